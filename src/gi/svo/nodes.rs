//! The node pool: 2³ node tiles behind one child pointer, built level by level from the root.

use std::sync::Arc;

use super::dynamic::{DynamicTiles, TouchedVoxels};
use super::pieces::Occupancy;
use crate::gi::voxel::voxelize::buffer;
use crate::gpu_struct;
use crate::graph::compute::{pass, read, read_write, write};
use crate::graph::{Buffer, Error, Frame, FrameStats, Gpu, Pass};

gpu_struct! {
    /// One level of the pool on the device (`gi/svo/pool.glsl`).
    pub struct Level {
        /// Index of its first tile.
        pub first: u32,
        /// Its tiles.
        pub count: u32,
        /// Workgroups of a thread a tile.
        pub groups_x: u32,
        /// Likewise.
        pub groups_y: u32,
        /// Likewise.
        pub groups_z: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.reduce_points`.
    pub struct ReduceParams {
        /// Blocks of the finer points along an axis.
        pub finer_blocks: u32,
        /// Blocks of the coarser points, and of tiles.
        pub coarser_blocks: u32,
        /// Tiles of the level along an axis.
        pub tile_limit: u32,
        /// The level, 0 the finest.
        pub level: u32,
        /// How far below 2q a coarser point reaches.
        pub point_reach: i32,
        /// How far below 2T a tile reaches.
        pub tile_reach: i32,
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
    /// Parameters of `svo.scan_nodes` and `svo.allocate_tiles`.
    pub struct LevelParams {
        /// The level whose nodes get children.
        pub level: u32,
        /// No tile before this one is given away.
        pub first_free: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.link_leaves`.
    pub struct LeafParams {
        /// Voxels along an edge of the grid.
        pub resolution: u32,
        /// The tile whose place comes first.
        pub first_place: u32,
    }
}

gpu_struct! {
    /// Parameters of `svo.link_neighbours`.
    pub struct NeighbourParams {
        /// The level whose tiles are linked.
        pub level: u32,
        /// The coarsest level.
        pub root: u32,
        /// Its tile.
        pub root_tile: u32,
        /// The tile whose place comes first.
        pub first_place: u32,
        /// A neighbour before this one in the pool counts for none.
        pub first_linked: u32,
    }
}

/// Points of the next coarser lattice, and tiles of this level, that hold something. A thread 4³ of each.
pub static REDUCE_POINTS: Pass = pass(
    "svo.reduce_points",
    "gi/svo/reduce_points.comp",
    &[read("finer_points"), write("coarser_points"), write("level_tiles"), read_write("tile_counts")],
    size_of::<ReduceParams>(),
);

/// Which nodes of a level have children. A thread a tile, as many as the device says.
pub static FLAG_NODES: Pass = pass(
    "svo.flag_nodes",
    "gi/svo/flag_nodes.comp",
    &[read("levels"), read("tiles"), read("child_bits"), write("nodes"), write("group_sums")],
    size_of::<FlagParams>(),
);

/// Prefix sum over groups of tiles; the next finer level. One workgroup.
pub static SCAN_NODES: Pass = pass("svo.scan_nodes", "gi/svo/scan_nodes.comp", &[read_write("group_sums"), read_write("levels")], size_of::<LevelParams>());

/// Child pointers, and the places of the child tiles. A thread a tile, as many as the device says.
pub static ALLOCATE_TILES: Pass = pass(
    "svo.allocate_tiles",
    "gi/svo/allocate_tiles.comp",
    &[read("levels"), read("group_sums"), read_write("nodes"), read_write("tiles")],
    size_of::<LevelParams>(),
);

/// Voxels of leaf tiles. A thread a tile, as many as the device says.
pub static LINK_LEAVES: Pass = pass(
    "svo.link_leaves",
    "gi/svo/link_leaves.comp",
    &[read("levels"), read("tiles"), read("occupancy"), read("block_bases"), write("nodes")],
    size_of::<LeafParams>(),
);

/// Each tile's neighbours before it on its level. A thread a tile, as many as the device says.
pub static LINK_NEIGHBOURS: Pass = pass(
    "svo.link_neighbours",
    "gi/svo/link_neighbours.comp",
    &[read("levels"), read("tiles"), read("nodes"), write("neighbours")],
    size_of::<NeighbourParams>(),
);

/// An error where there are more tiles, or voxels, than the 24 bits of a child pointer tell apart.
pub(super) fn require_pointers(resource: &str, count: u64) -> Result<(), Error> {
    let most = 1 << 24;
    if count <= most {
        return Ok(());
    }
    Err(Error::ImageTooLarge { resource: resource.to_owned(), wanted: count.to_string(), available: format!("{most} (24-bit pointers)") })
}

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
    /// A word a tile: which of its eight nodes have a child, and the first child (`gi/svo/pool.glsl`).
    pub nodes: Arc<Buffer>,
    /// Three words a tile: index + 1 of the neighbour towards −x, −y, −z, or 0.
    pub neighbours: Arc<Buffer>,
    /// The static levels, finest first; tiles of a level are in the order of their parents' nodes, and coarser levels come first in the pool.
    pub levels: Vec<LevelRange>,
    /// What is behind them where there are dynamic models: then tile 0 is the root of both, and the static root tile 1.
    pub dynamic: Option<DynamicTiles>,
}

