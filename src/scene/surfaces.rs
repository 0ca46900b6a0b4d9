//! The surfaces of a scene as rays on the host meet them.

use glam::{Vec2, Vec3, Vec4};

use super::rays::{Accel, Hit, NO_TRIANGLE, Ray, corners, texture_coordinates};
use super::texture_sampler::TextureSampler;
use super::{Material, Scene, Triangle};

/// Rays start this far from a surface, in units of the largest coordinate of its triangle: 16 units
/// in the last place of a 32-bit float. A position interpolated in single precision is off by about
/// 4 of them, so that no start lies behind the surface, whatever the scene's scale.
const OFFSET_RELATIVE: f32 = 16.0 * f32::EPSILON;

/// A scene prepared for rays.
pub(crate) struct Surfaces<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) textures: TextureSampler,
    accel: Accel,
}

/// A place on a triangle.
pub(crate) struct Place {
    /// World-space position (m).
    pub(crate) position: Vec3,
    /// Unit normal of the triangle's front.
    pub(crate) front: Vec3,
    /// Unit shading normal on the front side.
    pub(crate) shading: Vec3,
    /// The colour of the material: of what is no metal, its diffuse albedo.
    pub(crate) base: Vec3,
    /// Texture coordinates.
    pub(crate) uv: [f32; 2],
    /// How far off the surface rays start (m).
    pub(crate) offset_m: f32,
}

/// How far off a triangle with these corners rays start (m).
pub(crate) fn offset_m([a, b, c]: [Vec3; 3]) -> f32 {
    let scale_m = a.abs().max(b.abs()).max(c.abs()).max_element();
    (OFFSET_RELATIVE * scale_m).max(f32::MIN_POSITIVE)
}

impl<'a> Surfaces<'a> {
    /// Builds what rays need.
    pub(crate) fn new(scene: &'a Scene) -> Self {
        Surfaces {
            scene,
            textures: TextureSampler::new(),
            accel: Accel::new(scene),
        }
    }

    /// What a ray meets first.
    pub(crate) fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.accel.closest(|hit| self.is_solid(hit), ray)
    }

    /// Whether something is in the way before `distance_m`.
    pub(crate) fn is_occluded(&self, ray: &Ray, distance_m: f32) -> bool {
        self.is_hidden(ray, distance_m, NO_TRIANGLE)
    }

    /// Whether something is between the start of a ray and the triangle that it aims at.
    pub(crate) fn is_hidden(&self, ray: &Ray, distance_m: f32, target: u32) -> bool {
        self.accel
            .is_occluded(|hit| self.is_solid(hit), ray, distance_m, target)
    }

    /// Whether the alpha mask leaves a surface at a hit.
    pub(crate) fn is_solid(&self, hit: Hit) -> bool {
        let triangle = &self.scene.triangles[hit.triangle as usize];
        let Some(mask) = self.material(hit).mask_texture else {
            return true;
        };
        let texcoord = texture_coordinates(self.scene, triangle, hit.u, hit.v);
        let mask = &self.scene.textures[mask as usize];
        self.textures.sample(mask, texcoord).x >= 0.5
    }

    /// The material at a hit.
    pub(crate) fn material(&self, hit: Hit) -> &'a Material {
        let triangle = &self.scene.triangles[hit.triangle as usize];
        &self.scene.materials[triangle.material as usize]
    }

    /// The place of a hit.
    pub(crate) fn place(&self, hit: Hit) -> Place {
        let triangle = &self.scene.triangles[hit.triangle as usize];
        let material = self.material(hit);
        let [p0, p1, p2] = corners(self.scene, triangle);
        let position = p0 * (1.0 - hit.u - hit.v) + p1 * hit.u + p2 * hit.v;
        let front = (p1 - p0).cross(p2 - p0).normalize();
        let uv = texture_coordinates(self.scene, triangle, hit.u, hit.v);
        Place {
            position,
            front,
            shading: self.shading_normal(triangle, material, hit, uv, front),
            base: self.color(material.albedo, material.albedo_texture, uv),
            uv,
            offset_m: offset_m([p0, p1, p2]),
        }
    }

    /// F0 of what is no metal, and roughness; `None` where the material has no lobe.
    pub(crate) fn lobe(&self, material: &Material, uv: [f32; 2]) -> Option<(Vec3, f32)> {
        let lobe = material.specular?;
        let texel = lobe.texture.map_or(Vec4::ONE, |texture| {
            self.textures
                .sample(&self.scene.textures[texture as usize], uv)
        });
        Some((lobe.f0 * texel.truncate(), lobe.roughness * texel.w))
    }

    /// Radiance that the front of a place emits (W/(m² sr)).
    pub(crate) fn emission(&self, material: &Material, place: &Place) -> Vec3 {
        if material.emission == Vec3::ZERO {
            return Vec3::ZERO;
        }
        self.color(material.emission, material.emission_texture, place.uv)
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
