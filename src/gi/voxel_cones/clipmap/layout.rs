//! Where the levels of a clipmap are.

use glam::{DVec3, IVec3, Vec3};

use crate::gi::shared::voxel::{VoxelBox, VoxelGrid};

/// Windows move by whole blocks of voxels.
const BLOCK: i32 = 4;

/// Voxels from a level's end within which it may have faded: it fades from a place up to two voxels
/// from its middle, to three before its end from there.
const UNSHARED: u32 = 5;

/// Most voxels along a scene: places of voxels stay exact in 32-bit numbers, with four steps in
/// between.
const MOST_VOXELS: f32 = (1 << 22) as f32;

/// Where a level is, in voxels of its unbounded grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Its first voxel.
    pub first: IVec3,
    /// The point from which it fades to all sides: the camera, or the point next to it that the
    /// level can have in its middle; at most two voxels from the middle, which moves by whole
    /// blocks.
    pub middle: Vec3,
}

/// Where the texels of a level are made from the next finer level, which never fades there. Beyond,
/// texels are made from the level's own voxels. Over the first voxels inside both are mixed, so
/// that little changes when the camera moves on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inner {
    /// The middle, in voxels of the finer level: it moves with the camera by one of them.
    pub middle: IVec3,
    /// How far the place reaches from there to all sides (voxels).
    pub reach: i32,
    /// Over how many voxels from its end on both are mixed.
    pub ramp: i32,
}

impl Inner {
    /// For a level that has no finer one.
    pub const NONE: Inner = Inner {
        middle: IVec3::ZERO,
        reach: 0,
        ramp: 0,
    };

    /// The voxels whose middle is nearer than `reach`.
    pub fn region(&self) -> VoxelBox {
        let half = self.middle >> 1;
        VoxelBox {
            low: self.middle - half - self.reach,
            end: half + self.reach,
        }
    }

    /// The part in which the texels are not mixed.
    pub fn core(&self) -> VoxelBox {
        let (half, reach) = (self.middle >> 1, self.reach - self.ramp);
        VoxelBox {
            low: half - reach,
            end: self.middle - half + reach,
        }
    }

    /// Share of the level's own voxel in a texel, w of equation (3), 0 to 1.
    pub fn own_share(&self, voxel: IVec3) -> f32 {
        let depth =
            self.reach as f32 - 0.5 * (2 * voxel + 1 - self.middle).abs().max_element() as f32;
        (1.0 - depth / self.ramp as f32).clamp(0.0, 1.0)
    }
}

/// The nested grids of a clipmap, wherever it is: level l has n³ voxels of size 2^l h, and voxel v
/// of its unbounded grid lies where voxels 2v and 2v + 1 of the next finer one do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    /// Corner of voxel (0, 0, 0) of every level (m).
    pub anchor: Vec3,
    /// Edge of a voxel of level 0, h (m).
    pub voxel_size: f32,
    /// Voxels along an edge of a level, n.
    pub resolution: u32,
    /// Number of levels.
    pub levels: u32,
    bounds: (Vec3, Vec3),
}

impl Layout {
    /// For a scene with these bounds (m). Without a voxel size (0), the outermost level just holds
    /// the scene. Levels that are larger than the scene takes are left out.
    pub fn new(bounds: (Vec3, Vec3), resolution: u32, levels: u32, voxel_size: f32) -> Self {
        let whole = VoxelGrid::around(bounds, resolution);
        let finest = whole.voxel_size * (resolution as f32 / MOST_VOXELS);
        if voxel_size > 0.0 && voxel_size < finest {
            log::warn!(
                "voxel_size = {voxel_size} is too fine for a scene of this extent; {finest} m are \
                 taken"
            );
        }
        let voxel_size = if voxel_size > 0.0 {
            voxel_size.max(finest)
        } else {
            0.0
        };
        let outermost = if voxel_size > 0.0 {
            (0..levels).find(|level| size_of_level(voxel_size, *level) >= whole.voxel_size)
        } else {
            None
        };
        let levels = outermost.map_or(levels, |level| level + 1);
        let voxel_size = if voxel_size > 0.0 {
            voxel_size
        } else {
            whole.voxel_size / (1 << (levels - 1)) as f32
        };
        let extent = size_of_level(voxel_size, levels - 1) * resolution as f32;
        Layout {
            anchor: 0.5 * (bounds.0 + bounds.1) - Vec3::splat(0.5 * extent),
            voxel_size,
            resolution,
            levels,
            bounds,
        }
    }

    /// Edge of a voxel of a level (m).
    pub fn size_of(&self, level: u32) -> f32 {
        size_of_level(self.voxel_size, level)
    }

