//! Direct light and the composite: the passes between the G-buffer and the picture.

use std::sync::Arc;

use super::super::{GpuScene, LightMaps, ShadowSettings};
use super::gbuffer::GBuffer;
use crate::gpu_struct;
use crate::graph::{
    Access, Binding, Error, Frame, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Owner, Pass,
    ScreenFormat, Sets, Shaders, vk,
};
use crate::shader::GpuStruct;

/// Light reflected once.
pub static DIRECT: Pass = Pass {
    name: "render.direct",
    shaders: Shaders::Compute("render/screen/direct.comp"),
    bindings: &[
        Binding::buffer("light_views", Access::ComputeRead),
        Binding::sampled("shadow_maps", Access::ComputeSampled),
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::sampled("albedo", Access::ComputeSampled),
        Binding::sampled("specular", Access::ComputeSampled),
        Binding::image("direct", Access::ComputeWrite),
    ],
    constants: &["GLOSSY", "SHADOW_FILTER"],
    params: Some(DirectParams::LAYOUT),
    sets: Sets::Scene,
};

gpu_struct! {
    /// Parameters of `render.direct`.
    pub struct DirectParams {
        /// Tangent of half the angular diameter of directional lights.
        pub sun_tangent: f32,
    }
}

/// L = L_e + L_direct + ρ/π · E_i + L_s.
pub static COMPOSITE: Pass = Pass {
    name: "render.composite",
    shaders: Shaders::Compute("render/screen/composite.comp"),
    bindings: &[
        Binding::sampled("direct", Access::ComputeSampled),
        Binding::sampled("albedo", Access::ComputeSampled),
        Binding::sampled("indirect_diffuse", Access::ComputeSampled),
        Binding::sampled("indirect_specular", Access::ComputeSampled),
        Binding::sampled("emission", Access::ComputeSampled),
        Binding::image("indirect", Access::ComputeWrite),
        Binding::image("radiance", Access::ComputeWrite),
    ],
    constants: &["SPECULAR", "EMISSIVE"],
    params: None,
    sets: Sets::Scene,
};

/// What every technique answers: the light that reaches each pixel's surface after at least one
/// reflection. Alpha channels and pixels without a surface are as stated.
#[derive(Clone)]
pub struct IndirectLight {
    /// RGBA32F. rgb: indirect diffuse irradiance E_i (W/m²); a: ambient visibility, 0 to 1. 0
    /// where there is no surface.
    pub diffuse: Arc<Image>,
    /// RGBA32F. rgb: indirect specular radiance L_s (W/(m² sr)); only where the scene is glossy
    /// and the technique traces it.
    pub specular: Option<Arc<Image>>,
}

/// The pictures of a frame, RGBA32F; alpha is 1 where there is a surface.
pub struct Output {
    /// L_direct: light reflected once (W/(m² sr)).
    pub direct: Arc<Image>,
    /// ρ/π · E_i + L_s (W/(m² sr)).
    pub indirect: Arc<Image>,
    /// L = L_e + L_direct + ρ/π · E_i + L_s, and the environment where there is no surface (W/(m²
    /// sr)).
    pub radiance: Arc<Image>,
}

impl Output {
    /// Allocates the pictures.
    pub fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, Error> {
        let light = (gpu.screen_format().format(), Owner::Shared);
        let image = |name: &str| image_of(gpu, name, size, light);
        Ok(Output {
            direct: image("output.direct")?,
            indirect: image("output.indirect")?,
            radiance: image("output.radiance")?,
        })
    }

    /// Adds the direct light of all lights.
    pub fn draw_direct(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        (maps, shadows): (&LightMaps, &ShadowSettings),
        gbuffer: &GBuffer,
    ) {
        frame
            .pass(&DIRECT)
            .bind("light_views", &maps.views)
            .bind("shadow_maps", &maps.depth)
            .bind("view_depth", &gbuffer.view_depth)
            .bind("normals", &gbuffer.normals)
            .bind("albedo", &gbuffer.albedo)
            .bind(
                "specular",
                gbuffer.specular.as_ref().unwrap_or(&gbuffer.albedo),
            )
            .bind("direct", &self.direct)
            .constant("GLOSSY", scene.is_glossy)
            .constant("SHADOW_FILTER", shadows.filter as u32)
            .push(&DirectParams {
                sun_tangent: (0.5 * shadows.sun_angle_deg.to_radians()).tan(),
            })
            .dispatch(screen_groups(gbuffer.size));
    }

    /// Composites direct and indirect light.
    pub fn draw_composite(&self, frame: &mut Frame, gbuffer: &GBuffer, light: &IndirectLight) {
        frame
            .pass(&COMPOSITE)
            .bind("direct", &self.direct)
            .bind("albedo", &gbuffer.albedo)
            .bind("indirect_diffuse", &light.diffuse)
            .bind(
                "indirect_specular",
                light.specular.as_ref().unwrap_or(&gbuffer.albedo),
            )
            .bind(
                "emission",
                gbuffer.emission.as_ref().unwrap_or(&gbuffer.albedo),
            )
            .bind("indirect", &self.indirect)
            .bind("radiance", &self.radiance)
            .constant("SPECULAR", light.specular.is_some())
            .constant("EMISSIVE", gbuffer.emission.is_some())
            .dispatch(screen_groups(gbuffer.size));
    }
}

/// An image of light, of the size of the screen and in the format of screens ([`ScreenFormat`]),
/// for a technique.
pub fn screen_image(gpu: &Gpu, name: &str, size: [u32; 2]) -> Result<Arc<Image>, Error> {
    image_of(
        gpu,
        name,
        size,
        (gpu.screen_format().format(), Owner::Screen),
    )
}

/// An image of the size of the screen and of any format, for a technique.
pub fn screen_image_of(
    gpu: &Gpu,
    name: &str,
    size: [u32; 2],
    format: vk::Format,
) -> Result<Arc<Image>, Error> {
    image_of(gpu, name, size, (format, Owner::Screen))
}

/// The same of RGBA32F in any case, for what the host reads.
pub fn exact_screen_image(gpu: &Gpu, name: &str, size: [u32; 2]) -> Result<Arc<Image>, Error> {
    screen_image_of(gpu, name, size, ScreenFormat::Float32.format())
}

fn image_of(
    gpu: &Gpu,
    name: &str,
    size: [u32; 2],
    (format, owner): (vk::Format, Owner),
) -> Result<Arc<Image>, Error> {
    gpu.create_image(&ImageDesc {
        name: name.into(),
        extent: [size[0], size[1], 1],
        kind: ImageKind::D2,
        format,
        mips: 1,
        layers: 1,
        usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
        owner,
    })
}

/// Workgroups of 8×8 threads that cover the screen.
pub fn screen_groups([width, height]: [u32; 2]) -> [u32; 3] {
    [width.div_ceil(8), height.div_ceil(8), 1]
}
