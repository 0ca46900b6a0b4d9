//! What the camera sees as what blocks lobes, on the device against its CPU oracle; and what is
//! kept of what lights see.

use crate::lpv::{SETTINGS, grid_of, lights};
use crate::support::compare::{Largest, Worst};
use crate::support::scenes::{bundled, scene_of, soup};
use crate::support::technique::{Builder, Surfaces, frame, moving_room, small_lights};
use crate::support::voxels::half;
use crate::support::{Random, gpu};
use glam::{DVec4, Quat, UVec3, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::Settings;
use lumivox::gi::lpv::lobes::{LobeSettings, Occlusion, Scheme};
use lumivox::gi::lpv::oracle::{self, lobes::blockers};
use lumivox::gi::lpv::peel::CameraLayers;
use lumivox::gi::lpv::{CellGrid, CellSettings, Cells};
use lumivox::gi::registry::find;
use lumivox::graph::{Frame, Gpu, Issued};
use lumivox::image::Aov;
use lumivox::render::oracle::View;
use lumivox::render::{Follows, GBuffer, GpuScene, LightMaps};
use lumivox::scene::{Camera, Light, Scene};

fn settings(blocker_layers: u32) -> CellSettings {
    CellSettings {
        occlusion: Occlusion::Fuzzy,
        blocker_layers,
        lobes: Some(LobeSettings {
            scheme: Scheme::Lobes30,
            iterations: 12,
            gain: 1.0,
            clamp_negative: true,
        }),
        ..SETTINGS
    }
}

/// What one frame of a scene, seen by its camera, leaves in a grid.
struct Found {
    /// Halves of the blocking potential of all corners.
    bits: Vec<[u16; 4]>,
    /// First coefficient of the light of all cells, of green.
    light: Vec<f64>,
    /// View of the camera.
    view: View,
}

impl Found {
    fn potential(&self) -> Vec<DVec4> {
        let number = |texel: &[u16; 4]| DVec4::from(texel.map(half));
        self.bits.iter().map(number).collect()
    }
}

fn find_in(gpu: &Gpu, scene: &Scene, grid: CellGrid, size: [u32; 2], layers: u32) -> Found {
    let on_gpu = GpuScene::new(gpu, scene).unwrap();
    let constants = on_gpu.frame_constants(&scene.camera, size);
    on_gpu.set_frame(gpu, &constants).unwrap();
    let maps = LightMaps::new(gpu, &on_gpu, 64, true).unwrap();
    let gbuffer = GBuffer::new(gpu, &on_gpu, size, Follows::Nothing).unwrap();
    let camera_layers = CameraLayers::new(gpu, size, layers).unwrap();
    let mut cells = Cells::new(gpu, &on_gpu, grid, settings(layers)).unwrap();
    cells.find_faces(gpu, &on_gpu).unwrap();
    let mut frame = Frame::new();
    frame.set_scene(&on_gpu.set, &on_gpu.materials);
    maps.draw(&mut frame, &on_gpu);
    gbuffer.draw(&mut frame, &on_gpu);
    let seen = camera_layers.draw(&mut frame, &on_gpu, &gbuffer);
    assert_eq!(seen.len() as u32, layers);
    cells.light(&mut frame, &on_gpu, &maps, &seen);
    gpu.submit(frame).unwrap();
    let volume = cells.blockers.as_ref().unwrap().volume();
    let near_m = f64::from(constants.clip_from_world[3][2]);
    Found {
        bits: bytemuck::pod_collect_to_vec(&gpu.read_image(volume, 0, 0).unwrap()),
        light: crate::lpv::read_light(gpu, &cells)
            .iter()
            .map(|cell| cell[0].y)
            .collect(),
        view: View::of_camera(&scene.camera, size, near_m),
    }
}

fn find_with(gpu: &Gpu, scene: &Scene, size: [u32; 2], layers: u32) -> (Found, CellGrid) {
    let grid = grid_of(&GpuScene::new(gpu, scene).unwrap(), 16);
    (find_in(gpu, scene, grid, size, layers), grid)
}

fn without_lights(scene: &Scene) -> Scene {
    Scene {
        lights: Vec::new(),
        ..scene.clone()
    }
}

/// Surfels in double precision. One between two corners may be at either, and a pixel at an edge
/// may see either side: corners are compared with some surfels to spare, sums more closely.
fn check(gpu: &Gpu, name: &str, scene: &Scene, (size, stride, layers): ([u32; 2], u32, u32)) {
    let (found, grid) = find_with(gpu, &without_lights(scene), size, layers);
    let nearest = oracle::surfels(scene, &found.view, stride, 1);
    let small = View {
        size: size.map(|side| side.div_ceil(stride)),
        ..found.view
    };
    let behind = oracle::surfels(scene, &small, 1, layers as usize);
    let all = nearest.into_iter().chain(behind.into_iter().skip(1));
    let expected = blockers(all.flatten(), &grid);
    let (mut sums, mut apart) = ([DVec4::ZERO; 2], 0.0);
    for (got, expected) in found.potential().iter().zip(&expected) {
        sums[0] += *got;
        sums[1] += *expected;
        apart += (*got - *expected).abs().largest();
    }
    let error = (sums[0] - sums[1]).abs().largest() / sums[1].x;
    let apart = apart / sums[1].x;
    println!(
        "{name}, {size:?}, {layers} layers: Σ {:.1}, sums differ by {error:.1e}, corners by \
         {apart:.1e}",
        sums[1].x
    );
    // A few pixels at edges.
    let pixels: u32 = size.map(|side| side.div_ceil(stride)).iter().product();
    let spare = 4.0 / f64::from(pixels);
    assert!(
        error < 0.01 + spare && apart < 0.01 + spare,
        "{name}: {error}, {apart}"
    );
}

#[test]
fn camera_blockers_are_the_oracles() {
    let gpu = gpu();
    for name in ["cornell", "two-rooms"] {
        let scene = bundled(name);
        for layers in 1..=4 {
            check(&gpu, name, &scene, ([96, 80], 1, layers));
        }
        check(&gpu, name, &scene, ([1500, 70], 3, 3));
    }
    let mut random = Random::new(5);
    for _ in 0..4 {
        let mut scene = scene_of(&soup(&mut random, 16), 0.0, &mut random);
        scene.camera = Camera {
            eye: 16.0 * Vec3::new(random.unit(), random.unit(), 1.7),
            target: 16.0 * Vec3::new(random.unit(), random.unit(), 0.4),
            ..scene.camera
        };
        check(&gpu, "soup", &scene, ([120, 120], 1, 4));
    }
}

/// Surfaces that a light and the camera see count once.
#[test]
fn camera_and_lights_are_merged_by_the_larger() {
    let gpu = gpu();
    for (name, scene) in lights() {
        let size = [64, 64];
        let of_lights = find_with(&gpu, &scene, size, 0).0.potential();
        let of_camera = find_with(&gpu, &without_lights(&scene), size, 2)
            .0
            .potential();
        let of_both = find_with(&gpu, &scene, size, 2).0.potential();
        let expected = oracle::merge(&of_lights, &of_camera);
        let mut from = [0; 2];
        for (index, both) in of_both.iter().enumerate() {
            let (light, camera) = (of_lights[index], of_camera[index]);
            from[usize::from(camera.x > light.x)] += u32::from(both.x > 0.0);
            let is_tie = (light.x - camera.x).abs() <= 2e-3 * light.x;
            assert!(is_tie || *both == expected[index], "{name}: {both}");
        }
        println!("{name}: {from:?} corners of lights, of the camera");
        assert!(from[0] > 20 && from[1] > 20, "{name}: {from:?}");
    }
}

/// A lamp that shines on a patch of floor alone, and two walls, one behind the other, that only
/// the camera faces; the further is hidden.
fn two_walls() -> Scene {
    let mut builder = Builder::default();
    let matte = builder.matte("matte", Vec3::splat(0.5));
    let wall = |builder: &mut Builder, z: f32| {
        builder.quad(matte, Vec3::new(-1.0, 0.0, z), 2.0 * Vec3::X, 2.0 * Vec3::Y);
    };
    wall(&mut builder, 0.0);
    wall(&mut builder, -0.8);
    builder.quad(
        matte,
        Vec3::new(-1.0, 0.0, 0.4),
        1.2 * Vec3::Z,
        2.0 * Vec3::X,
    );
    let lamp = Light::Spot {
        position: Vec3::new(0.0, 1.0, 1.0),
        direction: Vec3::NEG_Y,
        intensity: Vec3::splat(5.0),
        inner_deg: 15.0,
        outer_deg: 20.0,
    };
    let camera = Camera {
        eye: Vec3::new(0.0, 1.0, 3.0),
        target: Vec3::new(0.0, 1.0, 0.0),
        up: Vec3::Y,
        vfov_deg: 70.0,
    };
    builder.finish("two-walls", vec![lamp], Vec3::ZERO, camera)
}

#[test]
fn walls_that_only_the_camera_sees_block_layer_by_layer() {
    let gpu = gpu();
    let scene = two_walls();
    let grid = CellGrid::new(Vec3::new(-1.3, -0.3, -1.5), 0.2, UVec3::new(13, 13, 17));
    // Mean of all corners or cells of a part of a wall, or beyond it.
    let mean = |values: &[f64], size: UVec3, z: std::ops::Range<u32>| {
        let (mut sum, mut count) = (0.0, 0.0);
        for index in 0..size.element_product() {
            let place = UVec3::new(
                index % size.x,
                index / size.x % size.y,
                index / (size.x * size.y),
            );
            let is_wall = (4..=9).contains(&place.x) && (4..=9).contains(&place.y);
            if is_wall && z.contains(&place.z) {
                sum += values[index as usize];
                count += 1.0;
            }
        }
        sum / count
    };
    let [mut walls, mut lit] = [Vec::new(), Vec::new()];
    for layers in 0..=3 {
        let found = find_in(&gpu, &scene, grid, [64, 64], layers);
        let potential: Vec<f64> = found.potential().iter().map(|corner| corner.x).collect();
        // z = 0 is at corner 7.5, −0.8 at 3.5.
        let of_wall = |z| mean(&potential, grid.size + 1, z);
        walls.push([of_wall(7..9), of_wall(3..5)]);
        lit.push([
            mean(&found.light, grid.size, 5..7),
            mean(&found.light, grid.size, 0..3),
        ]);
    }
    println!("walls {walls:.3?}, light behind them {lit:?}");
    // Half of the corners have all of the wall, with A = h².
    let whole = 0.5 * 0.5 * std::f64::consts::PI.sqrt();
    for (layers, [near, far]) in walls.iter().enumerate() {
        for (wall, found) in [near, far].into_iter().enumerate() {
            let expected = if layers > wall { whole } else { 0.0 };
            assert!(
                (found - expected).abs() < 0.05,
                "{layers} layers: {walls:?}"
            );
        }
    }
    assert!(lit[0][1] > 0.0 && lit[1][0] < 0.6 * lit[0][0], "{lit:?}");
    assert!(lit[2][1] < 0.6 * lit[1][1], "{lit:?}");
    assert_eq!(lit[2], lit[3]);
}

/// Nothing in view, an eye on a surface and inside a block, and pictures of a pixel or two.
#[test]
fn camera_blockers_of_strange_views_are_the_oracles_or_none() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let looking = |eye: Vec3, along: Vec3| Scene {
        camera: Camera {
            eye,
            target: eye + along,
            ..scene.camera
        },
        ..scene.clone()
    };
    let away = looking(scene.camera.eye, scene.camera.eye - scene.camera.target);
    let (seen, _) = find_with(&gpu, &away, [32, 32], 4);
    let (of_lights, _) = find_with(&gpu, &away, [32, 32], 0);
    assert!(seen.bits.iter().any(|node| node[0] > 0));
    assert_eq!(seen.bits, of_lights.bits);
    assert_eq!(seen.light, of_lights.light);

    let corner = scene
        .vertices
        .iter()
        .map(|vertex| Vec3::from(vertex.position));
    let low = corner.fold(Vec3::INFINITY, Vec3::min);
    let on_floor = looking(Vec3::new(0.1, low.y, 0.2), Vec3::new(0.3, 0.0, -1.0));
    let in_block = looking(Vec3::new(0.33, 0.3, 0.35), Vec3::new(-0.3, 0.2, -1.0));
    for (name, strange) in [("on the floor", &on_floor), ("in a block", &in_block)] {
        let (found, _) = find_with(&gpu, strange, [48, 48], 4);
        assert!(found.potential().iter().all(|node| node.is_finite()));
        assert!(found.light.iter().copied().worst().is_finite(), "{name}");
    }
    check(&gpu, "in a block", &in_block, ([64, 64], 1, 4));
    for size in [[1, 1], [2, 1], [1, 3], [7, 5]] {
        check(&gpu, "few pixels", &scene, (size, 1, 1));
        check(&gpu, "few pixels", &scene, (size, 1, 4));
    }
}

