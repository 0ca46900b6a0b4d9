//! What pixels share of what a technique gathers, whichever it is: which of them gather
//! ([`UPSAMPLE`], [`JOIN`]), light of frames before ([`HISTORY`]), of neighbours ([`BLUR`]). Each
//! is a setting that all techniques have, and is off by default. `oracle` is the CPU twin.

mod a_trous;
mod blur;
mod discontinuity;
mod gather;
mod history;
pub mod oracle;
mod relight;
pub mod settings;

pub use a_trous::{A_TROUS, ATrousParams, VARIANCE, VarianceParams};
pub use blur::{BLUR, BlurParams};
pub use discontinuity::discontinuity;
pub use gather::{CoarseParams, JOIN, JoinParams, LEFT_OVER, UPSAMPLE};
pub use history::{HISTORY, HISTORY_MIRRORED, HISTORY_MOMENTS, HistoryParams};
pub use relight::{RELIGHT, REMEMBER};
pub use settings::{Blurring, ScreenSettings};

use std::sync::Arc;

use a_trous::ATrous;
use blur::Blur;
use gather::Gather;
use history::History;
use relight::{Change, Relight};

use crate::gi::entry::Stage;
use crate::gi::shared::interleave::{DEINTERLEAVE, Pattern, deinterleave};
use crate::gi::{IndirectLight, Inputs, Technique};
use crate::graph::{Error, Frame, Gpu, Image as GpuImage, Pass};
use crate::image::Image;
use crate::render::{
    Follows, FrameConstants, GBuffer, GpuScene, PICK, read_pixels, read_weights, screen_image,
};
use crate::scene::Camera;

/// All passes of this module, and those of windows.
pub static PASSES: &[&Pass] = &[
    &JOIN,
    &LEFT_OVER,
    &UPSAMPLE,
    &DEINTERLEAVE,
    &REMEMBER,
    &RELIGHT,
    &HISTORY,
    &HISTORY_MOMENTS,
    &HISTORY_MIRRORED,
    &BLUR,
    &VARIANCE,
    &A_TROUS,
];

/// Which pixels gather.
pub static SOME_PIXELS: Stage = Stage::picture(
    "fewer or sorted pixels",
    &[PICK.name, JOIN.name, LEFT_OVER.name, UPSAMPLE.name],
);
/// Light of the pixels of a tile, a part of the gather.
pub static WINDOW: Stage = Stage::picture("gather", &["gi.deinterleave"]);

/// Light of frames before.
pub static REUSE: Stage = Stage::picture(
    "reuse over time",
    &[
        REMEMBER.name,
        RELIGHT.name,
        HISTORY.name,
        HISTORY_MIRRORED.name,
    ],
);
/// Light of neighbours.
pub static BLURRING: Stage = Stage::picture("blur", &[BLUR.name, VARIANCE.name, A_TROUS.name]);

/// The stages of one picture.
pub struct Screen {
    settings: ScreenSettings,
    gather: Gather,
    relight: Option<Relight>,
    history: Option<History>,
    blur: Option<Blur>,
    a_trous: Option<ATrous>,
    /// RGBA32F: a copy of the light that is kept, where a technique adds to it what is not.
    whole: Option<Arc<GpuImage>>,
    /// RGBA32F: mirrored light after its window; absent without patterns of it.
    mirrored: Option<Arc<GpuImage>>,
}

