//! Twin of `lpv.slices`, with the same account of the flux as the sweep's.

use glam::{DVec3, DVec4, UVec3};

use super::sweep::{Boundary, Ledger, Swept, face, neighbour, upwind_order};
use crate::gi::lpv::slices::dominant_axis;
use crate::gi::lpv::{CellGrid, Directions};
use crate::gi::shared::sh;

/// All orders of three axes.
const ORDERS: [[usize; 3]; 6] = [
    [0, 1, 2],
    [0, 2, 1],
    [1, 0, 2],
    [1, 2, 0],
    [2, 0, 1],
    [2, 1, 0],
];

/// Where a path of steps to neighbours comes to.
enum End {
    /// All the way.
    Cell(UVec3),
    /// An opaque face of a cell, seen from it.
    Opaque(usize, u32),
    /// The border, through a face of a cell.
    Border(usize, u32),
}

/// From a cell along some axes, up- or downwind.
fn path(
    grid: &CellGrid,
    faces: &[u32],
    (from, direction): (UVec3, DVec3),
    axes: impl Iterator<Item = usize>,
    is_upwind: bool,
) -> End {
    let mut cell = from;
    for axis in axes {
        let (index, face) = (grid.index(cell), face(direction, axis, is_upwind));
        if faces[index] >> face & 1 == 1 {
            return End::Opaque(index, face);
        }
        match neighbour(grid, cell, face) {
            Some(next) => cell = next,
            None => return End::Border(index, face),
        }
    }
    End::Cell(cell)
}

/// The paths of a cell along a direction, with their shares, which are 1 together: to each of four
/// cells by its bilinear weight, and by each order of the axes that they differ in alike.
fn paths(direction: DVec3) -> Vec<(f64, Vec<usize>)> {
    let steepest = dominant_axis(direction);
    let across = (direction / direction[steepest]).abs();
    let mut all = Vec::new();
    for corner in 0..8usize {
        let has = |axis: usize| corner >> axis & 1 == 1;
        if !has(steepest) {
            continue;
        }
        let share: f64 = (0..3)
            .filter(|axis| *axis != steepest)
            .map(|axis| {
                if has(axis) {
                    across[axis]
                } else {
                    1.0 - across[axis]
                }
            })
            .product();
        // Orders of three axes have each order of fewer ones alike often.
        all.extend(ORDERS.map(|order| {
            let order = order.into_iter().filter(|axis| has(*axis)).collect();
            (share / 6.0, order)
        }));
    }
    all
}

/// Radiance of all cells along one direction (W/(m² sr)), slice by slice.
fn field(grid: &CellGrid, boundary: &Boundary<'_>, direction: DVec3) -> Vec<DVec4> {
    let steepest = direction[dominant_axis(direction)].abs();
    let paths = paths(direction);
    let mut field = vec![DVec4::ZERO; grid.count() as usize];
    // A slice's cells do not read each other, so that the upwind order of cells is one of slices.
    for cell in upwind_order(grid.size, direction) {
        let index = grid.index(cell);
        let mut radiance = (boundary.source)(index, direction) / steepest;
        for (share, axes) in &paths {
            let axes = axes.iter().copied();
            radiance += *share
                * match path(grid, boundary.faces, (cell, direction), axes, true) {
                    End::Cell(from) => field[grid.index(from)],
                    End::Opaque(at, face) => (boundary.side)(at, face),
                    End::Border(at, face) => (boundary.inflow)(at, face, direction),
                };
        }
        field[index] = radiance;
    }
    field
}

/// The `field` of every direction.
pub fn slices(grid: &CellGrid, directions: &Directions, boundary: &Boundary<'_>) -> Swept {
    let mut swept = Swept {
        light: vec![[DVec4::ZERO; 9]; grid.count() as usize],
        ledger: Ledger::default(),
    };
    let face_m2 = f64::from(grid.cell_size).powi(2);
    for &(direction, weight) in &directions.all {
        let field = field(grid, boundary, direction);
        let mut basis = [0.0; 9];
        sh::evaluate(3, -direction, &mut basis);
        let through = weight * face_m2 * direction[dominant_axis(direction)].abs();
        let paths = paths(direction);
        for cell in upwind_order(grid.size, direction) {
            let index = grid.index(cell);
            for (sum, basis) in swept.light[index].iter_mut().zip(basis) {
                *sum += weight * basis * field[index];
            }
            let ledger = &mut swept.ledger;
            ledger.injected += weight * face_m2 * (boundary.source)(index, direction);
            for (share, axes) in &paths {
                let axes = || axes.iter().copied();
                let part = through * *share;
                match path(grid, boundary.faces, (cell, direction), axes(), true) {
                    End::Cell(_) => {}
                    End::Opaque(at, face) => ledger.injected += part * (boundary.side)(at, face),
                    End::Border(at, face) => {
                        ledger.entered += part * (boundary.inflow)(at, face, direction);
                    }
                }
                match path(grid, boundary.faces, (cell, direction), axes(), false) {
                    End::Cell(_) => {}
                    End::Opaque(..) => ledger.absorbed += part * field[index],
                    End::Border(..) => ledger.left += part * field[index],
                }
            }
        }
    }
    swept
}
