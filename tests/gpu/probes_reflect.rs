//! Reflections of probes whose light is averaged beforehand.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3, UVec2, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::entry::Entry;
use lumivox::gi::probes::field::Field;
use lumivox::gi::probes::oracle::direction_of;
use lumivox::gi::probes::prefiltered::{Parallax, Prefiltered};
use lumivox::gi::probes::volume::{Irradiance, Kept, Volume};
use lumivox::gi::probes::{Lattice, cascades, irradiance, light_field};
use lumivox::gi::shared::split_sum::reflected_by_lobe;
use lumivox::graph::{Frame, Gpu};
use lumivox::image::Image;
use lumivox::reference::guide;
use lumivox::render::GpuScene;
use lumivox::scene::{Camera, Material, Scene, Specular};

use super::probes_field::unpack_rgbe;
use super::probes_mirror::{SIZE, expected};
use super::probes_voxels::with_lamp;
use crate::support::compare::{Worst, exceeds};
use crate::support::gpu;
use crate::support::loading::corners;
use crate::support::scenes::bundled;
use crate::support::technique::{Builder, block_errors, frame, largest_difference};

const ENTRIES: [&Entry; 3] = [&irradiance::ENTRY, &light_field::ENTRY, &cascades::ENTRY];

fn mirrored(gpu: &Gpu, scene: &Scene, entry: &'static Entry, pairs: &[&str]) -> Image {
    let all = [&["specular=prefiltered"], pairs].concat();
    let settings = entry.settings(None, &all).unwrap();
    let of = frame(SIZE[0], SIZE[1], 128);
    let (mut renderer, _) = Renderer::new(gpu, scene, entry, &settings, of).unwrap();
    renderer.render(&scene.camera).unwrap();
    renderer.indirect_light().unwrap().specular
}

/// Three numbers, at least one of them not 0, with an exponent that they share.
fn rgbe_of(light: DVec3) -> u32 {
    let exponent = light.max_element().log2().floor() as i32 + 1;
    let parts = (light * 2f64.powi(8 - exponent))
        .round()
        .min(DVec3::splat(255.0))
        .as_uvec3();
    parts.x | parts.y << 8 | parts.z << 16 | ((exponent + 128) as u32) << 24
}

/// Light that comes mostly from about `towards`.
fn peaked(direction: DVec3, towards: DVec3) -> f64 {
    0.1 + (6.0 * (direction.dot(towards) - 1.0)).exp()
}

/// Its mean over directions, each with a weight.
fn mean_of(towards: DVec3, weight: impl Fn(DVec3) -> f64) -> f64 {
    let (rows, columns) = (250, 250);
    let mut sums = DVec2::ZERO;
    for index in 0..rows * columns {
        let z = 1.0 - 2.0 * (f64::from(index / columns) + 0.5) / f64::from(rows);
        let phi = TAU * (f64::from(index % columns) + 0.5) / f64::from(columns);
        let across = (1.0 - z * z).sqrt();
        let direction = DVec3::new(across * phi.cos(), across * phi.sin(), z);
        let share = weight(direction);
        sums += share * DVec2::new(peaked(direction, towards), 1.0);
    }
    sums.x / sums.y
}

/// GGX facets about a direction that is the eye's too, of light from `to_light`, times the cosine.
fn ggx_weight(around: DVec3, to_light: DVec3, roughness: f64) -> f64 {
    let alpha = roughness * roughness;
    let cosine = around.dot(to_light);
    let half = (around + to_light).normalize();
    let (cos_h, sin_h) = (around.dot(half), around.cross(half).length());
    let density = alpha / (cos_h * cos_h * alpha * alpha + sin_h * sin_h);
    density * density * cosine.max(0.0)
}

