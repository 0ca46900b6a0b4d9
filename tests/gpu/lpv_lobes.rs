//! The published propagation on the device against its CPU oracle.

use crate::lpv::{Lit, SETTINGS, light, light_in, lights, read_sides, texels_of};
use crate::support::compare::{Largest, Worst, larger};
use crate::support::scenes::{bundled, scene_of, soup};
use crate::support::voxels::half;
use crate::support::{Random, gpu, read_words};
use glam::{DVec3, DVec4, UVec3, Vec3};
use lumivox::gi::lpv::inject::flux_unit;
use lumivox::gi::lpv::lobes::{LobeSettings, Occlusion, Scheme};
use lumivox::gi::lpv::oracle::bands;
use lumivox::gi::lpv::oracle::lobes::{self as oracle, Lobe, Steps};
use lumivox::gi::lpv::{CellGrid, CellSettings, Source};
use lumivox::graph::Gpu;
use lumivox::render::GpuScene;
use lumivox::scene::Scene;

const LOBES: LobeSettings = LobeSettings {
    scheme: Scheme::Lobes30,
    iterations: 5,
    gain: 1.0,
    clamp_negative: true,
};

fn settings(scheme: Scheme, occlusion: Occlusion) -> CellSettings {
    CellSettings {
        occlusion,
        lobes: Some(LobeSettings { scheme, ..LOBES }),
        ..SETTINGS
    }
}

/// Σ Φ of all cells (W).
fn power(gpu: &Gpu, lit: &Lit) -> Vec<DVec3> {
    let (count, steps) = (lit.words.len(), read_words(gpu, &lit.cells.flux));
    let unit = f64::from(flux_unit(&lit.scene.lights, &lit.cells.grid));
    let number = |cell: usize, colour: usize| {
        unit * f64::from(steps[(9 + colour) * count + cell].cast_signed())
    };
    (0..count)
        .map(|cell| DVec3::from([0, 1, 2].map(|colour| number(cell, colour))))
        .collect()
}

/// Blocking potential of all nodes.
fn blockers(gpu: &Gpu, lit: &Lit) -> Vec<DVec4> {
    let Some(blockers) = &lit.cells.blockers else {
        return Vec::new();
    };
    let texels: Vec<[u16; 4]> =
        bytemuck::pod_collect_to_vec(&gpu.read_image(blockers.volume(), 0, 0).unwrap());
    let number = |texel: &[u16; 4]| DVec4::from(texel.map(half));
    texels.iter().map(number).collect()
}

/// What cells send at first.
pub(crate) fn first_of(gpu: &Gpu, lit: &Lit) -> Vec<Lobe> {
    let given = (&lit.flux[..], &power(gpu, lit)[..]);
    oracle::seed(&lit.cells.grid, given, &lit.words, &sides_of(gpu, lit))
}

/// What the opaque faces of cells send.
fn sides_of(gpu: &Gpu, lit: &Lit) -> impl Fn(usize, u32) -> DVec4 {
    let side_light = read_sides(gpu, lit);
    move |cell, face| {
        let word = lit.words[cell];
        let before = (word & ((1 << face) - 1)).count_ones();
        let side = side_light.get(((word >> 8) + before) as usize);
        side.copied().unwrap_or_default()
    }
}

/// The steps of the same flux, faces, sides and blockers in double precision. Half floats between
/// the steps and in the result cost the rest.
fn check(gpu: &Gpu, name: &str, lit: &Lit) {
    let (grid, settings) = (&lit.cells.grid, lit.cells.settings);
    let blockers = blockers(gpu, lit);
    let steps = Steps {
        settings: settings.lobes.unwrap(),
        occlusion: settings.occlusion,
        faces: &lit.words,
        blockers: &blockers,
    };
    if settings.bands == 2 {
        check_light(
            name,
            lit,
            &oracle::propagate(grid, &steps, &first_of(gpu, lit)),
        );
        return;
    }
    let given = (&lit.flux[..], settings.bands as usize);
    let first = bands::seed(grid, given, &lit.words, &sides_of(gpu, lit));
    check_finished(
        name,
        lit,
        &bands::finish(&bands::propagate(grid, &steps, &first)),
    );
}

