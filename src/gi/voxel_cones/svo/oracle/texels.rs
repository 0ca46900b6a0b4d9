//! What the bricks hold.

use std::collections::BTreeMap;

use glam::{DVec3, DVec4};

use super::{Lattice, add, cube};
use crate::gi::shared::cone::oracle::luminance;
use crate::gi::shared::voxel::oracle::VoxelIndex;

/// Texels of a level that are not nothing: radiance [W/(m² sr)] premultiplied by opacity, and
/// opacity.
pub type Texels = BTreeMap<VoxelIndex, DVec4>;

/// A voxel that shines from two sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LitVoxel {
    /// Radiance of its front [W/(m² sr)].
    pub front: DVec3,
    /// Radiance of its back [W/(m² sr)].
    pub back: DVec3,
    /// Mean normal of its front, no longer than 1; of opposed surfaces the axis that parts them.
    pub normal: DVec3,
    /// Share of the voxel that blocks light, 0 to 1.
    pub opacity: f64,
}

impl LitVoxel {
    /// Its light: that of both sides together, premultiplied by opacity, and opacity.
    pub fn light(&self) -> DVec4 {
        (self.opacity * (self.front + self.back)).extend(self.opacity)
    }

    /// Mean normal of what shines, the sides weighted with their luminance, times the luminance of
    /// both; premultiplied by opacity, and opacity.
    pub fn lit_normal(&self) -> DVec4 {
        (self.opacity * luminance(self.front - self.back) * self.normal).extend(self.opacity)
    }
}

/// How 2³ texels become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// The mean of the eight texels.
    Box,
    /// The mean over six directions of front-to-back compositing of pairs along the direction
    /// (Crassin et al. 2011, section 5.2).
    Directional,
    /// As before, brought to the opacity of the most opaque axis.
    DirectionalMax,
}

/// Level 0: each voxel is a texel, or gives an eighth to each of its corners.
pub fn leaves(voxels: &Texels, lattice: Lattice) -> Texels {
    let mut texels = Texels::new();
    for (voxel, value) in voxels {
        let reached = lattice.reached(*voxel);
        let share = *value / reached.len() as f64;
        reached
            .into_iter()
            .for_each(|texel| *texels.entry(texel).or_default() += share);
    }
    texels
}

/// The next level: one filtered cube a texel, or an eighth of each of the eight cubes around it
/// that lie in the grid, which is `cells` cubes wide.
pub fn coarser(finer: &Texels, cells: u32, lattice: Lattice, filter: Filter) -> Texels {
    let reached: std::collections::BTreeSet<VoxelIndex> = finer
        .keys()
        .flat_map(|texel| lattice.parents(*texel))
        .collect();
    let value = |at: [i64; 3]| {
        let texel: Option<Vec<u32>> = at.iter().map(|at| u32::try_from(*at).ok()).collect();
        texel
            .and_then(|at| finer.get(&[at[0], at[1], at[2]]))
            .copied()
            .unwrap_or_default()
    };
    // The cube from this texel on.
    let cube_at = |low: [i64; 3]| {
        let is_inside = low.iter().all(|at| (0..i64::from(cells)).contains(at));
        let texels = cube().map(|offset| {
            value(std::array::from_fn(|axis| {
                low[axis] + i64::from(offset[axis])
            }))
        });
        if is_inside {
            filtered(texels, filter)
        } else {
            DVec4::ZERO
        }
    };
    let texel = |at: &VoxelIndex| {
        let low = at.map(|at| 2 * i64::from(at));
        match lattice {
            Lattice::Centres => cube_at(low),
            Lattice::Corners => {
                cube()
                    .map(|below| {
                        cube_at(std::array::from_fn(|axis| {
                            low[axis] - i64::from(below[axis])
                        }))
                    })
                    .sum::<DVec4>()
                    / 8.0
            }
        }
    };
    reached.into_iter().map(|at| (at, texel(&at))).collect()
}

