//! Radiosity against closed forms, and against the path tracer, with which it shares the first
//! vertex alone.

use std::f32::consts::PI;

use super::reference::{add, block_errors, lambert, quad, scene};
use crate::support::scenes::bundled;
use glam::{Vec2, Vec3};
use lumivox::reference::{
    Bounces, Filter, Radiosity, RadiositySettings, ReferenceError, Sampling, Settings, render,
    render_radiosity,
};
use lumivox::scene::{Material, Scene, Specular};

fn settings(width: u32, height: u32, bounces: Bounces, sampling: Sampling) -> Settings {
    Settings {
        width,
        height,
        bounces,
        filter: Filter::Center,
        sampling,
        seed: 3,
        ..Settings::default()
    }
}

fn solve(scene: &Scene, bounces: Bounces) -> Radiosity {
    let settings = settings(16, 16, bounces, Sampling::Fixed { spp: 1 });
    Radiosity::solve(scene, &settings, &RadiositySettings::default(), &|_| {}).unwrap()
}

fn emitter(albedo: f32) -> Material {
    Material {
        emission: Vec3::ONE,
        ..lambert(albedo)
    }
}

/// Mean irradiance of the fronts, or backs, of some triangles of equal area [W/m²].
fn mean_of(solved: &Radiosity, triangles: std::ops::Range<u32>, is_back: bool) -> f32 {
    let count = triangles.len() as f32;
    let means = triangles.map(|triangle| solved.mean_irradiance(triangle, is_back).y);
    means.sum::<f32>() / count
}

#[track_caller]
fn assert_near(what: &str, found: f32, expected: f32, share: f32) {
    let off = found / expected - 1.0;
    println!("{what}: {found} of {expected}, {:+.3}%", 100.0 * off);
    assert!(off.abs() < share, "{what}: {found} of {expected}");
}

/// In a closed box that emits e everywhere, the radiance is e / (1 − ρ), whatever the box.
#[test]
fn furnace() {
    for (albedo, emission) in [(0.5_f32, 0.5_f32), (0.9, 2.0)] {
        let furnace = bundled(&format!("furnace,albedo={albedo},emission={emission}"));
        let expected = emission / (1.0 - albedo);
        let solved = solve(&furnace, Bounces::Full);
        let irradiance = mean_of(&solved, 0..furnace.triangles.len() as u32, false);
        assert_near("furnace, E/π", irradiance / PI, expected, 0.005);
        let settings = settings(16, 16, Bounces::Full, Sampling::Fixed { spp: 64 });
        let radiosity = RadiositySettings {
            rays: 256,
            ..RadiositySettings::default()
        };
        let (image, _) = render_radiosity(&furnace, &settings, &radiosity, &|_| {}).unwrap();
        let radiance = image.radiance();
        let mean: f32 = radiance.pixels.iter().map(|pixel| pixel.y).sum();
        let mean = mean / radiance.pixels.len() as f32;
        assert_near("furnace, picture", mean, expected, 0.005);
    }
}

/// A disc about the y axis, of triangles of equal area, whose front looks along `up`.
fn disc(radius_m: f32, y_m: f32, up: f32) -> Vec<[(Vec3, Vec3, Vec2); 3]> {
    const PARTS: u32 = 64;
    // As large as the circle.
    let step = std::f32::consts::TAU / PARTS as f32;
    let radius_m = radius_m * (step / step.sin()).sqrt();
    let corner = |part: u32| {
        let angle = step * part as f32;
        Vec3::new(radius_m * angle.cos(), y_m, radius_m * angle.sin())
    };
    let part = |part: u32| {
        let middle = Vec3::new(0.0, y_m, 0.0);
        let corners = if up > 0.0 {
            [middle, corner(part + 1), corner(part)]
        } else {
            [middle, corner(part), corner(part + 1)]
        };
        corners.map(|position| (position, up * Vec3::Y, Vec2::ZERO))
    };
    (0..PARTS).map(part).collect()
}

/// Two discs about one axis: the closed form of their form factor (J. Howell, *A Catalog of
/// Radiation Heat Transfer Configuration Factors*, C-41).
#[test]
fn two_discs() {
    for (own_m, other_m, apart_m) in [(1.0f32, 1.0f32, 1.0f32), (0.5, 2.0, 0.7), (1.5, 0.4, 2.0)] {
        let mut discs = scene(Vec3::new(0.0, 0.5 * apart_m, 9.0), Vec3::ZERO, 40.0);
        add(&mut discs, lambert(0.5), disc(own_m, 0.0, 1.0));
        add(&mut discs, emitter(0.0), disc(other_m, apart_m, -1.0));
        let [own, other] = [own_m / apart_m, other_m / apart_m];
        let s = 1.0 + (1.0 + other * other) / (own * own);
        let factor = 0.5 * (s - (s * s - 4.0 * (other / own).powi(2)).sqrt());
        let solved = solve(&discs, Bounces::Full);
        assert_near("discs", mean_of(&solved, 0..64, false) / PI, factor, 0.005);
    }
}

