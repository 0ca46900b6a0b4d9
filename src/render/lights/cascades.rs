//! Cascades of a directional light: maps of parts of what the camera sees (Zhang et al. 2006; as
//! spheres on whole texels, Valient 2007), and maps around the camera, each twice as wide as the
//! one before.

use glam::{DVec2, DVec3, Vec3};

use super::views::{GpuLightView, parallel_view};
use crate::scene::Camera;

/// Texels at a map's border that hold no point of its sphere: the map lies on whole texels, and a
/// lookup is moved by up to a texel and reads one beyond.
const ROOM_TEXELS: f64 = 3.0;

/// Maps around the camera move by this share of their width.
const STEP_SHARE: u32 = 8;

/// The camera that cascades follow.
#[derive(Clone, Copy, Debug)]
pub struct Watcher {
    /// What is seen.
    pub camera: Camera,
    /// Width of the picture over its height.
    pub aspect: f32,
    /// ρ of the split, 0 to 1.
    pub split_lambda: f32,
}

/// The whole lit scene as a directional light sees it: a box whose corner is the one with the least
/// coordinates along the map and along the light.
pub(super) struct Column {
    right: DVec3,
    down: DVec3,
    forward: DVec3,
    corner: DVec3,
    /// Width and height (m).
    extent: DVec2,
    /// Depth from the first caster to the last surface (m).
    range_m: f64,
}

impl Column {
    /// Of a scene within these bounds (m). The map's right edge runs along the scene's longest
    /// side.
    pub(super) fn of_scene(direction: Vec3, (low, high): (Vec3, Vec3)) -> Self {
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        let size = high - low;
        let forward = direction.as_dvec3().normalize();
        let longest = [DVec3::X, DVec3::Y, DVec3::Z]
            .map(|axis| axis * size.max(DVec3::splat(1e-6)).dot(axis))
            .map(|side| side.reject_from_normalized(forward))
            .into_iter()
            .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
        let right = longest
            .and_then(DVec3::try_normalize)
            .unwrap_or_else(|| forward.any_orthonormal_vector());
        let down = forward.cross(right);
        let margin = 1e-3 * size.length().max(1e-6);
        let span = |axis: DVec3| {
            let (middle, half) = (0.5 * (low + high).dot(axis), 0.5 * size.dot(axis.abs()));
            (middle - half - margin, 2.0 * (half + margin))
        };
        let ((x, width), (y, height), (z, range_m)) = (span(right), span(down), span(forward));
        Column {
            corner: right * x + down * y + forward * z,
            extent: DVec2::new(width, height),
            range_m,
            right,
            down,
            forward,
        }
    }

    /// The map of `size`² texels of this size (m) whose middle is nearest to `middle` among those
    /// that are whole steps (texels) from the corner and lie in the column.
    fn map(&self, middle: DVec3, texel: DVec2, step: u32, of: &MapOf) -> GpuLightView {
        let size = f64::from(of.size);
        let offset = middle - self.corner;
        let at = DVec2::new(offset.dot(self.right), offset.dot(self.down));
        let step = f64::from(step);
        let last = ((self.extent / texel - size).max(DVec2::ZERO) / step - 1e-6).ceil() * step;
        let first = (((at / texel - 0.5 * size) / step).round() * step).clamp(DVec2::ZERO, last);
        let half = 0.5 * size * texel;
        let centre = first * texel + half;
        let view = parallel_view(
            [self.right, self.down, self.forward].map(|axis| axis.as_vec3()),
            (self.corner + self.right * centre.x + self.down * centre.y).as_vec3(),
            half.extend(self.range_m).as_vec3(),
            [of.light, of.size],
        );
        let first = first.as_ivec2().as_uvec2();
        let has_more = last.map(|texels| f64::from(u8::from(texels > 0.0)));
        GpuLightView {
            anchor: self
                .corner
                .as_vec3()
                .extend(1.0 + of.number as f32)
                .to_array(),
            border: has_more.as_vec2().extend(0.0).extend(0.0).to_array(),
            light: [of.light, of.size, first.x, first.y],
            ..view
        }
    }
}

/// Which map is made.
struct MapOf {
    light: u32,
    /// Width and height (texels).
    size: u32,
    /// Number among its cascades, 0 the finest.
    number: u32,
}

/// Where the parts of what a camera sees begin and end (m, view depth): C = ρ C_log + (1 − ρ)
/// C_uni, C_log = n (f/n)^(i/m), C_uni = n + (f − n) i/m.
pub fn splits(near_m: f64, far_m: f64, count: u32, lambda: f64) -> Vec<f64> {
    let at = |index: u32| {
        let share = f64::from(index) / f64::from(count);
        let log = near_m * (far_m / near_m).powf(share);
        let uniform = near_m + (far_m - near_m) * share;
        lambda * log + (1.0 - lambda) * uniform
    };
    (0..=count).map(at).collect()
}

