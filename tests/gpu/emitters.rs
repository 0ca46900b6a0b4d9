//! Surfaces that emit, as points that rays go to: `voxel.gather_emitters` and
//! `voxel.bounce_emitters` on the device against the CPU oracle, pictures against the path tracer.

use std::collections::BTreeMap;

use crate::support::compare::Largest;
use crate::support::gather::View;
use crate::support::scenes::{add_model, bundled, still};
use crate::support::technique::{
    Builder, Case, Surfaces, block_errors, frame, is_sound, largest_difference, mean, shoot,
    small_room,
};
use crate::support::voxels::{
    Read, coordinates, half, ray_blocks, to_half, trace_settings, trace_voxel, voxel_settings,
    voxelize,
};
use crate::support::{Random, gpu};
use glam::{DVec2, DVec3, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::Settings;
use lumivox::gi::registry::find;
use lumivox::gi::shared::interleave::Pattern;
use lumivox::gi::shared::interleave::oracle::interleaved_offset;
use lumivox::gi::shared::voxel::build::passes::Voxel;
use lumivox::gi::shared::voxel::oracle::{
    EmitterPart, PointSettings, Reached, Receiver, TraceGrid, TraceVoxel, VoxelIndex,
    bounce_receiver, gather_emitters, gather_emitters_triangles, seed_of, unhidden, voxel_pattern,
};
use lumivox::gi::shared::voxel::{
    CANDIDATES, EmitterPoints, Injection, LightBounces, LightSettings, Method, RaySettings,
    RayTracer, Sides, VoxelGrid, VoxelLight, VoxelRecords, emitter_rows,
};
use lumivox::gi::voxel_cones::mips::space;
use lumivox::graph::{Frame, Gpu};
use lumivox::image::{Aov, GuideImage, Image, luminance};
use lumivox::reference::{self, Bounces, Filter, Sampling};
use lumivox::render::GpuScene;
use lumivox::render::bvh::{START_SHARE, SceneRays};
use lumivox::scene::{Camera, Material, Scene};
use rayon::prelude::*;

/// What decides is within f32 rounding where this is all that separates it from the other decision.
const ROUNDING: f64 = 1e-3;

fn voxel_mips() -> Case {
    Case {
        entry: find("voxel-mips").unwrap(),
        preset: Some("accurate"),
    }
}

/// The table of a scene in a grid.
fn parts(scene: &GpuScene, grid: &VoxelGrid) -> Vec<EmitterPart> {
    let h = f64::from(grid.voxel_size);
    let vec = |row: [f32; 4]| Vec3::from_slice(&row).as_dvec3();
    emitter_rows(&scene.emitters)
        .iter()
        .map(|row| EmitterPart {
            corner: (vec(row.corner_before) - grid.origin.as_dvec3()) / h,
            edges: [vec(row.edge_density) / h, vec(row.edge) / h],
            radiance: vec(row.radiance),
            before: f64::from(row.corner_before[3]),
            density: f64::from(row.edge_density[3]) * h * h,
        })
        .collect()
}

/// The corners of all triangles of a scene (voxels).
fn corners(scene: &Scene, grid: &VoxelGrid) -> Vec<[DVec3; 3]> {
    let corner = |vertex: u32| {
        let position = Vec3::from(scene.vertices[vertex as usize].position);
        (position.as_dvec3() - grid.origin.as_dvec3()) / f64::from(grid.voxel_size)
    };
    (scene
        .triangles
        .iter()
        .map(|triangle| triangle.vertices.map(corner)))
    .collect()
}

/// How far off a receiver its rays against triangles start (voxels).
fn start(scene: &Scene, receiver: &Receiver, grid: &VoxelGrid) -> f64 {
    let h = f64::from(grid.voxel_size);
    let place = h * receiver.position + grid.origin.as_dvec3();
    let eye = scene.camera.eye.as_dvec3();
    let largest = place.abs().max((eye - place).abs()).max_element();
    f64::from(START_SHARE) * largest / h
}

fn trace_grid(read: &Read) -> TraceGrid {
    let surface = |record: &Voxel| trace_voxel(record, [DVec3::ZERO; 2]);
    let voxels: BTreeMap<VoxelIndex, TraceVoxel> = read
        .records
        .iter()
        .map(|record| (coordinates(record), surface(record)))
        .collect();
    TraceGrid {
        resolution: read.voxels.grid.resolution,
        voxels,
    }
}

fn settings(pairs: &[&str]) -> Settings {
    voxel_mips()
        .entry
        .settings(Some("accurate"), pairs)
        .unwrap()
}

fn point_settings(
    settings: &Settings,
    ray_count: u32,
    (pattern, seed): (DVec2, u32),
    least: f64,
) -> PointSettings {
    PointSettings {
        ray_count,
        candidates: CANDIDATES,
        start_offset: f64::from(settings.number("ray_start")),
        least_distance: least,
        trace: trace_settings(settings, seed),
        pattern,
    }
}

/// What is wrong with light on the device, if anything: at places where no decision is within
/// rounding, light is the oracle's to 1% of the mean, and such places are most.
fn verdict(seen: &[DVec3], expected: &[Reached]) -> Result<String, String> {
    let mean = expected
        .iter()
        .map(|reached| reached.irradiance.length())
        .sum::<f64>()
        / expected.len() as f64;
    let sure: Vec<f64> = seen
        .iter()
        .zip(expected)
        .filter(|(_, reached)| reached.margin > ROUNDING)
        .map(|(seen, reached)| {
            (*seen - reached.irradiance).length() / (reached.irradiance.length() + 0.05 * mean)
        })
        .collect();
    let worst = sure
        .iter()
        .fold(0.0, |a: f64, b| if *b <= a { a } else { *b });
    let share = sure.len() as f64 / expected.len() as f64;
    let what = format!(
        "{:.0}% are sure, the worst is off by {worst:.1e}",
        100.0 * share
    );
    if share >= 0.4 && worst <= 0.01 && mean > 0.0 {
        Ok(what)
    } else {
        Err(what)
    }
}

#[test]
fn light_from_points_is_the_oracles() {
    let gpu = gpu();
    for (name, pairs, by_triangles) in [
        (
            "cornell-lamp",
            ["rays=3", "interleave=4", "contour_slack=0.1"],
            false,
        ),
        (
            "emissive-gallery",
            ["rays=4", "interleave=4", "contour_slack=0.1"],
            false,
        ),
        (
            "emissive-gallery",
            ["rays=2", "interleave=1", "contour_slack=-1"],
            false,
        ),
        (
            "cornell-lamp",
            ["rays=3", "interleave=4", "contour_slack=0.1"],
            true,
        ),
        (
            "emissive-gallery",
            ["rays=2", "interleave=1", "contour_slack=0.1"],
            true,
        ),
    ] {
        let scene = bundled(name);
        let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
        let read = voxelize(&gpu, &gpu_scene, voxel_settings(32, Method::Compute));
        let view = View::new(&gpu, &gpu_scene, &scene.camera, [32, 24], &read.voxels.grid);
        let settings = settings(&pairs);
        let mut frame = Frame::new();
        frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
        frame.clear_image("test.clear", &view.result, [1.0, 2.0, 3.0, 0.5]);
        let light_settings = LightSettings::direct(Injection::Voxel, Sides::Two);
        let light = VoxelLight::new(&gpu, &gpu_scene, &read.voxels, light_settings).unwrap();
        let scene_rays = SceneRays::new(&gpu, &gpu_scene).unwrap();
        RayTracer::new(RaySettings::new(&settings), 0).gather_emitters(
            &mut frame,
            &view.all(&gpu_scene),
            &space(&read.voxels, &ray_blocks(&gpu, &read.voxels), &light),
            by_triangles.then_some(&scene_rays),
            &EmitterPoints::new(&gpu, &gpu_scene).unwrap(),
        );
        gpu.submit(frame).unwrap();
        let (grid, parts) = (trace_grid(&read), parts(&gpu_scene, &read.voxels.grid));
        let triangles = corners(&scene, &read.voxels.grid);
        let of = |(pixel, receiver): &([u32; 2], Receiver)| {
            let pattern = interleaved_offset(*pixel, Pattern::new(&settings), 0);
            let count = settings.count("rays");
            let seed = seed_of([pixel[0], pixel[1], 0], 0);
            let point = point_settings(&settings, count, (pattern, seed), 0.0);
            if by_triangles {
                let start_offset = start(&scene, receiver, &read.voxels.grid);
                let point = PointSettings {
                    start_offset,
                    ..point
                };
                return gather_emitters_triangles(&triangles, &parts, receiver, &point);
            }
            gather_emitters(&grid, &parts, receiver, &point)
        };
        let expected: Vec<Reached> = view.receivers.par_iter().map(of).collect();
        let results = view.results(&gpu);
        assert!(results.iter().all(|pixel| pixel.w == 0.5));
        let mut seen: Vec<DVec3> = results
            .iter()
            .map(|pixel| pixel.truncate() - DVec3::new(1.0, 2.0, 3.0))
            .collect();
        let what =
            verdict(&seen, &expected).unwrap_or_else(|error| panic!("{name}, {pairs:?}: {error}"));
        println!("{name}, {pairs:?}: {what}");
        seen.rotate_right(1);
        assert!(
            verdict(&seen, &expected).is_err(),
            "another pixel's light goes unnoticed"
        );
    }
}

#[test]
fn light_from_points_to_voxels_is_the_oracles() {
    let gpu = gpu();
    let scene = bundled("emissive-gallery");
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    gpu_scene
        .set_frame(&gpu, &gpu_scene.frame_constants(&scene.camera, [8, 8]))
        .unwrap();
    let read = voxelize(&gpu, &gpu_scene, voxel_settings(32, Method::Compute));
    let settings = settings(&["radiance=two-sided"]);
    let before = [0.001, 0.002, 0.003].map(to_half);
    let slots = 2 * read.records.len();
    let words: Vec<u16> = (0..slots)
        .flat_map(|_| [before[0], before[1], before[2], 0])
        .collect();
    let light_settings = LightSettings {
        bounces: LightBounces::Count(2),
        ..LightSettings::direct(Injection::Voxel, Sides::Two)
    };
    let light = VoxelLight::new(&gpu, &gpu_scene, &read.voxels, light_settings).unwrap();
    let irradiance = light.irradiance.as_ref().unwrap();
    gpu.upload_buffer(irradiance, bytemuck::cast_slice(&words))
        .unwrap();
    let mut frame = Frame::new();
    frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
    RayTracer::new(RaySettings::new(&settings), 3).bounce_emitters(
        &mut frame,
        &VoxelRecords::from(&read.voxels),
        &space(&read.voxels, &ray_blocks(&gpu, &read.voxels), &light),
        irradiance,
        &EmitterPoints::new(&gpu, &gpu_scene).unwrap(),
    );
    gpu.submit(frame).unwrap();
    let (grid, parts) = (trace_grid(&read), parts(&gpu_scene, &read.voxels.grid));
    let chosen: Vec<usize> = (0..slots).step_by(7).collect();
    let of = |slot: &usize| {
        let voxel = coordinates(&read.records[slot / 2]);
        let receiver = bounce_receiver(voxel, &grid.voxels[&voxel], Some(slot % 2), 0);
        let seed = seed_of(voxel, (slot % 2) as u32);
        let point = point_settings(&settings, 3, (voxel_pattern(voxel), seed), 0.25);
        gather_emitters(&grid, &parts, &receiver, &point)
    };
    let expected: Vec<Reached> = chosen.par_iter().map(of).collect();
    let halves: Vec<u16> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(irradiance).unwrap());
    let mut seen: Vec<DVec3> = chosen
        .iter()
        .map(|slot| {
            let color = DVec3::from([0, 1, 2].map(|channel| half(halves[4 * slot + channel])));
            std::f64::consts::PI * (color - DVec3::new(0.001, 0.002, 0.003))
        })
        .collect();
    let what = verdict(&seen, &expected).unwrap_or_else(|error| panic!("{error}"));
    println!("voxels: {what}");
    seen.rotate_right(1);
    assert!(verdict(&seen, &expected).is_err());
}

