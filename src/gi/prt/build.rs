//! Transfer is worked out by rays, round by round.
//!
//! - Round 0 (P1): T⁰_i = ∫ Y_i(s) V(s) max(n·s, 0) ds, and the emission that rays meet.
//! - Round k (P2): Tᵏ_i = 1/π ∫ (1 − V) ρ(q) Tᵏ⁻¹_i(q) max(n·s, 0) ds, at what rays hit. In round 1
//!   analytic lights shine on what they hit.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::fill::{fill, hang, open_points, stand_ins};
use super::lattice::Lattice;
use super::lobes::Projector;
use super::rays::{Rays, Sampling};
use super::rows::Rows;
use super::transfer::{Progress, Transfer, TransferSettings, unit_light};
use crate::gi::shared::sh::Rotation;
use crate::scene::rays::{Hit, NO_TRIANGLE, Ray};
use crate::scene::surfaces::Surfaces;
use crate::scene::{Light, Scene};

/// What a ray met.
#[derive(Clone, Copy)]
pub(super) struct Met {
    /// [`NO_TRIANGLE`]: nothing.
    pub(super) triangle: u32,
    pub(super) at: [u16; 2],
    /// Diffuse albedo, times 65,535.
    pub(super) albedo: [u16; 3],
    pub(super) is_back: bool,
}

pub(super) const NOTHING: Met = Met {
    triangle: NO_TRIANGLE,
    at: [0; 2],
    albedo: [0; 3],
    is_back: false,
};

/// Hits of all rays of all points are kept from round to round where they have no more bytes.
const MOST_KEPT_BYTES: usize = 2 << 30;
/// A point that sees more open places than this share of its rays is not inside of something. Some
/// rays get out of bodies, through gaps between triangles; and in creases of cloth points are a
/// hair behind it.
const REACHED: f32 = 0.1;
/// What the progress is called.
const TOLD: &str = "transfer";
const TOLD_CLUSTERS: &str = "clusters of transfer";
/// Rays by which the back of a triangle is looked at, from each of four places.
const BACK_RAYS: u32 = 16;

/// What is needed to work transfer out.
pub(super) struct Builder<'s> {
    pub(super) surfaces: Surfaces<'s>,
    pub(super) settings: TransferSettings,
    pub(super) lattice: Lattice,
    pub(super) rays: Rays,
    pub(super) projector: Option<Projector>,
    pub(super) has_emission: bool,
    pub(super) lights: Vec<Light>,
    /// Numbers of a row: three a function.
    pub(super) stride: usize,
}

/// What one point brings from a round.
struct Shot {
    row: Vec<f32>,
    visibility: f32,
    /// So many of its rays end on back faces that it may be inside of something.
    is_doubtful: bool,
}

impl<'s> Builder<'s> {
    /// `cells`: how many each triangle has along an edge.
    pub(super) fn new(scene: &'s Scene, settings: TransferSettings, cells: &[u32]) -> Self {
        let surfaces = Surfaces::new(scene);
        let backs: Vec<bool> = (0..scene.triangles.len())
            .into_par_iter()
            .map(|triangle| settings.has_backs && is_back_seen(&surfaces, triangle))
            .collect();
        let has_emission = settings.has_lights && scene.is_emissive();
        let lights: Vec<Light> = match settings.has_lights {
            true => scene.lights.iter().map(unit_light).collect(),
            false => Vec::new(),
        };
        let harmonics = (settings.order * settings.order) as usize;
        let rays = Rays::new(settings.sampling, settings.rays, settings.order);
        let projector = settings.lobes.map(|lobes| Projector::new(lobes, &rays));
        Builder {
            surfaces,
            settings,
            lattice: Lattice::new(scene, settings.lattice.inset, cells, |triangle| {
                backs[triangle]
            }),
            rays,
            projector,
            has_emission,
            stride: 3 * (harmonics + usize::from(has_emission) + lights.len()),
            lights,
        }
    }

