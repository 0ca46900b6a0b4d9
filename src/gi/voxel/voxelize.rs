//! One-pass voxelization: triangles to fragments, fragments to voxels.

use std::sync::Arc;

use glam::{UVec3, Vec3};

use super::VoxelGrid;
use super::passes::{
    COUNT_BLOCKS, CountParams, FRAGMENTS_COMPUTE, FRAGMENTS_RASTER, FRAGMENTS_RASTER_HW, Fragment, FragmentParams, INDEX_BLOCKS, LINK_FRAGMENTS, LinkParams,
    RESOLVE_VOXELS, RUNNING_AVERAGE, ResolveParams, SCAN_GROUPS, ScanParams, Voxel,
};
use crate::gi::Settings;
use crate::graph::{
    BatchDispatch, Buffer, BufferDesc, BufferUsage, DrawBatch, Error, Frame, FrameStats, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Targets, vk,
};
use crate::render::{GpuScene, TextureUse};

/// How triangles become fragments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// A compute shader.
    Compute,
    /// Rasterization with triangles enlarged by the geometry shader.
    Raster,
    /// Rasterization with hardware conservative rasterization.
    RasterHw,
}

/// How the albedo of a voxel is averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Accumulation {
    /// Integer sums: independent of thread order.
    Exact,
    /// Compare-and-swap moving average: depends on thread order.
    RunningAverage,
}

/// What to voxelize into, and how.
#[derive(Clone, Copy, Debug)]
pub struct VoxelSettings {
    /// Voxels along an edge.
    pub resolution: u32,
    /// How triangles become fragments.
    pub method: Method,
    /// How albedo is averaged.
    pub accumulation: Accumulation,
    /// Opacity is the covered fraction of the voxel's face, not 1.
    pub coverage: bool,
}

impl VoxelSettings {
    /// From a technique's settings.
    pub fn new(settings: &Settings) -> Self {
        let method = if settings.is("voxelization", "compute") {
            Method::Compute
        } else if settings.is("voxelization", "raster") {
            Method::Raster
        } else {
            Method::RasterHw
        };
        VoxelSettings {
            resolution: settings.count("resolution"),
            method,
            accumulation: if settings.is("accumulation", "exact") { Accumulation::Exact } else { Accumulation::RunningAverage },
            coverage: settings.is("opacity", "coverage"),
        }
    }
}

/// The occupied voxels of a scene.
pub struct Voxels {
    /// Where they are.
    pub grid: VoxelGrid,
    /// One bit a voxel.
    pub occupancy: Arc<Buffer>,
    /// Compact index of each block's first voxel.
    pub block_bases: Arc<Buffer>,
    /// One [`Voxel`] each, in compact order.
    pub records: Arc<Buffer>,
    /// Mean emitted radiance (W/(m² sr)) and the share of it that leaves the front, 16 bytes each; only in an emissive scene.
    pub emission: Option<Arc<Buffer>>,
    /// Occupied voxels.
    pub voxel_count: u32,
    /// Triangle–voxel pairs.
    pub fragment_count: u32,
}

/// What depends on the grid alone.
#[derive(Clone)]
struct GridBuffers {
    occupancy: Arc<Buffer>,
    block_bases: Arc<Buffer>,
    group_sums: Arc<Buffer>,
    counters: Arc<Buffer>,
}

impl GridBuffers {
    fn new(gpu: &Gpu, grid: VoxelGrid) -> Result<Self, Error> {
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
    first_voxel: UVec3,
    /// The piece of the whole grid.
    grid: VoxelGrid,
    /// Absent after [`Voxelizer::release`].
    buffers: Option<GridBuffers>,
    /// Bound where a pass is compiled for something that this scene or these settings do not have.
    nothing: Arc<Buffer>,
    no_image: Arc<Image>,
    fragment_capacity: u32,
    /// Workgroups that share the same triangles, at least.
    sharing: u32,
}

impl Voxelizer {
    /// In a grid around the scene. Allocates what depends on the grid alone.
    pub fn new(gpu: &Gpu, scene: &GpuScene, settings: VoxelSettings) -> Result<Self, Error> {
        let whole = VoxelGrid::around(scene.bounds, settings.resolution);
        Self::of_piece(gpu, settings, whole, UVec3::ZERO, whole.resolution)
    }

    /// Of a cube of a grid, `resolution` voxels wide; what lies outside of it is left out. Positions are rounded as in the whole grid.
    pub fn of_piece(gpu: &Gpu, settings: VoxelSettings, whole: VoxelGrid, first: UVec3, resolution: u32) -> Result<Self, Error> {
        require(gpu, settings.method)?;
        let grid = VoxelGrid { origin: whole.origin + whole.voxel_size * first.as_vec3(), voxel_size: whole.voxel_size, resolution };
        let no_image = average_image(gpu, 1)?;
        Ok(Voxelizer {
            settings,
            whole_origin: whole.origin,
            first_voxel: first,
            grid,
            buffers: Some(GridBuffers::new(gpu, grid)?),
            nothing: buffer(gpu, "voxel.nothing", 0)?,
            no_image,
            fragment_capacity: 0,
            sharing: 1,
        })
    }

