//! The passes, the rows that they read and write, and their parameters.

use super::super::bvh;
use crate::gpu_struct;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Pass, Sets, Shaders};
use crate::shader::GpuStruct;

gpu_struct! {
    /// What passes a material (`Clear` in `render/clear/way.glsl`).
    pub struct GpuClear {
        /// rgb: share of light that passes one of its surfaces; w: index of refraction.
        pub passes: [f32; 4],
    }
}

gpu_struct! {
    /// Where a line of sight goes on (`Way` in `render/clear/way.glsl`).
    pub struct GpuWay {
        /// rgb: what is left of the light; w: bits of the next triangle.
        pub left: [f32; 4],
        /// xy: barycentric coordinates there.
        pub at: [f32; 4],
    }
}

gpu_struct! {
    /// A line of sight (`SightRay` in `shared/sight.glsl`).
    pub struct GpuSightRay {
        /// xyz: where it starts (m); w: where it ends along its direction (m).
        pub origin: [f32; 4],
        /// xyz: of unit length, or 0: nothing is asked.
        pub direction: [f32; 4],
    }
}

gpu_struct! {
    /// What is seen along a line of sight (`Sight` in `shared/sight.glsl`).
    pub struct GpuSight {
        /// rgb: radiance of what it meets (W/(m² sr)); a: share that meets nothing.
        pub light: [f32; 4],
    }
}

gpu_struct! {
    /// Parameters of `clear.enter`.
    pub struct EnterParams {
        /// 1: from the first body, the mirrored ray instead of the refracted one.
        pub is_mirrored: u32,
        /// 1 where some surface bends light.
        pub has_bodies: u32,
    }
}

gpu_struct! {
    /// Parameters of `clear.shadow`.
    pub struct ClearShadowParams {
        /// Of a directional light, xyz: the middle of its map (m); w: half its edge (m).
        pub middle: [f32; 4],
        /// xyz: position of another light (m); w: 1, or 0 of a directional one.
        pub position: [f32; 4],
        /// xyz: in which a directional light travels.
        pub direction: [f32; 4],
        /// Where its rows begin.
        pub first_row: u32,
        /// Rows along an edge.
        pub edge: u32,
    }
}

/// What a pass binds that follows rays through clear surfaces, after [`bvh::BINDINGS`].
const fn way(asked: Access) -> [Binding; 8] {
    join(
        bvh::BINDINGS,
        [
            Binding::buffer("clear_materials", Access::ComputeRead),
            Binding::buffer("ways", asked),
            Binding::buffer("sight_rays", asked),
        ],
    )
}

/// What sheets leave of each pixel's light, and its first line of sight through a body. Reads the
/// G-buffer's depth; a thread a pixel.
pub static ENTER: Pass = Pass {
    name: "clear.enter",
    shaders: Shaders::Compute("render/clear/enter.comp"),
    bindings: &join::<_, 8, 3, 11>(
        way(Access::ComputeWrite),
        [
            Binding::sampled("view_depth", Access::ComputeSampled),
            Binding::image("clear_filter", Access::ComputeWrite),
            Binding::image("clear_light", Access::ComputeWrite),
        ],
    ),
    constants: &bvh::CONSTANTS,
    params: Some(EnterParams::LAYOUT),
    sets: Sets::Scene,
};

/// Which share of a light passes what is clear. A thread a row of its shadow.
pub static SHADOW: Pass = Pass {
    name: "clear.shadow",
    shaders: Shaders::Compute("render/clear/shadow.comp"),
    bindings: &join::<_, 5, 2, 7>(
        bvh::BINDINGS,
        [
            Binding::buffer("clear_materials", Access::ComputeRead),
            Binding::buffer("shadow_rows", Access::ComputeWrite),
        ],
    ),
    constants: &bvh::CONSTANTS,
    params: Some(ClearShadowParams::LAYOUT),
    sets: Sets::Scene,
};

/// Adds what was seen along each line of sight, and finds the next. A thread a pixel.
pub static PASS: Pass = Pass {
    name: "clear.pass",
    shaders: Shaders::Compute("render/clear/pass.comp"),
    bindings: &join::<_, 8, 2, 10>(
        way(Access::ComputeReadWrite),
        [
            Binding::buffer("sights", Access::ComputeRead),
            Binding::image("clear_light", Access::ComputeReadWrite),
        ],
    ),
    constants: &bvh::CONSTANTS,
    params: None,
    sets: Sets::Scene,
};

/// Puts all that in front of the picture. A thread a pixel.
pub static COVER: Pass = Pass {
    name: "clear.cover",
    shaders: Shaders::Compute("render/clear/cover.comp"),
    bindings: &[
        Binding::sampled("clear_filter", Access::ComputeSampled),
        Binding::sampled("clear_light", Access::ComputeSampled),
        Binding::sampled("albedo", Access::ComputeSampled),
        Binding::sampled("indirect_diffuse", Access::ComputeSampled),
        Binding::sampled("indirect_specular", Access::ComputeSampled),
        Binding::image("direct", Access::ComputeReadWrite),
        Binding::image("emission", Access::ComputeReadWrite),
        Binding::image("covered_diffuse", Access::ComputeWrite),
        Binding::image("covered_specular", Access::ComputeWrite),
    ],
    constants: &["SPECULAR", "EMISSIVE"],
    params: None,
    sets: Sets::Scene,
};
