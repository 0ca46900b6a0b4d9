//! CPU twin of `screen.upsample`.

use glam::DVec4;

use super::{Judged, Limits, Picture, Seen};

/// The light of a pixel by those texels of a coarse picture that show its own surface. `coarse` has
/// a texel for the middle of each square `scale` pixels wide. `None` where none of the four around
/// the pixel does.
pub fn upsample(
    pixel: [u32; 2],
    seen: &Seen,
    coarse: &Picture<'_, (Seen, DVec4)>,
    (scale, limits): (u32, Limits),
) -> Judged<Option<DVec4>> {
    let place = pixel.map(|at| (f64::from(at) - f64::from(scale / 2)) / f64::from(scale));
    let corner = place.map(f64::floor);
    let (mut sum, mut shown, mut least_margin) = (DVec4::ZERO, 0.0, f64::INFINITY);
    for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let near = |axis: usize, step: i64| 1.0 - (place[axis] - corner[axis] - step as f64).abs();
        let part = near(0, x) * near(1, y);
        let Some((other, light)) = coarse.at(corner[0] as i64 + x, corner[1] as i64 + y) else {
            continue;
        };
        if part <= 0.0 {
            continue;
        }
        let margin = limits.margin(seen, other.position - seen.position, other);
        least_margin = least_margin.min(margin.abs());
        if margin >= 0.0 {
            sum += part * *light;
            shown += part;
        }
    }
    Judged {
        value: (shown >= 1e-3).then(|| sum / shown),
        least_margin,
    }
}
