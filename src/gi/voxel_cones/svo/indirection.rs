//! The indirection texture: which tile is at a place of a level, for all but the finest levels. So
//! cones find a brick without a descent from the root, and know empty space by one texel
//! (`gi/voxel_cones/svo/indirection.glsl`).

use std::sync::Arc;

use super::nodes::NodePool;
use crate::gpu_struct;
use crate::graph::compute::{linear_groups, read};
use crate::graph::{
    Access, Binding, Error, Frame, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Owner, Pass, vk,
};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `svo.index_tiles`.
    pub struct IndexTilesParams {
        /// The level, 0 the finest.
        pub level: u32,
        /// Level of the root.
        pub root: u32,
    }
}

/// The tiles of a level by their places. A thread a place of the level above.
pub static INDEX_TILES: Pass = Pass::compute(
    "svo.index_tiles",
    "gi/voxel_cones/svo/index_tiles.comp",
    &[
        read("nodes"),
        Binding::image("indirection", Access::ComputeReadWrite),
    ],
    IndexTilesParams::LAYOUT,
);

/// log2 of tiles along an edge of its finest level, at most (as in
/// `gi/voxel_cones/svo/indirection.glsl`).
const BITS: u32 = 6;

/// RG32UI: room for the cube of the finest level that it has, and behind it for all others.
pub(super) fn indirection_image(gpu: &Gpu, nodes: &NodePool) -> Result<Arc<Image>, Error> {
    let edge = 1 << nodes.root().min(BITS);
    gpu.create_image(&ImageDesc {
        name: "svo.indirection".into(),
        extent: [edge, edge, edge + edge.div_ceil(2)],
        kind: ImageKind::D3,
        format: vk::Format::R32G32_UINT,
        mips: 1,
        layers: 1,
        usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
        owner: Owner::Store,
    })
}

/// Adds the passes that fill it from the tiles as they are now.
pub(super) fn index_tiles(frame: &mut Frame, nodes: &NodePool, indirection: &Arc<Image>) {
    let root = nodes.root();
    frame.clear_image("svo.clear", indirection, 0);
    for level in (root.saturating_sub(BITS)..=root).rev() {
        frame
            .pass(&INDEX_TILES)
            .bind("nodes", &nodes.nodes)
            .bind("indirection", indirection)
            .push(&IndexTilesParams { level, root })
            .dispatch(linear_groups(1 << (3 * (root - level).saturating_sub(1))));
    }
}
