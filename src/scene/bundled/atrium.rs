//! A courtyard of two storeys, open to the sky: arcades on four sides, hanging cloths that bleed
//! their colour, plants and a fountain.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Affine3A, Mat3, Quat, Vec2, Vec3};

use super::super::{Camera, Light, Scene};
use super::atrium_materials::Materials;
use super::mesh::{HIGH_X, HIGH_Y, LOW_X, LOW_Y, Mesh, SurfacePoint};
use super::{BundledScene, Parameter, Values};

pub(super) const ROW: BundledScene = BundledScene {
    name: "atrium",
    description: "two-storey courtyard with arcades, hanging cloths, plants and sun (textured)",
    parameters: &[],
    build,
};

pub(super) const STREET_ROW: BundledScene = BundledScene {
    name: "street",
    description: "the atrium without its ends, again and again: arcades on both sides of a long \
                  street (textured)",
    parameters: &[Parameter {
        name: "length_m",
        description: "length, to whole courts of 22 m",
        unit: "m",
        min: 22.0,
        max: 2200.0,
        default: 110.0,
    }],
    build: build_street,
};

/// Half the size of the open court \[m\].
const COURT: Vec2 = Vec2::new(8.0, 4.0);
/// Depth of the galleries around it \[m\].
const GALLERY_M: f32 = 3.0;
/// Width of one bay of an arcade \[m\].
const BAY_M: f32 = 2.0;
/// Thickness of an arcade's wall \[m\].
const WALL_M: f32 = 0.4;
/// Thickness of a gallery's floor \[m\].
const SLAB_M: f32 = 0.3;
/// Half the width of the wall that stands on a column \[m\].
const PIER_M: f32 = 0.26;

/// One storey: the height of its floor, of the springing of its arches, and of its ceiling \[m\].
struct Storey {
    floor_m: f32,
    spring_m: f32,
    ceiling_m: f32,
}

const STOREYS: [Storey; 2] = [
    Storey {
        floor_m: 0.0,
        spring_m: 2.7,
        ceiling_m: 3.9,
    },
    Storey {
        floor_m: 4.2,
        spring_m: 6.5,
        ceiling_m: 7.6,
    },
];
/// Top of the parapet \[m\].
const TOP_M: f32 = 8.3;

fn build(_values: &Values) -> Scene {
    let camera = Camera {
        eye: Vec3::new(-7.7, 2.0, 2.3),
        target: Vec3::new(3.0, 3.0, -1.2),
        up: Vec3::Y,
        vfov_deg: 65.0,
    };
    court(Ends::Closed).into_scene("atrium", vec![sun()], SKY, camera)
}

fn build_street(values: &Values) -> Scene {
    let mut mesh = court(Ends::Open);
    let pitch_m = 2.0 * (COURT.x + GALLERY_M);
    mesh.repeat(
        (values.number("length_m") / pitch_m).round() as u32,
        pitch_m * Vec3::X,
    );
    let camera = Camera {
        eye: Vec3::new(-7.7, 2.0, 2.3),
        target: Vec3::new(30.0, 3.0, -1.0),
        up: Vec3::Y,
        vfov_deg: 65.0,
    };
    mesh.into_scene("street", vec![sun()], SKY, camera)
}

/// Radiance of the sky [W/(m² sr)].
const SKY: Vec3 = Vec3::new(0.16, 0.21, 0.3);

fn sun() -> Light {
    Light::Directional {
        direction: Vec3::new(0.32, -1.0, 0.22).normalize(),
        irradiance: Vec3::new(11.0, 9.8, 8.0),
    }
}

/// What a court has towards −x and +x.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Ends {
    /// Arcades and walls, as on its other sides.
    Closed,
    /// No arcade and no wall.
    Open,
}

