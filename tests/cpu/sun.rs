//! The sun of a map, taken out to be a light.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use lumivox::image::Image;
use lumivox::scene::{ClearSky, Scene, Sky};

use crate::support::Random;
use crate::support::compare::Worst;

/// Irradiance of a surface that faces a direction, summed over places of texels.
fn irradiance(sky: &Sky, normal: DVec3) -> DVec3 {
    let (rows, columns) = (1024, 2048);
    let mut sum = DVec3::ZERO;
    for row in 0..rows {
        let edge = |row: u32| (PI * f64::from(row) / f64::from(rows)).cos();
        let solid_angle = (edge(row) - edge(row + 1)) * 2.0 * PI / f64::from(columns);
        let (flat, up) = (PI * (f64::from(row) + 0.5) / f64::from(rows)).sin_cos();
        for column in 0..columns {
            let turn = 2.0 * PI * (f64::from(column) + 0.5) / f64::from(columns);
            let direction = DVec3::new(flat * turn.sin(), up, -flat * turn.cos());
            let cosine = direction.dot(normal);
            if cosine > 0.0 {
                sum += cosine * solid_angle * sky.radiance(direction.as_vec3()).as_dvec3();
            }
        }
    }
    sum
}

/// A sky with a disc of light, soft by half a texel.
fn with_disc(to_sun: Vec3, width_deg: f32, times: f32) -> Sky {
    let (width, height) = (512, 256);
    let image = Image::from_fn(width, height, |index| {
        let u = (index as u32 % width) as f32 + 0.5;
        let v = (index as u32 / width) as f32 + 0.5;
        let (flat, up) = (v / height as f32 * std::f32::consts::PI).sin_cos();
        let (sin, cos) = (u / width as f32 * std::f32::consts::TAU).sin_cos();
        let direction = Vec3::new(flat * sin, up, -flat * cos);
        let off_deg = direction.angle_between(to_sun).to_degrees() - 0.5 * width_deg;
        let part = (0.5 - off_deg / 0.7).clamp(0.0, 1.0);
        let sky = Vec3::new(0.3, 0.5, 0.8) * (1.0 + 0.5 * up);
        sky + part * times * Vec3::new(1.0, 0.9, 0.7)
    });
    Sky::new(image, 0.0).unwrap()
}

/// The brightest disc becomes a light: where it was, as bright as it was, wherever it is in the map
/// and however the map is turned. What is left has no trace of it.
#[test]
fn the_sun_of_a_map_becomes_a_light() {
    let mut random = Random::new(21);
    let mut places = vec![
        Vec3::Y,
        Vec3::NEG_Z,
        Vec3::new(0.01, -0.3, -1.0).normalize(),
    ];
    places.extend((0..3).map(|_| {
        let mut number = || random.unit() - 0.5;
        Vec3::new(number(), number(), number()).normalize()
    }));
    for (number, to_sun) in (0..).zip(places) {
        let width_deg = 1.0 + 2.0 * number as f32;
        let whole = with_disc(to_sun, width_deg, 300.0).with(0.7, 30.0 * number as f32);
        let split = whole.split_sun().unwrap();
        let (found, _, facing) = split.sun().unwrap().sample(Vec3::ZERO);
        let turn = glam::Quat::from_rotation_y(whole.rotate_deg().to_radians());
        let off_deg = found.angle_between(turn * to_sun).to_degrees();
        let normals = [found.as_dvec3(), DVec3::Y, DVec3::new(0.6, 0.0, 0.8)];
        let offs = normals.map(|normal| {
            let before = irradiance(&whole, normal);
            let cosine = normal.dot(found.as_dvec3());
            // A disc has part of its light where a floor touches it, and its middle has not.
            if cosine.abs() < 0.15 {
                return 0.0;
            }
            let cosine = cosine.max(0.0);
            let after = irradiance(&split, normal) + cosine * facing.as_dvec3();
            let off = ((after - before) / before).abs();
            off.to_array().into_iter().worst()
        });
        let left = split.radiance(found).y / (0.7 * 0.5);
        println!(
            "{width_deg}° at {to_sun}: off by {off_deg:.4}°, light by {offs:.5?}, left {left}"
        );
        assert!(off_deg < 0.05 && offs.iter().all(|off| *off < 1e-3));
        assert!((0.4..1.6).contains(&left), "{left}");
        assert!(split.split_sun().is_none() && split.whole() == whole);
    }
}

/// Nothing is taken out of a sky that has no small bright disc.
#[test]
fn skies_without_a_sun_stay_whole() {
    let white = Image::from_fn(64, 32, |_| Vec3::ONE);
    let black = Image::from_fn(64, 32, |_| Vec3::ZERO);
    for image in [white, black] {
        assert!(Sky::new(image, 0.0).unwrap().split_sun().is_none());
    }
    assert!(with_disc(Vec3::X, 30.0, 300.0).split_sun().is_none());
    assert!(with_disc(Vec3::X, 3.0, 1.0).split_sun().is_none());
    let overcast = ClearSky {
        has_sun: false,
        ..ClearSky::default()
    };
    assert!(Sky::clear(overcast).unwrap().split_sun().is_none());
}

/// The sun of a clear sky is where the model has it and as bright; a scene file asks for it, an
/// overlay may turn it, and it leaves with its sky.
#[test]
fn scenes_split_the_sun_off() {
    let mut scene = Scene::bundled("atrium", &[]).unwrap();
    let before = scene.lights.clone();
    let sky = |more: &str| {
        let height = "environment.clear_sky.sun_height_deg = 40.0\n";
        format!("{height}environment.scale = 0.02\n{more}")
    };
    let take = |scene: &mut Scene, more: &str| {
        scene.overlay("test", &sky(more)).unwrap();
        scene.lights.clone()
    };
    let lights = take(&mut scene, "environment.split_sun = true");
    assert_eq!(lights.len(), before.len() + 1);
    let clear = ClearSky {
        sun_height_deg: 40.0,
        ..ClearSky::default()
    };
    let (to_sun, _, facing) = lights[before.len()].sample(Vec3::ZERO);
    let off_deg = to_sun.angle_between(clear.to_sun()).to_degrees();
    let off = (facing / (0.02 * clear.sun_irradiance()) - 1.0).abs();
    let off = off.to_array().into_iter().worst();
    println!("off by {off_deg}° and {off}");
    assert!(off_deg < 0.02 && off < 1e-3, "{off_deg}° {off}");
    let width_deg = scene.environment.sky().unwrap().sun_width_deg().unwrap();
    assert!((width_deg - 0.533).abs() < 0.01, "{width_deg}°");
    let turned = take(
        &mut scene,
        "environment.split_sun = true\nenvironment.rotate_deg = 90.0",
    );
    assert_eq!(turned.len(), before.len() + 1);
    let (to_sun, ..) = turned[before.len()].sample(Vec3::ZERO);
    assert!((to_sun.x - clear.to_sun().z).abs() < 1e-3, "{to_sun}");
    assert_eq!(take(&mut scene, ""), before);
}
