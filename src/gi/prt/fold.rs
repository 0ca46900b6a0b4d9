//! What bands above `order` hold of a sky, folded into those that are kept.
//!
//! Harmonics that are cut off ring: from a court, the sky overhead is brighter or darker by what a
//! step at the horizon leaves out. But where the points of a scene look is known. So the kept bands
//! take L + K H instead of L, H being the bands above, where K is such that points have the least
//! mean square error of the light that the sky brings them, in parts of their own:
//! K = (⟨t tᵀ⟩ + μI)⁻¹ ⟨t hᵀ⟩. t is the transfer of a point by the kept bands, h by those above,
//! both over T_0, and ⟨⟩ the mean over surfaces. In the open h is 0 nearly, and so is K. A light
//! that all these bands together do not hold is not folded: it would ring in them.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::lobes::inverse_of;
use crate::gi::shared::sh::{self, Rotation};
use crate::scene::Sky;

/// Bands in all.
pub(super) const BANDS: usize = 16;

/// μ: keeps K small where points tell little.
const LEAST: f64 = 5e-3;

/// Points that K is learnt from; of more, as many spread evenly.
pub(super) const MOST_LEARNT: usize = 8_192;

/// K, a row for each kept harmonic, from the transfer of points by all bands, each for so much of
/// the surface (m²).
pub(super) fn learn(order: u32, points: &[Vec<f64>], areas: &[f64]) -> Vec<f32> {
    const PART: usize = 256;
    let (kept, all) = ((order * order) as usize, BANDS * BANDS);
    let parts = points.par_chunks(PART).zip(areas.par_chunks(PART));
    let parts = parts.map(|(points, areas)| {
        let mut sums = vec![0.0; kept * all];
        for (point, area) in points.iter().zip(areas).filter(|(point, _)| point[0] > 0.0) {
            let scale = area * point[0].powi(-2);
            for (own, sums) in point.iter().zip(sums.chunks_exact_mut(all)) {
                let factor = scale * own;
                sums.iter_mut()
                    .zip(point)
                    .for_each(|(sum, other)| *sum += factor * other);
            }
        }
        sums
    });
    let parts: Vec<Vec<f64>> = parts.collect();
    let lit = points.iter().zip(areas).filter(|(point, _)| point[0] > 0.0);
    let area: f64 = lit.map(|(_, area)| area).sum();
    let share = if area > 0.0 { 1.0 / area } else { 0.0 };
    let mean = |at: usize| share * parts.iter().map(|part| part[at]).sum::<f64>();
    let means: Vec<f64> = (0..kept * all).map(mean).collect();
    let mut gram = vec![0.0; kept * kept];
    for (own, mean) in gram.chunks_exact_mut(kept).zip(means.chunks_exact(all)) {
        own.copy_from_slice(&mean[..kept]);
    }
    for at in 0..kept {
        gram[at * kept + at] += LEAST;
    }
    let mut folded = vec![0.0f64; kept * (all - kept)];
    let inverse = inverse_of(gram, kept);
    for (row, folded) in inverse
        .chunks_exact(kept)
        .zip(folded.chunks_exact_mut(all - kept))
    {
        for (factor, mean) in row.iter().zip(means.chunks_exact(all)) {
            let pairs = folded.iter_mut().zip(&mean[kept..]);
            pairs.for_each(|(sum, other)| *sum += factor * other);
        }
    }
    folded.into_iter().map(|value| value as f32).collect()
}

/// Adds to the kept harmonics of a sky what those above bring.
pub(super) fn add(kept: &mut [DVec3], above: &[DVec3], folded: &[f32]) {
    for (own, row) in kept.iter_mut().zip(folded.chunks_exact(above.len().max(1))) {
        let more = row.iter().zip(above);
        *own += more.map(|(k, other)| f64::from(*k) * *other).sum::<DVec3>();
    }
}

/// Rows of parts of a sky; there are twice as many columns.
const ROWS: u32 = 128;

/// All bands of a sky before it is scaled and turned, by parts of it: texels of a large map are
/// summed up.
pub(super) fn project(sky: &Sky) -> Vec<DVec3> {
    let plain = sky.with(1.0, 0.0);
    // Samples of a part, along each axis.
    let samples = sky.image().height.div_ceil(ROWS).max(1);
    let rows = ROWS * samples;
    let edge = |y: u32| (PI * f64::from(y) / f64::from(rows)).cos();
    let row = |row: u32| {
        let (mut sums, mut values) = (vec![DVec3::ZERO; BANDS * BANDS], vec![0.0; BANDS * BANDS]);
        for column in 0..2 * ROWS {
            let mut light = DVec3::ZERO;
            for y in row * samples..(row + 1) * samples {
                let solid_angle = (edge(y) - edge(y + 1)) * TAU / f64::from(2 * rows);
                for x in column * samples..(column + 1) * samples {
                    let way = direction_of([x, y], rows).as_vec3();
                    light += solid_angle * plain.radiance(way).as_dvec3();
                }
            }
            sh::evaluate(BANDS, direction_of([column, row], ROWS), &mut values);
            sums.iter_mut()
                .zip(&values)
                .for_each(|(sum, y)| *sum += *y * light);
        }
        sums
    };
    let rows: Vec<Vec<DVec3>> = (0..ROWS).into_par_iter().map(row).collect();
    (0..BANDS * BANDS)
        .map(|at| rows.iter().map(|row| row[at]).sum())
        .collect()
}

