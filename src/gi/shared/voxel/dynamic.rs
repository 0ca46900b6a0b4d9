//! Dynamic geometry among static voxels: voxelized alone, put behind the static records, merged
//! where both are, and taken away again.
//!
//! Static geometry is voxelized once; its fragments and lists are kept. Each update voxelizes the
//! dynamic triangles into an occupancy of their own. In the blocks of 4×4×4 voxels that they touch,
//! all occupied voxels get records behind the static ones. The block's occupancy becomes the union
//! of both, and its base leads to the new records: a look-up of a voxel's compact index finds them
//! without any change. Their lists of fragments are the dynamic ones followed by the static list.
//! The mean is so the exact mean of both, bit for bit the same as if everything were voxelized at
//! once. The next update first puts the touched blocks back as they were. Static records,
//! fragments and lists are only read.

use std::sync::Arc;

use glam::{IVec3, Vec3};

use super::build::passes::{Fragment, Voxel};
use super::build::{FragmentLists, Triangles, buffer};
use super::dynamic_passes::{
    CONTINUE_LISTS, COUNT_TOUCHED, INDEX_TOUCHED, ListParams, RESTORE_BLOCKS, RestoreParams,
    SCAN_TOUCHED, TouchedBlock, TouchedCounters, TouchedParams, TouchedScanParams,
};
use super::{VoxelGrid, Voxelizer, Voxels};
use crate::graph::compute::linear_groups;
use crate::graph::{Buffer, Error, Frame, FrameStats, Gpu};
use crate::render::GpuScene;

/// Adds passes to the submission that finds touched blocks, which need no more than these; what it
/// returns is read with the counters.
pub type CountAlso<'a> = &'a dyn Fn(&mut Frame, &DynamicVoxels, &Voxels) -> Option<Arc<Buffer>>;

/// What following models took, and what [`CountAlso`] has counted, where all fitted.
pub type Followed = (FrameStats, Option<Vec<u8>>);

/// What is kept to follow dynamic geometry through static voxels.
pub struct DynamicVoxels {
    /// One bit a voxel that dynamic geometry touches.
    occupancy: Arc<Buffer>,
    touched_sums: Arc<Buffer>,
    /// [`TouchedCounters`].
    counts: Arc<Buffer>,
    /// What they start from.
    first_counts: Arc<Buffer>,
    /// One [`TouchedBlock`] each.
    touched: Arc<Buffer>,
    touched_count: u32,
    /// Static fragments and lists, then those of the last update.
    lists: FragmentLists,
    static_fragments: u32,
    static_voxels: u32,
    /// Voxels that dynamic geometry touches.
    pub voxel_count: u32,
}

impl Voxelizer {
    /// Voxelizes the static triangles, and then the dynamic ones where they are;
    /// [`DynamicVoxels::update`] follows them from there.
    pub fn run_dynamic(
        &mut self,
        gpu: &Gpu,
        scene: &GpuScene,
    ) -> Result<(Voxels, DynamicVoxels, FrameStats), Error> {
        let (mut voxels, mut dynamic, mut stats) = self.run_static(gpu, scene)?;
        stats.append(dynamic.update(gpu, scene, self, &mut voxels, None)?.0);
        Ok((voxels, dynamic, stats))
    }

    /// Voxelizes the static triangles alone; [`DynamicVoxels::update`] puts the dynamic ones among
    /// them.
    pub fn run_static(
        &mut self,
        gpu: &Gpu,
        scene: &GpuScene,
    ) -> Result<(Voxels, DynamicVoxels, FrameStats), Error> {
        let (voxels, lists, stats) = self.voxelize(gpu, scene, Triangles::Static)?;
        let dynamic = DynamicVoxels::new(gpu, &voxels, lists)?;
        Ok((voxels, dynamic, stats))
    }
}

