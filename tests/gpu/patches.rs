//! Surfaces that emit, as patches that cones see: the patches, `cone.patches` on the device against
//! its CPU oracle, its pictures against the path tracer, its cost.

use crate::support::compare::Largest;
use crate::support::gather::{
    View, errors, filter, matter, occupied, random_volume, read_chain, verdict, volume,
};
use crate::support::scenes::{add_model, bundled, still};
use crate::support::technique::{
    Builder, Case, Surfaces, block_errors, default_cases_with, frame, is_sound, largest_difference,
    mean, shoot, small_lights, small_room,
};
use crate::support::{Random, gpu};
use glam::{DVec3, DVec4, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::registry::find;
use lumivox::gi::shared::cone::oracle::MarchSettings;
use lumivox::gi::shared::cone::oracle::patches::{Disc, irradiance, unhidden};
use lumivox::gi::shared::cone::{ConeTracer, EmissivePatches, Patch, patches};
use lumivox::gi::shared::voxel::VoxelGrid;
use lumivox::gi::shared::voxel::oracle::Receiver;
use lumivox::gi::voxel_cones::mips;
use lumivox::graph::Frame;
use lumivox::image::{Aov, GuideImage, Image, luminance};
use lumivox::reference::{self, Bounces, Filter, Sampling};
use lumivox::render::GpuScene;
use lumivox::render::emitters::{Emitter, emitters};
use lumivox::scene::{Camera, Material, Scene};
use rayon::prelude::*;

fn power(parts: impl Iterator<Item = (f32, Vec3)>) -> Vec3 {
    parts.map(|(area, radiance)| area * radiance).sum()
}

/// Disc of a patch in a grid.
fn disc(patch: &Patch, grid: &VoxelGrid) -> Disc {
    let size = f64::from(grid.voxel_size);
    Disc {
        position: (patch.position - grid.origin).as_dvec3() / size,
        normal: patch.normal.as_dvec3(),
        area: f64::from(patch.area) / (size * size),
        radius: f64::from(patch.radius) / size,
        radiance: patch.radiance.as_dvec3(),
    }
}

/// A ball that emits, of an icosphere's first subdivisions.
fn glowing_ball() -> Vec<Emitter> {
    let mut random = Random::new(7);
    let point = |random: &mut Random| loop {
        let at = Vec3::from([0; 3].map(|_: u32| 2.0 * random.unit() - 1.0));
        if (0.1..1.0).contains(&at.length()) {
            return at.normalize();
        }
    };
    (0..2000)
        .map(|_| point(&mut random))
        .map(|normal| Emitter {
            corners: [normal; 3],
            position: normal,
            normal,
            area: 0.01,
            radiance: Vec3::ONE,
        })
        .collect()
}

/// No light is lost or added, however few patches there are, and with more of them each is flatter
/// and smaller.
#[test]
fn patches_hold_all_light() {
    for (name, parts) in [
        ("ball", glowing_ball()),
        ("gallery", emitters(&bundled("emissive-gallery"))),
        ("lamp", emitters(&bundled("cornell-lamp"))),
    ] {
        let expected = power(parts.iter().map(|part| (part.area, part.radiance)));
        let mut widest = f32::INFINITY;
        for count in [1, 2, 5, 16, 64, 256] {
            let made = patches(&parts, count, 1.0);
            let sum = power(made.iter().map(|patch| (patch.area, patch.radiance)));
            assert!(
                (sum / expected - 1.0).abs().largest() < 1e-4 && made.len() == count,
                "{name}, {count}: {} patches, {sum} of {expected}",
                made.len()
            );
            assert!(
                made.iter()
                    .all(|patch| (patch.normal.length() - 1.0).abs() < 1e-4 && patch.radius >= 0.0),
                "{name}, {count}"
            );
            let weight = |patch: &Patch| {
                patch.area * luminance(patch.radiance) * patch.radius * patch.radius
            };
            let mean = made.iter().map(weight).sum::<f32>() / luminance(expected);
            assert!(mean < widest, "{name}, {count}: patches grow");
            widest = mean;
        }
    }
    assert_eq!(patches(&[], 8, 1.0), []);
    assert_eq!(patches(&glowing_ball(), 0, 1.0), []);
}

/// What patches send to points of a room, over what all parts send.
#[test]
fn patches_shine_as_their_parts_do() {
    for (name, most) in [
        ("emissive-gallery", [0.35, 0.15, 0.05]),
        ("cornell-lamp", [0.1, 0.03, 0.01]),
    ] {
        let scene = bundled(name);
        let grid = VoxelGrid::around(scene.bounds().unwrap(), 64);
        let parts = emitters(&scene);
        let alone = |part: &Emitter| Patch {
            position: part.position,
            normal: part.normal,
            area: part.area,
            radius: 0.0,
            radiance: part.radiance,
        };
        let exact: Vec<Disc> = parts.iter().map(|part| disc(&alone(part), &grid)).collect();
        let mut random = Random::new(11);
        let (low, high) = scene.bounds().unwrap();
        let mut errors = [0.0; 3];
        let (mut sum, counts) = (0.0, [4, 32, 256]);
        for _ in 0..200 {
            let at =
                low + (high - low) * Vec3::from([0; 3].map(|_: u32| 0.15 + 0.7 * random.unit()));
            let position = (at - grid.origin).as_dvec3() / f64::from(grid.voxel_size);
            let normal =
                DVec3::from([0; 3].map(|_: u32| f64::from(random.unit()) - 0.5)).normalize();
            let receiver = Receiver {
                position,
                geometric_normal: normal,
                shading_normal: normal,
            };
            let light = |discs: &[Disc]| {
                discs
                    .iter()
                    .map(|disc| unhidden(disc, &receiver).element_sum())
                    .sum::<f64>()
            };
            let expected = light(&exact);
            sum += expected;
            for (error, count) in errors.iter_mut().zip(counts) {
                let discs: Vec<Disc> = patches(&parts, count, 1.0)
                    .iter()
                    .map(|patch| disc(patch, &grid))
                    .collect();
                *error += (light(&discs) - expected).abs();
            }
        }
        let shares = errors.map(|error| error / sum);
        println!("{name}: {counts:?} patches are off by {shares:.4?}");
        assert!(
            shares.iter().zip(most).all(|(share, most)| *share <= most),
            "{name}: {shares:?}"
        );
    }
}

#[test]
fn patches_by_cones_are_the_oracles() {
    let gpu = gpu();
    let scene = bundled("emissive-gallery");
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let grid = VoxelGrid::around(gpu_scene.bounds, 32);
    let view = View::new(&gpu, &gpu_scene, &scene.camera, [32, 24], &grid);
    for seed in 0..6u64 {
        let mut random = Random::new(1300 + seed);
        let finest = random_volume(32, [0.002, 0.01, 0.05][seed as usize % 3], &mut random);
        let (image, matter) = (volume(&gpu, &finest), matter(&gpu, &occupied(&finest), 32));
        let count = 1 + random.below(40);
        let pairs = [
            "emitters=patches".to_owned(),
            format!("step_factor={}", 0.25 + 1.5 * random.unit()),
            format!("opacity_exponent={}", 0.5 + 3.0 * random.unit()),
            format!(
                "height_clamp={}",
                if random.below(2) == 0 {
                    0.0
                } else {
                    1.0 + 6.0 * random.unit()
                }
            ),
            format!("start_offset={}", 0.5 + 2.0 * random.unit()),
        ];
        let settings = find("voxel-mips")
            .unwrap()
            .settings(Some("textbook"), &pairs)
            .unwrap();
        let made = EmissivePatches::new(&gpu, &gpu_scene, count).unwrap();
        let mut frame = Frame::new();
        frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
        filter(&gpu, &mut frame, &image, random.below(2));
        frame.clear_image("test.clear", &view.result, [1.0, 2.0, 3.0, 0.5]);
        let dense = mips::volume(grid, &image, &matter, None);
        ConeTracer::new(&gpu, &settings).unwrap().patches(
            &mut frame,
            &view.gbuffer,
            dense,
            &made,
            &view.result,
        );
        gpu.submit(frame).unwrap();
        let number = |name: &str| f64::from(settings.number(name));
        let march = MarchSettings {
            step_factor: number("step_factor"),
            opacity_exponent: number("opacity_exponent"),
            height_clamp: number("height_clamp"),
            max_distance: f64::INFINITY,
            ..MarchSettings::TEXTBOOK
        };
        let discs: Vec<Disc> = made
            .list(&gpu_scene)
            .iter()
            .map(|patch| disc(patch, &grid))
            .collect();
        assert_eq!(discs.len(), count as usize);
        let chain = read_chain(&gpu, &image);
        let light = |(_, receiver): &([u32; 2], Receiver)| {
            irradiance(&chain, &discs, receiver, number("start_offset"), &march).extend(0.5)
                + DVec4::new(1.0, 2.0, 3.0, 0.0)
        };
        let expected: Vec<DVec4> = view.receivers.par_iter().map(light).collect();
        let mut seen = view.results(&gpu);
        let result = errors(&seen, &expected);
        println!(
            "patches {seed}: {count}, worst error {:.1e}",
            result.0.last().unwrap()
        );
        verdict(&result).unwrap_or_else(|error| panic!("patches {seed}, {pairs:?}: {error}"));
        seen[100] *= 1.02;
        seen.rotate_right(1);
        assert!(
            verdict(&errors(&seen, &expected)).is_err(),
            "another pixel's light goes unnoticed"
        );
    }
}

fn traced(scene: &Scene, [width, height]: [u32; 2]) -> (Image, GuideImage) {
    let sampling = Sampling::Fixed { spp: 256 };
    let settings = reference::Settings {
        width,
        height,
        bounces: Bounces::Count(1),
        filter: Filter::Center,
        sampling,
        seed: 1,
        ..reference::Settings::default()
    };
    (
        reference::render(scene, &settings, &|_| {})
            .unwrap()
            .indirect(),
        reference::guide(scene, width, height).unwrap(),
    )
}

/// A panel under the ceiling of an empty room: nothing hides it, and its own plane does not either.
#[test]
fn an_open_panel_is_seen_whole() {
    let gpu = gpu();
    let mut builder = Builder::default();
    let black = builder.matte("black", Vec3::ZERO);
    let floor = builder.matte("floor", Vec3::splat(0.5));
    let lamp = builder.material(Material {
        name: "lamp".into(),
        albedo: Vec3::ZERO,
        emission: Vec3::splat(10.0),
        ..Material::default()
    });
    builder.room(
        [black, black, floor, black, black, black],
        Vec3::new(-1.0, 0.0, -1.0),
        Vec3::new(1.0, 2.0, 1.0),
        true,
    );
    builder.quad(
        lamp,
        Vec3::new(-0.3, 1.99, -0.3),
        Vec3::X * 0.6,
        Vec3::Z * 0.6,
    );
    let camera = Camera {
        eye: Vec3::new(0.0, 1.0, 0.9),
        target: Vec3::ZERO,
        up: Vec3::Y,
        vfov_deg: 40.0,
    };
    let scene = builder.finish("panel", Vec::new(), Vec3::ZERO, camera);
    let (reference, guide) = traced(&scene, [32, 24]);
    let expected = mean(&reference, &guide);
    for case in default_cases_with("emitters=patches") {
        for count in ["1", "4", "32", "256"] {
            let pairs = [
                ("resolution", "64"),
                ("emitters", "patches"),
                ("emissive_patches", count),
            ];
            let shot = shoot(&gpu, &scene, &case, &pairs, frame(32, 24, 64)).unwrap();
            let share = mean(&shot.indirect, &guide) / expected;
            println!("{}, {count} patches: {share:.3}", case.name());
            assert!(
                is_sound(&shot.indirect) && (share - 1.0).abs() <= 0.05,
                "{}, {count}: {share}",
                case.name()
            );
        }
    }
}

/// Nothing is counted twice, and what hides a panel is seen: the error falls where the gather's
/// cones are what is wrong, with one bounce and with two.
#[test]
fn patches_reduce_the_error() {
    let gpu = gpu();
    for (name, most) in [("cornell-lamp", 0.5), ("emissive-gallery", 0.3)] {
        let scene = bundled(name);
        let (reference, guide) = traced(&scene, [96, 72]);
        for technique in ["voxel-mips", "svo", "clipmap"] {
            let case = Case {
                entry: find(technique).unwrap(),
                preset: Some("cones"),
            };
            let error = |count| {
                let pairs = [
                    ("resolution", "64"),
                    ("emitters", "patches"),
                    ("emissive_patches", count),
                ];
                block_errors(
                    &shoot(&gpu, &scene, &case, &pairs, frame(96, 72, 64))
                        .unwrap()
                        .indirect,
                    &reference,
                    &guide,
                )
            };
            let [without, with] = ["0", "32"].map(error);
            println!(
                "{name}, {technique}: {:+.3} / {:.3}, with patches {:+.3} / {:.3}",
                without.bias, without.rel_rmse, with.bias, with.rel_rmse
            );
            assert!(
                with.rel_rmse <= most * without.rel_rmse && with.bias.abs() <= 0.1,
                "{name}, {technique}: {without:?}, {with:?}"
            );
        }
    }
}

/// With bounces the voxels go on seeing emission: what is left after the first bounce is what it is
/// without patches.
#[test]
fn later_bounces_and_reflections_keep_emission() {
    let gpu = gpu();
    let scene = bundled("cornell-lamp");
    let guide = reference::guide(&scene, 24, 18).unwrap();
    for case in default_cases_with("emitters=patches") {
        let lit = |bounces: &str, count: &str| {
            let pairs = [
                ("resolution", "16"),
                ("emitters", "patches"),
                ("emissive_patches", count),
                ("bounces", bounces),
            ];
            let (mut renderer, _) = Renderer::new(
                &gpu,
                &scene,
                case.entry,
                &case.settings(&pairs),
                frame(24, 18, 64),
            )
            .unwrap();
            (0..if bounces == "feedback" { 8 } else { 1 })
                .for_each(|_| drop(renderer.render(&scene.camera).unwrap()));
            mean(&renderer.aov(Aov::Indirect).unwrap(), &guide)
        };
        let [first, patched] = ["0", "32"].map(|count| lit("1", count));
        for bounces in ["2", "3", "feedback"] {
            let [all, all_patched] = ["0", "32"].map(|count| lit(bounces, count));
            let (later, later_patched) = (all - first, all_patched - patched);
            println!(
                "{}, {bounces}: later bounces {later:.4}, with patches {later_patched:.4}",
                case.name()
            );
            // Feedback with patches is one bounce ahead.
            assert!(
                later > 0.0 && (later_patched / later - 1.0).abs() <= 0.02,
                "{}, {bounces}: {later}, {later_patched}",
                case.name()
            );
        }
    }
}

/// A mirror-like floor shows the lamp, which patches do not.
#[test]
fn glossy_surfaces_reflect_what_emits() {
    let gpu = gpu();
    let scene = Scene {
        lights: Vec::new(),
        ..small_room(Surfaces::Glossy, Vec::new())
    };
    let mut glowing = scene.clone();
    glowing.materials[3].emission = Vec3::splat(2.0);
    for case in default_cases_with("emitters=patches") {
        let reflected = |count| {
            let pairs = [
                ("resolution", "32"),
                ("emitters", "patches"),
                ("emissive_patches", count),
            ];
            let (mut renderer, _) = Renderer::new(
                &gpu,
                &glowing,
                case.entry,
                &case.settings(&pairs),
                frame(32, 24, 64),
            )
            .unwrap();
            renderer.render(&glowing.camera).unwrap();
            renderer.aov(Aov::Specular).unwrap()
        };
        let (without, with) = (reflected("0"), reflected("16"));
        let sum = |image: &Image| {
            image
                .pixels
                .iter()
                .map(|pixel| f64::from(luminance(*pixel)))
                .sum::<f64>()
        };
        assert!(
            sum(&without) > 0.0 && (sum(&with) / sum(&without) - 1.0).abs() < 1e-4,
            "{}: {}, {}",
            case.name(),
            sum(&with),
            sum(&without)
        );
    }
}

/// A lamp that moves lights what it comes to: as a scene in which it was there from the start.
#[test]
fn patches_follow_their_models() {
    let gpu = gpu();
    let mut lamp = Builder::default();
    let glow = lamp.material(Material {
        name: "lamp".into(),
        emission: Vec3::splat(8.0),
        ..Material::default()
    });
    lamp.cuboid(glow, Vec3::splat(-0.1), Vec3::splat(0.1));
    let mut scene = small_room(Surfaces::Diffuse, Vec::new());
    add_model(
        &mut scene,
        lamp.scene,
        &[
            still(Vec3::new(-0.3, 0.9, 0.0)),
            still(Vec3::new(0.4, 0.5, 0.2)),
        ],
    );
    let mut moved = scene.clone();
    moved.set_time(1.0);
    for case in default_cases_with("emitters=patches") {
        let settings = case.settings(&[
            ("resolution", "32"),
            ("emitters", "patches"),
            ("emissive_patches", "12"),
        ]);
        let mut renderer = Renderer::new(&gpu, &scene, case.entry, &settings, frame(32, 24, 64))
            .unwrap()
            .0;
        let mut there = Renderer::new(&gpu, &moved, case.entry, &settings, frame(32, 24, 64))
            .unwrap()
            .0;
        renderer.render(&scene.camera).unwrap();
        let before = renderer.aov(Aov::Indirect).unwrap();
        renderer.set_pose(&moved).unwrap();
        let [seen, expected] = [&mut renderer, &mut there].map(|renderer| {
            renderer.render(&scene.camera).unwrap();
            renderer.aov(Aov::Indirect).unwrap()
        });
        let off = largest_difference(&seen, &expected);
        assert!(
            off < 1e-3 && largest_difference(&before, &expected) > 0.1,
            "{}: {off}",
            case.name()
        );
    }
}

/// Without emission, with another way for it, or with 0 patches there is no pass and no byte for
/// them.
#[test]
fn what_does_not_emit_costs_nothing() {
    let gpu = gpu();
    let [(_, light), ..] = small_lights();
    let dark = small_room(Surfaces::Diffuse, vec![light]);
    let mut glowing = dark.clone();
    glowing.materials[0].emission = Vec3::ONE;
    for case in default_cases_with("emitters=patches") {
        for (scene, pairs, own) in [
            (&dark, &[("emitters", "patches")][..], false),
            (&glowing, &[("emitters", "gather")], false),
            (
                &glowing,
                &[("emitters", "patches"), ("emissive_patches", "0")],
                false,
            ),
            (&glowing, &[("emitters", "patches")], true),
        ] {
            let (mut renderer, _) = Renderer::new(
                &gpu,
                scene,
                case.entry,
                &case.settings(&[&[("resolution", "16")], pairs].concat()),
                frame(16, 16, 64),
            )
            .unwrap();
            let stats = renderer.render(&scene.camera).unwrap();
            let runs = stats.passes.iter().any(|pass| pass.name == "cone.patches");
            let bytes: u64 = gpu
                .memory()
                .iter()
                .filter(|(name, _)| name == "cone.patches")
                .map(|(_, bytes)| *bytes)
                .sum();
            assert_eq!(
                [runs, bytes > 0],
                [own; 2],
                "{}, {pairs:?}: {bytes} bytes",
                case.name()
            );
        }
    }
}
