//! CPU twins, in f64: the numbers of a pixel's pattern, and `gi.deinterleave`, the mean over a
//! window around each pixel.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3, DVec4};

use super::Pattern;
use crate::gi::shared::surfaces::Limits;
use crate::gi::shared::voxel::oracle::Receiver;

/// Two numbers of [0, 1) that shift sin²θ of a pixel's directions by a part of a stratum and their
/// azimuths by a part of a turn, in the frame of number `walk`.
///
/// The point of a Hammersley set with the pixel's number. The first number moves within its
/// stratum from frame to frame, and azimuths turn, by the numbers of the R2 sequence in 32-bit
/// fixed point. The azimuths of each tile are turned besides by a number of its own (a hash of 24
/// bits).
pub fn interleaved_offset(pixel: [u32; 2], pattern: Pattern, walk: u32) -> DVec2 {
    let ([width, height], count) = (pattern.size, pattern.count());
    let fixed = |number: u32| f64::from(number >> 8) / f64::from(1 << 24);
    let number = pixel[0] % width + width * (pixel[1] % height) + walk % count;
    let index = number * pattern.stride() % count;
    let radical_inverse: f64 = (0..32)
        .filter(|bit| index >> bit & 1 == 1)
        .map(|bit| 0.5f64.powi(bit + 1))
        .sum();
    let mixed = (pixel[0] / width).wrapping_mul(0x9e37_79b1)
        ^ (pixel[1] / height).wrapping_mul(0x85eb_ca77);
    let hash = match () {
        _ if count == 1 || !pattern.is_turned => 0,
        _ => (mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d),
    };
    let moved = fixed(0x8000_0000u32.wrapping_add(0xc13f_a9a9u32.wrapping_mul(walk)));
    let turn = fixed(hash.wrapping_add(0x91e1_0da6u32.wrapping_mul(walk)));
    DVec2::new(
        (f64::from(index) + moved) / f64::from(count),
        (radical_inverse + turn).fract(),
    )
}

/// What one pixel gathered, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The surface; positions in any unit, the same as the eye's.
    pub receiver: Receiver,
    /// What was gathered.
    pub value: DVec4,
}

/// Mean of what the pixels gathered in a window as large as a tile around each, over those on its
/// own surface, weighted by the share of the pixel that lies inside the window.
/// `footprint` is a pixel's height at distance 1.
pub fn deinterleave(
    samples: &BTreeMap<[u32; 2], Sample>,
    eye: DVec3,
    footprint: f64,
    (pattern, limits): (Pattern, Limits),
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
                    (pattern, limits),
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
    (pattern, limits): (Pattern, Limits),
) -> DVec4 {
    let range = |axis: usize| {
        let reach = pattern.size[axis] / 2;
        pixel[axis].saturating_sub(reach)..=pixel[axis] + reach
    };
    let (mut sum, mut weight_sum) = (DVec4::ZERO, 0.0);
    for other_pixel in range(1).flat_map(|y| range(0).map(move |x| [x, y])) {
        let Some(other) = samples.get(&other_pixel) else {
            continue;
        };
        let off_plane = (other.receiver.position - own.receiver.position)
            .dot(own.receiver.geometric_normal)
            .abs();
        if off_plane > f64::from(limits.plane_tolerance) * footprint
            || other
                .receiver
                .shading_normal
                .dot(own.receiver.shading_normal)
                < f64::from(limits.normal_cosine)
        {
            continue;
        }
        let share = |axis: usize| share_inside(pixel[axis], other_pixel[axis], pattern.size[axis]);
        let weight = share(0) * share(1);
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

    const LIMITS: Limits = Limits {
        plane_tolerance: 0.5,
        normal_cosine: 0.9,
    };

    fn all_sizes() -> impl Iterator<Item = Pattern> {
        (1..=8).flat_map(|width| (1..=8).map(move |height| Pattern::of([width, height])))
    }

    /// In every frame, and over as many frames as a tile has pixels each pixel has each.
    #[test]
    fn a_tile_has_each_number_once() {
        for pattern in all_sizes() {
            let ([width, height], count) = (pattern.size, pattern.count());
            let number = |x: u32, y: u32, walk: u32| {
                (interleaved_offset([x, y], pattern, walk).x * f64::from(count)).floor() as u32
            };
            let every: Vec<u32> = (0..count).collect();
            for walk in [0, 1, 5, 1_000_003, u32::MAX] {
                let mut of_tile: Vec<u32> = (0..count)
                    .map(|at| number(width + at % width, 2 * height + at / width, walk))
                    .collect();
                of_tile.sort_unstable();
                assert_eq!(of_tile, every, "{pattern:?}, frame {walk}");
            }
            let mut of_pixel: Vec<u32> = (0..count).map(|walk| number(1, 2, walk)).collect();
            of_pixel.sort_unstable();
            assert_eq!(of_pixel, every, "{pattern:?}");
        }
    }

    #[test]
    fn patterns_by_hand() {
        let pattern = Pattern::of([4, 4]);
        assert_eq!(pattern.stride(), 7);
        // Pixel (1, 0) has number 7 of 16, in bits 0111; its reversal is 0.1110 (binary).
        let first = interleaved_offset([1, 0], pattern, 0);
        assert_eq!(first, DVec2::new(7.5 / 16.0, 0.875));
        // In the next frame number 14, reversal 0.0111; .5 + .75487766 − 1 into its stratum,
        // .56984029 of a turn.
        let next = interleaved_offset([1, 0], pattern, 1);
        let expected = DVec2::new(14.254_877_66 / 16.0, (0.4375f64 + 0.569_840_29).fract());
        assert!((next - expected).abs().max_element() < 1e-6, "{next}");
        // Another tile: the same elevations, all azimuths turned alike.
        let turn = |pixel: [u32; 2]| {
            let other = interleaved_offset([pixel[0] + 4, pixel[1] + 4], pattern, 0);
            (other - interleaved_offset(pixel, pattern, 0)).rem_euclid(DVec2::ONE)
        };
        assert_eq!(turn([0, 0]).x, 0.0);
        let is_near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(turn([0, 0]).y > 0.0 && (1..4).all(|x| is_near(turn([x, 2]).y, turn([0, 0]).y)));
        let unturned = Pattern {
            is_turned: false,
            ..pattern
        };
        let alike = |x, y| {
            interleaved_offset([x, y], unturned, 3) == interleaved_offset([x + 4, y], unturned, 3)
        };
        assert!((0..4).all(|x| alike(x, 1)));
        // One pattern for all pixels turns by frame alone.
        let one = Pattern::of([1, 1]);
        assert_eq!(interleaved_offset([5, 9], one, 0), DVec2::new(0.5, 0.0));
        let alike =
            |walk| interleaved_offset([5, 9], one, walk) == interleaved_offset([0, 3], one, walk);
        assert!((0..9).all(alike));
    }

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
        let pattern = Pattern::of([2, 2]);
        let means = deinterleave(
            &samples,
            DVec3::new(0.0, 0.0, 50.0),
            0.02,
            (pattern, LIMITS),
        );
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
