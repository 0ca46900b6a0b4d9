//! What surfaces reflect of analytic lights, and how much of a light a shadow map lets through.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::View;
use crate::scene::Light;

/// The smallest α of a lobe.
pub const SMALLEST_ALPHA: f64 = 1e-3;

/// Depth differences up to this share of the depth are no shadow.
pub const SHADOW_BIAS: f64 = 1e-4;

/// Slope of a facet beside a receiver: depth over distance across the light.
const FACET_SLOPE: f64 = 0.5;

/// A receiver's plane is followed no farther than this many widths of a texel.
const PLANE_REACH_TEXELS: f64 = 16.0;

/// A point that light falls on.
#[derive(Clone, Copy, Debug)]
pub struct Reflector {
    /// World-space position (m).
    pub position: DVec3,
    /// Unit normal of the real surface, on the viewer's side.
    pub geometric_normal: DVec3,
    /// Unit normal that light is reflected by.
    pub shading_normal: DVec3,
    /// Unit direction to the viewer.
    pub to_eye: DVec3,
    /// Diffuse albedo ρ.
    pub albedo: DVec3,
    /// Roughness of the lobe, where there is one.
    pub roughness: Option<f64>,
    /// Reflectance at normal incidence.
    pub f0: DVec3,
}

/// Radiance of light reflected once [W/(m² sr)].
#[derive(Clone, Copy, Debug, Default)]
pub struct Reflected {
    /// Radiance by the Lambertian part.
    pub diffuse: DVec3,
    /// Radiance by the GGX lobe.
    pub specular: DVec3,
}

/// Unit direction to a light and the irradiance on a plane that faces it [W/m²], were nothing in
/// the way.
pub fn light_at(light: &Light, point: DVec3) -> (DVec3, DVec3) {
    let towards = |position: glam::Vec3| {
        let offset = position.as_dvec3() - point;
        (offset.normalize(), offset.length_squared())
    };
    match *light {
        Light::Directional {
            direction,
            irradiance,
        } => (-direction.as_dvec3().normalize(), irradiance.as_dvec3()),
        Light::Point {
            position,
            intensity,
        } => {
            let (to_light, squared) = towards(position);
            (to_light, intensity.as_dvec3() / squared)
        }
        Light::Spot {
            position,
            direction,
            intensity,
            inner_deg,
            outer_deg,
        } => {
            let (to_light, squared) = towards(position);
            let angle = direction.as_dvec3().angle_between(-to_light).to_degrees();
            (
                to_light,
                spot_share(angle, inner_deg.into(), outer_deg.into()) * intensity.as_dvec3()
                    / squared,
            )
        }
    }
}

/// Share of a spot's intensity at an angle from its axis: linear in angle from the inner to the
/// outer half angle.
pub fn spot_share(angle_deg: f64, inner_deg: f64, outer_deg: f64) -> f64 {
    if angle_deg <= inner_deg {
        1.0
    } else if angle_deg >= outer_deg {
        0.0
    } else {
        (outer_deg - angle_deg) / (outer_deg - inner_deg)
    }
}

/// ∫ of a spot's share over all directions \[sr\].
pub fn spot_solid_angle(inner_deg: f64, outer_deg: f64) -> f64 {
    let (inner, outer) = (inner_deg.to_radians(), outer_deg.to_radians());
    let mean_cosine = if inner == outer {
        outer.cos()
    } else {
        (outer.sin() - inner.sin()) / (outer - inner)
    };
    2.0 * PI * (1.0 - mean_cosine)
}

/// f_s [1/sr] of the glossy lobe: F D G₂ / (4 |n·o| |n·i|) (Walter et al. 2007, (20)), D of GGX
/// (their (33)) with α = r², G₂ of height-correlated Smith masking (Heitz 2014, (99)), F by Schlick
/// (1994). 0 where either direction is below the surface.
pub fn lobe(normal: DVec3, to_eye: DVec3, to_light: DVec3, f0: DVec3, roughness: f64) -> DVec3 {
    let alpha = (roughness * roughness).max(SMALLEST_ALPHA);
    let (cos_o, cos_i) = (normal.dot(to_eye), normal.dot(to_light));
    if cos_o <= 0.0 || cos_i <= 0.0 {
        return DVec3::ZERO;
    }
    let half = (to_eye + to_light).normalize();
    let (cos_m, sin_m) = (normal.dot(half), normal.cross(half).length());
    let distribution =
        alpha * alpha / (PI * cos_m.powi(4) * (alpha * alpha + (sin_m / cos_m).powi(2)).powi(2));
    let lambda = |direction: DVec3, cosine: f64| {
        let tangent = normal.cross(direction).length() / cosine;
        0.5 * ((1.0 + (alpha * tangent).powi(2)).sqrt() - 1.0)
    };
    let masking = 1.0 / (1.0 + lambda(to_eye, cos_o) + lambda(to_light, cos_i));
    let fresnel = f0 + (1.0 - f0) * (1.0 - to_light.dot(half)).powi(5);
    fresnel * (distribution * masking / (4.0 * cos_o * cos_i))
}

