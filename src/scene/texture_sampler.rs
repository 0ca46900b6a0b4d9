//! Bilinear texture lookups with the decoding tabulated: [`Texture::sample`] to the bit, without
//! its `powf`.

use glam::Vec4;

use super::{Texture, TextureKind};

/// Decodes and filters textures.
pub(crate) struct TextureSampler {
    /// Linear value of each 8-bit sRGB value.
    srgb: [f32; 256],
    /// Linear value of each 8-bit linear value.
    linear: [f32; 256],
}

impl TextureSampler {
    pub(crate) fn new() -> Self {
        let decode = |kind| {
            std::array::from_fn(|value| {
                let texel = [value as u8; 4];
                Texture {
                    name: String::new(),
                    kind,
                    width: 1,
                    height: 1,
                    texels: vec![texel],
                }
                .texel(0, 0)
                .x
            })
        };
        TextureSampler {
            srgb: decode(TextureKind::Color),
            linear: decode(TextureKind::Mask),
        }
    }

    /// Bilinear sample with repeat addressing; (u, v) with v upwards.
    pub(crate) fn sample(&self, texture: &Texture, [u, v]: [f32; 2]) -> Vec4 {
        let x = u * texture.width as f32 - 0.5;
        let y = (1.0 - v) * texture.height as f32 - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let (left, right) = repeat(x0, texture.width);
        let (top, bottom) = repeat(y0, texture.height);
        let texel = |column: usize, row: usize| {
            self.decode(
                texture.kind,
                texture.texels[row * texture.width as usize + column],
            )
        };
        let upper = texel(left, top).lerp(texel(right, top), fx);
        let lower = texel(left, bottom).lerp(texel(right, bottom), fx);
        upper.lerp(lower, fy)
    }

    /// The mean of all texels, decoded.
    pub(crate) fn mean(&self, texture: &Texture) -> Vec4 {
        let sum = texture
            .texels
            .iter()
            .fold(glam::DVec4::ZERO, |sum, &texel| {
                sum + self.decode(texture.kind, texel).as_dvec4()
            });
        (sum / texture.texels.len().max(1) as f64).as_vec4()
    }

    fn decode(&self, kind: TextureKind, [r, g, b, a]: [u8; 4]) -> Vec4 {
        let table = match kind {
            TextureKind::Color => &self.srgb,
            TextureKind::Mask | TextureKind::Normal => &self.linear,
        };
        Vec4::new(
            table[usize::from(r)],
            table[usize::from(g)],
            table[usize::from(b)],
            self.linear[usize::from(a)],
        )
    }
}

/// The texel at `position` and the one after it, wrapped into 0…`size` − 1.
fn repeat(position: f32, size: u32) -> (usize, usize) {
    let first = (position as i64).rem_euclid(i64::from(size)) as usize;
    let second = if first + 1 == size as usize {
        0
    } else {
        first + 1
    };
    (first, second)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equals_the_scene_s_own_sampling() {
        let texels = (0..15u8)
            .map(|i| [i * 17, 255 - i * 16, i * 3, 200 + i])
            .collect();
        let mut texture = Texture {
            name: String::from("test"),
            kind: TextureKind::Color,
            width: 5,
            height: 3,
            texels,
        };
        let sampler = TextureSampler::new();
        for kind in [TextureKind::Color, TextureKind::Mask, TextureKind::Normal] {
            texture.kind = kind;
            for step in -40..40 {
                let (u, v) = (step as f32 * 0.137, step as f32 * -0.311);
                assert_eq!(
                    sampler.sample(&texture, [u, v]),
                    texture.sample(u, v),
                    "{kind:?} at {u}, {v}"
                );
            }
        }
    }
}
