//! Transfer on the host: closed forms, symmetry, and what may not matter.

use std::f64::consts::PI;

use glam::{DVec3, Quat, Vec3};
use lumivox::gi::prt::compress::{CompressSettings, Compressed};
use lumivox::gi::prt::lattice::{LatticeSettings, NONE, Refine};
use lumivox::gi::prt::light::project_sky;
use lumivox::gi::prt::transfer::{Sampling, Transfer, TransferSettings};
use lumivox::gi::shared::sh;
use lumivox::image::Image;
use lumivox::scene::{Light, Scene, Sky};

use super::reference::{add, lambert, quad, scene};
use crate::support::Random;
use crate::support::compare::Worst;

/// That no cells are halved of.
fn lattice(cell_m: f32, inset: f32) -> LatticeSettings {
    LatticeSettings {
        cell_m,
        inset,
        refine: Refine {
            levels: 0,
            difference: 0.1,
            most_nodes: 1_000_000,
        },
    }
}

fn settings(cell_m: f32) -> TransferSettings {
    TransferSettings {
        lattice: lattice(cell_m, 0.1),
        order: 6,
        rays: 1024,
        sampling: Sampling::Cosine,
        bounces: 1,
        has_backs: false,
        invalid_share: 0.25,
        has_lights: true,
        compress: None,
        lobes: None,
    }
}

fn worked_out(scene: &Scene, settings: TransferSettings) -> Transfer {
    Transfer::new(scene, settings, &|_, _| ())
}

/// Irradiance of a point under a uniform sky of radiance 1.
fn under_white(transfer: &Transfer, point: usize) -> f64 {
    f64::from(transfer.irradiance.row(point)[1]) * (4.0 * PI).sqrt()
}

