//! One grid, from surfaces to the light in all its cells.

use std::sync::Arc;

use super::faces::Faces;
use super::grid::CellGrid;
use super::inject::{FLUX_NUMBERS, POWER_NUMBERS, flux_unit, inject};
use super::leaf_sweep::LeafSweep;
use super::leaves::LeafSettings;
use super::lobes::{LobeSettings, Lobes, Occlusion};
use super::sweep::Sweep;
use crate::gi::Settings;
use crate::graph::{Buffer, BufferDesc, BufferUsage, Error, Frame, FrameStats, Gpu, Image, Owner};
use crate::render::{GpuScene, LightMaps};

/// Where the light of lights comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Texels of reflective shadow maps, into the cells in front of them.
    Rsm,
    /// Opaque faces, lit at the place where the segment between two cells meets a surface.
    Faces,
}

/// How cells are lit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellSettings {
    /// Where light comes from.
    pub source: Source,
    /// Discrete directions that it goes along.
    pub directions: u32,
    /// Bounces, at least 1: a sweep each.
    pub bounces: u32,
    /// Texels along an edge of each reflective shadow map that inject light.
    pub rsm_texels: u32,
    /// How far off the surface its light is injected (cells).
    pub injection_shift: f32,
    /// What stops light between two cells.
    pub occlusion: Occlusion,
    /// How lobes are handed on, where no directions are swept.
    pub lobes: Option<LobeSettings>,
    /// Where cells are leaves of an octree, those that are swept.
    pub leaves: Option<LeafSettings>,
}

impl CellSettings {
    /// As the technique's settings say.
    pub fn new(settings: &Settings) -> Self {
        CellSettings {
            source: if settings.is("source", "faces") {
                Source::Faces
            } else {
                Source::Rsm
            },
            directions: match settings.count("directions") {
                0 => (3 * settings.count("resolution")).min(1024),
                count => count,
            },
            bounces: settings.count("bounces"),
            rsm_texels: settings.count("rsm_texels"),
            injection_shift: settings.number("injection_shift"),
            occlusion: Occlusion::new(settings),
            lobes: LobeSettings::new(settings),
            leaves: None,
        }
    }
}

/// From cells to all others.
pub enum Propagation {
    /// Along discrete directions.
    Sweep(Sweep),
    /// Along discrete directions, by leaves of an octree.
    Leaves(LeafSweep),
    /// As lobes.
    Lobes(Lobes),
}

/// The cells of one grid.
pub struct Cells {
    /// Where they are.
    pub grid: CellGrid,
    /// How they are lit.
    pub settings: CellSettings,
    /// Which neighbours cannot see each other.
    pub faces: Faces,
    /// Injected flux, x, y and z of red, of green, of blue, each for all cells, or leaves of an
    /// octree: integers of [`flux_unit`]. For lobes then also the power, red, green, blue.
    pub flux: Arc<Buffer>,
    /// From cells to all others.
    pub propagation: Propagation,
    /// Radiance of a stored 1 (W/(m² sr)), of the last light.
    pub scale: f32,
}

/// Of what half floats hold, so that the integral of this radiance over all directions fits too.
const MOST_STORED: f32 = 1.5e4;
/// Times the radiance of one bounce or of a lamp that all bounces of a bright room may have.
const MANY_BOUNCES: f32 = 64.0;

/// Radiance of a stored 1 (W/(m² sr)): a power of two, so that twice the light is the same numbers
/// with twice the scale, and such that no cell has more than half floats hold.
fn radiance_scale(scene: &GpuScene, grid: &CellGrid) -> f32 {
    let face_m2 = grid.cell_size * grid.cell_size;
    let injected = flux_unit(&scene.lights, grid) * (1u32 << 30) as f32;
    let lasting = scene.largest_emission + scene.environment.max_element();
    let most = injected / (std::f32::consts::PI * face_m2) + MANY_BOUNCES * lasting;
    (most / MOST_STORED)
        .max(f32::MIN_POSITIVE)
        .log2()
        .ceil()
        .exp2()
}

