//! The grid: cubes around the scene's box.

use glam::{IVec3, UVec3, Vec3};

use crate::gpu_struct;

/// Where the cells are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellGrid {
    /// Corner of cell (0, 0, 0) of the lattice that the grid is a part of (m).
    pub origin: Vec3,
    /// Edge of a cell (m).
    pub cell_size: f32,
    /// The grid's first cell in the lattice.
    pub first: IVec3,
    /// Cells along each axis.
    pub size: UVec3,
    /// Where the grid is among those that share images of light.
    pub slab: u32,
}

gpu_struct! {
    /// A grid as the shaders read it (`gi/lpv/grid.glsl`).
    pub struct GridRow {
        /// xyz: corner of the lattice's cell (0, 0, 0) (m); w: edge of a cell (m).
        pub place: [f32; 4],
        /// xyz: cells along each axis; w: another number of the pass.
        pub size: [i32; 4],
        /// xyz: the first cell in the lattice; w: first layer in the images of light.
        pub first: [i32; 4],
    }
}

impl CellGrid {
    /// A grid of its own, from its smallest corner (m) on.
    pub fn new(origin: Vec3, cell_size: f32, size: UVec3) -> Self {
        CellGrid {
            origin,
            cell_size,
            first: IVec3::ZERO,
            size,
            slab: 0,
        }
    }

    /// Cells around a box (m), `cells` of them along its longest side, with `margin` empty ones at
    /// either end of every axis: a wall between the last centre and the border would lie on no
    /// segment between two centres.
    pub fn around((low, high): (Vec3, Vec3), cells: u32, margin: u32) -> Self {
        let extent = (high - low).max(Vec3::ZERO);
        // Cells of a point, or far from the origin, are still some steps of its coordinates wide.
        let farthest = low.abs().max(high.abs()).max_element();
        let longest = extent.max_element().max(2e-4 * farthest).max(1e-6);
        let inner = cells.saturating_sub(2 * margin).max(1);
        let cell_size = longest / inner as f32;
        // A side that rounding makes a hair longer than whole cells has no cell more.
        let needed = (extent / cell_size - 1e-3)
            .ceil()
            .as_uvec3()
            .max(UVec3::ONE);
        let size = needed.min(UVec3::splat(inner)) + 2 * margin;
        let origin = 0.5 * (low + high) - 0.5 * cell_size * size.as_vec3();
        CellGrid::new(origin, cell_size, size)
    }

    /// Smallest corner (m).
    pub fn corner(&self) -> Vec3 {
        self.origin + self.cell_size * self.first.as_vec3()
    }

    /// Number of cells.
    pub fn count(&self) -> u32 {
        self.size.element_product()
    }

    /// Where a cell is in lists of all cells.
    pub fn index(&self, cell: UVec3) -> usize {
        (cell.x + self.size.x * (cell.y + self.size.y * cell.z)) as usize
    }

    /// As the shaders take it, with a number of the pass.
    pub fn row(&self, number: u32) -> GridRow {
        GridRow {
            place: self.origin.extend(self.cell_size).to_array(),
            size: self.size.extend(number).as_ivec4().to_array(),
            first: self
                .first
                .extend((self.slab * self.size.z).cast_signed())
                .to_array(),
        }
    }
}