impl DynamicVoxels {
    /// For static voxels and their lists; there is no dynamic geometry among them yet.
    pub(super) fn new(gpu: &Gpu, voxels: &Voxels, lists: FragmentLists) -> Result<Self, Error> {
        let blocks = u64::from(voxels.grid.block_count());
        let made = DynamicVoxels {
            occupancy: buffer(gpu, "voxel.dynamic_occupancy", 8 * blocks)?,
            touched_sums: buffer(gpu, "voxel.touched_sums", 8 * blocks.div_ceil(1024))?,
            counts: buffer(
                gpu,
                "voxel.touched_counts",
                size_of::<TouchedCounters>() as u64,
            )?,
            first_counts: buffer(
                gpu,
                "voxel.touched_counts",
                size_of::<TouchedCounters>() as u64,
            )?,
            touched: buffer(gpu, "voxel.touched_blocks", 0)?,
            touched_count: 0,
            lists,
            static_fragments: voxels.fragment_count,
            static_voxels: voxels.voxel_count,
            voxel_count: 0,
        };
        let first = TouchedCounters {
            fragment_count: voxels.fragment_count,
            indexed: 0,
            unfinished_count: 0,
            touched_count: 0,
            slot_count: 0,
            added_voxels: 0,
            dynamic_voxels: 0,
        };
        gpu.upload_buffer(&made.first_counts, bytemuck::bytes_of(&first))?;
        let mut frame = Frame::new();
        frame.fill("voxel.clear", &made.occupancy, 0);
        gpu.enqueue(frame);
        Ok(made)
    }

    /// Records of the voxels in touched blocks, behind the static ones.
    pub fn slots(&self, voxels: &Voxels) -> std::ops::Range<u32> {
        self.static_voxels..voxels.voxel_count
    }

    /// The [`TouchedBlock`]s of the last update, how many there is room for, and the
    /// [`TouchedCounters`] that say how many there are.
    pub fn touched_blocks(&self) -> (&Arc<Buffer>, u32, &Arc<Buffer>) {
        (&self.touched, self.touched_room(), &self.counts)
    }

    fn touched_room(&self) -> u32 {
        (self.touched.size_bytes() / size_of::<TouchedBlock>() as u64) as u32
    }

    fn fragment_room(&self) -> u32 {
        (self.lists.fragments.size_bytes() / size_of::<Fragment>() as u64) as u32
    }

    /// Takes the dynamic geometry of the last update away, and puts it where it is now. Buffers
    /// that prove too small are made larger, and what filled them is run again. `also` adds passes
    /// that need no more than the touched blocks to the same submission; what they have counted
    /// comes back where all fitted.
    pub fn update(
        &mut self,
        gpu: &Gpu,
        scene: &GpuScene,
        voxelizer: &mut Voxelizer,
        voxels: &mut Voxels,
        also: Option<CountAlso<'_>>,
    ) -> Result<Followed, Error> {
        let block_box = scene.dynamic.as_ref().map_or([IVec3::ZERO; 2], |dynamic| {
            block_box(&voxels.grid, dynamic.bounds)
        });
        let params = self.box_params(&voxels.grid, block_box);
        let mut stats = FrameStats::default();
        let mut frame = Frame::new();
        self.add_restore(&mut frame, voxels);
        let (counts, counted) = loop {
            let capacity = self.fragment_room();
            frame.set_scene(&scene.set, &scene.materials);
            self.add_first_counts(&mut frame);
            let buffers = [
                &self.occupancy,
                &self.lists.fragments,
                &self.lists.emission,
                &self.counts,
            ];
            voxelizer.add_fragments(
                &mut frame,
                scene,
                &Triangles::Dynamic.batches(scene),
                voxelizer.whole(),
                buffers,
                capacity,
            );
            self.add_count(&mut frame, voxels, &params);
            self.add_index(&mut frame, voxels, &params);
            let more = also.and_then(|also| also(&mut frame, self, voxels));
            let read: Vec<_> = [&self.counts].into_iter().chain(&more).collect();
            let (run, mut read) = gpu.submit_and_read_all(std::mem::take(&mut frame), &read)?;
            self.touched_count = 0;
            let counted = more.and_then(|_| read.pop());
            let counts: TouchedCounters =
                bytemuck::pod_read_unaligned(read.first().map_or(&[], |read| read));
            let again = voxelizer.shares_more(counts.unfinished_count)?;
            if !again && counts.fragment_count <= capacity {
                stats.append(run);
                break (counts, counted);
            }
            stats.append(run.into_counting());
            self.reserve_fragments(gpu, scene, &mut frame, counts.fragment_count)?;
        };
        self.reserve_slots(gpu, &mut frame, voxels, &counts)?;
        voxelizer.dynamic_room = [
            counts.fragment_count - self.static_fragments,
            counts.slot_count,
        ]
        .map(with_slack);
        (self.touched_count, self.voxel_count) = (counts.touched_count, counts.dynamic_voxels);
        voxels.voxel_count = self.static_voxels + counts.slot_count;
        voxels.hidden_count = counts.slot_count - counts.added_voxels;
        voxels.fragment_count = counts.fragment_count;
        if counts.indexed == 0 {
            // There is room now.
            self.add_first_counts(&mut frame);
            self.add_count(&mut frame, voxels, &params);
            self.add_index(&mut frame, voxels, &params);
        }
        self.add_continued(&mut frame, voxels);
        let ranges = [
            self.static_fragments..counts.fragment_count,
            self.slots(voxels),
        ];
        voxelizer.add_dynamic_resolve(&mut frame, scene, voxels, &self.lists, ranges);
        gpu.enqueue(frame);
        Ok((stats, counted.filter(|_| counts.indexed != 0)))
    }

