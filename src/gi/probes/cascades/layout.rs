//! Where the lattices are.

use glam::{IVec3, UVec3, Vec3, Vec4};

use crate::gi::probes::Lattice;

/// Of a level's spacing: how far inside of the scene's bounds its first probes are.
const OUTER_LAYER: f32 = 0.25;

/// Most probes along a scene: their places stay exact in 32-bit numbers.
const MOST_PROBES: f32 = (1 << 20) as f32;

/// Nested lattices, wherever they are: probes of each are twice as far apart as those of the one
/// inside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    bounds: (Vec3, Vec3),
    /// Of a level's spacing: how far inside of the bounds its first probes are.
    outer_layer: f32,
    /// Between probes of the finest level (m).
    pub finest: f32,
    /// Most probes along an edge of a level.
    pub probes: u32,
    /// Number of levels.
    pub levels: u32,
}

/// Where a level is: a part of its unbounded lattice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Where probe 0 of the unbounded lattice stands (m).
    origin: Vec3,
    /// The first probe along each axis.
    pub first: IVec3,
    /// Its probes.
    pub lattice: Lattice,
    /// A bit for each side beyond which there are more: −x, +x, −y, and so on.
    pub open: u32,
}

impl Layout {
    /// For a scene with these bounds (m), and probes of the finest level so far apart (m); 0: such
    /// that the outermost level just holds the scene. Levels that are larger than the scene takes
    /// are left out.
    pub fn new(bounds: (Vec3, Vec3), probes: u32, levels: u32, finest: f32) -> Self {
        let farthest = bounds.0.abs().max(bounds.1.abs()).max_element();
        let extent = (bounds.1 - bounds.0).max_element();
        let longest = extent.max(2e-4 * farthest).max(1e-6);
        let whole = longest / (probes as f32 - 1.0 + 2.0 * OUTER_LAYER);
        let size_of = |level: u32| (1 << level) as f32;
        let finest = if finest > 0.0 {
            let least = longest / MOST_PROBES;
            if finest < least {
                log::warn!(
                    "spacing = {finest} is too fine for a scene of this extent; {least} m are taken"
                );
            }
            finest.max(least)
        } else {
            whole / size_of(levels - 1)
        };
        let holding = (0..levels).find(|level| finest * size_of(*level) >= whole * (1.0 - 1e-6));
        Layout {
            bounds,
            outer_layer: OUTER_LAYER,
            finest,
            probes,
            levels: holding.map_or(levels, |level| level + 1),
        }
    }

    /// One level that is as wide as `level` of these, or as the coarsest, with `probes` along its
    /// edge, the first of them so many spacings inside of the scene's bounds.
    pub(super) fn as_wide_as(&self, level: u32, probes: u32, outer_layer: f32) -> Self {
        let gaps = |probes: u32, outer: f32| probes as f32 - 1.0 + 2.0 * outer;
        let spacing = self.finest * (1 << level.min(self.levels - 1)) as f32;
        Layout {
            outer_layer,
            finest: spacing * gaps(self.probes, self.outer_layer) / gaps(probes, outer_layer),
            probes,
            levels: 1,
            ..*self
        }
    }

    /// The levels for a camera at `eye` (m), finest first. The camera is in the middle, unless a
    /// level would then reach beyond the scene: in that case it stays at the scene's border. Levels
    /// move from probe to probe.
    pub fn windows(&self, eye: Vec3) -> Vec<Window> {
        let level = |level: u32| self.window(eye, self.finest * (1 << level) as f32);
        (0..self.levels).map(level).collect()
    }

    fn window(&self, eye: Vec3, spacing: f32) -> Window {
        let (low, high) = self.bounds;
        let (mut first, mut counts, mut open) = (IVec3::ZERO, UVec3::ZERO, 0);
        let mut origin = low + self.outer_layer * spacing;
        for axis in 0..3 {
            // Probes along the scene; the last is as far inside as the first, or farther out.
            let gaps = (high[axis] - low[axis]) / spacing - 2.0 * self.outer_layer;
            let all = (gaps - 1e-3).ceil() as i32 + 1;
            // A plane has room on both sides.
            if all <= 2 {
                origin[axis] = 0.5 * (low[axis] + high[axis]) - 0.5 * spacing;
            }
            let all = all.max(2);
            let count = all.min(self.probes.cast_signed());
            let middle = (eye[axis] - origin[axis]) / spacing;
            let centred = (middle - 0.5 * (count - 1) as f32).round();
            first[axis] = (centred as i32).clamp(0, all - count);
            counts[axis] = count.cast_unsigned();
            open |= u32::from(first[axis] > 0) << (2 * axis);
            open |= u32::from(first[axis] < all - count) << (2 * axis + 1);
        }
        Window {
            origin,
            first,
            lattice: Lattice {
                first: place_of(origin, first, spacing),
                spacing: Vec3::splat(spacing),
                counts,
            },
            open,
        }
    }
}

/// Where a probe of a lattice is, wherever its window begins (m).
fn place_of(origin: Vec3, at: IVec3, spacing: f32) -> Vec3 {
    origin + at.as_vec3() * spacing
}

impl Window {
    /// A probe of it, by its place in the unbounded lattice.
    pub fn at(&self, probe: u32) -> IVec3 {
        self.first + self.lattice.at(probe).as_ivec3()
    }

    /// xyz: where the probe at a place of the unbounded lattice stands (m); w: spacing (m).
    pub fn home(&self, at: IVec3) -> Vec4 {
        let spacing = self.lattice.spacing.x;
        place_of(self.origin, at, spacing).extend(spacing)
    }

    /// The probe at a place of the unbounded lattice, if it is in the window.
    pub fn find(&self, at: IVec3) -> Option<u32> {
        let within = at - self.first;
        let counts = self.lattice.counts.as_ivec3();
        let is_there = within.cmpge(IVec3::ZERO).all() && within.cmplt(counts).all();
        is_there.then(|| self.lattice.index(within.as_uvec3()))
    }
}
