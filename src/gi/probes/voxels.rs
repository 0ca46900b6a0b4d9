//! Voxels as what probes see, in place of triangles: a ray ends in the first one that it hits, and
//! brings the light of its face.

use super::list::{LIST_BINDING, Listed};
use super::passes::MomentParams;
use super::rays::{Moved, ProbeRays, corners, widened};
use super::volume::Volume;
use crate::gi::Inputs;
use crate::gi::shared::paths::{CACHE_BINDINGS, Cache};
use crate::gi::shared::voxel::Voxels;
use crate::gpu_struct;
use crate::graph::compute::linear_groups;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Error, Frame, FrameStats, Gpu, Pass, Sets, Shaders};
use crate::render::GpuScene;
use crate::render::bvh::SceneRays;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `probes.trace_voxels`.
    pub struct VoxelTraceParams {
        /// xyz: smallest corner of the box in which something has moved (m).
        pub low: [f32; 4],
        /// xyz: its largest corner (m).
        pub high: [f32; 4],
        /// xyz: smallest corner of the grid (m); w: edge of its voxels (m).
        pub grid: [f32; 4],
        /// Edge of the grid (voxels).
        pub resolution: u32,
        /// Rays of a probe.
        pub ray_count: u32,
        /// First of the list.
        pub first_probe: u32,
        /// Rays of those from there on.
        pub all: u32,
    }
}

gpu_struct! {
    /// Parameters of `probes.light_voxels`.
    pub struct VoxelRayParams {
        /// xyz: smallest corner of the grid (m); w: edge of its voxels (m).
        pub grid: [f32; 4],
        /// Edge of the grid (voxels).
        pub resolution: u32,
        /// Rays of a probe.
        pub ray_count: u32,
        /// First of the list.
        pub first_probe: u32,
        /// Rays of those from there on.
        pub all: u32,
    }
}

/// The voxel that each ray hits first, where that may have changed. Reads places and voxels, writes
/// RGBA32UI; a thread a ray.
pub static TRACE_VOXELS: Pass = Pass {
    name: "probes.trace_voxels",
    shaders: Shaders::Compute("gi/probes/trace_voxels.comp"),
    bindings: &join::<_, 3, 4, 7>(
        CACHE_BINDINGS,
        [
            Binding::buffer("probe_places", Access::ComputeRead),
            Binding::sampled("ray_set", Access::ComputeSampled),
            Binding::image("ray_hits", Access::ComputeReadWrite),
            LIST_BINDING,
        ],
    ),
    constants: &["SIDES", "KEEPS"],
    params: Some(VoxelTraceParams::LAYOUT),
    sets: Sets::Scene,
};

/// Mean and mean square of the distance that a probe sees through voxels, by direction. Reads
/// places and voxels, writes RG16F; a thread a texel.
pub static MOMENTS_VOXELS: Pass = Pass {
    name: "probes.moments_voxels",
    shaders: Shaders::Compute("gi/probes/moments_voxels.comp"),
    bindings: &join::<_, 3, 3, 6>(
        CACHE_BINDINGS,
        [
            Binding::buffer("probe_places", Access::ComputeRead),
            Binding::image("probe_moments", Access::ComputeWrite),
            LIST_BINDING,
        ],
    ),
    constants: &["SIDES", "KEEPS"],
    params: Some(MomentParams::LAYOUT),
    sets: Sets::Scene,
};

/// What each ray brings: the light of the voxel that it hits. Reads hits and voxels, writes
/// RGBA32F; a thread a ray.
pub static LIGHT_VOXELS: Pass = Pass {
    name: "probes.light_voxels",
    shaders: Shaders::Compute("gi/probes/light_voxels.comp"),
    bindings: &join::<_, 3, 4, 7>(
        CACHE_BINDINGS,
        [
            Binding::sampled("ray_set", Access::ComputeSampled),
            Binding::sampled("ray_hits", Access::ComputeSampled),
            Binding::image("ray_light", Access::ComputeWrite),
            LIST_BINDING,
        ],
    ),
    constants: &["SIDES"],
    params: Some(VoxelRayParams::LAYOUT),
    sets: Sets::Scene,
};

