//! Picture files to [`Texture`]s.

use std::io::Cursor;
use std::path::Path;

use glam::Vec3;
use image::{ImageFormat, ImageReader, Limits};

use super::texture::linear_from_srgb;
use super::{SceneError, Texture, TextureKind};
use crate::image::srgb_from_linear;

/// Largest width and height of a texture \[texels\].
const SIZE_MAX: u32 = 16_384;

/// Memory that decoding one picture may take (bytes).
const DECODE_BYTES_MAX: u64 = 4 << 30;

/// Height of a full-scale bump map with `-bm 1` \[texels\].
const BUMP_HEIGHT_TEXELS: f32 = 4.0;

/// What a material uses a picture for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Use {
    /// An sRGB colour.
    Color,
    /// Coverage: alpha where the picture has an alpha channel that varies, red otherwise.
    Mask,
    /// Coverage: alpha.
    Alpha,
    /// Tangent-space normals; the factor is that of x and y.
    Normal(f32),
    /// Heights, to become normals; the factor is `-bm`.
    Bump(f32),
}

impl Use {
    /// The kind of texture that this use makes.
    pub(super) fn kind(self) -> TextureKind {
        match self {
            Use::Color => TextureKind::Color,
            Use::Mask | Use::Alpha => TextureKind::Mask,
            Use::Normal(_) | Use::Bump(_) => TextureKind::Normal,
        }
    }

    /// One texel that stands for a missing picture: mid-grey (linear 0.5), full coverage, or a flat
    /// normal.
    pub(super) fn placeholder(self, name: &str) -> Texture {
        let texel = match self {
            Use::Color => [188, 188, 188, 255],
            Use::Mask | Use::Alpha => [255, 255, 255, 255],
            Use::Normal(_) | Use::Bump(_) => [128, 128, 255, 255],
        };
        Texture {
            name: name.to_owned(),
            kind: self.kind(),
            width: 1,
            height: 1,
            texels: vec![texel],
        }
    }
}

/// Reads a picture (grey, RGB or RGBA, 8 or 16 bits) as a texture called `name`; linear values
/// (colours, coverage, heights) become base + gain · value. `path` is for messages.
pub(super) fn read(
    path: &Path,
    bytes: &[u8],
    name: &str,
    wanted: Use,
    [base, gain]: [f32; 2],
) -> Result<Texture, SceneError> {
    let (width, height, mut texels) = decode(path, bytes)?;
    match wanted {
        Use::Color => adjust_colors(&mut texels, [base, gain]),
        Use::Normal(scale) => make_unit(&mut texels, scale),
        Use::Alpha => {
            texels
                .iter_mut()
                .for_each(|texel| *texel = [texel[3], texel[3], texel[3], 255]);
            adjust_masks(&mut texels, [base, gain]);
        }
        Use::Mask => {
            mask_from_alpha(&mut texels);
            adjust_masks(&mut texels, [base, gain]);
        }
        Use::Bump(_) if is_normal_map(&texels) => {
            log::warn!(
                "{}: named as a bump map but holds normals; read as a normal map",
                path.display()
            );
            make_unit(&mut texels, 1.0);
        }
        Use::Bump(multiplier) => {
            let height_texels = multiplier * gain * BUMP_HEIGHT_TEXELS;
            texels = normals_from_heights(width, height, &texels, height_texels);
        }
    }
    Ok(Texture {
        name: name.to_owned(),
        kind: wanted.kind(),
        width,
        height,
        texels,
    })
}

/// Width, height and RGBA texels of a picture; `path` is for messages.
pub(super) fn decode(path: &Path, bytes: &[u8]) -> Result<(u32, u32, Vec<[u8; 4]>), SceneError> {
    let damaged = |error: image::ImageError| {
        SceneError::file(
            path,
            format!("the picture cannot be decoded ({error})"),
            "export it again as PNG, JPEG, TGA or BMP: the file is cut short or damaged",
        )
    };
    let open = || {
        // Some formats show in the name alone.
        let mut reader = ImageReader::new(Cursor::new(bytes));
        if let Ok(format) = ImageFormat::from_path(path) {
            reader.set_format(format);
        }
        reader
            .with_guessed_format()
            .map_err(|error| SceneError::read(path, error))
    };
    let reader = open()?;
    if let Some(problem) = unread_format(reader.format()) {
        return Err(SceneError::file(
            path,
            problem,
            "convert it to PNG, JPEG, TGA or BMP, and name that file in the material",
        ));
    }
    let (width, height) = reader.into_dimensions().map_err(damaged)?;
    if width > SIZE_MAX || height > SIZE_MAX {
        return Err(SceneError::file(
            path,
            format!("the picture has {width} × {height} texels"),
            format!("scale it down to at most {SIZE_MAX} × {SIZE_MAX}"),
        ));
    }
    if width == 0 || height == 0 {
        return Err(SceneError::file(
            path,
            "the picture has no texels",
            "export it again",
        ));
    }
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(DECODE_BYTES_MAX);
    let mut reader = open()?;
    reader.limits(limits);
    let picture = reader.decode().map_err(damaged)?.into_rgba8();
    Ok((
        width,
        height,
        picture.pixels().map(|pixel| pixel.0).collect(),
    ))
}

/// Why pictures of a format are not read; `None` where they are.
fn unread_format(format: Option<ImageFormat>) -> Option<String> {
    match format {
        Some(format) if format.reading_enabled() => None,
        Some(format) => {
            let extension = format.extensions_str().first();
            let name = extension.map_or_else(String::new, |name| name.to_uppercase());
            Some(format!(
                "this is a {name} picture, a format that is not read"
            ))
        }
        None => Some(String::from(
            "this is no picture, or of a format that is not read",
        )),
    }
}

