//! `voxel.fragments` and the compact index on the device against the CPU oracle.

use std::collections::{BTreeMap, BTreeSet};

use crate::support::scenes::{
    Corners, LARGEST_UNIT_GRID, bundled, cuboid, in_unit_grid, lump, scene_of, soup,
};
use crate::support::voxels::{
    Read, SetDifference, compare_sets, compare_surfaces, coordinates, occupied, oracle_grid,
    raster_methods, read, voxel_settings, voxelize,
};
use crate::support::{Random, gpu};
use glam::{DVec2, EulerRot, Quat, Vec3};
use lumivox::gi::shared::voxel::oracle::{
    COLUMN_OFFSET, VoxelIndex, block_bases, compact_order, interior, occupancy_words,
};
use lumivox::gi::shared::voxel::{Faces, Method, Surface, VoxelSettings, Voxelizer};
use lumivox::graph::{Error, FrameStats, Gpu};
use lumivox::render::GpuScene;
use lumivox::scene::{Camera, Scene};

/// The scene by every method that the device has: the same bits. Returns that of `compute`.
fn by_all_methods(gpu: &Gpu, scene: &GpuScene, resolution: u32, what: &str) -> Read {
    let compute = voxelize(gpu, scene, voxel_settings(resolution, Method::Compute));
    for method in raster_methods(gpu) {
        let other = voxelize(gpu, scene, voxel_settings(resolution, method));
        same_bits(&compute, &other).unwrap_or_else(|difference| {
            panic!("{what} at {resolution}: compute and {method:?}: {difference}")
        });
    }
    compute
}

fn same_bits(a: &Read, b: &Read) -> Result<(), String> {
    let (in_a, in_b) = (a.occupied(), b.occupied());
    if let Some(voxel) = in_a.symmetric_difference(&in_b).next() {
        return Err(format!(
            "{voxel:?} is in one only, one of {}",
            in_a.symmetric_difference(&in_b).count()
        ));
    }
    if a.voxels.fragment_count != b.voxels.fragment_count {
        return Err(format!(
            "{} and {} fragments",
            a.voxels.fragment_count, b.voxels.fragment_count
        ));
    }
    if let Some(index) = (0..a.records.len()).find(|index| a.records[*index] != b.records[*index]) {
        return Err(format!(
            "record {index}: {:?} and {:?}",
            a.records[index], b.records[index]
        ));
    }
    (a.emission == b.emission)
        .then_some(())
        .ok_or_else(|| "emission".to_owned())
}

/// Checks one scene by all methods and against the oracle.
fn check(gpu: &Gpu, scene: &Scene, resolution: u32, unit_grid: bool, what: &str) -> SetDifference {
    let mut gpu_scene = GpuScene::new(gpu, scene).unwrap();
    if unit_grid {
        in_unit_grid(&mut gpu_scene, resolution);
    }
    let voxels = by_all_methods(gpu, &gpu_scene, resolution, what);
    let grid = oracle_grid(&voxels.voxels.grid);
    assert!(!unit_grid || (grid.origin == Vec3::ZERO && grid.voxel_size == 1.0));
    let difference = compare_sets(&voxels.occupied(), scene, &grid)
        .unwrap_or_else(|error| panic!("{what} at {resolution}: {error}"));
    check_index(&voxels).unwrap_or_else(|error| panic!("{what} at {resolution}: {error}"));
    difference
}

/// Records, bases and counts against the oracle's compact order of the same occupied voxels.
fn check_index(voxels: &Read) -> Result<(), String> {
    let occupied = voxels.occupied();
    let order = compact_order(occupied.iter().copied());
    let stored: Vec<VoxelIndex> = voxels.records.iter().map(coordinates).collect();
    if voxels.voxels.voxel_count as usize != order.len() {
        return Err(format!(
            "{} voxels are counted, {} occupied",
            voxels.voxels.voxel_count,
            order.len()
        ));
    }
    if stored != order {
        let first = (0..order.len()).find(|index| stored.get(*index) != order.get(*index));
        return Err(format!("the order differs from record {first:?} on"));
    }
    if occupancy_words(occupied.iter().copied(), voxels.voxels.grid.resolution) != voxels.occupancy
    {
        return Err("occupancy words".to_owned());
    }
    (block_bases(&voxels.occupancy) == voxels.bases)
        .then_some(())
        .ok_or_else(|| "block bases".to_owned())
}

