//! One-pass voxelization: triangles to fragments, fragments to voxels.

mod expected;
mod fragments;
mod index;
mod interior;
pub mod list;
pub mod passes;
mod resolve;
pub mod settings;

use std::sync::Arc;
use std::time::Instant;

use glam::{IVec3, UVec3, Vec3};

use crate::gi::shared::voxel::build::passes::{Fragment, Voxel};
use crate::gi::shared::voxel::build::settings::{Accumulation, Method, Surface, VoxelSettings};
use crate::gi::shared::voxel::{Lattice, VoxelBox, VoxelGrid};
use crate::graph::{
    Buffer, BufferDesc, BufferUsage, Error, Frame, FrameStats, Gpu, Image, ImageDesc, ImageKind,
    ImageUsage, Owner, vk,
};
use crate::render::GpuScene;
use crate::scene::Batch;
use crate::vulkan::IMAGE_ATOMICS;

use self::expected::room_for_fragments;
pub use self::index::FilledBlocks;
pub(super) use self::index::{GridBuffers, add_index};
pub use self::interior::Interior;
use self::interior::columns_buffer;

/// The occupied voxels of a scene.
#[derive(Clone)]
pub struct Voxels {
    /// Where they are.
    pub grid: VoxelGrid,
    /// What that is a part of.
    pub lattice: Lattice,
    /// One bit a voxel.
    pub occupancy: Arc<Buffer>,
    /// Compact index of each block's first voxel.
    pub block_bases: Arc<Buffer>,
    /// One [`Voxel`] each, in compact order.
    pub records: Arc<Buffer>,
    /// Mean emitted radiance (W/(m² sr)) and the share of it that leaves the front, 16 bytes each;
    /// only in an emissive scene.
    pub emission: Option<Arc<Buffer>>,
    /// Opacities of the faces +x, +y, +z and −x, −y, −z, 3×10 bits each; only of directional
    /// voxels.
    pub faces: Option<Arc<Buffer>>,
    /// Records: one an occupied voxel; with dynamic geometry also one each of the voxels in
    /// `hidden_count`.
    pub voxel_count: u32,
    /// Static voxels whose record stands back for one of dynamic geometry, which has the voxel's
    /// compact index.
    pub hidden_count: u32,
    /// Triangle–voxel pairs.
    pub fragment_count: u32,
    /// There may be records of dynamic geometry.
    pub is_dynamic: bool,
    /// The blocks that had voxels when they were built, where a list was asked for.
    pub filled: Option<FilledBlocks>,
}

impl Voxels {
    /// Voxels that there is room for.
    pub fn capacity(&self) -> u32 {
        (self.records.size_bytes() / size_of::<Voxel>() as u64) as u32
    }
}

/// Fragments, and the first of each voxel's list.
pub(super) struct FragmentLists {
    pub(super) fragments: Arc<Buffer>,
    pub(super) emission: Arc<Buffer>,
    pub(super) heads: Arc<Buffer>,
    /// Voxels with opposed surfaces, of those that are resolved at once.
    pub(super) opposed: Arc<Buffer>,
    /// Workgroups for them along three axes, and their number.
    pub(super) opposed_count: Arc<Buffer>,
}

impl FragmentLists {
    /// Of no voxels, over such buffers.
    pub(super) fn new(
        gpu: &Gpu,
        [fragments, emission]: [Arc<Buffer>; 2],
        voxel_capacity: u64,
    ) -> Result<Self, Error> {
        Ok(FragmentLists {
            fragments,
            emission,
            heads: buffer(gpu, "voxel.heads", 4 * voxel_capacity)?,
            opposed: buffer(gpu, "voxel.opposed", 4 * voxel_capacity)?,
            opposed_count: buffer(gpu, "voxel.opposed_count", 16)?,
        })
    }
}

/// Which triangles are voxelized.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Triangles {
    All,
    Static,
    Dynamic,
}

impl Triangles {
    pub(super) fn batches(self, scene: &GpuScene) -> Vec<Batch> {
        let has = |batch: &&Batch| {
            self == Triangles::All
                || scene.is_dynamic(batch.material) == (self == Triangles::Dynamic)
        };
        scene.batches.iter().filter(has).copied().collect()
    }
}

