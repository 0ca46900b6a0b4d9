//! No indirect light: direct light alone, and the skeleton of a technique.

use super::entry::{Entry, Stage};
use super::settings::Settings;
use super::{Answer, Context, IndirectLight, Inputs, Inspect, MapNeeds, Needs, Technique};
use crate::graph::{Error, Frame, FrameStats};
use crate::render::screen_image;

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    bounces: |_| Some(0),
    stages: &[&Stage::picture("gather", &["none.clear"])],
    ..Entry::new("none", "no indirect light", make)
};

fn make(context: &Context<'_>, _settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(NoLight {
        light: IndirectLight {
            diffuse: screen_image(context.gpu, "none.diffuse", context.size)?,
            specular: None,
        },
    }))
}

struct NoLight {
    light: IndirectLight,
}

impl Technique for NoLight {
    fn needs(&self) -> Needs {
        Needs {
            maps: MapNeeds::Shadows,
            motion: false,
        }
    }

    fn build(&mut self, _context: &Context<'_>) -> Result<FrameStats, Error> {
        Ok(FrameStats::default())
    }

    fn update(&mut self, _frame: &mut Frame, _given: &Inputs<'_>) {}

    fn gather(&mut self, frame: &mut Frame, _given: &Inputs<'_>) -> Answer {
        frame.clear_image("none.clear", &self.light.diffuse, [0.0; 4]);
        Answer {
            indirect: self.light.clone(),
            has_direct: false,
        }
    }
}

impl Inspect for NoLight {}
