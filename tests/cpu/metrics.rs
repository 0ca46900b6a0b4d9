//! The metrics on hand-computed cases, and each of them failing where it must.

use glam::Vec3;
use lumivox::image::{
    GuideImage, Image, Planes, heat_color, read_exr, read_planes, srgb_from_linear, write_exr,
    write_heatmap, write_planes, write_png,
};
use lumivox::metrics::stability::{
    excess_flicker, flicker, lag, leak, popping, rotation_spread, run_spread, shown_change,
    shown_from, squares, translation_spread,
};
use lumivox::metrics::{Channel, MetricError, compare, errors_of_values, find_blocks};

fn grey(width: u32, values: &[f32]) -> Image {
    Image {
        width,
        height: values.len() as u32 / width,
        pixels: values.iter().map(|&value| Vec3::splat(value)).collect(),
    }
}

#[track_caller]
fn assert_near(found: f64, expected: f64) {
    assert!(
        (found - expected).abs() <= 1e-6 * expected.abs().max(1.0),
        "found {found}, expected {expected}"
    );
}

#[test]
fn four_errors_by_hand() {
    // Mean R = 2, ε = 0.02; differences 1, −1, 0, 2.
    let errors = errors_of_values(&[2.0, 1.0, 2.0, 5.0], &[1.0, 2.0, 2.0, 3.0]).unwrap();
    assert_near(errors.mean_reference, 2.0);
    assert_near(errors.bias, 0.5 / 2.0);
    assert_near(errors.rel_rmse, (6.0f64 / 4.0).sqrt() / 2.0);
    let e2 = 0.02f64 * 0.02;
    assert_near(
        errors.rel_mse,
        (1.0 / (1.0 + e2) + 1.0 / (4.0 + e2) + 4.0 / (9.0 + e2)) / 4.0,
    );
    assert_near(errors.p95, 1.0 / 1.02);
    assert_eq!(errors.count, 4);
}

#[test]
fn p95_is_the_nearest_rank() {
    let reference = [1.0; 100];
    let technique: Vec<f32> = (1..=100).map(|i| 1.0 + i as f32).collect();
    assert_near(
        errors_of_values(&technique, &reference).unwrap().p95,
        95.0 / 1.01,
    );
}

#[test]
fn equal_images_have_no_error_and_unequal_ones_do() {
    let image = grey(2, &[0.0, 1.0, 2.0, 3.0]);
    let same = compare(&image, &image, None, Channel::Luminance)
        .unwrap()
        .pixel;
    assert_eq!([same.rel_rmse, same.bias, same.rel_mse, same.p95], [0.0; 4]);
    let other = compare(
        &grey(2, &[0.0, 1.0, 2.0, 3.1]),
        &image,
        None,
        Channel::Luminance,
    )
    .unwrap()
    .pixel;
    assert!(other.rel_rmse > 0.0 && other.bias > 0.0 && other.rel_mse > 0.0 && other.p95 > 0.0);
    let black = compare(&image, &grey(2, &[0.0; 4]), None, Channel::Luminance)
        .unwrap()
        .pixel;
    assert!(black.rel_rmse.is_infinite() && black.bias.is_infinite());
}

#[test]
fn opposite_errors_cancel_in_luminance_bias_but_not_in_rgb_rmse() {
    let reference = grey(1, &[1.0]);
    let mut image = reference.clone();
    image.pixels[0] = Vec3::new(1.0 + 0.7152, 1.0 - 0.2126, 1.0);
    let luminance = compare(&image, &reference, None, Channel::Luminance)
        .unwrap()
        .pixel;
    let rgb = compare(&image, &reference, None, Channel::Rgb)
        .unwrap()
        .pixel;
    assert!(luminance.rel_rmse < 1e-6, "{luminance:?}");
    assert_near(
        rgb.rel_rmse,
        ((0.7152f64.powi(2) + 0.2126f64.powi(2)) / 3.0).sqrt(),
    );
    assert_eq!((luminance.count, rgb.count), (1, 3));
}

/// A 16×8 guide: the left block on the plane z = −1, the right one `bent` as asked.
fn guide(bent: impl Fn(&mut GuideImage, usize)) -> GuideImage {
    let mut guide = GuideImage::new(16, 8);
    for index in 0..128 {
        let (x, y) = (index % 16, index / 16);
        guide.position[index] = Vec3::new(x as f32, y as f32, -1.0);
        guide.normal[index] = Vec3::Z;
        guide.depth_m[index] = 1.0;
        guide.material[index] = if x < 8 { 3 } else { 5 };
        if x >= 8 {
            bent(&mut guide, index);
        }
    }
    guide
}

