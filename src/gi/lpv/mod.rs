//! Light propagation volumes (Kaplanyan & Dachsbacher 2010): light goes from cell to cell of a grid,
//! and surfaces look it up.
//!
//! - [`faces`]: which neighbours cannot see each other.
//! - [`inject`]: what surfaces reflect, into cells.
//! - [`sweep`]: from cells to all others.
//! - [`gather`]: from cells to pixels.

mod directions;
mod entry;
pub mod faces;
pub mod gather;
mod grid;
pub mod inject;
pub mod oracle;
pub mod sweep;

pub use directions::Directions;
pub use entry::ENTRY;
pub use grid::{CellGrid, GridRow};

use std::sync::Arc;

use self::sweep::Sweep;
use super::{
    Answer, Change, Context, IndirectLight, Inputs, Inspect, MapNeeds, Needs, Settings, Technique,
};
use crate::graph::{Buffer, BufferDesc, BufferUsage, Error, Frame, FrameStats, Owner};
use crate::render::screen_image;

/// Empty cells around the scene.
const MARGIN: u32 = 1;

/// The technique, of one scene.
struct Lpv {
    grid: CellGrid,
    /// Opaque faces: a word a cell.
    faces: Arc<Buffer>,
    /// Injected flux: nine integers a cell.
    flux: Arc<Buffer>,
    sweep: Sweep,
    injection_shift: f32,
    gather_shift: f32,
    rsm_texels: u32,
    light: IndirectLight,
}

impl Lpv {
    fn new(context: &Context<'_>, settings: &Settings) -> Result<Self, Error> {
        let Context {
            gpu, scene, size, ..
        } = *context;
        let grid = CellGrid::around(scene.lit_bounds(), settings.count("resolution"), MARGIN);
        let words = |name: &str, count: u32| {
            gpu.create_buffer(&BufferDesc {
                name: name.into(),
                size_bytes: 4 * u64::from(count),
                usage: BufferUsage::Storage,
                owner: Owner::Store,
            })
        };
        let specular = || screen_image(gpu, "lpv.specular", size);
        Ok(Lpv {
            grid,
            faces: words("lpv.faces", grid.count())?,
            flux: words("lpv.flux", inject::FLUX_NUMBERS * grid.count())?,
            sweep: Sweep::new(gpu, grid, entry::directions(settings))?,
            injection_shift: settings.number("injection_shift"),
            gather_shift: settings.number("gather_shift"),
            rsm_texels: settings.count("rsm_texels"),
            light: IndirectLight {
                diffuse: screen_image(gpu, "lpv.diffuse", size)?,
                specular: scene.is_glossy.then(specular).transpose()?,
            },
        })
    }
}

impl Technique for Lpv {
    fn needs(&self) -> Needs {
        Needs {
            maps: MapNeeds::Reflective,
            motion: false,
        }
    }

    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        let mut frame = Frame::new();
        frame.set_scene(&context.scene.set, &context.scene.materials);
        faces::find_faces(&mut frame, context.scene, &self.grid, &self.faces);
        context.gpu.submit(frame)
    }

    fn follow(&mut self, context: &Context<'_>, change: Change) -> Result<FrameStats, Error> {
        match change {
            Change::Models => self.build(context),
            Change::Lights | Change::Camera => Ok(FrameStats::default()),
        }
    }

    fn update(&mut self, frame: &mut Frame, given: &Inputs<'_>) {
        let flux_unit = inject::flux_unit(&given.scene.lights, &self.grid);
        inject::inject(
            frame,
            given.maps,
            (&self.grid, &self.flux),
            (flux_unit, self.injection_shift, self.rsm_texels),
        );
        self.sweep.run(frame, &self.faces, (&self.flux, flux_unit));
    }

    fn gather(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> Answer {
        gather::gather(
            frame,
            given.gbuffer,
            (&self.grid, &self.sweep.light),
            self.gather_shift,
            &self.light,
        );
        Answer {
            indirect: self.light.clone(),
            has_direct: false,
        }
    }
}

impl Inspect for Lpv {
    fn cell_size(&self) -> Option<f32> {
        Some(self.grid.cell_size)
    }
}
