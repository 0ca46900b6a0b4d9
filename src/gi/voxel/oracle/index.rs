//! The compact index.

use std::collections::BTreeSet;

use super::VoxelIndex;

/// Occupied voxels in the order of their compact index: by block of 4×4×4 (z, then y, then x), within a block likewise.
pub fn compact_order(voxels: impl IntoIterator<Item = VoxelIndex>) -> Vec<VoxelIndex> {
    let key = |[x, y, z]: &VoxelIndex| [z / 4, y / 4, x / 4, z % 4, y % 4, x % 4];
    let mut ordered = voxels.into_iter().collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>();
    ordered.sort_by_key(key);
    ordered
}

/// Occupancy as stored: for each block, x fastest, two words of 32 bits; bit x + 4 y + 16 z of a block is its voxel (x, y, z). `resolution` is a
/// multiple of 4.
pub fn occupancy_words(voxels: impl IntoIterator<Item = VoxelIndex>, resolution: u32) -> Vec<u32> {
    let blocks = resolution / 4;
    let mut words = vec![0; 2 * (blocks as usize).pow(3)];
    for [x, y, z] in voxels {
        let block = x / 4 + blocks * (y / 4) + blocks * blocks * (z / 4);
        let bit = x % 4 + 4 * (y % 4) + 16 * (z % 4);
        words[(2 * block + bit / 32) as usize] |= 1 << (bit % 32);
    }
    words
}

/// For each block, the compact index of its first occupied voxel: the occupied voxels of all blocks before it.
pub fn block_bases(words: &[u32]) -> Vec<u32> {
    let counts = words.chunks(2).map(|block| block.iter().map(|word| word.count_ones()).sum::<u32>());
    counts.scan(0, |base, count| Some(std::mem::replace(base, *base + count))).collect()
}
