//! Environment maps: where light is in them, how it is drawn, and what the reference makes of it.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use glam::{DVec3, Vec3};
use lumivox::image::{Image, write_exr};
use lumivox::reference::{Bounces, Sampling, Settings, render};
use lumivox::scene::{ClearSky, LoadOptions, Material, Scene, Sky};

use super::reference::{add, lambert, quad, scene};
use crate::support::Random;
use crate::support::compare::{Largest, Worst};

fn map(width: u32, height: u32, texel: impl FnMut(usize) -> Vec3) -> Image {
    Image::from_fn(width, height, texel)
}

/// The middle of a texel, by the map's own axes.
fn direction_of(x: f64, y: f64, width: u32, height: u32) -> DVec3 {
    let (u, v) = ((x + 0.5) / f64::from(width), (y + 0.5) / f64::from(height));
    let (sin, cos) = (PI * v).sin_cos();
    DVec3::new(sin * (TAU * u).sin(), cos, -sin * (TAU * u).cos())
}

/// ∫ f(ω) dω over the sphere, by the middles of a fine grid.
fn over_sphere(f: impl Fn(DVec3) -> f64) -> f64 {
    let (width, height) = (720, 360);
    let mut sum = 0.0;
    for row in 0..height {
        let edge = |row: u32| (PI * f64::from(row) / f64::from(height)).cos();
        let solid_angle = (edge(row) - edge(row + 1)) * TAU / f64::from(width);
        let y = 0.5 * (edge(row) + edge(row + 1));
        for column in 0..width {
            let (sin, cos) = (TAU * (f64::from(column) + 0.5) / f64::from(width)).sin_cos();
            let flat = (1.0 - y * y).sqrt();
            sum += solid_angle * f(DVec3::new(flat * sin, y, -flat * cos));
        }
    }
    sum
}

fn random_map(random: &mut Random, width: u32, height: u32) -> Image {
    map(width, height, |_| {
        // Some are black, and some are suns.
        let power = [0.0, 1.0, 1.0, 1.0, 40.0][random.below(5) as usize];
        power * Vec3::new(random.unit(), random.unit(), random.unit())
    })
}

#[test]
fn texels_are_where_their_middles_are_and_light_is_bilinear_between() {
    let mut random = Random::new(1);
    let (width, height) = (12, 7);
    let image = random_map(&mut random, width, height);
    let texel = |x: i64, y: i64| {
        let x = x.rem_euclid(i64::from(width));
        let y = y.clamp(0, i64::from(height) - 1);
        image.pixels[(y * i64::from(width) + x) as usize].as_dvec3()
    };
    for rotate_deg in [0.0, 90.0, -37.5, 360.0] {
        let sky = Sky::new(image.clone(), rotate_deg).unwrap();
        let turn = glam::DQuat::from_rotation_y(f64::from(rotate_deg).to_radians());
        let offs = (0..2000).map(|_| {
            let x = f64::from(random.unit()) * 12.0 - 0.5;
            let y = f64::from(random.unit()) * 7.0 - 0.5;
            let direction = turn * direction_of(x, y, width, height);
            let (left, top) = (x.floor() as i64, y.floor() as i64);
            let between = |a: DVec3, b: DVec3, share: f64| a + share * (b - a);
            let row = |y: i64| between(texel(left, y), texel(left + 1, y), x - x.floor());
            let expected = between(row(top), row(top + 1), y - y.floor());
            let found = sky.radiance(direction.as_vec3()).as_dvec3();
            (found - expected).abs().largest()
        });
        let off = offs.worst();
        assert!(off < 2e-3, "{rotate_deg}: {off}");
    }
    // Mitsuba's axes: the map's middle column is at +z, a quarter of it at +x.
    let quarter = map(4, 2, |index| Vec3::splat((index % 4) as f32));
    let sky = Sky::new(quarter, 0.0).unwrap();
    let flat = |x: f32, z: f32| sky.radiance(Vec3::new(x, 0.0, z).normalize()).x;
    assert!((flat(1.0, -1.0) - 0.0).abs() < 1e-5 && (flat(1.0, 1.0) - 1.0).abs() < 1e-5);
    assert!((flat(-1.0, 1.0) - 2.0).abs() < 1e-5);
}

