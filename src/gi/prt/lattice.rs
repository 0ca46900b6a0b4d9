//! The points that transfer is kept at: a lattice on the scene's own triangles.
//!
//! A triangle whose longest edge is e is cut into k² cells, k = ⌈e/d⌉. Lattice points of neighbours
//! are one where they have one place, one shading normal and one side.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use crate::scene::Scene;
use crate::scene::rays::corners;
use crate::scene::surfaces::offset_m;

/// No nodes: a triangle without area, or a side that nothing sees.
pub const NONE: u32 = u32::MAX;

/// A place where light is transferred to.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Point {
    /// On the surface, moved inwards from the border of what it belongs to (m).
    pub position: Vec3,
    /// Unit shading normal, on its side.
    pub normal: Vec3,
    /// Unit geometric normal, the mean of its triangles' on its side.
    pub geometric: Vec3,
    /// Unit, along the first edge of its first triangle: what its rays are turned with.
    pub along: Vec3,
    /// How far off the surface rays start (m).
    pub offset_m: f32,
}

/// Where the nodes of a triangle are in [`Lattice::nodes`], as shaders read it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct TriangleNodes {
    /// The first node of its front, and of its back; [`NONE`] where the side has none.
    pub first: [u32; 2],
    /// Cells along an edge.
    pub cells: u32,
    /// Makes rows of 16 bytes.
    pub padding: u32,
}

/// All points, and which of them are at the nodes of each triangle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lattice {
    /// In the order of triangles.
    pub points: Vec<Point>,
    /// The point at each node.
    pub nodes: Vec<u32>,
    /// A row a triangle.
    pub triangles: Vec<TriangleNodes>,
    /// In the order of points.
    pub hanging: Vec<Hanging>,
}

/// A point on an edge that a coarser triangle shares: it has what the coarser one has there.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Hanging {
    /// The point.
    pub point: u32,
    /// The points on both sides of it that the coarser triangle has.
    pub between: [u32; 2],
    /// The share of the second.
    pub share: f32,
}

/// How a lattice is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatticeSettings {
    /// Longest cell (m).
    pub cell_m: f32,
    /// Which part of the way points move to the mean centroid of their cells.
    pub inset: f32,
    /// How finer cells are made where light differs.
    pub refine: Refine,
}

/// Where cells are halved: in triangles whose points differ in what light they get.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refine {
    /// Times that cells may be halved.
    pub levels: u32,
    /// The largest difference within a cell, as part of what a point in the open gets.
    pub difference: f32,
    /// No more are halved where there would be more nodes than these.
    pub most_nodes: u64,
}

/// Nodes of a triangle that is cut into `cells`² cells.
fn node_count(cells: u32) -> u32 {
    (cells + 1) * (cells + 2) / 2
}

/// The node of a triangle that is `i` cells towards its second corner and `j` towards its third.
pub(super) fn node(cells: u32, i: u32, j: u32) -> u32 {
    j * (2 * cells + 3 - j) / 2 + i
}

/// Cells along an edge of each triangle, before any are halved; 0 where it has no area.
pub(super) fn cells_of(scene: &Scene, cell_m: f32) -> impl Iterator<Item = u32> + '_ {
    (0..scene.triangles.len()).map(move |triangle| {
        let [a, b, c] = corners(scene, &scene.triangles[triangle]);
        if (b - a).cross(c - a).length_squared() == 0.0 {
            return 0;
        }
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        (longest / cell_m).ceil().clamp(1.0, 4096.0) as u32
    })
}

/// Nodes of all triangles, one side, before any are one point.
pub(super) fn count_nodes(scene: &Scene, cell_m: f32) -> u64 {
    let cells: Vec<u32> = cells_of(scene, cell_m).collect();
    nodes_of(&cells)
}

/// The same of triangles that have so many cells along an edge.
pub(super) fn nodes_of(cells: &[u32]) -> u64 {
    let own = cells.iter().filter(|cells| **cells > 0);
    own.map(|cells| u64::from(node_count(*cells))).sum()
}

/// A place of the lattice: position and shading normal, as bits.
type Place = [u32; 6];

