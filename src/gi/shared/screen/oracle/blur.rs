//! CPU twin of `screen.blur`.

use glam::DVec4;

use super::super::blur::LEAST_RADIUS;
use super::{Judged, Limits, Picture, Seen};

/// Radius (px) of an adaptive blur where the light is the mean of this many directions; `radius`
/// for up to four.
pub fn adaptive_radius(radius: f64, directions: f64) -> f64 {
    (radius * (4.0 / directions).min(1.0)).max(f64::from(LEAST_RADIUS).min(radius))
}

/// Mean of a pixel's row (`axis` 0) or column (1) around it, over pixels on its own surface, by a
/// Gaussian of this radius (px).
pub fn blur(
    pixel: [u32; 2],
    axis: usize,
    radius: f64,
    picture: &Picture<'_, (Seen, DVec4)>,
    limits: Limits,
) -> Judged<DVec4> {
    let [x, y] = pixel.map(i64::from);
    let sigma = 0.5 * (radius + 1.0);
    let (mut sum, mut weight_sum, mut least_margin) = (DVec4::ZERO, 0.0, f64::INFINITY);
    let reach = (radius + 0.5) as i64;
    if let Some((seen, _)) = picture.at(x, y) {
        for i in -reach..=reach {
            let at = if axis == 0 { (x + i, y) } else { (x, y + i) };
            let Some((other, light)) = picture.at(at.0, at.1) else {
                continue;
            };
            let margin = limits.margin(seen, other.position - seen.position, other);
            if i != 0 {
                least_margin = least_margin.min(margin.abs());
            }
            if margin >= 0.0 || i == 0 {
                let weight = (-0.5 * (i * i) as f64 / (sigma * sigma)).exp();
                sum += weight * *light;
                weight_sum += weight;
            }
        }
    }
    Judged {
        value: sum / f64::max(weight_sum, f64::MIN_POSITIVE),
        least_margin,
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{LIMITS, seen};
    use super::*;

    /// By hand: radius 1 has σ 1; the pixel beyond a step does not count.
    #[test]
    fn a_row_by_hand() {
        let pixel = |height, light| Some((seen(height), DVec4::splat(light)));
        let pixels = [pixel(0.0, 1.0), pixel(0.0, 3.0), pixel(1.0, 99.0)];
        let row = Picture {
            size: [3, 1],
            pixels: &pixels,
        };
        let side = (-0.5f64).exp();
        let expected = (3.0 + side) / (1.0 + side);
        let found = blur([1, 0], 0, 1.0, &row, LIMITS).value;
        assert!((found.x - expected).abs() < 1e-12);
        assert_eq!(blur([1, 0], 1, 1.0, &row, LIMITS).value, DVec4::splat(3.0));
        assert_eq!(adaptive_radius(8.0, 3.0), 8.0);
        assert_eq!(adaptive_radius(8.0, 16.0), 2.0);
        assert_eq!(adaptive_radius(8.0, 1e6), 0.5);
    }
}