/// What a point reflects of a light that nothing hides: (ρ/π + f_s) E (n·ω); nothing of light from
/// behind the real surface.
pub fn reflect(light: &Light, at: &Reflector) -> Reflected {
    let (to_light, irradiance) = light_at(light, at.position);
    let cosine = at.shading_normal.dot(to_light);
    if cosine <= 0.0 || at.geometric_normal.dot(to_light) <= 0.0 {
        return Reflected::default();
    }
    let received = irradiance * cosine;
    let specular = at.roughness.map_or(DVec3::ZERO, |roughness| {
        lobe(at.shading_normal, at.to_eye, to_light, at.f0, roughness)
    });
    Reflected {
        diffuse: at.albedo / PI * received,
        specular: specular * received,
    }
}

/// A shadow map: its view, and the view depth (m) of each texel, infinite where there is nothing.
#[derive(Clone, Debug)]
pub struct ShadowMap {
    /// How it looks into the scene.
    pub view: View,
    /// Depth of each texel (m), row 0 at the top.
    pub depth_m: Vec<f64>,
}

impl ShadowMap {
    /// Least and largest share of the light that may reach a point by four comparisons, weighted
    /// bilinearly, each with the nearer of the receiver and its tangent plane on the texel's ray,
    /// less [`ShadowMap::facet_m`]. A comparison that rounding decides counts as both. Beyond the
    /// map, all light arrives in a parallel view, and none in any other.
    pub fn visibility(&self, position: DVec3, normal: DVec3) -> [f64; 2] {
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

    /// The edge of a texel \[m\] at a depth.
    fn texel_m(&self, depth_m: f64) -> f64 {
        let scale = if self.view.is_parallel { 1.0 } else { depth_m };
        2.0 * self.view.right.length() / f64::from(self.view.size[0]) * scale
    }

    /// How much nearer to the light than a receiver the surface may be that a texel beside it sees,
    /// and yet be a facet of the same surface \[m\].
    pub fn facet_m(&self, texel_px: DVec2, position: DVec3) -> f64 {
        let (at_px, depth_m) = self.view.project(position);
        FACET_SLOPE * self.texel_m(depth_m) * at_px.distance(texel_px)
    }

    /// Whether a texel may let light pass to the receiver's plane, and whether it must.
    fn compare(&self, texel: DVec2, position: DVec3, normal: DVec3, depth_m: f64) -> [bool; 2] {
        let stored_m = self.depth_m[(texel.x + texel.y * f64::from(self.view.size[0])) as usize];
        let (origin, direction) = self.view.ray(texel + 0.5);
        let on_plane = normal.dot(position - origin) / normal.dot(direction);
        let texel_m = self.texel_m(depth_m);
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
        let bias_m = SHADOW_BIAS * depth_m + self.facet_m(texel + 0.5, position);
        [
            stored_m + 2e-6 * depth_m >= receivers[0] - bias_m,
            stored_m - 2e-6 * depth_m >= receivers[1] - bias_m,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(degrees: f64) -> DVec3 {
        let radians = degrees.to_radians();
        DVec3::new(radians.sin(), 0.0, radians.cos())
    }

    /// α = 1: D = 1/π. Straight on, G₂ = 1: f = F₀/(4π). At 60° on both sides, Λ = 1/2, G₂ = 1/2, F
    /// = 1 for F₀ = 1: f = 1/(2π); for F₀ = 0, 1/32 of it. α = 1/4, straight on: D = 16/π, f =
    /// 4/π.
    #[test]
    fn the_lobe_has_values_by_hand() {
        let near = |found: DVec3, expected: f64| {
            assert!(
                (found - expected).abs().max_element() < 1e-12 && found.is_finite(),
                "{found} for {expected}"
            )
        };
        near(
            lobe(DVec3::Z, DVec3::Z, DVec3::Z, DVec3::splat(0.5), 1.0),
            0.125 / PI,
        );
        near(
            lobe(DVec3::Z, at(60.0), at(-60.0), DVec3::ONE, 1.0),
            0.5 / PI,
        );
        near(
            lobe(DVec3::Z, at(60.0), at(-60.0), DVec3::ZERO, 1.0),
            1.0 / (64.0 * PI),
        );
        near(
            lobe(DVec3::Z, DVec3::Z, DVec3::Z, DVec3::ONE, 0.5),
            4.0 / PI,
        );
        near(lobe(DVec3::Z, at(95.0), at(20.0), DVec3::ONE, 0.5), 0.0);
        near(lobe(DVec3::Z, at(20.0), at(95.0), DVec3::ONE, 0.5), 0.0);
    }

    /// A spot of full intensity up to its edge covers a cap; one that falls off from its axis has
    /// the closed form of 2π ∫ (1 − θ/b) sin θ dθ.
    #[test]
    fn spots_have_their_solid_angle() {
        assert!((spot_solid_angle(60.0, 60.0) - PI).abs() < 1e-12);
        let (inner, outer) = (20.0f64, 50.0f64);
        let steps = 100_000;
        let sum: f64 = (0..steps)
            .map(|step| {
                let angle = outer * (f64::from(step) + 0.5) / f64::from(steps);
                2.0 * PI
                    * spot_share(angle, inner, outer)
                    * angle.to_radians().sin()
                    * outer.to_radians()
                    / f64::from(steps)
            })
            .sum();
        assert!((spot_solid_angle(inner, outer) / sum - 1.0).abs() < 1e-8);
        assert_eq!(
            [10.0, 20.0, 35.0, 50.0, 60.0].map(|angle| spot_share(angle, 20.0, 50.0)),
            [1.0, 1.0, 0.5, 0.0, 0.0]
        );
    }

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