    fn add_first_counts(&self, frame: &mut Frame) {
        frame.copy_buffer(
            "voxel.clear",
            (&self.first_counts, 0),
            (&self.counts, 0),
            size_of::<TouchedCounters>() as u64,
        );
    }

    fn box_params(&self, grid: &VoxelGrid, [first, size]: [IVec3; 2]) -> TouchedParams {
        let ([first_x, first_y, first_z], [size_x, size_y, size_z]) =
            (first.as_uvec3().to_array(), size.as_uvec3().to_array());
        TouchedParams {
            first_x,
            first_y,
            first_z,
            size_x,
            size_y,
            size_z,
            blocks: grid.resolution / 4,
            first_slot: self.static_voxels,
        }
    }

    fn add_restore(&self, frame: &mut Frame, voxels: &Voxels) {
        if self.touched_count == 0 {
            return;
        }
        frame
            .pass(&RESTORE_BLOCKS)
            .bind("touched", &self.touched)
            .bind("occupancy", &voxels.occupancy)
            .bind("block_bases", &voxels.block_bases)
            .bind("dynamic_occupancy", &self.occupancy)
            .push(&RestoreParams {
                touched_count: self.touched_count,
            })
            .dispatch(linear_groups(self.touched_count));
    }

    fn add_count(&self, frame: &mut Frame, voxels: &Voxels, params: &TouchedParams) {
        let groups = box_groups(params);
        frame
            .pass(&COUNT_TOUCHED)
            .bind("occupancy", &voxels.occupancy)
            .bind("dynamic_occupancy", &self.occupancy)
            .bind("touched_sums", &self.touched_sums)
            .bind("counts", &self.counts)
            .push(params)
            .dispatch([groups, 1, 1]);
        let scan = TouchedScanParams {
            touched_groups: groups,
            fragment_room: self.fragment_room(),
            touched_room: self.touched_room(),
        };
        frame
            .pass(&SCAN_TOUCHED)
            .bind("touched_sums", &self.touched_sums)
            .bind("counts", &self.counts)
            .push(&scan)
            .dispatch([1, 1, 1]);
    }

    fn add_index(&self, frame: &mut Frame, voxels: &Voxels, params: &TouchedParams) {
        frame
            .pass(&INDEX_TOUCHED)
            .bind("dynamic_occupancy", &self.occupancy)
            .bind("touched_sums", &self.touched_sums)
            .bind("occupancy", &voxels.occupancy)
            .bind("block_bases", &voxels.block_bases)
            .bind("touched", &self.touched)
            .bind("counts", &self.counts)
            .push(params)
            .dispatch([box_groups(params), 1, 1]);
    }

    fn add_continued(&self, frame: &mut Frame, voxels: &Voxels) {
        frame
            .pass(&CONTINUE_LISTS)
            .bind("touched", &self.touched)
            .bind("occupancy", &voxels.occupancy)
            .bind("block_bases", &voxels.block_bases)
            .bind("heads", &self.lists.heads)
            .push(&ListParams {
                touched_count: self.touched_count,
            })
            .dispatch(linear_groups(64 * self.touched_count));
    }

    fn reserve_fragments(
        &mut self,
        gpu: &Gpu,
        scene: &GpuScene,
        frame: &mut Frame,
        needed: u32,
    ) -> Result<(), Error> {
        let kept = self.static_fragments;
        reserve(
            gpu,
            frame,
            &mut self.lists.fragments,
            size_of::<Fragment>() as u64,
            kept,
            needed,
        )?;
        if scene.is_emissive {
            reserve(gpu, frame, &mut self.lists.emission, 8, kept, needed)?;
        }
        Ok(())
    }

