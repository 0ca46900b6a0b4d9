//! The path tracer against closed forms, against itself, and against renders of an independent path
//! tracer.

use crate::support::surfaces::with_lobe_textures;
use crate::support::{Missing, skipped};
use std::f32::consts::PI;
use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3};
use lumivox::image::{Image, luminance, read_exr, write_exr};
use lumivox::metrics::{Block, Channel, Errors, compare};
use lumivox::reference::{
    Bounces, Filter, Occlusion, ReferenceError, ReferenceImage, Sampling, Settings, cached, render,
};
use lumivox::scene::{
    Camera, Light, LoadOptions, Material, Scene, Specular, Texture, TextureKind, Triangle, Vertex,
};

/// An empty scene seen from `eye`.
pub(super) fn scene(eye: Vec3, target: Vec3, vfov_deg: f32) -> Scene {
    let forward = (target - eye).normalize();
    let up = if forward.y.abs() > 0.9 {
        Vec3::Z
    } else {
        Vec3::Y
    };
    Scene {
        camera: Camera {
            eye,
            target,
            up,
            vfov_deg,
        },
        ..Scene::default()
    }
}

pub(super) fn lambert(albedo: f32) -> Material {
    Material {
        albedo: Vec3::splat(albedo),
        ..Material::default()
    }
}

/// Adds a material and its triangles, each corner with position and normal.
pub(super) fn add(
    scene: &mut Scene,
    material: Material,
    triangles: impl IntoIterator<Item = [(Vec3, Vec3, Vec2); 3]>,
) {
    let material_index = scene.materials.len() as u32;
    scene.materials.push(material);
    for corners in triangles {
        let first = scene.vertices.len() as u32;
        scene.vertices.extend(corners.map(|(p, n, t)| Vertex {
            position: p.into(),
            u: t.x,
            normal: n.into(),
            v: t.y,
        }));
        scene.triangles.push(Triangle {
            vertices: [first, first + 1, first + 2],
            material: material_index,
        });
    }
}

/// A parallelogram, counter-clockwise from the front: `corner`, `corner + a`, `corner + a + b`,
/// `corner + b`.
pub(super) fn quad(corner: Vec3, a: Vec3, b: Vec3) -> [[(Vec3, Vec3, Vec2); 3]; 2] {
    let normal = a.cross(b).normalize();
    let point = |u: f32, v: f32| (corner + a * u + b * v, normal, Vec2::new(u, v));
    [
        [point(0.0, 0.0), point(1.0, 0.0), point(1.0, 1.0)],
        [point(0.0, 0.0), point(1.0, 1.0), point(0.0, 1.0)],
    ]
}

/// A horizontal square about the origin, front upwards.
fn floor(half_size_m: f32, y_m: f32) -> [[(Vec3, Vec3, Vec2); 3]; 2] {
    quad(
        Vec3::new(-half_size_m, y_m, half_size_m),
        Vec3::X * (2.0 * half_size_m),
        Vec3::NEG_Z * (2.0 * half_size_m),
    )
}

/// A cube of side 2 about the origin, front inwards.
fn inward_cube() -> Vec<[(Vec3, Vec3, Vec2); 3]> {
    let faces = [(Vec3::X, Vec3::Y), (Vec3::Y, Vec3::Z), (Vec3::Z, Vec3::X)];
    faces
        .into_iter()
        .flat_map(|(a, b)| [(a, b), (b, a)])
        .flat_map(|(a, b)| quad(-a - b - a.cross(b), a * 2.0, b * 2.0))
        .collect()
}

