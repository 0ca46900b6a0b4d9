//! Blocks: squares of pixels on one plane and one material.

use glam::Vec3;

use crate::image::{GuideImage, Image};

/// Side of a block (px).
pub const BLOCK_PX: u32 = 8;

/// Normals of one plane differ by less than this (1 − cosine; 0.8°).
const NORMAL_TOLERANCE: f32 = 1e-4;

/// Points of one plane are off it by less than this share of their depth.
const PLANE_TOLERANCE: f32 = 1e-3;

/// A block of [`BLOCK_PX`]² pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// Left column (px).
    pub x_px: u32,
    /// Top row (px), from the top of the image.
    pub y_px: u32,
    /// Index of the material that it shows.
    pub material: u32,
}

impl Block {
    /// Row-major indices of its pixels in an image of that width (px).
    pub fn pixels(self, width: u32) -> impl Iterator<Item = usize> {
        (0..BLOCK_PX * BLOCK_PX)
            .map(move |i| ((self.y_px + i / BLOCK_PX) * width + self.x_px + i % BLOCK_PX) as usize)
    }

    /// The mean colour of its pixels.
    pub fn mean(self, image: &Image) -> Vec3 {
        self.pixels(image.width)
            .map(|index| image.pixels[index])
            .sum::<Vec3>()
            / (BLOCK_PX * BLOCK_PX) as f32
    }
}

/// The blocks of a picture, row by row: whole squares of the grid whose pixel centres all lie on
/// one plane and one material.
pub fn find_blocks(guide: &GuideImage) -> Vec<Block> {
    let (columns, rows) = (guide.width / BLOCK_PX, guide.height / BLOCK_PX);
    let block = |index: u32| {
        let (x_px, y_px) = (index % columns * BLOCK_PX, index / columns * BLOCK_PX);
        let material = guide.material[(y_px * guide.width + x_px) as usize];
        Block {
            x_px,
            y_px,
            material,
        }
    };
    (0..columns * rows)
        .map(block)
        .filter(|&block| is_flat(block, guide))
        .collect()
}

fn is_flat(block: Block, guide: &GuideImage) -> bool {
    let Some(first) = block
        .pixels(guide.width)
        .next()
        .filter(|&first| guide.is_surface(first))
    else {
        return false;
    };
    let (origin, normal) = (guide.position[first], guide.normal[first]);
    block.pixels(guide.width).all(|index| {
        guide.material[index] == block.material
            && guide.normal[index].dot(normal) > 1.0 - NORMAL_TOLERANCE
            && (guide.position[index] - origin).dot(normal).abs()
                <= PLANE_TOLERANCE * guide.depth_m[index]
    })
}
