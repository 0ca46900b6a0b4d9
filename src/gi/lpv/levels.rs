//! Lobes in a full octree (Olovsson 2012, §4.2): grids of n, n/2, … 2 cells a side over one box. As
//! published each is handed on alone; repaired, each hands what is left to the next.

use std::sync::Arc;

use glam::{UVec3, Vec3};

use super::faces::{Faces, words};
use super::grid::{CellGrid, GridRow};
use super::inflow::Inflow;
use super::light::Light;
use super::lobes::{LobeSettings, Lobes, Occlusion, groups};
use crate::gi::Settings;
use crate::gpu_struct;
use crate::graph::{Access, Binding, Buffer, Error, Frame, Gpu, Image, Pass};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.level_faces` and `lpv.merge_levels`.
    pub struct LevelParams {
        /// A level.
        pub fine: GridRow,
        /// The next.
        pub coarse: GridRow,
    }
}

gpu_struct! {
    /// Parameters of `lpv.down_sample`.
    pub struct DownSampleParams {
        /// A level.
        pub fine: GridRow,
        /// The next.
        pub coarse: GridRow,
        /// The last step that has been done.
        pub step: u32,
    }
}

/// Opaque faces of the next level. A thread a cell of it.
pub static LEVEL_FACES: Pass = Pass::compute(
    "lpv.level_faces",
    "gi/lpv/levels/faces.comp",
    &[
        Binding::buffer("fine_faces", Access::ComputeRead),
        Binding::buffer("faces", Access::ComputeWrite),
    ],
    LevelParams::LAYOUT,
);

/// What the next level begins with. A thread a cell of it.
pub static DOWN_SAMPLE: Pass = Pass {
    constants: &["RESIDUAL"],
    ..Pass::compute(
        "lpv.down_sample",
        "gi/lpv/levels/down_sample.comp",
        &[
            Binding::image("fine_lobes", Access::ComputeRead),
            Binding::image("lobes", Access::ComputeWrite),
            Binding::image("sum", Access::ComputeWrite),
        ],
        DownSampleParams::LAYOUT,
    )
};

/// What all coarser levels have, into a level. A thread a cell of it.
pub static MERGE_LEVELS: Pass = Pass {
    constants: &["FINEST"],
    ..Pass::compute(
        "lpv.merge_levels",
        "gi/lpv/levels/merge.comp",
        &[
            Binding::image("coarse_sum", Access::ComputeRead),
            Binding::image("sum", Access::ComputeReadWrite),
        ],
        LevelParams::LAYOUT,
    )
};

/// What a level begins with, and how levels become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transfer {
    /// The mean of its children's source; the finest level that has light counts. As published.
    Mean,
    /// The sum of what its children have left after their steps; levels add up. Repaired.
    Residual,
}

impl Transfer {
    /// As the technique's settings say.
    pub fn new(settings: &Settings) -> Self {
        if settings.is("transfer", "residual") {
            Transfer::Residual
        } else {
            Transfer::Mean
        }
    }
}

/// The grids of all levels, the finest first; the last has two cells or fewer along each axis. A
/// level of an odd number of cells ends half a coarse cell before its next one does.
pub fn grids(finest: CellGrid) -> Vec<CellGrid> {
    let mut grids = vec![finest];
    let mut grid = finest;
    while grid.size.max_element() > 2 {
        grid = CellGrid {
            cell_size: 2.0 * grid.cell_size,
            size: (grid.size + 1) / 2,
            ..grid
        };
        grids.push(grid);
    }
    grids
}

/// A level but the finest.
struct Level {
    /// Its opaque faces, where they stop light.
    faces: Option<Arc<Buffer>>,
    lobes: Lobes,
}

/// Lobes of all levels of an octree.
pub struct Levels {
    pub(super) transfer: Transfer,
    iterations: u32,
    finest: Lobes,
    coarser: Vec<Level>,
}

impl Levels {
    /// Takes what comes in from another environment, or at another scale.
    pub fn set_inflow(&self, gpu: &Gpu, inflow: Inflow<'_>) -> Result<(), Error> {
        let coarser = self.coarser.iter().map(|level| &level.lobes);
        std::iter::once(&self.finest)
            .chain(coarser)
            .try_for_each(|lobes| lobes.set_inflow(gpu, inflow))
    }

    /// Allocates.
    pub fn new(
        gpu: &Gpu,
        size: UVec3,
        (settings, occlusion): (LobeSettings, Occlusion),
        transfer: Transfer,
        inflow: Inflow<'_>,
    ) -> Result<Self, Error> {
        let stops = occlusion == Occlusion::Faces;
        let level = |grid: &CellGrid| {
            let faces = || words(gpu, "lpv.faces", grid.count());
            Ok(Level {
                faces: stops.then(faces).transpose()?,
                lobes: Lobes::new(gpu, grid.size, settings, occlusion, inflow)?,
            })
        };
        let grids = grids(CellGrid::new(Vec3::ZERO, 1.0, size));
        Ok(Levels {
            transfer,
            iterations: settings.iterations,
            finest: Lobes::new(gpu, size, settings, occlusion, inflow)?,
            coarser: grids[1..].iter().map(level).collect::<Result<_, Error>>()?,
        })
    }

    /// How many levels there are.
    pub fn count(&self) -> u32 {
        1 + self.coarser.len() as u32
    }

    /// What the lookup has of a level and those above it; of the coarsest beyond that.
    pub(super) fn sum(&self, level: usize) -> &Arc<Image> {
        let last = self.coarser.len();
        let coarser = level.min(last).checked_sub(1);
        coarser.map_or(&self.finest.sum, |at| &self.coarser[at].lobes.sum)
    }

    /// Opaque faces of each level but the finest, where they stop light.
    pub fn faces(&self) -> impl Iterator<Item = &Arc<Buffer>> {
        self.coarser.iter().filter_map(|level| level.faces.as_ref())
    }

    /// Adds the passes that find the opaque faces of all levels from those of the finest.
    pub(super) fn find_faces(&self, frame: &mut Frame, faces: &Faces) {
        let mut fine_faces = &faces.words;
        for (pair, coarse_faces) in grids(faces.grid).windows(2).zip(self.faces()) {
            frame
                .pass(&LEVEL_FACES)
                .bind("fine_faces", fine_faces)
                .bind("faces", coarse_faces)
                .push(&LevelParams {
                    fine: pair[0].row(0),
                    coarse: pair[1].row(0),
                })
                .dispatch(groups(&pair[1]));
            fine_faces = coarse_faces;
        }
    }

    /// Adds the passes that bring the flux of all cells (integers of `flux_unit`, W), and the light
    /// of the sides of all opaque faces, to the cells that it reaches.
    pub fn run(&self, frame: &mut Frame, faces: &Faces, flux: (&Arc<Buffer>, f32), light: &Light) {
        let grids = grids(faces.grid);
        let lobes = |level: usize| match level {
            0 => &self.finest,
            _ => &self.coarser[level - 1].lobes,
        };
        let level_faces = |level: usize| match level {
            0 => &faces.words,
            // Nothing is read where faces do not stop light.
            _ => self.coarser[level - 1]
                .faces
                .as_ref()
                .unwrap_or(&faces.words),
        };
        let is_residual = self.transfer == Transfer::Residual;
        let down_sample = |frame: &mut Frame, level: usize, step: u32| {
            frame
                .pass(&DOWN_SAMPLE)
                .bind("fine_lobes", &lobes(level - 1).lobes)
                .bind("lobes", &lobes(level).lobes)
                .bind("sum", &lobes(level).sum)
                .constant("RESIDUAL", is_residual)
                .push(&DownSampleParams {
                    fine: grids[level - 1].row(0),
                    coarse: grids[level].row(0),
                    step,
                })
                .dispatch(groups(&grids[level]));
        };
        self.finest.seed(frame, faces, flux);
        if !is_residual {
            // Before the steps, which overwrite what levels begin with.
            (1..grids.len()).for_each(|level| down_sample(frame, level, 0));
        }
        for (level, grid) in grids.iter().enumerate() {
            // One count for all levels where light goes from one to the next: that of outside
            // comes in once.
            let done = if is_residual {
                level as u32 * self.iterations
            } else {
                0
            };
            if is_residual && level > 0 {
                down_sample(frame, level, done);
            }
            lobes(level).step(frame, (grid, level_faces(level)), done, &light.low);
        }
        for level in (1..grids.len()).rev() {
            frame
                .pass(&MERGE_LEVELS)
                .bind("coarse_sum", &lobes(level).sum)
                .bind("sum", &lobes(level - 1).sum)
                .constant("FINEST", !is_residual)
                .push(&LevelParams {
                    fine: grids[level - 1].row(0),
                    coarse: grids[level].row(0),
                })
                .dispatch(groups(&grids[level - 1]));
        }
        self.finest.finish(frame, &grids[0], light);
    }
}