fn mask_from_alpha(texels: &mut [[u8; 4]]) {
    let has_alpha = texels.iter().any(|texel| texel[3] != texels[0][3]);
    if has_alpha {
        for texel in texels {
            *texel = [texel[3], texel[3], texel[3], 255];
        }
    }
}

/// Makes each colour base + gain · colour, clamped to 0…1.
fn adjust_colors(texels: &mut [[u8; 4]], [base, gain]: [f32; 2]) {
    if [base, gain] == [0.0, 1.0] {
        return;
    }
    let table: [u8; 256] =
        std::array::from_fn(|value| srgb_from_linear(base + gain * linear_from_srgb(value as u8)));
    for [r, g, b, _] in texels {
        [*r, *g, *b] = [*r, *g, *b].map(|value| table[usize::from(value)]);
    }
}

/// Makes each coverage base + gain · coverage, clamped to 0…1.
fn adjust_masks(texels: &mut [[u8; 4]], [base, gain]: [f32; 2]) {
    let adjusted = |value: u8| (base * 255.0 + gain * f32::from(value)).round() as u8;
    texels
        .iter_mut()
        .for_each(|texel| texel[0] = adjusted(texel[0]));
}

/// Whether most texels are bluish as in a tangent-space normal map, rather than grey heights.
fn is_normal_map(texels: &[[u8; 4]]) -> bool {
    let bluish = texels
        .iter()
        .filter(|[r, g, b, _]| *b > 127 && b.saturating_sub(*r) > 32 && b.saturating_sub(*g) > 32)
        .count();
    2 * bluish > texels.len()
}

/// How far the length of a unit vector is off by 8 bits a component.
const UNIT_ERROR: f32 = 0.007;

/// Makes normals unit vectors that are not, x and y times `scale`. A length that is left is that of
/// a mean: a pixel of several texels that differ.
fn make_unit(texels: &mut [[u8; 4]], scale: f32) {
    for texel in texels {
        let [x, y, z, _] = texel.map(|component| f32::from(component) / 127.5 - 1.0);
        let normal = Vec3::new(scale * x, scale * y, z);
        if scale != 1.0 || (normal.length() - 1.0).abs() > UNIT_ERROR {
            *texel = texel_of(normal.normalize());
        }
    }
}

/// A unit vector as a texel. (A texel's own vector is never 0: 127.5 is no integer.)
fn texel_of(normal: Vec3) -> [u8; 4] {
    let [x, y, z] = ((normal * 0.5 + 0.5) * 255.0).to_array();
    [x.round() as u8, y.round() as u8, z.round() as u8, 255]
}

/// Normals (x right, y up, z out of the surface) of a height field by central differences with
/// repeat addressing; `height_texels` is the height of white.
fn normals_from_heights(
    width: u32,
    height: u32,
    texels: &[[u8; 4]],
    height_texels: f32,
) -> Vec<[u8; 4]> {
    let (columns, rows) = (width as usize, height as usize);
    let at = |x: usize, y: usize| {
        f32::from(texels[(y % rows) * columns + x % columns][0]) / 255.0 * height_texels
    };
    let mut normals = Vec::with_capacity(texels.len());
    for y in 0..rows {
        for x in 0..columns {
            let slope_right = 0.5 * (at(x + 1, y) - at(x + columns - 1, y));
            let slope_up = 0.5 * (at(x, y + rows - 1) - at(x, y + 1));
            normals.push(texel_of(
                Vec3::new(-slope_right, -slope_up, 1.0).normalize(),
            ));
        }
    }
    normals
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_heights_are_a_flat_normal_map() {
        assert!(
            normals_from_heights(3, 2, &[[7, 7, 7, 255]; 6], 4.0)
                .iter()
                .all(|texel| *texel == [128, 128, 255, 255])
        );
    }

    #[test]
    fn normals_become_unit_vectors_and_those_that_are_stay() {
        let slanted = texel_of(Vec3::new(0.48, -0.6, 0.64));
        let mut texels = [
            [128, 128, 255, 255],
            slanted,
            [128, 128, 191, 255],
            [158, 90, 168, 255],
            [0, 0, 0, 255],
        ];
        make_unit(&mut texels, 1.0);
        assert_eq!(texels[..2], [[128, 128, 255, 255], slanted]);
        // Half as long, in whole steps of 8 bits.
        for (made, direction) in texels[2..]
            .iter()
            .zip([texels[0], slanted, [54, 54, 54, 255]])
        {
            let is_near = |(a, b): (&u8, &u8)| a.abs_diff(*b) <= 1;
            assert!(made.iter().zip(&direction).all(is_near), "{made:?}");
        }
    }

    #[test]
    fn a_slope_rising_to_the_right_tilts_the_normal_to_the_left() {
        let texels: Vec<[u8; 4]> = [0u8, 64, 128, 192]
            .iter()
            .map(|height| [*height, *height, *height, 255])
            .collect();
        let normals = normals_from_heights(4, 1, &texels, 4.0);
        assert!(normals[1][0] < 100 && normals[1][1] == 128, "{normals:?}");
    }

    #[test]
    fn a_slope_rising_upwards_tilts_the_normal_down() {
        let texels: Vec<[u8; 4]> = [192u8, 128, 64, 0]
            .iter()
            .map(|height| [*height, *height, *height, 255])
            .collect();
        let normals = normals_from_heights(1, 4, &texels, 4.0);
        assert!(normals[1][1] < 100 && normals[1][0] == 128, "{normals:?}");
    }
}
