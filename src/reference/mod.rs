//! The CPU path tracer: ground truth in the same units and terms as the techniques.
//!
//! [`render`] answers, per pixel, the terms of the radiometric contract L = L_e + L_direct + ρ/π ·
//! E_i + L_s, for a stated number of indirect bounces or all of them, with the standard error that
//! it measured. Two-sided Lambert with interpolated (and mapped) shading normals, alpha masks,
//! GGX lobes, emission from front sides, analytic lights and a constant environment; light that a
//! shading normal would take from behind the real surface does not count. Results depend on the
//! settings and the seed alone, not on the number of threads.
//!
//! ```
//! use lumivox::reference::{Bounces, Filter, Sampling, Settings, render};
//! use lumivox::scene::Scene;
//!
//! let settings = Settings {
//!     width: 16,
//!     height: 9,
//!     bounces: Bounces::Count(1),
//!     filter: Filter::Center,
//!     sampling: Sampling::Fixed { spp: 4 },
//!     seed: 1,
//!     ..Settings::default()
//! };
//! let image = render(&Scene::default(), &settings, &|_| {})?;
//! assert_eq!(image.radiance().size(), (16, 9));
//! # Ok::<(), lumivox::reference::ReferenceError>(())
//! ```

mod bsdf;
mod cache;
mod emitters;
mod form_factors;
mod glass;
mod patches;
mod path;
mod radiosity;
mod render;
mod result;
mod sampler;
mod substitute;
mod world;

pub use self::cache::{cache_dir, cached};
pub use self::radiosity::{Radiosity, RadiositySettings, render_radiosity};
pub use self::render::{guide, render};
pub use self::result::{ReferenceImage, StandardError};
pub use self::substitute::{gather, light_surfaces, surface_area_m2};
use crate::scene::Scene;
use crate::text::counted;

/// How many times light goes from surface to surface (or from the environment to one), the last
/// time to the one that is seen. Light of the analytic lights reaches its first surface without
/// such a bounce; light of an emitter makes its first one on leaving it, as a technique gathers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Bounces {
    /// At most this many: 0 is direct light only.
    Count(u32),
    /// All of them, by unbiased Russian roulette.
    Full,
}

impl serde::Serialize for Bounces {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Bounces::Count(count) => serializer.serialize_u32(*count),
            Bounces::Full => serializer.serialize_str("full"),
        }
    }
}

impl<'de> serde::Deserialize<'de> for Bounces {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = serde_json::Value::deserialize(deserializer)?;
        let count = || {
            value
                .as_u64()
                .and_then(|count| u32::try_from(count).ok())
                .map(Bounces::Count)
        };
        let bounces = if value == "full" {
            Some(Bounces::Full)
        } else {
            count()
        };
        bounces.ok_or_else(|| serde::de::Error::custom("bounces are a whole number, or \"full\""))
    }
}

/// Where in a pixel the camera looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// At its centre, as a G-buffer does.
    Center,
    /// Anywhere in it: the mean over its square.
    Box,
}

/// How many samples to take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sampling {
    /// The same number for each pixel (samples), rounded up to whole batches.
    Fixed {
        /// Samples per pixel.
        spp: u32,
    },
    /// Until the mean luminance of each block of 8×8 pixels is known well enough. Independent noise
    /// is 8 times that in a pixel. Stopping by an estimate of the error biases the result by a
    /// small part of that error.
    Adaptive {
        /// Largest standard error of a block's mean, relative to that mean plus 1% of the image's.
        max_error: f32,
        /// Stop there in any case [samples per pixel].
        max_spp: u32,
    },
}

/// What to render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Width (px), 1 to [`MAX_SIZE_PX`].
    pub width: u32,
    /// Height (px), 1 to [`MAX_SIZE_PX`].
    pub height: u32,
    /// Indirect bounces.
    pub bounces: Bounces,
    /// Where in a pixel its samples lie.
    pub filter: Filter,
    /// Number of samples.
    pub sampling: Sampling,
    /// Seed of the random numbers.
    pub seed: u64,
    /// How surfaces count in the ambient visibility.
    pub occlusion: Occlusion,
}

/// How surfaces count in the ambient visibility V = 1 − 1/π ∫ f(r) cos θ dω: one that is met at a
/// distance r counts f(r) = 1 / (1 + λ r) up to the longest distance (Crassin et al. 2011). By
/// default all do, wholly.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Occlusion {
    /// The longest distance (m), above 0; `None`: any.
    pub distance_m: Option<f32>,
    /// λ (1/m), 0 or more.
    pub falloff: f32,
}

