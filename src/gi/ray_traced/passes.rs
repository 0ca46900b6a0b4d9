//! The passes, and what they are told.

use crate::gpu_struct;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Pass, Sets, Shaders};
use crate::render::bvh;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `ray_traced.gather`.
    pub struct GatherParams {
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
        /// Where rays of a pixel start (share of distances and coordinates).
        pub start_offset: f32,
    }
}

gpu_struct! {
    /// Parameters of `ray_traced.mirror`.
    pub struct MirrorParams {
        /// Rays of all dispatches.
        pub ray_count: u32,
        /// As in [`GatherParams`].
        pub first_ray: u32,
        /// As in [`GatherParams`].
        pub end_ray: u32,
        /// As in [`GatherParams`], of glossy reflections.
        pub pattern: u32,
        /// Indirect bounces.
        pub bounces: u32,
        /// As in [`GatherParams`].
        pub start_offset: f32,
    }
}

/// What paths read of the scene.
const SCENE: [Binding; 9] = join(
    bvh::BINDINGS,
    [
        Binding::buffer("emitters", Access::ComputeRead),
        Binding::buffer("emitter_densities", Access::ComputeRead),
        Binding::buffer("light_views", Access::ComputeRead),
        Binding::sampled("shadow_maps", Access::ComputeSampled),
    ],
);

const CONSTANTS: &[&str] = &[
    bvh::CONSTANTS[0],
    bvh::CONSTANTS[1],
    bvh::CONSTANTS[2],
    "EMITTERS",
    "SHADOW_MAPS",
    "BUMPS",
];

/// Diffuse light and visibility by paths. Reads the G-buffer, adds to an RGBA32F image; a thread a
/// pixel.
pub static GATHER: Pass = Pass {
    name: "ray_traced.gather",
    shaders: Shaders::Compute("gi/ray_traced/gather.comp"),
    bindings: &join::<9, 3, 12>(
        SCENE,
        [
            Binding::sampled("view_depth", Access::ComputeSampled),
            Binding::sampled("normals", Access::ComputeSampled),
            Binding::image("indirect_diffuse", Access::ComputeReadWrite),
        ],
    ),
    constants: CONSTANTS,
    params: Some(GatherParams::LAYOUT),
    sets: Sets::Scene,
};

/// Light that glossy surfaces mirror, by paths. Reads the G-buffer, adds to an RGBA32F image; a
/// thread a pixel.
pub static MIRROR: Pass = Pass {
    name: "ray_traced.mirror",
    shaders: Shaders::Compute("gi/ray_traced/mirror.comp"),
    bindings: &join::<9, 5, 14>(
        SCENE,
        [
            Binding::sampled("view_depth", Access::ComputeSampled),
            Binding::sampled("normals", Access::ComputeSampled),
            Binding::sampled("albedo", Access::ComputeSampled),
            Binding::sampled("specular", Access::ComputeSampled),
            Binding::image("indirect_specular", Access::ComputeReadWrite),
        ],
    ),
    constants: CONSTANTS,
    params: Some(MirrorParams::LAYOUT),
    sets: Sets::Scene,
};
