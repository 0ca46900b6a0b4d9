//! Ambient visibility by horizons in the picture, against its oracle on the same depths.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::gtao::oracle::{Depths, Search};
use lumivox::gi::gtao::{ENTRY, GATHER};
use lumivox::gi::shared::interleave::Pattern;
use lumivox::gi::shared::interleave::oracle::interleaved_offset;
use lumivox::gi::shared::voxel::VoxelGrid;
use lumivox::render::GpuScene;
use lumivox::scene::{Camera, Environment, Scene};

use crate::support::gather::View;
use crate::support::scenes::bundled;
use crate::support::technique::frame;
use crate::support::{Random, gpu};

const SIZE: [u32; 2] = [56, 40];

/// Largest difference of a pixel's visibility. Samples are the middles of pixels: where one of them
/// falls on the border of two, the device may take the other, which moves one of few horizons.
const MOST: f64 = 0.1;

/// Mean difference; 4.7·10⁻⁵ at most was measured.
const MOST_ON_AVERAGE: f64 = 3e-4;

fn looking(random: &mut Random, scene: &Scene) -> Camera {
    let mut vector = |size: f32| {
        Vec3::new(
            random.unit() - 0.5,
            random.unit() - 0.5,
            random.unit() - 0.5,
        ) * size
    };
    Camera {
        // Cameras of rooms stand at a wall.
        eye: scene.camera.eye.lerp(scene.camera.target, 0.15) + vector(0.2),
        target: scene.camera.target + vector(0.5),
        up: Vec3::Y + vector(0.8),
        ..scene.camera
    }
}

/// What the picture's depths are, and where its camera stands.
fn depths(gpu: &lumivox::graph::Gpu, scene: &GpuScene, view: &View, camera: &Camera) -> Depths {
    let constants = scene.frame_constants(camera, SIZE);
    let xyz = |row: [f32; 4]| DVec3::from_array([0, 1, 2].map(|axis| row[axis].into()));
    let bytes = gpu.read_image(&view.gbuffer.view_depth, 0, 0).unwrap();
    Depths {
        size: SIZE,
        depths_m: bytemuck::pod_collect_to_vec(&bytes),
        eye: xyz(constants.eye_ws),
        right: xyz(constants.ray_right),
        up: xyz(constants.ray_up),
        forward: xyz(constants.ray_forward),
    }
}

#[test]
fn horizons_are_the_oracles() {
    let gpu = gpu();
    let mut random = Random::new(61);
    for (round, name) in (0u32..).zip(["cornell", "two-rooms,door=1", "lit-sphere", "pergola"]) {
        let mut scene = bundled(name);
        scene.environment = Environment::from(Vec3::new(0.3, 0.5, 0.9));
        scene.camera = looking(&mut random, &scene);
        let mut number = |least: f32, most: f32| least + (most - least) * random.unit();
        let pairs = [
            format!("slices={}", 1 + number(0.0, 6.0) as u32),
            format!("slice_steps={}", 2 + number(0.0, 14.0) as u32),
            format!(
                "occlusion_distance={}",
                [0.0, number(0.2, 1.5)][round as usize % 2]
            ),
            format!(
                "occlusion_falloff={}",
                [number(0.1, 2.0), 0.0][round as usize / 2]
            ),
            format!(
                "thin_occluders={}",
                [0.0, number(0.0, 0.2)][round as usize % 2]
            ),
            format!("interleave={}", 2 + round),
            "interleave_window=off".to_owned(),
            format!("light={}", ["sky", "none"][round as usize % 2]),
        ];
        let settings = ENTRY.settings(None, &pairs).unwrap();
        let (mut renderer, _) =
            Renderer::new(&gpu, &scene, &ENTRY, &settings, frame(SIZE[0], SIZE[1], 64)).unwrap();
        renderer.render(&scene.camera).unwrap();
        let light = renderer.indirect_light().unwrap();
        let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
        // Receivers are where they are in a grid; their normals are what counts.
        let grid = VoxelGrid::around(gpu_scene.bounds, 8);
        let view = View::new(&gpu, &gpu_scene, &scene.camera, SIZE, &grid);
        let depths = depths(&gpu, &gpu_scene, &view, &scene.camera);
        let search = Search {
            slices: settings.count("slices"),
            steps: settings.count("slice_steps"),
            distance: settings.number("occlusion_distance").into(),
            falloff: settings.number("occlusion_falloff").into(),
            thin: settings.number("thin_occluders").into(),
        };
        let pattern = Pattern::new(&settings);
        let (mut sum, mut worst, mut hidden) = (0.0, 0.0f64, 0.0);
        for (pixel, receiver) in &view.receivers {
            let turned = interleaved_offset(*pixel, pattern, 0);
            let expected = depths.visibility(*pixel, receiver.shading_normal, &search, turned);
            let at = (pixel[0] + SIZE[0] * pixel[1]) as usize;
            let found = f64::from(light.visibility[at]);
            let off = (found - expected).abs();
            (sum, hidden) = (sum + off, hidden + 1.0 - expected);
            worst = worst.max(off);
            let irradiance = light.irradiance.pixels[at].as_dvec3();
            let sky = f64::from(u8::from(settings.is("light", "sky")));
            let sent = sky * PI * found * scene.environment.uniform().as_dvec3();
            assert!(
                (irradiance - sent).length() < 1e-5,
                "{name}: {irradiance}, {sent}"
            );
        }
        let count = view.receivers.len() as f64;
        println!("{name}: mean error {:.1e}, worst {worst:.1e}", sum / count);
        assert!(
            count > 400.0 && hidden / count > 0.02,
            "{name}: {count}, {hidden}"
        );
        assert!(
            sum / count < MOST_ON_AVERAGE && worst < MOST,
            "{name}, {pairs:?}: on average {}, at most {worst}",
            sum / count
        );
    }
}

/// A frame is the picture, this pass and the means over tiles: there is nothing in the world.
#[test]
fn there_is_one_pass_and_no_store() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let settings = ENTRY.settings::<&str>(None, &[]).unwrap();
    let (mut renderer, built) =
        Renderer::new(&gpu, &scene, &ENTRY, &settings, frame(SIZE[0], SIZE[1], 64)).unwrap();
    let stats = renderer.render(&scene.camera).unwrap();
    assert!(built.passes.is_empty());
    let own = stats
        .passes
        .iter()
        .filter(|pass| pass.name.starts_with("gtao."));
    assert_eq!(
        own.map(|pass| pass.name.as_str()).collect::<Vec<_>>(),
        [GATHER.name]
    );
}
