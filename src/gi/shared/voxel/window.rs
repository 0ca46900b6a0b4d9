//! Voxels of a window that moves over the scene, a cube of an unbounded grid.
//!
//! The window moves by whole blocks of 4×4×4 voxels. Voxels that stay in it keep their records,
//! which move to their new places in the compact order; the slabs that come into it are voxelized,
//! and so is what has to be made anew because geometry has moved. The result is, bit for bit, what
//! voxelizing the whole window gives: positions are rounded to whole grains of a voxel, which a
//! float holds exactly wherever the window is.

use std::sync::Arc;

use glam::{IVec3, Vec3};

use super::build::{GridBuffers, add_index, buffer};
use super::window_passes::{
    EMPTY_BLOCKS, EmptyParams, MOVE_RECORDS, MoveParams, SHIFT_BLOCKS, ShiftParams,
};
use super::window_scratch::WindowScratch;
use super::{Interior, VoxelBox, VoxelGrid, VoxelSettings, Voxelizer, Voxels};
use crate::graph::compute::linear_groups;
use crate::graph::{Buffer, Error, Frame, FrameStats, Gpu};
use crate::render::GpuScene;

/// Grains of a voxel: 2¹⁴ voxels from the anchor, positions are still exact to one.
pub const GRAINS: f32 = 1024.0;

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

/// Where a window goes, and what is made anew.
pub struct WindowMove<'m> {
    /// The window.
    pub window: &'m mut VoxelWindow,
    /// The voxel that it begins at from now on; its coordinates are multiples of 4.
    pub first: IVec3,
    /// What is made anew beside what comes into it (whole blocks).
    pub stale: &'m [VoxelBox],
    /// The light of voxels, which moves with those that stay: its buffer, and how many times 8
    /// bytes a voxel has there.
    pub carried: Option<(&'m mut Arc<Buffer>, u32)>,
}

/// What moving a window takes.
struct Plan {
    place: VoxelBox,
    shift: IVec3,
    /// What is voxelized: what comes into it, and from `exposed` on what is stale.
    boxes: Vec<VoxelBox>,
    exposed: usize,
}

/// What a window has that was voxelized: which of those that move at once it is, and counts.
struct Counted {
    window: usize,
    fragment_count: u32,
    voxel_count: u32,
}

/// Moves windows, and voxelizes what comes into them or is stale: one submission for all of them,
/// whose counts are waited for; the rest goes with the next. Returns for each window the boxes that
/// are new; they are disjoint, in voxels of the unbounded grid.
pub fn move_windows(
    gpu: &Gpu,
    scene: &GpuScene,
    scratch: &mut WindowScratch,
    moves: Vec<WindowMove<'_>>,
) -> Result<(Vec<Vec<VoxelBox>>, FrameStats), Error> {
    scratch.hold(gpu, scene, moves.len())?;
    let mut new = vec![Vec::new(); moves.len()];
    let mut moved = Vec::with_capacity(moves.len());
    let mut frame = Frame::new();
    for (index, window_move) in moves.into_iter().enumerate() {
        let window = &mut *window_move.window;
        if let Some(plan) = window.plan(window_move.first, window_move.stale) {
            window.voxelizer.move_to(window.anchor, window_move.first);
            window.add_shift(&mut frame, &plan);
            new[index].clone_from(&plan.boxes);
            moved.push((index, window_move, plan));
        }
    }
    if moved.is_empty() {
        return Ok((new, FrameStats::default()));
    }
    let mut stats = FrameStats::default();
    let counted = voxelize((gpu, scene), scratch, &mut moved, frame, &mut stats)?;
    let mut frame = Frame::new();
    frame.set_scene(&scene.set, &scene.materials);
    for ((_, window_move, plan), counted) in moved.into_iter().zip(&counted) {
        let (window, carried) = (window_move.window, window_move.carried);
        window.add_records((gpu, scene), &mut frame, scratch, &plan, counted, carried)?;
    }
    gpu.enqueue(frame);
    Ok((new, stats))
}

