//! A scene as the bench starts from it: what its lights make of its surfaces, and its opaque faces.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::{Emission, Injected, Setup};
use crate::gi::lpv::CellGrid;
use crate::gi::lpv::oracle::crossings;
use crate::gi::simulator::LitScene;
use crate::image::luminance;

/// Squares of a surface along the edge of a cell.
const SQUARES_PER_CELL: f32 = 4.0;
/// How far off its surface light is injected (cells along n, times |n|₁).
const SHIFT: f64 = 0.5;

/// A scene that the bench cannot start from.
#[derive(Debug, thiserror::Error)]
pub enum SceneSetupError {
    /// It has no surfaces.
    #[error("{0} has no triangles, so that there is nothing to light")]
    Empty(String),
    /// Nothing lights its surfaces.
    #[error(
        "no light of {0} reaches a surface; the bench injects the diffuse reflection of \
         directional, spot and point lights"
    )]
    Dark(String),
    /// Its surfaces cannot be lit, in words.
    #[error("{0}")]
    Unlit(String),
}

/// A grid around the scene's box, `cells` along its longest side. Light is the luminance of what
/// surfaces reflect of lights.
pub fn scene_setup(
    LitScene { scene, light }: &LitScene<'_>,
    cells: u32,
    multiplier: f64,
) -> Result<Setup, SceneSetupError> {
    let empty = || SceneSetupError::Empty(scene.name.clone());
    let grid = CellGrid::around(scene.bounds().ok_or_else(empty)?, cells, 1);
    let found = crossings(scene, &grid);
    // A wall through the centres of cells is one of them.
    let faces = found.opaque.iter().zip(&found.unsure).map(|(a, b)| a | b);
    let spacing_m = grid.cell_size / SQUARES_PER_CELL;
    let square_m2 = f64::from(spacing_m).powi(2);
    let mut injected = Vec::new();
    for point in light(scene, spacing_m).map_err(SceneSetupError::Unlit)? {
        for (radiance, side) in point.radiance.into_iter().zip([1.0, -1.0]) {
            let normal = side * point.surface.normal.as_dvec3();
            let place = place(&grid, point.surface.position, normal);
            let power = multiplier * PI * square_m2 * f64::from(luminance(radiance));
            if power == 0.0 || place.cmplt(DVec3::ZERO).any() {
                continue;
            }
            let cell = place.as_uvec3();
            if cell.cmplt(grid.size).all() {
                injected.push(Injected {
                    cell,
                    emission: Emission::Cosine(power * normal),
                });
            }
        }
    }
    if injected.is_empty() {
        return Err(SceneSetupError::Dark(scene.name.clone()));
    }
    Ok(Setup {
        faces: faces.collect(),
        injected,
        grid,
        gain: 1.0,
        clamp_negative: false,
    })
}

/// In cells, off the surface.
fn place(grid: &CellGrid, position: Vec3, normal: DVec3) -> DVec3 {
    let place = (position - grid.corner()).as_dvec3() / f64::from(grid.cell_size);
    place + SHIFT * normal.abs().element_sum() * normal
}
