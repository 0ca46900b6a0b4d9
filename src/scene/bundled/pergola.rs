//! A terrace under a pergola of thin slats, between fences of boards, behind a railing of thin
//! bars, with masked leaves on trellises and in planters.

use glam::{Affine3A, Mat3, Quat, Vec3};

use super::super::{Camera, Light, Scene};
use super::atrium::leaf_card;
use super::atrium_materials::{leaves, wood};
use super::mesh::Mesh;
use super::{BundledScene, Values};

pub(super) const ROW: BundledScene = BundledScene {
    name: "pergola",
    description: "terrace under thin slats, with fences of boards, a railing of thin bars, \
                  foliage of masked leaves, sun and sky",
    parameters: &[],
    build,
};

/// Half the terrace along x and z (m).
const HALF_X_M: f32 = 4.5;
const HALF_Z_M: f32 = 3.5;
/// Height of the fences and of the beams of the pergola (m).
const FENCE_M: f32 = 2.0;
const BEAM_M: f32 = 2.45;

struct Materials {
    paving: u32,
    fence: u32,
    render: u32,
    wood: u32,
    iron: u32,
    clay: u32,
    leaves: u32,
}

fn build(_values: &Values) -> Scene {
    let mut mesh = Mesh::default();
    let materials = Materials {
        paving: mesh.matte("paving", [0.52, 0.48, 0.42]),
        fence: mesh.matte("fence", [0.5, 0.3, 0.17]),
        render: mesh.matte("render", [0.76, 0.7, 0.58]),
        wood: wood(&mut mesh),
        iron: mesh.matte("iron", [0.14, 0.14, 0.15]),
        clay: mesh.matte("planter", [0.5, 0.24, 0.14]),
        leaves: leaves(&mut mesh),
    };
    ground(&mut mesh, &materials);
    fences(&mut mesh, &materials);
    pergola(&mut mesh, &materials);
    railing(&mut mesh, &materials);
    foliage(&mut mesh, &materials);
    let sun = Light::Directional {
        direction: Vec3::new(0.5, -1.0, -0.45).normalize(),
        irradiance: Vec3::new(13.0, 11.8, 10.0),
    };
    let camera = Camera {
        eye: Vec3::new(-3.9, 1.6, 3.0),
        target: Vec3::new(0.8, 1.2, -1.2),
        up: Vec3::Y,
        vfov_deg: 62.0,
    };
    mesh.into_scene("pergola", vec![sun], Vec3::new(0.2, 0.27, 0.4), camera)
}

fn board(mesh: &mut Mesh, material: u32, low: [f32; 3], high: [f32; 3]) {
    mesh.cuboid([material; 6], Vec3::from(low), Vec3::from(high));
}

/// Paving, and a house wall of 3 cm with a doorway towards −x.
fn ground(mesh: &mut Mesh, materials: &Materials) {
    let [x, z] = [HALF_X_M, HALF_Z_M];
    board(mesh, materials.paving, [-x, -0.05, -z], [x, 0.0, z]);
    for [y0, y1, z0, z1] in [
        [0.0, 2.9, -z, -1.6],
        [2.1, 2.9, -1.6, -0.6],
        [0.0, 2.9, -0.6, z],
    ] {
        board(mesh, materials.render, [-x, y0, z0], [-x + 0.03, y1, z1]);
    }
}

/// Upright boards of 15 mm with gaps of 10 mm, along the back and along +x.
fn fences(mesh: &mut Mesh, materials: &Materials) {
    const BOARD_M: f32 = 0.12;
    const STEP_M: f32 = 0.13;
    let [x, z] = [HALF_X_M, HALF_Z_M];
    for index in 0..(2.0 * x / STEP_M) as u32 {
        let at = -x + STEP_M * index as f32;
        board(
            mesh,
            materials.fence,
            [at, 0.05, -z],
            [at + BOARD_M, FENCE_M, -z + 0.015],
        );
    }
    for index in 0..(2.0 * z / STEP_M) as u32 {
        let at = -z + STEP_M * index as f32;
        board(
            mesh,
            materials.fence,
            [x - 0.015, 0.05, at],
            [x, FENCE_M, at + BOARD_M],
        );
    }
    for y in [0.35, 1.65] {
        let top = y + 0.07;
        board(
            mesh,
            materials.wood,
            [-x, y, -z + 0.015],
            [x, top, -z + 0.05],
        );
        board(mesh, materials.wood, [x - 0.05, y, -z], [x - 0.015, top, z]);
    }
}