fn report(what: &str, total: SetDifference) {
    let share = total.rounding as f64 / total.oracle.max(1) as f64;
    let SetDifference {
        oracle,
        rounding,
        missing,
        worst,
    } = total;
    println!(
        "{what}: {oracle} voxels, {rounding} differ within rounding ({:.4}%), {missing} of them \
         missing, worst {worst:.1e} voxels",
        100.0 * share
    );
    assert!(
        share <= 1e-4,
        "{what}: {rounding} of {oracle} voxels differ"
    );
    assert_eq!(
        missing, 0,
        "{what}: the tested box is larger by what rounding may take away"
    );
}

fn sum(a: SetDifference, b: SetDifference) -> SetDifference {
    SetDifference {
        oracle: a.oracle + b.oracle,
        rounding: a.rounding + b.rounding,
        missing: a.missing + b.missing,
        worst: a.worst.max(b.worst),
    }
}

#[test]
fn cornell_is_the_oracles_at_all_resolutions() {
    let (gpu, scene) = (gpu(), bundled("cornell"));
    let each =
        [8, 16, 32, 64, 128].map(|resolution| check(&gpu, &scene, resolution, false, "cornell"));
    report(
        "cornell, 8 to 128",
        each.into_iter().fold(SetDifference::default(), sum),
    );
}

#[test]
fn random_soups_are_the_oracles() {
    let gpu = gpu();
    for (resolution, count) in [(32, 100), (64, 30)] {
        let mut total = SetDifference::default();
        for seed in 0..count {
            let mut random = Random::new(seed);
            let triangles = soup(&mut random, resolution);
            let scene = scene_of(
                &triangles,
                if seed % 4 == 0 { 7.0 } else { 0.0 },
                &mut random,
            );
            total = sum(
                total,
                check(&gpu, &scene, resolution, true, &format!("soup {seed}")),
            );
        }
        report(&format!("{count} soups at {resolution}"), total);
    }
}

/// Thin surfaces, but for needles: the oracle's by every method, and never more than the
/// conservative ones.
#[test]
fn thin_soups_are_the_oracles() {
    let gpu = gpu();
    let (mut total, mut thin_count, mut touched_count) = (SetDifference::default(), 0, 0);
    for seed in 0..50 {
        let mut random = Random::new(3000 + seed);
        let mut triangles = soup(&mut random, 32);
        // The plane of a needle is not known in f32. Boxes do not need it, for the edges' axes say
        // as much; crosses do.
        triangles.retain(|[a, b, c]| {
            let longest = a.distance(*b).max(b.distance(*c)).max(c.distance(*a));
            (*b - *a).cross(*c - *a).length() > 0.02 * longest * longest
        });
        let scene = scene_of(&triangles, 0.0, &mut random);
        let mut gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
        in_unit_grid(&mut gpu_scene, 32);
        let settings = |method| VoxelSettings {
            surface: Surface::Thin,
            ..voxel_settings(32, method)
        };
        let thin = voxelize(&gpu, &gpu_scene, settings(Method::Compute));
        for method in raster_methods(&gpu) {
            same_bits(&thin, &voxelize(&gpu, &gpu_scene, settings(method)))
                .unwrap_or_else(|difference| panic!("soup {seed}, {method:?}: {difference}"));
        }
        check_index(&thin).unwrap();
        let found = compare_surfaces(
            &thin.occupied(),
            &scene,
            &oracle_grid(&thin.voxels.grid),
            Surface::Thin,
        );
        total = sum(
            total,
            found.unwrap_or_else(|error| panic!("soup {seed}: {error}")),
        );
        let touched = voxelize(&gpu, &gpu_scene, voxel_settings(32, Method::Compute)).occupied();
        assert!(thin.occupied().is_subset(&touched), "soup {seed}");
        (thin_count, touched_count) = (
            thin_count + thin.records.len(),
            touched_count + touched.len(),
        );
    }
    report("50 thin soups", total);
    println!("{thin_count} thin of {touched_count} touched voxels");
    assert!(thin_count < touched_count * 9 / 10);
}

