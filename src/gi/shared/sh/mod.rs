//! Real spherical harmonics on the host, in f64; `glsl/gi/shared/sh.glsl` is the twin on the
//! device. The equations are in `docs/gi/spherical_harmonics.md`.
//!
//! # One convention
//!
//! Y_lm is real and orthonormal, ∫ Y_i Y_j dω = δ_ij, and has **no** Condon-Shortley phase (−1)^m.
//! So Y_00 = √(1/4π) and Y_1 = √(3/4π) (y, z, x) for m = −1, 0, 1: all signs are plus. This is the
//! basis of Ramamoorthi & Hanrahan 2001, "An Efficient Representation for Irradiance Environment
//! Maps". That of Sloan 2008, "Stupid Spherical Harmonics (SH) Tricks", appendix A2, differs by the
//! sign of odd m.
//!
//! The trap: texts mix two signs. Some give the basis as −√(3/4π) y and −√(3/4π) x, and then a lobe
//! towards d whose band 1 is +d. Both together mirror light in x and y. Coefficients with the other
//! sign become ours by a factor (−1)^m.
//!
//! # Shapes
//!
//! A function of *n* bands (l < n) is a slice of n² coefficients; Y_lm has the place l² + l + m
//! ([`index`]). A lobe or a window is a slice of n factors, one a band ([`scale_bands`]). Nothing
//! here has a largest n; tests and the twin go to [`TESTED_BANDS`]. Directions have length 1.
//! Coefficients have the unit of the function times √sr.

mod basis;
mod legendre;
mod lobes;
mod product;
mod project;
mod rotate;
mod window;

pub use basis::{evaluate, reconstruct};
pub use lobes::{clamped_cosine, cone, irradiance, power_lobe, rotate_zonal};
pub use product::Products;
pub use project::{Quadrature, project};
pub use rotate::Rotation;
pub use window::{hann, lanczos, laplacian_strength, laplacian_window};

/// How many bands the tests cover, and how many the twin has room for.
pub const TESTED_BANDS: usize = 8;

/// The place of Y_lm in a slice of coefficients; |m| ≤ l.
pub fn index(l: usize, m: isize) -> usize {
    (l * l + l).wrapping_add_signed(m)
}

/// How many bands a slice of coefficients has: the largest n with n² ≤ its length.
pub fn bands_of(coefficients: &[f64]) -> usize {
    coefficients.len().isqrt()
}

/// ∫ f g dω of two functions; bands that one of them lacks are 0.
pub fn inner_product(f: &[f64], g: &[f64]) -> f64 {
    f.iter().zip(g).map(|(f, g)| f * g).sum()
}

/// Multiplies band l by `factors[l]`; bands without a factor become 0.
///
/// With the factors of a lobe this is the convolution with it (Funk-Hecke): radiance becomes
/// irradiance by [`clamped_cosine`]. With those of a window it is the windowing.
pub fn scale_bands(factors: &[f64], coefficients: &mut [f64]) {
    let factor = |place: usize| factors.get(place.isqrt()).copied().unwrap_or(0.0);
    for (place, coefficient) in coefficients.iter_mut().enumerate() {
        *coefficient *= factor(place);
    }
}