/// Four posts, two beams, and slats of 3 cm over them.
fn pergola(mesh: &mut Mesh, materials: &Materials) {
    let wood = materials.wood;
    for z in [-2.6_f32, 0.9] {
        for x in [-2.9_f32, 3.3] {
            board(
                mesh,
                wood,
                [x - 0.045, 0.0, z - 0.045],
                [x + 0.045, BEAM_M, z + 0.045],
            );
        }
        board(
            mesh,
            wood,
            [-3.3, BEAM_M, z - 0.03],
            [3.7, BEAM_M + 0.14, z + 0.03],
        );
    }
    for index in 0..28 {
        let x = -3.2 + 0.25 * index as f32;
        let (low, high) = ([x, BEAM_M + 0.14, -3.0], [x + 0.03, BEAM_M + 0.23, 1.3]);
        board(mesh, wood, low, high);
    }
    // A bench of slats.
    for index in 0..5 {
        let z = -2.3 + 0.09 * index as f32;
        board(mesh, wood, [-1.6, 0.42, z], [0.9, 0.44, z + 0.07]);
    }
    for x in [-1.5, 0.75] {
        board(mesh, wood, [x, 0.0, -2.3], [x + 0.05, 0.42, -1.87]);
    }
}

/// Bars of 14 mm along the open side.
fn railing(mesh: &mut Mesh, materials: &Materials) {
    let (half, z) = (0.007, 2.2);
    for index in 0..42 {
        let x = -0.6 + 0.12 * index as f32;
        board(
            mesh,
            materials.iron,
            [x - half, 0.0, z - half],
            [x + half, 0.92, z + half],
        );
    }
    board(
        mesh,
        materials.iron,
        [-0.62, 0.08, z - 0.01],
        [4.4, 0.1, z + 0.01],
    );
    board(
        mesh,
        materials.wood,
        [-0.64, 0.92, z - 0.025],
        [4.45, 0.96, z + 0.025],
    );
}

/// Leaves on the fence, on the slats and in planters.
fn foliage(mesh: &mut Mesh, materials: &Materials) {
    let sprig = |mesh: &mut Mesh, turn: Quat, root: Vec3, length_m: f32| {
        mesh.world_from_local = Affine3A::from_mat3_translation(Mat3::from_quat(turn), root);
        leaf_card(mesh, materials.leaves, 0.42 * length_m, length_m);
        mesh.world_from_local = Affine3A::IDENTITY;
    };
    for index in 0..160 {
        // Along the fence and up it, as the R2 sequence spreads points (Roberts 2018).
        let step = index as f32;
        let [u, v] = [
            (0.5 + 0.754_877_7 * step).fract(),
            (0.5 + 0.569_840_3 * step).fract(),
        ];
        let root = Vec3::new(1.2 + 3.1 * u, 0.1 + 1.9 * v, -HALF_Z_M + 0.06);
        let turn = Quat::from_rotation_y(0.9 * (u - 0.5)) * Quat::from_rotation_z(2.0 * (v - 0.5));
        sprig(mesh, turn * Quat::from_rotation_x(0.35), root, 0.34);
    }
    for index in 0..90 {
        let step = index as f32;
        let [u, v] = [
            (0.2 + 0.754_877_7 * step).fract(),
            (0.7 + 0.569_840_3 * step).fract(),
        ];
        let root = Vec3::new(-3.1 + 2.6 * u, BEAM_M + 0.24, -2.9 + 2.2 * v);
        let turn = Quat::from_rotation_y(6.0 * u + 9.0 * v) * Quat::from_rotation_x(1.2);
        sprig(mesh, turn, root, 0.4);
    }
    for (number, x) in [-2.2_f32, -1.2, 2.4].into_iter().enumerate() {
        let low = Vec3::new(x - 0.3, 0.0, 1.2);
        mesh.cuboid([materials.clay; 6], low, low + Vec3::new(0.6, 0.38, 0.34));
        for index in 0..40 {
            let step = (index + 40 * number) as f32;
            let [u, v] = [(0.754_877_7 * step).fract(), (0.569_840_3 * step).fract()];
            let root = low + Vec3::new(0.6 * u, 0.36, 0.34 * v);
            let turn = Quat::from_rotation_y(2.4 * step) * Quat::from_rotation_x(0.15 + 0.9 * v);
            sprig(mesh, turn, root, 0.75);
        }
    }
}