    /// Mips above the outermost level: their texels are at most an eighth of its edge.
    pub fn top_mips(&self) -> u32 {
        (self.resolution / 8).ilog2()
    }

    /// Where each level is for a camera at `eye` (m). The camera is in the middle, unless the level
    /// would then reach beyond the scene: in that case it stays at the scene's border. Every level
    /// lies inside the next.
    pub fn places(&self, eye: Vec3) -> Vec<Place> {
        let mut places = vec![
            Place {
                first: IVec3::ZERO,
                middle: Vec3::ZERO
            };
            self.levels as usize
        ];
        let mut outer: Option<IVec3> = None;
        for level in (0..self.levels).rev() {
            let (size, edge) = (self.size_of(level), self.resolution as i32);
            // So that the mips above the outermost level begin with a whole texel.
            let step = if level == self.levels - 1 {
                BLOCK.max(1 << self.top_mips())
            } else {
                BLOCK
            };
            let axis = |eye: f32, low: f32, high: f32, anchor: f32| {
                let [eye, low, high] =
                    [eye, low, high].map(|position| f64::from(position - anchor) / f64::from(size));
                let half = 0.5 * f64::from(edge);
                let (least, most) = (
                    low - f64::from(BLOCK) + half,
                    high + f64::from(BLOCK) - half,
                );
                if least >= most {
                    0.5 * (low + high)
                } else {
                    eye.clamp(least, most)
                }
            };
            let (low, high) = self.bounds;
            let centre = DVec3::from_array(std::array::from_fn(|i| {
                axis(eye[i], low[i], high[i], self.anchor[i])
            }));
            let half = 0.5 * f64::from(edge);
            let first = step * ((centre - half) / f64::from(step)).round().as_ivec3();
            let first = outer.map_or(first, |outer| first.clamp(2 * outer, 2 * outer + edge));
            outer = Some(first);
            let (own, slack) = (
                first.as_dvec3() + half,
                DVec3::splat(0.5 * f64::from(BLOCK)),
            );
            places[level as usize] = Place {
                first,
                middle: centre.clamp(own - slack, own + slack).as_vec3(),
            };
        }
        places
    }

    /// The outermost level as a grid of voxels of level 0. All levels are parts of it.
    pub fn grid(&self, outermost: IVec3) -> VoxelGrid {
        let top = self.levels - 1;
        let origin = self.anchor + self.size_of(top) * outermost.as_vec3();
        VoxelGrid {
            origin,
            voxel_size: self.voxel_size,
            resolution: self.resolution << top,
        }
    }

    /// The rows of a level that cones are traced with: its corner from the outermost level's, in
    /// voxels of level 0, and where it begins in its slab; likewise its middle (`gi/clipmap/
    /// sample.glsl`).
    pub fn rows(
        &self,
        level: u32,
        Place { first, middle }: Place,
        outermost: IVec3,
    ) -> [[f32; 4]; 2] {
        let corner = (first << level as i32) - (outermost << (self.levels - 1) as i32);
        let n = self.resolution as i32;
        let wrap = first.rem_euclid(IVec3::splat(n));
        let corner = corner.as_vec3();
        let from_corner = (middle - first.as_vec3()) * (1 << level) as f32;
        [
            corner
                .extend((wrap.x + n * (wrap.y + n * wrap.z)) as f32)
                .to_array(),
            (corner + from_corner).extend(0.0).to_array(),
        ]
    }

    /// Where a finer level lies, in voxels of the next coarser one.
    pub fn extent(&self, finer: IVec3) -> VoxelBox {
        VoxelBox::cube(finer / 2, self.resolution / 2)
    }

    /// Where the texels of a level are made from the next finer level.
    pub fn inner(&self, finer: Place) -> Inner {
        let margin = (UNSHARED + self.resolution.div_ceil(16)).div_ceil(2);
        Inner {
            middle: finer.middle.round().as_ivec3(),
            reach: (self.resolution / 4 - margin) as i32,
            ramp: self.resolution.div_ceil(8) as i32,
        }
    }

    /// Voxels whose light stays when a level moves from `before` to `first`. Light that falls on
    /// the border of a level falls otherwise where it goes on.
    pub fn stays_lit(&self, before: IVec3, first: IVec3) -> VoxelBox {
        let border = BLOCK * (first - before).signum().abs();
        let common =
            VoxelBox::cube(before, self.resolution).cut(VoxelBox::cube(first, self.resolution));
        VoxelBox {
            low: common.low + border,
            end: common.end - border,
        }
    }
}

