//! From cells to pixels.

use super::cells::Cells;
use super::grid::GridRow;
use crate::gpu_struct;
use crate::graph::{Access, Binding, Frame, Pass, Sets, Shaders};
use crate::render::{GBuffer, IndirectLight, screen_groups};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.gather` and `lpv.specular`.
    pub struct LookupParams {
        /// The grid.
        pub grid: GridRow,
        /// Off the surface (cells).
        pub shift: f32,
        /// Radiance of a stored 1 (W/(m² sr)).
        pub scale: f32,
    }
}

/// Irradiance and ambient visibility by a lookup off the surface. A thread a pixel.
pub static GATHER: Pass = Pass {
    name: "lpv.gather",
    shaders: Shaders::Compute("gi/lpv/gather.comp"),
    bindings: &[
        Binding::sampled("light", Access::ComputeSampled),
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::image("indirect_diffuse", Access::ComputeWrite),
    ],
    constants: &[],
    params: Some(LookupParams::LAYOUT),
    sets: Sets::Scene,
};

/// Specular radiance by the same lookup. A thread a pixel.
pub static SPECULAR: Pass = Pass {
    name: "lpv.specular",
    shaders: Shaders::Compute("gi/lpv/specular.comp"),
    bindings: &[
        Binding::sampled("light", Access::ComputeSampled),
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::sampled("albedo", Access::ComputeSampled),
        Binding::sampled("specular", Access::ComputeSampled),
        Binding::image("indirect_specular", Access::ComputeWrite),
    ],
    constants: &[],
    params: Some(LookupParams::LAYOUT),
    sets: Sets::Scene,
};

/// Adds the passes that answer for each pixel.
pub(super) fn gather(
    frame: &mut Frame,
    gbuffer: &GBuffer,
    cells: &Cells,
    shift: f32,
    answer: &IndirectLight,
) {
    let params = LookupParams {
        grid: cells.grid.row(0),
        shift,
        scale: cells.scale,
    };
    frame
        .pass(&GATHER)
        .bind("light", cells.volume())
        .bind("view_depth", &gbuffer.view_depth)
        .bind("normals", &gbuffer.normals)
        .bind("indirect_diffuse", &answer.diffuse)
        .push(&params)
        .dispatch(screen_groups(gbuffer.size));
    if let (Some(result), Some(specular)) = (&answer.specular, &gbuffer.specular) {
        frame
            .pass(&SPECULAR)
            .bind("light", cells.volume())
            .bind("view_depth", &gbuffer.view_depth)
            .bind("normals", &gbuffer.normals)
            .bind("albedo", &gbuffer.albedo)
            .bind("specular", specular)
            .bind("indirect_specular", result)
            .push(&params)
            .dispatch(screen_groups(gbuffer.size));
    }
}