    /// That of the columns of analytic lights alone.
    pub(super) fn of_lights(scene: &'s Scene, settings: TransferSettings, cells: &[u32]) -> Self {
        let harmonics = TransferSettings {
            order: 0,
            ..settings
        };
        let mut builder = Builder::new(scene, harmonics, cells);
        builder.has_emission = false;
        builder.stride = 3 * builder.lights.len();
        builder
    }

    pub(super) fn build(self, progress: Progress<'_>) -> Transfer {
        let points = self.lattice.points.len();
        let ray_count = self.settings.rays as usize;
        let keeps = points * ray_count * size_of::<Met>() <= MOST_KEPT_BYTES;
        let mut kept = vec![NOTHING; if keeps { points * ray_count } else { 0 }];
        let needs_round = |round: u32| {
            round < self.settings.bounces
                || (round == self.settings.bounces && !self.lights.is_empty())
        };
        let rounds = (0..).take_while(|round| needs_round(*round)).count();
        let done = std::sync::atomic::AtomicUsize::new(0);
        let advance = || {
            let all = (rounds * points).max(1);
            let count = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            if count.is_multiple_of(256) {
                progress(TOLD, count as f32 / all as f32);
            }
        };
        let cast = |number: usize, hits: &mut [Met]| {
            let shot = self.first_round(number, hits);
            advance();
            shot
        };
        let numbers = 0..points;
        let shots: Vec<Shot> = if keeps {
            let hits = kept.par_chunks_mut(ray_count.max(1)).enumerate();
            hits.map(|(number, hits)| cast(number, hits)).collect()
        } else {
            let fresh = || vec![NOTHING; ray_count];
            let all = numbers.clone().into_par_iter();
            all.map_init(fresh, |hits, number| cast(number, hits))
                .collect()
        };
        let reaches = |number: usize, is_open: &[bool]| match keeps {
            true => self.reaches(number, &kept[number * ray_count..][..ray_count], is_open),
            false => {
                let mut hits = vec![NOTHING; ray_count];
                self.cast(number, &mut hits);
                self.reaches(number, &hits, is_open)
            }
        };
        let is_valid = open_points(shots.iter().map(|shot| shot.is_doubtful), reaches);
        let mut visibility: Vec<f32> = shots.iter().map(|shot| shot.visibility).collect();
        let mut last: Vec<f32> = Vec::with_capacity(points * self.stride);
        shots.iter().for_each(|shot| last.extend(&shot.row));
        drop(shots);
        let neighbours = self.lattice.neighbours();
        let filled = fill(&mut last, self.stride, &is_valid, &neighbours);
        fill(&mut visibility, 1, &is_valid, &neighbours);
        hang(&mut last, self.stride, &self.lattice.hanging);
        hang(&mut visibility, 1, &self.lattice.hanging);
        let mut rows = last.clone();
        // What surfaces have that is reflected once more.
        let mut senders = vec![0.0; self.projector.as_ref().map_or(0, |_| last.len())];
        for round in 1..rounds as u32 {
            let from = self.first_reflected(round);
            let pairs = senders.chunks_exact_mut(self.stride.max(1));
            for (sum, own) in pairs.zip(last.chunks_exact(self.stride.max(1))) {
                let sums = sum[from..].iter_mut();
                sums.zip(&own[from..]).for_each(|(sum, own)| *sum += own);
            }
            let bounce = |number: usize, hits: &[Met]| {
                let row = self.bounce(number, hits, round, &last);
                advance();
                row
            };
            let next: Vec<Vec<f32>> = if keeps {
                let hits = kept.par_chunks(ray_count.max(1)).enumerate();
                hits.map(|(number, hits)| bounce(number, hits)).collect()
            } else {
                let fresh = || vec![NOTHING; ray_count];
                let all = numbers.clone().into_par_iter();
                all.map_init(fresh, |hits, number| {
                    self.cast(number, hits);
                    bounce(number, hits)
                })
                .collect()
            };
            last.clear();
            next.iter().for_each(|row| last.extend(row));
            drop(next);
            fill(&mut last, self.stride, &is_valid, &neighbours);
            hang(&mut last, self.stride, &self.lattice.hanging);
            rows.par_iter_mut()
                .zip(&last)
                .for_each(|(sum, more)| *sum += more);
        }
        progress(TOLD, 1.0);
        let hits = keeps.then_some(kept);
        let lobes = (self.projector.as_ref()).map(|projector| {
            let stand_ins = stand_ins(&is_valid, &neighbours);
            self.lobes(projector, (hits.as_deref(), &stand_ins, &senders), progress)
        });
        let folded = self.folded(hits.as_deref(), &is_valid);
        drop(hits);
        progress(TOLD_CLUSTERS, 0.0);
        let irradiance = self.collect(1, |point| {
            rows[point * self.stride..][..self.stride].to_vec()
        });
        progress(TOLD_CLUSTERS, 1.0);
        Transfer {
            order: self.settings.order,
            irradiance,
            lobes,
            visibility,
            folded,
            filled,
            lattice: self.lattice,
        }
    }

