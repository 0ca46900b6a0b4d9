//! The store of another technique, as what probes see and as what surfaces mirror by cones.

use std::sync::Arc;

use super::list::{LIST_BINDING, Listed};
use super::passes::{MomentParams, RayParams};
use super::rays::{MomentFilter, Moved, ProbeRays, corners, widened};
use super::volume::{Maps, Volume, buffer};
use crate::gi::settings::{Domain, Setting};
use crate::gi::shared::bounces::LightBounces;
use crate::gi::{
    CastRays, Change, Context, Inputs, MapNeeds, Needs, Settings, StoreKind, Technique, Wanted,
};
use crate::gpu_struct;
use crate::graph::compute::linear_groups;
use crate::graph::{
    Access, Binding, Buffer, Error, Frame, FrameStats, Gpu, Image, Pass, Sets, Shaders,
};
use crate::render::bvh::SceneRays;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `probes.aim`.
    pub struct AimParams {
        /// xyz: smallest corner of the box in which something has moved (m).
        pub low: [f32; 4],
        /// xyz: its largest corner (m).
        pub high: [f32; 4],
        /// Rays of a probe.
        pub ray_count: u32,
        /// First of the list.
        pub first_probe: u32,
        /// Rays of those from there on.
        pub all: u32,
        /// Edge of a map of distances (texels) whose texels have rays; 0: those of the set.
        pub edge: u32,
        /// The smallest spacing (m).
        pub cell_m: f32,
        /// The farthest that a probe sees (cells).
        pub reach: f32,
    }
}

/// What kind of store that is.
pub(super) const STORE: Setting = Setting {
    name: "store",
    help: "how the store divides space that is borrowed of another technique: dense, into equal \
           voxels, sparse, where surfaces are, or nested, into larger ones farther from the camera",
    unit: "",
    domain: Domain::Choice(&StoreKind::NAMES),
    default: StoreKind::Dense.name(),
};

/// How fine it is, or the probes' own voxels.
pub(super) const SOURCE_RESOLUTION: Setting = Setting {
    name: "source_resolution",
    help: "voxels along the largest extent of the scene",
    unit: "voxels",
    domain: Domain::OneOf(&[8, 16, 32, 64, 128, 256, 512]),
    default: "128",
};

/// The rays of some probes. Reads places, writes rays; a thread a ray.
pub static AIM: Pass = Pass {
    name: "probes.aim",
    shaders: Shaders::Compute("gi/probes/aim.comp"),
    bindings: &[
        Binding::buffer("probe_places", Access::ComputeRead),
        Binding::sampled("ray_set", Access::ComputeSampled),
        Binding::buffer("cast_rays", Access::ComputeWrite),
        LIST_BINDING,
    ],
    constants: &["KEEPS"],
    params: Some(AimParams::LAYOUT),
    sets: Sets::Scene,
};

/// What those bring. Reads hits, writes RGBA32UI and RGBA32F; a thread a ray.
pub static TAKE: Pass = Pass {
    name: "probes.take",
    shaders: Shaders::Compute("gi/probes/take.comp"),
    bindings: &[
        Binding::buffer("cast_hits", Access::ComputeRead),
        Binding::image("ray_hits", Access::ComputeWrite),
        Binding::image("ray_light", Access::ComputeWrite),
        LIST_BINDING,
    ],
    constants: &[],
    params: Some(RayParams::LAYOUT),
    sets: Sets::Scene,
};

/// Mean and mean square of the distance that a probe sees through the store, by direction, where
/// that may have changed. Reads hits, writes RG16F; a thread a texel.
pub static MOMENTS_CAST: Pass = Pass {
    name: "probes.moments_cast",
    shaders: Shaders::Compute("gi/probes/moments_cast.comp"),
    bindings: &[
        Binding::buffer("cast_hits", Access::ComputeRead),
        Binding::image("probe_moments", Access::ComputeWrite),
        Binding::buffer("probe_places", Access::ComputeRead),
        LIST_BINDING,
    ],
    constants: &["KEEPS"],
    params: Some(MomentParams::LAYOUT),
    sets: Sets::Scene,
};

/// Rays of a texel of a map of distances (`gi/probes/moment_rays.glsl`).
const RAYS_OF_TEXEL: u32 = 4;

/// Rays that are cast at a time, but for one probe that has more.
const RAYS_AT_A_TIME: u32 = 1 << 18;

