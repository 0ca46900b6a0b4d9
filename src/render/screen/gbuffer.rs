//! The G-buffer: what each pixel's surface is.

use std::sync::Arc;

use super::super::gpu_scene::{FrameConstants, GpuScene, TextureUse};
use super::motion::{MotionParams, Previous};
use crate::graph::{
    Access, Binding, ClearOrLoad, Error, Frame, Gpu, Image, ImageDesc, ImageKind, ImageUsage,
    Owner, Pass, RasterState, Sets, Shaders, Targets, vk,
};
use crate::shader::GpuStruct;

const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
const VIEW_DEPTH: vk::Format = vk::Format::R32_SFLOAT;
const NORMALS: vk::Format = vk::Format::R32G32_UINT;
const ALBEDO: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
const SPECULAR: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
const EMISSION: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
const MOTION: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
const MATERIAL: vk::Format = vk::Format::R32_UINT;

const PREVIOUS: &[Binding] = &[Binding::buffer("previous_positions", Access::RasterRead)];

const fn gbuffer_pass(color: &'static [vk::Format], fragment: &'static str) -> Pass {
    Pass {
        name: "render.gbuffer",
        shaders: shaders("render/screen/gbuffer.vert", fragment, color),
        bindings: &[],
        constants: TEXTURES,
        params: None,
        sets: Sets::SceneAndMaterials,
    }
}

/// Whether materials have masks, any other textures but bumps, and bumps.
const TEXTURES: &[&str] = &["MASKED", "TEXTURED", "BUMPED"];

const fn motion_pass(color: &'static [vk::Format], fragment: &'static str) -> Pass {
    Pass {
        name: "render.gbuffer",
        shaders: shaders("render/screen/gbuffer_motion.vert", fragment, color),
        bindings: PREVIOUS,
        constants: TEXTURES,
        params: Some(MotionParams::LAYOUT),
        sets: Sets::SceneAndMaterials,
    }
}

const fn shaders(
    vertex: &'static str,
    fragment: &'static str,
    color: &'static [vk::Format],
) -> Shaders {
    Shaders::Raster {
        vertex,
        geometry: None,
        fragment: Some(fragment),
        state: RasterState {
            color,
            depth: Some(DEPTH),
            depth_compare: vk::CompareOp::GREATER,
            ..RasterState::NO_TARGETS
        },
    }
}

/// The passes that draw the G-buffer, by what there is to draw: 1 for a glossy scene, 2 for an
/// emissive one, 4 for motion, 8 for motion and materials, or a sum of these. Reads the scene, and
/// for motion where dynamic models were; writes the images of [`GBuffer`] and a depth buffer.
pub static GBUFFER: [Pass; 12] = [
    gbuffer_pass(&[VIEW_DEPTH, NORMALS, ALBEDO], "render/screen/gbuffer.frag"),
    gbuffer_pass(
        &[VIEW_DEPTH, NORMALS, ALBEDO, SPECULAR],
        "render/screen/gbuffer_glossy.frag",
    ),
    gbuffer_pass(
        &[VIEW_DEPTH, NORMALS, ALBEDO, EMISSION],
        "render/screen/gbuffer_emissive.frag",
    ),
    gbuffer_pass(
        &[VIEW_DEPTH, NORMALS, ALBEDO, SPECULAR, EMISSION],
        "render/screen/gbuffer_glossy_emissive.frag",
    ),
    motion_pass(
        &[VIEW_DEPTH, NORMALS, ALBEDO, MOTION],
        "render/screen/gbuffer_motion.frag",
    ),
    motion_pass(
        &[VIEW_DEPTH, NORMALS, ALBEDO, SPECULAR, MOTION],
        "render/screen/gbuffer_glossy_motion.frag",
    ),
    motion_pass(
        &[VIEW_DEPTH, NORMALS, ALBEDO, EMISSION, MOTION],
        "render/screen/gbuffer_emissive_motion.frag",
    ),
    motion_pass(
        &[VIEW_DEPTH, NORMALS, ALBEDO, SPECULAR, EMISSION, MOTION],
        "render/screen/gbuffer_glossy_emissive_motion.frag",
    ),
    motion_pass(
        &[VIEW_DEPTH, NORMALS, ALBEDO, MOTION, MATERIAL],
        "render/screen/gbuffer_material.frag",
    ),
    motion_pass(
        &[VIEW_DEPTH, NORMALS, ALBEDO, SPECULAR, MOTION, MATERIAL],
        "render/screen/gbuffer_glossy_material.frag",
    ),
    motion_pass(
        &[VIEW_DEPTH, NORMALS, ALBEDO, EMISSION, MOTION, MATERIAL],
        "render/screen/gbuffer_emissive_material.frag",
    ),
    motion_pass(
        &[
            VIEW_DEPTH, NORMALS, ALBEDO, SPECULAR, EMISSION, MOTION, MATERIAL,
        ],
        "render/screen/gbuffer_glossy_emissive_material.frag",
    ),
];

