//! A technique that does nothing but ask for motion.

use lumivox::gi::entry::Entry;
use lumivox::gi::{Context, Inputs, Inspect, MapNeeds, Needs, Settings, Technique};
use lumivox::graph::{Error, Frame, FrameStats};
use lumivox::render::Receivers;

/// Its row; no registry has it.
pub static WITH_MOTION: Entry = Entry::new("with-motion", "asks for motion", make);

fn make(_: &Context<'_>, _: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(WithMotion))
}

struct WithMotion;

impl Technique for WithMotion {
    fn needs(&self) -> Needs {
        Needs {
            motion: true,
            ..Needs::maps(MapNeeds::Nothing)
        }
    }

    fn build(&mut self, _: &Context<'_>) -> Result<FrameStats, Error> {
        Ok(FrameStats::default())
    }

    fn update(&mut self, _: &mut Frame, _: &Inputs<'_>) {}

    fn gather(&mut self, frame: &mut Frame, _: &Inputs<'_>, receivers: &Receivers<'_>) {
        frame.clear_image("with_motion.clear", receivers.light, [0.0; 4]);
    }

    fn shadow_direct(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> bool {
        frame.clear_image("with_motion.no_direct", given.direct, [0.0; 4]);
        true
    }
}

impl Inspect for WithMotion {}
