//! The voxels and their light: of the whole grid, or, where one of its buffers would be larger than the device can bind, of pieces voxelized one after another.

use std::sync::Arc;

use glam::UVec3;

use super::dynamic::TouchedVoxels;
use super::nodes::require_pointers;
use crate::gi::cone::{ConeTracer, Volume};
use crate::gi::voxel::voxelize::{buffer, linear_groups};
use crate::gi::voxel::{Accumulation, DynamicVoxels, LightSettings, VoxelGrid, VoxelLight, VoxelLookup, VoxelRecords, VoxelSettings, Voxelizer, Voxels};
use crate::gpu_struct;
use crate::graph::{Access, Binding, Buffer, Error, Frame, FrameStats, Gpu, Pass, Sets, Shaders};
use crate::render::{GpuScene, LightMaps};

gpu_struct! {
    /// Parameters of `svo.merge_occupancy`.
    pub struct MergeParams {
        /// Blocks of the piece along an axis.
        pub piece_blocks: u32,
        /// Blocks of the whole grid along an axis.
        pub blocks: u32,
        /// First block of the piece in the whole grid.
        pub first_x: u32,
        /// Likewise.
        pub first_y: u32,
        /// Likewise.
        pub first_z: u32,
        /// Voxels of the pieces before it.
        pub first_voxel: u32,
    }
}

/// Occupancy and block bases of a piece into those of the whole grid. A thread a block.
pub static MERGE_OCCUPANCY: Pass = Pass {
    name: "svo.merge_occupancy",
    shaders: Shaders::Compute("gi/svo/merge_occupancy.comp"),
    bindings: &[
        Binding::buffer("piece_occupancy", Access::ComputeRead),
        Binding::buffer("piece_bases", Access::ComputeRead),
        Binding::buffer("occupancy", Access::ComputeWrite),
        Binding::buffer("block_bases", Access::ComputeWrite),
    ],
    push_bytes: size_of::<MergeParams>() as u32,
    sets: Sets::None,
};

/// No piece is smaller than this along an edge (voxels).
const SMALLEST_PIECE: u32 = 64;

/// A piece and its light.
struct Piece {
    voxels: VoxelRecords,
    light: VoxelLight,
    /// Where there are dynamic models, and the grid is in one piece.
    dynamic: Option<(Voxels, DynamicVoxels)>,
}

/// Voxelizes the grid, in as few pieces as the device's limits allow.
pub struct PieceVoxelizer {
    settings: VoxelSettings,
    grid: VoxelGrid,
    /// One a piece, x fastest; a cube of pieces.
    voxelizers: Vec<Voxelizer>,
}

/// All voxels and their light. Compact indices go through the pieces in order.
pub struct Pieces {
    /// The whole grid.
    pub grid: VoxelGrid,
    /// Occupied voxels.
    pub voxel_count: u32,
    /// Triangle–voxel pairs.
    pub fragment_count: u32,
    /// Radiance and opacity of each voxel.
    pub radiance: Arc<Buffer>,
    pieces: Vec<Piece>,
}

/// What the octree is built over: all voxels, or with dynamic models the static ones. Needed during the build only.
pub struct Occupancy {
    /// Voxels along an edge of the grid.
    pub resolution: u32,
    /// One bit a voxel.
    pub occupancy: Arc<Buffer>,
    /// Compact index of each block's first voxel.
    pub block_bases: Arc<Buffer>,
}

impl From<&Voxels> for Occupancy {
    fn from(voxels: &Voxels) -> Self {
        Occupancy { resolution: voxels.grid.resolution, occupancy: Arc::clone(&voxels.occupancy), block_bases: Arc::clone(&voxels.block_bases) }
    }
}

impl Occupancy {
    /// That of these voxels as they are now.
    fn copy(gpu: &Gpu, voxels: &Voxels) -> Result<(Self, FrameStats), Error> {
        let copied = |frame: &mut Frame, name, source: &Arc<Buffer>| {
            let target = buffer(gpu, name, source.size_bytes())?;
            frame.copy_buffer("svo.copy_occupancy", (source, 0), (&target, 0), source.size_bytes());
            Ok::<_, Error>(target)
        };
        let mut frame = Frame::new();
        let occupancy = copied(&mut frame, "svo.occupancy", &voxels.occupancy)?;
        let block_bases = copied(&mut frame, "svo.block_bases", &voxels.block_bases)?;
        let stats = gpu.submit(frame)?;
        Ok((Occupancy { resolution: voxels.grid.resolution, occupancy, block_bases }, stats))
    }
}

impl PieceVoxelizer {
    /// For a grid around the scene.
    pub fn new(gpu: &Gpu, scene: &GpuScene, settings: VoxelSettings) -> Result<Self, Error> {
        let grid = VoxelGrid::around(scene.bounds, settings.resolution);
        let mut made = PieceVoxelizer { settings, grid, voxelizers: Vec::new() };
        made.cut(gpu, 1)?;
        Ok(made)
    }