/// No path from face to face leads through a closed thin surface, however it lies; a path over
/// corners does lead through some.
#[test]
fn a_closed_thin_surface_separates() {
    let gpu = gpu();
    let mut leaking = 0;
    for seed in 0..20 {
        let mut random = Random::new(4000 + seed);
        let turn = Quat::from_euler(
            glam::EulerRot::XYZ,
            6.0 * random.unit(),
            6.0 * random.unit(),
            6.0 * random.unit(),
        );
        let shift = Vec3::new(random.unit(), random.unit(), random.unit());
        let mut builder = crate::support::technique::Builder::default();
        let matte = builder.matte("box", Vec3::splat(0.5));
        builder.cuboid(matte, Vec3::new(-6.0, -7.0, -8.0), Vec3::new(6.0, 7.0, 8.0));
        let mut scene = builder.finish("box", Vec::new(), Vec3::ZERO, Camera::default());
        scene.vertices.iter_mut().for_each(|vertex| {
            vertex.position = (turn * Vec3::from(vertex.position) + 15.5 + shift).to_array()
        });
        let mut gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
        in_unit_grid(&mut gpu_scene, 32);
        let thin = voxelize(
            &gpu,
            &gpu_scene,
            VoxelSettings {
                surface: Surface::Thin,
                ..voxel_settings(32, Method::Compute)
            },
        )
        .occupied();
        assert!(
            !reaches(&thin, false),
            "box {seed} lets a path through its faces"
        );
        leaking += u32::from(reaches(&thin, true));
    }
    assert!(
        leaking > 10,
        "thin surfaces are thicker than they need to be: only {leaking} of 20 let paths over \
         corners through"
    );
}

/// Whether a path through empty voxels leads from a corner of the grid of 32³ to its middle, from
/// face to face or over corners and edges too.
fn reaches(occupied: &BTreeSet<VoxelIndex>, corners: bool) -> bool {
    let mut seen: BTreeSet<VoxelIndex> = BTreeSet::from([[0; 3]]);
    let mut next = vec![[0u32; 3]];
    while let Some(voxel) = next.pop() {
        for step in (0..27)
            .map(|at| [at % 3, at / 3 % 3, at / 9].map(|step| step - 1i32))
            .filter(|step| corners || step.map(i32::abs).iter().sum::<i32>() == 1)
        {
            let to = [0, 1, 2].map(|axis| voxel[axis].wrapping_add_signed(step[axis]));
            if to.iter().all(|i| *i < 32) && !occupied.contains(&to) && seen.insert(to) {
                next.push(to);
            }
        }
    }
    seen.contains(&[16; 3])
}

/// Voxels that are not a power of two wide, and the sizes that the soups leave out.
#[test]
fn soups_in_any_grid_are_the_oracles() {
    let gpu = gpu();
    let mut total = SetDifference::default();
    for (seed, resolution) in [(0, 8), (1, 8), (2, 16), (3, 16), (4, 32), (5, 64), (6, 128)] {
        let mut random = Random::new(1000 + seed);
        let mut triangles = soup(&mut random, resolution);
        triangles
            .iter_mut()
            .flatten()
            .for_each(|corner| *corner = *corner * 0.137 - Vec3::new(3.3, 0.1, -7.7));
        let scene = scene_of(&triangles, 0.0, &mut random);
        total = sum(
            total,
            check(
                &gpu,
                &scene,
                resolution,
                false,
                &format!("soup {seed} in its own grid"),
            ),
        );
    }
    report("soups in their own grids", total);
}

#[test]
fn small_triangles_are_the_oracles() {
    let gpu = gpu();
    let scene = scene_of(&lump(64, LARGEST_UNIT_GRID), 0.0, &mut Random::new(5));
    report(
        "lump of 16,384 triangles, 64",
        check(&gpu, &scene, 64, true, "lump"),
    );
    report(
        "lump of 16,384 triangles, 128",
        check(&gpu, &scene, 128, false, "lump"),
    );
}