/// The sides of a court, the long ones first and third: turn about the vertical, half length,
/// distance from the middle \[m\].
const SIDES: [(f32, f32, f32); 4] = [
    (0.0, COURT.x, COURT.y),
    (FRAC_PI_2, COURT.y, COURT.x),
    (PI, COURT.x, COURT.y),
    (-FRAC_PI_2, COURT.y, COURT.x),
];

/// One court and what is in it.
fn court(ends: Ends) -> Mesh {
    let mut mesh = Mesh::default();
    let materials = Materials::new(&mut mesh);
    let sides = if ends == Ends::Closed { 4 } else { 2 };
    shell(&mut mesh, &materials, sides);
    for storey in &STOREYS {
        slabs(&mut mesh, &materials, storey, sides);
        for (turn, length, distance) in SIDES.into_iter().step_by(4 / sides) {
            let to_side = Affine3A::from_rotation_y(turn)
                * Affine3A::from_translation(Vec3::new(-length, 0.0, -distance));
            for bay in 0..(2.0 * length / BAY_M) as u32 {
                mesh.world_from_local =
                    to_side * Affine3A::from_translation(Vec3::new(bay as f32 * BAY_M, 0.0, 0.0));
                arch(&mut mesh, &materials, storey);
                column(&mut mesh, materials.marble, storey);
                if storey.floor_m > 0.0 {
                    balustrade(&mut mesh, &materials, storey.floor_m);
                }
            }
        }
    }
    mesh.world_from_local = Affine3A::IDENTITY;
    fountain(&mut mesh, &materials);
    cloths(&mut mesh, &materials);
    plants(&mut mesh, &materials);
    mesh
}

/// The ground, and the outer walls of the first `sides` sides.
fn shell(mesh: &mut Mesh, materials: &Materials, sides: usize) {
    let [x, z] = [COURT.x + GALLERY_M, COURT.y + GALLERY_M];
    let cuts_x = [-x, -COURT.x, COURT.x, x];
    let cuts_z = [-z, -COURT.y, COURT.y, z];
    mesh.room(
        [&cuts_x, &[0.0, STOREYS[0].ceiling_m, TOP_M], &cuts_z],
        |face, middle| match face {
            LOW_Y if middle.x.abs() < COURT.x && middle.z.abs() < COURT.y => {
                Some(materials.court_tiles)
            }
            LOW_Y => Some(materials.gallery_tiles),
            HIGH_Y => None,
            LOW_X | HIGH_X if sides < 3 => None,
            _ => Some(materials.brick),
        },
    );
    // A millimetre behind the bricks, in whose plane its inner faces would be.
    let (behind_m, outer_m) = (0.001, 0.4);
    for (low, high) in ring(Vec2::new(x, z) + behind_m, outer_m)
        .into_iter()
        .take(sides)
    {
        mesh.cuboid(
            [materials.cornice; 6],
            Vec3::new(low.x, -0.1, low.y),
            Vec3::new(high.x, TOP_M, high.y),
        );
    }
}

/// The four rectangles of a ring of the given width around a rectangle of half size `inner`, as
/// (low, high) in x and z: towards −z, +z, −x and +x.
fn ring(inner: Vec2, width: f32) -> [(Vec2, Vec2); 4] {
    let outer = inner + width;
    [
        (-outer, Vec2::new(outer.x, -inner.y)),
        (Vec2::new(-outer.x, inner.y), outer),
        (Vec2::new(-outer.x, -inner.y), Vec2::new(-inner.x, inner.y)),
        (Vec2::new(inner.x, -inner.y), Vec2::new(outer.x, inner.y)),
    ]
}

