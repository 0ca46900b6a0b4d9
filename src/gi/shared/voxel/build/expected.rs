//! How many fragments a list has to have room for, before any is made.

use glam::Vec3;
use rayon::prelude::*;

use super::settings::Surface;
use crate::gi::shared::voxel::{VoxelBox, VoxelGrid};
use crate::scene::{Batch, Scene};

/// Room beyond what is expected: a part of it, and so many standard deviations.
const SLACK: f64 = 1.0 / 32.0;
const DEVIATIONS: f64 = 4.0;

/// Triangles that one thread takes at once.
const AT_ONCE: usize = 1024;

/// Fragments of some triangles in a box of a grid: about as many as there will be, and seldom
/// fewer.
///
/// The grid may lie anywhere. Over all places a convex body K touches as many voxels on average as
/// the Minkowski sum of K and a voxel has volume: with K in voxels and flat, Σ A + Σ e + 1, where A
/// is what is seen of it along each axis and e what it extends (Schneider 2014, section 5.1).
pub(super) fn room_for_fragments(
    scene: &Scene,
    batches: &[Batch],
    grid: VoxelGrid,
    clip: VoxelBox,
    surface: Surface,
) -> u32 {
    let inside = [clip.low.as_vec3(), clip.end.as_vec3()];
    let runs = batches.iter().flat_map(|batch| {
        let first = batch.first_triangle as usize;
        let triangles = &scene.triangles[first..first + batch.triangle_count as usize];
        triangles.chunks(AT_ONCE)
    });
    let runs: Vec<_> = runs.collect();
    // Added up in their order: the same scene has the same room.
    let sums: Vec<[f64; 2]> = (runs.into_par_iter().map(|triangles| {
        let mut sums = [0.0f64; 2];
        for triangle in triangles {
            let corner = |vertex: u32| {
                let position = Vec3::from(scene.vertices[vertex as usize].position);
                (position - grid.origin) / grid.voxel_size
            };
            let [mean, spread] = expected(triangle.vertices.map(corner), inside, surface);
            sums[0] += f64::from(mean);
            sums[1] += f64::from(spread * spread);
        }
        sums
    }))
    .collect();
    let [mean, variance] = [0, 1].map(|of| sums.iter().map(|sums| sums[of]).sum::<f64>());
    room(mean, variance)
}

fn room(mean: f64, variance: f64) -> u32 {
    ((1.0 + SLACK) * mean + DEVIATIONS * variance.sqrt()).ceil() as u32
}

/// Voxels that a triangle is expected to touch in a box, and by about how many that may be wrong.
fn expected(corners: [Vec3; 3], inside: [Vec3; 2], surface: Surface) -> [f32; 2] {
    let [a, b, c] = corners;
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    if high.cmplt(inside[0]).any() || low.cmpgt(inside[1]).any() {
        return [0.0; 2];
    }
    if low.cmpge(inside[0]).all() && high.cmple(inside[1]).all() {
        return touched((b - a).cross(c - a), high - low, surface);
    }
    let cut = cut_to_box(&corners, inside);
    let Some(first) = cut.first() else {
        return [0.0; 2];
    };
    let doubled = (cut.windows(2)).fold(Vec3::ZERO, |sum, edge| {
        sum + (edge[0] - first).cross(edge[1] - first)
    });
    let low = cut.iter().copied().fold(*first, Vec3::min);
    let high = cut.iter().copied().fold(*first, Vec3::max);
    touched(doubled, high - low, surface)
}

/// From twice the area across each axis, and the extent along each.
fn touched(doubled: Vec3, extent: Vec3, surface: Surface) -> [f32; 2] {
    let (area, around) = (0.5 * doubled.abs(), extent.element_sum());
    let across = match surface {
        Surface::Conservative | Surface::Solid => area.element_sum(),
        // One voxel thick along its dominant axis; less than the rest around its outline.
        Surface::Thin => area.max_element(),
    };
    [across + around + 1.0, 0.5 * around + 1.0]
}

