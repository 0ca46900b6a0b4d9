//! CPU twin of `gi.deinterleave`: the mean over a window around each pixel, in f64.

use std::collections::BTreeMap;

use glam::{DVec3, DVec4};

use crate::gi::shared::voxel::oracle::Receiver;

/// Cosine of two shading normals below which two pixels are not on one surface.
const ONE_SURFACE: f64 = 0.9;

/// What one pixel gathered, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The surface; positions in any unit, the same as the eye's.
    pub receiver: Receiver,
    /// What was gathered.
    pub value: DVec4,
}

/// Mean of what the pixels gathered in a window `interleave` (even) pixels wide around each, over
/// those on its own surface, weighted by the share of the pixel that lies inside the window.
/// `footprint` is a pixel's height at distance 1.
pub fn deinterleave(
    samples: &BTreeMap<[u32; 2], Sample>,
    eye: DVec3,
    footprint: f64,
    interleave: u32,
) -> BTreeMap<[u32; 2], DVec4> {
    samples
        .iter()
        .map(|(pixel, own)| {
            (
                *pixel,
                window_mean(
                    samples,
                    *pixel,
                    own,
                    footprint * own.receiver.position.distance(eye),
                    interleave,
                ),
            )
        })
        .collect()
}

fn window_mean(
    samples: &BTreeMap<[u32; 2], Sample>,
    pixel: [u32; 2],
    own: &Sample,
    footprint: f64,
    interleave: u32,
) -> DVec4 {
    let reach = interleave / 2;
    let range = |at: u32| at.saturating_sub(reach)..=at + reach;
    let (mut sum, mut weight_sum) = (DVec4::ZERO, 0.0);
    for other_pixel in range(pixel[1]).flat_map(|y| range(pixel[0]).map(move |x| [x, y])) {
        let Some(other) = samples.get(&other_pixel) else {
            continue;
        };
        let off_plane = (other.receiver.position - own.receiver.position)
            .dot(own.receiver.geometric_normal)
            .abs();
        if off_plane > 0.5 * footprint
            || other
                .receiver
                .shading_normal
                .dot(own.receiver.shading_normal)
                < ONE_SURFACE
        {
            continue;
        }
        let weight = share_inside(pixel[0], other_pixel[0], interleave)
            * share_inside(pixel[1], other_pixel[1], interleave);
        sum += weight * other.value;
        weight_sum += weight;
    }
    sum / weight_sum
}

/// Length of the unit interval around `other` that lies in the interval of length `width` around
/// `centre`.
fn share_inside(centre: u32, other: u32, width: u32) -> f64 {
    (0.5 * f64::from(width) + 0.5 - f64::from(centre.abs_diff(other))).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: in a row of pixels on one plane, 2 wide: (½ a + b + ½ c) / 2, and (b + ½ a) / 1½ at
    /// the end. A step of the surface ends the window.
    #[test]
    fn a_row_by_hand() {
        let sample = |x: u32, height: f64, value: f64| {
            let receiver = Receiver {
                position: DVec3::new(f64::from(x), 0.0, height),
                geometric_normal: DVec3::Z,
                shading_normal: DVec3::Z,
            };
            (
                [x, 0],
                Sample {
                    receiver,
                    value: DVec4::splat(value),
                },
            )
        };
        let samples = BTreeMap::from([
            sample(0, 0.0, 1.0),
            sample(1, 0.0, 4.0),
            sample(2, 0.0, 9.0),
            sample(3, 5.0, 100.0),
        ]);
        let means = deinterleave(&samples, DVec3::new(0.0, 0.0, 50.0), 0.02, 2);
        let expected = [
            (4.0 + 2.0 * 1.0) / 3.0,
            (1.0 + 8.0 + 9.0) / 4.0,
            (2.0 * 9.0 + 4.0) / 3.0,
            100.0,
        ];
        for (x, expected) in expected.into_iter().enumerate() {
            assert!(
                (means[&[x as u32, 0]] - DVec4::splat(expected))
                    .abs()
                    .max_element()
                    < 1e-12,
                "{x}"
            );
        }
    }
}