/// The mean of what points send is what the whole surface sends.
#[test]
fn points_shine_as_their_surfaces_do() {
    for name in ["cornell-lamp", "emissive-gallery"] {
        let gpu = gpu();
        let scene = bundled(name);
        let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
        let grid = VoxelGrid::around(gpu_scene.bounds, 64);
        let parts = parts(&gpu_scene, &grid);
        let nothing = TraceGrid {
            resolution: 64,
            voxels: BTreeMap::new(),
        };
        let mut random = Random::new(3);
        let (mut off, mut sum) = (DVec3::ZERO, DVec3::ZERO);
        for _ in 0..200 {
            let position = DVec3::from([0; 3].map(|_: u32| f64::from(20.0 + 24.0 * random.unit())));
            let normal =
                DVec3::from([0; 3].map(|_: u32| f64::from(random.unit()) - 0.5)).normalize();
            let receiver = Receiver {
                position,
                geometric_normal: normal,
                shading_normal: normal,
            };
            let pattern = DVec2::new(f64::from(random.unit()), f64::from(random.unit()));
            let point = point_settings(&settings(&[]), 1024, (pattern, 0), 0.0);
            let seen = gather_emitters(&nothing, &parts, &receiver, &point).irradiance;
            let expected = unhidden(&parts, &receiver, 4);
            off += seen - expected;
            sum += expected;
        }
        let share = (off / sum).abs().largest();
        println!("{name}: off by {share:.2e}");
        assert!(share < 0.01, "{name}: {share}");
    }
}

