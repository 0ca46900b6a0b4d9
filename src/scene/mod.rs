//! The scene on the CPU: what every renderer in this crate, GPU technique or reference, is given.
//!
//! Lengths are metres, +y is up, light is linear RGB in the units of [`crate`]'s radiometric
//! contract. Triangles are sorted by material, so that a material is one contiguous range
//! ([`Scene::batches`]).

mod assemble;
pub mod bundled;
mod camera;
pub(crate) mod clear;
mod clear_sky;
mod environment;
mod error;
mod gltf;
mod hash;
mod light;
mod lit;
mod load;
mod lobes;
mod material;
mod model;
mod motion;
mod mtl;
mod obj;
mod options;
mod paths;
mod picture;
mod place;
mod polygon;
pub(crate) mod rays;
mod shot;
mod sight;
mod sky;
mod sun;
pub(crate) mod surfaces;
mod texture;
pub(crate) mod texture_sampler;
mod textures;
mod toml;
mod write;

pub use camera::Camera;
pub use clear_sky::ClearSky;
pub use environment::Environment;
pub use error::SceneError;
pub use hash::Fnv;
pub use light::Light;
pub use lit::{LitPoint, SurfacePoint};
pub use material::{Material, Specular, Transmission};
pub(crate) use motion::union;
pub use motion::{Keyframe, Motion, Pose};
pub use options::{LoadOptions, Up};
pub use shot::Shot;
pub use sight::Sight;
pub use sky::{Sky, SkySample, SkySource};
pub use texture::{Texture, TextureKind};
pub use write::{camera_toml, environment_toml, lights_toml};

use std::path::PathBuf;
use std::sync::Arc;

use glam::Vec3;

/// One vertex.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// World-space position (m).
    pub position: [f32; 3],
    /// First texture coordinate, to the right.
    pub u: f32,
    /// Unit shading normal in world space.
    pub normal: [f32; 3],
    /// Second texture coordinate, upwards (OBJ convention: v = 0 is the bottom row of the picture).
    pub v: f32,
}

/// One triangle: three vertices, counter-clockwise from the front, and its material.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Triangle {
    /// Indices into [`Scene::vertices`].
    pub vertices: [u32; 3],
    /// Index into [`Scene::materials`].
    pub material: u32,
}

/// The triangles of one material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Batch {
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// First triangle of the range.
    pub first_triangle: u32,
    /// Number of triangles in the range, at least one.
    pub triangle_count: u32,
}

/// One model of a scene: a contiguous range of its triangles, whose vertices and materials belong
/// to no other model.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// The OBJ file's stem or the bundled scene's name.
    pub name: String,
    /// Whether the model may move.
    pub dynamic: bool,
    /// First triangle of the range.
    pub first_triangle: u32,
    /// Number of triangles in the range, at least one.
    pub triangle_count: u32,
    /// How it moves; `None` where nothing says so. Only dynamic models have one.
    pub motion: Option<Motion>,
}

/// A whole scene, in world space, at one time: the time of the last [`Scene::set_time`], or 0 s
/// after loading.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Name for reports: the file's stem or the bundled scene's name.
    pub name: String,
    /// Vertices of all triangles.
    pub vertices: Vec<Vertex>,
    /// All triangles, sorted by material.
    pub triangles: Vec<Triangle>,
    /// All materials; none is unused, and there is at least one where there is a triangle.
    pub materials: Vec<Material>,
    /// All models, in the order of their triangles.
    pub models: Vec<Model>,
    /// All textures, each referred to by at least one material. Copies of the scene share them.
    pub textures: Vec<Arc<Texture>>,
    /// All analytic lights.
    pub lights: Vec<Light>,
    /// Light from far away.
    pub environment: Environment,
    /// The camera that a picture is taken with.
    pub camera: Camera,
    /// The files that it was read from; none of a bundled scene.
    pub files: Vec<PathBuf>,
}

impl Scene {
    /// Smallest and largest corner of the bounding box \[m\]; `None` without triangles.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.bounds_of(0..self.triangles.len())
    }

    /// The triangle ranges of the materials, in order.
    pub fn batches(&self) -> Vec<Batch> {
        let mut batches: Vec<Batch> = Vec::new();
        for (index, triangle) in self.triangles.iter().enumerate() {
            match batches.last_mut() {
                Some(batch) if batch.material == triangle.material => batch.triangle_count += 1,
                _ => batches.push(Batch {
                    material: triangle.material,
                    first_triangle: index as u32,
                    triangle_count: 1,
                }),
            }
        }
        batches
    }

    /// Whether any surface emits.
    pub fn is_emissive(&self) -> bool {
        self.materials
            .iter()
            .any(|material| material.emission != Vec3::ZERO)
    }

    /// Whether any surface has a specular lobe.
    pub fn is_glossy(&self) -> bool {
        self.materials
            .iter()
            .any(|material| material.specular.is_some())
    }
}