fn filtered(texels: impl Iterator<Item = DVec4>, filter: Filter) -> DVec4 {
    let texels: Vec<DVec4> = texels.collect();
    let mean = texels.iter().sum::<DVec4>() / 8.0;
    if filter == Filter::Box || mean.w == 0.0 {
        return mean;
    }
    // Mean over the four columns along an axis, each seen from both of its ends.
    let along = |axis: usize| {
        let columns = cube().enumerate().filter(|(_, offset)| offset[axis] == 0);
        let pair = |(index, offset): (usize, [u32; 3])| {
            let mut far = [0; 3];
            far[axis] = 1;
            let far = add(offset, far);
            let (a, b) = (
                texels[index],
                texels[(far[0] + 2 * far[1] + 4 * far[2]) as usize],
            );
            (over(a, b) + over(b, a)) / 2.0
        };
        columns.map(pair).sum::<DVec4>() / 4.0
    };
    let axes = [0, 1, 2].map(along);
    let mean = axes.iter().sum::<DVec4>() / 3.0;
    match filter {
        Filter::DirectionalMax => {
            mean * (axes.iter().map(|axis| axis.w).fold(0.0, f64::max) / mean.w)
        }
        _ => mean,
    }
}

/// Premultiplied `front` composited over `back` (Porter & Duff 1984).
fn over(front: DVec4, back: DVec4) -> DVec4 {
    front + (1.0 - front.w) * back
}

#[cfg(test)]
mod tests {
    use super::*;

    const GLOW: DVec4 = DVec4::new(2.0, 1.0, 0.5, 1.0);

    /// The 27 taps (¼, ½, ¼)³ of one texel, seen from the coarser texels around it.
    #[test]
    fn box_on_corners_is_gaussian() {
        let weights = [
            ([4, 4, 4], 0.125),
            ([5, 4, 4], 0.0625),
            ([5, 5, 4], 0.03125),
            ([5, 5, 5], 0.015625),
        ];
        for (texel, weight) in weights {
            let level = coarser(&[(texel, GLOW)].into(), 8, Lattice::Corners, Filter::Box);
            assert_eq!(level[&[2, 2, 2]], GLOW * weight, "{texel:?}");
            assert!((level.values().sum::<DVec4>() - GLOW / 8.0).length() < 1e-12);
        }
    }

    #[test]
    fn voxels_spread_to_corners() {
        let texels = leaves(
            &[([1, 1, 1], GLOW), ([2, 1, 1], GLOW)].into(),
            Lattice::Corners,
        );
        assert_eq!(texels.len(), 12);
        assert_eq!(texels[&[2, 2, 1]], GLOW / 4.0);
        assert_eq!(texels[&[1, 1, 1]], GLOW / 8.0);
    }

    /// Along its normal a wall is opaque; along the others half of the columns are.
    #[test]
    fn directional_keeps_walls() {
        let wall: Texels = cube()
            .filter(|offset| offset[0] == 0)
            .map(|offset| (offset, GLOW))
            .collect();
        let texel = |filter| coarser(&wall, 2, Lattice::Centres, filter)[&[0; 3]];
        assert!((texel(Filter::Directional) - GLOW * 2.0 / 3.0).length() < 1e-12);
        assert!((texel(Filter::DirectionalMax) - GLOW).length() < 1e-12);
        assert!((texel(Filter::Box) - GLOW / 2.0).length() < 1e-12);
    }

    #[test]
    fn a_pair_is_seen_from_both_sides() {
        let (a, b) = (
            DVec4::new(0.3, 0.0, 0.0, 0.5),
            DVec4::new(0.0, 1.0, 0.0, 1.0),
        );
        let texels = [([0, 0, 0], a), ([1, 0, 0], b)].into();
        let along_x = (DVec4::new(0.3, 0.5, 0.0, 1.0) + DVec4::new(0.0, 1.0, 0.0, 1.0)) / 2.0 / 4.0;
        let expected = (along_x + 2.0 * (a + b) / 4.0) / 3.0;
        assert!(
            (coarser(&texels, 2, Lattice::Centres, Filter::Directional)[&[0; 3]] - expected)
                .length()
                < 1e-12
        );
    }
}
