//! Textures that are made of two pictures: those of specular lobes, with F0 as their colour and the
//! roughness as their alpha, and what metal leaves of a base colour.

use glam::{Vec3, Vec4};

use super::{Texture, TextureKind};
use crate::image::srgb_from_linear;

/// How two pictures become a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Recipe {
    /// Colour of the first, red of the second as alpha: F0 and roughness (`map_Ks` and `map_Pr`),
    /// or a colour and its mask.
    ColorAndAlpha,
    /// Colour of the first as F0; roughness is 1 less its alpha times this (glTF's specular-glossy
    /// materials).
    SpecularGlossy(f32),
    /// The first is the base colour; of the second, green is roughness and blue metalness (glTF's
    /// metal-rough materials).
    MetalRough(MetalRough),
    /// Of the same two, what is diffuse of the base colour, without its factor.
    Diffuse(MetalRough),
}

/// The factors of a metal-rough material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MetalRough {
    /// Factor of the base colour.
    pub(super) base: Vec3,
    /// F0 of what is no metal.
    pub(super) f0: Vec3,
    /// Factor of metalness.
    pub(super) metalness: f32,
    /// Factor of roughness.
    pub(super) roughness: f32,
}

impl Recipe {
    /// The colour (linear) and the alpha of a texel: `first` is decoded from sRGB, `second` is as
    /// it is stored.
    fn texel(self, first: Vec4, second: Vec4) -> (Vec3, f32) {
        let color = first.truncate();
        match self {
            Recipe::ColorAndAlpha => (color, second.x),
            Recipe::SpecularGlossy(glossiness) => (color, 1.0 - glossiness * first.w),
            Recipe::MetalRough(factors) => (
                (factors.f0).lerp(factors.base * color, factors.metalness * second.z),
                factors.roughness * second.y,
            ),
            Recipe::Diffuse(factors) => (color * (1.0 - factors.metalness * second.z), 1.0),
        }
    }

    /// Makes the texture. It has the larger width and the larger height of the two pictures; one
    /// that is not there is white.
    pub(super) fn make(self, name: &str, pictures: [Option<Picture>; 2]) -> Texture {
        let kinds = [TextureKind::Color, TextureKind::Mask];
        let [first, second] = std::array::from_fn(|index| {
            let white = || (1, 1, vec![[255; 4]]);
            let (width, height, texels) = pictures[index].clone().unwrap_or_else(white);
            Texture {
                name: String::new(),
                kind: kinds[index],
                width,
                height,
                texels,
            }
        });
        let width = first.width.max(second.width);
        let height = first.height.max(second.height);
        let at = |texture: &Texture, x: u32, y: u32| {
            if [texture.width, texture.height] == [width, height] {
                return texture.texel(x.into(), y.into());
            }
            let u = (x as f32 + 0.5) / width as f32;
            texture.sample(u, 1.0 - (y as f32 + 0.5) / height as f32)
        };
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let texels = texels.map(|(x, y)| {
            let (color, alpha) = self.texel(at(&first, x, y), at(&second, x, y));
            let [r, g, b] = color.to_array().map(srgb_from_linear);
            [r, g, b, (alpha * 255.0).round() as u8]
        });
        Texture {
            name: name.to_owned(),
            kind: TextureKind::Color,
            width,
            height,
            texels: texels.collect(),
        }
    }
}

/// Width, height and texels.
pub(super) type Picture = (u32, u32, Vec<[u8; 4]>);

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes that go through unchanged come out as they were.
    #[test]
    fn colors_and_roughness_are_kept_to_the_bit() {
        let first: Vec<[u8; 4]> = (0..=255u8).map(|v| [v, 255 - v, v ^ 85, 255]).collect();
        let second: Vec<[u8; 4]> = (0..=255u8).map(|v| [v, 0, 0, 255]).collect();
        let pictures = [Some((16, 16, first.clone())), Some((16, 16, second))];
        let made = Recipe::ColorAndAlpha.make("lobe", pictures);
        for (index, (texel, first)) in made.texels.iter().zip(&first).enumerate() {
            assert_eq!(texel[..3], first[..3]);
            assert_eq!(usize::from(texel[3]), index);
        }
    }

    #[test]
    fn metal_has_no_diffuse_color_and_mirrors_its_base() {
        let factors = MetalRough {
            base: Vec3::new(1.0, 0.5, 0.25),
            f0: Vec3::splat(0.04),
            metalness: 1.0,
            roughness: 0.5,
        };
        let pictures = || [None, Some((2, 1, vec![[0, 255, 255, 0], [0, 102, 0, 0]]))];
        let lobe = Recipe::MetalRough(factors).make("lobe", pictures());
        let expected = |color: Vec3, roughness: f32| {
            let [r, g, b] = color.to_array().map(srgb_from_linear);
            [r, g, b, (255.0 * roughness).round() as u8]
        };
        assert_eq!(lobe.texels[0], expected(factors.base, 0.5));
        assert_eq!(lobe.texels[1], expected(factors.f0, 0.2));
        let diffuse = Recipe::Diffuse(factors).make("diffuse", pictures());
        assert_eq!(diffuse.texels, [[0, 0, 0, 255], [255; 4]]);
    }

    /// The smaller picture is stretched over the larger one.
    #[test]
    fn pictures_of_two_sizes_fit() {
        let first = Some((1, 1, vec![[255, 255, 255, 128]]));
        let second = Some((4, 2, vec![[64, 0, 0, 0]; 8]));
        let made = Recipe::ColorAndAlpha.make("lobe", [first, second]);
        assert_eq!((made.width, made.height), (4, 2));
        assert_eq!(made.texels, [[255, 255, 255, 64]; 8]);
    }
}
