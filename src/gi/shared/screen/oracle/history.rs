//! CPU twin of `screen.history`.

use glam::{DQuat, DVec2, DVec3, DVec4, Vec2Swizzles as _};

use super::{Judged, Limits, Picture, Seen};

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

/// Cosine of the largest turn of a surface from frame to frame.
const LEAST_TURNED: f64 = -0.8;

/// Light slides along the edge of a surface by no more, in the mean of frames (px).
const LONGEST_SLIDE_PX: f64 = 1.0;

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
    let (mut found, mut weights, mut kept, mut aside_px, mut least_margin) =
        (DVec4::ZERO, DVec2::ZERO, 0.0, DVec2::ZERO, f64::INFINITY);
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
            if margin >= 0.0 && known > 0.0 && tap.seen.material == seen.material {
                found += part * tap.light;
                weights += part * DVec2::from(tap.weights);
                kept += part;
                aside_px += part * (DVec2::new(x as f64, y as f64) - share);
            }
        }
        if kept > 0.0 {
            // A small part of a sample is as uncertain as its place.
            least_margin = least_margin.min((kept - 1e-3).abs()).min(0.05 * kept);
        }
    }
    let is_kept = kept >= 1e-3;
    let (found, weights) = match is_kept {
        true => {
            let slid_px = (aside_px / kept).length().max(1e-4);
            let longest = DVec2::splat(LONGEST_SLIDE_PX / slid_px);
            (found / kept, (weights / kept).min(longest))
        }
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

#[cfg(test)]
mod tests {
    use super::super::tests::{LIMITS, seen};
    use super::*;

    /// By hand: a place a quarter of the way from one pixel to the next; half a footprint off the
    /// plane is on it, two are not, and what stays of the sample weighs less.
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
        // The first alone, a quarter of a pixel beside, may weigh 4: (1 + 3 · 4) / 4 and
        // (1 + 1.5 · 4) / 2.5.
        assert_eq!(of(0.2, 0.0), (light(3.25, 2.8), [4.0, 2.5]));
        // A change of .2 leaves .3 / .2 − .3 = 1.2 frames of light: (1 + 1.2 · 5) / 2.2.
        let (found, weights) = of(0.0, 0.2);
        let expected = light(7.0 / 2.2, 11.0 / 3.0);
        assert!((found - expected).abs().max_element() < 1e-12, "{found}");
        assert!((weights[0] - 2.2).abs() < 1e-12 && weights[1] == 3.0);
    }

    /// By hand: what a surface shows a quarter of the sample, ¾ of a pixel beside, weighs 1 / ¾.
    #[test]
    fn light_beside_the_place_weighs_less() {
        let kept = KeptPixel {
            seen: seen(0.0),
            light: DVec4::splat(8.0),
            weights: [9.0, 1.0],
        };
        let before = Picture {
            size: [2, 1],
            pixels: &[None, Some(kept)],
        };
        let moved = Moved {
            place: DVec2::new(0.75, 0.5),
            position: DVec3::ZERO,
            turned: None,
        };
        let limits = (LIMITS, terms(32.0));
        let (light, weights) = history(&seen(0.0), DVec4::ONE, Some(&moved), &before, limits).value;
        assert!((weights[0] - 7.0 / 3.0).abs() < 1e-12 && weights[1] == 2.0);
        assert!((light.x - (1.0 + 8.0 * 4.0 / 3.0) / (7.0 / 3.0)).abs() < 1e-12);
        assert_eq!(light.w, 4.5);
    }

    fn terms(longest: f64) -> Terms {
        Terms {
            factor: DVec3::ONE,
            unchanged: f64::INFINITY,
            longest,
        }
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
}