/// What a G-buffer follows from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Follows {
    /// Nothing.
    Nothing,
    /// Where surfaces were in the frame before.
    Motion,
    /// That, and which material each pixel showed.
    Materials,
}

/// The images of the G-buffer, one pixel each.
pub struct GBuffer {
    /// R32F: view depth (m); 0 where there is no surface.
    pub view_depth: Arc<Image>,
    /// RG32UI: geometric and shading normal on the viewer's side, octahedral 2×16 bits.
    pub normals: Arc<Image>,
    /// RGBA16F. rgb: diffuse albedo; a: length of the mean of the shading normals in the pixel, 0
    /// where there is no surface. It is less than 1 where a normal map's texels differ within the
    /// pixel. Light that no surface cuts off is linear in the normal, so what a light brings them
    /// is what it brings their mean direction, times this.
    pub albedo: Arc<Image>,
    /// RGBA16F: F0, roughness (negative where there is no lobe); only in a glossy scene.
    pub specular: Option<Arc<Image>>,
    /// RGBA32F: emitted radiance (W/(m² sr)); only in an emissive scene.
    pub emission: Option<Arc<Image>>,
    /// RGBA32F. rg: where the surface was in the picture of the frame before, less where it is (px,
    /// x to the right, y down), from both cameras and both poses of dynamic models; b: its view
    /// depth there (m); a: of what has moved, the shading normal there, packed
    /// (`shared/turned.glsl`), 0 elsewhere. Only where it was asked for. Both pictures count as of
    /// this frame's size. So a surface's place in the one before, as a share of it, is that of the
    /// pixel's centre and this together, whatever size that had. It may lie outside of it, and
    /// something else may have been in front. What was behind the camera has
    /// [`BEHIND_PX`](crate::render::BEHIND_PX). rg is 0 in the first frame, where nothing moved
    /// (exactly), and where there is no surface.
    pub motion: Option<Arc<Image>>,
    /// R32UI: 1 for the scene's first material; 0 where there is no surface. Of this frame and of
    /// the one before. Only where they were asked for.
    pub materials: Option<[Arc<Image>; 2]>,
    /// What motion is measured against, where there is motion.
    previous: Option<Previous>,
    depth: Arc<Image>,
    /// Width and height (px).
    pub size: [u32; 2],
}