/// A unit sphere of 8 · 4ⁿ triangles, front inwards, with smooth normals.
fn inward_sphere(levels: u32) -> Vec<[(Vec3, Vec3, Vec2); 3]> {
    let mut faces = Vec::new();
    for (x, y, z) in (0..8).map(|i| (i & 1, i >> 1 & 1, i >> 2)) {
        let [x, y, z] = [
            Vec3::X * (1 - 2 * x) as f32,
            Vec3::Y * (1 - 2 * y) as f32,
            Vec3::Z * (1 - 2 * z) as f32,
        ];
        faces.push(if x.cross(y).dot(z) > 0.0 {
            [x, z, y]
        } else {
            [x, y, z]
        });
    }
    for _ in 0..levels {
        let split = |[a, b, c]: [Vec3; 3]| {
            let [ab, bc, ca] = [
                (a + b).normalize(),
                (b + c).normalize(),
                (c + a).normalize(),
            ];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(split).collect();
    }
    faces
        .into_iter()
        .map(|face| face.map(|point| (point, -point, Vec2::ZERO)))
        .collect()
}

fn settings(width: u32, height: u32, bounces: Bounces, spp: u32) -> Settings {
    Settings {
        width,
        height,
        bounces,
        filter: Filter::Center,
        sampling: Sampling::Fixed { spp },
        seed: 7,
        ..Settings::default()
    }
}

fn trace(scene: &Scene, settings: &Settings) -> ReferenceImage {
    render(scene, settings, &|_| {}).unwrap()
}

fn mean(image: &Image) -> Vec3 {
    image.pixels.iter().sum::<Vec3>() / image.pixels.len() as f32
}

#[track_caller]
fn assert_close(found: f32, expected: f32, tolerance: f32) {
    assert!(
        (found / expected - 1.0).abs() <= tolerance,
        "found {found}, expected {expected} to {tolerance}"
    );
}

/// Under an endless ceiling at a height h: within a distance D, V = (h/D)²; and with f(r) = 1/(1 +
/// λr), V = 2a − 2a² ln((1 + a)/a), a = λh.
#[test]
fn occluders_count_by_their_distance() {
    let mut room = scene(Vec3::new(0.0, 0.5, 0.2), Vec3::ZERO, 10.0);
    add(&mut room, lambert(0.5), floor(200.0, 0.0));
    add(&mut room, lambert(0.5), floor(200.0, 0.8));
    let open = |distance_m, falloff| {
        let image = trace(
            &room,
            &Settings {
                occlusion: Occlusion {
                    distance_m,
                    falloff,
                },
                ..settings(8, 8, Bounces::Count(1), 1024)
            },
        );
        f64::from(image.light.visibility.iter().sum::<f32>()) / 64.0
    };
    let a: f64 = 0.8 * 1.5;
    let weighted = 2.0 * a - 2.0 * a * a * ((1.0 + a) / a).ln();
    for (distance_m, falloff, expected) in [
        (None, 0.0, 0.0),
        (Some(0.7), 0.0, 1.0),
        (Some(1.0), 0.0, 0.64),
        (Some(2.0), 0.0, 0.16),
        (None, 1.5, weighted),
    ] {
        let found = open(distance_m, falloff);
        assert!(
            (found - expected).abs() < 0.004,
            "{distance_m:?}, {falloff}: {found}, and not {expected}"
        );
    }
}

#[test]
fn plane_under_a_uniform_sky_receives_pi_times_its_radiance() {
    let mut scene = scene(Vec3::new(0.0, 3.0, 2.0), Vec3::ZERO, 40.0);
    add(&mut scene, lambert(0.7), floor(100.0, 0.0));
    scene.environment = Vec3::new(0.5, 1.0, 2.0).into();
    for filter in [Filter::Center, Filter::Box] {
        let image = trace(
            &scene,
            &Settings {
                filter,
                ..settings(8, 8, Bounces::Full, 4)
            },
        );
        for (index, &radiance) in image.radiance().pixels.iter().enumerate() {
            assert!(
                radiance.abs_diff_eq(scene.environment.uniform() * 0.7, 1e-4),
                "{radiance} at {index}"
            );
            assert!(
                image.light.irradiance.pixels[index]
                    .abs_diff_eq(scene.environment.uniform() * PI, 1e-3),
                "{} at {index}",
                image.light.irradiance.pixels[index]
            );
            assert_eq!(image.light.visibility[index], 1.0);
        }
        assert_eq!(image.direct, Image::new(8, 8));
    }
}

#[test]
fn plane_under_each_light_has_its_closed_form() {
    let position = Vec3::new(0.3, 1.5, -0.2);
    let axis = Vec3::new(0.1, -1.0, 0.2).normalize();
    let (inner_deg, outer_deg) = (15.0f32, 35.0f32);
    let sun = Vec3::new(0.5, -1.0, 0.3).normalize();
    let irradiance = |light: usize, point: Vec3| {
        let to_light = position - point;
        let lambert = 2.0 * to_light.normalize().y / to_light.length_squared();
        let angle_deg = (-to_light.normalize()).dot(axis).acos().to_degrees();
        match light {
            0 => 3.0 * -sun.y,
            1 => lambert,
            _ => lambert * ((outer_deg - angle_deg) / (outer_deg - inner_deg)).clamp(0.0, 1.0),
        }
    };
    let lights = [
        Light::Directional {
            direction: sun,
            irradiance: Vec3::splat(3.0),
        },
        Light::Point {
            position,
            intensity: Vec3::splat(2.0),
        },
        Light::Spot {
            position,
            direction: axis,
            intensity: Vec3::splat(2.0),
            inner_deg,
            outer_deg,
        },
    ];
    for (index, light) in lights.into_iter().enumerate() {
        let mut scene = scene(Vec3::new(0.0, 3.0, 0.0), Vec3::ZERO, 60.0);
        add(&mut scene, lambert(0.6), floor(10.0, 0.0));
        scene.lights.push(light);
        let image = trace(&scene, &settings(32, 32, Bounces::Full, 1));
        for (pixel, &radiance) in image.radiance().pixels.iter().enumerate() {
            let expected = 0.6 / PI * irradiance(index, image.guide.position[pixel]);
            assert!(
                (radiance.y - expected).abs() <= 1e-3 * expected + 1e-5,
                "light {index}, pixel {pixel}: {} for {expected}",
                radiance.y
            );
        }
    }
}

#[test]
fn closed_furnace_reaches_its_partial_sums_and_their_limit() {
    let (emission, albedo) = (2.0f32, 0.6f32);
    let mut scene = scene(Vec3::ZERO, Vec3::new(1.0, 0.3, 0.2), 70.0);
    add(
        &mut scene,
        Material {
            emission: Vec3::splat(emission),
            ..lambert(albedo)
        },
        inward_cube(),
    );
    for bounces in 0..4 {
        let image = trace(&scene, &settings(16, 16, Bounces::Count(bounces), 64));
        let sum: f32 = (0..=bounces as i32)
            .map(|power| emission * albedo.powi(power))
            .sum();
        assert_close(mean(&image.radiance()).y, sum, 0.005);
        assert!(
            (mean(&image.diffuse).y - (sum - emission)).abs() <= 0.005 * sum,
            "{bounces}: {}",
            mean(&image.diffuse)
        );
        assert_eq!(mean(&image.direct), Vec3::ZERO, "no analytic light");
        assert_close(mean(&image.emission).y, emission, 1e-6);
    }
    let image = trace(&scene, &settings(16, 16, Bounces::Full, 64));
    assert_close(mean(&image.radiance()).y, emission / (1.0 - albedo), 0.005);
    assert_eq!(image.light.visibility.iter().sum::<f32>(), 0.0);
}

#[test]
fn lit_sphere_has_its_closed_form() {
    // Albedo 1/2, intensity π, radius 1: E = π · Σ ρⁿ = 2π, L = ρ E / π = 1 (pbrt's analytic
    // scene).
    let mut scene = scene(Vec3::new(0.2, 0.1, 0.0), Vec3::new(1.0, 0.5, 0.3), 80.0);
    add(&mut scene, lambert(0.5), inward_sphere(5));
    scene.lights.push(Light::Point {
        position: Vec3::ZERO,
        intensity: Vec3::splat(PI),
    });
    let image = trace(&scene, &settings(16, 16, Bounces::Full, 128));
    assert_close(mean(&image.direct).y, 0.5, 0.005);
    assert_close(mean(&image.light.irradiance).y, PI, 0.005);
    assert_close(mean(&image.radiance()).y, 1.0, 0.005);
    let image = trace(&scene, &settings(16, 16, Bounces::Count(1), 128));
    assert_close(mean(&image.radiance()).y, 0.75, 0.005);
}

/// Form factor from a point to a parallel rectangle at unit height, whose corner is above the point
/// and which extends by x and y.
fn corner_form_factor(x: f32, y: f32) -> f32 {
    let part = |x: f32, y: f32| x / (1.0 + x * x).sqrt() * (y / (1.0 + x * x).sqrt()).atan();
    (part(x, y) + part(y, x)) / (2.0 * PI)
}

/// Form factor from a point of the lower of two unit squares, one above the other at unit distance,
/// to the upper.
fn plate_form_factor(x: f32, z: f32) -> f32 {
    [x, 1.0 - x]
        .into_iter()
        .flat_map(|x| [z, 1.0 - z].map(|z| corner_form_factor(x, z)))
        .sum()
}

#[test]
fn two_plates_have_their_form_factor() {
    let n = 200;
    let at = |i: i32| ((i % n) as f32 + 0.5) / n as f32;
    let whole = (0..n * n)
        .map(|i| plate_form_factor(at(i), at(i / n)))
        .sum::<f32>()
        / (n * n) as f32;
    assert_close(whole, 0.199_825, 1e-3);

    let mut scene = scene(Vec3::new(0.5, 0.9, 0.5), Vec3::new(0.5, 0.0, 0.5), 57.0);
    let emitter = Material {
        emission: Vec3::splat(5.0),
        ..lambert(0.0)
    };
    add(
        &mut scene,
        lambert(0.8),
        quad(Vec3::Z, Vec3::X, Vec3::NEG_Z),
    );
    add(&mut scene, emitter, quad(Vec3::Y, Vec3::X, Vec3::Z));
    let image = trace(&scene, &settings(32, 32, Bounces::Full, 512));
    let (mut found, mut expected) = (0.0, 0.0);
    for (pixel, radiance) in image.diffuse.pixels.iter().enumerate() {
        if image.guide.material[pixel] == 0 {
            let point = image.guide.position[pixel];
            let exact = 0.8 * 5.0 * plate_form_factor(point.x, point.z);
            assert_close(radiance.y, exact, 0.1);
            found += radiance.y;
            expected += exact;
        }
    }
    assert_close(found, expected, 2e-3);
}

#[test]
fn emission_leaves_the_front_only() {
    let mut scene = scene(Vec3::new(0.0, -2.0, 0.0), Vec3::ZERO, 30.0);
    add(
        &mut scene,
        Material {
            emission: Vec3::ONE,
            ..lambert(0.5)
        },
        floor(10.0, 0.0),
    );
    assert_eq!(
        mean(&trace(&scene, &settings(8, 8, Bounces::Full, 4)).radiance()),
        Vec3::ZERO
    );
    scene.camera.eye.y = 2.0;
    assert_eq!(
        mean(&trace(&scene, &settings(8, 8, Bounces::Full, 4)).radiance()),
        Vec3::ONE
    );
}

#[test]
fn masked_surfaces_are_neither_seen_nor_cast_shadows() {
    let mut scene = scene(Vec3::new(0.0, 3.0, 0.0), Vec3::ZERO, 50.0);
    add(&mut scene, lambert(0.6), floor(10.0, 0.0));
    scene.lights.push(Light::Directional {
        direction: Vec3::NEG_Y,
        irradiance: Vec3::ONE,
    });
    let bare = trace(&scene, &settings(16, 16, Bounces::Count(0), 1));
    let mask = |value: u8| Texture {
        name: String::from("mask"),
        kind: TextureKind::Mask,
        width: 1,
        height: 1,
        texels: vec![[value; 4]],
    };
    scene.textures.push(mask(127).into());
    add(
        &mut scene,
        Material {
            mask_texture: Some(0),
            ..lambert(0.2)
        },
        floor(5.0, 1.0),
    );
    assert_eq!(trace(&scene, &settings(16, 16, Bounces::Count(0), 1)), bare);
    scene.textures[0] = mask(128).into();
    assert_close(
        mean(&trace(&scene, &settings(16, 16, Bounces::Count(0), 1)).radiance()).y,
        0.2 / PI,
        1e-3,
    );
}

#[test]
fn normal_map_bends_the_shading_normal_along_u() {
    let mut scene = scene(Vec3::new(0.0, 3.0, 0.0), Vec3::ZERO, 50.0);
    scene.textures.push(
        Texture {
            name: String::from("normal"),
            kind: TextureKind::Normal,
            width: 1,
            height: 1,
            texels: vec![[218, 128, 218, 255]],
        }
        .into(),
    );
    add(
        &mut scene,
        Material {
            normal_texture: Some(0),
            ..lambert(0.5)
        },
        floor(10.0, 0.0),
    );
    let image = trace(&scene, &settings(4, 4, Bounces::Count(0), 1));
    // u grows along +x, v along −z; 218/255 · 2 − 1 = 0.71.
    assert!(
        image.normal.pixels[5].abs_diff_eq(Vec3::new(0.707, 0.707, 0.0), 5e-3),
        "{}",
        image.normal.pixels[5]
    );
}

#[test]
fn smooth_metal_mirrors_and_keeps_energy() {
    // A smooth mirror at 45° shows an emitter; the same lobe under a uniform sky of 1 returns 1.
    let mut scene = scene(Vec3::new(0.0, 2.0, 2.0), Vec3::ZERO, 5.0);
    let metal = |roughness| Material {
        specular: Some(Specular {
            f0: Vec3::ONE,
            roughness,
            metalness: 1.0,
            texture: None,
        }),
        ..lambert(1.0)
    };
    add(&mut scene, metal(0.1), floor(10.0, 0.0));
    add(
        &mut scene,
        Material {
            emission: Vec3::splat(3.0),
            ..lambert(0.0)
        },
        quad(Vec3::new(-5.0, 0.1, -3.0), Vec3::X * 10.0, Vec3::Y * 10.0),
    );
    let image = trace(&scene, &settings(8, 8, Bounces::Full, 64));
    assert_close(mean(&image.light.specular).y, 3.0, 0.01);
    scene.environment = Vec3::ONE.into();
    scene.materials[1].mask_texture = Some(0);
    scene.textures.push(
        Texture {
            name: String::from("mask"),
            kind: TextureKind::Mask,
            width: 1,
            height: 1,
            texels: vec![[0; 4]],
        }
        .into(),
    );
    assert_close(
        mean(
            &trace(&scene, &settings(8, 8, Bounces::Full, 64))
                .light
                .specular,
        )
        .y,
        1.0,
        0.01,
    );
}

/// Texels that are all alike make the picture that their factors make.
#[test]
fn lobes_of_texels_are_those_of_factors() {
    let plain = Scene::bundled("glossy", &[]).unwrap();
    let settings = settings(32, 18, Bounces::Count(1), 16);
    let [expected, found] =
        [&plain, &with_lobe_textures(&plain)].map(|scene| trace(scene, &settings));
    for (expected, found) in [
        (&expected.light.specular, &found.light.specular),
        (&expected.light.irradiance, &found.light.irradiance),
    ] {
        for (expected, found) in expected.pixels.iter().zip(&found.pixels) {
            assert!(
                (*expected - *found).length() <= 1e-3 * (1.0 + expected.length()),
                "{found} for {expected}"
            );
        }
    }
}

#[test]
fn many_lights_equal_their_sum() {
    let mut one = cornell_like(1.0);
    let Light::Point {
        position,
        intensity,
    } = one.lights[0]
    else {
        unreachable!()
    };
    let mut many = one.clone();
    many.lights = vec![
        Light::Point {
            position,
            intensity: intensity / 20.0
        };
        20
    ];
    one.name = String::from("one");
    let settings = settings(16, 16, Bounces::Count(1), 64);
    assert_close(
        mean(&trace(&many, &settings).radiance()).y,
        mean(&trace(&one, &settings).radiance()).y,
        0.01,
    );
}

/// A box of side 2 · `scale`, open in front, with a coloured wall and a lamp; light falls off with
/// the scale's square.
fn cornell_like(scale: f32) -> Scene {
    let mut scene = scene(
        Vec3::new(0.2, 0.1, 0.9) * scale,
        Vec3::new(-0.2, -0.1, -1.0) * scale,
        80.0,
    );
    let mut walls = inward_cube();
    walls
        .iter_mut()
        .flatten()
        .for_each(|corner| corner.0 *= scale);
    let (left, others): (Vec<_>, Vec<_>) = walls
        .into_iter()
        .partition(|triangle| triangle[0].1.x > 0.5);
    add(
        &mut scene,
        Material {
            albedo: Vec3::new(0.7, 0.1, 0.1),
            ..Material::default()
        },
        left,
    );
    add(&mut scene, lambert(0.6), others);
    scene.lights.push(Light::Point {
        position: Vec3::new(0.1, 0.7, -0.2) * scale,
        intensity: Vec3::new(2.0, 2.0, 1.5) * scale * scale,
    });
    scene
}

#[test]
fn scale_does_not_matter_from_a_millimetre_to_ten_kilometres() {
    let settings = settings(32, 32, Bounces::Count(2), 16);
    let unit = trace(&cornell_like(1.0), &settings).radiance();
    for scale in [1e-3, 1e4] {
        let scaled = trace(&cornell_like(scale), &settings).radiance();
        let errors = compare(&scaled, &unit, None, Channel::Rgb).unwrap().pixel;
        assert!(
            errors.rel_rmse < 0.02 && errors.bias.abs() < 1e-3,
            "scale {scale}: {errors:?}"
        );
    }
}

#[test]
fn threads_do_not_matter_and_seeds_do() {
    let scene = cornell_like(1.0);
    let settings = Settings {
        sampling: Sampling::Adaptive {
            max_error: 0.02,
            max_spp: 256,
        },
        ..settings(20, 12, Bounces::Full, 1)
    };
    let many = trace(&scene, &settings);
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap()
        .install(|| trace(&scene, &settings));
    assert_eq!(many, one);
    assert_ne!(
        many,
        trace(
            &scene,
            &Settings {
                seed: 8,
                ..settings
            }
        )
    );
}

/// The scene mirrored in the plane x = 0, fronts kept.
fn mirrored(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    for vertex in &mut scene.vertices {
        vertex.position[0] *= -1.0;
        vertex.normal[0] *= -1.0;
    }
    scene
        .triangles
        .iter_mut()
        .for_each(|triangle| triangle.vertices.swap(1, 2));
    scene.camera.eye.x *= -1.0;
    scene.camera.target.x *= -1.0;
    for light in &mut scene.lights {
        if let Light::Point { position, .. } = light {
            position.x *= -1.0;
        }
    }
    scene
}

#[test]
fn mirrored_scene_gives_the_mirrored_image() {
    let scene = cornell_like(1.0);
    let settings = settings(32, 32, Bounces::Full, 64);
    let (plain, mirror) = (
        trace(&scene, &settings),
        trace(&mirrored(&scene), &settings),
    );
    let standard_error = f64::from(
        plain
            .radiance_error()
            .image
            .hypot(mirror.radiance_error().image),
    );
    let (plain, mirror) = (plain.radiance(), mirror.radiance());
    let flipped = Image::from_fn(32, 32, |i| mirror.pixels[i / 32 * 32 + 31 - i % 32]);
    let errors = block_errors(&flipped, &plain);
    assert!(
        errors.bias.abs() < 4.0 * standard_error && errors.rel_rmse < 0.02,
        "{errors:?}, standard error {standard_error}"
    );
    let negative = block_errors(&mirror, &plain);
    assert!(
        negative.rel_rmse > 0.05,
        "the picture is symmetric and this test shows nothing: {negative:?}"
    );
}

#[test]
fn measured_standard_error_is_the_spread_over_seeds() {
    let scene = cornell_like(1.0);
    let images: Vec<ReferenceImage> = (0..16)
        .map(|seed| {
            trace(
                &scene,
                &Settings {
                    seed,
                    ..settings(16, 16, Bounces::Full, 32)
                },
            )
        })
        .collect();
    let claimed = images
        .iter()
        .map(|image| image.radiance_variance.iter().sum::<f32>())
        .sum::<f32>()
        / 16.0;
    let radiance: Vec<Image> = images.iter().map(ReferenceImage::radiance).collect();
    let spread: f32 = (0..256)
        .map(|pixel| {
            let values: Vec<f32> = radiance
                .iter()
                .map(|image| luminance(image.pixels[pixel]))
                .collect();
            let mean = values.iter().sum::<f32>() / 16.0;
            values
                .iter()
                .map(|value| (value - mean).powi(2))
                .sum::<f32>()
                / 15.0
        })
        .sum();
    assert_close(claimed, spread, 0.2);
}

#[test]
fn adaptive_sampling_reaches_the_error_asked_for() {
    let scene = cornell_like(1.0);
    let render = |max_error| {
        trace(
            &scene,
            &Settings {
                sampling: Sampling::Adaptive {
                    max_error,
                    max_spp: 4096,
                },
                ..settings(32, 32, Bounces::Full, 1)
            },
        )
    };
    let (coarse, fine) = (render(0.02), render(0.004));
    assert!(
        fine.mean_samples() > 4.0 * coarse.mean_samples(),
        "{} and {} samples",
        coarse.mean_samples(),
        fine.mean_samples()
    );
    let error_per_block = fine.radiance_error().pixel / 8.0;
    assert!(error_per_block < 0.004, "{error_per_block}");
}

#[test]
fn empty_scene_shows_its_environment() {
    let mut scene = scene(Vec3::ZERO, Vec3::X, 60.0);
    scene.environment = Vec3::new(1.0, 2.0, 3.0).into();
    let image = trace(&scene, &settings(4, 3, Bounces::Full, 1));
    assert!(
        image
            .radiance()
            .pixels
            .iter()
            .all(|&pixel| pixel == scene.environment.uniform())
    );
    assert!((0..12).all(|pixel| !image.guide.is_surface(pixel)));
}

#[test]
fn bad_settings_and_scenes_are_errors() {
    let scene = cornell_like(1.0);
    let good = settings(4, 4, Bounces::Full, 1);
    let bad = [
        Settings { width: 0, ..good },
        Settings {
            height: 1 << 20,
            ..good
        },
        Settings {
            sampling: Sampling::Fixed { spp: 0 },
            ..good
        },
        Settings {
            sampling: Sampling::Adaptive {
                max_error: f32::NAN,
                max_spp: 4,
            },
            ..good
        },
    ];
    for settings in bad {
        assert!(
            matches!(
                render(&scene, &settings, &|_| {}),
                Err(ReferenceError::Setting { .. })
            ),
            "{settings:?}"
        );
    }
    let breakages: [fn(&mut Scene); 5] = [
        |scene| scene.triangles[0].vertices[0] = 1 << 30,
        |scene| scene.triangles[0].material = 99,
        |scene| scene.materials[0].albedo_texture = Some(3),
        |scene| {
            scene.materials[0].specular = Some(Specular {
                texture: Some(3),
                ..Specular::default()
            });
        },
        |scene| scene.vertices[0].position[1] = f32::NAN,
    ];
    for breakage in breakages {
        let mut broken = scene.clone();
        breakage(&mut broken);
        assert!(matches!(
            render(&broken, &good, &|_| {}),
            Err(ReferenceError::Scene { .. })
        ));
    }
}

#[test]
fn cache_returns_the_same_image_and_survives_damage() {
    let dir = tempfile::tempdir().unwrap();
    let scene = cornell_like(1.0);
    let settings = settings(12, 9, Bounces::Count(1), 8);
    let files = || {
        std::fs::read_dir(dir.path())
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .collect::<Vec<PathBuf>>()
    };
    let rendered = trace(&scene, &settings);
    let fetch =
        |scene: &Scene, settings: &Settings| cached(scene, settings, dir.path(), &|_| {}).unwrap();
    assert_eq!(fetch(&scene, &settings), rendered);
    assert_eq!(files().len(), 1);
    let found_without_rendering =
        cached(&scene, &settings, dir.path(), &|_| panic!("rendered again")).unwrap();
    assert_eq!(found_without_rendering, rendered);
    std::fs::write(&files()[0], b"not an image").unwrap();
    assert_eq!(fetch(&scene, &settings), rendered);
    assert_eq!(
        cached(&scene, &settings, dir.path(), &|_| panic!("rendered again")).unwrap(),
        rendered
    );
    fetch(
        &scene,
        &Settings {
            seed: 9,
            ..settings
        },
    );
    let mut brighter = scene.clone();
    brighter.materials[0].albedo *= 1.01;
    assert_ne!(fetch(&brighter, &settings), rendered);
    assert_eq!(files().len(), 3);
}

/// The folder with scenes and independent renders that is not part of the project:
/// `LUMIVOX_SHARED`, else `../shared`.
fn shared() -> Option<PathBuf> {
    let folder = std::env::var_os("LUMIVOX_SHARED").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared"),
        PathBuf::from,
    );
    if !folder.join("refs").is_dir() {
        skipped(&Missing::Other(
            "no independent references (LUMIVOX_SHARED)",
        ));
        return None;
    }
    Some(folder)
}

