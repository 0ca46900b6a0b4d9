//! Direct light with soft shadows: a cone from the surface to each light, whose aperture is the
//! light's apparent size (Crassin et al. 2011; Kahl 2019, section 4.2).

use std::sync::Arc;

use ash::vk;

use super::march::{ConeSettings, MarchSettings};
use super::tracer::ConeTracer;
use super::volume::{ConeOutput, March, Volume};
use crate::gi::entry::Stage;
use crate::gpu_struct;
use crate::graph::{Access, Binding, Error, Frame, Gpu, Image};
use crate::render::{GBuffer, GpuScene, Receivers, screen_groups, screen_image_of};

gpu_struct! {
    /// Parameters of `cone.shadow`.
    pub struct ShadowConeParams {
        /// xyz: smallest corner of the grid (m); w: voxel size (m).
        pub grid: [f32; 4],
        /// How they are marched.
        pub march: MarchSettings,
        /// tan(γ/2).
        pub tan_half: f32,
        /// 1 in a scene with specular lobes.
        pub is_glossy: u32,
        /// First light of this dispatch.
        pub first_light: u32,
        /// One beyond its last light.
        pub end_light: u32,
        /// Of the volume, from a face of what it stores to the next.
        pub face_stride: u32,
    }
}

gpu_struct! {
    /// Parameters of `cone.obscure`.
    pub struct ObscureParams {
        /// xyz: smallest corner of the grid (m); w: voxel size (m).
        pub grid: [f32; 4],
        /// How they are marched.
        pub march: MarchSettings,
        /// tan(γ/2).
        pub tan_half: f32,
        /// First light of this dispatch.
        pub first_light: u32,
        /// One beyond its last light.
        pub end_light: u32,
        /// 1 for the last dispatch.
        pub is_last: u32,
        /// Of the volume, from a face of what it stores to the next.
        pub face_stride: u32,
    }
}

pub(in crate::gi) const BINDINGS: [Binding; 5] = [
    Binding::sampled("view_depth", Access::ComputeSampled),
    Binding::sampled("normals", Access::ComputeSampled),
    Binding::sampled("albedo", Access::ComputeSampled),
    Binding::sampled("specular", Access::ComputeSampled),
    Binding::image("direct", Access::ComputeReadWrite),
];

pub(in crate::gi) const OBSCURE: [Binding; 4] = [
    Binding::sampled("view_depth", Access::ComputeSampled),
    Binding::sampled("normals", Access::ComputeSampled),
    Binding::image("least_visibility", Access::ComputeReadWrite),
    Binding::image("indirect_diffuse", Access::ComputeReadWrite),
];

/// Direct light by cones, and that of surfaces that emit.
pub static SOFT_SHADOWS: Stage = Stage::picture("soft shadows", &["cone.shadow", "cone.patches"]);

impl ConeTracer {
    /// How cones to lights are marched.
    fn to_lights(&self) -> ConeSettings {
        self.settings.of_kind(self.shadow_kind)
    }

    /// Adds the direct light of all lights, each seen by a cone; nothing where the settings leave
    /// shadows to maps.
    pub fn shadow(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        gbuffer: &GBuffer,
        volume: Volume<'_>,
        direct: &Arc<Image>,
    ) {
        let Some(tan_half) = self.shadow_tan_half else {
            return;
        };
        let s = self.to_lights();
        let specular = gbuffer.specular.as_ref().unwrap_or(&gbuffer.albedo);
        let mut dispatches = s.dispatches(frame.loops(), volume, scene.lights.len() as u32);
        if dispatches.is_empty() {
            // Without lights, the picture is black.
            dispatches.push([0, 0]);
        }
        for [first_light, end_light] in dispatches {
            let params = ShadowConeParams {
                grid: volume.grid.row(),
                march: s.march(volume),
                tan_half,
                is_glossy: u32::from(scene.is_glossy),
                first_light,
                end_light,
                face_stride: volume.face_stride,
            };
            let march = March::new(true, ConeOutput::Light, s.face_weights);
            volume
                .pass(frame, &volume.passes.shadow, march)
                .bind("view_depth", &gbuffer.view_depth)
                .bind("normals", &gbuffer.normals)
                .bind("albedo", &gbuffer.albedo)
                .bind("specular", specular)
                .bind("direct", direct)
                .push(&params)
                .dispatch(screen_groups(gbuffer.size));
        }
    }

    /// Where [`Self::obscure`] keeps what it found, a texel a pixel; absent where gathered light
    /// stays as it is.
    pub fn least_visibility(&self, gpu: &Gpu, size: [u32; 2]) -> Result<Option<Arc<Image>>, Error> {
        (self.obscures_diffuse && self.has_shadows())
            .then(|| screen_image_of(gpu, "cone.least_visibility", size, vk::Format::R32_SFLOAT))
            .transpose()
    }

    /// Multiplies gathered light by the least that the cones to the lights see of one (Kahl 2019,
    /// equation 5.9: a look). `least` is that of [`Self::least_visibility`].
    pub fn obscure(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        receivers: &Receivers<'_>,
        volume: Volume<'_>,
        least: &Arc<Image>,
    ) {
        let Some(tan_half) = self.shadow_tan_half else {
            return;
        };
        let s = self.to_lights();
        let light_count = scene.lights.len() as u32;
        for [first_light, end_light] in s.dispatches(frame.loops(), volume, light_count) {
            let params = ObscureParams {
                grid: volume.grid.row(),
                march: s.march(volume),
                tan_half,
                first_light,
                end_light,
                is_last: u32::from(end_light == light_count),
                face_stride: volume.face_stride,
            };
            let march = March::new(true, ConeOutput::Light, s.face_weights);
            volume
                .pass(frame, &volume.passes.obscure, march)
                .bind("view_depth", receivers.view_depth)
                .bind("normals", receivers.normals)
                .bind("least_visibility", least)
                .bind("indirect_diffuse", receivers.light)
                .push(&params)
                .dispatch(receivers.groups());
        }
    }
}
