//! What light each point gets: the transfer of Sloan, Kautz & Snyder (2002), worked out on the
//! host.
//!
//! A point's row has for each function of the light what irradiance a unit of it brings: spherical
//! harmonics of the environment, then columns of emission and of each analytic light. No albedo of
//! the receiver is in it.

use std::f32::consts::PI;
use std::path::Path;

use glam::Vec3;
use rayon::prelude::*;

use super::build::Builder;
use super::cache;
use super::compress::CompressSettings;
use super::lattice::{self, Lattice, LatticeSettings};
use super::lobes::LobeSettings;
pub use super::rays::Sampling;
use super::rows::Rows;
use crate::gi::shared::sh;
use crate::scene::{Light, Scene};

/// What is being done, and its progress of 0 to 1, told from any thread.
pub type Progress<'p> = &'p (dyn Fn(&'static str, f32) + Sync);

/// How transfer is worked out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransferSettings {
    /// Where the points are.
    pub lattice: LatticeSettings,
    /// Bands of spherical harmonics.
    pub order: u32,
    /// Rays of a point.
    pub rays: u32,
    /// Where they go.
    pub sampling: Sampling,
    /// Times that light goes on from one surface to the next, the last one to the camera.
    pub bounces: u32,
    /// Backs of triangles have points too, where something is seen from there.
    pub has_backs: bool,
    /// A point of whose rays a larger share ends on back faces, and that sees neither the sky nor
    /// open places, takes what its neighbours have.
    pub invalid_share: f32,
    /// Emission and analytic lights have columns.
    pub has_lights: bool,
    /// How the columns of harmonics are compressed.
    pub compress: Option<CompressSettings>,
    /// How it is kept which light comes from where, if it is.
    pub lobes: Option<LobeSettings>,
}

/// The transfer of all points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transfer {
    /// Where it is kept.
    pub lattice: Lattice,
    /// Bands of spherical harmonics.
    pub order: u32,
    /// What irradiance each function brings (W/m²).
    pub irradiance: Rows,
    /// What radiance each brings, as harmonics of where it comes from (W/m²/sr).
    pub lobes: Option<Rows>,
    /// Of each point: the share of the hemisphere that is open, by cosine.
    pub visibility: Vec<f32>,
    /// What the bands of a sky above those that are kept bring these, as points see them: a row for
    /// each kept harmonic.
    pub folded: Vec<f32>,
    /// Points that took what their neighbours have.
    pub filled: u32,
}

impl Transfer {
    /// Works out the transfer of a scene.
    pub fn new(scene: &Scene, settings: TransferSettings, progress: Progress<'_>) -> Self {
        let cells = refined_cells(scene, settings, progress);
        Builder::new(scene, settings, &cells).build(progress)
    }

    /// That of a file in a folder or, where there is none, worked out and kept there.
    pub fn kept(
        scene: &Scene,
        settings: TransferSettings,
        folder: &Path,
        progress: Progress<'_>,
    ) -> Self {
        let path = cache::path_in(folder, scene, &settings);
        if path.exists() {
            match cache::read(&path) {
                Some(transfer) => return transfer,
                None => log::warn!(
                    "{} is damaged: the transfer is worked out again",
                    path.display()
                ),
            }
        }
        let transfer = Transfer::new(scene, settings, progress);
        if let Err(problem) = cache::write(&path, &transfer) {
            log::warn!(
                "the transfer cannot be kept in {}: {problem}; it will be worked out again",
                folder.display()
            );
        }
        transfer
    }

