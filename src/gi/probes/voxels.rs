//! Voxels as what probes see, in place of triangles: a ray ends in the first one that it hits, and
//! brings the light of its face.

use super::list::{LIST_BINDING, Listed};
use super::passes::MomentParams;
use super::rays::ProbeRays;
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
    /// Parameters of `probes.trace_voxels` and `probes.light_voxels`.
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

/// The voxel that each ray hits first. Reads places and voxels, writes RGBA32UI; a thread a ray.
pub static TRACE_VOXELS: Pass = Pass {
    name: "probes.trace_voxels",
    shaders: Shaders::Compute("gi/probes/trace_voxels.comp"),
    bindings: &join::<_, 4, 4, 8>(
        CACHE_BINDINGS,
        [
            Binding::buffer("probe_places", Access::ComputeRead),
            Binding::sampled("ray_set", Access::ComputeSampled),
            Binding::image("ray_hits", Access::ComputeWrite),
            LIST_BINDING,
        ],
    ),
    constants: &["SIDES"],
    params: Some(VoxelRayParams::LAYOUT),
    sets: Sets::Scene,
};

/// Mean and mean square of the distance that a probe sees through voxels, by direction. Reads
/// places and voxels, writes RG16F; a thread a texel.
pub static MOMENTS_VOXELS: Pass = Pass {
    name: "probes.moments_voxels",
    shaders: Shaders::Compute("gi/probes/moments_voxels.comp"),
    bindings: &join::<_, 4, 3, 7>(
        CACHE_BINDINGS,
        [
            Binding::buffer("probe_places", Access::ComputeRead),
            Binding::image("probe_moments", Access::ComputeWrite),
            LIST_BINDING,
        ],
    ),
    constants: &["SIDES"],
    params: Some(MomentParams::LAYOUT),
    sets: Sets::Scene,
};

/// What each ray brings: the light of the voxel that it hits. Reads hits and voxels, writes
/// RGBA32F; a thread a ray.
pub static LIGHT_VOXELS: Pass = Pass {
    name: "probes.light_voxels",
    shaders: Shaders::Compute("gi/probes/light_voxels.comp"),
    bindings: &join::<_, 4, 4, 8>(
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

    /// Adds [`TRACE_VOXELS`], and where surfaces ask how far probes see [`MOMENTS_VOXELS`].
    pub fn trace(
        &self,
        frame: &mut Frame,
        rays: &ProbeRays,
        volume: &Volume,
        probes: Listed<'_>,
        by_rays: bool,
    ) {
        let all = probes.count * rays.count;
        let pass = probes.bind(self.cache.bind(frame.pass(&TRACE_VOXELS)));
        pass.bind("probe_places", &volume.places)
            .bind("ray_set", &rays.set)
            .bind("ray_hits", &rays.hits)
            .push(&self.params(rays, probes))
            .dispatch(linear_groups(all));
        if !volume.has_moments || !by_rays {
            return;
        }
        let texels = probes.count * volume.moment_texels * volume.moment_texels;
        let params = MomentParams {
            grid: self.cache.row(),
            resolution: self.resolution,
            ..rays.moment_params(volume, probes, None)
        };
        let pass = probes.bind(self.cache.bind(frame.pass(&MOMENTS_VOXELS)));
        pass.bind("probe_places", &volume.places)
            .bind("probe_moments", &volume.moments)
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
