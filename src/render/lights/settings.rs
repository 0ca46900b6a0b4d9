//! How finely lights are mapped.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// Angular diameter of the sun as the earth sees it (degrees).
pub const SUN_ANGLE_DEG: f32 = 0.53;

/// Possible numbers of cascades.
pub const CASCADES: RangeInclusive<u32> = 1..=6;

/// How the direct light compares with a shadow map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShadowFilter {
    /// One comparison, with the nearest texel.
    Point,
    /// Four comparisons, weighted bilinearly (percentage closer filtering).
    #[default]
    Pcf,
    /// Of directional lights: a mean over the penumbra of a light of
    /// [`ShadowSettings::sun_angle_deg`] (Fernando 2005). Of others as [`ShadowFilter::Pcf`].
    Pcss,
}

impl ShadowFilter {
    /// All of them.
    pub const ALL: [ShadowFilter; 3] = [ShadowFilter::Point, ShadowFilter::Pcf, ShadowFilter::Pcss];

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            ShadowFilter::Point => "point",
            ShadowFilter::Pcf => "pcf",
            ShadowFilter::Pcss => "pcss",
        }
    }
}

impl fmt::Display for ShadowFilter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for ShadowFilter {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        ShadowFilter::ALL
            .into_iter()
            .find(|filter| filter.name() == text)
            .ok_or_else(|| String::from("write point, pcf or pcss"))
    }
}

/// The maps of the lights, and how the direct light reads them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowSettings {
    /// Width and height of each shadow map and reflective shadow map (texels).
    pub resolution: u32,
    /// Maps of a directional light, 1 to 6 ([`CASCADES`]). With 1, it is one map of the whole
    /// scene. With more, the direct light has as many, each of a part of what the camera sees, and
    /// light injection has as many around the camera, each twice as wide as the one before.
    pub cascades: u32,
    /// ρ of the practical split C = ρ C_log + (1 − ρ) C_uni (Zhang et al. 2006), 0 to 1.
    pub split_lambda: f32,
    /// How the direct light compares.
    pub filter: ShadowFilter,
    /// Angular diameter of directional lights for [`ShadowFilter::Pcss`] (degrees), above 0 and at
    /// most 20.
    pub sun_angle_deg: f32,
}

impl ShadowSettings {
    /// One map a light, of this width and height (texels).
    pub const fn of_resolution(resolution: u32) -> Self {
        ShadowSettings {
            resolution,
            cascades: 1,
            split_lambda: 0.995,
            filter: ShadowFilter::Pcf,
            sun_angle_deg: SUN_ANGLE_DEG,
        }
    }

    /// What differs from [`ShadowSettings::of_resolution`], by the names of the options of the
    /// command line without their dashes before.
    pub fn changes(&self) -> Vec<(&'static str, String)> {
        let plain = ShadowSettings::of_resolution(self.resolution);
        let all = |settings: &ShadowSettings| {
            [
                ("cascades", settings.cascades.to_string()),
                ("split-lambda", settings.split_lambda.to_string()),
                ("shadow-filter", settings.filter.to_string()),
                ("sun-angle", settings.sun_angle_deg.to_string()),
            ]
        };
        let changed = all(self).into_iter().zip(all(&plain));
        changed
            .filter(|(own, plain)| own != plain)
            .map(|(own, _)| own)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_what_differs() {
        let plain = ShadowSettings::of_resolution(64);
        assert_eq!(plain.changes(), []);
        let other = ShadowSettings {
            cascades: 4,
            filter: ShadowFilter::Pcss,
            ..plain
        };
        assert_eq!(
            other.changes(),
            [
                ("cascades", "4".to_owned()),
                ("shadow-filter", "pcss".to_owned())
            ]
        );
        assert_eq!("point".parse(), Ok(ShadowFilter::Point));
        assert!("soft".parse::<ShadowFilter>().is_err());
    }
}
