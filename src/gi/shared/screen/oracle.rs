//! CPU twins of `screen.upsample`, `screen.relight`, `screen.history`, `screen.blur` and
//! `screen.a_trous`, in f64, pixel by pixel.

use glam::{DQuat, DVec2, DVec3, DVec4, Vec2Swizzles as _};

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
    /// Of what has moved, the shading normal there.
    pub turned: Option<DVec3>,
}

/// What the frame before kept of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeptPixel {
    /// The surface.
    pub seen: Seen,
    /// Its light and visibility.
    pub light: DVec4,
    /// What light weighs (frames), and what visibility does.
    pub weights: [f64; 2],
}

/// A picture of what may be there or not, row by row.
pub struct Picture<'p, T> {
    /// Width and height (px).
    pub size: [u32; 2],
    /// The pixels.
    pub pixels: &'p [Option<T>],
}

impl<T> Picture<'_, T> {
    pub(super) fn at(&self, x: i64, y: i64) -> Option<&T> {
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
        let [of_position, of_normal] = self.margins(seen, from_here, other);
        of_position.min(of_normal)
    }

    /// The same, of each limit: footprints left, and cosine left.
    pub fn margins(&self, seen: &Seen, from_here: DVec3, other: &Seen) -> [f64; 2] {
        let off_plane = from_here.dot(seen.geometric_normal).abs() / seen.footprint;
        let cosine = seen.shading_normal.dot(other.shading_normal);
        [
            self.plane_tolerance - off_plane,
            cosine - self.normal_cosine,
        ]
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

/// Cosine of the largest turn of a surface from frame to frame.
const LEAST_TURNED: f64 = -0.8;

/// The same surface in the frame before, and how far it is from having turned too much: what has
/// moved is turned by the smallest angle that turns its shading normal to what it was.
fn turned_back(seen: &Seen, moved: &Moved) -> (Seen, f64) {
    let Some(before) = moved.turned else {
        return (*seen, f64::INFINITY);
    };
    let cosine = seen.shading_normal.dot(before);
    let turn = DQuat::from_rotation_arc(seen.shading_normal.normalize(), before.normalize());
    let there = Seen {
        geometric_normal: turn * seen.geometric_normal,
        shading_normal: before,
        ..*seen
    };
    (there, cosine - LEAST_TURNED)
}

/// What brings light of the frame before to this frame's, and what weighs at most (frames).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// Times light of the frame before.
    pub factor: DVec3,
    /// What light of the frame before weighs, without this frame's: less where it has changed.
    pub unchanged: f64,
    /// What light and visibility weigh with this frame's.
    pub longest: f64,
}

/// What light of the frame before weighs (frames) where it differs by the share `change`, 0 to 1.
pub fn unchanged(change: f64, slack: f64) -> f64 {
    if change > 0.0 {
        slack / change - slack
    } else {
        f64::INFINITY
    }
}

/// What mirrored light of the frame before weighs at most (frames), where the directions to the eye
/// are seen from the surface: in the mean of so many, it slides by a quarter of the half angle of a
/// lobe of this roughness.
pub fn unslid(
    seen: &Seen,
    moved: &Moved,
    [to_eye, to_eye_before]: [DVec3; 2],
    roughness: f64,
) -> f64 {
    let alpha = roughness.powi(2).max(1e-3);
    let half_angle = 2.0 * (alpha / 3f64.sqrt()).atan();
    let turned = moved
        .turned
        .map_or(0.0, |before| seen.shading_normal.distance(before));
    let slid = to_eye.distance(to_eye_before) + 2.0 * turned;
    if slid > 0.0 {
        0.5 * half_angle / slid
    } else {
        f64::INFINITY
    }
}

