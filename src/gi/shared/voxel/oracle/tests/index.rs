//! Their order and their index.

use super::*;

#[test]
fn compact_index_follows_the_blocks() {
    let voxels = [
        [4, 0, 0],
        [0, 0, 1],
        [3, 3, 3],
        [0, 4, 0],
        [1, 0, 0],
        [0, 1, 0],
    ];
    assert_eq!(
        compact_order(voxels),
        [
            [1, 0, 0],
            [0, 1, 0],
            [0, 0, 1],
            [3, 3, 3],
            [4, 0, 0],
            [0, 4, 0]
        ]
    );
    let words = occupancy_words(voxels, 8);
    assert_eq!(words.len(), 16);
    assert_eq!(words[..6], [1 << 1 | 1 << 2 | 1 << 4, 1 << 31, 1, 0, 1, 0]);
    assert_eq!(block_bases(&words), [0, 4, 5, 6, 6, 6, 6, 6]);
}
