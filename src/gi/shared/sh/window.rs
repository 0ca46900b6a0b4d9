//! Windows: one factor a band, which damps the ringing of functions that were cut off at a band.
//!
//! They blur as much as they calm (Sloan 2008, "Windowing"). All have the factor 1 in band 0, so
//! the mean stays.

use std::f64::consts::PI;

/// (1 + cos(π l / `width`)) / 2, and 0 from l = `width` on (Hann). At twice the number of bands it
/// is mild.
pub fn hann(bands: usize, width: f64) -> Vec<f64> {
    window(bands, width, |x| 0.5 * (1.0 + x.cos()))
}

/// sin(x)/x with x = π l / `width`, and 0 from l = `width` on (Lanczos).
pub fn lanczos(bands: usize, width: f64) -> Vec<f64> {
    window(bands, width, |x| if x > 0.0 { x.sin() / x } else { 1.0 })
}

/// The factors of a shape over 0..π.
fn window(bands: usize, width: f64, shape: impl Fn(f64) -> f64) -> Vec<f64> {
    let factor = |l: usize| {
        let part = l as f64 / width;
        if part < 1.0 { shape(PI * part) } else { 0.0 }
    };
    (0..bands).map(factor).collect()
}

/// 1 / (1 + λ l² (l+1)²), λ = `strength`: of all functions g the least ∫ (f − g)² + λ (Δg)² dω, Δ
/// the Laplacian on the sphere (Sloan 2008, "Windowing").
pub fn laplacian_window(bands: usize, strength: f64) -> Vec<f64> {
    let factor = |l: usize| 1.0 / (1.0 + strength * squared_eigenvalue(l));
    (0..bands).map(factor).collect()
}

/// The λ with which [`laplacian_window`] leaves `fraction` (above 0, to 1) of ∫ (Δf)² dω; 0 if f is
/// constant.
///
/// Newton's method from λ = 0. What is left is convex and falls with λ, so no step goes too far.
pub fn laplacian_strength(coefficients: &[f64], fraction: f64) -> f64 {
    const STEPS: usize = 100;
    let bands = super::bands_of(coefficients);
    let energy = |l: usize| -> f64 {
        coefficients[l * l..(l + 1) * (l + 1)]
            .iter()
            .map(|c| c * c)
            .sum()
    };
    // Of each band: l² (l+1)², and its part of ∫ (Δf)².
    let parts: Vec<(f64, f64)> = (0..bands)
        .map(|l| (squared_eigenvalue(l), squared_eigenvalue(l) * energy(l)))
        .collect();
    let wanted = fraction * parts.iter().map(|(_, part)| part).sum::<f64>();
    let mut strength = 0.0;
    for _ in 0..STEPS {
        let (mut left, mut slope) = (-wanted, 0.0);
        for &(eigenvalue, part) in &parts {
            let factor = 1.0 / (1.0 + strength * eigenvalue);
            left += part * factor * factor;
            slope += 2.0 * part * eigenvalue * factor.powi(3);
        }
        if left <= 0.0 {
            break;
        }
        strength += left / slope;
    }
    strength
}

/// l² (l+1)²: the Laplacian of Y_lm is −l (l+1) Y_lm.
fn squared_eigenvalue(l: usize) -> f64 {
    ((l * (l + 1)) as f64).powi(2)
}