    /// Rows of all points, compressed as the settings say.
    pub(super) fn collect(&self, outputs: usize, row: impl Fn(usize) -> Vec<f32> + Sync) -> Rows {
        let harmonics = (self.settings.order * self.settings.order) as usize;
        let compress = self.settings.compress.map(|own| (harmonics, own));
        let counts = [self.lattice.points.len(), outputs, self.stride / 3];
        Rows::collect(counts, compress, row)
    }

    /// The first number of a row that a round reflects: in the last one lights alone remain.
    fn first_reflected(&self, round: u32) -> usize {
        match round < self.settings.bounces {
            true => 0,
            false => self.stride - 3 * self.lights.len(),
        }
    }

    /// Directions of a point's rays; `None` where one goes below the surface.
    pub(super) fn directions(&self, number: usize) -> impl Iterator<Item = Option<Vec3>> {
        let point = &self.lattice.points[number];
        let frame = self.rays.frame_of(number, point).as_mat3();
        let (geometric, normal) = (point.geometric, point.normal);
        self.rays.directions.iter().map(move |local| {
            let direction = frame * *local;
            let is_above = direction.dot(geometric) > 0.0 && direction.dot(normal) > 0.0;
            is_above.then_some(direction)
        })
    }

    fn ray(&self, number: usize, direction: Vec3) -> Ray {
        let point = &self.lattice.points[number];
        Ray {
            origin: point.position + point.offset_m * point.geometric,
            direction,
            leaves: NO_TRIANGLE,
        }
    }

    /// What the rays of a point meet.
    pub(super) fn cast(&self, number: usize, hits: &mut [Met]) {
        for (met, direction) in hits.iter_mut().zip(self.directions(number)) {
            *met = NOTHING;
            let Some(direction) = direction else { continue };
            let Some(hit) = self.surfaces.closest(&self.ray(number, direction)) else {
                continue;
            };
            let place = self.surfaces.place(hit);
            let material = self.surfaces.material(hit);
            let metalness = material.specular.map_or(0.0, |lobe| lobe.metalness);
            let albedo = place.base * (1.0 - metalness);
            let unit = |value: f32| (value * 65_535.0).round().clamp(0.0, 65_535.0) as u16;
            *met = Met {
                triangle: hit.triangle,
                at: [unit(hit.u), unit(hit.v)],
                albedo: albedo.to_array().map(unit),
                is_back: place.front.dot(direction) > 0.0,
            };
        }
    }

