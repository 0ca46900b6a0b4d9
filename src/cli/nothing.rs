//! Pictures that show nothing, and why.

use std::fmt;

use crate::image::{Image, luminance, srgb_from_linear};
use crate::scene::{Scene, Sight};

/// Brightest 8-bit value that looks black.
const BLACK_MAX: u8 = 2;

/// Least share of the rays from a camera in a solid that end on backs.
const IN_A_SOLID: f32 = 0.95;

/// How a picture shows nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Nothing {
    /// All of it looks black; the value is its largest luminance [W/(m² sr)].
    Black(f32),
    /// All of it is clipped; the value is its least luminance [W/(m² sr)].
    White(f32),
    /// All pixels are the same.
    OneValue([u8; 3]),
}

impl fmt::Display for Nothing {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Nothing::Black(_) => formatter.write_str("black"),
            Nothing::White(_) => formatter.write_str("white"),
            Nothing::OneValue([r, g, b]) => {
                write!(formatter, "of one value, {r} {g} {b} of 255")
            }
        }
    }
}

impl Nothing {
    /// What is wrong with a picture of more than one pixel; `None` where it shows something.
    pub(super) fn of(image: &Image, exposure: f32) -> Option<Nothing> {
        let encoded = |index: usize| {
            (image.pixels[index] * exposure)
                .to_array()
                .map(srgb_from_linear)
        };
        let (mut low, mut high) = ([u8::MAX; 3], [0; 3]);
        for pixel in (0..image.pixels.len()).map(encoded) {
            low = std::array::from_fn(|channel| low[channel].min(pixel[channel]));
            high = std::array::from_fn(|channel| high[channel].max(pixel[channel]));
        }
        let bright = || image.pixels.iter().map(|&pixel| luminance(pixel));
        match (low, high) {
            _ if image.pixels.len() < 2 => None,
            _ if high.iter().all(|value| *value <= BLACK_MAX) => {
                Some(Nothing::Black(bright().fold(0.0, f32::max)))
            }
            ([u8::MAX, u8::MAX, u8::MAX], _) => {
                Some(Nothing::White(bright().fold(f32::INFINITY, f32::min)))
            }
            _ if low == high => Some(Nothing::OneValue(low)),
            _ => None,
        }
    }

    /// Why, and what to do, by what the scene's camera sees; `exposure` is what it was shown at.
    pub(super) fn reason(self, scene: &Scene, exposure: f32) -> String {
        let sight = scene.sight();
        let camera = "give another camera (--with 'camera = { … }')";
        match self {
            Nothing::White(least) => format!(
                "at exposure {exposure} nothing is darker than white; pass --exposure {:.3e}",
                0.5 / least
            ),
            _ if sight.surfaces == 0.0 => {
                format!("the camera sees no surface; {camera}")
            }
            _ if sight.is_in_a_solid() => {
                format!("the camera is inside a solid, or in a wall, and sees its back; {camera}")
            }
            Nothing::Black(_) if !scene.is_lit() => String::from(
                "there is no light, no emission and no environment; give a light (--with 'light = \
                 […]')",
            ),
            Nothing::Black(most) if most > 0.0 => format!(
                "what the camera sees has at most {most:.1e} W/(m² sr); pass --exposure {:.3e}, or \
                 give more light",
                0.5 / most
            ),
            Nothing::Black(_) if sight.lit == 0.0 => {
                String::from("no light reaches what the camera sees; move the light, or the camera")
            }
            Nothing::Black(_) => {
                String::from("what the camera sees reflects no light; check the materials")
            }
            Nothing::OneValue(_) => String::from(
                "all that the camera sees is of one radiance; check camera, materials and light",
            ),
        }
    }
}

impl Sight {
    /// Whether the camera stands in what it sees.
    pub(super) fn is_in_a_solid(&self) -> bool {
        self.backs >= IN_A_SOLID * self.surfaces && self.surfaces >= IN_A_SOLID
    }
}