fn floor(albedo: f32) -> Scene {
    let mut scene = scene(Vec3::new(0.0, 3.0, 0.1), Vec3::ZERO, 30.0);
    let quad = quad(Vec3::new(-1.0, 0.0, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0);
    add(&mut scene, lambert(albedo), quad);
    scene
}

/// All six walls of a box, looking inwards.
fn room(albedo: f32) -> Scene {
    let mut scene = floor(albedo);
    scene.triangles.clear();
    let (x, y, z) = (2.0 * Vec3::X, 2.0 * Vec3::Y, 2.0 * Vec3::Z);
    let low = Vec3::new(-1.0, 0.0, -1.0);
    for (corner, a, b) in [
        (low, z, x),
        (low + y, x, z),
        (low, y, z),
        (low + x, z, y),
        (low, x, y),
        (low + z, y, x),
    ] {
        add(&mut scene, lambert(albedo), quad(corner, a, b));
    }
    scene
}

/// T_i = A_l Y_i(n), and E = πL without noise.
#[test]
fn a_plane_in_the_open_has_the_cosine_lobe() {
    let transfer = worked_out(&floor(0.5), settings(0.5));
    let lobe = sh::rotate_zonal(&sh::clamped_cosine(6), DVec3::Y);
    let offs = (0..transfer.lattice.points.len()).flat_map(|point| {
        let row = transfer.irradiance.row(point);
        (row.chunks_exact(3).take(36))
            .zip(&lobe)
            .map(|(rgb, expected)| (f64::from(rgb[0]) - expected).abs())
            .collect::<Vec<_>>()
    });
    let off = offs.worst();
    println!("{} points, off by {off}", transfer.lattice.points.len());
    assert_eq!(transfer.lattice.points.len(), 49);
    assert!(off < 0.006, "{off}");
    for point in 0..49 {
        assert!((under_white(&transfer, point) - PI).abs() < 1e-4);
        assert!((transfer.visibility[point] - 1.0).abs() < 1e-5);
    }
}

/// In a closed room all is dark with points moved inwards; with points at its corners it is not, as
/// published. With all of its light from one wall every bounce is the furnace's.
#[test]
fn closed_rooms_are_dark_but_for_corners() {
    let scene = room(0.5);
    for cell_m in [1.0, 0.5] {
        let dark = worked_out(&scene, settings(cell_m));
        let corners = TransferSettings {
            lattice: lattice(cell_m, 0.0),
            invalid_share: 1.0,
            ..settings(cell_m)
        };
        let open = worked_out(&scene, corners);
        let worst = |transfer: &Transfer| {
            let all = 0..transfer.lattice.points.len();
            all.map(|point| under_white(transfer, point)).worst()
        };
        println!("{cell_m} m: {} and {}", worst(&dark), worst(&open));
        assert!(worst(&dark) == 0.0 && worst(&open) > 0.3);
    }
    // Emission of all walls, two interreflections: π L (1 + ρ + ρ²).
    let mut furnace = room(0.5);
    for material in &mut furnace.materials {
        material.emission = Vec3::splat(2.0);
    }
    let bounced = worked_out(
        &furnace,
        TransferSettings {
            bounces: 3,
            ..settings(0.5)
        },
    );
    let last = 3 * bounced.irradiance.functions as usize - 3;
    let offs = (0..bounced.lattice.points.len()).map(|point| {
        let found = f64::from(bounced.irradiance.row(point)[last]);
        (found / (2.0 * PI * 1.75) - 1.0).abs()
    });
    let off = offs.worst();
    println!("furnace: off by {off}");
    assert!(off < 1e-3, "{off}");
}

/// Turning a scene turns its transfer; the same scene twice is the same, bit by bit.
#[test]
fn transfer_turns_with_the_scene() {
    let mut scene = floor(0.7);
    let block = quad(Vec3::new(-0.3, 0.0, 0.2), Vec3::new(0.9, 0.0, 0.1), Vec3::Y);
    add(&mut scene, lambert(0.4), block);
    let with = TransferSettings {
        bounces: 2,
        has_backs: true,
        ..settings(0.4)
    };
    let first = worked_out(&scene, with);
    assert!(first.irradiance == worked_out(&scene, with).irradiance);
    let turn = Quat::from_axis_angle(Vec3::new(0.3, -0.5, 0.8).normalize(), 1.1);
    let mut turned = scene.clone();
    for vertex in &mut turned.vertices {
        vertex.position = (turn * Vec3::from(vertex.position)).to_array();
        vertex.normal = (turn * Vec3::from(vertex.normal)).to_array();
    }
    let second = worked_out(&turned, with);
    assert_eq!(first.lattice.points.len(), second.lattice.points.len());
    let rotation = sh::Rotation::new(6, glam::DMat3::from_quat(turn.as_dquat()));
    // A ray at the edge of a block may pass it in one of both.
    let mut sum = 0.0;
    for point in 0..first.lattice.points.len() {
        let own: Vec<f64> = first
            .irradiance
            .row(point)
            .chunks(3)
            .map(|rgb| rgb[0].into())
            .collect();
        let expected = rotation.apply(&own);
        let second = second.irradiance.row(point);
        let found = second.chunks(3).map(|rgb| f64::from(rgb[0]));
        sum += found
            .zip(&expected)
            .map(|(a, b)| (a - b).abs())
            .sum::<f64>();
    }
    let off = sum / (36 * first.lattice.points.len()) as f64;
    println!("off by {off} in the mean");
    assert!(off < 1e-4, "{off}");
}

/// A map that is turned has harmonics that are turned; with the sign (−1)^m that other tables have
/// it has not.
#[test]
fn skies_turn_as_their_harmonics_do() {
    let mut random = Random::new(3);
    let smooth = |turn: f64| {
        let (sin, cos) = turn.sin_cos();
        Image::from_fn(256, 128, |index| {
            let (u, v) = ((index % 256) as f64 + 0.5, (index / 256) as f64 + 0.5);
            let (a, up) = (u / 256.0 * 2.0 * PI, v / 128.0 * PI);
            let (x, z) = (up.sin() * a.sin(), -up.sin() * a.cos());
            let (x, z) = (cos * x - sin * z, sin * x + cos * z);
            Vec3::splat((1.5 + x + 0.4 * z * z + 0.2 * up.cos()) as f32)
        })
    };
    let turn = 0.3 + f64::from(random.unit());
    let plain = project_sky(6, &Sky::new(smooth(0.0), 0.0).unwrap());
    let turned = project_sky(6, &Sky::new(smooth(turn), 0.0).unwrap());
    let off = |sign: fn(isize) -> f64| {
        let flip = |values: &[DVec3]| -> Vec<f64> {
            let signed = |(at, rgb): (usize, &DVec3)| {
                let l = at.isqrt();
                rgb.x * sign(at as isize - (l * l + l) as isize)
            };
            values.iter().enumerate().map(signed).collect()
        };
        let rotation = sh::Rotation::new(6, glam::DMat3::from_rotation_y(turn));
        let expected = rotation.apply(&flip(&plain));
        let found = flip(&turned);
        found
            .iter()
            .zip(&expected)
            .map(|(a, b)| (a - b).abs())
            .worst()
    };
    let (right, wrong) = (off(|_| 1.0), off(|m| if m % 2 == 0 { 1.0 } else { -1.0 }));
    println!("off by {right}; with the sign by {wrong}");
    assert!(right < 1e-4 && wrong > 0.1);
    // A constant is the first harmonic alone.
    let white = project_sky(
        6,
        &Sky::new(Image::from_fn(256, 128, |_| Vec3::ONE), 0.0).unwrap(),
    );
    assert!((white[0].x - (4.0 * PI).sqrt()).abs() < 1e-6);
    assert!(white[1..].iter().map(|rgb| rgb.x.abs()).worst() < 1e-3);
}

/// T⁰ between two points of a scene is symmetric: Σ_p A ρ/π T⁰_i T_j = Σ_p A ρ/π T⁰_j T_i.
#[test]
fn interreflection_is_reciprocal() {
    let mut scene = floor(0.5);
    let wall = quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Y * 2.0);
    add(&mut scene, lambert(0.5), wall);
    let direct = worked_out(&scene, settings(0.125));
    let all = worked_out(
        &scene,
        TransferSettings {
            bounces: 2,
            ..settings(0.125)
        },
    );
    let area = |point: usize| {
        // Points at a border have half a cell, and those in a corner a quarter.
        let position = direct.lattice.points[point].position;
        let normal = direct.lattice.points[point].normal;
        let flat = [position.x, position.y, position.z].map(f64::from);
        let is_end = |axis: usize, low: f64, high: f64| {
            let off = (flat[axis] - low).abs().min((flat[axis] - high).abs());
            if off < 0.04 { 0.5 } else { 1.0 }
        };
        match normal.y > 0.5 {
            true => is_end(0, -1.0, 1.0) * is_end(2, -1.0, 1.0),
            false => is_end(0, -1.0, 1.0) * is_end(1, 0.0, 2.0),
        }
    };
    let mut h = vec![vec![0.0; 9]; 9];
    for point in 0..direct.lattice.points.len() {
        let (first, sum) = (direct.irradiance.row(point), all.irradiance.row(point));
        for (i, row) in h.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                let bounced = f64::from(sum[3 * j]) - f64::from(first[3 * j]);
                *entry += area(point) * f64::from(first[3 * i]) * bounced;
            }
        }
    }
    let largest = h.iter().flatten().map(|entry| entry.abs()).worst();
    let offs = (0..9).flat_map(|i| (0..9).map(move |j| (i, j)));
    let off = offs.map(|(i, j)| (h[i][j] - h[j][i]).abs()).worst() / largest;
    println!("off by {off} of the largest");
    assert!(off < 0.01, "{off}");
}