/// A store that another technique lends.
pub(super) struct Borrowed {
    technique: Box<dyn Technique>,
    /// Such a store with a bounce less, where rays mirror: what they hit has one less behind it.
    behind: Option<Box<dyn Technique>>,
    /// Rays, and what they bring.
    room: [Arc<Buffer>; 2],
    /// Rays that there is room for.
    at_a_time: u32,
    /// Whether it holds something else where the camera moves.
    follows_camera: bool,
}

impl Borrowed {
    /// As the settings say. `casts`: probes see through it; `mirrors`: surfaces mirror by its
    /// cones. None where neither is wanted.
    pub(super) fn new(
        context: &Context<'_>,
        settings: &Settings,
        (casts, mirrors): (bool, bool),
    ) -> Result<Option<Self>, Error> {
        if !casts && !mirrors {
            return Ok(None);
        }
        let named = |kind: &StoreKind| settings.is(STORE.name, kind.name());
        let kind = StoreKind::ALL.into_iter().find(named);
        let wanted = Wanted {
            kind: kind.unwrap_or(StoreKind::Dense),
            resolution: settings.count(SOURCE_RESOLUTION.name),
            bounces: settings.choice("bounces").to_owned(),
            casts,
            mirrors,
        };
        let technique = (context.lend)(context, &wanted)?;
        let fewer = Borrowed::bounces_behind(context, settings, casts);
        let behind = fewer.map(|fewer| {
            let wanted = Wanted {
                bounces: fewer.to_string(),
                mirrors: false,
                ..wanted.clone()
            };
            (context.lend)(context, &wanted)
        });
        let at_a_time = if casts {
            let moment_texels = settings.count("moment_texels");
            let of_texels = RAYS_OF_TEXEL * moment_texels * moment_texels;
            of_texels.max(settings.count("rays")).max(RAYS_AT_A_TIME)
        } else {
            1
        };
        let room = |name: &str, bytes: u64| buffer(context.gpu, name, bytes * u64::from(at_a_time));
        Ok(Some(Borrowed {
            technique,
            behind: behind.transpose()?,
            room: [room("probes.cast_rays", 32)?, room("probes.cast_hits", 16)?],
            at_a_time,
            follows_camera: wanted.kind == StoreKind::Nested,
        }))
    }

    /// Bounces that what rays of surfaces hit has behind it, where those need a store of their own.
    fn bounces_behind(context: &Context<'_>, settings: &Settings, casts: bool) -> Option<u32> {
        let by_rays = settings.is("specular", "rays") || settings.is("specular", "prefiltered");
        match LightBounces::new(settings) {
            LightBounces::Count(count) if casts && by_rays && context.scene.is_glossy => {
                count.checked_sub(1).filter(|fewer| *fewer > 0)
            }
            _ => None,
        }
    }

    /// Bounces for which probes have maps: 2 where the first are for what surfaces mirror.
    pub(super) fn lit(&self) -> u32 {
        1 + u32::from(self.behind.is_some())
    }

    /// Whether it holds something else where the camera moves.
    pub(super) fn follows_camera(&self) -> bool {
        self.follows_camera
    }

