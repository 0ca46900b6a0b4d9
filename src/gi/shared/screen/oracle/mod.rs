//! CPU twins of `screen.upsample`, `screen.relight`, `screen.history`, `screen.blur` and
//! `screen.a_trous`, in f64, pixel by pixel.

mod a_trous;
mod blur;
mod history;
mod relight;
mod upsample;

pub use a_trous::{a_trous, variance};
pub use blur::{adaptive_radius, blur};
pub use history::{KeptPixel, Moved, Terms, history, unchanged, unslid};
pub use relight::relight;
pub use upsample::upsample;

use glam::DVec3;

/// A surface that a pixel sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Where it is (m).
    pub position: DVec3,
    /// Unit vectors on the viewer's side.
    pub geometric_normal: DVec3,
    /// The same, for shading.
    pub shading_normal: DVec3,
    /// Height of a pixel there (m).
    pub footprint: f64,
    /// Number of its material; the same everywhere where nobody asks.
    pub material: u32,
}

/// A picture of what may be there or not, row by row.
pub struct Picture<'p, T> {
    /// Width and height (px).
    pub size: [u32; 2],
    /// The pixels.
    pub pixels: &'p [Option<T>],
}

impl<T> Picture<'_, T> {
    pub(super) fn at(&self, x: i64, y: i64) -> Option<&T> {
        let is_inside = |at: i64, size: u32| (0..i64::from(size)).contains(&at);
        (is_inside(x, self.size[0]) && is_inside(y, self.size[1]))
            .then(|| self.pixels[(y * i64::from(self.size[0]) + x) as usize].as_ref())
            .flatten()
    }
}

/// How near two surfaces have to be to be one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Off the plane (footprints).
    pub plane_tolerance: f64,
    /// Least cosine of two shading normals.
    pub normal_cosine: f64,
}

impl Limits {
    /// How far inside the limits (positive) or outside another surface is: the smaller of
    /// footprints and cosine left. `from_here` leads to it from where `seen` is or was (m).
    pub fn margin(&self, seen: &Seen, from_here: DVec3, other: &Seen) -> f64 {
        let [of_position, of_normal] = self.margins(seen, from_here, other);
        of_position.min(of_normal)
    }

    /// The same, of each limit: footprints left, and cosine left.
    pub fn margins(&self, seen: &Seen, from_here: DVec3, other: &Seen) -> [f64; 2] {
        let off_plane = from_here.dot(seen.geometric_normal).abs() / seen.footprint;
        let cosine = seen.shading_normal.dot(other.shading_normal);
        [
            self.plane_tolerance - off_plane,
            cosine - self.normal_cosine,
        ]
    }
}

/// A result, and how near it came to another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged<T> {
    /// The result.
    pub value: T,
    /// The smallest |margin| of all decisions.
    pub least_margin: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Limits of the tests.
    pub(super) const LIMITS: Limits = Limits {
        plane_tolerance: 1.0,
        normal_cosine: 0.9,
    };

    /// A surface that looks up.
    pub(super) fn seen(height: f64) -> Seen {
        Seen {
            position: DVec3::new(0.0, 0.0, height),
            geometric_normal: DVec3::Z,
            shading_normal: DVec3::Z,
            footprint: 0.1,
            material: 0,
        }
    }
}
