//! The voxels and their light: of the whole grid, or, where one of its buffers would be larger than
//! the device can bind, of pieces voxelized one after another.

use std::sync::Arc;

use glam::UVec3;

use super::super::Gatherer;
use super::bricks::RecordRange;
use super::dynamic::TouchedVoxels;
use super::nodes::{NodePool, require_pointers};
use super::space::{MERGE_RADIANCE, MergeParams, radiance_texels};
use crate::gi::shared::cone::Volume;
use crate::gi::shared::voxel::build::passes::Voxel;
use crate::gi::shared::voxel::build::{FilledBlocks, buffer};
use crate::gi::shared::voxel::dynamic::Followed;
use crate::gi::shared::voxel::light::inject::{INJECT_BINDINGS, inject_pass};
use crate::gi::shared::voxel::trace::surfaces::{SURFACE_BYTES, pack_surfaces};
use crate::gi::shared::voxel::{
    Accumulation, DynamicVoxels, LightInputs, LightSettings, LitVoxels, Space, Viewer, VoxelGrid,
    VoxelLight, VoxelLookup, VoxelRecords, VoxelSettings, Voxelizer, Voxels, add_counts,
    bound_tiles,
};
use crate::graph::compute::linear_groups;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Buffer, Error, Frame, FrameStats, Gpu, Image, Pass};
use crate::render::GpuScene;

/// As `voxel.inject_rsm` elsewhere; voxels are found by descent from the root of the octree
/// (Crassin et al. 2011, section 6).
pub static INJECT_RSM: Pass = inject_pass(
    "gi/voxel_cones/svo/inject_rsm.comp",
    const {
        &join::<_, 8, 1, 9>(
            INJECT_BINDINGS,
            [Binding::buffer("nodes", Access::ComputeRead)],
        )
    },
);

/// Words of a voxel's record.
const RECORD_WORDS: u32 = (size_of::<Voxel>() / 4) as u32;

/// A piece and its light.
struct Piece {
    voxels: VoxelRecords,
    light: VoxelLight,
    /// Where there are dynamic models, and the grid is in one piece.
    dynamic: Option<(Voxels, DynamicVoxels)>,
}

impl Piece {
    /// Radiances of all its voxels.
    fn radiance_count(&self) -> u32 {
        self.light.settings.radiances() * self.voxels.voxel_count
    }
}

/// Voxelizes the grid, in as few pieces as the device's limits allow.
pub struct PieceVoxelizer {
    settings: VoxelSettings,
    grid: VoxelGrid,
    whole: Voxelizer,
    /// One for each piece of the grid.
    voxelizers: Vec<Voxelizer>,
    /// Whether dynamic geometry has voxels of its own, which follow it; otherwise all is voxelized
    /// at once.
    pub follows: bool,
    /// Whether bricks read the light of all voxels, from one buffer.
    pub has_bricks: bool,
}

/// All voxels and their light. Compact indices go through the pieces in order.
pub struct Pieces {
    /// The whole grid.
    pub grid: VoxelGrid,
    /// Occupied voxels.
    pub voxel_count: u32,
    /// Triangle–voxel pairs.
    pub fragment_count: u32,
    /// Radiance and opacity of each voxel, or of each side of it; empty where rays alone read those
    /// of several pieces.
    pub radiance: Arc<Buffer>,
    /// The same as rays read it of several pieces without bricks, made by [`Pieces::pack`].
    pub radiance_texels: Option<Arc<Image>>,
    /// Whether bricks read `radiance`.
    has_bricks: bool,
    /// The pieces that are not empty, or the whole grid as one.
    pieces: Vec<Piece>,
    /// What rays read of the voxels of several pieces.
    packed: Option<Arc<Buffer>>,
}

/// What the octree is built over: all voxels, or with dynamic models the static ones. Needed during
/// the build only.
pub struct Occupancy {
    /// Voxels along an edge of the grid.
    pub resolution: u32,
    /// Cubes of the grid that have all voxels in them.
    pub cubes: Vec<OccupiedCube>,
}

/// The voxels of a cube of the grid.
pub struct OccupiedCube {
    /// Its smallest corner (voxels).
    pub first: UVec3,
    /// Voxels along its edge.
    pub resolution: u32,
    /// One bit a voxel.
    pub occupancy: Arc<Buffer>,
    /// For each block: number of the cube's voxels before its first one.
    pub block_bases: Arc<Buffer>,
    /// Compact index of the cube's first voxel.
    pub first_voxel: u32,
    /// Its blocks that have voxels, where they are listed.
    pub filled: Option<FilledBlocks>,
}

