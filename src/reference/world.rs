//! The scene as paths see it: hits turned into surfaces, and the emitters to sample.

use std::ops::Deref;

use glam::Vec3;

use super::bsdf::{Lobe, Scatter, cosine_density, sample_cosine};
use super::emitters::Emitters;
use super::glass::Glass;
use super::sampler::Sampler;
use crate::image::luminance;
use crate::scene::Scene;
use crate::scene::rays::{Hit, Ray};
use crate::scene::surfaces::Surfaces;

/// A scene prepared for path tracing.
pub(super) struct World<'a> {
    surfaces: Surfaces<'a>,
    pub(super) emitters: Emitters,
    /// Some of it lets light pass straight.
    pub(super) has_thin_glass: bool,
}

impl<'a> Deref for World<'a> {
    type Target = Surfaces<'a>;

    fn deref(&self) -> &Surfaces<'a> {
        &self.surfaces
    }
}

/// A point on a surface, seen from somewhere.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    /// World-space position (m).
    pub(super) position: Vec3,
    /// Unit geometric normal on the viewer's side.
    pub(super) geometric_normal: Vec3,
    /// Unit shading normal on the same side as the geometric normal.
    pub(super) normal: Vec3,
    /// Unit direction to the viewer.
    pub(super) wo: Vec3,
    /// Diffuse albedo ρ (zero for a metal).
    pub(super) albedo: Vec3,
    /// The specular lobe, where the material has one.
    pub(super) lobe: Option<Lobe>,
    /// What is clear of it.
    pub(super) glass: Option<Glass>,
    /// Radiance emitted towards the viewer [W/(m² sr)].
    pub(super) emission: Vec3,
    /// Index into the scene's triangles.
    pub(super) triangle: u32,
    /// Index into the scene's materials.
    pub(super) material: u32,
    /// How far off the surface rays start (m).
    offset_m: f32,
}

impl<'a> World<'a> {
    /// Builds what path tracing needs.
    pub(super) fn new(scene: &'a Scene) -> Self {
        let surfaces = Surfaces::new(scene);
        World {
            emitters: Emitters::new(scene, &surfaces.textures),
            has_thin_glass: scene.materials.iter().any(|material| {
                let index = material.transmission.map(|transmission| transmission.index);
                index == Some(1.0)
            }),
            surfaces,
        }
    }

    /// The surface that a ray meets first.
    pub(super) fn trace(&self, ray: &Ray) -> Option<Surface> {
        self.closest(ray)
            .map(|hit| self.surface(hit, -ray.direction))
    }

    /// The surface at a hit, seen along `wo`.
    pub(super) fn surface(&self, hit: Hit, wo: Vec3) -> Surface {
        let material = self.material(hit);
        let place = self.place(hit);
        let is_front = place.front.dot(wo) >= 0.0;
        let geometric_normal = if is_front { place.front } else { -place.front };
        let normal = if place.shading.dot(geometric_normal) >= 0.0 {
            place.shading
        } else {
            -place.shading
        };
        let metalness = material.specular.map_or(0.0, |specular| specular.metalness);
        let lobe = self
            .lobe(material, place.uv)
            .map(|(f0, roughness)| Lobe::new(f0.lerp(place.base, metalness), roughness));
        Surface {
            position: place.position,
            geometric_normal,
            normal,
            wo,
            albedo: place.base * (1.0 - metalness),
            lobe,
            glass: (material.transmission.as_ref())
                .map(|transmission| Glass::new(transmission, is_front)),
            emission: if is_front {
                self.emission(material, &place)
            } else {
                Vec3::ZERO
            },
            triangle: hit.triangle,
            material: self.scene.triangles[hit.triangle as usize].material,
            offset_m: place.offset_m,
        }
    }
}

impl Surface {
    /// A ray that leaves the surface on the viewer's side.
    pub(super) fn ray(&self, direction: Vec3) -> Ray {
        Ray {
            origin: self.origin(),
            direction,
            leaves: self.triangle,
        }
    }

    /// A ray that leaves the surface on the other side.
    pub(super) fn ray_behind(&self, direction: Vec3) -> Ray {
        Ray {
            origin: self.position - self.geometric_normal * self.offset_m,
            direction,
            leaves: self.triangle,
        }
    }

    /// Where rays start (m).
    pub(super) fn origin(&self) -> Vec3 {
        self.position + self.geometric_normal * self.offset_m
    }

    /// Whether light can go to or come from there: above the shading and above the real surface.
    pub(super) fn is_above(&self, direction: Vec3) -> bool {
        self.normal.dot(direction) > 0.0 && self.geometric_normal.dot(direction) > 0.0
    }

    /// f · cos θ [1/sr] of light from `wi`; zero below the surface.
    pub(super) fn reflect(&self, wi: Vec3) -> Vec3 {
        if !self.is_above(wi) {
            return Vec3::ZERO;
        }
        let diffuse = self.albedo * cosine_density(self.normal.dot(wi));
        diffuse
            + self
                .lobe
                .map_or(Vec3::ZERO, |lobe| lobe.evaluate(self.normal, self.wo, wi).0)
    }

    /// Density [1/sr] with which [`Surface::scatter`] draws `wi`.
    pub(super) fn density(&self, wi: Vec3) -> f32 {
        let diffuse = cosine_density(self.normal.dot(wi));
        match self.lobe {
            None => diffuse,
            Some(lobe) => {
                let share = self.specular_share(&lobe);
                diffuse + share * (lobe.evaluate(self.normal, self.wo, wi).1 - diffuse)
            }
        }
    }

    /// Draws a direction from the whole BSDF; `None` where the path ends.
    pub(super) fn scatter(&self, sampler: &mut Sampler) -> Option<Scatter> {
        let choice = sampler.next_1d();
        let point = sampler.next_2d();
        let Some(lobe) = self.lobe else {
            let direction = sample_cosine(self.normal, point);
            let density = cosine_density(self.normal.dot(direction));
            return self.is_above(direction).then_some(Scatter {
                direction,
                weight: self.albedo,
                density,
            });
        };
        let direction = if choice < self.specular_share(&lobe) {
            lobe.sample(self.normal, self.wo, point)?.direction
        } else {
            sample_cosine(self.normal, point)
        };
        let density = self.density(direction);
        let is_useful = self.is_above(direction) && density > 0.0 && density.is_finite();
        is_useful.then(|| Scatter {
            direction,
            weight: self.reflect(direction) / density,
            density,
        })
    }

    /// The share of scattered directions that are drawn from the specular lobe.
    fn specular_share(&self, lobe: &Lobe) -> f32 {
        if self.normal.dot(self.wo) <= 0.0 {
            return 0.0;
        }
        let (diffuse, specular) = (luminance(self.albedo), luminance(lobe.f0).max(0.04));
        (specular / (diffuse + specular)).clamp(0.1, 1.0)
    }
}
