//! Technique `lpv-cascaded`: nested grids around the camera, each with cells twice as large as
//! those of the grid inside it (Kaplanyan & Dachsbacher 2010, section 6; Hong 2015, section
//! 2.5.2.7).

mod entry;
pub mod layout;

use std::sync::Arc;

pub use entry::ENTRY;
pub use layout::Layout;

use super::cells::radiance_scale;
use super::gather::Lookup;
use super::inflow::Inflow;
use super::peel::CameraLayers;
use super::structure::Structure;
use super::sweep::Nesting;
use super::{CellSettings, Cells, Propagation, gather, ledger, place, settings as family, view};
use crate::gi::inspect::{BeamStart, Energy, ViewRow};
use crate::gi::{Change, Context, Inputs, Inspect, Needs, Settings, Technique};
use crate::graph::{Error, Frame, FrameStats, Gpu, Image};
use crate::render::{GBuffer, Receivers, screen_image};

/// The technique, of one scene.
pub struct CascadedLpv {
    layout: Layout,
    /// The grids, outermost first.
    pub levels: Vec<Cells>,
    /// Whether light comes into a grid from the one around it.
    takes_light: bool,
    /// A grid has moved since light went through it.
    has_moved: bool,
    layers: CameraLayers,
    lookup: Lookup,
    /// RGBA32F: indirect specular radiance; absent where nothing mirrors.
    specular: Option<Arc<Image>>,
}

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    family::warn(settings);
    Ok(Box::new(CascadedLpv::new(context, settings)?))
}

impl CascadedLpv {
    /// Allocates, for where the camera is.
    pub fn new(context: &Context<'_>, settings: &Settings) -> Result<Self, Error> {
        let Context {
            gpu, scene, size, ..
        } = *context;
        let layout = Layout::new(
            scene.lit_bounds(),
            settings.count("resolution"),
            settings.count("levels"),
            settings.number("cell_size"),
        );
        let specular = || screen_image(gpu, "lpv.specular", size);
        let grids = layout.grids(context.eye);
        let cell_settings = CellSettings::new(settings);
        Ok(CascadedLpv {
            layout,
            levels: Cells::nested(gpu, scene, &grids, cell_settings)?,
            layers: CameraLayers::new(gpu, size, cell_settings.blocker_layers)?,
            takes_light: settings.is("nesting", "inflow"),
            has_moved: false,
            lookup: Lookup::new(settings, settings.number("blend")),
            specular: scene.is_glossy.then(specular).transpose()?,
        })
    }

    fn nesting(&self, level: usize) -> Nesting {
        if !self.takes_light {
            return Nesting::default();
        }
        let grids: Vec<_> = self.levels.iter().map(|cells| cells.grid).collect();
        Nesting {
            own: Layout::nested(&grids, level),
            inner: Layout::nested(&grids, level + 1),
        }
    }
}

impl Technique for CascadedLpv {
    fn needs(&self) -> Needs {
        self.levels[0].settings.needs()
    }

    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        for (cells, grid) in self.levels.iter_mut().zip(self.layout.grids(context.eye)) {
            cells.place(grid);
        }
        Cells::find_all_faces(context.gpu, context.scene, &mut self.levels)
    }

    fn follow(&mut self, context: &Context<'_>, change: Change) -> Result<FrameStats, Error> {
        match change {
            Change::Models => self.build(context),
            Change::Camera => {
                let grids = self.layout.grids(context.eye);
                let levels = self.levels.iter().zip(&grids);
                self.has_moved |= levels.into_iter().any(|(cells, grid)| cells.grid != *grid);
                Cells::follow(context.gpu, context.scene, &mut self.levels, &grids)
            }
            Change::Lights => {
                if let Some(finest) = self.levels.last().map(|cells| cells.grid) {
                    let inflow = Inflow::new(context.scene, &finest);
                    for cells in &mut self.levels {
                        cells.follow_lights(context.gpu, inflow)?;
                    }
                }
                Ok(FrameStats::default())
            }
        }
    }

    fn update(&mut self, frame: &mut Frame, given: &Inputs<'_>) {
        let has_moved = std::mem::take(&mut self.has_moved);
        if given.is_still && !has_moved && !self.layers.any() {
            return;
        }
        let lit = (given.scene, given.maps);
        // The finest cells have the most radiance: a lamp's power over the smallest faces.
        let finest = self.levels.last().map(|cells| cells.grid);
        let scale = finest.map_or(1.0, |grid| radiance_scale(given.scene, &grid));
        let layers = self.layers.draw(frame, given.scene, given.gbuffer);
        for cells in &mut self.levels {
            cells.inject(frame, lit, &layers, scale);
        }
        for bounce in 0..self.levels[0].settings.bounces {
            for (level, cells) in self.levels.iter().enumerate() {
                cells.propagate(frame, lit, bounce, self.nesting(level));
            }
        }
    }

    fn gather(&mut self, frame: &mut Frame, _given: &Inputs<'_>, receivers: &Receivers<'_>) {
        gather::gather(frame, receivers, &self.levels, self.lookup);
    }

    fn mirror(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> Option<Arc<Image>> {
        let specular = self.specular.as_ref()?;
        gather::mirror(frame, given.gbuffer, &self.levels, self.lookup, specular);
        Some(Arc::clone(specular))
    }
}

impl Inspect for CascadedLpv {
    fn counts(&self, _gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let cells = self.levels.iter().map(|cells| cells.grid.count());
        let sides = self.levels.iter().map(|cells| cells.faces.sides.as_ref());
        let sides: Option<u64> = sides.map(|sides| Some(u64::from(sides?.count))).sum();
        let cells = ("cells", cells.map(u64::from).sum());
        let sides = sides.map(|sides| ("opaque_sides", sides));
        Ok([Some(cells), sides].into_iter().flatten().collect())
    }

    /// Of the outermost grid: all light goes through it, and it takes none from the others.
    fn energy(&self, context: &Context<'_>) -> Result<Option<Energy>, Error> {
        let outermost = &self.levels[0];
        // Of lobes there is an account in techniques of one grid alone.
        match &*outermost.propagation {
            Propagation::Sweep(_) => ledger::energy(context.gpu, context.scene, outermost),
            _ => Ok(None),
        }
    }

    fn cell_size(&self) -> Option<f32> {
        self.levels.last().map(|cells| cells.grid.cell_size)
    }

    fn levels(&self, view: &ViewRow) -> u32 {
        if view::VIEWS.contains(view) {
            self.levels.len() as u32
        } else {
            0
        }
    }

    fn draw_view(
        &self,
        frame: &mut Frame,
        (view, level): (&ViewRow, u32),
        gbuffer: &GBuffer,
        seen: &Arc<Image>,
    ) {
        if view.name == view::LEVELS {
            let structure = Structure {
                grids: &self.levels,
                shift: self.lookup.shift,
                blend: self.lookup.blend,
                from: level,
            };
            structure.draw(frame, gbuffer, seen);
            return;
        }
        let mut finest_first = self.levels.iter().rev();
        if let Some(cells) = finest_first.nth(level as usize) {
            view::draw(frame, view, cells, seen);
        }
    }

    fn figures_at(
        &self,
        context: &Context<'_>,
        start: &BeamStart,
    ) -> Result<Vec<(&'static str, String)>, Error> {
        let of = (context.gpu, context.scene);
        place::figures(of, &self.levels, self.lookup.shift, start)
    }
}
