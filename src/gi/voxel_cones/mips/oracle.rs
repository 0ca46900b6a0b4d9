//! CPU twins of `voxel_mips.filter`, each mip of premultiplied radiance from the next finer one, in
//! f64, and of the matter pyramid.

use std::collections::BTreeSet;

use glam::{DVec4, UVec3};

use crate::gi::shared::cone::oracle::Volume;
use crate::gi::shared::voxel::oracle::VoxelIndex;

/// How eight texels become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// Their mean. A wall one voxel thick loses half its opacity at every level.
    Box,
    /// Along each of the six directions the two texels of each of four pairs are composited front
    /// to back, and the pairs are averaged; the mean of the six directions is kept (Crassin et
    /// al. 2011, section 5.2, in one texel). A wall stays opaque along its normal.
    Directional,
}

/// All mips down to one texel, `finest` first. Its resolution is a power of two.
pub fn chain(finest: Volume, filter: Filter) -> Vec<Volume> {
    let mut levels = vec![finest];
    while let Some(finer) = levels.last().filter(|level| level.resolution > 1) {
        let coarser = coarser(finer, filter);
        levels.push(coarser);
    }
    levels
}

/// The next coarser mip: texel i is made of texels 2i and 2i + 1 along each axis. An odd last texel
/// is left out.
pub fn coarser(finer: &Volume, filter: Filter) -> Volume {
    Volume::new((finer.resolution / 2).max(1), |texel| {
        let child =
            |x, y, z| finer.texel((2 * UVec3::from(texel) + UVec3::new(x, y, z)).to_array());
        match filter {
            Filter::Box => box_mean(child),
            Filter::Directional => directional_mean(child),
        }
    })
}

/// All levels down to one texel per face (+x, −x, +y, −y, +z, −z), `finest` first.
pub fn face_chain(finest: [Volume; 6]) -> Vec<[Volume; 6]> {
    let mut levels = vec![finest];
    while let Some(finer) = levels.last().filter(|level| level[0].resolution > 1) {
        let coarser = coarser_faces(finer.each_ref());
        levels.push(coarser);
    }
    levels
}

/// The six faces of the next coarser level: of each pair of texels along the face's axis, the one
/// nearer to the viewer is composited over the other, and the four results are averaged (Crassin et
/// al. 2011, section 5.2). If the level has no faces, all six inputs are the same.
pub fn coarser_faces(finer: [&Volume; 6]) -> [Volume; 6] {
    [0, 1, 2, 3, 4, 5].map(|face| {
        let (axis, nearer) = (face / 2, 1 - face as u32 % 2);
        Volume::new((finer[face].resolution / 2).max(1), |texel| {
            let child = |x, y, z| {
                finer[face].texel((2 * UVec3::from(texel) + UVec3::new(x, y, z)).to_array())
            };
            columns()
                .map(|[a, b]| {
                    over(
                        at_depth(&child, axis, nearer, a, b),
                        at_depth(&child, axis, 1 - nearer, a, b),
                    )
                })
                .into_iter()
                .sum::<DVec4>()
                / 4.0
        })
    })
}

/// The four columns of the eight children along an axis.
fn columns() -> [[u32; 2]; 4] {
    [[0, 0], [1, 0], [0, 1], [1, 1]]
}

/// The child at a depth along an axis, in column (a, b).
fn at_depth(
    child: &impl Fn(u32, u32, u32) -> DVec4,
    axis: usize,
    depth: u32,
    a: u32,
    b: u32,
) -> DVec4 {
    match axis {
        0 => child(depth, a, b),
        1 => child(a, depth, b),
        _ => child(a, b, depth),
    }
}

fn box_mean(child: impl Fn(u32, u32, u32) -> DVec4) -> DVec4 {
    pairs()
        .map(|[x, y, z]| child(x, y, z))
        .into_iter()
        .sum::<DVec4>()
        / 8.0
}

/// The coordinates of the eight children.
fn pairs() -> [[u32; 3]; 8] {
    std::array::from_fn(|index| [index as u32 & 1, index as u32 >> 1 & 1, index as u32 >> 2])
}

fn directional_mean(child: impl Fn(u32, u32, u32) -> DVec4) -> DVec4 {
    let mut sum = DVec4::ZERO;
    for axis in 0..3 {
        for front in [0, 1] {
            for [a, b] in columns() {
                sum += over(
                    at_depth(&child, axis, front, a, b),
                    at_depth(&child, axis, 1 - front, a, b),
                );
            }
        }
    }
    sum / 24.0
}

/// Premultiplied `front` composited over `back` (Porter & Duff 1984).
fn over(front: DVec4, back: DVec4) -> DVec4 {
    front + (1.0 - front.w) * back
}