#[test]
fn blocks_lie_on_one_plane_and_one_material() {
    assert_eq!(find_blocks(&guide(|_, _| {})).len(), 2);
    let bends: [fn(&mut GuideImage, usize); 4] = [
        |guide, index| guide.normal[index] = if index == 77 { Vec3::X } else { Vec3::Z },
        |guide, index| guide.position[index].z += if index == 77 { 0.01 } else { 0.0 },
        |guide, index| guide.material[index] = if index == 77 { 3 } else { 5 },
        |guide, index| {
            guide.material[index] = if index == 77 {
                lumivox::image::NO_SURFACE
            } else {
                5
            }
        },
    ];
    for bend in bends {
        let blocks = find_blocks(&guide(bend));
        assert_eq!(blocks.len(), 1);
        assert_eq!(
            (blocks[0].x_px, blocks[0].y_px, blocks[0].material),
            (0, 0, 3)
        );
    }
}

#[test]
fn blocks_average_noise_away_and_materials_are_told_apart() {
    let guide = guide(|_, _| {});
    let reference = Image::from_fn(16, 8, |_| Vec3::ONE);
    // ±0.5 in a checkerboard on material 3; +0.1 everywhere on material 5.
    let image = Image::from_fn(16, 8, |i| {
        Vec3::splat(if i % 16 >= 8 {
            1.1
        } else {
            0.5 + ((i + i / 16) % 2) as f32
        })
    });
    let comparison = compare(&image, &reference, Some(&guide), Channel::Luminance).unwrap();
    assert_near(comparison.pixel.bias, 0.05);
    let block = comparison.block.unwrap();
    assert_eq!(block.count, 2);
    assert!(
        (block.rel_rmse - (0.01f64 / 2.0).sqrt()).abs() < 1e-6,
        "{block:?}"
    );
    let [first, second] = comparison.materials.as_slice() else {
        panic!("{:?}", comparison.materials)
    };
    assert_eq!((first.material, second.material), (3, 5));
    assert!(first.pixel.rel_rmse > 0.49 && first.block.unwrap().rel_rmse < 1e-6);
    assert!((second.pixel.bias - 0.1).abs() < 1e-6);
}

#[test]
fn pixels_without_a_surface_do_not_count() {
    let mut guide = guide(|_, _| {});
    guide.material[..64].fill(lumivox::image::NO_SURFACE);
    let reference = Image::from_fn(16, 8, |_| Vec3::ONE);
    let image = Image::from_fn(16, 8, |i| Vec3::splat(if i < 64 { 100.0 } else { 1.0 }));
    let comparison = compare(&image, &reference, Some(&guide), Channel::Luminance).unwrap();
    assert_eq!(
        (
            comparison.pixel.count,
            comparison.pixel.rel_rmse,
            comparison.block
        ),
        (64, 0.0, None)
    );
    guide.material.fill(lumivox::image::NO_SURFACE);
    assert!(matches!(
        compare(&image, &reference, Some(&guide), Channel::Luminance),
        Err(MetricError::Empty(_))
    ));
}

#[test]
fn what_cannot_be_compared_is_an_error() {
    let (two, four) = (grey(2, &[1.0, 2.0]), grey(2, &[1.0; 4]));
    assert!(matches!(
        compare(&two, &four, None, Channel::Luminance),
        Err(MetricError::Size {
            found_height: 1,
            height: 2,
            ..
        })
    ));
    let infinite = grey(2, &[1.0, 1.0, 1.0, f32::NAN]);
    assert_eq!(
        compare(&infinite, &four, None, Channel::Luminance),
        Err(MetricError::NotFinite {
            what: "the image",
            x: 1,
            y: 1
        })
    );
    assert!(matches!(
        compare(
            &four,
            &four,
            Some(&GuideImage::new(1, 1)),
            Channel::Luminance
        ),
        Err(MetricError::Size {
            what: "the guide",
            ..
        })
    ));
    assert_eq!(errors_of_values(&[], &[]), None);
}

