//! Discrete directions, by octant.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DQuat, DVec3};

use super::inflow::Inflow;

/// Directions of travel with weights, sorted by octant.
#[derive(Clone, Debug, PartialEq)]
pub struct Directions {
    /// Unit vectors, and weights (sr).
    pub all: Vec<(DVec3, f64)>,
    /// The first direction of each octant, and how many it has. Bits 0, 1 and 2 of an octant say
    /// that x, y and z fall.
    pub octants: [[u32; 2]; 8],
}

/// Moments that the weights are corrected to: Σwω = 0, Σwωω = 4π/3 (and so Σw = 4π), and Σw|ωx| =
/// 2π for each axis, so that a face takes and sends what it should.
const MOMENTS: usize = 12;
/// The first of them that are of half a sphere.
const HALVES: usize = 9;

impl Directions {
    /// `count` directions on a spiral from pole to pole (Fibonacci), turned once so that none
    /// lies along an axis, with weights whose moments up to the second are those of the sphere.
    pub fn spiral(count: u32) -> Self {
        let turn = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::ZYX, 0.37, 0.71, 1.13));
        let step = PI * (1.0 + 5f64.sqrt());
        let ends: Vec<DVec3> = (0..count)
            .map(|k| {
                let z = 1.0 - 2.0 * (f64::from(k) + 0.5) / f64::from(count);
                let (sin, cos) = ((f64::from(k) + 0.5) * step % TAU).sin_cos();
                let across = (1.0 - z * z).max(0.0).sqrt();
                turn * DVec3::new(across * cos, across * sin, z)
            })
            .collect();
        let weights = corrected(&ends);
        let mut all: Vec<(DVec3, f64)> = ends.into_iter().zip(weights).collect();
        all.sort_by_key(|(direction, _)| octant(*direction));
        let mut octants = [[0; 2]; 8];
        for (place, (direction, _)) in (0u32..).zip(&all) {
            let own = &mut octants[octant(*direction)];
            if own[1] == 0 {
                own[0] = place;
            }
            own[1] += 1;
        }
        Directions { all, octants }
    }

    /// Pairs of directions of the octant that has most.
    pub fn most_pairs(&self) -> u32 {
        let counts = self.octants.iter().map(|[_, count]| count.div_ceil(2));
        counts.max().unwrap_or(0)
    }

    /// Pairs of directions of all octants.
    pub fn pair_count(&self) -> u32 {
        self.octants
            .iter()
            .map(|[_, count]| count.div_ceil(2))
            .sum()
    }

    /// As `lpv.sweep` reads them: first pair and number of pairs of each octant, then all pairs.
    /// An odd octant's last direction has a partner without weight.
    pub(super) fn words(&self, inflow: Inflow<'_>) -> Vec<u32> {
        let (mut octants, mut pairs) = (Vec::new(), Vec::new());
        for [first, count] in self.octants {
            octants.extend([pairs.len() as u32 / (2 * ROW), count.div_ceil(2), 0, 0]);
            let own = &self.all[first as usize..][..count as usize];
            let partner = own.last().filter(|_| count % 2 == 1);
            let all = own.iter().copied();
            let all = all.chain(partner.map(|(direction, _)| (*direction, 0.0)));
            pairs.extend(all.flat_map(|direction| row(direction, inflow)));
        }
        octants.append(&mut pairs);
        octants
    }
}

/// Words of a [`row`].
pub(super) const ROW: u32 = 8;

/// A direction as shaders read it (`gi/lpv/directions.glsl`).
pub(super) fn row((travel, weight): (DVec3, f64), inflow: Inflow<'_>) -> [u32; ROW as usize] {
    let sky = inflow.along(travel, weight);
    let [x, y, z, w] = travel.extend(weight).as_vec4().to_array();
    [x, y, z, w, sky.x, sky.y, sky.z, 0.0].map(f32::to_bits)
}

fn octant(direction: DVec3) -> usize {
    usize::from(direction.x < 0.0)
        + 2 * usize::from(direction.y < 0.0)
        + 4 * usize::from(direction.z < 0.0)
}

fn moments(d: DVec3) -> [f64; MOMENTS] {
    [
        d.x,
        d.y,
        d.z,
        d.x * d.x,
        d.y * d.y,
        d.z * d.z,
        d.x * d.y,
        d.y * d.z,
        d.z * d.x,
        d.x.abs(),
        d.y.abs(),
        d.z.abs(),
    ]
}

/// The weights nearest to equal ones that have the sphere's moments: w = w₀ + Mᵀ λ. Few directions
/// may have no positive weights with all of them.
fn corrected(ends: &[DVec3]) -> Vec<f64> {
    let equal = vec![4.0 * PI / ends.len().max(1) as f64; ends.len()];
    let mut tried = [MOMENTS, HALVES]
        .into_iter()
        .filter_map(|count| with_moments(ends, equal.first().copied()?, count));
    tried
        .find(|weights| weights.iter().all(|weight| *weight > 0.0))
        .unwrap_or(equal)
}

/// The same, positive or not, with the first `count` moments.
fn with_moments(ends: &[DVec3], equal: f64, count: usize) -> Option<Vec<f64>> {
    let (third, half) = (4.0 * PI / 3.0, 2.0 * PI);
    let target = [
        0.0, 0.0, 0.0, third, third, third, 0.0, 0.0, 0.0, half, half, half,
    ];
    let rows: Vec<[f64; MOMENTS]> = ends.iter().map(|end| moments(*end)).collect();
    let (mut matrix, mut missing) = ([[0.0; MOMENTS]; MOMENTS], [0.0; MOMENTS]);
    for i in 0..MOMENTS {
        if i < count {
            missing[i] = target[i] - equal * rows.iter().map(|row| row[i]).sum::<f64>();
            for j in 0..count {
                matrix[i][j] = rows.iter().map(|row| row[i] * row[j]).sum();
            }
        } else {
            matrix[i][i] = 1.0;
        }
    }
    let lambda = solved(matrix, missing)?;
    let more = |row: &[f64; MOMENTS]| lambda.iter().zip(row).map(|(l, m)| l * m).sum::<f64>();
    Some(rows.iter().map(|row| equal + more(row)).collect())
}

/// Gaussian elimination with pivots; `None` where the rows depend on each other.
fn solved(mut m: [[f64; MOMENTS]; MOMENTS], mut b: [f64; MOMENTS]) -> Option<[f64; MOMENTS]> {
    for column in 0..MOMENTS {
        let pivot =
            (column..MOMENTS).max_by(|a, b| m[*a][column].abs().total_cmp(&m[*b][column].abs()))?;
        if m[pivot][column].abs() < 1e-9 {
            return None;
        }
        m.swap(column, pivot);
        b.swap(column, pivot);
        for row in column + 1..MOMENTS {
            let factor = m[row][column] / m[column][column];
            let upper = m[column];
            for (own, above) in m[row].iter_mut().zip(upper).skip(column) {
                *own -= factor * above;
            }
            b[row] -= factor * b[column];
        }
    }
    for column in (0..MOMENTS).rev() {
        let known: f64 = (column + 1..MOMENTS).map(|at| m[column][at] * b[at]).sum();
        b[column] = (b[column] - known) / m[column][column];
    }
    Some(b)
}
