//! The one comparator: largest values and differences in which a NaN anywhere is seen.
//!
//! `f64::max` takes the other number where one is NaN, and glam's `max_element` does so for some of
//! its components; with both, a picture of NaN has no error.

use glam::{DVec2, DVec3, DVec4, Vec3};

/// The largest component; NaN where any component is.
pub trait Largest {
    fn largest(self) -> f64;
}

/// The largest number, at least 0; NaN where any is, 0 of none.
pub trait Worst: Iterator {
    fn worst(self) -> f64;
}

impl<I: Iterator<Item: Into<f64>>> Worst for I {
    fn worst(self) -> f64 {
        self.map(Into::into).fold(0.0, larger)
    }
}

impl Largest for Vec3 {
    fn largest(self) -> f64 {
        self.as_dvec3().largest()
    }
}

impl Largest for DVec2 {
    fn largest(self) -> f64 {
        larger(self.x, self.y)
    }
}

impl Largest for DVec3 {
    fn largest(self) -> f64 {
        larger(larger(self.x, self.y), self.z)
    }
}

impl Largest for DVec4 {
    fn largest(self) -> f64 {
        larger(self.truncate().largest(), self.w)
    }
}

/// Whether a value is above a limit, or NaN.
pub fn exceeds(value: f64, limit: f64) -> bool {
    value.is_nan() || value > limit
}

/// The larger of two; NaN where one is.
pub fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        f64::NAN
    } else {
        a.max(b)
    }
}
