//! One-pass voxelization: triangles to fragments, fragments to voxels.

pub mod list;
pub mod passes;
pub mod settings;

use std::ops::Range;
use std::sync::Arc;

use glam::{IVec3, UVec3, Vec3};

use crate::gi::shared::voxel::build::passes::{
    COUNT_BLOCKS, CountParams, FRAGMENTS_COMPUTE, FRAGMENTS_RASTER, FRAGMENTS_RASTER_HW, Fragment,
    FragmentParams, INDEX_BLOCKS, LINK_FRAGMENTS, LinkParams, RESOLVE_VOXELS, RUNNING_AVERAGE,
    ResolveParams, SCAN_GROUPS, ScanParams, Voxel,
};
use crate::gi::shared::voxel::build::settings::{Accumulation, Method, Surface, VoxelSettings};
use crate::gi::shared::voxel::{Lattice, VoxelBox, VoxelGrid};
use crate::graph::compute::linear_groups;
use crate::graph::{
    BatchDispatch, Buffer, BufferDesc, BufferUsage, DrawBatch, Error, Frame, FrameStats, Gpu,
    Image, ImageDesc, ImageKind, ImageUsage, Owner, Targets, vk,
};
use crate::render::{GpuScene, TextureUse};
use crate::scene::Batch;

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

/// What depends on the grid alone.
#[derive(Clone)]
pub(super) struct GridBuffers {
    pub(super) occupancy: Arc<Buffer>,
    pub(super) block_bases: Arc<Buffer>,
    group_sums: Arc<Buffer>,
    pub(super) counters: Arc<Buffer>,
}

