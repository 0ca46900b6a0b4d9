//! What is clear, in the reference: closed forms of a slab, a ball lens and a sheet.

use glam::{DVec3, Vec2, Vec3};
use lumivox::image::Image;
use lumivox::reference::{Bounces, Filter, ReferenceImage, Sampling, Settings, render};
use lumivox::scene::{Light, Material, Scene, Sky, Transmission};

use crate::reference::{add, lambert, quad, scene};

type Corners = [(Vec3, Vec3, Vec2); 3];

fn glass(share: f32, filter: Vec3, index: f32) -> Material {
    Material {
        transmission: Some(Transmission {
            share,
            filter,
            index,
        }),
        ..lambert(0.5)
    }
}

fn trace(scene: &Scene, size: u32, spp: u32) -> ReferenceImage {
    let settings = Settings {
        width: size,
        height: size,
        bounces: Bounces::Count(1),
        filter: Filter::Center,
        sampling: Sampling::Fixed { spp },
        seed: 3,
        ..Settings::default()
    };
    render(scene, &settings, &|_| {}).unwrap()
}

/// Both sides of a slab from z = -thick to 0, fronts outwards. Its edges are far away.
fn slab(thick: f32) -> Vec<Corners> {
    let half = 50.0;
    let front = quad(
        Vec3::new(-half, -half, 0.0),
        Vec3::X * 2.0 * half,
        Vec3::Y * 2.0 * half,
    );
    let back = quad(
        Vec3::new(half, -half, -thick),
        Vec3::X * -2.0 * half,
        Vec3::Y * 2.0 * half,
    );
    [front, back].concat()
}

/// Reflectance of unpolarised light that comes from air, by the angle (Fresnel; Born & Wolf 1.5.2).
fn fresnel(cosine: f64, index: f64) -> f64 {
    let inside = (1.0 - (1.0 - cosine * cosine) / (index * index)).sqrt();
    let across = (cosine - index * inside) / (cosine + index * inside);
    let within = (index * cosine - inside) / (index * cosine + inside);
    0.5 * (across * across + within * within)
}

/// A camera at z = 3 that looks down the z axis at an angle.
fn before_glass(degrees: f32) -> Scene {
    let eye = Vec3::new(0.0, 0.0, 3.0);
    let (sin, cos) = degrees.to_radians().sin_cos();
    scene(eye, eye + Vec3::new(sin, 0.0, -cos), 0.5)
}

/// T = T_f (1 − F)/(1 + F) of a slab whose interfaces mirror F, all orders added up; the same light
/// on both sides is seen unchanged where nothing is filtered.
#[test]
fn a_slab_lets_through_what_fresnel_leaves() {
    let filter = Vec3::new(0.9, 0.5, 0.2);
    for (degrees, index) in [(0.0f32, 1.5f32), (45.0, 1.5), (70.0, 1.3), (80.0, 2.0)] {
        let mut room = before_glass(degrees);
        add(&mut room, glass(1.0, filter, index), slab(0.3));
        let lamp = Material {
            emission: Vec3::ONE,
            ..lambert(0.0)
        };
        let wall = quad(
            Vec3::new(-90.0, -90.0, -2.0),
            Vec3::X * 180.0,
            Vec3::Y * 180.0,
        );
        add(&mut room, lamp, wall);
        let seen = trace(&room, 8, 4096);
        let found = seen.light.specular.pixels.iter().sum::<Vec3>() / 64.0;
        let mirrored = fresnel(f64::from(degrees.to_radians().cos()), index.into());
        let clear = (1.0 - mirrored) / (1.0 + mirrored);
        for channel in 0..3 {
            let expected = f64::from(filter[channel]) * clear;
            let off = f64::from(found[channel]) / expected - 1.0;
            assert!(
                off.abs() < 0.005,
                "{degrees}°, {index}: {found}, {expected}"
            );
        }
        assert!(
            seen.direct
                .pixels
                .iter()
                .all(|direct| *direct == Vec3::ZERO)
        );
    }
    let mut alone = before_glass(50.0);
    alone.environment = Vec3::ONE.into();
    add(&mut alone, glass(1.0, Vec3::ONE, 1.7), slab(0.3));
    let seen = trace(&alone, 8, 64);
    // ρ/π of the irradiance is the diffuse term, of which the clear share has none.
    let irradiance = &seen.light.irradiance.pixels;
    assert!(irradiance.iter().all(|one| *one == Vec3::ZERO));
    let seen = seen.radiance();
    let is_near = |pixel: &Vec3| pixel.abs_diff_eq(Vec3::ONE, 1e-4);
    assert!(seen.pixels.iter().all(is_near));
}

