//! Which voxels a triangle touches.

use glam::DVec3;

use super::{GridTriangle, VoxelIndex, corner_of, doubles};
use crate::gi::shared::voxel::Surface;

/// One separating axis: a direction and the interval that the triangle covers along it.
struct Axis {
    direction: DVec3,
    low: f64,
    high: f64,
}

impl Axis {
    fn new(direction: DVec3, triangle: [DVec3; 3]) -> Axis {
        let along = triangle.map(|vertex| direction.dot(vertex));
        Axis {
            direction,
            low: along[0].min(along[1]).min(along[2]),
            high: along[0].max(along[1]).max(along[2]),
        }
    }

    /// Gap between triangle and box, or the box's cross, \[voxels\]; negative is overlap. Divided
    /// by the axis' length last, so that exact inputs touch exactly.
    fn gap(&self, voxel: VoxelIndex, surface: Surface) -> f64 {
        let centre = self.direction.dot(corner_of(voxel) + 0.5);
        let radius = match surface {
            Surface::Conservative | Surface::Solid => 0.5 * self.direction.abs().element_sum(),
            Surface::Thin => 0.5 * self.direction.abs().max_element(),
        };
        (self.low - (centre + radius)).max((centre - radius) - self.high) / self.direction.length()
    }
}

/// The axes of the separating axis theorem for a triangle and a box: three faces, the triangle's
/// plane, nine cross products of edges (Gottschalk et al. 1996; Akenine-Möller 2001). A cross
/// product that vanishes separates nothing that the others do not.
fn separating_axes(triangle: [DVec3; 3]) -> Vec<Axis> {
    let [a, b, c] = triangle;
    let edges = [b - a, c - b, a - c];
    let crossed = edges
        .iter()
        .flat_map(|edge| DVec3::AXES.map(|axis| axis.cross(*edge)));
    let directions = DVec3::AXES
        .into_iter()
        .chain([(b - a).cross(c - a)])
        .chain(crossed);
    directions
        .filter(|direction| *direction != DVec3::ZERO)
        .map(|direction| Axis::new(direction, triangle))
        .collect()
}

/// Whether the triangle has no area as the GPU sees it: its cross product, in f32, is zero. Such a
/// triangle is skipped.
pub fn is_degenerate(triangle: GridTriangle) -> bool {
    let [a, b, c] = triangle;
    let ab: [f32; 3] = std::array::from_fn(|axis| b[axis] - a[axis]);
    let ac: [f32; 3] = std::array::from_fn(|axis| c[axis] - a[axis]);
    let component = |i: usize, j: usize| ab[i] * ac[j] - ab[j] * ac[i];
    component(1, 2) == 0.0 && component(2, 0) == 0.0 && component(0, 1) == 0.0
}

/// A voxel near a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// The voxel that may touch the triangle.
    pub voxel: VoxelIndex,
    /// Largest gap between closed triangle and closed box (or its cross) over the 13 axes, along
    /// unit vectors \[voxels\]: touching is ≤ 0. A lower bound of the distance where positive,
    /// the depth of the overlap where negative.
    pub separation: f64,
}

/// All voxels of the grid that meet the triangle's bounding box enlarged by `reach` voxels, each
/// with its separation (of a thin surface, from its cross); none for a degenerate triangle.
/// Two implementations may disagree only where |separation| is within their rounding.
pub fn candidates(
    triangle: GridTriangle,
    resolution: u32,
    reach: f64,
    surface: Surface,
) -> Vec<Candidate> {
    let mut found = Vec::new();
    if is_degenerate(triangle) {
        return found;
    }
    let axes = separating_axes(doubles(triangle));
    // The closed box [i, i + 1] meets [low, high] where i ≥ ⌈low⌉ − 1 and i ≤ ⌊high⌋.
    let range = |axis: usize| {
        let along = triangle.map(|vertex| f64::from(vertex[axis]));
        let low = along[0].min(along[1]).min(along[2]) - reach;
        let high = along[0].max(along[1]).max(along[2]) + reach;
        (low.ceil() as i64 - 1).max(0)..=(high.floor() as i64).min(i64::from(resolution) - 1)
    };
    for x in range(0) {
        for y in range(1) {
            for z in range(2) {
                let voxel = [x as u32, y as u32, z as u32];
                let separation = axes
                    .iter()
                    .map(|axis| axis.gap(voxel, surface))
                    .fold(f64::NEG_INFINITY, f64::max);
                found.push(Candidate { voxel, separation });
            }
        }
    }
    found
}

/// The voxels that the closed triangle touches, as closed boxes, in ascending order; none for a
/// degenerate triangle.
pub fn touched_voxels(triangle: GridTriangle, resolution: u32) -> Vec<VoxelIndex> {
    candidates(triangle, resolution, 0.0, Surface::Conservative)
        .into_iter()
        .filter(|candidate| candidate.separation <= 0.0)
        .map(|candidate| candidate.voxel)
        .collect()
}