/// The floor above a storey's galleries, with a cornice towards the court.
fn slabs(mesh: &mut Mesh, materials: &Materials, storey: &Storey, sides: usize) {
    mesh.world_from_local = Affine3A::IDENTITY;
    let Materials {
        plaster,
        cornice,
        gallery_tiles,
        ..
    } = *materials;
    let top_m = storey.ceiling_m + SLAB_M;
    let edge = COURT - 0.5 * WALL_M;
    for (low, high) in ring(edge, GALLERY_M + 0.5 * WALL_M - 0.001)
        .into_iter()
        .take(sides)
    {
        mesh.cuboid(
            [cornice, cornice, plaster, gallery_tiles, cornice, cornice],
            Vec3::new(low.x, storey.ceiling_m, low.y),
            Vec3::new(high.x, top_m, high.y),
        );
    }
    for (step, (out_m, height_m)) in [(0.06, 0.09), (0.11, 0.09), (0.17, 0.07)]
        .into_iter()
        .enumerate()
    {
        let low_m = storey.ceiling_m + 0.02 + 0.09 * step as f32;
        for (low, high) in ring(edge - out_m, out_m + 0.01).into_iter().take(sides) {
            mesh.cuboid(
                [cornice; 6],
                Vec3::new(low.x, low_m, low.y),
                Vec3::new(high.x, low_m + height_m, high.y),
            );
        }
    }
}

/// The wall of one bay above its arch; the bay reaches from x = 0 to its width, z > 0 is the court.
fn arch(mesh: &mut Mesh, materials: &Materials, storey: &Storey) {
    const SEGMENTS: u32 = 24;
    let (radius, half, centre) = (0.5 * BAY_M - PIER_M, 0.5 * WALL_M, 0.5 * BAY_M);
    let rise = (storey.ceiling_m - storey.spring_m - 0.25).min(radius) / radius;
    let on_arch = |step: u32, grow: f32| {
        let (sin, cos) = (PI - PI * step as f32 / SEGMENTS as f32).sin_cos();
        Vec3::new(
            centre + (radius + grow) * cos,
            storey.spring_m + (radius * rise + grow) * sin,
            0.0,
        )
    };
    let (front, back) = (half * Vec3::Z, -half * Vec3::Z);
    let at_top = |p: Vec3| p.with_y(storey.ceiling_m);
    for step in 0..SEGMENTS {
        let (a, b) = (on_arch(step, 0.0), on_arch(step + 1, 0.0));
        mesh.quad(
            materials.stone,
            [a + front, b + front, at_top(b) + front, at_top(a) + front],
        );
        mesh.quad(
            materials.plaster,
            [b + back, a + back, at_top(a) + back, at_top(b) + back],
        );
        mesh.quad(materials.stone, [a + back, b + back, b + front, a + front]);
        let (out_a, out_b, proud) = (
            on_arch(step, 0.14),
            on_arch(step + 1, 0.14),
            front + 0.03 * Vec3::Z,
        );
        mesh.quad(
            materials.marble,
            [a + proud, b + proud, out_b + proud, out_a + proud],
        );
        mesh.quad(
            materials.marble,
            [out_a + proud, out_b + proud, out_b + front, out_a + front],
        );
        mesh.quad(
            materials.marble,
            [a + front, b + front, b + proud, a + proud],
        );
    }
    for (low_x, high_x) in [(0.0, PIER_M), (BAY_M - PIER_M, BAY_M)] {
        let low = Vec3::new(low_x, storey.spring_m, -half);
        let faces = [
            materials.stone,
            materials.stone,
            materials.stone,
            materials.stone,
            materials.plaster,
            materials.stone,
        ];
        mesh.cuboid(faces, low, Vec3::new(high_x, storey.ceiling_m, half));
    }
}