impl GridBuffers {
    pub(super) fn new(gpu: &Gpu, grid: VoxelGrid) -> Result<Self, Error> {
        let blocks = u64::from(grid.block_count());
        Ok(GridBuffers {
            occupancy: buffer(gpu, "voxel.occupancy", 8 * blocks)?,
            block_bases: buffer(gpu, "voxel.block_bases", 4 * blocks)?,
            group_sums: buffer(gpu, "voxel.group_sums", 4 * blocks.div_ceil(1024))?,
            counters: buffer(gpu, "voxel.counters", 12)?,
        })
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
    /// Workgroups that share the same triangles, at least.
    sharing: u32,
}

impl Voxelizer {
    /// In a grid around the scene.
    pub fn new(gpu: &Gpu, scene: &GpuScene, settings: VoxelSettings) -> Result<Self, Error> {
        require(gpu, settings.method)?;
        let grid = VoxelGrid::around(scene.bounds, settings.resolution);
        Ok(Voxelizer {
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
        grains: f32,
    ) -> Result<Self, Error> {
        require(gpu, settings.method)?;
        Ok(Voxelizer {
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
        })
    }

    /// Moves the window to where it begins at a voxel of the grid that has a corner at `anchor`.
    pub(super) fn move_to(&mut self, anchor: Vec3, first: IVec3) {
        self.first_voxel = first;
        self.grid.origin = anchor + self.grid.voxel_size * first.as_vec3();
    }

    /// Voxelizes all triangles, static and dynamic alike. The first time, fragments are counted
    /// before they are stored, so that their buffer is exact. Later, a buffer that proves too small
    /// is made larger and the pass is repeated. It is also repeated where a driver ended threads
    /// that had too much to do. The cost of the repeated runs is separate, in
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
            None => GridBuffers::new(gpu, self.grid)?,
        };
        self.buffers = Some(grid_buffers.clone());
        let mut stats = FrameStats::default();
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
                &which.batches(scene),
                self.whole(),
                buffers,
                self.fragment_capacity,
            );
            add_index(&mut frame, self.grid, &grid_buffers);
            let run = gpu.submit(frame)?;
            let counts: Vec<u32> =
                bytemuck::pod_collect_to_vec(&gpu.read_buffer(&grid_buffers.counters)?);
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
            let (voxels, lists, resolved) = self.resolve(
                gpu,
                scene,
                which,
                &grid_buffers,
                [fragments, emission],
                [fragment_count, voxel_count],
            )?;
            stats.append(run);
            stats.append(resolved);
            return Ok((voxels, lists, stats));
        }
    }

    /// Frees what depends on the grid alone, until the next run.
    pub fn release(&mut self) {
        self.buffers = None;
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

    /// Fragments of some triangles in some voxels of the grid into `[occupancy, fragments,
    /// emission, counters]`, those beyond `capacity` counted only.
    pub(super) fn add_fragments(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        batches: &[Batch],
        clip: VoxelBox,
        [occupancy, fragments, emission, counters]: [&Arc<Buffer>; 4],
        capacity: u32,
    ) {
        // For a part of the grid, the batches are short runs of triangles.
        let alike = if clip == self.whole() {
            1
        } else {
            batches
                .iter()
                .map(|batch| batch.triangle_count.div_ceil(64))
                .sum()
        };
        let [clip_x, clip_y, clip_z] =
            (clip.low.as_uvec3() | (clip.end - 1).as_uvec3() << 16u32).to_array();
        let params = |batch: &Batch| FragmentParams {
            origin_inverse_size: self
                .whole_origin
                .extend(1.0 / self.grid.voxel_size)
                .to_array(),
            first_voxel: self.first_voxel.as_vec3().extend(self.grains).to_array(),
            resolution: self.grid.resolution,
            first_triangle: batch.first_triangle,
            triangle_count: batch.triangle_count,
            material: batch.material,
            capacity,
            emission_unit: scene.largest_emission.max(f32::MIN_POSITIVE),
            clip_x,
            clip_y,
            clip_z,
        };
        // A material pays for the textures that it has: one variant for each kind.
        for kind in [TextureUse::None, TextureUse::Textured, TextureUse::Masked] {
            let is_of = |batch: &&Batch| scene.texture_use[batch.material as usize] == kind;
            let batches: Vec<_> = batches.iter().filter(is_of).collect();
            if batches.is_empty() {
                continue;
            }
            let pass = match self.settings.method {
                Method::Compute => &FRAGMENTS_COMPUTE,
                Method::Raster => &FRAGMENTS_RASTER,
                Method::RasterHw => &FRAGMENTS_RASTER_HW,
            };
            let builder = frame
                .pass(pass)
                .bind("occupancy", occupancy)
                .bind("fragments", fragments)
                .bind("fragment_emission", emission)
                .bind("fragment_count", counters)
                .constant("EMISSIVE", scene.is_emissive)
                .constant("MASKED", kind == TextureUse::Masked)
                .constant("TEXTURED", kind != TextureUse::None)
                .constant("THIN", self.settings.surface == Surface::Thin);
            if self.settings.method == Method::Compute {
                let dispatch = |batch: &&Batch| BatchDispatch {
                    material: batch.material,
                    push: bytemuck::bytes_of(&params(batch)).to_vec(),
                    groups: self.triangle_groups(batch.triangle_count, alike),
                };
                builder.dispatch_batches(batches.iter().map(dispatch).collect());
            } else {
                let draw = |batch: &&Batch| DrawBatch {
                    material: batch.material,
                    push: bytemuck::bytes_of(&params(batch)).to_vec(),
                    first_vertex: 0,
                    vertex_count: 3 * batch.triangle_count,
                    ..Default::default()
                };
                builder.draw(
                    Targets::none([self.grid.resolution; 2]),
                    batches.iter().map(draw).collect(),
                );
            }
        }
    }

    /// Workgroups of 64 triangles, and how many share the columns of the same triangles where there
    /// are few: of the batch, or of many small ones `alike`.
    fn triangle_groups(&self, triangle_count: u32, alike: u32) -> [u32; 3] {
        let groups = triangle_count.div_ceil(64);
        let sharing = (64 / groups.max(alike)).clamp(1, self.grid.resolution.pow(2).div_ceil(256));
        [groups, sharing.max(self.sharing), 1]
    }

    fn resolve(
        &self,
        gpu: &Gpu,
        scene: &GpuScene,
        which: Triangles,
        GridBuffers {
            occupancy,
            block_bases,
            ..
        }: &GridBuffers,
        [fragments, emission]: [Arc<Buffer>; 2],
        [fragment_count, voxel_count]: [u32; 2],
    ) -> Result<(Voxels, FragmentLists, FrameStats), Error> {
        let is_dynamic = which == Triangles::Static;
        let capacity = u64::from(voxel_count)
            + if is_dynamic {
                u64::from(self.dynamic_room[1])
            } else {
                0
            };
        let heads = buffer(gpu, "voxel.heads", 4 * capacity)?;
        let records = buffer(gpu, "voxel.records", size_of::<Voxel>() as u64 * capacity)?;
        let voxel_emission = scene
            .is_emissive
            .then(|| buffer(gpu, "voxel.emission", 16 * capacity))
            .transpose()?;
        let faces = self
            .settings
            .faces
            .map(|_| buffer(gpu, "voxel.faces", 8 * capacity))
            .transpose()?;
        let running = self.settings.accumulation == Accumulation::RunningAverage;
        let averages = if running {
            average_image(gpu, self.grid.resolution)?
        } else {
            Arc::clone(&self.no_image)
        };
        let mut frame = Frame::new();
        frame.fill("voxel.clear", &heads, 0);
        if running {
            let link = LinkParams {
                resolution: self.grid.resolution,
                fragment_count,
                first_fragment: 0,
            };
            frame.clear_image("voxel.clear", &averages, 0);
            frame
                .pass(&RUNNING_AVERAGE)
                .bind("fragments", &fragments)
                .bind("averages", &averages)
                .push(&link)
                .dispatch(linear_groups(fragment_count));
        }
        let (occupancy, block_bases) = (Arc::clone(occupancy), Arc::clone(block_bases));
        let lists = FragmentLists {
            fragments,
            emission,
            heads,
        };
        let (grid, lattice, emission, hidden_count) =
            (self.grid, self.grid.lattice(), voxel_emission, 0);
        let voxels = Voxels {
            grid,
            lattice,
            occupancy,
            block_bases,
            records,
            emission,
            faces,
            voxel_count,
            hidden_count,
            fragment_count,
            is_dynamic,
        };
        self.add_resolve(
            &mut frame,
            scene,
            &voxels,
            &lists,
            &averages,
            [0..fragment_count, 0..voxel_count],
        );
        let stats = gpu.submit(frame)?;
        Ok((voxels, lists, stats))
    }

    /// A range of fragments into lists, and a range of voxels from their lists to records.
    fn add_resolve(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        voxels: &Voxels,
        lists: &FragmentLists,
        averages: &Arc<Image>,
        [fragments, slots]: [Range<u32>; 2],
    ) {
        let running = self.settings.accumulation == Accumulation::RunningAverage;
        let (fragment_count, voxel_count) = (fragments.len() as u32, slots.len() as u32);
        frame
            .pass(&LINK_FRAGMENTS)
            .bind("occupancy", &voxels.occupancy)
            .bind("block_bases", &voxels.block_bases)
            .bind("fragments", &lists.fragments)
            .bind("heads", &lists.heads)
            .push(&LinkParams {
                resolution: self.grid.resolution,
                fragment_count,
                first_fragment: fragments.start,
            })
            .dispatch(linear_groups(fragment_count));
        frame
            .pass(&RESOLVE_VOXELS)
            .bind("fragments", &lists.fragments)
            .bind("fragment_emission", &lists.emission)
            .bind("heads", &lists.heads)
            .bind("voxels", &voxels.records)
            .bind(
                "voxel_emission",
                voxels.emission.as_ref().unwrap_or(&self.nothing),
            )
            .bind("averages", averages)
            .bind(
                "voxel_faces",
                voxels.faces.as_ref().unwrap_or(&self.nothing),
            )
            .constant("EMISSIVE", scene.is_emissive)
            .constant("COVERAGE", self.settings.coverage)
            .constant("RUNNING", running)
            .constant("FACES", self.settings.faces.map_or(0, |faces| faces as u32))
            .push(&ResolveParams {
                voxel_count,
                emission_unit: scene.largest_emission.max(f32::MIN_POSITIVE),
                first_voxel: slots.start,
            })
            .dispatch(linear_groups(voxel_count));
    }

    /// The same for dynamic geometry.
    pub(super) fn add_dynamic_resolve(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        voxels: &Voxels,
        lists: &FragmentLists,
        ranges: [Range<u32>; 2],
    ) {
        self.add_resolve(frame, scene, voxels, lists, &self.no_image, ranges);
    }
}

