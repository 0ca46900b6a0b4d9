//! Voxels as a cache of the light at a path's last place.

use crate::gi::Inputs;
use crate::gi::shared::voxel::{
    EmissionSeenBy, Injection, LightInputs, LightSettings, LitGrid, Occlusion, Sides,
    VoxelSettings, lit_grid,
};
use crate::graph::{Access, Binding, Error, Frame, Gpu, PassBuilder};
use crate::render::GpuScene;
use crate::render::bvh::SceneRays;

/// What a pass binds, after all else, whose paths read a cache (`gi/shared/paths/cache.glsl`).
pub const CACHE_BINDINGS: [Binding; 3] = [
    Binding::sampled("blocks", Access::ComputeSampled),
    Binding::buffer("voxel_records", Access::ComputeRead),
    Binding::buffer("voxel_radiance", Access::ComputeRead),
];

/// A grid of voxels, each of whose faces has a radiance.
pub struct Cache {
    /// The voxels and their light.
    pub grid: LitGrid,
}

impl Cache {
    /// Nothing is built yet. `uses_maps`: reflective shadow maps light the voxels, and not rays.
    /// Places meet what emits themselves, or (`has_emission`) it is in the light of voxels too.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        resolution: u32,
        (uses_maps, has_emission): (bool, bool),
    ) -> Result<Self, Error> {
        let (injection, occlusion) = if uses_maps {
            (Injection::Rsm, Occlusion::ShadowMap)
        } else {
            (Injection::Voxel, Occlusion::Triangles)
        };
        let light = LightSettings {
            occlusion,
            emission: if has_emission {
                EmissionSeenBy::All
            } else {
                EmissionSeenBy::Mirror
            },
            ..LightSettings::direct(injection, Sides::Six)
        };
        let settings = VoxelSettings::exact(resolution);
        Ok(Cache {
            grid: LitGrid::new(gpu, scene, settings, light, true)?,
        })
    }

    /// Adds the passes that light the voxels.
    pub fn light(&self, frame: &mut Frame, given: &Inputs<'_>, triangles: &SceneRays) {
        if let Some((voxels, light)) = &self.grid.lit {
            let inputs = LightInputs {
                maps: given.maps,
                rsm: given.rsm,
                triangles: Some(triangles),
            };
            light.update(frame, voxels, inputs, None);
        }
    }

    /// Binds what paths read of it.
    pub fn bind<'f>(&self, pass: PassBuilder<'f>) -> PassBuilder<'f> {
        let (Some((voxels, light)), Some(blocks)) = (&self.grid.lit, &self.grid.blocks) else {
            return pass;
        };
        lit_grid::bound(voxels, blocks, light)
            .into_iter()
            .fold(pass, |pass, (name, bound)| pass.bind(name, bound))
            .constant("SIDES", light.settings.sides as u32)
    }

    /// Smallest corner (m) and voxel size (m) of the grid.
    pub fn row(&self) -> [f32; 4] {
        (self.grid.lit.as_ref()).map_or([0.0; 4], |(voxels, _)| voxels.grid.row())
    }
}
