//! Dynamic tiles: the tiles of the octree that dynamic geometry changes. They lie behind the static
//! ones, which are never written again.
//!
//! A tile is *affected* where voxels of a touched block reach a texel of its brick. An affected
//! tile gets a copy of its own behind the static tiles, and so do its siblings, as the children of
//! a tile follow each other; whatever else a copy leads to is static. The way from the root to
//! every affected tile is so copied (Driscoll et al. 1989: path copying), and the static tree stays
//! as it is. Tile 0, the *entry*, is the root of what is sampled.

use std::sync::Arc;

use super::dynamic_passes::{
    ALLOCATE_DYNAMIC, AffectedParams, DynamicParams, FLAG_DYNAMIC, FLAG_TEXELS, KEEP_STATIC,
    KeepParams, MARK_AFFECTED, TexelParams,
};
use super::nodes::{
    LINK_LEAVES, LINK_NEIGHBOURS, LeafParams, Level, LevelParams, LevelRange, NodePool, SCAN_NODES,
    TILES_PER_GROUP, require_pointers, tile_blocks,
};
use crate::gi::shared::voxel::build::buffer;
use crate::gi::shared::voxel::dynamic::with_slack;
use crate::graph::compute::linear_groups;
use crate::graph::{Buffer, Error, Frame, FrameStats, Gpu, Image};

/// All voxels, and the blocks of 4³ of them that dynamic geometry touches.
pub struct TouchedVoxels<'v> {
    /// One [`crate::gi::shared::voxel::dynamic_passes::TouchedBlock`] each.
    pub blocks: &'v Arc<Buffer>,
    /// Entries that `blocks` has room for.
    pub block_room: u32,
    /// [`crate::gi::shared::voxel::dynamic_passes::TouchedCounters`]: how many there are.
    pub counts: &'v Arc<Buffer>,
    /// One bit a voxel.
    pub occupancy: &'v Arc<Buffer>,
    /// Compact index of each block's first voxel.
    pub block_bases: &'v Arc<Buffer>,
}

/// What is known of each dynamic tile. Arrays start with the entry, and go on with the first tile
/// behind the static ones.
struct Slots {
    /// Dynamic tiles that there is room for, the entry too.
    capacity: u32,
    /// Place of each on its level, 3×10 bits.
    places: Arc<Buffer>,
    /// Index + 1 of the static tile at the same place, or 0.
    originals: Arc<Buffer>,
    /// 27 bits: texels that are made anew; the others are the static tile's.
    remade: Arc<Buffer>,
    group_sums: Arc<Buffer>,
}

impl Slots {
    fn new(gpu: &Gpu, capacity: u32) -> Result<Self, Error> {
        let array = |name, count: u32| buffer(gpu, name, 4 * u64::from(count));
        let slots = Slots {
            capacity,
            places: array("svo.dynamic_places", capacity)?,
            originals: array("svo.originals", capacity)?,
            remade: array("svo.remade_texels", capacity)?,
            group_sums: array("svo.group_sums", capacity.div_ceil(TILES_PER_GROUP))?,
        };
        // The entry is at the place of the static root, tile 1.
        gpu.upload_buffer(&slots.places, bytemuck::bytes_of(&0u32))?;
        gpu.upload_buffer(&slots.originals, bytemuck::bytes_of(&2u32))?;
        Ok(slots)
    }
}

/// The dynamic tiles of a pool.
pub struct DynamicTiles {
    /// Where the dynamic tiles of each level are, finest first; the coarsest one is the entry.
    pub levels: Vec<LevelRange>,
    /// First tile behind the static ones.
    first: u32,
    corners: bool,
    /// A bit an affected tile, in blocks of 4³, finest level first.
    affected: Arc<Buffer>,
    slots: Slots,
    /// A [`Level`] each.
    device_levels: Arc<Buffer>,
    /// What they start from.
    first_levels: Arc<Buffer>,
}

/// Blocks of 4³ tiles of all levels before a level.
fn blocks_before(resolution: u32, level: u32) -> u32 {
    (0..level)
        .map(|level| tile_blocks(resolution, level).pow(3))
        .sum()
}

/// Arguments of an indirect dispatch over the tiles of a level.
fn arguments(level: u32) -> u64 {
    size_of::<Level>() as u64 * u64::from(level) + 8
}

