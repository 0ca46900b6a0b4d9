//! Techniques of one grid around the scene.

use std::sync::Arc;

use super::gather::Lookup;
use super::inflow::Inflow;
use super::peel::CameraLayers;
use super::structure::{self, Structure};
use super::{
    CellGrid, CellSettings, Cells, Propagation, by_direction, gather, ledger, place, view,
};
use crate::gi::inspect::{BeamStart, Energy, ViewRow};
use crate::gi::{Change, Context, Inputs, Inspect, Needs, Settings, Technique};
use crate::graph::{Error, Frame, FrameStats, Gpu, Image};
use crate::render::{GBuffer, Receivers, screen_image};

/// A technique of one scene.
pub(super) struct OneGrid {
    cells: Cells,
    layers: CameraLayers,
    lookup: Lookup,
    /// RGBA32F: indirect specular radiance; absent where nothing mirrors.
    specular: Option<Arc<Image>>,
}

impl OneGrid {
    /// Allocates.
    pub(super) fn new(context: &Context<'_>, settings: &Settings) -> Result<Self, Error> {
        let Context {
            gpu, scene, size, ..
        } = *context;
        let [cells, margin] = ["resolution", "margin"].map(|name| settings.count(name));
        let grid = CellGrid::around(scene.lit_bounds(), cells, margin);
        let cell_settings = CellSettings::new(settings);
        let specular = || screen_image(gpu, "lpv.specular", size);
        Ok(OneGrid {
            cells: Cells::new(gpu, scene, grid, cell_settings)?,
            layers: CameraLayers::new(gpu, size, cell_settings.blocker_layers)?,
            lookup: Lookup::new(settings, 0.0),
            specular: scene.is_glossy.then(specular).transpose()?,
        })
    }
}

impl Technique for OneGrid {
    fn needs(&self) -> Needs {
        self.cells.settings.needs()
    }

    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        self.cells.find_faces(context.gpu, context.scene)
    }

    fn follow(&mut self, context: &Context<'_>, change: Change) -> Result<FrameStats, Error> {
        match change {
            Change::Models => self.build(context),
            Change::Lights => {
                let inflow = Inflow::new(context.scene, &self.cells.grid);
                self.cells.follow_lights(context.gpu, inflow)?;
                Ok(FrameStats::default())
            }
            Change::Camera => Ok(FrameStats::default()),
        }
    }

    fn update(&mut self, frame: &mut Frame, given: &Inputs<'_>) {
        let Inputs {
            scene,
            maps,
            gbuffer,
            is_still,
            ..
        } = *given;
        if is_still && !self.layers.any() {
            return;
        }
        let layers = self.layers.draw(frame, scene, gbuffer);
        self.cells.light(frame, scene, maps, &layers);
    }

    fn gather(&mut self, frame: &mut Frame, given: &Inputs<'_>, receivers: &Receivers<'_>) {
        let cells = &self.cells;
        if cells.settings.keeps_directions {
            let specular = self.specular.as_ref();
            by_direction::gather(frame, given, cells, self.lookup, (receivers, specular));
        } else {
            gather::gather(frame, receivers, std::slice::from_ref(cells), self.lookup);
        }
    }

    fn mirror(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> Option<Arc<Image>> {
        let specular = self.specular.as_ref()?;
        if !self.cells.settings.keeps_directions {
            let levels = std::slice::from_ref(&self.cells);
            gather::mirror(frame, given.gbuffer, levels, self.lookup, specular);
        }
        Some(Arc::clone(specular))
    }
}

impl Inspect for OneGrid {
    fn counts(&self, _gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let sides = self.cells.faces.sides.as_ref();
        let sides = sides.map(|sides| ("opaque_sides", u64::from(sides.count)));
        let cells = ("cells", u64::from(self.cells.grid.count()));
        let larger = match &*self.cells.propagation {
            Propagation::Leaves(sweep) => Some(("leaves", sweep.leaves.all.len() as u64)),
            Propagation::Levels(levels) => Some(("levels", u64::from(levels.count()))),
            _ => None,
        };
        Ok([Some(cells), larger, sides].into_iter().flatten().collect())
    }

    fn energy(&self, context: &Context<'_>) -> Result<Option<Energy>, Error> {
        ledger::energy(context.gpu, context.scene, &self.cells)
    }

    fn cell_size(&self) -> Option<f32> {
        Some(self.cells.grid.cell_size)
    }

    fn levels(&self, view: &ViewRow) -> u32 {
        match view.name {
            view::LEVELS => structure::count(std::slice::from_ref(&self.cells)),
            _ => u32::from(view::VIEWS.contains(view)),
        }
    }

    fn draw_view(
        &self,
        frame: &mut Frame,
        (view, level): (&ViewRow, u32),
        gbuffer: &GBuffer,
        seen: &Arc<Image>,
    ) {
        if view.name != view::LEVELS {
            view::draw(frame, view, &self.cells, seen);
            return;
        }
        let structure = Structure {
            grids: std::slice::from_ref(&self.cells),
            shift: self.lookup.shift,
            blend: self.lookup.blend,
            from: level,
        };
        structure.draw(frame, gbuffer, seen);
    }

    fn figures_at(
        &self,
        context: &Context<'_>,
        start: &BeamStart,
    ) -> Result<Vec<(&'static str, String)>, Error> {
        let of = (context.gpu, context.scene);
        place::figures(
            of,
            std::slice::from_ref(&self.cells),
            self.lookup.shift,
            start,
        )
    }
}
