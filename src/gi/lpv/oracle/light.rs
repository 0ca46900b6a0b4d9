//! Twins of `lpv.inject` and `lpv.gather`.

use glam::{DVec3, DVec4, UVec3};

use crate::gi::lpv::CellGrid;
use crate::gi::shared::sh;

/// A texel of a reflective shadow map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texel {
    /// Of the surface (m).
    pub position: DVec3,
    /// On the lit side, of unit length.
    pub normal: DVec3,
    /// Reflected flux of red, green, blue (W).
    pub flux: DVec3,
    /// Of the surface (m²).
    pub area_m2: f64,
}

/// A position (m) in cells, moved off its surface by `shift` |n|₁ n.
pub(super) fn shifted(grid: &CellGrid, position: DVec3, normal: DVec3, shift: f64) -> DVec3 {
    let place = (position - grid.corner().as_dvec3()) / f64::from(grid.cell_size);
    place + shift * normal.abs().element_sum() * normal
}

/// Flux vectors of all cells: Σ Φ n of red, of green, of blue (W).
pub fn inject(
    texels: impl IntoIterator<Item = Texel>,
    grid: &CellGrid,
    shift: f64,
) -> Vec<[DVec3; 3]> {
    let mut flux = vec![[DVec3::ZERO; 3]; grid.count() as usize];
    for texel in texels {
        let place = shifted(grid, texel.position, texel.normal, shift).floor();
        if place.min_element() < 0.0 || place.cmpge(grid.size.as_dvec3()).any() {
            continue;
        }
        let cell = &mut flux[grid.index(place.as_uvec3())];
        for (colour, sum) in cell.iter_mut().enumerate() {
            *sum += texel.flux[colour] * texel.normal;
        }
    }
    flux
}

/// The nine coefficients by a trilinear lookup off the surface.
fn looked_up(
    light: &[[DVec4; 9]],
    grid: &CellGrid,
    (position, normal): (DVec3, DVec3),
    shift: f64,
) -> [DVec4; 9] {
    let place = shifted(grid, position, normal, shift) - 0.5;
    let place = place.clamp(DVec3::ZERO, grid.size.as_dvec3() - 1.0);
    let base = place.floor();
    let share = place - base;
    let mut found = [DVec4::ZERO; 9];
    for corner in 0..8u32 {
        let step = UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
        let cell = (base.as_uvec3() + step).min(grid.size - 1);
        let weight = DVec3::select(
            glam::BVec3::new(step.x == 1, step.y == 1, step.z == 1),
            share,
            1.0 - share,
        );
        for (sum, coefficient) in found.iter_mut().zip(light[grid.index(cell)]) {
            *sum += weight.element_product() * coefficient;
        }
    }
    found
}

fn irradiance_of(coefficients: &[DVec4; 9], normal: DVec3) -> DVec4 {
    let mut basis = [0.0; 9];
    sh::evaluate(3, normal, &mut basis);
    let factors = sh::clamped_cosine(3);
    let terms = coefficients.iter().zip(basis).enumerate();
    let sum: DVec4 = terms
        .map(|(at, (coefficient, basis))| factors[at.isqrt()] * basis * *coefficient)
        .sum();
    sum.max(DVec4::ZERO)
}

/// Irradiance (rgb, W/m²) and that of an environment of radiance 1 (alpha) on a surface, from the
/// nine coefficients of all cells, by a trilinear lookup off the surface.
pub fn irradiance(
    light: &[[DVec4; 9]],
    grid: &CellGrid,
    surface: (DVec3, DVec3),
    shading_normal: DVec3,
    shift: f64,
) -> DVec4 {
    irradiance_of(&looked_up(light, grid, surface, shift), shading_normal)
}

/// The same, damped where light falls off from the surface: times 1 + ⟨c, ∂c/∂n⟩/⟨c, c⟩, between 0
/// and 1.
pub fn damped_irradiance(
    light: &[[DVec4; 9]],
    grid: &CellGrid,
    surface: (DVec3, DVec3),
    shading_normal: DVec3,
    shift: f64,
) -> DVec4 {
    let [own, front, behind] =
        [shift, shift + 0.5, shift - 0.5].map(|shift| looked_up(light, grid, surface, shift));
    let (mut along, mut square) = (DVec4::ZERO, DVec4::ZERO);
    for (own, (front, behind)) in own.iter().zip(front.iter().zip(&behind)) {
        along += *own * (*front - *behind);
        square += *own * *own;
    }
    // Where there is no light, any factor will do.
    let square = DVec4::select(square.cmpgt(DVec4::ZERO), square, DVec4::ONE);
    let factor = (1.0 + along / square).clamp(DVec4::ZERO, DVec4::ONE);
    factor * irradiance_of(&own, shading_normal)
}
