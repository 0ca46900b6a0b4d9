//! What surfaces reflect of analytic lights.

use std::f64::consts::PI;

use glam::DVec3;

use crate::scene::Light;

/// The smallest α of a lobe.
pub const SMALLEST_ALPHA: f64 = 1e-3;

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
}
