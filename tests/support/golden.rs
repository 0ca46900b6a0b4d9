//! Golden pictures: which pictures are compared with ones that somebody looked at, and how close
//! they have to be.

use std::path::{Path, PathBuf};

use glam::Vec3;
use lumivox::image::Image;
use lumivox::metrics::{Channel, Flip, compare, exposure_of, flip};

use super::technique::write_failure;
use super::tolerance::device_class;

/// Mean and 99th percentile of ꟻLIP, and relative RMSE. On llvmpipe, measured between two runs: 0
/// in all three; between two processors (it compiles for each): up to 0.0057, 0.035 and 0.007, in
/// the atrium. Other drivers see the other side of edges, which are many in small pictures;
/// SwiftShader also sees the other one of two walls that are a millimetre apart: 0.071, 0.51, 0.16.
fn thresholds() -> (f32, f32, f64) {
    device_class().allows((0.008, 0.05, 0.02), (0.08, 0.55, 0.2))
}

/// Where a golden picture is: in a folder beside the test of the same name.
pub fn golden_path(folder: &str, name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests")
        .join(folder)
        .join(format!("{name}.png"))
}

/// Whether pictures are to be accepted as they are.
pub fn is_update() -> bool {
    std::env::var_os("LUMIVOX_GOLDEN").is_some_and(|value| value == "update")
}

/// A golden picture is sRGB with 8 bits; this is what it stands for, before exposure.
fn linear(pixel: [u8; 3], exposure: f32) -> Vec3 {
    let decode = |value: u8| {
        let value = f32::from(value) / 255.0;
        if value <= 0.04045 {
            value / 12.92
        } else {
            ((value + 0.055) / 1.055).powf(2.4)
        }
    };
    Vec3::from(pixel.map(decode)) / exposure
}

/// What is left of a picture in sRGB with 8 bits.
pub fn quantized(image: &Image, exposure: f32) -> Image {
    let encode = |value: f32| lumivox::image::srgb_from_linear(value * exposure);
    Image::from_fn(image.width, image.height, |i| {
        linear(image.pixels[i].to_array().map(encode), exposure)
    })
}

/// ꟻLIP and relative RMSE of two pictures that were quantized alike.
pub fn distance(image: &Image, golden: &Image) -> (Flip, f64) {
    let flip = flip(image, golden, exposure_of(golden)).unwrap();
    let errors = compare(image, golden, None, Channel::Rgb).unwrap();
    (flip, errors.pixel.rel_rmse)
}

/// Whether two pictures count as the same.
pub fn is_close((flip, rel_rmse): &(Flip, f64)) -> bool {
    let (mean, p99, most_rmse) = thresholds();
    flip.mean <= mean && flip.p99 <= p99 && *rel_rmse <= most_rmse
}

/// Reads a PNG; `None` where there is none.
pub fn read_golden(path: &Path, exposure: f32) -> Option<Image> {
    let picture = image::open(path).ok()?.to_rgb8();
    let pixels = picture
        .pixels()
        .map(|pixel| linear(pixel.0, exposure))
        .collect();
    Some(Image {
        width: picture.width(),
        height: picture.height(),
        pixels,
    })
}

/// What is wrong with a picture, if anything.
pub fn judge(folder: &str, name: &str, image: &Image, exposure: f32) -> Option<String> {
    let seen = quantized(image, exposure);
    let Some(golden) = read_golden(&golden_path(folder, name), exposure) else {
        write_failure(
            &format!("{folder}.{name}"),
            image,
            None,
            exposure,
            "there is no golden picture",
        );
        return Some(format!(
            "{name}: there is no golden picture; look at tests/failures, then run tools/golden \
             update"
        ));
    };
    if golden.size() != seen.size() {
        return Some(format!("{name}: the golden picture has another size"));
    }
    let found = distance(&seen, &golden);
    println!(
        "{name}: flip mean {:.5}, p99 {:.5}, rel_rmse {:.5}",
        found.0.mean, found.0.p99, found.1
    );
    if is_close(&found) {
        return None;
    }
    let (mean, p99, most_rmse) = thresholds();
    let numbers = format!(
        "flip mean {:.5} (at most {mean}), p99 {:.5} ({p99}), rel_rmse {:.5} ({most_rmse})",
        found.0.mean, found.0.p99, found.1
    );
    write_failure(
        &format!("{folder}.{name}"),
        &seen,
        Some(&golden),
        exposure,
        &numbers,
    );
    Some(format!("{name}: {numbers}"))
}