/// Whether one of the texels `stencil` and `stencil` + 1 along each axis of mip `mip` of a grid of
/// n³ voxels holds an occupied voxel: what `voxel_mips.mark_matter` and `reduce_matter` tell.
pub fn sees_matter(
    occupied: &BTreeSet<VoxelIndex>,
    resolution: u32,
    stencil: [u32; 3],
    mip: u32,
) -> bool {
    let range = |axis: usize| stencil[axis] << mip..((stencil[axis] + 2) << mip).min(resolution);
    let (x, y, z) = (range(0), range(1), range(2));
    occupied
        .range([x.start, 0, 0]..[x.end, 0, 0])
        .any(|voxel| y.contains(&voxel[1]) && z.contains(&voxel[2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const GLOW: DVec4 = DVec4::new(2.0, 1.0, 0.5, 1.0);

    /// A wall one voxel thick, across x.
    fn wall(resolution: u32) -> Volume {
        Volume::new(
            resolution,
            |[x, _, _]| if x == 2 { GLOW } else { DVec4::ZERO },
        )
    }

    fn near(a: DVec4, b: DVec4) -> bool {
        (a - b).abs().max_element() < 1e-12
    }

    #[test]
    fn chain_ends_at_one_texel() {
        let resolutions: Vec<u32> = chain(wall(16), Filter::Box)
            .iter()
            .map(|level| level.resolution)
            .collect();
        assert_eq!(resolutions, [16, 8, 4, 2, 1]);
    }

    #[test]
    fn box_halves_a_wall_at_every_level() {
        let levels = chain(wall(8), Filter::Box);
        assert!(near(levels[1].texel([1, 0, 3]), GLOW / 2.0));
        assert!(near(levels[2].texel([0, 1, 1]), GLOW / 4.0));
        assert!(near(levels[3].texel([0, 0, 0]), GLOW / 8.0));
    }

    /// Along x a pair is opaque whichever is in front: four pairs, two directions. Along y and z
    /// half of the pairs are opaque.
    #[test]
    fn directional_keeps_a_wall_along_its_normal() {
        let levels = chain(wall(8), Filter::Directional);
        assert!(near(
            levels[1].texel([1, 2, 0]),
            GLOW * (1.0 + 0.5 + 0.5) / 3.0
        ));
        assert!(near(levels[1].texel([0, 2, 0]), DVec4::ZERO));
        // Along x: 2/3 with nothing; along y and z: two equal layers of 2/3, or nothing.
        let twice = 1.0 - (1.0 / 3.0f64).powi(2);
        assert!(near(
            levels[2].texel([0, 0, 1]),
            GLOW * (2.0 / 3.0 + 2.0 * 0.5 * twice) / 3.0
        ));
    }

    /// A wall of two layers, glowing on the side of −x, stays opaque along its normal and glows to
    /// that side alone; across, half of the pairs are opaque.
    #[test]
    fn faces_keep_a_wall_and_its_sides() {
        let (glow, black) = (GLOW, DVec4::new(0.0, 0.0, 0.0, 1.0));
        let wall = Volume::new(8, |[x, _, _]| {
            [glow, black]
                .get(x.wrapping_sub(4) as usize)
                .copied()
                .unwrap_or_default()
        });
        let levels = face_chain(std::array::from_fn(|_| wall.clone()));
        assert_eq!(
            levels
                .iter()
                .map(|level| level[0].resolution)
                .collect::<Vec<_>>(),
            [8, 4, 2, 1]
        );
        for (level, texel) in [(1, [2, 1, 1]), (2, [1, 0, 1]), (3, [0; 3])] {
            let seen = |face: usize| levels[level][face].texel(texel);
            assert!(
                near(seen(1), glow) && near(seen(0), black),
                "level {level}: {} from −x, {} from +x",
                seen(1),
                seen(0)
            );
            assert!(
                near(levels[1][2].texel([2, 1, 1]), (glow + black) / 2.0) && seen(4).w == seen(2).w
            );
        }
        let thin = face_chain(std::array::from_fn(|_| self::wall(8)));
        assert!(
            near(thin[1][0].texel([1, 1, 1]), GLOW)
                && near(thin[2][1].texel([0, 1, 1]), GLOW)
                && near(thin[1][2].texel([1, 1, 1]), GLOW / 2.0)
        );
    }

    #[test]
    fn opaque_constant_volume_stays_so() {
        for filter in [Filter::Box, Filter::Directional] {
            for level in chain(Volume::new(8, |_| GLOW), filter) {
                assert!(
                    level.texels.iter().all(|texel| near(*texel, GLOW)),
                    "{filter:?}"
                );
            }
        }
    }

    /// Two different texels of a pair: each is in front once.
    #[test]
    fn a_pair_is_seen_from_both_sides() {
        let (near_texel, far_texel) = (
            DVec4::new(0.3, 0.0, 0.0, 0.5),
            DVec4::new(0.0, 1.0, 0.0, 1.0),
        );
        let volume = Volume::new(2, |[x, _, _]| if x == 0 { near_texel } else { far_texel });
        let along_x = (DVec4::new(0.3, 0.5, 0.0, 1.0) + DVec4::new(0.0, 1.0, 0.0, 1.0)) / 2.0;
        // Along y and z: each texel over itself.
        let across = (near_texel * 1.5 + far_texel) / 2.0;
        assert!(near(
            coarser(&volume, Filter::Directional).texel([0, 0, 0]),
            (along_x + 2.0 * across) / 3.0
        ));
        assert!(near(
            coarser(&volume, Filter::Box).texel([0, 0, 0]),
            (near_texel + far_texel) / 2.0
        ));
    }
}