/// 60,000 textured triangles, some masked: masks take fragments away, so that only all methods'
/// agreement and `none extra` hold.
#[test]
fn atrium_is_the_same_by_all_methods_and_has_none_extra() {
    let (gpu, scene) = (gpu(), bundled("atrium"));
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let voxels = by_all_methods(&gpu, &gpu_scene, 64, "atrium");
    check_index(&voxels).unwrap();
    let mut solid = scene.clone();
    solid
        .materials
        .iter_mut()
        .for_each(|material| material.mask_texture = None);
    let mut solid_gpu = GpuScene::new(&gpu, &solid).unwrap();
    solid_gpu.bounds = gpu_scene.bounds;
    let solid_voxels = by_all_methods(&gpu, &solid_gpu, 64, "atrium without masks");
    let difference = compare_sets(
        &solid_voxels.occupied(),
        &solid,
        &oracle_grid(&solid_voxels.voxels.grid),
    )
    .unwrap();
    report("atrium without masks, 64", difference);
    let (masked, all) = (voxels.occupied(), solid_voxels.occupied());
    println!(
        "atrium: {} voxels, {} without masks",
        masked.len(),
        all.len()
    );
    assert!(masked.is_subset(&all) && masked.len() < all.len());
}

/// A tiny triangle in the middle of each of some voxels.
fn dots(voxels: &[VoxelIndex]) -> Vec<Corners> {
    let dot = |voxel: &VoxelIndex| {
        [
            Vec3::new(0.2, 0.3, 0.4),
            Vec3::new(0.7, 0.4, 0.5),
            Vec3::new(0.4, 0.8, 0.6),
        ]
        .map(|at| at + Vec3::from(voxel.map(|i| i as f32)))
    };
    voxels.iter().map(dot).collect()
}

#[test]
fn compact_index_at_every_count() {
    let gpu = gpu();
    for resolution in [8u32, 32, 64] {
        for count in [0usize, 1, 63, 64, 65, 4096] {
            let mut random = Random::new(u64::from(resolution) + count as u64);
            let mut chosen = BTreeSet::new();
            while chosen.len() < count.min(resolution.pow(3) as usize) {
                chosen.insert([0; 3].map(|_: u32| random.below(resolution)));
            }
            let mut triangles = dots(&chosen.iter().copied().collect::<Vec<_>>());
            triangles.push([Vec3::ONE; 3]);
            let mut scene = GpuScene::new(&gpu, &scene_of(&triangles, 0.0, &mut random)).unwrap();
            in_unit_grid(&mut scene, resolution);
            let voxels = by_all_methods(&gpu, &scene, resolution, &format!("{count} dots"));
            assert_eq!(voxels.occupied(), chosen, "{count} dots at {resolution}");
            assert_eq!(voxels.voxels.fragment_count as usize, chosen.len());
            check_index(&voxels)
                .unwrap_or_else(|error| panic!("{count} dots at {resolution}: {error}"));
        }
    }
}

/// Every voxel of a 128³ grid, 2,097,152 of them, by planes between the layers: more blocks than
/// one scan group and more groups than one pass.
#[test]
fn compact_index_of_a_full_grid() {
    let gpu = gpu();
    let resolution = 64u32;
    let n = resolution as f32;
    let layer = |z: f32| {
        [[
            Vec3::new(0.0, 0.0, z),
            Vec3::new(2.0 * n, 0.0, z),
            Vec3::new(0.0, 2.0 * n, z),
        ]]
    };
    let triangles: Vec<Corners> = (0..resolution)
        .flat_map(|z| layer(z as f32 + 0.5))
        .collect();
    let mut scene = GpuScene::new(&gpu, &scene_of(&triangles, 0.0, &mut Random::new(1))).unwrap();
    in_unit_grid(&mut scene, resolution);
    let voxels = voxelize(&gpu, &scene, voxel_settings(resolution, Method::Compute));
    assert_eq!(voxels.voxels.voxel_count, resolution.pow(3));
    check_index(&voxels).unwrap();
    assert!(voxels.occupancy.iter().all(|word| *word == u32::MAX));
}

#[test]
fn scene_without_triangles_is_an_empty_grid() {
    let gpu = gpu();
    let scene = GpuScene::new(&gpu, &Scene::default()).unwrap();
    let voxels = by_all_methods(&gpu, &scene, 32, "nothing");
    assert_eq!(
        (voxels.voxels.voxel_count, voxels.voxels.fragment_count),
        (0, 0)
    );
    check_index(&voxels).unwrap();
}

