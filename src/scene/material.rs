//! Surface materials.

use glam::Vec3;

/// A GGX lobe with Schlick Fresnel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Specular {
    /// Reflectance at normal incidence of the dielectric part, 0 to 1.
    pub f0: Vec3,
    /// Perceptual roughness r, 0 to 1; GGX α = r².
    pub roughness: f32,
    /// 0 (dielectric) to 1 (metal: F0 is the albedo and nothing is diffuse).
    pub metalness: f32,
    /// Index into the textures, kind `Color`: its colour multiplies `f0`, its alpha `roughness`.
    pub texture: Option<u32>,
}

/// A material: Lambert, two-sided for transport, with optional emission (front side only), mask,
/// normal map and specular lobe.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the MTL.
    pub name: String,
    /// Diffuse albedo, multiplied by `albedo_texture` where there is one; 0 to 1.
    pub albedo: Vec3,
    /// Index into [`super::Scene::textures`], kind [`super::TextureKind::Color`].
    pub albedo_texture: Option<u32>,
    /// Emitted radiance [W/(m² sr)], front side only, multiplied by `emission_texture` where there
    /// is one.
    pub emission: Vec3,
    /// Index into the textures, kind `Color`.
    pub emission_texture: Option<u32>,
    /// Alpha mask, kind [`super::TextureKind::Mask`]: below 0.5 there is no surface.
    pub mask_texture: Option<u32>,
    /// Tangent-space normal map, kind [`super::TextureKind::Normal`]; bump maps are converted to
    /// it on loading.
    pub normal_texture: Option<u32>,
    /// Specular lobe; `None` is a purely diffuse surface.
    pub specular: Option<Specular>,
    /// What light passes through; `None` is opaque.
    pub transmission: Option<Transmission>,
}

/// What passes through a surface: the reference shows it. Techniques leave a surface out of which
/// more than half is clear, and take another for opaque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transmission {
    /// Share of the surface that is clear, above 0, at most 1. The rest is as the material says.
    pub share: f32,
    /// T_f: what is left of light that has passed a body, which has two surfaces, or a thin sheet,
    /// 0 to 1.
    pub filter: Vec3,
    /// Index of refraction of the body behind the front sides, 1 to 4; 1: a thin sheet, which light
    /// passes straight.
    pub index: f32,
}

impl Default for Material {
    fn default() -> Self {
        Material {
            name: String::from("default"),
            albedo: Vec3::splat(0.5),
            albedo_texture: None,
            emission: Vec3::ZERO,
            emission_texture: None,
            mask_texture: None,
            normal_texture: None,
            specular: None,
            transmission: None,
        }
    }
}
