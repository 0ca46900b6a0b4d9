//! Technique `irradiance-probes`: a lattice of probes with octahedral maps of irradiance and of
//! the distances that they see (Majercik et al. 2019; Luo 2022, section 4.2).

use std::sync::Arc;

use glam::Vec3;

use super::borrowed::{AIM, Borrowed, MOMENTS_CAST, TAKE};
use super::field;
use super::figures;
use super::list::Listed;
use super::lookup::{Lookup, gather};
use super::mirror::{self, MIRROR, SPECULAR_RULES};
use super::passes::{
    BLEND, BLEND_SH, BOUNCE, EXPLORE, GATHER, GATHER_BY_RAYS, LIGHT, MOMENTS, MOMENTS_POWER,
    STRUCTS, SURFACES, TRACE,
};
use super::placement::Standing;
use super::prefiltered::{PREFILTER, REFLECT};
use super::raster::{MOMENTS_RASTER, MovedPast, RASTER, TRACE_RASTER};
use super::rays::{Lighting, MomentFilter, Moved, ProbeRays};
use super::reflection::{
    REFLECTION_RULES, REFLECTION_SETTINGS, ReflectionProbes, ReflectionSettings,
};
use super::schedule::{self, Schedule};
use super::settings::{
    KEPT_SETTINGS, LOOKUP_SETTINGS, PLACEMENT, PLACEMENT_RULES, PRESETS, RULES, SETTINGS,
};
use super::source::{SOURCE_RULES, SOURCE_SETTINGS, Source};
use super::view::{self, VIEW, VIEWS};
use super::volume::{Irradiance, Kept, Maps, Volume};
use super::voxels::{LIGHT_VOXELS, MOMENTS_VOXELS, TRACE_VOXELS};
use crate::gi::entry::{Directions, Entry, Stage};
use crate::gi::inspect::{BeamStart, ViewRow};
use crate::gi::shared::bounces::LightBounces;
use crate::gi::shared::interleave;
use crate::gi::shared::paths::{self, Mirrors, PathScene};
use crate::gi::shared::voxel;
use crate::gi::{
    CAST, Change, Context, Inputs, Inspect, MapNeeds, Needs, SettingError, Settings, Technique,
};
use crate::graph::{Error, Frame, FrameStats, Gpu, Image};
use crate::render::{GBuffer, GpuScene, Receivers};
use crate::scene::union;

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    bounces: |settings| LightBounces::new(settings).count(),
    frames_to_rest: schedule::frames_to_rest,
    check,
    borrows: true,
    settings: &[
        PLACEMENT,
        KEPT_SETTINGS,
        LOOKUP_SETTINGS,
        SETTINGS,
        SOURCE_SETTINGS,
        REFLECTION_SETTINGS,
        interleave::SPECULAR_SETTINGS,
    ],
    rules: &[
        PLACEMENT_RULES,
        RULES,
        SOURCE_RULES,
        SPECULAR_RULES,
        REFLECTION_RULES,
        interleave::SPECULAR_RULES,
    ],
    presets: PRESETS,
    passes: &[
        &[
            &EXPLORE,
            &TRACE,
            &SURFACES,
            &MOMENTS,
            &MOMENTS_POWER,
            &LIGHT,
            &BOUNCE,
            &BLEND,
            &BLEND_SH,
            &GATHER,
            &GATHER_BY_RAYS,
            &MIRROR,
            &VIEW,
            &TRACE_VOXELS,
            &MOMENTS_VOXELS,
            &LIGHT_VOXELS,
            &RASTER,
            &TRACE_RASTER,
            &MOMENTS_RASTER,
            &AIM,
            &TAKE,
            &MOMENTS_CAST,
            &field::TRACE,
            &field::LIGHT,
            &PREFILTER,
            &REFLECT,
        ],
        voxel::PASSES,
    ],
    views: &[&VIEWS],
    structs: &[paths::STRUCTS, voxel::STRUCTS, STRUCTS],
    stages: &[
        &Stage::store("hierarchy", paths::HOST_PASSES),
        &voxel::VOXELIZATION,
        &voxel::LIGHT_INJECTION,
        &Stage::store("casting", &["probes.aim", CAST, "probes.take"]),
        &Stage::store("placement", &["probes.explore"]),
        &Stage::store(
            "tracing",
            &[
                "probes.trace",
                "probes.surfaces",
                "probes.moments",
                "probes.moments_power",
                "probes.trace_voxels",
                "probes.moments_voxels",
                "probes.raster",
                "probes.trace_raster",
                "probes.moments_raster",
                "probes.moments_cast",
                "light_field.trace",
            ],
        ),
        &Stage::store(
            "lighting",
            &[
                "probes.light",
                "probes.light_voxels",
                "probes.blend",
                "probes.blend_sh",
                "light_field.light",
                "light_field.prefilter",
            ],
        ),
        &Stage::store("bounces", &["probes.bounce"]),
        &Stage::picture(
            "gather",
            &["probes.clear", "probes.gather", "probes.gather_by_rays"],
        ),
        &Stage::picture("specular", &["light_field.reflect", "probes.mirror"]),
    ],
    directions: &[Directions {
        pass: &MIRROR,
        count: None,
    }],
    ..Entry::new(
        "irradiance-probes",
        "a lattice of probes that know the irradiance of every direction and what they see",
        make,
    )
};

