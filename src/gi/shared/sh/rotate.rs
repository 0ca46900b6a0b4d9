//! Rotation of any function.

use glam::DMat3;

/// What a rotation does to the coefficients: a matrix of (2l+1)² for each band.
///
/// By the recurrence over bands of Ivanic & Ruedenberg 1996, "Rotation Matrices for Real Spherical
/// Harmonics", section 3 and table 1, with the corrections of 1998. It has no angles, so none of
/// them is at a lock.
#[derive(Clone, Debug)]
pub struct Rotation {
    bands: Vec<Band>,
}

impl Rotation {
    /// For functions of so many bands. The function turns with `rotation`: f'(R d) = f(d). The
    /// matrix has to be a rotation, as exact as the result is to be.
    pub fn new(bands: usize, rotation: DMat3) -> Rotation {
        // Band 1 is (y, z, x).
        const AXES: [usize; 3] = [1, 2, 0];
        let first = Band::new(1, |m, n| {
            let axis = |m: isize| AXES[(m + 1) as usize];
            rotation.col(axis(n))[axis(m)]
        });
        let mut matrices: Vec<Band> = Vec::with_capacity(bands);
        for l in 0..bands {
            let next = match matrices.last() {
                None => Band::new(0, |_, _| 1.0),
                Some(_) if l == 1 => first.clone(),
                Some(last) => Band::after(&first, last),
            };
            matrices.push(next);
        }
        Rotation { bands: matrices }
    }

    /// The coefficients of the turned function; bands beyond those of this rotation are left out.
    pub fn apply(&self, coefficients: &[f64]) -> Vec<f64> {
        let mut turned = Vec::with_capacity(coefficients.len());
        for band in &self.bands {
            let l = band.l as usize;
            let Some(old) = coefficients.get(l * l..(l + 1) * (l + 1)) else {
                break;
            };
            let rows = band.entries.chunks_exact(2 * l + 1);
            turned.extend(rows.map(|row| super::inner_product(row, old)));
        }
        turned
    }
}

/// The matrix of one band: rows m, columns n, both from −l to l.
#[derive(Clone, Debug)]
struct Band {
    l: isize,
    entries: Vec<f64>,
}

impl Band {
    fn new(l: isize, entry: impl Fn(isize, isize) -> f64) -> Band {
        let rows = (-l..=l).flat_map(|m| (-l..=l).map(move |n| (m, n)));
        let entries = rows.map(|(m, n)| entry(m, n)).collect();
        Band { l, entries }
    }

    fn at(&self, m: isize, n: isize) -> f64 {
        self.entries[((m + self.l) * (2 * self.l + 1) + n + self.l) as usize]
    }

    /// The band after `last`; `first` is band 1. Table 1 has u, v and w, and table 2 has what they
    /// multiply.
    fn after(first: &Band, last: &Band) -> Band {
        let l = last.l + 1;
        Band::new(l, |m, n| {
            let number = |value: isize| value as f64;
            let below = if n.abs() == l {
                number(2 * l * (2 * l - 1))
            } else {
                number((l + n) * (l - n))
            };
            let (size, sign) = (m.abs(), m.signum());
            // P of table 2: the product of band 1 and the last one.
            let p = |i: isize, m: isize| {
                if n == l {
                    first.at(i, 1) * last.at(m, l - 1) - first.at(i, -1) * last.at(m, 1 - l)
                } else if n == -l {
                    first.at(i, 1) * last.at(m, 1 - l) + first.at(i, -1) * last.at(m, l - 1)
                } else {
                    first.at(i, 0) * last.at(m, n)
                }
            };
            let mut entry = 0.0;
            if size < l {
                entry += (number(l * l - m * m) / below).sqrt() * p(0, m);
            }
            let v = 0.5 * (number((l + size - 1) * (l + size)) / below).sqrt();
            if m == 0 {
                entry -= v * std::f64::consts::SQRT_2 * (p(1, 1) + p(-1, -1));
            } else if size == 1 {
                // One term of the two is left: m = 0 of the last band has no partner.
                entry += v * std::f64::consts::SQRT_2 * p(sign, 0);
            } else {
                let (one, other) = (p(1, m - sign), p(-1, sign - m));
                entry += v * (one - number(sign) * other);
            }
            if m != 0 && size < l - 1 {
                let w = 0.5 * (number((l - size - 1) * (l - size)) / below).sqrt();
                let (one, other) = (p(1, m + sign), p(-1, -m - sign));
                entry -= w * (one + number(sign) * other);
            }
            entry
        })
    }
}
