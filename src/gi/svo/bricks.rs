//! The brick pool: 3³ texels a tile in one 3D texture, and the passes that fill it.

use std::sync::Arc;

use super::nodes::{LevelRange, NodePool};
use crate::gi::voxel::voxelize::linear_groups;
use crate::gpu_struct;
use crate::graph::{Access, Binding, Buffer, Error, Frame, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Pass, Sets, Shaders, vk};

gpu_struct! {
    /// Parameters of `svo.write_leaves` and `svo.filter`.
    pub struct BrickParams {
        /// First tile of the level.
        pub first: u32,
        /// Tiles of the level.
        pub count: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.transfer_borders`.
    pub struct TransferParams {
        /// First tile of the level.
        pub first: u32,
        /// Tiles of the level.
        pub count: u32,
        /// 0 to 2: towards +x, +y, +z.
        pub axis: u32,
    }
}

/// Radiance of the voxels of each leaf tile into its own brick. A thread a texel.
pub static WRITE_LEAVES: Pass = Pass {
    name: "svo.write_leaves",
    shaders: Shaders::Compute("gi/svo/write_leaves.comp"),
    bindings: &[
        Binding::buffer("nodes", Access::ComputeRead),
        Binding::buffer("voxel_radiance", Access::ComputeRead),
        Binding::image("bricks", Access::ComputeWrite),
    ],
    push_bytes: size_of::<BrickParams>() as u32,
    sets: Sets::None,
};

/// The texels that neighbouring bricks share, along one axis. A thread a tile.
pub static TRANSFER_BORDERS: Pass = Pass {
    name: "svo.transfer_borders",
    shaders: Shaders::Compute("gi/svo/transfer_borders.comp"),
    bindings: &[Binding::buffer("neighbours", Access::ComputeRead), Binding::image("bricks", Access::ComputeReadWrite)],
    push_bytes: size_of::<TransferParams>() as u32,
    sets: Sets::None,
};

/// Bricks of a level from those of the next finer one. A thread a texel.
pub static FILTER: Pass = Pass {
    name: "svo.filter",
    shaders: Shaders::Compute("gi/svo/filter.comp"),
    bindings: &[Binding::buffer("nodes", Access::ComputeRead), Binding::image("bricks", Access::ComputeReadWrite)],
    push_bytes: size_of::<BrickParams>() as u32,
    sets: Sets::None,
};

/// How bricks are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BrickSettings {
    /// Lattice points are corners of voxels, to which these spread; otherwise they are the centres of the texels of dense mips.
    pub corners: bool,
    /// `mode` of `filter_eight` (`gi/voxel/prefilter.glsl`).
    pub filter: u32,
    /// The filter runs apart for centres, for faces and edges, and for corners.
    pub is_split: bool,
}

/// All bricks of an octree; brick and tile have the same index.
pub struct BrickPool {
    /// RGBA16F: radiance (W/(m² sr)) premultiplied by opacity, opacity.
    pub image: Arc<Image>,
    settings: BrickSettings,
}

impl BrickPool {
    /// Allocates a brick for each tile.
    pub fn new(gpu: &Gpu, nodes: &NodePool, settings: BrickSettings) -> Result<Self, Error> {
        let count = nodes.levels[0].first + nodes.levels[0].count;
        let image = gpu.create_image(&ImageDesc {
            name: "svo.bricks".into(),
            extent: pool_extent(count).map(|bricks| 3 * bricks),
            kind: ImageKind::D3,
            format: vk::Format::R16G16B16A16_SFLOAT,
            mips: 1,
            layers: 1,
            usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
        })?;
        Ok(BrickPool { image, settings })
    }

    /// Adds the passes from the voxels' light to all levels.
    pub fn update(&self, frame: &mut Frame, nodes: &NodePool, radiance: &Arc<Buffer>) {
        let leaves = nodes.levels[0];
        frame
            .pass(&WRITE_LEAVES)
            .bind(&nodes.nodes)
            .bind(radiance)
            .bind(&self.image)
            .constants(&[u32::from(self.settings.corners)])
            .push(&BrickParams { first: leaves.first, count: leaves.count })
            .dispatch(linear_groups(if self.settings.corners { 27 } else { 8 } * leaves.count));
        self.transfer(frame, nodes, leaves);
        for level in &nodes.levels[1..] {
            // Number of the part, and its texels.
            let parts: &[(u32, u32)] = match self.settings {
                BrickSettings { corners: false, .. } => &[(0, 8)],
                BrickSettings { is_split: true, .. } => &[(1, 1), (2, 18), (3, 8)],
                _ => &[(0, 27)],
            };
            for (part, texels) in parts {
                frame
                    .pass(&FILTER)
                    .bind(&nodes.nodes)
                    .bind(&self.image)
                    .constants(&[self.settings.filter, u32::from(self.settings.corners), *part])
                    .push(&BrickParams { first: level.first, count: level.count })
                    .dispatch(linear_groups(texels * level.count));
            }
            self.transfer(frame, nodes, *level);
        }
    }

    fn transfer(&self, frame: &mut Frame, nodes: &NodePool, level: LevelRange) {
        for axis in 0..3 {
            frame
                .pass(&TRANSFER_BORDERS)
                .bind(&nodes.neighbours)
                .bind(&self.image)
                .constants(&[u32::from(self.settings.corners)])
                .push(&TransferParams { first: level.first, count: level.count, axis })
                .dispatch(linear_groups(level.count));
        }
    }
}

/// Bricks along each axis of a pool of `count`: near to a cube, width and height powers of two, at most 10% left over (or three bricks).
pub fn pool_extent(count: u32) -> [u32; 3] {
    let count = count.max(1);
    let slice_bits = (count.ilog2() * 2 / 3).min((count / 10).max(1).ilog2());
    let (width, height) = (1 << slice_bits.div_ceil(2), 1 << (slice_bits / 2));
    [width, height, count.div_ceil(width * height)]
}