impl DynamicTiles {
    /// For a pool whose static tiles are from 1 on, over voxels that spread to their corners or
    /// not.
    pub(super) fn new(gpu: &Gpu, nodes: &NodePool, corners: bool) -> Result<Self, Error> {
        let level_count = nodes.levels.len();
        let mut levels = vec![
            Level {
                first: 0,
                count: 0,
                groups_x: 0,
                groups_y: 0,
                groups_z: 0
            };
            level_count
        ];
        levels[level_count - 1] = Level {
            first: 0,
            count: 1,
            groups_x: 1,
            groups_y: 1,
            groups_z: 1,
        };
        let levels_buffer = || {
            buffer(
                gpu,
                "svo.dynamic_levels",
                size_of_val(levels.as_slice()) as u64,
            )
        };
        let (device_levels, first_levels) = (levels_buffer()?, levels_buffer()?);
        gpu.upload_buffer(&first_levels, bytemuck::cast_slice(&levels))?;
        let blocks = blocks_before(1 << level_count, level_count as u32);
        Ok(DynamicTiles {
            levels: vec![LevelRange { first: 0, count: 0 }; level_count],
            first: nodes.static_end(),
            corners,
            affected: buffer(gpu, "svo.affected_tiles", 8 * u64::from(blocks))?,
            slots: Slots::new(gpu, 1)?,
            device_levels,
            first_levels,
        })
    }

    /// Dynamic tiles behind the static ones.
    pub(super) fn tail_count(&self) -> u32 {
        self.levels
            .iter()
            .rev()
            .skip(1)
            .map(|level| level.count)
            .sum()
    }

    /// Number of tiles that there is room for.
    pub(super) fn tail_room(&self) -> u32 {
        self.slots.capacity - 1
    }

    fn root(&self) -> u32 {
        self.levels.len() as u32 - 1
    }

    fn resolution(&self) -> u32 {
        1 << self.levels.len()
    }

    /// Makes the dynamic tiles anew. They are counted while they are made; where there is no room
    /// for all, the run counts, and is repeated with more: as often as there are levels at
    /// most, as the tiles of a level are counted once those above it have room. `counted` is what
    /// [`DynamicTiles::count`] has counted already.
    pub(super) fn update(
        &mut self,
        gpu: &Gpu,
        nodes: &mut NodePool,
        touched: &TouchedVoxels<'_>,
        mut counted: Option<Vec<u8>>,
    ) -> Result<FrameStats, Error> {
        let mut stats = FrameStats::default();
        let mut frame = Frame::new();
        loop {
            let (run, levels) = match counted.take() {
                Some(levels) => (FrameStats::default(), levels),
                None => {
                    self.add_tiles(&mut frame, nodes, touched);
                    gpu.submit_and_read(std::mem::take(&mut frame), &self.device_levels)?
                }
            };
            let levels: Vec<Level> = bytemuck::pod_collect_to_vec(&levels);
            self.levels = levels
                .iter()
                .map(|level| LevelRange {
                    first: level.first,
                    count: level.count,
                })
                .collect();
            require_pointers(
                "svo.nodes",
                u64::from(self.first)
                    + self
                        .levels
                        .iter()
                        .map(|level| u64::from(level.count))
                        .sum::<u64>(),
            )?;
            if self.tail_count() <= self.tail_room() {
                stats.append(run);
                break;
            }
            stats.append(run.into_counting());
            self.grow(gpu, &mut frame, nodes)?;
        }
        self.add_links(&mut frame, nodes, touched);
        gpu.enqueue(frame);
        Ok(stats)
    }

    /// Adds the passes that make the tiles, as far as there is room, and count them; returns where.
    pub(super) fn count(
        &self,
        frame: &mut Frame,
        nodes: &NodePool,
        touched: &TouchedVoxels<'_>,
    ) -> Arc<Buffer> {
        self.add_tiles(frame, nodes, touched);
        Arc::clone(&self.device_levels)
    }

    /// Room for the tiles counted so far, and a little more.
    fn grow(&mut self, gpu: &Gpu, frame: &mut Frame, nodes: &mut NodePool) -> Result<(), Error> {
        self.slots = Slots::new(gpu, 1 + with_slack(self.tail_count()))?;
        let (kept, all) = (
            u64::from(self.first),
            u64::from(self.first + self.tail_room()),
        );
        for (target, stride) in [(&mut nodes.nodes, 4), (&mut nodes.neighbours, 12)] {
            let larger = buffer(gpu, target.name(), stride * all)?;
            frame.copy_buffer("svo.grow", (target, 0), (&larger, 0), stride * kept);
            *target = larger;
        }
        Ok(())
    }