/// Two runs of one scene are the same, bit by bit.
#[test]
fn camera_blockers_are_the_same_in_every_run() {
    let gpu = gpu();
    let (_, scene) = &lights()[0];
    let [first, second] = [(); 2].map(|()| find_with(&gpu, scene, [160, 100], 3).0);
    assert!(first.bits.iter().any(|node| node[0] > 0));
    assert_eq!(first.bits, second.bits);
    assert_eq!(first.light, second.light);
}

/// A camera that turns where it is changes the light where what it sees counts, and not elsewhere.
#[test]
fn light_depends_on_the_view_with_camera_layers_alone() {
    let gpu = gpu();
    let (_, mut scene) = lights().swap_remove(0);
    let grid = grid_of(&GpuScene::new(&gpu, &scene).unwrap(), 32);
    let camera = scene.camera;
    let mut lit_by = |layers: u32, degrees: f32| {
        let turn = Quat::from_rotation_y(degrees.to_radians());
        scene.camera.target = camera.eye + turn * (camera.target - camera.eye);
        find_in(&gpu, &scene, grid, [128, 128], layers).light
    };
    for layers in [0, 1, 2, 4] {
        let [ahead, aside, back] = [0.0, 40.0, 180.0].map(|degrees| lit_by(layers, degrees));
        let change = |turned: &[f64]| {
            let pairs = || ahead.iter().zip(turned);
            let sum: f64 = pairs().map(|(a, b)| (a - b).powi(2)).sum();
            let bias: f64 = pairs().map(|(a, b)| b - a).sum();
            let squares: f64 = ahead.iter().map(|a| a * a).sum();
            [(sum / squares).sqrt(), bias / ahead.iter().sum::<f64>()]
        };
        let [aside, back] = [change(&aside), change(&back)];
        println!("{layers} layers: rms and mean change {aside:.4?} at 40°, {back:.4?} at 180°");
        assert_eq!(aside[0] == 0.0, layers == 0, "{layers} layers");
    }
}

