//! The passes that light voxels, and what they are told.

use crate::gpu_struct;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Pass, Sets, Shaders};
use crate::render::bvh;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `voxel.light`.
    pub struct LightParams {
        /// xyz: corner that places are counted from (m); w: voxel size (m).
        pub grid: [f32; 4],
        /// xyz: smallest corner of the voxels' grid from there (voxels).
        pub first: [i32; 4],
        /// xyz: first voxel of the box whose light stays as it is.
        pub kept_low: [i32; 4],
        /// xyz: end of that box, one voxel beyond its last.
        pub kept_end: [i32; 4],
        /// Number of records.
        pub voxel_count: u32,
        /// One integer step of r, g, b (W/(m² sr)).
        pub flux_unit: f32,
        /// One integer step of lit area (voxel faces).
        pub area_unit: f32,
        /// Voxels along an edge of the grid.
        pub resolution: u32,
        /// κ of soft occlusion (voxels).
        pub kappa: f32,
    }
}

const LIGHT_BINDINGS: [Binding; 11] = [
    Binding::buffer("light_views", Access::ComputeRead),
    Binding::sampled("shadow_maps", Access::ComputeSampled),
    Binding::buffer("voxels", Access::ComputeRead),
    Binding::buffer("voxel_emission", Access::ComputeRead),
    Binding::buffer("flux", Access::ComputeRead),
    Binding::buffer("voxel_radiance", Access::ComputeWrite),
    Binding::buffer("lost_texels", Access::ComputeReadWrite),
    Binding::buffer("voxel_irradiance", Access::ComputeRead),
    Binding::buffer("occupancy", Access::ComputeRead),
    Binding::buffer("block_bases", Access::ComputeRead),
    Binding::buffer("voxel_faces", Access::ComputeRead),
];

const LIGHT_CONSTANTS: [&str; 9] = [
    "INJECTION_VOXEL",
    "EMISSIVE",
    "SIDES",
    "INDIRECT",
    "COUNTING",
    "NORMAL_WEIGHTED",
    "OCCLUSION",
    "DYNAMIC",
    "FACES",
];

const DENSE_TEXELS: [Binding; 2] = [
    Binding::image("dense_radiance", Access::ComputeWrite),
    Binding::image("dense_normals", Access::ComputeWrite),
];

const BY_RAYS_CONSTANTS: [&str; 13] = join::<_, 12, 1, 13>(
    join::<_, 3, 9, 12>(bvh::CONSTANTS, LIGHT_CONSTANTS),
    ["POINTS"],
);

/// Radiance of each occupied voxel, in compact order. A thread a voxel.
pub static LIGHT: Pass = Pass {
    name: "voxel.light",
    shaders: Shaders::Compute("gi/shared/voxel/light/light_voxels.comp"),
    bindings: &LIGHT_BINDINGS,
    constants: &LIGHT_CONSTANTS,
    params: Some(LightParams::LAYOUT),
    sets: Sets::Scene,
};

/// As [`LIGHT`], and into mip 0 of a dense RGBA16F texture, premultiplied by opacity; of
/// directional voxels, six faces side by side along x. Where voxels shine by their normals, both
/// sides together, and the mean normal of what shines into a second texture.
pub static LIGHT_DENSE: Pass = Pass {
    name: "voxel.light",
    shaders: Shaders::Compute("gi/shared/voxel/light/light_voxels_dense.comp"),
    bindings: &join::<_, 11, 2, 13>(LIGHT_BINDINGS, DENSE_TEXELS),
    constants: &join::<_, 9, 1, 10>(LIGHT_CONSTANTS, ["NORMALS"]),
    params: Some(LightParams::LAYOUT),
    sets: Sets::Scene,
};

/// As [`LIGHT`], by rays against the scene's triangles from points of each voxel's surface.
pub static LIGHT_BY_RAYS: Pass = Pass {
    shaders: Shaders::Compute("gi/shared/voxel/light/light_by_rays.comp"),
    bindings: &join::<_, 5, 11, 16>(bvh::BINDINGS, LIGHT_BINDINGS),
    constants: &BY_RAYS_CONSTANTS,
    ..LIGHT
};

/// As [`LIGHT_BY_RAYS`], and as [`LIGHT_DENSE`].
pub static LIGHT_BY_RAYS_DENSE: Pass = Pass {
    shaders: Shaders::Compute("gi/shared/voxel/light/light_by_rays_dense.comp"),
    bindings: &join::<_, 16, 2, 18>(
        join::<_, 5, 11, 16>(bvh::BINDINGS, LIGHT_BINDINGS),
        DENSE_TEXELS,
    ),
    constants: &join::<_, 13, 1, 14>(BY_RAYS_CONSTANTS, ["NORMALS"]),
    ..LIGHT
};
