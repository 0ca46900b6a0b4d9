//! The furnace: a closed box that glows everywhere. Radiance is emission / (1 − albedo) at every
//! point and in every direction.

use glam::Vec3;

use super::super::{Camera, Material, Scene};
use super::mesh::Mesh;
use super::{BundledScene, Parameter, Values};

pub(super) const ROW: BundledScene = BundledScene {
    name: "furnace",
    description: "closed 2 m box, emitting everywhere: radiance is emission / (1 - albedo)",
    parameters: &[
        Parameter {
            name: "albedo",
            description: "albedo of all walls",
            unit: "",
            min: 0.0,
            max: 0.99,
            default: 0.5,
        },
        Parameter {
            name: "emission",
            description: "radiance that all walls emit",
            unit: "W/(m² sr)",
            min: 0.0,
            max: 1e6,
            default: 0.5,
        },
    ],
    build,
};

fn build(values: &Values) -> Scene {
    let mut mesh = Mesh::default();
    let wall = mesh.material(Material {
        name: String::from("wall"),
        albedo: Vec3::splat(values.number("albedo")),
        emission: Vec3::splat(values.number("emission")),
        ..Material::default()
    });
    let cuts: &[f32] = &[-1.0, 1.0];
    mesh.room([cuts; 3], |_, _| Some(wall));
    let camera = Camera {
        eye: Vec3::new(0.6, 0.3, 0.7),
        target: Vec3::new(-1.0, -0.2, -0.9),
        up: Vec3::Y,
        vfov_deg: 60.0,
    };
    mesh.into_scene("furnace", Vec::new(), Vec3::ZERO, camera)
}
