//! Transfer of more than irradiance: matrices of points, and what bands of a sky above the kept
//! ones bring these.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::build::{Builder, Met, NOTHING, add_products, place_of};
use super::fold;
use super::lobes::Projector;
use super::rays::{Rays, Sampling};
use super::rows::Rows;
use super::transfer::Progress;
use crate::gi::shared::sh::Rotation;
use crate::scene::rays::NO_TRIANGLE;

const TOLD_LOBES: &str = "transfer to lobes";

impl Builder<'_> {
    /// Which light comes to points from where; those that are not valid have that of another.
    pub(super) fn lobes(
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

    /// What bands of a sky above the kept ones bring these, by points that are spread evenly.
    pub(super) fn folded(&self, kept: Option<&[Met]>, is_valid: &[bool]) -> Vec<f32> {
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
        let all = self.lattice.areas_m2(self.surfaces.scene);
        let area_m2 = |at: usize| all[valid[at * valid.len() / count]];
        let areas_m2: Vec<f64> = (0..count).map(area_m2).collect();
        fold::learn(self.settings.order, &learnt.collect::<Vec<_>>(), &areas_m2)
    }
}