/// Errors of the means of all whole 8×8 squares.
pub(super) fn block_errors(image: &Image, reference: &Image) -> Errors {
    let columns = reference.width / 8;
    let shrink = |image: &Image| {
        Image::from_fn(columns, reference.height / 8, |i| {
            Block {
                x_px: i as u32 % columns * 8,
                y_px: i as u32 / columns * 8,
                material: 0,
            }
            .mean(image)
        })
    };
    compare(&shrink(image), &shrink(reference), None, Channel::Rgb)
        .unwrap()
        .pixel
}

/// Holds a render against an independent one: |bias| ≤ 0.5%, rel_rmse ≤ 3% over block means.
fn check_against_independent(scene_name: &str, bounces: Bounces, suffix: &str, spp: u32) {
    let Some(shared) = shared() else { return };
    let reference = read_exr(&shared.join(format!("refs/{scene_name}_{suffix}.exr"))).unwrap();
    let scene = Scene::load(
        &shared.join(format!("scenes/{scene_name}.toml")),
        &LoadOptions::default(),
    )
    .unwrap();
    let image = trace(
        &scene,
        &Settings {
            filter: Filter::Box,
            ..settings(reference.width, reference.height, bounces, spp)
        },
    )
    .radiance();
    let errors = block_errors(&image, &reference);
    println!(
        "{scene_name} {suffix}: bias {:+.5}, rel_rmse {:.5} over {} values",
        errors.bias, errors.rel_rmse, errors.count
    );
    if errors.bias.abs() > 0.005 || errors.rel_rmse > 0.03 {
        let path =
            Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{scene_name}_{suffix}.exr"));
        write_exr(&path, &image).unwrap();
        panic!(
            "{scene_name} {suffix} is off: {errors:?}; see {}",
            path.display()
        );
    }
}

#[test]
fn cornell_agrees_with_an_independent_path_tracer() {
    check_against_independent("cornell_point", Bounces::Count(0), "direct", 16);
    check_against_independent("cornell_point", Bounces::Count(1), "1bounce", 32);
    check_against_independent("cornell_point", Bounces::Full, "full", 32);
}

#[test]
fn sponza_agrees_with_an_independent_path_tracer() {
    check_against_independent("sponza_noplants_sun", Bounces::Count(0), "direct", 32);
    check_against_independent("sponza_noplants_sun", Bounces::Count(1), "1bounce", 32);
}

#[test]
fn the_comparison_with_an_independent_path_tracer_can_fail() {
    let Some(shared) = shared() else { return };
    let read =
        |suffix: &str| read_exr(&shared.join(format!("refs/cornell_point_{suffix}.exr"))).unwrap();
    let errors = block_errors(&read("1bounce"), &read("2bounce"));
    assert!(
        errors.bias.abs() > 0.005 && errors.rel_rmse > 0.03,
        "one bounce passes for two: {errors:?}"
    );
}
