//! CPU twin of `gtao.gather`, in f64.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DMat3, DVec2, DVec3};

/// The depths of a picture, and where its camera stands.
#[derive(Clone, Debug)]
pub struct Depths {
    /// Width and height (px).
    pub size: [u32; 2],
    /// View depths (m), row by row from the top; 0 where there is no surface.
    pub depths_m: Vec<f32>,
    /// Position of the camera (m).
    pub eye: DVec3,
    /// From the image's centre to its right edge at view depth 1.
    pub right: DVec3,
    /// The same to its top edge.
    pub up: DVec3,
    /// Unit view direction.
    pub forward: DVec3,
}

/// How horizons are looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Slices of a pixel.
    pub slices: u32,
    /// Samples along each half of a slice.
    pub steps: u32,
    /// Of the farthest occluders (m); 0: any.
    pub distance: f64,
    /// λ of an occluder's weight 1 / (1 + λ r) (1/m).
    pub falloff: f64,
    /// Share of a horizon that what is behind it takes back.
    pub thin: f64,
}

/// A half of a slice, as its horizon is looked for.
struct Half {
    position: DVec3,
    /// What brings an offset from the surface into the slice, parallel to the surface.
    within: [DVec3; 2],
    middle: DVec2,
    /// On the picture, of length 1.
    direction: DVec2,
    reach_px: f64,
    /// Cosine of the horizon where nothing is in the way.
    low: f64,
    jitter: f64,
}

impl Depths {
    fn at(&self, [x, y]: [u32; 2]) -> f64 {
        self.depths_m[(x + y * self.size[0]) as usize].into()
    }

    /// Position (m) at a view depth through the middle of a pixel.
    pub fn position([x, y]: [u32; 2], depth_m: f64, of: &Depths) -> DVec3 {
        let ndc = |at: u32, size: u32| 2.0 * (f64::from(at) + 0.5) / f64::from(size) - 1.0;
        let ray = of.forward + ndc(x, of.size[0]) * of.right - ndc(y, of.size[1]) * of.up;
        of.eye + depth_m * ray
    }

    /// Ambient visibility of the surface of a pixel, whose slices are turned by `turned.x` of the
    /// angle between two, and whose samples lie at `turned.y` of a step.
    pub fn visibility(
        &self,
        pixel: [u32; 2],
        normal: DVec3,
        search: &Search,
        turned: DVec2,
    ) -> f64 {
        let position = Depths::position(pixel, self.at(pixel), self);
        let offset = position - self.eye;
        let to_eye = -offset.normalize();
        let depth = offset.dot(self.forward);
        let squared = (depth * depth - search.distance * search.distance).max(0.25 * depth * depth);
        let reach_px = if search.distance > 0.0 {
            search.distance / squared.sqrt() * f64::from(self.size[1]) / 2.0 / self.up.length()
        } else {
            f64::INFINITY
        };
        let around = frame_around(to_eye);
        let slice = |i: u32| {
            let angle = PI * (f64::from(i) + turned.x) / f64::from(search.slices);
            let across = around * DVec3::new(angle.cos(), angle.sin(), 0.0);
            let direction = self.picture_direction(offset, across);
            let (x, y) = (normal.dot(across), normal.dot(to_eye));
            let normal_angle = x.atan2(y);
            let axis = across.cross(to_eye);
            let lean = normal.dot(axis) / (x * x + y * y).max(0.01);
            let half = |direction, end: f64| Half {
                position,
                within: [across + lean * x * axis, to_eye + lean * y * axis],
                middle: DVec2::new(pixel[0].into(), pixel[1].into()) + 0.5,
                direction,
                reach_px,
                low: end.clamp(-PI, PI).cos(),
                jitter: (turned.y + f64::from(i) * 0.618034).fract(),
            };
            let [first, last] = [normal_angle - FRAC_PI_2, normal_angle + FRAC_PI_2];
            let ahead = self.horizon(&half(direction, last), search);
            let behind = self.horizon(&half(-direction, first), search);
            let arc = |h: f64| {
                0.25 * (normal_angle.cos() - (2.0 * h - normal_angle).cos()
                    + 2.0 * h * normal_angle.sin())
            };
            let ends = [
                ahead.clamp(-1.0, 1.0).acos().min(last),
                (-behind.clamp(-1.0, 1.0).acos()).max(first),
            ];
            x.hypot(y) * ends.map(arc).iter().sum::<f64>()
        };
        let sum: f64 = (0..search.slices).map(slice).sum();
        sum / f64::from(search.slices)
    }

    /// The direction on the picture in which a point at an offset from the eye moves along a
    /// tangent.
    fn picture_direction(&self, offset: DVec3, tangent: DVec3) -> DVec2 {
        let in_picture = |v: DVec3| {
            DVec2::new(
                v.dot(self.right) / self.right.length_squared(),
                v.dot(self.up) / self.up.length_squared(),
            )
        };
        let moved = in_picture(tangent) * offset.dot(self.forward)
            - in_picture(offset) * tangent.dot(self.forward);
        let size = DVec2::new(self.size[0].into(), -f64::from(self.size[1]));
        (moved * size).normalize_or_zero()
    }