impl OccupiedCube {
    fn new(voxels: &Voxels, first: UVec3, first_voxel: u32) -> Self {
        let (occupancy, block_bases) = (
            Arc::clone(&voxels.occupancy),
            Arc::clone(&voxels.block_bases),
        );
        OccupiedCube {
            first,
            resolution: voxels.grid.resolution,
            occupancy,
            block_bases,
            first_voxel,
            filled: voxels.filled.clone(),
        }
    }

    /// A whole grid, as it is now.
    fn copy(gpu: &Gpu, voxels: &Voxels) -> Result<(Self, FrameStats), Error> {
        let copied = |frame: &mut Frame, name, source: &Arc<Buffer>| {
            let target = buffer(gpu, name, source.size_bytes())?;
            frame.copy_buffer(
                "svo.copy_occupancy",
                (source, 0),
                (&target, 0),
                source.size_bytes(),
            );
            Ok::<_, Error>(target)
        };
        let mut frame = Frame::new();
        let occupancy = copied(&mut frame, "svo.occupancy", &voxels.occupancy)?;
        let block_bases = copied(&mut frame, "svo.block_bases", &voxels.block_bases)?;
        let stats = gpu.submit(frame)?;
        Ok((
            OccupiedCube {
                occupancy,
                block_bases,
                ..OccupiedCube::new(voxels, UVec3::ZERO, 0)
            },
            stats,
        ))
    }
}

impl From<&Voxels> for Occupancy {
    fn from(voxels: &Voxels) -> Self {
        Occupancy {
            resolution: voxels.grid.resolution,
            cubes: vec![OccupiedCube::new(voxels, UVec3::ZERO, 0)],
        }
    }
}

impl PieceVoxelizer {
    /// For a grid around the scene.
    pub fn new(gpu: &Gpu, scene: &GpuScene, settings: VoxelSettings) -> Result<Self, Error> {
        let mut whole = Voxelizer::new(gpu, scene, settings)?;
        whole.lists_blocks = true;
        Ok(PieceVoxelizer {
            settings,
            grid: VoxelGrid::around(scene.bounds, settings.resolution),
            voxelizers: whole.cut(1),
            whole,
            follows: true,
            has_bricks: true,
        })
    }

    /// Cuts the grid into a cube of pieces, `along` of them on each edge.
    pub fn cut(&mut self, along: u32) {
        self.voxelizers = self.whole.cut(along);
    }

    /// Voxelizes. If a buffer is too large to bind, smaller pieces are tried, unless voxels see
    /// lights by rays: a ray in one piece does not see the voxels of another.
    pub fn run(
        &mut self,
        gpu: &Gpu,
        scene: &GpuScene,
        light: LightSettings,
    ) -> Result<(Pieces, Occupancy, FrameStats), Error> {
        let Self {
            settings,
            grid,
            ref whole,
            ref mut voxelizers,
            follows,
            has_bricks,
        } = *self;
        let follows =
            follows && scene.dynamic.is_some() && settings.accumulation == Accumulation::Exact;
        let attempt = |voxelizers: &mut [Voxelizer]| {
            attempt(gpu, scene, [follows, has_bricks], grid, light, voxelizers)
        };
        if light.traces() {
            attempt(voxelizers)
        } else {
            whole.run_in_pieces(voxelizers, attempt)
        }
    }
}

fn attempt(
    gpu: &Gpu,
    scene: &GpuScene,
    [follows, has_bricks]: [bool; 2],
    grid: VoxelGrid,
    light_settings: LightSettings,
    voxelizers: &mut [Voxelizer],
) -> Result<(Pieces, Occupancy, FrameStats), Error> {
    let is_whole = voxelizers.len() == 1;
    let mut stats = FrameStats::default();
    let mut occupancy = Occupancy {
        resolution: grid.resolution,
        cubes: Vec::new(),
    };
    let mut pieces = Vec::new();
    let (mut voxel_count, mut fragment_count, mut first_voxel) = (0, 0, 0);
    for voxelizer in voxelizers.iter_mut() {
        let (voxels, dynamic) = if follows && is_whole {
            let (mut voxels, mut dynamic, cost) = voxelizer.run_static(gpu, scene)?;
            stats.append(cost);
            let (cube, cost) = OccupiedCube::copy(gpu, &voxels)?;
            stats.append(cost);
            occupancy.cubes.push(cube);
            voxels.filled = None;
            stats.append(dynamic.update(gpu, scene, voxelizer, &mut voxels, None)?.0);
            (voxels, Some(dynamic))
        } else {
            let (voxels, cost) = voxelizer.run(gpu, scene)?;
            stats.append(cost);
            occupancy.cubes.push(OccupiedCube::new(
                &voxels,
                voxelizer.first_voxel(),
                first_voxel,
            ));
            (voxels, None)
        };
        voxelizer.release();
        if voxels.voxel_count == 0 && !is_whole {
            occupancy.cubes.pop();
            continue;
        }
        require_pointers(
            "voxel.records",
            u64::from(first_voxel) + u64::from(voxels.voxel_count),
        )?;
        let light = VoxelLight::new(gpu, scene, &voxels, light_settings)?;
        let mut records = VoxelRecords::from(&voxels);
        if dynamic.is_none() && !light_settings.traces() {
            // Light finds its voxels in the octree: the dense grid goes with `occupancy`.
            records.dense = None;
        }
        voxel_count += voxels.voxel_count - voxels.hidden_count;
        fragment_count += voxels.fragment_count;
        first_voxel += voxels.voxel_count;
        pieces.push(Piece {
            voxels: records,
            light,
            dynamic: dynamic.map(|dynamic| (voxels, dynamic)),
        });
    }
    let radiance = match pieces.as_slice() {
        [whole] => Arc::clone(&whole.light.radiance),
        _ if has_bricks => buffer(
            gpu,
            "svo.radiance",
            light_settings.radiance_bytes(voxel_count),
        )?,
        _ => buffer(gpu, "svo.radiance", 0)?,
    };
    Ok((
        Pieces {
            grid,
            voxel_count,
            fragment_count,
            radiance,
            radiance_texels: None,
            has_bricks,
            pieces,
            packed: None,
        },
        occupancy,
        stats,
    ))
}

