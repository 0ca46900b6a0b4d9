//! One grid, from surfaces to the light in all its cells.

use std::sync::Arc;

use glam::UVec3;

use super::bands::Streams;
use super::blockers::{self, Blockers};
use super::cell_settings::{CellSettings, Octree, Ordinates, Source};
use super::faces::{self, BounceTest, Faces};
use super::grid::CellGrid;
use super::inflow::Inflow;
use super::inject::{FLUX_NUMBERS, POWER_NUMBERS, flux_unit, inject};
use super::jacobi::Jacobi;
use super::leaf_sweep::LeafSweep;
use super::levels::Levels;
use super::light::Light;
use super::lobes::{Lobes, Occlusion, Scheme};
use super::peel::Layer;
use super::slices::Slices;
use super::sweep::{Batch, Nesting, Sweep, Watch};
use crate::graph::{Buffer, BufferDesc, BufferUsage, Error, Frame, FrameStats, Gpu, Image, Owner};
use crate::render::{GpuScene, LightMaps};

/// From cells to all others.
pub enum Propagation {
    /// Along discrete directions.
    Sweep(Sweep),
    /// Along discrete directions, in steps of all cells at once.
    Jacobi(Jacobi),
    /// Along discrete directions, slice by slice.
    Slices(Slices),
    /// Along discrete directions, by leaves of an octree.
    Leaves(LeafSweep),
    /// As lobes.
    Lobes(Lobes),
    /// As streams in more bands than lobes have.
    Streams(Streams),
    /// As lobes, in levels of an octree.
    Levels(Levels),
}

/// What grids of one size share.
struct Parts {
    propagation: Arc<Propagation>,
    areas: Option<Arc<Buffer>>,
    light: Arc<Light>,
}

impl Parts {
    fn new(
        gpu: &Gpu,
        size: UVec3,
        grids: u32,
        settings: &CellSettings,
        inflow: Inflow<'_>,
    ) -> Result<Self, Error> {
        let directions = settings.directions;
        let propagation = match (settings.lobes, settings.octree) {
            (Some(lobes), Some(Octree::Levels(transfer))) => {
                let steps = (lobes, settings.occlusion);
                Propagation::Levels(Levels::new(gpu, size, steps, transfer, inflow)?)
            }
            (Some(lobes), _) if lobes.scheme == Scheme::Stream && settings.bands > 2 => {
                let steps = (lobes, settings.bands);
                Propagation::Streams(Streams::new(gpu, size, steps, settings.occlusion, inflow)?)
            }
            (Some(lobes), _) => {
                Propagation::Lobes(Lobes::new(gpu, size, lobes, settings.occlusion, inflow)?)
            }
            (None, Some(Octree::Leaves(leaves))) => {
                Propagation::Leaves(LeafSweep::new(gpu, (directions, leaves), inflow)?)
            }
            (None, _) => match settings.ordinates {
                Ordinates::Sweep => {
                    let keeps = settings.keeps_directions;
                    Propagation::Sweep(Sweep::new(
                        gpu,
                        size,
                        (directions, inflow),
                        grids - 1,
                        keeps,
                    )?)
                }
                Ordinates::Slices => {
                    Propagation::Slices(Slices::new(gpu, size, directions, inflow)?)
                }
                Ordinates::Jacobi(steps) => {
                    Propagation::Jacobi(Jacobi::new(gpu, size, (directions, steps), inflow)?)
                }
            },
        };
        let has_two_bands = matches!(propagation, Propagation::Lobes(_) | Propagation::Levels(_));
        Ok(Parts {
            propagation: Arc::new(propagation),
            light: Arc::new(Light::new(gpu, size, grids, !has_two_bands)?),
            areas: settings
                .is_fuzzy()
                .then(|| blockers::areas(gpu, size))
                .transpose()?,
        })
    }
}

/// The cells of one grid.
pub struct Cells {
    /// Where they are.
    pub grid: CellGrid,
    /// How they are lit.
    pub settings: CellSettings,
    /// Which neighbours cannot see each other.
    pub faces: Faces,
    /// What blocks light, where that is of the surfaces that lights and the camera see.
    pub blockers: Option<Blockers>,
    /// Injected flux, x, y and z of red, of green, of blue, each for all cells, or leaves of an
    /// octree: integers of [`flux_unit`]. For lobes then also the power, red, green, blue.
    pub flux: Arc<Buffer>,
    /// From cells to all others; grids of one size share it.
    pub propagation: Arc<Propagation>,
    /// What all directions bring each cell: coefficients of radiance (W/(m² sr)), in steps of the
    /// scale, in alpha those of an environment of radiance 1. Grids of one size share it.
    pub light: Arc<Light>,
    /// Radiance of a stored 1 (W/(m² sr)), of the last light.
    pub scale: f32,
    bounce_test: Option<BounceTest>,
}

