//! What the light of cells is kept in.

use std::sync::Arc;

use glam::UVec3;

use super::sweep::volume;
use crate::graph::{Error, Gpu, Image, ImageUsage, vk};

/// Coefficients of bands 0 and 1.
const LOW_COEFFICIENTS: u32 = 4;
/// Coefficients of band 2.
const BAND2_COEFFICIENTS: u32 = 5;

/// The light of the cells of grids of one size, each with its slab along z: coefficients of
/// spherical harmonics, four half floats each (`gi/lpv/light.glsl`).
pub struct Light {
    /// Bands 0 and 1: 2×2 blocks of cells across x and y.
    pub low: Arc<Image>,
    /// Band 2: five blocks across x. `None` of light in two bands.
    pub band2: Option<Arc<Image>>,
}

impl Light {
    /// Allocates.
    pub fn new(gpu: &Gpu, size: UVec3, grids: u32, has_band2: bool) -> Result<Self, Error> {
        let blocks = |name, blocks: [u32; 2]| {
            volume(
                gpu,
                (name, vk::Format::R16G16B16A16_SFLOAT),
                [blocks[0] * size.x, blocks[1] * size.y, grids * size.z],
                ImageUsage::STORAGE | ImageUsage::SAMPLED,
            )
        };
        let band2 = || blocks("lpv.light_band2", [BAND2_COEFFICIENTS, 1]);
        Ok(Light {
            low: blocks("lpv.light", [2, 2])?,
            band2: has_band2.then(band2).transpose()?,
        })
    }

    /// What passes take as band 2: of light in two bands another image, which they do not read.
    pub fn bound_band2(&self) -> &Arc<Image> {
        self.band2.as_ref().unwrap_or(&self.low)
    }

    /// How many coefficients a cell has.
    pub fn coefficients(&self) -> u32 {
        LOW_COEFFICIENTS + self.band2.as_ref().map_or(0, |_| BAND2_COEFFICIENTS)
    }

    /// Where a coefficient of the first cell of a slab is.
    pub fn place(&self, coefficient: u32, (size, slab): (UVec3, u32)) -> (&Arc<Image>, UVec3) {
        let (image, block) = match coefficient.checked_sub(LOW_COEFFICIENTS) {
            None => (&self.low, [coefficient % 2, coefficient / 2]),
            Some(beyond) => (self.bound_band2(), [beyond, 0]),
        };
        (image, UVec3::new(block[0], block[1], slab) * size)
    }
}
