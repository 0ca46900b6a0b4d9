//! A sky without clouds: the model of Hosek & Wilkie (2012), with a sun and a ground of our own.
//!
//! Radiance is in watts as bright as so many watts of green light: luminance over 683 lm/W.

use std::f32::consts::PI;

use glam::Vec3;
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};
use rayon::prelude::*;

use crate::image::Image;

/// A cloudless sky over a flat ground. The sun is at +z, `sun_height_deg` up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClearSky {
    /// Height of the sun over the horizon (°), 0 to 90.
    pub sun_height_deg: f32,
    /// Haze: 1 to 10; 2 is a clear day, 6 a hazy one.
    pub turbidity: f32,
    /// Diffuse albedo of the ground, which the sky sees and the scene.
    pub ground: Vec3,
    /// Whether the disc of the sun is in the map.
    pub has_sun: bool,
}

impl Default for ClearSky {
    fn default() -> Self {
        ClearSky {
            sun_height_deg: 45.0,
            turbidity: 3.0,
            ground: Vec3::splat(0.2),
            has_sun: true,
        }
    }
}

/// Diameter of the sun (°).
const SUN_DEG: f32 = 0.533;
/// Irradiance of the sun outside of the air, W/m² of green light: 133.3 klx.
const SOLAR: f32 = 133_300.0 / 683.0;
/// Its colour there: a black body of 5,778 K, of luminance 1.
const SOLAR_COLOR: Vec3 = Vec3::new(1.083, 0.980, 0.955);
/// Wavelengths of the three channels (µm).
const WAVELENGTHS: Vec3 = Vec3::new(0.610, 0.550, 0.465);
/// What ozone takes at these of the light (1/cm), of a layer of so many cm (Preetham et al. 1999,
/// appendix).
const OZONE: (Vec3, f32) = (Vec3::new(0.120, 0.085, 0.010), 0.35);
/// Width of a map without and with a sun, which is three texels wide then.
const WIDTHS: [u32; 2] = [1024, 2048];
/// Places of a texel along each axis where the disc is looked for.
const PLACES: u32 = 8;

impl ClearSky {
    /// Unit direction of the sun.
    pub fn to_sun(&self) -> Vec3 {
        let (sin, cos) = self.sun_height_deg.to_radians().sin_cos();
        Vec3::new(0.0, sin, cos)
    }

    /// Irradiance of the sun on a facing surface (W/m²): what Rayleigh scattering, haze and ozone
    /// leave of it (Preetham et al. 1999, appendix).
    pub fn sun_irradiance(&self) -> Vec3 {
        let zenith_deg = 90.0 - self.sun_height_deg;
        // Masses of air on the way (Kasten 1989, as in the appendix).
        let masses = 1.0
            / (zenith_deg.to_radians().cos().max(0.0) + 0.15 * (93.885 - zenith_deg).powf(-1.253));
        let of = |wavelength: f32, ozone: f32| {
            let rayleigh = 0.008_735 * wavelength.powf(-4.08);
            let haze = (0.046_08 * self.turbidity - 0.045_86) * wavelength.powf(-1.3);
            (-masses * (rayleigh + haze + OZONE.1 * ozone)).exp()
        };
        let left: [f32; 3] = std::array::from_fn(|at| of(WAVELENGTHS[at], OZONE.0[at]));
        SOLAR * SOLAR_COLOR * Vec3::from(left)
    }

    /// The map, equirectangular (W/(m² sr)).
    pub(super) fn image(&self) -> Result<Image, String> {
        let state = SkyState::new(&SkyParams {
            elevation: self.sun_height_deg.to_radians().min(0.5 * PI),
            turbidity: self.turbidity,
            albedo: self.ground.to_array(),
        })
        .map_err(|error| error.to_string())?;
        let width = WIDTHS[usize::from(self.has_sun)];
        let height = width / 2;
        let to_sun = self.to_sun();
        let air = |direction: Vec3| {
            let gamma = direction.dot(to_sun).clamp(-1.0, 1.0).acos();
            let theta = direction.y.clamp(0.0, 1.0).acos();
            let of = |channel| state.radiance(theta, gamma, channel);
            Vec3::new(of(Channel::R), of(Channel::G), of(Channel::B)).max(Vec3::ZERO)
        };
        let row = |y: u32| (0..width).map(move |x| direction_of(x as f32, y as f32, width));
        let mut pixels: Vec<Vec3> = (0..height)
            .into_par_iter()
            .flat_map_iter(row)
            .map(air)
            .collect();
        let mut on_ground = Vec3::ZERO;
        for y in 0..height / 2 {
            let solid_angle = solid_angle_of(y, width);
            for x in 0..width {
                let cosine = direction_of(x as f32, y as f32, width).y;
                on_ground += solid_angle * cosine * pixels[(y * width + x) as usize];
            }
        }
        if self.has_sun {
            on_ground += to_sun.y * self.sun_irradiance();
            self.add_sun(&mut pixels, width);
        }
        let ground = self.ground * on_ground / PI;
        pixels[(height / 2 * width) as usize..].fill(ground);
        Ok(Image {
            width,
            height,
            pixels,
        })
    }

    /// Adds the disc: texels by how much of each is in it, and together as bright as it is.
    fn add_sun(&self, pixels: &mut [Vec3], width: u32) {
        let to_sun = self.to_sun();
        let reach = (0.5 * SUN_DEG).to_radians().cos();
        let mut texels = Vec::new();
        let mut all = 0.0;
        for y in 0..width / 4 {
            // No texel of another row has any of the disc.
            let middle = direction_of(0.0, y as f32, width).y.asin().to_degrees();
            if (middle - self.sun_height_deg).abs() > SUN_DEG {
                continue;
            }
            for x in 0..width {
                let is_in = |place: u32| {
                    let at = |part: u32| (part as f32 + 0.5) / PLACES as f32 - 0.5;
                    let (dx, dy) = (at(place % PLACES), at(place / PLACES));
                    direction_of(x as f32 + dx, y as f32 + dy, width).dot(to_sun) > reach
                };
                let count = (0..PLACES * PLACES).filter(|place| is_in(*place)).count();
                if count > 0 {
                    let share = count as f32 / (PLACES * PLACES) as f32;
                    texels.push(((y * width + x) as usize, share));
                    all += share * solid_angle_of(y, width);
                }
            }
        }
        let radiance = self.sun_irradiance() / all.max(f32::MIN_POSITIVE);
        for (texel, share) in texels {
            pixels[texel] += share * radiance;
        }
    }
}

/// Unit direction of a place in an equirectangular map: 0, 0 is the middle of its first texel.
fn direction_of(x: f32, y: f32, width: u32) -> Vec3 {
    let (u, v) = ((x + 0.5) / width as f32, (y + 0.5) / (width / 2) as f32);
    let ((sin, cos), (flat, up)) = ((2.0 * PI * u).sin_cos(), (PI * v).sin_cos());
    Vec3::new(flat * sin, up, -flat * cos)
}

/// Of a texel of a row (sr).
fn solid_angle_of(y: u32, width: u32) -> f32 {
    let edge = |y: u32| (PI * y as f32 / (width / 2) as f32).cos();
    (edge(y) - edge(y + 1)) * 2.0 * PI / width as f32
}
