//! Light in images of half the bits.

use crate::support::technique::{Case, Surfaces, TINY, cases, frame, small_lights, small_room};
use crate::support::{gpu, own_gpu};
use lumivox::frame::Renderer;
use lumivox::graph::{Gpu, GpuOptions, ScreenFormat};
use lumivox::image::{Aov, Image};
use lumivox::scene::{Camera, Scene};

/// Images that hold all light of the screen: what a frame shows, and what it is made of.
const SHOWN: [Aov; 4] = [Aov::Full, Aov::Direct, Aov::Diffuse, Aov::Specular];

/// Pictures of the third frame of a camera that moves, and bytes of images of the screen's light.
fn rendered(gpu: &Gpu, case: &Case, scene: &Scene) -> (Vec<Image>, u64) {
    let settings = case.settings(TINY);
    let (mut renderer, _) =
        Renderer::new(gpu, scene, case.entry, &settings, frame(72, 40, 64)).unwrap();
    for step in 0..3u8 {
        let along = 0.02 * f32::from(step);
        renderer
            .render(&Camera {
                eye: scene.camera.eye + along,
                target: scene.camera.target + along,
                ..scene.camera
            })
            .unwrap();
    }
    let pictures = SHOWN.map(|aov| renderer.aov(aov).unwrap());
    let outputs = |(name, bytes): &(String, u64)| name.starts_with("output.").then_some(*bytes);
    let bytes = gpu.memory().iter().filter_map(outputs).sum();
    (pictures.to_vec(), bytes)
}

/// Of each technique the default, and presets that gather, filter and mirror in other ways.
fn chosen_cases() -> Vec<Case> {
    let mut cases = cases();
    cases.retain(|case| {
        let named = |names: &[&str]| case.preset.is_some_and(|preset| names.contains(&preset));
        match case.entry.name {
            "voxel-mips" => true,
            "svo" | "clipmap" => named(&["accurate", "cones"]),
            _ => named(&["default", "accurate", "balanced", "glossy", "textbook"]),
        }
    });
    cases
}

/// Root of the mean squared difference over the mean, over all channels.
fn relative_difference(of: &Image, from: &Image) -> f64 {
    let (mut squares, mut sum) = (0.0, 0.0);
    for (a, b) in of.pixels.iter().zip(&from.pixels) {
        squares += f64::from((*a - *b).length_squared());
        sum += f64::from(b.length_squared());
    }
    (squares / sum.max(1e-12)).sqrt()
}

/// A number of 11 bits is off by 2⁻¹² at most, and light is rounded a few times on its way. Where
/// light of frames before is blurred by how much it differs, a little more comes of it.
#[test]
fn light_of_half_the_bits_is_nearly_the_same() {
    let mut scene = small_room(Surfaces::Glossy, Vec::new());
    scene.lights = small_lights().map(|(_, light)| light).to_vec();
    let exact = gpu();
    let half = own_gpu(&GpuOptions {
        screen_format: ScreenFormat::Float16,
        ..GpuOptions::default()
    });
    for case in chosen_cases() {
        let (expected, full_bytes) = rendered(&exact, &case, &scene);
        let (pictures, half_bytes) = rendered(&half, &case, &scene);
        let differences = [0, 1, 2, 3].map(|at| relative_difference(&pictures[at], &expected[at]));
        println!(
            "{}: {differences:.5?}, {half_bytes} of {full_bytes} bytes",
            case.name()
        );
        assert!(2 * half_bytes <= full_bytes + 4096, "{}", case.name());
        assert!(differences[0] > 0.0, "{}: nothing was rounded", case.name());
        for (aov, difference) in SHOWN.iter().zip(differences) {
            assert!(
                difference < 2e-3,
                "{} {}: {difference}",
                case.name(),
                aov.name()
            );
        }
    }
}