    /// Cosine between the way to the eye and the highest of what is seen.
    fn horizon(&self, half: &Half, search: &Search) -> f64 {
        let edge = |at: f64, direction: f64, size: u32| match direction {
            d if d > 0.0 => (f64::from(size) - at) / d,
            d if d < 0.0 => -at / d,
            _ => f64::INFINITY,
        };
        let reach_px = half
            .reach_px
            .min(edge(half.middle.x, half.direction.x, self.size[0]))
            .min(edge(half.middle.y, half.direction.y, self.size[1]));
        let mut highest = half.low;
        for i in 0..search.steps {
            let share = (f64::from(i) + half.jitter) / f64::from(search.steps);
            let along = 1.0 + (reach_px - 1.0).max(0.0) * share * share;
            let at = (half.middle + half.direction * along).floor();
            let is_inside = |at: f64, size: u32| at >= 0.0 && at < f64::from(size);
            if !is_inside(at.x, self.size[0]) || !is_inside(at.y, self.size[1]) {
                break;
            }
            let pixel = [at.x as u32, at.y as u32];
            let depth_m = self.at(pixel);
            let offset = Depths::position(pixel, depth_m, self) - half.position;
            let far = offset.length();
            let counts = depth_m > 0.0 && (search.distance == 0.0 || far < search.distance);
            let found = if counts {
                let [x, y] = half.within.map(|along| offset.dot(along));
                let cosine = y / x.hypot(y);
                half.low + (cosine - half.low) / (1.0 + search.falloff * far)
            } else {
                half.low
            };
            highest = if found > highest {
                found
            } else {
                highest + search.thin * (found.max(half.low) - highest)
            };
        }
        highest
    }
}

/// Two tangents of a unit vector, and the vector (Duff et al. 2017).
fn frame_around(n: DVec3) -> DMat3 {
    let sign = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    DMat3::from_cols(
        DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        DVec3::new(b, sign + n.y * n.y * a, -n.y),
        n,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEARCH: Search = Search {
        slices: 64,
        steps: 64,
        distance: 0.0,
        falloff: 0.0,
        thin: 0.0,
    };

    /// Looks down the y axis onto y = 0 from a height of 4, over x and z of ±4, at surfaces that a
    /// function of the way from the eye says: the depth at which a ray meets them.
    fn seen(size: u32, depth_of: impl Fn(DVec3) -> f64) -> Depths {
        let mut depths = Depths {
            size: [size; 2],
            depths_m: Vec::new(),
            eye: DVec3::new(0.0, 4.0, 0.0),
            right: DVec3::X,
            up: DVec3::NEG_Z,
            forward: DVec3::NEG_Y,
        };
        for y in 0..size {
            for x in 0..size {
                let ray = Depths::position([x, y], 1.0, &depths) - depths.eye;
                depths.depths_m.push(depth_of(ray) as f32);
            }
        }
        depths
    }

    /// A floor is wholly open wherever it is looked at, from above and at a slant.
    #[test]
    fn a_plane_is_open() {
        let floor = seen(96, |_| 4.0);
        for pixel in [[48, 48], [10, 20], [95, 0], [0, 60]] {
            let open = floor.visibility(pixel, DVec3::Y, &SEARCH, DVec2::new(0.3, 0.5));
            assert!((open - 1.0).abs() < 2e-3, "{pixel:?}: {open}");
        }
    }

    /// Beside a wall of height H at a distance d along the whole floor, V = (1 + cos β)/2 with
    /// tan β = H/d.
    #[test]
    fn beside_a_wall_visibility_is_the_closed_form() {
        // The wall is at x = 1.5; what is behind it is as high.
        let depth_of = |ray: DVec3| {
            let top = 4.0 - 1.2;
            if ray.x * top > 1.5 {
                top
            } else if ray.x * 4.0 > 1.5 {
                1.5 / ray.x
            } else {
                4.0
            }
        };
        let room = seen(512, depth_of);
        for column in [256, 290, 320, 340] {
            let x = (f64::from(column) + 0.5) / 256.0 * 4.0 - 4.0;
            let beta = (1.2 / (1.5 - x)).atan();
            // What lies along the wall beyond the picture is not seen.
            let expected = 0.5 * (1.0 + beta.cos());
            let found: f64 = (0..8)
                .map(|i| {
                    let turned = DVec2::new(0.5, f64::from(i) / 8.0);
                    room.visibility([column, 256], DVec3::Y, &SEARCH, turned) / 8.0
                })
                .sum();
            assert!(
                (found - expected).abs() < 0.015,
                "{x}: {found}, and not {expected}"
            );
            // A wall that is too far away does not count.
            let near = Search {
                distance: 0.9 * (1.5 - x),
                ..SEARCH
            };
            let open = room.visibility([column, 256], DVec3::Y, &near, DVec2::splat(0.5));
            assert!((open - 1.0).abs() < 2e-3, "{x}: {open}");
        }
    }

    /// Behind a bar there is floor again: a share of the horizon is taken back there.
    #[test]
    fn thin_occluders_hide_less() {
        let bar = |ray: DVec3| {
            if (0.5..0.55).contains(&(ray.x * 3.0)) {
                3.0
            } else {
                4.0
            }
        };
        let room = seen(256, bar);
        let of = |thin| {
            let search = Search { thin, ..SEARCH };
            room.visibility([128, 128], DVec3::Y, &search, DVec2::splat(0.5))
        };
        let (solid, thin, none) = (of(0.0), of(0.2), of(1.0));
        assert!(
            solid < thin && thin < none && none > 0.99,
            "{solid} {thin} {none}"
        );
    }
}