    /// Adds the passes that find affected tiles, and from the entry down give them, and their
    /// siblings, tiles.
    fn add_tiles(&self, frame: &mut Frame, nodes: &NodePool, touched: &TouchedVoxels<'_>) {
        let (root, resolution) = (self.root(), self.resolution());
        frame.copy_buffer(
            "svo.clear",
            (&self.first_levels, 0),
            (&self.device_levels, 0),
            self.first_levels.size_bytes(),
        );
        frame.fill("svo.clear", &self.affected, 0);
        frame
            .pass(&MARK_AFFECTED)
            .bind("touched", touched.blocks)
            .bind("occupancy", touched.occupancy)
            .bind("affected_tiles", &self.affected)
            .bind("counts", touched.counts)
            .constant("CORNERS", self.corners)
            .push(&AffectedParams {
                blocks: resolution / 4,
                level_count: root + 1,
            })
            .dispatch(linear_groups(64 * touched.block_room));
        let Slots {
            capacity,
            places,
            originals,
            group_sums,
            ..
        } = &self.slots;
        for level in (1..=root).rev() {
            let params = DynamicParams {
                level,
                first_dynamic: self.first,
                capacity: *capacity,
                first_block: blocks_before(resolution, level - 1),
                blocks: tile_blocks(resolution, level - 1),
            };
            frame
                .pass(&FLAG_DYNAMIC)
                .bind("levels", &self.device_levels)
                .bind("nodes", &nodes.nodes)
                .bind("places", places)
                .bind("originals", originals)
                .bind("affected_tiles", &self.affected)
                .bind("group_sums", group_sums)
                .push(&params)
                .dispatch_indirect(&self.device_levels, arguments(level));
            let scan = LevelParams {
                level,
                first_child: self.first,
            };
            frame
                .pass(&SCAN_NODES)
                .bind("group_sums", group_sums)
                .bind("levels", &self.device_levels)
                .push(&scan)
                .dispatch([1, 1, 1]);
            frame
                .pass(&ALLOCATE_DYNAMIC)
                .bind("levels", &self.device_levels)
                .bind("group_sums", group_sums)
                .bind("affected_tiles", &self.affected)
                .bind("nodes", &nodes.nodes)
                .bind("places", places)
                .bind("originals", originals)
                .push(&params)
                .dispatch_indirect(&self.device_levels, arguments(level));
        }
    }

    /// Adds the passes that link dynamic leaves to voxels, and dynamic neighbours to each other,
    /// and tell texels that are made anew from those that are not.
    fn add_links(&self, frame: &mut Frame, nodes: &NodePool, touched: &TouchedVoxels<'_>) {
        let (root, resolution, first_child) = (self.root(), self.resolution(), self.first);
        let Slots { places, remade, .. } = &self.slots;
        let blocks = resolution / 4;
        frame
            .pass(&LINK_LEAVES)
            .bind("levels", &self.device_levels)
            .bind("tiles", places)
            .bind("occupancy", touched.occupancy)
            .bind("block_bases", touched.block_bases)
            .bind("nodes", &nodes.nodes)
            .push(&LeafParams {
                blocks,
                first_x: 0,
                first_y: 0,
                first_z: 0,
                first_voxel: 0,
                first_place: self.first - 1,
                first_child,
            })
            .dispatch_indirect(&self.device_levels, arguments(1));
        for level in (0..=root)
            .rev()
            .filter(|level| self.levels[*level as usize].count > 0)
        {
            if level > 0 {
                frame
                    .pass(&LINK_NEIGHBOURS)
                    .bind("levels", &self.device_levels)
                    .bind("nodes", &nodes.nodes)
                    .bind("neighbours", &nodes.neighbours)
                    .push(&LevelParams { level, first_child })
                    .dispatch_indirect(&self.device_levels, arguments(level));
            }
            let LevelRange { first, count } = self.levels[level as usize];
            frame
                .pass(&FLAG_TEXELS)
                .bind("places", places)
                .bind("affected_tiles", &self.affected)
                .bind("remade_texels", remade)
                .constant("CORNERS", self.corners)
                .push(&TexelParams {
                    first,
                    count,
                    first_dynamic: self.first,
                    first_block: blocks_before(resolution, level),
                    blocks: tile_blocks(resolution, level),
                    tiles: resolution >> (level + 1),
                })
                .dispatch(linear_groups(count));
        }
    }

    /// Adds the pass that gives the bricks of a level what is static in them, once all else is done
    /// with them.
    pub(super) fn keep_static(&self, frame: &mut Frame, level: usize, bricks: &Arc<Image>) {
        let LevelRange { first, count } = self.levels[level];
        if count == 0 {
            return;
        }
        frame
            .pass(&KEEP_STATIC)
            .bind("originals", &self.slots.originals)
            .bind("remade_texels", &self.slots.remade)
            .bind("bricks", bricks)
            .push(&KeepParams {
                first,
                count,
                first_dynamic: self.first,
            })
            .dispatch(linear_groups(27 * count));
    }
}
