//! The Cornell box lit by a lamp in its ceiling, flush with it.

use glam::Vec3;

use super::super::{Material, Scene};
use super::mesh::{HIGH_X, HIGH_Y, LOW_X, Mesh};
use super::{BundledScene, Parameter, Values, cornell};

pub(super) const ROW: BundledScene = BundledScene {
    name: "cornell-lamp",
    description: "the same box lit by an emissive 0.5 m lamp in the ceiling, and by nothing else",
    parameters: &[Parameter {
        name: "radiance",
        description: "radiance of the lamp",
        unit: "W/(m² sr)",
        min: 0.0,
        max: 1e6,
        default: 17.0,
    }],
    build,
};

fn build(values: &Values) -> Scene {
    let mut mesh = Mesh::default();
    let [white, red, green] = cornell::walls(&mut mesh);
    let emission = Vec3::new(1.0, 0.87, 0.65) * values.number("radiance");
    let lamp = mesh.material(Material {
        name: String::from("lamp"),
        albedo: Vec3::splat(0.78),
        emission,
        ..Material::default()
    });
    let cuts: &[f32] = &[-1.0, -0.25, 0.25, 1.0];
    mesh.room([cuts, &[0.0, 2.0], cuts], |face, middle| {
        let is_lamp = face == HIGH_Y && middle.x == 0.0 && middle.z == 0.0;
        Some(match face {
            _ if is_lamp => lamp,
            LOW_X => red,
            HIGH_X => green,
            _ => white,
        })
    });
    cornell::blocks(&mut mesh, white);
    mesh.into_scene("cornell-lamp", Vec::new(), Vec3::ZERO, cornell::camera())
}
