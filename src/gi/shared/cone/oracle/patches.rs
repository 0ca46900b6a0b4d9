//! CPU twin of `cone.patches`: the light of discs that emit, each seen by a cone as wide as the
//! disc, in f64.

use glam::DVec3;

use super::{Cone, LEAST_STEP_DENOMINATOR, Levels, MarchSettings, apex, march_to};
use crate::gi::shared::voxel::oracle::Receiver;

/// A disc that emits from one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Its centre \[voxels\].
    pub position: DVec3,
    /// Unit normal of the side that emits.
    pub normal: DVec3,
    /// Area that emits (voxels²).
    pub area: f64,
    /// Radius \[voxels\].
    pub radius: f64,
    /// Emitted radiance [W/(m² sr)].
    pub radiance: DVec3,
}

/// Irradiance [W/m²] at a receiver if nothing hides the disc: L A cos θ cos θ' / (d² + r²), which
/// is exact over the centre of a disc, and far from any surface.
pub fn unhidden(disc: &Disc, receiver: &Receiver) -> DVec3 {
    let offset = disc.position - receiver.position;
    let to_disc = offset.normalize_or_zero();
    if receiver.geometric_normal.dot(to_disc) <= 0.0 {
        return DVec3::ZERO;
    }
    let cosines =
        receiver.shading_normal.dot(to_disc).max(0.0) * (-disc.normal.dot(to_disc)).max(0.0);
    disc.radiance * disc.area * cosines / (offset.length_squared() + disc.radius * disc.radius)
}

/// Fraction of the disc that a receiver sees: the transmittance of a cone from `start_offset` over
/// its surface, whose last sample is over the disc's plane by `start_offset`, and, where no clamp
/// keeps it narrow, by its own diameter.
pub fn visibility<'l>(
    levels: impl Into<Levels<'l>>,
    disc: &Disc,
    receiver: &Receiver,
    start_offset: f64,
    settings: &MarchSettings,
) -> f64 {
    let levels = levels.into();
    let (origin, height) = apex(levels, receiver, start_offset);
    let way = disc.position - origin;
    let (distance, direction) = (way.length(), way.normalize_or_zero());
    let leaving = -disc.normal.dot(direction);
    if leaving <= 1e-3 {
        return 1.0;
    }
    let tan_half = (disc.radius / distance).min(1.0);
    let beta = settings.step_factor;
    let wide_end = distance * leaving / (2.0 * tan_half + leaving)
        * (1.0 - beta * tan_half).max(LEAST_STEP_DENOMINATOR);
    let least = levels.least_diameter(origin + way);
    let narrow_end = distance - start_offset * least / leaving - beta * least / 2.0;
    let settings = MarchSettings {
        max_distance: if settings.height_clamp > 0.0 {
            narrow_end
        } else {
            wide_end.min(narrow_end)
        },
        ao_falloff: 0.0,
        ..*settings
    };
    let cosine = direction.dot(receiver.geometric_normal).max(0.0);
    let cone = Cone {
        origin,
        direction,
        tan_half,
        height,
        cosine,
    };
    march_to(
        levels,
        &cone,
        &settings,
        Some((distance * leaving, leaving)),
    )
    .visibility
}

/// Irradiance [W/m²] of all discs at a receiver.
pub fn irradiance<'l>(
    levels: impl Into<Levels<'l>>,
    discs: &[Disc],
    receiver: &Receiver,
    start_offset: f64,
    settings: &MarchSettings,
) -> DVec3 {
    let levels = levels.into();
    let of = |disc: &Disc| {
        let light = unhidden(disc, receiver);
        if light == DVec3::ZERO {
            light
        } else {
            light * visibility(levels, disc, receiver, start_offset, settings)
        }
    };
    discs.iter().map(of).sum()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::gi::shared::cone::oracle::Volume;
    use glam::DVec4;

    const MARCH: MarchSettings = MarchSettings {
        step_factor: 1.0,
        max_distance: 1e9,
        ..MarchSettings::TEXTBOOK
    };

    fn receiver() -> Receiver {
        Receiver {
            position: DVec3::new(8.0, 8.0, 2.0),
            geometric_normal: DVec3::Z,
            shading_normal: DVec3::Z,
        }
    }

    fn disc(radius: f64) -> Disc {
        Disc {
            position: DVec3::new(8.0, 8.0, 12.0),
            normal: DVec3::NEG_Z,
            area: PI * radius * radius,
            radius,
            radiance: DVec3::splat(2.0),
        }
    }

    /// E = π L r² / (d² + r²) over the centre of a disc, as large as it may be: π L of an endless
    /// one.
    #[test]
    fn light_over_a_disc_is_exact() {
        for radius in [0.1, 3.0, 50.0] {
            let expected = 2.0 * PI * radius * radius / (100.0 + radius * radius);
            assert!((unhidden(&disc(radius), &receiver()).x - expected).abs() < 1e-12);
        }
        let behind = Disc {
            normal: DVec3::Z,
            ..disc(1.0)
        };
        let below = Disc {
            position: DVec3::new(8.0, 8.0, 1.0),
            normal: DVec3::Z,
            ..disc(1.0)
        };
        assert_eq!(
            [
                unhidden(&behind, &receiver()),
                unhidden(&below, &receiver())
            ],
            [DVec3::ZERO; 2]
        );
    }

    /// An opaque wall at the disc's own place does not hide it, one half way does, and one behind
    /// it is not reached.
    #[test]
    fn a_disc_is_hidden_by_what_is_in_front() {
        // Half a step off its middle, a wall one voxel thick lets a quarter through at g = 1.
        let march = MarchSettings {
            opacity_exponent: 2.0,
            ..MARCH
        };
        for (z, expected) in [(7, 0.0), (12, 1.0), (14, 1.0)] {
            let wall = [Volume::new(16, |[_, _, at]| {
                if at == z { DVec4::W } else { DVec4::ZERO }
            })];
            let seen = visibility(wall.as_slice(), &disc(0.3), &receiver(), 1.5, &march);
            assert!((seen - expected).abs() < 0.1, "a wall at {z}: {seen}");
        }
    }
}
