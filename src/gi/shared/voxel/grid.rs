//! The voxel grid: a cube of n³ voxels around the scene.

use glam::{IVec3, Vec3};

/// Where the voxels are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelGrid {
    /// Smallest corner (m).
    pub origin: Vec3,
    /// Edge of a voxel (m).
    pub voxel_size: f32,
    /// Voxels along an edge of the cube, a power of two of at least 8.
    pub resolution: u32,
}

/// What a grid is a part of. Light on voxels is computed from places in it, and so does not depend,
/// by rounding, on which part the grid is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Corner of its voxel (0, 0, 0) (m).
    pub anchor: Vec3,
    /// Its voxel that is the grid's first.
    pub first: IVec3,
}

impl VoxelGrid {
    /// The lattice of a grid that stands alone.
    pub fn lattice(&self) -> Lattice {
        Lattice {
            anchor: self.origin,
            first: IVec3::ZERO,
        }
    }

    /// A cube around a bounding box: its largest extent and 2% more on each side, but at least two
    /// voxels and a quarter, so that filtering at the border sees emptiness. The quarter keeps
    /// the walls of a room off the borders between voxels, where rounding decides whether a wall is
    /// one voxel thick or two.
    pub fn around((low, high): (Vec3, Vec3), resolution: u32) -> Self {
        let extent = (high - low).max_element().max(f32::MIN_POSITIVE * 1e6);
        let voxel_size =
            (1.04 * extent / resolution as f32).max(extent / (resolution as f32 - 4.5));
        let origin = 0.5 * (low + high) - Vec3::splat(0.5 * voxel_size * resolution as f32);
        VoxelGrid {
            origin,
            voxel_size,
            resolution,
        }
    }

    /// Origin and voxel size in one row, as the shaders take them.
    pub fn row(&self) -> [f32; 4] {
        self.origin.extend(self.voxel_size).to_array()
    }

    /// Number of blocks of 4×4×4 voxels.
    pub fn block_count(&self) -> u32 {
        (self.resolution / 4).pow(3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At every resolution and extent the faces of the bounds lie inside voxels, at least two
    /// voxels of emptiness away from the grid's border.
    #[test]
    fn no_face_of_the_bounds_is_on_a_voxel_border() {
        for resolution in (3..=10).map(|power| 1u32 << power) {
            for extent in [1e-4f32, 1.0, 2.03, 1e5] {
                let grid = VoxelGrid::around(
                    (Vec3::splat(-0.3 * extent), Vec3::splat(0.7 * extent)),
                    resolution,
                );
                for face in [-0.3 * extent, 0.7 * extent] {
                    let at = (face - grid.origin.x) / grid.voxel_size;
                    assert!(
                        at >= 2.0 && at <= resolution as f32 - 2.0,
                        "{resolution}, {extent} m: {at}"
                    );
                    assert!(
                        (at - at.round()).abs() > 0.05,
                        "{resolution}, {extent} m: {at}"
                    );
                }
            }
        }
    }
}
