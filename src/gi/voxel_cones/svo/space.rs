//! The octree as exact rays go through it: a table of its cells of 16³ voxels, and blocks of 4³. So
//! a ray finds a voxel by two texels, however deep the octree is.

use std::sync::Arc;

use super::nodes::NodePool;
use super::{Pieces, RAYS};
use crate::gi::shared::voxel::build::buffer;
use crate::gi::shared::voxel::{Sides, Space};
use crate::gpu_struct;
use crate::graph::compute::{linear_groups, read, read_write};
use crate::graph::{
    Access, Binding, Bound, Error, Frame, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Owner,
    Pass, vk,
};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `svo.index_cells`.
    pub struct IndexParams {
        /// Cells of the grid along an axis.
        pub edge: u32,
        /// Level of the root.
        pub root: u32,
    }
}

/// Which blocks of each cell hold voxels, and which voxels of each block; of an empty cell, the
/// node that a descent from the root ends in. A thread a cell.
pub static INDEX_CELLS: Pass = Pass::compute(
    "svo.index_cells",
    "gi/voxel_cones/svo/index_cells.comp",
    &[
        read("nodes"),
        Binding::image("cells", Access::ComputeWrite),
        Binding::image("blocks", Access::ComputeWrite),
        read_write("block_count"),
    ],
    IndexParams::LAYOUT,
);

gpu_struct! {
    /// Parameters of `svo.merge_radiance`.
    pub struct MergeParams {
        /// The piece's first radiance among all.
        pub first: u32,
        /// How many it has.
        pub count: u32,
    }
}

/// Radiances of a piece among those of all, as texels. A thread a radiance.
pub static MERGE_RADIANCE: Pass = Pass::compute(
    "svo.merge_radiance",
    "gi/voxel_cones/svo/merge_radiance.comp",
    &[
        read("piece_radiance"),
        Binding::image("radiance_texels", Access::ComputeWrite),
    ],
    MergeParams::LAYOUT,
);

/// Level of tiles as large as a cell.
const CELL_LEVEL: u32 = 3;

/// Texels of a row (`glsl/gi/voxel_cones/svo/cells.glsl`).
const ROW: u32 = 1024;

/// Radiances of a row (as above).
const RADIANCE_ROW: u32 = 16_384;

/// Room for so many radiances.
pub(super) fn radiance_texels(gpu: &Gpu, count: u32) -> Result<Arc<Image>, Error> {
    let format = vk::Format::R32G32_UINT;
    texels(gpu, "svo.radiance", (count, RADIANCE_ROW), format)
}

/// A table of cells, and blocks: a texel of four words each, which comes in one load.
pub(super) struct OctreeSpace {
    cells: Arc<Image>,
    blocks: Arc<Image>,
}

impl OctreeSpace {
    /// Of an octree as it is now.
    pub(super) fn new(gpu: &Gpu, nodes: &NodePool) -> Result<Self, Error> {
        let root = nodes.root();
        let moving = nodes.dynamic.as_ref();
        let moving_blocks = moving.map_or(0, |tiles| tiles.levels[1].count);
        let params = IndexParams {
            edge: 1 << root.saturating_sub(CELL_LEVEL),
            root,
        };
        let cell_count = params.edge.pow(3);
        let block_count = nodes.levels[1].count + moving_blocks;
        let space = OctreeSpace {
            cells: texels(gpu, "svo.cells", (cell_count, ROW), WORDS)?,
            blocks: texels(gpu, "svo.blocks", (block_count, ROW), WORDS)?,
        };
        let counter = buffer(gpu, "svo.block_count", 4)?;
        let mut frame = Frame::new();
        frame.fill("svo.clear", &counter, 0);
        frame
            .pass(&INDEX_CELLS)
            .bind("nodes", &nodes.nodes)
            .bind("cells", &space.cells)
            .bind("blocks", &space.blocks)
            .bind("block_count", &counter)
            .push(&params)
            .dispatch(linear_groups(cell_count));
        gpu.enqueue(frame);
        Ok(space)
    }

    /// What rays go through.
    pub(super) fn as_space<'v>(&'v self, voxels: &'v Pieces, sides: Sides) -> Option<Space<'v>> {
        let (surfaces, words) = voxels.surfaces()?;
        let radiance = voxels.radiance_texels.as_ref();
        Some(Space {
            passes: &RAYS,
            grid: voxels.grid,
            bound: vec![
                ("cells", Bound::Image(&self.cells)),
                ("blocks", Bound::Image(&self.blocks)),
                ("surfaces", Bound::Buffer(surfaces)),
                ("voxel_radiance", Bound::Buffer(&voxels.radiance)),
                // Bound where nothing is read.
                (
                    "radiance_texels",
                    Bound::Image(radiance.unwrap_or(&self.blocks)),
                ),
            ],
            constants: vec![
                ("SURFACE_WORDS", words),
                ("RADIANCE_TEXELS", u32::from(radiance.is_some())),
            ],
            sides,
            // A line crosses at most 3 n voxels of an n³ grid.
            cells: 3 * voxels.grid.resolution + 1,
        })
    }
}

/// Four words a texel.
const WORDS: vk::Format = vk::Format::R32G32B32A32_UINT;

/// Room for so many texels, in rows.
fn texels(
    gpu: &Gpu,
    name: &'static str,
    (count, row): (u32, u32),
    format: vk::Format,
) -> Result<Arc<Image>, Error> {
    gpu.create_image(&ImageDesc {
        name: name.into(),
        extent: [count.clamp(1, row), count.div_ceil(row).max(1), 1],
        kind: ImageKind::D2,
        format,
        mips: 1,
        layers: 1,
        usage: ImageUsage::SAMPLED | ImageUsage::STORAGE,
        owner: Owner::Store,
    })
}