/// The voxels, and the light of their faces.
pub struct VoxelSource {
    cache: Cache,
    resolution: u32,
}

impl VoxelSource {
    /// So many voxels along the largest extent of the scene. Nothing is built yet. `uses_maps`:
    /// reflective shadow maps light the voxels, and not rays.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        resolution: u32,
        uses_maps: bool,
    ) -> Result<Self, Error> {
        let cache = Cache::new(gpu, scene, resolution, (uses_maps, true))?;
        Ok(VoxelSource { cache, resolution })
    }

    /// The voxels, once they are built.
    pub fn voxels(&self) -> Option<&Voxels> {
        self.cache.grid.lit.as_ref().map(|(voxels, _)| voxels)
    }

    /// Voxelizes the scene as it is.
    pub fn build(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<FrameStats, Error> {
        self.cache.grid.build(gpu, scene)
    }

    /// Brings it up to models that have moved.
    pub fn follow(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<FrameStats, Error> {
        self.cache.grid.follow(gpu, scene)
    }

    /// Counts, by name.
    pub fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        self.cache.grid.counts(gpu)
    }

    /// Adds the passes that light the voxels.
    pub fn light(&self, frame: &mut Frame, given: &Inputs<'_>, triangles: &SceneRays) {
        self.cache.light(frame, given, triangles);
    }

    /// The box in which voxels may be others, or have other numbers, after models have moved in
    /// this one (m); none where all are.
    fn changed(&self, moved: Option<Moved>) -> Option<Moved> {
        let [.., edge] = self.cache.row();
        widened(moved?, self.cache.grid.change_margin()? * edge)
    }

    /// Adds [`TRACE_VOXELS`], and where surfaces ask how far probes see [`MOMENTS_VOXELS`]. With a
    /// box in which models have moved, rays keep what they have met as [`ProbeRays::trace`] has it.
    pub fn trace(
        &self,
        frame: &mut Frame,
        rays: &ProbeRays,
        volume: &Volume,
        probes: Listed<'_>,
        (by_rays, moved): (bool, Option<Moved>),
    ) {
        let all = probes.count * rays.count;
        let changed = self.changed(moved);
        let [low, high] = corners(changed);
        let pass = probes.bind(self.cache.bind(frame.pass(&TRACE_VOXELS)));
        pass.bind("probe_places", &volume.places)
            .bind("ray_set", &rays.set)
            .bind("ray_hits", &rays.hits)
            .constant("KEEPS", changed.is_some())
            .push(&VoxelTraceParams {
                low,
                high,
                grid: self.cache.row(),
                resolution: self.resolution,
                ray_count: rays.count,
                first_probe: probes.first,
                all,
            })
            .dispatch(linear_groups(all));
        if !volume.has_moments || !by_rays {
            return;
        }
        let texels = probes.count * volume.moment_texels * volume.moment_texels;
        let params = MomentParams {
            grid: self.cache.row(),
            resolution: self.resolution,
            ..rays.moment_params(volume, probes, changed)
        };
        let pass = probes.bind(self.cache.bind(frame.pass(&MOMENTS_VOXELS)));
        pass.bind("probe_places", &volume.places)
            .bind("probe_moments", &volume.moments)
            .constant("KEEPS", changed.is_some())
            .push(&params)
            .dispatch(linear_groups(texels));
    }

    /// Adds [`LIGHT_VOXELS`] of these probes.
    pub fn straight(&self, frame: &mut Frame, rays: &ProbeRays, probes: Listed<'_>) {
        let pass = probes.bind(self.cache.bind(frame.pass(&LIGHT_VOXELS)));
        rays.bind(pass)
            .push(&self.params(rays, probes))
            .dispatch(linear_groups(probes.count * rays.count));
    }

    fn params(&self, rays: &ProbeRays, probes: Listed<'_>) -> VoxelRayParams {
        VoxelRayParams {
            grid: self.cache.row(),
            resolution: self.resolution,
            ray_count: rays.count,
            first_probe: probes.first,
            all: probes.count * rays.count,
        }
    }
}