    fn reserve_slots(
        &mut self,
        gpu: &Gpu,
        frame: &mut Frame,
        voxels: &mut Voxels,
        counts: &TouchedCounters,
    ) -> Result<(), Error> {
        let (kept, needed) = (self.static_voxels, self.static_voxels + counts.slot_count);
        reserve(
            gpu,
            frame,
            &mut self.touched,
            size_of::<TouchedBlock>() as u64,
            0,
            counts.touched_count,
        )?;
        reserve(gpu, frame, &mut self.lists.heads, 4, kept, needed)?;
        reserve(gpu, frame, &mut self.lists.opposed, 4, 0, needed)?;
        reserve(
            gpu,
            frame,
            &mut voxels.records,
            size_of::<Voxel>() as u64,
            kept,
            needed,
        )?;
        if let Some(emission) = &mut voxels.emission {
            reserve(gpu, frame, emission, 16, kept, needed)?;
        }
        if let Some(faces) = &mut voxels.faces {
            reserve(gpu, frame, faces, 8, kept, needed)?;
        }
        Ok(())
    }
}

/// An eighth more than was counted, so that a model that grows and shrinks as it turns does not
/// make its buffers grow every time.
pub(crate) fn with_slack(count: u32) -> u32 {
    count.saturating_add(count / 8)
}

/// Makes a buffer larger where it has no room for `needed` elements; the first `kept` go along.
fn reserve(
    gpu: &Gpu,
    frame: &mut Frame,
    target: &mut Arc<Buffer>,
    stride: u64,
    kept: u32,
    needed: u32,
) -> Result<(), Error> {
    if stride * u64::from(needed) <= target.size_bytes() {
        return Ok(());
    }
    let capacity = u64::from(kept) + u64::from(with_slack(needed - kept));
    let larger = buffer(gpu, target.name(), stride * capacity)?;
    if kept > 0 {
        frame.copy_buffer(
            "voxel.grow",
            (target, 0),
            (&larger, 0),
            stride * u64::from(kept),
        );
    }
    *target = larger;
    Ok(())
}

/// First block, and blocks along each axis, of those that geometry within some bounds (m) can
/// touch.
fn block_box(grid: &VoxelGrid, (low, high): (Vec3, Vec3)) -> [IVec3; 2] {
    let voxel = |corner: Vec3| ((corner - grid.origin) / grid.voxel_size).floor();
    let limit = (grid.resolution / 4) as f32;
    // A voxel more on each side: geometry touches both voxels at a border, and positions are
    // rounded.
    let first = ((voxel(low) - 1.0) / 4.0)
        .floor()
        .clamp(Vec3::ZERO, Vec3::splat(limit));
    let end = ((voxel(high) + 1.0) / 4.0).floor() + 1.0;
    let size = (end.clamp(Vec3::ZERO, Vec3::splat(limit)) - first).as_ivec3();
    [
        first.as_ivec3(),
        if size.min_element() > 0 {
            size
        } else {
            IVec3::ZERO
        },
    ]
}

/// Workgroups of 1,024 blocks.
fn box_groups(params: &TouchedParams) -> u32 {
    (params.size_x * params.size_y * params.size_z).div_ceil(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_hold_what_geometry_can_touch() {
        let grid = VoxelGrid {
            origin: Vec3::new(1.0, 2.0, 3.0),
            voxel_size: 0.5,
            resolution: 32,
        };
        let at = |low: f32, high: f32| {
            block_box(&grid, (grid.origin + 0.5 * low, grid.origin + 0.5 * high))
                .map(|corner| corner.to_array())
        };
        assert_eq!(at(5.5, 6.5), [[1; 3], [1; 3]]);
        assert_eq!(at(4.5, 7.5), [[0; 3], [3; 3]]);
        assert_eq!(at(-100.0, 100.0), [[0; 3], [8; 3]]);
        assert_eq!(at(31.5, 90.0), [[7; 3], [1; 3]]);
        for (low, high) in [(-90.0, -10.0), (40.0, 50.0)] {
            assert_eq!(
                at(low, high)[1],
                [0; 3],
                "nothing is left of {low} to {high}"
            );
        }
        let aside = (
            grid.origin + Vec3::new(2.0, 2.0, 40.0),
            grid.origin + Vec3::new(3.0, 3.0, 41.0),
        );
        assert_eq!(block_box(&grid, aside)[1], IVec3::ZERO);
    }
}
