//! Transfer is worked out by rays, round by round.
//!
//! - Round 0 (P1): T⁰_i = ∫ Y_i(s) V(s) max(n·s, 0) ds, and the emission that rays meet.
//! - Round k (P2): Tᵏ_i = 1/π ∫ (1 − V) ρ(q) Tᵏ⁻¹_i(q) max(n·s, 0) ds, at what rays hit. In round 1
//!   analytic lights shine on what they hit.

use std::collections::VecDeque;
use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::fold;
use super::lattice::{Hanging, Lattice};
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
struct Met {
    /// [`NO_TRIANGLE`]: nothing.
    triangle: u32,
    at: [u16; 2],
    /// Diffuse albedo, times 65,535.
    albedo: [u16; 3],
    is_back: bool,
}

const NOTHING: Met = Met {
    triangle: NO_TRIANGLE,
    at: [0; 2],
    albedo: [0; 3],
    is_back: false,
};

/// Hits of all rays of all points are kept from round to round where they have no more bytes.
const MOST_KEPT_BYTES: usize = 2 << 30;
/// What the progress is called.
const TOLD: &str = "transfer";
const TOLD_CLUSTERS: &str = "clusters of transfer";
const TOLD_LOBES: &str = "transfer to lobes";
/// Rays by which the back of a triangle is looked at, from each of four places.
const BACK_RAYS: u32 = 16;

/// What is needed to work transfer out.
pub(super) struct Builder<'s> {
    surfaces: Surfaces<'s>,
    settings: TransferSettings,
    lattice: Lattice,
    rays: Rays,
    projector: Option<Projector>,
    has_emission: bool,
    lights: Vec<Light>,
    /// Numbers of a row: three a function.
    stride: usize,
}

/// What one point brings from a round.
struct Shot {
    row: Vec<f32>,
    visibility: f32,
    is_valid: bool,
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
        let is_valid: Vec<bool> = shots.iter().map(|shot| shot.is_valid).collect();
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
    fn collect(&self, outputs: usize, row: impl Fn(usize) -> Vec<f32> + Sync) -> Rows {
        let harmonics = (self.settings.order * self.settings.order) as usize;
        let compress = self.settings.compress.map(|own| (harmonics, own));
        let counts = [self.lattice.points.len(), outputs, self.stride / 3];
        Rows::collect(counts, compress, row)
    }

    /// Which light comes to points from where; those that are not valid have that of another.
    fn lobes(
        &self,
        projector: &Projector,
        (kept, stand_ins, senders): (Option<&[Met]>, &[u32], &[f32]),
        progress: Progress<'_>,
    ) -> Rows {
        let ray_count = self.settings.rays as usize;
        let done = std::sync::atomic::AtomicUsize::new(0);
        let row = |point: usize| {
            let number = stand_ins[point] as usize;
            let row = match kept {
                Some(kept) => {
                    let hits = &kept[number * ray_count..][..ray_count];
                    self.lobe(projector, number, hits, senders)
                }
                None => {
                    let mut hits = vec![NOTHING; ray_count];
                    self.cast(number, &mut hits);
                    self.lobe(projector, number, &hits, senders)
                }
            };
            let count = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            if count.is_multiple_of(64) {
                progress(TOLD_LOBES, (count as f32 / stand_ins.len() as f32).min(1.0));
            }
            row
        };
        let rows = self.collect(projector.count(), row);
        progress(TOLD_LOBES, 1.0);
        rows
    }

    /// The first number of a row that a round reflects: in the last one lights alone remain.
    fn first_reflected(&self, round: u32) -> usize {
        match round < self.settings.bounces {
            true => 0,
            false => self.stride - 3 * self.lights.len(),
        }
    }

    /// Directions of a point's rays; `None` where one goes below the surface.
    fn directions(&self, number: usize) -> impl Iterator<Item = Option<Vec3>> {
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
    fn cast(&self, number: usize, hits: &mut [Met]) {
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
            is_valid: backs as f32 <= self.settings.invalid_share * above as f32,
        }
    }