/// Voxelizes a scene; keeps what it learnt about sizes for the next time.
pub struct Voxelizer {
    settings: VoxelSettings,
    whole_origin: Vec3,
    first_voxel: IVec3,
    /// Grains of a voxel that positions are rounded to; 0: they are not.
    grains: f32,
    /// The piece of the whole grid.
    grid: VoxelGrid,
    /// Absent before the first run and after [`Voxelizer::release`].
    buffers: Option<GridBuffers>,
    /// Bound where a pass is compiled for something that this scene or these settings do not have.
    nothing: Arc<Buffer>,
    no_image: Arc<Image>,
    fragment_capacity: u32,
    /// Fragments and records that dynamic geometry has needed so far.
    pub(super) dynamic_room: [u32; 2],
    /// What says what is inside of bodies; only of solid voxels.
    interior: Option<Arc<Interior>>,
    /// Where it keeps that; absent before the first run and after [`Voxelizer::release`].
    columns: Option<Arc<Buffer>>,
    /// Workgroups that share the same triangles, at least.
    sharing: u32,
    /// Whether blocks with voxels are listed.
    pub lists_blocks: bool,
}

impl Voxelizer {
    /// In a grid around the scene.
    pub fn new(gpu: &Gpu, scene: &GpuScene, settings: VoxelSettings) -> Result<Self, Error> {
        require(gpu, &settings)?;
        let grid = VoxelGrid::around(scene.bounds, settings.resolution);
        let interior = match settings.surface {
            Surface::Solid => Some(Interior::new(gpu, scene)?),
            Surface::Conservative | Surface::Thin => None,
        };
        Ok(Voxelizer {
            interior,
            columns: None,
            settings,
            whole_origin: grid.origin,
            first_voxel: IVec3::ZERO,
            grains: 0.0,
            grid,
            buffers: None,
            nothing: buffer(gpu, "voxel.nothing", 0)?,
            no_image: average_image(gpu, 1)?,
            fragment_capacity: 0,
            dynamic_room: [0; 2],
            sharing: 1,
            lists_blocks: false,
        })
    }

    /// One for each piece of this one's grid, `along` of them along an axis, x fastest. Each leaves
    /// out what lies outside of its piece; positions are rounded as in the whole grid.
    pub fn cut(&self, along: u32) -> Vec<Self> {
        let resolution = self.grid.resolution / along;
        let piece = |index: u32| {
            let first_voxel = (resolution
                * UVec3::new(
                    index % along,
                    index / along % along,
                    index / (along * along),
                ))
            .as_ivec3();
            let grid = VoxelGrid {
                origin: self.grid.origin + self.grid.voxel_size * first_voxel.as_vec3(),
                resolution,
                ..self.grid
            };
            let (nothing, no_image) = (Arc::clone(&self.nothing), Arc::clone(&self.no_image));
            Voxelizer {
                first_voxel,
                grid,
                buffers: None,
                nothing,
                no_image,
                interior: self.interior.clone(),
                columns: None,
                ..*self
            }
        };
        (0..along.pow(3)).map(piece).collect()
    }

    /// Runs an attempt at all pieces of the grid, which may be one. What is too large to bind is
    /// tried again in smaller pieces.
    pub fn run_in_pieces<T>(
        &self,
        pieces: &mut Vec<Self>,
        mut attempt: impl FnMut(&mut [Self]) -> Result<T, Error>,
    ) -> Result<T, Error> {
        loop {
            match attempt(pieces) {
                Err(Error::TooLarge { .. }) if pieces[0].grid.resolution > SMALLEST_PIECE => {
                    let next = (pieces[0].grid.resolution / 2).min(LARGEST_PIECE);
                    *pieces = self.cut(self.grid.resolution / next);
                }
                result => return result,
            }
        }
    }

    /// Smallest corner of the piece in the whole grid (voxels).
    pub fn first_voxel(&self) -> UVec3 {
        self.first_voxel.as_uvec3()
    }

