//! What a render gives: the terms per pixel, their measured error, and what is seen at the pixel
//! centres.

use glam::Vec3;

use super::path::Terms;
use super::world::Surface;
use crate::image::{Aov, GuideImage, Image, IndirectImage, Planes, luminance};

/// Mean of the batches of a pixel, and their spread (B. Welford, 1962).
#[derive(Clone, Default)]
pub(super) struct Accumulator {
    mean: Terms,
    batches: u32,
    /// Sum of squared deviations of the batches' luminance: of radiance, of indirect radiance.
    spread: [f32; 2],
}

impl Accumulator {
    /// Adds the mean of one batch.
    pub(super) fn add(&mut self, batch: Terms) {
        self.batches += 1;
        let measured = |terms: &Terms| [luminance(terms.radiance()), luminance(terms.indirect())];
        let (value, before) = (measured(&batch), measured(&self.mean));
        let weight = 1.0 / self.batches as f32;
        self.mean = self
            .mean
            .zip(batch, |mean, value| mean + (value - mean) * weight);
        let after = measured(&self.mean);
        for i in 0..2 {
            self.spread[i] += (value[i] - before[i]) * (value[i] - after[i]);
        }
    }

    pub(super) fn mean(&self) -> &Terms {
        &self.mean
    }

    pub(super) fn batches(&self) -> u32 {
        self.batches
    }

    /// Variance of the mean radiance's luminance; infinite while unknown.
    pub(super) fn radiance_variance(&self) -> f32 {
        self.variance(0)
    }

    fn variance(&self, which: usize) -> f32 {
        if self.batches < 2 {
            f32::INFINITY
        } else {
            self.spread[which].max(0.0) / (self.batches as f32 * (self.batches - 1) as f32)
        }
    }
}

/// Standard errors of luminance, each relative to the image's mean.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct StandardError {
    /// Root mean square over pixels.
    pub pixel: f32,
    /// Standard error of the mean over the image.
    pub image: f32,
}

/// The reference: the terms of L = L_e + L_direct + ρ/π · E_i + L_s per pixel. Row 0 is at the top;
/// every image has the same size.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceImage {
    /// Emitted radiance seen directly, the environment's included [W/(m² sr)].
    pub emission: Image,
    /// Radiance of the analytic lights' light, reflected once [W/(m² sr)].
    pub direct: Image,
    /// What techniques answer: E_i [W/m²], L_s [W/(m² sr)] and the ambient visibility.
    pub light: IndirectImage,
    /// Indirect diffuse radiance ρ/π E_i, averaged over the pixel as a product [W/(m² sr)].
    pub diffuse: Image,
    /// Diffuse albedo at the pixel centre.
    pub albedo: Image,
    /// Shading normal at the pixel centre, on the camera's side.
    pub normal: Image,
    /// Geometry at the pixel centre.
    pub guide: GuideImage,
    /// Variance of the mean luminance of the radiance, per pixel; infinite where a single batch
    /// was taken.
    pub radiance_variance: Vec<f32>,
    /// Variance of the mean luminance of the indirect radiance, per pixel.
    pub indirect_variance: Vec<f32>,
    /// Samples taken, per pixel.
    pub samples: Vec<f32>,
}

impl ReferenceImage {
    /// An image in which nothing is known yet.
    pub(super) fn new(width: u32, height: u32) -> Self {
        let (black, zeros) = (
            Image::new(width, height),
            vec![0.0; width as usize * height as usize],
        );
        ReferenceImage {
            emission: black.clone(),
            direct: black.clone(),
            light: IndirectImage::new(width, height),
            diffuse: black.clone(),
            albedo: black.clone(),
            normal: black,
            guide: GuideImage::new(width, height),
            radiance_variance: zeros.clone(),
            indirect_variance: zeros.clone(),
            samples: zeros,
        }
    }

    pub(super) fn set(&mut self, slot: usize, pixel: &Accumulator, batch_spp: u32) {
        let terms = pixel.mean();
        self.emission.pixels[slot] = terms.emission;
        self.direct.pixels[slot] = terms.direct;
        self.light.irradiance.pixels[slot] = terms.irradiance;
        self.diffuse.pixels[slot] = terms.diffuse;
        self.light.specular.pixels[slot] = terms.specular;
        self.light.visibility[slot] = terms.visibility;
        self.radiance_variance[slot] = pixel.variance(0);
        self.indirect_variance[slot] = pixel.variance(1);
        self.samples[slot] = (pixel.batches() * batch_spp) as f32;
    }