#[test]
fn spreads_by_hand() {
    // Pixel 0: (3 − 1) / 2 = 1; pixel 1: constant; pixel 2: black.
    let images = [
        grey(3, &[1.0, 5.0, 0.0]),
        grey(3, &[3.0, 5.0, 0.0]),
        grey(3, &[2.0, 5.0, 0.0]),
    ];
    for spread in [translation_spread, rotation_spread, run_spread] {
        assert_near(spread(&images).unwrap(), 1.0 / 3.0);
        assert_eq!(
            spread(&[images[0].clone(), images[0].clone()]).unwrap(),
            0.0
        );
        assert!(matches!(spread(&images[..1]), Err(MetricError::Empty(_))));
        assert!(matches!(
            spread(&[grey(1, &[1.0]), grey(1, &[1.0, 2.0])]),
            Err(MetricError::Size { .. })
        ));
    }
}

#[test]
fn flicker_by_hand() {
    // Changes 2 and 1 about a mean of 2: 1.5 / 2.
    let frames = [grey(1, &[1.0]), grey(1, &[3.0]), grey(1, &[2.0])];
    assert_near(flicker(&frames).unwrap(), 0.75);
    assert_eq!(
        flicker(&[frames[0].clone(), frames[0].clone()]).unwrap(),
        0.0
    );
}

#[test]
fn change_beyond_the_references_own_by_hand() {
    // Reference 1, 3, 2 (mean 2); the picture is off by 1, 1, 0: changes of 0 and 1 beyond the
    // reference's own.
    let reference = [1.0, 3.0, 2.0].map(|value| grey(1, &[value]));
    let frames = [2.0, 4.0, 2.0].map(|value| grey(1, &[value]));
    assert_near(excess_flicker(&frames, &reference).unwrap(), 0.5 / 2.0);
    assert_near(popping(&frames, &reference).unwrap(), 1.0 / 2.0);
    assert_eq!(
        (
            excess_flicker(&reference, &reference).unwrap(),
            popping(&reference, &reference).unwrap()
        ),
        (0.0, 0.0)
    );
    assert!(matches!(
        popping(&frames[..2], &reference),
        Err(MetricError::Empty(_))
    ));
    assert!(matches!(
        excess_flicker(&[grey(2, &[1.0; 2]), grey(2, &[1.0; 2])], &reference[..2]),
        Err(MetricError::Size { .. })
    ));
    assert_near(
        lag(&grey(2, &[1.0, 4.0]), &grey(2, &[2.0, 3.0])).unwrap(),
        2.0 / 5.0,
    );
    assert_eq!(lag(&reference[0], &reference[0]).unwrap(), 0.0);
}

/// By hand, and whatever noise is added that does not go with the change.
#[test]
fn shown_changes_by_hand() {
    let (before, after) = (grey(3, &[1.0, 2.0, 5.0]), grey(3, &[3.0, 1.0, 5.0]));
    let shown = |values: &[f32]| shown_change(&grey(3, values), [&before, &after]);
    assert_near(shown(&[1.0, 2.0, 5.0]).unwrap(), 0.0);
    assert_near(shown(&[3.0, 1.0, 5.0]).unwrap(), 1.0);
    assert_near(shown(&[2.0, 1.5, 5.0]).unwrap(), 0.5);
    assert_near(shown(&[2.0 + 0.3, 1.5 + 0.6, 9.0]).unwrap(), 0.5);
    assert!(shown_change(&after, [&before, &before]).is_err());
    assert!(shown_change(&grey(2, &[1.0, 2.0]), [&before, &after]).is_err());
    let late = [0.2, 0.95, 0.8, 0.9, 0.99];
    assert_eq!(shown_from(&late, 0.9), Some(3));
    assert_eq!(shown_from(&late, 0.1), Some(0));
    assert_eq!(shown_from(&late, 1.0), None);
}

#[test]
fn squares_are_means() {
    let image = Image::from_fn(9, 4, |index| {
        Vec3::splat(if index % 9 < 4 { 1.0 } else { 3.0 })
    });
    let means = squares(&image, 4);
    assert_eq!(
        (means.size(), means.pixels[0], means.pixels[1]),
        ((2, 1), Vec3::ONE, Vec3::splat(3.0))
    );
}

#[test]
fn leak_by_hand() {
    let reference = grey(4, &[2.0, 4.0, 0.0, 0.0]);
    assert_near(
        leak(&grey(4, &[9.0, 9.0, 0.3, 0.0]), &reference, None).unwrap(),
        0.05,
    );
    assert_eq!(leak(&reference, &reference, None).unwrap(), 0.0);
    assert!(matches!(
        leak(&reference, &grey(4, &[0.0; 4]), None),
        Err(MetricError::Empty(_))
    ));
    assert!(matches!(
        leak(&reference, &grey(4, &[1.0; 4]), None),
        Err(MetricError::Empty(_))
    ));
}

