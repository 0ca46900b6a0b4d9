//! Stability metrics over sequences of images of one size, on luminance. The ideal of each is 0.

use glam::Vec3;

use super::errors::ratio;
use super::{MetricError, check};
use crate::image::{GuideImage, Image, luminance};

/// Spread of an image over whole-scene translations by fractions of a voxel: per pixel (max − min)
/// / mean over the sequence, mean over pixels. Pixels that stay black count as 0.
pub fn translation_spread(images: &[Image]) -> Result<f64, MetricError> {
    mean_over_pixels(images, spread)
}

/// The same over rotations of scene, lights and camera about the vertical.
pub fn rotation_spread(images: &[Image]) -> Result<f64, MetricError> {
    mean_over_pixels(images, spread)
}

/// The same over repeated runs with the same input.
pub fn run_spread(images: &[Image]) -> Result<f64, MetricError> {
    mean_over_pixels(images, spread)
}

/// Flicker of consecutive frames of what should stand still: per pixel the mean |difference| of
/// neighbours in time / mean, mean over pixels.
pub fn flicker(frames: &[Image]) -> Result<f64, MetricError> {
    mean_over_pixels(frames, |values| {
        let changes: f64 = values
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).abs())
            .sum();
        ratio(changes / (values.len() - 1) as f64, mean(values))
    })
}

/// Flicker of consecutive frames of what moves, beyond the reference's own change: the mean over
/// frames and pixels of |ΔT − ΔR| over the mean of R, where Δ is the change from one frame to the
/// next. `reference` is the same sequence.
pub fn excess_flicker(frames: &[Image], reference: &[Image]) -> Result<f64, MetricError> {
    Ok(mean(&excess_changes(frames, reference)?))
}

/// The largest single-frame jump of such a sequence: the largest, over frames, of the mean over
/// pixels of |ΔT − ΔR| over the mean of R.
pub fn popping(frames: &[Image], reference: &[Image]) -> Result<f64, MetricError> {
    Ok(excess_changes(frames, reference)?
        .into_iter()
        .fold(0.0, f64::max))
}

/// How far a frame that has a history is from one that has none: the mean over pixels of |T − C|
/// over the mean of C, the same technique converged.
pub fn lag(frame: &Image, converged: &Image) -> Result<f64, MetricError> {
    check("the converged image", converged, converged.size())?;
    check("the image", frame, converged.size())?;
    if converged.pixels.is_empty() {
        return Err(MetricError::Empty("the images have no pixels"));
    }
    let (now, then) = (luminances(frame), luminances(converged));
    Ok(ratio(
        now.iter()
            .zip(&then)
            .map(|(now, then)| (now - then).abs())
            .sum::<f64>(),
        then.iter().sum(),
    ))
}

/// Share of a change that a frame shows: Σ (T − A)(B − A) / Σ (B − A)² over pixels, where A and B
/// are the same technique's converged pictures before and after the change. 0: none of it, 1: all.
/// Noise of T that does not go with the change does not move it.
pub fn shown_change(frame: &Image, [before, after]: [&Image; 2]) -> Result<f64, MetricError> {
    check("the picture before the change", before, before.size())?;
    check("the picture after the change", after, before.size())?;
    check("the image", frame, before.size())?;
    let [now, old, new] = [frame, before, after].map(luminances);
    let (mut shown, mut whole) = (0.0, 0.0);
    for ((now, old), new) in now.iter().zip(&old).zip(&new) {
        shown += (now - old) * (new - old);
        whole += (new - old).powi(2);
    }
    if whole == 0.0 {
        return Err(MetricError::Empty(
            "the pictures before and after the change are the same",
        ));
    }
    Ok(shown / whole)
}

/// The first of these frames from which on at least this share of the change is shown in each;
/// `None` where the last shows less.
pub fn shown_from(shown: &[f64], share: f64) -> Option<usize> {
    let late = shown.iter().rposition(|shown| *shown < share);
    let first = late.map_or(0, |late| late + 1);
    (first < shown.len()).then_some(first)
}

/// Means of squares of pixels of this side (px); what is left over at the right and below is left
/// out, unless the picture is smaller than a square.
pub fn squares(image: &Image, side_px: u32) -> Image {
    let side = side_px.min(image.width).min(image.height).max(1);
    let (columns, rows) = (image.width / side, image.height / side);
    Image::from_fn(columns, rows, |index| {
        let (column, row) = (index as u32 % columns, index as u32 / columns);
        let pixel = |i: u32| {
            image.pixels
                [((row * side + i / side) * image.width + column * side + i % side) as usize]
        };
        (0..side * side).map(pixel).sum::<Vec3>() / (side * side) as f32
    })
}

