//! The Cornell box: a closed room of 2 m, exactly; the camera stands inside, at the front wall.

use glam::{Affine3A, Quat, Vec3};

use super::super::{Camera, Light, Scene};
use super::mesh::{HIGH_X, LOW_X, Mesh};
use super::{BundledScene, Values};

pub(super) const ROW: BundledScene = BundledScene {
    name: "cornell",
    description: "closed 2 m Cornell box with two blocks and a point light",
    parameters: &[],
    build,
};

fn build(_values: &Values) -> Scene {
    let mut mesh = Mesh::default();
    let [white, red, green] = walls(&mut mesh);
    let cuts: &[f32] = &[-1.0, 1.0];
    mesh.room([cuts, &[0.0, 2.0], cuts], |face, _| {
        Some(if face == LOW_X {
            red
        } else if face == HIGH_X {
            green
        } else {
            white
        })
    });
    blocks(&mut mesh, white);
    let light = Light::Point {
        position: Vec3::new(0.0, 1.6, 0.0),
        intensity: Vec3::new(2.0, 1.8, 1.5),
    };
    mesh.into_scene("cornell", vec![light], Vec3::ZERO, camera())
}

/// White, red and green.
pub(super) fn walls(mesh: &mut Mesh) -> [u32; 3] {
    [
        mesh.matte("white", [0.725, 0.71, 0.68]),
        mesh.matte("red", [0.63, 0.065, 0.05]),
        mesh.matte("green", [0.14, 0.45, 0.091]),
    ]
}

/// The tall and the short block.
pub(super) fn blocks(mesh: &mut Mesh, white: u32) {
    for (x, z, turn_deg, half_width, height) in [
        (-0.35, -0.45, 17.0_f32, 0.3, 1.2),
        (0.4, 0.05, -17.0, 0.3, 0.6),
    ] {
        mesh.world_from_local = Affine3A::from_rotation_translation(
            Quat::from_rotation_y(turn_deg.to_radians()),
            Vec3::new(x, 0.0, z),
        );
        mesh.cuboid(
            [white; 6],
            Vec3::new(-half_width, 0.0, -half_width),
            Vec3::new(half_width, height, half_width),
        );
    }
    mesh.world_from_local = Affine3A::IDENTITY;
}

/// At the front wall, looking at the back.
pub(super) fn camera() -> Camera {
    Camera {
        eye: Vec3::new(0.0, 1.0, 0.98),
        target: Vec3::new(0.0, 1.0, -1.0),
        up: Vec3::Y,
        vfov_deg: 75.0,
    }
}