/// Two plates: squares opposite each other (Howell, C-11); and two so near that they see nothing
/// else, of which one emits e: E = π e / (1 − ρ²) on the other, whichever of its sides is there.
#[test]
fn two_plates() {
    let plates = |apart_m: f32, albedo: f32, is_back: bool| {
        let mut plates = scene(Vec3::new(0.5, 0.5 * apart_m, 9.0), Vec3::splat(0.5), 40.0);
        let edges = if is_back {
            [Vec3::X, Vec3::Z]
        } else {
            [Vec3::Z, Vec3::X]
        };
        add(
            &mut plates,
            lambert(albedo),
            quad(Vec3::ZERO, edges[0], edges[1]),
        );
        let above = quad(Vec3::Y * apart_m, Vec3::X, Vec3::Z);
        add(&mut plates, emitter(albedo), above);
        let solved = solve(&plates, Bounces::Full);
        [is_back, !is_back].map(|side| mean_of(&solved, 0..2, side) / PI)
    };
    // 2 / (π x²) (ln √((1 + x²)² / (1 + 2 x²)) + 2 x √(1 + x²) atan(x / √(1 + x²)) − 2 x atan x) of
    // x = 1.
    let [squares, _] = plates(1.0, 0.0, false);
    assert_near("squares", squares, 0.199_825, 0.005);
    for is_back in [false, true] {
        let [near, behind] = plates(0.001, 0.6, is_back);
        assert_near("near plates", near, 1.0 / (1.0 - 0.6 * 0.6), 0.01);
        assert_eq!(behind, 0.0);
    }
}

/// The pictures of both references agree to 1% over blocks: under lights, under a lamp, and where
/// light comes through a door into a dark room.
#[test]
fn pictures_are_the_path_tracers() {
    for (name, bounces) in [
        ("cornell", Bounces::Full),
        ("cornell", Bounces::Count(2)),
        ("cornell-lamp", Bounces::Full),
        ("two-rooms,door=1", Bounces::Full),
    ] {
        let scene = bundled(name);
        let sampling = Sampling::Adaptive {
            max_error: 0.004,
            max_spp: 8192,
        };
        let settings = settings(48, 32, bounces, sampling);
        let traced = render(&scene, &settings, &|_| {}).unwrap();
        let (image, solved) =
            render_radiosity(&scene, &settings, &RadiositySettings::default(), &|_| {}).unwrap();
        let errors = block_errors(&image.indirect(), &traced.indirect());
        println!(
            "{name}, {bounces:?}: bias {:+.5}, rel_rmse {:.5}, {} patches, {} rays",
            errors.bias,
            errors.rel_rmse,
            solved.patch_count(),
            solved.ray_count()
        );
        assert!(errors.rel_rmse <= 0.01, "{name}, {bounces:?}: {errors:?}");
        assert_eq!(image.direct, traced.direct);
    }
}

/// Threads change no bit; and what radiosity cannot do is an error that says so.
#[test]
fn equal_settings_give_equal_bits_and_what_is_refused_is_named() {
    let cornell = bundled("cornell");
    let own = settings(16, 12, Bounces::Full, Sampling::Fixed { spp: 16 });
    let radiosity = RadiositySettings {
        rays: 64,
        ..RadiositySettings::default()
    };
    let draw = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            render_radiosity(&cornell, &own, &radiosity, &|_| {})
                .unwrap()
                .0
        })
    };
    assert_eq!(draw(1), draw(3));

    let mut glossy = cornell.clone();
    glossy.materials[1].specular = Some(Specular {
        f0: Vec3::splat(0.04),
        roughness: 0.5,
        metalness: 0.0,
        texture: None,
    });
    let name = &glossy.materials[1].name;
    let refused = |scene: &Scene, radiosity: RadiositySettings| -> String {
        let ReferenceError::Scene { problem, .. } =
            render_radiosity(scene, &own, &radiosity, &|_| {})
                .err()
                .unwrap()
        else {
            panic!("not refused for its scene")
        };
        problem
    };
    assert!(refused(&glossy, radiosity).contains(&format!("material {name} has a specular lobe")));
    let few = RadiositySettings {
        max_patches: 100,
        ..radiosity
    };
    assert!(refused(&cornell, few).contains("100 may be at most"));
    for (wrong, field) in [
        (
            RadiositySettings {
                rays: 96,
                ..radiosity
            },
            "patch_rays",
        ),
        (
            RadiositySettings {
                edge: 0.0,
                ..radiosity
            },
            "patch_edge",
        ),
        (
            RadiositySettings {
                max_error: f32::NAN,
                ..radiosity
            },
            "patch_error",
        ),
        (
            RadiositySettings {
                max_patches: 0,
                ..radiosity
            },
            "max_patches",
        ),
    ] {
        let problem = render_radiosity(&cornell, &own, &wrong, &|_| {})
            .err()
            .unwrap();
        assert!(problem.to_string().starts_with(field), "{problem}");
    }
}

/// A scene without surfaces, and one that nothing lights, are black.
#[test]
fn nothing_is_black() {
    let empty = scene(Vec3::Z, Vec3::ZERO, 40.0);
    let mut dark = empty.clone();
    add(&mut dark, lambert(0.5), quad(Vec3::ZERO, Vec3::X, Vec3::Y));
    for scene in [empty, dark] {
        let settings = settings(8, 8, Bounces::Full, Sampling::Fixed { spp: 4 });
        let (image, _) =
            render_radiosity(&scene, &settings, &RadiositySettings::default(), &|_| {}).unwrap();
        assert!(
            image
                .radiance()
                .pixels
                .iter()
                .all(|pixel| *pixel == Vec3::ZERO)
        );
    }
}
