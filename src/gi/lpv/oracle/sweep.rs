//! Twin of `lpv.sweep`, with an account of where the light has gone.

use glam::{DVec3, DVec4, UVec3};

use crate::gi::lpv::{CellGrid, Directions};
use crate::gi::shared::sh;

/// What comes in where a cell has no upwind neighbour, and what starts in it. All radiance is rgb
/// and, in alpha, that of an environment of radiance 1 (W/(m² sr)).
pub struct Boundary<'b> {
    /// Opaque faces of all cells, six bits each.
    pub faces: &'b [u32],
    /// What an opaque face (0 to 5) of a cell sends into it.
    pub side: &'b dyn Fn(usize, u32) -> DVec4,
    /// What comes to a cell through a face (0 to 5) at the border along a direction.
    pub inflow: &'b dyn Fn(usize, u32, DVec3) -> DVec4,
    /// Q: what a cell sends along a direction, as flux over projected area h².
    pub source: &'b dyn Fn(usize, DVec3) -> DVec4,
}

/// Where light has gone, by channel (W).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ledger {
    /// By sources and by opaque faces.
    pub injected: DVec4,
    /// Through the border, inwards.
    pub entered: DVec4,
    /// By opaque faces.
    pub absorbed: DVec4,
    /// Through the border, outwards.
    pub left: DVec4,
}

impl Ledger {
    /// What is in no other account (W).
    pub fn lost(&self) -> DVec4 {
        self.injected + self.entered - self.absorbed - self.left
    }
}

/// The light of all cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Swept {
    /// Nine coefficients each, of the directions that light comes from (W/(m² sr)).
    pub light: Vec<[DVec4; 9]>,
    /// Where it has gone.
    pub ledger: Ledger,
}

/// The face of a cell towards its neighbour along an axis, up- or downwind of a direction.
pub(super) fn face(direction: DVec3, axis: usize, is_upwind: bool) -> u32 {
    2 * axis as u32 + u32::from((direction[axis] < 0.0) == is_upwind)
}

/// The neighbour of a cell through a face; `None` where the border is.
pub(crate) fn neighbour(grid: &CellGrid, cell: UVec3, face: u32) -> Option<UVec3> {
    let axis = (face / 2) as usize;
    let mut next = cell;
    next[axis] = if face.is_multiple_of(2) {
        cell[axis].checked_sub(1)?
    } else {
        cell[axis] + 1
    };
    (next[axis] < grid.size[axis]).then_some(next)
}

/// What a cell sends along a direction, from what its upwind neighbours have sent.
fn sent(
    grid: &CellGrid,
    boundary: &Boundary<'_>,
    cell: UVec3,
    direction: DVec3,
    of: impl Fn(usize) -> DVec4,
) -> DVec4 {
    let index = grid.index(cell);
    let mut sum = (boundary.source)(index, direction);
    for axis in 0..3 {
        let face = face(direction, axis, true);
        let arriving = if boundary.faces[index] >> face & 1 == 1 {
            (boundary.side)(index, face)
        } else {
            let next = neighbour(grid, cell, face);
            let inflow = || (boundary.inflow)(index, face, direction);
            next.map_or_else(inflow, |next| of(grid.index(next)))
        };
        sum += direction[axis].abs() * arriving;
    }
    sum / direction.abs().element_sum()
}

/// All cells, in the order in which a direction meets them.
pub(super) fn upwind_order(size: UVec3, direction: DVec3) -> impl Iterator<Item = UVec3> {
    let along = move |axis: usize, step: u32| {
        if direction[axis] < 0.0 {
            size[axis] - 1 - step
        } else {
            step
        }
    };
    (0..size.element_product()).map(move |at| {
        let (x, y, z) = (at % size.x, at / size.x % size.y, at / (size.x * size.y));
        UVec3::new(along(0, x), along(1, y), along(2, z))
    })
}

/// Radiance of all cells along one direction (W/(m² sr)), each cell once, in upwind order.
pub fn field(grid: &CellGrid, boundary: &Boundary<'_>, direction: DVec3) -> Vec<DVec4> {
    let mut field = vec![DVec4::ZERO; grid.count() as usize];
    for cell in upwind_order(grid.size, direction) {
        field[grid.index(cell)] = sent(grid, boundary, cell, direction, |at| field[at]);
    }
    field
}

/// The [`field`] of every direction.
pub fn sweep(grid: &CellGrid, directions: &Directions, boundary: &Boundary<'_>) -> Swept {
    summed(grid, directions, boundary, |direction| {
        field(grid, boundary, direction)
    })
}

/// All cells at once, from what the step before has left, `steps` times.
pub fn jacobi(
    grid: &CellGrid,
    directions: &Directions,
    boundary: &Boundary<'_>,
    steps: u32,
) -> Swept {
    let field = |direction: DVec3| {
        let mut field = vec![DVec4::ZERO; grid.count() as usize];
        for _ in 0..steps {
            let before = field.clone();
            for cell in upwind_order(grid.size, direction) {
                field[grid.index(cell)] = sent(grid, boundary, cell, direction, |at| before[at]);
            }
        }
        field
    };
    summed(grid, directions, boundary, field)
}

fn summed(
    grid: &CellGrid,
    directions: &Directions,
    boundary: &Boundary<'_>,
    field_of: impl Fn(DVec3) -> Vec<DVec4>,
) -> Swept {
    let mut swept = Swept {
        light: vec![[DVec4::ZERO; 9]; grid.count() as usize],
        ledger: Ledger::default(),
    };
    let face_m2 = f64::from(grid.cell_size).powi(2);
    for &(direction, weight) in &directions.all {
        let field = field_of(direction);
        let mut basis = [0.0; 9];
        sh::evaluate(3, -direction, &mut basis);
        for cell in upwind_order(grid.size, direction) {
            let index = grid.index(cell);
            for (sum, basis) in swept.light[index].iter_mut().zip(basis) {
                *sum += weight * basis * field[index];
            }
            let ledger = &mut swept.ledger;
            ledger.injected += weight * face_m2 * (boundary.source)(index, direction);
            for axis in 0..3 {
                let through = weight * face_m2 * direction[axis].abs();
                let is_opaque = |face: u32| boundary.faces[index] >> face & 1 == 1;
                let (up, down) = (face(direction, axis, true), face(direction, axis, false));
                if is_opaque(up) {
                    ledger.injected += through * (boundary.side)(index, up);
                } else if neighbour(grid, cell, up).is_none() {
                    ledger.entered += through * (boundary.inflow)(index, up, direction);
                }
                if is_opaque(down) {
                    ledger.absorbed += through * field[index];
                } else if neighbour(grid, cell, down).is_none() {
                    ledger.left += through * field[index];
                }
            }
        }
    }
    swept
}
