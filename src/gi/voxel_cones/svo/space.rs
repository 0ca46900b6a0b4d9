//! The octree as exact rays go through it: a table of its tiles of 16³ voxels, and the occupancy of
//! its blocks of 4³. So a ray finds a voxel by two nodes, however deep the octree is.

use std::sync::Arc;

use super::nodes::{LevelRange, NodePool};
use super::{Pieces, RAYS};
use crate::gi::shared::voxel::build::{buffer, linear_groups};
use crate::gi::shared::voxel::{Sides, Space};
use crate::gpu_struct;
use crate::graph::compute::{read, write};
use crate::graph::{Buffer, Error, Frame, FrameStats, Gpu, Pass};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `svo.index_tiles`.
    pub struct IndexParams {
        /// Cells of the table along an axis.
        pub cells: u32,
        /// Level of the tiles that it has.
        pub top_level: u32,
        /// Level of the root.
        pub root: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.pack_blocks`.
    pub struct PackParams {
        /// First tile of level 1.
        pub first_tile: u32,
        /// Number of tiles.
        pub tile_count: u32,
        /// Place of the first one's block.
        pub first_block: u32,
    }
}

/// Where a descent from the root comes to in each cell of a table. A thread a cell.
pub static INDEX_TILES: Pass = Pass::compute(
    "svo.index_tiles",
    "gi/voxel_cones/svo/index_tiles.comp",
    &[read("nodes"), write("top_tiles")],
    IndexParams::LAYOUT,
);

/// Occupancy of the block of each tile of level 1, and the number of its first voxel. A thread a
/// tile.
pub static PACK_BLOCKS: Pass = Pass::compute(
    "svo.pack_blocks",
    "gi/voxel_cones/svo/pack_blocks.comp",
    &[read("nodes"), write("blocks")],
    PackParams::LAYOUT,
);

/// Level of the tiles of the table; that of the root, where it is finer.
const TOP_LEVEL: u32 = 3;

/// Bytes of a block: its occupancy, and the number of its first voxel.
const BLOCK_BYTES: u64 = 12;

/// A table of tiles, and blocks.
pub(super) struct OctreeSpace {
    top_tiles: Arc<Buffer>,
    blocks: Arc<Buffer>,
    /// Tiles of level 1 that stand still; the blocks of the others follow.
    still: LevelRange,
    /// First of the others.
    first_moving: u32,
}

impl OctreeSpace {
    /// Of an octree as it is now.
    pub(super) fn new(gpu: &Gpu, nodes: &NodePool) -> Result<(Self, FrameStats), Error> {
        let root = nodes.levels.len() as u32 - 1;
        let (still, moving) = (nodes.levels[1], nodes.dynamic.as_ref());
        let moving = moving.map_or(LevelRange { first: 0, count: 0 }, |tiles| tiles.levels[1]);
        let params = IndexParams {
            cells: 1 << root.saturating_sub(TOP_LEVEL),
            top_level: TOP_LEVEL.min(root),
            root,
        };
        let cell_count = params.cells.pow(3);
        let block_count = u64::from(still.count) + u64::from(moving.count);
        let space = OctreeSpace {
            top_tiles: buffer(gpu, "svo.top_tiles", 4 * u64::from(cell_count))?,
            blocks: buffer(gpu, "svo.blocks", BLOCK_BYTES * block_count)?,
            still,
            first_moving: moving.first,
        };
        let mut frame = Frame::new();
        frame
            .pass(&INDEX_TILES)
            .bind("nodes", &nodes.nodes)
            .bind("top_tiles", &space.top_tiles)
            .push(&params)
            .dispatch(linear_groups(cell_count));
        for (tiles, first_block) in [(still, 0), (moving, still.count)] {
            if tiles.count == 0 {
                continue;
            }
            frame
                .pass(&PACK_BLOCKS)
                .bind("nodes", &nodes.nodes)
                .bind("blocks", &space.blocks)
                .push(&PackParams {
                    first_tile: tiles.first,
                    tile_count: tiles.count,
                    first_block,
                })
                .dispatch(linear_groups(tiles.count));
        }
        let stats = gpu.submit(frame)?;
        Ok((space, stats))
    }

    /// What rays go through.
    pub(super) fn as_space<'v>(
        &'v self,
        voxels: &'v Pieces,
        nodes: &'v NodePool,
        sides: Sides,
    ) -> Option<Space<'v>> {
        let (surfaces, words) = voxels.surfaces()?;
        Some(Space {
            passes: &RAYS,
            grid: voxels.grid,
            bound: vec![
                ("nodes", &nodes.nodes),
                ("top_tiles", &self.top_tiles),
                ("blocks", &self.blocks),
                ("surfaces", surfaces),
                ("voxel_radiance", &voxels.radiance),
            ],
            constants: vec![("SURFACE_WORDS", words)],
            words: [self.still.first, self.still.count, self.first_moving, 0],
            sides,
            // A line crosses at most 3 n voxels of an n³ grid, and each is a turn of the loop.
            turns: 3 * voxels.grid.resolution + 1,
        })
    }
}
