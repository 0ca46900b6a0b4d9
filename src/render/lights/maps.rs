//! Shadow maps and reflective shadow maps (Dachsbacher & Stamminger 2005) of all lights.

use std::sync::Arc;

use glam::Vec3;

use super::super::GpuScene;
use super::super::gpu_scene::{TextureUse, storage};
use super::cascades::Watcher;
use super::views::{GpuLightView, ViewRanges, Viewed, light_views, sees, without_power};
use crate::gpu_struct;
use crate::graph::{
    Access, Binding, Buffer, BufferDesc, BufferUsage, ClearOrLoad, DrawBatch, Error, Frame, Gpu,
    Image, ImageDesc, ImageKind, ImageUsage, Owner, Pass, RasterState, Sets, Shaders, Targets, vk,
};
use crate::scene::Light;
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

static BINDINGS: [Binding; 1] = [Binding::buffer("light_views", Access::RasterRead)];

/// Depth of a light view. Reads the scene, writes a D32 layer (reversed depth); one draw a
/// material.
pub static SHADOW_MAPS: Pass = shadow_maps(
    "render/lights/light_view.vert",
    "render/lights/shadow_map.frag",
);

/// As [`SHADOW_MAPS`], of a cascade: the same texel has the same depth, bit by bit, wherever the
/// map is.
pub static SHADOW_CASCADES: Pass = shadow_maps(
    "render/lights/light_cascade.vert",
    "render/lights/shadow_cascade.frag",
);

const fn shadow_maps(vertex: &'static str, fragment: &'static str) -> Pass {
    Pass {
        name: "render.shadow_maps",
        shaders: Shaders::Raster {
            vertex,
            geometry: None,
            fragment: Some(fragment),
            state: RasterState {
                depth: Some(DEPTH),
                depth_compare: vk::CompareOp::GREATER,
                ..RasterState::NO_TARGETS
            },
        },
        bindings: &BINDINGS,
        constants: &["MASKED"],
        params: Some(ViewParams::LAYOUT),
        sets: Sets::SceneAndMaterials,
    }
}

/// Depth, normal and reflected share of a light view. Writes D32, R32UI (octahedral normal) and
/// A2B10G10R10 (square root of albedo × falloff).
pub static RSM: Pass = rsm("render/lights/light_view.vert", "render/lights/rsm.frag");

/// As [`RSM`], of a cascade ([`SHADOW_CASCADES`]).
pub static RSM_CASCADES: Pass = rsm(
    "render/lights/light_cascade.vert",
    "render/lights/rsm_cascade.frag",
);

const fn rsm(vertex: &'static str, fragment: &'static str) -> Pass {
    Pass {
        name: "render.rsm",
        shaders: Shaders::Raster {
            vertex,
            geometry: None,
            fragment: Some(fragment),
            state: RasterState {
                color: &[vk::Format::R32_UINT, vk::Format::A2B10G10R10_UNORM_PACK32],
                depth: Some(DEPTH),
                depth_compare: vk::CompareOp::GREATER,
                ..RasterState::NO_TARGETS
            },
        },
        bindings: &BINDINGS,
        constants: &["MASKED", "TEXTURED", "SPOT"],
        params: Some(ViewParams::LAYOUT),
        sets: Sets::SceneAndMaterials,
    }
}

/// The maps of all lights: array images with one layer a view (at least one, so that they can be
/// bound).
pub struct LightMaps {
    /// The views, a storage buffer of [`GpuLightView`].
    pub views: Arc<Buffer>,
    /// Depth, reversed.
    pub depth: Arc<Image>,
    /// RSM normal and reflected share, where a technique asked for them, of the first
    /// `view_count` views.
    pub rsm: Option<[Arc<Image>; 2]>,
    /// Room for what a technique notes of the RSM's tiles, [`TILE`] texels wide: two words a tile
    /// of all views; and four words and then one a tile, a list of some.
    pub tiles: [Arc<Buffer>; 2],
    /// Number of views for lookups anywhere and for injection. Behind them are those for what the
    /// camera sees, where directional lights have cascades.
    pub view_count: u32,
    /// Width and height of each map (texels).
    pub size: u32,
    /// How often views have moved since the maps were made.
    pub moves: u64,
    /// The views as they are in `views`.
    rows: Vec<GpuLightView>,
    /// Whether each is drawn as it is.
    is_drawn: Vec<bool>,
    /// The lights that the maps are of.
    lights: Vec<Light>,
}

impl LightMaps {
    /// Allocates the maps of a scene's lights; with `with_rsm` also what injection reads.
    pub fn new(gpu: &Gpu, scene: &GpuScene, size: u32, with_rsm: bool) -> Result<Self, Error> {
        let rows = light_views(&viewed(scene, size, None));
        let view_count = ViewRanges::of(&scene.lights, scene.cascades).anywhere;
        Self::of_views(gpu, rows, (view_count, &scene.lights), size, with_rsm)
    }

    /// No maps, for frames that read none.
    pub fn none(gpu: &Gpu) -> Result<Self, Error> {
        Self::of_views(gpu, Vec::new(), (0, &[]), 1, false)
    }

