//! Where the grids are.

use glam::{DVec3, IVec3, UVec3, Vec3};

use crate::gi::lpv::CellGrid;
use crate::gi::lpv::sweep::Nested;

/// Cells of an outer grid between its border and that of the grid inside it.
const BETWEEN: i32 = 1;

/// Most cells along a scene: their places stay exact in 32-bit numbers, with four steps in between.
const MOST_CELLS: f32 = (1 << 22) as f32;

/// Nested grids of one size, wherever they are: cells of each are half as large as those of the
/// grid around it, and two of them lie along one of its.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    /// Corner of cell (0, 0, 0) of every lattice (m).
    pub anchor: Vec3,
    /// Edge of an outermost cell (m).
    pub outermost_size: f32,
    /// Cells along an edge of each grid.
    pub resolution: u32,
    /// Number of grids.
    pub levels: u32,
    bounds: (Vec3, Vec3),
}

impl Layout {
    /// For a scene with these bounds (m) and finest cells of this size (m); 0: such that the
    /// outermost grid just holds the scene. Grids that are larger than the scene takes are left
    /// out.
    pub fn new(bounds: (Vec3, Vec3), resolution: u32, levels: u32, cell_size: f32) -> Self {
        let whole = CellGrid::around(bounds, resolution, 1).cell_size;
        let finest = if cell_size > 0.0 {
            let least = whole * resolution as f32 / MOST_CELLS;
            if cell_size < least {
                log::warn!(
                    "cell_size = {cell_size} is too fine for a scene of this extent; {least} m \
                     are taken"
                );
            }
            cell_size.max(least)
        } else {
            whole / (1 << (levels - 1)) as f32
        };
        let size_of = |level: u32| finest * (1 << level) as f32;
        let holding = (0..levels).find(|level| size_of(*level) >= whole);
        let levels = holding.map_or(levels, |level| level + 1);
        let outermost_size = size_of(levels - 1);
        Layout {
            anchor: 0.5 * (bounds.0 + bounds.1)
                - Vec3::splat(0.5 * outermost_size * resolution as f32),
            outermost_size,
            resolution,
            levels,
            bounds,
        }
    }

    /// The grids for a camera at `eye` (m), outermost first. The camera is in the middle, unless a
    /// grid would then reach beyond the scene. Grids move by two of their cells, which is one of
    /// the grid around them.
    pub fn grids(&self, eye: Vec3) -> Vec<CellGrid> {
        let n = self.resolution.cast_signed();
        let half = 0.5 * f64::from(n);
        let mut grids: Vec<CellGrid> = Vec::new();
        for level in 0..self.levels {
            let cell_size = self.outermost_size / (1 << level) as f32;
            let to_cells = |place: Vec3| (place - self.anchor).as_dvec3() / f64::from(cell_size);
            let [eye, low, high] = [eye, self.bounds.0, self.bounds.1].map(to_cells);
            let axis = |i: usize| {
                let (least, most) = (low[i] - 1.0 + half, high[i] + 1.0 - half);
                if least >= most {
                    0.5 * (low[i] + high[i])
                } else {
                    eye[i].clamp(least, most)
                }
            };
            let middle = DVec3::from([0, 1, 2].map(axis));
            let first = 2 * (0.5 * (middle - half)).round().as_ivec3();
            let around = grids.last().map(|outer| 2 * outer.first);
            let first = around.map_or(first, |around| {
                first.clamp(around + 2 * BETWEEN, around + n - 2 * BETWEEN)
            });
            grids.push(CellGrid {
                first,
                slab: level,
                ..CellGrid::new(self.anchor, cell_size, UVec3::splat(self.resolution))
            });
        }
        grids
    }

    /// Where a grid is in the one around it.
    pub fn nested(grids: &[CellGrid], level: usize) -> Option<Nested> {
        let outer = grids.get(level.checked_sub(1)?)?;
        let own = grids.get(level)?;
        let first: IVec3 = own.first / 2 - outer.first;
        Some(Nested {
            depth: level as u32,
            first: first.as_uvec3(),
        })
    }
}