fn touched_voxels<'v>(voxels: &'v Voxels, dynamic: &'v DynamicVoxels) -> TouchedVoxels<'v> {
    let (blocks, block_room, counts) = dynamic.touched_blocks();
    TouchedVoxels {
        blocks,
        block_room,
        counts,
        occupancy: &voxels.occupancy,
        block_bases: &voxels.block_bases,
    }
}

impl Pieces {
    /// Brings the voxels up to the dynamic models after they have moved, and answers what that took
    /// and what the dynamic tiles of `nodes` were counted to be, where they were; `None` where
    /// everything has to be voxelized anew.
    pub fn set_pose(
        &mut self,
        gpu: &Gpu,
        scene: &GpuScene,
        voxelizer: &mut PieceVoxelizer,
        nodes: &NodePool,
    ) -> Result<Option<Followed>, Error> {
        let (
            [
                Piece {
                    voxels: records,
                    light,
                    dynamic: Some((voxels, dynamic)),
                },
            ],
            [voxelizer],
        ) = (
            self.pieces.as_mut_slice(),
            voxelizer.voxelizers.as_mut_slice(),
        )
        else {
            return Ok(None);
        };
        let also = |frame: &mut Frame, dynamic: &DynamicVoxels, voxels: &Voxels| {
            nodes.count_tiles(frame, &touched_voxels(voxels, dynamic))
        };
        let updated = match dynamic.update(gpu, scene, voxelizer, voxels, Some(&also)) {
            Err(Error::TooLarge { .. }) => return Ok(None),
            updated => updated?,
        };
        match light.follow(gpu, scene, voxels, dynamic.slots(voxels).start) {
            Err(Error::TooLarge { .. }) => return Ok(None),
            followed => followed?,
        }
        self.radiance = Arc::clone(&light.radiance);
        *records = VoxelRecords::from(&*voxels);
        self.voxel_count = voxels.voxel_count - voxels.hidden_count;
        self.fragment_count = voxels.fragment_count;
        require_pointers("voxel.records", u64::from(voxels.voxel_count))?;
        Ok(Some(updated))
    }

