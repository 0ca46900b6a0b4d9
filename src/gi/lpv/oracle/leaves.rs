//! Twin of the octree's passes: which block each cell is in, and the sweep over blocks.

use std::collections::BTreeMap;

use glam::{DVec3, DVec4, IVec3, UVec3};

use super::sweep::{Boundary, Ledger, Swept, face};
use crate::gi::lpv::leaves::{Leaf, LeafSettings};
use crate::gi::lpv::{CellGrid, Directions};
use crate::gi::shared::sh;

/// The leaf that a cell is in: the largest block around it without an opaque face in itself and the
/// `guard` blocks around it, all of whose larger blocks are divided.
pub fn leaf_of(grid: &CellGrid, faces: &[u32], settings: LeafSettings, cell: UVec3) -> Leaf {
    let levels = (0..=settings.max_level).rev();
    let mut found = levels.map(|level| Leaf {
        corner: cell >> level << level,
        level,
    });
    let is_free = |leaf: &Leaf| {
        let reach = (settings.guard * leaf.size()) as i32;
        let low = (leaf.corner.as_ivec3() - reach).max(IVec3::ZERO);
        let end = leaf.corner.as_ivec3() + leaf.size() as i32 + reach;
        let mut cells = cells_of(low, end.min(grid.size.as_ivec3()));
        leaf.level == 0 || cells.all(|cell| faces[grid.index(cell.as_uvec3())] & 63 == 0)
    };
    found.find(is_free).unwrap_or(Leaf {
        corner: cell,
        level: 0,
    })
}

fn is_inside(grid: &CellGrid, cell: IVec3) -> bool {
    cell.cmpge(IVec3::ZERO).all() && cell.cmplt(grid.size.as_ivec3()).all()
}

fn cells_of(low: IVec3, end: IVec3) -> impl Iterator<Item = IVec3> {
    let range = move |axis: usize| low[axis]..end[axis];
    range(2)
        .flat_map(move |z| range(1).flat_map(move |y| range(0).map(move |x| IVec3::new(x, y, z))))
}

/// Radiance along one direction, of leaves by their corners.
struct Field<'f> {
    grid: &'f CellGrid,
    boundary: &'f Boundary<'f>,
    leaf_of: &'f [Leaf],
    direction: DVec3,
    known: BTreeMap<[u32; 3], DVec4>,
}

impl Field<'_> {
    /// What a leaf sends, after all that it needs.
    fn of(&mut self, leaf: Leaf) -> DVec4 {
        if let Some(known) = self.known.get(&leaf.corner.to_array()) {
            return *known;
        }
        let mut sum = self.source(leaf);
        for axis in 0..3 {
            sum += self.direction[axis].abs() * self.through(leaf, axis);
        }
        let sent = sum / self.direction.abs().element_sum();
        self.known.insert(leaf.corner.to_array(), sent);
        sent
    }

    /// Q: flux of its cells over the area of its face.
    fn source(&self, leaf: Leaf) -> DVec4 {
        let low = leaf.corner.as_ivec3();
        let cells = cells_of(low, low + leaf.size() as i32);
        let cells = cells.filter(|cell| is_inside(self.grid, *cell));
        let of = |cell: IVec3| {
            let index = self.grid.index(cell.as_uvec3());
            (self.boundary.source)(index, self.direction)
        };
        cells.map(of).sum::<DVec4>() / f64::from(leaf.size()).powi(2)
    }

    /// The mean of what comes through the upwind face, cell face by cell face.
    fn through(&mut self, leaf: Leaf, axis: usize) -> DVec4 {
        let face = face(self.direction, axis, true);
        let (low, size) = (leaf.corner.as_ivec3(), leaf.size() as i32);
        let (mut first, mut end) = (low, low + size);
        if face.is_multiple_of(2) {
            end[axis] = first[axis] + 1;
        } else {
            first[axis] = end[axis] - 1;
        }
        let step = IVec3::AXES[axis] * if face.is_multiple_of(2) { -1 } else { 1 };
        let mut sum = DVec4::ZERO;
        for cell in cells_of(first, end) {
            let (inside, next) = (is_inside(self.grid, cell), cell + step);
            sum += if inside && self.is_opaque(cell, face) {
                (self.boundary.side)(self.grid.index(cell.as_uvec3()), face)
            } else {
                match self.leaf_around(next) {
                    Some(leaf) => self.of(leaf),
                    None => {
                        let last = self.grid.size.as_ivec3() - 1;
                        let near = cell.clamp(IVec3::ZERO, last).as_uvec3();
                        (self.boundary.inflow)(self.grid.index(near), face, self.direction)
                    }
                }
            };
        }
        sum / f64::from(size).powi(2)
    }

    /// The leaf that a place is in, outside of the grid too where one sticks out so far.
    fn leaf_around(&self, cell: IVec3) -> Option<Leaf> {
        let last = self.grid.size.as_ivec3() - 1;
        let near = cell.clamp(IVec3::ZERO, last).as_uvec3();
        let leaf = self.leaf_of[self.grid.index(near)];
        let end = leaf.corner.as_ivec3() + leaf.size() as i32;
        (cell.cmpge(IVec3::ZERO).all() && cell.cmplt(end).all()).then_some(leaf)
    }

    fn is_opaque(&self, cell: IVec3, face: u32) -> bool {
        self.boundary.faces[self.grid.index(cell.as_uvec3())] >> face & 1 == 1
    }
}

/// Each leaf once a direction; all cells of a leaf have its light. There is no account.
pub fn sweep_leaves(
    grid: &CellGrid,
    directions: &Directions,
    boundary: &Boundary<'_>,
    settings: LeafSettings,
) -> Swept {
    let cells = cells_of(IVec3::ZERO, grid.size.as_ivec3());
    let leaf_of: Vec<Leaf> = cells
        .map(|cell| leaf_of(grid, boundary.faces, settings, cell.as_uvec3()))
        .collect();
    let mut light = vec![[DVec4::ZERO; 9]; leaf_of.len()];
    for &(direction, weight) in &directions.all {
        let mut field = Field {
            grid,
            boundary,
            leaf_of: &leaf_of,
            direction,
            known: BTreeMap::new(),
        };
        let mut basis = [0.0; 9];
        sh::evaluate(3, -direction, &mut basis);
        for (cell, leaf) in light.iter_mut().zip(&leaf_of) {
            let radiance = field.of(*leaf);
            for (sum, basis) in cell.iter_mut().zip(basis) {
                *sum += weight * basis * radiance;
            }
        }
    }
    Swept {
        light,
        ledger: Ledger::default(),
    }
}