/// The light of a pixel and what it and its visibility weigh (frames): `light` of this frame, and
/// of the frame before what a bilinear sample finds on the same surface.
pub fn history(
    seen: &Seen,
    light: DVec4,
    moved: Option<&Moved>,
    before: &Picture<'_, KeptPixel>,
    (limits, terms): (Limits, Terms),
) -> Judged<(DVec4, [f64; 2])> {
    let (mut found, mut weights, mut kept, mut least_margin) =
        (DVec4::ZERO, DVec2::ZERO, 0.0, f64::INFINITY);
    if let Some(moved) = moved {
        let (there, known) = turned_back(seen, moved);
        least_margin = least_margin.min(known.abs());
        let corner = (moved.place - 0.5).floor();
        let share = moved.place - 0.5 - corner;
        for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let near = |step: i64, share: f64| if step == 1 { share } else { 1.0 - share };
            let part = near(x, share.x) * near(y, share.y);
            let Some(tap) = before.at(corner.x as i64 + x, corner.y as i64 + y) else {
                continue;
            };
            let margin = limits.margin(&there, tap.seen.position - moved.position, &tap.seen);
            least_margin = least_margin.min(margin.abs());
            if margin >= 0.0 && known > 0.0 {
                found += part * tap.light;
                weights += part * DVec2::from(tap.weights);
                kept += part;
            }
        }
        if kept > 0.0 {
            // A small part of a sample is as uncertain as its place.
            least_margin = least_margin.min((kept - 1e-3).abs()).min(0.05 * kept);
        }
    }
    let is_kept = kept >= 1e-3;
    let (found, weights) = match is_kept {
        true => (found / kept, weights / kept * (kept / 0.05).min(1.0)),
        false => (DVec4::ZERO, DVec2::ZERO),
    };
    let found = (found.truncate() * terms.factor).extend(found.w);
    let longest = terms.longest - 1.0;
    let weights = weights.min(DVec2::new(longest.min(terms.unchanged), longest));
    let value = if light.is_finite() {
        let shares = weights / (weights + 1.0);
        let mean = light + (found - light) * shares.xxxy();
        (mean, (weights + 1.0).to_array())
    } else {
        (found, weights.to_array())
    };
    Judged {
        value,
        least_margin,
    }
}

