//! Linear float images: what the reference and the techniques produce and the metrics compare.
//!
//! Pixels are linear RGB with Rec. 709 primaries, in the units of what they show (radiance [W/(m²
//! sr)], irradiance [W/m²], …). They are kept as OpenEXR ([`read_exr`], [`write_exr`]) and looked
//! at as PNG ([`write_png`], [`write_heatmap`]).

mod aov;
mod error;
mod exr;
mod guide;
mod indirect;
mod png;

pub use self::aov::{Aov, UnknownAov};
pub use self::error::ImageError;
pub use self::exr::{Planes, read_aov, read_exr, read_planes, write_exr, write_planes};
pub use self::guide::{GuideImage, NO_SURFACE};
pub use self::indirect::IndirectImage;
pub use self::png::{
    exposure_to_see, heat_color, srgb_from_linear, write_bins, write_heatmap, write_png,
};

use glam::Vec3;

/// A linear RGB image, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width of the image (px).
    pub width: u32,
    /// Height of the image (px).
    pub height: u32,
    /// `width × height` pixels.
    pub pixels: Vec<Vec3>,
}

impl Image {
    /// A black image of this size (px).
    pub fn new(width: u32, height: u32) -> Self {
        Image {
            width,
            height,
            pixels: vec![Vec3::ZERO; width as usize * height as usize],
        }
    }

    /// The image whose pixel at row-major index i is `f(i)`.
    pub fn from_fn(width: u32, height: u32, f: impl FnMut(usize) -> Vec3) -> Self {
        Image {
            width,
            height,
            pixels: (0..width as usize * height as usize).map(f).collect(),
        }
    }

    /// The grey image of these `width × height` values.
    pub fn from_grey(width: u32, height: u32, values: &[f32]) -> Self {
        Image::from_fn(width, height, |i| Vec3::splat(values[i]))
    }

    /// Width and height (px).
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }
}

/// Luminance of a linear Rec. 709 colour (ITU-R BT.709-6, item 3.2), in the colour's own unit.
pub fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}