/// Techniques with blockers of lights alone, and of the camera too.
fn techniques() -> Vec<(&'static str, Settings)> {
    let settings = |technique: &'static str, pairs: &[&str]| {
        let entry = find(technique).unwrap();
        (technique, entry.settings(Some("textbook"), pairs).unwrap())
    };
    vec![
        settings("lpv", &["resolution=16"]),
        settings("lpv", &["resolution=16", "blocker_layers=3", "bounces=2"]),
        settings(
            "lpv-cascaded",
            &["resolution=16", "cell_size=0.03", "blocker_layers=2"],
        ),
    ]
}

/// What lights see is kept, and yet each frame is that of a renderer which has seen no other.
#[test]
fn kept_blockers_give_the_frames_of_a_new_renderer() {
    let gpu = gpu();
    let [(_, point), (_, spot), _] = small_lights();
    for (technique, settings) in techniques() {
        let mut scene = moving_room(Surfaces::Diffuse, point);
        scene.lights.push(spot);
        let entry = find(technique).unwrap();
        let new = |scene: &Scene| {
            Renderer::new(&gpu, scene, entry, &settings, frame(24, 16, 64))
                .unwrap()
                .0
        };
        let mut renderer = new(&scene);
        for step in 0..7 {
            match step {
                1 | 5 => scene.camera.eye += Vec3::new(0.3, 0.1, -0.2),
                2 | 6 => {
                    scene.set_time(0.2 * step as f32);
                    renderer.set_pose(&scene).unwrap();
                }
                3 => {
                    if let Light::Point { position, .. } = &mut scene.lights[0] {
                        *position -= Vec3::new(0.2, 0.3, 0.1);
                    }
                    renderer.move_lights(&scene).unwrap();
                }
                _ => {}
            }
            gpu.take_journal();
            renderer.render(&scene.camera).unwrap();
            let ran = passes(&gpu);
            let count = |name: &str| ran.iter().filter(|pass| **pass == name).count();
            if step == 4 {
                assert_eq!(count("lpv.geometry"), 0, "nothing has changed: {ran:?}");
                assert!(count("lpv.propagate") > 0, "{ran:?}");
            } else if [0, 2, 3, 6].contains(&step) {
                assert!(count("lpv.geometry") > 0, "{step}: {ran:?}");
            }
            let mut fresh = new(&scene);
            fresh.render(&scene.camera).unwrap();
            let [kept, fresh] =
                [&renderer, &fresh].map(|renderer| renderer.aov(Aov::Diffuse).unwrap());
            assert!(fresh.pixels.iter().any(|pixel| pixel.y > 0.0));
            assert_eq!(kept, fresh, "{technique}, step {step}");
        }
    }
}

