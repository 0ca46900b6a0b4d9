//! What light each point gets: the transfer of Sloan, Kautz & Snyder (2002), worked out on the
//! host.
//!
//! A point's row has for each function of the light what irradiance a unit of it brings: spherical
//! harmonics of the environment, then columns of emission and of each analytic light. No albedo of
//! the receiver is in it.
//!
//! - Round 0 (P1): T⁰_i = ∫ Y_i(s) V(s) max(n·s, 0) ds, and the emission that rays meet.
//! - Round k (P2): Tᵏ_i = 1/π ∫ (1 − V) ρ(q) Tᵏ⁻¹_i(q) max(n·s, 0) ds, at what rays hit. In round 1
//!   analytic lights shine on what they hit.

use std::f32::consts::PI;
use std::path::Path;

use glam::{DMat3, DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::cache;
use super::lattice::{Lattice, LatticeSettings, Point};
use crate::gi::shared::sh::{self, Rotation};
use crate::scene::rays::{Hit, NO_TRIANGLE, Ray};
use crate::scene::surfaces::Surfaces;
use crate::scene::{Light, Scene};

/// Where a point's rays go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// Cosine-distributed, a spiral that each point turns.
    Cosine,
    /// Over the sphere in strata, the same for all points.
    Sphere,
}

/// How transfer is worked out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransferSettings {
    /// Where the points are.
    pub lattice: LatticeSettings,
    /// Bands of spherical harmonics.
    pub order: u32,
    /// Rays of a point.
    pub rays: u32,
    /// Where they go.
    pub sampling: Sampling,
    /// Times that light goes on from one surface to the next, the last one to the camera.
    pub bounces: u32,
    /// Backs of triangles have points too, where something is seen from there.
    pub has_backs: bool,
    /// A point of whose rays a larger share ends on back faces takes what its neighbours have.
    pub invalid_share: f32,
    /// Emission and analytic lights have columns.
    pub has_lights: bool,
}

/// The transfer of all points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transfer {
    /// Where it is kept.
    pub lattice: Lattice,
    /// Bands of spherical harmonics.
    pub order: u32,
    /// Functions of a row: harmonics, then emission where something emits, then analytic lights.
    pub functions: u32,
    /// Of each point, of each function: red, green and blue (W/m²).
    pub rows: Vec<f32>,
    /// Of each point: the share of the hemisphere that is open, by cosine.
    pub visibility: Vec<f32>,
    /// Points that took what their neighbours have.
    pub filled: u32,
}

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
/// Rays by which the back of a triangle is looked at, from each of four places.
const BACK_RAYS: u32 = 16;

/// Directions with weights: E = Σ w L. Local ones have the normal along z.
struct Rays {
    directions: Vec<Vec3>,
    /// Y of each, f32: a row a direction.
    basis: Vec<f32>,
    functions: usize,
    sampling: Sampling,
}

/// A progress of 0 to 1, told from any thread.
pub type Progress<'p> = &'p (dyn Fn(f32) + Sync);

impl Rays {
    fn new(sampling: Sampling, count: u32, order: u32) -> Self {
        let direction = |ray: u32| match sampling {
            Sampling::Cosine => {
                let golden = PI * (3.0 - 5f32.sqrt());
                let radius = ((ray as f32 + 0.5) / count as f32).sqrt();
                let (sin, cos) = ((ray as f32 * golden) % (2.0 * PI)).sin_cos();
                let up = (1.0 - radius * radius).max(0.0).sqrt();
                Vec3::new(radius * cos, radius * sin, up)
            }
            Sampling::Sphere => {
                // Strata of equal areas, a random place in each.
                let rows = (f64::from(count) / 2.0).sqrt().ceil() as u32;
                let columns = count.div_ceil(rows);
                let [x, y] = [0, 1].map(|axis| unit_number(2 * ray + axis));
                let z = 1.0 - 2.0 * ((ray / columns) as f32 + x) / rows as f32;
                let turn = 2.0 * PI * ((ray % columns) as f32 + y) / columns as f32;
                let flat = (1.0 - z * z).max(0.0).sqrt();
                Vec3::new(flat * turn.cos(), flat * turn.sin(), z)
            }
        };
        let directions: Vec<Vec3> = (0..count).map(direction).collect();
        let functions = (order * order) as usize;
        let mut values = vec![0.0; functions];
        let mut basis = Vec::with_capacity(directions.len() * functions);
        for direction in &directions {
            sh::evaluate(order as usize, direction.as_dvec3(), &mut values);
            basis.extend(values.iter().map(|value| *value as f32));
        }
        Rays {
            directions,
            basis,
            functions,
            sampling,
        }
    }

