//! PNG for looking at: exposure, plain clamp, sRGB; and heat maps of errors.

use std::path::Path;

use glam::Vec3;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};

use super::{Image, ImageError, luminance};
use crate::output::write_file;

/// What [`exposure_to_see`] makes of the median luminance; 0.63 as sRGB.
const EXPOSED_MEDIAN: f32 = 0.35;

/// Writes an image as 8-bit sRGB PNG: multiplied by `exposure`, clamped to 0…1, and encoded by the
/// sRGB transfer function. Nothing else is done to it, so that equal pictures mean equal light and
/// a clipped highlight shows as white.
pub fn write_png(path: &Path, image: &Image, exposure: f32) -> Result<(), ImageError> {
    save(
        path,
        image.width,
        image.height,
        image.pixels.iter().map(|&pixel| pixel * exposure),
    )
}

/// The exposure at which a picture of linear light can be judged: its median luminance becomes a
/// light grey, unless more than a twentieth of it would be clipped. 1 where nothing is lit. Pixels
/// that show the `background` [W/(m² sr)] alone do not count.
pub fn exposure_to_see(image: &Image, background: Vec3) -> f32 {
    let is_background =
        |pixel: Vec3| pixel.abs_diff_eq(background, 1e-3 * background.max_element());
    let shown = image.pixels.iter().filter(|pixel| !is_background(**pixel));
    let bright = shown.map(|&pixel| luminance(pixel));
    let mut lit: Vec<f32> = bright
        .filter(|value| value.is_finite() && *value > 0.0)
        .collect();
    if lit.is_empty() {
        return 1.0;
    }
    lit.sort_unstable_by(f32::total_cmp);
    let at = |share: f32| lit[(share * (lit.len() - 1) as f32) as usize];
    let exposure = (EXPOSED_MEDIAN / at(0.5)).min(1.0 / at(0.95));
    exposure.clamp(f32::MIN_POSITIVE, f32::MAX)
}

/// Writes the luminance of an image as a heat map PNG: 0 is black, `scale` and above is the
/// brightest colour of [`heat_color`].
pub fn write_heatmap(path: &Path, error: &Image, scale: f32) -> Result<(), ImageError> {
    let bytes = error
        .pixels
        .iter()
        .flat_map(|&pixel| heat_color(luminance(pixel) / scale))
        .collect();
    save_bytes(path, error.width, error.height, bytes)
}

/// Writes the sum of an image's channels, times `exposure`, as a PNG of three bins: red up to 0.1
/// (black for 0), green up to 0.2, blue above and where it is no number (Hong 2015, figure 71).
/// Returns the share of the pixels in each bin.
pub fn write_bins(path: &Path, error: &Image, exposure: f32) -> Result<[f64; 3], ImageError> {
    let sums = error
        .pixels
        .iter()
        .map(|pixel| pixel.element_sum() * exposure);
    let mut counts = [0.0; 3];
    let color = |sum: f32| {
        let (bin, color) = if sum <= 0.1 {
            (0, [(55.0 + 2000.0 * sum) as u8, 0, 0])
        } else if sum <= 0.2 {
            (1, [0, 255, 0])
        } else {
            (2, [0, 0, 255])
        };
        counts[bin] += 1.0;
        if sum == 0.0 { [0; 3] } else { color }
    };
    let bytes = sums.flat_map(color).collect();
    save_bytes(path, error.width, error.height, bytes)?;
    Ok(counts.map(|count| count / (error.pixels.len() as f64).max(1.0)))
}

/// Encodes linear light 0…1 as an 8-bit sRGB value (IEC 61966-2-1), clamping what is outside; NaN
/// is 0.
pub fn srgb_from_linear(linear: f32) -> u8 {
    let value = linear.clamp(0.0, 1.0);
    let encoded = if value <= 0.003_130_8 {
        12.92 * value
    } else {
        1.055 * value.powf(1.0 / 2.4) - 0.055
    };
    (encoded * 255.0 + 0.5) as u8
}

/// The sRGB colour of a value 0…1 in the perceptually uniform map *inferno* (N. Smith and S. van
/// der Walt, 2015), by the sixth-degree polynomial fit of M. Zucker (2019, public domain); outside
/// values are clamped, NaN is black.
pub fn heat_color(value: f32) -> [u8; 3] {
    const COEFFICIENTS: [Vec3; 7] = [
        Vec3::new(0.0002, 0.0017, -0.0195),
        Vec3::new(0.1065, 0.5640, 3.9327),
        Vec3::new(11.6025, -3.9729, -15.9424),
        Vec3::new(-41.7040, 17.4364, 44.3541),
        Vec3::new(77.1629, -33.4024, -81.8073),
        Vec3::new(-71.3194, 32.6261, 73.2095),
        Vec3::new(25.1311, -12.2427, -23.0703),
    ];
    let t = if value.is_nan() {
        0.0
    } else {
        value.clamp(0.0, 1.0)
    };
    let color = COEFFICIENTS
        .iter()
        .rev()
        .fold(Vec3::ZERO, |sum, &coefficient| sum * t + coefficient);
    color
        .to_array()
        .map(|channel| (channel.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
}

fn save(
    path: &Path,
    width: u32,
    height: u32,
    pixels: impl Iterator<Item = Vec3>,
) -> Result<(), ImageError> {
    save_bytes(
        path,
        width,
        height,
        pixels
            .flat_map(|pixel| pixel.to_array().map(srgb_from_linear))
            .collect(),
    )
}

fn save_bytes(path: &Path, width: u32, height: u32, bytes: Vec<u8>) -> Result<(), ImageError> {
    write_file(path, |file| {
        PngEncoder::new(file).write_image(&bytes, width, height, ExtendedColorType::Rgb8)
    })
    .map_err(|error| match error {
        image::ImageError::IoError(source) => ImageError::write(path, source),
        other => ImageError::write(path, other),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_are_counted_and_coloured() -> Result<(), Box<dyn std::error::Error>> {
        let sums = [0.0, 0.05, 0.1, 0.15, 0.5, f32::NAN];
        let error = Image::from_fn(6, 1, |at| Vec3::new(0.25 * sums[at], 0.25 * sums[at], 0.0));
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("bins.png");
        let shares = write_bins(&path, &error, 2.0)?;
        assert_eq!(shares, [3.0, 1.0, 2.0].map(|count: f64| count / 6.0));
        let read = ::image::open(&path)?.to_rgb8();
        let colors: Vec<[u8; 3]> = read.pixels().map(|pixel| pixel.0).collect();
        let (green, blue) = ([0, 255, 0], [0, 0, 255]);
        assert_eq!(colors[0], [0; 3]);
        assert!(colors[1][0] > 100 && colors[2][0] > colors[1][0]);
        assert_eq!(colors[3..], [green, blue, blue]);
        Ok(())
    }
}
