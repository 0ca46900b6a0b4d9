//! Voxels read back, and what compares them with the oracle.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec2, DVec3, IVec3};
use lumivox::gi::Settings;
use lumivox::gi::shared::voxel::build::passes::Voxel;
use lumivox::gi::shared::voxel::oracle::{
    Grid, TraceSettings, TraceVoxel, VoxelIndex, candidates, front_of,
};
use lumivox::gi::shared::voxel::trace::blocks::RayBlocks;
use lumivox::gi::shared::voxel::{
    Accumulation, Method, Surface, VoxelBox, VoxelGrid, VoxelSettings, Voxelizer, Voxels,
};
use lumivox::graph::{Frame, Gpu};
use lumivox::render::GpuScene;
use lumivox::scene::Scene;
use rayon::prelude::*;

use super::{Missing, read_words, skipped};

/// Exact accumulation, coverage as opacity.
pub fn voxel_settings(resolution: u32, method: Method) -> VoxelSettings {
    VoxelSettings {
        resolution,
        method,
        accumulation: Accumulation::Exact,
        surface: Surface::Conservative,
        coverage: true,
        faces: None,
    }
}

/// The contents of [`Voxels`].
pub struct Read {
    /// The buffers themselves.
    pub voxels: Voxels,
    /// Occupancy.
    pub occupancy: Vec<u32>,
    /// Compact index of each block's first voxel.
    pub bases: Vec<u32>,
    /// Records in compact order.
    pub records: Vec<Voxel>,
    /// Emission in compact order, in an emissive scene.
    pub emission: Vec<[f32; 4]>,
}

/// Voxelizes once with a new voxelizer and reads all of it.
pub fn voxelize(gpu: &Gpu, scene: &GpuScene, settings: VoxelSettings) -> Read {
    read(
        gpu,
        Voxelizer::new(gpu, scene, settings)
            .unwrap()
            .run(gpu, scene)
            .unwrap()
            .0,
    )
}

/// The blocks of a grid as rays read them.
pub fn ray_blocks(gpu: &Gpu, voxels: &Voxels) -> RayBlocks {
    let blocks = RayBlocks::new(gpu, voxels.grid.resolution, 1).unwrap();
    let mut frame = Frame::new();
    blocks.pack(&mut frame, 0, (voxels, 0), (IVec3::ZERO, VoxelBox::NONE));
    gpu.submit(frame).unwrap();
    blocks
}

/// Reads all of it.
pub fn read(gpu: &Gpu, voxels: Voxels) -> Read {
    let count = voxels.voxel_count as usize;
    let mut records: Vec<Voxel> = bytemuck::pod_collect_to_vec(
        &gpu.read_buffer(&voxels.records).unwrap()[..count * size_of::<Voxel>()],
    );
    records.truncate(count);
    let emission = voxels.emission.as_ref().map_or_else(Vec::new, |buffer| {
        bytemuck::pod_collect_to_vec(&gpu.read_buffer(buffer).unwrap()[..16 * count])
    });
    let blocks = voxels.grid.block_count() as usize;
    let mut occupancy = read_words(gpu, &voxels.occupancy);
    let mut bases = read_words(gpu, &voxels.block_bases);
    occupancy.truncate(2 * blocks);
    bases.truncate(blocks);
    Read {
        voxels,
        occupancy,
        bases,
        records,
        emission,
    }
}

impl Read {
    /// Coordinates of the occupied voxels, from the occupancy bits.
    pub fn occupied(&self) -> BTreeSet<VoxelIndex> {
        occupied(&self.occupancy, self.voxels.grid.resolution)
    }
}

/// Coordinates of the set bits.
pub fn occupied(words: &[u32], resolution: u32) -> BTreeSet<VoxelIndex> {
    let blocks = resolution / 4;
    let coordinates = |(index, word): (usize, &u32)| {
        let (block, base, word) = (index as u32 / 2, 32 * (index as u32 % 2), *word);
        let corner = [
            block % blocks,
            block / blocks % blocks,
            block / (blocks * blocks),
        ];
        (0..32)
            .filter(move |bit| word >> bit & 1 == 1)
            .map(move |bit| {
                let bit = base + bit;
                [0, 1, 2]
                    .map(|axis| 4 * corner[axis] + (bit >> axis & 1) + 2 * (bit >> (axis + 3) & 1))
            })
    };
    words.iter().enumerate().flat_map(coordinates).collect()
}

/// Coordinates of a record.
pub fn coordinates(voxel: &Voxel) -> VoxelIndex {
    [voxel.xy & 0xffff, voxel.xy >> 16, voxel.z_area & 0xffff]
}

/// Area of a record (voxel faces).
pub fn area(voxel: &Voxel) -> f64 {
    half((voxel.z_area >> 16) as u16)
}

/// Mean normal of a record.
pub fn mean_normal(voxel: &Voxel) -> DVec3 {
    unorm10(voxel.normal) * 2.0 - 1.0
}

/// Shares of a record's surface that are seen from one side, and from both.
pub fn seen(voxel: &Voxel) -> DVec2 {
    DVec2::new(
        f64::from(voxel.coverage >> 12 & 0x1ff) / 511.0,
        f64::from(voxel.coverage >> 21 & 0xff) / 255.0,
    )
}

/// Whether a record's surface is opposed.
pub fn is_opposed(voxel: &Voxel) -> bool {
    voxel.coverage >> 29 & 1 == 1
}

/// Axis along which a record's surface is opposed.
pub fn opposed_axis(voxel: &Voxel) -> Option<usize> {
    is_opposed(voxel).then_some((voxel.coverage >> 30) as usize)
}

