//! What cases measure with: a technique's pictures, and what they ought to be.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::PathBuf;

use super::{Effort, StressError, changed, scenes};
use crate::frame::{FrameSettings, Renderer};
use crate::gi::Settings;
use crate::gi::entry::Entry;
use crate::graph::Gpu;
use crate::image::{Aov, GuideImage, Image};
use crate::metrics::{Channel, Errors, MetricError, compare};
use crate::reference::{self, Bounces, Filter, ReferenceImage, Sampling, cached};
use crate::scene::Scene;

/// What is measured.
pub struct Trial<'p> {
    /// The device that renders.
    pub gpu: &'p Gpu,
    /// The technique that is measured.
    pub entry: &'static Entry,
    /// The values of all its settings.
    pub settings: &'p Settings,
    /// What all techniques share.
    pub frame: FrameSettings,
    /// How much is measured.
    pub effort: &'p Effort,
    /// The scene of cases that take any; `None` for the suite's own.
    pub scene: Option<&'p Scene>,
    /// References that all techniques are compared with.
    pub memo: &'p Memo,
}

/// References that were rendered before.
pub struct Memo {
    /// The folder of references for still pictures.
    cache: PathBuf,
    /// References of frames, kept while the program runs: a sequence is too many files for the
    /// folder.
    frames: RefCell<BTreeMap<(u128, Bounces), Image>>,
}

impl Memo {
    /// With the references in a folder.
    pub fn new(cache: PathBuf) -> Self {
        Memo {
            cache,
            frames: RefCell::default(),
        }
    }
}

/// Resolution of a technique without that setting (cells).
const RESOLUTION: u32 = 64;

/// Frames after the last move, at least, until a picture is taken to stand still.
pub(super) const SETTLE_FRAMES: u32 = 17;

/// Fewer blocks than this say little of a picture.
const FEWEST_BLOCKS: usize = 4;