/// A ray is displaced by h sin θ (1 − cos θ/(n cos θ')) across its direction: an edge on the wall
/// behind is seen where that says.
#[test]
fn a_slab_displaces_what_is_behind_it() {
    let (thick, index, far) = (1.5f64, 1.6f64, 2.0f64);
    for degrees in [20.0f64, 50.0, 70.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let inside = (1.0 - sin * sin / (index * index)).sqrt();
        let tan = sin / cos;
        // Where the ray in the picture's middle meets the wall: along x.
        let behind = 3.0 * tan + thick * (sin / index) / inside + (far - thick) * tan;
        for (shift, expected) in [(-0.01, 1.0), (0.01, 0.0)] {
            let mut room = before_glass(degrees as f32);
            add(
                &mut room,
                glass(1.0, Vec3::ONE, index as f32),
                slab(thick as f32),
            );
            let lamp = Material {
                emission: Vec3::ONE,
                ..lambert(0.0)
            };
            let edge = (behind + shift) as f32;
            let wall = quad(
                Vec3::new(edge, -40.0, -far as f32),
                Vec3::X * 80.0,
                Vec3::Y * 80.0,
            );
            add(&mut room, lamp, wall);
            room.camera.vfov_deg = 0.01;
            let seen = trace(&room, 8, 256).light.specular;
            let mean = seen.pixels.iter().map(|pixel| pixel.x).sum::<f32>() / 64.0;
            let is_seen = f64::from(u8::from(mean > 0.4));
            assert_eq!(is_seen, expected, "{degrees}°, {shift}: {mean}");
        }
    }
}

