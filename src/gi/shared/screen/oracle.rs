//! CPU twins of `screen.history` and `screen.blur`, in f64, pixel by pixel.

use glam::{DVec2, DVec3, DVec4};

use super::blur::LEAST_RADIUS;

/// A surface that a pixel sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Where it is (m).
    pub position: DVec3,
    /// Unit vectors on the viewer's side.
    pub geometric_normal: DVec3,
    /// The same, for shading.
    pub shading_normal: DVec3,
    /// Height of a pixel there (m).
    pub footprint: f64,
}

/// Where a surface was in the frame before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    /// In the picture (px).
    pub place: DVec2,
    /// In space (m).
    pub position: DVec3,
}

/// What the frame before kept of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeptPixel {
    /// The surface.
    pub seen: Seen,
    /// Its light.
    pub light: DVec4,
    /// What that weighs (frames).
    pub weight: f64,
}

/// A picture of what may be there or not, row by row.
pub struct Picture<'p, T> {
    /// Width and height (px).
    pub size: [u32; 2],
    /// The pixels.
    pub pixels: &'p [Option<T>],
}

impl<T> Picture<'_, T> {
    fn at(&self, x: i64, y: i64) -> Option<&T> {
        let is_inside = |at: i64, size: u32| (0..i64::from(size)).contains(&at);
        (is_inside(x, self.size[0]) && is_inside(y, self.size[1]))
            .then(|| self.pixels[(y * i64::from(self.size[0]) + x) as usize].as_ref())
            .flatten()
    }
}

/// How near two surfaces have to be to be one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Off the plane (footprints).
    pub plane_tolerance: f64,
    /// Least cosine of two shading normals.
    pub normal_cosine: f64,
}

impl Limits {
    /// How far inside the limits (positive) or outside another surface is: the smaller of
    /// footprints and cosine left. `from_here` leads to it from where `seen` is or was (m).
    pub fn margin(&self, seen: &Seen, from_here: DVec3, other: &Seen) -> f64 {
        let off_plane = from_here.dot(seen.geometric_normal).abs() / seen.footprint;
        let cosine = seen.shading_normal.dot(other.shading_normal);
        (self.plane_tolerance - off_plane).min(cosine - self.normal_cosine)
    }
}

/// A result, and how near it came to another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged<T> {
    /// The result.
    pub value: T,
    /// The smallest |margin| of all decisions.
    pub least_margin: f64,
}

/// The light of a pixel and its weight (frames): `light` of this frame, and of the frame before
/// what a bilinear sample finds on the same surface, which together weigh `longest` at most.
pub fn history(
    seen: &Seen,
    light: DVec4,
    moved: Option<&Moved>,
    before: &Picture<'_, KeptPixel>,
    (limits, longest): (Limits, f64),
) -> Judged<(DVec4, f64)> {
    let (mut found, mut weight, mut kept, mut least_margin) =
        (DVec4::ZERO, 0.0, 0.0, f64::INFINITY);
    if let Some(moved) = moved {
        let corner = (moved.place - 0.5).floor();
        let share = moved.place - 0.5 - corner;
        for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let near = |step: i64, share: f64| if step == 1 { share } else { 1.0 - share };
            let part = near(x, share.x) * near(y, share.y);
            let Some(tap) = before.at(corner.x as i64 + x, corner.y as i64 + y) else {
                continue;
            };
            let margin = limits.margin(seen, tap.seen.position - moved.position, &tap.seen);
            least_margin = least_margin.min(margin.abs());
            if margin >= 0.0 {
                found += part * tap.light;
                weight += part * tap.weight;
                kept += part;
            }
        }
        if kept > 0.0 {
            least_margin = least_margin.min((kept - 1e-3).abs());
        }
    }
    let is_kept = kept >= 1e-3;
    let (found, weight) = match is_kept {
        true => (found / kept, weight / kept * (kept / 0.05).min(1.0)),
        false => (DVec4::ZERO, 0.0),
    };
    let weight = weight.min(longest - 1.0);
    let value = if light.is_finite() {
        let mean = light + (found - light) * (weight / (weight + 1.0));
        (mean, weight + 1.0)
    } else {
        (found, weight)
    };
    Judged {
        value,
        least_margin,
    }
}

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

/// Radius (px) of an adaptive blur where the light is the mean of this many directions; `radius`
/// for one.
pub fn adaptive_radius(radius: f64, directions: f64) -> f64 {
    (radius / directions.sqrt()).max(f64::from(LEAST_RADIUS).min(radius))
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
    use super::*;

    const LIMITS: Limits = Limits {
        plane_tolerance: 1.0,
        normal_cosine: 0.9,
    };

    fn seen(height: f64) -> Seen {
        Seen {
            position: DVec3::new(0.0, 0.0, height),
            geometric_normal: DVec3::Z,
            shading_normal: DVec3::Z,
            footprint: 0.1,
        }
    }

    /// By hand: a place a quarter of the way from one pixel to the next; half a footprint off the
    /// plane is on it, two are not, and what stays of the sample weighs as all of it.
    #[test]
    fn a_sample_by_hand() {
        let kept = |height: f64, light: f64, weight: f64| {
            Some(KeptPixel {
                seen: seen(height),
                light: DVec4::splat(light),
                weight,
            })
        };
        let moved = Moved {
            place: DVec2::new(0.75, 0.5),
            position: DVec3::ZERO,
        };
        let of = |second: f64| {
            let pixels = [kept(0.05, 4.0, 3.0), kept(second, 8.0, 7.0)];
            let before = Picture {
                size: [2, 1],
                pixels: &pixels,
            };
            history(&seen(0.0), DVec4::ONE, Some(&moved), &before, (LIMITS, 6.0)).value
        };
        // ¾ · 4 + ¼ · 8 = 5, with weight 4: (1 + 4 · 5) / 5.
        assert_eq!(of(0.0), (DVec4::splat(4.2), 5.0));
        // The first alone: (1 + 3 · 4) / 4.
        assert_eq!(of(0.2), (DVec4::splat(3.25), 4.0));
    }

    /// After n frames of what stands still: their mean, with the weight n.
    #[test]
    fn still_frames_come_to_their_mean() {
        let moved = Moved {
            place: DVec2::splat(0.5),
            position: DVec3::ZERO,
        };
        let mut pixels = [None];
        for frame in 1..=9 {
            let before = Picture {
                size: [1, 1],
                pixels: &pixels,
            };
            let light = DVec4::splat(f64::from(frame));
            let limits = (LIMITS, 32.0);
            let (light, weight) = history(&seen(0.0), light, Some(&moved), &before, limits).value;
            assert!((light.x - 0.5 * f64::from(frame + 1)).abs() < 1e-12);
            assert_eq!(weight, f64::from(frame));
            pixels = [Some(KeptPixel {
                seen: seen(0.0),
                light,
                weight,
            })];
        }
    }

    /// What is no number is gone in the next frame.
    #[test]
    fn no_number_is_kept() {
        let before = Picture {
            size: [1, 1],
            pixels: &[None],
        };
        let light = DVec4::new(1.0, f64::NAN, 0.0, 0.0);
        let (light, weight) = history(&seen(0.0), light, None, &before, (LIMITS, 9.0)).value;
        assert_eq!((light, weight), (DVec4::ZERO, 0.0));
    }

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
        assert_eq!(adaptive_radius(8.0, 16.0), 2.0);
        assert_eq!(adaptive_radius(8.0, 1e6), 0.5);
    }
}
