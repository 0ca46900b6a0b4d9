//! Details of about a voxel: gaps, lamps, columns, surfaces back to back and face to face.

use glam::Vec3;

use super::scenes::{add_floor, camera, closed_room, lamp};
use super::{Change, ENERGY, OWN, StressCase, StressError, Trial};
use crate::metrics::Channel;
use crate::scene::bundled::mesh::{HIGH_X, LOW_X, Mesh};
use crate::scene::{Material, Scene};

/// Where details are, beyond a border between voxels (voxels): nowhere in particular.
const PLACE_VOXELS: f32 = 0.3;

/// Gaps let little light through, so the reference takes this many times the usual samples.
const GAP_SAMPLES: u32 = 4;

pub(super) static NARROW_GAP: StressCase = StressCase {
    name: "narrow_gap",
    help: "light comes from one room into the next through a slit",
    source: "Crassin et al. 2011: cones average what they pass; Hong 2015, section 3.2: wide \
             cones skip thin geometry",
    severity: "width of the slit [voxels]",
    severities: &[8.0, 4.0, 2.0, 1.0, 0.5],
    quick: &[8.0, 0.5],
    figures: ENERGY,
    measure: |trial, width| energy(trial, &gap(trial.cell_m(), width as f32, None)),
    ..OWN
};

pub(super) static DISTANT_GAP: StressCase = StressCase {
    name: "distant_gap",
    help: "light falls through a slit of eight voxels on a wall behind it; the further the wall, \
           the wider a cone is at the slit",
    source: "Kahl 2019, section 6.2.2: sizes of samples double from mip to mip",
    severity: "distance of the wall [voxels]",
    severities: &[2.0, 4.0, 8.0, 10.0],
    quick: &[10.0],
    figures: ENERGY,
    measure: |trial, distance| energy(trial, &gap(trial.cell_m(), 8.0, Some(distance as f32))),
    ..OWN
};

pub(super) static SMALL_EMITTER: StressCase = StressCase {
    name: "small_emitter",
    help: "one square lamp lights a room, with the same power at every size",
    source: "Villegas & Ramírez, figure 16: light of emissive voxels only",
    severity: "edge of the lamp [voxels]",
    severities: &[16.0, 8.0, 4.0, 2.0, 1.0, 0.25, 0.01],
    quick: &[16.0, 0.25],
    measure: |trial, edge| {
        error(
            trial,
            &lamp_room(trial.cell_m(), edge as f32),
            Channel::Luminance,
        )
    },
    ..OWN
};

pub(super) static THIN_COLUMNS: StressCase = StressCase {
    name: "thin_columns",
    help: "nine columns stand on a floor under the sky; one thinner than a voxel still fills it",
    source: "Villegas & Ramírez, section V-A: conservative voxelization; Hong 2015, section 3.2",
    severity: "edge of a column [voxels]",
    severities: &[4.0, 2.0, 1.0, 0.5, 0.25],
    quick: &[4.0, 0.25],
    measure: |trial, edge| {
        error(
            trial,
            &columns(trial.cell_m(), edge as f32),
            Channel::Luminance,
        )
    },
    ..OWN
};

pub(super) static OPPOSED_NORMALS: StressCase = StressCase {
    name: "opposed_normals",
    help: "a partition is red and lit on one side, green and dark on the other; in one voxel the \
           normals cancel and the colours mix",
    source: "Villegas & Ramírez, section VI-B and figure 3: uneven normals in a voxel; Hong 2015, \
             section 2.4.2: opposite normals",
    severity: "thickness [voxels]",
    severities: &[4.0, 2.0, 1.0, 0.5, 0.1],
    quick: &[4.0, 0.1],
    changes: &[
        Change {
            name: "faces",
            values: &[],
            needs: Some(("gather", "cones")),
        },
        Change {
            name: "normals",
            values: &[],
            needs: Some(("gather", "cones")),
        },
    ],
    measure: |trial, thickness| {
        error(
            trial,
            &partition(trial.cell_m(), thickness as f32),
            Channel::Rgb,
        )
    },
    ..OWN
};

