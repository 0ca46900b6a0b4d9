//! Textures made by code; all repeat without a seam.

use glam::{Vec2, Vec3};

use super::super::{Texture, TextureKind};

/// Width and height of the larger pictures \[texels\].
const SIZE: u32 = 512;

/// A picture from linear colours at the texels' middles; (u, v) ∈ [0, 1]², v upwards.
pub(super) fn paint(name: &str, size: u32, color: impl Fn(Vec2) -> Vec3) -> Texture {
    texels(name, TextureKind::Color, size, |uv| {
        color(uv).to_array().map(srgb_from_linear)
    })
}

fn texels(name: &str, kind: TextureKind, size: u32, texel: impl Fn(Vec2) -> [u8; 3]) -> Texture {
    let mut texels = Vec::with_capacity((size * size) as usize);
    for y in 0..size {
        for x in 0..size {
            let [r, g, b] =
                texel(Vec2::new(x as f32 + 0.5, (size - 1 - y) as f32 + 0.5) / size as f32);
            texels.push([r, g, b, 255]);
        }
    }
    Texture {
        name: format!("textures/{name}.png"),
        kind,
        width: size,
        height: size,
        texels,
    }
}

/// Coverage: 1 is surface.
pub(super) fn mask(name: &str, size: u32, covered: impl Fn(Vec2) -> bool) -> Texture {
    texels(name, TextureKind::Mask, size, |uv| {
        [if covered(uv) { 255 } else { 0 }; 3]
    })
}

/// Tangent-space normals of a height field; `height` answers in units of the picture's width.
pub(super) fn normals(name: &str, size: u32, height: impl Fn(Vec2) -> f32) -> Texture {
    let step = 1.0 / size as f32;
    texels(name, TextureKind::Normal, size, |uv| {
        let slope =
            |axis: Vec2| (height(uv + axis * step) - height(uv - axis * step)) / (2.0 * step);
        let normal = Vec3::new(-slope(Vec2::X), -slope(Vec2::Y), 1.0).normalize();
        ((normal * 0.5 + 0.5) * 255.0)
            .to_array()
            .map(|value| value.round() as u8)
    })
}

/// The sRGB transfer function, encoding linear to 8 bits.
fn srgb_from_linear(linear: f32) -> u8 {
    let encoded = if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    };
    (encoded.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// A hash of a lattice point to [0, 1).
fn hash(x: i32, y: i32, seed: u32) -> f32 {
    let mut state = (x as u32).wrapping_mul(0x9E37_79B1)
        ^ (y as u32).wrapping_mul(0x85EB_CA77)
        ^ seed.wrapping_mul(0xC2B2_AE3D);
    for _ in 0..2 {
        state = (state ^ (state >> 15)).wrapping_mul(0x2C1B_3C6D);
        state = (state ^ (state >> 12)).wrapping_mul(0x297A_2D39);
    }
    (state >> 8) as f32 / (1 << 24) as f32
}

/// Smooth noise in [0, 1] with `cells` lattice cells across the picture, repeating.
pub(super) fn noise(uv: Vec2, cells: i32, seed: u32) -> f32 {
    let p = uv * cells as f32;
    let (base, f) = (p.floor(), p - p.floor());
    let f = f * f * (3.0 - 2.0 * f);
    let at = |dx: i32, dy: i32| {
        hash(
            (base.x as i32 + dx).rem_euclid(cells),
            (base.y as i32 + dy).rem_euclid(cells),
            seed,
        )
    };
    let bottom = at(0, 0) + (at(1, 0) - at(0, 0)) * f.x;
    let top = at(0, 1) + (at(1, 1) - at(0, 1)) * f.x;
    bottom + (top - bottom) * f.y
}

/// Five octaves of [`noise`], in [0, 1].
pub(super) fn fractal(uv: Vec2, cells: i32, seed: u32) -> f32 {
    (0..5)
        .map(|octave| {
            noise(uv, cells << octave, seed + octave as u32) * 0.516 / (1 << octave) as f32
        })
        .sum()
}

/// A 2 × 2 checker.
pub(super) fn checker(name: &str, light: [f32; 3], dark: [f32; 3]) -> Texture {
    paint(name, 64, |uv| {
        Vec3::from(if (uv.x < 0.5) == (uv.y < 0.5) {
            light
        } else {
            dark
        })
    })
}

/// Upright stripes of four colours.
pub(super) fn stripes(name: &str, colors: [[f32; 3]; 4]) -> Texture {
    paint(name, 64, |uv| Vec3::from(colors[(uv.x * 4.0) as usize % 4]))
}

/// Leaded panes of random colours.
pub(super) fn stained_glass(name: &str) -> Texture {
    let palette = [
        [1.0, 0.1, 0.05],
        [1.0, 0.7, 0.1],
        [0.1, 0.7, 0.25],
        [0.1, 0.25, 0.95],
        [0.7, 0.15, 0.8],
        [0.9, 0.9, 0.8],
    ];
    paint(name, 256, |uv| {
        let cell = uv * Vec2::new(6.0, 4.0);
        let inside = cell - cell.floor();
        if inside.min_element() < 0.06 || inside.max_element() > 0.94 {
            return Vec3::splat(0.01);
        }
        let is_upper = inside.x + inside.y > 1.0;
        let pick = hash(cell.x as i32, cell.y as i32, 11 + u32::from(is_upper));
        Vec3::from(palette[(pick * palette.len() as f32) as usize])
    })
}

/// A wall of bricks laid in running bond, eight courses to the picture: which brick, and how deep
/// in its face (0 is mortar, 1 is brick).
pub(super) fn brick(uv: Vec2) -> (f32, f32) {
    let courses = 8.0;
    let row = (uv.y * courses).floor();
    let shifted = uv.x * 4.0 + if row.rem_euclid(2.0) == 0.0 { 0.0 } else { 0.5 };
    let inside = Vec2::new(shifted - shifted.floor(), uv.y * courses - row);
    let edge = (inside.x.min(1.0 - inside.x) * 2.0).min(inside.y.min(1.0 - inside.y));
    let tint = hash(
        (shifted.floor() as i32).rem_euclid(4),
        (row as i32).rem_euclid(8),
        3,
    );
    (tint, smoothstep(0.05, 0.12, edge))
}

/// Square tiles, `count` across the picture: which tile, and 0 in the joint to 1 on the tile.
pub(super) fn tile(uv: Vec2, count: f32, joint: f32) -> (Vec2, f32) {
    let cell = uv * count;
    let inside = cell - cell.floor();
    let edge = inside.min(Vec2::ONE - inside).min_element();
    (cell.floor(), smoothstep(0.4 * joint, joint, edge))
}

/// A random number in [0, 1) for a tile.
pub(super) fn tile_tint(cell: Vec2, seed: u32) -> f32 {
    hash(cell.x as i32, cell.y as i32, seed)
}

/// 0 below `low`, 1 above `high`, smooth between.
pub(super) fn smoothstep(low: f32, high: f32, value: f32) -> f32 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A colour picture of the usual size.
pub(super) fn large(name: &str, color: impl Fn(Vec2) -> Vec3) -> Texture {
    paint(name, SIZE, color)
}

/// A normal map of the usual size.
pub(super) fn large_normals(name: &str, height: impl Fn(Vec2) -> f32) -> Texture {
    normals(name, SIZE, height)
}
