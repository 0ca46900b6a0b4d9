//! Functions to coefficients.

use std::f64::consts::TAU;

use glam::DVec3;

use super::legendre::gauss_legendre;

/// Directions and their weights, which sum to 4π: Gauss-Legendre in z, equal steps in azimuth.
#[derive(Clone, Debug)]
pub struct Quadrature {
    /// Directions, and the solid angle of each (sr).
    pub nodes: Vec<(DVec3, f64)>,
}

impl Quadrature {
    /// Exact for every polynomial in x, y and z up to `degree`, by (⌊degree/2⌋ + 1) (degree + 1)
    /// nodes.
    pub fn exact_to(degree: usize) -> Quadrature {
        let azimuths = degree + 1;
        let step = TAU / azimuths as f64;
        let mut nodes = Vec::new();
        for (z, weight) in gauss_legendre(degree / 2 + 1) {
            let radius = (1.0 - z * z).sqrt();
            for k in 0..azimuths {
                let (sine, cosine) = (step * k as f64).sin_cos();
                nodes.push((DVec3::new(radius * cosine, radius * sine, z), weight * step));
            }
        }
        Quadrature { nodes }
    }

    /// The same over the half of the sphere with z > 0; exact for polynomials there.
    pub fn half(degree: usize) -> Quadrature {
        let whole = Quadrature::exact_to(degree);
        let raised = whole.nodes.iter().map(|(direction, weight)| {
            let z = 0.5 * (direction.z + 1.0);
            let flat = DVec3::new(direction.x, direction.y, 0.0).normalize_or_zero();
            ((1.0 - z * z).sqrt() * flat + z * DVec3::Z, 0.5 * weight)
        });
        Quadrature {
            nodes: raised.collect(),
        }
    }

    /// ∫ f dω.
    pub fn integrate(&self, f: impl Fn(DVec3) -> f64) -> f64 {
        self.nodes.iter().map(|&(d, weight)| weight * f(d)).sum()
    }
}

/// The coefficients ∫ f Y_lm dω of l < `bands`.
///
/// Exact if f is a polynomial of degree p and the quadrature exact to p + `bands` − 1.
pub fn project(bands: usize, quadrature: &Quadrature, f: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let mut coefficients = vec![0.0; bands * bands];
    let mut values = coefficients.clone();
    for &(direction, weight) in &quadrature.nodes {
        super::evaluate(bands, direction, &mut values);
        let share = weight * f(direction);
        for (coefficient, value) in coefficients.iter_mut().zip(&values) {
            *coefficient += share * value;
        }
    }
    coefficients
}