    /// Voxelizes. The first time, fragments are counted before they are stored, so that their buffer is exact; later, a buffer that proves too small is
    /// made larger and the pass repeated, as it is where a driver ended threads with too much to do. The cost of runs that had to be repeated is told
    /// apart, in [`FrameStats::counting`].
    pub fn run(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<(Voxels, FrameStats), Error> {
        let grid_buffers = match self.buffers.take() {
            Some(buffers) => buffers,
            None => GridBuffers::new(gpu, self.grid)?,
        };
        self.buffers = Some(grid_buffers.clone());
        let mut stats = FrameStats::default();
        loop {
            let fragments = buffer(gpu, "voxel.fragments", size_of::<Fragment>() as u64 * u64::from(self.fragment_capacity))?;
            let emission_bytes = if scene.is_emissive { 8 * u64::from(self.fragment_capacity) } else { 0 };
            let emission = buffer(gpu, "voxel.fragment_emission", emission_bytes)?;
            let mut frame = Frame::new();
            frame.set_scene(&scene.set, &scene.materials);
            self.add_fragments(&mut frame, scene, &grid_buffers, [&fragments, &emission]);
            add_index(&mut frame, self.grid, &grid_buffers);
            let run = gpu.submit(frame)?;
            let counts: Vec<u32> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&grid_buffers.counters)?);
            let (fragment_count, voxel_count, unfinished_count) = (counts[0], counts[1], counts[2]);
            if unfinished_count > 0 {
                if self.sharing >= MOST_SHARING {
                    return Err(Error::Unfinished { pass: "voxel.fragments", thread_count: unfinished_count });
                }
                self.sharing *= 4;
                stats.append(run.into_counting());
                continue;
            }
            if fragment_count > self.fragment_capacity {
                self.fragment_capacity = fragment_count;
                stats.append(run.into_counting());
                continue;
            }
            let (voxels, resolved) = self.resolve(gpu, scene, &grid_buffers, [&fragments, &emission], [fragment_count, voxel_count])?;
            stats.append(run);
            stats.append(resolved);
            return Ok((voxels, stats));
        }
    }

    /// Frees what depends on the grid alone, until the next run.
    pub fn release(&mut self) {
        self.buffers = None;
    }

    fn add_fragments(&self, frame: &mut Frame, scene: &GpuScene, grid_buffers: &GridBuffers, [fragments, emission]: [&Arc<Buffer>; 2]) {
        let GridBuffers { occupancy, counters, .. } = grid_buffers;
        frame.fill("voxel.clear", occupancy, 0);
        frame.fill("voxel.clear", counters, 0);
        let params = |batch: &crate::scene::Batch| FragmentParams {
            origin_inverse_size: self.whole_origin.extend(1.0 / self.grid.voxel_size).to_array(),
            first_voxel: self.first_voxel.as_vec3().extend(0.0).to_array(),
            resolution: self.grid.resolution,
            first_triangle: batch.first_triangle,
            triangle_count: batch.triangle_count,
            material: batch.material,
            capacity: self.fragment_capacity,
            emission_unit: scene.largest_emission.max(f32::MIN_POSITIVE),
        };
        // A material pays for the textures that it has: one variant for each kind.
        for kind in [TextureUse::None, TextureUse::Textured, TextureUse::Masked] {
            let batches: Vec<_> = scene.batches.iter().filter(|batch| scene.texture_use[batch.material as usize] == kind).collect();
            if batches.is_empty() {
                continue;
            }
            let pass = match self.settings.method {
                Method::Compute => &FRAGMENTS_COMPUTE,
                Method::Raster => &FRAGMENTS_RASTER,
                Method::RasterHw => &FRAGMENTS_RASTER_HW,
            };
            let builder = frame.pass(pass).bind(occupancy).bind(fragments).bind(emission).bind(counters);
            let builder = builder.constants(&[u32::from(scene.is_emissive), u32::from(kind == TextureUse::Masked), u32::from(kind != TextureUse::None)]);
            if self.settings.method == Method::Compute {
                let dispatch = |batch: &&crate::scene::Batch| BatchDispatch {
                    material: batch.material,
                    push: bytemuck::bytes_of(&params(batch)).to_vec(),
                    groups: self.triangle_groups(batch.triangle_count),
                };
                builder.dispatch_batches(batches.iter().map(dispatch).collect());
            } else {
                let draw = |batch: &&crate::scene::Batch| DrawBatch {
                    material: batch.material,
                    push: bytemuck::bytes_of(&params(batch)).to_vec(),
                    first_vertex: 0,
                    vertex_count: 3 * batch.triangle_count,
                };
                builder.draw(Targets::none([self.grid.resolution; 2]), batches.iter().map(draw).collect());
            }
        }
    }