#[test]
fn levels_are_means_over_lobes() {
    const EDGE: u32 = 64;
    let gpu = gpu();
    let scene = bundled("cornell");
    let on_gpu = GpuScene::new(&gpu, &scene).unwrap();
    let lattice = Lattice::within(on_gpu.bounds, 2, 0.4);
    let kept = Kept {
        irradiance: Irradiance::Harmonics,
        moment_texels: None,
        has_gradients: false,
        bounces: 1,
    };
    let volume = Volume::new(&gpu, lattice, &kept).unwrap();
    let field = Field::new(&gpu, &volume, EDGE).unwrap();
    let towards = |probe: u32| {
        let angle = f64::from(probe);
        DVec3::new(angle.cos(), 0.3 * (angle - 3.0), angle.sin()).normalize()
    };
    let [width, height, _] = field.radiance.extent(0);
    let probe_of = |map: UVec2| map.x + map.y * field.columns;
    let packed: Vec<u32> = (0..width * height)
        .map(|index| {
            let texel = UVec2::new(index % width, index / width);
            let place = (texel % EDGE).as_dvec2() + 0.5;
            let light = peaked(direction_of(place, EDGE), towards(probe_of(texel / EDGE)));
            rgbe_of(DVec3::new(light, 2.0 * light, 0.0))
        })
        .collect();
    gpu.upload_image(&field.radiance, 0, 0, bytemuck::cast_slice(&packed))
        .unwrap();
    let prefiltered = Prefiltered::new(&gpu, &field, Parallax::Distance).unwrap();
    let mut frame = Frame::new();
    frame.set_scene(&on_gpu.set, &on_gpu.materials);
    prefiltered.filter(&mut frame, &field);
    gpu.submit(frame).unwrap();
    let found: Vec<u32> =
        bytemuck::pod_collect_to_vec(&gpu.read_image(&prefiltered.levels, 0, 0).unwrap());
    let columns = prefiltered.levels.extent(0)[0];
    let rows = field.probe_count.div_ceil(field.columns);
    let levels = [
        (32, Some(0.175), UVec2::ZERO),
        (16, Some(0.35), UVec2::new(0, 32 * rows)),
        (8, None, UVec2::new(16 * field.columns, 32 * rows)),
    ];
    for (edge, roughness, first) in levels {
        let mut off = Vec::new();
        for probe in 0..field.probe_count {
            let map = UVec2::new(probe % field.columns, probe / field.columns);
            // Every so many texels, of which there are the edges and corners too.
            for at in (0..edge * edge)
                .step_by(7)
                .chain([edge - 1, edge * edge - 1])
            {
                let texel = UVec2::new(at % edge, at / edge);
                let around = direction_of(texel.as_dvec2() + 0.5, edge);
                let expected = mean_of(towards(probe), |direction| match roughness {
                    Some(roughness) => ggx_weight(around, direction, roughness),
                    None => around.dot(direction).max(0.0),
                });
                let place = map * edge + texel + first;
                let light = unpack_rgbe(found[(place.x + place.y * columns) as usize]);
                off.push((light.x / expected - 1.0).abs());
                assert!((light.y - 2.0 * light.x).abs() < 0.02 * light.y && light.z == 0.0);
            }
        }
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        let worst = off.iter().copied().worst();
        println!("{edge} texels: {mean:.4} off, at most {worst:.4}");
        assert!(
            mean < 0.015 && !exceeds(worst, 0.08),
            "{edge} texels: {mean} {worst}"
        );
    }
}

/// A plane under an even sky mirrors it with what its lobe reflects, whatever light is looked up.
#[test]
fn an_even_sky_is_mirrored_by_the_split_sum() {
    let gpu = gpu();
    let f0 = Vec3::new(0.2, 0.5, 0.9);
    for (roughness, most) in [
        (0.05, 0.01),
        (0.2, 0.01),
        (0.35, 0.015),
        (0.5, 0.03),
        (0.8, 0.01),
    ] {
        let mut builder = Builder::default();
        let ground = builder.material(Material {
            albedo: Vec3::ZERO,
            specular: Some(Specular {
                f0,
                roughness,
                metalness: 0.0,
                texture: None,
            }),
            ..Material::default()
        });
        let corner = Vec3::new(-2.0, 0.0, -2.0);
        builder.quad(ground, corner, Vec3::Z * 4.0, Vec3::X * 4.0);
        let camera = Camera {
            eye: Vec3::new(0.3, 2.0, 1.5),
            target: Vec3::ZERO,
            up: Vec3::Y,
            vfov_deg: 50.0,
        };
        let sky = 2.0;
        let scene = builder.finish("plane", Vec::new(), Vec3::splat(sky), camera);
        let [width, height] = SIZE;
        let seen = guide(&scene, width, height).unwrap();
        for entry in ENTRIES {
            for parallax in ["parallax=distance", "parallax=none"] {
                let found = mirrored(&gpu, &scene, entry, &[parallax, "mirror_rays=64"]);
                let mut sums = DVec2::ZERO;
                for (index, pixel) in found.pixels.iter().enumerate() {
                    if !seen.is_surface(index) {
                        continue;
                    }
                    let to_eye = camera.eye - seen.position[index];
                    let cosine = f64::from(to_eye.normalize().y);
                    let [factor, besides] = reflected_by_lobe(cosine, roughness.into());
                    let expected = f64::from(sky) * (f64::from(f0.y) * factor + besides);
                    sums += DVec2::new((f64::from(pixel.y) / expected - 1.0).abs(), 1.0);
                }
                let off = sums.x / sums.y;
                println!(
                    "{} {roughness} {parallax}: {off:.4} of {}",
                    entry.name, sums.y
                );
                assert!(
                    sums.y > 100.0 && off < most,
                    "{} {roughness}: {off}",
                    entry.name
                );
            }
        }
    }
}