pub(super) static FACING_SURFACES: StressCase = StressCase {
    name: "facing_surfaces",
    help: "a slab lies above a floor under the sky, with the camera between them; cones that \
           start beyond the slab see the sky",
    source: "Kahl 2019, section 6.2.2 and figure 6.4: offset and self-collision",
    severity: "distance [voxels]",
    severities: &[8.0, 4.0, 2.0, 1.0, 0.5],
    quick: &[8.0, 0.5],
    measure: |trial, distance| {
        error(
            trial,
            &slab(trial.cell_m(), distance as f32),
            Channel::Luminance,
        )
    },
    ..OWN
};

fn error(trial: &Trial<'_>, scene: &Scene, channel: Channel) -> Result<Vec<f64>, StressError> {
    Ok(vec![trial.errors(scene, channel, 1)?.rel_rmse])
}

fn energy(trial: &Trial<'_>, scene: &Scene) -> Result<Vec<f64>, StressError> {
    Ok(vec![
        trial
            .errors(scene, Channel::Luminance, GAP_SAMPLES)?
            .bias
            .abs(),
    ])
}

/// Two rooms with a wall of four voxels and a slit in it. The lamp is so far to the side that none
/// of its own light comes through. The camera sees the room behind, or a wall in it at a distance
/// (voxels).
fn gap(cell_m: f32, width_voxels: f32, distance_voxels: Option<f32>) -> Scene {
    let (mut mesh, _) = closed_room();
    let wall = mesh.matte("wall", [0.7, 0.7, 0.7]);
    let (face, middle, half) = (
        2.0 * cell_m,
        PLACE_VOXELS * cell_m,
        0.5 * width_voxels * cell_m,
    );
    for [z0, z1] in [[-2.0, middle - half], [middle + half, 2.0]] {
        mesh.cuboid(
            [wall; 6],
            Vec3::new(-face, 0.0, z0),
            Vec3::new(face, 3.0, z1),
        );
    }
    let seen = match distance_voxels {
        Some(distance) => {
            let at = face + distance * cell_m;
            let receiver = mesh.matte("receiver", [0.7, 0.7, 0.7]);
            mesh.quad(
                receiver,
                [[-2.0, 0.0], [2.0, 0.0], [2.0, 3.0], [-2.0, 3.0]]
                    .map(|[z, y]| Vec3::new(at, y, z)),
            );
            camera(
                [
                    face + 0.1 * distance * cell_m,
                    1.5,
                    middle - 1.2 * distance * cell_m,
                ],
                [at, 1.5, middle],
                70.0,
            )
        }
        None => camera([face + 0.3, 1.6, -1.7], [2.0, 1.1, 0.6], 75.0),
    };
    mesh.into_scene("gap", lamp([-0.8, 1.5, 1.5], 10.0), Vec3::ZERO, seen)
}

fn lamp_room(cell_m: f32, edge_voxels: f32) -> Scene {
    let (mut mesh, _) = closed_room();
    let (at, half) = (PLACE_VOXELS * cell_m, 0.5 * edge_voxels * cell_m);
    let emission = Vec3::splat(1.0 / (half * half));
    let lamp = mesh.material(Material {
        name: "lamp".into(),
        albedo: Vec3::ZERO,
        emission,
        ..Material::default()
    });
    mesh.quad(
        lamp,
        [[-half, -half], [half, -half], [half, half], [-half, half]]
            .map(|[x, z]| Vec3::new(at + x, 2.98, at + z)),
    );
    mesh.into_scene(
        "lamp-room",
        Vec::new(),
        Vec3::ZERO,
        camera([0.0, 1.8, 1.9], [0.0, 0.4, -0.8], 65.0),
    )
}

fn columns(cell_m: f32, edge_voxels: f32) -> Scene {
    const STEP_VOXELS: f32 = 6.0;
    let mut mesh = Mesh::default();
    let grey = mesh.matte("floor", [0.6, 0.6, 0.6]);
    add_floor(&mut mesh, grey);
    let paint = mesh.matte("columns", [0.6, 0.6, 0.6]);
    let half = 0.5 * edge_voxels * cell_m;
    for index in 0..9 {
        let at = |step: i32| (STEP_VOXELS * (step - 1) as f32 + PLACE_VOXELS) * cell_m;
        let (x, z) = (at(index % 3), at(index / 3));
        mesh.cuboid(
            [paint; 6],
            Vec3::new(x - half, 0.0, z - half),
            Vec3::new(x + half, 8.0 * cell_m, z + half),
        );
    }
    let span = 1.5 * STEP_VOXELS * cell_m;
    mesh.into_scene(
        "columns",
        Vec::new(),
        Vec3::ONE,
        camera(
            [0.2 * span, 1.4 * span, 1.2 * span],
            [0.0, 0.1 * span, 0.0],
            55.0,
        ),
    )
}