/// Densities integrate to 1 and are those of the samples; the mean of L over density is ∫ L.
#[test]
fn directions_are_drawn_by_their_density() {
    let mut random = Random::new(2);
    for (width, height, rotate_deg) in [(2, 2, 0.0), (16, 8, 30.0), (61, 30, -120.0)] {
        let sky = Sky::new(random_map(&mut random, width, height), rotate_deg).unwrap();
        let all = over_sphere(|direction| sky.density(direction.as_vec3()).into());
        assert!((all - 1.0).abs() < 0.02, "{width}: {all}");
        let expected = over_sphere(|direction| sky.radiance(direction.as_vec3()).y.into());
        let (mut sum, mut different) = (0.0, 0);
        let count = 200_000;
        for _ in 0..count {
            let sample = sky.sample([random.unit(), random.unit()]);
            assert!((sample.direction.length() - 1.0).abs() < 1e-5);
            let density = sky.density(sample.direction);
            different += u32::from((density / sample.density - 1.0).abs() > 1e-3);
            sum += f64::from(sky.radiance(sample.direction).y / sample.density);
        }
        let found = sum / f64::from(count);
        println!("{width}: {found} for {expected}, {different} on edges");
        assert!(
            (found / expected - 1.0).abs() < 0.02,
            "{found} for {expected}"
        );
        // A sample at the edge of a texel may be in the next by rounding.
        assert!(different * 200 < count, "{different}");
    }
    // Each quarter of a texel has as many as its density says.
    let sky = Sky::new(random_map(&mut random, 12, 6), 0.0).unwrap();
    let (width, height, count) = (24u32, 12u32, 100_000u32);
    let mut shares = vec![0.0; (width * height) as usize];
    for _ in 0..count {
        let direction = sky
            .sample([random.unit(), random.unit()])
            .direction
            .as_dvec3();
        let u = direction.x.atan2(-direction.z).rem_euclid(TAU) / TAU;
        let v = direction.y.acos() / PI;
        let [column, row] = [u * f64::from(width), v * f64::from(height)].map(|at| at as u32);
        let bin = row.min(height - 1) * width + column.min(width - 1);
        shares[bin as usize] += 1.0 / f64::from(count);
    }
    let fine = 8;
    let expected = |bin: u32| -> f64 {
        let (left, top) = (bin % width * fine, bin / width * fine);
        let at = |index: u32| {
            let (x, y) = (left + index % fine, top + index / fine);
            let edge = |row: u32| (PI * f64::from(row) / f64::from(height * fine)).cos();
            let solid_angle = (edge(y) - edge(y + 1)) * TAU / f64::from(width * fine);
            let direction = direction_of(x.into(), y.into(), width * fine, height * fine);
            solid_angle * f64::from(sky.density(direction.as_vec3()))
        };
        (0..fine * fine).map(at).sum()
    };
    let off: f64 = (0..)
        .zip(&shares)
        .map(|(bin, share)| (share - expected(bin)).abs())
        .sum();
    println!("{off} in the wrong quarters of texels");
    assert!(off < 0.06, "{off}");
    let black = Sky::new(map(4, 4, |_| Vec3::ZERO), 0.0).unwrap();
    let sample = black.sample([0.3, 0.7]);
    assert!(sample.density > 0.0 && sample.direction.is_finite() && black.is_black());
}

/// A plane in the open, seen from above.
fn plane(sky: Sky) -> Scene {
    let mut scene = scene(Vec3::new(0.0, 3.0, 0.1), Vec3::ZERO, 30.0);
    let floor = quad(Vec3::new(-5.0, 0.0, 5.0), Vec3::X * 10.0, Vec3::Z * -10.0);
    add(&mut scene, lambert(0.5), floor);
    scene.environment = sky.into();
    scene
}

