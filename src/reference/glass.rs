//! What is clear: interfaces that refract, and thin sheets that light passes straight.
//!
//! At an interface light is mirrored by the Fresnel reflectance of unpolarised light and refracted
//! by Snell's law (Born & Wolf, *Principles of Optics*, section 1.5). Radiance is not scaled by η²:
//! the camera and what is seen are in air, and so the factors of a way cancel.

use glam::Vec3;

use super::sampler::Sampler;
use super::world::{Surface, World};
use crate::scene::Transmission;
use crate::scene::clear::{fresnel, refract};
use crate::scene::rays::{NO_TRIANGLE, Ray};

/// Interfaces of one way, after which it ends: each is a mirror or a window, so that a ray in a
/// body of glass may go on for long.
const MOST_INTERFACES: u32 = 64;

/// The clear part of a surface, on the way of a ray that meets it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Glass {
    /// Share of the surface that is clear.
    pub(super) share: f32,
    /// What is left of light that passes this surface.
    filter: Vec3,
    /// Index of refraction on the viewer's side over that on the other; 1 for a thin sheet.
    eta: f32,
    /// Light passes straight.
    is_thin: bool,
}

/// Where a ray goes on.
struct Passed {
    direction: Vec3,
    /// On the other side than it came from.
    is_through: bool,
    weight: Vec3,
}

/// What a ray meets behind all that is clear on its way.
pub(super) struct Seen {
    /// What is left of the light that comes back along the way.
    pub(super) throughput: Vec3,
    /// What is met; `None` where the way leaves the scene.
    pub(super) surface: Option<Surface>,
    /// The last piece of the way.
    pub(super) ray: Ray,
    /// It was bent, and nothing that aims at light goes that way.
    pub(super) is_bent: bool,
}

impl Glass {
    /// Of a transmission, met on the front side or the back.
    pub(super) fn new(transmission: &Transmission, is_front: bool) -> Self {
        let is_thin = transmission.index == 1.0;
        let filter = transmission.filter;
        Glass {
            share: transmission.share,
            // A body has two surfaces on the way.
            filter: if is_thin { filter } else { filter.powf(0.5) },
            eta: if is_front {
                1.0 / transmission.index
            } else {
                transmission.index
            },
            is_thin,
        }
    }

    /// What is left of light that goes straight through a thin sheet, opaque parts and all; none
    /// passes a body straight.
    fn straight(&self) -> Vec3 {
        if self.is_thin {
            self.share * self.filter
        } else {
            Vec3::ZERO
        }
    }

    /// Mirrors or refracts, by a number of [0, 1).
    fn pass(&self, surface: &Surface, random: f32) -> Passed {
        if self.is_thin {
            return Passed {
                direction: -surface.wo,
                is_through: true,
                weight: self.filter,
            };
        }
        let cosine = surface.normal.dot(surface.wo).clamp(0.0, 1.0);
        let mirrored = Passed {
            direction: (surface.normal * (2.0 * cosine) - surface.wo).normalize(),
            is_through: false,
            weight: Vec3::ONE,
        };
        let Some(refracted) = refract(cosine, self.eta) else {
            return mirrored;
        };
        if random < fresnel(cosine, refracted, self.eta) {
            return mirrored;
        }
        let bent = self.eta * -surface.wo + (self.eta * cosine - refracted) * surface.normal;
        Passed {
            direction: bent.normalize(),
            is_through: true,
            weight: self.filter,
        }
    }
}

impl World<'_> {
    /// What a ray meets behind all that is clear. Random numbers are drawn where it meets something
    /// clear alone.
    pub(super) fn see(&self, ray: Ray, sampler: &mut Sampler) -> Seen {
        let mut seen = Seen {
            throughput: Vec3::ONE,
            surface: self.trace(&ray),
            ray,
            is_bent: false,
        };
        for _ in 0..MOST_INTERFACES {
            let Some(surface) = seen.surface else {
                return seen;
            };
            let Some(glass) = surface.glass else {
                return seen;
            };
            if glass.share < 1.0 && sampler.next_1d() >= glass.share {
                return seen;
            }
            self.pass(&surface, &glass, &mut seen, sampler);
        }
        seen.throughput = Vec3::ZERO;
        seen
    }

    /// What is seen through, and mirrored by, the clear part of a surface.
    pub(super) fn see_through(
        &self,
        surface: &Surface,
        glass: &Glass,
        sampler: &mut Sampler,
    ) -> Seen {
        let mut first = Seen {
            throughput: Vec3::ONE,
            surface: None,
            ray: surface.ray(surface.normal),
            is_bent: !glass.is_thin,
        };
        let passed = self.go_on(surface, glass, &mut first, sampler);
        let behind = self.see(passed, sampler);
        Seen {
            throughput: first.throughput * behind.throughput,
            is_bent: first.is_bent || behind.is_bent,
            ..behind
        }
    }

    /// Goes on past a surface, to what is behind.
    fn pass(&self, surface: &Surface, glass: &Glass, seen: &mut Seen, sampler: &mut Sampler) {
        let ray = self.go_on(surface, glass, seen, sampler);
        seen.surface = self.trace(&ray);
        if glass.is_thin {
            // Densities of what is aimed at are those from where the straight way began.
            seen.ray.leaves = ray.leaves;
        } else {
            (seen.ray, seen.is_bent) = (ray, true);
        }
    }

    fn go_on(
        &self,
        surface: &Surface,
        glass: &Glass,
        seen: &mut Seen,
        sampler: &mut Sampler,
    ) -> Ray {
        let random = if glass.is_thin {
            0.0
        } else {
            sampler.next_1d()
        };
        let passed = glass.pass(surface, random);
        seen.throughput *= passed.weight;
        if passed.is_through {
            surface.ray_behind(passed.direction)
        } else {
            surface.ray(passed.direction)
        }
    }

    /// What is left of light on the straight way to a place at a distance, or to a triangle there:
    /// thin sheets filter it, and all else hides it.
    pub(super) fn clearness(&self, ray: &Ray, distance_m: f32, target: u32) -> Vec3 {
        if !self.has_thin_glass {
            return if self.is_hidden(ray, distance_m, target) {
                Vec3::ZERO
            } else {
                Vec3::ONE
            };
        }
        let (mut left, mut ray, mut rest_m) = (Vec3::ONE, *ray, distance_m);
        while self.is_hidden(&ray, rest_m, target) {
            let Some(surface) = self.trace(&ray) else {
                return left;
            };
            let Some(glass) = surface.glass else {
                return Vec3::ZERO;
            };
            left *= glass.straight();
            let way_m = surface.position.distance(ray.origin);
            if left == Vec3::ZERO || way_m >= rest_m {
                return left;
            }
            rest_m -= way_m;
            ray = surface.ray_behind(ray.direction);
        }
        left
    }

    /// As [`World::clearness`], to no triangle.
    pub(super) fn clearness_to(&self, ray: &Ray, distance_m: f32) -> Vec3 {
        self.clearness(ray, distance_m, NO_TRIANGLE)
    }
}