/// A unit sphere of 8 · 4⁷ triangles with smooth normals.
fn ball() -> Vec<Corners> {
    let mut faces: Vec<[Vec3; 3]> = Vec::new();
    for (x, y, z) in (0..8).map(|i| (i & 1, i >> 1 & 1, i >> 2)) {
        let [x, y, z] = [(x, Vec3::X), (y, Vec3::Y), (z, Vec3::Z)]
            .map(|(is_back, axis)| axis * (1 - 2 * is_back) as f32);
        faces.push(if x.cross(y).dot(z) > 0.0 {
            [x, y, z]
        } else {
            [x, z, y]
        });
    }
    for _ in 0..7 {
        let split = |[a, b, c]: [Vec3; 3]| {
            let [ab, bc, ca] = [(a + b), (b + c), (c + a)].map(Vec3::normalize);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(split).collect();
    }
    let corners = |face: [Vec3; 3]| face.map(|point| (point, point, Vec2::ZERO));
    faces.into_iter().map(corners).collect()
}

/// What a ball of an index shows of a sky along a ray, order by order of its inner reflections.
fn through_ball(eye: DVec3, along: DVec3, index: f64, sky: &Sky) -> Option<f64> {
    let nearest = -eye.dot(along);
    let squared = 1.0 - (eye.length_squared() - nearest * nearest);
    // The rim of a ball of triangles is another.
    if squared < 0.06 {
        return None;
    }
    let at_sky = |direction: DVec3| f64::from(sky.radiance(direction.normalize().as_vec3()).x);
    let enters = eye + (nearest - squared.sqrt()) * along;
    let cosine = -enters.dot(along);
    let mirrored = fresnel(cosine, index);
    let bend = |direction: DVec3, normal: DVec3, eta: f64| {
        let cosine = -normal.dot(direction);
        let inside = (1.0 - eta * eta * (1.0 - cosine * cosine)).sqrt();
        eta * direction + (eta * cosine - inside) * normal
    };
    let mut sum = mirrored * at_sky(along + 2.0 * cosine * enters);
    let (mut place, mut inner) = (enters, bend(along, enters, 1.0 / index));
    let mut left = 1.0 - mirrored;
    for _ in 0..24 {
        place = (place - 2.0 * place.dot(inner) * inner).normalize();
        sum += left * (1.0 - mirrored) * at_sky(bend(inner, -place, index));
        inner = (inner - 2.0 * inner.dot(place) * place).normalize();
        left *= mirrored;
    }
    Some(sum)
}

#[test]
fn a_ball_lens_shows_the_sky_as_its_rays_do() {
    let size = 24;
    for index in [1.33f32, 1.5, 2.0] {
        let mut room = scene(Vec3::new(0.0, 0.0, 8.0), Vec3::ZERO, 16.0);
        let map = Image::from_fn(256, 128, |at| {
            let (x, y) = (at % 256, at / 256);
            let turn = std::f32::consts::TAU * x as f32 / 256.0;
            Vec3::splat(1.0 + 0.3 * turn.cos() + 0.004 * y as f32)
        });
        let sky = Sky::new(map, 0.0).unwrap();
        room.environment = sky.clone().into();
        add(&mut room, glass(1.0, Vec3::ONE, index), ball());
        let seen = trace(&room, size, 1024).radiance();
        let [right, up, forward] = room.camera.basis().map(|axis| axis.as_dvec3());
        let tan = f64::from(0.5 * room.camera.vfov_deg.to_radians()).tan();
        let (mut worst, mut squares, mut count) = (0.0f64, 0.0, 0u32);
        for y in 0..size {
            for x in 0..size {
                let ndc = |at: u32| 2.0 * (f64::from(at) + 0.5) / f64::from(size) - 1.0;
                let along = (forward + tan * (ndc(x) * right - ndc(y) * up)).normalize();
                let eye = room.camera.eye.as_dvec3();
                let Some(expected) = through_ball(eye, along, index.into(), &sky) else {
                    continue;
                };
                let found = f64::from(seen.pixels[(x + size * y) as usize].x);
                let off = (found / expected - 1.0).abs();
                (worst, squares, count) = (worst.max(off), squares + off * off, count + 1);
            }
        }
        let rms = (squares / f64::from(count)).sqrt();
        println!("index {index}: {count} pixels, off by {rms:.5}, at most {worst:.5}");
        assert!(count > 200 && rms < 0.005, "index {index}: {rms}, {worst}");
    }
}

/// A thin sheet filters what is behind it, and the sun's light on the floor; a body of glass lets
/// no straight light through.
#[test]
fn a_sheet_colours_what_is_behind_it_and_its_shadow() {
    let filter = Vec3::new(0.9, 0.4, 0.1);
    for (share, index, passes) in [(1.0f32, 1.0f32, 1.0f32), (0.25, 1.0, 0.25), (1.0, 1.5, 0.0)] {
        let mut room = scene(Vec3::new(0.0, 1.0, 0.0), Vec3::ZERO, 20.0);
        let floor = |y: f32| quad(Vec3::new(-5.0, y, 5.0), Vec3::X * 10.0, Vec3::NEG_Z * 10.0);
        add(&mut room, lambert(0.5), floor(0.0));
        add(&mut room, glass(share, filter, index), floor(2.0));
        room.lights = vec![Light::Directional {
            direction: Vec3::new(0.3, -1.0, 0.1).normalize(),
            irradiance: Vec3::splat(2.0),
        }];
        let seen = trace(&room, 8, 16);
        let cosine = 1.0 / Vec3::new(0.3, -1.0, 0.1).length();
        let expected = passes * filter * 2.0 * cosine * 0.5 / std::f32::consts::PI;
        for direct in &seen.direct.pixels {
            assert!(
                (*direct - expected).length() < 1e-5,
                "{share}, {index}: {direct}"
            );
        }
        if index > 1.0 {
            continue;
        }
        // From above the sheet, a share of it is floor seen through it.
        room.camera.eye = Vec3::new(0.0, 4.0, 0.0);
        let seen = trace(&room, 8, 256);
        let own = seen.direct.pixels.iter().sum::<Vec3>() / 64.0;
        let sheet = (1.0 - share) * Vec3::splat(2.0 * cosine * 0.5 / std::f32::consts::PI);
        assert!((own - sheet).length() < 1e-4, "{share}: {own}, {sheet}");
        let through = seen.light.specular.pixels.iter().sum::<Vec3>() / 64.0;
        let behind = share * filter * expected;
        assert!(
            (through - behind).length() < 0.02 * behind.length(),
            "{share}: {through}, {behind}"
        );
    }
}