fn flux(gpu: &Gpu, numbers: u32) -> Result<Arc<Buffer>, Error> {
    gpu.create_buffer(&BufferDesc {
        name: "lpv.flux".into(),
        size_bytes: 4 * u64::from(numbers.max(4)),
        usage: BufferUsage::Storage,
        owner: Owner::Store,
    })
}

impl Cells {
    /// Allocates.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        grid: CellGrid,
        settings: CellSettings,
    ) -> Result<Self, Error> {
        let faces_send =
            settings.source == Source::Faces || settings.bounces > 1 || scene.is_emissive;
        let power_numbers = settings.lobes.map_or(0, |_| POWER_NUMBERS);
        // Of leaves there is the number once they are found.
        let receivers = settings.leaves.map_or(grid.count(), |_| 0);
        Ok(Cells {
            grid,
            settings,
            faces: Faces::new(gpu, grid, faces_send)?,
            flux: flux(gpu, (FLUX_NUMBERS + power_numbers) * receivers)?,
            propagation: match (settings.lobes, settings.leaves) {
                (Some(lobes), _) => {
                    Propagation::Lobes(Lobes::new(gpu, grid, lobes, settings.occlusion)?)
                }
                (None, Some(leaves)) => {
                    Propagation::Leaves(LeafSweep::new(gpu, grid, (settings.directions, leaves))?)
                }
                (None, None) => Propagation::Sweep(Sweep::new(gpu, grid, settings.directions)?),
            },
            scale: 1.0,
        })
    }

    /// Finds the opaque faces. A sweep that is to be stopped by none has none; lobes leave them
    /// out on their way, but may start there, and the view shows them.
    pub fn find_faces(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<FrameStats, Error> {
        let has_faces = self.settings.occlusion == Occlusion::Faces;
        let stats = if has_faces || self.settings.lobes.is_some() {
            self.faces.find(gpu, scene)?
        } else {
            let mut frame = Frame::new();
            frame.fill("lpv.clear_faces", &self.faces.words, 0);
            gpu.submit(frame)?
        };
        if let Propagation::Leaves(sweep) = &mut self.propagation {
            sweep.divide(gpu, &self.faces)?;
            let numbers = FLUX_NUMBERS * sweep.leaves.all.len() as u32;
            if self.flux.size_bytes() < 4 * u64::from(numbers) {
                self.flux = flux(gpu, numbers)?;
            }
        }
        Ok(stats)
    }

    /// How many cells, or leaves, have flux.
    pub(super) fn receivers(&self) -> u32 {
        match &self.propagation {
            Propagation::Leaves(sweep) => sweep.leaves.all.len() as u32,
            Propagation::Sweep(_) | Propagation::Lobes(_) => self.grid.count(),
        }
    }

    /// The light of all cells (see [`Sweep::light`]), in steps of [`Cells::scale`].
    pub fn volume(&self) -> &Arc<Image> {
        match &self.propagation {
            Propagation::Sweep(sweep) => &sweep.light,
            Propagation::Leaves(sweep) => &sweep.light,
            Propagation::Lobes(lobes) => &lobes.light,
        }
    }

    /// Adds the passes that light the cells: once by the lights, and again for each further bounce.
    pub fn light(&mut self, frame: &mut Frame, scene: &GpuScene, maps: &LightMaps) {
        let flux_unit = flux_unit(&scene.lights, &self.grid);
        self.scale = radiance_scale(scene, &self.grid);
        frame.fill("lpv.clear_flux", &self.flux, 0);
        if self.settings.source == Source::Rsm {
            inject(frame, maps, self, flux_unit);
        }
        if let Propagation::Lobes(lobes) = &self.propagation {
            lobes.block(frame, scene, maps, self.settings.rsm_texels);
        }
        let with_direct = self.settings.source == Source::Faces;
        for bounce in 0..self.settings.bounces {
            let before = (self.volume(), bounce > 0);
            self.faces
                .light(frame, maps, (with_direct, self.scale), before);
            let flux = (&self.flux, flux_unit / self.scale);
            match &self.propagation {
                Propagation::Sweep(sweep) => sweep.run(frame, &self.faces, flux),
                Propagation::Leaves(sweep) => sweep.run(frame, &self.faces, flux),
                Propagation::Lobes(lobes) => lobes.run(frame, &self.faces, flux),
            }
        }
    }
}
