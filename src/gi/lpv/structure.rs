//! Cells by their level, as the camera sees them: leaves or levels of an octree, and nested grids.

use std::sync::Arc;

use super::cells::{Cells, Propagation};
use super::gather::inner_places;
use super::grid::GridRow;
use super::leaf_sweep::LeafSweep;
use super::levels::{Levels, Transfer};
use crate::gpu_struct;
use crate::graph::{Access, Binding, Frame, Image, Pass, Sets, Shaders};
use crate::render::{GBuffer, screen_groups};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.grid_structure`.
    pub struct GridStructureParams {
        /// The grid; of nested ones the outermost.
        pub grid: GridRow,
        /// Where each inner grid is from the first cell of the one around it (its own cells), 10
        /// bits an axis.
        pub inner: [u32; 4],
        /// Off the surface (cells).
        pub shift: f32,
        /// Cells over which a grid goes over into the one around it.
        pub blend: f32,
        /// The finest level that is shown.
        pub from: u32,
    }
}

gpu_struct! {
    /// Parameters of `lpv.leaf_structure`.
    pub struct LeafStructureParams {
        /// The grid.
        pub grid: GridRow,
        /// Off the surface (cells).
        pub shift: f32,
        /// The finest level that is shown.
        pub from: u32,
    }
}

gpu_struct! {
    /// Parameters of `lpv.level_structure`.
    pub struct LevelStructureParams {
        /// The finest grid.
        pub grid: GridRow,
        /// Off the surface (cells).
        pub shift: f32,
        /// The finest level that is shown.
        pub from: u32,
        /// How many levels there are.
        pub count: u32,
    }
}

/// Seen surfaces by the grid that they look their light up in. A thread a pixel.
pub static GRID_STRUCTURE: Pass = Pass {
    name: "lpv.grid_structure",
    shaders: Shaders::Compute("gi/lpv/structure/grids.comp"),
    bindings: &[
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::image("seen", Access::ComputeWrite),
    ],
    constants: &["LEVELS"],
    params: Some(GridStructureParams::LAYOUT),
    sets: Sets::Scene,
};

/// Seen surfaces by the leaf that they look their light up in, and leaves in a plane before them. A
/// thread a pixel.
pub static LEAF_STRUCTURE: Pass = Pass {
    name: "lpv.leaf_structure",
    shaders: Shaders::Compute("gi/lpv/structure/leaves.comp"),
    bindings: &[
        Binding::buffer("leaf_of", Access::ComputeRead),
        Binding::buffer("leaves", Access::ComputeRead),
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::image("seen", Access::ComputeWrite),
    ],
    constants: &[],
    params: Some(LeafStructureParams::LAYOUT),
    sets: Sets::Scene,
};

/// Sums of the levels of an octree, the finest first: a grid of 256 cells has as many.
const SUMS: [&str; 8] = [
    "sum_0", "sum_1", "sum_2", "sum_3", "sum_4", "sum_5", "sum_6", "sum_7",
];

/// Seen surfaces by the level whose light they look up. A thread a pixel.
pub static LEVEL_STRUCTURE: Pass = Pass {
    name: "lpv.level_structure",
    shaders: Shaders::Compute("gi/lpv/structure/levels.comp"),
    bindings: &[
        Binding::image(SUMS[0], Access::ComputeRead),
        Binding::image(SUMS[1], Access::ComputeRead),
        Binding::image(SUMS[2], Access::ComputeRead),
        Binding::image(SUMS[3], Access::ComputeRead),
        Binding::image(SUMS[4], Access::ComputeRead),
        Binding::image(SUMS[5], Access::ComputeRead),
        Binding::image(SUMS[6], Access::ComputeRead),
        Binding::image(SUMS[7], Access::ComputeRead),
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::image("seen", Access::ComputeWrite),
    ],
    constants: &["FINEST"],
    params: Some(LevelStructureParams::LAYOUT),
    sets: Sets::Scene,
};

/// How many levels there are to be seen, of these grids.
pub(super) fn count(grids: &[Cells]) -> u32 {
    match grids.first().map(|cells| &*cells.propagation) {
        Some(Propagation::Leaves(sweep)) => {
            let levels = sweep.leaves.all.iter().map(|leaf| leaf.level + 1);
            levels.max().unwrap_or(1)
        }
        Some(Propagation::Levels(levels)) => levels.count(),
        _ => grids.len() as u32,
    }
}

/// What is drawn of the cells of these grids, outermost first.
pub struct Structure<'s> {
    /// The grids.
    pub grids: &'s [Cells],
    /// How far off the surface light is looked up (cells).
    pub shift: f32,
    /// Cells over which a grid goes over into the one around it.
    pub blend: f32,
    /// The finest level that is shown.
    pub from: u32,
}

impl Structure<'_> {
    /// Adds the pass that draws them: colours, and in alpha the level from 1 on.
    pub fn draw(&self, frame: &mut Frame, gbuffer: &GBuffer, seen: &Arc<Image>) {
        let Some(cells) = self.grids.first() else {
            return;
        };
        match &*cells.propagation {
            Propagation::Leaves(sweep) => self.draw_leaves(frame, (cells, sweep), gbuffer, seen),
            Propagation::Levels(levels) => self.draw_levels(frame, (cells, levels), gbuffer, seen),
            _ => frame
                .pass(&GRID_STRUCTURE)
                .bind("view_depth", &gbuffer.view_depth)
                .bind("normals", &gbuffer.normals)
                .bind("seen", seen)
                .constant("LEVELS", self.grids.len() as u32)
                .push(&GridStructureParams {
                    grid: cells.grid.row(0),
                    inner: inner_places(self.grids),
                    shift: self.shift,
                    blend: self.blend,
                    from: self.from,
                })
                .dispatch(screen_groups(gbuffer.size)),
        }
    }

    fn draw_leaves(
        &self,
        frame: &mut Frame,
        (cells, sweep): (&Cells, &LeafSweep),
        gbuffer: &GBuffer,
        seen: &Arc<Image>,
    ) {
        let (Some(of_cell), Some(words)) = (sweep.of_cell(), sweep.words()) else {
            return;
        };
        frame
            .pass(&LEAF_STRUCTURE)
            .bind("leaf_of", of_cell)
            .bind("leaves", words)
            .bind("view_depth", &gbuffer.view_depth)
            .bind("normals", &gbuffer.normals)
            .bind("seen", seen)
            .push(&LeafStructureParams {
                grid: cells.grid.row(0),
                shift: self.shift,
                from: self.from,
            })
            .dispatch(screen_groups(gbuffer.size));
    }

    fn draw_levels(
        &self,
        frame: &mut Frame,
        (cells, levels): (&Cells, &Levels),
        gbuffer: &GBuffer,
        seen: &Arc<Image>,
    ) {
        let mut pass = frame.pass(&LEVEL_STRUCTURE);
        for (level, name) in SUMS.into_iter().enumerate() {
            // What is beyond the last is not read.
            pass = pass.bind(name, levels.sum(level));
        }
        pass.bind("view_depth", &gbuffer.view_depth)
            .bind("normals", &gbuffer.normals)
            .bind("seen", seen)
            .constant("FINEST", levels.transfer == Transfer::Mean)
            .push(&LevelStructureParams {
                grid: cells.grid.row(0),
                shift: self.shift,
                from: self.from,
                count: levels.count(),
            })
            .dispatch(screen_groups(gbuffer.size));
    }
}
