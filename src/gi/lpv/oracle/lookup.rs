//! Twins of `lpv.gather` and `lpv.specular`, and of both direction by direction.

use glam::{DVec3, DVec4, UVec3};

use super::light::shifted;
use crate::gi::lpv::{CellGrid, Directions};
use crate::gi::shared::sh;

/// How far a cell's centre must be in front of a surface (cells; `gi/lpv/corners.glsl`).
const IN_FRONT: f64 = 0.02;

/// A place that looks up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// m.
    pub position: DVec3,
    /// Of the surface, of unit length.
    pub normal: DVec3,
    /// How far off it, times |n|₁ (cells).
    pub shift: f64,
    /// Whether cells behind the surface are left out.
    pub masked: bool,
    /// Whether harmonics are damped where they fall off from the surface.
    pub damping: bool,
}

impl Place {
    /// The same, further off the surface (cells).
    fn further(&self, cells: f64) -> Place {
        Place {
            shift: self.shift + cells,
            ..*self
        }
    }
}

/// The eight cells around a place off a surface, with weights whose sum is 1.
fn corners(grid: &CellGrid, place: &Place) -> [(UVec3, f64); 8] {
    let surface = shifted(grid, place.position, place.normal, 0.0);
    let low = shifted(grid, place.position, place.normal, place.shift) - 0.5;
    let last = (grid.size - 1).as_dvec3();
    let part = low - low.floor();
    let plain: [(DVec3, f64); 8] = std::array::from_fn(|corner| {
        let corner = corner as u32;
        let side = UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
        let share = DVec3::select(side.cmpeq(UVec3::ONE), part, 1.0 - part);
        (low.floor() + side.as_dvec3(), share.element_product())
    });
    let is_left_out =
        |cell: DVec3| place.masked && (cell + 0.5 - surface).dot(place.normal) < IN_FRONT;
    let kept = plain.iter().filter(|(cell, _)| !is_left_out(*cell));
    let all: f64 = kept.map(|(_, share)| share).sum();
    plain.map(|(cell, share)| {
        let weight = match all > 0.0 {
            true if is_left_out(cell) => 0.0,
            true => share / all,
            false => share,
        };
        (cell.clamp(DVec3::ZERO, last).as_uvec3(), weight)
    })
}

fn mean<const N: usize>(
    grid: &CellGrid,
    place: &Place,
    of_cell: impl Fn(usize) -> [DVec4; N],
) -> [DVec4; N] {
    let mut sum = [DVec4::ZERO; N];
    for (cell, weight) in corners(grid, place) {
        for (sum, found) in sum.iter_mut().zip(of_cell(grid.index(cell))) {
            *sum += weight * found;
        }
    }
    sum
}

/// Times 1 + ⟨c, ∂c/∂n⟩/⟨c, c⟩, between 0 and 1; the derivative is a difference over one cell.
fn damp(own: &mut [DVec4; 9], front: &[DVec4; 9], behind: &[DVec4; 9]) {
    let (mut along, mut square) = (DVec4::ZERO, DVec4::ZERO);
    for (own, (front, behind)) in own.iter().zip(front.iter().zip(behind)) {
        along += *own * (*front - *behind);
        square += *own * *own;
    }
    // Where there is no light, any factor will do.
    let square = DVec4::select(square.cmpgt(DVec4::ZERO), square, DVec4::ONE);
    let factor = (1.0 + along / square).clamp(DVec4::ZERO, DVec4::ONE);
    for coefficient in own {
        *coefficient *= factor;
    }
}

/// Σ f_l c_lm Y_lm(direction) of nine coefficients off a surface, at least 0: radiance or
/// irradiance (rgb), and that of an environment of radiance 1 (alpha).
fn of_harmonics(
    light: &[[DVec4; 9]],
    grid: &CellGrid,
    place: &Place,
    direction: DVec3,
    factors: [f64; 3],
) -> DVec4 {
    let mut basis = [0.0; 9];
    sh::evaluate(3, direction, &mut basis);
    let coefficients_at = |place: &Place| mean(grid, place, |cell| light[cell]);
    let mut found = coefficients_at(place);
    if place.damping {
        let [front, behind] = [0.5, -0.5].map(|cells| coefficients_at(&place.further(cells)));
        damp(&mut found, &front, &behind);
    }
    let terms = found.iter().zip(basis).enumerate();
    let sum: DVec4 = terms
        .map(|(at, (coefficient, basis))| factors[at.isqrt()] * basis * *coefficient)
        .sum();
    sum.max(DVec4::ZERO)
}

/// Irradiance (rgb, W/m²) and that of an environment of radiance 1 (alpha) on a surface.
pub fn irradiance(
    light: &[[DVec4; 9]],
    grid: &CellGrid,
    place: &Place,
    shading_normal: DVec3,
) -> DVec4 {
    let factors = sh::clamped_cosine(3);
    let factors = [factors[0], factors[1], factors[2]];
    of_harmonics(light, grid, place, shading_normal, factors)
}

/// Radiance (W/(m² sr)) around a direction, over a Gaussian lobe of width α (rad).
pub fn specular(
    light: &[[DVec4; 9]],
    grid: &CellGrid,
    place: &Place,
    mirror: DVec3,
    alpha: f64,
) -> DVec4 {
    let factors =
        [0.0, 1.0, 2.0].map(|band: f64| (-0.5 * band * (band + 1.0) * alpha * alpha).exp());
    of_harmonics(light, grid, place, mirror, factors)
}

/// Irradiance (W/m²) and radiance around the mirror direction (W/(m² sr)), of the radiance of all
/// cells along all directions (W/(m² sr)), a field for each.
pub fn by_direction(
    fields: &[Vec<DVec4>],
    directions: &Directions,
    grid: &CellGrid,
    place: &Place,
    (shading_normal, mirror, alpha): (DVec3, DVec3, f64),
) -> [DVec4; 2] {
    let width = (alpha * alpha).max(4.0 / directions.all.len() as f64);
    let (mut diffuse, mut lobe, mut lobe_weight) = (DVec4::ZERO, DVec4::ZERO, 0.0);
    for (field, (direction, weight)) in fields.iter().zip(&directions.all) {
        let [found] = mean(grid, place, |cell| [field[cell]]);
        diffuse += weight * (-direction.dot(shading_normal)).max(0.0) * found;
        let share = weight * (-(1.0 + direction.dot(mirror)) / width).exp();
        lobe += share * found;
        lobe_weight += share;
    }
    [diffuse, lobe / lobe_weight]
}
