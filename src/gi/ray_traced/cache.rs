//! Voxels as a cache of the light at a path's last place.

use crate::gi::Inputs;
use crate::gi::shared::voxel::{
    Accumulation, EmissionSeenBy, Injection, LightInputs, LightSettings, LitGrid, Method,
    Occlusion, Sides, Surface, VoxelSettings,
};
use crate::graph::{Error, Frame, Gpu, PassBuilder};
use crate::render::GpuScene;
use crate::render::bvh::SceneRays;

/// A grid of voxels, each of whose faces has a radiance.
pub(super) struct Cache {
    pub(super) grid: LitGrid,
}

impl Cache {
    /// Nothing is built yet. `uses_maps`: reflective shadow maps light the voxels, and not rays.
    pub(super) fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        resolution: u32,
        uses_maps: bool,
    ) -> Result<Self, Error> {
        let (injection, occlusion) = if uses_maps {
            (Injection::Rsm, Occlusion::ShadowMap)
        } else {
            (Injection::Voxel, Occlusion::Triangles)
        };
        let light = LightSettings {
            occlusion,
            // Paths meet what emits themselves.
            emission: EmissionSeenBy::Mirror,
            ..LightSettings::direct(injection, Sides::Six)
        };
        let settings = VoxelSettings {
            resolution,
            method: Method::Compute,
            accumulation: Accumulation::Exact,
            surface: Surface::Conservative,
            coverage: false,
            faces: None,
        };
        Ok(Cache {
            grid: LitGrid::new(gpu, scene, settings, light)?,
        })
    }

    /// Adds the passes that light the voxels.
    pub(super) fn light(&self, frame: &mut Frame, given: &Inputs<'_>, triangles: &SceneRays) {
        if let Some((voxels, light)) = &self.grid.lit {
            let inputs = LightInputs {
                maps: given.maps,
                triangles: Some(triangles),
            };
            light.update(frame, voxels, inputs, None);
        }
    }

    /// Binds what paths read of it.
    pub(super) fn bind<'f>(&self, pass: PassBuilder<'f>) -> PassBuilder<'f> {
        let Some((voxels, light)) = &self.grid.lit else {
            return pass;
        };
        pass.bind("occupancy", &voxels.occupancy)
            .bind("block_bases", &voxels.block_bases)
            .bind("voxel_records", &voxels.records)
            .bind("voxel_radiance", &light.radiance)
    }

    /// Smallest corner (m) and voxel size (m) of the grid.
    pub(super) fn row(&self) -> [f32; 4] {
        (self.grid.lit.as_ref()).map_or([0.0; 4], |(voxels, _)| voxels.grid.row())
    }
}
