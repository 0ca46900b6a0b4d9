//! No shader reads or writes outside of its buffers: the validation layer checks every access on
//! the device. A software driver clamps them silently, so nothing else would show one. Images it
//! does not check.

use crate::support::passes::DOUBLE;
use crate::support::technique::{
    Surfaces, default_cases, frame, is_sound, moving_room, small_lights,
};
use crate::support::voxels::{raster_methods, voxel_settings, voxelize};
use crate::support::{Missing, ValidatedGpu, gpu, own_gpu, skipped, words};
use glam::Vec3;
use lumivox::frame::Renderer;
use lumivox::gi::shared::voxel::Method;
use lumivox::graph::{Frame, Gpu, GpuOptions};
use lumivox::image::Aov;
use lumivox::render::GpuScene;
use lumivox::scene::{Camera, Scene};

/// `None` without 64-bit integers in shaders: the layer needs them for what it counts.
fn checking_gpu() -> Option<ValidatedGpu> {
    if !gpu().features().shader_int64 {
        skipped(&Missing::Other("the check of every access: no shaderInt64"));
        return None;
    }
    Some(own_gpu(&GpuOptions {
        check_accesses: true,
        ..GpuOptions::default()
    }))
}

/// Doubles `count` words of a buffer of 64, and takes what the layer says.
fn double(gpu: &Gpu, count: u32) -> Vec<String> {
    let values = words(gpu, "values", &[1; 64]);
    let mut frame = Frame::new();
    frame
        .pass(&DOUBLE)
        .bind("values", &values)
        .constant("WORKGROUP", 64u32)
        .push(&count)
        .dispatch([2, 1, 1]);
    gpu.submit(frame).unwrap();
    gpu.messages().take()
}

/// The layer sees the first word behind a buffer, and says nothing of the last one in it.
#[test]
fn an_access_outside_of_a_buffer_is_reported() {
    let Some(gpu) = checking_gpu() else { return };
    assert_eq!(double(&gpu, 64), Vec::<String>::new());
    let messages = double(&gpu, 65);
    assert!(
        messages
            .iter()
            .any(|message| message.contains("highest byte accessed was 259")),
        "{messages:?}"
    );
}

/// Fragments are counted before there is room for any: of masked triangles and of others, by both
/// methods.
#[test]
fn voxelization_stays_within_its_buffers() {
    let Some(gpu) = checking_gpu() else { return };
    let scene = GpuScene::new(&gpu, &masked_and_emissive()).unwrap();
    for method in [vec![Method::Compute], raster_methods(&gpu)].concat() {
        let voxels = voxelize(&gpu, &scene, voxel_settings(16, method)).voxels;
        assert!(
            voxels.fragment_count > 1000,
            "{} fragments",
            voxels.fragment_count
        );
        assert_eq!(
            gpu.validation_messages(),
            Vec::<String>::new(),
            "{method:?}"
        );
    }
}

/// A room with a mask, emission and a model that moves.
fn masked_and_emissive() -> Scene {
    let [(_, point), ..] = small_lights();
    let mut scene = moving_room(Surfaces::Masked, point);
    scene.materials.last_mut().unwrap().emission = Vec3::new(1.0, 2.0, 4.0);
    scene
}

/// The default preset of every technique, on a scene with a mask and emission, while its camera and
/// a model move. What takes the time is making the pipelines.
#[test]
fn no_technique_reads_or_writes_outside_of_its_buffers() {
    let Some(gpu) = checking_gpu() else { return };
    let mut scene = masked_and_emissive();
    let here = scene.camera;
    for case in default_cases() {
        let settings = case.settings(&[("resolution", case.smallest_resolution())]);
        let (mut renderer, _) =
            Renderer::new(&gpu, &scene, case.entry, &settings, frame(8, 6, 16)).unwrap();
        for (time_s, step_m) in [(0.0, 0.0), (0.7, 0.9), (1.4, -0.4)] {
            scene.set_time(time_s);
            renderer.set_pose(&scene).unwrap();
            renderer
                .render(&Camera {
                    eye: here.eye - Vec3::new(step_m, 0.0, step_m),
                    ..here
                })
                .unwrap();
            assert_eq!(
                gpu.validation_messages(),
                Vec::<String>::new(),
                "{}, {time_s} s",
                case.name()
            );
        }
        assert!(
            is_sound(&renderer.aov(Aov::Full).unwrap()),
            "{}",
            case.name()
        );
    }
}