/// A disc of radiance 1, so wide (°), at 40° above the horizon.
fn disc(width: u32, diameter_deg: f64) -> Image {
    let middle = DVec3::new(0.3, 40f64.to_radians().tan(), -0.9).normalize();
    let least = (0.5 * diameter_deg).to_radians().cos();
    let height = width / 2;
    map(width, height, |index| {
        let (x, y) = (index as u32 % width, index as u32 / width);
        let is_in = direction_of(x.into(), y.into(), width, height).dot(middle) >= least;
        Vec3::splat(if is_in { 1.0 } else { 0.0 })
    })
}

fn settings(spp: u32) -> Settings {
    Settings {
        width: 8,
        height: 8,
        bounces: Bounces::Count(1),
        sampling: Sampling::Fixed { spp },
        ..Settings::default()
    }
}

fn mean(image: &Image) -> f64 {
    let sum: f64 = image.pixels.iter().map(|pixel| f64::from(pixel.y)).sum();
    sum / image.pixels.len() as f64
}

/// E = ∫ L cos θ dω, whatever the map; noise of a small sun is no more than of a wide sky.
#[test]
fn a_plane_in_the_open_has_the_irradiance_of_its_sky() {
    let gradient = map(64, 32, |index| {
        Vec3::splat(1.0 - (index / 64) as f32 / 32.0)
    });
    let mut random = Random::new(3);
    let maps = [
        ("constant", map(8, 4, |_| Vec3::ONE), 40.0),
        ("gradient", gradient, 0.0),
        ("noise", random_map(&mut random, 40, 20), 77.0),
        ("sun of 5°", disc(512, 5.0), 10.0),
        ("sun of 0.5°", disc(4096, 0.5), 200.0),
    ];
    for (name, image, rotate_deg) in maps {
        let sky = Sky::new(image.clone(), rotate_deg).unwrap();
        // By each texel's own bilinear light, so that a small sun is met.
        let [width, height] = [image.width, image.height];
        let fine = if width > 1000 { 4 } else { 16 };
        let mut expected = 0.0;
        for row in 0..height * fine {
            let edge = |row: u32| (PI * f64::from(row) / f64::from(height * fine)).cos();
            let y = 0.5 * (edge(row) + edge(row + 1));
            if y <= 0.0 {
                break;
            }
            let solid_angle = (edge(row) - edge(row + 1)) * TAU / f64::from(width * fine);
            let texel_row = row / fine;
            let is_black = |row: u32| {
                let begin = (row * width) as usize;
                let texels = &image.pixels[begin..begin + width as usize];
                texels.iter().all(|texel| *texel == Vec3::ZERO)
            };
            let near = [
                texel_row.saturating_sub(1),
                texel_row,
                (texel_row + 1).min(height - 1),
            ];
            if near.into_iter().all(is_black) {
                continue;
            }
            let flat = (1.0 - y * y).sqrt();
            for column in 0..width * fine {
                let (sin, cos) =
                    (TAU * (f64::from(column) + 0.5) / f64::from(width * fine)).sin_cos();
                let direction = DVec3::new(flat * sin, y, -flat * cos).as_vec3();
                expected += solid_angle * y * f64::from(sky.radiance(direction).y);
            }
        }
        let scene = plane(sky);
        let rendered = render(&scene, &settings(4096), &|_| ()).unwrap();
        let found = mean(&rendered.light.irradiance);
        println!("{name}: {found} for {expected}");
        assert!(
            (found / expected - 1.0).abs() < 1e-3,
            "{name}: {found} for {expected}"
        );
    }
}

/// Root mean square over the mean of what pixels have of a plane's irradiance, which is the same
/// everywhere.
#[test]
fn a_small_sun_has_little_noise() {
    // What is left of a wide one is its cosine.
    for (diameter_deg, most) in [(40.0, 0.05), (5.0, 0.01), (0.5, 0.002)] {
        let scene = plane(Sky::new(disc(4096, diameter_deg), 0.0).unwrap());
        let rendered = render(&scene, &settings(16), &|_| ()).unwrap();
        let all = &rendered.light.irradiance;
        let middle = mean(all);
        let squares = all
            .pixels
            .iter()
            .map(|pixel| (f64::from(pixel.y) / middle - 1.0).powi(2));
        let noise = (squares.sum::<f64>() / all.pixels.len() as f64).sqrt();
        println!("{diameter_deg}°: {noise}");
        assert!(noise < most, "{diameter_deg}°: {noise}");
    }
}

