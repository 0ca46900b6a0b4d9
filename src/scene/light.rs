//! Analytic lights (units as in the radiometric contract).

use glam::Vec3;

/// Largest light value [W/m², W/sr, W/(m² sr)]: beyond it 32-bit sums lose meaning.
pub(super) const LIGHT_MAX: f32 = 1e12;

/// A light without extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Parallel light.
    Directional {
        /// Unit direction of travel.
        direction: Vec3,
        /// Irradiance on a plane perpendicular to the beam [W/m²].
        irradiance: Vec3,
    },
    /// Isotropic point light, inverse-square falloff.
    Point {
        /// Position \[m\].
        position: Vec3,
        /// Intensity [W/sr].
        intensity: Vec3,
    },
    /// Spot light: full intensity inside the inner half angle, falling linearly in angle to nothing
    /// at the outer half angle.
    Spot {
        /// Position \[m\].
        position: Vec3,
        /// Unit direction of travel on the axis.
        direction: Vec3,
        /// Intensity on the axis [W/sr].
        intensity: Vec3,
        /// Inner half angle \[degrees\], 0 to outer.
        inner_deg: f32,
        /// Outer half angle \[degrees\], below 90.
        outer_deg: f32,
    },
}

impl Light {
    /// Unit direction from `point` towards the light, the distance to it \[m\] (infinite for a
    /// directional light), and the irradiance on a plane at `point` that faces the light
    /// [W/m²], were nothing in the way.
    pub fn sample(&self, point: Vec3) -> (Vec3, f32, Vec3) {
        match *self {
            Light::Directional {
                direction,
                irradiance,
            } => (-direction, f32::INFINITY, irradiance),
            Light::Point {
                position,
                intensity,
            } => {
                let to_light = position - point;
                let distance_m = to_light.length();
                (
                    to_light / distance_m,
                    distance_m,
                    intensity / (distance_m * distance_m),
                )
            }
            Light::Spot {
                position,
                direction,
                intensity,
                inner_deg,
                outer_deg,
            } => {
                let to_light = position - point;
                let distance_m = to_light.length();
                let wi = to_light / distance_m;
                let angle_deg = (-wi).dot(direction).clamp(-1.0, 1.0).acos().to_degrees();
                let falloff = if angle_deg <= inner_deg {
                    1.0
                } else {
                    ((outer_deg - angle_deg) / (outer_deg - inner_deg)).max(0.0)
                };
                (
                    wi,
                    distance_m,
                    intensity * (falloff / (distance_m * distance_m)),
                )
            }
        }
    }
}
