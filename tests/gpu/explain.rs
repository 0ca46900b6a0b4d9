//! `lumivox explain`: a planted error shows in the row of its source, and exact light is the
//! oracle's.

use std::cell::Cell;

use crate::support::gpu;
use crate::support::scenes::bundled;
use crate::support::voxels::oracle_grid;
use glam::Vec3;
use lumivox::frame::FrameSettings;
use lumivox::gi::registry::{TECHNIQUES, find};
use lumivox::gi::shared::voxel::oracle::inject_sides;
use lumivox::gi::shared::voxel::{Method, VoxelGrid};
use lumivox::graph::Gpu;
use lumivox::image::luminance;
use lumivox::measure::bench::{Case, Truth};
use lumivox::measure::explain::{Budget, Subject, explain};
use lumivox::measure::report::ReferenceInfo;
use lumivox::metrics::Channel;
use lumivox::reference::{
    Bounces, Filter, Sampling, Settings, gather, light_surfaces, render, surface_area_m2,
};
use lumivox::render::ShadowSettings;
use lumivox::scene::Scene;

const SIZE: [u32; 2] = [48, 32];

/// The reference with one bounce.
fn truth(scene: &Scene) -> Truth {
    let [width, height] = SIZE;
    let sampling = Sampling::Fixed { spp: 256 };
    let image = render(
        scene,
        &Settings {
            width,
            height,
            bounces: Bounces::Count(1),
            filter: Filter::Center,
            sampling,
            seed: 0,
            ..Default::default()
        },
        &|_| {},
    )
    .unwrap();
    let info = ReferenceInfo {
        bounces: Bounces::Count(1),
        samples_per_pixel: 256.0,
        pixel_noise: f64::from(image.indirect_error().pixel),
    };
    Truth {
        image: Some((image.indirect(), info)),
        guide: image.guide,
    }
}

fn budget(
    gpu: &Gpu,
    scene: &Scene,
    truth: &Truth,
    technique: &str,
    pairs: &[&str],
    shadow_resolution: u32,
) -> Budget {
    let entry = find(technique).unwrap();
    let case = Case {
        entry,
        preset: None,
        settings: entry.settings(None, pairs).unwrap(),
    };
    let frame = FrameSettings {
        size: SIZE,
        shadows: ShadowSettings::of_resolution(shadow_resolution),
    };
    let last = Cell::new((0, 0));
    let budget = explain(
        &Subject {
            gpu,
            scene,
            case: &case,
            frame,
            channel: Channel::Luminance,
            truth,
        },
        None,
        &|step| {
            assert!(step.done < step.rows && step.done >= last.get().0);
            last.set((step.done, step.rows));
        },
    )
    .unwrap();
    assert_eq!(
        last.get(),
        (budget.budget.len() - 1, budget.budget.len()),
        "a bar that follows the steps ends where the budget does"
    );
    budget
}

/// What a row explains.
fn share(budget: &Budget, name: &str) -> f64 {
    let row = budget
        .budget
        .iter()
        .find(|row| row.name == name)
        .unwrap_or_else(|| panic!("there is no row {name}"));
    let error = row.error.unwrap();
    println!(
        "  {name:28} {:+.4} {:.4} explains {:.3}",
        error.bias,
        error.rel_rmse,
        row.explains.unwrap()
    );
    row.explains.unwrap()
}

/// One error at a time, each large, in a technique that is good without: its own row takes most of
/// it away, and the others do not.
#[test]
fn a_planted_error_shows_in_its_row() {
    let (gpu, scene) = (gpu(), bundled("cornell"));
    let truth = truth(&scene);
    let base = ["resolution=32"];
    for (what, pairs, shadow_resolution, sources, others) in [
        (
            "maps of 16²",
            vec![],
            16,
            ["direct light", "shadow maps"],
            ["visibility", "directions"],
        ),
        // Without the height test a ray hits the surface that it leaves.
        (
            "own surface hit",
            vec!["self_height=-8", "contour_slack=-1"],
            256,
            ["visibility", "direct light and visibility"],
            ["direct light", "directions"],
        ),
        (
            "one direction",
            vec!["rays=1", "interleave=1"],
            256,
            ["directions", "visibility"],
            ["direct light", "shadow maps"],
        ),
    ] {
        println!("{what}:");
        let pairs: Vec<&str> = base.iter().copied().chain(pairs).collect();
        let budget = budget(
            &gpu,
            &scene,
            &truth,
            "voxel-mips",
            &pairs,
            shadow_resolution,
        );
        assert_eq!(share(&budget, "as it is"), 0.0);
        sources
            .iter()
            .for_each(|name| assert!(share(&budget, name) > 0.6, "{what}: {name}"));
        others
            .iter()
            .for_each(|name| assert!(share(&budget, name) < 0.4, "{what}: {name}"));
        let materials = budget.by_material(0.1);
        assert!(materials.len() >= 2, "{what}: {materials:?}");
        for it in materials {
            let (name, share) = it.source.unwrap();
            println!(
                "  {}: {:.4}, {name} explains {share:.3}",
                it.material, it.error.rel_rmse
            );
            assert!(
                share > 0.5 && !others.contains(&&*name),
                "{what}: {}",
                it.material
            );
        }
    }
}

