//! The octree itself.

use std::collections::{BTreeMap, BTreeSet};

use super::{Lattice, add, cube};
use crate::gi::shared::voxel::oracle::{VoxelIndex, compact_order};

/// 2³ nodes of the octree, stored side by side.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Where it is, in tiles of its level.
    pub position: [u32; 3],
    /// For each node, x fastest: index of the child tile; on the finest level, compact index of the
    /// voxel.
    pub nodes: [Option<u32>; 8],
    /// Index of the neighbour towards −x, −y and −z on the same level.
    pub neighbours: [Option<u32>; 3],
}

/// All tiles in the order of the pool, and the number of each level, finest first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Octree {
    /// The root first; then level by level, in the order of the parents' nodes.
    pub tiles: Vec<Tile>,
    /// Tiles of each level, finest first.
    pub counts: Vec<u32>,
}

/// The octree over some voxels: level l has the tile T where one of its texels 2T to 2T + 2 along
/// each axis is reached by a voxel, and a root. `resolution` is a power of two of at least 4.
pub fn octree(voxels: &BTreeSet<VoxelIndex>, resolution: u32, lattice: Lattice) -> Octree {
    let levels = tile_sets(voxels, resolution, lattice);
    let mut tiles: Vec<Tile> = Vec::new();
    let mut level_tiles = vec![[0; 3]];
    for depth in (0..levels.len()).rev() {
        let first = tiles.len() as u32;
        let own: BTreeMap<[u32; 3], u32> = level_tiles
            .iter()
            .zip(first..)
            .map(|(position, index)| (*position, index))
            .collect();
        let neighbour = |position: [u32; 3], axis: usize| {
            let mut beside = position;
            beside[axis] = beside[axis].wrapping_sub(1);
            own.get(&beside).copied()
        };
        let mut children = Vec::new();
        let next = first + level_tiles.len() as u32;
        for position in &level_tiles {
            let nodes = std::array::from_fn(|index| {
                let child = cube()
                    .nth(index)
                    .map_or([0; 3], |offset| add(position.map(|at| 2 * at), offset));
                (depth > 0 && levels[depth - 1].contains(&child)).then(|| {
                    children.push(child);
                    next + children.len() as u32 - 1
                })
            });
            tiles.push(Tile {
                position: *position,
                nodes,
                neighbours: [0, 1, 2].map(|axis| neighbour(*position, axis)),
            });
        }
        if depth > 0 {
            level_tiles = children;
        }
    }
    let counts: Vec<u32> = levels.iter().map(|level| level.len() as u32).collect();
    let leaf_count = counts.first().map_or(0, |count| *count as usize);
    link_leaves(&mut tiles, leaf_count, voxels);
    Octree { tiles, counts }
}

/// The tiles of each level, finest first.
fn tile_sets(
    voxels: &BTreeSet<VoxelIndex>,
    resolution: u32,
    lattice: Lattice,
) -> Vec<BTreeSet<[u32; 3]>> {
    let mut texels: BTreeSet<VoxelIndex> = voxels
        .iter()
        .flat_map(|voxel| lattice.reached(*voxel))
        .collect();
    let mut levels = Vec::new();
    let mut tiles_along = resolution / 2;
    while tiles_along >= 1 {
        let holders = |texel: &VoxelIndex| {
            let high = texel.map(|at| at / 2);
            // An even texel is the last of the tile before, too.
            let shared = *texel;
            cube().filter_map(move |below| {
                let is_held = (0..3).all(|axis| {
                    below[axis] == 0 || (shared[axis].is_multiple_of(2) && high[axis] > 0)
                });
                let tile: [u32; 3] =
                    std::array::from_fn(|axis| high[axis].saturating_sub(below[axis]));
                (is_held && tile.iter().all(|at| *at < tiles_along)).then_some(tile)
            })
        };
        let mut tiles: BTreeSet<[u32; 3]> = texels.iter().flat_map(holders).collect();
        if tiles_along == 1 {
            tiles.insert([0; 3]);
        }
        levels.push(tiles);
        texels = texels
            .iter()
            .flat_map(|texel| lattice.parents(*texel))
            .collect();
        tiles_along /= 2;
    }
    levels
}

fn link_leaves(tiles: &mut [Tile], leaf_count: usize, voxels: &BTreeSet<VoxelIndex>) {
    let compact: BTreeMap<VoxelIndex, u32> = compact_order(voxels.iter().copied())
        .into_iter()
        .zip(0..)
        .collect();
    let first = tiles.len() - leaf_count;
    for tile in &mut tiles[first..] {
        for (node, offset) in tile.nodes.iter_mut().zip(cube()) {
            *node = compact
                .get(&add(tile.position.map(|at| 2 * at), offset))
                .copied();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A voxel on odd coordinates lies inside one tile, one on even coordinates on the border of
    /// eight.
    #[test]
    fn one_voxel() {
        let tree = |voxel| octree(&[voxel].into(), 8, Lattice::Centres);
        assert_eq!(tree([3, 3, 3]).counts, [1, 1, 1]);
        let even = tree([4, 2, 2]);
        // Level 1: texel (2, 1, 1) is the last along x of tile (0, 0, 0) and the first of (1, 0,
        // 0).
        assert_eq!(even.counts, [8, 2, 1]);
        let leaves = &even.tiles[3..];
        assert_eq!(
            leaves
                .iter()
                .flat_map(|tile| tile.nodes)
                .flatten()
                .collect::<Vec<_>>(),
            [0]
        );
        assert!(
            leaves
                .iter()
                .any(|tile| tile.position == [2, 1, 1] && tile.nodes[0] == Some(0))
        );
        assert_eq!(even.tiles[0].nodes[..2], [Some(1), Some(2)]);
        assert_eq!(even.tiles[1].neighbours, [None; 3]);
        assert_eq!(even.tiles[2].neighbours, [Some(1), None, None]);
    }

    #[test]
    fn corners_of_one_voxel() {
        // Texels 3 and 4 of level 0 along each axis: in the tiles 1 and 2; then 1 and 2: in the
        // tiles 0 and 1; then 0 and 1.
        assert_eq!(
            octree(&[[3, 3, 3]].into(), 8, Lattice::Corners).counts,
            [8, 8, 1]
        );
    }

    #[test]
    fn nothing_has_a_root() {
        let tree = octree(&BTreeSet::new(), 16, Lattice::Corners);
        assert_eq!(tree.counts, [0, 0, 0, 1]);
        assert_eq!(
            tree.tiles,
            [Tile {
                position: [0; 3],
                nodes: [None; 8],
                neighbours: [None; 3]
            }]
        );
    }

    #[test]
    fn a_full_grid_is_a_full_tree() {
        let all = (0..8)
            .flat_map(|z| (0..8).flat_map(move |y| (0..8).map(move |x| [x, y, z])))
            .collect();
        for lattice in [Lattice::Centres, Lattice::Corners] {
            let tree = octree(&all, 8, lattice);
            assert_eq!(tree.counts, [64, 8, 1]);
            assert!(
                tree.tiles
                    .iter()
                    .all(|tile| tile.nodes.iter().all(Option::is_some))
            );
        }
    }
}
