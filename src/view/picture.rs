//! From light to colours on the screen.

use std::sync::OnceLock;

use glam::Vec3;

use super::views::View;
use crate::gi::inspect::Scale;
use crate::image::{Aov, Image, heat_color, luminance, srgb_from_linear};
use crate::render::Terms;

/// The output of `lumivox render` that shows these terms; `None` where there is none.
pub(super) fn aov_of(terms: Terms) -> Option<Aov> {
    let Terms {
        direct,
        diffuse,
        specular,
        emission,
        visibility,
    } = terms;
    match (direct, diffuse, specular, emission, visibility) {
        (true, true, true, true, false) => Some(Aov::Full),
        (true, false, false, false, false) => Some(Aov::Direct),
        (false, true, true, false, false) => Some(Aov::Indirect),
        (false, false, false, true, false) => Some(Aov::Emission),
        (false, false, true, false, false) => Some(Aov::Specular),
        _ => None,
    }
}

/// The terms that an output of `lumivox render` is the sum of; `None` where it is no such sum.
pub(super) fn terms_of(aov: Aov) -> Option<Terms> {
    let none = Terms::NONE;
    Some(match aov {
        Aov::Full => Terms::ALL,
        Aov::Direct => Terms {
            direct: true,
            ..none
        },
        Aov::Indirect => Terms {
            diffuse: true,
            specular: true,
            ..none
        },
        Aov::Specular => Terms {
            specular: true,
            ..none
        },
        Aov::Emission => Terms {
            emission: true,
            ..none
        },
        Aov::Diffuse
        | Aov::Visibility
        | Aov::Albedo
        | Aov::Normal
        | Aov::Depth
        | Aov::Discontinuity => return None,
    })
}

/// How light becomes 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ToneMap {
    /// Times the exposure, clamped: what `lumivox render` writes as PNG.
    Clamp,
    /// L (1 + L/16) / (1 + L), white at 4 (Reinhard et al. 2002, equation 4).
    Reinhard,
}

/// How a view is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    /// Factor before the tone map.
    pub(super) exposure: f32,
    /// How radiances become display values.
    pub(super) tone_map: ToneMap,
}

/// 8-bit sRGB of a view's picture.
pub(super) fn develop(image: &Image, view: &View, look: Look) -> Vec<[u8; 3]> {
    let table = EncodeTable::get();
    let encode = |pixel: Vec3| pixel.to_array().map(|linear| table.encode(linear));
    match view.scale {
        Scale::Light if look.tone_map == ToneMap::Clamp => image
            .pixels
            .iter()
            .map(|&pixel| encode(pixel * look.exposure))
            .collect(),
        Scale::Light => image
            .pixels
            .iter()
            .map(|&pixel| encode(reinhard(pixel * look.exposure)))
            .collect(),
        Scale::Share => image.pixels.iter().map(|&pixel| encode(pixel)).collect(),
        // Without the transfer function, as normals are looked at everywhere.
        Scale::Signed => image
            .pixels
            .iter()
            .map(|pixel| {
                pixel
                    .to_array()
                    .map(|x| ((0.5 * x + 0.5).clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
            })
            .collect(),
        Scale::Range => {
            let most = image
                .pixels
                .iter()
                .map(|pixel| pixel.max_element())
                .filter(|most| most.is_finite())
                .fold(0.0, f32::max);
            image
                .pixels
                .iter()
                .map(|&pixel| encode(pixel / most.max(1e-30)))
                .collect()
        }
    }
}

/// [`srgb_from_linear`] without its power, for whole pictures many times a second.
struct EncodeTable {
    /// By value in steps of 1/4096: its code.
    codes: Vec<u8>,
    /// By code: the smallest value that has it.
    least: Vec<f32>,
}

/// By sRGB code of 8 bits: the smallest light that has it.
pub(super) fn least_light() -> &'static [f32] {
    &EncodeTable::get().least
}

const TABLE_STEPS: usize = 4096;

impl EncodeTable {
    fn get() -> &'static Self {
        static TABLE: OnceLock<EncodeTable> = OnceLock::new();
        TABLE.get_or_init(|| {
            // Positive floats are ordered as their bits are.
            let least = |code: u8| {
                let (mut low, mut high) = (0, 1f32.to_bits());
                while low < high {
                    let middle = low + (high - low) / 2;
                    if srgb_from_linear(f32::from_bits(middle)) >= code {
                        high = middle
                    } else {
                        low = middle + 1
                    }
                }
                f32::from_bits(high)
            };
            let codes = (0..=TABLE_STEPS)
                .map(|step| srgb_from_linear(step as f32 / TABLE_STEPS as f32))
                .collect();
            EncodeTable {
                codes,
                least: (0..=255).map(least).collect(),
            }
        })
    }

    fn encode(&self, linear: f32) -> u8 {
        // NaN is 0.
        let value = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
        let mut code = self.codes[(value * TABLE_STEPS as f32) as usize];
        while code < 255 && value >= self.least[code as usize + 1] {
            code += 1;
        }
        code
    }
}

fn reinhard(pixel: Vec3) -> Vec3 {
    let light = luminance(pixel).max(0.0);
    pixel * ((1.0 + light / 16.0) / (1.0 + light))
}