    /// Cuts the grid into a cube of pieces, so many along an edge.
    pub fn cut(&mut self, gpu: &Gpu, along: u32) -> Result<(), Error> {
        self.voxelizers.clear();
        let resolution = self.grid.resolution / along;
        for index in 0..along.pow(3) {
            let first = resolution * piece_place(index, along);
            self.voxelizers.push(Voxelizer::of_piece(gpu, self.settings, self.grid, first, resolution)?);
        }
        Ok(())
    }

    /// Voxelizes. What is too large to bind is tried again in smaller pieces, but where voxels see lights by rays: a piece does not know the others.
    pub fn run(&mut self, gpu: &Gpu, scene: &GpuScene, light: LightSettings) -> Result<(Pieces, Occupancy, FrameStats), Error> {
        loop {
            let along = (self.voxelizers.len() as f64).cbrt().round() as u32;
            match self.attempt(gpu, scene, light, along) {
                Err(Error::TooLarge { .. }) if self.grid.resolution / along > SMALLEST_PIECE && !light.traces() => self.cut(gpu, 2 * along)?,
                result => return result,
            }
        }
    }

    fn attempt(&mut self, gpu: &Gpu, scene: &GpuScene, settings: LightSettings, along: u32) -> Result<(Pieces, Occupancy, FrameStats), Error> {
        let mut stats = FrameStats::default();
        let mut found = Vec::with_capacity(self.voxelizers.len());
        let mut pieces = Vec::with_capacity(self.voxelizers.len());
        let mut static_occupancy = None;
        for voxelizer in &mut self.voxelizers {
            let (voxels, dynamic) = if scene.dynamic.is_some() && along == 1 && self.settings.accumulation == Accumulation::Exact {
                let (mut voxels, mut dynamic, cost) = voxelizer.run_static(gpu, scene)?;
                stats.append(cost);
                let (occupancy, cost) = Occupancy::copy(gpu, &voxels)?;
                stats.append(cost);
                static_occupancy = Some(occupancy);
                stats.append(dynamic.update(gpu, scene, voxelizer, &mut voxels)?);
                (voxels, Some(dynamic))
            } else {
                let (voxels, cost) = voxelizer.run(gpu, scene)?;
                stats.append(cost);
                (voxels, None)
            };
            let light = VoxelLight::new(gpu, scene, &voxels, settings)?;
            let mut records = VoxelRecords::from(&voxels);
            if dynamic.is_none() && !settings.traces() {
                // Light finds its voxels in the octree: the dense grid goes with `occupancy`.
                records.dense = None;
            }
            pieces.push(Piece { voxels: records, light, dynamic: dynamic.map(|dynamic| (voxels.clone(), dynamic)) });
            found.push(voxels);
        }
        self.voxelizers.iter_mut().for_each(Voxelizer::release);
        require_pointers("voxel.records", found.iter().map(|voxels| u64::from(voxels.voxel_count)).sum())?;
        let voxel_count = found.iter().map(|voxels| voxels.voxel_count - voxels.hidden_count).sum();
        let fragment_count = found.iter().map(|voxels| voxels.fragment_count).sum();
        let (occupancy, radiance) = match (found.as_slice(), pieces.as_slice()) {
            ([voxels], [whole]) => (static_occupancy.unwrap_or_else(|| Occupancy::from(voxels)), Arc::clone(&whole.light.radiance)),
            _ => {
                let (occupancy, cost) = merge(gpu, self.grid, &found, along)?;
                stats.append(cost);
                (occupancy, buffer(gpu, "svo.radiance", 8 * u64::from(voxel_count))?)
            }
        };
        Ok((Pieces { grid: self.grid, voxel_count, fragment_count, radiance, pieces }, occupancy, stats))
    }
}

/// Where a piece is, in pieces.
fn piece_place(index: u32, along: u32) -> UVec3 {
    UVec3::new(index % along, index / along % along, index / (along * along))
}

fn merge(gpu: &Gpu, grid: VoxelGrid, pieces: &[Voxels], along: u32) -> Result<(Occupancy, FrameStats), Error> {
    let blocks = u64::from(grid.block_count());
    let occupancy = buffer(gpu, "svo.occupancy", 8 * blocks)?;
    let block_bases = buffer(gpu, "svo.block_bases", 4 * blocks)?;
    let mut frame = Frame::new();
    let mut first_voxel = 0;
    for (index, piece) in (0u32..).zip(pieces) {
        let piece_blocks = piece.grid.resolution / 4;
        let [first_x, first_y, first_z] = (piece_blocks * piece_place(index, along)).to_array();
        frame
            .pass(&MERGE_OCCUPANCY)
            .bind(&piece.occupancy)
            .bind(&piece.block_bases)
            .bind(&occupancy)
            .bind(&block_bases)
            .push(&MergeParams { piece_blocks, blocks: grid.resolution / 4, first_x, first_y, first_z, first_voxel })
            .dispatch(linear_groups(piece_blocks.pow(3)));
        first_voxel += piece.voxel_count;
    }
    let stats = gpu.submit(frame)?;
    Ok((Occupancy { resolution: grid.resolution, occupancy, block_bases }, stats))
}