/// Which points and tiles there are, on every level; needed during the build only.
struct Pyramid {
    /// By level: points of the next coarser lattice, tiles of the level.
    levels: Vec<[Arc<Buffer>; 2]>,
    counts: Arc<Buffer>,
    resolution: u32,
}

impl Pyramid {
    fn new(gpu: &Gpu, resolution: u32) -> Result<Self, Error> {
        let bits = |level| -> Result<[Arc<Buffer>; 2], Error> {
            let bytes = 8 * u64::from(coarser_blocks(resolution, level)).pow(3);
            Ok([buffer(gpu, "svo.points", bytes)?, buffer(gpu, "svo.tile_bits", bytes)?])
        };
        let levels = (0..=root(resolution)).map(bits).collect::<Result<Vec<_>, _>>()?;
        let counts = buffer(gpu, "svo.tile_counts", 4 * levels.len() as u64)?;
        Ok(Pyramid { levels, counts, resolution })
    }

    fn add(&self, frame: &mut Frame, voxels: &Occupancy, corners: bool) {
        frame.fill("svo.clear", &self.counts, 0);
        for (level, [points, tiles]) in (0u32..).zip(&self.levels) {
            let finer = if level == 0 { &voxels.occupancy } else { &self.levels[level as usize - 1][0] };
            let params = ReduceParams {
                finer_blocks: if level == 0 { self.resolution / 4 } else { coarser_blocks(self.resolution, level - 1) },
                coarser_blocks: coarser_blocks(self.resolution, level),
                tile_limit: self.resolution >> (level + 1),
                level,
                point_reach: i32::from(corners) + i32::from(corners && level == 0),
                tile_reach: i32::from(corners && level == 0),
            };
            let groups = params.coarser_blocks.pow(3).div_ceil(64);
            frame.pass(&REDUCE_POINTS).bind(finer).bind(points).bind(tiles).bind(&self.counts).push(&params).dispatch([groups, 1, 1]);
        }
    }

    /// Tiles of each level, finest first, from tile `first` on. There is always a root.
    fn read_levels(&self, gpu: &Gpu, mut first: u32) -> Result<Vec<LevelRange>, Error> {
        let counts: Vec<u32> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&self.counts)?);
        let mut levels: Vec<LevelRange> = (0..self.levels.len())
            .rev()
            .map(|level| {
                let count = if level + 1 == self.levels.len() { 1 } else { counts[level] };
                let range = LevelRange { first, count };
                first += count;
                range
            })
            .collect();
        levels.reverse();
        Ok(levels)
    }
}

/// The coarsest level: two nodes along an axis.
pub fn root(resolution: u32) -> u32 {
    resolution.ilog2() - 1
}

/// Blocks of 4³ along an axis that hold the points 0 to n / 2^(level + 1) of the lattice above `level`.
fn coarser_blocks(resolution: u32, level: u32) -> u32 {
    (resolution >> (level + 1)) / 4 + 1
}

impl NodePool {
    /// Builds the octree over these voxels. The tiles are counted first, and the count is read back once, so that the pool is exact.
    pub fn build(gpu: &Gpu, voxels: &Occupancy, corners: bool) -> Result<(Self, FrameStats), Error> {
        Self::build_from(gpu, voxels, corners, 0)
    }

    /// Builds the octree over static voxels, among which [`NodePool::follow`] then puts dynamic ones; until it has, there is nothing to be found.
    pub fn build_static(gpu: &Gpu, voxels: &Occupancy, corners: bool) -> Result<(Self, FrameStats), Error> {
        let (mut pool, stats) = Self::build_from(gpu, voxels, corners, 1)?;
        pool.dynamic = Some(DynamicTiles::new(gpu, &pool, corners)?);
        Ok((pool, stats))
    }

