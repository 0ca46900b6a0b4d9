//! The tiles that light has touched, level by level, so that an update can leave the others alone.
//!
//! An untouched brick holds opacity and no radiance, and did so after the last update: all that is
//! in it was written when all bricks were filled. So an update of the touched ones gives the same
//! bits as one of all. Dynamic tiles are made anew in each update.

use std::sync::Arc;

use super::brick_passes::BrickParams;
use super::bricks::LevelBricks;
use super::nodes::{LevelRange, NodePool};
use crate::gi::shared::voxel::build::buffer;
use crate::gpu_struct;
use crate::graph::compute::linear_groups;
use crate::graph::{Access, Binding, Buffer, Error, Frame, Gpu, Pass, PassBuilder};
use crate::shader::GpuStruct;

gpu_struct! {
    /// The touched tiles of a level on the device (`gi/voxel_cones/svo/touched.glsl`).
    pub struct Touched {
        /// Number of touched tiles.
        pub count: u32,
        /// Workgroups of 64 threads, eight threads a tile: along x.
        pub texel_groups_x: u32,
        /// The same dispatch along y.
        pub texel_groups_y: u32,
        /// The same dispatch along z.
        pub texel_groups_z: u32,
        /// Workgroups of 64 threads, one thread a tile: along x.
        pub tile_groups_x: u32,
        /// The same dispatch along y.
        pub tile_groups_y: u32,
        /// The same dispatch along z.
        pub tile_groups_z: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.flag_touched`.
    pub struct TouchParams {
        /// First tile of the level.
        pub first: u32,
        /// Tiles of the level.
        pub count: u32,
        /// First tile of the next finer level.
        pub first_child: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.list_touched`.
    pub struct ListTouchedParams {
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

/// Which tiles of a level light has touched. A thread a tile.
pub static FLAG_TOUCHED: Pass = Pass {
    constants: &["LEAVES", "SIDES"],
    ..Pass::compute(
        "svo.flag_touched",
        "gi/voxel_cones/svo/flag_touched.comp",
        &[
            Binding::buffer("nodes", Access::ComputeRead),
            Binding::buffer("neighbours", Access::ComputeRead),
            Binding::buffer("voxel_radiance", Access::ComputeRead),
            Binding::buffer("touched_children", Access::ComputeRead),
            Binding::buffer("touched_bits", Access::ComputeReadWrite),
            Binding::buffer("lit_leaves", Access::ComputeReadWrite),
        ],
        TouchParams::LAYOUT,
    )
};

/// The touched tiles of a level, and all dynamic ones, as a list. A thread 32 tiles.
pub static LIST_TOUCHED: Pass = Pass::compute(
    "svo.list_touched",
    "gi/voxel_cones/svo/list_touched.comp",
    &[
        Binding::buffer("touched_bits", Access::ComputeRead),
        Binding::buffer("touched_levels", Access::ComputeReadWrite),
        Binding::buffer("touched_tiles", Access::ComputeWrite),
    ],
    ListTouchedParams::LAYOUT,
);

/// Finds the touched tiles.
pub(super) struct TouchedTiles {
    /// A bit a tile of an even and of an odd level.
    bits: [Arc<Buffer>; 2],
    /// A bit a leaf tile that held light in the last update.
    lit_leaves: Arc<Buffer>,
    /// A [`Touched`] a level.
    levels: Arc<Buffer>,
    /// The touched tiles of one level.
    list: Arc<Buffer>,
}

impl TouchedTiles {
    /// For these nodes, without light; `frame` runs before all others that use it.
    pub(super) fn new(gpu: &Gpu, nodes: &NodePool, frame: &mut Frame) -> Result<Self, Error> {
        let most = nodes
            .levels
            .iter()
            .map(|level| u64::from(level.count))
            .max()
            .unwrap_or(1);
        let bits = || buffer(gpu, "svo.touched_bits", 4 * most.div_ceil(32));
        let made = TouchedTiles {
            bits: [bits()?, bits()?],
            lit_leaves: buffer(
                gpu,
                "svo.lit_leaves",
                4 * u64::from(nodes.levels[0].count.div_ceil(32)),
            )?,
            levels: buffer(
                gpu,
                "svo.touched_levels",
                (size_of::<Touched>() * nodes.levels.len()) as u64,
            )?,
            list: list_buffer(gpu, nodes)?,
        };
        frame.fill("svo.clear", &made.lit_leaves, 0);
        Ok(made)
    }

    /// Makes room for these nodes, whose dynamic tiles are others than before.
    pub(super) fn reserve(&mut self, gpu: &Gpu, nodes: &NodePool) -> Result<(), Error> {
        if self.list.size_bytes() < 4 * u64::from(nodes.largest_level()) {
            self.list = list_buffer(gpu, nodes)?;
        }
        Ok(())
    }

    /// Adds the passes that find the touched tiles of a level. Levels come in order, finest first,
    /// and the tiles hold until the next is asked for. `sides`: radiances of a voxel.
    pub(super) fn find<'t>(
        &'t self,
        frame: &mut Frame,
        nodes: &NodePool,
        radiance: &Arc<Buffer>,
        sides: u32,
        level: usize,
    ) -> Tiles<'t> {
        let ranges = nodes.ranges(level);
        let [
            LevelRange { first, count },
            LevelRange {
                first: first_dynamic,
                count: dynamic_count,
            },
        ] = ranges;
        let (own, children) = (&self.bits[level % 2], &self.bits[1 - level % 2]);
        if level == 0 {
            frame.fill("svo.clear_touched", &self.levels, 0);
        }
        frame.fill("svo.clear_touched", own, 0);
        frame
            .pass(&FLAG_TOUCHED)
            .bind("nodes", &nodes.nodes)
            .bind("neighbours", &nodes.neighbours)
            .bind("voxel_radiance", radiance)
            .bind("touched_children", children)
            .bind("touched_bits", own)
            .bind("lit_leaves", &self.lit_leaves)
            .constant("LEAVES", level == 0)
            .constant("SIDES", sides)
            .push(&TouchParams {
                first,
                count,
                first_child: first + count,
            })
            .dispatch(linear_groups(count));
        let params = ListTouchedParams {
            first,
            count,
            first_dynamic,
            dynamic_count,
            level: level as u32,
        };
        let groups = (count.div_ceil(32) + dynamic_count.div_ceil(32)).div_ceil(256);
        frame
            .pass(&LIST_TOUCHED)
            .bind("touched_bits", own)
            .bind("touched_levels", &self.levels)
            .bind("touched_tiles", &self.list)
            .push(&params)
            .dispatch([groups, 1, 1]);
        Tiles {
            ranges,
            level: level as u32,
            lists: [&self.levels, &self.list],
            is_listed: true,
        }
    }

    /// Touched tiles of all levels, in the last update.
    pub(super) fn count(&self, gpu: &Gpu) -> Result<u64, Error> {
        let levels: Vec<u32> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&self.levels)?);
        Ok(levels
            .chunks_exact(size_of::<Touched>() / 4)
            .map(|level| u64::from(level[0]))
            .sum())
    }
}

