//! The inside of a unit sphere of albedo 0.5 with a point light of intensity π W/sr at its centre.
//!
//! Direct irradiance is π, so once-reflected radiance is 1/2, each further bounce halves it, and
//! all bounces sum to a radiance of 1 (pbrt's analytic scene).

use glam::Vec3;

use super::super::{Camera, Light, Scene};
use super::mesh::Mesh;
use super::{BundledScene, Parameter, Values, WHOLE_NUMBER};

pub(super) const ROW: BundledScene = BundledScene {
    name: "lit-sphere",
    description: "inside of a unit sphere, albedo 0.5, point light of pi W/sr at its centre: \
                  radiance 1",
    parameters: &[Parameter {
        name: "subdivisions",
        description: "how often the icosahedron is subdivided: 20 × 4ⁿ triangles",
        unit: WHOLE_NUMBER,
        min: 0.0,
        max: 8.0,
        default: 5.0,
    }],
    build,
};

fn build(values: &Values) -> Scene {
    let mut mesh = Mesh::default();
    let wall = mesh.matte("wall", [0.5; 3]);
    mesh.sphere(
        wall,
        Vec3::ZERO,
        1.0,
        values.number("subdivisions") as u32,
        true,
    );
    let light = Light::Point {
        position: Vec3::ZERO,
        intensity: Vec3::splat(std::f32::consts::PI),
    };
    let camera = Camera {
        eye: Vec3::new(0.3, 0.2, 0.5),
        target: Vec3::new(-0.5, 0.0, -0.6),
        up: Vec3::Y,
        vfov_deg: 60.0,
    };
    mesh.into_scene("lit-sphere", vec![light], Vec3::ZERO, camera)
}
