//! The oracle on cases computed by hand.

use std::f64::consts::PI;

use glam::DVec2;

use super::light::{arriving_light, at_weights, sample_weights};
use super::*;
use crate::gi::shared::voxel::Surface;
use crate::scene::{Light, Specular, Texture, TextureKind, Triangle};

mod fragments;
mod index;
mod light;
mod rays;
mod touching;

const UNIT_GRID: Grid = Grid {
    origin: Vec3::ZERO,
    voxel_size: 1.0,
    resolution: 4,
};

/// A scene of matt triangles, each with an albedo; the texture coordinates are (x, y).
fn scene_of(triangles: &[(GridTriangle, f32)]) -> Scene {
    let mut scene = Scene::default();
    for (corners, albedo) in triangles {
        let first = scene.vertices.len() as u32;
        let material = scene.materials.len() as u32;
        scene.vertices.extend(corners.map(|position| Vertex {
            position,
            u: position[0],
            normal: [0.0, 0.0, 1.0],
            v: position[1],
        }));
        scene.triangles.push(Triangle {
            vertices: [first, first + 1, first + 2],
            material,
        });
        scene.materials.push(Material {
            albedo: Vec3::splat(*albedo),
            ..Material::default()
        });
    }
    scene
}

/// A square of side `size` from the origin, at height z, facing up, in two triangles.
fn floor(size: f32, z: f32, albedo: f32) -> [(GridTriangle, f32); 2] {
    let corner = |x: f32, y: f32| [x * size, y * size, z];
    [
        (
            [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0)],
            albedo,
        ),
        (
            [corner(0.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)],
            albedo,
        ),
    ]
}

fn texture(kind: TextureKind, texels: &[[u8; 4]]) -> Texture {
    Texture {
        name: String::from("test"),
        kind,
        width: texels.len() as u32,
        height: 1,
        texels: texels.to_vec(),
    }
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9
}

fn near(a: DVec3, b: DVec3) -> bool {
    (a - b).abs().max_element() < 1e-9
}
