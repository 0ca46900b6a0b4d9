//! CPU twins of the voxel passes: what `voxel.fragments`, `voxel.resolve`, the compact index,
//! `voxel.light`, `voxel.gather_rays`, `voxel.bounce` and those from emitters must give.
//!
//! Everything is naive: every voxel against every triangle, every ray against every voxel, every
//! shadow ray against every triangle, in f64. The one thing in f32 is the position of a vertex in
//! the grid ([`Grid::position`]), because that rounding *defines* the surface that is voxelized.
//! Lengths are voxels (grid space) unless a name ends in `_m`; areas are voxel faces, h² each;
//! light is in the units of the radiometric contract.

mod bounce;
mod emitters;
mod fragments;
mod index;
mod interior;
mod light;
mod rays;
#[cfg(test)]
mod tests;
mod touching;

pub use bounce::{bounce_rays, bounce_receiver, voxel_pattern};
pub use emitters::{
    EmitterPart, PointSettings, Reached, gather_emitters, gather_emitters_triangles, unhidden,
};
pub use fragments::{
    Fragment, ONE_PLANE, OPPOSED, PARALLEL, VoxelSum, fragments, front_of, resolve, voxelize,
};
pub use index::{block_bases, block_bit, compact_order, occupancy_words};
pub use interior::{COLUMN_OFFSET, Met, interior, met_by_column};
pub use light::{
    inject, inject_faces, inject_sides, lit_area, normal_weighted, reflected_flux, shade_voxel,
    voxel_flux,
};
pub use rays::{
    Crossing, GatherSettings, Gathered, Receiver, TraceEnd, TraceGrid, TraceSettings, TraceVoxel,
    crossings, gather_rays, gather_triangles, hemisphere_direction, occlusion, seed_of, trace,
};
pub use touching::{Candidate, candidates, is_degenerate, touched_voxels};

use glam::{DVec3, Vec3};

use crate::scene::{Material, Scene, Vertex};

/// A triangle in grid space \[voxels\], as the GPU has it.
pub type GridTriangle = [[f32; 3]; 3];

/// Coordinates of a voxel, 0 to resolution − 1.
pub type VoxelIndex = [u32; 3];

/// Smallest weight of a fragment [voxel faces]: a voxel that is touched but holds no area still has
/// a mean.
pub const LEAST_WEIGHT: f64 = 1.0 / 16384.0;

/// Smallest coverage of an occupied voxel.
pub const LEAST_COVERAGE: f64 = 1.0 / 255.0;

/// Where the voxels lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Smallest corner, world space \[m\].
    pub origin: Vec3,
    /// Edge of a voxel, h \[m\].
    pub voxel_size: f32,
    /// Voxels along an edge of the grid.
    pub resolution: u32,
}

impl Grid {
    /// Grid position of a vertex \[voxels\]: `(p − origin) · (1 / h)` in f32, each operation
    /// rounded (IEEE 754, not contracted).
    pub fn position(&self, position_ws: [f32; 3]) -> [f32; 3] {
        let inverse_size = 1.0 / self.voxel_size;
        let origin = self.origin.to_array();
        std::array::from_fn(|axis| (position_ws[axis] - origin[axis]) * inverse_size)
    }

    fn triangle(&self, scene: &Scene, index: usize) -> GridTriangle {
        corners(scene, index).map(|vertex| self.position(vertex.position))
    }
}

fn corners(scene: &Scene, index: usize) -> [Vertex; 3] {
    scene.triangles[index]
        .vertices
        .map(|vertex| scene.vertices[vertex as usize])
}

fn world_triangle(scene: &Scene, index: usize) -> [DVec3; 3] {
    doubles(corners(scene, index).map(|vertex| vertex.position))
}

fn material_of(scene: &Scene, index: usize) -> &Material {
    &scene.materials[scene.triangles[index].material as usize]
}

fn doubles(triangle: GridTriangle) -> [DVec3; 3] {
    triangle.map(|vertex| Vec3::from(vertex).as_dvec3())
}

fn corner_of(voxel: VoxelIndex) -> DVec3 {
    DVec3::from(voxel.map(f64::from))
}
