//! Voxels of a window that moves over the scene, a cube of an unbounded grid.
//!
//! The window moves by whole blocks of 4×4×4 voxels. Voxels that stay in it keep their records,
//! which move to their new places in the compact order; the slabs that come into it are voxelized,
//! and so is what has to be made anew because geometry has moved. The result is, bit for bit, what
//! voxelizing the whole window gives: positions are rounded to whole grains of a voxel, which a
//! float holds exactly wherever the window is.

use std::sync::Arc;

use glam::{IVec3, Vec3};

use super::build::passes::{Fragment, Voxel};
use super::build::{FragmentLists, GridBuffers, add_index, buffer};
use super::{VoxelBox, VoxelGrid, VoxelSettings, Voxelizer, Voxels};
use crate::gpu_struct;
use crate::graph::compute::{linear_groups, read, write};
use crate::graph::{Buffer, Error, Frame, FrameStats, Gpu, Pass};
use crate::render::GpuScene;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `voxel.shift_blocks`.
    pub struct ShiftParams {
        /// Blocks that the window has moved by along x.
        pub shift_x: i32,
        /// Blocks that the window has moved by along y.
        pub shift_y: i32,
        /// Blocks that the window has moved by along z.
        pub shift_z: i32,
        /// Blocks along an edge of the window.
        pub blocks: i32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.empty_blocks`: a box of blocks.
    pub struct EmptyParams {
        /// First block of the box along x.
        pub first_x: u32,
        /// First block of the box along y.
        pub first_y: u32,
        /// First block of the box along z.
        pub first_z: u32,
        /// Blocks of the box along x.
        pub size_x: u32,
        /// Blocks of the box along y.
        pub size_y: u32,
        /// Blocks of the box along z.
        pub size_z: u32,
        /// Blocks along an edge of the window.
        pub blocks: u32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.move_records`.
    pub struct MoveParams {
        /// Blocks of the window.
        pub block_count: u32,
        /// Voxels that the window has moved by, along x and y: x + 2¹⁶ y, modulo 2³².
        pub shift_xy: u32,
        /// Voxels that the window has moved by along z, modulo 2³².
        pub shift_z: u32,
    }
}

/// Occupancy after a move, as far as the window stays where it was. A thread a block.
pub static SHIFT_BLOCKS: Pass = Pass::compute(
    "voxel.shift_blocks",
    "gi/shared/voxel/window/shift_blocks.comp",
    &[
        read("occupancy"),
        read("block_bases"),
        write("shifted_occupancy"),
        write("moved_from"),
    ],
    ShiftParams::LAYOUT,
);

/// Blocks that are voxelized anew become empty. A thread a block.
pub static EMPTY_BLOCKS: Pass = Pass::compute(
    "voxel.empty_blocks",
    "gi/shared/voxel/window/empty_blocks.comp",
    &[write("shifted_occupancy"), write("moved_from")],
    EmptyParams::LAYOUT,
);

/// Records of blocks that stay, to their new places. A thread a block.
pub static MOVE_RECORDS: Pass = Pass {
    constants: &["EMISSIVE", "CARRIED", "FACES"],
    ..Pass::compute(
        "voxel.move_records",
        "gi/shared/voxel/window/move_records.comp",
        &[
            read("moved_from"),
            read("occupancy"),
            read("block_bases"),
            read("old_voxels"),
            write("voxels"),
            read("old_emission"),
            write("voxel_emission"),
            read("old_carried"),
            write("carried"),
            read("old_faces"),
            write("voxel_faces"),
        ],
        MoveParams::LAYOUT,
    )
};

/// Grains of a voxel: 2¹⁴ voxels from the anchor, positions are still exact to one.
pub const GRAINS: f32 = 1024.0;

/// Records that a window's go to when it moves, and what only an update needs; windows that are
/// updated in turn share it.
pub struct WindowScratch {
    nothing: Arc<Buffer>,
    lists: FragmentLists,
    records: Arc<Buffer>,
    emission: Option<Arc<Buffer>>,
    /// Only for windows of directional voxels, from their first update on.
    faces: Option<Arc<Buffer>>,
}

impl WindowScratch {
    /// Empty buffers, which the first update makes as large as it needs them.
    pub fn new(gpu: &Gpu, scene: &GpuScene) -> Result<Self, Error> {
        let fragments = buffer(gpu, "voxel.fragments", 0)?;
        let name = if scene.is_emissive {
            "voxel.fragment_emission"
        } else {
            "voxel.nothing"
        };
        let emission = buffer(gpu, name, 0)?;
        Ok(WindowScratch {
            nothing: buffer(gpu, "voxel.nothing", 0)?,
            lists: FragmentLists::new(gpu, [fragments, emission], 0)?,
            records: buffer(gpu, "voxel.records", 0)?,
            emission: scene
                .is_emissive
                .then(|| buffer(gpu, "voxel.emission", 0))
                .transpose()?,
            faces: None,
        })
    }

