//! The estimator: one camera sample split into the terms of L = L_e + L_direct + ρ/π E_i + L_s.
//!
//! Light is gathered backwards (J. Kajiya, *The Rendering Equation*, 1986): at each vertex the
//! analytic lights by shadow rays, the emissive triangles by sampling them and by scattering,
//! weighted by the power heuristic (E. Veach, thesis, 1997, ch. 9). So is a map of the environment;
//! a constant one by scattering alone. At the first vertex the diffuse and the specular lobe get a
//! ray each, so that the terms separate exactly.

use std::f32::consts::PI;

use glam::Vec3;

use super::bsdf::{Scatter, cosine_density, sample_cosine};
use super::emitters::LightSample;
use super::glass::Seen;
use super::sampler::Sampler;
use super::world::{Surface, World};
use super::{Bounces, Occlusion, bsdf::Lobe};
use crate::scene::rays::Ray;
use crate::scene::{Environment, SkySample};

/// Roulette starts at this indirect bounce.
const ROULETTE_FROM_BOUNCE: u32 = 3;

/// The same where bounces are counted: beyond what anybody needs without noise of it, and before a
/// path takes forever.
const COUNTED_ROULETTE_FROM_BOUNCE: u32 = 64;

/// One sample, or the mean of many, of a pixel's terms.
#[derive(Clone, Copy, Default)]
pub(super) struct Terms {
    /// L_e seen directly [W/(m² sr)].
    pub(super) emission: Vec3,
    /// Light of the analytic lights, reflected once [W/(m² sr)].
    pub(super) direct: Vec3,
    /// E_i, indirect irradiance [W/m²].
    pub(super) irradiance: Vec3,
    /// ρ/π E_i [W/(m² sr)].
    pub(super) diffuse: Vec3,
    /// L_s [W/(m² sr)].
    pub(super) specular: Vec3,
    /// Ambient visibility.
    pub(super) visibility: f32,
}

impl Terms {
    /// Applies `f` to each number of `self` and the same of `other`.
    pub(super) fn zip(self, other: Terms, f: impl Fn(f32, f32) -> f32) -> Terms {
        let each = |a: Vec3, b: Vec3| Vec3::new(f(a.x, b.x), f(a.y, b.y), f(a.z, b.z));
        Terms {
            emission: each(self.emission, other.emission),
            direct: each(self.direct, other.direct),
            irradiance: each(self.irradiance, other.irradiance),
            diffuse: each(self.diffuse, other.diffuse),
            specular: each(self.specular, other.specular),
            visibility: f(self.visibility, other.visibility),
        }
    }

    /// Indirect radiance [W/(m² sr)].
    pub(super) fn indirect(&self) -> Vec3 {
        self.diffuse + self.specular
    }

    /// Outgoing radiance [W/(m² sr)].
    pub(super) fn radiance(&self) -> Vec3 {
        self.emission + self.direct + self.indirect()
    }
}

/// What goes on behind the second vertex of a path.
#[derive(Clone, Copy)]
pub(super) struct Beyond<'a> {
    /// How many bounces are counted.
    pub(super) bounces: Bounces,
    /// Radiance that the second vertex reflects [W/(m² sr)], where somebody knows it; otherwise the
    /// path goes on.
    pub(super) reflected: Option<&'a dyn Fn(&Surface) -> Vec3>,
    /// How it counts in the ambient visibility.
    pub(super) occlusion: Occlusion,
}

/// Light found along a scattered ray.
#[derive(Default)]
struct Gathered {
    /// What surfaces reflect, and what emitters and the environment send, weighted against sampling
    /// of them [W/(m² sr)].
    radiance: Vec3,
    /// How much of the ray is open: all where it met nothing.
    open: f32,
}

