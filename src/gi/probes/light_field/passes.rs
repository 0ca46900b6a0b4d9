//! The passes, and what they are told.

use crate::gi::probes::lookup::{LOOKUP_BINDINGS, LOOKUP_CONSTANTS};
use crate::gi::probes::passes::LookupRow;
use crate::gi::shared::paths;
use crate::gpu_struct;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Pass, Sets, Shaders};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `light_field.gather` and `light_field.mirror`.
    pub struct FieldGatherParams {
        /// How places look probes up.
        pub lookup: LookupRow,
        /// Rays of all dispatches.
        pub ray_count: u32,
        /// First ray of this dispatch, which adds to what those before it left.
        pub first_ray: u32,
        /// One beyond its last ray.
        pub end_ray: u32,
        /// Of a tile of pixels, as [`crate::gi::shared::interleave::Pattern`] packs it.
        pub pattern: u32,
        /// How far off its surface a ray starts (texels of the nearest probe).
        pub origin_bias: f32,
        /// The greatest thickness of surfaces (m).
        pub thickness_m: f32,
    }
}

/// What a pass binds last whose threads follow rays through the field
/// (`gi/probes/light_field/rays.glsl`).
const FIELD_BINDINGS: [Binding; 7] = join::<_, 2, 5, 7>(
    [
        Binding::sampled("field_surfaces", Access::ComputeSampled),
        Binding::sampled("field_radiance", Access::ComputeSampled),
    ],
    LOOKUP_BINDINGS,
);

const FIELD_CONSTANTS: [&str; 16] = join::<_, 6, 10, 16>(
    paths::CONSTANTS,
    join::<_, 4, 6, 10>(
        [
            "FIELD_TEXELS",
            "THICKNESS_TRACE",
            "UNKNOWN_BY_RAYS",
            "REFLECTS",
        ],
        LOOKUP_CONSTANTS,
    ),
);

/// Diffuse light and visibility by rays through the field. Reads the G-buffer and maps, adds to an
/// RGBA32F image; a thread a pixel.
pub static GATHER: Pass = Pass {
    name: "light_field.gather",
    shaders: Shaders::Compute("gi/probes/light_field/gather.comp"),
    bindings: &join::<_, 12, 7, 19>(
        join::<_, 9, 3, 12>(
            paths::BINDINGS,
            [
                Binding::sampled("view_depth", Access::ComputeSampled),
                Binding::sampled("normals", Access::ComputeSampled),
                Binding::image("indirect_diffuse", Access::ComputeReadWrite),
            ],
        ),
        FIELD_BINDINGS,
    ),
    constants: &FIELD_CONSTANTS,
    params: Some(FieldGatherParams::LAYOUT),
    sets: Sets::Scene,
};

/// Light that glossy surfaces mirror, by rays through the field. Reads the G-buffer and maps, adds
/// to an RGBA32F image; a thread a pixel.
pub static MIRROR: Pass = Pass {
    name: "light_field.mirror",
    shaders: Shaders::Compute("gi/probes/light_field/mirror.comp"),
    bindings: &join::<_, 13, 7, 20>(
        join::<_, 9, 4, 13>(paths::BINDINGS, paths::MIRROR_BINDINGS),
        FIELD_BINDINGS,
    ),
    constants: &join::<_, 16, 1, 17>(FIELD_CONSTANTS, ["MIRRORS_LEFT"]),
    params: Some(FieldGatherParams::LAYOUT),
    sets: Sets::Scene,
};