fn check(settings: &Settings) -> Result<(), SettingError> {
    schedule::check(settings)?;
    let borrows = settings.is("source", "store");
    let count = LightBounces::new(settings).count().unwrap_or(1);
    let wrong = if borrows && settings.is("gradient", "on") {
        Some("source=store, gradient=on: a store does not tell the surfaces; give gradient=off")
    } else if borrows && count > 4 {
        Some("source=store: light has at most 4 bounces there; give bounces=feedback, or 1 to 4")
    } else {
        None
    };
    wrong.map_or(Ok(()), |wrong| {
        Err(SettingError::Together(wrong.to_owned()))
    })
}

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    let (bounces, schedule) = (LightBounces::new(settings), Schedule::new(settings));
    let uses_maps = settings.is("hit_light", "maps");
    let casts = settings.is("source", "store");
    let mirrors = context.scene.is_glossy && settings.is("specular", "cones");
    let borrowed = Borrowed::new(context, settings, (casts, mirrors))?;
    let of_store = borrowed.as_ref().filter(|_| casts).map(Borrowed::lit);
    Ok(Box::new(IrradianceProbes {
        standing: Standing::new(settings),
        moment_filter: MomentFilter::new(settings),
        rays: settings.count("rays"),
        kept: Kept {
            irradiance: Irradiance::new(settings),
            moment_texels: settings
                .is("visibility", "moments")
                .then(|| settings.count("moment_texels")),
            has_gradients: settings.is("irradiance", "oct") && settings.is("gradient", "on"),
            bounces: of_store.unwrap_or_else(|| schedule.room(bounces)),
        },
        bounces,
        schedule,
        uses_maps,
        source: Source::new(context, settings, uses_maps)?,
        lookup: Lookup::new(settings),
        mirrors: Mirrors::new(context, settings, "probes.specular")?,
        reflections: ReflectionSettings::new(settings),
        borrowed,
        has_cones: mirrors,
        built: None,
    }))
}

struct Built {
    scene: PathScene,
    volume: Volume,
    /// Where the probes stand (m).
    places: Vec<Vec3>,
    rays: ProbeRays,
    /// What surfaces mirror without rays.
    reflections: Option<ReflectionProbes>,
    /// Where models that move were when rays were traced (m).
    models: Option<Moved>,
    /// Bounces that the probes' light has.
    lit: u32,
    /// That is the light of a store.
    is_cast: bool,
}

impl Built {
    /// The maps that have the light of the last frame.
    fn maps(&self) -> &Maps {
        self.volume.lit(self.lit)
    }

    /// What surfaces reflect of it towards surfaces that mirror them.
    fn reflected(&self, bounces: LightBounces) -> Option<&Maps> {
        match bounces {
            LightBounces::Count(1) => None,
            LightBounces::Count(_) if self.is_cast => Some(self.volume.lit(1)),
            LightBounces::Count(count) => Some(self.volume.lit(count - 1)),
            LightBounces::Feedback => Some(self.maps()),
        }
    }
}

struct IrradianceProbes {
    standing: Standing,
    moment_filter: MomentFilter,
    rays: u32,
    kept: Kept,
    bounces: LightBounces,
    schedule: Schedule,
    uses_maps: bool,
    source: Source,
    lookup: Lookup,
    mirrors: Option<Mirrors>,
    reflections: Option<ReflectionSettings>,
    borrowed: Option<Borrowed>,
    /// Surfaces mirror what is borrowed.
    has_cones: bool,
    built: Option<Built>,
}

