//! Textures on the CPU.

use glam::Vec4;

/// What the texels mean, and so how they are decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureKind {
    /// sRGB-encoded colour; decoded to linear before filtering.
    Color,
    /// Linear coverage in red; a surface is there where it is 0.5 or more.
    Mask,
    /// Linear tangent-space normal, (n + 1) / 2; n is a unit vector as far as 8 bits go.
    Normal,
}

/// An 8-bit RGBA picture, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// File it came from, or a generated name.
    pub name: String,
    /// Meaning of the texels.
    pub kind: TextureKind,
    /// Width \[texels\], at least 1.
    pub width: u32,
    /// Height \[texels\], at least 1.
    pub height: u32,
    /// `width × height` RGBA texels, 8 bits a channel.
    pub texels: Vec<[u8; 4]>,
}

impl Texture {
    /// The decoded texel at integer coordinates, repeated outside the picture; row 0 at the top.
    pub fn texel(&self, x: i64, y: i64) -> Vec4 {
        let column = x.rem_euclid(i64::from(self.width)) as usize;
        let row = y.rem_euclid(i64::from(self.height)) as usize;
        let [r, g, b, a] = self.texels[row * self.width as usize + column];
        match self.kind {
            TextureKind::Color => Vec4::new(
                linear_from_srgb(r),
                linear_from_srgb(g),
                linear_from_srgb(b),
                f32::from(a) / 255.0,
            ),
            TextureKind::Mask | TextureKind::Normal => {
                Vec4::new(f32::from(r), f32::from(g), f32::from(b), f32::from(a)) / 255.0
            }
        }
    }

    /// Bilinear sample with repeat addressing; (u, v) with v upwards, as in OBJ.
    pub fn sample(&self, u: f32, v: f32) -> Vec4 {
        let x = u * self.width as f32 - 0.5;
        let y = (1.0 - v) * self.height as f32 - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let (x0, y0) = (x0 as i64, y0 as i64);
        let top = self.texel(x0, y0).lerp(self.texel(x0 + 1, y0), fx);
        let bottom = self.texel(x0, y0 + 1).lerp(self.texel(x0 + 1, y0 + 1), fx);
        top.lerp(bottom, fy)
    }
}

/// The sRGB transfer function (IEC 61966-2-1), decoding 8 bits to linear.
pub(super) fn linear_from_srgb(encoded: u8) -> f32 {
    let value = f32::from(encoded) / 255.0;
    if value <= 0.04045 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}