/// What is kept in a file is what was worked out, bit by bit; a damaged file is worked out again,
/// and what differs in anything but the environment has a file of its own.
#[test]
fn transfer_is_kept_on_disk() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = room(0.5);
    scene.lights = crate::support::technique::small_lights()
        .map(|(_, light)| light)
        .to_vec();
    let with = TransferSettings {
        rays: 64,
        bounces: 2,
        ..settings(0.5)
    };
    let fresh = worked_out(&scene, with);
    let kept = |scene: &Scene, with: TransferSettings| {
        Transfer::kept(scene, with, folder.path(), &|_, _| ())
    };
    let files = || std::fs::read_dir(folder.path()).unwrap().count();
    assert!(kept(&scene, with) == fresh && kept(&scene, with) == fresh);
    assert_eq!(files(), 1);
    // Its brightness is live, as the environment is.
    scene.environment = Vec3::ONE.into();
    for light in &mut scene.lights {
        if let lumivox::scene::Light::Point { intensity, .. } = light {
            *intensity *= 3.0;
        }
    }
    assert!(kept(&scene, with) == fresh);
    assert_eq!(files(), 1);
    let file = std::fs::read_dir(folder.path()).unwrap().next().unwrap();
    let path = file.unwrap().path();
    let whole = std::fs::read(&path).unwrap();
    let mut broken = whole.clone();
    broken[whole.len() / 2] ^= 1;
    for damaged in [&broken[..], &whole[..40], &[]] {
        std::fs::write(&path, damaged).unwrap();
        assert!(kept(&scene, with) == fresh);
        assert_eq!(std::fs::read(&path).unwrap(), whole);
    }
    for material in &mut scene.materials {
        material.albedo *= 0.5;
    }
    assert!(kept(&scene, with) != fresh);
    assert!(kept(&scene, TransferSettings { rays: 65, ..with }) != fresh);
    assert_eq!(files(), 3);
    let compress = Some(CompressSettings {
        clusters: 4,
        vectors: 3,
    });
    let with = TransferSettings { compress, ..with };
    let fresh = worked_out(&scene, with);
    assert!(fresh.irradiance.harmonics.is_some());
    assert!(kept(&scene, with) == fresh && kept(&scene, with) == fresh);
    assert_eq!(files(), 4);
}