/// That of the middle of a cell, of so many rows and twice as many columns.
fn direction_of([x, y]: [u32; 2], rows: u32) -> DVec3 {
    let (sin, cos) = (TAU * (f64::from(x) + 0.5) / f64::from(2 * rows)).sin_cos();
    let from_top = PI * (f64::from(y) + 0.5) / f64::from(rows);
    DVec3::new(from_top.sin() * sin, from_top.cos(), -from_top.sin() * cos)
}

/// Red, green and blue harmonics, turned.
pub(super) fn turned(plain: &[DVec3], turn: DMat3) -> Vec<DVec3> {
    let rotation = Rotation::new(plain.len().isqrt(), turn);
    let [r, g, b] = [0, 1, 2].map(|channel| {
        let own: Vec<f64> = plain.iter().map(|rgb| rgb[channel]).collect();
        rotation.apply(&own)
    });
    (r.iter().zip(&g).zip(&b))
        .map(|((r, g), b)| DVec3::new(*r, *g, *b))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gi::shared::sh::Quadrature;

    /// Transfer of points that see what cones of half angle .6 rad around some directions hold.
    fn points(towards: &[DVec3]) -> Vec<Vec<f64>> {
        let lobe = sh::cone(BANDS, 0.6);
        let point = |direction: &DVec3| sh::rotate_zonal(&lobe, *direction);
        towards.iter().map(point).collect()
    }

    /// A step at the horizon, where all look up: points have the light of the sky, which the kept
    /// bands alone miss.
    #[test]
    fn points_have_the_light_that_they_see() {
        let around = (0..40).map(|at| {
            let (sin, cos) = (f64::from(at) * 2.4).sin_cos();
            let tilt = 0.3 * (f64::from(at) / 40.0).sqrt();
            DVec3::new(tilt.sin() * cos, tilt.cos(), tilt.sin() * sin)
        });
        let points = points(&around.collect::<Vec<_>>());
        let light = sh::project(BANDS, &Quadrature::exact_to(80), |way| {
            if way.y > 0.0 { 1.0 + way.x } else { 0.0 }
        });
        let light: Vec<DVec3> = light.iter().map(|own| DVec3::splat(*own)).collect();
        let (kept, above) = light.split_at(25);
        let mut folded = kept.to_vec();
        let areas = vec![1.0; points.len()];
        add(&mut folded, above, &learn(5, &points, &areas));
        let off = |own: &[DVec3]| {
            let brought = |point: &Vec<f64>, light: &[DVec3]| {
                let pairs = point.iter().zip(light);
                pairs.map(|(t, own)| *t * own.x).sum::<f64>()
            };
            let offs = points
                .iter()
                .map(|point| brought(point, own) / brought(point, &light) - 1.0);
            (offs.map(|off| off * off).sum::<f64>() / points.len() as f64).sqrt()
        };
        let (folded, kept) = (off(&folded), off(kept));
        println!("folded {folded:.5}, cut off {kept:.5}");
        assert!(kept > 0.01 && folded < 0.1 * kept, "{folded} {kept}");
    }

    /// Smooth skies have nothing above; and surfaces in the open take nothing of what is there.
    #[test]
    fn nothing_is_folded_where_nothing_is_missing() {
        let cosine = sh::clamped_cosine(BANDS);
        let point = |direction: DVec3| sh::rotate_zonal(&cosine, direction);
        let open = [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X].map(point);
        let folded = learn(6, &open, &[1.0; 4]);
        let largest = folded.iter().fold(0.0f32, |most, k| k.abs().max(most));
        println!("largest {largest}");
        assert!(largest < 0.05, "{largest}");
        assert!(learn(4, &[], &[]).iter().all(|k| *k == 0.0));
    }

    /// A surface counts by its area, however many points it has.
    #[test]
    fn points_count_by_their_area() {
        let point =
            |direction: DVec3, angle: f64| sh::rotate_zonal(&sh::cone(BANDS, angle), direction);
        let [narrow, wide] = [point(DVec3::Y, 0.3), point(DVec3::X, 1.2)];
        let few = learn(5, &[narrow.clone(), wide.clone()], &[1.0, 3.0]);
        let many = [vec![narrow; 4], vec![wide; 2]].concat();
        let many = learn(5, &many, &[0.25, 0.25, 0.25, 0.25, 1.5, 1.5]);
        let pairs = few.iter().zip(&many);
        let largest = pairs.fold(0.0f32, |most, (a, b)| most.max((a - b).abs()));
        assert!(
            largest < 1e-5 && few.iter().any(|k| k.abs() > 0.1),
            "{largest}"
        );
    }

    /// The parts of a sky have its harmonics, those of the large map and of the small one.
    #[test]
    fn parts_have_the_harmonics_of_the_sky() {
        for height in [64, 128, 300] {
            let image = crate::image::Image::from_fn(2 * height, height, |_| glam::Vec3::ONE);
            let sky = Sky::new(image, 0.0);
            let found = project(&sky.unwrap_or_else(|problem| panic!("{problem}")));
            assert!((found[0].x - (4.0 * PI).sqrt()).abs() < 1e-5);
            let largest = found[1..].iter().map(|rgb| rgb.x.abs()).sum::<f64>();
            assert!(largest < 0.01, "{height}: {largest}");
        }
    }
}