    /// Round 0, and what the rays met.
    fn first_round(&self, number: usize, hits: &mut [Met]) -> Shot {
        self.cast(number, hits);
        let point = &self.lattice.points[number];
        let mut emission = Vec3::ZERO;
        let (mut backs, mut above, mut visible) = (0, 0, 0.0);
        for (met, direction) in hits.iter().zip(self.directions(number)) {
            let Some(direction) = direction else { continue };
            above += 1;
            let weight = self.rays.weight(direction, point);
            if met.triangle == NO_TRIANGLE {
                visible += weight;
            } else if met.is_back {
                backs += 1;
            } else if self.has_emission {
                emission += weight * self.emission(*met);
            }
        }
        let mut row = Vec::with_capacity(self.stride);
        let open = self.open_row(&self.rays, number, hits);
        row.extend(open.iter().flat_map(|value| [*value as f32; 3]));
        if self.has_emission {
            row.extend(emission.to_array());
        }
        row.resize(self.stride, 0.0);
        Shot {
            row,
            visibility: (visible / PI).min(1.0),
            is_doubtful: backs as f32 > self.settings.invalid_share * above as f32,
        }
    }

    /// Whether a point sees the sky, or places all of whose points are open: then it is not inside
    /// of something, however many back faces it sees. A sheet over it has a back as well.
    fn reaches(&self, number: usize, hits: &[Met], is_open: &[bool]) -> bool {
        let (mut above, mut reached) = (0, 0);
        for (met, direction) in hits.iter().zip(self.directions(number)) {
            if direction.is_none() {
                continue;
            }
            above += 1;
            let points = || {
                let place = self
                    .lattice
                    .at(met.triangle, false, place_of(*met).to_array());
                place.is_some_and(|at| at.iter().all(|(point, _)| is_open[*point as usize]))
            };
            let is_open = met.triangle == NO_TRIANGLE || (!met.is_back && points());
            reached += u32::from(is_open);
        }
        reached as f32 > REACHED * above as f32
    }

    /// The transfer of the sky itself to a point, by the harmonics of a set of rays.
    pub(super) fn open_row(&self, rays: &Rays, number: usize, hits: &[Met]) -> Vec<f64> {
        let point = &self.lattice.points[number];
        let mut open = vec![0.0f32; rays.functions];
        for (ray, (met, direction)) in hits.iter().zip(self.directions(number)).enumerate() {
            if let Some(direction) = direction.filter(|_| met.triangle == NO_TRIANGLE) {
                let basis = &rays.basis[ray * rays.functions..][..rays.functions];
                add_products(
                    &mut open,
                    std::iter::once(rays.weight(direction, point)),
                    basis,
                );
            }
        }
        let open: Vec<f64> = open.iter().map(|sum| f64::from(*sum)).collect();
        match self.settings.sampling {
            Sampling::Cosine => {
                let frame = self.rays.frame_of(number, point);
                Rotation::new(rays.functions.isqrt(), frame).apply(&open)
            }
            Sampling::Sphere => open,
        }
    }

    /// What the front of a surface emits.
    pub(super) fn emission(&self, met: Met) -> Vec3 {
        let hit = hit_of(met);
        let material = self.surfaces.material(hit);
        match material.emission == Vec3::ZERO {
            true => Vec3::ZERO,
            false => self.surfaces.emission(material, &self.surfaces.place(hit)),
        }
    }

