//! Technique `probe-cascades`: nested lattices of probes around the camera, of which those are kept
//! that some surface looks up, and a stated number is traced and lit in a frame (Majercik et al.
//! 2021, section 6; Godot's HDDAGI).

mod entry;
pub mod layout;
pub mod need;
pub mod passes;
pub mod place;
pub mod pool;
mod reflections;
mod settings;
pub mod store;
mod work;

pub use entry::ENTRY;

use std::sync::Arc;

use super::borrowed::Borrowed;
use super::lookup::{Lookup, Visibility};
use super::mirror::parts_of;
use super::rays::{MomentFilter, Moved};
use super::reflection::ReflectionSettings;
use super::view::{self, LEVEL_VIEWS};
use super::volume::{Irradiance, Kept, Maps};
use crate::gi::inspect::ViewRow;
use crate::gi::shared::bounces::LightBounces;
use crate::gi::shared::paths::{self, Mirrors, PathScene};
use crate::gi::{Change, Context, Inputs, Inspect, Needs, Settings, Technique};
use crate::graph::compute::linear_groups;
use crate::graph::{Error, Frame, FrameStats, Gpu, Image};
use crate::render::{GBuffer, GpuScene, Receivers, screen_groups};
use crate::scene::union;
use layout::{Layout, Window};
use passes::{BOUNCE, LevelBounceParams, LevelMirrorParams, LevelViewParams, MIRROR, VIEW};
use place::place;
use reflections::Reflections;
use store::Store;
use work::{Pace, Work};

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    let bounces = LightBounces::new(settings);
    let casts = settings.is("source", "store");
    let has_cones = context.scene.is_glossy && settings.is("specular", "cones");
    let borrowed = Borrowed::new(context, settings, (casts, has_cones))?;
    let of_store = borrowed.as_ref().filter(|_| casts).map(Borrowed::lit);
    Ok(Box::new(ProbeCascades {
        layout: Layout::new(
            context.scene.lit_bounds(),
            settings.count("probes"),
            settings.count("levels"),
            settings.number("spacing"),
        ),
        surface_distance: settings.number("surface_distance"),
        pace: Pace {
            per_frame: settings.count("probes_per_frame"),
            bounces,
            is_cast: casts,
        },
        rays: settings.count("rays"),
        moment_filter: MomentFilter::new(settings),
        kept: Kept {
            irradiance: Irradiance::new(settings),
            moment_texels: Some(settings.count("moment_texels")),
            has_gradients: false,
            bounces: of_store.unwrap_or(1 + u32::from(bounces.any())),
        },
        uses_maps: settings.is("hit_light", "maps"),
        lookup: Lookup {
            visibility: Visibility::Moments,
            normal_bias: settings.number("normal_bias"),
            weight_floor: settings.number("weight_floor"),
            crush: settings.number("crush"),
            rings: 2,
        },
        mirrors: Mirrors::new(context, settings, "cascades.specular")?,
        reflections: ReflectionSettings::new(settings),
        borrowed,
        has_cones,
        built: None,
    }))
}

struct ProbeCascades {
    layout: Layout,
    /// How far off surfaces probes are moved (spacings).
    surface_distance: f32,
    pace: Pace,
    rays: u32,
    moment_filter: MomentFilter,
    kept: Kept,
    uses_maps: bool,
    lookup: Lookup,
    mirrors: Option<Mirrors>,
    reflections: Option<ReflectionSettings>,
    borrowed: Option<Borrowed>,
    /// Surfaces mirror what is borrowed.
    has_cones: bool,
    built: Option<Built>,
}

struct Built {
    scene: PathScene,
    store: Store,
    windows: Vec<Window>,
    /// What surfaces mirror without rays.
    reflections: Option<Reflections>,
    /// Where models that move are (m).
    models: Option<Moved>,
    /// The box in which models have moved since the last frame (m).
    moved: Option<Moved>,
    work: Work,
    /// Probes have come or gone since the last frame.
    has_others: bool,
    /// Probes to be lit, in turn, until all have the light of the scene as it is.
    owed: u32,
}

