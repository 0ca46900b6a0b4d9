//! The reference's rays, for tests of those on the device.

use glam::Vec3;

use crate::scene::Scene;
use crate::scene::rays::{Accel, Hit, NO_TRIANGLE, Ray, corners, texture_coordinates};

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleHit {
    /// Index into the scene's triangles.
    pub triangle: u32,
    /// In lengths of the direction.
    pub distance: f32,
    /// Barycentric coordinates of the second and third vertex.
    pub at: [f32; 2],
}

/// A scene as the reference traces it.
pub struct RayOracle<'s> {
    scene: &'s Scene,
    accel: Accel,
}

/// The start of a ray, its unit direction, and the triangle that it leaves.
pub type OracleRay = (Vec3, Vec3, Option<u32>);

impl<'s> RayOracle<'s> {
    /// Of a scene as it is.
    pub fn new(scene: &'s Scene) -> Self {
        let accel = Accel::new(scene);
        RayOracle { scene, accel }
    }

    /// The nearest hit by the reference's hierarchy.
    pub fn closest(&self, (origin, direction, leaves): OracleRay) -> Option<OracleHit> {
        let leaves = leaves.unwrap_or(NO_TRIANGLE);
        let ray = Ray {
            origin,
            direction,
            leaves,
        };
        let hit = self.accel.closest(|hit| self.is_solid(hit), &ray)?;
        self.meets(hit.triangle, (origin, direction, None))
    }

    /// The nearest hit by a look at every triangle.
    pub fn closest_of_all(&self, ray: OracleRay) -> Option<OracleHit> {
        let all = 0..self.scene.triangles.len() as u32;
        all.filter_map(|triangle| self.meets(triangle, ray))
            .min_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    /// Where a ray meets a triangle, whatever else is in the way (T. Möller and B. Trumbore, 1997),
    /// each operation as the reference has it.
    pub fn meets(
        &self,
        triangle: u32,
        (origin, direction, leaves): OracleRay,
    ) -> Option<OracleHit> {
        let dot = |a: Vec3, b: Vec3| a.x * b.x + a.y * b.y + a.z * b.z;
        let [a, b, c] = corners(self.scene, &self.scene.triangles[triangle as usize]);
        let (edge_1, edge_2, s) = (b - a, c - a, origin - a);
        let p = direction.cross(edge_2);
        let determinant = dot(edge_1, p);
        if determinant == 0.0 || leaves == Some(triangle) {
            return None;
        }
        let (inverse, q) = (1.0 / determinant, s.cross(edge_1));
        let [u, v, distance] =
            [dot(s, p), dot(direction, q), dot(edge_2, q)].map(|value| value * inverse);
        let hit = Hit { triangle, u, v };
        let is_met = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0;
        (is_met && self.is_solid(hit)).then_some(OracleHit {
            triangle,
            distance,
            at: [u, v],
        })
    }

    /// Whether the alpha mask leaves a surface at a hit.
    fn is_solid(&self, hit: Hit) -> bool {
        let triangle = &self.scene.triangles[hit.triangle as usize];
        let material = &self.scene.materials[triangle.material as usize];
        material.mask_texture.is_none_or(|mask| {
            let [u, v] = texture_coordinates(self.scene, triangle, hit.u, hit.v);
            self.scene.textures[mask as usize].sample(u, v).x >= 0.5
        })
    }
}