/// Heat map of the luminance's error against the reference, relative to the reference's mean,
/// `scale` and above brightest; and the figures. `noise` is the reference's (W/(m² sr)).
pub(super) fn difference(
    image: &Image,
    reference: &Image,
    noise: Option<f32>,
    scale: f32,
) -> Option<(Vec<[u8; 3]>, Figures)> {
    if image.size() != reference.size() {
        return None;
    }
    let count = image.pixels.len().max(1) as f64;
    let mean = reference
        .pixels
        .iter()
        .map(|&pixel| f64::from(luminance(pixel)))
        .sum::<f64>()
        / count;
    let errors: Vec<f32> = image
        .pixels
        .iter()
        .zip(&reference.pixels)
        .map(|(&a, &b)| luminance(a) - luminance(b))
        .collect();
    let bias = errors.iter().map(|&error| f64::from(error)).sum::<f64>() / count / mean.max(1e-30);
    let rmse = (errors
        .iter()
        .map(|&error| f64::from(error).powi(2))
        .sum::<f64>()
        / count)
        .sqrt()
        / mean.max(1e-30);
    let colors = errors
        .iter()
        .map(|error| heat_color(error.abs() / (scale * mean as f32).max(1e-30)))
        .collect();
    let figures = Figures {
        bias: bias as f32,
        rel_rmse: rmse as f32,
        noise: noise.map(|noise| noise / mean.max(1e-30) as f32),
    };
    Some((colors, figures))
}

/// Of a whole difference, relative to the mean of the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Figures {
    /// Mean of the error.
    pub(super) bias: f32,
    /// Root mean square of the error, with what of it is the reference's noise.
    pub(super) rel_rmse: f32,
    /// Root mean square of the reference's noise; `None` where it is not known yet.
    pub(super) noise: Option<f32>,
}

impl Figures {
    /// In words. No error is told that is below the noise that it was measured with.
    pub(super) fn told(&self, is_done: bool) -> String {
        let refining = if is_done { "" } else { ", refining" };
        let Some(noise) = self.noise else {
            return "the noise of the reference is not known yet, refining".to_owned();
        };
        let error = if self.rel_rmse > noise {
            format!("{} ± {} noise", percent(self.rel_rmse), percent(noise))
        } else {
            format!("no more than {}, the noise", percent(noise))
        };
        let sign = if self.bias < 0.0 { "−" } else { "+" };
        let bias = percent(self.bias.abs());
        format!("rel_rmse {error}, bias {sign}{bias}{refining}")
    }
}

/// With two digits.
fn percent(share: f32) -> String {
    let percent = 100.0 * share;
    match percent {
        0.0..0.095 => format!("{percent:.2}%"),
        0.0..9.95 => format!("{percent:.1}%"),
        _ => format!("{percent:.0}%"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::views::VIEWS;

    #[test]
    fn light_is_shown_as_a_png_of_render_is() {
        let image = Image {
            width: 3,
            height: 1,
            pixels: vec![
                Vec3::splat(0.25),
                Vec3::new(2.0, 0.0, -1.0),
                Vec3::splat(f32::NAN),
            ],
        };
        let shown = develop(
            &image,
            &VIEWS[0],
            Look {
                exposure: 2.0,
                tone_map: ToneMap::Clamp,
            },
        );
        assert_eq!(shown, [[188; 3], [255, 0, 0], [0; 3]]);
    }

    #[test]
    fn the_table_encodes_as_the_formula_does() {
        let table = EncodeTable::get();
        for index in 0..1_000_000 {
            let linear = index as f32 / 999_983.0 - 1e-4;
            assert_eq!(table.encode(linear), srgb_from_linear(linear), "{linear}");
        }
        assert_eq!(
            [f32::NAN, f32::INFINITY, -1.0, 1e-40].map(|x| table.encode(x)),
            [0, 255, 0, 0]
        );
    }

    #[test]
    fn reinhard_keeps_black_and_reaches_white_at_four() {
        assert_eq!(reinhard(Vec3::ZERO), Vec3::ZERO);
        assert!((reinhard(Vec3::splat(4.0)) - 1.0).abs().max_element() < 1e-6);
        assert!(reinhard(Vec3::splat(1.0)).x < 0.6);
    }

    #[test]
    fn a_picture_does_not_differ_from_itself_and_a_brighter_one_does() {
        let image = Image::from_fn(4, 2, |index| Vec3::splat(index as f32));
        assert_eq!(
            difference(&image, &image, None, 0.5).map(|(colors, errors)| (colors[3], errors)),
            Some((heat_color(0.0), Figures::default()))
        );
        let brighter = Image::from_fn(4, 2, |index| Vec3::splat(1.1 * index as f32));
        let bias = difference(&brighter, &image, None, 0.5).map_or(0.0, |(_, all)| all.bias);
        assert!((bias - 0.1).abs() < 1e-5, "{bias}");
        assert_eq!(difference(&image, &Image::new(1, 1), None, 0.5), None);
    }

    #[test]
    fn no_error_is_told_that_is_below_the_noise() {
        let told = |rel_rmse, noise, is_done| {
            let bias = -0.0123;
            let figures = Figures {
                bias,
                rel_rmse,
                noise,
            };
            figures.told(is_done)
        };
        assert_eq!(
            told(0.39, Some(0.35), false),
            "rel_rmse 39% ± 35% noise, bias −1.2%, refining"
        );
        assert_eq!(
            told(0.002, Some(0.0111), true),
            "rel_rmse no more than 1.1%, the noise, bias −1.2%"
        );
        assert!(told(0.39, None, false).contains("not known yet"));
    }

    #[test]
    fn terms_name_the_outputs_that_they_are() {
        for aov in Aov::ALL {
            let terms = terms_of(aov);
            assert!(
                terms.is_none_or(|terms| aov_of(terms) == Some(aov)),
                "{aov}"
            );
        }
        let sums = Aov::ALL.iter().filter(|aov| terms_of(**aov).is_some());
        assert_eq!(sums.count(), 5);
        let looks = Terms {
            visibility: true,
            ..Terms::ALL
        };
        assert_eq!(aov_of(looks), None);
    }
}
