//! What light each point gets: the transfer of Sloan, Kautz & Snyder (2002), worked out on the
//! host.
//!
//! A point's row has for each function of the light what irradiance a unit of it brings: spherical
//! harmonics of the environment, then columns of emission and of each analytic light. No albedo of
//! the receiver is in it.

use std::path::Path;

use glam::Vec3;

use super::build::Builder;
use super::cache;
use super::compress::{CompressSettings, Compressed};
use super::lattice::{Lattice, LatticeSettings};
pub use super::rays::Sampling;
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
    /// A point of whose rays a larger share ends on back faces takes what its neighbours have.
    pub invalid_share: f32,
    /// Emission and analytic lights have columns.
    pub has_lights: bool,
    /// How the columns of harmonics are compressed.
    pub compress: Option<CompressSettings>,
}

/// The transfer of all points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transfer {
    /// Where it is kept.
    pub lattice: Lattice,
    /// Bands of spherical harmonics.
    pub order: u32,
    /// Functions of a row: harmonics, then emission where something emits, then analytic lights.
    pub functions: u32,
    /// Columns of harmonics, where they are compressed.
    pub harmonics: Option<Compressed>,
    /// Of each point, of each other function: red, green and blue (W/m²).
    pub rows: Vec<f32>,
    /// Of each point: the share of the hemisphere that is open, by cosine.
    pub visibility: Vec<f32>,
    /// Points that took what their neighbours have.
    pub filled: u32,
}

impl Transfer {
    /// Works out the transfer of a scene.
    pub fn new(scene: &Scene, settings: TransferSettings, progress: Progress<'_>) -> Self {
        let mut transfer = Builder::new(scene, settings).build(progress);
        if let Some(compress) = settings.compress {
            progress("clusters of transfer", 0.0);
            transfer.compress(compress);
            progress("clusters of transfer", 1.0);
        }
        transfer
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

    /// The first functions, those that are compressed.
    pub fn compressed_functions(&self) -> u32 {
        let harmonics = self.harmonics.as_ref();
        harmonics.map_or(0, |harmonics| harmonics.stride / 3)
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
        let columns = Builder::of_lights(&alone, settings).build(progress);
        let stride = 3 * (self.functions - self.compressed_functions()) as usize;
        let first = stride - 3 * scene.lights.len();
        let rows = self.rows.chunks_exact_mut(stride);
        for (row, fresh) in rows.zip(columns.rows.chunks_exact(3 * moved.len())) {
            for (at, column) in moved.iter().zip(fresh.chunks_exact(3)) {
                row[first + 3 * at..][..3].copy_from_slice(column);
            }
        }
    }

    /// The row of a point.
    pub fn row(&self, point: usize) -> Vec<f32> {
        let harmonics = self.harmonics.as_ref();
        let mut row = harmonics.map_or(Vec::new(), |harmonics| harmonics.row(point));
        row.extend(self.plain_row(point));
        row
    }

    /// The part of a point's row that is not compressed.
    pub fn plain_row(&self, point: usize) -> &[f32] {
        let stride = 3 * (self.functions - self.compressed_functions()) as usize;
        &self.rows[point * stride..][..stride]
    }

    /// Compresses the columns of harmonics.
    fn compress(&mut self, settings: CompressSettings) {
        let stride = 3 * self.functions as usize;
        let harmonics = 3 * (self.order * self.order) as usize;
        let part = |from: usize, to: usize| -> Vec<f32> {
            let rows = self.rows.chunks_exact(stride);
            rows.flat_map(|row| &row[from..to]).copied().collect()
        };
        let (first, rest) = (part(0, harmonics), part(harmonics, stride));
        self.harmonics = Some(Compressed::new(&first, harmonics, settings));
        self.rows = rest;
    }
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