/// For each frame but the first: the mean over pixels of |ΔT − ΔR| over the mean of R.
fn excess_changes(frames: &[Image], reference: &[Image]) -> Result<Vec<f64>, MetricError> {
    let [first, _, ..] = reference else {
        return Err(MetricError::Empty("a sequence needs at least two images"));
    };
    if frames.len() != reference.len() {
        return Err(MetricError::Empty("the sequences differ in length"));
    }
    reference
        .iter()
        .try_for_each(|image| check("the reference", image, first.size()))?;
    frames
        .iter()
        .try_for_each(|image| check("an image of the sequence", image, first.size()))?;
    if first.pixels.is_empty() {
        return Err(MetricError::Empty("the images have no pixels"));
    }
    let mean_reference = mean(
        &reference
            .iter()
            .map(|image| mean(&luminances(image)))
            .collect::<Vec<_>>(),
    );
    let errors: Vec<Vec<f64>> = frames
        .iter()
        .zip(reference)
        .map(|(frame, truth)| {
            luminances(frame)
                .iter()
                .zip(luminances(truth))
                .map(|(t, r)| t - r)
                .collect()
        })
        .collect();
    let change = |pair: &[Vec<f64>]| {
        mean(
            &pair[0]
                .iter()
                .zip(&pair[1])
                .map(|(before, after)| (after - before).abs())
                .collect::<Vec<_>>(),
        )
    };
    Ok(errors
        .windows(2)
        .map(|pair| ratio(change(pair), mean_reference))
        .collect())
}

fn luminances(image: &Image) -> Vec<f64> {
    image
        .pixels
        .iter()
        .map(|&pixel| f64::from(luminance(pixel)))
        .collect()
}

/// Light where there should be none: the mean of T over pixels where the reference is dark (at most
/// 0.1% of the reference's mean over the lit region), divided by the reference's mean over the lit
/// region, which is the rest. Only pixels that see a surface count, where a guide says which do.
pub fn leak(
    technique: &Image,
    reference: &Image,
    guide: Option<&GuideImage>,
) -> Result<f64, MetricError> {
    const DARK_SHARE: f64 = 1e-3;
    check("the reference", reference, reference.size())?;
    check("the image", technique, reference.size())?;
    let pairs: Vec<(f64, f64)> = (0..reference.pixels.len())
        .filter(|&i| {
            guide.is_none_or(|guide| {
                guide.material.len() == reference.pixels.len() && guide.is_surface(i)
            })
        })
        .map(|i| {
            (
                f64::from(luminance(technique.pixels[i])),
                f64::from(luminance(reference.pixels[i])),
            )
        })
        .collect();
    let lit: Vec<f64> = pairs.iter().map(|&(_, r)| r).filter(|&r| r > 0.0).collect();
    if lit.is_empty() {
        return Err(MetricError::Empty("the reference is black"));
    }
    let threshold = DARK_SHARE * mean(&lit);
    let lit: Vec<f64> = lit.into_iter().filter(|&r| r > threshold).collect();
    let dark: Vec<f64> = pairs
        .iter()
        .filter(|&&(_, r)| r <= threshold)
        .map(|&(t, _)| t)
        .collect();
    if dark.is_empty() {
        return Err(MetricError::Empty("the reference is dark nowhere"));
    }
    Ok(ratio(mean(&dark), mean(&lit)))
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn spread(values: &[f64]) -> f64 {
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| {
            (low.min(value), high.max(value))
        });
    ratio(high - low, mean(values))
}

/// Mean over the pixels of `f` of a pixel's luminance over the sequence, which has at least two
/// images.
fn mean_over_pixels(images: &[Image], f: impl Fn(&[f64]) -> f64) -> Result<f64, MetricError> {
    let [first, _, ..] = images else {
        return Err(MetricError::Empty("a sequence needs at least two images"));
    };
    images
        .iter()
        .try_for_each(|image| check("an image of the sequence", image, first.size()))?;
    if first.pixels.is_empty() {
        return Err(MetricError::Empty("the images have no pixels"));
    }
    let per_pixel = |i: usize| {
        f(&images
            .iter()
            .map(|image| f64::from(luminance(image.pixels[i])))
            .collect::<Vec<_>>())
    };
    Ok((0..first.pixels.len()).map(per_pixel).sum::<f64>() / first.pixels.len() as f64)
}