/// One corner in the shade does not halve a large floor, and halves squares of its own.
#[test]
fn a_large_triangle_is_not_halved_for_one_corner() {
    let most = |squares: u32| {
        let mut scene = floor(0.5);
        scene.triangles.clear();
        let size = 8.0 / squares as f32;
        for at in 0..squares * squares {
            let corner = Vec3::new((at % squares) as f32, 0.0, -((at / squares) as f32));
            let corner = size * corner + Vec3::new(-4.0, 0.0, 4.0);
            let square = quad(corner, size * Vec3::X, -size * Vec3::Z);
            add(&mut scene, lambert(0.5), square);
        }
        let floor = scene.triangles.len();
        let wall = quad(Vec3::new(3.5, 0.0, 3.6), 0.5 * Vec3::X, 0.5 * Vec3::Y);
        add(&mut scene, lambert(0.5), wall);
        let mut with = TransferSettings {
            rays: 256,
            bounces: 1,
            ..settings(1.0)
        };
        with.lattice.refine.levels = 1;
        let rows = worked_out(&scene, with).lattice.triangles;
        rows[..floor].iter().map(|row| row.cells).max()
    };
    // 8 m at most √2 long, in cells of a metre: 12.
    assert_eq!([1, 8].map(most), [Some(12), Some(4)]);
}