    /// The stores, and the maps that have the light of each.
    fn stores<'s>(
        &'s self,
        volume: &'s Volume,
    ) -> impl Iterator<Item = (&'s dyn Technique, &'s Maps)> {
        let behind = (self.behind.as_deref()).map(|behind| (behind, volume.lit(1)));
        let own: &dyn Technique = &*self.technique;
        behind.into_iter().chain([(own, volume.lit(self.lit()))])
    }

    fn all_mut(&mut self) -> impl Iterator<Item = &mut Box<dyn Technique>> {
        [&mut self.technique].into_iter().chain(&mut self.behind)
    }

    /// What its technique reads, and what `own` tells.
    pub(super) fn needs(&self, own: Needs) -> Needs {
        let of_store = self.technique.needs();
        Needs {
            maps: of_store.maps.max(own.maps),
            motion: of_store.motion || own.motion,
            // What the borrower reads may be finer than what the store has use for.
            rsm_size: of_store
                .rsm_size
                .filter(|_| own.maps != MapNeeds::Reflective),
        }
    }

    /// Builds it.
    pub(super) fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        let mut stats = FrameStats::default();
        for technique in self.all_mut() {
            stats.append(technique.build(context)?);
        }
        Ok(stats)
    }

    /// Brings it up to a change.
    pub(super) fn follow(
        &mut self,
        context: &Context<'_>,
        change: Change,
    ) -> Result<FrameStats, Error> {
        let mut stats = FrameStats::default();
        for technique in self.all_mut() {
            stats.append(technique.follow(context, change)?);
        }
        Ok(stats)
    }

    /// Adds the passes that bring it up to this frame's light.
    pub(super) fn update(&mut self, frame: &mut Frame, given: &Inputs<'_>) {
        for technique in self.all_mut() {
            technique.update(frame, given);
        }
    }

    /// Adds the passes by which surfaces mirror what is in it.
    pub(super) fn mirror(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> Option<Arc<Image>> {
        self.technique.mirror(frame, given)
    }

    /// Its counts, by name.
    pub(super) fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        self.technique.counts(gpu)
    }

    /// Casts through a store `of_probe` rays of each of these probes, of a map's texels where it
    /// has an `edge`, and adds with each part of the probes what makes something of the hits.
    fn cast(
        &self,
        (frame, technique): (&mut Frame, &dyn Technique),
        rays: &ProbeRays,
        (volume, probes): (&Volume, Listed<'_>),
        (of_probe, edge, changed): (u32, u32, Option<Moved>),
        mut then: impl FnMut(&mut Frame, Listed<'_>),
    ) {
        let [cast_rays, cast_hits] = &self.room;
        let [low, high] = corners(changed);
        for part in probes.parts((self.at_a_time / of_probe).max(1)) {
            let all = part.count * of_probe;
            (part.bind(frame.pass(&AIM)))
                .bind("probe_places", &volume.places)
                .bind("ray_set", &rays.set)
                .bind("cast_rays", cast_rays)
                .constant("KEEPS", changed.is_some())
                .push(&AimParams {
                    low,
                    high,
                    ray_count: of_probe,
                    first_probe: part.first,
                    all,
                    edge,
                    cell_m: volume.lattice.cell(),
                    reach: volume.reach(),
                })
                .dispatch(linear_groups(all));
            let cast = CastRays {
                rays: cast_rays,
                hits: cast_hits,
                count: all,
                of_family: of_probe,
            };
            technique.cast(frame, cast);
            then(frame, part);
        }
    }

    /// Adds the pass that takes what all rays of these probes have brought.
    fn take(&self, frame: &mut Frame, rays: &ProbeRays, probes: Listed<'_>) {
        let all = probes.count * rays.count;
        (rays.bind_written(probes.bind(frame.pass(&TAKE))))
            .bind("cast_hits", &self.room[1])
            .push(&RayParams {
                ray_count: rays.count,
                first_probe: probes.first,
                all,
            })
            .dispatch(linear_groups(all));
    }

    /// Adds the passes that find out what rays of these probes bring; `then` adds what blends that
    /// light of a part of them into these maps.
    pub(super) fn light(
        &self,
        frame: &mut Frame,
        rays: &ProbeRays,
        of: (&Volume, Listed<'_>),
        mut then: impl FnMut(&mut Frame, Listed<'_>, &Maps),
    ) {
        for (technique, maps) in self.stores(of.0) {
            let cast = (rays.count, 0, None);
            self.cast((frame, technique), rays, of, cast, |frame, part| {
                self.take(frame, rays, part);
                then(frame, part, maps);
            });
        }
    }

    /// Adds the passes that find out how far these probes see, where look-ups ask for it. With a
    /// box in which models have moved (m), texels keep what that cannot have changed, where each
    /// has rays of its own.
    pub(super) fn moments(
        &self,
        frame: &mut Frame,
        (rays, triangles): (&ProbeRays, &SceneRays),
        of: (&Volume, Listed<'_>),
        (filter, moved): (MomentFilter, Option<Moved>),
    ) {
        let (volume, _) = of;
        if !volume.has_moments {
            return;
        }
        let through = &*self.technique;
        if filter == MomentFilter::Power {
            let cast = (rays.count, 0, None);
            self.cast((frame, through), rays, of, cast, |frame, part| {
                self.take(frame, rays, part);
                rays.moments(frame, triangles, (volume, part), filter, None);
            });
            return;
        }
        let edge = volume.moment_texels;
        let changed = moved.and_then(|moved| widened(moved, self.technique.cast_margin()));
        let how = (RAYS_OF_TEXEL * edge * edge, edge, changed);
        self.cast((frame, through), rays, of, how, |frame, part| {
            let params = rays.moment_params(volume, part, changed);
            (part.bind(frame.pass(&MOMENTS_CAST)))
                .bind("cast_hits", &self.room[1])
                .bind("probe_moments", &volume.moments)
                .bind("probe_places", &volume.places)
                .constant("KEEPS", changed.is_some())
                .push(&params)
                .dispatch(linear_groups(params.all));
        });
    }
}
