//! How much of a light shadow maps let through.

use glam::{DVec2, DVec3};

use super::View;
use crate::render::{GpuLightView, ShadowFilter};

/// Depth differences up to this share of the depth are no shadow.
pub const SHADOW_BIAS: f64 = 1e-4;

/// Slope of a facet beside a receiver: depth over distance across the light.
const FACET_SLOPE: f64 = 0.5;

/// The same in cascades.
const CASCADE_FACET_SLOPE: f64 = 0.25;

/// A receiver's plane is followed no farther than this many widths of a texel.
const PLANE_REACH_TEXELS: f64 = 16.0;

/// Rounding of depths in a cascade's map and of positions, as a share of the depth range.
const DEPTH_ROUNDING: f64 = 1e-6;

/// Room at the border of a cascade (texels).
const CASCADE_ROOM: f64 = 3.0;

/// Part of half a cascade's width over which it passes into the next.
const CASCADE_BLEND: f64 = 0.1;

/// The widest search and penumbra of PCSS (texels), and their taps.
const PCSS_REACH: f64 = 24.0;
const SEARCH_TAPS: u32 = 16;
const PENUMBRA_TAPS: u32 = 32;

/// Places closer to the border of a texel than this (texels) may be in either.
const PLACE_ROUNDING: f64 = 2e-4;

/// A shadow map: its view, and the view depth (m) of each texel, infinite where there is nothing.
#[derive(Clone, Debug)]
pub struct ShadowMap {
    /// How it looks into the scene.
    pub view: View,
    /// Depth of each texel (m), row 0 at the top.
    pub depth_m: Vec<f64>,
    /// What a cascade has besides.
    pub cascade: Option<Cascade>,
}

/// What a map of cascades has besides its view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cascade {
    /// Whether the scene goes on beyond its edge to the right, and below.
    pub has_more: [bool; 2],
    /// Its depth range (m).
    pub range_m: f64,
}

impl Cascade {
    /// Of a light's view; `None` where that is none of cascades.
    pub fn of_light(view: &GpuLightView) -> Option<Cascade> {
        (view.anchor[3] > 0.0).then(|| Cascade {
            has_more: [view.border[0] > 0.0, view.border[1] > 0.0],
            range_m: view.right[3].into(),
        })
    }
}

/// How a light is compared with its maps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// The filter.
    pub filter: ShadowFilter,
    /// Tangent of half the angular diameter of directional lights.
    pub sun_tangent: f64,
}

impl Comparison {
    /// Four comparisons.
    pub const PCF: Comparison = Comparison {
        filter: ShadowFilter::Pcf,
        sun_tangent: 0.0,
    };
}

/// Least and largest share of a directional light that may reach a point by its cascades, the
/// finest first: the finest that has the point, blended into the next near its border.
pub fn cascaded_visibility(
    maps: &[ShadowMap],
    (position, normal): (DVec3, DVec3),
    comparison: Comparison,
) -> [f64; 2] {
    for (index, map) in maps.iter().enumerate() {
        let own = || map.visibility_by(position, normal, comparison);
        let Some(next) = maps.get(index + 1) else {
            return own();
        };
        let share = map.share(position);
        if share >= 1.0 {
            return own();
        }
        // Whether the share is just 0 or a little more makes no difference.
        if share > 0.0 {
            let (own, next) = (own(), next.visibility_by(position, normal, comparison));
            let rounding = 1e-3;
            return [
                share * own[0] + (1.0 - share) * next[0] - rounding,
                share * own[1] + (1.0 - share) * next[1] + rounding,
            ];
        }
    }
    [1.0; 2]
}

impl ShadowMap {
    /// Least and largest share of the light that may reach a point by four comparisons, weighted
    /// bilinearly, each with the nearer of the receiver and its tangent plane on the texel's ray,
    /// less [`ShadowMap::facet_m`]. A comparison that rounding decides counts as both. Beyond the
    /// map, all light arrives in a parallel view, and none in any other.
    pub fn visibility(&self, position: DVec3, normal: DVec3) -> [f64; 2] {
        self.visibility_by(position, normal, Comparison::PCF)
    }