/// Edge of a square of the chequered wall (m).
const SQUARE: f32 = 0.5;

/// A room of 4 × 3 × 4 m whose walls are squares that emit, in turns, 1 and 0.2, and whose floor is
/// nearly a mirror.
fn chequered_room() -> Scene {
    let mut builder = Builder::default();
    let mut emitting = |name: &str, light: f32| {
        builder.material(Material {
            name: name.into(),
            albedo: Vec3::ZERO,
            emission: Vec3::splat(light),
            ..Material::default()
        })
    };
    let squares = [emitting("bright", 1.0), emitting("dim", 0.2)];
    let floor = builder.material(Material {
        name: "floor".into(),
        albedo: Vec3::ZERO,
        specular: Some(Specular {
            f0: Vec3::splat(0.5),
            roughness: 0.05,
            metalness: 0.0,
            texture: None,
        }),
        ..Material::default()
    });
    builder.quad(
        floor,
        Vec3::new(-2.0, 0.0, -2.0),
        Vec3::Z * 4.0,
        Vec3::X * 4.0,
    );
    let sides = [
        (Vec3::new(-2.0, 0.0, -2.0), Vec3::X, Vec3::Y, [8, 6]),
        (Vec3::new(-2.0, 0.0, 2.0), Vec3::Y, Vec3::X, [6, 8]),
        (Vec3::new(-2.0, 0.0, -2.0), Vec3::Y, Vec3::Z, [6, 8]),
        (Vec3::new(2.0, 0.0, -2.0), Vec3::Z, Vec3::Y, [8, 6]),
        (Vec3::new(-2.0, 3.0, -2.0), Vec3::X, Vec3::Z, [8, 8]),
    ];
    for (corner, a, b, [across, along]) in sides {
        for (i, j) in (0..across).flat_map(|i| (0..along).map(move |j| (i, j))) {
            let at = corner + SQUARE * (a * i as f32 + b * j as f32);
            builder.quad(squares[(i + j) % 2], at, SQUARE * a, SQUARE * b);
        }
    }
    let camera = Camera {
        eye: Vec3::new(0.3, 1.6, 1.7),
        target: Vec3::new(0.1, 0.0, -0.4),
        up: Vec3::Y,
        vfov_deg: 60.0,
    };
    builder.finish("chequered", Vec::new(), Vec3::ZERO, camera)
}

/// From any place of the floor each square is where a mirror would show it, but for its edges.
#[test]
fn a_chequered_room_is_mirrored_where_it_is() {
    let gpu = gpu();
    let scene = chequered_room();
    let [width, height] = SIZE;
    let seen = guide(&scene, width, height).unwrap();
    let eye = scene.camera.eye;
    let right = |parallax: &str| {
        let pairs = [parallax, "radiance_texels=128"];
        let found = mirrored(&gpu, &scene, &light_field::ENTRY, &pairs);
        let (mut all, mut right) = (0, 0);
        for (index, pixel) in found.pixels.iter().enumerate() {
            let place = seen.position[index];
            if !seen.is_surface(index) || place.y.abs() > 1e-3 {
                continue;
            }
            let way = (place - eye).normalize() * Vec3::new(1.0, -1.0, 1.0);
            let sides = Vec3::new(2.0f32.copysign(way.x), 3.0, 2.0f32.copysign(way.z));
            let t = (sides - place) / way;
            let nearest = t.min_element();
            let at = (place + nearest * way - Vec3::new(-2.0, 0.0, -2.0)) / SQUARE;
            let on: Vec<f32> = (0..3)
                .filter(|axis| t[*axis] > nearest)
                .map(|axis| at[axis])
                .collect();
            // Two texels of a probe that is 3 m off.
            if on
                .iter()
                .any(|place| (place - place.round()).abs() * SQUARE < 6.0 * 4.0 / 128.0)
            {
                continue;
            }
            let is_bright = on.iter().map(|place| place.floor() as i32).sum::<i32>() % 2 == 0;
            let cosine = f64::from(way.y);
            let [factor, besides] = reflected_by_lobe(cosine, 0.05);
            let light = f64::from(pixel.y) / (0.5 * factor + besides);
            let expected = if is_bright { 1.0 } else { 0.2 };
            all += 1;
            right += u32::from((light - expected).abs() < 0.1);
        }
        println!("{parallax}: {right} of {all}");
        assert!(all > 250);
        f64::from(right) / f64::from(all)
    };
    assert!(right("parallax=box") > 0.98);
    assert!(right("parallax=distance") > 0.98);
    assert!(right("parallax=none") < 0.9);
}