/// The smallest sphere around a part of a frustum: view depth of its centre, on the axis, and its
/// radius (m). `slope` is the length across per depth of the frustum's edges.
pub fn sphere_of_part(near_m: f64, far_m: f64, slope: f64) -> (f64, f64) {
    let squared = slope * slope;
    let centre_m = (0.5 * (near_m + far_m) * (1.0 + squared)).min(far_m);
    let radius_m = ((far_m - centre_m).powi(2) + squared * far_m * far_m).sqrt();
    (centre_m, radius_m)
}

/// Splits begin no nearer than this share of the distance at which they end: texels nearer than it
/// would be finer than pixels.
const LEAST_NEAR: f64 = 1e-3;

/// From which distance to which a scene within `bounds` lies from the eye (m). They change by steps
/// of a half and of 2^¼, so that maps keep the size of their texels while the camera moves and
/// turns.
fn visible_range(eye: Vec3, (low, high): (Vec3, Vec3)) -> (f64, f64) {
    let (eye, low, high) = (eye.as_dvec3(), low.as_dvec3(), high.as_dvec3());
    let farthest = (eye - low).abs().max((eye - high).abs()).length();
    let far_m = ((4.0 * farthest.max(1e-6).log2()).ceil() / 4.0).exp2();
    let nearest = eye.distance(eye.clamp(low, high)).max(LEAST_NEAR * far_m);
    (nearest.log2().floor().exp2().min(0.5 * far_m), far_m)
}

/// The maps of a directional light for the direct light: each holds the sphere around a part of
/// what the camera sees, and every caster before it.
pub(super) fn of_camera(
    column: &Column,
    bounds: (Vec3, Vec3),
    watcher: &Watcher,
    count: u32,
    (light, size): (u32, u32),
) -> Vec<GpuLightView> {
    let Watcher {
        camera,
        aspect,
        split_lambda,
    } = watcher;
    let [.., forward] = camera.basis();
    let tan_y = (0.5 * f64::from(camera.vfov_deg).to_radians()).tan();
    let slope = tan_y * (1.0 + f64::from(*aspect).powi(2)).sqrt();
    let (near_m, far_m) = visible_range(camera.eye, bounds);
    let ends = splits(near_m, far_m, count, f64::from(*split_lambda));
    let parts = ends.windows(2).zip(0..count);
    parts
        .map(|(ends, number)| {
            // What is nearer than the first part is in it too.
            let near_m = if number == 0 { 0.0 } else { ends[0] };
            let (centre_m, radius_m) = sphere_of_part(near_m, ends[1], slope);
            let width = 2.0 * radius_m / (1.0 - 2.0 * ROOM_TEXELS / f64::from(size));
            let texel = DVec2::splat(width).min(column.extent) / f64::from(size);
            let middle = camera.eye.as_dvec3() + forward.as_dvec3() * centre_m;
            let of = MapOf {
                light,
                size,
                number,
            };
            column.map(middle, texel, 1, &of)
        })
        .collect()
}