impl IrradianceProbes {
    /// Puts the probes where the scene needs them as it is, and finds out what they see: all of it,
    /// or what has changed since models stood elsewhere. Where rays are traced in each frame, that
    /// is found out there.
    fn place(
        &self,
        &Context { gpu, scene, .. }: &Context<'_>,
        built: &mut Built,
    ) -> Result<FrameStats, Error> {
        let (triangles, how) = (&built.scene.rays, (self.rays, self.lookup.normal_bias));
        let stood = built.places.clone();
        let at = (&built.volume, &mut built.places);
        let stats = (self.standing).put((gpu, scene), triangles, at, how)?;
        let models = scene.dynamic.as_ref().map(|dynamic| dynamic.bounds);
        let before = std::mem::replace(&mut built.models, models);
        let moved = before.zip(models).map(|(before, now)| union(before, now));
        let mut frame = Frame::new();
        frame.set_scene(&scene.set, &scene.materials);
        if let Some(reflections) = &built.reflections {
            reflections.trace(&mut frame, &built.scene.rays, moved);
        }
        if !self.schedule.traces {
            let moved = moved.map(|bounds| MovedPast {
                bounds,
                places: [&built.places, &stood],
            });
            self.trace(&mut frame, scene, built, built.volume.listed(), moved);
        }
        gpu.enqueue(frame);
        Ok(stats)
    }

    /// Whether what rays are cast through changes with the camera.
    fn casts_around_camera(&self, built: &Built) -> bool {
        let borrowed = self.borrowed.as_ref().filter(|_| built.is_cast);
        borrowed.is_some_and(Borrowed::follows_camera)
    }

    /// Whether each frame makes all light anew, in which the frame before has no part.
    fn is_made_anew(&self) -> bool {
        let schedule = &self.schedule;
        self.bounces != LightBounces::Feedback && !schedule.traces && !schedule.is_gradual()
    }

    /// Adds the passes that find out what these probes see.
    fn trace(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        built: &Built,
        probes: Listed<'_>,
        moved: Option<MovedPast<'_>>,
    ) {
        let (through, of) = ((scene, &built.scene), (&built.volume, probes));
        let how = (self.moment_filter, moved, self.borrowed.as_ref());
        (self.source).trace(frame, through, &built.rays, of, how);
    }
}

