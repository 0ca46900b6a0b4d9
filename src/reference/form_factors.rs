//! What the sides of patches see: rays from all over them, which carry the form factors and the
//! light of what is no patch.

use std::cell::Cell;
use std::f32::consts::PI;

use glam::Vec3;
use rayon::prelude::*;

use super::bsdf::sample_cosine;
use super::patches::{Patch, Patches};
use super::path::{Beyond, Terms};
use super::render::PixelCamera;
use super::sampler::Sampler;
use super::world::{Surface, World};
use super::{Bounces, Occlusion, Settings};
use crate::image::luminance;
use crate::scene::Scene;
use crate::scene::rays::{Hit, corners};

/// Rays from the picture that tell what is important, a power of two.
const WATCHING_RAYS: u32 = 1 << 16;

/// What rays are for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Purpose {
    /// To tell which patches are split.
    Decide,
    /// To measure what patches get.
    Measure,
}

impl Purpose {
    /// A quarter of a patch has this share of its rays: a fourth, and to decide a fourth of that.
    pub(super) fn share(self) -> u32 {
        match self {
            Purpose::Decide => 16,
            Purpose::Measure => 4,
        }
    }
}

/// What a quarter of a side gets.
#[derive(Clone, Default)]
pub(super) struct Quarter {
    /// Rays, without those that a mask lets through.
    pub(super) rays: u32,
    /// Sum over its rays of the light of analytic lights [W/m²].
    pub(super) direct: Vec3,
    /// The same of emitters and the environment.
    pub(super) sent: Vec3,
    /// Sum of squares of the luminance of both.
    pub(super) squares: f32,
    pub(super) seen: Vec<Seen>,
}

/// Where a ray ends.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    pub(super) triangle: u32,
    pub(super) place: [f32; 2],
    pub(super) is_back: bool,
    pub(super) albedo: Vec3,
}

/// A side of a patch, seen by the rays of four quarters.
pub(super) type Side = [Quarter; 4];

/// Where rays end, side by side: the numbers of the sides that they meet, and their albedo.
pub(super) struct Links {
    /// The first link of each side, and the end of all.
    pub(super) first: Vec<usize>,
    pub(super) all: Vec<(u32, Vec3)>,
}

impl Links {
    /// Resolves where the rays of all sides end.
    pub(super) fn new(patches: &Patches, sides: &[Option<Side>]) -> Self {
        let of_side = |side: &Option<Side>| -> Vec<(u32, Vec3)> {
            let seen = quarters(side).iter().flat_map(|quarter| &quarter.seen);
            seen.map(|seen| {
                let patch = patches.find(seen.triangle, seen.place);
                (seen.side(patch) as u32, seen.albedo)
            })
            .collect()
        };
        let links: Vec<Vec<(u32, Vec3)>> = sides.par_iter().map(of_side).collect();
        let mut first = vec![0];
        for links in &links {
            first.push(first[first.len() - 1] + links.len());
        }
        Links {
            first,
            all: links.into_iter().flatten().collect(),
        }
    }
}

impl Seen {
    pub(super) fn of(scene: &Scene, surface: &Surface) -> Self {
        let [a, b, c] = corners(scene, &scene.triangles[surface.triangle as usize]);
        let (along, aside, to) = (b - a, c - a, surface.position - a);
        let normal = along.cross(aside);
        let scale = 1.0 / normal.length_squared();
        let [u, v] = [to.cross(aside), along.cross(to)]
            .map(|part| (part.dot(normal) * scale).clamp(0.0, 1.0));
        Seen {
            triangle: surface.triangle,
            place: [u, v.min(1.0 - u)],
            is_back: surface.geometric_normal.dot(normal) < 0.0,
            albedo: surface.albedo,
        }
    }

    /// Number of the side, on this patch.
    pub(super) fn side(&self, patch: u32) -> usize {
        2 * patch as usize + usize::from(self.is_back)
    }
}

/// Where rays from what a picture shows end, the albedo there times that where they start.
pub(super) fn watch(world: &World<'_>, settings: &Settings) -> Vec<Seen> {
    let camera = PixelCamera::new(world.scene, settings);
    let stream = Sampler::stream(settings.seed, 0, 2);
    let watched = |index| {
        let mut sampler = Sampler::new(stream, index, WATCHING_RAYS);
        let [x, y] = sampler.next_2d();
        let first =
            world.trace(&camera.ray(x * settings.width as f32, y * settings.height as f32))?;
        let direction = sample_cosine(first.normal, sampler.next_2d());
        let second = world
            .trace(&first.ray(direction))
            .filter(|_| first.is_above(direction))?;
        let seen = Seen::of(world.scene, &second);
        Some(Seen {
            albedo: first.albedo * seen.albedo,
            ..seen
        })
    };
    (0..WATCHING_RAYS)
        .into_par_iter()
        .filter_map(watched)
        .collect()
}

/// Sends `batch` rays from each quarter of a side.
pub(super) fn sample(
    world: &World<'_>,
    (seed, purpose): (u64, Purpose),
    patch: &Patch,
    is_back: bool,
    batch: u32,
) -> Side {
    let [a, b, c] = corners(world.scene, &world.scene.triangles[patch.triangle as usize]);
    let front = (b - a).cross(c - a).normalize_or_zero();
    let wo = if is_back { -front } else { front };
    let mut side = Side::default();
    if wo == Vec3::ZERO {
        return side;
    }
    for (number, (quarter, part)) in (0..).zip(side.iter_mut().zip(patch.quarters())) {
        // A place has a stream of its own, wherever its patch is in the list.
        let [u, v] = part.corners[0].map(f32::to_bits);
        let stream = Sampler::stream(
            seed ^ u64::from(u) << 32 ^ u64::from(v),
            2 * patch.triangle + u32::from(is_back),
            4 * purpose as u32 + number,
        );
        for ray in 0..batch {
            let mut sampler = Sampler::new(stream, ray, batch);
            let [u, v] = part.place(sampler.next_2d());
            let hit = Hit {
                triangle: patch.triangle,
                u,
                v,
            };
            if !world.is_solid(hit) {
                continue;
            }
            let mut surface = world.surface(hit, wo);
            surface.albedo = Vec3::ONE;
            // What it meets is kept, and reflects nothing yet.
            let met = Cell::new(None);
            let beyond = Beyond {
                bounces: Bounces::Count(1),
                reflected: Some(&|next: &Surface| {
                    met.set(Some(Seen::of(world.scene, next)));
                    Vec3::ZERO
                }),
                occlusion: Occlusion::default(),
            };
            let Terms {
                direct, irradiance, ..
            } = world.shade_first(&surface, None, beyond, &mut sampler);
            let direct = direct * PI;
            quarter.rays += 1;
            quarter.direct += direct;
            quarter.sent += irradiance;
            quarter.squares += luminance(direct + irradiance).powi(2);
            quarter.seen.extend(met.get());
        }
    }
    side
}

/// The quarters of a side, none where it is not sampled yet.
pub(super) fn quarters(side: &Option<Side>) -> &[Quarter] {
    side.as_ref().map_or(&[], |side| side)
}

/// Number of rays of each side, at least 1.
pub(super) fn rays_of(sides: &[Option<Side>]) -> Vec<f32> {
    let rays = |side: &Option<Side>| {
        quarters(side)
            .iter()
            .map(|quarter| quarter.rays)
            .sum::<u32>()
    };
    sides.iter().map(|side| rays(side).max(1) as f32).collect()
}
