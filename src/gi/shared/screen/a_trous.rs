//! Light of the neighbours, as far as it differs by noise alone.

use std::sync::Arc;

use super::ScreenSettings;
use super::history::History;
use crate::gpu_struct;
use crate::graph::{Access, Binding, Error, Frame, Gpu, Image, Pass, Sets, Shaders, vk};
use crate::render::{GBuffer, screen_groups, screen_image, screen_image_of};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `screen.variance`.
    pub struct VarianceParams {
        /// Off a pixel's plane (footprints).
        pub plane_tolerance: f32,
        /// Least cosine of two normals.
        pub normal_cosine: f32,
    }
}

gpu_struct! {
    /// Parameters of `screen.a_trous`.
    pub struct ATrousParams {
        /// Between taps (px).
        pub step: i32,
        /// Standard deviations of luminance at which a tap weighs 1/e.
        pub contrast: f32,
        /// Off a pixel's plane (footprints).
        pub plane_tolerance: f32,
        /// Least cosine of two normals.
        pub normal_cosine: f32,
    }
}

/// Variance of the luminance of each pixel's light (Schied et al. 2017, section 4.2). Reads the
/// G-buffer, light and its moments over time; writes R32F, a thread a pixel.
pub static VARIANCE: Pass = Pass {
    name: "screen.variance",
    shaders: Shaders::Compute("gi/shared/screen/variance.comp"),
    bindings: &[
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::sampled("light", Access::ComputeSampled),
        Binding::sampled("guide", Access::ComputeSampled),
        Binding::sampled("moments", Access::ComputeSampled),
        Binding::image("variance", Access::ComputeWrite),
    ],
    constants: &["HAS_MOMENTS"],
    params: Some(VarianceParams::LAYOUT),
    sets: Sets::Scene,
};

/// A level of the à-trous filter (Schied et al. 2017, section 4.3). Reads the G-buffer, light and
/// its variance; writes both, a thread a pixel.
pub static A_TROUS: Pass = Pass {
    name: "screen.a_trous",
    shaders: Shaders::Compute("gi/shared/screen/a_trous.comp"),
    bindings: &[
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::sampled("light", Access::ComputeSampled),
        Binding::sampled("variance", Access::ComputeSampled),
        Binding::image("filtered", Access::ComputeWrite),
        Binding::image("filtered_variance", Access::ComputeWrite),
    ],
    constants: &[],
    params: Some(ATrousParams::LAYOUT),
    sets: Sets::Scene,
};

/// Light of the neighbours, as far as it differs by noise alone.
pub(super) struct ATrous {
    /// RGBA32F.
    light: [Arc<Image>; 2],
    /// R32F: of the light of the image before, and of these.
    variance: [Arc<Image>; 2],
}

impl ATrous {
    pub(super) fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, Error> {
        let light = |name: &str| screen_image(gpu, name, size);
        let variance = |name: &str| screen_image_of(gpu, name, size, vk::Format::R32_SFLOAT);
        Ok(ATrous {
            light: [light("screen.filtered")?, light("screen.filtered_more")?],
            variance: [
                variance("screen.variance")?,
                variance("screen.variance_more")?,
            ],
        })
    }

    /// Adds the passes; returns the filtered light.
    pub(super) fn add(
        &self,
        frame: &mut Frame,
        gbuffer: &GBuffer,
        (light, history): (&Arc<Image>, Option<&History>),
        settings: &ScreenSettings,
    ) -> Arc<Image> {
        let moments = history.and_then(History::moments);
        let guide = history.map_or(&gbuffer.normals, History::guide);
        frame
            .pass(&VARIANCE)
            .bind("view_depth", &gbuffer.view_depth)
            .bind("normals", &gbuffer.normals)
            .bind("light", light)
            .bind("guide", guide)
            .bind("moments", moments.unwrap_or(light))
            .bind("variance", &self.variance[0])
            .constant("HAS_MOMENTS", moments.is_some())
            .push(&VarianceParams {
                plane_tolerance: settings.limits.plane_tolerance,
                normal_cosine: settings.limits.normal_cosine,
            })
            .dispatch(screen_groups(gbuffer.size));
        let mut from = light;
        for level in 0..settings.blur_levels {
            let (old, new) = ((level % 2) as usize, ((level + 1) % 2) as usize);
            frame
                .pass(&A_TROUS)
                .bind("view_depth", &gbuffer.view_depth)
                .bind("normals", &gbuffer.normals)
                .bind("light", from)
                .bind("variance", &self.variance[old])
                .bind("filtered", &self.light[old])
                .bind("filtered_variance", &self.variance[new])
                .push(&ATrousParams {
                    step: 1 << level,
                    contrast: settings.blur_contrast,
                    plane_tolerance: settings.limits.plane_tolerance,
                    normal_cosine: settings.limits.normal_cosine,
                })
                .dispatch(screen_groups(gbuffer.size));
            from = &self.light[old];
        }
        Arc::clone(from)
    }
}