impl Screen {
    /// Allocates what these settings need, for pictures of at most this size (px); `adds_apart` as
    /// [`Technique::adds_apart`].
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        (settings, adds_apart): (ScreenSettings, bool),
        size: [u32; 2],
    ) -> Result<Self, Error> {
        let has_history = settings.longest_history > 0;
        let mirrors = scene.is_glossy && settings.specular_pattern.count() > 1;
        let shows_kept = has_history && settings.blur == Blurring::Off;
        let is_a_trous = settings.blur == Blurring::ATrous;
        let history = has_history.then(|| History::new(gpu, size, [mirrors, is_a_trous]));
        let relight = (has_history && settings.relight_tile > 0)
            .then(|| Relight::new(gpu, scene, (settings.relight_tile, settings.scale), size));
        let blur = matches!(settings.blur, Blurring::Even | Blurring::Adaptive)
            .then(|| Blur::new(gpu, size));
        Ok(Screen {
            settings,
            gather: Gather::new(gpu, scene, &settings, size)?,
            relight: relight.transpose()?,
            history: history.transpose()?,
            blur: blur.transpose()?,
            a_trous: is_a_trous.then(|| ATrous::new(gpu, size)).transpose()?,
            whole: (adds_apart && shows_kept)
                .then(|| screen_image(gpu, "screen.whole", size))
                .transpose()?,
            mirrored: mirrors
                .then(|| screen_image(gpu, "screen.mirrored", size))
                .transpose()?,
        })
    }

    /// What of the frame before is read in the G-buffer.
    pub fn follows(&self) -> Follows {
        match &self.history {
            None => Follows::Nothing,
            Some(_) if self.settings.tests_material => Follows::Materials,
            Some(_) => Follows::Motion,
        }
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
        if let Some(relight) = &mut self.relight {
            relight.forget();
        }
    }

    /// Lights or models have moved: for so many frames, the light of frames before may be wrong.
    pub fn expect_change(&mut self, frames: u32) {
        if let Some(relight) = &mut self.relight {
            relight.expect_change(frames);
        }
    }

    /// Lights have moved. Where nothing says by how much that changes the light of a pixel, frames
    /// before weigh little in the next frame.
    pub fn doubt(&mut self) {
        if let Some(history) = self.history.as_mut().filter(|_| self.relight.is_none()) {
            history.is_doubtful = true;
        }
    }

    /// Which of the pixels that gather has the directions that a pixel shows, counted along each
    /// axis.
    pub fn place(&self, pixel: [u32; 2]) -> [u32; 2] {
        pixel.map(|at| at / self.settings.scale)
    }

    /// The next frame is seen with these constants; sets the number of the frame in them.
    pub fn set(&mut self, gpu: &Gpu, seen_with: &mut FrameConstants) -> Result<(), Error> {
        let number = self.walk();
        seen_with.walk[0] = number;
        self.gather.set(gpu, &self.settings, seen_with)?;
        match &mut self.relight {
            Some(relight) => relight.set(gpu, seen_with, (self.gather.grid(), number)),
            None => Ok(()),
        }
    }

    /// Adds the passes that answer for each pixel of the G-buffer: the technique's, for the pixels
    /// that gather, and those by which pixels share.
    pub fn light(
        &self,
        frame: &mut Frame,
        given: &Inputs<'_>,
        technique: &mut dyn Technique,
    ) -> IndirectLight {
        let relight = self.relight.as_ref();
        let change = relight.and_then(|relight| relight.find(frame, given, technique));
        let mut diffuse = self.gather.add(frame, given, technique, &self.settings);
        if let Some(relight) = relight {
            relight.remember(frame, given, &self.gather);
        }
        if let Some(history) = &self.history {
            let light = (&diffuse, change.as_ref());
            diffuse = history.add(frame, given.gbuffer, light, &self.settings);
        }
        if let Some(blur) = &self.blur {
            let guide = self.history.as_ref().map(History::guide);
            diffuse = blur.add(frame, given.gbuffer, (&diffuse, guide), &self.settings);
        }
        if let Some(a_trous) = &self.a_trous {
            let light = (&diffuse, self.history.as_ref());
            diffuse = a_trous.add(frame, given.gbuffer, light, &self.settings);
        }
        if let Some(whole) = &self.whole {
            // A window of one pixel is a copy.
            let kept = given.gbuffer.receivers(given.scene, &diffuse);
            deinterleave(
                frame,
                &kept,
                whole,
                (Pattern::of([1, 1]), self.settings.limits),
            );
            diffuse = Arc::clone(whole);
        }
        technique.add_apart(frame, given, &diffuse);
        let specular = technique.mirror(frame, given);
        IndirectLight {
            diffuse,
            specular: specular.map(|light| self.share_mirrored(frame, given, light, change)),
        }
    }

    /// Adds the passes by which pixels share mirrored light, where each has directions of its own.
    fn share_mirrored(
        &self,
        frame: &mut Frame,
        given: &Inputs<'_>,
        light: Arc<GpuImage>,
        change: Option<Change<'_>>,
    ) -> Arc<GpuImage> {
        let Some(windowed) = &self.mirrored else {
            return light;
        };
        let mirrored = given.gbuffer.receivers(given.scene, &light);
        let shared = (self.settings.specular_pattern, self.settings.limits);
        deinterleave(frame, &mirrored, windowed, shared);
        match &self.history {
            Some(history) => history.add_mirrored(
                frame,
                given.gbuffer,
                (windowed, change.as_ref()),
                &self.settings,
            ),
            None => Arc::clone(windowed),
        }
    }

    /// How many frames the light of each pixel of the last frame weighs, in red, and its
    /// visibility, in green; `None` without history.
    pub fn weights(&self, gpu: &Gpu, gbuffer: &GBuffer) -> Result<Option<Image>, Error> {
        let guide = self.history.as_ref().map(History::last_guide);
        guide
            .map(|guide| read_weights(gpu, gbuffer, guide))
            .transpose()
    }

    /// Where pixels of the last frame, seen by this camera, are too far apart to share light.
    pub fn discontinuity(
        &self,
        gpu: &Gpu,
        gbuffer: &GBuffer,
        camera: &Camera,
    ) -> Result<Image, Error> {
        let surfaces = read_pixels(gpu, gbuffer)?;
        Ok(discontinuity(
            &surfaces,
            gbuffer.size,
            camera,
            self.settings.limits,
        ))
    }

    /// Makes the frame that was drawn with these constants the one before; called when it is done.
    pub fn keep_frame(&mut self, seen_with: &FrameConstants) {
        if let Some(history) = &mut self.history {
            history.keep_frame(seen_with);
        }
        if let Some(relight) = &mut self.relight {
            relight.keep_frame();
        }
    }
}