/// ρ = Σ L′ / Σ L, at most 4, and λ = Σ|L′ − ρL| / Σ max(L′, ρL) around a texel, by a Gaussian: of
/// surfaces, what they gathered (`before`) and gather now.
pub fn relight(texel: [u32; 2], picture: &Picture<'_, [DVec3; 2]>) -> (DVec3, f64) {
    let [x, y] = texel.map(i64::from);
    let around = || {
        let taps = (-2..=2).flat_map(|j| (-2..=2).map(move |i| (i, j)));
        taps.filter_map(|(i, j)| {
            let weight = (-0.5 * (i * i + j * j) as f64 / (1.5 * 1.5)).exp();
            picture.at(x + i, y + j).map(|pair| (weight, *pair))
        })
    };
    let sum = |of: fn([DVec3; 2]) -> DVec3| -> DVec3 {
        around().map(|(weight, pair)| weight * of(pair)).sum()
    };
    let (before, now) = (sum(|[before, _]| before), sum(|[_, now]| now));
    let factor = DVec3::select(
        before.cmpgt(DVec3::ZERO),
        (now / before).min(DVec3::splat(4.0)),
        DVec3::ONE,
    );
    let (mut apart, mut all) = (0.0, 0.0);
    for (weight, [before, now]) in around() {
        apart += weight * (now - factor * before).abs().element_sum();
        all += weight * now.max(factor * before).element_sum();
    }
    (factor, if all > 0.0 { apart / all } else { 0.0 })
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
                weights: [weight, 0.5 * weight],
            })
        };
        let moved = Moved {
            place: DVec2::new(0.75, 0.5),
            position: DVec3::ZERO,
            turned: None,
        };
        let of = |second: f64, change: f64| {
            let terms = Terms {
                unchanged: unchanged(change, 0.3),
                ..terms(6.0)
            };
            let pixels = [kept(0.05, 4.0, 3.0), kept(second, 8.0, 7.0)];
            let before = Picture {
                size: [2, 1],
                pixels: &pixels,
            };
            history(
                &seen(0.0),
                DVec4::ONE,
                Some(&moved),
                &before,
                (LIMITS, terms),
            )
            .value
        };
        let light = |rgb: f64, visibility: f64| DVec3::splat(rgb).extend(visibility);
        // ¾ · 4 + ¼ · 8 = 5, with weight 4: (1 + 4 · 5) / 5; with weight 2: (1 + 2 · 5) / 3.
        assert_eq!(of(0.0, 0.0), (light(4.2, 11.0 / 3.0), [5.0, 3.0]));
        // The first alone: (1 + 3 · 4) / 4, (1 + 1.5 · 4) / 2.5.
        assert_eq!(of(0.2, 0.0), (light(3.25, 2.8), [4.0, 2.5]));
        // A change of .2 leaves .3 / .2 − .3 = 1.2 frames of light: (1 + 1.2 · 5) / 2.2.
        let (found, weights) = of(0.0, 0.2);
        let expected = light(7.0 / 2.2, 11.0 / 3.0);
        assert!((found - expected).abs().max_element() < 1e-12, "{found}");
        assert!((weights[0] - 2.2).abs() < 1e-12 && weights[1] == 3.0);
    }

    fn terms(longest: f64) -> Terms {
        Terms {
            factor: DVec3::ONE,
            unchanged: f64::INFINITY,
            longest,
        }
    }

    /// By hand: one texel of two has doubled; and where all have, they differ by a factor alone.
    #[test]
    fn a_change_by_hand() {
        let pixels = [
            Some([DVec3::ONE, DVec3::splat(2.0)]),
            Some([DVec3::ONE, DVec3::ONE]),
        ];
        let of = |pixels: &[Option<[DVec3; 2]>]| {
            let picture = Picture {
                size: [2, 1],
                pixels,
            };
            relight([0, 0], &picture)
        };
        let beside = (-0.5f64 / 2.25).exp();
        let (factor, change) = of(&pixels);
        let mean = (2.0 + beside) / (1.0 + beside);
        assert!((factor - mean).abs().max_element() < 1e-12, "{factor}");
        let apart = (2.0 - mean) + beside * (mean - 1.0);
        let expected = apart / (2.0 + beside * mean);
        assert!((change - expected).abs() < 1e-12, "{change}");
        let (factor, change) = of(&[pixels[0], pixels[0]]);
        assert_eq!((factor, change), (DVec3::splat(2.0), 0.0));
        assert_eq!(of(&[pixels[1], None]), (DVec3::ONE, 0.0));
        let lit = Some([DVec3::ZERO, DVec3::ONE]);
        assert_eq!(of(&[lit, lit]), (DVec3::ONE, 1.0));
    }

    /// After n frames of what stands still: their mean, with the weight n.
    #[test]
    fn still_frames_come_to_their_mean() {
        let moved = Moved {
            place: DVec2::splat(0.5),
            position: DVec3::ZERO,
            turned: None,
        };
        let mut pixels = [None];
        for frame in 1..=9 {
            let before = Picture {
                size: [1, 1],
                pixels: &pixels,
            };
            let light = DVec4::splat(f64::from(frame));
            let limits = (LIMITS, terms(32.0));
            let (light, weights) = history(&seen(0.0), light, Some(&moved), &before, limits).value;
            assert!((light.x - 0.5 * f64::from(frame + 1)).abs() < 1e-12);
            assert_eq!(weights, [f64::from(frame); 2]);
            pixels = [Some(KeptPixel {
                seen: seen(0.0),
                light,
                weights,
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
        let limits = (LIMITS, terms(9.0));
        let found = history(&seen(0.0), light, None, &before, limits).value;
        assert_eq!(found, (DVec4::ZERO, [0.0; 2]));
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
