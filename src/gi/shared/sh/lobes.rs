//! Functions that are round about an axis, as one factor a band.
//!
//! The factor of band l is λ_l = 2π ∫ f(z) P_l(z) dz, z the cosine of the angle to the axis. It is
//! what band l is multiplied by when a function is convolved with the lobe (Funk-Hecke). Texts also
//! have the coefficient of Y_l0 of the lobe about +z, z_l = √((2l+1)/4π) λ_l.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, DVec4};

use super::legendre::legendre;

/// λ_l of z^`exponent`, clamped to 0 below the horizon and scaled to an integral of 1;
/// `exponent` ≥ 0 need not be whole.
///
/// From M_l = ∫₀¹ z^s P_l dz: M_0 = 1/(s+1), M_1 = 1/(s+2), M_l = M_{l−2} (s−l+2)/(s+l+1).
pub fn power_lobe(bands: usize, exponent: f64) -> Vec<f64> {
    let (s, mut moments) = (exponent, Vec::with_capacity(bands));
    for l in 0..bands {
        moments.push(match l {
            0 => 1.0,
            1 => (s + 1.0) / (s + 2.0),
            _ => moments[l - 2] * (s + 2.0 - l as f64) / (s + 1.0 + l as f64),
        });
    }
    moments
}

/// λ_l of max(z, 0): π, 2π/3, π/4, 0, −π/24, 0, π/64, 0. These are the A_l of Ramamoorthi &
/// Hanrahan 2001: they turn radiance into irradiance.
pub fn clamped_cosine(bands: usize) -> Vec<f64> {
    power_lobe(bands, 1.0).iter().map(|l| PI * l).collect()
}

/// λ_l of a disc: 1 within `half_angle_rad` (0 to π) of the axis, 0 beyond. λ_0 is its solid angle.
///
/// ∫_c^1 P_l dz = (1 − c²) P_l'(c) / (l (l+1)), which loses no digits on a small disc, as P_{l−1} −
/// P_{l+1} does.
pub fn cone(bands: usize, half_angle_rad: f64) -> Vec<f64> {
    let (sine, cosine) = half_angle_rad.sin_cos();
    let half_sine = (0.5 * half_angle_rad).sin();
    let factor = |l: usize| match l {
        0 => TAU * 2.0 * half_sine * half_sine,
        _ => TAU * sine * sine * legendre(l, cosine).1 / (l * (l + 1)) as f64,
    };
    (0..bands).map(factor).collect()
}

/// The coefficients λ_l Y_lm(direction) of a lobe about a direction: the addition theorem (Sloan
/// 2008, "Zonal Harmonics"). It has as many bands as the lobe.
pub fn rotate_zonal(lobe: &[f64], direction: DVec3) -> Vec<f64> {
    let mut coefficients = vec![0.0; lobe.len() * lobe.len()];
    super::evaluate(lobe.len(), direction, &mut coefficients);
    super::scale_bands(lobe, &mut coefficients);
    coefficients
}

/// What a surface gets of radiance with these coefficients, four functions at once, not clamped:
/// Σ A_l c Y(normal) (Ramamoorthi & Hanrahan 2001, equation 13).
pub fn irradiance(radiance: &[DVec4], normal: DVec3) -> DVec4 {
    let lobe = rotate_zonal(&clamped_cosine(radiance.len().isqrt()), normal);
    radiance.iter().zip(lobe).map(|(c, lobe)| lobe * *c).sum()
}