    /// As [`ShadowMap::visibility`], with other filters too.
    pub fn visibility_by(
        &self,
        position: DVec3,
        normal: DVec3,
        comparison: Comparison,
    ) -> [f64; 2] {
        let position = position + self.offset(normal);
        let size = f64::from(self.view.size[0]);
        let (at_px, depth_m) = self.view.project(position);
        let is_inside = at_px.cmpge(DVec2::ZERO).all()
            && at_px.cmple(DVec2::splat(size)).all()
            && depth_m > 0.0;
        if !is_inside {
            return if self.view.is_parallel {
                [1.0; 2]
            } else {
                [0.0; 2]
            };
        }
        match comparison.filter {
            ShadowFilter::Point => self.nearest(at_px, position, normal, depth_m),
            ShadowFilter::Pcss if self.view.is_parallel => {
                self.soft((position, normal), (at_px, depth_m), comparison.sun_tangent)
            }
            _ => self.bilinear(at_px, position, normal, depth_m),
        }
    }

    /// How far a receiver is moved off its surface (m): in a cascade, where the light grazes it, as
    /// far as four texels reach.
    fn offset(&self, normal: DVec3) -> DVec3 {
        if self.cascade.is_none() {
            return DVec3::ZERO;
        }
        let across = DVec2::new(
            normal.dot(self.view.right.normalize()),
            normal.dot(self.view.down.normalize()),
        );
        let reach_m = across.abs().dot(self.edges_m(1.0));
        normal * (1.0 + 0.5 * CASCADE_FACET_SLOPE) * reach_m
    }

    /// Share of this cascade in what is seen at a point, 0 to 1.
    pub fn share(&self, position: DVec3) -> f64 {
        let Some(cascade) = self.cascade else {
            return 1.0;
        };
        let size = f64::from(self.view.size[0]);
        let (at_px, _) = self.view.project(position);
        let inside = DVec2::ONE - (2.0 * at_px / size - 1.0).abs();
        let inside = DVec2::select(cascade.has_more.into(), inside, DVec2::ONE);
        let room = 2.0 * CASCADE_ROOM / size;
        ((inside.min_element() - room) / CASCADE_BLEND).clamp(0.0, 1.0)
    }

    fn nearest(&self, at_px: DVec2, position: DVec3, normal: DVec3, depth_m: f64) -> [f64; 2] {
        let size = f64::from(self.view.size[0]);
        let mut bounds = [1.0f64, 0.0];
        for by in [
            DVec2::NEG_ONE,
            DVec2::new(-1.0, 1.0),
            DVec2::new(1.0, -1.0),
            DVec2::ONE,
        ] {
            let texel = (at_px + PLACE_ROUNDING * by).floor();
            let texel = texel.clamp(DVec2::ZERO, DVec2::splat(size - 1.0));
            let [may_be, must_be] = self.compare(texel, position, normal, depth_m);
            bounds[0] = bounds[0].min(f64::from(u8::from(must_be)));
            bounds[1] = bounds[1].max(f64::from(u8::from(may_be)));
        }
        bounds
    }