/// The maps of a directional light around a point, each twice as wide as the one before; the last
/// holds the whole scene. The edges of each lie between texels of the next.
pub(super) fn around(
    column: &Column,
    middle: Vec3,
    count: u32,
    (light, size): (u32, u32),
) -> Vec<GpuLightView> {
    let widest = column.extent.max_element();
    let map = |number: u32| {
        let width = widest / f64::from(1 << (count - 1 - number));
        // A side that is shorter than the map is wide is halved as often as it stays long enough.
        let halvings = (column.extent / width).log2().floor().max(DVec2::ZERO);
        let texel = column.extent / halvings.exp2() / f64::from(size);
        let of = MapOf {
            light,
            size,
            number,
        };
        column.map(
            middle.as_dvec3(),
            texel,
            size.div_ceil(STEP_SHARE).next_multiple_of(2),
            &of,
        )
    };
    (0..count).map(map).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From 1 m to 16 m in four parts: logarithmic at 1, 2, 4, 8, 16; uniform at 1, 4.75, 8.5,
    /// 12.25, 16; half of each in between.
    #[test]
    fn splits_are_those_of_the_paper() {
        let near = |found: Vec<f64>, expected: [f64; 5]| {
            assert!(
                found
                    .iter()
                    .zip(expected)
                    .all(|(a, b)| (a - b).abs() < 1e-12),
                "{found:?} for {expected:?}"
            )
        };
        near(splits(1.0, 16.0, 4, 1.0), [1.0, 2.0, 4.0, 8.0, 16.0]);
        near(splits(1.0, 16.0, 4, 0.0), [1.0, 4.75, 8.5, 12.25, 16.0]);
        near(splits(1.0, 16.0, 4, 0.5), [1.0, 3.375, 6.25, 10.125, 16.0]);
    }

    /// The sphere holds the corners of its part and touches those of the far end.
    #[test]
    fn spheres_hold_their_parts() {
        for (near_m, far_m, slope) in [(1.0, 2.0, 0.3), (1.0, 2.0, 2.0), (0.0, 5.0, 1.0)] {
            let (centre_m, radius_m) = sphere_of_part(near_m, far_m, slope);
            let from_corner = |depth_m: f64| (depth_m - centre_m).hypot(slope * depth_m);
            assert!(from_corner(near_m) <= radius_m + 1e-12);
            assert!((from_corner(far_m) - radius_m).abs() < 1e-12);
        }
    }

    fn texels_of(view: &GpuLightView) -> [[i64; 2]; 2] {
        let first = [view.light[2], view.light[3]].map(i64::from);
        [first, first.map(|at| at + i64::from(view.light[1]))]
    }

    /// A camera that moves and turns: maps keep their texels and move by whole ones; a point before
    /// the camera is in the map of its part.
    #[test]
    fn maps_of_the_camera_stay_on_their_texels() {
        let bounds = (Vec3::new(-40.0, 0.0, -300.0), Vec3::new(40.0, 30.0, 300.0));
        let column = Column::of_scene(Vec3::new(0.3, -0.8, 0.5).normalize(), bounds);
        let at = |shift: f32, turn: f32| {
            let eye = Vec3::new(2.0 + shift, 2.0, 0.3 * shift);
            let watcher = Watcher {
                camera: Camera {
                    eye,
                    target: eye + Vec3::new(turn.sin(), 0.0, turn.cos()),
                    ..Camera::default()
                },
                aspect: 1.5,
                split_lambda: 0.9,
            };
            (of_camera(&column, bounds, &watcher, 4, (0, 256)), watcher)
        };
        let (first, _) = at(0.0, 0.0);
        for step in 0..32 {
            let (maps, watcher) = at(0.01 * step as f32, 0.2 * step as f32);
            for (map, before) in maps.iter().zip(&first) {
                assert_eq!((map.right, map.down), (before.right, before.down));
                assert_eq!(map.anchor, before.anchor);
            }
            let [.., forward] = watcher.camera.basis();
            let (near_m, far_m) = visible_range(watcher.camera.eye, bounds);
            let ends = splits(near_m, far_m, 4, 0.9);
            for (map, end) in maps.iter().zip(&ends[1..]) {
                let point = watcher.camera.eye + forward * (0.99 * *end as f32);
                if point.cmplt(bounds.0).any() || point.cmpgt(bounds.1).any() {
                    continue;
                }
                let offset = point - Vec3::from_slice(&map.origin_kind);
                for side in [map.right, map.down] {
                    let side = Vec3::from_slice(&side);
                    assert!((offset.dot(side) / side.length_squared()).abs() < 1.0);
                }
            }
        }
    }

    /// The edges of a map lie between texels of the next, which has the same texels or twice as
    /// large ones; the last map holds everything.
    #[test]
    fn maps_around_a_point_are_nested() {
        let bounds = (Vec3::new(-40.0, 0.0, -300.0), Vec3::new(40.0, 30.0, 300.0));
        let column = Column::of_scene(Vec3::new(0.3, -0.8, 0.5).normalize(), bounds);
        for step in 0..20 {
            let middle = Vec3::new(3.0, 2.0, -320.0 + 32.0 * step as f32);
            let maps = around(&column, middle, 4, (0, 64));
            for pair in maps.windows(2) {
                let [fine, coarse] = [&pair[0], &pair[1]].map(texels_of);
                for (axis, sides) in [
                    (0, [pair[0].right, pair[1].right]),
                    (1, [pair[0].down, pair[1].down]),
                ] {
                    let [a, b] = sides.map(|side| Vec3::from_slice(&side).length());
                    let ratio = (b / a).round() as i64;
                    assert!([1, 2].contains(&ratio) && (b / a - ratio as f32).abs() < 1e-4);
                    for edge in [fine[0][axis], fine[1][axis]] {
                        assert_eq!(edge % ratio, 0);
                        assert!((coarse[0][axis]..=coarse[1][axis]).contains(&(edge / ratio)));
                    }
                }
            }
            assert_eq!(texels_of(&maps[3]), [[0; 2], [64; 2]]);
            assert_eq!(maps[3].border, [0.0; 4]);
        }
    }
}