/// A column with base and capital at the left end of a bay.
fn column(mesh: &mut Mesh, marble: u32, storey: &Storey) {
    let height_m = storey.spring_m - storey.floor_m;
    let foot = Vec3::new(0.0, storey.floor_m, 0.0);
    mesh.cuboid(
        [marble; 6],
        foot - Vec3::new(0.26, 0.0, 0.26),
        foot + Vec3::new(0.26, 0.12, 0.26),
    );
    mesh.cuboid(
        [marble; 6],
        foot + Vec3::new(-0.28, height_m - 0.12, -0.28),
        foot + Vec3::new(0.28, height_m, 0.28),
    );
    let mut profile = vec![
        (0.24, 0.12),
        (0.25, 0.16),
        (0.24, 0.2),
        (0.2, 0.23),
        (0.2, 0.26),
        (0.22, 0.29),
        (0.2, 0.32),
        (0.17, 0.36),
    ];
    for step in 1..=6 {
        let along = step as f32 / 6.0;
        profile.push((
            0.17 - 0.03 * along * along,
            0.36 + (height_m - 0.36 - 0.5) * along,
        ));
    }
    let capital = [
        (0.16, -0.49),
        (0.165, -0.46),
        (0.145, -0.43),
        (0.15, -0.36),
        (0.17, -0.28),
        (0.21, -0.19),
        (0.25, -0.14),
        (0.25, -0.12),
    ];
    profile.extend(capital.map(|(radius, below)| (radius, height_m + below)));
    mesh.lathe(marble, foot, &profile, 20);
}

/// Balusters and rails of one bay.
fn balustrade(mesh: &mut Mesh, materials: &Materials, floor_m: f32) {
    const COUNT: u32 = 7;
    let profile = [
        (0.05, 0.06),
        (0.05, 0.12),
        (0.03, 0.16),
        (0.06, 0.3),
        (0.065, 0.38),
        (0.03, 0.6),
        (0.05, 0.7),
        (0.05, 0.76),
    ];
    for index in 0..COUNT {
        let x = 0.3 + (BAY_M - 0.6) * index as f32 / (COUNT - 1) as f32;
        mesh.lathe(materials.stone, Vec3::new(x, floor_m, 0.0), &profile, 8);
    }
    let rail = |mesh: &mut Mesh, material: u32, low_m: f32, high_m: f32, half_width: f32| {
        mesh.cuboid(
            [material; 6],
            Vec3::new(0.17, floor_m + low_m, -half_width),
            Vec3::new(BAY_M - 0.17, floor_m + high_m, half_width),
        );
    };
    rail(mesh, materials.stone, 0.0, 0.06, 0.09);
    rail(mesh, materials.wood, 0.76, 0.84, 0.1);
}

/// A basin with a bowl in the middle of the court.
fn fountain(mesh: &mut Mesh, materials: &Materials) {
    let basin = [
        (1.5, 0.0),
        (1.5, 0.08),
        (1.35, 0.12),
        (1.3, 0.42),
        (1.42, 0.47),
        (1.42, 0.55),
        (1.2, 0.55),
        (1.16, 0.3),
    ];
    mesh.lathe(materials.marble, Vec3::ZERO, &basin, 48);
    mesh.lathe(
        materials.water,
        Vec3::ZERO,
        &[(1.18, 0.45), (0.0, 0.45)],
        48,
    );
    let bowl = [
        (0.22, 0.3),
        (0.14, 0.5),
        (0.1, 0.8),
        (0.16, 1.0),
        (0.55, 1.12),
        (0.66, 1.24),
        (0.62, 1.25),
        (0.4, 1.18),
        (0.0, 1.16),
    ];
    mesh.lathe(materials.marble, Vec3::ZERO, &bowl, 40);
    mesh.sphere(materials.marble, Vec3::new(0.0, 1.3, 0.0), 0.16, 3, false);
}

/// Cloths that hang from the upper balustrades into the court, on both long sides.
fn cloths(mesh: &mut Mesh, materials: &Materials) {
    for (index, x) in [-6.0_f32, -4.0, 0.0, 4.0, 6.0].into_iter().enumerate() {
        for (side, turn) in [(0, 0.0), (1, PI)] {
            let material = materials.cloths[(index + 2 * side) % materials.cloths.len()];
            let at = Vec3::new(
                x + 1.0,
                STOREYS[1].floor_m + 0.82,
                -COURT.y + 0.5 * WALL_M + 0.28,
            );
            mesh.world_from_local =
                Affine3A::from_rotation_y(turn) * Affine3A::from_translation(at);
            hanging_cloth(
                mesh,
                material,
                1.5,
                2.9 + 0.25 * (index % 3) as f32,
                index as f32 + 0.5 * side as f32,
            );
        }
    }
    mesh.world_from_local = Affine3A::IDENTITY;
}

