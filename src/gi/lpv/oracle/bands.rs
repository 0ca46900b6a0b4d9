//! Twins of `lpv.seed_bands`, `lpv.stream` and `lpv.finish_bands`.

use std::f64::consts::PI;

use glam::{DVec3, DVec4, UVec3};

use super::lobes::{Steps, basis, blocking};
use super::sweep::neighbour;
use crate::gi::lpv::CellGrid;
use crate::gi::lpv::bands::streams;
use crate::gi::lpv::lobes::{Occlusion, axis_direction};
use crate::gi::shared::sh;

/// Bands of intensity over h², by the directions that light goes to: rgb, and in alpha that of an
/// environment of radiance 1 (W/(m² sr)).
pub type Bands = Vec<DVec4>;

fn add_lobe(to: &mut Bands, peak: DVec4, direction: DVec3) {
    let cosine = sh::clamped_cosine(to.len().isqrt());
    for (own, lobe) in to.iter_mut().zip(sh::rotate_zonal(&cosine, direction)) {
        *own += lobe * peak;
    }
}

/// What cells send at first in so many bands: of each colour max(0, F·ω)/π, F = Σ Φ n, and what the
/// opaque faces send.
pub fn seed(
    grid: &CellGrid,
    (flux, bands): (&[[DVec3; 3]], usize),
    faces: &[u32],
    side: &dyn Fn(usize, u32) -> DVec4,
) -> Vec<Bands> {
    let peak = 1.0 / (PI * f64::from(grid.cell_size).powi(2));
    let cell = |index: usize| {
        let mut sent = vec![DVec4::ZERO; bands * bands];
        for (vector, colour) in flux[index].iter().zip([DVec4::X, DVec4::Y, DVec4::Z]) {
            if let Some(direction) = vector.try_normalize() {
                add_lobe(&mut sent, peak * vector.length() * colour, direction);
            }
        }
        for face in (0..6).filter(|face| faces[index] >> face & 1 == 1) {
            add_lobe(&mut sent, side(index, face), -axis_direction(face));
        }
        sent
    };
    (0..grid.count() as usize).map(cell).collect()
}

fn step(
    grid: &CellGrid,
    (steps, matrices): (&Steps<'_>, &[Vec<f64>; 6]),
    before: &[Bands],
    number: u32,
) -> Vec<Bands> {
    let count = before[0].len();
    let mut outside = vec![DVec4::ZERO; count];
    if number == 1 {
        outside[0].w = 6.0 * PI * basis(DVec3::X).x;
    }
    let cell = |index: u32| {
        let cell = UVec3::new(
            index % grid.size.x,
            index / grid.size.x % grid.size.y,
            index / (grid.size.x * grid.size.y),
        );
        let word = match steps.occlusion {
            Occlusion::Faces => steps.faces[grid.index(cell)],
            Occlusion::None | Occlusion::Fuzzy => 0,
        };
        let mut arrived = vec![DVec4::ZERO; count];
        for face in (0..6).filter(|face| word >> face & 1 == 0) {
            let next = neighbour(grid, cell, face);
            let sent = next.map_or(&outside, |next| &before[grid.index(next)]);
            let mut passing = f64::from(steps.settings.gain);
            if steps.occlusion == Occlusion::Fuzzy && number > 1 {
                let blocking = blocking(grid, steps.blockers, cell, face);
                passing *= 1.0 - blocking.dot(basis(axis_direction(face))).clamp(0.0, 1.0);
            }
            for (own, row) in arrived
                .iter_mut()
                .zip(matrices[face as usize].chunks_exact(count))
            {
                let passed: DVec4 = row.iter().zip(sent).map(|(m, c)| *m * *c).sum();
                *own += passing * passed;
            }
        }
        arrived
    };
    (0..grid.count()).map(cell).collect()
}

/// The sum of all steps, with what cells sent at first.
pub fn propagate(grid: &CellGrid, steps: &Steps<'_>, first: &[Bands]) -> Vec<Bands> {
    let matrices = streams(first[0].len().isqrt());
    let (mut sum, mut before) = (first.to_vec(), first.to_vec());
    for number in 1..=steps.settings.iterations {
        before = step(grid, (steps, &matrices), &before, number);
        for (sum, own) in sum.iter_mut().flatten().zip(before.iter().flatten()) {
            *sum += *own;
        }
    }
    sum
}

/// As radiance by the directions that light comes from: L = (2/3) I / h², in three bands.
pub fn finish(sum: &[Bands]) -> Vec<[DVec4; 9]> {
    let cell = |bands: &Bands| {
        std::array::from_fn(|i| {
            let factor = if (1..4).contains(&i) { -2.0 } else { 2.0 } / 3.0;
            factor * bands.get(i).copied().unwrap_or_default()
        })
    };
    sum.iter().map(cell).collect()
}