impl ProbeCascades {
    /// Holds the probes that surfaces need around a camera at `eye` (m), in a larger store where
    /// there is no room for them.
    fn hold(
        &self,
        &Context {
            gpu, scene, eye, ..
        }: &Context<'_>,
        store: Option<Store>,
    ) -> Result<(Store, Vec<Window>, FrameStats), Error> {
        let windows = self.layout.windows(eye);
        let (needed, stats) = need::needed(gpu, scene, &windows, self.lookup.normal_bias)?;
        let count = needed.len() as u32;
        let mut store = match store {
            Some(store) if store.pool.room() >= count => store,
            Some(store) => store.grown(gpu, &self.kept, &windows, count)?,
            None => Store::new(gpu, (&self.kept, self.rays), &windows, count)?,
        };
        store.pool.hold(&needed);
        store.look_up_by(gpu, &self.lookup, &windows)?;
        Ok((store, windows, stats))
    }

    /// The maps that have all light.
    fn maps<'s>(&self, store: &'s Store) -> &'s Maps {
        store.volume().lit(self.kept.bounces)
    }

    /// What surfaces reflect of the probes' light towards surfaces that mirror them: a bounce less
    /// than those that look probes up.
    fn reflected<'s>(&self, store: &'s Store) -> Option<&'s Maps> {
        match self.pace.bounces {
            LightBounces::Count(1) => None,
            LightBounces::Count(_) => Some(store.volume().lit(1)),
            LightBounces::Feedback => Some(self.maps(store)),
        }
    }

    /// Leaves out what would not change: once all probes have the light of a scene that is still,
    /// only new ones are lit.
    fn settle(&self, built: &mut Built, is_still: bool) {
        let camera_matters = match self.cast_through() {
            Some(borrowed) => borrowed.follows_camera(),
            // Light of a second bounce comes from probes that may be others now.
            None => built.has_others && self.pace.bounces != LightBounces::Count(1),
        };
        let Built { work, store, .. } = built;
        let is_fed_back =
            self.cast_through().is_none() && self.pace.bounces == LightBounces::Feedback;
        let new: u32 = work.new.iter().sum();
        if is_fed_back || !is_still || work.moved.is_some() || camera_matters {
            // Where probes have turns, the second bounce of the first is of others without theirs.
            let turns = if self.pace.per_frame == 0 {
                1
            } else {
                self.kept.bounces
            };
            built.owed = turns * store.pool.held();
        } else if built.owed == 0 {
            work.again = 0;
            work.rounds *= u32::from(new > 0);
        }
        built.owed = built.owed.saturating_sub(new + work.again);
    }

    /// Adds the passes that put new probes where they stand, and find out what they see.
    fn find_out(&self, frame: &mut Frame, scene: &GpuScene, built: &Built) {
        let Built {
            store,
            work,
            scene: paths,
            ..
        } = built;
        let buffers = [&store.homes, &store.volume().places];
        let parts = [
            (0, &work.kept, work.moved),
            (work.kept.iter().sum(), &work.new, None),
        ];
        for (first, counts, moved) in parts {
            let all = store.list.part(first, counts.iter().sum());
            let how = (self.surface_distance, moved);
            place(frame, &paths.rays, &store.rays, all, buffers, how);
            for (volume, part) in store.of_levels(first, counts) {
                let of = (volume, part);
                if let Some(borrowed) = self.cast_through() {
                    let how = (self.moment_filter, moved);
                    borrowed.moments(frame, (&store.rays, &paths.rays), of, how);
                    continue;
                }
                (store.rays).trace(frame, (scene, paths), volume, part, moved);
                (store.rays).moments(frame, &paths.rays, of, self.moment_filter, moved);
            }
        }
    }

    /// What probes see, where that is borrowed.
    fn cast_through(&self) -> Option<&Borrowed> {
        self.borrowed.as_ref().filter(|_| self.pace.is_cast)
    }

    /// Adds the passes that light probes, new ones and others.
    fn light(&self, frame: &mut Frame, given: &Inputs<'_>, built: &Built) {
        let Built {
            store,
            work,
            scene: paths,
            ..
        } = built;
        let (rays, volume) = (&store.rays, store.volume());
        let [kept, new] = [&work.kept, &work.new].map(|of_levels| of_levels.iter().sum::<u32>());
        let (lit, end_of_new) = (store.list.part(kept, new + work.again), kept + new);
        let (first, all) = (volume.lit(1), self.maps(store));
        if let Some(borrowed) = self.cast_through() {
            borrowed.light(frame, rays, (volume, lit), |frame, part, maps| {
                rays.blend(frame, volume, part, [maps, maps], (false, 0.0));
            });
            return;
        }
        for part in rays.parts(lit) {
            rays.straight(frame, given, paths, (volume, part), self.uses_maps);
            rays.blend(frame, volume, part, [first, first], (false, 0.0));
            // What others see of new probes is never what was in their place before.
            let new = end_of_new.saturating_sub(part.first).min(part.count);
            if self.pace.bounces.any() && new > 0 {
                let new = store.list.part(part.first, new);
                rays.blend(frame, volume, new, [first, all], (false, 0.0));
            }
        }
        let fed_back = match self.pace.bounces {
            LightBounces::Count(_) => first,
            LightBounces::Feedback => all,
        };
        for part in (0..work.rounds).flat_map(|_| rays.parts(lit)) {
            let pass = paths.bind(part.bind(frame.pass(&BOUNCE)), given, false);
            rays.bind(store.bind(pass, &self.lookup, fed_back))
                .push(&LevelBounceParams {
                    level_count: store.levels.len() as u32,
                    ray_count: self.rays,
                    first_probe: part.first,
                    all: part.count * self.rays,
                })
                .dispatch(linear_groups(part.count * self.rays));
            rays.blend(frame, volume, part, [first, all], (true, 0.0));
        }
    }
}

