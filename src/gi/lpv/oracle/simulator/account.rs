//! Where light is and has gone, and how far one solution is from another.

use glam::DVec3;

use super::light::Light;
use crate::gi::lpv::CellGrid;
use crate::gi::lpv::oracle::lobes::Lobe;
use crate::gi::lpv::oracle::octree::{cell_at, mean_of_children};

/// Flux of a grid (W).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Account {
    /// Injected, averaged from the finer level, or taken over from it.
    pub injected: f64,
    /// Out through the border.
    pub left: f64,
    /// Into opaque faces.
    pub absorbed: f64,
    /// On its way.
    pub on_its_way: f64,
    /// Handed to the next level.
    pub handed_on: f64,
}

impl Account {
    /// What is in no other account (W): what the gain takes, less what clamping makes.
    pub fn lost(&self) -> f64 {
        self.injected - self.left - self.absorbed - self.on_its_way - self.handed_on
    }
}

/// ∫ I dω of all cells (W), and its first moment (W times finest cells).
pub(super) fn flux_and_moment(light: &Light, grid: &CellGrid, level: usize) -> (f64, DVec3) {
    let (mut flux, mut moment) = (0.0, DVec3::ZERO);
    for at in 0..grid.count() as usize {
        let own = light.flux_of(grid, at);
        flux += own;
        moment += own * (cell_at(grid, at).as_dvec3() + 0.5) * f64::from(1u32 << level);
    }
    (flux, moment)
}

/// Differences of all cells of the levels 1 and up (W/(m² sr); relative ones 1).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// e_abs: mean of ‖O − Ô‖∞.
    pub absolute: f64,
    /// e_rel: mean of ‖O − Ô‖∞/‖O‖∞.
    pub relative: f64,
    /// The largest ‖O − Ô‖∞.
    pub worst: f64,
}

/// The largest magnitude of the coefficients.
fn norm(lobe: &Lobe) -> f64 {
    lobe.iter().fold(0.0, |largest, c| c.x.abs().max(largest))
}

fn errors<'l>(pairs: impl Iterator<Item = (&'l Lobe, Lobe)>) -> Errors {
    let (mut errors, mut cells) = (Errors::default(), 0u32);
    for (own, expected) in pairs {
        let mut difference = *own;
        difference
            .iter_mut()
            .zip(expected)
            .for_each(|(c, expected)| *c -= expected);
        let error = norm(&difference);
        errors.absolute += error;
        if error > 0.0 {
            errors.relative += error / norm(own).max(f64::MIN_POSITIVE);
        }
        errors.worst = errors.worst.max(error);
        cells += 1;
    }
    let count = f64::from(cells.max(1));
    Errors {
        absolute: errors.absolute / count,
        relative: errors.relative / count,
        worst: errors.worst,
    }
}

/// Each level against the mean of the finer one (Olovsson 2012, §6.2; over as many cells as there
/// are, where it has eight times as many).
pub fn errors_within(grids: &[CellGrid], fields: &[&[Lobe]]) -> Errors {
    let means: Vec<Vec<Lobe>> = (1..grids.len())
        .map(|level| mean_of_children(&grids[level - 1], &grids[level], fields[level - 1]))
        .collect();
    errors(
        fields[1..]
            .iter()
            .flat_map(|field| field.iter())
            .zip(means.into_iter().flatten()),
    )
}

/// Each level against the mean of a uniform grid (§7).
pub fn errors_to(grids: &[CellGrid], fields: &[&[Lobe]], uniform: &[Lobe]) -> Errors {
    let mut means = vec![uniform.to_vec()];
    for level in 1..grids.len() {
        let mean = mean_of_children(&grids[level - 1], &grids[level], &means[level - 1]);
        means.push(mean);
    }
    let means = means.into_iter().skip(1).flatten();
    errors(fields[1..].iter().flat_map(|field| field.iter()).zip(means))
}

/// Root of the mean square of the difference of all coefficients, over that of the second.
pub fn difference(own: &[Lobe], other: &[Lobe]) -> f64 {
    let (mut square, mut all) = (0.0, 0.0);
    for (own, other) in own.iter().flatten().zip(other.iter().flatten()) {
        square += (own.x - other.x).powi(2);
        all += other.x.powi(2);
    }
    (square / all).sqrt()
}
