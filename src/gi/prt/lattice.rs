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
}

/// How a lattice is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatticeSettings {
    /// Longest cell (m).
    pub cell_m: f32,
    /// Which part of the way points move to the mean centroid of their cells.
    pub inset: f32,
}

/// Nodes of a triangle that is cut into `cells`² cells.
fn node_count(cells: u32) -> u32 {
    (cells + 1) * (cells + 2) / 2
}

/// The node of a triangle that is `i` cells towards its second corner and `j` towards its third.
pub(super) fn node(cells: u32, i: u32, j: u32) -> u32 {
    j * (2 * cells + 3 - j) / 2 + i
}

/// Cells along an edge of each triangle; 0 where it has no area.
fn cells_of(scene: &Scene, cell_m: f32) -> impl Iterator<Item = u32> + '_ {
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
    cells_of(scene, cell_m)
        .filter(|cells| *cells > 0)
        .map(|cells| u64::from(node_count(cells)))
        .sum()
}

/// Sums over the cells at a point.
#[derive(Default)]
struct Around {
    centroids: DVec3,
    geometric: DVec3,
    cells: u32,
}

impl Lattice {
    /// Cuts all triangles. `has_back` says of a triangle whether its back is seen.
    pub(super) fn new(
        scene: &Scene,
        settings: LatticeSettings,
        has_back: impl Fn(usize) -> bool,
    ) -> Self {
        let mut lattice = Lattice::default();
        let mut around: Vec<Around> = Vec::new();
        let mut known: HashMap<[u32; 6], u32> = HashMap::new();
        for (triangle, cells) in cells_of(scene, settings.cell_m).enumerate() {
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
            point.position += (f64::from(settings.inset) * way).as_vec3();
        }
        lattice
    }

    fn cut(
        &mut self,
        scene: &Scene,
        (triangle, is_back): (usize, bool),
        cells: u32,
        around: &mut Vec<Around>,
        known: &mut HashMap<[u32; 6], u32>,
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
