//! A clipmap along a camera's walk: memory, flicker, and what is seen of levels that follow.

use crate::support::scenes::bundled;
use crate::support::technique::{Surfaces, frame, shared_scene, small_lights, small_room, walked};
use crate::support::{ValidatedGpu, gpu};
use glam::Vec3;
use lumivox::frame::Renderer;
use lumivox::gi::registry;
use lumivox::gi::registry::find;
use lumivox::gi::shared::interleave::{Pattern, deinterleave};
use lumivox::gi::shared::surfaces::Limits;
use lumivox::gi::shared::voxel::VoxelGrid;
use lumivox::gi::voxel_cones::VoxelCones;
use lumivox::gi::voxel_cones::clipmap::{self, Clipmap, Layout};
use lumivox::gi::{Change, Context, Inputs, MapNeeds, Settings, Technique};
use lumivox::graph::{Frame, Gpu, Image as GpuImage};
use lumivox::image::{Aov, Image};
use lumivox::metrics::stability::{flicker, translation_spread};
use lumivox::render::{Follows, GBuffer, GpuScene, LightMaps, Output, screen_image};
use lumivox::scene::{Camera, Light, Scene, Triangle, Vertex};
use std::sync::Arc;

const SIZE: [u32; 2] = [48, 36];

/// Voxels along an edge of the dense grid that the clipmap is held against.
const DENSE: u32 = 64;

