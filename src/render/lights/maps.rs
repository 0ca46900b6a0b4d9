//! Shadow maps and reflective shadow maps (Dachsbacher & Stamminger 2005) of all lights.

use std::sync::Arc;

use super::super::GpuScene;
use super::super::gpu_scene::{material_draws, storage};
use super::views::{GpuLightView, light_views};
use crate::gpu_struct;
use crate::graph::{
    Access, Binding, Buffer, BufferDesc, BufferUsage, ClearOrLoad, DrawBatch, Error, Frame, Gpu,
    Image, ImageDesc, ImageKind, ImageUsage, Owner, Pass, RasterState, Sets, Shaders, Targets, vk,
};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Which light view is drawn.
    pub struct ViewParams {
        /// Index of the light view, and layer of the maps.
        pub view: u32,
    }
}

/// Edge of a tile of an RSM (texels).
pub const TILE: u32 = 8;

const DEPTH: vk::Format = vk::Format::D32_SFLOAT;

/// Depth of every light view. Reads the scene, writes D32 layers (reversed depth); one draw a
/// material.
pub static SHADOW_MAPS: Pass = Pass {
    name: "render.shadow_maps",
    shaders: Shaders::Raster {
        vertex: "render/lights/light_view.vert",
        geometry: None,
        fragment: Some("render/lights/shadow_map.frag"),
        state: RasterState {
            depth: Some(DEPTH),
            depth_compare: vk::CompareOp::GREATER,
            ..RasterState::NO_TARGETS
        },
    },
    bindings: &[Binding::buffer("light_views", Access::RasterRead)],
    constants: &[],
    params: Some(ViewParams::LAYOUT),
    sets: Sets::SceneAndMaterials,
};

/// Depth, normal and reflected share of every light view. Writes D32, R32UI (octahedral normal) and
/// A2B10G10R10 (square root of albedo × falloff).
pub static RSM: Pass = Pass {
    name: "render.rsm",
    shaders: Shaders::Raster {
        vertex: "render/lights/light_view.vert",
        geometry: None,
        fragment: Some("render/lights/rsm.frag"),
        state: RasterState {
            color: &[vk::Format::R32_UINT, vk::Format::A2B10G10R10_UNORM_PACK32],
            depth: Some(DEPTH),
            depth_compare: vk::CompareOp::GREATER,
            ..RasterState::NO_TARGETS
        },
    },
    bindings: &[Binding::buffer("light_views", Access::RasterRead)],
    constants: &[],
    params: Some(ViewParams::LAYOUT),
    sets: Sets::SceneAndMaterials,
};

/// The maps of all lights: array images with one layer a view (at least one, so that they can be
/// bound).
pub struct LightMaps {
    /// The views, a storage buffer of [`GpuLightView`].
    pub views: Arc<Buffer>,
    /// Depth, reversed.
    pub depth: Arc<Image>,
    /// RSM normal and reflected share, where a technique asked for them.
    pub rsm: Option<[Arc<Image>; 2]>,
    /// Room for what a technique notes of the RSM's tiles, [`TILE`] texels wide: two words a tile
    /// of all views; and four words and then one a tile, a list of some.
    pub tiles: [Arc<Buffer>; 2],
    /// Number of views.
    pub view_count: u32,
    /// Width and height of each map (texels).
    pub size: u32,
}

impl LightMaps {
    /// Allocates the maps of a scene's lights; with `with_rsm` also what injection reads.
    pub fn new(gpu: &Gpu, scene: &GpuScene, size: u32, with_rsm: bool) -> Result<Self, Error> {
        Self::of_views(
            gpu,
            &light_views(&scene.lights, scene.lit_bounds(), size),
            size,
            with_rsm,
        )
    }

    /// No maps, for frames that read none.
    pub fn none(gpu: &Gpu) -> Result<Self, Error> {
        Self::of_views(gpu, &[], 1, false)
    }

    fn of_views(
        gpu: &Gpu,
        views: &[GpuLightView],
        size: u32,
        with_rsm: bool,
    ) -> Result<Self, Error> {
        let view_count = views.len() as u32;
        let image = |name: &str, format, usage| {
            let extent = if view_count == 0 {
                [1, 1, 1]
            } else {
                [size, size, 1]
            };
            gpu.create_image(&ImageDesc {
                name: name.into(),
                extent,
                kind: ImageKind::D2Array,
                format,
                mips: 1,
                layers: view_count.max(1),
                usage,
                owner: Owner::Shared,
            })
        };
        let color = ImageUsage::COLOR | ImageUsage::SAMPLED;
        let rsm = || {
            Ok([
                image("light.rsm_normal", vk::Format::R32_UINT, color)?,
                image(
                    "light.rsm_reflected",
                    vk::Format::A2B10G10R10_UNORM_PACK32,
                    color,
                )?,
            ])
        };
        let tiles = if with_rsm {
            u64::from(view_count) * u64::from(size.div_ceil(TILE)).pow(2)
        } else {
            0
        };
        let words = |name: &str, count: u64| {
            gpu.create_buffer(&BufferDesc {
                name: name.into(),
                size_bytes: 4 * count.max(4),
                usage: BufferUsage::Storage,
                owner: Owner::Shared,
            })
        };
        Ok(LightMaps {
            tiles: [
                words("light.tile_depths", 2 * tiles)?,
                words("light.listed_tiles", 4 + tiles)?,
            ],
            views: storage(
                gpu,
                ("light.views", Owner::Shared),
                bytemuck::cast_slice(views),
            )?,
            depth: image(
                "light.depth",
                DEPTH,
                ImageUsage::DEPTH | ImageUsage::SAMPLED,
            )?,
            rsm: with_rsm.then(rsm).transpose()?,
            view_count,
            size,
        })
    }

    /// Brings the views up to the lights after [`GpuScene::move_lights`].
    pub(crate) fn move_lights(&self, gpu: &Gpu, scene: &GpuScene) -> Result<(), Error> {
        if self.view_count == 0 {
            return Ok(());
        }
        gpu.upload_buffer(
            &self.views,
            bytemuck::cast_slice(&light_views(&scene.lights, scene.lit_bounds(), self.size)),
        )
    }

    /// Draws every view.
    pub fn draw(&self, frame: &mut Frame, scene: &GpuScene) {
        let clear = ClearOrLoad::Clear([0.0; 4]);
        for view in 0..self.view_count {
            let push = bytemuck::bytes_of(&ViewParams { view }).to_vec();
            let draws: Vec<DrawBatch> = material_draws(scene)
                .into_iter()
                .map(|draw| DrawBatch {
                    push: push.clone(),
                    ..draw
                })
                .collect();
            let color: Vec<_> = match &self.rsm {
                Some([normal, reflected]) => vec![
                    (normal, 0, view, ClearOrLoad::ClearUint(0)),
                    (reflected, 0, view, clear),
                ],
                None => Vec::new(),
            };
            let targets = Targets {
                color: &color,
                depth: Some((&self.depth, view, clear)),
                extent: [self.size; 2],
                viewport: None,
            };
            let pass = if self.rsm.is_some() {
                &RSM
            } else {
                &SHADOW_MAPS
            };
            frame
                .pass(pass)
                .bind("light_views", &self.views)
                .draw(targets, draws);
        }
    }
}
