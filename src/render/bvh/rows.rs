//! Nodes and triangles as texels of an image.
//!
//! A shader's load of a texel brings four words at once. llvmpipe, which has no vector load for
//! words of a buffer, fetches texels several times as fast; other drivers fetch both well.

use std::sync::Arc;

use bytemuck::cast_slice;

use crate::graph::{Error, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Owner, vk};

/// Items of a row (`ROW_BITS` in `glsl/render/bvh/triangle.glsl`).
const ROW_ITEMS: usize = 1024;

/// 32-bit words of a texel.
const TEXEL_WORDS: usize = 4;

/// Items of some texels each, row by row.
pub(super) struct Rows {
    pub(super) image: Arc<Image>,
    row_words: usize,
    /// Row and words of those that change, where some do.
    first_changing: usize,
    changing: Vec<u32>,
}

impl Rows {
    /// An image of all `words`. The items from `first_changing` on may be replaced later.
    pub(super) fn new(
        gpu: &Gpu,
        name: &'static str,
        (words, item_texels): (&[u32], usize),
        first_changing: usize,
    ) -> Result<Self, Error> {
        let item_words = TEXEL_WORDS * item_texels;
        let items = words.len() / item_words;
        let row_words = items.clamp(1, ROW_ITEMS) * item_words;
        let row_count = items.div_ceil(ROW_ITEMS).max(1);
        let image = gpu.create_image(&ImageDesc {
            name: name.into(),
            extent: [(row_words / TEXEL_WORDS) as u32, row_count as u32, 1],
            kind: ImageKind::D2,
            format: vk::Format::R32G32B32A32_UINT,
            mips: 1,
            layers: 1,
            usage: ImageUsage::SAMPLED,
            owner: Owner::Store,
        })?;
        let mut whole = words.to_vec();
        whole.resize(row_count * row_words, 0);
        gpu.upload_image(&image, 0, 0, cast_slice(&whole))?;
        let first_changing = first_changing / ROW_ITEMS;
        let changing = if first_changing * ROW_ITEMS < items {
            whole.split_off(first_changing * row_words)
        } else {
            Vec::new()
        };
        Ok(Rows {
            image,
            row_words,
            first_changing,
            changing,
        })
    }

    /// The words from a word on, to be changed before [`Rows::upload`].
    pub(super) fn words_from(&mut self, first_word: usize) -> &mut [u32] {
        &mut self.changing[first_word - self.first_changing * self.row_words..]
    }

    /// Brings what has changed to the device.
    pub(super) fn upload(&self, gpu: &Gpu) -> Result<(), Error> {
        if self.changing.is_empty() {
            return Ok(());
        }
        gpu.upload_rows(
            &self.image,
            self.first_changing as u32,
            cast_slice(&self.changing),
        )
    }
}
