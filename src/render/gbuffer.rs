//! The G-buffer: what each pixel's surface is.

use std::sync::Arc;

use super::GpuScene;
use crate::graph::{
    ClearOrLoad, DrawBatch, Error, Frame, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Pass,
    RasterState, Sets, Shaders, Targets, vk,
};

const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
const FORMATS: [vk::Format; 5] = [
    vk::Format::R32_SFLOAT,
    vk::Format::R32G32_UINT,
    vk::Format::R16G16B16A16_SFLOAT,
    vk::Format::R16G16B16A16_SFLOAT,
    vk::Format::R32G32B32A32_SFLOAT,
];

const fn gbuffer_pass(color: &'static [vk::Format], fragment: &'static str) -> Pass {
    Pass {
        name: "render.gbuffer",
        shaders: Shaders::Raster {
            vertex: "render/gbuffer.vert",
            geometry: None,
            fragment: Some(fragment),
            state: RasterState {
                color,
                depth: Some(DEPTH),
                depth_compare: vk::CompareOp::GREATER,
                ..RasterState::NO_TARGETS
            },
        },
        bindings: &[],
        push_bytes: 0,
        sets: Sets::SceneAndMaterials,
    }
}

/// G-buffer of a scene that is only diffuse.
pub static GBUFFER_DIFFUSE: Pass =
    gbuffer_pass(&[FORMATS[0], FORMATS[1], FORMATS[2]], "render/gbuffer.frag");
/// G-buffer of a glossy scene.
pub static GBUFFER_GLOSSY: Pass = gbuffer_pass(
    &[FORMATS[0], FORMATS[1], FORMATS[2], FORMATS[3]],
    "render/gbuffer_glossy.frag",
);
/// G-buffer of an emissive scene.
pub static GBUFFER_EMISSIVE: Pass = gbuffer_pass(
    &[FORMATS[0], FORMATS[1], FORMATS[2], FORMATS[4]],
    "render/gbuffer_emissive.frag",
);
/// G-buffer of a scene that is glossy and emissive.
pub static GBUFFER_GLOSSY_EMISSIVE: Pass =
    gbuffer_pass(&FORMATS, "render/gbuffer_glossy_emissive.frag");

/// The images of the G-buffer, one pixel each.
pub struct GBuffer {
    /// R32F: view depth (m); 0 where there is no surface.
    pub view_depth: Arc<Image>,
    /// RG32UI: geometric and shading normal on the viewer's side, octahedral 2×16 bits.
    pub normals: Arc<Image>,
    /// RGBA16F: diffuse albedo, roughness (negative where there is no lobe).
    pub albedo: Arc<Image>,
    /// RGBA16F: F0; only in a glossy scene.
    pub specular: Option<Arc<Image>>,
    /// RGBA32F: emitted radiance (W/(m² sr)); only in an emissive scene.
    pub emission: Option<Arc<Image>>,
    depth: Arc<Image>,
    /// Width and height (px).
    pub size: [u32; 2],
}

impl GBuffer {
    /// Allocates what the scene needs.
    pub fn new(gpu: &Gpu, scene: &GpuScene, size: [u32; 2]) -> Result<Self, Error> {
        let image = |name: &str, format, usage| {
            let desc = ImageDesc {
                name: name.into(),
                extent: [size[0], size[1], 1],
                kind: ImageKind::D2,
                format,
                mips: 1,
                layers: 1,
                usage,
            };
            gpu.create_image(&desc)
        };
        let color = ImageUsage::COLOR | ImageUsage::SAMPLED;
        Ok(GBuffer {
            view_depth: image("gbuffer.view_depth", FORMATS[0], color)?,
            normals: image("gbuffer.normals", FORMATS[1], color)?,
            albedo: image("gbuffer.albedo", FORMATS[2], color)?,
            specular: scene
                .is_glossy
                .then(|| image("gbuffer.specular", FORMATS[3], color))
                .transpose()?,
            emission: scene
                .is_emissive
                .then(|| image("gbuffer.emission", FORMATS[4], color))
                .transpose()?,
            depth: image("gbuffer.depth", DEPTH, ImageUsage::DEPTH)?,
            size,
        })
    }

    /// Draws the scene.
    pub fn draw(&self, frame: &mut Frame, scene: &GpuScene) {
        let pass = match (scene.is_glossy, scene.is_emissive) {
            (false, false) => &GBUFFER_DIFFUSE,
            (true, false) => &GBUFFER_GLOSSY,
            (false, true) => &GBUFFER_EMISSIVE,
            (true, true) => &GBUFFER_GLOSSY_EMISSIVE,
        };
        let black = ClearOrLoad::Clear([0.0; 4]);
        let mut color = vec![
            (&self.view_depth, 0, 0, black),
            (&self.normals, 0, 0, ClearOrLoad::ClearUint(0)),
            (&self.albedo, 0, 0, black),
        ];
        color.extend(
            self.specular
                .iter()
                .chain(&self.emission)
                .map(|image| (image, 0, 0, black)),
        );
        let targets = Targets {
            color: &color,
            depth: Some((&self.depth, 0, black)),
            extent: self.size,
        };
        frame.pass(pass).draw(targets, material_draws(scene));
    }
}

/// One draw for the triangles of each material.
pub(super) fn material_draws(scene: &GpuScene) -> Vec<DrawBatch> {
    let draw = |batch: &crate::scene::Batch| DrawBatch {
        material: batch.material,
        push: Vec::new(),
        first_vertex: 3 * batch.first_triangle,
        vertex_count: 3 * batch.triangle_count,
    };
    scene.batches.iter().map(draw).collect()
}