/// Cells are halved where a wall hides the sky, and the light of the floor has no step where they
/// are: along each edge both of its triangles have the same.
#[test]
fn halved_cells_leave_no_steps() {
    let mut scene = floor(0.5);
    scene.triangles.clear();
    // Four by four squares, and a wall that stands on the middle.
    for at in 0..16 {
        let corner = Vec3::new(-2.0 + (at % 4) as f32, 0.0, 2.0 - (at / 4) as f32);
        add(&mut scene, lambert(0.5), quad(corner, Vec3::X, -Vec3::Z));
    }
    let wall = quad(Vec3::new(-0.5, 0.0, 0.1), Vec3::X, Vec3::Y);
    add(&mut scene, lambert(0.5), wall);
    let with = |levels| TransferSettings {
        lattice: LatticeSettings {
            refine: Refine {
                levels,
                ..lattice(1.0, 0.1).refine
            },
            ..lattice(1.0, 0.1)
        },
        rays: 256,
        bounces: 2,
        ..settings(1.0)
    };
    let [plain, fine] = [0, 3].map(|levels| worked_out(&scene, with(levels)));
    assert!(plain.lattice.hanging.is_empty() && !fine.lattice.hanging.is_empty());
    let cells: Vec<u32> = fine.lattice.triangles.iter().map(|row| row.cells).collect();
    assert!(
        cells.contains(&2) && cells.iter().max() >= Some(&8),
        "{cells:?}"
    );
    let light = |triangle: u32, at: [f32; 2]| -> Vec<f64> {
        let around = fine.lattice.at(triangle, false, at).unwrap();
        let mut sums = vec![0.0; 108];
        for (point, share) in around {
            let row = fine.irradiance.row(point as usize);
            let pairs = sums.iter_mut().zip(&row);
            pairs.for_each(|(sum, own)| *sum += f64::from(share) * f64::from(*own));
        }
        sums
    };
    // By the ends of each edge of the floor: its triangles, and which corners they have there.
    let mut edges = std::collections::BTreeMap::<_, Vec<_>>::new();
    for (number, triangle) in (0u32..).zip(&scene.triangles).take(32) {
        let places = triangle.vertices.map(|vertex| {
            scene.vertices[vertex as usize]
                .position
                .map(|x| (64.0 * x) as i32)
        });
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = if places[a] < places[b] {
                (a, b)
            } else {
                (b, a)
            };
            edges
                .entry((places[a], places[b]))
                .or_default()
                .push((number, a, b));
        }
    }
    let mut compared = 0;
    for sides in edges.values().filter(|sides| sides.len() == 2) {
        if sides
            .iter()
            .any(|(number, ..)| fine.lattice.triangles[*number as usize].first[0] == NONE)
        {
            continue;
        }
        for step in 0..=40 {
            let [one, other] = [0, 1].map(|side| {
                let (number, a, b) = sides[side];
                let mut shares = [0.0f32; 3];
                shares[a] += 1.0 - step as f32 / 40.0;
                shares[b] += step as f32 / 40.0;
                light(number, [shares[1], shares[2]])
            });
            let off = one.iter().zip(&other).map(|(a, b)| (a - b).abs()).worst();
            assert!(off < 1e-4, "{sides:?} at {step}: {off}");
            compared += 1;
        }
    }
    assert!(compared > 500, "{compared}");
}

fn squared_off(rows: &[f32], stride: usize, compressed: &Compressed) -> f64 {
    let all = rows.chunks_exact(stride).enumerate();
    all.map(|(at, row)| {
        let rebuilt = compressed.row(at);
        let pairs = row.iter().zip(&rebuilt);
        pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>()
    })
    .sum()
}

/// Rows that lie in a few planes come back; the vectors of a cluster are orthonormal.
#[test]
fn clusters_rebuild_rows_of_low_rank() {
    let mut random = Random::new(11);
    let (stride, planes, rank) = (30, 5, 2);
    let mut vector =
        |size: f32| -> Vec<f32> { (0..stride).map(|_| size * (random.unit() - 0.5)).collect() };
    let middles: Vec<_> = (0..planes).map(|_| vector(40.0)).collect();
    let spans: Vec<_> = (0..planes * rank).map(|_| vector(2.0)).collect();
    let mut rows = Vec::new();
    for at in 0..2000 {
        let plane = at * 7 % planes;
        let mut row = middles[plane].clone();
        for span in &spans[plane * rank..][..rank] {
            let factor = random.unit() - 0.5;
            row.iter_mut()
                .zip(span)
                .for_each(|(sum, value)| *sum += factor * value);
        }
        rows.extend(row);
    }
    let size: f64 = rows.iter().map(|value| f64::from(*value).powi(2)).sum();
    let off = |clusters, vectors| {
        let settings = CompressSettings { clusters, vectors };
        let compressed = Compressed::new(&rows, stride, settings);
        assert_eq!(compressed, Compressed::new(&rows, stride, settings));
        let basis = compressed
            .basis
            .chunks_exact((1 + vectors as usize) * stride);
        for own in basis {
            let own: Vec<&[f32]> = own[stride..].chunks_exact(stride).collect();
            for (i, a) in own.iter().enumerate() {
                for (j, b) in own.iter().enumerate() {
                    let product: f32 = a.iter().zip(*b).map(|(a, b)| a * b).sum();
                    let is_none = a.iter().all(|value| *value == 0.0);
                    let expected = if i == j && !is_none { 1.0 } else { 0.0 };
                    assert!((product - expected).abs() < 1e-4, "{i} {j}: {product}");
                }
            }
        }
        (squared_off(&rows, stride, &compressed) / size).sqrt()
    };
    let [exact, more, few, mean] = [off(5, 2), off(8, 4), off(5, 1), off(5, 0)];
    println!("off by {exact:.1e}, {more:.1e}, {few:.1e} and {mean:.1e} of their length");
    assert!(exact < 1e-5 && more < 1e-5);
    assert!(few > 1e-3 && mean > few);
    // One cluster: principal components of all.
    let [all, less] = [off(1, 14), off(1, 4)];
    println!("one cluster: {all:.1e} and {less:.1e}");
    assert!(all < 1e-4 && less > 1e-2);
}

