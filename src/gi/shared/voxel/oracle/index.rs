//! The compact index.

use std::collections::BTreeSet;

use super::VoxelIndex;

/// Place of a voxel within its block of 4×4×4, 0 to 63: Morton order.
pub fn block_bit([x, y, z]: VoxelIndex) -> u32 {
    let cube = |shift: u32| (x >> shift & 1) | (y >> shift & 1) << 1 | (z >> shift & 1) << 2;
    cube(0) | cube(1) << 3
}

/// Occupied voxels in the order of their compact index: by block of 4×4×4 (z, then y, then x),
/// within a block in Morton order.
pub fn compact_order(voxels: impl IntoIterator<Item = VoxelIndex>) -> Vec<VoxelIndex> {
    let key = |voxel: &VoxelIndex| [voxel[2] / 4, voxel[1] / 4, voxel[0] / 4, block_bit(*voxel)];
    let mut ordered = voxels
        .into_iter()
        .collect::<BTreeSet<_>>()
        .into_iter()
        .collect::<Vec<_>>();
    ordered.sort_by_key(key);
    ordered
}

/// Occupancy as stored: for each block, x fastest, two words of 32 bits, a bit a voxel
/// ([`block_bit`]). `resolution` is a multiple of 4.
pub fn occupancy_words(voxels: impl IntoIterator<Item = VoxelIndex>, resolution: u32) -> Vec<u32> {
    let blocks = resolution / 4;
    let mut words = vec![0; 2 * (blocks as usize).pow(3)];
    for [x, y, z] in voxels {
        let block = x / 4 + blocks * (y / 4) + blocks * blocks * (z / 4);
        let bit = block_bit([x, y, z]);
        words[(2 * block + bit / 32) as usize] |= 1 << (bit % 32);
    }
    words
}

/// For each block, the compact index of its first occupied voxel: the occupied voxels of all blocks
/// before it.
pub fn block_bases(words: &[u32]) -> Vec<u32> {
    let counts = words
        .chunks(2)
        .map(|block| block.iter().map(|word| word.count_ones()).sum::<u32>());
    counts
        .scan(0, |base, count| {
            Some(std::mem::replace(base, *base + count))
        })
        .collect()
}