    /// Percentage-closer soft shadows. Where rounding decides a comparison or a place, anything may
    /// come out.
    fn soft(
        &self,
        (position, normal): (DVec3, DVec3),
        (at_px, depth_m): (DVec2, f64),
        sun_tangent: f64,
    ) -> [f64; 2] {
        let size = f64::from(self.view.size[0]);
        let edges_m = self.edges_m(depth_m);
        let tap = |index: u32, count: u32, radius_m: f64| {
            let angle = 2.399_963_23 * f64::from(index);
            let radius = (DVec2::splat(radius_m) / edges_m).min(DVec2::splat(PCSS_REACH));
            let at = at_px
                + radius
                    * ((f64::from(index) + 0.5) / f64::from(count)).sqrt()
                    * DVec2::from_angle(angle);
            let is_certain = (at - at.round()).abs().min_element() > PLACE_ROUNDING;
            let texel = at.floor().clamp(DVec2::ZERO, DVec2::splat(size - 1.0));
            let [may_be, must_be] = self.compare(texel, position, normal, depth_m);
            (is_certain && may_be == must_be).then_some((may_be, texel))
        };
        let searched: Option<Vec<_>> = (0..SEARCH_TAPS)
            .map(|index| tap(index, SEARCH_TAPS, sun_tangent * depth_m))
            .collect();
        let Some(searched) = searched else {
            return [0.0, 1.0];
        };
        let hidden = searched.iter().filter(|(is_lit, _)| !is_lit);
        let distances = hidden.map(|(_, texel)| depth_m - self.stored_m(*texel));
        let (sum_m, count) = distances.fold((0.0, 0.0), |(sum, count), d| (sum + d, count + 1.0));
        let radius_m = sun_tangent * sum_m.max(0.0) / f64::max(count, 1.0);
        let texel_m = edges_m.max_element();
        if (radius_m / texel_m - 1.0).abs() < 1e-3 {
            return [0.0, 1.0];
        }
        if radius_m < texel_m {
            return self.bilinear(at_px, position, normal, depth_m);
        }
        let taps: Option<Vec<bool>> = (0..PENUMBRA_TAPS)
            .map(|index| tap(index, PENUMBRA_TAPS, radius_m).map(|(is_lit, _)| is_lit))
            .collect();
        taps.map_or([0.0, 1.0], |taps| {
            let lit = taps.iter().filter(|is_lit| **is_lit).count();
            [lit as f64 / f64::from(PENUMBRA_TAPS); 2]
        })
    }

    fn bilinear(&self, at_px: DVec2, position: DVec3, normal: DVec3, depth_m: f64) -> [f64; 2] {
        let size = f64::from(self.view.size[0]);
        let first = (at_px - 0.5).floor();
        let share = at_px - 0.5 - first;
        let mut bounds = [0.0; 2];
        for corner in [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE] {
            let texel = (first + corner).clamp(DVec2::ZERO, DVec2::splat(size - 1.0));
            let weight = (DVec2::ONE - corner - share).abs();
            let [may_be, must_be] = self.compare(texel, position, normal, depth_m);
            bounds[0] += if must_be { weight.x * weight.y } else { 0.0 };
            bounds[1] += if may_be { weight.x * weight.y } else { 0.0 };
        }
        bounds
    }

    /// The edges of a texel (m) at a depth. Biases of a map that is no cascade count with squares
    /// of its first edge.
    fn edges_m(&self, depth_m: f64) -> DVec2 {
        let scale = if self.view.is_parallel { 1.0 } else { depth_m };
        let down = match self.cascade {
            Some(_) => self.view.down,
            None => self.view.right,
        };
        DVec2::new(self.view.right.length(), down.length()) * 2.0 / f64::from(self.view.size[0])
            * scale
    }

    /// Depth that the map has at a texel (m).
    fn stored_m(&self, texel: DVec2) -> f64 {
        self.depth_m[(texel.x + texel.y * f64::from(self.view.size[0])) as usize]
    }

    /// How much nearer to the light than a receiver the surface may be that a texel beside it sees,
    /// and yet be a facet of the same surface \[m\].
    pub fn facet_m(&self, texel_px: DVec2, position: DVec3) -> f64 {
        let (at_px, depth_m) = self.view.project(position);
        let slope = if self.cascade.is_some() {
            CASCADE_FACET_SLOPE
        } else {
            FACET_SLOPE
        };
        slope * ((at_px - texel_px) * self.edges_m(depth_m)).length()
    }