fn partition(cell_m: f32, thickness_voxels: f32) -> Scene {
    let (mut mesh, _) = closed_room();
    let [red, green, grey] = [
        mesh.matte("red", [0.85, 0.1, 0.1]),
        mesh.matte("green", [0.1, 0.75, 0.1]),
        mesh.matte("rim", [0.3, 0.3, 0.3]),
    ];
    let mut faces = [grey; 6];
    (faces[LOW_X], faces[HIGH_X]) = (red, green);
    let (at, half) = (PLACE_VOXELS * cell_m, 0.5 * thickness_voxels * cell_m);
    mesh.cuboid(
        faces,
        Vec3::new(at - half, 0.0, -1.5),
        Vec3::new(at + half, 2.0, 1.5),
    );
    mesh.into_scene(
        "partition",
        lamp([-1.3, 1.4, 0.2], 10.0),
        Vec3::ZERO,
        camera([0.0, 2.8, 1.95], [0.0, 0.2, -0.4], 80.0),
    )
}

fn slab(cell_m: f32, distance_voxels: f32) -> Scene {
    let mut mesh = Mesh::default();
    let grey = mesh.matte("floor", [0.6, 0.6, 0.6]);
    add_floor(&mut mesh, grey);
    let paint = mesh.matte("slab", [0.6, 0.6, 0.6]);
    let under = distance_voxels * cell_m;
    mesh.cuboid(
        [paint; 6],
        Vec3::new(-1.2, under, -1.2),
        Vec3::new(1.2, under + 4.0 * cell_m, 1.2),
    );
    let middle = 0.5 * under;
    mesh.into_scene(
        "slab",
        Vec::new(),
        Vec3::ONE,
        camera([-1.25, middle, 0.1], [1.0, middle, 0.0], 70.0),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::stress::scenes::extent_m;

    /// At the coarsest grid and at a fine one, every scene has the extent by which its voxels are
    /// counted, and its camera is in the open.
    #[test]
    fn scenes_have_the_suites_extent() {
        for cell_m in [4.0 / 27.5, 4.0 / 251.5] {
            let widths = [0.1, 0.5, 1.0, 4.0, 8.0];
            let all = widths.iter().flat_map(|&width| {
                let gaps = [2.0, 10.0].map(|distance| gap(cell_m, width, Some(distance)));
                [
                    gap(cell_m, width, None),
                    lamp_room(cell_m, width),
                    columns(cell_m, width),
                    partition(cell_m, width),
                    slab(cell_m, width),
                ]
                .into_iter()
                .chain(gaps)
            });
            for scene in all {
                assert!((extent_m(&scene) - 4.0).abs() < 1e-5, "{}", scene.name);
                assert!(
                    scene.camera.eye.abs().max_element() < 3.0,
                    "{}: {:?}",
                    scene.name,
                    scene.camera
                );
            }
        }
    }

    /// The lamp's power is the same at every size; the partition is as thick as it should be.
    #[test]
    fn severities_are_what_they_say() {
        let power = |edge: f32| {
            let scene = lamp_room(0.1, edge);
            let lamp = scene
                .materials
                .iter()
                .find(|material| material.name == "lamp")
                .map_or(0.0, |material| material.emission.x);
            lamp * (edge * 0.1).powi(2)
        };
        assert!((power(4.0) - power(0.25)).abs() < 1e-4);
        let scene = partition(0.1, 0.5);
        let of_rim = |corner: &Vec3| (corner.x - 0.03).abs() < 0.026;
        assert_eq!(
            scene
                .vertices
                .iter()
                .map(|vertex| Vec3::from(vertex.position))
                .filter(of_rim)
                .count(),
            24
        );
    }
}