    /// Whether transfer differs so much within the cells of a triangle: the length of what differs,
    /// of all harmonics, as part of that of a surface in the open; root mean square over the cells,
    /// each with its worst edge.
    fn differs(&self, triangle: usize, most: f32) -> bool {
        let row = &self.lattice.triangles[triangle];
        let own = 3 * (self.order * self.order) as usize;
        let open: f32 = sh::clamped_cosine(self.order as usize)
            .iter()
            .zip(0u32..)
            .map(|(factor, l)| (*factor as f32).powi(2) * (2 * l + 1) as f32 / (4.0 * PI))
            .sum();
        let distance = |a: u32, b: u32| {
            let [a, b] = [a, b].map(|point| &self.irradiance.plain[point as usize * own..][..own]);
            let pairs = a.iter().zip(b).step_by(3);
            pairs.map(|(a, b)| (a - b).powi(2)).sum::<f32>()
        };
        let sides = row
            .first
            .into_iter()
            .filter(|first| *first != lattice::NONE);
        sides.into_iter().any(|first| {
            let at = |i, j| self.lattice.nodes[(first + lattice::node(row.cells, i, j)) as usize];
            let cells = (0..row.cells).flat_map(|j| (0..row.cells - j).map(move |i| (i, j)));
            let (mut sum, mut count) = (0.0, 0.0);
            for (i, j) in cells {
                let [a, b, c] = [at(i, j), at(i + 1, j), at(i, j + 1)];
                sum += distance(a, b).max(distance(b, c)).max(distance(c, a));
                count += 1.0;
            }
            sum > count * most * most * open
        })
    }

    /// Works out the columns of some lights anew, by their places among the scene's lights.
    pub fn move_lights(
        &mut self,
        scene: &Scene,
        settings: TransferSettings,
        moved: &[usize],
        progress: Progress<'_>,
    ) {
        let mut alone = scene.clone();
        alone.lights = moved.iter().map(|at| scene.lights[*at]).collect();
        let cells: Vec<u32> = self.lattice.triangles.iter().map(|row| row.cells).collect();
        let fresh = Builder::of_lights(&alone, settings, &cells).build(progress);
        let first = self.irradiance.functions as usize - scene.lights.len();
        let moved: Vec<usize> = moved.iter().map(|at| first + at).collect();
        self.irradiance.set_columns(&moved, &fresh.irradiance);
        if let (Some(own), Some(fresh)) = (&mut self.lobes, &fresh.lobes) {
            own.set_columns(&moved, fresh);
        }
    }
}

/// Points of the lattice of a scene, before cells are halved.
pub(super) fn count_points(scene: &Scene, settings: TransferSettings) -> u64 {
    let cells: Vec<u32> = lattice::cells_of(scene, settings.lattice.cell_m).collect();
    let builder = Builder::new(scene, settings, &cells);
    builder.lattice.points.len() as u64
}

/// Cells along an edge of each triangle: halved again and again where the light of the sky itself
/// differs within a cell. The points of each step are those of the step before, and more.
fn refined_cells(scene: &Scene, settings: TransferSettings, progress: Progress<'_>) -> Vec<u32> {
    let LatticeSettings { cell_m, refine, .. } = settings.lattice;
    let mut cells: Vec<u32> = lattice::cells_of(scene, cell_m).collect();
    let sky_alone = TransferSettings {
        bounces: 1,
        has_lights: false,
        compress: None,
        lobes: None,
        ..settings
    };
    for _ in 0..refine.levels {
        let found = Builder::new(scene, sky_alone, &cells).build(progress);
        let is_coarse = |triangle: &usize| found.differs(*triangle, refine.difference);
        let coarse: Vec<usize> = (0..cells.len()).into_par_iter().filter(is_coarse).collect();
        let mut finer = cells.clone();
        coarse.iter().for_each(|triangle| finer[*triangle] *= 2);
        let nodes = lattice::nodes_of(&finer);
        if nodes > refine.most_nodes {
            log::warn!(
                "prt: cells are not halved once more: there would be {nodes} nodes, more than \
                 points_max={}",
                refine.most_nodes
            );
            break;
        }
        if coarse.is_empty() {
            break;
        }
        cells = finer;
    }
    cells
}

/// A light of intensity, or irradiance, 1.
pub(super) fn unit_light(light: &Light) -> Light {
    let mut unit = *light;
    match &mut unit {
        Light::Directional { irradiance, .. } => *irradiance = Vec3::ONE,
        Light::Point { intensity, .. } | Light::Spot { intensity, .. } => *intensity = Vec3::ONE,
    }
    unit
}
