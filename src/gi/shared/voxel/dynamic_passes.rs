//! The passes that take dynamic geometry in and out, and what they share with shaders.

use crate::gpu_struct;
use crate::graph::Pass;
use crate::graph::compute::{read, read_write, write};
use crate::shader::GpuStruct;

gpu_struct! {
    /// A block that dynamic geometry touches, and what it is without
    /// (`gi/shared/voxel/dynamic/touched.glsl`).
    pub struct TouchedBlock {
        /// Index in the grid.
        pub block: u32,
        /// Compact index of its first static voxel.
        pub static_base: u32,
        /// Static occupancy of its lower 32 voxels.
        pub static_low: u32,
        /// Static occupancy of its upper 32 voxels.
        pub static_high: u32,
    }
}

gpu_struct! {
    /// What one update counts (`gi/shared/voxel/dynamic/touched.glsl`).
    pub struct TouchedCounters {
        /// Fragments, static ones too.
        pub fragment_count: u32,
        /// 1 where fragments and blocks all fit, so that the blocks are listed.
        pub indexed: u32,
        /// Threads that a driver ended.
        pub unfinished_count: u32,
        /// Blocks that dynamic geometry touches.
        pub touched_count: u32,
        /// Occupied voxels in them.
        pub slot_count: u32,
        /// Occupied voxels in them that static geometry does not occupy.
        pub added_voxels: u32,
        /// Occupied voxels in them that dynamic geometry touches.
        pub dynamic_voxels: u32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.count_touched` and `voxel.index_touched`: a box of blocks.
    pub struct TouchedParams {
        /// First block of the box along x.
        pub first_x: u32,
        /// First block of the box along y.
        pub first_y: u32,
        /// First block of the box along z.
        pub first_z: u32,
        /// Blocks of the box along x.
        pub size_x: u32,
        /// Blocks of the box along y.
        pub size_y: u32,
        /// Blocks of the box along z.
        pub size_z: u32,
        /// Blocks of the grid along an axis.
        pub blocks: u32,
        /// Number of static records.
        pub first_slot: u32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.scan_touched`.
    pub struct TouchedScanParams {
        /// Groups of 1,024 blocks.
        pub touched_groups: u32,
        /// Fragments that there is room for, static ones too.
        pub fragment_room: u32,
        /// Touched blocks that there is room for.
        pub touched_room: u32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.restore_blocks`.
    pub struct RestoreParams {
        /// Blocks to put back.
        pub touched_count: u32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.continue_lists`.
    pub struct ListParams {
        /// Touched blocks.
        pub touched_count: u32,
    }
}

/// Touched blocks become again what they are without dynamic geometry. A thread a touched block.
pub static RESTORE_BLOCKS: Pass = Pass::compute(
    "voxel.restore_blocks",
    "gi/shared/voxel/dynamic/restore_blocks.comp",
    &[
        read("touched"),
        write("occupancy"),
        write("block_bases"),
        write("dynamic_occupancy"),
    ],
    RestoreParams::LAYOUT,
);

/// Touched blocks and the voxels in them, in each group of 1,024 blocks of the box. Four blocks a
/// thread.
pub static COUNT_TOUCHED: Pass = Pass::compute(
    "voxel.count_touched",
    "gi/shared/voxel/dynamic/count_touched.comp",
    &[
        read("occupancy"),
        read("dynamic_occupancy"),
        write("touched_sums"),
        read_write("counts"),
    ],
    TouchedParams::LAYOUT,
);

/// Sums of groups to sums before each group, and the totals. One workgroup.
pub static SCAN_TOUCHED: Pass = Pass::compute(
    "voxel.scan_touched",
    "gi/shared/voxel/dynamic/scan_touched.comp",
    &[read_write("touched_sums"), read_write("counts")],
    TouchedScanParams::LAYOUT,
);

/// The list of touched blocks; their occupancy and base with dynamic geometry. Only where the
/// counters say that all fits. Four blocks a thread.
pub static INDEX_TOUCHED: Pass = Pass::compute(
    "voxel.index_touched",
    "gi/shared/voxel/dynamic/index_touched.comp",
    &[
        read("dynamic_occupancy"),
        read("touched_sums"),
        read_write("occupancy"),
        read_write("block_bases"),
        write("touched"),
        read("counts"),
    ],
    TouchedParams::LAYOUT,
);

/// The list of each voxel of a touched block starts as that of its static fragments. 64 threads a
/// touched block.
pub static CONTINUE_LISTS: Pass = Pass::compute(
    "voxel.continue_lists",
    "gi/shared/voxel/dynamic/continue_lists.comp",
    &[
        read("touched"),
        read("occupancy"),
        read("block_bases"),
        read_write("heads"),
    ],
    ListParams::LAYOUT,
);
