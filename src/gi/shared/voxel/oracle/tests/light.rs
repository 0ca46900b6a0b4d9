//! Light on them.

use super::*;

#[test]
fn floor_reflects_a_beam() {
    let mut scene = scene_of(&floor(4.0, 1.25, 0.5));
    let direction = Vec3::new(0.75f32.sqrt(), 0.0, -0.5);
    scene.lights = vec![Light::Directional {
        direction,
        irradiance: Vec3::splat(4.0),
    }];
    let grid = Grid {
        voxel_size: 0.5,
        resolution: 8,
        ..UNIT_GRID
    };
    let radiance = inject(&scene, &grid, 4);
    assert_eq!(radiance.len(), 64);
    // Triangles that only touch a full voxel have a least weight, and so it has a little more than
    // one face.
    assert!(
        radiance
            .values()
            .all(|value| (*value - 1.0 / PI).abs().max_element() < 3.0 * LEAST_WEIGHT)
    );
    let flux = reflected_flux(&scene, 4);
    assert!((flux - 16.0).abs().max_element() < 1e-5);
    let collected = voxel_flux(&voxelize(&scene, &grid), &radiance, &grid);
    assert!((collected / flux - 1.0).abs().max_element() < 1e-3);
    // The other side reflects as well.
    scene.lights = vec![Light::Directional {
        direction: -direction,
        irradiance: Vec3::splat(4.0),
    }];
    assert!((reflected_flux(&scene, 4) - 16.0).abs().max_element() < 1e-5);
}

#[test]
fn nothing_behind_a_light_occludes() {
    let ceiling = floor(4.0, 3.75, 0.5).map(|(triangle, _)| (triangle, 0.0));
    let mut scene = scene_of(&[floor(4.0, 1.25, 0.5), ceiling].concat());
    let lamp = |z: f32| {
        vec![Light::Point {
            position: Vec3::new(2.0, 1.0, z),
            intensity: Vec3::ONE,
        }]
    };
    scene.lights = lamp(3.5);
    assert!(inject(&scene, &UNIT_GRID, 4)[&[1, 1, 1]].x > 0.0);
    scene.lights = lamp(4.0);
    assert_eq!(inject(&scene, &UNIT_GRID, 4)[&[1, 1, 1]], DVec3::ZERO);
}

/// The normals of a thin sheet's two sides cancel; what the sheet covers does not, nor its plane.
#[test]
fn both_sides_of_a_sheet_cover() {
    let front = [[0.0, 0.0, 0.5], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]];
    let sum = voxelize(
        &scene_of(&[(front, 0.5), ([front[0], front[2], front[1]], 0.5)]),
        &UNIT_GRID,
    )[&[0, 0, 0]];
    assert!(near(sum.normal, DVec3::Z) && close(sum.coverage, 0.25));
    assert!(
        close(sum.seen_from_one, 0.5)
            && close(sum.seen_from_both, 1.0)
            && sum.opposed_axis == Some(2)
    );
}

