//! Direct light with soft shadows: a cone from the surface to each light, whose aperture is the
//! light's apparent size (Crassin et al. 2011; Kahl 2019, section 4.2).

use std::sync::Arc;

use super::tracer::ConeTracer;
use super::volume::{Output, Volume, VolumePass, volume_pass};
use crate::gi::registry::{Part, Stage};
use crate::gi::shared::voxel::VoxelGrid;
use crate::gpu_struct;
use crate::graph::{Access, Binding, Frame, Image};
use crate::render::{GBuffer, GpuScene, screen_groups};

gpu_struct! {
    /// Parameters of `cone.shadow`.
    pub struct ShadowConeParams {
        /// xyz: smallest corner of the grid (m); w: voxel size (m).
        pub grid: [f32; 4],
        /// Voxels along an edge of the grid.
        pub resolution: f32,
        /// β.
        pub step_factor: f32,
        /// g.
        pub opacity_exponent: f32,
        /// k; 0: off.
        pub height_clamp: f32,
        /// Start along the geometric normal (voxels).
        pub start_offset: f32,
        /// tan(γ/2).
        pub tan_half: f32,
        /// 1 in a scene with specular lobes.
        pub is_glossy: u32,
        /// First light of this dispatch.
        pub first_light: u32,
        /// One beyond its last light.
        pub end_light: u32,
        /// Bricks of a sparse volume from a face of a tile to the next.
        pub face_stride: u32,
    }
}

const BINDINGS: [Binding; 5] = [
    Binding::sampled("view_depth", Access::ComputeSampled),
    Binding::sampled("normals", Access::ComputeSampled),
    Binding::sampled("albedo", Access::ComputeSampled),
    Binding::sampled("specular", Access::ComputeSampled),
    Binding::image("direct", Access::ComputeReadWrite),
];

/// L = Σ (ρ/π + f_s) E (n·ω) V over the lights. Reads the G-buffer and a volume, writes RGBA32F as
/// `render.direct` does; a thread a pixel.
pub static SHADOW: VolumePass = volume_pass!(
    "cone.shadow",
    "gi/shared/cone/shadow",
    ShadowConeParams,
    BINDINGS
);

/// Direct light by cones, and that of surfaces that emit.
pub static SOFT_SHADOWS: Stage = Stage {
    name: "soft shadows",
    part: Part::Picture,
    passes: &["cone.shadow", "cone.patches"],
};

impl ConeTracer {
    /// Adds the direct light of all lights, each seen by a cone; nothing where the settings leave
    /// shadows to maps.
    pub fn shadow(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        gbuffer: &GBuffer,
        grid: &VoxelGrid,
        volume: Volume<'_>,
        direct: &Arc<Image>,
    ) {
        let Some(tan_half) = self.shadow_tan_half else {
            return;
        };
        let s = &self.settings;
        let pass = volume.choose(&SHADOW);
        let specular = gbuffer.specular.as_ref().unwrap_or(&gbuffer.albedo);
        let mut dispatches = s.dispatches(grid, volume, scene.lights.len() as u32);
        if dispatches.is_empty() {
            // Without lights, the picture is black.
            dispatches.push([0, 0]);
        }
        for [first_light, end_light] in dispatches {
            let params = ShadowConeParams {
                grid: grid.row(),
                resolution: grid.resolution as f32,
                step_factor: s.step_factor,
                opacity_exponent: s.opacity_exponent,
                height_clamp: s.height_clamp,
                start_offset: s.start_offset,
                tan_half,
                is_glossy: u32::from(scene.is_glossy),
                first_light,
                end_light,
                face_stride: volume.face_stride(),
            };
            let builder = frame
                .pass(pass)
                .bind(&gbuffer.view_depth)
                .bind(&gbuffer.normals)
                .bind(&gbuffer.albedo)
                .bind(specular)
                .bind(direct);
            volume
                .bind(builder, true, Output::Light, s.face_weights)
                .push(&params)
                .dispatch(screen_groups(gbuffer.size));
        }
    }
}
