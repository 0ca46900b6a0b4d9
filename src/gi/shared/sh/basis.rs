//! The basis itself.

use std::f64::consts::{PI, SQRT_2};

use glam::DVec3;

/// Writes Y_lm(direction) of l < `bands` to the first `bands`² values.
///
/// Y_l,±m = √2 K_lm P_lm(z) / sin^m θ · (Re, Im) (x + iy)^m. The first factor is a polynomial in z
/// and comes from its recurrence in l. So nothing is divided by sin θ, and poles are directions as
/// any other (the form of Sloan 2013, "Efficient Spherical Harmonic Evaluation").
pub fn evaluate(bands: usize, direction: DVec3, values: &mut [f64]) {
    let DVec3 { x, y, z } = direction;
    // Of the three-term recurrence of normalised P_lm.
    let ratio = |l: usize, m: usize| {
        let (l2, m2) = ((l * l) as f64, (m * m) as f64);
        ((l2 - m2) / (4.0 * l2 - 1.0)).sqrt()
    };
    // sin^m θ times cos mφ and sin mφ.
    let (mut cosine, mut sine) = (1.0, 0.0);
    // Of l = m.
    let mut first = (0.25 / PI).sqrt();
    for m in 0..bands {
        let (mut before, mut polynomial) = (0.0, first);
        for l in m..bands {
            let middle = l * l + l;
            if m > 0 {
                values[middle - m] = polynomial * sine;
            }
            values[middle + m] = polynomial * cosine;
            let next = (z * polynomial - ratio(l, m) * before) / ratio(l + 1, m);
            (before, polynomial) = (polynomial, next);
        }
        (cosine, sine) = (x * cosine - y * sine, x * sine + y * cosine);
        let odd = (2 * m + 1) as f64;
        first *= ((odd + 2.0) / (odd + 1.0)).sqrt() * if m == 0 { SQRT_2 } else { 1.0 };
    }
}

/// The function's value in a direction: Σ c_lm Y_lm(direction).
pub fn reconstruct(coefficients: &[f64], direction: DVec3) -> f64 {
    let bands = super::bands_of(coefficients);
    let mut values = vec![0.0; bands * bands];
    evaluate(bands, direction, &mut values);
    super::inner_product(coefficients, &values)
}