    /// Fragments that there is room for.
    fn capacity(&self) -> u32 {
        (self.lists.fragments.size_bytes() / size_of::<Fragment>() as u64) as u32
    }

    fn reserve_fragments(&mut self, gpu: &Gpu, scene: &GpuScene, count: u32) -> Result<(), Error> {
        reserve(gpu, &mut self.lists.fragments, size_of::<Fragment>(), count)?;
        if scene.is_emissive {
            reserve(gpu, &mut self.lists.emission, 8, count)
        } else {
            Ok(())
        }
    }

    fn reserve_voxels(&mut self, gpu: &Gpu, count: u32, has_faces: bool) -> Result<(), Error> {
        if has_faces {
            let faces = self
                .faces
                .take()
                .map_or_else(|| buffer(gpu, "voxel.faces", 0), Ok)?;
            reserve(gpu, self.faces.insert(faces), 8, count)?;
        }
        reserve(gpu, &mut self.lists.heads, 4, count)?;
        reserve(gpu, &mut self.lists.opposed, 4, count)?;
        reserve(gpu, &mut self.records, size_of::<Voxel>(), count)?;
        self.emission
            .as_mut()
            .map_or(Ok(()), |emission| reserve(gpu, emission, 16, count))
    }
}

/// Makes a buffer larger, without its contents, where it has no room for `count` elements; then
/// with an eighth to spare.
fn reserve(gpu: &Gpu, target: &mut Arc<Buffer>, stride: usize, count: u32) -> Result<(), Error> {
    let needed = stride as u64 * u64::from(count);
    if needed > target.size_bytes() {
        *target = buffer(
            gpu,
            target.name(),
            stride as u64 * (u64::from(count) + u64::from(count) / 8),
        )?;
    }
    Ok(())
}

/// The occupied voxels of a window.
pub struct VoxelWindow {
    /// Corner of voxel (0, 0, 0) of the unbounded grid (m).
    anchor: Vec3,
    voxelizer: Voxelizer,
    /// Where the window is; nowhere before the first update.
    place: Option<VoxelBox>,
    /// Buffers of the voxels now, and of the voxels after the next update.
    grids: [GridBuffers; 2],
    moved_from: Arc<Buffer>,
    /// The voxels, with coordinates from the window's smallest corner.
    pub voxels: Voxels,
}

