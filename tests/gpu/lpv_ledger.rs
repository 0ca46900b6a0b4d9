//! The device's account of where light has gone against that of the oracles.

use std::f64::consts::PI;

use glam::{DVec3, DVec4, UVec3, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::inspect::Energy;
use lumivox::gi::lpv::leaves::LeafSettings;
use lumivox::gi::lpv::ledger::energy;
use lumivox::gi::lpv::lobes::{LobeSettings, Occlusion, Scheme};
use lumivox::gi::lpv::oracle::{self, Boundary};
use lumivox::gi::lpv::{CellGrid, CellSettings, Octree, Propagation, Source};
use lumivox::gi::registry::find;
use lumivox::graph::Gpu;
use lumivox::render::GpuScene;
use lumivox::scene::{Light, Scene};

use crate::lpv::{Lit, SETTINGS, light, light_in, read_light, read_sides};
use crate::support::compare::Largest;
use crate::support::scenes::{bundled, scene_of, soup};
use crate::support::technique::frame;
use crate::support::{Random, gpu};

/// The oracle's account of the same flux, faces and sides.
fn expected(lit: &Lit, sides: &[DVec4]) -> Energy {
    let Propagation::Sweep(sweep) = &*lit.cells.propagation else {
        panic!("no sweep");
    };
    let grid = &lit.cells.grid;
    let face_m2 = f64::from(grid.cell_size).powi(2);
    let side = |cell: usize, face: u32| {
        let word = lit.words[cell];
        let before = (word & ((1 << face) - 1)).count_ones();
        let side = sides.get(((word >> 8) + before) as usize).copied();
        side.unwrap_or_default().truncate().extend(0.0)
    };
    let swept = oracle::sweep(
        grid,
        &sweep.directions,
        &Boundary {
            faces: &lit.words,
            side: &side,
            inflow: &|_, _, _| DVec4::W,
            source: &|cell, direction| {
                let [r, g, b] = lit.flux[cell].map(|vector| vector.dot(direction).max(0.0));
                DVec3::new(r, g, b).extend(0.0) / (PI * face_m2)
            },
        },
    );
    let environment = lit.scene.environment.radiance.as_dvec3();
    let watts = |sum: DVec4| sum.truncate() + sum.w * environment;
    let ledger = swept.ledger;
    Energy {
        injected: watts(ledger.injected),
        entered: watts(ledger.entered),
        absorbed: watts(ledger.absorbed),
        left: watts(ledger.left),
        on_its_way: DVec3::ZERO,
    }
}

fn check(gpu: &Gpu, name: &str, lit: &Lit) {
    let before = read_light(gpu, &lit.cells);
    let found = energy(gpu, &lit.scene, &lit.cells).unwrap().unwrap();
    // Where directions are kept, pixels would have the last bounce swept.
    assert!(
        lit.cells.settings.keeps_directions || read_light(gpu, &lit.cells) == before,
        "{name}: counting changes the light"
    );
    let expected = expected(lit, &read_sides(gpu, lit));
    let all = expected.injected + expected.entered;
    for ((account, found), (_, expected)) in found.rows().into_iter().zip(expected.rows()) {
        let error = ((found - expected) / all).abs().largest();
        println!("{name}, {account}: {found:.4} for {expected:.4} W, {error:.1e} of all");
        assert!(error < 1e-4, "{name}, {account}: {error}");
    }
    assert!(all.min_element() > 0.0, "{name}");
}

#[test]
fn accounts_of_the_sweep_are_the_oracles() {
    let gpu = &gpu();
    let mut scene = bundled("cornell");
    for environment in [Vec3::ZERO, Vec3::new(0.1, 0.3, 0.2)] {
        scene.environment = environment.into();
        for (source, bounces) in [(Source::Rsm, 1), (Source::Faces, 1), (Source::Rsm, 3)] {
            for (cells, directions) in [(13, 33), (20, 60)] {
                let settings = CellSettings {
                    source,
                    bounces,
                    directions,
                    keeps_directions: source == Source::Rsm && bounces == 1 && cells == 20,
                    ..SETTINGS
                };
                let lit = light(gpu, &scene, cells, settings);
                let of = if source == Source::Rsm {
                    "maps"
                } else {
                    "faces"
                };
                check(
                    gpu,
                    &format!("{of}, {bounces} bounces, {cells} cells"),
                    &lit,
                );
            }
        }
    }
}

/// Triangles anywhere, in grids that are long, flat, or hardly there.
#[test]
fn accounts_among_random_faces_are_the_oracles() {
    let gpu = &gpu();
    let mut random = Random::new(2033);
    for size in [[17, 12, 15], [3, 19, 7], [40, 3, 3], [2, 2, 2], [5, 9, 33]] {
        let mut scene = scene_of(&soup(&mut random, 16), 0.0, &mut random);
        scene.environment = Vec3::new(0.2, 0.1, 0.3).into();
        scene.lights = vec![Light::Point {
            position: Vec3::new(0.2, 8.3, 1.1),
            intensity: Vec3::new(30.0, 20.0, 10.0),
        }];
        for source in [Source::Rsm, Source::Faces] {
            let lit = in_grid(gpu, &scene, size, CellSettings { source, ..SETTINGS });
            let [x, y, z] = size;
            check(gpu, &format!("{x}×{y}×{z}"), &lit);
        }
    }
}

fn in_grid(gpu: &Gpu, scene: &Scene, size: [u32; 3], settings: CellSettings) -> Lit {
    let scene_on = GpuScene::new(gpu, scene).unwrap();
    let grid = CellGrid::new(Vec3::new(-0.3, 0.2, 0.7), 1.07, UVec3::from(size));
    light_in(gpu, scene, scene_on, grid, settings)
}

fn lobes(scheme: Scheme, clamp_negative: bool, gain: f32, occlusion: Occlusion) -> CellSettings {
    CellSettings {
        occlusion,
        lobes: Some(LobeSettings {
            scheme,
            iterations: 9,
            gain,
            clamp_negative,
        }),
        ..SETTINGS
    }
}

/// What is lost of what was injected and entered.
fn lost(gpu: &Gpu, lit: &Lit) -> (Energy, DVec3) {
    let before = read_light(gpu, &lit.cells);
    let found = energy(gpu, &lit.scene, &lit.cells).unwrap().unwrap();
    // Where directions are kept, pixels would have the last bounce swept.
    assert!(
        lit.cells.settings.keeps_directions || read_light(gpu, &lit.cells) == before,
        "counting changes the light"
    );
    (found, found.lost() / (found.injected + found.entered))
}

/// A step of gain 1 keeps the flux, unless negative flux is cut off: so all accounts together are
/// what began, and each is positive.
#[test]
fn lobes_lose_nothing_with_gain_1() {
    let gpu = &gpu();
    let mut scene = bundled("cornell");
    for environment in [Vec3::ZERO, Vec3::new(0.4, 0.2, 0.3)] {
        scene.environment = environment.into();
        for (name, scheme) in [
            ("lobes30", Scheme::Lobes30),
            ("axis6", Scheme::Axis6),
            ("stream", Scheme::Stream),
        ] {
            for occlusion in [Occlusion::None, Occlusion::Faces, Occlusion::Fuzzy] {
                let of = lobes(scheme, false, 1.0, occlusion);
                let (energy, share) = lost(gpu, &light(gpu, &scene, 16, of));
                println!("{name}: {share:.6} lost");
                assert!(share.abs().largest() < 3e-4, "{name}: {energy:?}");
                // Two bands go below 0: behind surfaces what leaves may be negative.
                let is_open = occlusion == Occlusion::None;
                assert!(!is_open || energy.left.x > 0.0, "{name}: {energy:?}");
                assert!(energy.on_its_way.x > 0.0, "{name}: {energy:?}");
                assert_eq!(
                    energy.absorbed.x > 0.0,
                    occlusion != Occlusion::None,
                    "{name}"
                );
                assert_eq!(energy.entered.x > 0.0, environment.x > 0.0, "{name}");
            }
        }
    }
}

/// Injected flux is the oracle's: of maps, as the cells have it.
#[test]
fn lobes_begin_with_what_is_injected() {
    let gpu = &gpu();
    let scene = bundled("cornell");
    let lit = light(
        gpu,
        &scene,
        16,
        lobes(Scheme::Stream, false, 1.0, Occlusion::None),
    );
    let (energy, _) = lost(gpu, &lit);
    let first = crate::lpv_lobes::first_of(gpu, &lit);
    let face_m2 = f64::from(lit.cells.grid.cell_size).powi(2);
    // ∫ I dω of c₀₀ Y₀₀ is c₀₀ √4π.
    let sum: DVec4 = first.iter().map(|lobe| lobe[0]).sum();
    let expected = face_m2 * (4.0 * PI).sqrt() * sum.truncate();
    let error = (energy.injected / expected - 1.0).abs().largest();
    assert!(error < 3e-4, "{} for {expected}", energy.injected);
}

/// Clamping makes light in the first step, and a gain below 1 takes some in each.
#[test]
fn clamping_and_gain_show_as_losses() {
    let gpu = &gpu();
    let scene = bundled("cornell");
    let share = |clamp, gain| {
        let of = lobes(Scheme::Lobes30, clamp, gain, Occlusion::None);
        lost(gpu, &light(gpu, &scene, 16, of)).1.x
    };
    let [clamped, damped] = [share(true, 1.0), share(false, 0.75)];
    println!("clamped: {clamped:.3}, gain ¾: {damped:.3}");
    assert!((-0.25..-0.08).contains(&clamped), "{clamped}");
    assert!((0.6..1.0).contains(&damped), "{damped}");
}

#[test]
fn octrees_have_no_account() {
    let gpu = &gpu();
    let settings = CellSettings {
        octree: Some(Octree::Leaves(LeafSettings {
            guard: 1,
            max_level: 1,
        })),
        ..SETTINGS
    };
    let lit = light(gpu, &bundled("cornell"), 10, settings);
    assert_eq!(energy(gpu, &lit.scene, &lit.cells).unwrap(), None);
}

/// Of nested grids the outermost has an account, and what looks light up afterwards finds the same.
#[test]
fn the_outermost_grid_has_an_account() {
    let gpu = &gpu();
    let scene = bundled("cornell");
    let picture = |asks: bool| {
        let entry = find("lpv-cascaded").unwrap();
        let settings = entry
            .settings(
                Some("accurate"),
                &["resolution=16", "cell_size=0.03", "bounces=2"],
            )
            .unwrap();
        let (mut renderer, _) =
            Renderer::new(gpu, &scene, entry, &settings, frame(16, 12, 64)).unwrap();
        renderer.render(&scene.camera).unwrap();
        if asks {
            let energy = renderer.energy().unwrap().unwrap();
            let share = energy.lost() / (energy.injected + energy.entered);
            println!("{energy:?}: {share:.6} lost");
            assert!(energy.injected.min_element() > 1.0 && share.abs().largest() < 1e-4);
        }
        let view = entry.views.iter().copied().flatten().next().unwrap();
        renderer.view(view, 2).unwrap().unwrap().pixels
    };
    assert!(picture(true) == picture(false));
}
