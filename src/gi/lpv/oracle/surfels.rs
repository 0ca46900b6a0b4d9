//! Twins of `lpv.peel`, `lpv.camera_geometry` and `lpv.merge`.

use glam::{DVec2, DVec3, DVec4};

use super::Texel;
use crate::render::oracle::View;
use crate::scene::Scene;

/// Surfaces nearer to each other than this share of their depth are one.
const SAME: f64 = 1e-5;

/// Where a ray meets a triangle: its length, and the triangle's normal towards the ray's start
/// (Möller & Trumbore 1997).
fn meet(start: DVec3, ray: DVec3, [a, b, c]: [DVec3; 3]) -> Option<(f64, DVec3)> {
    let (e1, e2) = (b - a, c - a);
    let across = ray.cross(e2);
    let volume = e1.dot(across);
    let normal = e1.cross(e2).normalize_or_zero();
    if volume == 0.0 || normal == DVec3::ZERO {
        return None;
    }
    let from = start - a;
    let around = from.cross(e1);
    let [u, v, way] = [from.dot(across), ray.dot(around), e2.dot(around)].map(|x| x / volume);
    // A hair wider, so that no ray passes between two triangles with one edge.
    let is_inside = u.min(v).min(1.0 - u - v) >= -1e-9;
    let towards = if normal.dot(ray) > 0.0 {
        -normal
    } else {
        normal
    };
    is_inside.then_some((way, towards))
}

/// Of a spherical triangle (van Oosterom & Strackee 1983) [sr].
fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let volume = a.dot(b.cross(c)).abs();
    2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

/// Of a rectangle of a perspective view, from one corner to the other (px) [sr].
fn extent(view: &View, low: DVec2, high: DVec2) -> f64 {
    let corners = [
        low,
        DVec2::new(high.x, low.y),
        high,
        DVec2::new(low.x, high.y),
    ];
    let [a, b, c, d] = corners.map(|corner| view.ray(corner).1.normalize());
    solid_angle([a, b, c]) + solid_angle([a, c, d])
}

/// What a perspective view sees as surfels, layer by layer, the nearest first: one a square of
/// `stride` pixels, which its middle pixel stands for. Every ray is tested against every triangle,
/// of which all are opaque.
pub fn surfels(scene: &Scene, view: &View, stride: u32, layers: usize) -> Vec<Vec<Texel>> {
    let corner = |vertex: u32| DVec3::from(scene.vertices[vertex as usize].position.map(f64::from));
    let triangles: Vec<[DVec3; 3]> = scene
        .triangles
        .iter()
        .map(|triangle| triangle.vertices.map(corner))
        .collect();
    let mut found = vec![Vec::new(); layers];
    let [columns, rows] = view.size.map(|side| side.div_ceil(stride));
    for square in 0..columns * rows {
        let first = [square % columns, square / columns].map(|place| place * stride);
        let [low, high] = [0, stride].map(|way| {
            let end = |axis: usize| f64::from((first[axis] + way).min(view.size[axis]));
            DVec2::new(end(0), end(1))
        });
        let (start, ray) = view.ray((0.5 * (low + high)).floor() + 0.5);
        let mut hits: Vec<_> = triangles
            .iter()
            .filter_map(|triangle| meet(start, ray, *triangle))
            .filter(|(depth_m, _)| *depth_m > view.near_m)
            .collect();
        hits.sort_by(|a, b| a.0.total_cmp(&b.0));
        hits.dedup_by(|far, near| far.0 <= near.0 * (1.0 + SAME));
        let seen = extent(view, low, high);
        for (layer, (depth_m, normal)) in found.iter_mut().zip(hits) {
            let way = depth_m * ray;
            layer.push(Texel {
                position: start + way,
                normal,
                flux: DVec3::ZERO,
                area_m2: seen * way.length_squared() / normal.dot(way.normalize()).abs(),
            });
        }
    }
    found
}

/// Blocking potential of two volumes: of each corner, that of which it has more.
pub fn merge(first: &[DVec4], second: &[DVec4]) -> Vec<DVec4> {
    let more =
        |(first, second): (&DVec4, &DVec4)| if second.x > first.x { *second } else { *first };
    first.iter().zip(second).map(more).collect()
}
