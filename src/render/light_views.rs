//! Shadow maps and reflective shadow maps (Dachsbacher & Stamminger 2005): one view of a
//! directional or spot light, six of a point light.

use std::sync::Arc;

use glam::{Mat4, Vec3, Vec4};

use super::GpuScene;
use super::gbuffer::material_draws;
use super::gpu_scene::storage;
use crate::gpu_struct;
use crate::graph::{
    Access, Binding, Buffer, BufferDesc, BufferUsage, ClearOrLoad, DrawBatch, Error, Frame, Gpu,
    Image, ImageDesc, ImageKind, ImageUsage, Pass, RasterState, Sets, Shaders, Targets, vk,
};
use crate::scene::Light;

gpu_struct! {
    /// One light view as the shaders read it (`LightView` in `shared/light_view.glsl`).
    pub struct GpuLightView {
        /// World to clip space; depth is reversed.
        pub clip_from_world: [[f32; 4]; 4],
        /// xyz: light position, or the map's centre on its near plane (m); w: 0 parallel, 1
        /// perspective.
        pub origin_kind: [f32; 4],
        /// xyz: from the map's centre to its right edge (m, or per unit of view depth); w: depth
        /// range of a parallel view (m).
        pub right: [f32; 4],
        /// xyz: from the map's centre to its lower edge, likewise.
        pub down: [f32; 4],
        /// xyz: unit direction of travel; w: depth of the near plane (m).
        pub forward: [f32; 4],
        /// x: index of the light; y: map size (texels).
        pub light: [u32; 4],
    }
}

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
        vertex: "render/light_view.vert",
        geometry: None,
        fragment: Some("render/shadow_map.frag"),
        state: RasterState {
            depth: Some(DEPTH),
            depth_compare: vk::CompareOp::GREATER,
            ..RasterState::NO_TARGETS
        },
    },
    bindings: &[Binding::buffer("light_views", Access::RasterRead)],
    push_bytes: size_of::<ViewParams>() as u32,
    sets: Sets::SceneAndMaterials,
};

/// Depth, normal and reflected share of every light view. Writes D32, R32UI (octahedral normal) and
/// A2B10G10R10 (square root of albedo × falloff).
pub static RSM: Pass = Pass {
    name: "render.rsm",
    shaders: Shaders::Raster {
        vertex: "render/light_view.vert",
        geometry: None,
        fragment: Some("render/rsm.frag"),
        state: RasterState {
            color: &[vk::Format::R32_UINT, vk::Format::A2B10G10R10_UNORM_PACK32],
            depth: Some(DEPTH),
            depth_compare: vk::CompareOp::GREATER,
            ..RasterState::NO_TARGETS
        },
    },
    bindings: &[Binding::buffer("light_views", Access::RasterRead)],
    push_bytes: size_of::<ViewParams>() as u32,
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
    /// Of each tile of the RSM, [`TILE`] texels wide, what depths it has; and a list of tiles
    /// (`gi/shared/voxel/light/list_tiles.comp`).
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
            })
        };
        Ok(LightMaps {
            tiles: [
                words("light.tile_depths", 2 * tiles)?,
                words("light.listed_tiles", 4 + tiles)?,
            ],
            views: storage(gpu, "light.views", bytemuck::cast_slice(views))?,
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
            };
            let pass = if self.rsm.is_some() {
                &RSM
            } else {
                &SHADOW_MAPS
            };
            frame.pass(pass).bind(&self.views).draw(targets, draws);
        }
    }
}

/// The views of all lights, in the order of the lights.
fn light_views(lights: &[Light], bounds: (Vec3, Vec3), size: u32) -> Vec<GpuLightView> {
    let size_m = (bounds.1 - bounds.0).length().max(1e-6);
    let mut views = Vec::new();
    for (index, light) in lights.iter().enumerate() {
        let light_index = [index as u32, size, 0, 0];
        match *light {
            Light::Directional { direction, .. } => {
                views.push(parallel_view(direction, bounds, light_index))
            }
            Light::Point { position, .. } => {
                for (forward, right, down) in CUBE_FACES {
                    views.push(perspective_view(
                        position,
                        forward,
                        right,
                        down,
                        1e-4 * size_m,
                        light_index,
                    ));
                }
            }
            Light::Spot {
                position,
                direction,
                outer_deg,
                ..
            } => {
                let right = direction.any_orthonormal_vector();
                let extent = outer_deg.to_radians().tan() * 1.01;
                views.push(perspective_view(
                    position,
                    direction,
                    right * extent,
                    direction.cross(right) * extent,
                    1e-4 * size_m,
                    light_index,
                ));
            }
        }
    }
    views
}

