//! The scene as paths see it: hits turned into surfaces, and the emitters to sample.

use glam::{Vec2, Vec3};

use super::bsdf::{Lobe, Scatter, cosine_density, sample_cosine};
use super::emitters::Emitters;
use super::sampler::Sampler;
use super::texture::TextureSampler;
use crate::image::luminance;
use crate::scene::rays::{Accel, Hit, NO_TRIANGLE, Ray, corners, texture_coordinates};
use crate::scene::{Material, Scene, Triangle};

/// Rays start this far from a surface, in units of the largest coordinate of its triangle: 16 units
/// in the last place of a 32-bit float. A position interpolated in single precision is off by about
/// 4 of them, so that no start lies behind the surface, whatever the scene's scale.
const OFFSET_RELATIVE: f32 = 16.0 * f32::EPSILON;

/// A scene prepared for path tracing.
pub(super) struct World<'a> {
    pub(super) scene: &'a Scene,
    pub(super) emitters: Emitters,
    accel: Accel,
    textures: TextureSampler,
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
        let textures = TextureSampler::new();
        World {
            scene,
            emitters: Emitters::new(scene, &textures),
            accel: Accel::new(scene),
            textures,
        }
    }

    /// The surface that a ray meets first.
    pub(super) fn trace(&self, ray: &Ray) -> Option<Surface> {
        self.accel
            .closest(|hit| self.is_solid(hit), ray)
            .map(|hit| self.surface(hit, -ray.direction))
    }

    /// Whether something is in the way before `distance_m`.
    pub(super) fn is_occluded(&self, ray: &Ray, distance_m: f32) -> bool {
        self.accel
            .is_occluded(|hit| self.is_solid(hit), ray, distance_m, NO_TRIANGLE)
    }

    /// Whether something is between the start of a ray and the triangle that it aims at.
    pub(super) fn is_hidden(&self, ray: &Ray, distance_m: f32, target: u32) -> bool {
        self.accel
            .is_occluded(|hit| self.is_solid(hit), ray, distance_m, target)
    }

    /// Whether the alpha mask leaves a surface at a hit.
    pub(super) fn is_solid(&self, hit: Hit) -> bool {
        let triangle = &self.scene.triangles[hit.triangle as usize];
        let Some(mask) = self.scene.materials[triangle.material as usize].mask_texture else {
            return true;
        };
        let texcoord = texture_coordinates(self.scene, triangle, hit.u, hit.v);
        let mask = &self.scene.textures[mask as usize];
        self.textures.sample(mask, texcoord).x >= 0.5
    }

    /// The surface at a hit, seen along `wo`.
    pub(super) fn surface(&self, hit: Hit, wo: Vec3) -> Surface {
        let triangle = &self.scene.triangles[hit.triangle as usize];
        let material = &self.scene.materials[triangle.material as usize];
        let [p0, p1, p2] = corners(self.scene, triangle);
        let position = p0 * (1.0 - hit.u - hit.v) + p1 * hit.u + p2 * hit.v;
        let front = (p1 - p0).cross(p2 - p0).normalize();
        let is_front = front.dot(wo) >= 0.0;
        let geometric_normal = if is_front { front } else { -front };
        let uv = texture_coordinates(self.scene, triangle, hit.u, hit.v);
        let shading = self.shading_normal(triangle, material, hit, uv, front);
        let normal = if shading.dot(geometric_normal) >= 0.0 {
            shading
        } else {
            -shading
        };
        let base = self.color(material.albedo, material.albedo_texture, uv);
        let (albedo, lobe) = match material.specular {
            None => (base, None),
            Some(specular) => {
                let f0 = specular.f0.lerp(base, specular.metalness);
                (
                    base * (1.0 - specular.metalness),
                    Some(Lobe::new(f0, specular.roughness)),
                )
            }
        };
        let is_emitter = is_front && material.emission != Vec3::ZERO;
        let emission = if is_emitter {
            self.color(material.emission, material.emission_texture, uv)
        } else {
            Vec3::ZERO
        };
        let scale_m = p0.abs().max(p1.abs()).max(p2.abs()).max_element();
        let offset_m = (OFFSET_RELATIVE * scale_m).max(f32::MIN_POSITIVE);
        let (triangle, material) = (hit.triangle, triangle.material);
        Surface {
            position,
            geometric_normal,
            normal,
            wo,
            albedo,
            lobe,
            emission,
            triangle,
            material,
            offset_m,
        }
    }

    /// The interpolated normal, bent by the normal map where there is one; on the triangle's own
    /// side.
    fn shading_normal(
        &self,
        triangle: &Triangle,
        material: &Material,
        hit: Hit,
        uv: [f32; 2],
        front: Vec3,
    ) -> Vec3 {
        let [a, b, c] = triangle
            .vertices
            .map(|index| Vec3::from(self.scene.vertices[index as usize].normal));
        let normal = (a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v)
            .try_normalize()
            .unwrap_or(front);
        let normal = if normal.dot(front) >= 0.0 {
            normal
        } else {
            -normal
        };
        let Some(texture) = material.normal_texture else {
            return normal;
        };
        let Some([tangent, bitangent]) = tangents(self.scene, triangle, normal) else {
            return normal;
        };
        let encoded = self
            .textures
            .sample(&self.scene.textures[texture as usize], uv)
            .truncate();
        let local = encoded * 2.0 - 1.0;
        (tangent * local.x + bitangent * local.y + normal * local.z)
            .try_normalize()
            .unwrap_or(normal)
    }

    fn color(&self, factor: Vec3, texture: Option<u32>, uv: [f32; 2]) -> Vec3 {
        match texture {
            Some(index) => {
                factor
                    * self
                        .textures
                        .sample(&self.scene.textures[index as usize], uv)
                        .truncate()
            }
            None => factor,
        }
    }
}

/// Unit directions of growing u and v, perpendicular to `normal`; `None` where the texture
/// coordinates are degenerate.
fn tangents(scene: &Scene, triangle: &Triangle, normal: Vec3) -> Option<[Vec3; 2]> {
    let [p0, p1, p2] = corners(scene, triangle);
    let [t0, t1, t2] = triangle.vertices.map(|index| {
        Vec2::new(
            scene.vertices[index as usize].u,
            scene.vertices[index as usize].v,
        )
    });
    let (e1, e2, d1, d2) = (p1 - p0, p2 - p0, t1 - t0, t2 - t0);
    let determinant = d1.perp_dot(d2);
    let along_u = (e1 * d2.y - e2 * d1.y) * determinant.signum();
    let tangent = along_u.reject_from_normalized(normal).try_normalize()?;
    let handedness = if determinant == 0.0 {
        return None;
    } else {
        determinant.signum() * (e1.cross(e2).dot(normal)).signum()
    };
    Some([tangent, normal.cross(tangent) * handedness])
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