impl Pieces {
    /// Brings the voxels up to the dynamic models after they have moved; `None` where everything has to be voxelized anew.
    pub fn set_pose(&mut self, gpu: &Gpu, scene: &GpuScene, voxelizer: &mut PieceVoxelizer) -> Result<Option<FrameStats>, Error> {
        let ([Piece { voxels: records, light, dynamic: Some((voxels, dynamic)) }], [voxelizer]) =
            (self.pieces.as_mut_slice(), voxelizer.voxelizers.as_mut_slice())
        else {
            return Ok(None);
        };
        let mut stats = match dynamic.update(gpu, scene, voxelizer, voxels) {
            Err(Error::TooLarge { .. }) => return Ok(None),
            updated => updated?,
        };
        match light.follow(gpu, scene, voxels, dynamic.slots(voxels)) {
            Err(Error::TooLarge { .. }) => return Ok(None),
            cleared => stats.append(cleared?),
        }
        self.radiance = Arc::clone(&light.radiance);
        *records = VoxelRecords::from(&*voxels);
        self.voxel_count = voxels.voxel_count - voxels.hidden_count;
        self.fragment_count = voxels.fragment_count;
        require_pointers("voxel.records", u64::from(voxels.voxel_count))?;
        Ok(Some(stats))
    }

    /// The voxels, and which of them dynamic geometry touches; `None` where it is not told apart.
    pub fn touched(&self) -> Option<TouchedVoxels<'_>> {
        let (voxels, dynamic) = self.pieces.first()?.dynamic.as_ref()?;
        let (blocks, block_count) = dynamic.touched_blocks();
        Some(TouchedVoxels { blocks, block_count, occupancy: &voxels.occupancy, block_bases: &voxels.block_bases })
    }

    /// Adds the passes that light the voxels, which are found in the octree of these nodes.
    pub fn update(&self, frame: &mut Frame, maps: &LightMaps, nodes: &Arc<Buffer>) {
        self.add_light(frame, |frame, Piece { voxels, light, .. }, first_voxel| {
            light.update_records(frame, voxels, VoxelLookup::Sparse { nodes, grid: self.grid, first_voxel }, maps, None);
        });
    }

    /// Adds the passes that light the voxels once more in the same frame, with what they gathered.
    pub fn relight(&self, frame: &mut Frame, maps: &LightMaps) {
        self.add_light(frame, |frame, Piece { voxels, light, .. }, _| light.relight(frame, voxels, maps, None));
    }

    /// Adds the passes by which the voxels gather.
    pub fn bounce(&self, frame: &mut Frame, cones: &ConeTracer, volume: Volume<'_>) {
        for Piece { voxels, light, .. } in &self.pieces {
            if let Some(irradiance) = &light.irradiance {
                cones.bounce(frame, &self.grid, voxels, volume, irradiance);
            }
        }
    }

    /// Adds passes of each piece, given its first voxel, and puts the radiances together.
    fn add_light(&self, frame: &mut Frame, add: impl Fn(&mut Frame, &Piece, u32)) {
        let mut first_voxel = 0;
        for piece in &self.pieces {
            add(frame, piece, first_voxel);
            let Piece { voxels, light, .. } = piece;
            let bytes = 8 * u64::from(voxels.voxel_count);
            if self.pieces.len() > 1 && bytes > 0 {
                frame.copy_buffer("svo.merge_radiance", (&light.radiance, 0), (&self.radiance, 8 * u64::from(first_voxel)), bytes);
            }
            first_voxel += voxels.voxel_count;
        }
    }

    /// Counts of fragments, voxels, pieces and light, for the report.
    pub fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let mut counts = vec![("fragments", u64::from(self.fragment_count)), ("voxels", u64::from(self.voxel_count)), ("pieces", self.pieces.len() as u64)];
        for piece in &self.pieces {
            counts.extend(piece.dynamic.as_ref().map(|(_, dynamic)| ("dynamic_voxels", u64::from(dynamic.voxel_count))));
            for (name, count) in piece.light.counts(gpu)? {
                match counts.iter_mut().find(|(known, _)| *known == name) {
                    Some((_, sum)) => *sum += count,
                    None => counts.push((name, count)),
                }
            }
        }
        Ok(counts)
    }
}
