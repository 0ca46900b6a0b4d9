//! Lobes in a full octree (Olovsson 2012, §4.2): grids of n, n/2, … 2 cells a side over one box,
//! each handed on alone. As published, and repaired.

use glam::{DVec4, UVec3};

use super::lobes::{Lobe, Steps, propagate, step};
use crate::gi::lpv::CellGrid;
pub use crate::gi::lpv::levels::grids as levels;

/// What a cell without light has.
const DARK: Lobe = [DVec4::ZERO; 4];

/// The cell of a place in lists of all cells.
pub(crate) fn cell_at(grid: &CellGrid, index: usize) -> UVec3 {
    let (index, size) = (index as u32, grid.size);
    UVec3::new(
        index % size.x,
        index / size.x % size.y,
        index / (size.x * size.y),
    )
}

/// The children of a cell of a level that are in the finer one.
fn children(fine: &CellGrid, parent: UVec3) -> impl Iterator<Item = usize> {
    (0..8u32).filter_map(move |corner| {
        let child = 2 * parent + UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
        child.cmplt(fine.size).all().then(|| fine.index(child))
    })
}

fn of_children(fine: &CellGrid, coarse: &CellGrid, cells: &[Lobe], factor: f64) -> Vec<Lobe> {
    let parent = |index| {
        let mut sum = DARK;
        for child in children(fine, cell_at(coarse, index)) {
            for (sum, own) in sum.iter_mut().zip(&cells[child]) {
                *sum += factor * *own;
            }
        }
        sum
    };
    (0..coarse.count() as usize).map(parent).collect()
}

/// Mean of the eight children (11), which is right for fields of I/h² and wrong for what is
/// injected.
pub fn mean_of_children(fine: &CellGrid, coarse: &CellGrid, cells: &[Lobe]) -> Vec<Lobe> {
    of_children(fine, coarse, cells, 1.0 / 8.0)
}

/// I of the eight children together over the parent's (2h)²: twice their mean. The flux stays.
pub fn sum_of_children(fine: &CellGrid, coarse: &CellGrid, cells: &[Lobe]) -> Vec<Lobe> {
    of_children(fine, coarse, cells, 1.0 / 4.0)
}

/// Opaque faces of the next level. A segment between two centres crosses a fine face in the middle,
/// and has one at either end; the lower of the two is its own, so that no wall is lost or doubled.
/// It is opaque where any of its four columns is: what is closed stays closed, and a door that is
/// narrower than a coarse cell closes. But a coarse cell that a wall goes through has the light of
/// both its sides.
pub fn coarse_faces(fine: &CellGrid, coarse: &CellGrid, faces: &[u32]) -> Vec<u32> {
    let is_opaque = |cell: UVec3, axis: usize| {
        let at = |cell: UVec3| {
            let is_inside = cell.cmplt(fine.size).all();
            is_inside && faces[fine.index(cell)] >> (2 * axis + 1) & 1 == 1
        };
        let mut next = cell;
        next[axis] += 1;
        at(cell) || at(next)
    };
    let mut words = vec![0; coarse.count() as usize];
    for index in 0..words.len() {
        let cell = cell_at(coarse, index);
        for axis in 0..3 {
            let is_blocked = |column: u32| {
                let mut low = 2 * cell;
                low[(axis + 1) % 3] += column & 1;
                low[(axis + 2) % 3] += column >> 1;
                is_opaque(low, axis)
            };
            if !(0..4).any(is_blocked) {
                continue;
            }
            words[index] |= 1 << (2 * axis + 1);
            let mut next = cell;
            next[axis] += 1;
            if next.cmplt(coarse.size).all() {
                words[coarse.index(next)] |= 1 << (2 * axis);
            }
        }
    }
    // The border below the first cell is between no two cells of the grid.
    for (word, index) in words.iter_mut().zip(0..) {
        let cell = cell_at(coarse, index);
        for axis in (0..3).filter(|axis| cell[*axis] == 0) {
            let is_blocked = |child: usize| {
                cell_at(fine, child)[axis] == 0 && faces[child] >> (2 * axis) & 1 == 1
            };
            *word |= u32::from(children(fine, cell).any(is_blocked)) << (2 * axis);
        }
    }
    words
}

