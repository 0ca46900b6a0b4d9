//! What pixels share after a technique has gathered, whichever it is: light of frames before
//! ([`HISTORY`]) and of neighbours ([`BLUR`]), each by settings that all techniques have, and each
//! off by default. `oracle` is the CPU twin.

mod blur;
mod history;
pub mod oracle;
pub mod settings;

pub use blur::{BLUR, BlurParams};
pub use history::{HISTORY, HistoryParams};
pub use settings::{Blurring, ScreenSettings};

use blur::Blur;
use history::History;

use crate::gi::IndirectLight;
use crate::gi::entry::Stage;
use crate::graph::{Error, Frame, Gpu, Pass};
use crate::image::Image;
use crate::render::{FrameConstants, GBuffer, read_last_float};

/// All passes of this module.
pub static PASSES: &[&Pass] = &[&HISTORY, &BLUR];

/// Light of frames before.
pub static REUSE: Stage = Stage::picture("reuse over time", &["screen.history"]);
/// Light of neighbours.
pub static BLURRING: Stage = Stage::picture("blur", &["screen.blur"]);

/// The stages of one picture.
pub struct Screen {
    settings: ScreenSettings,
    history: Option<History>,
    blur: Option<Blur>,
}

impl Screen {
    /// Allocates what these settings need, for pictures of at most this size (px).
    pub fn new(gpu: &Gpu, settings: ScreenSettings, size: [u32; 2]) -> Result<Self, Error> {
        let history = (settings.longest_history > 0).then(|| History::new(gpu, size));
        let blur = (settings.blur != Blurring::Off).then(|| Blur::new(gpu, size));
        Ok(Screen {
            settings,
            history: history.transpose()?,
            blur: blur.transpose()?,
        })
    }

    /// Whether [`GBuffer::motion`] is read.
    pub fn needs_motion(&self) -> bool {
        self.history.is_some()
    }

    /// Number of the frame in the walk of patterns ([`FrameConstants::walk`]); 0 where nothing is
    /// kept of frames before.
    pub fn walk(&self) -> u32 {
        self.history.as_ref().map_or(0, |history| history.frames)
    }

    /// The next frame is the first: it has nothing to do with those before.
    pub fn forget(&mut self) {
        if let Some(history) = &mut self.history {
            history.forget();
        }
    }

    /// Lights have changed. What frames before have seen is wrong now, and weighs little in the
    /// next frame.
    pub fn doubt(&mut self) {
        if let Some(history) = &mut self.history {
            history.is_doubtful = true;
        }
    }

    /// Adds the passes that bring other pixels' light, and that of frames before, to what a
    /// technique has gathered.
    pub fn share(
        &self,
        frame: &mut Frame,
        gbuffer: &GBuffer,
        gathered: IndirectLight,
    ) -> IndirectLight {
        let mut light = gathered;
        if let Some(history) = &self.history {
            light.diffuse = history.add(frame, gbuffer, &light.diffuse, &self.settings);
        }
        if let Some(blur) = &self.blur {
            let guide = self.history.as_ref().map(History::guide);
            light.diffuse = blur.add(frame, gbuffer, (&light.diffuse, guide), &self.settings);
        }
        light
    }

    /// How many frames the light of each pixel of the last frame weighs, grey; `None` without
    /// history.
    pub fn weights(&self, gpu: &Gpu, gbuffer: &GBuffer) -> Result<Option<Image>, Error> {
        let guide = self.history.as_ref().map(History::last_guide);
        guide
            .map(|guide| read_last_float(gpu, gbuffer, guide))
            .transpose()
    }

    /// Makes the frame that was drawn with these constants the one before; called when it is done.
    pub fn keep_frame(&mut self, seen_with: &FrameConstants) {
        if let Some(history) = &mut self.history {
            history.keep_frame(seen_with);
        }
    }
}
