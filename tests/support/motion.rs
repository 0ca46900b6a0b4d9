//! A technique that does nothing but ask for motion.

use lumivox::gi::entry::Entry;
use lumivox::gi::{
    Answer, Context, IndirectLight, Inputs, Inspect, MapNeeds, Needs, Settings, Technique,
};
use lumivox::graph::{Error, Frame, FrameStats, Image};
use lumivox::render::screen_image;
use std::sync::Arc;

/// Its row; no registry has it.
pub static WITH_MOTION: Entry = Entry::new("with-motion", "asks for motion", make);

fn make(context: &Context<'_>, _: &Settings) -> Result<Box<dyn Technique>, Error> {
    let diffuse = screen_image(context.gpu, "with_motion.diffuse", context.size)?;
    Ok(Box::new(WithMotion { diffuse }))
}

struct WithMotion {
    diffuse: Arc<Image>,
}

impl Technique for WithMotion {
    fn needs(&self) -> Needs {
        Needs {
            maps: MapNeeds::Nothing,
            motion: true,
        }
    }

    fn build(&mut self, _: &Context<'_>) -> Result<FrameStats, Error> {
        Ok(FrameStats::default())
    }

    fn update(&mut self, _: &mut Frame, _: &Inputs<'_>) {}

    fn gather(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> Answer {
        frame.clear_image("with_motion.clear", &self.diffuse, [0.0; 4]);
        frame.clear_image("with_motion.no_direct", given.direct, [0.0; 4]);
        Answer {
            indirect: IndirectLight {
                diffuse: Arc::clone(&self.diffuse),
                specular: None,
            },
            has_direct: true,
        }
    }
}

impl Inspect for WithMotion {}