fn traced(scene: &Scene, [width, height]: [u32; 2], bounces: u32) -> (Image, GuideImage) {
    let settings = reference::Settings {
        width,
        height,
        bounces: Bounces::Count(bounces),
        filter: Filter::Center,
        sampling: Sampling::Fixed { spp: 256 },
        seed: 1,
        ..reference::Settings::default()
    };
    let indirect = reference::render(scene, &settings, &|_| {})
        .unwrap()
        .indirect();
    (indirect, reference::guide(scene, width, height).unwrap())
}

/// A scene with lamps needs nothing else: no setting says that there are some.
#[test]
fn the_default_is_right_with_lamps() {
    let gpu = gpu();
    for (name, bounces, most) in [
        ("cornell-lamp", "1", 0.03),
        ("cornell-lamp", "2", 0.03),
        ("emissive-gallery", "1", 0.08),
    ] {
        let scene = bundled(name);
        let (reference, guide) = traced(&scene, [96, 72], bounces.parse().unwrap());
        let error = |method| {
            let pairs = [("emitters", method), ("bounces", bounces)];
            let shot = shoot(&gpu, &scene, &voxel_mips(), &pairs, frame(96, 72, 64)).unwrap();
            block_errors(&shot.indirect, &reference, &guide)
        };
        let [seen, gathered] = ["auto", "gather"].map(error);
        println!(
            "{name}, {bounces}: {:+.3} / {:.3}, gathered {:+.3} / {:.3}",
            seen.bias, seen.rel_rmse, gathered.bias, gathered.rel_rmse
        );
        assert!(
            seen.rel_rmse <= most && seen.rel_rmse < 0.8 * gathered.rel_rmse,
            "{name}, {bounces}: {seen:?}, {gathered:?}"
        );
    }
}

