//! What the other tests compare with, held to errors that are planted; and the choices of settings
//! that they try together.

use crate::support::compare::{Largest, Worst, exceeds, larger};
use crate::support::covering::covering_rows;
use crate::support::gather::{errors, verdict};
use crate::support::technique::largest_difference;
use glam::{DVec2, DVec3, DVec4, Vec3};
use lumivox::image::Image;

#[test]
fn a_nan_in_any_channel_is_the_largest() {
    for channel in 0..4 {
        let mut texel = [1.0f64; 4];
        texel[channel] = f64::NAN;
        let [x, y, z, w] = texel;
        assert!(
            DVec4::new(x, y, z, w).largest().is_nan(),
            "channel {channel} of 4"
        );
        assert!(
            channel == 3
                || DVec3::new(x, y, z).largest().is_nan()
                    && Vec3::new(x as f32, y as f32, z as f32).largest().is_nan(),
            "channel {channel} of 3"
        );
        assert!(
            channel >= 2 || DVec2::new(x, y).largest().is_nan(),
            "channel {channel} of 2"
        );
        assert!(texel.into_iter().worst().is_nan(), "number {channel} of 4");
    }
    assert_eq!(
        (
            DVec4::new(1.0, 4.0, 3.0, 2.0).largest(),
            DVec3::new(1.0, 2.0, 3.0).largest(),
            DVec2::new(5.0, 2.0).largest()
        ),
        (4.0, 3.0, 5.0)
    );
    assert_eq!(
        (
            [1.0f32, 7.0, 3.0].into_iter().worst(),
            [0.0f64; 0].into_iter().worst(),
            larger(-1.0, -2.0)
        ),
        (7.0, 0.0, -1.0)
    );
    assert!(exceeds(f64::NAN, 1.0) && exceeds(1.1, 1.0) && !exceeds(1.0, 1.0));
}

#[test]
fn pictures_with_a_nan_differ() {
    let picture = Image::from_fn(3, 2, |_| Vec3::ONE);
    assert_eq!(largest_difference(&picture, &picture), 0.0);
    for (pixel, channel) in (0..6).flat_map(|pixel| (0..3).map(move |channel| (pixel, channel))) {
        let mut wrong = picture.clone();
        wrong.pixels[pixel][channel] = f32::NAN;
        assert!(
            largest_difference(&wrong, &picture).is_nan()
                && largest_difference(&picture, &wrong).is_nan(),
            "pixel {pixel}, channel {channel}"
        );
        wrong.pixels[pixel][channel] = 1.5;
        assert_eq!(largest_difference(&wrong, &picture), 0.5);
    }
}

#[test]
fn gathers_with_a_nan_are_wrong() {
    let expected = vec![DVec4::ONE; 100];
    for (pixel, channel) in [0, 17, 99]
        .into_iter()
        .flat_map(|pixel| (0..4).map(move |channel| (pixel, channel)))
    {
        let mut seen = expected.clone();
        assert_eq!(verdict(&errors(&seen, &expected)), Ok(()));
        seen[pixel][channel] = f64::NAN;
        assert!(
            verdict(&errors(&seen, &expected)).is_err(),
            "pixel {pixel}, channel {channel}"
        );
        seen[pixel][channel] = 1.02;
        assert!(
            verdict(&errors(&seen, &expected)).is_err(),
            "pixel {pixel}, channel {channel}"
        );
    }
}

/// Every two choices meet in a row but those that may not, and no row has what may not be.
#[test]
fn covering_rows_cover_every_pair() {
    let counts = [3, 2, 7, 4, 2, 5];
    // The second value of the first factor forbids the third factor's last, unless the last factor
    // has its first.
    let is_legal = |row: &[(usize, usize)]| {
        !row.contains(&(0, 1)) || !row.contains(&(2, 6)) || row.contains(&(5, 0))
    };
    let never = |row: &[(usize, usize)]| !(row.contains(&(1, 1)) && row.contains(&(4, 0)));
    let (rows, refused) = covering_rows(&counts, |row| is_legal(row) && never(row));
    assert_eq!(refused, [[(1, 1), (4, 0)]]);
    assert!(rows.iter().all(|row| is_legal(row) && never(row)));
    assert!(rows.len() < 60, "{} rows", rows.len());
    for a in 0..counts.len() {
        for b in a + 1..counts.len() {
            for pair in (0..counts[a]).flat_map(|x| (0..counts[b]).map(move |y| [(a, x), (b, y)])) {
                assert!(
                    refused.contains(&pair)
                        || rows
                            .iter()
                            .any(|row| pair.iter().all(|choice| row.contains(choice))),
                    "{pair:?}"
                );
            }
        }
    }
}
