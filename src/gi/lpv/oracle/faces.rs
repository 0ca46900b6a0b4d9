//! Twin of `lpv.faces`: segments between the centres of cells against triangles.

use glam::{DVec2, DVec3, UVec3};

use crate::gi::lpv::CellGrid;
use crate::scene::Scene;

/// The opaque faces of cells, six bits each: −x, +x, −y, +y, −z, +z.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Crossings {
    /// Faces whose segment a triangle meets.
    pub opaque: Vec<u32>,
    /// Faces for which rounding decides: a triangle passes the segment or one of its ends closely.
    pub unsure: Vec<u32>,
}

/// How close an edge has to pass for rounding to decide (cells): rasterizers have 1/256 pixel.
const NEAR: f64 = 1.0 / 128.0;

/// Tests every segment between neighbours against every triangle. Masks do not count.
pub fn crossings(scene: &Scene, grid: &CellGrid) -> Crossings {
    let mut found = Crossings {
        opaque: vec![0; grid.count() as usize],
        unsure: vec![0; grid.count() as usize],
    };
    let place = |vertex: u32| {
        let position = scene.vertices[vertex as usize].position;
        (DVec3::from(position.map(f64::from)) - grid.corner().as_dvec3())
            / f64::from(grid.cell_size)
            - 0.5
    };
    for triangle in &scene.triangles {
        let corners = triangle.vertices.map(place);
        for axis in 0..3 {
            cross(&mut found, grid, corners, axis);
        }
    }
    found
}

/// The segments along an axis that a triangle meets; its corners are in cells from the centre of
/// the first.
fn cross(found: &mut Crossings, grid: &CellGrid, corners: [DVec3; 3], axis: usize) {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let flat = corners.map(|corner| DVec2::new(corner[u], corner[v]));
    let area = (flat[1] - flat[0]).perp_dot(flat[2] - flat[0]);
    let low = flat[0].min(flat[1]).min(flat[2]).floor();
    let high = flat[0].max(flat[1]).max(flat[2]).ceil();
    let range = |low: f64, high: f64, count: u32| {
        (low.max(0.0) as u32)..(high.max(-1.0) + 1.0).min(f64::from(count)) as u32
    };
    for row in range(low.x, high.x, grid.size[u]) {
        for column in range(low.y, high.y, grid.size[v]) {
            let point = DVec2::new(f64::from(row), f64::from(column));
            let edges = [0, 1, 2].map(|i| {
                let (from, to) = (flat[i], flat[(i + 1) % 3]);
                let length = (to - from).length().max(1e-12);
                area.signum() * (to - from).perp_dot(point - from) / length
            });
            let inside = edges.into_iter().fold(f64::MAX, f64::min);
            if inside < -NEAR || area == 0.0 {
                continue;
            }
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let across =
                (point.x - corners[0][u]) * normal[u] + (point.y - corners[0][v]) * normal[v];
            let depth = corners[0][axis] - across / normal[axis];
            // Where the triangle is steep, a small step across is a large one along.
            let steepness = (normal[u].abs() + normal[v].abs()) / normal[axis].abs();
            let slack = 1e-3 + NEAR * steepness;
            let is_sure = inside > NEAR;
            let mut note = |layer: f64, is_sure: bool| {
                let mut low = UVec3::ZERO;
                (low[u], low[v]) = (row, column);
                for (step, bit) in [(0.0, 1 << (2 * axis + 1)), (1.0, 1 << (2 * axis))] {
                    let at = layer + step;
                    if at < 0.0 || at >= f64::from(grid.size[axis]) {
                        continue;
                    }
                    low[axis] = at as u32;
                    let list = if is_sure {
                        &mut found.opaque
                    } else {
                        &mut found.unsure
                    };
                    list[grid.index(low)] |= bit;
                }
            };
            let (first, last) = ((depth - slack).floor(), (depth + slack).floor());
            if first == last {
                note(first, is_sure);
            } else {
                let mut layer = first;
                while layer <= last && last - first < 1e4 {
                    note(layer, false);
                    layer += 1.0;
                }
            }
        }
    }
}
