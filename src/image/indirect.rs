//! The answer of a technique, or of the reference, read back.

use super::Image;

/// The indirect light at each pixel, row 0 at the top: what techniques answer and the reference
/// answers too, so that an error is a difference of two of these. Both images are of one size.
#[derive(Clone, Debug, PartialEq)]
pub struct IndirectImage {
    /// Indirect diffuse irradiance E_i, from surfaces (what they emit included) and the
    /// environment [W/m²]; 0 where no surface is seen.
    pub irradiance: Image,
    /// Indirect specular radiance L_s [W/(m² sr)]; 0 where no surface with a lobe is seen.
    pub specular: Image,
    /// Ambient visibility, `width × height` numbers: the cosine-weighted share of the hemisphere
    /// about the shading normal that meets no surface. Where none is seen, the reference has 1 and
    /// techniques have 0.
    pub visibility: Vec<f32>,
}

impl IndirectImage {
    /// No light, and nothing open.
    pub fn new(width: u32, height: u32) -> Self {
        let black = Image::new(width, height);
        IndirectImage {
            visibility: vec![0.0; black.pixels.len()],
            irradiance: black.clone(),
            specular: black,
        }
    }
}