/// Bodies of many kinds in a room: a lump, a box within a box, boxes that reach into each other and
/// through the room's wall, and sheets that enclose nothing.
fn bodies(random: &mut Random) -> Vec<Corners> {
    let turned = |triangle: Corners| [triangle[0], triangle[2], triangle[1]];
    let boxed = |low: Vec3, high: Vec3, turn: f32| {
        let turn = Quat::from_euler(EulerRot::XYZ, turn, 2.0 * turn, 0.3 * turn);
        cuboid(0.5 * (low + high), 0.5 * (high - low), turn)
    };
    let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let mut all: Vec<Corners> = lump(8, 24).into_iter().map(turned).collect();
    all.extend(
        boxed(at(1.03, 1.07, 1.01), at(30.4, 30.3, 30.2), 0.0)
            .into_iter()
            .map(turned),
    );
    all.extend(boxed(at(20.2, 3.1, 4.3), at(27.7, 9.4, 10.6), 0.4));
    all.extend(boxed(at(18.2, 16.1, 20.3), at(29.1, 27.4, 28.6), 0.2));
    all.extend(boxed(at(21.2, 19.3, 22.1), at(26.3, 24.2, 26.7), 0.7));
    all.extend(boxed(at(3.3, 22.1, 20.3), at(10.1, 27.4, 26.2), 0.3));
    all.extend(boxed(at(7.3, 24.1, 22.3), at(14.1, 29.4, 28.2), -0.5));
    all.extend(boxed(at(25.3, 11.1, 12.3), at(34.1, 15.4, 18.2), 0.1));
    // Of sheets with two sides: hollow.
    let tent = boxed(at(11.2, 2.3, 21.1), at(16.8, 8.4, 27.3), 0.15);
    all.extend(tent.iter().copied());
    all.extend(tent.into_iter().map(turned));
    // On the floor, and one on the other: a body begins where another ends.
    all.extend(boxed(at(2.3, 1.07, 2.2), at(8.7, 5.4, 6.6), 0.0));
    all.extend(boxed(at(3.3, 5.4, 2.9), at(7.7, 9.4, 6.1), 0.0));
    for _ in 0..6 {
        let middle = 8.0 + 16.0 * at(random.unit(), random.unit(), random.unit());
        let corners = [0; 3]
            .map(|_: u32| middle + 8.0 * (at(random.unit(), random.unit(), random.unit()) - 0.5));
        all.extend([corners, turned(corners)]);
    }
    all
}

/// Voxels that some column decides within this much of its place \[voxels\] may be either.
const COLUMN_ROUNDING: DVec2 = DVec2::new(2e-3, -1e-3);

/// Solid voxels are those that surfaces touch and those inside of bodies, which are black, opaque
/// and dark; not those of rooms.
#[test]
fn solid_voxels_are_what_is_inside_of_bodies() {
    let gpu = gpu();
    let mut random = Random::new(61);
    let scene = scene_of(&bodies(&mut random), 2.0, &mut random);
    let mut gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    in_unit_grid(&mut gpu_scene, 32);
    for faces in [None, Some(Faces::Front), Some(Faces::Both)] {
        let settings = |surface| VoxelSettings {
            surface,
            faces,
            ..voxel_settings(32, Method::Compute)
        };
        let hollow = voxelize(&gpu, &gpu_scene, settings(Surface::Conservative));
        let solid = voxelize(&gpu, &gpu_scene, settings(Surface::Solid));
        check_index(&solid).unwrap();
        let (surface, all) = (hollow.occupied(), solid.occupied());
        assert!(surface.is_subset(&all));
        let filled: BTreeSet<_> = all.difference(&surface).copied().collect();
        let grid = oracle_grid(&solid.voxels.grid);
        let by_oracle = |shift: DVec2| -> BTreeSet<_> {
            let inside = interior(&scene, &grid, shift);
            inside
                .into_iter()
                .filter(|voxel| !surface.contains(voxel))
                .collect()
        };
        let (expected, near) = (
            by_oracle(COLUMN_OFFSET),
            by_oracle(COLUMN_OFFSET + COLUMN_ROUNDING),
        );
        let doubtful: BTreeSet<_> = expected.symmetric_difference(&near).copied().collect();
        let differ: Vec<_> = filled
            .symmetric_difference(&expected)
            .filter(|voxel| !doubtful.contains(*voxel))
            .collect();
        println!(
            "{} of {} voxels are inside, {} doubtful",
            filled.len(),
            all.len(),
            doubtful.len()
        );
        assert!(differ.is_empty(), "{differ:?}");
        assert!(
            filled.len() > 500 && doubtful.len() < 20,
            "{}",
            filled.len()
        );
        for (record, emission) in solid.records.iter().zip(&solid.emission) {
            if filled.contains(&coordinates(record)) {
                assert_eq!(record.albedo, 0);
                assert_eq!(record.coverage & 0xfff, 0xfff);
                assert_eq!(emission[..3], [0.0; 3]);
            }
        }
        // Surfaces have the records that they have without what is inside.
        let records = |read: &Read| -> BTreeMap<_, _> {
            read.records
                .iter()
                .map(|record| (coordinates(record), *record))
                .collect()
        };
        let (before, after) = (records(&hollow), records(&solid));
        assert!(before.iter().all(|(voxel, record)| after[voxel] == *record));
    }
}

