//! Light sources to sample: emissive triangles by power, and the analytic lights.

use glam::Vec3;

use super::sampler::Sampler;
use super::world::{Surface, World};
use crate::image::luminance;
use crate::scene::rays::{Hit, corners};
use crate::scene::texture_sampler::TextureSampler;
use crate::scene::{Light, Scene};

/// Up to this many analytic lights are all evaluated at a vertex; of more, one is drawn in
/// proportion to its unshadowed irradiance.
const MAX_LIGHTS_EVALUATED: usize = 8;

/// The emissive triangles, drawn in proportion to area times mean emitted luminance.
pub(super) struct Emitters {
    triangles: Vec<u32>,
    /// Running sum of the probabilities, ending at 1.
    cumulative: Vec<f32>,
    /// Per scene triangle: density of sampled points [1/m²]; empty where nothing emits.
    density_per_area: Vec<f32>,
}

/// A direction towards an emitter or the sky.
pub(super) struct LightSample {
    /// Unit direction.
    pub(super) wi: Vec3,
    /// Emitted radiance, zero where hidden [W/(m² sr)].
    pub(super) radiance: Vec3,
    /// Density [1/sr].
    pub(super) density: f32,
}

impl Emitters {
    pub(super) fn new(scene: &Scene, textures: &TextureSampler) -> Self {
        let powers: Vec<(u32, f64, f64)> = (0..scene.triangles.len() as u32)
            .filter_map(|index| {
                let triangle = &scene.triangles[index as usize];
                let material = &scene.materials[triangle.material as usize];
                let [p0, p1, p2] = corners(scene, triangle);
                let area = 0.5 * f64::from((p1 - p0).cross(p2 - p0).length());
                let tint = material.emission_texture.map_or(Vec3::ONE, |texture| {
                    textures.mean(&scene.textures[texture as usize]).truncate()
                });
                let power = area * f64::from(luminance(material.emission * tint));
                (power > 0.0).then_some((index, area, power))
            })
            .collect();
        if powers.is_empty() {
            return Emitters {
                triangles: Vec::new(),
                cumulative: Vec::new(),
                density_per_area: Vec::new(),
            };
        }
        let total: f64 = powers.iter().map(|&(_, _, power)| power).sum();
        let mut density_per_area = vec![0.0; scene.triangles.len()];
        let mut running = 0.0;
        let mut cumulative = Vec::with_capacity(powers.len());
        for &(index, area, power) in &powers {
            running += power / total;
            cumulative.push(running as f32);
            density_per_area[index as usize] = (power / total / area) as f32;
        }
        Emitters {
            triangles: powers.iter().map(|&(index, _, _)| index).collect(),
            cumulative,
            density_per_area,
        }
    }

    /// Whether no triangle emits.
    pub(super) fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Density [1/sr] with which a point of `emitter` (whose `wo` points back) is drawn from
    /// `origin`.
    pub(super) fn density(&self, origin: Vec3, emitter: &Surface) -> f32 {
        let Some(&per_area) = self.density_per_area.get(emitter.triangle as usize) else {
            return 0.0;
        };
        let cosine = emitter.geometric_normal.dot(emitter.wo);
        if cosine <= 0.0 {
            0.0
        } else {
            per_area * origin.distance_squared(emitter.position) / cosine
        }
    }
}

impl World<'_> {
    /// Whether [`World::light_from_lights`] is exact: evaluates every light, draws no number.
    pub(super) fn has_exact_lights(&self) -> bool {
        self.scene.lights.len() <= MAX_LIGHTS_EVALUATED
    }

    /// Draws a point on an emissive triangle, as seen from a surface; `None` where nothing emits or
    /// the point is behind.
    pub(super) fn sample_emitter(
        &self,
        surface: &Surface,
        sampler: &mut Sampler,
    ) -> Option<LightSample> {
        if self.emitters.is_empty() {
            return None;
        }
        let choice = sampler.next_1d();
        let [x, y] = sampler.next_2d();
        let slot = self
            .emitters
            .cumulative
            .partition_point(|&end| end <= choice)
            .min(self.emitters.triangles.len() - 1);
        let root = x.sqrt();
        let hit = Hit {
            triangle: self.emitters.triangles[slot],
            u: root * (1.0 - y),
            v: root * y,
        };
        let [p0, p1, p2] = corners(self.scene, &self.scene.triangles[hit.triangle as usize]);
        let target = p0 * (1.0 - hit.u - hit.v) + p1 * hit.u + p2 * hit.v;
        let to_target = target - surface.origin();
        let distance_m = to_target.length();
        let wi = to_target / distance_m;
        if !wi.is_finite() || hit.triangle == surface.triangle || !surface.is_above(wi) {
            return None;
        }
        let emitter = self.surface(hit, -wi);
        let density = self.emitters.density(surface.origin(), &emitter);
        if emitter.emission == Vec3::ZERO || density <= 0.0 || !self.is_solid(hit) {
            return None;
        }
        let clearness = self.clearness(&surface.ray(wi), distance_m, hit.triangle);
        Some(LightSample {
            wi,
            radiance: clearness * emitter.emission,
            density,
        })
    }

    /// Radiance [W/(m² sr)] towards the viewer of the surface from the analytic lights, reflected
    /// once.
    pub(super) fn light_from_lights(&self, surface: &Surface, sampler: &mut Sampler) -> Vec3 {
        let lights = &self.scene.lights;
        if self.has_exact_lights() {
            return lights
                .iter()
                .map(|light| self.light_from(light, surface))
                .sum();
        }
        // One pass of weighted reservoir sampling, one number reused.
        let mut random = sampler.next_1d();
        let (mut total, mut chosen) = (0.0f32, None);
        for light in lights {
            let (wi, _, irradiance) = light.sample(surface.origin());
            let weight = luminance(irradiance) * surface.normal.dot(wi).max(0.0);
            if !(weight > 0.0 && weight.is_finite()) {
                continue;
            }
            total += weight;
            let probability = weight / total;
            if random < probability {
                chosen = Some((light, weight));
                random /= probability;
            } else {
                random = (random - probability) / (1.0 - probability);
            }
        }
        chosen.map_or(Vec3::ZERO, |(light, weight)| {
            self.light_from(light, surface) * (total / weight)
        })
    }

    fn light_from(&self, light: &Light, surface: &Surface) -> Vec3 {
        let (wi, distance_m, irradiance) = light.sample(surface.origin());
        let reflected = surface.reflect(wi) * irradiance;
        if reflected == Vec3::ZERO || !reflected.is_finite() {
            return Vec3::ZERO;
        }
        reflected * self.clearness_to(&surface.ray(wi), distance_m)
    }
}