/// Sums over the cells at a point.
#[derive(Default)]
struct Around {
    centroids: DVec3,
    geometric: DVec3,
    cells: u32,
}

impl Lattice {
    /// Cuts all triangles, each into so many cells along an edge. `has_back` says of a triangle
    /// whether its back is seen.
    pub(super) fn new(
        scene: &Scene,
        inset: f32,
        cells: &[u32],
        has_back: impl Fn(usize) -> bool,
    ) -> Self {
        let mut lattice = Lattice::default();
        let mut around: Vec<Around> = Vec::new();
        let mut known: HashMap<Place, u32> = HashMap::new();
        for (triangle, &cells) in cells.iter().enumerate() {
            let mut row = TriangleNodes {
                first: [NONE; 2],
                cells: cells.max(1),
                padding: 0,
            };
            if cells > 0 {
                for side in 0..1 + usize::from(has_back(triangle)) {
                    row.first[side] = lattice.nodes.len() as u32;
                    lattice.cut(scene, (triangle, side == 1), cells, &mut around, &mut known);
                }
            }
            lattice.triangles.push(row);
        }
        for (point, around) in lattice.points.iter_mut().zip(&around) {
            let mean = around.geometric.normalize_or(point.geometric.as_dvec3());
            point.geometric = mean.as_vec3();
            // Along the surface: off a bent one the centroid would be inside the body.
            let centroid = around.centroids / f64::from(around.cells.max(1));
            let way = (centroid - point.position.as_dvec3()).reject_from_normalized(mean);
            point.position += (f64::from(inset) * way).as_vec3();
        }
        lattice.hanging = lattice.find_hanging();
        lattice
    }

    fn cut(
        &mut self,
        scene: &Scene,
        (triangle, is_back): (usize, bool),
        cells: u32,
        around: &mut Vec<Around>,
        known: &mut HashMap<Place, u32>,
    ) {
        let vertices = scene.triangles[triangle].vertices;
        let positions = corners(scene, &scene.triangles[triangle]);
        let normals = vertices.map(|vertex| Vec3::from(scene.vertices[vertex as usize].normal));
        let [a, b, c] = positions;
        let sign = if is_back { -1.0 } else { 1.0 };
        let geometric = sign * (b - a).cross(c - a).normalize();
        let first = self.nodes.len();
        for j in 0..=cells {
            for i in 0..=cells - j {
                let weights = [cells - i - j, i, j];
                let position = between(positions, weights, cells);
                let mut normal = between(normals, weights, cells).normalize_or(geometric);
                if normal.dot(geometric) < 0.0 {
                    normal = -normal;
                }
                let key = [position, (1024.0 * normal).round()];
                // −0 and 0 are one.
                let key = key.map(|of| (of + Vec3::ZERO).to_array().map(f32::to_bits));
                let [[x, y, z], [nx, ny, nz]] = key;
                let point = *known.entry([x, y, z, nx, ny, nz]).or_insert_with(|| {
                    self.points.push(Point {
                        position,
                        normal,
                        geometric,
                        along: (b - a).normalize_or(Vec3::X),
                        offset_m: offset_m(positions),
                    });
                    around.push(Around::default());
                    self.points.len() as u32 - 1
                });
                self.nodes.push(point);
            }
        }
        let at = |i, j| self.nodes[first + node(cells, i, j) as usize] as usize;
        for j in 0..cells {
            for i in 0..cells - j {
                let lower = [[i, j], [i + 1, j], [i, j + 1]];
                let upper = [[i + 1, j], [i + 1, j + 1], [i, j + 1]];
                let both = [Some(lower), (i + j + 2 <= cells).then_some(upper)];
                for cell in both.into_iter().flatten() {
                    let middle = cell.iter().map(|[i, j]| {
                        between(positions, [cells - i - j, *i, *j], cells).as_dvec3()
                    });
                    let centroid = middle.sum::<DVec3>() / 3.0;
                    for [i, j] in cell {
                        let own = &mut around[at(i, j)];
                        own.centroids += centroid;
                        own.geometric += geometric.as_dvec3();
                        own.cells += 1;
                    }
                }
            }
        }
    }