    fn build_from(gpu: &Gpu, voxels: &Occupancy, corners: bool, first: u32) -> Result<(Self, FrameStats), Error> {
        let pyramid = Pyramid::new(gpu, voxels.resolution)?;
        let mut frame = Frame::new();
        pyramid.add(&mut frame, voxels, corners);
        let mut stats = gpu.submit(frame)?;
        let levels = pyramid.read_levels(gpu, first)?;
        let tiles = u64::from(levels[0].first + levels[0].count);
        require_pointers("svo.nodes", tiles)?;
        let (nodes, neighbours) = (buffer(gpu, "svo.nodes", 4 * tiles)?, buffer(gpu, "svo.neighbours", 12 * tiles)?);
        let pool = NodePool { nodes, neighbours, levels, dynamic: None };
        stats.append(pool.fill(gpu, voxels, &pyramid)?);
        Ok((pool, stats))
    }

    /// Brings the dynamic tiles up to the blocks that dynamic geometry touches now.
    pub fn follow(&mut self, gpu: &Gpu, touched: &TouchedVoxels<'_>) -> Result<FrameStats, Error> {
        let Some(mut dynamic) = self.dynamic.take() else { return Ok(FrameStats::default()) };
        let stats = dynamic.update(gpu, self, touched);
        self.dynamic = Some(dynamic);
        stats
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
        let dynamic = self.dynamic.as_ref().map_or(LevelRange { first: 0, count: 0 }, |dynamic| dynamic.levels[level]);
        [self.levels[level], dynamic]
    }

    /// Tiles of the level that has the most.
    pub(super) fn largest_level(&self) -> u32 {
        (0..self.levels.len()).map(|level| self.ranges(level).iter().map(|range| range.count).sum()).max().unwrap_or(1)
    }

    fn fill(&self, gpu: &Gpu, voxels: &Occupancy, pyramid: &Pyramid) -> Result<FrameStats, Error> {
        let root = self.levels.len() as u32 - 1;
        let device_levels = buffer(gpu, "svo.levels", size_of::<Level>() as u64 * self.levels.len() as u64)?;
        let mut first = vec![Level { first: 0, count: 0, groups_x: 0, groups_y: 0, groups_z: 0 }; self.levels.len()];
        let root_tile = self.levels[root as usize].first;
        first[root as usize] = Level { first: root_tile, count: 1, groups_x: 1, groups_y: 1, groups_z: 1 };
        gpu.upload_buffer(&device_levels, bytemuck::cast_slice(&first))?;
        // Place of each tile on its level, 3×10 bits.
        let tiles = buffer(gpu, "svo.tiles", 4 * u64::from(self.static_end()))?;
        let most = self.levels.iter().map(|level| level.count).max().unwrap_or(1);
        let group_sums = buffer(gpu, "svo.group_sums", 4 * u64::from(most.div_ceil(256)))?;
        let arguments = |level: u32| size_of::<Level>() as u64 * u64::from(level) + 8;
        let mut frame = Frame::new();
        frame.fill("svo.clear", &tiles, 0);
        if root_tile > 0 {
            // The root of static and dynamic tiles has no neighbours.
            frame.fill("svo.clear", &self.neighbours, 0);
        }
        for level in (1..=root).rev() {
            let params = LevelParams { level, first_free: 0 };
            let flag = FlagParams { level, child_blocks: coarser_blocks(pyramid.resolution, level - 1) };
            let child_bits = &pyramid.levels[level as usize - 1][1];
            frame
                .pass(&FLAG_NODES)
                .bind(&device_levels)
                .bind(&tiles)
                .bind(child_bits)
                .bind(&self.nodes)
                .bind(&group_sums)
                .push(&flag)
                .dispatch_indirect(&device_levels, arguments(level));
            frame.pass(&SCAN_NODES).bind(&group_sums).bind(&device_levels).push(&params).dispatch([1, 1, 1]);
            frame
                .pass(&ALLOCATE_TILES)
                .bind(&device_levels)
                .bind(&group_sums)
                .bind(&self.nodes)
                .bind(&tiles)
                .push(&params)
                .dispatch_indirect(&device_levels, arguments(level));
        }
        frame
            .pass(&LINK_LEAVES)
            .bind(&device_levels)
            .bind(&tiles)
            .bind(&voxels.occupancy)
            .bind(&voxels.block_bases)
            .bind(&self.nodes)
            .push(&LeafParams { resolution: pyramid.resolution, first_place: 0 })
            .dispatch_indirect(&device_levels, arguments(0));
        for level in 0..=root {
            frame
                .pass(&LINK_NEIGHBOURS)
                .bind(&device_levels)
                .bind(&tiles)
                .bind(&self.nodes)
                .bind(&self.neighbours)
                .push(&NeighbourParams { level, root, root_tile, first_place: 0, first_linked: 0 })
                .dispatch_indirect(&device_levels, arguments(level));
        }
        gpu.submit(frame)
    }
}