/// Compact indices from occupancy.
pub(super) fn add_index(
    frame: &mut Frame,
    grid: VoxelGrid,
    GridBuffers {
        occupancy,
        block_bases,
        group_sums,
        counters,
    }: &GridBuffers,
) {
    let block_count = grid.block_count();
    let (groups, group_count) = (
        linear_groups(block_count.div_ceil(16)),
        block_count.div_ceil(1024),
    );
    let params = CountParams { block_count };
    frame
        .pass(&COUNT_BLOCKS)
        .bind("occupancy", occupancy)
        .bind("group_sums", group_sums)
        .push(&params)
        .dispatch(groups);
    frame
        .pass(&SCAN_GROUPS)
        .bind("group_sums", group_sums)
        .bind("voxel_count", counters)
        .push(&ScanParams { group_count })
        .dispatch([1, 1, 1]);
    frame
        .pass(&INDEX_BLOCKS)
        .bind("occupancy", occupancy)
        .bind("group_sums", group_sums)
        .bind("block_bases", block_bases)
        .push(&params)
        .dispatch(groups);
}

fn require(gpu: &Gpu, method: Method) -> Result<(), Error> {
    let features = gpu.features();
    let missing = |what: &str, feature| {
        Err(Error::FeatureMissing {
            what: what.into(),
            feature,
        })
    };
    match method {
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
