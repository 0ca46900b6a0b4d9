//! No indirect light: direct light alone, and the skeleton of a technique.

use super::entry::{Entry, Stage};
use super::settings::Settings;
use super::{Context, Inputs, Inspect, MapNeeds, Needs, Technique};
use crate::graph::{Error, Frame, FrameStats};
use crate::render::Receivers;

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    bounces: |_| Some(0),
    stages: &[&Stage::picture("gather", &["none.clear"])],
    ..Entry::new("none", "no indirect light", make)
};

fn make(_context: &Context<'_>, _settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(NoLight))
}

struct NoLight;

impl Technique for NoLight {
    fn needs(&self) -> Needs {
        Needs::maps(MapNeeds::Direct)
    }

    fn build(&mut self, _context: &Context<'_>) -> Result<FrameStats, Error> {
        Ok(FrameStats::default())
    }

    fn update(&mut self, _frame: &mut Frame, _given: &Inputs<'_>) {}

    fn gather(&mut self, frame: &mut Frame, _given: &Inputs<'_>, receivers: &Receivers<'_>) {
        frame.clear_image("none.clear", receivers.light, [0.0; 4]);
    }
}

impl Inspect for NoLight {}
