//! Objects, with or without a floor: a camera that looks down on them and frames them, and a sun.

use glam::Vec3;

use super::{Chosen, Sample, Seen, Space, best, direction};
use crate::scene::{Camera, Light};

/// Vertical field of view \[degrees\].
const VFOV_DEG: f32 = 40.0;

/// Width of the picture that the model must fit in, by its height: most pictures are wider.
const ASPECT: f32 = 1.5;

/// Share of the height below which a surface may be a floor.
const FLOOR_HEIGHT: f32 = 0.05;

/// Share of the width and depth that a floor covers.
const FLOOR_COVER: f32 = 0.9;

/// Air around the subject, as a factor on its size.
const MARGIN: f32 = 1.15;

/// The same around a subject on a floor that goes on beyond it: room for its shadow.
const MARGIN_ON_FLOOR: f32 = 1.5;

/// Azimuths of the camera, the best known first: from the front and right.
const AZIMUTHS_DEG: [f32; 8] = [28.0, -28.0, 62.0, -62.0, 118.0, -118.0, 152.0, -152.0];

/// Elevations of the camera.
const ELEVATIONS_DEG: [f32; 3] = [24.0, 38.0, 12.0];

/// Where the sun stands, to the right of the camera, and how high; the best known first.
const SUNS_DEG: [[f32; 2]; 8] = [
    [30.0, 50.0],
    [-62.0, 52.0],
    [62.0, 52.0],
    [-30.0, 50.0],
    [-85.0, 55.0],
    [85.0, 55.0],
    [-130.0, 65.0],
    [130.0, 65.0],
];

/// Share of what is seen that the sun should light: shadows show the shape.
const LIT_SHARE: f32 = 0.75;

/// Irradiance across the sun's beam [W/m²].
const SUN: f32 = 3.5;

/// Chooses from all sides.
pub(super) fn place(space: &Space) -> Chosen {
    let subject = Subject::of(space);
    let samples = space.samples(|triangle| subject.holds[triangle]);
    let mut cameras = Vec::new();
    for azimuth in AZIMUTHS_DEG {
        cameras
            .extend(ELEVATIONS_DEG.map(|elevation| (azimuth, subject.camera(azimuth, elevation))));
    }
    let rated = cameras
        .iter()
        .enumerate()
        .map(|(index, (azimuth, camera))| {
            let liked = 1.0 - 0.004 * index as f32 - if azimuth.abs() > 90.0 { 0.1 } else { 0.0 };
            shown_share(space, &samples, camera.eye) * liked
        });
    let (azimuth, camera) = cameras[best(rated).unwrap_or(0)];
    let seen = space.seen(&camera);
    let (sun, _) = sun(space, azimuth, &seen);
    Chosen {
        camera,
        place: "outside it, looking at it",
        lights: vec![sun],
        is_open: true,
    }
}

/// The sun that lights enough of what a camera in this azimuth sees, and the share that it lights.
pub(super) fn sun(space: &Space, azimuth_deg: f32, seen: &[Seen]) -> (Light, f32) {
    let suns = SUNS_DEG.map(|[beside, elevation]| direction(azimuth_deg + beside, elevation));
    let shares = suns.map(|sun| lit_share(space, seen, sun));
    let rated = shares
        .iter()
        .enumerate()
        .map(|(index, share)| share.min(LIT_SHARE) - 0.01 * index as f32);
    let index = best(rated).unwrap_or(0);
    let sun = Light::Directional {
        direction: -suns[index],
        irradiance: Vec3::splat(SUN),
    };
    (sun, shares[index])
}

/// The share of the samples that show their front; one that shows its back counts a third.
fn shown_share(space: &Space, samples: &[Sample], eye: Vec3) -> f32 {
    let shown = |sample: &Sample| {
        let cosine = (eye - sample.position)
            .normalize_or_zero()
            .dot(sample.normal);
        match space.is_clear(sample.position, sample.triangle, eye) {
            true if cosine > 0.0 => 1.0,
            true => 0.3,
            false => 0.0,
        }
    };
    samples.iter().map(shown).sum::<f32>() / samples.len().max(1) as f32
}

fn lit_share(space: &Space, seen: &[Seen], towards_sun: Vec3) -> f32 {
    let is_lit = |seen: &&Seen| {
        let far = seen.position + 4.0 * towards_sun;
        seen.normal.dot(towards_sun) > 0.0 && space.is_clear(seen.position, seen.triangle, far)
    };
    seen.iter().filter(is_lit).count() as f32 / seen.len().max(1) as f32
}

/// What the picture is of: all that is not floor.
struct Subject {
    /// Whether a triangle belongs to it.
    holds: Vec<bool>,
    points: Vec<Vec3>,
    low: Vec3,
    high: Vec3,
    margin: f32,
}

impl Subject {
    fn of(space: &Space) -> Subject {
        let top = space.half.y * (2.0 * FLOOR_HEIGHT - 1.0);
        let is_low = |corners: &[Vec3; 3]| corners.iter().all(|corner| corner.y <= top);
        let (low, high) = bounds(space.corners.iter().filter(|corners| is_low(corners)));
        let cover = (high - low) / (2.0 * space.half).max(Vec3::splat(1e-6));
        let is_floor = cover.x.min(cover.z) >= FLOOR_COVER;
        let mut holds: Vec<bool> = space
            .corners
            .iter()
            .map(|corners| !(is_floor && is_low(corners)))
            .collect();
        if !holds.contains(&true) {
            holds.fill(true);
        }
        let held = || {
            let pairs = space.corners.iter().zip(&holds);
            pairs
                .filter(|(_, holds)| **holds)
                .map(|(corners, _)| corners)
        };
        let (low, high) = bounds(held());
        let points = held().flatten().copied().collect();
        let is_small = (high - low).max_element() < 0.9 * 2.0 * space.half.max_element();
        Subject {
            points,
            low,
            high,
            margin: if is_small { MARGIN_ON_FLOOR } else { MARGIN },
            holds,
        }
    }

    /// A camera that looks from there at the middle of the subject and frames it.
    fn camera(&self, azimuth_deg: f32, elevation_deg: f32) -> Camera {
        let towards = direction(azimuth_deg, elevation_deg);
        let right = Vec3::Y.cross(towards).normalize();
        let up = towards.cross(right);
        let centre = 0.5 * (self.low + self.high);
        let tan_y = (0.5 * VFOV_DEG.to_radians()).tan() / self.margin;
        let corners = (0..8).map(|corner: u32| {
            let pick = |axis: usize| match corner >> axis & 1 {
                0 => self.low[axis],
                _ => self.high[axis],
            };
            Vec3::new(pick(0), pick(1), pick(2))
        });
        let distance_for = |point: Vec3| {
            let at = point - centre;
            let aside = (at.dot(right).abs() / ASPECT).max(at.dot(up).abs());
            at.dot(towards) + aside / tan_y
        };
        let boxed = corners.map(distance_for).fold(0.0, f32::max);
        let tight = self
            .points
            .iter()
            .map(|point| distance_for(*point))
            .fold(0.0, f32::max);
        let distance = tight.min(boxed).max(0.01);
        Camera {
            eye: centre + towards * distance,
            target: centre,
            up: Vec3::Y,
            vfov_deg: VFOV_DEG,
        }
    }
}

fn bounds<'c>(triangles: impl Iterator<Item = &'c [Vec3; 3]>) -> (Vec3, Vec3) {
    triangles.flatten().fold(
        (Vec3::INFINITY, Vec3::NEG_INFINITY),
        |(low, high), corner| (low.min(*corner), high.max(*corner)),
    )
}
