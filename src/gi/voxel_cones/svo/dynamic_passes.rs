//! The passes that make dynamic tiles.

use crate::gpu_struct;
use crate::graph::compute::{read, read_write, write};
use crate::graph::{Access, Binding, Pass};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `svo.mark_affected`.
    pub struct AffectedParams {
        /// Blocks of voxels along an axis of the grid.
        pub blocks: u32,
        /// Levels of the octree.
        pub level_count: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.flag_dynamic` and `svo.allocate_dynamic`.
    pub struct DynamicParams {
        /// The level whose nodes get children.
        pub level: u32,
        /// First tile behind the static ones.
        pub first_dynamic: u32,
        /// Dynamic tiles that there is room for, the entry too.
        pub capacity: u32,
        /// First block of the children's level among the affected tiles.
        pub first_block: u32,
        /// Blocks of that level along an axis.
        pub blocks: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.flag_texels`.
    pub struct TexelParams {
        /// First dynamic tile of the level.
        pub first: u32,
        /// Dynamic tiles of the level.
        pub count: u32,
        /// First tile behind the static ones.
        pub first_dynamic: u32,
        /// First block of the level among the affected tiles.
        pub first_block: u32,
        /// Blocks of the level along an axis.
        pub blocks: u32,
        /// Tiles of the level along an axis.
        pub tiles: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.keep_static`.
    pub struct KeepParams {
        /// First dynamic tile of the level.
        pub first: u32,
        /// Dynamic tiles of the level.
        pub count: u32,
        /// First tile behind the static ones.
        pub first_dynamic: u32,
    }
}

/// The tiles that hold a texel that voxels of touched blocks reach; none where these were not
/// listed. 64 threads a touched block that there is room for.
pub static MARK_AFFECTED: Pass = Pass {
    constants: &["CORNERS"],
    ..Pass::compute(
        "svo.mark_affected",
        "gi/voxel_cones/svo/mark_affected.comp",
        &[
            read("touched"),
            read("occupancy"),
            read_write("affected_tiles"),
            read("counts"),
        ],
        AffectedParams::LAYOUT,
    )
};

/// How many dynamic children dynamic tiles have. A thread 16 tiles, as many as the device says.
pub static FLAG_DYNAMIC: Pass = Pass::compute(
    "svo.flag_dynamic",
    "gi/voxel_cones/svo/flag_dynamic.comp",
    &[
        read("levels"),
        read("nodes"),
        read("places"),
        read("originals"),
        read("affected_tiles"),
        write("group_sums"),
    ],
    DynamicParams::LAYOUT,
);

/// Words of dynamic tiles, places and static tiles of their children. A thread 16 tiles, as many as
/// the device says.
pub static ALLOCATE_DYNAMIC: Pass = Pass::compute(
    "svo.allocate_dynamic",
    "gi/voxel_cones/svo/allocate_dynamic.comp",
    &[
        read("levels"),
        read("group_sums"),
        read("affected_tiles"),
        read_write("nodes"),
        read_write("places"),
        read_write("originals"),
    ],
    DynamicParams::LAYOUT,
);

/// Which texels of a dynamic tile's brick are made anew. A thread a tile.
pub static FLAG_TEXELS: Pass = Pass {
    constants: &["CORNERS"],
    ..Pass::compute(
        "svo.flag_texels",
        "gi/voxel_cones/svo/flag_texels.comp",
        &[
            read("places"),
            read("affected_tiles"),
            write("remade_texels"),
        ],
        TexelParams::LAYOUT,
    )
};

/// All other texels of it become those of the static tile. A thread a texel.
pub static KEEP_STATIC: Pass = Pass::compute(
    "svo.keep_static",
    "gi/voxel_cones/svo/keep_static.comp",
    &[
        read("originals"),
        read("remade_texels"),
        Binding::image("bricks", Access::ComputeReadWrite),
    ],
    KeepParams::LAYOUT,
);