    /// The voxels, and the blocks that dynamic geometry touches; `None` if it has no voxels of its
    /// own.
    pub fn touched(&self) -> Option<TouchedVoxels<'_>> {
        let (voxels, dynamic) = self.pieces.first()?.dynamic.as_ref()?;
        Some(touched_voxels(voxels, dynamic))
    }

    /// Adds the passes that light the voxels, which are found in the octree of these nodes.
    pub fn update<'l>(
        &self,
        frame: &mut Frame,
        lights: impl Into<LightInputs<'l>>,
        nodes: &Arc<Buffer>,
    ) {
        let lights = lights.into();
        if self
            .pieces
            .iter()
            .any(|Piece { voxels, light, .. }| light.is_part(voxels))
        {
            bound_tiles(frame, lights.maps);
        }
        self.add_light(frame, |frame, Piece { voxels, light, .. }, first_voxel| {
            light.update_records(
                frame,
                voxels,
                VoxelLookup {
                    pass: &INJECT_RSM,
                    bound: &[("nodes", nodes)],
                    grid: self.grid,
                    first: ((voxels.grid.origin - self.grid.origin) / self.grid.voxel_size)
                        .round()
                        .as_ivec3(),
                    first_voxel,
                },
                lights,
                None,
            );
        });
    }

    /// Adds the passes that light the voxels once more in the same frame, with what they gathered.
    pub fn relight<'l>(
        &self,
        frame: &mut Frame,
        lights: impl Into<LightInputs<'l>>,
        viewer: Viewer,
    ) {
        let lights = lights.into();
        self.add_light(frame, |frame, Piece { voxels, light, .. }, _| {
            light.relight(frame, voxels, lights, None, viewer)
        });
    }

    /// Adds the passes by which the voxels gather.
    pub fn bounce(
        &self,
        frame: &mut Frame,
        gatherer: &Gatherer,
        through: (Option<Volume<'_>>, Option<&Space<'_>>),
    ) {
        for Piece { voxels, light, .. } in &self.pieces {
            if let Some(irradiance) = &light.irradiance {
                gatherer.bounce(frame, voxels, through, irradiance);
            }
        }
    }

    /// What rays read of all voxels, and the words of each: the records where the grid is in one
    /// piece, and otherwise what [`Pieces::pack`] has made of them. `None` where it has not.
    pub fn surfaces(&self) -> Option<(&Arc<Buffer>, u32)> {
        match self.pieces.as_slice() {
            [whole] => Some((&whole.voxels.records, RECORD_WORDS)),
            _ => Some((self.packed.as_ref()?, (SURFACE_BYTES / 4) as u32)),
        }
    }

    /// Packs what rays read of the voxels, where these are in several pieces, and makes room for
    /// their light.
    pub fn pack(&mut self, gpu: &Gpu) -> Result<FrameStats, Error> {
        if self.pieces.len() == 1 {
            return Ok(FrameStats::default());
        }
        let bytes = SURFACE_BYTES * u64::from(self.voxel_count);
        let packed = buffer(gpu, "svo.surfaces", bytes)?;
        let mut frame = Frame::new();
        for range in self.records() {
            let records = (&range.records, range.voxel_count);
            pack_surfaces(&mut frame, records, &packed, range.first_voxel);
        }
        self.packed = Some(packed);
        if !self.has_bricks {
            let radiances = self.pieces.iter().map(Piece::radiance_count).sum();
            self.radiance_texels = Some(radiance_texels(gpu, radiances)?);
        }
        gpu.submit(frame)
    }

    /// Adds passes of each piece, given its first voxel, and puts the radiances together.
    fn add_light(&self, frame: &mut Frame, add: impl Fn(&mut Frame, &Piece, u32)) {
        let (mut first_voxel, mut first) = (0, 0);
        for piece in &self.pieces {
            add(frame, piece, first_voxel);
            let Piece { voxels, light, .. } = piece;
            let count = piece.radiance_count();
            if let Some(texels) = &self.radiance_texels {
                frame
                    .pass(&MERGE_RADIANCE)
                    .bind("piece_radiance", &light.radiance)
                    .bind("radiance_texels", texels)
                    .push(&MergeParams { first, count })
                    .dispatch(linear_groups(count));
            } else if self.pieces.len() > 1 && count > 0 {
                frame.copy_buffer(
                    "svo.merge_radiance",
                    (&light.radiance, 0),
                    (&self.radiance, light.settings.radiance_bytes(first_voxel)),
                    light.settings.radiance_bytes(voxels.voxel_count),
                );
            }
            first_voxel += voxels.voxel_count;
            first += count;
        }
    }

    /// The records of all voxels.
    pub fn records(&self) -> Vec<RecordRange> {
        let mut first_voxel = 0;
        let range = |Piece { voxels, .. }: &Piece| {
            let range = RecordRange {
                first_voxel,
                voxel_count: voxels.voxel_count,
                records: Arc::clone(&voxels.records),
                emission: voxels.emission.clone(),
            };
            first_voxel += voxels.voxel_count;
            range
        };
        self.pieces.iter().map(range).collect()
    }

    /// The voxels of each piece and their light.
    pub fn lit(&mut self) -> impl Iterator<Item = LitVoxels<'_>> {
        self.pieces
            .iter_mut()
            .map(|Piece { voxels, light, .. }| LitVoxels {
                voxels: voxels.clone(),
                light,
            })
    }

    /// Counts of fragments, voxels, pieces and light, for the report.
    pub fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let mut counts = vec![
            ("fragments", u64::from(self.fragment_count)),
            ("voxels", u64::from(self.voxel_count)),
            ("pieces", self.pieces.len() as u64),
        ];
        for piece in &self.pieces {
            counts.extend(
                piece
                    .dynamic
                    .as_ref()
                    .map(|(_, dynamic)| ("dynamic_voxels", u64::from(dynamic.voxel_count))),
            );
            add_counts(&mut counts, piece.light.counts(gpu)?);
        }
        Ok(counts)
    }
}
