//! Which voxels lie inside of closed bodies: the twin of `voxel.columns`.

use glam::DVec2;

use super::{Grid, VoxelIndex, corners, doubles};
use crate::scene::Scene;

/// Where a column meets a surface \[voxels\], and whether that looks ahead along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Met {
    /// Along the column.
    pub place: f64,
    /// The body ends here.
    pub is_back: bool,
    /// Index into [`Scene::triangles`].
    pub triangle: usize,
}

/// Surfaces that are nearer to each other are at one place \[voxels\].
const SAME: f64 = 2e-4;

/// The surfaces that a line along an axis meets, in their order; `at`: its place along the two axes
/// that follow.
pub fn met_by_column(scene: &Scene, grid: &Grid, axis: usize, at: DVec2) -> Vec<Met> {
    let (across, up) = ((axis + 1) % 3, (axis + 2) % 3);
    let meets = |index: usize| {
        let at_corners = doubles(grid.triangle(scene, index));
        let flat = at_corners.map(|corner| DVec2::new(corner[across], corner[up]) - at);
        let areas = [0, 1, 2].map(|i| flat[(i + 1) % 3].perp_dot(flat[(i + 2) % 3]));
        let area: f64 = areas.iter().sum();
        let is_met = area != 0.0 && areas.iter().all(|part| part * area >= 0.0);
        let place: f64 = (areas.iter().zip(at_corners))
            .map(|(part, corner)| part / area * corner[axis])
            .sum();
        is_met.then_some(Met {
            place,
            is_back: area > 0.0,
            triangle: index,
        })
    };
    let mut all: Vec<Met> = (0..scene.triangles.len()).filter_map(meets).collect();
    all.sort_by(|a, b| a.place.total_cmp(&b.place));
    let corners_of = |met: &Met| {
        let mut corners = corners(scene, met.triangle).map(|vertex| vertex.position);
        corners.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
        corners
    };
    let mut index = 1;
    while index < all.len() {
        let [first, second] = [all[index - 1], all[index]];
        if second.place > first.place + SAME {
            index += 1;
        } else if corners_of(&first) == corners_of(&second) {
            // A sheet of two sides bounds nothing.
            all.drain(index - 1..=index);
        } else {
            // A body begins where another ends.
            if second.is_back {
                all.swap(index - 1, index);
            }
            index += 2;
        }
    }
    all
}

/// Off the middles of voxels, where columns are \[voxels\].
pub const COLUMN_OFFSET: DVec2 = DVec2::new(0.0137, -0.0071);

/// The voxels whose middles lie between a surface that looks back and the next, which looks ahead,
/// along each axis. `offset`: of the columns from the middles \[voxels\].
pub fn interior(scene: &Scene, grid: &Grid, offset: DVec2) -> Vec<VoxelIndex> {
    let n = grid.resolution;
    let mut along = vec![0u8; (n as usize).pow(3)];
    let index = |voxel: VoxelIndex| ((voxel[2] * n + voxel[1]) * n + voxel[0]) as usize;
    for axis in 0..3 {
        for column in 0..n * n {
            let [u, v] = [column % n, column / n];
            let middle = DVec2::new(f64::from(u), f64::from(v)) + 0.5;
            let met = met_by_column(scene, grid, axis, middle + offset);
            for body in met
                .windows(2)
                .filter(|two| !two[0].is_back && two[1].is_back)
            {
                for at in 0..n {
                    let place = f64::from(at) + 0.5;
                    if (body[0].place..body[1].place).contains(&place) {
                        let mut voxel = [0; 3];
                        (voxel[axis], voxel[(axis + 1) % 3], voxel[(axis + 2) % 3]) = (at, u, v);
                        along[index(voxel)] |= 1 << axis;
                    }
                }
            }
        }
    }
    let all = (0..n.pow(3)).map(|i| [i % n, i / n % n, i / (n * n)]);
    all.filter(|voxel| along[index(*voxel)] == 7).collect()
}