/// The light of all cells, which is to be that of lobes.
pub(crate) fn check_light(name: &str, lit: &Lit, lobes: &[Lobe]) {
    check_finished(name, lit, &oracle::finish(lobes));
}

fn check_finished(name: &str, lit: &Lit, expected: &[[DVec4; 9]]) {
    let largest = |channel: usize| {
        let all = expected.iter().map(|cell| cell[0][channel].abs());
        all.worst().max(1e-9)
    };
    let scale = DVec4::from([0, 1, 2, 3].map(largest));
    let mut worst = 0f64;
    for (got, expected) in lit.light.iter().zip(expected) {
        for (got, expected) in got.iter().zip(expected) {
            worst = larger(worst, ((*got - *expected).abs() / scale).largest());
        }
    }
    println!("{name}: light differs by {worst:.1e} of the largest");
    assert!(worst < 2e-3, "{name}: {worst}");
    assert!(scale.w > 0.1, "{name}: no environment comes in");
}

#[test]
fn light_of_lobes_is_the_oracles() {
    let gpu = gpu();
    for (name, scene) in lights() {
        for scheme in [Scheme::Lobes30, Scheme::Axis6, Scheme::Stream] {
            for occlusion in [Occlusion::Faces, Occlusion::None, Occlusion::Fuzzy] {
                let lit = light(&gpu, &scene, 15, settings(scheme, occlusion));
                check(&gpu, &format!("{name}, {scheme:?}, {occlusion:?}"), &lit);
            }
        }
    }
    let scene = &lights()[0].1;
    for (iterations, gain, clamp_negative) in [(1, 1.0, false), (12, 0.75, false), (30, 1.0, true)]
    {
        let mut settings = settings(Scheme::Lobes30, Occlusion::Faces);
        settings.lobes = Some(LobeSettings {
            iterations,
            gain,
            clamp_negative,
            ..LOBES
        });
        let lit = light(&gpu, scene, 12, settings);
        check(&gpu, &format!("{iterations} steps, gain {gain}"), &lit);
    }
}

#[test]
fn streams_in_more_bands_are_the_oracles() {
    let gpu = gpu();
    for bands in [3, 4] {
        for (name, scene) in lights() {
            for occlusion in [Occlusion::Faces, Occlusion::None, Occlusion::Fuzzy] {
                let settings = CellSettings {
                    bands,
                    ..settings(Scheme::Stream, occlusion)
                };
                let lit = light(&gpu, &scene, 13, settings);
                check(&gpu, &format!("{name}, {bands} bands, {occlusion:?}"), &lit);
            }
        }
        // Light of faces that lie about, and many steps with a loss.
        let mut random = Random::new(21);
        let mut scene = scene_of(&soup(&mut random, 20), 0.0, &mut random);
        for material in &mut scene.materials {
            material.emission = Vec3::new(1.0, 2.0, 3.0);
        }
        for size in [[11, 9, 13], [3, 15, 4], [3, 3, 3]] {
            let scene_on = GpuScene::new(&gpu, &scene).unwrap();
            let grid = CellGrid::new(Vec3::new(-0.3, 0.2, 0.7), 1.07, UVec3::from(size));
            let mut settings = CellSettings {
                bands,
                source: Source::Faces,
                bounces: 2,
                ..settings(Scheme::Stream, Occlusion::Faces)
            };
            settings.lobes = settings.lobes.map(|lobes| LobeSettings {
                iterations: 30,
                gain: 0.75,
                ..lobes
            });
            let lit = light_in(&gpu, &scene, scene_on, grid, settings);
            check(&gpu, &format!("{size:?}, {bands} bands"), &lit);
        }
    }
}