/// Every technique has a budget: exact light through exact rays leaves little error, where there
/// are voxels at all. What patches give is not in the voxels that the picture sees, but in those
/// that exact rays see.
#[test]
fn exact_visibility_sees_what_patches_give() {
    let (gpu, scene) = (gpu(), bundled("cornell-lamp"));
    let truth = truth(&scene);
    for pairs in [&["resolution=32"][..], &["resolution=32", "shadows=cones"]] {
        let budget = budget(&gpu, &scene, &truth, "voxel-mips", pairs, 64);
        for name in ["as it is", "visibility", "direct light and visibility"] {
            share(&budget, name);
            let error = budget
                .budget
                .iter()
                .find(|row| row.name == name)
                .unwrap()
                .error
                .unwrap();
            assert!(error.bias.abs() < 0.1, "{pairs:?}, {name}: {error:?}");
        }
    }
}

#[test]
fn every_technique_has_a_budget() {
    let (gpu, scene) = (gpu(), bundled("cornell"));
    let truth = truth(&scene);
    for entry in TECHNIQUES {
        // A clipmap's voxels are of several sizes.
        let has_voxels = ["voxel-mips", "svo"].contains(&entry.name);
        let sized = entry.settings(None, &["resolution=32"]).is_ok();
        let settings: &[&str] = if sized { &["resolution=32"] } else { &[] };
        let budget = budget(&gpu, &scene, &truth, entry.name, settings, 256);
        println!("{}:", entry.name);
        assert_eq!(share(&budget, "as it is"), 0.0);
        let row = budget
            .budget
            .iter()
            .find(|row| row.name == "direct light and visibility");
        assert_eq!(row.is_some(), has_voxels);
        assert!(
            row.is_none_or(|row| row.error.unwrap().rel_rmse < 0.05),
            "{}",
            entry.name
        );
        assert!(serde_json::to_string(&budget).is_ok());
    }
}

/// What points of the surfaces say of each side of each voxel, against the brute-force oracle.
#[test]
fn exact_light_is_the_oracles() {
    use crate::support::voxels::{coordinates, voxel_settings, voxelize};
    let (gpu, scene) = (gpu(), bundled("cornell"));
    let entry = find("voxel-mips").unwrap();
    let settings = entry.settings(None, &["resolution=16"]).unwrap();
    let (mut renderer, _) = lumivox::frame::Renderer::new(
        &gpu,
        &scene,
        entry,
        &settings,
        FrameSettings {
            size: SIZE,
            shadows: ShadowSettings::of_resolution(64),
        },
    )
    .unwrap();
    let grid = VoxelGrid::around(scene.bounds().unwrap(), 16);
    let points = light_surfaces(&scene, grid.voxel_size / 8.0).unwrap();
    let mut slots = renderer.light_slots().unwrap().unwrap();
    lumivox::measure::explain::give_light(&gpu, &mut *slots, &points).unwrap();
    drop(slots);
    renderer.render(&scene.camera).unwrap();
    let slots = renderer.light_slots().unwrap().unwrap();
    let radiance = slots.radiance(&gpu).unwrap();
    let gpu_scene = lumivox::render::GpuScene::new(&gpu, &scene).unwrap();
    let records = voxelize(&gpu, &gpu_scene, voxel_settings(16, Method::Compute)).records;
    let oracle = inject_sides(&scene, &oracle_grid(&grid), 64);
    let (mut squares, mut total, mut compared) = (0.0, 0.0, 0);
    for (index, record) in records.iter().enumerate() {
        for (side, expected) in oracle[&coordinates(record)].iter().enumerate() {
            let area = crate::support::voxels::area(record);
            let (found, expected) = (
                f64::from(luminance(radiance[2 * index + side])),
                f64::from(luminance(expected.as_vec3())),
            );
            squares += area * (found - expected).powi(2);
            total += area * expected;
            compared += usize::from(expected > 0.0);
        }
    }
    let area: f64 = records.iter().map(crate::support::voxels::area).sum();
    let rel_rmse = (squares / area).sqrt() / (total / area);
    println!("{compared} lit sides, rel_rmse {rel_rmse:.4}");
    assert!(compared > 500 && rel_rmse < 0.05);
}

