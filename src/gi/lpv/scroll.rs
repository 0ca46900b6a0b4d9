//! Opaque faces of a grid that moves through its lattice: cells that stay keep theirs.
//!
//! The result is, bit for bit, what finding all faces anew gives, but for the order of the list of
//! sides.

use std::sync::Arc;

use glam::{IVec3, UVec3};

use super::faces::{CellBox, FACES, Faces, words};
use super::grid::{CellGrid, GridRow};
use crate::gpu_struct;
use crate::graph::{Access, Binding, Buffer, Error, Frame, FrameStats, Gpu, Pass};
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
    sides: Option<Arc<Buffer>>,
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
    /// Moves the grid through its lattice, and finds the faces of the cells that come into it.
    pub fn follow(
        &mut self,
        gpu: &Gpu,
        scene: &GpuScene,
        grid: CellGrid,
    ) -> Result<FrameStats, Error> {
        let shift = grid.first - self.grid.first;
        self.grid = grid;
        if shift == IVec3::ZERO {
            return Ok(FrameStats::default());
        }
        let Some(boxes) = new_boxes(grid.size, shift) else {
            return self.find(gpu, scene);
        };
        let params = ShiftParams {
            grid: grid.row(0),
            shift: shift.extend(0).to_array(),
        };
        let groups = [grid.count().div_ceil(64), 1, 1];
        let spare = match self.before.take() {
            Some(before) => before,
            None => Before {
                words: words(gpu, "lpv.old_faces", grid.count())?,
                sides: None,
            },
        };
        let old_words = std::mem::replace(&mut self.words, spare.words);
        let mut frame = Frame::new();
        frame.set_scene(&scene.set, &scene.materials);
        frame
            .pass(&SHIFT_FACES)
            .bind("old_faces", &old_words)
            .bind("faces", &self.words)
            .push(&params)
            .dispatch(groups);
        self.rasterize(&mut frame, scene, &FACES, &[("faces", &self.words)], &boxes);
        let old_sides = self.sides.as_ref().map(|sides| Arc::clone(&sides.list));
        let mut stats = self.number_sides(gpu, frame)?;
        if let (Some(sides), Some(old_sides)) = (&mut self.sides, &old_sides) {
            if Arc::ptr_eq(&sides.list, old_sides) {
                let bytes = old_sides.size_bytes();
                sides.list = match spare.sides.filter(|list| list.size_bytes() == bytes) {
                    Some(list) => list,
                    None => words(gpu, "lpv.old_sides", (bytes / 4) as u32)?,
                };
            }
            let mut frame = Frame::new();
            frame.set_scene(&scene.set, &scene.materials);
            frame
                .pass(&SHIFT_SIDES)
                .bind("old_faces", &old_words)
                .bind("faces", &self.words)
                .bind("old_sides", old_sides)
                .bind("sides", &sides.list)
                .push(&params)
                .dispatch(groups);
            self.note_surfaces(&mut frame, scene, &boxes);
            stats.append(gpu.submit(frame)?);
        }
        self.before = Some(Before {
            words: old_words,
            sides: old_sides,
        });
        Ok(stats)
    }
}
