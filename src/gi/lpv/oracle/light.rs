//! Twin of `lpv.inject`.

use glam::DVec3;

use crate::gi::lpv::CellGrid;

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