/// Fragments of what is new in windows, after a frame, and the compact order of all; again where
/// there was no room for the fragments.
fn voxelize(
    (gpu, scene): (&Gpu, &GpuScene),
    scratch: &mut WindowScratch,
    moved: &mut [(usize, WindowMove<'_>, Plan)],
    mut frame: Frame,
    stats: &mut FrameStats,
) -> Result<Vec<Counted>, Error> {
    loop {
        frame.set_scene(&scene.set, &scene.materials);
        for (index, window_move, plan) in &mut *moved {
            let to = (&*scratch, *index);
            window_move.window.add_voxels(&mut frame, scene, to, plan);
        }
        let counters = moved
            .iter()
            .map(|(_, one, _)| &one.window.grids[1].counters);
        let counters: Vec<&Arc<Buffer>> = counters.collect();
        let (run, counts) = gpu.submit_and_read_all(std::mem::take(&mut frame), &counters)?;
        let mut has_room = true;
        let mut counted = Vec::with_capacity(counts.len());
        for ((index, window_move, _), counts) in moved.iter_mut().zip(&counts) {
            let counts: Vec<u32> = bytemuck::pod_collect_to_vec(counts);
            let (fragment_count, voxel_count, unfinished_count) = (counts[0], counts[1], counts[2]);
            let voxelizer = &mut window_move.window.voxelizer;
            has_room &= !voxelizer.shares_more(unfinished_count)?
                && fragment_count <= scratch.capacity(*index);
            scratch.reserve_fragments(gpu, scene, (*index, fragment_count))?;
            counted.push(Counted {
                window: *index,
                fragment_count,
                voxel_count,
            });
        }
        if has_room {
            stats.append(run);
            return Ok(counted);
        }
        stats.append(run.into_counting());
        // What is inside of bodies is found by what surfaces have not marked.
        for (_, window_move, plan) in &*moved {
            window_move.window.add_shift(&mut frame, plan);
        }
    }
}

impl VoxelWindow {
    /// A window on the grid that has a corner at `anchor` (m), nowhere yet. `settings.resolution`
    /// is its edge, a multiple of 4.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: VoxelSettings,
        (anchor, voxel_size): (Vec3, f32),
        interior: Option<Arc<Interior>>,
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
        gpu.enqueue(frame);
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
            voxelizer: Voxelizer::of_window(gpu, settings, grid, (GRAINS, interior))?,
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

    /// Where it goes, and what is made anew there; `None` where nothing is.
    fn plan(&mut self, first: IVec3, stale: &[VoxelBox]) -> Option<Plan> {
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
        // From nowhere it has moved so far that nothing stays.
        let shift = self
            .place
            .map_or(IVec3::splat(self.voxels.grid.resolution as i32), |before| {
                first - before.low
            });
        (!boxes.is_empty()).then_some(Plan {
            place,
            shift,
            boxes,
            exposed,
        })
    }

    /// Adds the passes that move what stays, and make the records of what is new.
    fn add_records(
        &mut self,
        (gpu, scene): (&Gpu, &GpuScene),
        frame: &mut Frame,
        scratch: &mut WindowScratch,
        plan: &Plan,
        counted: &Counted,
        carried: Option<(&mut Arc<Buffer>, u32)>,
    ) -> Result<(), Error> {
        let Counted {
            window,
            fragment_count,
            voxel_count,
        } = *counted;
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
        let first = plan.place.low;
        self.grids.swap(0, 1);
        self.voxels.grid.origin = self.anchor + self.voxels.grid.voxel_size * first.as_vec3();
        self.voxels.lattice.first = first;
        (self.voxels.occupancy, self.voxels.block_bases) = (
            Arc::clone(&self.grids[0].occupancy),
            Arc::clone(&self.grids[0].block_bases),
        );
        (self.voxels.voxel_count, self.voxels.fragment_count) = (voxel_count, fragment_count);
        self.add_move(
            gpu,
            frame,
            scratch,
            plan.shift,
            [Some(&records), emission.as_ref(), faces.as_ref()],
            carried,
        )?;
        frame.fill("voxel.clear", &scratch.lists.heads, 0);
        let [fragments, fragment_emission] = scratch.fragments[window].each_ref().map(Arc::clone);
        (scratch.lists.fragments, scratch.lists.emission) = (fragments, fragment_emission);
        self.voxelizer.add_dynamic_resolve(
            frame,
            scene,
            &self.voxels,
            &scratch.lists,
            [0..fragment_count, 0..voxel_count],
        );
        (scratch.records, scratch.emission) = (records, emission);
        if faces.is_some() {
            scratch.faces = faces;
        }
        self.place = Some(plan.place);
        Ok(())
    }

    /// The occupancy of what stays, into the next grid.
    fn add_shift(&self, frame: &mut Frame, plan: &Plan) {
        let (shift, stale, first) = (plan.shift, &plan.boxes[plan.exposed..], plan.place.low);
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

    /// Adds fragments of what is new, and the compact order of all, into the next grid.
    fn add_voxels(
        &mut self,
        frame: &mut Frame,
        scene: &GpuScene,
        (scratch, window): (&WindowScratch, usize),
        Plan { place, boxes, .. }: &Plan,
    ) {
        let first = place.low;
        let [fragments, emission] = &scratch.fragments[window];
        let next = &self.grids[1];
        frame.fill("voxel.clear", &next.counters, 0);
        for new in boxes {
            let clip = VoxelBox {
                low: new.low - first,
                end: new.end - first,
            };
            let [low, high] = [new.low - 1, new.end + 1]
                .map(|voxel| self.anchor + self.voxels.grid.voxel_size * voxel.as_vec3());
            self.voxelizer.add_fragments(
                frame,
                scene,
                &scene.triangles_in(low, high),
                clip,
                [&next.occupancy, fragments, emission, &next.counters],
                scratch.capacity(window),
            );
            self.voxelizer.add_interior(
                frame,
                scene,
                clip,
                [&next.occupancy, fragments, emission, &next.counters],
                scratch.capacity(window),
            );
        }
        add_index(frame, self.voxels.grid, next);
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