impl Trial<'_> {
    /// The scene of a case that takes any, with nothing that moves.
    pub(super) fn base(&self) -> Result<Scene, StressError> {
        self.scene.map_or_else(
            || Ok(scenes::standard()?),
            |scene| Ok(scenes::still(scene.clone())),
        )
    }

    /// Cells along an edge of the grid.
    pub(super) fn resolution(&self) -> u32 {
        self.settings.resolution().unwrap_or(RESOLUTION)
    }

    /// Edge of a cell over the largest extent of what the grid is fitted to.
    pub(super) fn cell_share(&self) -> f32 {
        scenes::cell_share(self.resolution()) as f32
    }

    /// Edge of a cell in a scene of the suite's own (m).
    pub(super) fn cell_m(&self) -> f32 {
        scenes::ROOM_M * self.cell_share()
    }

    /// Bounces that the reference has; a technique without any is held against one.
    pub(super) fn bounces(&self) -> Bounces {
        (self.entry.bounces)(self.settings)
            .map_or(Bounces::Full, |bounces| Bounces::Count(bounces.max(1)))
    }

    /// Frames until a still picture has all its light.
    pub(super) fn frames_to_rest(&self) -> u32 {
        self.entry.rest(self.settings)
    }

    /// Frames until it is so too after something else was seen, with as much history as there may
    /// be.
    pub(super) fn frames_to_settle(&self) -> u32 {
        (2 * self.frames_to_rest()).max(SETTLE_FRAMES)
    }

    /// The settings with those of these `KEY=VALUE` pairs on top that the technique has.
    pub(super) fn settings_with(&self, pairs: &[&str]) -> Result<Settings, StressError> {
        let is_known = |pair: &&&str| {
            let mut all = self.entry.all_settings();
            all.any(|setting| pair.split('=').next() == Some(setting.name))
        };
        let known: Vec<&str> = pairs.iter().filter(is_known).copied().collect();
        Ok(changed(self.entry, self.settings, &known)?)
    }

    /// The technique's indirect light in a still scene.
    pub(super) fn indirect(&self, scene: &Scene) -> Result<Image, StressError> {
        self.picture(scene, Aov::Indirect)
    }

    /// The technique's diffuse irradiance in a still scene.
    pub(super) fn diffuse(&self, scene: &Scene) -> Result<Image, StressError> {
        self.picture(scene, Aov::Diffuse)
    }

    /// An output of the technique in a still scene.
    fn picture(&self, scene: &Scene, aov: Aov) -> Result<Image, StressError> {
        let (mut renderer, _) =
            Renderer::new(self.gpu, scene, self.entry, self.settings, self.frame)?;
        (0..self.frames_to_rest()).try_for_each(|_| renderer.render(&scene.camera).map(drop))?;
        Ok(renderer.aov(aov)?)
    }

    /// The reference's indirect light, and what each pixel sees; `times` as many samples as usual.
    pub(super) fn reference(
        &self,
        scene: &Scene,
        times: u32,
    ) -> Result<(Image, GuideImage), StressError> {
        let image = self.still_reference(scene, times)?;
        Ok((image.indirect(), image.guide))
    }

    /// The reference of a still scene; `times` as many samples as usual.
    pub(super) fn still_reference(
        &self,
        scene: &Scene,
        times: u32,
    ) -> Result<ReferenceImage, StressError> {
        let settings = self.reference_settings(times * self.effort.spp);
        Ok(cached(scene, &settings, &self.memo.cache, &|_| {})?)
    }

    /// The reference's indirect light in a frame of a sequence: every frame has the same random
    /// numbers, so that noise changes as little as it can.
    pub(super) fn frame_reference(&self, scene: &Scene) -> Result<Image, StressError> {
        let key = (scene.content_hash(), self.bounces());
        if let Some(image) = self.memo.frames.borrow().get(&key) {
            return Ok(image.clone());
        }
        let image = reference::render(
            scene,
            &self.reference_settings(self.effort.frame_spp),
            &|_| {},
        )?
        .indirect();
        self.memo.frames.borrow_mut().insert(key, image.clone());
        Ok(image)
    }

    fn reference_settings(&self, spp: u32) -> reference::Settings {
        let [width, height] = self.frame.size;
        reference::Settings {
            width,
            height,
            bounces: self.bounces(),
            filter: Filter::Center,
            sampling: Sampling::Fixed { spp },
            seed: 0,
            ..reference::Settings::default()
        }
    }

    /// Errors of the technique's indirect light in a still scene.
    pub(super) fn errors(
        &self,
        scene: &Scene,
        channel: Channel,
        times: u32,
    ) -> Result<Errors, StressError> {
        self.errors_of(&self.indirect(scene)?, scene, channel, times)
    }

    /// The technique's ambient visibility in a still scene.
    pub(super) fn visibility(&self, scene: &Scene) -> Result<Image, StressError> {
        self.picture(scene, Aov::Visibility)
    }

    /// rel_rmse of the technique's ambient visibility in a still scene.
    pub(super) fn visibility_error(&self, scene: &Scene) -> Result<f64, StressError> {
        let image = self.still_reference(scene, 1)?;
        let picture = self.visibility(scene)?;
        let open = (image.aov(Aov::Visibility)).ok_or(MetricError::Empty("no visibility"))?;
        Ok(errors_between(&picture, &open, &image.guide, Channel::Luminance)?.rel_rmse)
    }

    /// Errors of a picture against the reference of a scene: over blocks, or over pixels where
    /// there are too few of them.
    pub(super) fn errors_of(
        &self,
        picture: &Image,
        scene: &Scene,
        channel: Channel,
        times: u32,
    ) -> Result<Errors, StressError> {
        let (reference, guide) = self.reference(scene, times)?;
        Ok(errors_between(picture, &reference, &guide, channel)?)
    }
}

/// Over blocks, or over pixels where there are too few of them.
fn errors_between(
    picture: &Image,
    reference: &Image,
    guide: &GuideImage,
    channel: Channel,
) -> Result<Errors, MetricError> {
    let errors = compare(picture, reference, Some(guide), channel)?;
    Ok(errors
        .block
        .filter(|block| block.count >= FEWEST_BLOCKS)
        .unwrap_or(errors.pixel))
}