impl Technique for IrradianceProbes {
    fn needs(&self) -> Needs {
        let own = match (self.source.voxels(), self.uses_maps) {
            (Some(_), true) => Needs::maps(MapNeeds::Reflective),
            (_, uses_maps) => paths::needs(uses_maps),
        };
        (self.borrowed.as_ref()).map_or(own, |borrowed| borrowed.needs(own))
    }

    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        self.built = None;
        let &Context { gpu, scene, .. } = context;
        let (own, mut stats) = PathScene::build(gpu, scene)?;
        if let Some(voxels) = self.source.voxels_mut() {
            stats.append(voxels.build(gpu, scene)?);
        }
        if let Some(borrowed) = &mut self.borrowed {
            stats.append(borrowed.build(context)?);
        }
        let lattice = self.standing.lattice(scene);
        let reflections = self.mirrors.as_ref().and(self.reflections);
        let mut built = Built {
            scene: own,
            reflections: reflections
                .map(|how| ReflectionProbes::new(gpu, how.lattice(scene.lit_bounds()), how))
                .transpose()?,
            volume: Volume::new(gpu, lattice, &self.kept)?,
            places: Vec::new(),
            rays: ProbeRays::new(gpu, lattice.probe_count(), self.rays)?,
            models: None,
            lit: 0,
            is_cast: matches!(self.source, Source::Store),
        };
        stats.append(self.place(context, &mut built)?);
        self.schedule.restart(gpu, lattice.probe_count())?;
        self.built = Some(built);
        Ok(stats)
    }

    fn follow(&mut self, context: &Context<'_>, change: Change) -> Result<FrameStats, Error> {
        if change == Change::Camera {
            self.schedule.advance(context.gpu)?;
        }
        let is_moved = change == Change::Models;
        if self.built.is_none() && is_moved {
            return self.build(context);
        }
        let mut stats = FrameStats::default();
        if let Some(borrowed) = &mut self.borrowed {
            stats.append(borrowed.follow(context, change)?);
        }
        let Some(mut built) = self.built.take_if(|_| is_moved) else {
            return Ok(stats);
        };
        stats.append(built.scene.follow(context.gpu, context.scene)?);
        if let Some(voxels) = self.source.voxels_mut() {
            stats.append(voxels.follow(context.gpu, context.scene)?);
        }
        stats.append(self.place(context, &mut built)?);
        self.built = Some(built);
        Ok(stats)
    }

    fn update(&mut self, frame: &mut Frame, given: &Inputs<'_>) {
        let Some(mut built) = self.built.take() else {
            return;
        };
        built.volume.forget_orphans(frame);
        if let Some(borrowed) = &mut self.borrowed {
            borrowed.update(frame, given);
        }
        if given.is_still && self.is_made_anew() && !self.casts_around_camera(&built) {
            self.built = Some(built);
            return;
        }
        if let Some(voxels) = self.source.voxels() {
            voxels.light(frame, given, &built.scene.rays);
        }
        let probes = self.schedule.probes(built.volume.listed());
        if self.schedule.traces {
            self.trace(frame, given.scene, &built, probes, None);
        }
        let bounces = self.schedule.bounces(self.bounces, built.lit);
        let cast = (self.borrowed.as_ref()).filter(|_| built.is_cast);
        if let Some(borrowed) = cast {
            let (volume, rays, kept) = (&built.volume, &built.rays, self.schedule.kept());
            borrowed.light(frame, rays, (volume, probes), |frame, part, maps| {
                rays.blend(frame, volume, part, [maps, maps], (false, kept));
            });
            built.lit = borrowed.lit();
        } else {
            let how = Lighting {
                lookup: &self.lookup,
                bounces: &bounces,
                uses_maps: self.uses_maps,
                kept: self.schedule.kept(),
                voxels: self.source.voxels(),
            };
            let of = (&built.volume, probes);
            built.rays.light(frame, given, &built.scene, of, how);
            built.lit = bounces.last().map_or(1, |[_, lit]| *lit);
        }
        if let Some(reflections) = &built.reflections {
            let of = (&built.volume, &self.lookup);
            let how = (built.reflected(self.bounces), self.uses_maps);
            reflections.light(frame, |frame, field| {
                field.light(frame, given, &built.scene, of, how);
            });
        }
        self.built = Some(built);
    }

    fn gather(&mut self, frame: &mut Frame, _given: &Inputs<'_>, receivers: &Receivers<'_>) {
        let Some(built) = &self.built else { return };
        let maps = built.maps();
        let of = (&built.volume, maps);
        gather(frame, receivers, &built.scene.rays, of, &self.lookup);
    }

    fn mirror(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> Option<Arc<Image>> {
        if let Some(borrowed) = self.borrowed.as_mut().filter(|_| self.has_cones) {
            return borrowed.mirror(frame, given);
        }
        let (built, mirrors) = (self.built.as_ref()?, self.mirrors.as_ref()?);
        let of = (&built.volume, &self.lookup);
        let left = built.reflections.is_some();
        if let Some(reflections) = &built.reflections {
            let to = (given.gbuffer.specular.as_ref()?, &mirrors.light);
            reflections.reflect(frame, given, &built.scene.rays, to);
        }
        let how = (built.reflected(self.bounces), self.uses_maps, left);
        mirror::mirror(frame, given, mirrors, &built.scene, of, how)
    }
}

impl Inspect for IrradianceProbes {
    fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let Some(built) = &self.built else {
            return Ok(Vec::new());
        };
        let mut counts = built.scene.counts();
        if let Some(voxels) = self.source.voxels() {
            counts.extend(voxels.counts(gpu)?);
        }
        if let Some(borrowed) = &self.borrowed {
            counts.extend(borrowed.counts(gpu)?);
        }
        counts.push(("probes", built.volume.lattice.probe_count().into()));
        counts.push(built.volume.count_orphans(gpu)?);
        Ok(counts)
    }

    fn levels(&self, view: &ViewRow) -> u32 {
        let volume = self.built.as_ref().map(|built| &built.volume);
        u32::from(volume.is_some_and(|volume| view::is_there(view, volume)))
    }

    fn draw_view(
        &self,
        frame: &mut Frame,
        (view, _level): (&ViewRow, u32),
        gbuffer: &GBuffer,
        seen: &Arc<Image>,
    ) {
        let Some(built) = &self.built else { return };
        let maps = built.maps();
        let of = (&built.volume, maps, &self.lookup);
        view::draw(frame, view, of, (gbuffer, seen));
    }

    fn figures_at(
        &self,
        context: &Context<'_>,
        start: &BeamStart,
    ) -> Result<Vec<(&'static str, String)>, Error> {
        let Some(built) = &self.built else {
            return Ok(Vec::new());
        };
        let maps = built.maps();
        let of = (&built.volume, maps, &self.lookup);
        figures::figures(context.gpu, of, start)
    }
}