/// Two lines that stand across: rows at the end of one are nearest to the middle of the other, and
/// are rebuilt by their own.
#[test]
fn rows_go_to_the_cluster_that_rebuilds_them() {
    let mut random = Random::new(12);
    let (stride, count) = (12, 1000);
    let mut rows = vec![0.0; count * stride];
    for (at, row) in rows.chunks_exact_mut(stride).enumerate() {
        let along = 20.0 * (random.unit() - 0.5);
        if at % 2 == 0 {
            row[0] = along;
        } else {
            (row[0], row[1]) = (6.0, along);
        }
    }
    let settings = CompressSettings {
        clusters: 2,
        vectors: 1,
    };
    let compressed = Compressed::new(&rows, stride, settings);
    let size: f64 = rows.iter().map(|value| f64::from(*value).powi(2)).sum();
    let off = (squared_off(&rows, stride, &compressed) / size).sqrt();
    println!("off by {off:.1e} of their length");
    assert!(off < 1e-5);
}

/// Fewer rows than clusters, rows that are all the same, and none at all.
#[test]
fn few_rows_make_few_clusters() {
    let settings = CompressSettings {
        clusters: 64,
        vectors: 8,
    };
    for rows in [
        Vec::new(),
        vec![0.0; 12],
        vec![3.0; 12 * 100],
        (0..12 * 9).map(|at| (at * at % 17) as f32).collect(),
    ] {
        let compressed = Compressed::new(&rows, 12, settings);
        let clusters = compressed.basis.len() / (12 * 9);
        assert!(clusters <= rows.len() / 12);
        assert_eq!(compressed.clusters.len(), rows.len() / 12);
        let off = squared_off(&rows, 12, &compressed);
        assert!(off < 1e-9, "{off}");
        assert!(compressed.basis.iter().all(|value| value.is_finite()));
    }
}

/// Lights that move have their columns worked out anew, and nothing else is; it is what a build
/// finds that begins with them there.
#[test]
fn lights_that_move_take_their_columns_along() {
    let mut scene = room(0.5);
    scene.lights = crate::support::technique::small_lights()
        .map(|(_, light)| light)
        .to_vec();
    for material in &mut scene.materials {
        material.emission = Vec3::splat(0.1);
    }
    for compress in [
        None,
        Some(CompressSettings {
            clusters: 3,
            vectors: 2,
        }),
    ] {
        let with = TransferSettings {
            rays: 64,
            bounces: 2,
            compress,
            ..settings(0.5)
        };
        let mut followed = worked_out(&scene, with);
        let mut moved = scene.clone();
        let places = [0, 2];
        for at in places {
            match &mut moved.lights[at] {
                Light::Point { position, .. } | Light::Spot { position, .. } => position.x += 0.1,
                Light::Directional { direction, .. } => {
                    *direction = Quat::from_rotation_z(0.3) * *direction;
                }
            }
        }
        let before = followed.clone();
        followed.move_lights(&moved, with, &places, &|_, _| ());
        assert!(followed != before);
        assert!(followed == worked_out(&moved, with));
    }
}

