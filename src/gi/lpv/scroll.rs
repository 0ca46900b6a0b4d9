//! Opaque faces of a grid that moves through its lattice: cells that stay keep theirs.
//!
//! The result is, bit for bit, what finding all faces anew gives, but for the order of the list of
//! sides.

use std::sync::Arc;

use glam::{IVec3, UVec3};

use super::faces::{CellBox, FACES, Faces, Search, words};
use super::grid::{CellGrid, GridRow};
use crate::gpu_struct;
use crate::graph::{Access, Binding, Buffer, Error, Frame, Gpu, Pass};
use crate::render::GpuScene;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.shift_faces` and `lpv.shift_sides`.
    pub struct ShiftParams {
        /// The grid, where it is now.
        pub grid: GridRow,
        /// xyz: cells that it has moved by; w: 0.
        pub shift: [i32; 4],
    }
}

/// Opaque faces of the cells that stay. A thread a cell.
pub static SHIFT_FACES: Pass = Pass::compute(
    "lpv.shift_faces",
    "gi/lpv/shift_faces.comp",
    &[
        Binding::buffer("old_faces", Access::ComputeRead),
        Binding::buffer("faces", Access::ComputeWrite),
    ],
    ShiftParams::LAYOUT,
);

/// Their sides, to their new places in the list. A thread a cell.
pub static SHIFT_SIDES: Pass = Pass::compute(
    "lpv.shift_sides",
    "gi/lpv/shift_sides.comp",
    &[
        Binding::buffer("old_faces", Access::ComputeRead),
        Binding::buffer("faces", Access::ComputeRead),
        Binding::buffer("old_sides", Access::ComputeRead),
        Binding::buffer("sides", Access::ComputeWrite),
    ],
    ShiftParams::LAYOUT,
);

/// What a grid had before it moved.
pub(super) struct Before {
    words: Arc<Buffer>,
    pub(super) sides: Option<Arc<Buffer>>,
}

/// A grid that moves through its lattice.
pub(super) struct Shifted {
    params: ShiftParams,
    /// What it had.
    pub(super) before: Before,
    /// A list of sides that nobody uses.
    spare: Option<Arc<Buffer>>,
}

/// The parts of a grid that were not in it before it moved by `shift` cells; `None` where nothing
/// was.
fn new_boxes(size: UVec3, shift: IVec3) -> Option<Vec<CellBox>> {
    if shift.abs().as_uvec3().cmpge(size).any() {
        return None;
    }
    let mut boxes = Vec::new();
    // What the boxes so far leave.
    let (mut low, mut end) = (UVec3::ZERO, size);
    for axis in (0..3).filter(|axis| shift[*axis] != 0) {
        let count = shift[axis].unsigned_abs();
        let (mut box_low, mut box_end) = (low, end);
        if shift[axis] > 0 {
            box_low[axis] = size[axis] - count;
            end[axis] = box_low[axis];
        } else {
            box_end[axis] = count;
            low[axis] = count;
        }
        boxes.push(CellBox {
            low: box_low,
            size: box_end - box_low,
        });
    }
    Some(boxes)
}

impl Faces {
    /// Moves the grid through its lattice, and adds the passes that find the faces of what
    /// comes into it; [`super::faces::finish`] is next. `None` where it has not moved.
    pub(super) fn follow(
        &mut self,
        gpu: &Gpu,
        frame: &mut Frame,
        scene: &GpuScene,
        grid: CellGrid,
    ) -> Result<Option<Search>, Error> {
        let shift = grid.first - self.grid.first;
        self.grid = grid;
        if shift == IVec3::ZERO {
            return Ok(None);
        }
        let Some(boxes) = new_boxes(grid.size, shift) else {
            return Ok(Some(self.search(frame, scene)));
        };
        let params = ShiftParams {
            grid: grid.row(0),
            shift: shift.extend(0).to_array(),
        };
        let spare = match self.before.take() {
            Some(before) => before,
            None => Before {
                words: words(gpu, "lpv.old_faces", grid.count())?,
                sides: None,
            },
        };
        let old_words = std::mem::replace(&mut self.words, spare.words);
        frame.set_scene(&scene.set, &scene.materials);
        frame
            .pass(&SHIFT_FACES)
            .bind("old_faces", &old_words)
            .bind("faces", &self.words)
            .push(&params)
            .dispatch([grid.count().div_ceil(64), 1, 1]);
        self.rasterize(frame, scene, &FACES, &[("faces", &self.words)], &boxes);
        let shifted = Shifted {
            params,
            before: Before {
                words: old_words,
                sides: None,
            },
            spare: spare.sides,
        };
        Ok(Some(Search {
            boxes,
            shifted: Some(shifted),
        }))
    }

    /// Adds the pass that moves the sides of cells that stay; returns what the grid had before.
    pub(super) fn shift_sides(
        &mut self,
        gpu: &Gpu,
        frame: &mut Frame,
        Shifted {
            params,
            before,
            spare,
        }: Shifted,
    ) -> Result<Before, Error> {
        let (Some(sides), Some(old_sides)) = (&mut self.sides, &before.sides) else {
            return Ok(before);
        };
        if Arc::ptr_eq(&sides.list, old_sides) {
            let bytes = old_sides.size_bytes();
            sides.list = match spare.filter(|list| list.size_bytes() == bytes) {
                Some(list) => list,
                None => words(gpu, "lpv.old_sides", (bytes / 4) as u32)?,
            };
        }
        frame
            .pass(&SHIFT_SIDES)
            .bind("old_faces", &before.words)
            .bind("faces", &self.words)
            .bind("old_sides", old_sides)
            .bind("sides", &sides.list)
            .push(&params)
            .dispatch([self.grid.count().div_ceil(64), 1, 1]);
        Ok(before)
    }
}
