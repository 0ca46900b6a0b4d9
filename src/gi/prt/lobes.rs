//! Transfer as a matrix: which light comes to a point from where (Sloan, Kautz & Snyder 2002,
//! section 5), and what glossy lobes and bumped normals make of it.
//!
//! Radiance above a point is kept as harmonics c in the frame of its normal: L(w) ≈ Σ_j c_j Y_j(w),
//! for w above the surface alone. Of all c those are taken that leave the least
//! ∫ ⟨n·w⟩ (L − Σ c Y)² dw, because light is reflected by its cosine:
//! c = (A + λI)⁻¹ ∫ ⟨n·w⟩ L Y dw, A_jk = ∫ ⟨n·w⟩ Y_j Y_k. `plain` keeps c = ∫ L Y dw as if nothing
//! came from below.

use std::f64::consts::FRAC_PI_2;

use glam::{DMat3, Vec3};

use super::lattice::Point;
use super::rays::{Rays, Sampling};
use crate::gi::shared::sh::{self, Quadrature, Rotation};
use crate::gi::shared::split_sum::lobe_directions;

/// How radiance above points is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LobeSettings {
    /// Its bands, 3 to 6.
    pub order: u32,
    /// Which coefficients.
    pub projection: Projection,
}

/// What a function on half a sphere has for coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Projection {
    /// Least squares on that half, by the cosine.
    Hemisphere,
    /// Those of the whole sphere, dark below.
    Plain,
}

/// λ: what keeps coefficients small that say little above the surface.
const LAMBDA: f64 = 3e-4;
/// Below this cosine a ray of `plain` has no more weight.
const LEAST_COSINE: f32 = 0.02;

/// Sums over rays to coefficients.
pub(super) struct Projector {
    settings: LobeSettings,
    sampling: Sampling,
    /// Y of each direction of the set, a row a direction.
    basis: Vec<f32>,
    /// (A + λI)⁻¹ around +z, symmetric.
    inverse: Vec<f64>,
}

impl Projector {
    pub(super) fn new(settings: LobeSettings, rays: &Rays) -> Self {
        let order = settings.order as usize;
        let count = order * order;
        let mut values = vec![0.0; count];
        let mut basis = Vec::with_capacity(count * rays.directions.len());
        for direction in &rays.directions {
            sh::evaluate(order, direction.as_dvec3(), &mut values);
            basis.extend(values.iter().map(|value| *value as f32));
        }
        let mut gram = vec![0.0; count * count];
        for (direction, weight) in Quadrature::half(2 * order).nodes {
            sh::evaluate(order, direction, &mut values);
            for j in 0..count {
                for k in 0..count {
                    gram[j * count + k] += weight * direction.z * values[j] * values[k];
                }
            }
        }
        for j in 0..count {
            gram[j * count + j] += LAMBDA;
        }
        Projector {
            settings,
            sampling: rays.sampling,
            basis,
            inverse: match settings.projection {
                Projection::Hemisphere => inverse_of(gram, count),
                Projection::Plain => (0..count * count)
                    .map(|at| f64::from(u8::from(at % (count + 1) == 0)))
                    .collect(),
            },
        }
    }

    /// Coefficients.
    pub(super) fn count(&self) -> usize {
        (self.settings.order * self.settings.order) as usize
    }

    /// Y of a ray, each times its weight beside the one by which irradiance is a sum.
    pub(super) fn weights(&self, ray: usize, cosine: f32) -> impl Iterator<Item = f32> {
        let factor = match self.settings.projection {
            Projection::Hemisphere => 1.0,
            Projection::Plain => 1.0 / cosine.max(LEAST_COSINE),
        };
        let count = self.count();
        let basis = &self.basis[ray * count..][..count];
        basis.iter().map(move |value| factor * value)
    }

    /// Sums of light over the rays of a point, a row of `columns` numbers for each Y, to rows of
    /// coefficients in the frame of its normal. `frame`: that of the rays.
    pub(super) fn solve(
        &self,
        sums: &[f32],
        columns: usize,
        (point, frame): (&Point, DMat3),
    ) -> Vec<f32> {
        let (order, count) = (self.settings.order as usize, self.count());
        let own = frame_of(point.normal);
        // The inverse is symmetric, and alike for all turns about the normal.
        let turn = match self.sampling {
            Sampling::Cosine => frame.transpose() * own,
            Sampling::Sphere => own,
        };
        let rotation = Rotation::new(order, turn);
        let mut solved = vec![0.0f32; count * columns];
        let rows = self.inverse.chunks_exact(count);
        for (row, solved) in rows.zip(solved.chunks_exact_mut(columns)) {
            let row = rotation.apply(row);
            for (factor, sums) in row.iter().zip(sums.chunks_exact(columns)) {
                let factor = *factor as f32;
                let pairs = solved.iter_mut().zip(sums);
                pairs.for_each(|(own, sum)| *own += factor * sum);
            }
        }
        solved
    }
}

