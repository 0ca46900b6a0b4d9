//! Blocks of 4³ voxels as rays read them: what is in a block, or how large the empty space around
//! it is (`gi/shared/voxel/trace/blocks.glsl`).

use std::sync::Arc;

use glam::IVec3;

use crate::gi::shared::voxel::{VoxelBox, Voxels};
use crate::gpu_struct;
use crate::graph::compute::read;
use crate::graph::{
    Access, Binding, Error, Frame, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Owner, Pass, vk,
};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `voxel.pack_blocks`.
    pub struct PackBlocksParams {
        /// xyz: corner of the box of voxels that rays see in another grid.
        pub hidden_low: [i32; 4],
        /// xyz: end of that box.
        pub hidden_end: [i32; 4],
        /// xyz: blocks between the grid's corner and the last corner of a cube of 16³ before it.
        pub cube_offset: [i32; 4],
        /// Blocks along an edge of the grid.
        pub blocks_along: u32,
        /// First layer that is written.
        pub first_layer: u32,
        /// Number of the grid's first voxel.
        pub first_voxel: u32,
    }
}

/// The blocks of a grid. A thread a block.
pub static PACK_BLOCKS: Pass = Pass::compute(
    "voxel.pack_blocks",
    "gi/shared/voxel/trace/pack_blocks.comp",
    &[
        read("occupancy"),
        read("block_bases"),
        Binding::image("blocks", Access::ComputeWrite),
    ],
    PackBlocksParams::LAYOUT,
);

/// Edge of the largest empty cube (voxels).
const LARGEST: i32 = 16;

/// The blocks of one or more grids of n³ voxels: RGBA32UI, n/4 × n/4 × n/4 a grid.
pub struct RayBlocks {
    resolution: u32,
    blocks: Arc<Image>,
}

impl RayBlocks {
    /// Without contents.
    pub fn new(gpu: &Gpu, resolution: u32, grids: u32) -> Result<Self, Error> {
        let along = resolution / 4;
        let desc = ImageDesc {
            name: "voxel.blocks".into(),
            extent: [along, along, grids * along],
            kind: ImageKind::D3,
            format: vk::Format::R32G32B32A32_UINT,
            mips: 1,
            layers: 1,
            usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
            owner: Owner::Store,
        };
        Ok(RayBlocks {
            resolution,
            blocks: gpu.create_image(&desc)?,
        })
    }

    /// Adds the pass for one of the grids, whose first voxel has this number among all. `hidden`:
    /// the box of its voxels that rays see in another grid. `corner`: where the grid begins in the
    /// space that rays walk through (its voxels, a multiple of 4).
    pub fn pack(
        &self,
        frame: &mut Frame,
        grid: u32,
        (voxels, first_voxel): (&Voxels, u32),
        (corner, hidden): (IVec3, VoxelBox),
    ) {
        let cube_offset = corner.rem_euclid(IVec3::splat(LARGEST)) / 4;
        let blocks_along = self.resolution / 4;
        frame
            .pass(&PACK_BLOCKS)
            .bind("occupancy", &voxels.occupancy)
            .bind("block_bases", &voxels.block_bases)
            .bind("blocks", &self.blocks)
            .push(&PackBlocksParams {
                hidden_low: hidden.low.extend(0).to_array(),
                hidden_end: hidden.end.extend(0).to_array(),
                cube_offset: cube_offset.extend(0).to_array(),
                blocks_along,
                first_layer: grid * blocks_along,
                first_voxel,
            })
            .dispatch(
                (cube_offset.as_uvec3() + blocks_along)
                    .to_array()
                    .map(|blocks| blocks.div_ceil(4)),
            );
    }

    /// What a pass binds.
    pub fn image(&self) -> &Arc<Image> {
        &self.blocks
    }
}