/// What clusters lose of a room under every sky, and what they do not touch.
#[test]
fn compressed_transfer_is_near() {
    let mut scene = room(0.5);
    scene.triangles.truncate(10);
    scene.lights = vec![crate::support::technique::small_lights()[0].1];
    let plain = settings(0.2);
    let with = |clusters, vectors| TransferSettings {
        compress: Some(CompressSettings { clusters, vectors }),
        ..plain
    };
    let exact = worked_out(&scene, plain);
    let size = |transfer: &Transfer| -> f64 {
        let rows = (0..exact.lattice.points.len()).flat_map(|point| transfer.irradiance.row(point));
        rows.map(|value| f64::from(value).powi(2)).sum()
    };
    let whole = size(&exact);
    let off = |clusters, vectors| {
        let found = worked_out(&scene, with(clusters, vectors));
        assert_eq!(found.lattice, exact.lattice);
        let mut sum = 0.0;
        for point in 0..exact.lattice.points.len() {
            let (expected, found) = (exact.irradiance.row(point), found.irradiance.row(point));
            // The column of the lamp is as it was.
            assert_eq!(expected[108..], found[108..]);
            let pairs = expected.iter().zip(&found);
            sum += pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
        }
        (sum / whole).sqrt()
    };
    let [vq, pca, few, cpca] = [off(64, 0), off(1, 8), off(16, 4), off(64, 8)];
    println!("vq {vq:.4}, pca {pca:.4}, 16 × 4 {few:.4}, 64 × 8 {cpca:.4}");
    assert!(cpca < few && cpca < pca && few < vq);
    assert!(cpca < 0.02, "{cpca}");
}

/// The inside of a unit sphere of which such a part is open, at the top.
fn bowl(open: f32, albedo: f32) -> Scene {
    let mut scene = floor(albedo);
    scene.triangles.clear();
    let (rings, columns) = (10, 32);
    let steepest = (2.0 * open - 1.0).acos();
    let place = |ring: u32, column: u32| {
        let (sin, cos) = (steepest * ring as f32 / rings as f32).sin_cos();
        let turn = std::f32::consts::TAU * (column % columns) as f32 / columns as f32;
        Vec3::new(sin * turn.cos(), -cos, sin * turn.sin())
    };
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for column in 0..columns {
            let corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
                .map(|(down, along)| place(ring + down, column + along));
            for [a, b, c] in [[0, 2, 1], [0, 3, 2]].map(|all: [usize; 3]| all.map(|at| corners[at]))
            {
                let area = (b - a).cross(c - a);
                if area.length() < 1e-6 {
                    continue;
                }
                let [b, c] = if area.dot(a) < 0.0 { [b, c] } else { [c, b] };
                triangles.push([a, b, c].map(|corner| (corner, -corner, glam::Vec2::ZERO)));
            }
        }
    }
    add(&mut scene, lambert(albedo), triangles);
    scene
}

/// In a sphere of which the part f is open, E = π L f Σ (ρ (1 − f))ᵏ everywhere; it tends to the
/// furnace's π L where nothing is absorbed.
#[test]
fn bowls_hold_their_light() {
    for (open, albedo, bounces) in [(0.5, 0.6, 1), (0.5, 0.6, 3), (0.25, 0.8, 4), (0.5, 1.0, 8)] {
        let with = TransferSettings {
            bounces,
            ..settings(0.5)
        };
        let transfer = worked_out(&bowl(open, albedo), with);
        let (open, albedo) = (f64::from(open), f64::from(albedo));
        let sum: f64 = (0..bounces)
            .map(|k| (albedo * (1.0 - open)).powi(k as i32))
            .sum();
        let expected = PI * open * sum;
        let all = 0..transfer.lattice.points.len();
        let count = all.len() as f64;
        let found: Vec<f64> = all.map(|point| under_white(&transfer, point)).collect();
        let bias = found.iter().sum::<f64>() / count / expected - 1.0;
        let off = found.iter().map(|one| (one / expected - 1.0).abs()).worst();
        println!("{open} open, albedo {albedo}, {bounces} bounces: {bias:+.5}, worst {off:.4}");
        assert!(bias.abs() < 0.01 && off < 0.08, "{bias} {off}");
    }
}