/// Veach's power heuristic with exponent 2.
fn power_heuristic(own: f32, other: f32) -> f32 {
    if !own.is_finite() {
        return 1.0;
    }
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

impl World<'_> {
    /// The terms of one sample at a first hit. `lights` is the light of the analytic lights there
    /// where it is known already.
    pub(super) fn shade_first(
        &self,
        surface: &Surface,
        lights: Option<Vec3>,
        beyond: Beyond<'_>,
        sampler: &mut Sampler,
    ) -> Terms {
        sampler.start_vertex(1);
        let point = sampler.next_2d();
        let direction = sample_cosine(surface.normal, point);
        let mut terms = Terms {
            emission: surface.emission,
            ..Terms::default()
        };
        terms.direct = lights.unwrap_or_else(|| self.light_from_lights(surface, sampler));
        let sent = [
            self.sample_emitter(surface, sampler),
            self.sample_sky(surface, sampler),
        ]
        .map(|sample| sample.filter(|_| beyond.bounces != Bounces::Count(0)));
        let specular_point = surface.lobe.map(|lobe| (lobe, sampler.next_2d()));
        // ρ/π E_i is ρ times this, and E_i is π times it.
        let mut mean_radiance = Vec3::ZERO;
        for sample in sent.iter().flatten() {
            let density = cosine_density(surface.normal.dot(sample.wi));
            mean_radiance += sample.radiance
                * (density * power_heuristic(sample.density, density) / sample.density);
        }
        if surface.is_above(direction) {
            let density = cosine_density(surface.normal.dot(direction));
            let gathered = self.gather(surface, direction, density, beyond, sampler);
            mean_radiance += gathered.radiance;
            terms.visibility = gathered.open;
        }
        terms.irradiance = mean_radiance * PI;
        terms.diffuse = surface.albedo * mean_radiance;
        if let Some((lobe, point)) = specular_point {
            terms.specular = self.shade_specular(surface, &lobe, point, &sent, beyond, sampler);
        }
        if let Some(glass) = &surface.glass {
            let opaque = 1.0 - glass.share;
            terms.direct *= opaque;
            terms.diffuse *= opaque;
            // So that the diffuse term is still ρ/π of it.
            terms.irradiance *= opaque;
            let seen = self.see_through(surface, glass, sampler);
            let through = self.shown(surface, seen, beyond, sampler);
            terms.specular = opaque * terms.specular + glass.share * through;
        }
        terms
    }

    /// What is seen through a clear surface: straight, as if nothing were in front but what filters
    /// it; bent, as in a mirror.
    fn shown(
        &self,
        surface: &Surface,
        seen: Seen,
        beyond: Beyond<'_>,
        sampler: &mut Sampler,
    ) -> Vec3 {
        match &seen.surface {
            Some(next) if !seen.is_bent => {
                // Its clear part was passed already.
                let mut next = *next;
                next.glass = None;
                let terms = self.shade_first(&next, None, beyond, sampler);
                seen.throughput * terms.radiance()
            }
            None if !seen.is_bent => {
                seen.throughput * self.weighted_sky(seen.ray.direction, f32::INFINITY)
            }
            _ => (self.brought_back(surface, seen, f32::INFINITY, beyond, sampler)).radiance,
        }
    }

    /// L_s, from what was sampled of emitters and the sky and from a ray scattered by the lobe.
    fn shade_specular(
        &self,
        surface: &Surface,
        lobe: &Lobe,
        point: [f32; 2],
        sent: &[Option<LightSample>],
        beyond: Beyond<'_>,
        sampler: &mut Sampler,
    ) -> Vec3 {
        let from_sample = |sample: &LightSample| {
            let (value, density) = lobe.evaluate(surface.normal, surface.wo, sample.wi);
            sample.radiance * value * (power_heuristic(sample.density, density) / sample.density)
        };
        let from_samples: Vec3 = sent.iter().flatten().map(from_sample).sum();
        let scatter = lobe
            .sample(surface.normal, surface.wo, point)
            .filter(|scatter| surface.is_above(scatter.direction));
        let Some(Scatter {
            direction,
            weight,
            density,
        }) = scatter
        else {
            return from_samples;
        };
        from_samples
            + weight
                * self
                    .gather(surface, direction, density, beyond, sampler)
                    .radiance
    }

    /// What a ray scattered off the first surface brings back: nothing without a bounce, as a
    /// technique's gather is its first.
    fn gather(
        &self,
        surface: &Surface,
        direction: Vec3,
        density: f32,
        beyond: Beyond<'_>,
        sampler: &mut Sampler,
    ) -> Gathered {
        let seen = self.see(surface.ray(direction), sampler);
        self.brought_back(surface, seen, density, beyond, sampler)
    }

    /// What comes back along a way that a direction of some density began.
    fn brought_back(
        &self,
        surface: &Surface,
        seen: Seen,
        density: f32,
        beyond: Beyond<'_>,
        sampler: &mut Sampler,
    ) -> Gathered {
        let Seen {
            throughput,
            surface: next,
            ray,
            is_bent,
        } = seen;
        let density = if is_bent { f32::INFINITY } else { density };
        let distance = |next: &Surface| next.position.distance(surface.position);
        let open =
            (next.as_ref()).map_or(1.0, |next| 1.0 - beyond.occlusion.weight(distance(next)));
        let radiance = match next {
            _ if beyond.bounces == Bounces::Count(0) => Vec3::ZERO,
            None => self.weighted_sky(ray.direction, density),
            Some(next) => {
                self.weighted_emission(&ray, &next, density)
                    + match beyond.reflected {
                        Some(reflected) => reflected(&next),
                        None => self.reflected(next, beyond.bounces, sampler),
                    }
            }
        };
        Gathered {
            radiance: throughput * radiance,
            open,
        }
    }

    /// Emission met by scattering with `density`, weighted against emitter sampling.
    fn weighted_emission(&self, ray: &Ray, emitter: &Surface, density: f32) -> Vec3 {
        if emitter.emission == Vec3::ZERO {
            return Vec3::ZERO;
        }
        emitter.emission * power_heuristic(density, self.emitters.density(ray.origin, emitter))
    }

    /// Light of the environment that scattering with `density` comes to, weighted against sampling
    /// of its map.
    fn weighted_sky(&self, direction: Vec3, density: f32) -> Vec3 {
        match &self.scene.environment {
            Environment::Map(sky) => {
                sky.radiance(direction) * power_heuristic(density, sky.density(direction))
            }
            Environment::Uniform(radiance) => *radiance,
        }
    }

    /// Draws a direction towards the environment from its map, as seen from a surface; `None` where
    /// there is no map, or the direction is behind.
    fn sample_sky(&self, surface: &Surface, sampler: &mut Sampler) -> Option<LightSample> {
        let sky = self.scene.environment.sky()?;
        let SkySample { direction, density } = sky.sample(sampler.next_2d());
        if !surface.is_above(direction) || density <= 0.0 {
            return None;
        }
        let clearness = self.clearness_to(&surface.ray(direction), f32::INFINITY);
        Some(LightSample {
            wi: direction,
            radiance: clearness * sky.radiance(direction),
            density,
        })
    }

    /// Radiance that leaves the second vertex of a path towards the first, its own emission
    /// excluded [W/(m² sr)].
    fn reflected(&self, mut surface: Surface, bounces: Bounces, sampler: &mut Sampler) -> Vec3 {
        let mut throughput = Vec3::ONE;
        let mut radiance = Vec3::ZERO;
        for bounce in 1u32.. {
            sampler.start_vertex(bounce + 1);
            let scatter = surface.scatter(sampler);
            radiance += throughput * self.light_from_lights(&surface, sampler);
            // What emitters and the environment send here is one gather more.
            if bounces == Bounces::Count(bounce) {
                break;
            }
            let sent = [
                self.sample_emitter(&surface, sampler),
                self.sample_sky(&surface, sampler),
            ];
            for sample in sent.into_iter().flatten() {
                let weight = power_heuristic(sample.density, surface.density(sample.wi));
                radiance += throughput
                    * surface.reflect(sample.wi)
                    * sample.radiance
                    * (weight / sample.density);
            }
            let Some(scatter) = scatter else { break };
            throughput *= scatter.weight;
            let ray = surface.ray(scatter.direction);
            let seen = self.see(ray, sampler);
            throughput *= seen.throughput;
            let density = if seen.is_bent {
                f32::INFINITY
            } else {
                scatter.density
            };
            let Some(next) = seen.surface else {
                radiance += throughput * self.weighted_sky(seen.ray.direction, density);
                break;
            };
            radiance += throughput * self.weighted_emission(&seen.ray, &next, density);
            let roulette_from = match bounces {
                Bounces::Full => ROULETTE_FROM_BOUNCE,
                Bounces::Count(_) => COUNTED_ROULETTE_FROM_BOUNCE,
            };
            if bounce >= roulette_from {
                let survival = throughput.max_element().min(0.95);
                if sampler.next_1d() >= survival {
                    break;
                }
                throughput /= survival;
            }
            surface = next;
        }
        radiance
    }
}
