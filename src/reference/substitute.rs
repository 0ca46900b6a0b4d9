//! Parts of the path tracer for error budgets: direct light where a technique stores it, and a
//! picture's gather that sees somebody else's light.

use std::f32::consts::PI;

use glam::Vec3;
use rayon::prelude::*;

use super::bsdf::sample_cosine;
use super::render::PixelCamera;
use super::sampler::Sampler;
use super::world::World;
use super::{ReferenceError, Settings, validate_scene};
use crate::image::Image;
use crate::scene::rays::{Hit, corners};
use crate::scene::{LitPoint, Scene, SurfacePoint};

/// Points that cover all surfaces evenly, one for every square of an edge of `spacing_m` (m), lit
/// by exact shadow rays. What a mask takes away has none.
pub fn light_surfaces(scene: &Scene, spacing_m: f32) -> Result<Vec<LitPoint>, ReferenceError> {
    validate_scene(scene)?;
    let world = World::new(scene);
    let square_m2 = f64::from(spacing_m).powi(2);
    // Point number i stands for square number i of all surfaces in a row, so that small triangles
    // have their share too.
    let ends: Vec<u64> = (0..scene.triangles.len())
        .scan(0.0, |covered, index| {
            *covered += area_m2(scene, index) / square_m2;
            Some((*covered + 0.5) as u64)
        })
        .collect();
    let of_triangle = |index: usize| {
        let first = index.checked_sub(1).map_or(0, |before| ends[before]);
        let world = &world;
        (first..ends[index]).filter_map(move |number| lit_point(world, index, number))
    };
    Ok((0..scene.triangles.len())
        .into_par_iter()
        .flat_map_iter(of_triangle)
        .collect())
}

/// Surface of all triangles (m²).
pub fn surface_area_m2(scene: &Scene) -> f64 {
    (0..scene.triangles.len())
        .map(|index| area_m2(scene, index))
        .sum()
}

fn area_m2(scene: &Scene, index: usize) -> f64 {
    let [a, b, c] = corners(scene, &scene.triangles[index]).map(Vec3::as_dvec3);
    0.5 * (b - a).cross(c - a).length()
}

fn lit_point(world: &World<'_>, triangle: usize, number: u64) -> Option<LitPoint> {
    // Multiples of powers of the inverse plastic number (M. Roberts 2018, "R₂"), from the square to
    // the triangle (G. Turk 1990).
    let [x, y] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2]
        .map(|step: f64| ((number % (1 << 24)) as f64 * step + 0.5).fract() as f32);
    let root = x.sqrt();
    let hit = Hit {
        triangle: triangle as u32,
        u: root * (1.0 - y),
        v: root * y,
    };
    if !world.is_solid(hit) {
        return None;
    }
    let [a, b, c] = corners(world.scene, &world.scene.triangles[triangle]);
    let front = (b - a).cross(c - a).try_normalize()?;
    let reflected = |wo: Vec3| {
        let mut surface = world.surface(hit, wo);
        surface.lobe = None;
        world.light_from_lights(&surface, &mut Sampler::new(number as u32, 0, 1))
    };
    let surface = world.surface(hit, front);
    Some(LitPoint {
        surface: SurfacePoint {
            position: surface.position,
            normal: front,
        },
        radiance: [reflected(front), reflected(-front)],
    })
}

/// The diffuse indirect radiance ρ/π E_i of a picture \[W/(m² sr)\], gathered at the pixel centres
/// by `directions` cosine-distributed rays (a power of two) through the scene itself. Each sees the
/// environment, or at a surface what `radiance` says of it [W/(m² sr)].
pub fn gather(
    scene: &Scene,
    [width, height]: [u32; 2],
    directions: u32,
    radiance: &(dyn Fn(&SurfacePoint) -> Vec3 + Sync),
) -> Result<Image, ReferenceError> {
    let settings = Settings {
        width,
        height,
        ..Settings::default()
    };
    settings.validate()?;
    validate_scene(scene)?;
    let world = World::new(scene);
    let camera = PixelCamera::new(scene, &settings);
    let pixel = |index: u32| {
        let Some(surface) =
            world.trace(&camera.ray((index % width) as f32 + 0.5, (index / width) as f32 + 0.5))
        else {
            return Vec3::ZERO;
        };
        let stream = Sampler::stream(0, index, 0);
        let seen = (0..directions).map(|number| {
            let mut sampler = Sampler::new(stream, number, directions);
            sampler.start_vertex(1);
            let direction = sample_cosine(surface.normal, sampler.next_2d());
            match surface
                .is_above(direction)
                .then(|| world.trace(&surface.ray(direction)))
            {
                None => Vec3::ZERO,
                Some(None) => scene.environment.radiance(direction),
                Some(Some(hit)) => radiance(&SurfacePoint {
                    position: hit.position,
                    normal: hit.geometric_normal,
                }),
            }
        });
        let irradiance = PI / directions as f32 * seen.sum::<Vec3>();
        surface.albedo / PI * irradiance
    };
    Ok(Image {
        width,
        height,
        pixels: (0..width * height).into_par_iter().map(pixel).collect(),
    })
}
