//! Spheres of rising roughness on a checkered floor, before a striped wall that they reflect.

use glam::Vec3;

use super::super::{Camera, Light, Material, Scene, Specular};
use super::mesh::Mesh;
use super::{BundledScene, Parameter, Values, WHOLE_NUMBER, picture};

pub(super) const ROW: BundledScene = BundledScene {
    name: "glossy",
    description: "two rows of spheres, metal and varnish, of rising roughness on a checkered floor",
    parameters: &[Parameter {
        name: "spheres",
        description: "number of spheres in each row, roughness 0.05 to 0.9",
        unit: WHOLE_NUMBER,
        min: 2.0,
        max: 12.0,
        default: 6.0,
    }],
    build,
};

fn build(values: &Values) -> Scene {
    let mut mesh = Mesh::default();
    let checker = mesh.texture(picture::checker(
        "checker",
        [0.75, 0.72, 0.66],
        [0.12, 0.14, 0.18],
    ));
    let stripes = mesh.texture(picture::stripes(
        "stripes",
        [
            [0.75, 0.12, 0.08],
            [0.8, 0.75, 0.65],
            [0.1, 0.3, 0.65],
            [0.8, 0.55, 0.1],
        ],
    ));
    let textured = |name: &str, texture| Material {
        name: name.to_owned(),
        albedo: Vec3::ONE,
        albedo_texture: Some(texture),
        ..Material::default()
    };
    let floor = mesh.tiled_material(textured("floor", checker), 1.0);
    let wall = mesh.tiled_material(textured("wall", stripes), 4.0);
    let [x, z] = [8.0, 6.0];
    mesh.quad(
        floor,
        [
            Vec3::new(-x, 0.0, z),
            Vec3::new(x, 0.0, z),
            Vec3::new(x, 0.0, -z),
            Vec3::new(-x, 0.0, -z),
        ],
    );
    mesh.quad(
        wall,
        [
            Vec3::new(-x, 0.0, -3.0),
            Vec3::new(x, 0.0, -3.0),
            Vec3::new(x, 4.0, -3.0),
            Vec3::new(-x, 4.0, -3.0),
        ],
    );
    let count = values.number("spheres") as u32;
    for index in 0..count {
        let along = index as f32 / (count - 1) as f32;
        let roughness = 0.05 + 0.85 * along;
        let spacing_m = 6.4 / (count - 1) as f32;
        let radius_m = (0.42 * spacing_m).min(0.55);
        for (name, albedo, metalness, z) in [
            ("metal", [0.95, 0.78, 0.5], 1.0, -0.9),
            ("varnish", [0.1, 0.25, 0.5], 0.0, 0.7),
        ] {
            let ball = mesh.material(Material {
                name: format!("{name}_{index}"),
                albedo: Vec3::from(albedo),
                specular: Some(Specular {
                    f0: Vec3::splat(0.04),
                    roughness,
                    metalness,
                    texture: None,
                }),
                ..Material::default()
            });
            mesh.sphere(
                ball,
                Vec3::new(-3.2 + 6.4 * along, radius_m, z),
                radius_m,
                4,
                false,
            );
        }
    }
    let sun = Light::Directional {
        direction: Vec3::new(-0.45, -0.8, -0.5).normalize(),
        irradiance: Vec3::new(6.0, 5.7, 5.2),
    };
    let camera = Camera {
        eye: Vec3::new(0.0, 2.6, 6.0),
        target: Vec3::new(0.0, 0.6, 0.0),
        up: Vec3::Y,
        vfov_deg: 45.0,
    };
    mesh.into_scene("glossy", vec![sun], Vec3::new(0.35, 0.42, 0.55), camera)
}