/// Whether a record's surfaces, not opposed, meet like the walls of a room.
pub fn is_concave(voxel: &Voxel) -> bool {
    !is_opposed(voxel) && voxel.coverage >> 30 == 1
}

/// The direction that parts the two sides of a record's surface.
pub fn front(voxel: &Voxel) -> DVec3 {
    front_of(mean_normal(voxel), opposed_axis(voxel))
}

/// What rays need to know of a record, with the radiance of its front and back.
pub fn trace_voxel(voxel: &Voxel, radiance: [DVec3; 2]) -> TraceVoxel {
    TraceVoxel {
        mean_position: unorm10(voxel.mean_position),
        mean_normal: mean_normal(voxel),
        opposed_axis: opposed_axis(voxel),
        is_concave: is_concave(voxel),
        across: unorm10(voxel.across),
        radiance,
    }
}

/// What counts as a hit by a technique's settings, for the first ray of a receiver.
pub fn trace_settings(settings: &Settings, seed: u32) -> TraceSettings {
    TraceSettings {
        self_height: f64::from(settings.number("self_height")),
        contour_slack: f64::from(settings.number("contour_slack")),
        seed,
        ray: 0,
    }
}

/// Three numbers of 10 bits.
pub fn unorm10(packed: u32) -> DVec3 {
    DVec3::from([packed, packed >> 10, packed >> 20].map(|bits| f64::from(bits & 1023) / 1023.0))
}

/// A half float.
pub fn half(bits: u16) -> f64 {
    let (exponent, mantissa) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
    let magnitude = if exponent == 0 {
        mantissa * 0.5f64.powi(24)
    } else {
        (1024.0 + mantissa) * 2f64.powi(exponent - 25)
    };
    if bits >> 15 == 0 {
        magnitude
    } else {
        -magnitude
    }
}

/// Nearest half float of a number from 0 to 65504.
pub fn to_half(value: f64) -> u16 {
    let exponent = (value.max(0.5f64.powi(14)).log2().floor() as i32).clamp(-14, 15);
    let steps = (value / 2f64.powi(exponent - 10)).round() as u32;
    (((exponent + 14) as u32 * 1024) + steps) as u16
}

/// The oracle's grid.
pub fn oracle_grid(grid: &VoxelGrid) -> Grid {
    Grid {
        origin: grid.origin,
        voxel_size: grid.voxel_size,
        resolution: grid.resolution,
    }
}

/// How a voxel set differs from the oracle's.
#[derive(Clone, Copy, Debug, Default)]
pub struct SetDifference {
    /// The oracle's voxels.
    pub oracle: usize,
    /// Voxels that one has and the other has not, all of them within rounding of touching.
    pub rounding: usize,
    /// Voxels that only the oracle has.
    pub missing: usize,
    /// The largest distance from touching among those (voxels).
    pub worst: f64,
}

/// Distance from touching that counts as rounding (voxels): f32 has 24 bits, coordinates are below
/// 128, and the test's dot products cancel.
pub const ROUNDING: f64 = 1e-3;

/// Compares occupied voxels with the oracle's; an error names a voxel that is missing or too many
/// beyond rounding.
pub fn compare_sets(
    occupied: &BTreeSet<VoxelIndex>,
    scene: &Scene,
    grid: &Grid,
) -> Result<SetDifference, String> {
    compare_surfaces(occupied, scene, grid, Surface::Conservative)
}

/// The same of either kind of surface.
pub fn compare_surfaces(
    occupied: &BTreeSet<VoxelIndex>,
    scene: &Scene,
    grid: &Grid,
    surface: Surface,
) -> Result<SetDifference, String> {
    let separations = separations(scene, grid, surface);
    let oracle: BTreeSet<VoxelIndex> = separations
        .iter()
        .filter(|(_, separation)| **separation <= 0.0)
        .map(|(voxel, _)| *voxel)
        .collect();
    let mut difference = SetDifference {
        oracle: oracle.len(),
        ..SetDifference::default()
    };
    for voxel in occupied.symmetric_difference(&oracle) {
        let separation = separations.get(voxel).copied().unwrap_or(f64::INFINITY);
        if separation.abs() > ROUNDING {
            let what = if oracle.contains(voxel) {
                "is missing"
            } else {
                "is too many"
            };
            return Err(format!("{voxel:?} {what}: separation {separation}"));
        }
        difference.rounding += 1;
        difference.missing += usize::from(oracle.contains(voxel));
        difference.worst = difference.worst.max(separation.abs());
    }
    Ok(difference)
}

/// The least separation of each voxel near a triangle from any triangle.
pub fn separations(scene: &Scene, grid: &Grid, surface: Surface) -> BTreeMap<VoxelIndex, f64> {
    let of = |index: usize| {
        let corners = scene.triangles[index]
            .vertices
            .map(|vertex| grid.position(scene.vertices[vertex as usize].position));
        candidates(corners, grid.resolution, ROUNDING, surface)
            .into_iter()
            .filter(|near| near.separation <= ROUNDING)
            .collect::<Vec<_>>()
    };
    let all: Vec<_> = (0..scene.triangles.len())
        .into_par_iter()
        .flat_map_iter(of)
        .collect();
    let mut least = BTreeMap::new();
    for near in all {
        let entry = least.entry(near.voxel).or_insert(f64::INFINITY);
        *entry = entry.min(near.separation);
    }
    least
}

/// The ways to voxelize by rasterization that the device has.
pub fn raster_methods(gpu: &Gpu) -> Vec<Method> {
    let features = gpu.features();
    if !features.geometry_shader {
        skipped(&Missing::Other("voxelization=raster: no geometry shaders"));
        return Vec::new();
    }
    if features.conservative_rasterization {
        vec![Method::Raster, Method::RasterHw]
    } else {
        vec![Method::Raster]
    }
}