fn list_buffer(gpu: &Gpu, nodes: &NodePool) -> Result<Arc<Buffer>, Error> {
    buffer(
        gpu,
        "svo.touched_tiles",
        4 * u64::from(nodes.largest_level()),
    )
}

/// Tiles of a level that passes over bricks run on.
pub(super) struct Tiles<'t> {
    /// Static and dynamic ones.
    ranges: [LevelRange; 2],
    pub(super) level: u32,
    /// The touched tiles by level, and one by one.
    lists: [&'t Arc<Buffer>; 2],
    is_listed: bool,
}

impl<'t> Tiles<'t> {
    /// All tiles; `nothing` is bound in place of a list.
    pub(super) fn all(nodes: &NodePool, level: usize, nothing: &'t Arc<Buffer>) -> Self {
        Tiles {
            ranges: nodes.ranges(level),
            level: level as u32,
            lists: [nothing; 2],
            is_listed: false,
        }
    }

    /// All dynamic tiles.
    pub(super) fn dynamic(nodes: &NodePool, level: usize, nothing: &'t Arc<Buffer>) -> Self {
        let [LevelRange { first, .. }, dynamic] = nodes.ranges(level);
        Tiles {
            ranges: [LevelRange { first, count: 0 }, dynamic],
            ..Tiles::all(nodes, level, nothing)
        }
    }

    /// The parameters of a pass over these tiles: where their own bricks and their children's are.
    pub(super) fn params(&self, [own, children]: [LevelBricks; 2]) -> BrickParams {
        let [
            LevelRange { first, count },
            LevelRange {
                first: first_dynamic,
                count: dynamic_count,
            },
        ] = self.ranges;
        let LevelBricks { shift, stride, .. } = own;
        let (child_shift, child_stride) = (children.shift, children.stride);
        BrickParams {
            first,
            count,
            first_dynamic,
            dynamic_count,
            level: self.level,
            shift,
            stride,
            child_shift,
            child_stride,
        }
    }

    /// Runs a pass with `threads` a tile: eight or one, or any number where no list is followed.
    /// Binds the lists, and says whether it follows them.
    pub(super) fn dispatch<T: bytemuck::Pod>(
        &self,
        pass: PassBuilder<'_>,
        params: &T,
        threads: u32,
    ) {
        let [levels, list] = self.lists;
        let pass = pass
            .bind("touched_levels", levels)
            .bind("touched_tiles", list)
            .constant("TOUCHED", self.is_listed)
            .push(params);
        if self.is_listed {
            let arguments = if threads == 8 { 4 } else { 16 };
            pass.dispatch_indirect(
                levels,
                (size_of::<Touched>() * self.level as usize) as u64 + arguments,
            );
        } else {
            pass.dispatch(linear_groups(
                threads * self.ranges.iter().map(|range| range.count).sum::<u32>(),
            ));
        }
    }
}