/// What of a convex polygon is in a box (Sutherland & Hodgman 1974).
fn cut_to_box(corners: &[Vec3], [low, high]: [Vec3; 2]) -> Vec<Vec3> {
    let mut polygon = corners.to_vec();
    for axis in 0..3 {
        for (side, at) in [(1.0, low[axis]), (-1.0, high[axis])] {
            let depth = |point: Vec3| side * (point[axis] - at);
            let mut cut = Vec::with_capacity(polygon.len() + 1);
            for (at, &own) in polygon.iter().enumerate() {
                let next = polygon[(at + 1) % polygon.len()];
                let (here, there) = (depth(own), depth(next));
                if here >= 0.0 {
                    cut.push(own);
                }
                if (here >= 0.0) != (there >= 0.0) {
                    cut.push(own.lerp(next, here / (here - there)));
                }
            }
            polygon = cut;
        }
    }
    polygon
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gi::shared::voxel::oracle::candidates;

    const RESOLUTION: u32 = 32;

    /// Triangles of a size (voxels), in a cube of `across` voxels around the middle of the grid.
    fn random(count: usize, size: f32, across: f32) -> Vec<[Vec3; 3]> {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (state >> 8) as f32 / 16_777_216.0 - 0.5
        };
        let mut point = |size: f32| size * Vec3::new(next(), next(), next());
        let triangle = |_| {
            let middle = Vec3::splat(0.5 * RESOLUTION as f32) + point(across);
            [(); 3].map(|()| middle + point(size))
        };
        (0..count).map(triangle).collect()
    }

    /// Two triangles of a wall that stands square to the axes.
    fn wall(at: f32, size: f32) -> Vec<[Vec3; 3]> {
        let corner = |x: f32, y: f32| Vec3::new(3.3 + x * size, 5.1 + y * size, at);
        let [a, b, c, d] =
            [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| corner(x, y));
        vec![[a, b, c], [a, c, d]]
    }

    #[test]
    fn there_is_room_for_what_the_oracle_counts() {
        let whole = VoxelBox::cube(glam::IVec3::ZERO, RESOLUTION);
        let part = VoxelBox {
            low: glam::IVec3::new(8, 4, 12),
            end: glam::IVec3::new(24, 28, 20),
        };
        for (name, triangles) in [
            ("dust", random(3000, 0.05, 20.0)),
            ("small", random(2000, 1.5, 20.0)),
            ("large", random(60, 20.0, 10.0)),
            ("out of the grid", random(100, 60.0, 40.0)),
            ("a wall", wall(7.4, 21.6)),
            ("nothing", Vec::new()),
        ] {
            for (clip, surface) in [whole, part].into_iter().flat_map(|clip| {
                [Surface::Conservative, Surface::Thin].map(|surface| (clip, surface))
            }) {
                let inside = [clip.low.as_vec3(), clip.end.as_vec3()];
                let (mut mean, mut variance, mut counted) = (0.0, 0.0, 0);
                for corners in &triangles {
                    let [one, spread] = expected(*corners, inside, surface).map(f64::from);
                    (mean, variance) = (mean + one, variance + spread * spread);
                    let all = candidates(corners.map(Into::into), RESOLUTION, 0.0, surface);
                    let is_counted = |one: &&crate::gi::shared::voxel::oracle::Candidate| {
                        let voxel = glam::UVec3::from(one.voxel).as_ivec3();
                        one.separation <= 0.0
                            && voxel.cmpge(clip.low).all()
                            && voxel.cmplt(clip.end).all()
                    };
                    counted += all.iter().filter(is_counted).count() as u32;
                }
                let room = room(mean, variance);
                println!("{name}, {surface:?}: {counted} counted, {mean:.0} expected, room {room}");
                assert!(room >= counted, "{name}, {surface:?}: {room} for {counted}");
                let most = if surface == Surface::Thin { 2.0 } else { 1.1 };
                let most = most * f64::from(counted) + 2.0 * DEVIATIONS * variance.sqrt();
                assert!(
                    f64::from(room) <= most,
                    "{name}, {surface:?}: {room} for {counted}"
                );
            }
        }
    }
}
