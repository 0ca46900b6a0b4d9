//! The names of what an image can show.

use crate::text::quoted;
use std::fmt;
use std::str::FromStr;

/// An arbitrary output variable: which quantity of the frame an image shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Aov {
    /// Outgoing radiance L = L_e + L_direct + ρ/π · E_i + L_s [W/(m² sr)].
    Full,
    /// Radiance of the analytic lights' light, reflected exactly once [W/(m² sr)].
    Direct,
    /// Indirect radiance ρ/π · E_i + L_s [W/(m² sr)].
    Indirect,
    /// Indirect diffuse irradiance E_i, from surfaces (what they emit included) and the environment
    /// [W/m²].
    Diffuse,
    /// Indirect specular radiance L_s [W/(m² sr)].
    Specular,
    /// Ambient visibility, 0 to 1.
    Visibility,
    /// Emitted radiance that is seen directly [W/(m² sr)].
    Emission,
    /// Diffuse albedo ρ, 0 to 1.
    Albedo,
    /// Shading normal, world space, each component −1 to 1.
    Normal,
    /// Distance along the view axis (m); 0 where nothing is seen.
    Depth,
    /// Where a pixel's surface is another than that of a pixel to its right, below it or both: red
    /// 1 by position, green 1 by shading normal, else 0. The limits are those within which the
    /// technique's pixels share light, so a reference has none.
    Discontinuity,
}

impl Aov {
    /// All of them, in the order of the documentation.
    pub const ALL: [Aov; 11] = [
        Aov::Full,
        Aov::Direct,
        Aov::Indirect,
        Aov::Diffuse,
        Aov::Specular,
        Aov::Visibility,
        Aov::Emission,
        Aov::Albedo,
        Aov::Normal,
        Aov::Depth,
        Aov::Discontinuity,
    ];

    /// Whether it is light, whose picture may be too dark or too bright to judge.
    pub fn is_light(self) -> bool {
        !matches!(
            self,
            Aov::Visibility | Aov::Albedo | Aov::Normal | Aov::Depth | Aov::Discontinuity
        )
    }

    /// The name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Aov::Full => "full",
            Aov::Direct => "direct",
            Aov::Indirect => "indirect",
            Aov::Diffuse => "diffuse",
            Aov::Specular => "specular",
            Aov::Visibility => "visibility",
            Aov::Emission => "emission",
            Aov::Albedo => "albedo",
            Aov::Normal => "normal",
            Aov::Depth => "depth",
            Aov::Discontinuity => "discontinuity",
        }
    }
}

impl fmt::Display for Aov {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// No [`Aov`] has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown output {}; known are full, direct, indirect, diffuse, specular, visibility, \
     emission, albedo, normal, depth, discontinuity",
    quoted(.0)
)]
pub struct UnknownAov(String);

impl FromStr for Aov {
    type Err = UnknownAov;

    fn from_str(name: &str) -> Result<Self, UnknownAov> {
        Aov::ALL
            .into_iter()
            .find(|aov| aov.name() == name)
            .ok_or_else(|| UnknownAov(name.to_owned()))
    }
}
