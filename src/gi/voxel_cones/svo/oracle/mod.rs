//! CPU twins of the octree's passes: `reduce_points`, `flag_nodes`, `scan_nodes`, `allocate_tiles`,
//! `link_leaves` and `link_neighbours` in [`octree`]; `write_leaves`, `write_normals`,
//! `transfer_borders` and `filter` in `texels`. Sets and maps from the definitions, in f64; nothing
//! knows how the device goes about it.

mod octree;
mod texels;

pub use octree::{Octree, Tile, octree};
pub use texels::{Filter, LitVoxel, Texels, coarser, leaves};

use crate::gi::shared::voxel::oracle::VoxelIndex;

/// Where the texels of a level are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lattice {
    /// Texel q of level l is at 2^l (q + ½) voxels, and made of the texels 2q and 2q + 1 of the
    /// level below; those of level 0 are the voxels.
    Centres,
    /// Texel q of level l is at 2^l q voxels, and made of the texels 2q − 1, 2q and 2q + 1; a voxel
    /// spreads to its eight corners at level 0.
    Corners,
}

impl Lattice {
    /// The texels of level 0 that a voxel reaches.
    fn reached(self, voxel: VoxelIndex) -> Vec<VoxelIndex> {
        match self {
            Lattice::Centres => vec![voxel],
            Lattice::Corners => cube().map(|offset| add(voxel, offset)).collect(),
        }
    }

    /// The texels of the next level that a texel reaches.
    fn parents(self, texel: VoxelIndex) -> Vec<VoxelIndex> {
        let low = texel.map(|at| at / 2);
        match self {
            Lattice::Centres => vec![low],
            // An odd texel lies between two.
            Lattice::Corners => {
                let odd = texel.map(|at| at % 2);
                cube()
                    .filter(|offset| (0..3).all(|axis| offset[axis] <= odd[axis]))
                    .map(|offset| add(low, offset))
                    .collect()
            }
        }
    }
}

/// The corners of a unit cube, x fastest.
fn cube() -> impl Iterator<Item = [u32; 3]> {
    (0..8).map(|index| [index & 1, index >> 1 & 1, index >> 2])
}

fn add(a: [u32; 3], b: [u32; 3]) -> [u32; 3] {
    std::array::from_fn(|axis| a[axis] + b[axis])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_reach_further_than_centres() {
        assert_eq!(Lattice::Centres.reached([3, 4, 5]), [[3, 4, 5]]);
        assert_eq!(Lattice::Corners.reached([3, 4, 5]).len(), 8);
        assert_eq!(Lattice::Centres.parents([3, 4, 5]), [[1, 2, 2]]);
        assert_eq!(
            Lattice::Corners.parents([3, 4, 5]),
            [[1, 2, 2], [2, 2, 2], [1, 2, 3], [2, 2, 3]]
        );
        assert_eq!(Lattice::Corners.parents([0, 4, 2]), [[0, 2, 1]]);
    }
}
