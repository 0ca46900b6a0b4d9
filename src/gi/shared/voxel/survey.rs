//! What voxels of a size would be like in a scene: measured by making them.

use super::build::passes::Voxel;
use super::{Accumulation, Method, Surface, VoxelSettings, Voxelizer};
use crate::gi::shared::voxel::build::list::mean_normal;
use crate::graph::{Error, Gpu};
use crate::render::GpuScene;

/// The voxels of a scene, counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Survey {
    /// Voxels along the largest extent of the scene.
    pub resolution: u32,
    /// Edge of a voxel (m).
    pub voxel_size_m: f32,
    /// Occupied voxels.
    pub voxels: u32,
    /// Triangle–voxel pairs.
    pub fragments: u32,
    /// There are glossy surfaces, and so a dense texture that cones march through.
    is_glossy: bool,
    /// Share of the occupied voxels whose surface is no one plane: both faces of a wall, bars,
    /// leaves, edges.
    pub mixed: f64,
}

/// Below this squared length of the mean normal a voxel holds several planes, as rays take it.
const ONE_PLANE: f32 = 0.9;

/// Bytes that an occupied voxel has in all buffers of voxels and their light, with six sides and
/// one bounce: record, radiance, injected flux, and the first of its fragments while it is built.
const BYTES_A_VOXEL: u64 = 28 + 48 + FLUX_BYTES_A_VOXEL + 4;

/// Injected flux of them.
const FLUX_BYTES_A_VOXEL: u64 = 120;

/// Bytes of a fragment, while voxels are built.
const BYTES_A_FRAGMENT: u64 = 24;

impl Survey {
    /// Voxelizes a scene, and counts.
    pub fn new(gpu: &Gpu, scene: &GpuScene, resolution: u32) -> Result<Self, Error> {
        let settings = VoxelSettings {
            resolution,
            method: Method::Compute,
            accumulation: Accumulation::Exact,
            surface: Surface::Conservative,
            coverage: false,
            faces: None,
        };
        let (voxels, _) = Voxelizer::new(gpu, scene, settings)?.run(gpu, scene)?;
        let bytes = gpu.read_buffer(&voxels.records)?;
        let mixed = bytes
            .chunks_exact(size_of::<Voxel>())
            .take(voxels.voxel_count as usize)
            .map(bytemuck::pod_read_unaligned)
            .filter(|record: &Voxel| mean_normal(record).length_squared() < ONE_PLANE)
            .count();
        Ok(Survey {
            resolution,
            voxel_size_m: voxels.grid.voxel_size,
            voxels: voxels.voxel_count,
            fragments: voxels.fragment_count,
            is_glossy: scene.is_glossy,
            mixed: mixed as f64 / f64::from(voxels.voxel_count.max(1)),
        })
    }

    /// Bytes of the largest buffer of voxels half as large: of the flux that maps inject.
    pub fn flux_of_finer(&self) -> u64 {
        4 * FLUX_BYTES_A_VOXEL * u64::from(self.voxels)
    }

    /// Bytes that voxels half as large would take, in a grid for rays: there are about four times
    /// as many of them, as they lie on surfaces.
    pub fn bytes_of_finer(&self) -> u64 {
        let finer = 4
            * (BYTES_A_VOXEL * u64::from(self.voxels)
                + BYTES_A_FRAGMENT * u64::from(self.fragments));
        let grid = u64::from(2 * self.resolution).pow(3);
        // A bit a voxel, and a count of 4 bytes for each block of 64.
        let blocks = grid / 8 + grid / 16;
        // RGBA16F with its mips, and the pyramid of matter.
        let dense = if self.is_glossy {
            grid * 64 / 7 + grid / 4
        } else {
            0
        };
        finer + blocks + dense
    }
}
