//! Occupied voxels on the host.

use glam::{UVec3, Vec3};

use crate::gi::Context;
use crate::gi::Settings;
use crate::gi::shared::voxel::build::passes::Voxel;
use crate::gi::shared::voxel::{VoxelGrid, VoxelSettings, Voxelizer};
use crate::graph::Error;
use crate::render::float_from_half;

/// One occupied voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OccupiedVoxel {
    /// Coordinates along x, y and z, 0 to resolution − 1.
    pub index: [u32; 3],
    /// Diffuse albedo, linear, 0 to 1.
    pub albedo: Vec3,
    /// Mean of the geometric normals, world space; shorter than 1 where they differ.
    pub normal: Vec3,
    /// Share of the voxel that blocks light, 0 to 1.
    pub opacity: f32,
}

/// The occupied voxels of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelList {
    /// Where the voxels are.
    pub grid: VoxelGrid,
    /// The voxels, each once.
    pub voxels: Vec<OccupiedVoxel>,
}

impl VoxelList {
    /// Centre of a voxel, world space (m).
    pub fn centre_ws(&self, index: [u32; 3]) -> Vec3 {
        self.grid.origin + self.grid.voxel_size * (Vec3::from(index.map(|i| i as f32)) + 0.5)
    }
}

/// Voxelizes a scene, with the settings of [`crate::gi::shared::voxel::SETTINGS`] among others, and
/// reads the voxels back; in pieces where the grid is too large to bind.
pub fn list_voxels(context: &Context<'_>, settings: &Settings) -> Result<VoxelList, Error> {
    let Context { gpu, scene, .. } = *context;
    let settings = VoxelSettings::new(settings);
    let whole = Voxelizer::new(gpu, scene, settings)?;
    let voxels = whole.run_in_pieces(&mut whole.cut(1), |pieces| {
        let mut all = Vec::new();
        for piece in pieces {
            let (voxels, _) = piece.run(gpu, scene)?;
            piece.release();
            let bytes = gpu.read_buffer(&voxels.records)?;
            let records = bytes
                .chunks_exact(size_of::<Voxel>())
                .take(voxels.voxel_count as usize)
                .map(bytemuck::pod_read_unaligned);
            all.extend(records.map(|record| unpack(&record, piece.first_voxel())));
        }
        Ok(all)
    })?;
    Ok(VoxelList {
        grid: VoxelGrid::around(scene.bounds, settings.resolution),
        voxels,
    })
}

fn unpack(record: &Voxel, first: UVec3) -> OccupiedVoxel {
    let albedo_root = unpack_unorm10(record.albedo);
    let opacity = (record.coverage & 0xfff) as f32 / 4095.0;
    OccupiedVoxel {
        index: (first + UVec3::from(index(record))).to_array(),
        albedo: albedo_root * albedo_root,
        normal: mean_normal(record),
        opacity,
    }
}

/// Coordinates along x, y and z.
pub(in crate::gi::shared::voxel) fn index(record: &Voxel) -> [u32; 3] {
    [record.xy & 0xffff, record.xy >> 16, record.z_area & 0xffff]
}

/// Area of the surface inside the voxel (voxel faces).
pub(in crate::gi::shared::voxel) fn area(record: &Voxel) -> f32 {
    float_from_half((record.z_area >> 16) as u16)
}

/// Area of the surface as it is seen along x, y and z (voxel faces).
pub(in crate::gi::shared::voxel) fn across(record: &Voxel) -> Vec3 {
    unpack_unorm10(record.across)
}

/// Mean of the unit normals, weighted with area; shorter than 1 where they differ, but of opposed
/// parallel planes their unit normal.
pub(in crate::gi::shared::voxel) fn mean_normal(record: &Voxel) -> Vec3 {
    unpack_unorm10(record.normal) * 2.0 - 1.0
}

/// The direction that parts the two sides of the surface: its mean normal, or the axis along which
/// surfaces are opposed that are not parallel.
pub(in crate::gi::shared::voxel) fn front(record: &Voxel) -> Vec3 {
    let (is_opposed, normal) = (record.coverage >> 29 & 1 != 0, mean_normal(record));
    if is_opposed && normal.length_squared() < 0.9 {
        Vec3::AXES[(record.coverage >> 30).min(2) as usize]
    } else {
        normal.normalize_or_zero()
    }
}

/// Three numbers of 10 bits (`glsl/shared/packing.glsl`).
fn unpack_unorm10(packed: u32) -> Vec3 {
    Vec3::from([packed, packed >> 10, packed >> 20].map(|bits| (bits & 1023) as f32 / 1023.0))
}