/// A panel under a ceiling, from 16 voxels to a hundredth of one, with the same power.
#[test]
fn a_lamp_of_any_size_is_right() {
    let gpu = gpu();
    for edge_voxels in [16.0, 1.0, 0.01] {
        let mut builder = Builder::default();
        let black = builder.matte("black", Vec3::ZERO);
        let floor = builder.matte("floor", Vec3::splat(0.5));
        let half = 0.5 * edge_voxels * 2.08 / 64.0;
        let lamp = builder.material(Material {
            name: "lamp".into(),
            albedo: Vec3::ZERO,
            emission: Vec3::splat(1.0 / (half * half)),
            ..Material::default()
        });
        builder.room(
            [floor, floor, floor, black, floor, floor],
            Vec3::new(-1.0, 0.0, -1.0),
            Vec3::new(1.0, 2.0, 1.0),
            true,
        );
        builder.quad(
            lamp,
            Vec3::new(0.1 - half, 1.99, -half),
            Vec3::X * 2.0 * half,
            Vec3::Z * 2.0 * half,
        );
        let camera = Camera {
            eye: Vec3::new(0.0, 1.0, 0.9),
            target: Vec3::new(0.0, 0.6, 0.0),
            up: Vec3::Y,
            vfov_deg: 70.0,
        };
        let scene = builder.finish("panel", Vec::new(), Vec3::ZERO, camera);
        let (reference, guide) = traced(&scene, [48, 36], 1);
        let pairs = [("resolution", "64")];
        let shot = shoot(&gpu, &scene, &voxel_mips(), &pairs, frame(48, 36, 64)).unwrap();
        let errors = block_errors(&shot.indirect, &reference, &guide);
        println!(
            "{edge_voxels} voxels: {:+.4} / {:.4}",
            errors.bias, errors.rel_rmse
        );
        assert!(
            is_sound(&shot.indirect) && errors.rel_rmse <= 0.03,
            "{edge_voxels} voxels: {errors:?}"
        );
    }
}