/// Forward, right and down of the six views of a point light: +x, −x, +y, −y, +z, −z.
const CUBE_FACES: [(Vec3, Vec3, Vec3); 6] = [
    (Vec3::X, Vec3::Z, Vec3::NEG_Y),
    (Vec3::NEG_X, Vec3::NEG_Z, Vec3::NEG_Y),
    (Vec3::Y, Vec3::X, Vec3::Z),
    (Vec3::NEG_Y, Vec3::X, Vec3::NEG_Z),
    (Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y),
    (Vec3::NEG_Z, Vec3::X, Vec3::NEG_Y),
];

/// A parallel view that covers the whole scene.
fn parallel_view(direction: Vec3, bounds: (Vec3, Vec3), light: [u32; 4]) -> GpuLightView {
    let (low, high) = bounds;
    let right = direction.any_orthonormal_vector();
    let down = direction.cross(right);
    let corners = (0..8).map(|i| {
        Vec3::select(
            glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0),
            high,
            low,
        )
    });
    let range = |axis: Vec3| {
        corners
            .clone()
            .map(|corner| corner.dot(axis))
            .fold((f32::MAX, f32::MIN), |(a, b), x| (a.min(x), b.max(x)))
    };
    let ((x0, x1), (y0, y1), (z0, z1)) = (range(right), range(down), range(direction));
    // A little more than the scene, so that no surface lies on the border or on the near plane.
    let margin = 1e-3 * (high - low).length().max(1e-6);
    let half = Vec3::new(
        0.5 * (x1 - x0) + margin,
        0.5 * (y1 - y0) + margin,
        z1 - z0 + 2.0 * margin,
    );
    let origin = right * (0.5 * (x0 + x1)) + down * (0.5 * (y0 + y1)) + direction * (z0 - margin);
    let world = Mat4::from_cols(
        right.extend(0.0),
        down.extend(0.0),
        direction.extend(0.0),
        origin.extend(1.0),
    );
    let clip = Mat4::from_cols(
        Vec4::new(1.0 / half.x, 0.0, 0.0, 0.0),
        Vec4::new(0.0, 1.0 / half.y, 0.0, 0.0),
        Vec4::new(0.0, 0.0, -1.0 / half.z, 0.0),
        Vec4::new(0.0, 0.0, 1.0, 1.0),
    );
    GpuLightView {
        clip_from_world: (clip * world.inverse()).to_cols_array_2d(),
        origin_kind: origin.extend(0.0).to_array(),
        right: (right * half.x).extend(half.z).to_array(),
        down: (down * half.y).extend(0.0).to_array(),
        forward: direction.extend(0.0).to_array(),
        light,
    }
}

/// A perspective view; `right` and `down` reach the map's edges at unit depth.
fn perspective_view(
    position: Vec3,
    forward: Vec3,
    right: Vec3,
    down: Vec3,
    near_m: f32,
    light: [u32; 4],
) -> GpuLightView {
    let world = Mat4::from_cols(
        right.extend(0.0),
        down.extend(0.0),
        forward.extend(0.0),
        position.extend(1.0),
    );
    let clip = Mat4::from_cols(
        Vec4::X,
        Vec4::Y,
        Vec4::new(0.0, 0.0, 0.0, 1.0),
        Vec4::new(0.0, 0.0, near_m, 0.0),
    );
    GpuLightView {
        clip_from_world: (clip * world.inverse()).to_cols_array_2d(),
        origin_kind: position.extend(1.0).to_array(),
        right: right.extend(0.0).to_array(),
        down: down.extend(0.0).to_array(),
        forward: forward.extend(near_m).to_array(),
        light,
    }
}
