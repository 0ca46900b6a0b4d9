//! The rays of a point, and the harmonics of where they go.

use std::f32::consts::PI;

use glam::{DMat3, Vec3};

use super::lattice::Point;
use crate::gi::shared::sh;

/// Where a point's rays go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// Cosine-distributed, a spiral that each point turns.
    Cosine,
    /// Over the sphere in strata, the same for all points.
    Sphere,
}

/// Directions with weights: E = Σ w L. Local ones have the normal along z.
pub(super) struct Rays {
    pub(super) directions: Vec<Vec3>,
    /// Y of each, f32: a row a direction.
    pub(super) basis: Vec<f32>,
    pub(super) functions: usize,
    pub(super) sampling: Sampling,
}

impl Rays {
    pub(super) fn new(sampling: Sampling, count: u32, order: u32) -> Self {
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
    pub(super) fn frame_of(&self, number: usize, point: &Point) -> DMat3 {
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
    pub(super) fn weight(&self, direction: Vec3, point: &Point) -> f32 {
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