impl VoxelWindow {
    /// A window on the grid that has a corner at `anchor` (m), nowhere yet. `settings.resolution`
    /// is its edge, a multiple of 4.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: VoxelSettings,
        anchor: Vec3,
        voxel_size: f32,
    ) -> Result<Self, Error> {
        let grid = VoxelGrid {
            origin: anchor,
            voxel_size,
            resolution: settings.resolution,
        };
        let grids = [GridBuffers::new(gpu, grid)?, GridBuffers::new(gpu, grid)?];
        let mut frame = Frame::new();
        frame.fill("voxel.clear", &grids[0].occupancy, 0);
        frame.fill("voxel.clear", &grids[0].block_bases, 0);
        gpu.submit(frame)?;
        let voxels = Voxels {
            grid,
            lattice: grid.lattice(),
            occupancy: Arc::clone(&grids[0].occupancy),
            block_bases: Arc::clone(&grids[0].block_bases),
            records: buffer(gpu, "voxel.records", 0)?,
            emission: scene
                .is_emissive
                .then(|| buffer(gpu, "voxel.emission", 0))
                .transpose()?,
            faces: settings
                .faces
                .map(|_| buffer(gpu, "voxel.faces", 0))
                .transpose()?,
            voxel_count: 0,
            hidden_count: 0,
            fragment_count: 0,
            is_dynamic: false,
            filled: None,
        };
        Ok(VoxelWindow {
            anchor,
            voxelizer: Voxelizer::of_window(gpu, settings, grid, GRAINS)?,
            place: None,
            grids,
            moved_from: buffer(gpu, "voxel.moved_from", 4 * u64::from(grid.block_count()))?,
            voxels,
        })
    }

    /// The voxels of the unbounded grid that are in it.
    pub fn place(&self) -> Option<VoxelBox> {
        self.place
    }

    /// The voxels that geometry within some bounds (m) can touch, in whole blocks.
    pub fn touched(&self, (low, high): (Vec3, Vec3)) -> VoxelBox {
        // A voxel more on each side: geometry touches both voxels at a border, and positions are
        // rounded.
        let block = |corner: Vec3, more: f32| {
            ((((corner - self.anchor) / self.voxels.grid.voxel_size).floor() + more) / 4.0)
                .floor()
                .as_ivec3()
        };
        VoxelBox {
            low: 4 * block(low, -1.0),
            end: 4 * (block(high, 1.0) + 1),
        }
    }

    /// Moves the window so that it begins at the voxel `first`, whose coordinates are multiples of
    /// 4, and makes what lies in `stale` (whole blocks) anew. Returns the boxes that are new; they
    /// are disjoint, in voxels of the unbounded grid. The light of the voxels that stay moves with
    /// them (`carried`: its buffer, and how many times 8 bytes a voxel has there).
    pub fn update(
        &mut self,
        gpu: &Gpu,
        scene: &GpuScene,
        scratch: &mut WindowScratch,
        first: IVec3,
        stale: &[VoxelBox],
        carried: Option<(&mut Arc<Buffer>, u32)>,
    ) -> Result<(Vec<VoxelBox>, FrameStats), Error> {
        let place = VoxelBox::cube(first, self.voxels.grid.resolution);
        let kept = self.place.map_or(
            VoxelBox {
                low: first,
                end: first,
            },
            |before| before.cut(place),
        );
        let mut boxes = place.without(kept);
        let exposed = boxes.len();
        for stale in stale {
            let mut parts = vec![stale.cut(kept)];
            for known in &boxes[exposed..] {
                parts = parts
                    .into_iter()
                    .flat_map(|part| part.without(*known))
                    .collect();
            }
            boxes.extend(parts.into_iter().filter(|part| !part.is_empty()));
        }
        if boxes.is_empty() {
            return Ok((boxes, FrameStats::default()));
        }
        // From nowhere it has moved so far that nothing stays.
        let shift = self
            .place
            .map_or(IVec3::splat(self.voxels.grid.resolution as i32), |before| {
                first - before.low
            });
        self.voxelizer.move_to(self.anchor, first);
        let mut frame = Frame::new();
        self.add_shift(&mut frame, shift, &boxes[exposed..], first);
        let mut stats = FrameStats::default();
        let [fragment_count, voxel_count] =
            self.add_voxels(gpu, scene, scratch, (frame, first, &boxes), &mut stats)?;
        scratch.reserve_voxels(gpu, voxel_count, self.voxels.faces.is_some())?;
        let records = std::mem::replace(&mut self.voxels.records, Arc::clone(&scratch.records));
        let emission = std::mem::replace(
            &mut self.voxels.emission,
            scratch.emission.as_ref().map(Arc::clone),
        );
        let scratch_faces = scratch.faces.as_ref().map(Arc::clone);
        let faces = self
            .voxels
            .faces
            .as_mut()
            .zip(scratch_faces)
            .map(|(own, new)| std::mem::replace(own, new));
        self.grids.swap(0, 1);
        self.voxels.grid.origin = self.anchor + self.voxels.grid.voxel_size * first.as_vec3();
        self.voxels.lattice.first = first;
        (self.voxels.occupancy, self.voxels.block_bases) = (
            Arc::clone(&self.grids[0].occupancy),
            Arc::clone(&self.grids[0].block_bases),
        );
        (self.voxels.voxel_count, self.voxels.fragment_count) = (voxel_count, fragment_count);
        let mut frame = Frame::new();
        frame.set_scene(&scene.set, &scene.materials);
        self.add_move(
            gpu,
            &mut frame,
            scratch,
            shift,
            [Some(&records), emission.as_ref(), faces.as_ref()],
            carried,
        )?;
        frame.fill("voxel.clear", &scratch.lists.heads, 0);
        self.voxelizer.add_dynamic_resolve(
            &mut frame,
            scene,
            &self.voxels,
            &scratch.lists,
            [0..fragment_count, 0..voxel_count],
        );
        stats.append(gpu.submit(frame)?);
        (scratch.records, scratch.emission) = (records, emission);
        if faces.is_some() {
            scratch.faces = faces;
        }
        self.place = Some(place);
        Ok((boxes, stats))
    }

    /// The occupancy of what stays, into the next grid.
    fn add_shift(&self, frame: &mut Frame, shift: IVec3, stale: &[VoxelBox], first: IVec3) {
        let [grid, next] = &self.grids;
        let blocks = self.voxels.grid.resolution / 4;
        let [shift_x, shift_y, shift_z] = (shift / 4).to_array();
        frame
            .pass(&SHIFT_BLOCKS)
            .bind("occupancy", &grid.occupancy)
            .bind("block_bases", &grid.block_bases)
            .bind("shifted_occupancy", &next.occupancy)
            .bind("moved_from", &self.moved_from)
            .push(&ShiftParams {
                shift_x,
                shift_y,
                shift_z,
                blocks: blocks as i32,
            })
            .dispatch([blocks.pow(3).div_ceil(64), 1, 1]);
        for stale in stale {
            let ([first_x, first_y, first_z], [size_x, size_y, size_z]) = (
                ((stale.low - first) / 4).as_uvec3().to_array(),
                ((stale.end - stale.low) / 4).as_uvec3().to_array(),
            );
            frame
                .pass(&EMPTY_BLOCKS)
                .bind("shifted_occupancy", &next.occupancy)
                .bind("moved_from", &self.moved_from)
                .push(&EmptyParams {
                    first_x,
                    first_y,
                    first_z,
                    size_x,
                    size_y,
                    size_z,
                    blocks,
                })
                .dispatch([(size_x * size_y * size_z).div_ceil(64), 1, 1]);
        }
    }

    /// Fragments of what is new, and the compact order of all; returns how many fragments and
    /// voxels. Run again where there was no room for the fragments.
    fn add_voxels(
        &mut self,
        gpu: &Gpu,
        scene: &GpuScene,
        scratch: &mut WindowScratch,
        (mut frame, first, boxes): (Frame, IVec3, &[VoxelBox]),
        stats: &mut FrameStats,
    ) -> Result<[u32; 2], Error> {
        loop {
            let next = &self.grids[1];
            frame.set_scene(&scene.set, &scene.materials);
            frame.fill("voxel.clear", &next.counters, 0);
            for new in boxes {
                let clip = VoxelBox {
                    low: new.low - first,
                    end: new.end - first,
                };
                let [low, high] = [new.low - 1, new.end + 1]
                    .map(|voxel| self.anchor + self.voxels.grid.voxel_size * voxel.as_vec3());
                let buffers = [
                    &next.occupancy,
                    &scratch.lists.fragments,
                    &scratch.lists.emission,
                    &next.counters,
                ];
                self.voxelizer.add_fragments(
                    &mut frame,
                    scene,
                    &scene.triangles_in(low, high),
                    clip,
                    buffers,
                    scratch.capacity(),
                );
            }
            add_index(&mut frame, self.voxels.grid, next);
            let (run, counts) = gpu.submit_and_read(std::mem::take(&mut frame), &next.counters)?;
            let counts: Vec<u32> = bytemuck::pod_collect_to_vec(&counts);
            let (fragment_count, voxel_count, unfinished_count) = (counts[0], counts[1], counts[2]);
            let again = self.voxelizer.shares_more(unfinished_count)?;
            if !again && fragment_count <= scratch.capacity() {
                stats.append(run);
                return Ok([fragment_count, voxel_count]);
            }
            stats.append(run.into_counting());
            scratch.reserve_fragments(gpu, scene, fragment_count)?;
        }
    }

    fn add_move(
        &self,
        gpu: &Gpu,
        frame: &mut Frame,
        scratch: &WindowScratch,
        shift: IVec3,
        old: [Option<&Arc<Buffer>>; 3],
        carried: Option<(&mut Arc<Buffer>, u32)>,
    ) -> Result<(), Error> {
        let nothing = &scratch.nothing;
        let [old_records, old_emission, old_faces] = old.map(|old| old.unwrap_or(nothing));
        let [_, has_emission, has_faces] = old.map(|old| old.is_some());
        let moved_light = match &carried {
            Some((old, parts)) => buffer(
                gpu,
                old.name(),
                8 * u64::from(*parts) * u64::from(self.voxels.capacity()),
            )?,
            None => buffer(gpu, "voxel.nothing", 0)?,
        };
        let block_count = self.voxels.grid.block_count();
        let params = MoveParams {
            block_count,
            shift_xy: (shift.x + (shift.y << 16)) as u32,
            shift_z: shift.z as u32,
        };
        let pass = frame
            .pass(&MOVE_RECORDS)
            .bind("moved_from", &self.moved_from)
            .bind("occupancy", &self.voxels.occupancy)
            .bind("block_bases", &self.voxels.block_bases)
            .bind("old_voxels", old_records);
        pass.bind("voxels", &self.voxels.records)
            .bind("old_emission", old_emission)
            .bind(
                "voxel_emission",
                self.voxels.emission.as_ref().unwrap_or(&moved_light),
            )
            .bind(
                "old_carried",
                carried.as_ref().map_or(nothing, |(old, _)| &**old),
            )
            .bind("carried", &moved_light)
            .bind("old_faces", old_faces)
            .bind(
                "voxel_faces",
                self.voxels.faces.as_ref().unwrap_or(&moved_light),
            )
            .constant("EMISSIVE", has_emission)
            .constant("CARRIED", carried.as_ref().map_or(0, |(_, parts)| *parts))
            .constant("FACES", has_faces)
            .push(&params)
            .dispatch(linear_groups(block_count));
        if let Some((carried, _)) = carried {
            *carried = moved_light;
        }
        Ok(())
    }
}