    /// Workgroups of 64 triangles, and how many share the columns of the same triangles where there are few.
    fn triangle_groups(&self, triangle_count: u32) -> [u32; 3] {
        let groups = triangle_count.div_ceil(64);
        let sharing = (64 / groups).clamp(1, self.grid.resolution.pow(2).div_ceil(256));
        [groups, sharing.max(self.sharing), 1]
    }

    fn resolve(
        &self,
        gpu: &Gpu,
        scene: &GpuScene,
        GridBuffers { occupancy, block_bases, .. }: &GridBuffers,
        [fragments, emission]: [&Arc<Buffer>; 2],
        [fragment_count, voxel_count]: [u32; 2],
    ) -> Result<(Voxels, FrameStats), Error> {
        let heads = buffer(gpu, "voxel.heads", 4 * u64::from(voxel_count))?;
        let records = buffer(gpu, "voxel.records", size_of::<Voxel>() as u64 * u64::from(voxel_count))?;
        let voxel_emission = scene.is_emissive.then(|| buffer(gpu, "voxel.emission", 16 * u64::from(voxel_count))).transpose()?;
        let running = self.settings.accumulation == Accumulation::RunningAverage;
        let averages = if running { average_image(gpu, self.grid.resolution)? } else { Arc::clone(&self.no_image) };
        let mut frame = Frame::new();
        frame.fill("voxel.clear", &heads, 0);
        let link = LinkParams { resolution: self.grid.resolution, fragment_count };
        if running {
            frame.clear_image("voxel.clear", &averages, 0);
            frame.pass(&RUNNING_AVERAGE).bind(fragments).bind(&averages).push(&link).dispatch(linear_groups(fragment_count));
        }
        frame.pass(&LINK_FRAGMENTS).bind(occupancy).bind(block_bases).bind(fragments).bind(&heads).push(&link).dispatch(linear_groups(fragment_count));
        frame
            .pass(&RESOLVE_VOXELS)
            .bind(fragments)
            .bind(emission)
            .bind(&heads)
            .bind(&records)
            .bind(voxel_emission.as_ref().unwrap_or(&self.nothing))
            .bind(&averages)
            .constants(&[u32::from(scene.is_emissive), u32::from(self.settings.coverage), u32::from(running)])
            .push(&ResolveParams { voxel_count, emission_unit: scene.largest_emission.max(f32::MIN_POSITIVE) })
            .dispatch(linear_groups(voxel_count));
        let stats = gpu.submit(frame)?;
        let (occupancy, block_bases) = (Arc::clone(occupancy), Arc::clone(block_bases));
        Ok((Voxels { grid: self.grid, occupancy, block_bases, records, emission: voxel_emission, voxel_count, fragment_count }, stats))
    }
}

/// Compact indices from occupancy.
fn add_index(frame: &mut Frame, grid: VoxelGrid, GridBuffers { occupancy, block_bases, group_sums, counters }: &GridBuffers) {
    let block_count = grid.block_count();
    let groups = block_count.div_ceil(1024);
    let params = CountParams { block_count };
    frame.pass(&COUNT_BLOCKS).bind(occupancy).bind(group_sums).push(&params).dispatch([groups, 1, 1]);
    frame.pass(&SCAN_GROUPS).bind(group_sums).bind(counters).push(&ScanParams { group_count: groups }).dispatch([1, 1, 1]);
    frame.pass(&INDEX_BLOCKS).bind(occupancy).bind(group_sums).bind(block_bases).push(&params).dispatch([groups, 1, 1]);
}

fn require(gpu: &Gpu, method: Method) -> Result<(), Error> {
    let features = gpu.features();
    let missing = |what: &str, feature| Err(Error::FeatureMissing { what: what.into(), feature });
    match method {
        Method::Raster if !features.geometry_shader => missing("voxelization=raster (compute does without)", "geometryShader"),
        Method::RasterHw if !(features.geometry_shader && features.conservative_rasterization) => {
            missing("voxelization=raster-hw (raster and compute do without)", "VK_EXT_conservative_rasterization")
        }
        _ => Ok(()),
    }
}

/// A storage buffer of at least 16 bytes.
pub(crate) fn buffer(gpu: &Gpu, name: &str, size_bytes: u64) -> Result<Arc<Buffer>, Error> {
    gpu.create_buffer(&BufferDesc { name: name.into(), size_bytes: size_bytes.max(16), usage: BufferUsage::Storage })
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
    })
}

/// Most workgroups that share the same triangles: at the highest resolution, each thread then has a few tiles of 64 full-sized triangles.
const MOST_SHARING: u32 = 1 << 14;

/// Workgroups of 64 threads for a linear index; beyond the limit of one dimension they go on in the second (`y × 65,535 × 64`).
pub(crate) fn linear_groups(count: u32) -> [u32; 3] {
    let groups = count.div_ceil(64);
    [groups.min(65_535), groups.div_ceil(65_535).max(1), 1]
}