impl Technique for ProbeCascades {
    fn needs(&self) -> Needs {
        let own = paths::needs(self.uses_maps);
        (self.borrowed.as_ref()).map_or(own, |borrowed| borrowed.needs(own))
    }

    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        self.built = None;
        let &Context {
            gpu, scene, eye, ..
        } = context;
        let (own, mut stats) = PathScene::build(gpu, scene)?;
        if let Some(borrowed) = &mut self.borrowed {
            stats.append(borrowed.build(context)?);
        }
        let (store, windows, held) = self.hold(context, None)?;
        stats.append(held);
        let reflections = self.mirrors.as_ref().and(self.reflections);
        self.built = Some(Built {
            reflections: reflections
                .map(|how| Reflections::new(gpu, &self.layout, eye, how))
                .transpose()?,
            scene: own,
            store,
            windows,
            models: scene.dynamic.as_ref().map(|dynamic| dynamic.bounds),
            moved: None,
            work: Work::default(),
            has_others: true,
            owed: 0,
        });
        Ok(stats)
    }

    fn follow(&mut self, context: &Context<'_>, change: Change) -> Result<FrameStats, Error> {
        let Some(mut built) = self.built.take() else {
            return self.build(context);
        };
        let &Context {
            gpu, scene, eye, ..
        } = context;
        let mut stats = FrameStats::default();
        if let Some(borrowed) = &mut self.borrowed {
            stats.append(borrowed.follow(context, change)?);
        }
        if change == Change::Models {
            stats.append(built.scene.follow(gpu, scene)?);
            let models = scene.dynamic.as_ref().map(|dynamic| dynamic.bounds);
            let before = std::mem::replace(&mut built.models, models);
            let boxes = [before, models, built.moved].into_iter().flatten();
            built.moved = boxes.reduce(union);
        }
        if change == Change::Camera {
            let has_moved = built.moved.is_some() || self.layout.windows(eye) != built.windows;
            if has_moved {
                let (store, windows, held) = self.hold(context, Some(built.store))?;
                stats.append(held);
                (built.store, built.windows) = (store, windows);
            }
            built.has_others = has_moved;
            if let Some(reflections) = &mut built.reflections {
                reflections.follow(gpu, eye)?;
            }
            let of = (&mut built.store, &built.windows[..]);
            let moved = (built.moved.take(), has_moved);
            built.work = self.pace.advance(gpu, of, moved)?;
        }
        self.built = Some(built);
        Ok(stats)
    }

    fn update(&mut self, frame: &mut Frame, given: &Inputs<'_>) {
        let Some(mut built) = self.built.take() else {
            return;
        };
        built.store.volume().forget_orphans(frame);
        if let Some(borrowed) = &mut self.borrowed {
            borrowed.update(frame, given);
        }
        self.find_out(frame, given.scene, &built);
        self.settle(&mut built, given.is_still);
        self.light(frame, given, &built);
        if let Some(reflections) = &mut built.reflections {
            let sees_else = reflections.trace(frame, &built.scene.rays, built.work.moved);
            if sees_else || built.work.lights() {
                let store = (&built.store, &self.lookup);
                let (scene, reflected) =
                    ((&built.scene, self.uses_maps), self.reflected(&built.store));
                reflections.light(frame, given, scene, store, reflected);
            }
        }
        self.built = Some(built);
    }

    fn gather(&mut self, frame: &mut Frame, _given: &Inputs<'_>, receivers: &Receivers<'_>) {
        let Some(Built { store, .. }) = &self.built else {
            return;
        };
        store.gather(frame, receivers, &self.lookup, self.maps(store));
    }

    fn mirror(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> Option<Arc<Image>> {
        if let Some(borrowed) = self.borrowed.as_mut().filter(|_| self.has_cones) {
            return borrowed.mirror(frame, given);
        }
        let (built, mirrors) = (self.built.as_ref()?, self.mirrors.as_ref()?);
        let (store, specular) = (&built.store, given.gbuffer.specular.as_ref()?);
        if let Some(reflections) = &built.reflections {
            let to = (specular, &mirrors.light);
            (reflections.probes).reflect(frame, given, &built.scene.rays, to);
        }
        let reflected = self.reflected(store);
        // Without light to reflect any maps are bound, and not read.
        let maps = reflected.unwrap_or(store.volume().lit(1));
        for [first_ray, end_ray] in parts_of(mirrors, given.scene, self.uses_maps) {
            let pass = (built.scene).bind(frame.pass(&MIRROR), given, self.uses_maps);
            (store.bind(
                mirrors.bind(pass, given.gbuffer, specular),
                &self.lookup,
                maps,
            ))
            .constant("MIRRORS_LEFT", built.reflections.is_some())
            .push(&LevelMirrorParams {
                level_count: store.levels.len() as u32,
                ray_count: mirrors.rays,
                first_ray,
                end_ray,
                pattern: mirrors.pattern.bits(),
                has_light: u32::from(reflected.is_some()),
            })
            .dispatch(screen_groups(given.gbuffer.size));
        }
        Some(Arc::clone(&mirrors.light))
    }
}

