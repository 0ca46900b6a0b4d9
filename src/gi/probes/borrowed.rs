//! The store of another technique, as what probes see and as what surfaces mirror by cones.

use std::sync::Arc;

use super::list::{LIST_BINDING, Listed};
use super::passes::{MomentParams, RayParams};
use super::rays::{MomentFilter, ProbeRays};
use super::volume::{Volume, buffer};
use crate::gi::settings::{Domain, Setting};
use crate::gi::{CastRays, Change, Context, Inputs, Needs, Settings, StoreKind, Technique, Wanted};
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
        /// Rays of a probe.
        pub ray_count: u32,
        /// First of the list.
        pub first_probe: u32,
        /// Rays of those from there on.
        pub all: u32,
        /// Edge of a map of distances (texels) whose texels have rays; 0: those of the set.
        pub edge: u32,
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
    constants: &[],
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

/// Mean and mean square of the distance that a probe sees through the store, by direction. Reads
/// hits, writes RG16F; a thread a texel.
pub static MOMENTS_CAST: Pass = Pass {
    name: "probes.moments_cast",
    shaders: Shaders::Compute("gi/probes/moments_cast.comp"),
    bindings: &[
        Binding::buffer("cast_hits", Access::ComputeRead),
        Binding::image("probe_moments", Access::ComputeWrite),
        LIST_BINDING,
    ],
    constants: &[],
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
    /// Rays, and what they bring.
    room: [Arc<Buffer>; 2],
    /// Rays that there is room for.
    at_a_time: u32,
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
        let moment_texels = settings.count("moment_texels");
        let of_probe = (settings.count("rays")).max(RAYS_OF_TEXEL * moment_texels * moment_texels);
        let at_a_time = if casts {
            of_probe.max(RAYS_AT_A_TIME)
        } else {
            1
        };
        let room = |name: &str, bytes: u64| buffer(context.gpu, name, bytes * u64::from(at_a_time));
        Ok(Some(Borrowed {
            technique,
            room: [room("probes.cast_rays", 32)?, room("probes.cast_hits", 16)?],
            at_a_time,
        }))
    }

    /// What its technique reads, and what `own` tells.
    pub(super) fn needs(&self, own: Needs) -> Needs {
        let of_store = self.technique.needs();
        Needs {
            maps: of_store.maps.max(own.maps),
            motion: of_store.motion || own.motion,
        }
    }

    /// Builds it.
    pub(super) fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        self.technique.build(context)
    }

    /// Brings it up to a change.
    pub(super) fn follow(
        &mut self,
        context: &Context<'_>,
        change: Change,
    ) -> Result<FrameStats, Error> {
        self.technique.follow(context, change)
    }

    /// Adds the passes that bring it up to this frame's light.
    pub(super) fn update(&mut self, frame: &mut Frame, given: &Inputs<'_>) {
        self.technique.update(frame, given);
    }

    /// Adds the passes by which surfaces mirror what is in it.
    pub(super) fn mirror(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> Option<Arc<Image>> {
        self.technique.mirror(frame, given)
    }

    /// Its counts, by name.
    pub(super) fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        self.technique.counts(gpu)
    }

    /// Casts `of_probe` rays of each of these probes, of a map's texels where it has an `edge`, and
    /// adds with each part of the probes what makes something of the hits.
    fn cast(
        &self,
        frame: &mut Frame,
        rays: &ProbeRays,
        (volume, probes): (&Volume, Listed<'_>),
        (of_probe, edge): (u32, u32),
        mut then: impl FnMut(&mut Frame, Listed<'_>),
    ) {
        let [cast_rays, cast_hits] = &self.room;
        for part in probes.parts((self.at_a_time / of_probe).max(1)) {
            let all = part.count * of_probe;
            (part.bind(frame.pass(&AIM)))
                .bind("probe_places", &volume.places)
                .bind("ray_set", &rays.set)
                .bind("cast_rays", cast_rays)
                .push(&AimParams {
                    ray_count: of_probe,
                    first_probe: part.first,
                    all,
                    edge,
                })
                .dispatch(linear_groups(all));
            let cast = CastRays {
                rays: cast_rays,
                hits: cast_hits,
                count: all,
            };
            self.technique.cast(frame, cast);
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
    /// light of a part of them.
    pub(super) fn light(
        &self,
        frame: &mut Frame,
        rays: &ProbeRays,
        of: (&Volume, Listed<'_>),
        mut then: impl FnMut(&mut Frame, Listed<'_>),
    ) {
        self.cast(frame, rays, of, (rays.count, 0), |frame, part| {
            self.take(frame, rays, part);
            then(frame, part);
        });
    }

    /// Adds the passes that find out how far these probes see, where look-ups ask for it.
    pub(super) fn moments(
        &self,
        frame: &mut Frame,
        (rays, triangles): (&ProbeRays, &SceneRays),
        of: (&Volume, Listed<'_>),
        filter: MomentFilter,
    ) {
        let (volume, _) = of;
        if !volume.has_moments {
            return;
        }
        if filter == MomentFilter::Power {
            self.cast(frame, rays, of, (rays.count, 0), |frame, part| {
                self.take(frame, rays, part);
                rays.moments(frame, triangles, (volume, part), filter, None);
            });
            return;
        }
        let edge = volume.moment_texels;
        let how = (RAYS_OF_TEXEL * edge * edge, edge);
        self.cast(frame, rays, of, how, |frame, part| {
            let params = rays.moment_params(volume, part, None);
            (part.bind(frame.pass(&MOMENTS_CAST)))
                .bind("cast_hits", &self.room[1])
                .bind("probe_moments", &volume.moments)
                .push(&params)
                .dispatch(linear_groups(params.all));
        });
    }
}
