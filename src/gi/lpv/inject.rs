//! Reflective shadow maps into cells.

use super::cells::{Cells, Propagation};
use super::grid::{CellGrid, GridRow};
use crate::gpu_struct;
use crate::graph::{Access, Binding, Frame, Pass, Sets, Shaders};
use crate::render::LightMaps;
use crate::scene::Light;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.inject`.
    pub struct InjectParams {
        /// The grid; w of its size: cells or leaves that have flux.
        pub grid: GridRow,
        /// One integer step (W).
        pub flux_unit: f32,
        /// Off the surface (cells).
        pub shift: f32,
        /// Texels along an edge of the square that one texel stands for.
        pub stride: u32,
    }
}

/// Texels of the maps add Φ n to the cell in front of them; integer sums, the same in every run. A
/// thread 4×4 of the texels that are read.
pub static INJECT: Pass = Pass {
    name: "lpv.inject",
    shaders: Shaders::Compute("gi/lpv/inject.comp"),
    bindings: &[
        Binding::buffer("light_views", Access::ComputeRead),
        Binding::sampled("shadow_maps", Access::ComputeSampled),
        Binding::sampled("rsm_normal", Access::ComputeSampled),
        Binding::sampled("rsm_reflected", Access::ComputeSampled),
        Binding::buffer("flux", Access::ComputeReadWrite),
        Binding::buffer("leaf_of", Access::ComputeRead),
    ],
    constants: &["POWER", "LEAVES"],
    params: Some(InjectParams::LAYOUT),
    sets: Sets::Scene,
};

/// Numbers of a cell's flux: x, y and z of each colour.
pub(super) const FLUX_NUMBERS: u32 = 9;
/// Numbers of its power besides, which lobes need: one of each colour.
pub(super) const POWER_NUMBERS: u32 = 3;

/// One integer step of flux (W): no cell can have more than 2³⁰ of them. A parallel light brings a
/// cell at most E times the beam that meets it and its neighbours, any other light its whole power.
pub fn flux_unit(lights: &[Light], grid: &CellGrid) -> f32 {
    let beam = 16.0 * grid.cell_size * grid.cell_size;
    let most = |light: &Light| match *light {
        Light::Directional { irradiance, .. } => irradiance.max_element() * beam,
        Light::Point { intensity, .. } | Light::Spot { intensity, .. } => {
            intensity.max_element() * 4.0 * std::f32::consts::PI
        }
    };
    let sum: f32 = lights.iter().map(most).sum();
    (sum / (1u32 << 30) as f32).max(f32::MIN_POSITIVE)
}

/// Adds the pass that injects the light of all maps.
pub(super) fn inject(frame: &mut Frame, maps: &LightMaps, cells: &Cells, flux_unit: f32) {
    let Some([normal, reflected]) = maps.rsm.as_ref().filter(|_| maps.view_count > 0) else {
        return;
    };
    let stride = (maps.size / cells.settings.rsm_texels.max(1)).max(1);
    let groups = maps.size.div_ceil(stride).div_ceil(4 * 8);
    let leaf_of = match &*cells.propagation {
        Propagation::Leaves(sweep) => sweep.of_cell(),
        _ => None,
    };
    frame
        .pass(&INJECT)
        .bind("light_views", &maps.views)
        .bind("shadow_maps", &maps.depth)
        .bind("rsm_normal", normal)
        .bind("rsm_reflected", reflected)
        .bind("flux", &cells.flux)
        .bind("leaf_of", leaf_of.unwrap_or(&cells.faces.words))
        .constant("POWER", cells.settings.lobes.is_some())
        .constant("LEAVES", leaf_of.is_some())
        .push(&InjectParams {
            grid: cells.grid.row(cells.receivers()),
            flux_unit,
            shift: cells.settings.injection_shift,
            stride,
        })
        .dispatch([groups, groups, maps.view_count]);
}