impl Inspect for ProbeCascades {
    fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let Some(built) = &self.built else {
            return Ok(Vec::new());
        };
        let mut counts = built.scene.counts();
        if let Some(borrowed) = &self.borrowed {
            counts.extend(borrowed.counts(gpu)?);
        }
        counts.push(("probes", built.store.pool.held().into()));
        counts.push(("probe_room", built.store.pool.room().into()));
        counts.push(built.store.volume().count_orphans(gpu)?);
        Ok(counts)
    }

    fn cell_size(&self) -> Option<f32> {
        Some(self.layout.finest)
    }

    fn levels(&self, view: &ViewRow) -> u32 {
        if LEVEL_VIEWS.contains(view) {
            self.layout.levels
        } else {
            0
        }
    }

    fn draw_view(
        &self,
        frame: &mut Frame,
        (view, level): (&ViewRow, u32),
        gbuffer: &GBuffer,
        seen: &Arc<Image>,
    ) {
        let Some(Built { store, .. }) = &self.built else {
            return;
        };
        let Some(volume) = store.levels.get(level as usize) else {
            return;
        };
        let [width, height, _] = seen.extent(0);
        let pass = frame
            .pass(&VIEW)
            .bind("view_depth", &gbuffer.view_depth)
            .bind("normals", &gbuffer.normals)
            .bind("seen", seen);
        store
            .bind(pass, &self.lookup, self.maps(store))
            .push(&LevelViewParams {
                radius_m: view::RADIUS * volume.lattice.cell(),
                reach: volume.reach(),
                view: view::index_of(view),
                level,
                level_count: store.levels.len() as u32,
            })
            .dispatch(screen_groups([width, height]));
    }
}