    /// For a window of an unbounded grid, with this many grains a voxel.
    pub(super) fn of_window(
        gpu: &Gpu,
        settings: VoxelSettings,
        grid: VoxelGrid,
        (grains, interior): (f32, Option<Arc<Interior>>),
    ) -> Result<Self, Error> {
        require(gpu, &settings)?;
        let columns = (interior.as_ref())
            .map(|_| columns_buffer(gpu, grid.resolution))
            .transpose()?;
        Ok(Voxelizer {
            interior,
            columns,
            settings,
            whole_origin: grid.origin,
            first_voxel: IVec3::ZERO,
            grains,
            grid,
            buffers: None,
            nothing: buffer(gpu, "voxel.nothing", 0)?,
            no_image: average_image(gpu, 1)?,
            fragment_capacity: 0,
            dynamic_room: [0; 2],
            sharing: 1,
            lists_blocks: false,
        })
    }

    /// Moves the window to where it begins at a voxel of the grid that has a corner at `anchor`.
    pub(super) fn move_to(&mut self, anchor: Vec3, first: IVec3) {
        self.first_voxel = first;
        self.grid.origin = anchor + self.grid.voxel_size * first.as_vec3();
    }

    /// Voxelizes all triangles, static and dynamic alike. The first time, the host works out for
    /// how many fragments their buffer needs room; from then on that is known. A buffer that proves
    /// too small is made larger and the pass is repeated. It is also repeated where a driver ended
    /// threads that had too much to do. The cost of all this is separate, in
    /// [`FrameStats::counting`].
    pub fn run(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<(Voxels, FrameStats), Error> {
        let (voxels, _, stats) = self.voxelize(gpu, scene, Triangles::All)?;
        Ok((voxels, stats))
    }

    pub(super) fn voxelize(
        &mut self,
        gpu: &Gpu,
        scene: &GpuScene,
        which: Triangles,
    ) -> Result<(Voxels, FragmentLists, FrameStats), Error> {
        let grid_buffers = match self.buffers.take() {
            Some(buffers) => buffers,
            None if self.lists_blocks => GridBuffers::listing(gpu, self.grid)?,
            None => GridBuffers::new(gpu, self.grid)?,
        };
        self.buffers = Some(grid_buffers.clone());
        if self.interior.is_some() && self.columns.is_none() {
            self.columns = Some(columns_buffer(gpu, self.grid.resolution)?);
        }
        let mut stats = FrameStats::default();
        let batches = which.batches(scene);
        let is_first = self.fragment_capacity == 0;
        if is_first {
            let began = Instant::now();
            let (clip, surface) = (self.whole(), self.settings.surface);
            let room = room_for_fragments(&scene.host, &batches, self.grid, clip, surface);
            self.fragment_capacity = room.min(most_fragments(gpu));
            stats.append(FrameStats::of_host(EXPECT_FRAGMENTS, began).into_counting());
        }
        let [fragment_room, _] = if which == Triangles::Static {
            self.dynamic_room
        } else {
            [0; 2]
        };
        loop {
            let capacity = u64::from(self.fragment_capacity) + u64::from(fragment_room);
            let fragments = buffer(
                gpu,
                "voxel.fragments",
                size_of::<Fragment>() as u64 * capacity,
            )?;
            let emission = buffer(
                gpu,
                "voxel.fragment_emission",
                if scene.is_emissive { 8 * capacity } else { 0 },
            )?;
            let mut frame = Frame::new();
            frame.set_scene(&scene.set, &scene.materials);
            frame.fill("voxel.clear", &grid_buffers.occupancy, 0);
            frame.fill("voxel.clear", &grid_buffers.counters, 0);
            let buffers = [
                &grid_buffers.occupancy,
                &fragments,
                &emission,
                &grid_buffers.counters,
            ];
            self.add_fragments(
                &mut frame,
                scene,
                &batches,
                self.whole(),
                buffers,
                self.fragment_capacity,
            );
            if which != Triangles::Dynamic {
                let capacity = self.fragment_capacity;
                self.add_interior(&mut frame, scene, self.whole(), buffers, capacity);
            }
            add_index(&mut frame, self.grid, &grid_buffers);
            let (run, counts) = gpu.submit_and_read(frame, &grid_buffers.counters)?;
            let counts: Vec<u32> = bytemuck::pod_collect_to_vec(&counts);
            let (fragment_count, voxel_count, unfinished_count) = (counts[0], counts[1], counts[2]);
            if self.shares_more(unfinished_count)? {
                stats.append(run.into_counting());
                continue;
            }
            if fragment_count > self.fragment_capacity {
                self.fragment_capacity = fragment_count;
                stats.append(run.into_counting());
                continue;
            }
            let (mut voxels, lists, resolved) = self.resolve(
                gpu,
                scene,
                which,
                &grid_buffers,
                [fragments, emission],
                [fragment_count, voxel_count],
            )?;
            voxels.filled = grid_buffers.filled(counts[3]);
            if is_first {
                self.fragment_capacity = fragment_count;
            }
            stats.append(run);
            stats.append(resolved);
            return Ok((voxels, lists, stats));
        }
    }

    /// Frees what depends on the grid alone, until the next run.
    pub fn release(&mut self) {
        (self.buffers, self.columns) = (None, None);
    }

    /// Whether the pass has to be run again, because the driver ended some of its threads. The next
    /// run shares the work among more workgroups.
    pub(super) fn shares_more(&mut self, unfinished_count: u32) -> Result<bool, Error> {
        if unfinished_count > 0 && self.sharing >= MOST_SHARING {
            return Err(Error::Unfinished {
                pass: "voxel.fragments",
                thread_count: unfinished_count,
            });
        }
        self.sharing *= if unfinished_count > 0 { 4 } else { 1 };
        Ok(unfinished_count > 0)
    }

    /// All voxels of the grid.
    pub(super) fn whole(&self) -> VoxelBox {
        VoxelBox::cube(IVec3::ZERO, self.grid.resolution)
    }
}

fn require(gpu: &Gpu, settings: &VoxelSettings) -> Result<(), Error> {
    let features = gpu.features();
    let missing = |what: &str, feature| {
        Err(Error::FeatureMissing {
            what: what.into(),
            feature,
        })
    };
    match settings.method {
        _ if settings.accumulation == Accumulation::RunningAverage && !features.image_atomics => {
            missing(
                "accumulation=running-average (exact does without)",
                IMAGE_ATOMICS,
            )
        }
        Method::Raster if !features.geometry_shader => missing(
            "voxelization=raster (compute does without)",
            "geometryShader",
        ),
        // For the number of the triangle in the fragment shader.
        Method::RasterHw if !features.geometry_shader => missing(
            "voxelization=raster-hw (compute does without)",
            "geometryShader",
        ),
        Method::RasterHw if !features.conservative_rasterization => missing(
            "voxelization=raster-hw (raster and compute do without)",
            "VK_EXT_conservative_rasterization",
        ),
        _ => Ok(()),
    }
}

/// What the host does before the first build, by name.
const EXPECT_FRAGMENTS: &str = "voxel.expect_fragments";

/// Fragments that a buffer can hold.
fn most_fragments(gpu: &Gpu) -> u32 {
    let most = gpu.limits().storage_buffer_bytes / size_of::<Fragment>() as u64;
    most.try_into().unwrap_or(u32::MAX)
}

/// Where a grid is in pieces, none is smaller along an edge (voxels).
const SMALLEST_PIECE: u32 = 64;

/// And none is larger, so that much of a nearly empty grid is in pieces that are empty and need not
/// be kept.
const LARGEST_PIECE: u32 = 512;

/// A storage buffer of at least 16 bytes.
pub(crate) fn buffer(gpu: &Gpu, name: &str, size_bytes: u64) -> Result<Arc<Buffer>, Error> {
    gpu.create_buffer(&BufferDesc {
        name: name.into(),
        size_bytes: size_bytes.max(16),
        usage: BufferUsage::Storage,
        owner: Owner::Store,
    })
}

fn average_image(gpu: &Gpu, resolution: u32) -> Result<Arc<Image>, Error> {
    gpu.create_image(&ImageDesc {
        name: "voxel.averages".into(),
        extent: [resolution; 3],
        kind: ImageKind::D3,
        format: vk::Format::R32_UINT,
        mips: 1,
        layers: 1,
        usage: ImageUsage::STORAGE,
        owner: Owner::Store,
    })
}

/// Most workgroups that share the same triangles: at the highest resolution, each thread then has a
/// few tiles of 64 full-sized triangles.
const MOST_SHARING: u32 = 1 << 14;
