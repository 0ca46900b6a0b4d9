//! A room whose window has panes of coloured glass, with a slab and a ball of clear glass in it.

use glam::{Affine3A, Quat, Vec3};

use super::super::{Camera, Light, Material, Scene, Transmission};
use super::mesh::{HIGH_X, LOW_Y, Mesh};
use super::{BundledScene, Parameter, Values, picture};

pub(super) const ROW: BundledScene = BundledScene {
    name: "glass",
    description: "room with coloured panes in its window, and a slab and a ball of clear glass",
    parameters: &[Parameter {
        name: "index",
        description: "index of refraction of the slab and the ball",
        unit: "",
        min: 1.0,
        max: 3.0,
        default: 1.5,
    }],
    build,
};

/// Where the window is cut into the wall of largest x (m).
const CUTS_Y: [f32; 4] = [0.0, 0.8, 2.2, 2.6];
const CUTS_Z: [f32; 6] = [-2.0, -1.2, -0.4, 0.4, 1.2, 2.0];

fn build(values: &Values) -> Scene {
    let mut mesh = Mesh::default();
    let checker = mesh.texture(picture::checker(
        "checker",
        [0.75, 0.72, 0.66],
        [0.2, 0.25, 0.3],
    ));
    let back = mesh.tiled_material(
        Material {
            name: "back".into(),
            albedo: Vec3::ONE,
            albedo_texture: Some(checker),
            ..Material::default()
        },
        0.5,
    );
    let floor = mesh.matte("floor", [0.6; 3]);
    let wall = mesh.matte("wall", [0.7, 0.68, 0.65]);
    mesh.room([&[-2.0, 2.0], &CUTS_Y, &CUTS_Z], |face, middle| {
        let is_window = (0.8..2.2).contains(&middle.y) && middle.z.abs() < 1.2;
        match face {
            HIGH_X if is_window => None,
            LOW_Y => Some(floor),
            // The wall that the camera looks at.
            4 => Some(back),
            _ => Some(wall),
        }
    });
    // Its outside: without a thickness, light would come in at the corners.
    let outside = |cuts: &[f32], by: f32| -> Vec<f32> {
        let last = cuts.len() - 1;
        let moved = |(index, at): (usize, &f32)| match index {
            0 => at - by,
            _ if index == last => at + by,
            _ => *at,
        };
        cuts.iter().enumerate().map(moved).collect()
    };
    mesh.room(
        [
            &outside(&[-2.0, 2.0], 0.15),
            &outside(&CUTS_Y, 0.15),
            &outside(&CUTS_Z, 0.15),
        ],
        |face, middle| {
            let is_window = (0.8..2.2).contains(&middle.y) && middle.z.abs() < 1.2;
            (face != HIGH_X || !is_window).then_some(wall)
        },
    );
    let pane = |name: &str, filter: [f32; 3], index| Material {
        name: name.to_owned(),
        albedo: Vec3::ZERO,
        transmission: Some(Transmission {
            share: 1.0,
            filter: Vec3::from(filter),
            index,
        }),
        ..Material::default()
    };
    let colors = [
        ("red", [0.9, 0.15, 0.1]),
        ("amber", [0.9, 0.7, 0.15]),
        ("blue", [0.12, 0.3, 0.9]),
    ];
    for (z, (name, filter)) in CUTS_Z[1..5].windows(2).zip(colors) {
        let glass = mesh.material(pane(name, filter, 1.0));
        let corner = |y, z| Vec3::new(2.0, y, z);
        mesh.quad(
            glass,
            [
                corner(0.8, z[0]),
                corner(0.8, z[1]),
                corner(2.2, z[1]),
                corner(2.2, z[0]),
            ],
        );
    }
    let clear = mesh.material(pane("clear", [0.95; 3], values.number("index")));
    mesh.world_from_local = Affine3A::from_rotation_translation(
        Quat::from_rotation_y(0.5),
        Vec3::new(-0.75, 0.0, -0.2),
    );
    mesh.cuboid(
        [clear; 6],
        Vec3::new(-0.5, 0.01, -0.06),
        Vec3::new(0.5, 1.4, 0.06),
    );
    mesh.world_from_local = Affine3A::IDENTITY;
    mesh.sphere(clear, Vec3::new(0.7, 0.41, -0.1), 0.4, 5, false);
    let sun = Light::Directional {
        direction: Vec3::new(-0.8, -0.7, -0.15).normalize(),
        irradiance: Vec3::new(9.0, 8.6, 8.0),
    };
    let camera = Camera {
        eye: Vec3::new(0.0, 1.3, 1.9),
        target: Vec3::new(-0.05, 0.75, -1.0),
        up: Vec3::Y,
        vfov_deg: 65.0,
    };
    mesh.into_scene("glass", vec![sun], Vec3::new(0.4, 0.5, 0.65), camera)
}
