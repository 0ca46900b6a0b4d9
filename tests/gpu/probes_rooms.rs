//! Closed rooms beside each other, light in one of them: none comes to the other, wherever probes
//! stand and whichever way walls face.

use glam::Vec3;
use lumivox::frame::Renderer;
use lumivox::gi::probes::irradiance::ENTRY;
use lumivox::graph::Gpu;
use lumivox::image::Aov;
use lumivox::reference::{self, Bounces, Filter, Sampling};
use lumivox::scene::{Camera, Light, Material, Scene, Triangle, Vertex};

use crate::support::compare::{Largest, Worst};
use crate::support::gpu;
use crate::support::scenes::bundled;
use crate::support::technique::{block_errors, frame};

const SIZE: [u32; 2] = [48, 48];

/// Height and depth of rooms, and the width of the lit one (m).
const EDGE: f32 = 2.0;

/// Appends a rectangle; `normal` is that of its front.
pub(crate) fn add_rectangle(scene: &mut Scene, corner: Vec3, [u, v]: [Vec3; 2], normal: Vec3) {
    let first = scene.vertices.len() as u32;
    for place in [corner, corner + u, corner + u + v, corner + v] {
        scene.vertices.push(Vertex {
            position: place.to_array(),
            u: 0.0,
            normal: normal.to_array(),
            v: 0.0,
        });
    }
    let is_ahead = u.cross(v).dot(normal) > 0.0;
    for [a, b] in [[1, 2], [2, 3]] {
        let [a, b] = if is_ahead { [a, b] } else { [b, a] };
        scene.triangles.push(Triangle {
            vertices: [first, first + a, first + b],
            material: 0,
        });
    }
}

/// Appends a closed box whose front is inside, or outside.
pub(crate) fn add_box(scene: &mut Scene, low: Vec3, high: Vec3, is_flipped: bool) {
    let size = high - low;
    for axis in 0..3 {
        let normal = Vec3::AXES[axis];
        let [u, v] = [1, 2].map(|step| size * Vec3::AXES[(axis + step) % 3]);
        let side = if is_flipped { -1.0 } else { 1.0 };
        add_rectangle(scene, low, [u, v], side * normal);
        add_rectangle(scene, low + size * normal, [u, v], -side * normal);
    }
}

/// Two rooms with a wall (m) between them, one sheet where it has no thickness. The dark one is
/// `stretch` (m) longer, which moves the lattice along the wall's normal.
fn two_rooms(wall: f32, stretch: f32, is_flipped: bool) -> Scene {
    let mut scene = Scene {
        name: format!("wall {wall} m, stretched {stretch} m, flipped {is_flipped}"),
        ..Scene::default()
    };
    scene.materials.push(Material {
        albedo: Vec3::splat(0.7),
        ..Material::default()
    });
    let far = Vec3::new(2.0 * EDGE + wall + stretch, EDGE, EDGE);
    if wall > 0.0 {
        add_box(&mut scene, Vec3::ZERO, Vec3::splat(EDGE), is_flipped);
        add_box(&mut scene, Vec3::X * (EDGE + wall), far, is_flipped);
    } else {
        add_box(&mut scene, Vec3::ZERO, far, is_flipped);
        let sheet = [EDGE * Vec3::Y, EDGE * Vec3::Z];
        let side = if is_flipped { -1.0 } else { 1.0 };
        add_rectangle(&mut scene, EDGE * Vec3::X, sheet, side * Vec3::X);
    }
    scene.lights.push(Light::Point {
        position: Vec3::new(0.9, 1.4, 1.1),
        intensity: Vec3::splat(5.0),
    });
    scene.camera = Camera {
        eye: far - Vec3::new(0.3, 0.6, 0.4),
        target: Vec3::new(EDGE + wall, 0.8, 0.9),
        vfov_deg: 80.0,
        ..scene.camera
    };
    scene
}

/// Mean irradiance (W/m²) in the lit room, and in the dark one, and the largest there.
fn light_in_rooms(gpu: &Gpu, scene: &Scene, (preset, pairs): (&str, &[&str])) -> [f64; 3] {
    let pairs: Vec<String> = pairs.iter().map(|pair| (*pair).into()).collect();
    let settings = ENTRY.settings(Some(preset), &pairs).unwrap();
    let of = frame(SIZE[0], SIZE[1], 64);
    let (mut renderer, _) = Renderer::new(gpu, scene, &ENTRY, &settings, of).unwrap();
    let lit = Camera {
        eye: Vec3::new(0.3, 1.4, 0.4),
        target: Vec3::new(EDGE, 0.8, 0.9),
        ..scene.camera
    };
    let mut seen_by = |camera: &Camera| {
        renderer.render(camera).unwrap();
        let light = renderer.indirect_light().unwrap().irradiance;
        let all = light.pixels.iter().map(|light| light.as_dvec3().largest());
        let all: Vec<f64> = all.collect();
        let most = all.iter().copied().worst();
        [all.iter().sum::<f64>() / all.len() as f64, most]
    };
    let [lit, _] = seen_by(&lit);
    let [dark, most] = seen_by(&scene.camera);
    assert!(lit > 0.1, "{}: the lit room has {lit} W/m²", scene.name);
    [lit, dark / lit, most / lit]
}