/// A wall hides half of the sky from its foot, and no surface has more light than a sky of one
/// radiance brings to one in the open.
#[test]
fn walls_hide_half_and_nothing_is_brighter_than_the_sky() {
    let mut scene = floor(0.9);
    let far = 400.0;
    let corner = Vec3::new(-0.5 * far, 0.0, -1.0);
    add(
        &mut scene,
        lambert(0.9),
        quad(corner, Vec3::X * far, Vec3::Y * far),
    );
    let transfer = worked_out(&scene, settings(50.0));
    let mut feet = 0;
    for (point, place) in transfer.lattice.points.iter().enumerate() {
        let is_foot = place.normal.y > 0.5 && place.position.z < -0.8;
        if is_foot {
            let found = under_white(&transfer, point);
            assert!((found / (0.5 * PI) - 1.0).abs() < 0.02, "{found}");
            feet += 1;
        }
    }
    assert!(feet >= 2, "{feet}");
    let mut yard = floor(0.95);
    let block = quad(Vec3::new(-0.3, 0.0, 0.2), Vec3::new(0.9, 0.0, 0.1), Vec3::Y);
    add(&mut yard, lambert(0.95), block);
    let with = TransferSettings {
        bounces: 8,
        has_backs: true,
        ..settings(0.25)
    };
    let transfer = worked_out(&yard, with);
    let brightest = (0..transfer.lattice.points.len()).map(|point| under_white(&transfer, point));
    let brightest = brightest.worst();
    println!("the brightest has {:.4} of the sky's", brightest / PI);
    assert!(brightest / PI < 1.0 + 1e-3);
}

/// Points below a sheet see its back, and have their own light all the same; those that a box of
/// any height stands on see backs as well, and have that of points around it.
#[test]
fn sheets_shade_and_boxes_are_filled() {
    let low = Vec3::new(-0.5, 0.0, 0.5);
    let lid = |height: f32| quad(low + height * Vec3::Y, Vec3::X, -Vec3::Z);
    let of = |scene: &Scene, invalid_share: f32| {
        let with = TransferSettings {
            invalid_share,
            bounces: 2,
            ..settings(0.2)
        };
        worked_out(scene, with)
    };
    for height in [0.05, 0.2, 0.6] {
        let mut sheet = floor(0.5);
        add(&mut sheet, lambert(0.5), lid(height));
        let [filled, own] = [0.25, 1.0].map(|share| of(&sheet, share));
        // Next to nothing gets past the edge of the lowest: it is taken for a lid.
        assert_eq!(filled == own, height > 0.1, "a sheet at {height}");

        let (mut boxed, up) = (floor(0.5), height * Vec3::Y);
        add(&mut boxed, lambert(0.5), lid(height));
        for (corner, along) in [
            (low, Vec3::X),
            (low + Vec3::X, -Vec3::Z),
            (low + Vec3::X - Vec3::Z, -Vec3::X),
            (low - Vec3::Z, Vec3::Z),
        ] {
            add(&mut boxed, lambert(0.5), quad(corner, along, up));
        }
        let [filled, own] = [0.25, 1.0].map(|share| of(&boxed, share));
        let mut inside = 0;
        for (point, place) in own.lattice.points.iter().enumerate() {
            let Vec3 { x, y, z } = place.position;
            if y == 0.0 && x.abs().max(z.abs()) < 0.45 {
                assert_eq!(under_white(&own, point), 0.0);
                let found = under_white(&filled, point);
                assert!(found > 1.0, "{found} in a box of height {height}");
                inside += 1;
            }
        }
        assert!(inside > 8 && filled.filled >= inside, "{inside} points");
    }
}

/// A ceiling over an open floor has what the floor reflects, not what it would reflect itself: the
/// floor has the sky's light, and the ceiling has next to none of it.
#[test]
fn ceilings_are_lit_by_floors() {
    let mut scene = floor(0.5);
    let low = Vec3::new(-0.3, 0.5, -0.3);
    add(
        &mut scene,
        lambert(0.5),
        quad(low, 0.6 * Vec3::X, 0.6 * Vec3::Z),
    );
    let [once, twice] = [1, 2].map(|bounces| {
        let with = TransferSettings {
            bounces,
            ..settings(0.25)
        };
        worked_out(&scene, with)
    });
    let mut seen = 0;
    for (point, place) in once.lattice.points.iter().enumerate() {
        if place.normal.y < -0.5 {
            let more = under_white(&twice, point) - under_white(&once, point);
            assert!((0.7..1.4).contains(&more), "{more} from the floor");
            seen += 1;
        }
    }
    assert!(seen > 8, "{seen} points");
}