/// A cloth in folds on the plane z = 0, its upper edge on y = 0.
fn hanging_cloth(mesh: &mut Mesh, material: u32, width_m: f32, length_m: f32, phase: f32) {
    let position = |s: f32, t: f32| {
        let down = 1.0 - t;
        let fold = 0.02 + 0.07 * down;
        let wave =
            (s * 3.5 * TAU + phase).sin() + 0.35 * (s * 1.3 * TAU + 2.0 * phase + 2.0 * down).sin();
        let gather = 1.0 - 0.08 * (PI * down).sin();
        Vec3::new((s - 0.5) * width_m * gather, -down * length_m, fold * wave)
    };
    mesh.surface(material, 40, 28, |s, t| {
        let step = 1e-3;
        let across = position(s + step, t) - position(s - step, t);
        let up = position(s, t + step) - position(s, t - step);
        SurfacePoint {
            position: position(s, t),
            normal: across.cross(up),
            uv: Vec2::new(s, t),
        }
    });
}

/// Pots with bushes along the arcades and at the fountain.
fn plants(mesh: &mut Mesh, materials: &Materials) {
    let pots = [
        (-6.9, -3.2),
        (-3.0, -3.2),
        (1.0, -3.2),
        (5.0, -3.2),
        (-5.0, 3.2),
        (-1.0, 3.2),
        (3.0, 3.2),
        (6.9, 3.2),
        (-2.4, -0.9),
        (2.4, 0.9),
    ];
    for (index, (x, z)) in pots.into_iter().enumerate() {
        let foot = Vec3::new(x, 0.0, z);
        let profile = [
            (0.0, 0.0),
            (0.2, 0.0),
            (0.24, 0.1),
            (0.32, 0.38),
            (0.35, 0.42),
            (0.35, 0.5),
            (0.29, 0.5),
            (0.28, 0.42),
        ];
        mesh.lathe(materials.terracotta, foot, &profile, 28);
        mesh.lathe(materials.soil, foot, &[(0.285, 0.45), (0.0, 0.46)], 28);
        let size = 0.85 + 0.25 * ((index * 7) % 5) as f32 / 4.0;
        for sprig in 0..64 {
            let turn = sprig as f32 * 2.399_963 + index as f32;
            let lean = 0.12 + 1.2 * (sprig as f32 + 0.5) / 64.0;
            let to_sprig =
                Mat3::from_quat(Quat::from_rotation_y(turn) * Quat::from_rotation_x(lean));
            let root = foot + Vec3::new(0.0, 0.44, 0.0) + to_sprig * Vec3::Y * 0.12;
            mesh.world_from_local = Affine3A::from_mat3_translation(to_sprig, root);
            leaf_card(
                mesh,
                materials.leaves,
                0.34 * size,
                (0.95 - 0.25 * lean) * size,
            );
        }
        mesh.world_from_local = Affine3A::IDENTITY;
    }
}

/// A masked card that bends back under its weight.
pub(super) fn leaf_card(mesh: &mut Mesh, leaves: u32, width_m: f32, length_m: f32) {
    mesh.surface(leaves, 1, 5, |s, t| SurfacePoint {
        position: Vec3::new(
            (s - 0.5) * width_m,
            t * length_m * (1.0 - 0.15 * t),
            0.3 * t * t * length_m,
        ),
        normal: Vec3::new(0.0, -0.6 * t, 1.0),
        uv: Vec2::new(s, t),
    });
}
