//! The passes, and what they are told.

use crate::gi::shared::paths::{BINDINGS, CACHE_BINDINGS, CONSTANTS, MIRROR_BINDINGS};
use crate::gpu_struct;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Pass, Sets, Shaders};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `ray_traced.gather`, `ray_traced.mirror` and `ray_traced.see`.
    pub struct PathParams {
        /// Of the cache, if there is one: xyz: smallest corner (m); w: edge of its voxels (m).
        pub grid: [f32; 4],
        /// Edge of the cache (voxels).
        pub resolution: u32,
        /// Rays of all dispatches.
        pub ray_count: u32,
        /// First ray of this dispatch, which adds to what those before it left.
        pub first_ray: u32,
        /// One beyond its last ray.
        pub end_ray: u32,
        /// Of a tile of pixels, as [`crate::gi::shared::interleave::Pattern`] packs it.
        pub pattern: u32,
        /// Indirect bounces.
        pub bounces: u32,
        /// Least roughness of what the rays of a diffuse surface hit.
        pub hit_roughness: f32,
    }
}

const CACHED_CONSTANTS: &[&str] = &join::<_, 6, 1, 7>(CONSTANTS, ["SIDES"]);

const GATHER_BINDINGS: [Binding; 12] = join(
    BINDINGS,
    [
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::image("indirect_diffuse", Access::ComputeReadWrite),
    ],
);

const MIRRORED: [Binding; 13] = join(BINDINGS, MIRROR_BINDINGS);

/// Diffuse light and visibility by paths. Reads the G-buffer, adds to an RGBA32F image; a thread a
/// pixel.
pub static GATHER: Pass = Pass {
    name: "ray_traced.gather",
    shaders: Shaders::Compute("gi/ray_traced/gather.comp"),
    bindings: &GATHER_BINDINGS,
    constants: &CONSTANTS,
    params: Some(PathParams::LAYOUT),
    sets: Sets::Scene,
};

/// As [`GATHER`], with the light of voxels at the last place of a path.
pub static GATHER_CACHED: Pass = Pass {
    shaders: Shaders::Compute("gi/ray_traced/gather_cached.comp"),
    bindings: &join::<_, 12, 3, 15>(GATHER_BINDINGS, CACHE_BINDINGS),
    constants: CACHED_CONSTANTS,
    ..GATHER
};

const SEEN: [Binding; 11] = join(
    BINDINGS,
    [
        Binding::buffer("sight_rays", Access::ComputeRead),
        Binding::buffer("sights", Access::ComputeReadWrite),
    ],
);

/// What is seen along lines of sight, by paths from what they meet. Adds to a row a line; a thread
/// a line.
pub static SEE: Pass = Pass {
    name: "ray_traced.see",
    shaders: Shaders::Compute("gi/ray_traced/see.comp"),
    bindings: &SEEN,
    constants: &CONSTANTS,
    params: Some(PathParams::LAYOUT),
    sets: Sets::Scene,
};

/// As [`SEE`], with the light of voxels at the last place of a path.
pub static SEE_CACHED: Pass = Pass {
    shaders: Shaders::Compute("gi/ray_traced/see_cached.comp"),
    bindings: &join::<_, 11, 3, 14>(SEEN, CACHE_BINDINGS),
    constants: CACHED_CONSTANTS,
    ..SEE
};

/// Light that glossy surfaces mirror, by paths. Reads the G-buffer, adds to an RGBA32F image; a
/// thread a pixel.
pub static MIRROR: Pass = Pass {
    name: "ray_traced.mirror",
    shaders: Shaders::Compute("gi/ray_traced/mirror.comp"),
    bindings: &MIRRORED,
    constants: &CONSTANTS,
    params: Some(PathParams::LAYOUT),
    sets: Sets::Scene,
};

/// As [`MIRROR`], with the light of voxels at the last place of a path.
pub static MIRROR_CACHED: Pass = Pass {
    shaders: Shaders::Compute("gi/ray_traced/mirror_cached.comp"),
    bindings: &join::<_, 13, 3, 16>(MIRRORED, CACHE_BINDINGS),
    constants: CACHED_CONSTANTS,
    ..MIRROR
};
