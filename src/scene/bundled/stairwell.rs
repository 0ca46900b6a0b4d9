//! A stair hall of thin boards: partitions of two centimetres, open treads, railings of thin bars.
//! The sun comes in by a skylight; the room under the landing has the light of the hall alone.

use glam::{Affine3A, Mat3, Quat, Vec3};

use super::super::{Camera, Light, Scene};
use super::atrium::leaf_card;
use super::atrium_materials::{leaves, wood};
use super::mesh::Mesh;
use super::{BundledScene, Parameter, Values};

pub(super) const ROW: BundledScene = BundledScene {
    name: "stairwell",
    description: "stair hall with partitions thinner than a voxel, railings of thin bars, a potted \
                  plant and sun by a skylight",
    parameters: &[Parameter {
        name: "wall_m",
        description: "thickness of walls and partitions",
        unit: "m",
        min: 0.001,
        max: 0.3,
        default: 0.02,
    }],
    build,
};

/// Half the inside of the hall, along x and z, and its height (m).
const HALF_X_M: f32 = 3.0;
const HALF_Z_M: f32 = 2.5;
const HEIGHT_M: f32 = 5.4;
/// Top of the landing, and where it begins (m).
const LANDING_M: f32 = 2.8;
const LANDING_X_M: f32 = 0.8;
/// Where the stair ends, seen from the back wall (m).
const STAIR_Z_M: f32 = -1.4;
/// Edge of a bar of a railing, and from one to the next (m).
const BAR_M: f32 = 0.012;
const BARS_APART_M: f32 = 0.11;
/// Height of a handrail over what it stands on (m).
const RAIL_M: f32 = 0.95;

struct Materials {
    wall: u32,
    partition: u32,
    floor: u32,
    wood: u32,
    iron: u32,
}

fn build(values: &Values) -> Scene {
    let mut mesh = Mesh::default();
    let materials = Materials {
        wall: mesh.matte("wall", [0.74, 0.71, 0.66]),
        partition: mesh.matte("partition", [0.3, 0.46, 0.5]),
        floor: mesh.matte("floor", [0.46, 0.36, 0.27]),
        wood: wood(&mut mesh),
        iron: mesh.matte("iron", [0.12, 0.12, 0.13]),
    };
    let wall_m = values.number("wall_m");
    shell(&mut mesh, &materials, wall_m);
    landing(&mut mesh, &materials, wall_m);
    stair(&mut mesh, &materials);
    plant(&mut mesh);
    let sun = Light::Directional {
        direction: Vec3::new(0.42, -1.0, -0.3).normalize(),
        irradiance: Vec3::new(24.0, 21.5, 18.0),
    };
    let camera = Camera {
        eye: Vec3::new(-2.7, 1.6, 2.2),
        target: Vec3::new(1.0, 1.9, -0.9),
        up: Vec3::Y,
        vfov_deg: 68.0,
    };
    mesh.into_scene("stairwell", vec![sun], Vec3::new(0.5, 0.65, 0.9), camera)
}

fn board(mesh: &mut Mesh, material: u32, low: [f32; 3], high: [f32; 3]) {
    mesh.cuboid([material; 6], Vec3::from(low), Vec3::from(high));
}

/// Floor and walls, and a ceiling with a skylight.
fn shell(mesh: &mut Mesh, materials: &Materials, wall_m: f32) {
    let Materials { wall, floor, .. } = *materials;
    let [x, z, top] = [HALF_X_M, HALF_Z_M, HEIGHT_M];
    let [out_x, out_z, out_top] = [x + wall_m, z + wall_m, top + wall_m];
    board(mesh, floor, [-out_x, -wall_m, -out_z], [out_x, 0.0, out_z]);
    board(mesh, wall, [-out_x, 0.0, -out_z], [-x, top, out_z]);
    board(mesh, wall, [x, 0.0, -out_z], [out_x, top, out_z]);
    board(mesh, wall, [-x, 0.0, -out_z], [x, top, -z]);
    board(mesh, wall, [-x, 0.0, z], [x, top, out_z]);
    let [west, east, back, front] = [-2.3, -0.1, -0.5, 1.7];
    for [x0, x1, z0, z1] in [
        [-out_x, west, -out_z, out_z],
        [east, out_x, -out_z, out_z],
        [west, east, -out_z, back],
        [west, east, front, out_z],
    ] {
        board(mesh, wall, [x0, top, z0], [x1, out_top, z1]);
    }
    // Glazing bars.
    for step in 1..5 {
        let at = west + (east - west) * step as f32 / 5.0;
        let [a, b] = [at - BAR_M, at + BAR_M];
        board(mesh, materials.wood, [a, top, back], [b, top + 0.03, front]);
    }
    let [a, b] = [0.6 - BAR_M, 0.6 + BAR_M];
    board(mesh, materials.wood, [west, top, a], [east, top + 0.03, b]);
}

