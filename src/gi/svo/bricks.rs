//! The brick pool: 3³ texels a tile in one 3D texture, and the passes that fill it.

use std::sync::Arc;

use super::nodes::NodePool;
use super::touched::{Tiles, TouchedTiles};
use crate::gi::voxel::voxelize::{buffer, linear_groups};
use crate::gpu_struct;
use crate::graph::{Access, Binding, Buffer, Error, Frame, FrameStats, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Pass, Sets, Shaders, vk};

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
        /// 0 to 2: x, y, z.
        pub axis: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.copy_bricks`.
    pub struct CopyBricksParams {
        /// How many.
        pub brick_count: u32,
    }
}

const LEVELS: Binding = Binding::buffer("touched_levels", Access::ComputeRead);
const LIST: Binding = Binding::buffer("touched_tiles", Access::ComputeRead);

/// Radiance of the voxels of each leaf tile into its own brick. A thread a texel.
pub static WRITE_LEAVES: Pass = Pass {
    name: "svo.write_leaves",
    shaders: Shaders::Compute("gi/svo/write_leaves.comp"),
    bindings: &[
        Binding::buffer("nodes", Access::ComputeRead),
        Binding::buffer("voxel_radiance", Access::ComputeRead),
        Binding::image("bricks", Access::ComputeWrite),
        LEVELS,
        LIST,
    ],
    push_bytes: size_of::<BrickParams>() as u32,
    sets: Sets::None,
};

/// The texels that neighbouring bricks share, along one axis. A thread a tile.
pub static TRANSFER_BORDERS: Pass = Pass {
    name: "svo.transfer_borders",
    shaders: Shaders::Compute("gi/svo/transfer_borders.comp"),
    bindings: &[Binding::buffer("neighbours", Access::ComputeRead), Binding::image("bricks", Access::ComputeReadWrite), LEVELS, LIST],
    push_bytes: size_of::<TransferParams>() as u32,
    sets: Sets::None,
};

/// Bricks of a level from those of the next finer one. A thread a texel.
pub static FILTER: Pass = Pass {
    name: "svo.filter",
    shaders: Shaders::Compute("gi/svo/filter.comp"),
    bindings: &[Binding::buffer("nodes", Access::ComputeRead), Binding::image("bricks", Access::ComputeReadWrite), LEVELS, LIST],
    push_bytes: size_of::<BrickParams>() as u32,
    sets: Sets::None,
};

/// The first bricks of a pool into another. A thread a texel.
pub static COPY_BRICKS: Pass = Pass {
    name: "svo.copy_bricks",
    shaders: Shaders::Compute("gi/svo/copy_bricks.comp"),
    bindings: &[Binding::image("bricks", Access::ComputeRead), Binding::image("larger_bricks", Access::ComputeWrite)],
    push_bytes: size_of::<CopyBricksParams>() as u32,
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
    /// Once all bricks are filled, an update runs on those that light has touched; on centres only.
    pub touched: bool,
}

/// All bricks of an octree; brick and tile have the same index.
pub struct BrickPool {
    /// RGBA16F: radiance (W/(m² sr)) premultiplied by opacity, opacity.
    pub image: Arc<Image>,
    /// Bricks that there is room for.
    capacity: u32,
    settings: BrickSettings,
    touched: Option<TouchedTiles>,
    /// Bound where nothing is read.
    nothing: Arc<Buffer>,
    is_filled: bool,
}

impl BrickPool {
    /// Allocates a brick for each tile, all zero.
    pub fn new(gpu: &Gpu, nodes: &NodePool, settings: BrickSettings) -> Result<(Self, FrameStats), Error> {
        let capacity = nodes.room();
        let image = pool_image(gpu, capacity)?;
        let mut frame = Frame::new();
        let touched = (settings.touched && !settings.corners).then(|| TouchedTiles::new(gpu, nodes, &mut frame)).transpose()?;
        // What no tile writes, a brick's last texels without a neighbour, stays zero.
        frame.clear_image("svo.clear", &image, [0.0; 4]);
        let stats = gpu.submit(frame)?;
        Ok((BrickPool { image, capacity, settings, touched, nothing: buffer(gpu, "svo.nothing", 0)?, is_filled: false }, stats))
    }

    /// Makes room for the bricks of dynamic tiles that have become more; static bricks go along as they are.
    pub fn reserve(&mut self, gpu: &Gpu, nodes: &NodePool) -> Result<FrameStats, Error> {
        if let Some(touched) = &mut self.touched {
            touched.reserve(gpu, nodes)?;
        }
        let mut frame = Frame::new();
        if nodes.room() > self.capacity {
            let larger = pool_image(gpu, nodes.room())?;
            let brick_count = nodes.static_end();
            let pass = frame.pass(&COPY_BRICKS).bind(&self.image).bind(&larger);
            pass.push(&CopyBricksParams { brick_count }).dispatch(linear_groups(27 * brick_count));
            (self.image, self.capacity) = (larger, nodes.room());
        }
        gpu.submit(frame)
    }

    /// Adds the passes from the voxels' light to all levels.
    pub fn update(&mut self, frame: &mut Frame, nodes: &NodePool, radiance: &Arc<Buffer>) {
        let is_filled = std::mem::replace(&mut self.is_filled, true);
        for level in 0..nodes.levels.len() {
            let tiles = match &self.touched {
                Some(touched) if is_filled => touched.find(frame, nodes, radiance, level),
                _ => Tiles::all(nodes, level, &self.nothing),
            };
            if level == 0 {
                self.write_leaves(frame, nodes, radiance, &tiles);
            } else {
                self.filter(frame, nodes, &tiles);
            }
            for axis in 0..3 {
                let pass = frame.pass(&TRANSFER_BORDERS).bind(&nodes.neighbours).bind(&self.image);
                let BrickParams { first, count, first_dynamic, dynamic_count, level } = tiles.params();
                let params = TransferParams { first, count, first_dynamic, dynamic_count, level, axis };
                tiles.dispatch(pass, &[u32::from(self.settings.corners)], &params, 1);
            }
            if let Some(dynamic) = &nodes.dynamic {
                dynamic.keep_static(frame, level, &self.image);
            }
        }
        if let (Some(touched), false) = (&self.touched, is_filled) {
            for level in 0..nodes.levels.len() {
                touched.find(frame, nodes, radiance, level);
            }
        }
    }

    fn write_leaves(&self, frame: &mut Frame, nodes: &NodePool, radiance: &Arc<Buffer>, tiles: &Tiles) {
        let pass = frame.pass(&WRITE_LEAVES).bind(&nodes.nodes).bind(radiance).bind(&self.image);
        let texels = if self.settings.corners { 27 } else { 8 };
        tiles.dispatch(pass, &[u32::from(self.settings.corners)], &tiles.params(), texels);
    }

    fn filter(&self, frame: &mut Frame, nodes: &NodePool, tiles: &Tiles) {
        // Number of the part, and its texels.
        let parts: &[(u32, u32)] = match self.settings {
            BrickSettings { corners: false, .. } => &[(0, 8)],
            BrickSettings { is_split: true, .. } => &[(1, 1), (2, 18), (3, 8)],
            _ => &[(0, 27)],
        };
        for (part, texels) in parts {
            let pass = frame.pass(&FILTER).bind(&nodes.nodes).bind(&self.image);
            tiles.dispatch(pass, &[self.settings.filter, u32::from(self.settings.corners), *part], &tiles.params(), *texels);
        }
    }

    /// Tiles that the last update ran on, where it ran on some only.
    pub fn touched_count(&self, gpu: &Gpu) -> Result<Option<u64>, Error> {
        self.touched.as_ref().map(|touched| touched.count(gpu)).transpose()
    }
}

fn pool_image(gpu: &Gpu, count: u32) -> Result<Arc<Image>, Error> {
    gpu.create_image(&ImageDesc {
        name: "svo.bricks".into(),
        extent: pool_extent(count).map(|bricks| 3 * bricks),
        kind: ImageKind::D3,
        format: vk::Format::R16G16B16A16_SFLOAT,
        mips: 1,
        layers: 1,
        usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
    })
}

/// Bricks along each axis of a pool of `count`: near to a cube, width and height powers of two, at most 2% left over (or three bricks).
pub fn pool_extent(count: u32) -> [u32; 3] {
    let count = count.max(1);
    let slice_bits = (count.ilog2() * 2 / 3).min((count / 50).max(1).ilog2());
    let (width, height) = (1 << slice_bits.div_ceil(2), 1 << (slice_bits / 2));
    [width, height, count.div_ceil(width * height)]
}