/// Exact light in sides of voxels, and in their faces, as it is read back at the points that it is
/// from: as much on the mean. Where walls meet, a face knows which one it is of.
#[test]
fn faces_take_exact_light_as_sides_do() {
    let (gpu, scene) = (gpu(), bundled("cornell"));
    let entry = find("voxel-mips").unwrap();
    let grid = VoxelGrid::around(scene.bounds().unwrap(), 16);
    let points = light_surfaces(&scene, grid.voxel_size / 8.0).unwrap();
    let errors = ["two-sided", "six-sided"].map(|radiance| {
        let pairs = ["resolution=16".to_owned(), format!("radiance={radiance}")];
        let settings = entry.settings(None, &pairs).unwrap();
        let frame = FrameSettings {
            size: SIZE,
            shadows: ShadowSettings::of_resolution(64),
        };
        let (mut renderer, _) =
            lumivox::frame::Renderer::new(&gpu, &scene, entry, &settings, frame).unwrap();
        let mut slots = renderer.light_slots().unwrap().unwrap();
        lumivox::measure::explain::give_light(&gpu, &mut *slots, &points).unwrap();
        drop(slots);
        renderer.render(&scene.camera).unwrap();
        let slots = renderer.light_slots().unwrap().unwrap();
        let radiance = slots.radiance(&gpu).unwrap();
        let (mut squares, mut sum_seen, mut total) = (0.0, 0.0, 0.0);
        for point in &points {
            let shares = slots.at(point.surface.position, point.surface.normal);
            for (side, shares) in shares.unwrap().iter().enumerate() {
                let sum: f32 = shares.iter().map(|share| share.seen).sum();
                assert!((sum - 1.0).abs() < 1e-5, "{shares:?}");
                let seen = shares.iter().map(|share| share.seen * radiance[share.slot]);
                let seen = f64::from(luminance(seen.sum::<Vec3>()));
                let exact = f64::from(luminance(point.radiance[side]));
                squares += (seen - exact).powi(2);
                (sum_seen, total) = (sum_seen + seen, total + exact);
            }
        }
        let mean_square = squares / points.len() as f64;
        let mean = total / points.len() as f64;
        [mean_square.sqrt() / mean, sum_seen / total - 1.0]
    });
    println!("error and bias, of sides and of faces: {errors:?}");
    let [sides, faces] = errors;
    assert!(faces[0] < 0.9 * sides[0], "{errors:?}");
    assert!(sides[1].abs() < 0.02 && faces[1].abs() < 0.02, "{errors:?}");
}

/// Points cover surfaces evenly, however the surface is cut into triangles, and both sides are told
/// apart.
#[test]
fn surfaces_are_covered_evenly() {
    let scene = bundled("cornell");
    let area = surface_area_m2(&scene);
    for share in [0.01f64, 0.003] {
        let spacing = share * area.sqrt();
        let points = light_surfaces(&scene, spacing as f32).unwrap();
        assert!(
            (points.len() as f64 * share * share - 1.0).abs() < 0.01,
            "{} points",
            points.len()
        );
        let middle: Vec3 = points
            .iter()
            .map(|point| point.surface.position)
            .sum::<Vec3>()
            / points.len() as f32;
        let (low, high) = scene.bounds().unwrap();
        assert!(middle.cmpgt(low).all() && middle.cmplt(high).all());
        assert!(
            points
                .iter()
                .all(|point| point.radiance[0] == Vec3::ZERO || point.radiance[1] == Vec3::ZERO),
            "a point light lights one side"
        );
        assert!(
            points.iter().any(|point| point.radiance[0] != Vec3::ZERO)
                && light_surfaces(&Scene::default(), 1.0).unwrap().is_empty()
        );
    }
}

/// A gather that sees radiance 1 everywhere gives ρ, and half of it where only what faces up is 1.
#[test]
fn a_gather_of_constant_light_is_the_albedo() {
    let scene = bundled("furnace");
    let [ones, halves]: [f32; 2] = [
        |_: Vec3| 1.0,
        |normal: Vec3| f32::from(u8::from(normal.y > 0.0)),
    ]
    .map(|light: fn(Vec3) -> f32| {
        let image = gather(&scene, [8, 8], 64, &|point| {
            Vec3::splat(light(point.normal))
        })
        .unwrap();
        image
            .pixels
            .iter()
            .map(|pixel| luminance(*pixel))
            .sum::<f32>()
            / 64.0
    });
    let albedo = luminance(scene.materials[0].albedo);
    assert!((ones - albedo).abs() < 0.02 * albedo, "{ones} for {albedo}");
    assert!(halves < ones && halves >= 0.0);
}
