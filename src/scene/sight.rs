//! What a camera sees of a scene, for messages about pictures that show nothing.

use glam::Vec3;

use super::rays::{Accel, Hit, NO_TRIANGLE, Ray, corners, texture_coordinates};
use super::{Light, Scene};

/// Columns and rows of the rays.
const GRID: [u32; 2] = [32, 18];

/// What rays through the middle of a picture's cells meet, as shares of all of them, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sight {
    /// Rays that end on a surface.
    pub surfaces: f32,
    /// Rays that end on the back of one.
    pub backs: f32,
    /// Rays that end on a surface which a light shines on, or which emits.
    pub lit: f32,
}

impl Scene {
    /// What the camera sees, by a few rays through a picture of 16:9.
    pub fn sight(&self) -> Sight {
        let accel = Accel::new(self);
        let [columns, rows] = GRID;
        let mut sight = Sight::default();
        let share = 1.0 / (columns * rows) as f32;
        for index in 0..columns * rows {
            let (x, y) = (
                (index % columns) as f32 + 0.5,
                (index / columns) as f32 + 0.5,
            );
            let ray = Ray {
                origin: self.camera.eye,
                direction: self.camera.ray_direction(x, y, columns, rows),
                leaves: NO_TRIANGLE,
            };
            let Some(hit) = accel.closest(|hit| self.has_surface(hit), &ray) else {
                continue;
            };
            let is_back = self.front(hit).dot(ray.direction) > 0.0;
            sight.surfaces += share;
            sight.backs += if is_back { share } else { 0.0 };
            sight.lit += if self.is_lit_at(&accel, hit, is_back) {
                share
            } else {
                0.0
            };
        }
        sight
    }

    fn front(&self, hit: Hit) -> Vec3 {
        let [a, b, c] = corners(self, &self.triangles[hit.triangle as usize]).map(Vec3::as_dvec3);
        (b - a).cross(c - a).normalize_or_zero().as_vec3()
    }

    /// Whether the mask leaves a surface at a hit.
    pub(super) fn has_surface(&self, hit: Hit) -> bool {
        let triangle = &self.triangles[hit.triangle as usize];
        let Some(mask) = self.materials[triangle.material as usize].mask_texture else {
            return true;
        };
        let [u, v] = texture_coordinates(self, triangle, hit.u, hit.v);
        self.textures[mask as usize].sample(u, v).x >= 0.5
    }

    fn is_lit_at(&self, accel: &Accel, hit: Hit, is_back: bool) -> bool {
        let triangle = &self.triangles[hit.triangle as usize];
        let emits = self.materials[triangle.material as usize].emission != Vec3::ZERO;
        let [a, b, c] = corners(self, triangle);
        let position = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
        let normal = if is_back {
            -self.front(hit)
        } else {
            self.front(hit)
        };
        let shines = |light: &Light| {
            let (direction, distance_m, irradiance) = light.sample(position);
            let ray = Ray {
                origin: position,
                direction,
                leaves: hit.triangle,
            };
            let is_solid = |hit| self.has_surface(hit);
            irradiance != Vec3::ZERO
                && normal.dot(direction) > 0.0
                && !accel.is_occluded(is_solid, &ray, distance_m, hit.triangle)
        };
        (emits && !is_back) || self.lights.iter().any(shines)
    }
}