/// A voxelizer that has learnt the size of one scene meets a larger and then a smaller one.
#[test]
fn fragments_that_do_not_fit_are_not_lost() {
    let gpu = gpu();
    let mut random = Random::new(77);
    let scenes = [
        dots(&[[3, 4, 5]]),
        soup(&mut random, 32),
        dots(&[[3, 4, 5], [7, 7, 7]]),
        soup(&mut random, 32),
        Vec::new(),
    ];
    let scenes = scenes.map(|triangles| {
        let mut scene = GpuScene::new(&gpu, &scene_of(&triangles, 3.0, &mut random)).unwrap();
        in_unit_grid(&mut scene, 32);
        scene
    });
    for method in [vec![Method::Compute], raster_methods(&gpu)].concat() {
        let settings = voxel_settings(32, method);
        let mut voxelizer = Voxelizer::new(&gpu, &scenes[0], settings).unwrap();
        for (index, scene) in scenes.iter().enumerate() {
            let again = read(&gpu, voxelizer.run(&gpu, scene).unwrap().0);
            let fresh = voxelize(&gpu, scene, settings);
            same_bits(&again, &fresh)
                .unwrap_or_else(|difference| panic!("{method:?}, scene {index}: {difference}"));
            assert_eq!(again.voxels.fragment_count, fresh.voxels.fragment_count);
        }
    }
}

/// llvmpipe ends loops after 65,535 turns: what a workgroup cannot finish, more workgroups share.
#[test]
fn a_group_of_large_triangles_loses_no_fragment() {
    let gpu = gpu();
    let resolution = 256;
    let level = |k: u32| 4.0 * k as f32 / 256.0;
    let large = |k: u32| {
        [
            Vec3::new(0.0, level(k), 0.0),
            Vec3::new(0.0, level(k), 1.0),
            Vec3::new(1.0, level(k), 0.0),
        ]
    };
    let small = [
        Vec3::new(0.5, 0.5, 0.5),
        Vec3::new(0.5, 0.5, 0.501),
        Vec3::new(0.501, 0.5, 0.5),
    ];
    let triangles: Vec<Corners> = (0..64)
        .map(large)
        .chain(std::iter::repeat_n(small, 65 * 64))
        .collect();
    let mut scene = scene_of(&triangles, 0.0, &mut Random::new(5));
    for triangle in &mut scene.triangles {
        triangle.material = 0;
    }
    let scene = GpuScene::new(&gpu, &scene).unwrap();
    by_all_methods(&gpu, &scene, resolution, "large triangles");
}