/// The same picture, whether the map or the scene is turned.
#[test]
fn a_turned_map_is_a_turned_scene() {
    let mut random = Random::new(4);
    let image = random_map(&mut random, 24, 12);
    let angle = 70f32;
    let room = |turn: glam::Quat| {
        let mut scene = scene(turn * Vec3::new(0.0, 1.5, 3.0), Vec3::ZERO, 50.0);
        let floor = quad(Vec3::new(-1.0, 0.0, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0);
        let wall = quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Y * 1.5);
        for (albedo, corners) in [(0.8, floor), (0.5, wall)] {
            let turned = corners.map(|triangle| {
                triangle.map(|(place, normal, uv)| (turn * place, turn * normal, uv))
            });
            add(&mut scene, lambert(albedo), turned);
        }
        scene
    };
    let light = |mut scene: Scene, rotate_deg: f32| {
        scene.environment = Sky::new(image.clone(), rotate_deg).unwrap().into();
        let how = Settings {
            width: 16,
            height: 12,
            bounces: Bounces::Count(2),
            ..settings(1024)
        };
        render(&scene, &how, &|_| ()).unwrap().diffuse
    };
    let turn = glam::Quat::from_rotation_y(angle.to_radians());
    let [found, expected] = [
        light(room(turn), angle),
        light(room(glam::Quat::IDENTITY), 0.0),
    ];
    let pairs = found.pixels.iter().zip(&expected.pixels);
    let squares: f64 = pairs.map(|(a, b)| f64::from((*a - *b).y).powi(2)).sum();
    let noise = (squares / found.pixels.len() as f64).sqrt() / mean(&expected);
    let means = mean(&found) / mean(&expected) - 1.0;
    println!("{means} in all, {noise} a pixel");
    assert!(mean(&expected) > 0.1);
    assert!(means.abs() < 5e-3 && noise < 0.05, "{means} {noise}");
}

/// A scene file with a plane and this environment.
fn load(folder: &Path, environment: &str) -> Result<Scene, String> {
    let obj = "v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nf 1 2 3 4\n";
    std::fs::write(folder.join("plane.obj"), obj).unwrap();
    let text = format!("[[model]]\npath = \"plane.obj\"\n\n[environment]\n{environment}\n");
    std::fs::write(folder.join("scene.toml"), text).unwrap();
    Scene::load(&folder.join("scene.toml"), &LoadOptions::default())
        .map_err(|error| error.to_string())
}

#[test]
fn maps_are_read_of_files_and_written_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = Random::new(5);
    let image = random_map(&mut random, 8, 4);
    write_exr(&folder.path().join("sky.exr"), &image).unwrap();
    let scene = load(
        folder.path(),
        "map = \"sky.exr\"\nscale = 2.0\nrotate_deg = -90.0",
    )
    .unwrap();
    let sky = scene.environment.sky().cloned().unwrap();
    assert_eq!((sky.rotate_deg(), sky.scale()), (270.0, 2.0));
    let pairs = sky.image().pixels.iter().zip(&image.pixels);
    assert!(pairs.clone().all(|(found, given)| found == given));
    let twice = Sky::new(image.clone(), 270.0).unwrap();
    assert_eq!(sky.radiance(Vec3::X), 2.0 * twice.radiance(Vec3::X));
    assert!(scene.is_lit() && scene.files.iter().any(|file| file.ends_with("sky.exr")));
    let again = folder.path().join("again");
    let again = Scene::load(&scene.write(&again).unwrap(), &LoadOptions::default()).unwrap();
    assert_eq!(again.environment, scene.environment);
    assert_eq!(again.content_hash(), scene.content_hash());
    let mut other = scene.clone();
    other.environment = sky.with(2.0, 80.0).into();
    assert_ne!(other.content_hash(), scene.content_hash());
    // A constant takes its place, and the other way round.
    other
        .overlay("sky", "environment = { radiance = [1.0, 1.0, 1.0] }")
        .unwrap();
    assert_eq!(other.environment, Vec3::ONE.into());
    // Radiance with a common exponent.
    let texels: Vec<image::Rgb<f32>> = vec![image::Rgb([0.5, 4.0, 1.0]); 8];
    let file = std::fs::File::create(folder.path().join("sky.hdr")).unwrap();
    image::codecs::hdr::HdrEncoder::new(file)
        .encode(&texels, 4, 2)
        .unwrap();
    let scene = load(folder.path(), "map = \"sky.hdr\"").unwrap();
    let found = scene.environment.radiance(Vec3::Y);
    assert!(
        (found - Vec3::new(0.5, 4.0, 1.0))
            .as_dvec3()
            .abs()
            .largest()
            < 0.05,
        "{found}"
    );
}

