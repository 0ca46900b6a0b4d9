//! Textures, decoded and filtered in f64.

use glam::{DVec2, DVec4};

use crate::scene::{Texture, TextureKind};

/// The sRGB transfer function, decoding (IEC 61966-2-1).
pub fn linear_from_srgb(encoded: f64) -> f64 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// The texel of a column and a row from the top, which repeat.
fn texel(texture: &Texture, column: i64, row: i64) -> DVec4 {
    let (width, height) = (i64::from(texture.width), i64::from(texture.height));
    let stored =
        texture.texels[(column.rem_euclid(width) + width * row.rem_euclid(height)) as usize];
    let [r, g, b, a] = stored.map(|value| f64::from(value) / 255.0);
    match texture.kind {
        TextureKind::Color => DVec4::new(
            linear_from_srgb(r),
            linear_from_srgb(g),
            linear_from_srgb(b),
            a,
        ),
        TextureKind::Mask | TextureKind::Normal => DVec4::new(r, g, b, a),
    }
}

/// Bilinear filter of the decoded texels; v grows upwards, and a texel's value is that of its
/// centre.
pub fn bilinear(texture: &Texture, uv: DVec2) -> DVec4 {
    let at = DVec2::new(
        uv.x * f64::from(texture.width),
        (1.0 - uv.y) * f64::from(texture.height),
    ) - 0.5;
    let (low, share) = (at.floor(), at - at.floor());
    let (column, row) = (low.x as i64, low.y as i64);
    let along =
        |row: i64| texel(texture, column, row).lerp(texel(texture, column + 1, row), share.x);
    along(row).lerp(along(row + 1), share.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Black and white beside each other: at the white texel's centre, between the two, and where
    /// the picture repeats.
    #[test]
    fn two_texels_are_filtered_by_hand() {
        let texels = vec![[0; 4], [255; 4]];
        let texture = Texture {
            name: String::new(),
            kind: TextureKind::Color,
            width: 2,
            height: 1,
            texels,
        };
        for (u, value) in [
            (0.25, 0.0),
            (0.75, 1.0),
            (0.5, 0.5),
            (0.0, 0.5),
            (1.0, 0.5),
            (0.625, 0.75),
            (-0.25, 1.0),
        ] {
            assert_eq!(
                bilinear(&texture, DVec2::new(u, 0.3)),
                DVec4::splat(value),
                "u = {u}"
            );
        }
        assert!(
            (linear_from_srgb(188.0 / 255.0) - 0.5029).abs() < 1e-4
                && (linear_from_srgb(0.04) - 0.04 / 12.92).abs() < 1e-12
        );
    }

    /// Row 0 is at the top, v grows upwards.
    #[test]
    fn the_first_row_is_the_top() {
        let texels = vec![[255; 4], [0; 4]];
        let texture = Texture {
            name: String::new(),
            kind: TextureKind::Mask,
            width: 1,
            height: 2,
            texels,
        };
        assert_eq!(bilinear(&texture, DVec2::new(0.5, 0.75)).x, 1.0);
        assert_eq!(bilinear(&texture, DVec2::new(0.5, 0.25)).x, 0.0);
    }
}
