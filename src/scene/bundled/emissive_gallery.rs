//! A gallery whose only light comes from surfaces: coloured panels and a picture that glows.

use glam::{Affine3A, Quat, Vec2, Vec3};

use super::super::{Camera, Material, Scene};
use super::mesh::{HIGH_Y, LOW_Y, Mesh};
use super::{BundledScene, Parameter, Values, picture};

pub(super) const ROW: BundledScene = BundledScene {
    name: "emissive-gallery",
    description: "a room lit by coloured emissive panels and a glowing picture, and by nothing \
                  else",
    parameters: &[Parameter {
        name: "radiance",
        description: "radiance of the brightest panel",
        unit: "W/(m² sr)",
        min: 0.0,
        max: 1e6,
        default: 4.0,
    }],
    build,
};

/// Panels stand this far out of their wall.
const FRAME_M: f32 = 0.05;

fn build(values: &Values) -> Scene {
    let radiance = values.number("radiance");
    let mut mesh = Mesh::default();
    let wall = mesh.matte("wall", [0.72, 0.71, 0.69]);
    let floor = mesh.matte("floor", [0.42, 0.38, 0.34]);
    let ceiling = mesh.matte("ceiling", [0.8, 0.8, 0.8]);
    let frame = mesh.matte("frame", [0.1, 0.1, 0.1]);
    mesh.room([&[-5.0, 5.0], &[0.0, 3.2], &[-2.5, 2.5]], |face, _| {
        Some(match face {
            LOW_Y => floor,
            HIGH_Y => ceiling,
            _ => wall,
        })
    });
    for (index, (x, color)) in [
        (-3.6, [1.0, 0.12, 0.05]),
        (-1.2, [1.0, 0.6, 0.15]),
        (1.2, [0.15, 0.9, 0.3]),
        (3.6, [0.1, 0.3, 1.0]),
    ]
    .into_iter()
    .enumerate()
    {
        let panel = emitter(
            &mut mesh,
            &format!("panel_{index}"),
            Vec3::from(color) * radiance,
            None,
        );
        mesh.world_from_local = Affine3A::from_translation(Vec3::new(x, 1.7, -2.5));
        hang(&mut mesh, panel, frame, 0.5, 0.8);
    }
    let glass = mesh.texture(picture::stained_glass("stained_glass"));
    let window = emitter(
        &mut mesh,
        "glowing_picture",
        Vec3::splat(0.6 * radiance),
        Some(glass),
    );
    mesh.world_from_local = Affine3A::from_rotation_translation(
        Quat::from_rotation_y(std::f32::consts::FRAC_PI_2),
        Vec3::new(-5.0, 1.7, 0.0),
    );
    hang(&mut mesh, window, frame, 1.5, 1.0);
    mesh.world_from_local = Affine3A::IDENTITY;
    exhibits(&mut mesh);
    let camera = Camera {
        eye: Vec3::new(4.5, 1.65, 1.9),
        target: Vec3::new(-2.0, 1.2, -1.2),
        up: Vec3::Y,
        vfov_deg: 62.0,
    };
    mesh.into_scene("emissive-gallery", Vec::new(), Vec3::ZERO, camera)
}

fn emitter(mesh: &mut Mesh, name: &str, emission: Vec3, emission_texture: Option<u32>) -> u32 {
    mesh.material(Material {
        name: name.to_owned(),
        albedo: Vec3::splat(0.2),
        emission,
        emission_texture,
        ..Material::default()
    })
}

/// A panel in a shallow frame, on the wall z = 0, facing +z.
fn hang(mesh: &mut Mesh, panel: u32, frame: u32, half_width: f32, half_height: f32) {
    let (outer, depth) = (
        Vec3::new(half_width + 0.06, half_height + 0.06, 0.0),
        FRAME_M * Vec3::Z,
    );
    mesh.cuboid([frame; 6], -outer, outer + depth);
    let z = FRAME_M + 0.01;
    let [x, y] = [half_width, half_height];
    let corners = [
        Vec3::new(-x, -y, z),
        Vec3::new(x, -y, z),
        Vec3::new(x, y, z),
        Vec3::new(-x, y, z),
    ];
    mesh.quad_with_uv(panel, corners, [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
}

/// Pedestals with spheres and turned blocks, to catch the colours and throw shadows.
fn exhibits(mesh: &mut Mesh) {
    let stone = mesh.matte("pedestal", [0.65, 0.64, 0.6]);
    let clay = mesh.matte("exhibit", [0.8, 0.78, 0.74]);
    for (index, x) in [-2.4_f32, 0.0, 2.4].into_iter().enumerate() {
        mesh.cuboid(
            [stone; 6],
            Vec3::new(x - 0.3, 0.0, -0.5),
            Vec3::new(x + 0.3, 0.9, 0.1),
        );
        if index == 1 {
            mesh.world_from_local = Affine3A::from_rotation_translation(
                Quat::from_rotation_y(0.6),
                Vec3::new(x, 0.9, -0.2),
            );
            mesh.cuboid(
                [clay; 6],
                Vec3::new(-0.18, 0.0, -0.18),
                Vec3::new(0.18, 0.55, 0.18),
            );
            mesh.world_from_local = Affine3A::IDENTITY;
        } else {
            mesh.sphere(clay, Vec3::new(x, 1.17, -0.2), 0.27, 4, false);
        }
    }
}
