//! CPU twins of `screen.variance` and `screen.a_trous`.

use glam::{DVec3, DVec4};

use super::{Judged, Limits, Picture, Seen};

/// Luminance of linear RGB (Rec. 709).
fn luminance(light: DVec4) -> f64 {
    light.truncate().dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// Variance of luminance over the 7×7 pixels around one that are on its surface.
pub fn variance(
    pixel: [u32; 2],
    picture: &Picture<'_, (Seen, DVec4)>,
    limits: Limits,
) -> Judged<f64> {
    let [x, y] = pixel.map(i64::from);
    let (mut sums, mut least_margin) = (DVec3::ZERO, f64::INFINITY);
    if let Some((seen, _)) = picture.at(x, y) {
        for (i, j) in (-3..=3).flat_map(|j| (-3..=3).map(move |i| (i, j))) {
            let Some((other, light)) = picture.at(x + i, y + j) else {
                continue;
            };
            let margin = limits.margin(seen, other.position - seen.position, other);
            if (i, j) != (0, 0) {
                least_margin = least_margin.min(margin.abs());
            }
            if margin >= 0.0 || (i, j) == (0, 0) {
                let l = luminance(*light);
                sums += DVec3::new(l, l * l, 1.0);
            }
        }
    }
    let means = sums / f64::max(sums.z, 1.0);
    Judged {
        value: (means.y - means.x * means.x).max(0.0),
        least_margin,
    }
}

/// One level of the à-trous filter: a pixel's light and its variance. `variances` has those of the
/// picture, row by row, 0 where nothing is.
pub fn a_trous(
    pixel: [u32; 2],
    step: i64,
    (picture, variances): (&Picture<'_, (Seen, DVec4)>, &[f64]),
    (limits, contrast): (Limits, f64),
) -> Judged<(DVec4, f64)> {
    let [x, y] = pixel.map(i64::from);
    let [width, height] = picture.size.map(i64::from);
    let variance_at = |x: i64, y: i64| {
        variances[(y.clamp(0, height - 1) * width + x.clamp(0, width - 1)) as usize]
    };
    let around = (-1..=1).flat_map(|j| (-1..=1).map(move |i| (i, j)));
    let smooth: f64 = around
        .map(|(i, j): (i64, i64)| {
            0.0625 * ((2 - i.abs()) * (2 - j.abs())) as f64 * variance_at(x + i, y + j)
        })
        .sum();
    let deviation = contrast * smooth.sqrt() + 1e-6;
    let spline = |at: i64| [0.375, 0.25, 0.0625][at.unsigned_abs() as usize];
    let (mut sum, mut weights, mut spread, mut least_margin) =
        (DVec4::ZERO, 0.0, 0.0, f64::INFINITY);
    if let Some((seen, own)) = picture.at(x, y) {
        for (i, j) in (-2..=2).flat_map(|j| (-2..=2).map(move |i| (i, j))) {
            let (at_x, at_y) = (x + step * i, y + step * j);
            let Some((other, light)) = picture.at(at_x, at_y) else {
                continue;
            };
            let margin = limits.margin(seen, other.position - seen.position, other);
            if (i, j) != (0, 0) {
                least_margin = least_margin.min(margin.abs());
            }
            if margin >= 0.0 || (i, j) == (0, 0) {
                let apart = (luminance(*light) - luminance(*own)).abs();
                let weight = spline(i) * spline(j) * (-apart / deviation).exp();
                sum += weight * *light;
                weights += weight;
                spread += weight * weight * variance_at(at_x, at_y);
            }
        }
    }
    let weights = f64::max(weights, f64::MIN_POSITIVE);
    Judged {
        value: (sum / weights, spread / (weights * weights)),
        least_margin,
    }
}
