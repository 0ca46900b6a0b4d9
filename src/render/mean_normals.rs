//! Mip levels of normal maps, whose texels are means of normals.

use glam::Vec3;
use rayon::prelude::*;

use crate::scene::Texture;

/// Where in a texel its normals are taken, from its centre (texels). Between two centres these are
/// the places of Gauss's rule for the mean.
const PLACES: [f32; 2] = [-0.211_324_87, 0.211_324_87];

/// Texels of all levels after the first. A texel is the mean of the normals that the map has in
/// its square: those between four texels are interpolated and made unit vectors, as shading does.
/// So its length says how much they differ.
pub(super) fn levels_of_means(map: &Texture) -> Vec<Vec<[u8; 4]>> {
    let mut size = [map.width as usize, map.height as usize];
    let mut means = means_in_texels(map, size);
    let mut levels = Vec::new();
    while size != [1, 1] {
        let smaller = size.map(|size| (size / 2).max(1));
        means = halved(&means, size, smaller);
        size = smaller;
        levels.push(means.iter().map(|mean| texel_of(*mean)).collect());
    }
    levels
}

fn means_in_texels(map: &Texture, [width, height]: [usize; 2]) -> Vec<Vec3> {
    let normals: Vec<Vec3> = (map.texels.iter())
        .map(|texel| {
            let [x, y, z, _] = texel.map(|component| f32::from(component) / 127.5 - 1.0);
            Vec3::new(x, y, z)
        })
        .collect();
    // The neighbours on the sides of the places.
    let beside = |at: usize, size: usize| [(at + size - 1) % size, (at + 1) % size];
    let mean = |x: usize, y: usize| {
        let own = normals[y * width + x];
        let mut sum = Vec3::ZERO;
        for (row, down) in beside(y, height).into_iter().zip(PLACES) {
            let below = normals[row * width + x];
            for (column, right) in beside(x, width).into_iter().zip(PLACES) {
                let (near, far) = (
                    own.lerp(normals[y * width + column], right.abs()),
                    below.lerp(normals[row * width + column], right.abs()),
                );
                sum += near.lerp(far, down.abs()).normalize_or_zero();
            }
        }
        0.25 * sum
    };
    by_rows([width, height], mean)
}

/// A value for each texel, row by row, on all cores.
fn by_rows([width, height]: [usize; 2], of: impl Fn(usize, usize) -> Vec3 + Sync) -> Vec<Vec3> {
    let of = &of;
    (0..height)
        .into_par_iter()
        .flat_map_iter(|y| (0..width).map(move |x| of(x, y)))
        .collect()
}

/// Means over the squares of a smaller picture's texels.
fn halved(means: &[Vec3], size: [usize; 2], smaller: [usize; 2]) -> Vec<Vec3> {
    let covered = |at: usize, axis: usize| {
        let step = size[axis] as f32 / smaller[axis] as f32;
        let (from, to) = (at as f32 * step, (at + 1) as f32 * step);
        (from as usize..(to.ceil() as usize).min(size[axis])).map(move |texel| {
            let (first, last) = (texel as f32, texel as f32 + 1.0);
            (texel, (to.min(last) - from.max(first)) / step)
        })
    };
    let mean = |x: usize, y: usize| {
        let row = |row: usize| {
            covered(x, 0)
                .map(|(column, share)| share * means[row * size[0] + column])
                .sum::<Vec3>()
        };
        covered(y, 1).map(|(at, share)| share * row(at)).sum()
    };
    by_rows(smaller, mean)
}

fn texel_of(mean: Vec3) -> [u8; 4] {
    let [x, y, z] = (127.5 * (mean + 1.0)).to_array();
    [x.round() as u8, y.round() as u8, z.round() as u8, 255]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::TextureKind;

    fn map(width: u32, height: u32, normal: impl Fn(u32, u32) -> Vec3) -> Texture {
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Texture {
            name: "map".into(),
            kind: TextureKind::Normal,
            width,
            height,
            texels: places.map(|(x, y)| texel_of(normal(x, y))).collect(),
        }
    }

    fn vector([x, y, z, _]: [u8; 4]) -> Vec3 {
        Vec3::new(x.into(), y.into(), z.into()) / 127.5 - 1.0
    }

    #[test]
    fn one_normal_stays_with_its_length_on_all_levels() {
        let normal = Vec3::new(0.36, -0.48, 0.8);
        for (width, height) in [(1, 1), (8, 8), (7, 3), (1, 5)] {
            let levels = levels_of_means(&map(width, height, |_, _| normal));
            assert_eq!(levels.len() as u32, width.max(height).ilog2());
            for texel in levels.iter().flatten() {
                assert!((vector(*texel) - normal).length() < 0.01, "{texel:?}");
            }
        }
    }

    /// The exact mean over one texel's half, of n(t) = (0.6 t, 0, 0.8) made a unit vector, is
    /// 4/3 asinh(3/4) = 0.924 along z.
    #[test]
    fn ridges_are_as_long_as_the_mean_between_them() {
        let ridges = map(8, 4, |x, _| Vec3::new(0.6 - 1.2 * (x % 2) as f32, 0.0, 0.8));
        let levels = levels_of_means(&ridges);
        let exact = Vec3::Z * (4.0 / 3.0 * 0.75_f32.asinh());
        for texel in levels.iter().flatten() {
            assert!((vector(*texel) - exact).length() < 0.012, "{texel:?}");
        }
    }

    #[test]
    fn texels_of_odd_sizes_count_by_their_share() {
        let one_of_three = map(3, 1, |x, _| if x == 0 { Vec3::X } else { -Vec3::X });
        let seen = vector(levels_of_means(&one_of_three)[0][0]);
        assert!((seen.x + 1.0 / 3.0).abs() < 0.01, "{seen}");
    }
}