    /// From the directions of the set to those of a point.
    fn frame_of(&self, number: usize, point: &Point) -> DMat3 {
        if self.sampling == Sampling::Sphere {
            return DMat3::IDENTITY;
        }
        let normal = point.normal.as_dvec3();
        let along = point.along.as_dvec3().reject_from_normalized(normal);
        let along = along.normalize_or(normal.any_orthonormal_vector());
        let turn = f64::from(unit_number(number as u32)) * std::f64::consts::TAU;
        let (sin, cos) = turn.sin_cos();
        let x = along * cos + normal.cross(along) * sin;
        DMat3::from_cols(x, normal.cross(x), normal)
    }

    /// Of a ray: E = Σ w L.
    fn weight(&self, direction: Vec3, point: &Point) -> f32 {
        let count = self.directions.len() as f32;
        match self.sampling {
            Sampling::Cosine => PI / count,
            Sampling::Sphere => 4.0 * PI / count * direction.dot(point.normal).max(0.0),
        }
    }
}

/// A number of 0 to 1 for each other number (Wang's hash).
fn unit_number(seed: u32) -> f32 {
    let mut x = (seed ^ 61) ^ (seed >> 16);
    x = x.wrapping_mul(9);
    x ^= x >> 4;
    x = x.wrapping_mul(0x27d4_eb2d);
    x ^= x >> 15;
    (x >> 8) as f32 / (1 << 24) as f32
}

/// What is needed to work transfer out.
struct Builder<'s> {
    surfaces: Surfaces<'s>,
    settings: TransferSettings,
    lattice: Lattice,
    rays: Rays,
    has_emission: bool,
    lights: Vec<Light>,
    /// Numbers of a row: three a function.
    stride: usize,
}

impl Transfer {
    /// Works out the transfer of a scene.
    pub fn new(scene: &Scene, settings: TransferSettings, progress: Progress<'_>) -> Self {
        let surfaces = Surfaces::new(scene);
        let backs: Vec<bool> = (0..scene.triangles.len())
            .into_par_iter()
            .map(|triangle| settings.has_backs && is_back_seen(&surfaces, triangle))
            .collect();
        let lattice = Lattice::new(scene, settings.lattice, |triangle| backs[triangle]);
        let has_emission = settings.has_lights && scene.is_emissive();
        let lights = match settings.has_lights {
            true => scene.lights.iter().map(unit_light).collect(),
            false => Vec::new(),
        };
        let harmonics = settings.order * settings.order;
        let functions = harmonics + u32::from(has_emission) + lights.len() as u32;
        let builder = Builder {
            surfaces,
            settings,
            rays: Rays::new(settings.sampling, settings.rays, settings.order),
            has_emission,
            lights,
            stride: 3 * functions as usize,
            lattice,
        };
        builder.build(functions, progress)
    }

    /// That of a file in a folder or, where there is none, worked out and kept there.
    pub fn kept(
        scene: &Scene,
        settings: TransferSettings,
        folder: &Path,
        progress: Progress<'_>,
    ) -> Self {
        let path = cache::path_in(folder, scene, &settings);
        if path.exists() {
            match cache::read(&path) {
                Some(transfer) => return transfer,
                None => log::warn!(
                    "{} is damaged: the transfer is worked out again",
                    path.display()
                ),
            }
        }
        let transfer = Transfer::new(scene, settings, progress);
        if let Err(problem) = cache::write(&path, &transfer) {
            log::warn!(
                "the transfer cannot be kept in {}: {problem}; it will be worked out again",
                folder.display()
            );
        }
        transfer
    }

    /// The row of a point.
    pub fn row(&self, point: usize) -> &[f32] {
        let stride = 3 * self.functions as usize;
        &self.rows[point * stride..][..stride]
    }
}