/// A mirror-like floor shows the lamp, which rays to points do not.
#[test]
fn mirrors_see_lamps_in_voxels() {
    let gpu = gpu();
    let mut scene = small_room(Surfaces::Glossy, Vec::new());
    scene.lights.clear();
    scene.materials[3].emission = Vec3::splat(2.0);
    let mirrored = |method| {
        let pairs = [("resolution", "32"), ("emitters", method)];
        let settings = voxel_mips().settings(&pairs);
        let (mut renderer, _) = Renderer::new(
            &gpu,
            &scene,
            voxel_mips().entry,
            &settings,
            frame(32, 24, 64),
        )
        .unwrap();
        renderer.render(&scene.camera).unwrap();
        let seen = renderer.aov(Aov::Specular).unwrap();
        seen.pixels
            .iter()
            .map(|pixel| f64::from(luminance(*pixel)))
            .sum::<f64>()
    };
    let (points, gathered) = (mirrored("points"), mirrored("gather"));
    assert!(
        gathered > 0.0 && (points / gathered - 1.0).abs() < 1e-4,
        "{points}, {gathered}"
    );
}

/// A lamp that moves lights what it comes to: as a scene in which it was there from the start.
#[test]
fn points_follow_their_models() {
    let gpu = gpu();
    let mut lamp = Builder::default();
    let glow = lamp.material(Material {
        name: "lamp".into(),
        emission: Vec3::splat(8.0),
        ..Material::default()
    });
    lamp.cuboid(glow, Vec3::splat(-0.1), Vec3::splat(0.1));
    let mut scene = small_room(Surfaces::Diffuse, Vec::new());
    let places = [Vec3::new(-0.3, 0.9, 0.0), Vec3::new(0.4, 0.5, 0.2)].map(still);
    add_model(&mut scene, lamp.scene, &places);
    let mut moved = scene.clone();
    moved.set_time(1.0);
    let settings = voxel_mips().settings(&[("resolution", "32"), ("bounces", "2")]);
    let renderer = |scene: &Scene| {
        Renderer::new(
            &gpu,
            scene,
            voxel_mips().entry,
            &settings,
            frame(32, 24, 64),
        )
        .unwrap()
        .0
    };
    let (mut renderer, mut there) = (renderer(&scene), renderer(&moved));
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
        "{off}"
    );
}

/// Feedback comes to rest, at more light than two bounces.
#[test]
fn feedback_with_points_comes_to_rest() {
    let gpu = gpu();
    let scene = bundled("cornell-lamp");
    let guide = reference::guide(&scene, 24, 18).unwrap();
    let lit = |bounces: &str, frames: u32| {
        let settings = voxel_mips().settings(&[("resolution", "16"), ("bounces", bounces)]);
        let (mut renderer, _) = Renderer::new(
            &gpu,
            &scene,
            voxel_mips().entry,
            &settings,
            frame(24, 18, 64),
        )
        .unwrap();
        (0..frames).for_each(|_| drop(renderer.render(&scene.camera).unwrap()));
        mean(&renderer.aov(Aov::Indirect).unwrap(), &guide)
    };
    let (two, four) = (lit("2", 1), lit("4", 1));
    let [rest, later] = [16, 20].map(|frames| lit("feedback", frames));
    println!("two bounces {two:.4}, four {four:.4}, feedback {rest:.4}, later {later:.4}");
    assert!(two < four && four < rest && (later / rest - 1.0).abs() < 1e-3);
}

/// What does not emit costs nothing, and what is not asked for neither.
#[test]
fn points_cost_nothing_where_nothing_emits() {
    let gpu = gpu();
    let dark = bundled("cornell");
    let glowing = bundled("cornell-lamp");
    for (scene, method, own) in [
        (&dark, "auto", false),
        (&glowing, "gather", false),
        (&glowing, "auto", true),
    ] {
        let settings = voxel_mips().settings(&[("resolution", "16"), ("emitters", method)]);
        let (mut renderer, _) = Renderer::new(
            &gpu,
            scene,
            voxel_mips().entry,
            &settings,
            frame(16, 16, 64),
        )
        .unwrap();
        let stats = renderer.render(&scene.camera).unwrap();
        let runs = |name: &str| stats.passes.iter().any(|pass| pass.name == name);
        let bytes: u64 = bytes_of(&gpu, "voxel.emitter_parts");
        assert_eq!(
            [runs("voxel.gather_emitters"), bytes > 0],
            [own; 2],
            "{}, {method}",
            scene.name
        );
    }
}

fn bytes_of(gpu: &Gpu, name: &str) -> u64 {
    let all = gpu.memory();
    all.iter()
        .filter(|(own, _)| own == name)
        .map(|(_, bytes)| *bytes)
        .sum()
}