impl Occlusion {
    /// f of a distance (m).
    pub fn weight(self, distance_m: f32) -> f32 {
        if self.distance_m.is_none_or(|longest| distance_m < longest) {
            1.0 / (1.0 + self.falloff * distance_m)
        } else {
            0.0
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            width: 1280,
            height: 720,
            bounces: Bounces::Full,
            filter: Filter::Center,
            sampling: Sampling::Adaptive {
                max_error: 0.01,
                max_spp: 4096,
            },
            seed: 0,
            occlusion: Occlusion::default(),
        }
    }
}

/// Largest width and height (px).
pub const MAX_SIZE_PX: u32 = 16_384;

/// Largest number of samples per pixel.
pub const MAX_SPP: u32 = 1 << 24;

/// Why there is no reference.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// A setting is out of range.
    #[error("{field} is {value}; it must be {range}")]
    Setting {
        /// The field of [`Settings`].
        field: &'static str,
        /// The value that was given, as text.
        value: String,
        /// What it may be.
        range: &'static str,
    },
    /// The scene refers to what it does not have, or holds numbers that are not finite.
    #[error("the scene {scene} cannot be traced: {problem}")]
    Scene {
        /// The scene's name.
        scene: String,
        /// What is wrong with it.
        problem: String,
    },
}

impl Settings {
    /// Checks every field's range.
    fn validate(&self) -> Result<(), ReferenceError> {
        let check = |is_valid: bool, field, value: String, range| {
            if is_valid {
                Ok(())
            } else {
                Err(ReferenceError::Setting {
                    field,
                    value,
                    range,
                })
            }
        };
        for (field, size) in [("width", self.width), ("height", self.height)] {
            check(
                (1..=MAX_SIZE_PX).contains(&size),
                field,
                format!("{size} px"),
                "1 to 16384 px",
            )?;
        }
        let spp = match self.sampling {
            Sampling::Fixed { spp } => spp,
            Sampling::Adaptive { max_error, max_spp } => {
                check(
                    max_error > 0.0 && max_error.is_finite(),
                    "max_error",
                    max_error.to_string(),
                    "above 0",
                )?;
                max_spp
            }
        };
        let Occlusion {
            distance_m,
            falloff,
        } = self.occlusion;
        check(
            distance_m.is_none_or(|distance_m| distance_m > 0.0 && distance_m.is_finite()),
            "occlusion distance",
            format!("{} m", distance_m.unwrap_or(0.0)),
            "above 0 m",
        )?;
        check(
            falloff >= 0.0 && falloff.is_finite(),
            "occlusion falloff",
            format!("{falloff} 1/m"),
            "0 or more",
        )?;
        check(
            (1..=MAX_SPP).contains(&spp),
            "spp",
            spp.to_string(),
            "1 to 16777216 samples per pixel",
        )
    }
}

/// Checks that every index of a scene is in range and every number that matters finite.
fn validate_scene(scene: &Scene) -> Result<(), ReferenceError> {
    let fail = |problem: String| {
        Err(ReferenceError::Scene {
            scene: scene.name.clone(),
            problem,
        })
    };
    if scene.triangles.len() >= crate::scene::rays::NO_TRIANGLE as usize {
        return fail(format!("{} triangles are too many", scene.triangles.len()));
    }
    for (index, triangle) in scene.triangles.iter().enumerate() {
        if triangle
            .vertices
            .iter()
            .any(|&vertex| vertex as usize >= scene.vertices.len())
        {
            let [a, b, c] = triangle.vertices;
            return fail(format!(
                "triangle {index} has the vertices {a}, {b}, {c} of {}",
                scene.vertices.len()
            ));
        }
        if triangle.material as usize >= scene.materials.len() {
            return fail(format!(
                "triangle {index} has the material {} of {}",
                triangle.material,
                scene.materials.len()
            ));
        }
    }
    for (index, vertex) in scene.vertices.iter().enumerate() {
        if !vertex
            .position
            .iter()
            .chain(&vertex.normal)
            .chain([&vertex.u, &vertex.v])
            .all(|value| value.is_finite())
        {
            return fail(format!("vertex {index} is not finite"));
        }
    }
    for material in &scene.materials {
        let textures = [
            material.albedo_texture,
            material.emission_texture,
            material.mask_texture,
            material.normal_texture,
            material.specular.and_then(|lobe| lobe.texture),
        ];
        if let Some(texture) = textures
            .into_iter()
            .flatten()
            .find(|&texture| texture as usize >= scene.textures.len())
        {
            return fail(format!(
                "material {} has the texture {texture} of {}",
                material.name,
                scene.textures.len()
            ));
        }
    }
    match scene.textures.iter().find(|texture| {
        texture.texels.is_empty()
            || texture.texels.len() != texture.width as usize * texture.height as usize
    }) {
        Some(texture) => fail(format!(
            "texture {} has {}",
            texture.name,
            counted(texture.texels.len(), "texel")
        )),
        None => Ok(()),
    }
}
