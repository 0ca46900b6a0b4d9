//! The whole comparison of a technique's image with the reference: per pixel, per block, per
//! material.

use serde::Serialize;

use super::blocks::{Block, find_blocks};
use super::errors::{Errors, errors_of_values};
use super::{Channel, MetricError, check};
use crate::image::{GuideImage, Image};

/// Errors of an image against its reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// What was compared.
    pub channel: Channel,
    /// Over all pixels that see a surface.
    pub pixel: Errors,
    /// Over block means; `None` without a guide or where no block is flat.
    pub block: Option<Errors>,
    /// The same by material, most pixels first; empty without a guide.
    pub materials: Vec<MaterialErrors>,
}

/// Errors on the surfaces of one material.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialErrors {
    /// Index of the material in the scene.
    pub material: u32,
    /// Over its pixels.
    pub pixel: Errors,
    /// Over its blocks, where it has any.
    pub block: Option<Errors>,
}

/// Compares `technique` with `reference`. With a guide, pixels that see no surface are left out,
/// and errors are also taken over blocks and by material.
pub fn compare(
    technique: &Image,
    reference: &Image,
    guide: Option<&GuideImage>,
    channel: Channel,
) -> Result<Comparison, MetricError> {
    let size = reference.size();
    check("the reference", reference, size)?;
    check("the image", technique, size)?;
    let Some(guide) = guide else {
        let all: Vec<usize> = (0..reference.pixels.len()).collect();
        let pixel = pixel_errors(technique, reference, &all, channel)
            .ok_or(MetricError::Empty("the image has no pixels"))?;
        return Ok(Comparison {
            channel,
            pixel,
            block: None,
            materials: Vec::new(),
        });
    };
    if (guide.width, guide.height) != size {
        let (width, height) = size;
        return Err(MetricError::Size {
            what: "the guide",
            found_width: guide.width,
            found_height: guide.height,
            width,
            height,
        });
    }
    let surfaces: Vec<usize> = (0..reference.pixels.len())
        .filter(|&index| guide.is_surface(index))
        .collect();
    let pixel = pixel_errors(technique, reference, &surfaces, channel)
        .ok_or(MetricError::Empty("no pixel sees a surface"))?;
    let blocks = find_blocks(guide);
    let block = block_errors(technique, reference, &blocks, channel);
    let materials = material_errors(technique, reference, guide, &blocks, channel);
    Ok(Comparison {
        channel,
        pixel,
        block,
        materials,
    })
}

/// |T − R| per channel, for a heat map.
pub fn error_image(technique: &Image, reference: &Image) -> Result<Image, MetricError> {
    check("the image", technique, reference.size())?;
    Ok(Image::from_fn(reference.width, reference.height, |i| {
        (technique.pixels[i] - reference.pixels[i]).abs()
    }))
}

fn pixel_errors(
    technique: &Image,
    reference: &Image,
    indices: &[usize],
    channel: Channel,
) -> Option<Errors> {
    let values = |image: &Image| {
        let mut values = Vec::with_capacity(indices.len() * 3);
        indices
            .iter()
            .for_each(|&index| channel.extend(&mut values, image.pixels[index]));
        values
    };
    errors_of_values(&values(technique), &values(reference))
}

fn block_errors(
    technique: &Image,
    reference: &Image,
    blocks: &[Block],
    channel: Channel,
) -> Option<Errors> {
    let values = |image: &Image| {
        let mut values = Vec::with_capacity(blocks.len() * 3);
        blocks
            .iter()
            .for_each(|block| channel.extend(&mut values, block.mean(image)));
        values
    };
    errors_of_values(&values(technique), &values(reference))
}

fn material_errors(
    technique: &Image,
    reference: &Image,
    guide: &GuideImage,
    blocks: &[Block],
    channel: Channel,
) -> Vec<MaterialErrors> {
    let mut pixels: std::collections::BTreeMap<u32, Vec<usize>> = std::collections::BTreeMap::new();
    for index in (0..reference.pixels.len()).filter(|&index| guide.is_surface(index)) {
        pixels.entry(guide.material[index]).or_default().push(index);
    }
    let mut materials: Vec<MaterialErrors> = pixels
        .iter()
        .filter_map(|(&material, indices)| {
            let own: Vec<Block> = blocks
                .iter()
                .copied()
                .filter(|block| block.material == material)
                .collect();
            let pixel = pixel_errors(technique, reference, indices, channel)?;
            Some(MaterialErrors {
                material,
                pixel,
                block: block_errors(technique, reference, &own, channel),
            })
        })
        .collect();
    materials.sort_by_key(|errors| std::cmp::Reverse(errors.pixel.count));
    materials
}