/// The landing, the partition under it with a doorway, and the railing over that.
fn landing(mesh: &mut Mesh, materials: &Materials, wall_m: f32) {
    let [x, z] = [LANDING_X_M, HALF_Z_M];
    let floor_m = LANDING_M - 0.06;
    board(
        mesh,
        materials.wood,
        [x, floor_m, -z],
        [HALF_X_M, LANDING_M, z],
    );
    // A doorway, 0.9 m wide and 2.1 m high.
    let [left, right, head] = [0.4, 1.3, 2.1];
    for [y0, y1, z0, z1] in [
        [0.0, floor_m, STAIR_Z_M, left],
        [head, floor_m, left, right],
        [0.0, floor_m, right, z],
    ] {
        let [a, b] = [x + 0.1, x + 0.1 + wall_m];
        board(mesh, materials.partition, [a, y0, z0], [b, y1, z1]);
    }
    let [a, b] = [STAIR_Z_M, STAIR_Z_M + wall_m];
    board(
        mesh,
        materials.partition,
        [x + 0.1, 0.0, a],
        [HALF_X_M, floor_m, b],
    );
    // A shelf of thin boards behind the doorway.
    for step in 0..5 {
        let y = 0.35 + 0.4 * step as f32;
        board(
            mesh,
            materials.wood,
            [2.65, y, -1.0],
            [HALF_X_M, y + 0.015, 1.9],
        );
    }
    railing(
        mesh,
        materials,
        Vec3::new(x + 0.05, LANDING_M, STAIR_Z_M),
        Vec3::new(x + 0.05, LANDING_M, z),
    );
}

/// Open treads between two strings, from the floor to the landing, and a railing beside them.
fn stair(mesh: &mut Mesh, materials: &Materials) {
    const TREADS: u32 = 14;
    let [rise, going] = [LANDING_M / TREADS as f32, 0.25];
    let first_x = LANDING_X_M - going * TREADS as f32;
    let [back, front] = [-HALF_Z_M + 0.06, STAIR_Z_M];
    for tread in 1..TREADS {
        let [x, top] = [first_x + going * (tread - 1) as f32, rise * tread as f32];
        let (low, high) = ([x, top - 0.03, back], [x + going + 0.03, top, front]);
        board(mesh, materials.wood, low, high);
    }
    let [foot, head] = [
        Vec3::new(first_x, 0.0, front),
        Vec3::new(LANDING_X_M, LANDING_M, front),
    ];
    for z in [back, front - 0.03] {
        slope(
            mesh,
            materials.wood,
            foot.with_z(z),
            head.with_z(z),
            [0.22, 0.03],
        );
    }
    railing(mesh, materials, foot, head);
}

/// A beam from one foot point to another that is further along x, so high and deep (m).
fn slope(mesh: &mut Mesh, material: u32, foot: Vec3, head: Vec3, [height_m, depth_m]: [f32; 2]) {
    let way = head - foot;
    let turn = Quat::from_rotation_z(way.y.atan2(way.x));
    mesh.world_from_local = Affine3A::from_rotation_translation(turn, foot);
    let end = [way.length(), 0.5 * height_m, depth_m];
    board(mesh, material, [0.0, -0.5 * height_m, 0.0], end);
    mesh.world_from_local = Affine3A::IDENTITY;
}

/// Bars on the line between two points, and a handrail on them.
fn railing(mesh: &mut Mesh, materials: &Materials, from: Vec3, to: Vec3) {
    let count = ((to - from).with_y(0.0).length() / BARS_APART_M) as u32;
    let half = 0.5 * BAR_M;
    for index in 0..=count {
        let foot = from.lerp(to, index as f32 / count as f32);
        let low = [foot.x - half, foot.y, foot.z - half];
        let high = [foot.x + half, foot.y + RAIL_M, foot.z + half];
        board(mesh, materials.iron, low, high);
    }
    let up = RAIL_M * Vec3::Y;
    if from.y == to.y {
        let (low, high) = (from.min(to) + up, from.max(to) + up);
        let wide = Vec3::new(0.022, 0.0, 0.022);
        let high = high + wide + 0.04 * Vec3::Y;
        board(
            mesh,
            materials.wood,
            (low - wide).to_array(),
            high.to_array(),
        );
    } else {
        let aside = up - 0.022 * Vec3::Z;
        slope(
            mesh,
            materials.wood,
            from + aside,
            to + aside,
            [0.04, 0.044],
        );
    }
}

/// A pot with masked leaves at the foot of the partition.
fn plant(mesh: &mut Mesh) {
    let (clay, leaves) = (mesh.matte("pot", [0.5, 0.24, 0.14]), leaves(mesh));
    let foot = Vec3::new(0.1, 0.0, 1.5);
    let profile = [
        (0.0, 0.0),
        (0.17, 0.0),
        (0.24, 0.4),
        (0.21, 0.4),
        (0.0, 0.36),
    ];
    mesh.lathe(clay, foot, &profile, 24);
    for sprig in 0..48 {
        let [turn, lean] = [
            sprig as f32 * 2.399_963,
            0.1 + 0.8 * (sprig as f32 + 0.5) / 48.0,
        ];
        let to_sprig = Mat3::from_quat(Quat::from_rotation_y(turn) * Quat::from_rotation_x(lean));
        let root = foot + Vec3::new(0.0, 0.36, 0.0) + to_sprig * Vec3::Y * 0.08;
        mesh.world_from_local = Affine3A::from_mat3_translation(to_sprig, root);
        leaf_card(mesh, leaves, 0.3, 0.95 - 0.3 * lean);
    }
    mesh.world_from_local = Affine3A::IDENTITY;
}