#[test]
fn hardware_conservative_rasterization_is_refused_where_it_is_absent() {
    let gpu = gpu();
    let scene = GpuScene::new(&gpu, &bundled("cornell")).unwrap();
    let made = Voxelizer::new(&gpu, &scene, voxel_settings(32, Method::RasterHw));
    if gpu.features().conservative_rasterization {
        println!(
            "{}: raster-hw is compared with compute by the other tests",
            gpu.info().name
        );
        assert!(made.is_ok());
    } else {
        println!(
            "{}: no VK_EXT_conservative_rasterization; raster-hw is not compared here",
            gpu.info().name
        );
        assert!(matches!(made.err(), Some(Error::FeatureMissing { .. })));
    }
}

#[test]
fn comparators_notice_planted_errors() {
    let gpu = gpu();
    let mut random = Random::new(9);
    let scene = scene_of(&soup(&mut random, 32), 5.0, &mut random);
    let mut gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    in_unit_grid(&mut gpu_scene, 32);
    let make = || voxelize(&gpu, &gpu_scene, voxel_settings(32, Method::Compute));
    let good = make();
    let grid = oracle_grid(&good.voxels.grid);
    let set = good.occupied();
    assert!(
        compare_sets(&set, &scene, &grid).is_ok()
            && check_index(&good).is_ok()
            && same_bits(&good, &make()).is_ok()
    );
    // A voxel that a triangle passes through the middle of, and one that no triangle is near.
    let inside = *set
        .iter()
        .find(|voxel| {
            crate::support::voxels::separations(&scene, &grid, Surface::Conservative)
                .get(*voxel)
                .is_some_and(|gap| *gap < -0.3)
        })
        .unwrap();
    let empty = (0..32u32.pow(3))
        .map(|i| [i % 32, i / 32 % 32, i / 1024])
        .find(|voxel| !set.contains(voxel))
        .unwrap();
    assert!(
        compare_sets(
            &set.iter()
                .copied()
                .filter(|voxel| *voxel != inside)
                .collect(),
            &scene,
            &grid
        )
        .is_err()
    );
    assert!(compare_sets(&set.iter().copied().chain([empty]).collect(), &scene, &grid).is_err());
    let mut swapped = make();
    swapped.records.swap(3, 4);
    assert!(check_index(&swapped).is_err() && same_bits(&good, &swapped).is_err());
    let mut shifted = make();
    let last = shifted.bases.len() - 1;
    shifted.bases[last] += 1;
    assert!(check_index(&shifted).is_err());
    let mut flipped = make();
    flipped.occupancy[100] ^= 1;
    assert!(check_index(&flipped).is_err() && same_bits(&good, &flipped).is_err());
    assert_ne!(occupied(&flipped.occupancy, 32), set);
    let mut brighter = make();
    brighter.emission[0][1] += 1.0;
    assert!(same_bits(&good, &brighter).is_err());
}

/// The list of fragments has room for what walls touch that stand anywhere. Walls on the border
/// between voxels touch twice as many: they are counted, and stored again.
#[test]
fn more_fragments_than_expected_are_counted() {
    let gpu = gpu();
    let mut random = Random::new(21);
    for (at, is_counted) in [(7.4, false), (8.0, true)] {
        let corner = |x: f32, y: f32| Vec3::new(4.2 + 22.0 * x, 5.1 + 21.0 * y, at);
        let [a, b, c, d] =
            [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| corner(x, y));
        let walls = [[a, b, c], [a, c, d]].repeat(8);
        let mut scene = GpuScene::new(&gpu, &scene_of(&walls, 0.0, &mut random)).unwrap();
        in_unit_grid(&mut scene, 32);
        let settings = voxel_settings(32, Method::Compute);
        let mut voxelizer = Voxelizer::new(&gpu, &scene, settings).unwrap();
        let [first, second] = [(); 2].map(|()| voxelizer.run(&gpu, &scene).unwrap());
        let counts = |stats: &FrameStats| {
            let mut passes = stats.counting.iter();
            passes.any(|pass| pass.name == "voxel.fragments")
        };
        assert_eq!(
            [&first.1, &second.1].map(counts),
            [is_counted, false],
            "{at}"
        );
        let [first, second] = [first, second].map(|(voxels, _)| read(&gpu, voxels));
        same_bits(&first, &second).unwrap();
        let sides = if is_counted { 2 } else { 1 };
        assert_eq!(first.voxels.voxel_count, sides * 23 * 22, "{at}");
    }
}