    pub(super) fn set_surface(&mut self, slot: usize, surface: &Surface, depth_m: f32) {
        self.albedo.pixels[slot] = surface.albedo;
        self.normal.pixels[slot] = surface.normal;
        self.guide.position[slot] = surface.position;
        self.guide.normal[slot] = surface.geometric_normal;
        self.guide.depth_m[slot] = depth_m;
        self.guide.material[slot] = surface.material;
    }

    /// Width and height (px).
    pub fn size(&self) -> (u32, u32) {
        self.direct.size()
    }

    /// Outgoing radiance [W/(m² sr)].
    pub fn radiance(&self) -> Image {
        self.map(|i| {
            self.emission.pixels[i]
                + self.direct.pixels[i]
                + self.diffuse.pixels[i]
                + self.light.specular.pixels[i]
        })
    }

    /// Indirect radiance ρ/π E_i + L_s [W/(m² sr)].
    pub fn indirect(&self) -> Image {
        self.map(|i| self.diffuse.pixels[i] + self.light.specular.pixels[i])
    }

    /// The image of one output, by its name; `None` for what depends on settings of techniques.
    pub fn aov(&self, aov: Aov) -> Option<Image> {
        Some(match aov {
            Aov::Full => self.radiance(),
            Aov::Direct => self.direct.clone(),
            Aov::Indirect => self.indirect(),
            Aov::Diffuse => self.light.irradiance.clone(),
            Aov::Specular => self.light.specular.clone(),
            Aov::Visibility => self.map(|i| Vec3::splat(self.light.visibility[i])),
            Aov::Emission => self.emission.clone(),
            Aov::Albedo => self.albedo.clone(),
            Aov::Normal => self.normal.clone(),
            Aov::Depth => self.map(|i| Vec3::splat(self.guide.depth_m[i])),
            Aov::Discontinuity => return None,
        })
    }

    /// Every output as channels of one file: `full` as R, G, B, the others as layers of their
    /// names, numbers as `visibility.Y` and `depth.Z`.
    pub fn aov_planes(&self) -> Planes {
        let (width, height) = self.size();
        let mut planes = Planes::new(width, height);
        planes.push_image("", &self.radiance());
        for aov in Aov::ALL
            .into_iter()
            .filter(|aov| !matches!(aov, Aov::Full | Aov::Visibility | Aov::Depth))
        {
            if let Some(image) = self.aov(aov) {
                planes.push_image(aov.name(), &image);
            }
        }
        planes.push("visibility.Y", self.light.visibility.clone());
        planes.push("depth.Z", self.guide.depth_m.clone());
        planes
    }

    /// Measured noise of the radiance.
    pub fn radiance_error(&self) -> StandardError {
        relative_error(&self.radiance(), &self.radiance_variance)
    }

    /// Measured noise of the indirect radiance, relative to the mean indirect radiance.
    pub fn indirect_error(&self) -> StandardError {
        relative_error(&self.indirect(), &self.indirect_variance)
    }

    /// Noise of the ambient visibility, relative to its mean: that of n rays of which a share V is
    /// open has the variance V (1 − V) / n, and less where occluders count in part.
    pub fn visibility_error(&self) -> StandardError {
        let variance = |(&open, &samples): (&f32, &f32)| open * (1.0 - open) / samples.max(1.0);
        let seen = &self.light.visibility;
        let variances: Vec<f32> = seen.iter().zip(&self.samples).map(variance).collect();
        relative_error(&self.map(|i| Vec3::splat(seen[i])), &variances)
    }

    /// Mean number of samples per pixel.
    pub fn mean_samples(&self) -> f64 {
        self.samples
            .iter()
            .map(|&samples| f64::from(samples))
            .sum::<f64>()
            / self.samples.len().max(1) as f64
    }

    fn map(&self, f: impl FnMut(usize) -> Vec3) -> Image {
        let (width, height) = self.size();
        Image::from_fn(width, height, f)
    }
}

/// Zero where there is no light at all.
fn relative_error(image: &Image, variance: &[f32]) -> StandardError {
    let count = image.pixels.len().max(1) as f64;
    let mean = image
        .pixels
        .iter()
        .map(|&pixel| f64::from(luminance(pixel)))
        .sum::<f64>()
        / count;
    let total: f64 = variance.iter().map(|&value| f64::from(value)).sum();
    if total == 0.0 {
        return StandardError {
            pixel: 0.0,
            image: 0.0,
        };
    }
    StandardError {
        pixel: ((total / count).sqrt() / mean) as f32,
        image: (total.sqrt() / count / mean) as f32,
    }
}
