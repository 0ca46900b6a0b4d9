//! Legendre polynomials, and the quadrature that has them.

use std::f64::consts::PI;

/// P_l(z) and its derivative, by Bonnet's recurrence; |z| ≤ 1, with both ends.
pub(super) fn legendre(l: usize, z: f64) -> (f64, f64) {
    let (mut before, mut value) = (0.0, 1.0);
    let (mut slope_before, mut slope) = (0.0, 0.0);
    for k in 0..l {
        let odd = (2 * k + 1) as f64;
        let next_slope = slope_before + odd * value;
        (slope_before, slope) = (slope, next_slope);
        let next = (odd * z * value - k as f64 * before) / (k + 1) as f64;
        (before, value) = (value, next);
    }
    (value, slope)
}

/// The `count` nodes and weights of Gauss-Legendre quadrature on −1..1; exact for polynomials of
/// degree 2 `count` − 1. The nodes are the zeros of P_count, by Newton's method from Tricomi's
/// guess.
pub(super) fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    // Newton's method doubles the digits, and the guess has two or more.
    const STEPS: usize = 7;
    let node = |i: usize| {
        let mut z = (PI * (i as f64 + 0.75) / (count as f64 + 0.5)).cos();
        for _ in 0..STEPS {
            let (value, slope) = legendre(count, z);
            z -= value / slope;
        }
        let (_, slope) = legendre(count, z);
        (z, 2.0 / ((1.0 - z * z) * slope * slope))
    };
    (0..count).map(node).collect()
}
