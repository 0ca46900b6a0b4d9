//! The passes that move a window.

use crate::gpu_struct;
use crate::graph::Pass;
use crate::graph::compute::{read, write};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `voxel.shift_blocks`.
    pub struct ShiftParams {
        /// Blocks that the window has moved by along x.
        pub shift_x: i32,
        /// Blocks that the window has moved by along y.
        pub shift_y: i32,
        /// Blocks that the window has moved by along z.
        pub shift_z: i32,
        /// Blocks along an edge of the window.
        pub blocks: i32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.empty_blocks`: a box of blocks.
    pub struct EmptyParams {
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
        /// Blocks along an edge of the window.
        pub blocks: u32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.move_records`.
    pub struct MoveParams {
        /// Blocks of the window.
        pub block_count: u32,
        /// Voxels that the window has moved by, along x and y: x + 2¹⁶ y, modulo 2³².
        pub shift_xy: u32,
        /// Voxels that the window has moved by along z, modulo 2³².
        pub shift_z: u32,
    }
}

/// Occupancy after a move, as far as the window stays where it was. A thread a block.
pub static SHIFT_BLOCKS: Pass = Pass::compute(
    "voxel.shift_blocks",
    "gi/shared/voxel/window/shift_blocks.comp",
    &[
        read("occupancy"),
        read("block_bases"),
        write("shifted_occupancy"),
        write("moved_from"),
    ],
    ShiftParams::LAYOUT,
);

/// Blocks that are voxelized anew become empty. A thread a block.
pub static EMPTY_BLOCKS: Pass = Pass::compute(
    "voxel.empty_blocks",
    "gi/shared/voxel/window/empty_blocks.comp",
    &[write("shifted_occupancy"), write("moved_from")],
    EmptyParams::LAYOUT,
);

/// Records of blocks that stay, to their new places. A thread a block.
pub static MOVE_RECORDS: Pass = Pass {
    constants: &["EMISSIVE", "CARRIED", "FACES"],
    ..Pass::compute(
        "voxel.move_records",
        "gi/shared/voxel/window/move_records.comp",
        &[
            read("moved_from"),
            read("occupancy"),
            read("block_bases"),
            read("old_voxels"),
            write("voxels"),
            read("old_emission"),
            write("voxel_emission"),
            read("old_carried"),
            write("carried"),
            read("old_faces"),
            write("voxel_faces"),
        ],
        MoveParams::LAYOUT,
    )
};
