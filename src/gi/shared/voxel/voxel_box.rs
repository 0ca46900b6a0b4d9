//! Boxes of voxels.

use glam::IVec3;

/// Voxels of a grid from `low` on, up to but without `end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VoxelBox {
    /// Coordinates of the first voxel.
    pub low: IVec3,
    /// One beyond the last.
    pub end: IVec3,
}

impl VoxelBox {
    /// The box without voxels.
    pub const NONE: VoxelBox = VoxelBox {
        low: IVec3::ZERO,
        end: IVec3::ZERO,
    };

    /// A cube of `edge` voxels along each axis.
    pub fn cube(low: IVec3, edge: u32) -> Self {
        VoxelBox {
            low,
            end: low + IVec3::splat(edge as i32),
        }
    }

    /// What both have.
    pub fn cut(self, other: VoxelBox) -> Self {
        VoxelBox {
            low: self.low.max(other.low),
            end: self.end.min(other.end),
        }
    }

    /// The smallest box that holds both.
    pub fn around(self, other: VoxelBox) -> Self {
        match (self.is_empty(), other.is_empty()) {
            (true, _) => other,
            (_, true) => self,
            _ => VoxelBox {
                low: self.low.min(other.low),
                end: self.end.max(other.end),
            },
        }
    }

    /// The voxels of twice the size that it touches.
    pub fn coarser(self) -> Self {
        VoxelBox {
            low: self.low >> 1,
            end: (self.end + 1) >> 1,
        }
    }

    /// How many voxels it has along each axis.
    pub fn size(self) -> IVec3 {
        self.end - self.low
    }

    /// Whether there is no voxel in it.
    pub fn is_empty(self) -> bool {
        self.low.cmpge(self.end).any()
    }

    /// The part of this box that is not in `other`: at most six boxes that share no voxel.
    pub fn without(self, other: VoxelBox) -> Vec<VoxelBox> {
        let common = self.cut(other);
        if common.is_empty() {
            return if self.is_empty() {
                Vec::new()
            } else {
                vec![self]
            };
        }
        let (mut rest, mut parts) = (self, Vec::new());
        for axis in 0..3 {
            let (mut below, mut above) = (rest, rest);
            below.end[axis] = common.low[axis];
            above.low[axis] = common.end[axis];
            (rest.low[axis], rest.end[axis]) = (common.low[axis], common.end[axis]);
            parts.extend([below, above].into_iter().filter(|part| !part.is_empty()));
        }
        parts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every voxel of a box is in the other one, or in exactly one of the parts that are left
    /// without it.
    #[test]
    fn what_is_left_of_a_box_is_disjoint_and_complete() {
        let whole = VoxelBox::cube(IVec3::ZERO, 4);
        let corners = [-1, 0, 1, 3, 4, 5];
        for low in corners
            .iter()
            .flat_map(|x| corners.map(|y| IVec3::new(*x, y, 1)))
        {
            for end in corners.map(|end| low + IVec3::new(end, 2, end.min(3))) {
                let other = VoxelBox { low, end };
                let parts = whole.without(other);
                for index in 0..64 {
                    let voxel = VoxelBox::cube(IVec3::new(index % 4, index / 4 % 4, index / 16), 1);
                    let found = parts
                        .iter()
                        .filter(|part| !part.cut(voxel).is_empty())
                        .count();
                    assert_eq!(
                        found,
                        usize::from(other.cut(voxel).is_empty()),
                        "{voxel:?} of {other:?}: {parts:?}"
                    );
                }
            }
        }
    }
}