    /// What bands of a sky above the kept ones bring these, by points that are spread evenly.
    fn folded(&self, kept: Option<&[Met]>, is_valid: &[bool]) -> Vec<f32> {
        if self.settings.order == 0 {
            return Vec::new();
        }
        let valid: Vec<usize> = (0..is_valid.len()).filter(|at| is_valid[*at]).collect();
        let count = valid.len().min(fold::MOST_LEARNT);
        let rays = Rays::new(
            self.settings.sampling,
            self.settings.rays,
            fold::BANDS as u32,
        );
        let ray_count = rays.directions.len();
        let learnt = (0..count).into_par_iter().map(|at| {
            let number = valid[at * valid.len() / count];
            match kept {
                Some(kept) => {
                    self.open_row(&rays, number, &kept[number * ray_count..][..ray_count])
                }
                None => {
                    let mut hits = vec![NOTHING; ray_count];
                    self.cast(number, &mut hits);
                    self.open_row(&rays, number, &hits)
                }
            }
        });
        fold::learn(self.settings.order, &learnt.collect::<Vec<_>>())
    }

    /// The transfer of the sky itself to a point, by the harmonics of a set of rays.
    fn open_row(&self, rays: &Rays, number: usize, hits: &[Met]) -> Vec<f64> {
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
    fn emission(&self, met: Met) -> Vec3 {
        let hit = hit_of(met);
        let material = self.surfaces.material(hit);
        match material.emission == Vec3::ZERO {
            true => Vec3::ZERO,
            false => self.surfaces.emission(material, &self.surfaces.place(hit)),
        }
    }

    /// The matrix of a point: coefficients of the radiance above it, for each function of light.
    fn lobe(
        &self,
        projector: &Projector,
        number: usize,
        hits: &[Met],
        senders: &[f32],
    ) -> Vec<f32> {
        let point = &self.lattice.points[number];
        let frame = self.rays.frame_of(number, point);
        let first_light = self.stride - 3 * self.lights.len();
        let harmonics = self.rays.functions;
        // Of the sky, in the frame of the rays, and of what else they meet.
        let mut open = vec![0.0f32; projector.count() * harmonics];
        let mut met_sums = vec![0.0f32; projector.count() * self.stride];
        let mut light = vec![0.0f32; self.stride];
        for (ray, (met, direction)) in hits.iter().zip(self.directions(number)).enumerate() {
            let Some(direction) = direction else { continue };
            let weight = self.rays.weight(direction, point);
            let weights = projector.weights(ray, direction.dot(point.normal));
            let weights = weights.map(|own| weight * own);
            if met.triangle == NO_TRIANGLE {
                let basis = &self.rays.basis[ray * harmonics..][..harmonics];
                add_products(&mut open, weights, basis);
                continue;
            }
            light.fill(0.0);
            let reflected = Vec3::from(met.albedo.map(f32::from)) / 65_535.0 / PI;
            let Vec2 { x: u, y: v } = place_of(*met);
            let around = self.lattice.at(met.triangle, met.is_back, [u, v]);
            for (other, share) in around.into_iter().flatten() {
                let factors = (share * reflected).to_array();
                let other = &senders[other as usize * self.stride..][..self.stride];
                for (sum, value) in light.chunks_exact_mut(3).zip(other.chunks_exact(3)) {
                    for channel in 0..3 {
                        sum[channel] += factors[channel] * value[channel];
                    }
                }
            }
            if self.has_emission && !met.is_back {
                let emission = self.emission(*met).to_array();
                let column = &mut light[3 * harmonics..][..3];
                column
                    .iter_mut()
                    .zip(emission)
                    .for_each(|(sum, own)| *sum += own);
            }
            if !self.lights.is_empty() {
                let columns = light[first_light..].chunks_exact_mut(3);
                for (sum, irradiance) in columns.zip(self.lights_at(*met, direction)) {
                    for channel in 0..3 {
                        sum[channel] += reflected[channel] * irradiance;
                    }
                }
            }
            add_products(&mut met_sums, weights, &light);
        }
        let rotation = match self.settings.sampling {
            Sampling::Cosine => Some(Rotation::new(self.settings.order as usize, frame)),
            Sampling::Sphere => None,
        };
        let open = open.chunks_exact(harmonics.max(1));
        for (sums, open) in met_sums.chunks_exact_mut(self.stride).zip(open) {
            let open: Vec<f64> = open.iter().map(|sum| f64::from(*sum)).collect();
            let open = rotation
                .as_ref()
                .map_or(open.clone(), |turn| turn.apply(&open));
            for (sum, open) in sums.chunks_exact_mut(3).zip(open) {
                sum.iter_mut().for_each(|sum| *sum += open as f32);
            }
        }
        projector.solve(&met_sums, self.stride, (point, frame))
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
    fn lights_at(&self, met: Met, direction: Vec3) -> impl Iterator<Item = f32> {
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

fn place_of(met: Met) -> Vec2 {
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
fn add_products(sums: &mut [f32], factors: impl Iterator<Item = f32>, row: &[f32]) {
    for (factor, sums) in factors.zip(sums.chunks_exact_mut(row.len().max(1))) {
        sums.iter_mut()
            .zip(row)
            .for_each(|(sum, own)| *sum += factor * own);
    }
}

/// Gives points that hang on an edge what the coarser triangle has there.
fn hang(rows: &mut [f32], stride: usize, hanging: &[Hanging]) {
    for own in hanging {
        for at in 0..stride {
            let of = |point: u32| rows[point as usize * stride + at];
            let [a, b] = own.between.map(of);
            rows[own.point as usize * stride + at] = a + own.share * (b - a);
        }
    }
}

/// For each point a valid one: itself, or one of the nearest along the lattice. Those that no valid
/// one is near stand for themselves.
fn stand_ins(is_valid: &[bool], neighbours: &[Vec<u32>]) -> Vec<u32> {
    let mut found: Vec<u32> = (0..is_valid.len() as u32).collect();
    let mut is_known = is_valid.to_vec();
    let mut queue: VecDeque<u32> = found.clone().into();
    queue.retain(|point| is_valid[*point as usize]);
    while let Some(point) = queue.pop_front() {
        for other in &neighbours[point as usize] {
            if !std::mem::replace(&mut is_known[*other as usize], true) {
                found[*other as usize] = found[point as usize];
                queue.push_back(*other);
            }
        }
    }
    found
}

/// Gives points that are not valid the mean of their neighbours, ring by ring; returns how many.
/// Those that no valid one is near keep what they have.
fn fill(rows: &mut [f32], stride: usize, is_valid: &[bool], neighbours: &[Vec<u32>]) -> u32 {
    let mut is_known = is_valid.to_vec();
    let beside = |known: &[u32], is_known: &[bool]| {
        let near = known.iter().flat_map(|point| &neighbours[*point as usize]);
        let mut ring: Vec<u32> = near
            .copied()
            .filter(|point| !is_known[*point as usize])
            .collect();
        ring.sort_unstable();
        ring.dedup();
        ring
    };
    let valid: Vec<u32> = (0..is_valid.len() as u32)
        .filter(|point| is_valid[*point as usize])
        .collect();
    let mut ring = beside(&valid, &is_known);
    let mut count = 0;
    while !ring.is_empty() {
        let mean = |point: &u32| {
            let known =
                (neighbours[*point as usize].iter()).filter(|other| is_known[**other as usize]);
            let (mut sum, mut all) = (vec![0.0f32; stride], 0.0);
            for other in known {
                let other = &rows[*other as usize * stride..][..stride];
                sum.iter_mut().zip(other).for_each(|(sum, own)| *sum += own);
                all += 1.0;
            }
            sum.iter_mut().for_each(|sum| *sum /= all);
            sum
        };
        let means: Vec<Vec<f32>> = ring.iter().map(mean).collect();
        for (point, mean) in ring.iter().zip(means) {
            rows[*point as usize * stride..][..stride].copy_from_slice(&mean);
            is_known[*point as usize] = true;
        }
        count += ring.len() as u32;
        ring = beside(&ring, &is_known);
    }
    count
}