/// The box, whose blocks are of metal.
pub(super) fn metal_blocks(roughness: f32) -> Scene {
    let mut scene = bundled("cornell");
    let metal = scene.materials.len() as u32;
    scene.materials.push(Material {
        name: "metal".into(),
        albedo: Vec3::ONE,
        specular: Some(Specular {
            f0: Vec3::splat(0.04),
            roughness,
            metalness: 1.0,
            texture: None,
        }),
        ..Material::default()
    });
    let (low, high) = scene.bounds().unwrap();
    for index in 0..scene.triangles.len() {
        let middle = corners(&scene, index).into_iter().sum::<Vec3>() / 3.0;
        let to_wall = (middle - low).min(high - middle).to_array();
        if to_wall.iter().all(|distance| *distance > 1e-3) {
            scene.triangles[index].material = metal;
        }
    }
    scene.triangles.sort_by_key(|triangle| triangle.material);
    scene
}

/// Blocks of metal in a room mirror what the reference says, as far as lobes of probes can; the
/// place of what is mirrored tells where to look.
#[test]
fn mirrored_light_is_near_the_references() {
    let gpu = gpu();
    for (roughness, most) in [(0.1, 0.1), (0.25, 0.15), (0.5, 0.15), (0.8, 0.3)] {
        let scene = metal_blocks(roughness);
        let (expected, guide) = expected(&scene, 1);
        for entry in ENTRIES {
            let off = |parallax: &str| {
                let found = mirrored(&gpu, &scene, entry, &[parallax, "mirror_rays=16"]);
                block_errors(&found, &expected, &guide)
            };
            let errors = off("parallax=distance");
            println!("{} {roughness}: {errors:.4?}", entry.name);
            assert!(
                errors.rel_rmse < most && errors.bias.abs() < 0.1,
                "{errors:?}"
            );
            if roughness < 0.2 {
                let straight = off("parallax=none");
                assert!(straight.rel_rmse > 1.5 * errors.rel_rmse, "{straight:?}");
            }
        }
    }
}

/// As a renderer that was made when they stood there, mirrors bit by bit; most texels keep what
/// they see.
#[test]
fn light_fields_follow_models() {
    let gpu = gpu();
    let mut scene = with_lamp(metal_blocks(0.2), [[0.5, 1.2, 0.2], [0.4, 1.1, 0.25]]);
    for entry in ENTRIES {
        let pairs = [
            "specular=prefiltered",
            "probes=4",
            "radiance_texels=32",
            "bounces=2",
        ];
        let settings = entry.settings(None, &pairs).unwrap();
        let renderer = |scene: &Scene| {
            let of = frame(48, 36, 64);
            Renderer::new(&gpu, scene, entry, &settings, of).unwrap().0
        };
        scene.set_time(0.0);
        let mut following = renderer(&scene);
        following.render(&scene.camera).unwrap();
        scene.set_time(1.0);
        following.set_pose(&scene).unwrap();
        following.render(&scene.camera).unwrap();
        let mut made = renderer(&scene);
        made.render(&scene.camera).unwrap();
        let [found, expected] = [&following, &made].map(|of| of.indirect_light().unwrap());
        assert!(
            expected
                .specular
                .pixels
                .iter()
                .any(|pixel| *pixel != Vec3::ZERO)
        );
        let specular = largest_difference(&found.specular, &expected.specular);
        let diffuse = largest_difference(&found.irradiance, &expected.irradiance);
        println!("{}: {specular} {diffuse}", entry.name);
        assert_eq!(specular, 0.0, "{}", entry.name);
        assert!(diffuse < 1e-5, "{}: {diffuse}", entry.name);
    }
}

/// Those of cascades go with the camera: as a renderer that was made where it is.
#[test]
fn reflection_probes_go_with_the_camera() {
    let gpu = gpu();
    let scene = metal_blocks(0.2);
    let entry = &cascades::ENTRY;
    let pairs = [
        "specular=prefiltered",
        "reflection_probes=4",
        "radiance_texels=16",
        "probes=6",
        "levels=1",
        "spacing=0.12",
        "probes_per_frame=0",
    ];
    let settings = entry.settings(None, &pairs).unwrap();
    let renderer = || {
        let of = frame(48, 36, 64);
        Renderer::new(&gpu, &scene, entry, &settings, of).unwrap().0
    };
    let step = 0.4 * (scene.camera.target - scene.camera.eye);
    let mut camera = scene.camera;
    let mut following = renderer();
    following.render(&camera).unwrap();
    for _ in 0..2 {
        camera.eye += step;
        camera.target += step;
        following.render(&camera).unwrap();
        let mut made = renderer();
        made.render(&camera).unwrap();
        let [found, expected] = [&following, &made].map(|of| of.indirect_light().unwrap().specular);
        assert!(expected.pixels.iter().any(|pixel| *pixel != Vec3::ZERO));
        let off = largest_difference(&found, &expected);
        println!("{off} off");
        assert!(off < 1e-4, "{off}");
    }
}