/// Light from above leaves the upper side of a sheet, whichever way its normal points; of a wall of
/// two sheets each side keeps its own, undiminished.
#[test]
fn sides_keep_their_own_light() {
    let front = [[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [0.0, 1.0, 0.5]];
    let lower = front.map(|[x, y, z]| [x, y, z - 0.25]);
    let down = |irradiance: f32, z: f32| Light::Directional {
        direction: Vec3::new(0.0, 0.0, z),
        irradiance: Vec3::splat(irradiance),
    };
    for (triangles, expected) in [
        (vec![(front, 0.5)], [3.0, 1.0]),
        (vec![([front[0], front[2], front[1]], 0.5)], [1.0, 3.0]),
        (
            vec![(front, 0.5), ([lower[0], lower[2], lower[1]], 0.5)],
            [3.0, 1.0],
        ),
    ] {
        let mut scene = scene_of(&triangles);
        scene.lights = vec![down(3.0, -1.0), down(1.0, 1.0)];
        let sides = inject_sides(&scene, &UNIT_GRID, 16)[&[0, 0, 0]];
        for (side, expected) in sides.iter().zip(expected) {
            assert!(close(side.x, 0.5 / PI * expected), "{sides:?}");
        }
        let mean = inject(&scene, &UNIT_GRID, 16)[&[0, 0, 0]].x;
        assert!(
            close(mean, 0.5 / PI * 4.0 / triangles.len() as f64),
            "{mean}"
        );
    }
}

/// A floor and a wall meet in a voxel, and light falls straight onto the floor: the faces of the
/// wall stay dark, where the mean over both would be half as bright.
#[test]
fn faces_keep_the_light_of_their_own_plane() {
    let floor = [[0.25, 0.25, 0.25], [1.0, 0.25, 0.25], [0.25, 1.0, 0.25]];
    let wall = [[0.25, 0.25, 0.25], [0.25, 1.0, 0.25], [0.25, 0.25, 1.0]];
    let mut scene = scene_of(&[(floor, 0.5), (wall, 0.5)]);
    scene.lights = vec![Light::Directional {
        direction: Vec3::NEG_Z,
        irradiance: Vec3::splat(3.0),
    }];
    let faces = inject_faces(&scene, &UNIT_GRID, 16)[&[0, 0, 0]].map(|face| face.x);
    for (face, expected) in [0.0, 0.0, 0.0, 0.0, 3.0 * 0.5 / PI, 0.0]
        .into_iter()
        .enumerate()
    {
        assert!(close(faces[face], expected), "{face}: {faces:?}");
    }
    let [front, _] = inject_sides(&scene, &UNIT_GRID, 16)[&[0, 0, 0]];
    assert!(close(front.x, 0.5 * 3.0 * 0.5 / PI), "{front:?}");
}

/// Two panels fill a voxel's face, one before the other. Only one is seen: it glows as it does
/// alone, and to its front only.
#[test]
fn stacked_panels_glow_as_one() {
    let corners = [[-4.0, -4.0, 0.5], [4.0, -4.0, 0.5], [0.0, 4.0, 0.5]];
    let behind = corners.map(|[x, y, z]| [x, y, z - 0.25]);
    let mut scene = scene_of(&[(corners, 0.5), (behind, 0.5)]);
    scene.materials[0].emission = Vec3::splat(8.0);
    scene.triangles[1].material = 1;
    scene.materials.push(crate::scene::Material::default());
    let sum = voxelize(&scene, &UNIT_GRID)[&[0, 0, 0]];
    assert!(
        close(sum.seen_from_one, 0.5)
            && close(sum.emission_ahead, 1.0)
            && near(sum.emission / sum.seen_from_one, DVec3::splat(8.0)),
        "{sum:?}"
    );
}

/// A wall of two sheets that is turned by 30°: its normal is stored, not the axis nearest to it.
#[test]
fn opposed_planes_that_are_parallel_keep_their_normal() {
    let (sine, cosine) = 30f32.to_radians().sin_cos();
    let at = |across: f32, along: f32, z: f32| {
        let (x, y) = (
            0.5 + along * cosine - across * sine,
            0.5 + along * sine + across * cosine,
        );
        [x, y, z]
    };
    let sheet = |across| {
        [
            at(across, -0.3, 0.2),
            at(across, 0.3, 0.2),
            at(across, 0.3, 0.8),
        ]
    };
    let [a, b, c] = sheet(-0.1);
    let sum = voxelize(
        &scene_of(&[(sheet(0.1), 0.5), ([a, c, b], 0.5)]),
        &UNIT_GRID,
    )[&[0, 0, 0]];
    let normal = DVec3::new(-f64::from(sine), f64::from(cosine), 0.0);
    assert!(
        sum.opposed_axis == Some(1)
            && sum.normal.dot(normal) > 0.999_999
            && sum.front() == sum.normal,
        "{sum:?}"
    );
}

/// The corner of a room and the edge of a box have the same mean normal and lie apart.
#[test]
fn rooms_are_concave_and_boxes_are_not() {
    let floor = |low: f32, high: f32| [[low, low, 0.5], [high, low, 0.5], [low, high, 0.5]];
    let wall = |low: f32, high: f32| [[0.5, low, low], [0.5, high, low], [0.5, low, high]];
    for (low, high, is_concave) in [(0.5, 1.0, true), (0.0, 0.5, false)] {
        let scene = scene_of(&[(floor(low, high), 0.5), (wall(low, high), 0.5)]);
        let sum = voxelize(&scene, &UNIT_GRID)[&[0, 0, 0]];
        assert!(
            sum.is_concave() == is_concave && sum.opposed_axis.is_none(),
            "{sum:?}"
        );
        assert!(near(sum.across(), DVec3::new(0.125, 0.0, 0.125)), "{sum:?}");
    }
}

/// A floor and a wall that face the same corner of the voxel are opposed nowhere.
#[test]
fn corners_are_seen_whole_from_their_front() {
    let floor = [[0.0, 0.0, 0.25], [1.0, 0.0, 0.25], [0.0, 1.0, 0.25]];
    let wall = [[0.25, 0.0, 0.0], [0.25, 1.0, 0.0], [0.25, 0.0, 1.0]];
    let sum = voxelize(&scene_of(&[(floor, 0.5), (wall, 0.5)]), &UNIT_GRID)[&[0, 0, 0]];
    assert!(
        close(sum.seen_from_one, 1.0)
            && sum.opposed_axis.is_none()
            && sum.front().x > 0.5
            && sum.front().z > 0.5
    );
}

/// A lamp above a corner of a floor; beyond a wall the floor lies in its shadow.
#[test]
fn walls_throw_shadows() {
    let wall = [([[2.5, -1.0, 1.6], [2.5, 9.0, 1.6], [2.5, -1.0, 9.0]], 0.0)];
    let mut scene = scene_of(&[&floor(4.0, 1.5, 0.5)[..], &wall[..]].concat());
    scene.lights = vec![Light::Point {
        position: Vec3::new(0.5, 0.5, 3.5),
        intensity: Vec3::splat(8.0),
    }];
    let radiance = inject(&scene, &UNIT_GRID, 256);
    assert!(radiance[&[3, 1, 1]].max_element() < 1e-12);
    let expected = |x: f64| {
        // ρ/π I cos θ / r², averaged over the voxel by a fine sum.
        let at = |index: u32| {
            DVec2::new(
                x + (f64::from(index % 64) + 0.5) / 64.0,
                (f64::from(index / 64) + 0.5) / 64.0,
            ) - 0.5
        };
        let term = |offset: DVec2| 2.0 / (offset.length_squared() + 4.0).powf(1.5);
        0.5 / PI * 8.0 * (0..4096).map(|index| term(at(index))).sum::<f64>() / 4096.0
    };
    assert!(
        (radiance[&[0, 0, 1]].x / expected(0.0) - 1.0).abs() < 5e-3,
        "{} {}",
        radiance[&[0, 0, 1]].x,
        expected(0.0)
    );
    assert!(
        (radiance[&[1, 0, 1]].x / expected(1.0) - 1.0).abs() < 5e-3,
        "{} {}",
        radiance[&[1, 0, 1]].x,
        expected(1.0)
    );
    let voxels = voxelize(&scene, &UNIT_GRID);
    let point = shade_voxel(&scene, &UNIT_GRID, [0, 0, 1], &voxels[&[0, 0, 1]], 0.25);
    assert!((point.x - 0.5 / PI * 8.0 / 4.0).abs() < 1e-3);
    assert_eq!(
        shade_voxel(&scene, &UNIT_GRID, [3, 0, 1], &voxels[&[3, 0, 1]], 0.25),
        DVec3::ZERO
    );
}

#[test]
fn spots_fall_off_in_angle() {
    let spot = Light::Spot {
        position: Vec3::ZERO,
        direction: Vec3::Z,
        intensity: Vec3::splat(2.0),
        inner_deg: 30.0,
        outer_deg: 60.0,
    };
    for (angle_deg, expected) in [(0.0, 0.5), (29.0, 0.5), (45.0, 0.25), (61.0, 0.0)] {
        let angle = f64::to_radians(angle_deg);
        let (_, distance_m, irradiance) =
            arriving_light(&spot, 2.0 * DVec3::new(angle.sin(), 0.0, angle.cos()));
        assert!(
            close(distance_m, 2.0) && close(irradiance.x, expected),
            "{angle_deg}: {irradiance}"
        );
    }
}