impl GBuffer {
    /// Allocates what the scene needs, and what is to be followed.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        size: [u32; 2],
        follows: Follows,
    ) -> Result<Self, Error> {
        let image = |name: &str, format, usage| {
            let desc = ImageDesc {
                name: name.into(),
                extent: [size[0], size[1], 1],
                kind: ImageKind::D2,
                format,
                mips: 1,
                layers: 1,
                usage,
                owner: Owner::Shared,
            };
            gpu.create_image(&desc)
        };
        let color = ImageUsage::COLOR | ImageUsage::SAMPLED;
        // What is clear covers what is behind it.
        let emission = match &scene.clear {
            Some(_) => color | ImageUsage::STORAGE,
            None => color,
        };
        let with_motion = follows >= Follows::Motion;
        let material = || image("gbuffer.material", MATERIAL, color);
        let materials = || -> Result<_, Error> { Ok([material()?, material()?]) };
        Ok(GBuffer {
            view_depth: image("gbuffer.view_depth", VIEW_DEPTH, color)?,
            normals: image("gbuffer.normals", NORMALS, color)?,
            albedo: image("gbuffer.albedo", ALBEDO, color)?,
            specular: scene
                .is_glossy
                .then(|| image("gbuffer.specular", SPECULAR, color))
                .transpose()?,
            emission: scene
                .is_emissive
                .then(|| image("gbuffer.emission", EMISSION, emission))
                .transpose()?,
            motion: with_motion
                .then(|| image("gbuffer.motion", MOTION, color))
                .transpose()?,
            materials: (follows == Follows::Materials)
                .then(materials)
                .transpose()?,
            previous: with_motion.then(|| Previous::new(gpu, scene)).transpose()?,
            depth: image("gbuffer.depth", DEPTH, ImageUsage::DEPTH)?,
            size,
        })
    }

    /// [`GBuffer::motion`], for a stage for which the G-buffer was made with it.
    pub(crate) fn motion_asked_for(&self) -> &Arc<Image> {
        self.motion
            .as_ref()
            .unwrap_or_else(|| unreachable!("a stage that reads motion asks for it"))
    }

    /// Keeps where the dynamic models are, for motion; called before they move. The pose of the
    /// frame before is the one that it showed, however often they move until the next.
    pub(crate) fn keep_pose(&mut self, gpu: &Gpu, scene: &GpuScene) {
        if let Some(previous) = &mut self.previous {
            previous.keep_pose(gpu, scene);
        }
    }

    /// The next frame is the first: nothing has moved in it.
    pub(crate) fn forget_frame(&mut self) {
        if let Some(previous) = &mut self.previous {
            previous.forget_frame();
        }
    }

    /// Makes the frame that was drawn with these constants the one before, for motion; called when
    /// it is done.
    pub(crate) fn keep_frame(&mut self, seen_with: &FrameConstants) {
        if let Some(previous) = &mut self.previous {
            previous.keep_frame(seen_with);
        }
        if let Some(materials) = &mut self.materials {
            materials.reverse();
        }
    }

    /// Draws the scene.
    pub fn draw(&self, frame: &mut Frame, scene: &GpuScene) {
        let index = usize::from(scene.is_glossy)
            + 2 * usize::from(scene.is_emissive)
            + 4 * usize::from(self.motion.is_some())
            + 4 * usize::from(self.materials.is_some());
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
                .chain(&self.motion)
                .map(|image| (image, 0, 0, black)),
        );
        let nowhere = ClearOrLoad::ClearUint(0);
        color.extend((self.materials.iter()).map(|[now, _]| (now, 0, 0, nowhere)));
        let targets = Targets {
            color: &color,
            depth: Some((&self.depth, 0, black)),
            extent: self.size,
            viewport: None,
        };
        let uses = |kind| scene.texture_use.contains(&kind);
        let (masked, draws) = (uses(TextureUse::Masked), scene.draws());
        let pass = (frame.pass(&GBUFFER[index]))
            .constant("MASKED", masked)
            .constant(
                "TEXTURED",
                masked || uses(TextureUse::Textured) || scene.has_lobe_textures,
            )
            .constant("BUMPED", scene.is_bumped);
        match &self.previous {
            Some(previous) => pass
                .bind("previous_positions", previous.bound(scene))
                .draw_indexed(targets, &scene.corners, previous.draws(scene, draws)),
            None => pass.draw_indexed(targets, &scene.corners, draws),
        }
    }
}