    /// The points around a place of a triangle, and their shares; `None` where the side has none.
    pub fn at(&self, triangle: u32, is_back: bool, [u, v]: [f32; 2]) -> Option<[(u32, f32); 3]> {
        let TriangleNodes { first, cells, .. } = self.triangles[triangle as usize];
        let first = first[usize::from(is_back)];
        if first == NONE {
            return None;
        }
        let corners = cell_at(cells, [u, v]);
        Some(corners.map(|(i, j, share)| (self.nodes[(first + node(cells, i, j)) as usize], share)))
    }

    /// Points on edges between two others of the edge, where a triangle that shares it has those
    /// two alone: cells are halved there, so its points are among those of the finer one.
    fn find_hanging(&self) -> Vec<Hanging> {
        let mut edges: HashMap<[u32; 2], u32> = HashMap::new();
        let sides = || {
            self.triangles.iter().flat_map(|row| {
                let first = row.first.into_iter().filter(|first| *first != NONE);
                first.map(|first| (row.cells, first))
            })
        };
        for (cells, first) in sides() {
            for edge in self.edges(cells, first) {
                let coarsest = edges.entry(key_of(&edge)).or_insert(cells);
                *coarsest = cells.min(*coarsest);
            }
        }
        let mut found: Vec<Hanging> = Vec::new();
        for (cells, first) in sides() {
            for edge in self.edges(cells, first) {
                let coarsest = edges[&key_of(&edge)];
                if coarsest == cells || !cells.is_multiple_of(coarsest) {
                    continue;
                }
                let step = (cells / coarsest) as usize;
                for (at, point) in edge.iter().enumerate().filter(|(at, _)| at % step != 0) {
                    let low = at / step * step;
                    found.push(Hanging {
                        point: *point,
                        between: [edge[low], edge[low + step]],
                        share: (at - low) as f32 / step as f32,
                    });
                }
            }
        }
        found.sort_by_key(|hanging| hanging.point);
        found.dedup_by_key(|hanging| hanging.point);
        found
    }

    /// The points along each edge of a side of a triangle.
    fn edges(&self, cells: u32, first: u32) -> [Vec<u32>; 3] {
        let at = |i, j| self.nodes[(first + node(cells, i, j)) as usize];
        [
            (0..=cells).map(|i| at(i, 0)).collect(),
            (0..=cells).map(|j| at(0, j)).collect(),
            (0..=cells).map(|i| at(i, cells - i)).collect(),
        ]
    }

    /// How much of the surface each point is for: a third of each cell around it (m²).
    pub(super) fn areas_m2(&self, scene: &Scene) -> Vec<f64> {
        let mut areas_m2 = vec![0.0; self.points.len()];
        for (row, triangle) in self.triangles.iter().zip(&scene.triangles) {
            let [a, b, c] = corners(scene, triangle);
            let cells = f64::from(row.cells * row.cells);
            let third_m2 = f64::from((b - a).cross(c - a).length()) / (6.0 * cells);
            for first in row.first.into_iter().filter(|first| *first != NONE) {
                for j in 0..=row.cells {
                    for i in 0..=row.cells - j {
                        // Corners have one cell of the triangle around them, edges three.
                        let k = row.cells - i - j;
                        let edges = [i, j, k].iter().filter(|at| **at == 0).count();
                        let around = [6.0, 3.0, 1.0][edges.min(2)];
                        let point = self.nodes[(first + node(row.cells, i, j)) as usize];
                        areas_m2[point as usize] += around * third_m2;
                    }
                }
            }
        }
        areas_m2
    }

