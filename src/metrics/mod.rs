//! Error and stability metrics: how far a technique T is from the reference R.
//!
//! Both are linear images of one size. Metrics are taken over the pixels that see a surface, on
//! luminance unless another [`Channel`] is named, per pixel and per *block*: means of 8×8 pixels
//! that lie on one plane and one material, which neither noise nor silhouettes disturb. ε is 1% of
//! mean R throughout. Where R is black everywhere and T is not, relative metrics are infinite;
//! where both are, they are 0.
//!
//! - [`Errors`]: `rel_rmse`, `bias`, `rel_mse`, `p95`
//! - [`flip`]: ꟻLIP of the tone-mapped pair (feature `flip`)
//! - [`stability`]: `translation_spread`, `rotation_spread`, `flicker`, `excess_flicker`,
//!   `popping`, `lag`, `shown_change`, `leak`, `run_spread`

mod blocks;
mod compare;
mod errors;
#[cfg(feature = "flip")]
mod flip;
pub mod stability;

pub use blocks::{BLOCK_PX, Block, find_blocks};
pub use compare::{Comparison, MaterialErrors, compare, error_image};
pub use errors::{Errors, errors_of_values};
#[cfg(feature = "flip")]
pub use flip::{Flip, exposure_of, flip};

use glam::Vec3;

use crate::image::{Image, luminance};

/// Which values of a colour are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Channel {
    /// Rec. 709 luminance.
    #[default]
    Luminance,
    /// Red, green and blue as three values each.
    Rgb,
}

impl Channel {
    /// Appends the values of one colour.
    fn extend(self, values: &mut Vec<f32>, color: Vec3) {
        match self {
            Channel::Luminance => values.push(luminance(color)),
            Channel::Rgb => values.extend(color.to_array()),
        }
    }
}

/// Why two images cannot be compared.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum MetricError {
    /// Their sizes differ.
    #[error(
        "the images differ in size: {what} is {found_width}x{found_height}, the reference \
         {width}x{height}"
    )]
    Size {
        /// Which image is wrong.
        what: &'static str,
        /// Its width (px).
        found_width: u32,
        /// Its height (px).
        found_height: u32,
        /// The reference's width (px).
        width: u32,
        /// The reference's height (px).
        height: u32,
    },
    /// A pixel is not a number or not finite.
    #[error("{what} is not finite at pixel ({x}, {y})")]
    NotFinite {
        /// The image that the pixel is of, in words.
        what: &'static str,
        /// Column (px), 0 at the left.
        x: u32,
        /// Row (px), 0 at the top.
        y: u32,
    },
    /// There is nothing to compare.
    #[error("there is nothing to compare: {0}")]
    Empty(&'static str),
}

/// Checks that an image has the size of the reference and finite pixels.
fn check(
    what: &'static str,
    image: &Image,
    (width, height): (u32, u32),
) -> Result<(), MetricError> {
    if image.size() != (width, height) {
        return Err(MetricError::Size {
            what,
            found_width: image.width,
            found_height: image.height,
            width,
            height,
        });
    }
    match image.pixels.iter().position(|pixel| !pixel.is_finite()) {
        Some(index) => Err(MetricError::NotFinite {
            what,
            x: index as u32 % width,
            y: index as u32 / width,
        }),
        None => Ok(()),
    }
}