    /// Whether a texel may let light pass to the receiver's plane, and whether it must.
    fn compare(&self, texel: DVec2, position: DVec3, normal: DVec3, depth_m: f64) -> [bool; 2] {
        let stored_m = self.stored_m(texel);
        let (origin, direction) = self.view.ray(texel + 0.5);
        let on_plane = normal.dot(position - origin) / normal.dot(direction);
        let texel_m = self.edges_m(depth_m).max_element();
        let reach_m = PLANE_REACH_TEXELS * texel_m;
        // The plane is as steep as its normal is exact.
        let steepness = direction.length() / normal.dot(direction).abs();
        let rounding_m = 2e-6 * depth_m + 2e-6 * steepness * (depth_m + texel_m);
        let receivers = if on_plane.is_finite() {
            [on_plane - rounding_m, on_plane + rounding_m]
                .map(|plane| plane.clamp(depth_m - reach_m, depth_m + reach_m))
        } else {
            [depth_m - reach_m, depth_m + reach_m]
        };
        let receivers = receivers.map(|receiver| receiver.min(depth_m));
        let rounded_m = self.cascade.map_or(SHADOW_BIAS * depth_m, |cascade| {
            DEPTH_ROUNDING * cascade.range_m
        });
        let bias_m = rounded_m + self.facet_m(texel + 0.5, position);
        [
            stored_m + 2e-6 * depth_m >= receivers[0] - bias_m,
            stored_m - 2e-6 * depth_m >= receivers[1] - bias_m,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texels of 0.5 m, 0.5 px to the left of a point and 0.5 px above and below it, see something
    /// nearer. It is a facet of the same surface up to 0.5 · 0.5 m · √(0.5² + 0.5²) = 0.177 m, also
    /// where the point's plane is further away there.
    #[test]
    fn a_facet_beside_a_point_does_not_shadow_it() {
        let view = View {
            origin: DVec3::ZERO,
            right: DVec3::X,
            down: DVec3::Y,
            forward: DVec3::Z,
            near_m: 0.0,
            is_parallel: true,
            size: [4; 2],
        };
        let falling = DVec3::new(-1.0, 0.0, -1.0).normalize();
        for (nearer, normal, expected) in [
            (0.17, DVec3::NEG_Z, 1.0),
            (0.19, DVec3::NEG_Z, 0.5),
            (0.17, falling, 1.0),
            (0.19, falling, 0.5),
        ] {
            let depth = |texel| {
                if texel % 4 < 2 {
                    2.0 - nearer
                } else {
                    f64::INFINITY
                }
            };
            let map = ShadowMap {
                view,
                depth_m: (0..16).map(depth).collect(),
                cascade: None,
            };
            let found = map.visibility(DVec3::new(0.0, 0.0, 2.0), normal);
            assert_eq!(found, [expected; 2], "{nearer} m, {normal}");
        }
    }

    /// Half of a map of 4 × 4 texels is nearer than the receiver: full light, none, and in between
    /// as far as the point is from the edge.
    #[test]
    fn shadow_maps_are_compared_by_hand() {
        let view = View {
            origin: DVec3::ZERO,
            right: DVec3::X,
            down: DVec3::Y,
            forward: DVec3::Z,
            near_m: 0.0,
            is_parallel: true,
            size: [4; 2],
        };
        let map = ShadowMap {
            view,
            depth_m: (0..16)
                .map(|texel| if texel % 4 < 2 { 1.0 } else { f64::INFINITY })
                .collect(),
            cascade: None,
        };
        for (x, expected) in [
            (-0.6, 0.0),
            (-0.25, 0.0),
            (0.0, 0.5),
            (0.125, 0.75),
            (0.25, 1.0),
            (0.9, 1.0),
            (1.1, 1.0),
        ] {
            assert_eq!(
                map.visibility(DVec3::new(x, 0.1, 2.0), DVec3::NEG_Z),
                [expected; 2],
                "x = {x}"
            );
        }
        assert_eq!(
            map.visibility(DVec3::new(-0.6, 0.1, 0.5), DVec3::NEG_Z),
            [1.0; 2]
        );
        assert_eq!(
            map.visibility(DVec3::new(-0.75, 0.25, 1.0 + SHADOW_BIAS), DVec3::NEG_Z),
            [0.0, 1.0]
        );
        let spot = ShadowMap {
            view: View {
                is_parallel: false,
                ..view
            },
            ..map
        };
        assert_eq!(
            spot.visibility(DVec3::new(3.0, 0.1, 2.0), DVec3::NEG_Z),
            [0.0; 2]
        );
        assert_eq!(
            spot.visibility(DVec3::new(0.0, 0.1, -2.0), DVec3::NEG_Z),
            [0.0; 2]
        );
    }
}