/// Presets with settings, and the largest share of light that may come to one place through a thin
/// wall: maps of distances blur its edges, rays do not.
const WAYS: [((&str, &[&str]), f64); 4] = [
    (("default", &["probes=9"]), 0.4),
    (("default", &["probes=9", "placement=lattice"]), 0.4),
    (("textbook", &["probes=9"]), 0.4),
    (("default", &["probes=9", "visibility=rays"]), 0.002),
];

#[test]
fn closed_rooms_keep_their_light() {
    let gpu = gpu();
    for (wall, mean) in [(0.2, 0.002), (0.02, 0.002), (0.0, 0.005)] {
        for step in 0..4u8 {
            let scene = two_rooms(wall, 0.05 + 0.12 * f32::from(step), false);
            for (way, most) in WAYS {
                let [_, leak, worst] = light_in_rooms(&gpu, &scene, way);
                let name = format!("{}, {way:?}", scene.name);
                println!("{name}: mean {leak:.5}, largest {worst:.4}");
                assert!(leak <= mean, "{name}: a mean of {leak} leaks");
                assert!(worst <= most, "{name}: {worst} leaks at a place");
            }
        }
    }
}

/// Probes that serve the eye's room do not leave another one dark, or end in the wall.
#[test]
fn rooms_that_the_eye_does_not_see_keep_their_light() {
    let gpu = gpu();
    for step in 0..4u8 {
        let scene = two_rooms(0.2, 0.05 + 0.12 * f32::from(step), false);
        let [[snapped, ..], [lattice, ..]] =
            [WAYS[0].0, WAYS[1].0].map(|way| light_in_rooms(&gpu, &scene, way));
        let ratio = snapped / lattice;
        assert!((ratio - 1.0).abs() < 0.05, "{}: {ratio}", scene.name);
    }
}

#[test]
fn walls_that_face_the_other_way_are_the_same() {
    let gpu = gpu();
    for wall in [0.2, 0.0] {
        let scenes = [false, true].map(|is_flipped| two_rooms(wall, 0.1, is_flipped));
        for (way, _) in WAYS {
            let [own, flipped] = scenes
                .each_ref()
                .map(|scene| light_in_rooms(&gpu, scene, way));
            for part in 0..3 {
                let off = (own[part] - flipped[part]).abs();
                assert!(
                    off <= 2e-3 * own[part].max(1.0),
                    "{way:?}: {own:?}, {flipped:?}"
                );
            }
        }
    }
}

/// A speck outside of the scene moves the lattice: the largest error of snapped probes is no more
/// than twice the smallest, and less than half of that of probes that stay.
#[test]
fn the_place_of_the_lattice_matters_little() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let [width, height] = [128, 96];
    let settings = reference::Settings {
        width,
        height,
        bounces: Bounces::Count(1),
        filter: Filter::Center,
        sampling: Sampling::Fixed { spp: 256 },
        seed: 1,
        ..reference::Settings::default()
    };
    let expected = reference::render(&scene, &settings, &|_| {});
    let expected = expected.unwrap().indirect();
    let guide = reference::guide(&scene, width, height).unwrap();
    let (low, high) = scene.bounds().unwrap();
    let cell = (high - low).largest() as f32 / 7.5;
    let range = |placement: &str| {
        let error = |step: u8| {
            let mut scene = scene.clone();
            let corner = low - (0.1 + 0.2 * f32::from(step)) * cell;
            let speck = [1e-3 * Vec3::X, 1e-3 * Vec3::Y];
            add_rectangle(&mut scene, corner, speck, Vec3::Z);
            let pairs = ["probes=8".into(), format!("placement={placement}")];
            let settings = ENTRY.settings(None, &pairs).unwrap();
            let of = frame(width, height, 128);
            let (mut renderer, _) = Renderer::new(&gpu, &scene, &ENTRY, &settings, of).unwrap();
            renderer.render(&scene.camera).unwrap();
            let found = renderer.aov(Aov::Indirect).unwrap();
            block_errors(&found, &expected, &guide).rel_rmse
        };
        let errors = [0, 1, 2, 3, 4].map(error);
        println!("{placement}: {errors:.4?}");
        [
            errors.map(f64::recip).into_iter().worst().recip(),
            errors.into_iter().worst(),
        ]
    };
    let ([least, most], [_, unmoved]) = (range("snap"), range("lattice"));
    assert!(most <= 2.0 * least, "{least} to {most}");
    assert!(
        most < 0.5 * unmoved,
        "{most}, and {unmoved} where probes stay"
    );
}