/// The frame of a normal that radiance above it is kept in; z is the normal.
pub fn frame_of(normal: Vec3) -> DMat3 {
    let normal = normal.as_dvec3();
    let (x, y) = normal.any_orthonormal_pair();
    DMat3::from_cols(x, y, normal)
}

/// Gauss and Jordan; the matrix is symmetric and positive definite, so no pivots are looked for.
pub(super) fn inverse_of(mut matrix: Vec<f64>, count: usize) -> Vec<f64> {
    for at in 0..count {
        let pivot = matrix[at * count + at];
        matrix[at * count + at] = 1.0;
        matrix[at * count..][..count]
            .iter_mut()
            .for_each(|value| *value /= pivot);
        let own = matrix[at * count..][..count].to_vec();
        for row in (0..count).filter(|row| *row != at) {
            let row = &mut matrix[row * count..][..count];
            let factor = std::mem::take(&mut row[at]);
            row.iter_mut()
                .zip(&own)
                .for_each(|(value, own)| *value -= factor * own);
        }
    }
    matrix
}

/// Entries of a table along each axis (`gi/prt/lobes.glsl`).
const TABLE_EDGE: u32 = 32;

/// The angles of the table, from 0 to a right one.
fn angle(index: u32) -> f64 {
    FRAC_PI_2 * f64::from(index) / f64::from(TABLE_EDGE - 1)
}

/// Harmonics with m ≥ 0, those of functions that are symmetric about the xz plane: m by m.
fn even_harmonics(order: usize) -> impl Iterator<Item = usize> {
    (0..order).flat_map(move |m| (m..order).map(move |l| l * l + l + m))
}

/// What lobes around +z make of each harmonic with m ≥ 0, for an eye above the x axis: a factor of
/// F₀, and besides. Rows of a roughness, from 0 to 1; in them, rows of the angle of the eye.
pub fn lobe_table(order: u32) -> Vec<[f32; 2]> {
    /// Of an eye that is as good as in the plane of the surface.
    const LEAST: f64 = 1e-4;
    let order = order as usize;
    let mut values = vec![0.0; order * order];
    let mut table = Vec::new();
    for index in 0..TABLE_EDGE * TABLE_EDGE {
        let mut sums = vec![[0.0f64; 2]; order * order];
        let cosine = angle(index % TABLE_EDGE).cos().max(LEAST);
        let roughness = f64::from(index / TABLE_EDGE) / f64::from(TABLE_EDGE - 1);
        for (direction, shares) in lobe_directions(cosine, roughness) {
            sh::evaluate(order, direction, &mut values);
            for (sum, value) in sums.iter_mut().zip(&values) {
                sum[0] += shares[0] * value;
                sum[1] += shares[1] * value;
            }
        }
        table.extend(even_harmonics(order).map(|at| sums[at].map(|sum| sum as f32)));
    }
    table
}

/// Bands that the integrals of the table of bumps are exact to, were there no edge in them.
const BUMP_DEGREE: usize = 150;

/// What irradiance each harmonic with m ≥ 0, above a surface with normal +z, brings a normal in the
/// xz plane; as a table of lobes that have nothing but what is besides F₀. A row for each angle of
/// the two, from 0 to a right one.
pub fn bump_table(order: u32) -> Vec<[f32; 2]> {
    let order = order as usize;
    let mut values = vec![0.0; order * order];
    let nodes = Quadrature::half(BUMP_DEGREE).nodes;
    let mut table = Vec::new();
    for index in 0..TABLE_EDGE {
        let (sine, cosine) = angle(index).sin_cos();
        let mut sums = vec![0.0f64; order * order];
        for (direction, weight) in &nodes {
            let share = weight * (sine * direction.x + cosine * direction.z).max(0.0);
            if share > 0.0 {
                sh::evaluate(order, *direction, &mut values);
                let pairs = sums.iter_mut().zip(&values);
                pairs.for_each(|(sum, value)| *sum += share * value);
            }
        }
        table.extend(even_harmonics(order).map(|at| [0.0, sums[at] as f32]));
    }
    table
}
