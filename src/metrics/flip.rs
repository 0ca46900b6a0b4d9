//! ꟻLIP: the difference that a viewer would notice when flipping between two pictures
//! (P. Andersson et al., *ꟻLIP: A Difference Evaluator for Alternating Images*, HPG 2020), by
//! NVIDIA's implementation.

use serde::{Deserialize, Serialize};

use super::{MetricError, check};
use crate::image::{Image, luminance, srgb_from_linear};

/// ꟻLIP of a pair, 0 (alike) to 1, at NVIDIA's default of 67 pixels per degree.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Flip {
    /// Mean over the pixels.
    pub mean: f32,
    /// 99th percentile (nearest rank) over the pixels.
    pub p99: f32,
    /// The factor that both images were multiplied by.
    pub exposure: f32,
}

/// The exposure that brings the mean luminance of an image to 0.18 (a photographer's middle grey);
/// 1 for a black image.
pub fn exposure_of(reference: &Image) -> f32 {
    let sum: f64 = reference
        .pixels
        .iter()
        .map(|&pixel| f64::from(luminance(pixel)))
        .sum();
    let mean = sum / reference.pixels.len().max(1) as f64;
    if mean > 0.0 {
        (0.18 / mean) as f32
    } else {
        1.0
    }
}

/// ꟻLIP of two linear images, tone-mapped alike: multiplied by `exposure`, clamped to 0…1,
/// sRGB-encoded with 8 bits. `exposure` is [`exposure_of`] the reference, unless something else is
/// wanted.
pub fn flip(technique: &Image, reference: &Image, exposure: f32) -> Result<Flip, MetricError> {
    let (width, height) = reference.size();
    check("the reference", reference, (width, height))?;
    check("the image", technique, (width, height))?;
    if reference.pixels.is_empty() {
        return Err(MetricError::Empty("the image has no pixels"));
    }
    let encode = |image: &Image| {
        let bytes: Vec<u8> = image
            .pixels
            .iter()
            .flat_map(|&pixel| (pixel * exposure).to_array().map(srgb_from_linear))
            .collect();
        nv_flip::FlipImageRgb8::with_data(width, height, &bytes)
    };
    let mut map = nv_flip::flip(
        encode(reference),
        encode(technique),
        nv_flip::DEFAULT_PIXELS_PER_DEGREE,
    )
    .to_vec();
    let mean = map.iter().map(|&value| f64::from(value)).sum::<f64>() / map.len() as f64;
    map.sort_by(f32::total_cmp);
    let rank = ((0.99 * map.len() as f64).ceil() as usize).clamp(1, map.len());
    Ok(Flip {
        mean: mean as f32,
        p99: map[rank - 1],
        exposure,
    })
}