    /// What a point gets in a round of what surfaces had in the round before.
    fn bounce(&self, number: usize, hits: &[Met], round: u32, last: &[f32]) -> Vec<f32> {
        let point = &self.lattice.points[number];
        let first_light = self.stride - 3 * self.lights.len();
        let from = self.first_reflected(round);
        let mut row = vec![0.0f32; self.stride];
        for (met, direction) in hits.iter().zip(self.directions(number)) {
            let Some(direction) = direction.filter(|_| met.triangle != NO_TRIANGLE) else {
                continue;
            };
            let factor = self.rays.weight(direction, point) / PI / 65_535.0;
            let albedo = Vec3::from(met.albedo.map(f32::from)) * factor;
            let Vec2 { x: u, y: v } = place_of(*met);
            let around = self.lattice.at(met.triangle, met.is_back, [u, v]);
            for (other, share) in around.into_iter().flatten() {
                let factors = (share * albedo).to_array();
                let other = &last[other as usize * self.stride..][..self.stride];
                let sums = row[from..].chunks_exact_mut(3);
                for (sum, value) in sums.zip(other[from..].chunks_exact(3)) {
                    for channel in 0..3 {
                        sum[channel] += factors[channel] * value[channel];
                    }
                }
            }
            if round == 1 && !self.lights.is_empty() {
                let lit = self.lights_at(*met, direction);
                let sums = row[first_light..].chunks_exact_mut(3);
                for (sum, irradiance) in sums.zip(lit) {
                    for channel in 0..3 {
                        sum[channel] += albedo[channel] * irradiance;
                    }
                }
            }
        }
        row
    }

    /// What each light brings to a place, seen along a direction.
    pub(super) fn lights_at(&self, met: Met, direction: Vec3) -> impl Iterator<Item = f32> {
        let place = self.surfaces.place(hit_of(met));
        let side = if met.is_back { -1.0 } else { 1.0 };
        let geometric = side * place.front;
        let mut normal = place.shading;
        if normal.dot(geometric) < 0.0 {
            normal = -normal;
        }
        let origin = place.position + place.offset_m * geometric;
        let is_seen = direction.dot(geometric) < 0.0;
        self.lights.iter().map(move |light| {
            let (to_light, distance_m, irradiance) = light.sample(origin);
            let cosine = normal.dot(to_light);
            let is_lit = is_seen && cosine > 0.0 && geometric.dot(to_light) > 0.0;
            if !is_lit || irradiance.x == 0.0 {
                return 0.0;
            }
            let ray = Ray {
                origin,
                direction: to_light,
                leaves: met.triangle,
            };
            match self.surfaces.is_occluded(&ray, distance_m) {
                true => 0.0,
                false => cosine * irradiance.x,
            }
        })
    }
}

/// Whether a ray that leaves the back of a triangle sees anything but other backs.
fn is_back_seen(surfaces: &Surfaces<'_>, triangle: usize) -> bool {
    let places = [[0.33, 0.33], [0.05, 0.05], [0.9, 0.05], [0.05, 0.9]];
    places.iter().any(|[u, v]| {
        let triangle = triangle as u32;
        let place = surfaces.place(Hit {
            triangle,
            u: *u,
            v: *v,
        });
        if !place.front.is_finite() {
            return false;
        }
        let normal = -place.front;
        let (x, y) = normal.any_orthonormal_pair();
        (0..BACK_RAYS).any(|ray| {
            let radius = ((ray as f32 + 0.5) / BACK_RAYS as f32).sqrt();
            let (sin, cos) = (ray as f32 * 2.4).sin_cos();
            let up = (1.0 - radius * radius).sqrt();
            let direction = radius * (cos * x + sin * y) + up * normal;
            let ray = Ray {
                origin: place.position + place.offset_m * normal,
                direction,
                leaves: triangle,
            };
            match surfaces.closest(&ray) {
                Some(hit) => surfaces.place(hit).front.dot(direction) < 0.0,
                None => true,
            }
        })
    })
}

pub(super) fn place_of(met: Met) -> Vec2 {
    Vec2::from(met.at.map(f32::from)) / 65_535.0
}

fn hit_of(met: Met) -> Hit {
    let Vec2 { x, y } = place_of(met);
    Hit {
        triangle: met.triangle,
        u: x,
        v: y,
    }
}

/// Adds to each row of sums the same row times its factor.
pub(super) fn add_products(sums: &mut [f32], factors: impl Iterator<Item = f32>, row: &[f32]) {
    for (factor, sums) in factors.zip(sums.chunks_exact_mut(row.len().max(1))) {
        sums.iter_mut()
            .zip(row)
            .for_each(|(sum, own)| *sum += factor * own);
    }
}
