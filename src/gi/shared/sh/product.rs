//! Products of functions.

use super::Quadrature;

/// G_ijk = ∫ Y_i Y_j Y_k dω (Gaunt), i ≤ j; places as of [`super::index`].
#[derive(Clone, Copy, Debug)]
struct Triple {
    i: usize,
    j: usize,
    k: usize,
    integral: f64,
}

/// The triples that are not 0, for a number of bands: what products need. With 8 bands these are
/// 6,588 of 133,120.
#[derive(Clone, Debug)]
pub struct Products {
    bands: usize,
    triples: Vec<Triple>,
}

impl Products {
    /// By a quadrature that is exact for three factors of `bands` bands. With 8 bands it takes
    /// about 7 ms, so make it once.
    pub fn new(bands: usize) -> Products {
        // The smallest triple of 8 bands is 0.005.
        const ROUNDING: f64 = 1e-9;
        let count = bands * bands;
        let quadrature = Quadrature::exact_to(3 * bands.saturating_sub(1));
        // Of each Y_i its values at all nodes.
        let mut columns = vec![Vec::with_capacity(quadrature.nodes.len()); count];
        let mut values = vec![0.0; count];
        for &(direction, _) in &quadrature.nodes {
            super::evaluate(bands, direction, &mut values);
            for (column, value) in columns.iter_mut().zip(&values) {
                column.push(*value);
            }
        }
        let mut triples = Vec::new();
        for j in 0..count {
            for i in 0..=j {
                let pair: Vec<f64> = (quadrature.nodes.iter().zip(&columns[i]).zip(&columns[j]))
                    .map(|((&(_, weight), one), other)| weight * one * other)
                    .collect();
                for k in (0..count).filter(|&k| bands_fit(i.isqrt(), j.isqrt(), k.isqrt())) {
                    let integral = super::inner_product(&pair, &columns[k]);
                    if integral.abs() > ROUNDING {
                        triples.push(Triple { i, j, k, integral });
                    }
                }
            }
        }
        Products { bands, triples }
    }

    /// The product of two functions, cut off at the bands of this table: c_k = Σ G_ijk a_i b_j
    /// (Sloan 2008, "Products"). A product of n and m bands has n + m − 1, so take a table of so
    /// many to lose none. Both functions have `bands`² coefficients or fewer.
    pub fn multiply(&self, a: &[f64], b: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; self.bands * self.bands];
        let of = |f: &[f64], place: usize| f.get(place).copied().unwrap_or(0.0);
        for &Triple { i, j, k, integral } in &self.triples {
            let mut pairs = of(a, i) * of(b, j);
            if i != j {
                pairs += of(a, j) * of(b, i);
            }
            product[k] += integral * pairs;
        }
        product
    }
}

/// Whether Y of three bands can have a product whose integral is not 0: each band is at most the
/// sum of the others, and the sum of all is even.
fn bands_fit(a: usize, b: usize, c: usize) -> bool {
    (a + b + c).is_multiple_of(2) && c <= a + b && a <= b + c && b <= a + c
}
