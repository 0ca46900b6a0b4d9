//! The node pool: 2³ node tiles behind one child pointer, built level by level from the root.

use std::sync::Arc;

use glam::UVec3;

use super::dynamic::{DynamicTiles, TouchedVoxels};
use super::pieces::Occupancy;
use crate::gi::shared::voxel::build::FilledBlocks;
use crate::gi::shared::voxel::build::buffer;
use crate::gpu_struct;
use crate::graph::compute::{linear_groups, read, read_write, write};
use crate::graph::{Buffer, Error, Frame, FrameStats, Gpu, Pass};
use crate::shader::GpuStruct;

gpu_struct! {
    /// One level of the pool on the device (`gi/voxel_cones/svo/pool.glsl`).
    pub struct Level {
        /// Index of its first tile.
        pub first: u32,
        /// Number of its tiles.
        pub count: u32,
        /// Workgroups of a dispatch over its tiles, along x.
        pub groups_x: u32,
        /// Workgroups of that dispatch along y.
        pub groups_y: u32,
        /// Workgroups of that dispatch along z.
        pub groups_z: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.reduce_points`.
    pub struct ReduceParams {
        /// Blocks of the finer points along an axis.
        pub finer_blocks: u32,
        /// First block of the finer points in the whole lattice, along x.
        pub first_x: i32,
        /// First block of the finer points in the whole lattice, along y.
        pub first_y: i32,
        /// First block of the finer points in the whole lattice, along z.
        pub first_z: i32,
        /// Blocks of the coarser points along an axis.
        pub point_blocks: u32,
        /// Blocks of tiles along an axis.
        pub tile_blocks: u32,
        /// Tiles of the level along an axis.
        pub tile_limit: u32,
        /// The level, 0 the finest.
        pub level: u32,
        /// Blocks that are looked at.
        pub block_count: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.flag_nodes`.
    pub struct FlagParams {
        /// The level whose nodes are flagged.
        pub level: u32,
        /// Blocks of the children's tile bits along an axis.
        pub child_blocks: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.scan_nodes`, `svo.allocate_tiles` and `svo.link_neighbours`.
    pub struct LevelParams {
        /// The level of the nodes that lead to others.
        pub level: u32,
        /// No tile before this one is given away, or linked.
        pub first_child: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.link_leaves`.
    pub struct LeafParams {
        /// Blocks along an edge of the cube whose voxels are linked.
        pub blocks: u32,
        /// First block of the cube in the whole grid, along x.
        pub first_x: u32,
        /// First block of the cube in the whole grid, along y.
        pub first_y: u32,
        /// First block of the cube in the whole grid, along z.
        pub first_z: u32,
        /// Compact index of the cube's first voxel.
        pub first_voxel: u32,
        /// The tile whose place comes first.
        pub first_place: u32,
        /// Leaf tiles before this one are left as they are.
        pub first_child: u32,
    }
}

/// Points of the next coarser lattice, and tiles of this level, that hold something. A thread 4³ of
/// the finer points.
pub static REDUCE_POINTS: Pass = Pass {
    constants: &["POINT_REACH", "TILE_REACH", "LISTED"],
    ..Pass::compute(
        "svo.reduce_points",
        "gi/voxel_cones/svo/reduce_points.comp",
        &[
            read("finer_points"),
            read_write("coarser_points"),
            read_write("level_tiles"),
            read_write("tile_counts"),
            read("filled_blocks"),
        ],
        ReduceParams::LAYOUT,
    )
};

/// Which nodes of a level have children. A thread 16 tiles, as many as the device says.
pub static FLAG_NODES: Pass = Pass::compute(
    "svo.flag_nodes",
    "gi/voxel_cones/svo/flag_nodes.comp",
    &[
        read("levels"),
        read("tiles"),
        read("child_bits"),
        write("nodes"),
        write("group_sums"),
    ],
    FlagParams::LAYOUT,
);

/// Prefix sum over groups of tiles; the next finer level. One workgroup.
pub static SCAN_NODES: Pass = Pass::compute(
    "svo.scan_nodes",
    "gi/voxel_cones/svo/scan_nodes.comp",
    &[read_write("group_sums"), read_write("levels")],
    LevelParams::LAYOUT,
);

/// Child pointers, and the places of the child tiles. A thread 16 tiles, as many as the device
/// says.
pub static ALLOCATE_TILES: Pass = Pass::compute(
    "svo.allocate_tiles",
    "gi/voxel_cones/svo/allocate_tiles.comp",
    &[
        read("levels"),
        read("group_sums"),
        read_write("nodes"),
        read_write("tiles"),
    ],
    LevelParams::LAYOUT,
);

/// Voxels of leaf tiles. A thread 16 tiles of the level above, as many as the device says.
pub static LINK_LEAVES: Pass = Pass::compute(
    "svo.link_leaves",
    "gi/voxel_cones/svo/link_leaves.comp",
    &[
        read("levels"),
        read("tiles"),
        read("occupancy"),
        read("block_bases"),
        read_write("nodes"),
    ],
    LeafParams::LAYOUT,
);

/// The neighbours before each tile that a level's nodes lead to. A thread 16 tiles, as many as the
/// device says.
pub static LINK_NEIGHBOURS: Pass = Pass::compute(
    "svo.link_neighbours",
    "gi/voxel_cones/svo/link_neighbours.comp",
    &[read("levels"), read("nodes"), read_write("neighbours")],
    LevelParams::LAYOUT,
);

/// An error where there are more tiles, or voxels, than the 24 bits of a child pointer tell apart.
pub(super) fn require_pointers(resource: &str, count: u64) -> Result<(), Error> {
    let most = 1 << 24;
    if count <= most {
        return Ok(());
    }
    Err(Error::ImageTooLarge {
        resource: resource.to_owned(),
        wanted: count.to_string(),
        available: format!("{most} (24-bit pointers)"),
    })
}

/// Tiles of a workgroup, as in `gi/voxel_cones/svo/pool.glsl`.
pub(super) const TILES_PER_GROUP: u32 = 1024;

/// Where the tiles of a level are in the pool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelRange {
    /// Index of the first tile.
    pub first: u32,
    /// Number of tiles.
    pub count: u32,
}

/// The octree's nodes.
pub struct NodePool {
    /// A word a tile: which of its eight nodes have a child, and the first child
    /// (`gi/voxel_cones/svo/pool.glsl`).
    pub nodes: Arc<Buffer>,
    /// Three words a tile: index + 1 of the neighbour towards −x, −y, −z, or 0. Empty after
    /// [`NodePool::forget_neighbours`].
    pub neighbours: Arc<Buffer>,
    /// The static levels, finest first; tiles of a level are in the order of their parents' nodes,
    /// and coarser levels come first in the pool.
    pub levels: Vec<LevelRange>,
    /// What is behind them where there are dynamic models: then tile 0 is the root of both, and
    /// the static root tile 1.
    pub dynamic: Option<DynamicTiles>,
}

/// Which points and tiles there are, on every level; needed during the build only.
struct Pyramid {
    /// By level: points of the next coarser lattice, tiles of the level.
    levels: Vec<[Arc<Buffer>; 2]>,
    counts: Arc<Buffer>,
    resolution: u32,
    corners: bool,
}

impl Pyramid {
    fn new(gpu: &Gpu, resolution: u32, corners: bool) -> Result<Self, Error> {
        let bits = |level| -> Result<[Arc<Buffer>; 2], Error> {
            let bytes = |blocks: u32| 8 * u64::from(blocks).pow(3);
            let [points, tiles] = [
                point_blocks(resolution, level, corners),
                tile_blocks(resolution, level),
            ]
            .map(bytes);
            Ok([
                buffer(gpu, "svo.points", points)?,
                buffer(gpu, "svo.tile_bits", tiles)?,
            ])
        };
        let levels = (0..=root(resolution))
            .map(bits)
            .collect::<Result<Vec<_>, _>>()?;
        let counts = buffer(gpu, "svo.tile_counts", 4 * levels.len() as u64)?;
        Ok(Pyramid {
            levels,
            counts,
            resolution,
            corners,
        })
    }

    fn add(&self, frame: &mut Frame, voxels: &Occupancy) {
        frame.fill("svo.clear", &self.counts, 0);
        for bits in self.levels.iter().flatten() {
            frame.fill("svo.clear", bits, 0);
        }
        for cube in &voxels.cubes {
            self.reduce(
                frame,
                0,
                (&cube.occupancy, cube.filled.as_ref()),
                cube.resolution / 4,
                cube.first / 4,
            );
        }
        for level in 1..self.levels.len() as u32 {
            self.reduce(
                frame,
                level,
                (&self.levels[level as usize - 1][0], None),
                point_blocks(self.resolution, level - 1, self.corners),
                UVec3::ZERO,
            );
        }
    }

    /// Reduces a cube of finer points, given in blocks: its edge, and its `first` block in the
    /// whole lattice. The blocks that have any may be listed.
    fn reduce(
        &self,
        frame: &mut Frame,
        level: u32,
        (finer, filled): (&Arc<Buffer>, Option<&FilledBlocks>),
        finer_blocks: u32,
        first: UVec3,
    ) {
        let [first_x, first_y, first_z] = first.as_ivec3().to_array();
        let params = ReduceParams {
            finer_blocks,
            first_x,
            first_y,
            first_z,
            point_blocks: point_blocks(self.resolution, level, self.corners),
            tile_blocks: tile_blocks(self.resolution, level),
            tile_limit: self.resolution >> (level + 1),
            level,
            block_count: filled.map_or(finer_blocks.pow(3), |filled| filled.count),
        };
        // Voxels spread to corners by one point.
        let spread = u32::from(self.corners && level == 0);
        let [points, tiles] = &self.levels[level as usize];
        frame
            .pass(&REDUCE_POINTS)
            .bind("finer_points", finer)
            .bind("coarser_points", points)
            .bind("level_tiles", tiles)
            .bind("tile_counts", &self.counts)
            // Bound where nothing is read.
            .bind(
                "filled_blocks",
                filled.map_or(finer, |filled| &filled.blocks),
            )
            .constant("LISTED", filled.is_some())
            .constant("POINT_REACH", u32::from(self.corners) + spread)
            .constant("TILE_REACH", spread)
            .push(&params)
            .dispatch(linear_groups(params.block_count));
    }

    /// Tiles of each level, finest first, from tile `first` on. There is always a root.
    fn levels_of(&self, counts: &[u8], mut first: u32) -> Vec<LevelRange> {
        let counts: Vec<u32> = bytemuck::pod_collect_to_vec(counts);
        let mut levels: Vec<LevelRange> = (0..self.levels.len())
            .rev()
            .map(|level| {
                let count = if level + 1 == self.levels.len() {
                    1
                } else {
                    counts[level]
                };
                let range = LevelRange { first, count };
                first += count;
                range
            })
            .collect();
        levels.reverse();
        levels
    }
}

/// The coarsest level: two nodes along an axis.
pub fn root(resolution: u32) -> u32 {
    resolution.ilog2() - 1
}

/// Blocks of 4³ along an axis that hold the tiles of a level.
pub(super) fn tile_blocks(resolution: u32, level: u32) -> u32 {
    (resolution >> (level + 3)).max(1)
}

/// Blocks of 4³ along an axis that hold the points of the lattice above `level`: as many as there
/// are tiles, and on corners one more.
fn point_blocks(resolution: u32, level: u32, corners: bool) -> u32 {
    if corners {
        (resolution >> (level + 3)) + 1
    } else {
        tile_blocks(resolution, level)
    }
}

impl NodePool {
    /// Builds the octree over these voxels. The tiles are counted first, and the count is read back
    /// once, so that the pool is exact.
    pub fn build(
        gpu: &Gpu,
        voxels: &Occupancy,
        corners: bool,
    ) -> Result<(Self, FrameStats), Error> {
        Self::build_from(gpu, voxels, corners, 0)
    }

    /// Builds the octree over static voxels, among which [`NodePool::follow`] then puts dynamic
    /// ones; until it has, there is nothing to be found.
    pub fn build_static(
        gpu: &Gpu,
        voxels: &Occupancy,
        corners: bool,
    ) -> Result<(Self, FrameStats), Error> {
        let (mut pool, stats) = Self::build_from(gpu, voxels, corners, 1)?;
        pool.dynamic = Some(DynamicTiles::new(gpu, &pool, corners)?);
        Ok((pool, stats))
    }

    fn build_from(
        gpu: &Gpu,
        voxels: &Occupancy,
        corners: bool,
        first: u32,
    ) -> Result<(Self, FrameStats), Error> {
        let pyramid = Pyramid::new(gpu, voxels.resolution, corners)?;
        let mut frame = Frame::new();
        pyramid.add(&mut frame, voxels);
        let (mut stats, counts) = gpu.submit_and_read(frame, &pyramid.counts)?;
        let levels = pyramid.levels_of(&counts, first);
        let tiles = u64::from(levels[0].first + levels[0].count);
        require_pointers("svo.nodes", tiles)?;
        let (nodes, neighbours) = (
            buffer(gpu, "svo.nodes", 4 * tiles)?,
            buffer(gpu, "svo.neighbours", 12 * tiles)?,
        );
        let pool = NodePool {
            nodes,
            neighbours,
            levels,
            dynamic: None,
        };
        stats.append(pool.fill(gpu, voxels, &pyramid)?);
        Ok((pool, stats))
    }

    /// Gives back what bricks alone read, where there are none and tiles stay as they are.
    pub fn forget_neighbours(&mut self, gpu: &Gpu) -> Result<(), Error> {
        if self.dynamic.is_none() {
            self.neighbours = buffer(gpu, "svo.neighbours", 0)?;
        }
        Ok(())
    }

    /// Brings the dynamic tiles up to the blocks that dynamic geometry touches now.
    /// `counted` is what was counted of the tiles with these blocks, where they were.
    pub fn follow(
        &mut self,
        gpu: &Gpu,
        touched: &TouchedVoxels<'_>,
        counted: Option<Vec<u8>>,
    ) -> Result<FrameStats, Error> {
        let Some(mut dynamic) = self.dynamic.take() else {
            return Ok(FrameStats::default());
        };
        let stats = dynamic.update(gpu, self, touched, counted);
        self.dynamic = Some(dynamic);
        stats
    }

    /// Adds the passes that make the dynamic tiles, as far as there is room, and count them;
    /// returns where. `None` where there are none.
    pub(super) fn count_tiles(
        &self,
        frame: &mut Frame,
        touched: &TouchedVoxels<'_>,
    ) -> Option<Arc<Buffer>> {
        let dynamic = self.dynamic.as_ref()?;
        Some(dynamic.count(frame, self, touched))
    }

    /// Its coarsest level.
    pub(super) fn root(&self) -> u32 {
        self.levels.len() as u32 - 1
    }

    /// One beyond the last static tile.
    pub fn static_end(&self) -> u32 {
        self.levels[0].first + self.levels[0].count
    }

    /// Tiles of all levels, dynamic ones too.
    pub fn tile_count(&self) -> u32 {
        self.static_end() + self.dynamic.as_ref().map_or(0, DynamicTiles::tail_count)
    }

    /// Tiles that there is room for.
    pub(super) fn room(&self) -> u32 {
        self.static_end() + self.dynamic.as_ref().map_or(0, DynamicTiles::tail_room)
    }

    /// The static and the dynamic tiles of a level.
    pub(super) fn ranges(&self, level: usize) -> [LevelRange; 2] {
        let dynamic = self
            .dynamic
            .as_ref()
            .map_or(LevelRange { first: 0, count: 0 }, |dynamic| {
                dynamic.levels[level]
            });
        [self.levels[level], dynamic]
    }

    /// Tiles of the level that has the most.
    pub(super) fn largest_level(&self) -> u32 {
        (0..self.levels.len())
            .map(|level| self.ranges(level).iter().map(|range| range.count).sum())
            .max()
            .unwrap_or(1)
    }

    fn fill(&self, gpu: &Gpu, voxels: &Occupancy, pyramid: &Pyramid) -> Result<FrameStats, Error> {
        let root = self.root();
        let device_levels = buffer(
            gpu,
            "svo.levels",
            size_of::<Level>() as u64 * self.levels.len() as u64,
        )?;
        let mut first = vec![
            Level {
                first: 0,
                count: 0,
                groups_x: 0,
                groups_y: 0,
                groups_z: 0
            };
            self.levels.len()
        ];
        let root_tile = self.levels[root as usize].first;
        first[root as usize] = Level {
            first: root_tile,
            count: 1,
            groups_x: 1,
            groups_y: 1,
            groups_z: 1,
        };
        gpu.upload_buffer(&device_levels, bytemuck::cast_slice(&first))?;
        // Place of each tile on its level, 3×10 bits.
        let tiles = buffer(gpu, "svo.tiles", 4 * u64::from(self.static_end()))?;
        let most = self
            .levels
            .iter()
            .map(|level| level.count)
            .max()
            .unwrap_or(1);
        let group_sums = buffer(
            gpu,
            "svo.group_sums",
            4 * u64::from(most.div_ceil(TILES_PER_GROUP)),
        )?;
        let arguments = |level: u32| size_of::<Level>() as u64 * u64::from(level) + 8;
        let mut frame = Frame::new();
        frame.fill("svo.clear", &tiles, 0);
        if root_tile > 0 {
            // Neither the static root nor tile 0 has neighbours.
            frame.fill("svo.clear", &self.neighbours, 0);
        }
        for level in (1..=root).rev() {
            let params = LevelParams {
                level,
                first_child: 0,
            };
            let flag = FlagParams {
                level,
                child_blocks: tile_blocks(pyramid.resolution, level - 1),
            };
            let child_bits = &pyramid.levels[level as usize - 1][1];
            frame
                .pass(&FLAG_NODES)
                .bind("levels", &device_levels)
                .bind("tiles", &tiles)
                .bind("child_bits", child_bits)
                .bind("nodes", &self.nodes)
                .bind("group_sums", &group_sums)
                .push(&flag)
                .dispatch_indirect(&device_levels, arguments(level));
            frame
                .pass(&SCAN_NODES)
                .bind("group_sums", &group_sums)
                .bind("levels", &device_levels)
                .push(&params)
                .dispatch([1, 1, 1]);
            frame
                .pass(&ALLOCATE_TILES)
                .bind("levels", &device_levels)
                .bind("group_sums", &group_sums)
                .bind("nodes", &self.nodes)
                .bind("tiles", &tiles)
                .push(&params)
                .dispatch_indirect(&device_levels, arguments(level));
        }
        for cube in &voxels.cubes {
            let [first_x, first_y, first_z] = (cube.first / 4).to_array();
            let (blocks, first_voxel) = (cube.resolution / 4, cube.first_voxel);
            frame
                .pass(&LINK_LEAVES)
                .bind("levels", &device_levels)
                .bind("tiles", &tiles)
                .bind("occupancy", &cube.occupancy)
                .bind("block_bases", &cube.block_bases)
                .bind("nodes", &self.nodes)
                .push(&LeafParams {
                    blocks,
                    first_x,
                    first_y,
                    first_z,
                    first_voxel,
                    first_place: 0,
                    first_child: 0,
                })
                .dispatch_indirect(&device_levels, arguments(1));
        }
        for level in (1..=root).rev() {
            frame
                .pass(&LINK_NEIGHBOURS)
                .bind("levels", &device_levels)
                .bind("nodes", &self.nodes)
                .bind("neighbours", &self.neighbours)
                .push(&LevelParams {
                    level,
                    first_child: 0,
                })
                .dispatch_indirect(&device_levels, arguments(level));
        }
        gpu.submit(frame)
    }
}