/// A header that claims more than the file can hold takes no memory; a black picture, which packs
/// best, is still read.
#[test]
fn exr_files_cannot_claim_more_than_they_hold() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("image.exr");
    let black = Image::new(2048, 1024);
    write_exr(&path, &black).unwrap();
    assert_eq!(read_exr(&path).unwrap(), black);
    write_exr(&path, &grey(2, &[1.0; 4])).unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    let key = b"dataWindow\0box2i\0";
    let end = bytes
        .windows(key.len())
        .position(|part| part == key)
        .unwrap()
        + key.len()
        + 4;
    for [x, y] in [[100_000i32, 100_000], [1 << 20, 0], [0, 1 << 20]] {
        bytes[end + 8..end + 12].copy_from_slice(&x.to_le_bytes());
        bytes[end + 12..end + 16].copy_from_slice(&y.to_le_bytes());
        std::fs::write(&path, &bytes).unwrap();
        let error = read_planes(&path).unwrap_err();
        let cause = std::error::Error::source(&error)
            .map(ToString::to_string)
            .unwrap_or_default();
        assert!(
            error.to_string().contains("image.exr") && cause.contains("do not fit into"),
            "{error}: {cause}"
        );
    }
}

#[test]
fn exr_keeps_every_bit_and_every_channel() {
    let dir = tempfile::tempdir().unwrap();
    let image = Image::from_fn(5, 3, |i| {
        Vec3::new(i as f32 * 1.234_567e-5, 1e9 / (i + 1) as f32, -(i as f32))
    });
    let path = dir.path().join("image.exr");
    write_exr(&path, &image).unwrap();
    assert_eq!(read_exr(&path).unwrap(), image);
    let mut planes = Planes::new(5, 3);
    planes.push_image("direct", &image);
    planes.push("depth.Z", (0..15).map(|i| i as f32).collect());
    write_planes(&path, &planes).unwrap();
    let read = read_planes(&path).unwrap();
    assert_eq!(read.image("direct"), Some(image));
    assert_eq!(read.plane("depth.Z"), planes.plane("depth.Z"));
    let message = read_exr(&path).unwrap_err().to_string();
    assert!(
        message.contains("image.exr") && message.contains("depth.Z"),
        "{message}"
    );
    let missing = read_exr(&dir.path().join("missing.exr"))
        .unwrap_err()
        .to_string();
    assert!(missing.contains("missing.exr"), "{missing}");
}

#[test]
fn half_floats_with_alpha_are_read_as_colour() {
    use exr::prelude::{f16, write_rgba_file};
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("half.exr");
    let half = |value: usize| f16::from_f32(value as f32 * 0.25);
    write_rgba_file(&path, 3, 2, |x, y| {
        (half(x), half(y), half(x + y), f16::ONE)
    })
    .unwrap();
    assert_eq!(
        read_exr(&path).unwrap(),
        Image::from_fn(3, 2, |i| Vec3::new(
            (i % 3) as f32,
            (i / 3) as f32,
            (i % 3 + i / 3) as f32
        ) * 0.25)
    );
}

#[test]
fn pictures_are_srgb_and_clamped() {
    assert_eq!(
        [-1.0, 0.0, 0.215_9, 1.0, 9.0, f32::NAN].map(srgb_from_linear),
        [0, 0, 128, 255, 255, 0]
    );
    assert_eq!(heat_color(f32::NAN), heat_color(0.0));
    let brightness = |value: f32| {
        heat_color(value)
            .iter()
            .map(|&channel| u32::from(channel))
            .sum::<u32>()
    };
    assert!(
        (0..20).all(|step| brightness(step as f32 / 20.0) < brightness((step + 1) as f32 / 20.0))
    );
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("image.png");
    write_png(&path, &grey(2, &[0.0, 0.5, 1.0, 2.0]), 1.0).unwrap();
    let read = image::open(&path).unwrap().into_rgb8();
    assert_eq!(
        (
            read.dimensions(),
            read.get_pixel(1, 0).0,
            read.get_pixel(1, 1).0
        ),
        ((2, 2), [188; 3], [255; 3])
    );
    write_heatmap(&path, &grey(2, &[0.0, 0.5, 1.0, 2.0]), 1.0).unwrap();
    assert_eq!(
        image::open(&path).unwrap().into_rgb8().get_pixel(0, 1).0,
        heat_color(1.0)
    );
    assert!(write_png(&dir.path().join("absent/image.png"), &grey(1, &[0.0]), 1.0).is_err());
}