/// A light of intensity, or irradiance, 1.
pub(super) fn unit_light(light: &Light) -> Light {
    let mut unit = *light;
    match &mut unit {
        Light::Directional { irradiance, .. } => *irradiance = Vec3::ONE,
        Light::Point { intensity, .. } | Light::Spot { intensity, .. } => *intensity = Vec3::ONE,
    }
    unit
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

/// What one point brings from a round.
struct Shot {
    row: Vec<f32>,
    visibility: f32,
    is_valid: bool,
}

impl Builder<'_> {
    fn build(self, functions: u32, progress: Progress<'_>) -> Transfer {
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
                progress(count as f32 / all as f32);
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
        let mut rows = last.clone();
        for round in 1..rounds as u32 {
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
            rows.par_iter_mut()
                .zip(&last)
                .for_each(|(sum, more)| *sum += more);
        }
        progress(1.0);
        Transfer {
            lattice: self.lattice,
            order: self.settings.order,
            functions,
            rows,
            visibility,
            filled,
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
        let mut open = vec![0.0f32; self.rays.functions];
        let mut emission = Vec3::ZERO;
        let (mut backs, mut above, mut visible) = (0, 0, 0.0);
        for (ray, (met, direction)) in hits.iter().zip(self.directions(number)).enumerate() {
            let Some(direction) = direction else { continue };
            above += 1;
            let weight = self.rays.weight(direction, point);
            if met.triangle == NO_TRIANGLE {
                visible += weight;
                let basis = &self.rays.basis[ray * self.rays.functions..][..self.rays.functions];
                for (sum, basis) in open.iter_mut().zip(basis) {
                    *sum += weight * basis;
                }
            } else if met.is_back {
                backs += 1;
            } else if self.has_emission {
                let hit = hit_of(*met);
                let material = self.surfaces.material(hit);
                if material.emission != Vec3::ZERO {
                    let place = self.surfaces.place(hit);
                    emission += weight * self.surfaces.emission(material, &place);
                }
            }
        }
        let turned: Vec<f64> = open.iter().map(|sum| f64::from(*sum)).collect();
        let rotation = match self.settings.sampling {
            Sampling::Cosine => {
                let frame = self.rays.frame_of(number, point);
                Rotation::new(self.settings.order as usize, frame).apply(&turned)
            }
            Sampling::Sphere => turned,
        };
        let mut row = Vec::with_capacity(self.stride);
        row.extend(rotation.iter().flat_map(|value| [*value as f32; 3]));
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

    /// What a point gets in a round of what surfaces had in the round before.
    fn bounce(&self, number: usize, hits: &[Met], round: u32, last: &[f32]) -> Vec<f32> {
        let point = &self.lattice.points[number];
        let first_light = self.stride - 3 * self.lights.len();
        // Of the last round lights alone remain.
        let from = match round < self.settings.bounces {
            true => 0,
            false => first_light,
        };
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

/// Radiance of a sky as harmonics, red, green and blue of each, before it is scaled and turned:
/// texels by their solid angles, and where they are large, by places in each.
pub fn project_sky(order: u32, sky: &crate::scene::Sky) -> Vec<DVec3> {
    let image = sky.image();
    let parts = 256u32.div_ceil(image.width).max(1);
    let (width, height) = (parts * image.width, parts * image.height);
    let plain = sky.with(1.0, 0.0);
    let functions = (order * order) as usize;
    let row = |y: u32| {
        let edge = |y: u32| (std::f64::consts::PI * f64::from(y) / f64::from(height)).cos();
        let solid_angle = (edge(y) - edge(y + 1)) * std::f64::consts::TAU / f64::from(width);
        let (mut sums, mut basis) = (vec![DVec3::ZERO; functions], vec![0.0; functions]);
        let middle = std::f64::consts::PI * (f64::from(y) + 0.5) / f64::from(height);
        for x in 0..width {
            let (sin, cos) =
                (std::f64::consts::TAU * (f64::from(x) + 0.5) / f64::from(width)).sin_cos();
            let direction = DVec3::new(middle.sin() * sin, middle.cos(), -middle.sin() * cos);
            sh::evaluate(order as usize, direction, &mut basis);
            let light = solid_angle * plain.radiance(direction.as_vec3()).as_dvec3();
            for (sum, basis) in sums.iter_mut().zip(&basis) {
                *sum += *basis * light;
            }
        }
        sums
    };
    let rows: Vec<Vec<DVec3>> = (0..height).into_par_iter().map(row).collect();
    (0..functions)
        .map(|at| rows.iter().map(|row| row[at]).sum())
        .collect()
}
