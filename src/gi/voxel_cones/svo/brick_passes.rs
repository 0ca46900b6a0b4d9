//! The passes that fill bricks.

use crate::gpu_struct;
use crate::graph::{Access, Binding, Pass};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `svo.write_leaves` and `svo.filter`.
    pub struct BrickParams {
        /// First static tile of the level.
        pub first: u32,
        /// Static tiles of the level.
        pub count: u32,
        /// First dynamic tile of the level.
        pub first_dynamic: u32,
        /// Dynamic tiles of the level.
        pub dynamic_count: u32,
        /// The level, 0 the finest.
        pub level: u32,
        /// Bricks from a tile's index to that of its first brick.
        pub shift: u32,
        /// Bricks from a face to the next.
        pub stride: u32,
        /// Bricks from a tile's index to that of its first brick, on the next finer level.
        pub child_shift: u32,
        /// Bricks from a face to the next, on the next finer level.
        pub child_stride: u32,
    }
}

gpu_struct! {
    /// Parameters of the passes that make leaves of records, which are bound piece by piece.
    pub struct RecordParams {
        /// First static tile of the level.
        pub first: u32,
        /// Static tiles of the level.
        pub count: u32,
        /// First dynamic tile of the level.
        pub first_dynamic: u32,
        /// Dynamic tiles of the level.
        pub dynamic_count: u32,
        /// The level, always 0: leaves are on the finest.
        pub level: u32,
        /// Compact index of the first of the voxels whose records are bound.
        pub first_voxel: u32,
        /// How many they are.
        pub voxel_count: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.transfer_borders`.
    pub struct TransferParams {
        /// First static tile of the level.
        pub first: u32,
        /// Static tiles of the level.
        pub count: u32,
        /// First dynamic tile of the level.
        pub first_dynamic: u32,
        /// Dynamic tiles of the level.
        pub dynamic_count: u32,
        /// The level, 0 the finest.
        pub level: u32,
        /// Bricks from a tile's index to that of its first brick.
        pub shift: u32,
        /// Bricks from a face to the next.
        pub stride: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.sum_borders`.
    pub struct SumParams {
        /// First static tile of the level.
        pub first: u32,
        /// Static tiles of the level.
        pub count: u32,
        /// First dynamic tile of the level.
        pub first_dynamic: u32,
        /// Dynamic tiles of the level.
        pub dynamic_count: u32,
        /// 0 to 2: x, y, z.
        pub axis: u32,
        /// Bricks from a tile's index to that of its first brick.
        pub shift: u32,
        /// Bricks from a face to the next.
        pub stride: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.copy_bricks`.
    pub struct CopyBricksParams {
        /// Number of bricks that are copied.
        pub brick_count: u32,
    }
}

const LEVELS: Binding = Binding::buffer("touched_levels", Access::ComputeRead);
const LIST: Binding = Binding::buffer("touched_tiles", Access::ComputeRead);

/// Radiance of the voxels of each leaf tile into its own brick. A thread a texel.
pub static WRITE_LEAVES: Pass = Pass {
    constants: &["CORNERS", "SIDES", "TOUCHED", "NORMALS", "FACES"],
    ..Pass::compute(
        "svo.write_leaves",
        "gi/voxel_cones/svo/write_leaves.comp",
        &[
            Binding::buffer("nodes", Access::ComputeRead),
            Binding::buffer("voxel_radiance", Access::ComputeRead),
            Binding::image("bricks", Access::ComputeWrite),
            LEVELS,
            LIST,
        ],
        BrickParams::LAYOUT,
    )
};

/// The mean normal of what shines of the voxels of each leaf tile into its own normal brick. A
/// thread a texel.
pub static WRITE_NORMALS: Pass = Pass {
    constants: &["CORNERS", "", "TOUCHED"],
    ..Pass::compute(
        "svo.write_normals",
        "gi/voxel_cones/svo/write_normals.comp",
        &[
            Binding::buffer("nodes", Access::ComputeRead),
            Binding::buffer("voxel_radiance", Access::ComputeRead),
            Binding::image("bricks", Access::ComputeWrite),
            Binding::buffer("voxel_records", Access::ComputeRead),
            LEVELS,
            LIST,
        ],
        RecordParams::LAYOUT,
    )
};

/// The texels that neighbouring bricks share, where a voxel is the centre of a texel. A thread a
/// tile.
pub static TRANSFER_BORDERS: Pass = Pass {
    constants: &["FACES", "TOUCHED"],
    ..Pass::compute(
        "svo.transfer_borders",
        "gi/voxel_cones/svo/transfer_borders.comp",
        &[
            Binding::buffer("neighbours", Access::ComputeRead),
            Binding::image("bricks", Access::ComputeReadWrite),
            LEVELS,
            LIST,
        ],
        TransferParams::LAYOUT,
    )
};

/// The same along one axis, where voxels spread to their corners. A thread a tile.
pub static SUM_BORDERS: Pass = Pass {
    constants: &["FACES"],
    ..Pass::compute(
        "svo.sum_borders",
        "gi/voxel_cones/svo/sum_borders.comp",
        &[
            Binding::buffer("neighbours", Access::ComputeRead),
            Binding::image("bricks", Access::ComputeReadWrite),
        ],
        SumParams::LAYOUT,
    )
};

/// Makes the bricks of a level from the next finer level's. A thread a texel.
pub static FILTER: Pass = Pass {
    constants: &["FILTER", "CORNERS", "PART", "FACES", "TOUCHED"],
    ..Pass::compute(
        "svo.filter",
        "gi/voxel_cones/svo/filter.comp",
        &[
            Binding::buffer("nodes", Access::ComputeRead),
            Binding::image("bricks", Access::ComputeReadWrite),
            LEVELS,
            LIST,
        ],
        BrickParams::LAYOUT,
    )
};

/// The first bricks of a pool into another. A thread a texel.
pub static COPY_BRICKS: Pass = Pass::compute(
    "svo.copy_bricks",
    "gi/voxel_cones/svo/copy_bricks.comp",
    &[
        Binding::image("bricks", Access::ComputeRead),
        Binding::image("larger_bricks", Access::ComputeWrite),
    ],
    CopyBricksParams::LAYOUT,
);
