//! The cells as the camera sees them.

use std::sync::Arc;

use super::cells::Cells;
use super::grid::GridRow;
use crate::gi::inspect::{Channels, Scale, ViewRow};
use crate::gpu_struct;
use crate::graph::{Access, Binding, Frame, Image, Pass, Sets, Shaders};
use crate::render::screen_groups;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.view`.
    pub struct ViewParams {
        /// The grid.
        pub grid: GridRow,
        /// Radiance of a stored 1 (W/(m² sr)).
        pub scale: f32,
    }
}

/// Opaque faces by their irradiance, or cells beside them as lobes of theirs. A thread a pixel.
pub static VIEW: Pass = Pass {
    name: "lpv.view",
    shaders: Shaders::Compute("gi/lpv/view.comp"),
    bindings: &[
        Binding::buffer("faces", Access::ComputeRead),
        Binding::sampled("light", Access::ComputeSampled),
        Binding::sampled("light_band2", Access::ComputeSampled),
        Binding::image("seen", Access::ComputeWrite),
    ],
    constants: &["LOBES", "HAS_BAND2"],
    params: Some(ViewParams::LAYOUT),
    sets: Sets::Scene,
};

/// The views.
pub(super) static VIEWS: [ViewRow; 3] = [
    ViewRow {
        name: "cells",
        aliases: &[],
        help: "opaque faces between cells, by the light that their cells bring them",
        unit: "W/m²",
        scale: Scale::Light,
        channels: Channels::Rgb,
    },
    ViewRow {
        name: LOBES,
        aliases: &[],
        help: "the light of cells beside opaque faces: as far from a cell's centre as a receiver \
               that faces there gets irradiance, which is its colour",
        unit: "W/m²",
        scale: Scale::Light,
        channels: Channels::Rgb,
    },
    ViewRow {
        name: LEVELS,
        aliases: &[],
        help: "the level of the cell that a surface's light is looked up in: a leaf or level of \
               the octree, or one of nested grids, whose borders are white; of leaves also those \
               in a plane across the middle",
        unit: "",
        scale: Scale::Share,
        channels: Channels::Rgb,
    },
];

const LOBES: &str = "lobes";

/// Name of the view of cells by level.
pub(super) const LEVELS: &str = "cell-levels";

/// Adds the pass that draws one of them.
pub(super) fn draw(frame: &mut Frame, view: &ViewRow, cells: &Cells, seen: &Arc<Image>) {
    let [width, height, _] = seen.extent(0);
    frame
        .pass(&VIEW)
        .bind("faces", &cells.faces.words)
        .bind("light", &cells.light.low)
        .bind("light_band2", cells.light.bound_band2())
        .bind("seen", seen)
        .constant("LOBES", u32::from(view.name == LOBES))
        .constant("HAS_BAND2", cells.light.band2.is_some())
        .push(&ViewParams {
            grid: cells.grid.row(0),
            scale: cells.scale,
        })
        .dispatch(screen_groups([width, height]));
}