/// Names of the passes that have run since the last time.
fn passes(gpu: &Gpu) -> Vec<&'static str> {
    let journal = gpu.take_journal();
    let issued = journal.iter().flat_map(|frame| &frame.issued);
    issued
        .filter_map(|issued| match issued {
            Issued::Pass { pass, .. } => Some(pass.name),
            _ => None,
        })
        .collect()
}

/// A smaller picture may be peeled at more pixels than a larger one.
#[test]
fn layers_of_smaller_pictures_are_those_of_their_size() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let entry = find("lpv").unwrap();
    let settings = entry
        .settings(Some("textbook"), &["resolution=16", "blocker_layers=2"])
        .unwrap();
    let of_size = |width: u32| {
        let size = frame(width, 24, 64);
        Renderer::new(&gpu, &scene, entry, &settings, size)
            .unwrap()
            .0
    };
    let mut renderer = of_size(700);
    renderer.render(&scene.camera).unwrap();
    for width in [500, 700] {
        renderer.set_size([width, 24]);
        renderer.render(&scene.camera).unwrap();
        let mut own = of_size(width);
        own.render(&scene.camera).unwrap();
        let [kept, own] = [&renderer, &own].map(|renderer| renderer.aov(Aov::Diffuse).unwrap());
        assert_eq!(kept, own, "{width} px");
    }
}