fn size_of_level(voxel_size: f32, level: u32) -> f32 {
    voxel_size * (1u32 << level) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: (Vec3, Vec3) = (Vec3::new(-7.0, 0.0, -3.0), Vec3::new(12.0, 5.0, 4.0));

    #[test]
    fn levels_are_nested_and_aligned_wherever_the_camera_is() {
        for (resolution, levels, voxel_size) in [
            (16, 4, 0.0),
            (32, 5, 0.0),
            (32, 3, 0.05),
            (64, 1, 0.0),
            (128, 7, 0.02),
        ] {
            let layout = Layout::new(BOUNDS, resolution, levels, voxel_size);
            for step in -40..40 {
                let eye = Vec3::new(0.7, 0.31, -0.23) * step as f32;
                let places = layout.places(eye);
                for (level, Place { first, middle }) in places.iter().enumerate() {
                    let off = (*middle - first.as_vec3() - 0.5 * resolution as f32)
                        .abs()
                        .max_element();
                    assert!(
                        off <= 2.001,
                        "{layout:?} {eye} level {level}: {off} voxels from its middle"
                    );
                    assert_eq!(
                        first.rem_euclid(IVec3::splat(BLOCK)),
                        IVec3::ZERO,
                        "{layout:?} {eye} level {level}"
                    );
                    let Some(outer) = places.get(level + 1) else {
                        continue;
                    };
                    let (inner, outer) = (
                        layout.extent(*first),
                        VoxelBox::cube(outer.first, resolution),
                    );
                    assert_eq!(
                        inner.cut(outer),
                        inner,
                        "{layout:?} {eye}: level {level} lies inside the next"
                    );
                    let filtered = layout.inner(places[level]).region();
                    assert!(
                        !filtered.is_empty() && filtered.cut(inner) == filtered,
                        "{layout:?}: {filtered:?} of {inner:?}"
                    );
                }
                let outermost = places[layout.levels as usize - 1].first;
                assert_eq!(
                    outermost.rem_euclid(IVec3::splat(1 << layout.top_mips())),
                    IVec3::ZERO
                );
            }
        }
    }

    /// Wherever the middle is: texels are the level's own outside of the region and the finer
    /// level's in the core, and mixed in between.
    #[test]
    fn a_level_is_mixed_between_its_region_and_its_core() {
        for middle in [
            IVec3::new(0, 5, -7),
            IVec3::new(1, -4, 40),
            IVec3::new(-1, 2, 3),
        ] {
            for (reach, ramp) in [(1, 2), (5, 4), (12, 4)] {
                let inner = Inner {
                    middle,
                    reach,
                    ramp,
                };
                let around = VoxelBox::cube(middle / 2 - 16, 32);
                for index in 0..32i32.pow(3) {
                    let voxel = around.low + IVec3::new(index % 32, index / 32 % 32, index / 1024);
                    let [is_inside, is_core] = [inner.region(), inner.core()]
                        .map(|part| !part.cut(VoxelBox::cube(voxel, 1)).is_empty());
                    let share = inner.own_share(voxel);
                    assert_eq!(
                        (is_inside, is_core),
                        (share < 1.0, share == 0.0),
                        "{inner:?}, {voxel}: {share}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_block_along_sides_that_move_is_lit_again() {
        let layout = Layout::new(BOUNDS, 32, 3, 0.0);
        let stays = |first: [i32; 3]| layout.stays_lit(IVec3::ZERO, IVec3::from(first));
        assert_eq!(stays([0, 0, 0]), VoxelBox::cube(IVec3::ZERO, 32));
        assert_eq!(
            stays([4, 0, -8]),
            VoxelBox {
                low: IVec3::new(8, 0, 4),
                end: IVec3::new(28, 32, 20)
            }
        );
        assert!(stays([28, 0, 0]).is_empty() && stays([64, 0, 0]).is_empty());
    }

    #[test]
    fn the_outermost_level_holds_the_scene_unless_told_otherwise() {
        for (resolution, levels) in [(16, 5), (32, 3), (128, 5)] {
            let layout = Layout::new(BOUNDS, resolution, levels, 0.0);
            let places = layout.places(BOUNDS.1);
            let grid = layout.grid(places[layout.levels as usize - 1].first);
            let end = grid.origin + grid.voxel_size * grid.resolution as f32;
            assert!(
                grid.origin.cmplt(BOUNDS.0).all() && end.cmpgt(BOUNDS.1).all(),
                "{grid:?}"
            );
            assert_eq!(layout.levels, levels);
        }
        assert_eq!(
            Layout::new(BOUNDS, 32, 7, 0.5).levels,
            2,
            "two levels of 16 and 32 m hold 19 m"
        );
    }
}
