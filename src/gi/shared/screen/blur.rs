//! Light of the neighbours.

use std::sync::Arc;

use super::{Blurring, ScreenSettings};
use crate::gpu_struct;
use crate::graph::{Access, Binding, Error, Frame, Gpu, Image, Pass, Sets, Shaders};
use crate::render::{GBuffer, screen_groups, screen_image};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `screen.blur`.
    pub struct BlurParams {
        /// 0 along rows, 1 along columns.
        pub axis: u32,
        /// Of a pixel with at most four directions (px).
        pub radius: f32,
        /// The smallest (px).
        pub least_radius: f32,
        /// Of a pixel, in a frame.
        pub directions: f32,
        /// Off a pixel's plane (footprints).
        pub plane_tolerance: f32,
        /// Least cosine of two normals.
        pub normal_cosine: f32,
    }
}

/// Mean along one axis over pixels of one surface. Reads the G-buffer, light and where there is
/// history its weight; writes light.
pub static BLUR: Pass = Pass {
    name: "screen.blur",
    shaders: Shaders::Compute("gi/shared/screen/blur.comp"),
    bindings: &[
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::sampled("light", Access::ComputeSampled),
        Binding::sampled("guide", Access::ComputeSampled),
        Binding::image("blurred", Access::ComputeWrite),
    ],
    constants: &["HAS_GUIDE", "IS_ADAPTIVE"],
    params: Some(BlurParams::LAYOUT),
    sets: Sets::Scene,
};

/// The smallest radius of an adaptive blur (px).
pub(super) const LEAST_RADIUS: f32 = 0.5;

/// Light of the neighbours.
pub(super) struct Blur {
    /// RGBA32F: along rows, then along columns too.
    images: [Arc<Image>; 2],
}

impl Blur {
    pub(super) fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, Error> {
        let image = |name: &str| screen_image(gpu, name, size);
        Ok(Blur {
            images: [image("screen.blurred_rows")?, image("screen.blurred")?],
        })
    }

    /// Adds the passes; returns the blurred light. `guide` has the weight of history.
    pub(super) fn add(
        &self,
        frame: &mut Frame,
        gbuffer: &GBuffer,
        (light, guide): (&Arc<Image>, Option<&Arc<Image>>),
        settings: &ScreenSettings,
    ) -> Arc<Image> {
        let is_adaptive = settings.blur == Blurring::Adaptive;
        let [rows, columns] = &self.images;
        for (axis, from, to) in [(0, light, rows), (1, rows, columns)] {
            frame
                .pass(&BLUR)
                .bind("view_depth", &gbuffer.view_depth)
                .bind("normals", &gbuffer.normals)
                .bind("light", from)
                .bind("guide", guide.unwrap_or(&gbuffer.normals))
                .bind("blurred", to)
                .constant("HAS_GUIDE", guide.is_some())
                .constant("IS_ADAPTIVE", is_adaptive)
                .push(&BlurParams {
                    axis,
                    radius: settings.blur_radius,
                    least_radius: if is_adaptive {
                        LEAST_RADIUS.min(settings.blur_radius)
                    } else {
                        settings.blur_radius
                    },
                    directions: if is_adaptive {
                        settings.directions
                    } else {
                        1.0
                    },
                    plane_tolerance: settings.limits.plane_tolerance,
                    normal_cosine: settings.limits.normal_cosine,
                })
                .dispatch(screen_groups(gbuffer.size));
        }
        Arc::clone(columns)
    }
}