/// A dense grid, and a clipmap whose finest voxels are as large (m) but reach only half as far.
fn equals(bounds: (Vec3, Vec3), pairs: &[&str]) -> [(&'static str, Settings); 2] {
    let voxel_size = format!("voxel_size={}", VoxelGrid::around(bounds, DENSE).voxel_size);
    let dense = [&["resolution=64"], pairs].concat();
    let nested = [&["resolution=32", "levels=3", &voxel_size], pairs].concat();
    [("voxel-mips", dense), ("clipmap", nested)].map(|(name, pairs)| {
        (
            name,
            find(name).unwrap().settings(Some("cones"), &pairs).unwrap(),
        )
    })
}

/// The atrium, and Sponza where it is there.
fn scenes() -> Vec<Scene> {
    [
        Some(bundled("atrium")),
        shared_scene("sponza_dabrovic.toml"),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Round and round through a room, 400 frames: once each buffer has met the most that a lap has, no
/// byte is added; validation is silent.
#[test]
fn memory_is_constant_from_lap_to_lap() {
    const LAP: u32 = 100;
    let gpu = gpu();
    let scene = small_room(Surfaces::Emissive, vec![small_lights()[1].1]);
    let settings = clipmap::ENTRY
        .settings(
            Some("cones"),
            &["resolution=16", "levels=4", "voxel_size=0.03"],
        )
        .unwrap();
    let (mut renderer, _) =
        Renderer::new(&gpu, &scene, &clipmap::ENTRY, &settings, frame(8, 8, 32)).unwrap();
    let mut bytes = Vec::new();
    for step in 0..4 * LAP {
        if step % LAP == 0 {
            bytes.push(gpu.memory_total());
        }
        let angle = (step % LAP) as f32 * std::f32::consts::TAU / LAP as f32;
        let shift = Vec3::new(
            angle.cos(),
            0.5 * angle.sin(),
            0.8 * (2.0 * angle).sin() - 3.4,
        );
        renderer
            .render(&Camera {
                eye: scene.camera.eye + shift,
                target: scene.camera.target + shift,
                ..scene.camera
            })
            .unwrap();
    }
    bytes.push(gpu.memory_total());
    println!("bytes before each lap: {bytes:?}");
    assert!(
        bytes[0] < bytes[1] && bytes[1..].iter().all(|lap| *lap == bytes[1]),
        "{bytes:?}"
    );
}

/// The scene moved by a share of a voxel in each direction, in a grid that stays: two specks hold
/// the bounds.
fn moved(scene: &Scene, voxel_size: f32, share: f32) -> Scene {
    let mut moved = scene.clone();
    let (low, high) = scene.bounds().unwrap();
    let shift = Vec3::splat(share * voxel_size);
    moved
        .vertices
        .iter_mut()
        .for_each(|vertex| vertex.position = (Vec3::from(vertex.position) + shift).to_array());
    for light in &mut moved.lights {
        if let Light::Point { position, .. } | Light::Spot { position, .. } = light {
            *position += shift;
        }
    }
    moved.camera = Camera {
        eye: scene.camera.eye + shift,
        target: scene.camera.target + shift,
        ..scene.camera
    };
    let material = moved.triangles.last().unwrap().material;
    for (corner, inwards) in [(low - voxel_size, 1.0), (high + 2.0 * voxel_size, -1.0)] {
        let first = moved.vertices.len() as u32;
        for edge in [Vec3::ZERO, Vec3::X, Vec3::Y] {
            let position = corner + inwards * 1e-3 * voxel_size * edge;
            moved.vertices.push(Vertex {
                position: position.to_array(),
                u: 0.0,
                normal: [0.0, 0.0, 1.0],
                v: 0.0,
            });
        }
        moved.triangles.push(Triangle {
            vertices: [first, first + 1, first + 2],
            material,
        });
        moved.models.last_mut().unwrap().triangle_count += 1;
    }
    moved
}

fn indirect(gpu: &Gpu, scene: &Scene, technique: &str, settings: &Settings) -> Image {
    let (mut renderer, _) = Renderer::new(
        gpu,
        scene,
        find(technique).unwrap(),
        settings,
        frame(SIZE[0], SIZE[1], 256),
    )
    .unwrap();
    renderer.render(&scene.camera).unwrap();
    renderer.aov(Aov::Indirect).unwrap()
}

/// A scene that moves through its voxels by sixteenths of one changes no more through a clipmap
/// than 1.5 times what it does through a dense grid.
#[test]
fn scenes_may_move_through_their_voxels() {
    let gpu = gpu();
    for scene in scenes() {
        let bounds = moved(
            &scene,
            VoxelGrid::around(scene.bounds().unwrap(), DENSE).voxel_size,
            0.0,
        )
        .bounds()
        .unwrap();
        let voxel_size = VoxelGrid::around(bounds, DENSE).voxel_size;
        let [dense, nested] = equals(bounds, &[]).map(|(technique, settings)| {
            let images: Vec<Image> = (0u8..16)
                .map(|step| {
                    indirect(
                        &gpu,
                        &moved(&scene, voxel_size, f32::from(step) / 16.0),
                        technique,
                        &settings,
                    )
                })
                .collect();
            translation_spread(&images).unwrap()
        });
        println!(
            "{}: translation_spread {dense:.4} of dense voxels, {nested:.4} of a clipmap",
            scene.name
        );
        assert!(
            dense > 0.0 && nested <= 1.5 * dense,
            "{}: {nested} against {dense}",
            scene.name
        );
    }
}

/// 48 frames of a camera that walks half a voxel each, there and back: no more than 1.5 times the
/// flicker of a dense grid.
#[test]
fn a_walk_flickers_no_more_than_through_a_dense_grid() {
    let gpu = gpu();
    for scene in scenes() {
        let bounds = scene.bounds().unwrap();
        let step_m = 0.5 * VoxelGrid::around(bounds, DENSE).voxel_size;
        let [dense, nested] = equals(bounds, &[]).map(|(technique, settings)| {
            let (mut renderer, _) = Renderer::new(
                &gpu,
                &scene,
                find(technique).unwrap(),
                &settings,
                frame(SIZE[0], SIZE[1], 256),
            )
            .unwrap();
            let picture = |step: u8| {
                renderer
                    .render(&walked(
                        &scene.camera,
                        step_m * f32::from(step.min(48 - step)),
                    ))
                    .unwrap();
                renderer.aov(Aov::Indirect).unwrap()
            };
            flicker(&(0..48).map(picture).collect::<Vec<_>>()).unwrap()
        });
        println!(
            "{}: flicker {dense:.4} of dense voxels, {nested:.4} of a clipmap",
            scene.name
        );
        assert!(
            nested <= 1.5 * dense,
            "{}: {nested} against {dense}",
            scene.name
        );
    }
}

/// One picture of a clipmap whose levels are where they are for another place of the camera.
struct Still<'g> {
    gpu: &'g ValidatedGpu,
    gpu_scene: GpuScene,
    maps: LightMaps,
    gbuffer: GBuffer,
    output: Output,
    light: Arc<GpuImage>,
    windowed: Arc<GpuImage>,
    window: (Pattern, Limits),
    technique: VoxelCones<Clipmap>,
}

impl<'g> Still<'g> {
    fn new(gpu: &'g ValidatedGpu, scene: &Scene, settings: &Settings) -> Self {
        let gpu_scene = GpuScene::new(gpu, scene).unwrap();
        let context = Context {
            gpu,
            scene: &gpu_scene,
            size: SIZE,
            eye: scene.camera.eye,
            lend: registry::lend,
        };
        let mut technique = VoxelCones::<Clipmap>::new(&context, settings, "clipmap").unwrap();
        technique.build(&context).unwrap();
        let maps = LightMaps::new(
            gpu,
            &gpu_scene,
            256,
            technique.needs().maps == MapNeeds::Reflective,
        )
        .unwrap();
        let gbuffer = GBuffer::new(gpu, &gpu_scene, SIZE, Follows::Nothing).unwrap();
        Still {
            gpu,
            gpu_scene,
            maps,
            gbuffer,
            output: Output::new(gpu, SIZE).unwrap(),
            light: screen_image(gpu, "light", SIZE).unwrap(),
            windowed: screen_image(gpu, "windowed", SIZE).unwrap(),
            window: (Pattern::new(settings), Limits::new(settings)),
            technique,
        }
    }

    /// Irradiance (W/m², green) of each pixel that `camera` sees, with levels for a camera at
    /// `eye`.
    fn irradiance(&mut self, camera: &Camera, eye: Vec3) -> Vec<f32> {
        let Still {
            gpu,
            gpu_scene,
            maps,
            gbuffer,
            output,
            light,
            windowed,
            window,
            technique,
        } = self;
        gpu_scene
            .set_frame(gpu, &gpu_scene.frame_constants(camera, SIZE))
            .unwrap();
        let context = Context {
            gpu,
            scene: gpu_scene,
            size: SIZE,
            eye,
            lend: registry::lend,
        };
        technique.follow(&context, Change::Camera).unwrap();
        let mut frame = Frame::new();
        frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
        maps.draw(&mut frame, gpu_scene);
        gbuffer.draw(&mut frame, gpu_scene);
        let given = Inputs {
            scene: gpu_scene,
            maps,
            rsm: maps,
            gbuffer,
            direct: &output.direct,
            is_still: true,
        };
        technique.update(&mut frame, &given);
        let receivers = gbuffer.receivers(gpu_scene, light);
        technique.gather(&mut frame, &given, &receivers);
        deinterleave(&mut frame, &receivers, windowed, *window);
        gpu.submit(frame).unwrap();
        bytemuck::pod_collect_to_vec::<u8, [f32; 4]>(&gpu.read_image(windowed, 0, 0).unwrap())
            .into_iter()
            .map(|texel| texel[1])
            .collect()
    }
}

/// Each time that a level moves on, as the camera crosses from one block to the next, or its texels
/// are mixed anew, as it crosses from one voxel to the next, the light of a picture that stands
/// still hardly changes: no pixel that is not nearly dark by more than 2%.
#[test]
fn levels_move_unseen() {
    let gpu = gpu();
    let scenes = scenes();
    for (scene, resolution) in scenes
        .iter()
        .map(|scene| (scene, 64))
        .chain([(&scenes[0], 128)])
    {
        let pairs = [&format!("resolution={resolution}"), "levels=3"];
        let settings = clipmap::ENTRY.settings(Some("cones"), &pairs).unwrap();
        let mut still = Still::new(&gpu, scene, &settings);
        let layout = Layout::new(still.gpu_scene.bounds, resolution, 3, 0.0);
        let state = |way: f32| {
            layout
                .places(walked(&scene.camera, way).eye)
                .into_iter()
                .map(|place| (place.first, layout.inner(place)))
                .collect::<Vec<_>>()
        };
        let (mut way, mut moves, mut updates, mut changes) = (0.0f32, 0, 0, Vec::new());
        while moves < 5 {
            way += 0.05 * layout.voxel_size;
            let before = way - 0.05 * layout.voxel_size;
            let [old, new] = [before, way].map(state);
            if old == new {
                continue;
            }
            // Light also changes with the distance from the camera, at which levels fade: next to
            // where it happens, that is nothing.
            let (mut before, mut way_after) = (before, way);
            for _ in 0..7 {
                let middle = 0.5 * (before + way_after);
                if state(middle) == old {
                    before = middle
                } else {
                    way_after = middle
                }
            }
            updates += 1;
            moves += u32::from(old.iter().zip(&new).any(|(old, new)| old.0 != new.0));
            let camera = walked(&scene.camera, way);
            let [a, b] = [before, way_after]
                .map(|way| still.irradiance(&camera, walked(&scene.camera, way).eye));
            let mean = a.iter().sum::<f32>() / a.len() as f32;
            changes.extend(
                a.iter()
                    .zip(&b)
                    .map(|(a, b)| (b - a).abs() / a.max(0.05 * mean)),
            );
        }
        changes.sort_by(f32::total_cmp);
        let share = |share: f32| changes[((changes.len() - 1) as f32 * share) as usize];
        let [half, most, nearly, all] = [0.5, 0.99, 0.999, 1.0].map(share);
        println!(
            "{} at {resolution}³: {updates} updates, {moves} of them moves, change of a pixel: \
             median {half:.5}, 99% {most:.5}, 99.9% {nearly:.5}, largest {all:.5}",
            scene.name
        );
        assert!(all <= 0.02, "{}: {all}", scene.name);
    }
}

/// Half a kilometre with voxels of 5 cm near the camera takes less than 1 GiB; of the dense grid,
/// even with coarser ones, the refusal states the bytes.
#[test]
fn a_long_street_is_in_reach() {
    let gpu = gpu();
    let scene = bundled("street,length_m=500");
    let settings = clipmap::ENTRY
        .settings(
            Some("cones"),
            &["resolution=128", "levels=7", "voxel_size=0.05"],
        )
        .unwrap();
    let (mut renderer, _) = Renderer::new(
        &gpu,
        &scene,
        &clipmap::ENTRY,
        &settings,
        frame(SIZE[0], SIZE[1], 256),
    )
    .unwrap();
    renderer.render(&scene.camera).unwrap();
    let mib = gpu.memory_total() >> 20;
    println!("{mib} MiB");
    assert!(
        mib < 1024
            && renderer
                .aov(Aov::Indirect)
                .unwrap()
                .pixels
                .iter()
                .any(|pixel| pixel.y > 0.0),
        "{mib} MiB"
    );
    drop(renderer);
    let dense = find("voxel-mips").unwrap();
    let settings = dense.settings(Some("cones"), &["resolution=2048"]).unwrap();
    let refusal = Renderer::new(&gpu, &scene, dense, &settings, frame(SIZE[0], SIZE[1], 256))
        .err()
        .unwrap()
        .to_string();
    assert!(refusal.contains("78536546048 bytes"), "{refusal}");
}