#[test]
fn what_is_wrong_with_a_map_is_told_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let written = |name: &str, width: u32, height: u32, texel: fn(usize) -> Vec3| {
        write_exr(&folder.path().join(name), &map(width, height, texel)).unwrap();
    };
    written("bad.exr", 4, 2, |index| match index {
        5 => Vec3::new(1.0, -2.0, 0.0),
        6 => Vec3::splat(f32::NAN),
        _ => Vec3::ONE,
    });
    written("thin.exr", 4, 1, |_| Vec3::ONE);
    written("bright.exr", 4, 2, |_| Vec3::splat(1e30));
    std::fs::write(folder.path().join("sky.png"), "no map").unwrap();
    std::fs::write(folder.path().join("broken.hdr"), "no map").unwrap();
    for (environment, words) in [
        (
            "map = \"bad.exr\"",
            "bad.exr: 2 texels are negative, infinite or no number; the first is at column 1, \
             row 1: 1, -2, 0",
        ),
        (
            "map = \"thin.exr\"",
            "the map has 4×1 texels; sides have 2 to 16384",
        ),
        (
            "map = \"sky.png\"",
            "it is neither an .exr nor an .hdr file",
        ),
        ("map = \"broken.hdr\"", "broken.hdr: "),
        (
            "map = \"none.exr\"",
            "scene.toml:5: `environment.map` names `none.exr`, which is no file",
        ),
        (
            "radiance = [1.0, 1.0, 1.0]\nmap = \"bad.exr\"",
            "scene.toml:6: `environment` is given twice",
        ),
        (
            "radiance = [1.0, 1.0, 1.0]\nscale = 2.0",
            "`environment.scale` is of a map, and there is none",
        ),
        (
            "radiance = [1.0, 1.0, 1.0]\nsplit_sun = true",
            "`environment.split_sun` is of a map, and there is none",
        ),
        ("", "`environment` has no radiance, no map and no clear sky"),
        (
            "map = \"bad.exr\"\nrotate_deg = 400.0",
            "`environment.rotate_deg` is 400",
        ),
        (
            "clear_sky = { turbidity = 0.5 }",
            "scene.toml:5: `environment.clear_sky.turbidity` is 0.5",
        ),
        (
            "clear_sky = { sun_height_deg = 95.0 }",
            "`environment.clear_sky.sun_height_deg` is 95",
        ),
        (
            "clear_sky = { ground = [0.1, 1.5, 0.1] }",
            "environment.clear_sky.ground",
        ),
        ("clear_sky = { clouds = 3 }", "unknown field `clouds`"),
        (
            "map = \"bright.exr\"\nscale = 1e12",
            "`scale = 1000000000000` makes texels too bright",
        ),
        (
            "map = \"bad.exr\"\nscale = -1.0",
            "`environment.scale` is -1",
        ),
    ] {
        let error = load(folder.path(), environment).unwrap_err();
        assert!(error.contains(words), "{environment}: {error}");
    }
}

