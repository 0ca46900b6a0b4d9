//! The octree as exact rays go through it: a table of its cells of 16³ voxels, and blocks of 4³. So
//! a ray finds a voxel by two texels, however deep the octree is.

use std::sync::Arc;

use super::nodes::NodePool;
use super::{Pieces, RAYS};
use crate::gi::shared::voxel::build::{buffer, linear_groups};
use crate::gi::shared::voxel::{Sides, Space};
use crate::gpu_struct;
use crate::graph::compute::{read, read_write};
use crate::graph::{
    Access, Binding, Bound, Error, Frame, FrameStats, Gpu, Image, ImageDesc, ImageKind, ImageUsage,
    Owner, Pass, vk,
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

/// Level of tiles as large as a cell.
const CELL_LEVEL: u32 = 3;

/// Texels of a row (`glsl/gi/voxel_cones/svo/cells.glsl`).
const ROW: u32 = 1024;

/// A table of cells, and blocks: a texel of four words each, which comes in one load.
pub(super) struct OctreeSpace {
    cells: Arc<Image>,
    blocks: Arc<Image>,
}

impl OctreeSpace {
    /// Of an octree as it is now.
    pub(super) fn new(gpu: &Gpu, nodes: &NodePool) -> Result<(Self, FrameStats), Error> {
        let root = nodes.levels.len() as u32 - 1;
        let moving = nodes.dynamic.as_ref();
        let moving_blocks = moving.map_or(0, |tiles| tiles.levels[1].count);
        let params = IndexParams {
            edge: 1 << root.saturating_sub(CELL_LEVEL),
            root,
        };
        let cell_count = params.edge.pow(3);
        let space = OctreeSpace {
            cells: texels(gpu, "svo.cells", cell_count)?,
            blocks: texels(gpu, "svo.blocks", nodes.levels[1].count + moving_blocks)?,
        };
        let block_count = buffer(gpu, "svo.block_count", 4)?;
        let mut frame = Frame::new();
        frame.fill("svo.clear", &block_count, 0);
        frame
            .pass(&INDEX_CELLS)
            .bind("nodes", &nodes.nodes)
            .bind("cells", &space.cells)
            .bind("blocks", &space.blocks)
            .bind("block_count", &block_count)
            .push(&params)
            .dispatch(linear_groups(cell_count));
        let stats = gpu.submit(frame)?;
        Ok((space, stats))
    }

    /// What rays go through.
    pub(super) fn as_space<'v>(&'v self, voxels: &'v Pieces, sides: Sides) -> Option<Space<'v>> {
        let (surfaces, words) = voxels.surfaces()?;
        Some(Space {
            passes: &RAYS,
            grid: voxels.grid,
            bound: vec![
                ("cells", Bound::Image(&self.cells)),
                ("blocks", Bound::Image(&self.blocks)),
                ("surfaces", Bound::Buffer(surfaces)),
                ("voxel_radiance", Bound::Buffer(&voxels.radiance)),
            ],
            constants: vec![("SURFACE_WORDS", words)],
            sides,
            // A line crosses at most 3 n voxels of an n³ grid, and each is a turn of the loop.
            turns: 3 * voxels.grid.resolution + 1,
        })
    }
}

/// Room for so many texels of four words.
fn texels(gpu: &Gpu, name: &'static str, count: u32) -> Result<Arc<Image>, Error> {
    gpu.create_image(&ImageDesc {
        name: name.into(),
        extent: [count.clamp(1, ROW), count.div_ceil(ROW).max(1), 1],
        kind: ImageKind::D2,
        format: vk::Format::R32G32B32A32_UINT,
        mips: 1,
        layers: 1,
        usage: ImageUsage::SAMPLED | ImageUsage::STORAGE,
        owner: Owner::Store,
    })
}