/// As published: each level has the mean of its children's source, and is handed on alone. The sum
/// of all steps of each level.
pub fn published(grids: &[CellGrid], steps: &[Steps<'_>], first: &[Lobe]) -> Vec<Vec<Lobe>> {
    let mut source = first.to_vec();
    let mut fields = Vec::new();
    for (level, grid) in grids.iter().enumerate() {
        if level > 0 {
            source = mean_of_children(&grids[level - 1], grid, &source);
        }
        fields.push(propagate(grid, &steps[level], &source));
    }
    fields
}

/// What [`repaired`] finds.
#[derive(Clone, Debug, PartialEq)]
pub struct Repaired {
    /// What the steps of each level have brought its cells. Added up they are the light.
    pub fields: Vec<Vec<Lobe>>,
    /// What each level still has on its way after its last step. The next one takes it over.
    pub residuals: Vec<Vec<Lobe>>,
}

/// Repaired: what is left on its way after the steps of a level is, summed over children, the
/// source of the next one. The finer level has counted it where it is, so the coarser one counts
/// only what its steps bring.
pub fn repaired(grids: &[CellGrid], steps: &[Steps<'_>], first: &[Lobe]) -> Repaired {
    let (mut fields, mut residuals) = (Vec::new(), Vec::<Vec<Lobe>>::new());
    let mut number = 0;
    for (level, grid) in grids.iter().enumerate() {
        let (mut field, mut before) = if level == 0 {
            (first.to_vec(), first.to_vec())
        } else {
            let source = sum_of_children(&grids[level - 1], grid, &residuals[level - 1]);
            (vec![DARK; source.len()], source)
        };
        for _ in 0..steps[level].settings.iterations {
            // One count for all levels: the light of outside comes in once.
            number += 1;
            before = step(grid, &steps[level], &before, number);
            add(&mut field, &before);
        }
        fields.push(field);
        residuals.push(before);
    }
    Repaired { fields, residuals }
}

/// Adds lists of cells.
pub(crate) fn add(to: &mut [Lobe], more: &[Lobe]) {
    for (sum, own) in to.iter_mut().zip(more) {
        for (sum, own) in sum.iter_mut().zip(own) {
            *sum += *own;
        }
    }
}

/// The index volume: of each of the finest cells, the finest level that has any light there. The
/// last level where none has.
pub fn index_volume(grids: &[CellGrid], fields: &[Vec<Lobe>]) -> Vec<u32> {
    let finest = &grids[0];
    let has_light = |lobe: &Lobe| lobe.iter().any(|c| c.truncate() != glam::DVec3::ZERO);
    let index = |index| {
        let cell = cell_at(finest, index);
        let lit = grids
            .iter()
            .zip(fields)
            .enumerate()
            .position(|(level, (grid, field))| has_light(&field[grid.index(cell >> level as u32)]));
        lit.unwrap_or(grids.len() - 1) as u32
    };
    (0..finest.count() as usize).map(index).collect()
}

/// S (10): each of the finest cells as the level that the index volume names has it.
pub fn merge_finest(grids: &[CellGrid], fields: &[Vec<Lobe>]) -> Vec<Lobe> {
    let index = index_volume(grids, fields);
    let sampled = |(at, &level): (usize, &u32)| {
        let grid = &grids[level as usize];
        fields[level as usize][grid.index(cell_at(&grids[0], at) >> level)]
    };
    index.iter().enumerate().map(sampled).collect()
}

/// All levels together on the finest cells.
pub fn merge_sum(grids: &[CellGrid], fields: &[Vec<Lobe>]) -> Vec<Lobe> {
    let mut merged = fields[0].clone();
    for (level, (grid, field)) in (0u32..).zip(grids.iter().zip(fields)).skip(1) {
        for (at, sum) in merged.iter_mut().enumerate() {
            let coarse = &field[grid.index(cell_at(&grids[0], at) >> level)];
            add(std::slice::from_mut(sum), std::slice::from_ref(coarse));
        }
    }
    merged
}