    /// The points that share a cell with each, in the order of their numbers.
    pub(super) fn neighbours(&self) -> Vec<Vec<u32>> {
        let mut all = vec![Vec::new(); self.points.len()];
        let mut join = |cell: [u32; 3]| {
            for [own, other] in [[0, 1], [1, 2], [2, 0]].map(|pair| pair.map(|at| cell[at])) {
                all[own as usize].push(other);
                all[other as usize].push(own);
            }
        };
        for row in &self.triangles {
            for first in row.first.into_iter().filter(|first| *first != NONE) {
                let at = |i, j| self.nodes[(first + node(row.cells, i, j)) as usize];
                for j in 0..row.cells {
                    for i in 0..row.cells - j {
                        join([at(i, j), at(i + 1, j), at(i, j + 1)]);
                        if i + j + 2 <= row.cells {
                            join([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                        }
                    }
                }
            }
        }
        for of in &mut all {
            of.sort_unstable();
            of.dedup();
        }
        all
    }
}

/// What an edge is known by: the points at its ends.
fn key_of(edge: &[u32]) -> [u32; 2] {
    let ends = [edge[0], edge[edge.len() - 1]];
    [ends[0].min(ends[1]), ends[0].max(ends[1])]
}

/// Interpolated by whole shares. Along an edge both of its triangles get the same, bit by bit.
fn between(corners: [Vec3; 3], weights: [u32; 3], cells: u32) -> Vec3 {
    let mut terms: Vec<(Vec3, u32)> = corners.into_iter().zip(weights).collect();
    terms.retain(|(_, weight)| *weight > 0);
    if let [(corner, _)] = terms[..] {
        return corner;
    }
    terms.sort_by(|(a, _), (b, _)| {
        let order = |v: &Vec3| v.to_array().map(|x| x + 0.0);
        let (a, b) = (order(a), order(b));
        a.partial_cmp(&b).unwrap_or(std::cmp::Ordering::Equal)
    });
    let sum = terms
        .iter()
        .map(|(corner, weight)| corner.as_dvec3() * f64::from(*weight))
        .sum::<DVec3>();
    (sum / f64::from(cells)).as_vec3()
}

/// The three nodes around barycentric coordinates, by their steps, and their shares
/// (`gi/prt/lattice.glsl`).
pub(super) fn cell_at(cells: u32, [u, v]: [f32; 2]) -> [(u32, u32, f32); 3] {
    let n = cells as f32;
    let (x, y) = ((u * n).clamp(0.0, n), (v * n).clamp(0.0, n));
    // The last cell along a row may be a half one: it has a lower triangle alone.
    let j = (y as u32).min(cells - 1);
    let i = (x as u32).min(cells - 1 - j);
    let (fx, fy) = (x - i as f32, y - j as f32);
    let has_upper = i + j + 2 <= cells;
    if fx + fy <= 1.0 || !has_upper {
        let (fx, fy) = (fx.clamp(0.0, 1.0), fy.clamp(0.0, 1.0));
        let rest = (1.0 - fx - fy).max(0.0);
        let all = rest + fx + fy;
        [
            (i, j, rest / all),
            (i + 1, j, fx / all),
            (i, j + 1, fy / all),
        ]
    } else {
        [
            (i + 1, j, 1.0 - fy),
            (i + 1, j + 1, fx + fy - 1.0),
            (i, j + 1, 1.0 - fx),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles with one to seven cells along an edge, each third one with its back.
    #[test]
    fn points_share_all_of_the_surface() {
        let Ok(scene) = Scene::bundled("cornell", &[]) else {
            panic!("a bundled scene")
        };
        let count = scene.triangles.len();
        let cells: Vec<u32> = (0..count).map(|at| 1 + at as u32 % 7).collect();
        let has_back = |triangle: usize| triangle.is_multiple_of(3);
        let lattice = Lattice::new(&scene, 0.1, &cells, has_back);
        let expected: f64 = (0..count)
            .map(|at| {
                let [a, b, c] = corners(&scene, &scene.triangles[at]);
                let sides = if has_back(at) { 1.0 } else { 0.5 };
                f64::from((b - a).cross(c - a).length()) * sides
            })
            .sum();
        let areas_m2 = lattice.areas_m2(&scene);
        let sum: f64 = areas_m2.iter().sum();
        assert!((sum / expected - 1.0).abs() < 1e-12, "{sum} of {expected}");
        assert!(areas_m2.iter().all(|area_m2| *area_m2 > 0.0));
    }
}