/// Metal mirrors a map as its lobe says, also where a small sun is in it: both ways of drawing
/// agree with scattering alone, of which a smooth map has little noise.
#[test]
fn a_mirror_shows_the_sky() {
    let gradient = map(64, 32, |index| {
        Vec3::splat(2.0 - (index / 64) as f32 / 16.0)
    });
    let metal = Material {
        albedo: Vec3::ZERO,
        specular: Some(lumivox::scene::Specular {
            f0: Vec3::ONE,
            roughness: 0.05,
            metalness: 0.0,
            texture: None,
        }),
        ..Material::default()
    };
    let mut scene = scene(Vec3::new(0.0, 2.0, 2.0), Vec3::ZERO, 10.0);
    let floor = quad(Vec3::new(-5.0, 0.0, 5.0), Vec3::X * 10.0, Vec3::Z * -10.0);
    add(&mut scene, metal, floor);
    scene.environment = Sky::new(gradient, 0.0).unwrap().into();
    let rendered = render(&scene, &settings(1024), &|_| ()).unwrap();
    let found = mean(&rendered.light.specular);
    let mirrored = Vec3::new(0.0, 1.0, -1.0).normalize();
    let expected = f64::from(scene.environment.radiance(mirrored).y);
    println!("{found} for {expected}");
    assert!(
        (found / expected - 1.0).abs() < 0.01,
        "{found} for {expected}"
    );
}

/// Where the sun is, its light by haze and height, the ground's, and the round trip of the text.
#[test]
fn a_clear_sky_has_its_sun_and_its_ground() {
    let luminance = lumivox::image::luminance;
    let mut last = f32::INFINITY;
    for (sun_height_deg, turbidity) in [(80.0, 2.0), (35.0, 3.0), (10.0, 3.0), (8.0, 4.0)] {
        let clear = ClearSky {
            sun_height_deg,
            turbidity,
            ..ClearSky::default()
        };
        let (with, without) = (
            Sky::clear(clear).unwrap(),
            Sky::clear(ClearSky {
                has_sun: false,
                ..clear
            })
            .unwrap(),
        );
        let sun = clear.sun_irradiance();
        // On a facing surface, over the texels around the sun; what the sky adds there is little.
        let image = with.image();
        let (mut facing, mut on_ground) = (DVec3::ZERO, DVec3::ZERO);
        for (index, texel) in image.pixels.iter().enumerate() {
            let (x, y) = (index as u32 % image.width, index as u32 / image.width);
            let edge = |y: u32| (PI * f64::from(y) / f64::from(image.height)).cos();
            let solid_angle = (edge(y) - edge(y + 1)) * TAU / f64::from(image.width);
            let direction = direction_of(x.into(), y.into(), image.width, image.height);
            let cosine = direction.dot(clear.to_sun().as_dvec3());
            if cosine > 1f64.to_radians().cos() {
                facing += solid_angle * cosine * texel.as_dvec3();
            }
            on_ground += solid_angle * direction.y.max(0.0) * texel.as_dvec3();
        }
        let off = (facing / sun.as_dvec3() - 1.0).abs().largest();
        let below = with.radiance(-Vec3::Y).as_dvec3() * PI / on_ground;
        println!("{sun_height_deg}°, {turbidity}: {sun}, off by {off:.4}, ground {below}");
        assert!(off < 0.1, "{off}");
        assert!((below - 0.2).abs().largest() < 2e-3, "{below}");
        // Lower and redder through more air.
        assert!(luminance(sun) < last && sun.x > sun.z, "{sun}");
        last = luminance(sun);
        // Blue overhead, brightest about the sun; no brighter than the sun without its disc.
        let zenith = without.radiance(Vec3::Y);
        assert!(
            zenith.z > zenith.x && zenith.min_element() > 0.0,
            "{zenith}"
        );
        let to_sun = clear.to_sun();
        let beside = without.radiance(to_sun);
        assert!(luminance(beside) > luminance(zenith) || sun_height_deg > 70.0);
        assert!(luminance(with.radiance(to_sun)) > 1e3 * luminance(beside));
        let folder = tempfile::tempdir().unwrap();
        let wanted = with.with(0.5, 30.0).into();
        let text = lumivox::scene::environment_toml(&wanted).unwrap();
        let mut scene = load(folder.path(), "radiance = [1.0, 1.0, 1.0]").unwrap();
        scene.overlay("text", &text).unwrap();
        assert_eq!(scene.environment, wanted);
        let again = folder.path().join("again");
        let again = Scene::load(&scene.write(&again).unwrap(), &LoadOptions::default()).unwrap();
        assert_eq!(again.environment, scene.environment);
        assert!(!folder.path().join("again/sky.exr").exists());
    }
}
