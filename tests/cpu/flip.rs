//! ꟻLIP on pairs whose order is known, and failing where it must.

use glam::Vec3;
use lumivox::image::Image;
use lumivox::metrics::{MetricError, exposure_of, flip};

#[test]
fn flip_sees_a_difference_and_only_that() {
    let reference = Image::from_fn(32, 32, |i| Vec3::splat(0.1 + (i % 32) as f32 / 32.0));
    let exposure = exposure_of(&reference);
    assert!((exposure - 0.18 / 0.584_375).abs() < 1e-4, "{exposure}");
    assert_eq!(flip(&reference, &reference, exposure).unwrap().mean, 0.0);
    let darker = Image::from_fn(32, 32, |i| reference.pixels[i] * 0.5);
    let half = Image::from_fn(32, 32, |i| {
        reference.pixels[i] * if i < 512 { 0.5 } else { 1.0 }
    });
    let (whole, part) = (
        flip(&darker, &reference, exposure).unwrap(),
        flip(&half, &reference, exposure).unwrap(),
    );
    assert!(
        whole.mean > 0.05 && part.mean > 0.02 && part.mean < whole.mean,
        "{whole:?} {part:?}"
    );
    assert!(part.p99 >= part.mean);
}

#[test]
fn pictures_of_two_sizes_have_no_flip() {
    assert!(matches!(
        flip(&Image::new(2, 1), &Image::new(2, 2), 1.0),
        Err(MetricError::Size { .. })
    ));
    assert!(matches!(
        flip(&Image::new(0, 0), &Image::new(0, 0), 1.0),
        Err(MetricError::Empty(_))
    ));
}