/// Long and flat grids, and one of a single cell between margins.
#[test]
fn lobes_in_thin_grids_are_the_oracles() {
    let gpu = gpu();
    let scene = &lights()[0].1;
    for size in [[3, 19, 7], [40, 3, 3], [3, 3, 3], [5, 9, 64]] {
        for occlusion in [Occlusion::Faces, Occlusion::Fuzzy] {
            let scene_on = GpuScene::new(&gpu, scene).unwrap();
            let grid = CellGrid::new(Vec3::new(-1.1, -0.05, -1.1), 0.13, UVec3::from(size));
            let settings = settings(Scheme::Lobes30, occlusion);
            let lit = light_in(&gpu, scene, scene_on, grid, settings);
            check(&gpu, &format!("{size:?}"), &lit);
        }
    }
}

/// Faces send as lobes do, and so do further bounces.
#[test]
fn lobes_of_faces_are_the_oracles() {
    let gpu = gpu();
    let mut scene = bundled("cornell");
    scene.materials[0].emission = Vec3::new(1.0, 2.0, 3.0);
    for (source, occlusion, bounces) in [
        (Source::Faces, Occlusion::Faces, 1),
        (Source::Faces, Occlusion::None, 1),
        (Source::Rsm, Occlusion::Fuzzy, 2),
    ] {
        let settings = CellSettings {
            source,
            bounces,
            ..settings(Scheme::Axis6, occlusion)
        };
        let lit = light(&gpu, &scene, 14, settings);
        assert!(read_sides(&gpu, &lit).iter().any(|side| side.z > 0.0));
        check(&gpu, &format!("{source:?}, {bounces} bounces"), &lit);
    }
}

fn fuzzy(gpu: &Gpu, scene: &Scene) -> (Lit, Vec<DVec4>) {
    let lit = light(gpu, scene, 16, settings(Scheme::Axis6, Occlusion::Fuzzy));
    let found = blockers(gpu, &lit);
    (lit, found)
}

/// Areas of texels in double precision. A texel between two nodes may be at either, so that nodes
/// are compared with a texel's area to spare; sums over all are not.
#[test]
fn blockers_are_the_oracles() {
    let gpu = gpu();
    for (name, scene) in lights() {
        let (lit, found) = fuzzy(&gpu, &scene);
        let texels = texels_of(&gpu, &lit);
        let expected = oracle::blockers(texels.iter().copied(), &lit.cells.grid);
        let largest = expected.iter().map(|node| node.x).worst();
        let (mut sums, mut different) = ([DVec4::ZERO; 2], 0);
        for (got, expected) in found.iter().zip(&expected) {
            sums[0] += *got;
            sums[1] += *expected;
            let error = (*got - *expected).abs().largest();
            different += u32::from(error > 2e-3 * largest);
            assert!(error < 0.5 * largest, "{name}: {got} for {expected}");
        }
        let error = (sums[0] - sums[1]).abs().largest() / sums[1].x;
        println!("{name}: sums differ by {error:.1e}, {different} nodes, largest {largest:.2}");
        assert!(
            error < 2e-3 && different < 120,
            "{name}: {error}, {different}"
        );
        assert!(largest > 0.5, "{name}");
    }
}

/// Surfaces that two lights see count once: each node has what one of the lights sees.
#[test]
fn blockers_of_two_lights_are_of_the_one_that_sees_more() {
    let gpu = gpu();
    let [(_, point), _, (_, sun)] = &lights()[..] else {
        panic!("there are three lights");
    };
    let both = Scene {
        lights: vec![point.lights[0], sun.lights[0]],
        ..point.clone()
    };
    let [point, sun, both] = [point, sun, &both].map(|scene| fuzzy(&gpu, scene).1);
    let mut from_sun = 0;
    for ((point, sun), both) in point.iter().zip(&sun).zip(&both) {
        let expected = if sun.x > point.x { sun } else { point };
        from_sun += u32::from(sun.x > point.x);
        let is_tie = (sun.x - point.x).abs() < 1e-3 * point.x;
        assert!(is_tie || both == expected, "{both} for {point}, {sun}");
    }
    assert!(from_sun > 20, "{from_sun}");
}
