//! Which voxels are occupied, and their compact indices.

use std::sync::Arc;

use super::buffer;
use super::passes::{COUNT_BLOCKS, CountParams, INDEX_BLOCKS, SCAN_GROUPS, ScanParams};
use crate::gi::shared::voxel::VoxelGrid;
use crate::graph::compute::linear_groups;
use crate::graph::{Buffer, Error, Frame, Gpu};

/// The blocks of a grid that have voxels.
#[derive(Clone)]
pub struct FilledBlocks {
    /// Their numbers, in any order.
    pub blocks: Arc<Buffer>,
    /// How many they are.
    pub count: u32,
}

/// What depends on the grid alone.
#[derive(Clone)]
pub(in crate::gi::shared::voxel) struct GridBuffers {
    pub(in crate::gi::shared::voxel) occupancy: Arc<Buffer>,
    pub(in crate::gi::shared::voxel) block_bases: Arc<Buffer>,
    group_sums: Arc<Buffer>,
    /// Fragments, voxels, threads that the driver ended, listed blocks.
    pub(in crate::gi::shared::voxel) counters: Arc<Buffer>,
    /// Blocks with voxels, in any order.
    filled_blocks: Option<Arc<Buffer>>,
}

impl GridBuffers {
    pub(in crate::gi::shared::voxel) fn new(gpu: &Gpu, grid: VoxelGrid) -> Result<Self, Error> {
        let blocks = u64::from(grid.block_count());
        Ok(GridBuffers {
            occupancy: buffer(gpu, "voxel.occupancy", 8 * blocks)?,
            block_bases: buffer(gpu, "voxel.block_bases", 4 * blocks)?,
            group_sums: buffer(gpu, "voxel.group_sums", 4 * blocks.div_ceil(1024))?,
            counters: buffer(gpu, "voxel.counters", 16)?,
            filled_blocks: None,
        })
    }

    /// With a list of the blocks that have voxels.
    pub(super) fn listing(gpu: &Gpu, grid: VoxelGrid) -> Result<Self, Error> {
        let bytes = 4 * u64::from(grid.block_count());
        Ok(GridBuffers {
            filled_blocks: Some(buffer(gpu, "voxel.filled_blocks", bytes)?),
            ..Self::new(gpu, grid)?
        })
    }

    /// The list, which has so many blocks.
    pub(super) fn filled(&self, count: u32) -> Option<FilledBlocks> {
        let blocks = Arc::clone(self.filled_blocks.as_ref()?);
        Some(FilledBlocks { blocks, count })
    }
}

/// Compact indices from occupancy.
pub(in crate::gi::shared::voxel) fn add_index(
    frame: &mut Frame,
    grid: VoxelGrid,
    GridBuffers {
        occupancy,
        block_bases,
        group_sums,
        counters,
        filled_blocks,
    }: &GridBuffers,
) {
    let block_count = grid.block_count();
    let (groups, group_count) = (
        linear_groups(block_count.div_ceil(16)),
        block_count.div_ceil(1024),
    );
    let params = CountParams { block_count };
    frame
        .pass(&COUNT_BLOCKS)
        .bind("occupancy", occupancy)
        .bind("group_sums", group_sums)
        .push(&params)
        .dispatch(groups);
    frame
        .pass(&SCAN_GROUPS)
        .bind("group_sums", group_sums)
        .bind("voxel_count", counters)
        .push(&ScanParams { group_count })
        .dispatch([1, 1, 1]);
    frame
        .pass(&INDEX_BLOCKS)
        .bind("occupancy", occupancy)
        .bind("group_sums", group_sums)
        .bind("block_bases", block_bases)
        // Bound where nothing is written.
        .bind(
            "filled_blocks",
            filled_blocks.as_ref().unwrap_or(group_sums),
        )
        .bind("filled_count", counters)
        .constant("LISTS", filled_blocks.is_some())
        .push(&params)
        .dispatch(groups);
}