    fn of_views(
        gpu: &Gpu,
        rows: Vec<GpuLightView>,
        (view_count, lights): (u32, &[Light]),
        size: u32,
        with_rsm: bool,
    ) -> Result<Self, Error> {
        let image = |name: &str, format, usage, layers: u32| {
            let extent = if layers == 0 {
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
                layers: layers.max(1),
                usage,
                owner: Owner::Shared,
            })
        };
        let color = ImageUsage::COLOR | ImageUsage::SAMPLED;
        let rsm = || {
            Ok([
                image("light.rsm_normal", vk::Format::R32_UINT, color, view_count)?,
                image(
                    "light.rsm_reflected",
                    vk::Format::A2B10G10R10_UNORM_PACK32,
                    color,
                    view_count,
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
                bytemuck::cast_slice(&rows),
            )?,
            depth: image(
                "light.depth",
                DEPTH,
                ImageUsage::DEPTH | ImageUsage::SAMPLED,
                rows.len() as u32,
            )?,
            rsm: with_rsm.then(rsm).transpose()?,
            view_count,
            size,
            moves: 0,
            is_drawn: vec![false; rows.len()],
            rows,
            lights: lights.to_vec(),
        })
    }

    /// The views: first those for lookups anywhere, then those for what the camera sees.
    pub fn rows(&self) -> &[GpuLightView] {
        &self.rows
    }

    /// Brings the views up to the lights and to the camera. What is then seen otherwise has to be
    /// drawn again.
    pub fn follow(
        &mut self,
        gpu: &Gpu,
        scene: &GpuScene,
        watcher: Option<Watcher>,
    ) -> Result<(), Error> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let rows = light_views(&viewed(scene, self.size, watcher));
        let mut moved = false;
        for (index, row) in rows.iter().enumerate() {
            let light = row.light[0] as usize;
            let same_light =
                without_power(&scene.lights[light]) == without_power(&self.lights[light]);
            moved |= *row != self.rows[index];
            self.is_drawn[index] &= same_light && *row == self.rows[index];
        }
        if moved {
            self.moves += 1;
            gpu.upload_buffer(&self.views, bytemuck::cast_slice(&rows))?;
        }
        self.rows = rows;
        self.lights.clone_from(&scene.lights);
        Ok(())
    }

    /// What a box holds has moved (m): the views that see some of it have to be drawn again.
    pub fn moved_in(&mut self, bounds: (Vec3, Vec3)) {
        for (row, is_drawn) in self.rows.iter().zip(&mut self.is_drawn) {
            *is_drawn &= !sees(row, bounds);
        }
    }

    /// All views have to be drawn again.
    pub fn forget(&mut self) {
        self.is_drawn.fill(false);
    }

    /// What [`LightMaps::draw`] added has been drawn.
    pub fn keep(&mut self) {
        self.is_drawn.fill(true);
    }

    /// Adds the passes that draw the views that are not drawn yet.
    pub fn draw(&self, frame: &mut Frame, scene: &GpuScene) {
        for view in (0..self.rows.len() as u32).filter(|view| !self.is_drawn[*view as usize]) {
            self.draw_view(frame, scene, view);
        }
    }

    /// Draws those surfaces together that sample the same kinds of textures: a pixel without does
    /// not pay for them.
    fn draw_view(&self, frame: &mut Frame, scene: &GpuScene, view: u32) {
        let push = bytemuck::bytes_of(&ViewParams { view }).to_vec();
        let of_kind = |kind| (kind, scene.draws_where(|textures| textures == kind));
        let mut kinds: Vec<_> = TextureUse::ALL.map(of_kind).into();
        kinds.retain(|(_, draws)| !draws.is_empty());
        if kinds.is_empty() {
            // A map of nothing is clear.
            kinds.push((TextureUse::None, Vec::new()));
        }
        for (index, (kind, draws)) in kinds.into_iter().enumerate() {
            let with_push = |draw| DrawBatch {
                push: push.clone(),
                ..draw
            };
            let draws = draws.into_iter().map(with_push).collect();
            let [clear, clear_uint] = if index == 0 {
                [ClearOrLoad::Clear([0.0; 4]), ClearOrLoad::ClearUint(0)]
            } else {
                [ClearOrLoad::Load; 2]
            };
            let color: Vec<_> = match &self.rsm {
                Some([normal, reflected]) if view < self.view_count => {
                    vec![(normal, 0, view, clear_uint), (reflected, 0, view, clear)]
                }
                _ => Vec::new(),
            };
            let targets = Targets {
                color: &color,
                depth: Some((&self.depth, view, clear)),
                extent: [self.size; 2],
                viewport: None,
            };
            let is_cascade = self.rows[view as usize].anchor[3] > 0.0;
            let pass = match (color.is_empty(), is_cascade) {
                (true, false) => frame.pass(&SHADOW_MAPS),
                (true, true) => frame.pass(&SHADOW_CASCADES),
                (false, false) => frame.pass(&RSM),
                (false, true) => frame.pass(&RSM_CASCADES),
            };
            let pass = pass
                .bind("light_views", &self.views)
                .constant("MASKED", kind == TextureUse::Masked);
            let pass = if color.is_empty() {
                pass
            } else {
                let light = self.lights[self.rows[view as usize].light[0] as usize];
                pass.constant("TEXTURED", kind != TextureUse::None)
                    .constant("SPOT", matches!(light, Light::Spot { .. }))
            };
            pass.draw_indexed(targets, &scene.corners, draws);
        }
    }
}

fn viewed(scene: &GpuScene, size: u32, watcher: Option<Watcher>) -> Viewed<'_> {
    Viewed {
        lights: &scene.lights,
        bounds: scene.lit_bounds(),
        size,
        cascades: scene.cascades,
        watcher,
    }
}