/// Others that read what a sweep keeps of a batch of directions.
type After<'a> = &'a mut dyn FnMut(&mut Frame, &Sweep, Batch);

/// Of what half floats hold, so that the integral of this radiance over all directions fits too.
const MOST_STORED: f32 = 1.5e4;
/// Times the radiance of one bounce or of a lamp that all bounces of a bright room may have.
const MANY_BOUNCES: f32 = 64.0;

/// No direction of propagation has a smaller solid angle (sr).
const LOOK_SR: f64 = 0.01;

/// Radiance of a stored 1 (W/(m² sr)): a power of two, so that twice the light is the same numbers
/// with twice the scale, and such that no cell has more than half floats hold.
pub(super) fn radiance_scale(scene: &GpuScene, grid: &CellGrid) -> f32 {
    let face_m2 = grid.cell_size * grid.cell_size;
    let injected = flux_unit(&scene.lights, grid) * (1u32 << 30) as f32;
    let lasting = scene.largest_emission + scene.environment.largest(LOOK_SR);
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
    /// Allocates the cells of one grid.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        grid: CellGrid,
        settings: CellSettings,
    ) -> Result<Self, Error> {
        let inflow = Inflow::new(scene, &grid);
        let parts = Parts::new(gpu, grid.size, 1, &settings, inflow)?;
        Cells::with(gpu, scene, grid, settings, &parts)
    }

    /// Allocates the cells of grids of one size, each inside the next and with cells half as large.
    pub fn nested(
        gpu: &Gpu,
        scene: &GpuScene,
        grids: &[CellGrid],
        settings: CellSettings,
    ) -> Result<Vec<Self>, Error> {
        let size = grids.first().map_or(UVec3::ONE, |grid| grid.size);
        let Some(finest) = grids.last() else {
            return Ok(Vec::new());
        };
        let inflow = Inflow::new(scene, finest);
        let parts = Parts::new(gpu, size, grids.len() as u32, &settings, inflow)?;
        let cells = |grid: &CellGrid| Cells::with(gpu, scene, *grid, settings, &parts);
        grids.iter().map(cells).collect()
    }

    fn with(
        gpu: &Gpu,
        scene: &GpuScene,
        grid: CellGrid,
        settings: CellSettings,
        parts: &Parts,
    ) -> Result<Self, Error> {
        let faces_send =
            settings.source == Source::Faces || settings.bounces > 1 || scene.is_emissive;
        let power_numbers = settings.lobes.map_or(0, |_| POWER_NUMBERS);
        // Of leaves there is the number once they are found.
        let receivers = match parts.propagation.as_ref() {
            Propagation::Leaves(_) => 0,
            _ => grid.count(),
        };
        Ok(Cells {
            grid,
            settings,
            faces: Faces::new(gpu, grid, faces_send)?,
            blockers: parts
                .areas
                .as_ref()
                .map(|areas| Blockers::new(gpu, grid.size, areas, settings.blocker_layers > 0))
                .transpose()?,
            flux: flux(gpu, (FLUX_NUMBERS + power_numbers) * receivers)?,
            propagation: Arc::clone(&parts.propagation),
            light: Arc::clone(&parts.light),
            scale: 1.0,
            bounce_test: Self::bounce_test(gpu, &settings)?,
        })
    }

    fn bounce_test(gpu: &Gpu, settings: &CellSettings) -> Result<Option<BounceTest>, Error> {
        let is_asked = settings.bounces > 1 && settings.least_change > 0.0;
        if is_asked && !gpu.features().conditional_rendering {
            log::warn!(
                "bounce_change: the device has no VK_EXT_conditional_rendering; all bounces are \
                 swept"
            );
            return Ok(None);
        }
        is_asked
            .then(|| BounceTest::new(gpu, settings.least_change))
            .transpose()
    }

    /// Finds the opaque faces.
    pub fn find_faces(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<FrameStats, Error> {
        Self::find_all_faces(gpu, scene, std::slice::from_mut(self))
    }

    /// Finds the opaque faces of several grids at once.
    pub(super) fn find_all_faces(
        gpu: &Gpu,
        scene: &GpuScene,
        grids: &mut [Cells],
    ) -> Result<FrameStats, Error> {
        let (mut frame, mut searches) = (Frame::new(), Vec::new());
        for cells in &mut *grids {
            cells.forget_blockers();
            if cells.has_faces() {
                let search = cells.faces.search(&mut frame, scene);
                searches.push((&mut cells.faces, search));
            } else {
                frame.fill("lpv.clear_faces", &cells.faces.words, 0);
            }
        }
        let stats = faces::finish(gpu, scene, frame, searches)?;
        for cells in grids {
            cells.divide(gpu)?;
        }
        Ok(stats)
    }

    /// What some ways of propagation need to know of the faces.
    fn divide(&mut self, gpu: &Gpu) -> Result<(), Error> {
        if let Propagation::Levels(levels) = &*self.propagation {
            let mut frame = Frame::new();
            levels.find_faces(&mut frame, &self.faces);
            gpu.enqueue(frame);
        }
        // Leaves are those of one grid: it shares them with none.
        if let Some(Propagation::Leaves(sweep)) = Arc::get_mut(&mut self.propagation) {
            sweep.divide(gpu, &self.faces)?;
            let numbers = FLUX_NUMBERS * sweep.leaves.all.len() as u32;
            if self.flux.size_bytes() < 4 * u64::from(numbers) {
                self.flux = flux(gpu, numbers)?;
            }
        }
        Ok(())
    }

    /// How many cells, or leaves, have flux.
    pub(super) fn receivers(&self) -> u32 {
        match &*self.propagation {
            Propagation::Leaves(sweep) => sweep.leaves.all.len() as u32,
            _ => self.grid.count(),
        }
    }

    /// Moves grids through their lattices, all at once, and finds the faces of the cells that come
    /// into them.
    pub(super) fn follow(
        gpu: &Gpu,
        scene: &GpuScene,
        all: &mut [Cells],
        grids: &[CellGrid],
    ) -> Result<FrameStats, Error> {
        let (mut frame, mut searches) = (Frame::new(), Vec::new());
        for (cells, grid) in all.iter_mut().zip(grids) {
            if cells.grid != *grid {
                cells.forget_blockers();
            }
            cells.grid = *grid;
            if !cells.has_faces() {
                cells.faces.grid = *grid;
            } else if let Some(search) = cells.faces.follow(gpu, &mut frame, scene, *grid)? {
                searches.push((&mut cells.faces, search));
            }
        }
        faces::finish(gpu, scene, frame, searches)
    }

    /// Places the grid elsewhere in its lattice, where its faces are still to be found.
    pub(super) fn place(&mut self, grid: CellGrid) {
        (self.grid, self.faces.grid) = (grid, grid);
    }

    /// Follows lights that have moved and another environment; its scale is that of the finest of
    /// grids that share how they propagate.
    pub(super) fn follow_lights(&mut self, gpu: &Gpu, inflow: Inflow<'_>) -> Result<(), Error> {
        self.forget_blockers();
        match &*self.propagation {
            Propagation::Sweep(sweep) => sweep.set_inflow(gpu, inflow),
            Propagation::Jacobi(jacobi) => jacobi.set_inflow(gpu, inflow),
            Propagation::Slices(slices) => slices.set_inflow(gpu, inflow),
            Propagation::Leaves(leaves) => leaves.set_inflow(gpu, inflow),
            Propagation::Lobes(lobes) => lobes.set_inflow(gpu, inflow),
            Propagation::Streams(streams) => streams.set_inflow(gpu, inflow),
            Propagation::Levels(levels) => levels.set_inflow(gpu, inflow),
        }
    }

    /// What lights see is to be found anew: they have moved.
    fn forget_blockers(&mut self) {
        if let Some(blockers) = &mut self.blockers {
            blockers.forget();
        }
    }

    /// What blocks lobes; where nothing reads it, any volume.
    pub(super) fn blocking(&self) -> &Arc<Image> {
        self.blockers
            .as_ref()
            .map_or(&self.light.low, Blockers::volume)
    }

    /// A sweep that is to be stopped by no face has none; lobes leave them out on their way, but
    /// may start there, and the view shows them.
    fn has_faces(&self) -> bool {
        self.settings.occlusion == Occlusion::Faces || self.settings.lobes.is_some()
    }

    /// Adds the passes that light the cells: once by the lights, and again for each further bounce.
    /// `layers` are those of what the camera sees.
    pub fn light(
        &mut self,
        frame: &mut Frame,
        scene: &GpuScene,
        maps: &LightMaps,
        layers: &[Layer],
    ) {
        let scale = radiance_scale(scene, &self.grid);
        self.inject(frame, (scene, maps), layers, scale);
        let later = u32::from(self.settings.keeps_directions);
        for bounce in 0..self.settings.bounces.saturating_sub(later) {
            self.propagate(frame, (scene, maps), bounce, Nesting::default());
        }
    }

    /// Adds the passes that inject what surfaces reflect of the lights, and those that find what
    /// blocks it; `scale` is the radiance of a stored 1 (W/(m² sr)), one for grids that share
    /// light.
    pub(super) fn inject(
        &mut self,
        frame: &mut Frame,
        (scene, maps): (&GpuScene, &LightMaps),
        layers: &[Layer],
        scale: f32,
    ) {
        self.scale = scale;
        if let Some(blockers) = &mut self.blockers {
            let texels = (maps, self.settings.rsm_texels);
            blockers.find(frame, &self.grid, (scene, layers), texels);
        }
        frame.fill("lpv.clear_flux", &self.flux, 0);
        if self.settings.source == Source::Rsm {
            inject(frame, maps, self, flux_unit(&scene.lights, &self.grid));
        }
    }

    /// The same of one bounce.
    pub(super) fn propagate(
        &self,
        frame: &mut Frame,
        given: (&GpuScene, &LightMaps),
        bounce: u32,
        nesting: Nesting,
    ) {
        let test = self.bounce_test.as_ref();
        self.propagate_with(frame, given, (bounce, nesting), (test, &mut |_, _, _| ()));
    }

    /// The same of the last bounce, where [`CellSettings::keeps_directions`]; `after` each batch of
    /// directions others may read what the sweep has kept of it.
    pub(super) fn propagate_last(
        &self,
        frame: &mut Frame,
        given: (&GpuScene, &LightMaps),
        after: After<'_>,
    ) {
        let last = self.settings.bounces.saturating_sub(1);
        self.propagate_with(frame, given, (last, Nesting::default()), (None, after));
    }

    /// Adds the passes that bring injected light, and that of faces, to all cells. Bounces are
    /// counted from 0; all but the first begin with what the one before has left.
    fn propagate_with(
        &self,
        frame: &mut Frame,
        (scene, maps): (&GpuScene, &LightMaps),
        (bounce, nesting): (u32, Nesting),
        (test, after): (Option<&BounceTest>, After<'_>),
    ) {
        let with_direct = self.settings.source == Source::Faces;
        let before = (&*self.light, bounce > 0);
        let scale = (with_direct, self.scale);
        self.faces.light(frame, maps, scale, before, test);
        let flux_unit = flux_unit(&scene.lights, &self.grid) / self.scale;
        let mut hand_on = |frame: &mut Frame| {
            let flux = (&self.flux, flux_unit);
            match &*self.propagation {
                Propagation::Sweep(sweep) => {
                    let light = (&*self.light, nesting);
                    let mut after = |frame: &mut Frame, batch| after(frame, sweep, batch);
                    let mut watch = Watch::Batches(&mut after);
                    sweep.run(frame, &self.faces, flux, light, &mut watch);
                }
                Propagation::Jacobi(jacobi) => jacobi.run(frame, &self.faces, flux, &self.light),
                Propagation::Slices(slices) => slices.run(frame, &self.faces, flux, &self.light),
                Propagation::Leaves(sweep) => sweep.run(frame, &self.faces, flux, &self.light),
                Propagation::Lobes(lobes) => {
                    let light = (&*self.light, self.blocking());
                    lobes.run(frame, &self.faces, flux, light);
                }
                Propagation::Streams(streams) => {
                    let light = (&*self.light, self.blocking());
                    streams.run(frame, &self.faces, flux, light);
                }
                Propagation::Levels(levels) => levels.run(frame, &self.faces, flux, &self.light),
            }
        };
        match test.filter(|_| bounce > 0) {
            Some(test) => frame.only_if(&test.goes_on, hand_on),
            None => hand_on(frame),
        }
    }
}
