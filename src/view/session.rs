//! What the window is about: scene, camera, lights, techniques, what is shown of them, and what
//! came back from the threads.

use std::collections::{BTreeMap, VecDeque};
use std::ffi::OsString;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Vec3;

use super::beam::{BeamAnswer, BeamJob, BeamState};
use super::camera::{Controls, DEG_PER_POINT};
use super::picture::{Look, ToneMap};
use super::simulator::{Order, SimulatorState};
use super::sky::{MadeSky, WantedSky};
use super::suit::{Suit, SuitAnswer, SuitJob};
use super::truth::{MOST_SAMPLES, RefinedReference, TruthJob};
use super::views::VIEWS;
use super::worker::{Job, PaneJob, Picture};
use crate::gi::entry::{Entry, Suited};
use crate::gi::{SettingError, Settings};
use crate::image::{Aov, Image};
use crate::reference::Bounces;
use crate::render::{ShadowSettings, Terms};
use crate::scene::{Environment, Light, LoadOptions, Scene};

/// How long after the last change the picture counts as at rest.
const REST: Duration = Duration::from_millis(150);

/// Frames that the history of times keeps.
pub(super) const HISTORY: usize = 240;

/// What is side by side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compare {
    /// One technique alone.
    Single,
    /// Two techniques or settings, left and right of a divider.
    Split,
    /// One technique left of the divider, its difference to the reference right of it.
    Difference,
}

impl Compare {
    /// The name that scripts have for it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Compare::Single => "single",
            Compare::Split => "split",
            Compare::Difference => "difference",
        }
    }
}

/// A technique with its settings, as the user chose them.
#[derive(Clone)]
pub(super) struct Choice {
    pub(super) entry: &'static Entry,
    pub(super) preset: Option<&'static str>,
    /// On top of the preset.
    pub(super) set: BTreeMap<&'static str, String>,
    /// The last values that are possible together.
    pub(super) settings: Settings,
    /// What is wrong with the chosen ones.
    pub(super) problem: Option<String>,
    /// Whether they are to suit the scene.
    pub(super) suit: Suit,
}

impl Choice {
    pub(super) fn new(
        entry: &'static Entry,
        preset: Option<&str>,
        pairs: &[String],
    ) -> Result<Self, SettingError> {
        let settings = entry.settings(preset, pairs)?;
        let preset = match preset {
            Some(name) => entry.presets.iter().find(|preset| preset.name == name),
            None => entry.presets.first(),
        };
        let mut choice = Choice {
            entry,
            preset: preset.map(|preset| preset.name),
            set: BTreeMap::new(),
            settings,
            problem: None,
            suit: Suit::Unasked,
        };
        for (name, value) in pairs.iter().filter_map(|pair| pair.split_once('=')) {
            let mut all = entry.all_settings();
            if let Some(setting) = all.find(|setting| setting.name == name.trim()) {
                choice.set.insert(setting.name, value.trim().to_owned());
            }
        }
        Ok(choice)
    }

    /// `KEY=VALUE` on top of the preset.
    pub(super) fn pairs(&self) -> Vec<String> {
        self.set
            .iter()
            .map(|(name, value)| format!("{name}={value}"))
            .collect()
    }

    /// Works the settings out after a change.
    pub(super) fn update(&mut self) {
        match self.entry.settings(self.preset, &self.pairs()) {
            Ok(settings) => (self.settings, self.problem) = (settings, None),
            Err(error) => self.problem = Some(error.to_string()),
        }
    }

    /// Another technique, or another preset of it.
    pub(super) fn choose(&mut self, entry: &'static Entry, preset: Option<&'static str>) {
        (self.entry, self.preset) = (
            entry,
            preset.or(entry.presets.first().map(|preset| preset.name)),
        );
        self.set.clear();
        self.suit = Suit::Unasked;
        self.update();
    }

    /// What was chosen for the scene, on top of the default preset; returns the resolution of light
    /// maps that goes with it (texels).
    fn take_suited(&mut self, suited: Suited) -> Option<u32> {
        match Choice::new(self.entry, None, &suited.pairs) {
            Ok(choice) => *self = choice,
            Err(error) => self.problem = Some(error.to_string()),
        }
        let needs = suited.needs.iter().map(|needs| format!("; {needs}"));
        self.suit = Suit::Said(suited.because + &needs.collect::<String>());
        suited.shadow_resolution
    }
}

/// The newest picture of a side.
pub(super) struct Newest {
    pub(super) picture: Picture,
    /// Grows with each picture: the drawing code sees by it whether the picture is new.
    pub(super) version: u64,
}

/// W/(m² sr) of a texel of 1, of a clear sky in place of a constant: as bright as a picture at
/// exposure 1 can show.
const FIRST_SCALE: f32 = 0.02;

/// All state of the program except the window itself.
pub(super) struct Session {
    /// As it was named.
    pub(super) source: OsString,
    /// How scenes are loaded.
    pub(super) load: LoadOptions,
    /// Number and scene, as loaded.
    pub(super) scene: (u64, Arc<Scene>),
    pub(super) lights: Vec<Light>,
    pub(super) environment: Environment,
    /// The sky that is to take its place once it is worked out.
    pub(super) wanted_sky: Option<WantedSky>,
    pub(super) controls: Controls,
    pub(super) choices: [Choice; 2],
    pub(super) compare: Compare,
    /// Where the divider is, 0 left to 1 right.
    pub(super) divider: f32,
    pub(super) view: usize,
    pub(super) layer: u32,
    pub(super) components: Terms,
    pub(super) beam: BeamState,
    pub(super) simulator: SimulatorState,
    /// Exposure (stops), 0 for none.
    pub(super) exposure_ev: f32,
    pub(super) tone_map: ToneMap,
    /// Brightest colour of differences, as a share of the reference's mean.
    pub(super) difference_scale: f32,
    pub(super) shadows: ShadowSettings,
    /// Width and height of the picture (px).
    pub(super) size: [u32; 2],
    /// Whether frames follow each other although nothing changes.
    pub(super) continuous: bool,
    /// Name of the device that renders; empty until it is open.
    pub(super) device: String,
    /// What the last thing that went wrong was.
    pub(super) problem: Option<String>,
    /// What the last shader that was compiled said.
    pub(super) shader: Option<Result<String, String>>,
    /// Why the scene that was last asked for could not be opened; pictures of the one before do
    /// not undo it.
    pub(super) scene_problem: Option<String>,
    /// What was last done, for the status line.
    pub(super) note: String,
    pub(super) newest: [Option<Newest>; 2],
    /// Frame times of each side (ms).
    pub(super) history: [VecDeque<f32>; 2],
    pub(super) builds: [Option<f64>; 2],
    pub(super) truth: Option<RefinedReference>,
    asked: Option<Job>,
    sky_asked: Option<WantedSky>,
    truth_asked: Option<u64>,
    /// Samples after which the reference rests.
    most_samples: u32,
    changed_at: Instant,
    pictures: u64,
}

impl Session {
    /// The sky was dragged by `x` points to the right.
    pub(super) fn drag_sky(&mut self, x: f32) {
        let Some(sky) = self.environment.sky() else {
            return;
        };
        let turned = sky.with(sky.scale(), sky.rotate_deg() - DEG_PER_POINT * x);
        self.set_environment(turned.into());
    }

    /// Replaces the environment, and with it the sun that was taken out of it.
    pub(super) fn set_environment(&mut self, environment: Environment) {
        environment.set_sun(&self.environment, &mut self.lights);
        self.environment = environment;
    }

    /// The sky to ask for, where there is a new one.
    pub(super) fn next_sky(&mut self) -> Option<WantedSky> {
        if self.wanted_sky == self.sky_asked {
            return None;
        }
        self.sky_asked.clone_from(&self.wanted_sky);
        self.wanted_sky.clone()
    }

    /// A sky is worked out: it is shown, as bright and as turned as the one before, unless none is
    /// wanted any more.
    pub(super) fn take_sky(&mut self, (wanted, made): MadeSky) {
        if self.wanted_sky.is_none() {
            return;
        }
        if self.wanted_sky.as_ref() == Some(&wanted) {
            self.wanted_sky = None;
        }
        if let Some(sky) = made {
            let (scale, rotate_deg) = self
                .environment
                .sky()
                .map_or((FIRST_SCALE, 0.0), |sky| (sky.scale(), sky.rotate_deg()));
            self.set_environment(sky.with(scale, rotate_deg).into());
        }
    }

    pub(super) fn new(
        source: OsString,
        scene: Scene,
        choice: Choice,
        shadows: ShadowSettings,
    ) -> Self {
        let bounds = scene.bounds().unwrap_or((Vec3::ZERO, Vec3::ONE));
        Session {
            source,
            load: LoadOptions::default(),
            lights: scene.lights.clone(),
            environment: scene.environment.clone(),
            wanted_sky: None,
            controls: Controls::new(scene.camera, bounds),
            scene: (0, Arc::new(scene)),
            choices: [choice.clone(), choice],
            compare: Compare::Single,
            divider: 0.5,
            view: 0,
            layer: 0,
            components: Terms::ALL,
            beam: BeamState::default(),
            simulator: SimulatorState::default(),
            exposure_ev: 0.0,
            tone_map: ToneMap::Clamp,
            difference_scale: 0.5,
            shadows,
            size: [0; 2],
            continuous: false,
            device: String::new(),
            problem: None,
            shader: None,
            scene_problem: None,
            note: String::new(),
            newest: [None, None],
            history: Default::default(),
            builds: [None; 2],
            truth: None,
            asked: None,
            sky_asked: None,
            truth_asked: None,
            most_samples: MOST_SAMPLES,
            changed_at: Instant::now(),
            pictures: 0,
        }
    }

    /// Another scene; techniques and what is shown of them stay.
    pub(super) fn open(&mut self, source: OsString, scene: Scene) {
        let bounds = scene.bounds().unwrap_or((Vec3::ZERO, Vec3::ONE));
        let mode = self.controls.mode;
        (self.lights, self.environment) = (scene.lights.clone(), scene.environment.clone());
        self.wanted_sky = None;
        self.controls = Controls::new(scene.camera, bounds);
        self.controls.mode = mode;
        self.scene = (self.scene.0 + 1, Arc::new(scene));
        // What was said is of another scene.
        for choice in &mut self.choices {
            choice.suit = Suit::Unasked;
        }
        (self.source, self.layer, self.problem) = (source, 0, None);
        self.note = format!("opened {}", self.source.to_string_lossy());
    }

    /// Exposure and tone map.
    pub(super) fn look(&self) -> Look {
        Look {
            exposure: self.exposure_ev.exp2(),
            tone_map: self.tone_map,
        }
    }

    /// How many techniques are rendered.
    pub(super) fn pane_count(&self) -> usize {
        if self.compare == Compare::Split { 2 } else { 1 }
    }

    fn pane_job(&self, index: usize) -> PaneJob {
        let choice = &self.choices[index];
        // The reference is compared with all light.
        let (view, components) = if self.compare == Compare::Difference {
            (0, Terms::ALL)
        } else {
            (self.view, self.components)
        };
        PaneJob {
            entry: choice.entry,
            settings: choice.settings.clone(),
            view,
            layer: self.layer,
            components,
        }
    }

    /// What is on the left side.
    pub(super) fn left_job(&self) -> PaneJob {
        self.pane_job(0)
    }

    /// The job to ask for, where there is a new one: in a hurry right after a change, at rest a
    /// little later. `held` says that a button or key is held down that changes things.
    pub(super) fn next_job(&mut self, held: bool) -> Option<Job> {
        if self.size.contains(&0) {
            return None;
        }
        let mut job = Job {
            id: self.asked.as_ref().map_or(1, |job| job.id),
            scene: (self.scene.0, Arc::clone(&self.scene.1)),
            lights: Arc::from(self.lights.as_slice()),
            environment: self.environment.clone(),
            camera: self.controls.camera,
            panes: (0..self.pane_count())
                .map(|index| self.pane_job(index))
                .collect(),
            size: self.size,
            shadows: self.shadows,
            rest: false,
            continuous: self.continuous,
        };
        match &self.asked {
            Some(asked) if same(asked, &job) => {
                if asked.rest || held || self.changed_at.elapsed() < REST {
                    return None;
                }
                job.rest = true;
            }
            asked => {
                // What is not dragged is at rest at once: the quick picture comes first anyway.
                job.rest = !held
                    && asked
                        .as_ref()
                        .is_none_or(|asked| asked.camera == job.camera && asked.size == job.size);
                job.id += u64::from(asked.is_some());
                self.changed_at = Instant::now();
            }
        }
        self.asked = Some(job.clone());
        Some(job)
    }

    /// When the picture is to be asked for in full, where nothing changes until then: nothing else
    /// may wake the window for it. `None` where it has been asked for.
    pub(super) fn rests_at(&self) -> Option<Instant> {
        let is_asked = self.asked.as_ref().is_none_or(|asked| asked.rest);
        (!is_asked && !self.size.contains(&0)).then(|| self.changed_at + REST)
    }

    /// The reference to ask for, where there is a new one; the inner `None` is that none is wanted
    /// any more.
    pub(super) fn next_truth(&mut self) -> Option<Option<TruthJob>> {
        let wanted = self
            .asked
            .as_ref()
            .filter(|job| job.rest && self.compare == Compare::Difference);
        if wanted.map(|job| job.id) == self.truth_asked {
            return None;
        }
        self.truth_asked = wanted.map(|job| job.id);
        let Some(job) = wanted else { return Some(None) };
        let pane = job.panes.first()?;
        let bounces = (pane.entry.bounces)(&pane.settings).map_or(Bounces::Full, Bounces::Count);
        let (scene, lights) = (Arc::clone(&job.scene.1), Arc::clone(&job.lights));
        Some(Some(TruthJob {
            id: job.id,
            scene,
            lights,
            environment: job.environment.clone(),
            camera: job.camera,
            size: job.size,
            bounces,
            most_samples: self.most_samples,
        }))
    }

    /// From now on the reference rests after `most` samples. A reference that has been asked for
    /// starts over.
    pub(super) fn set_most_samples(&mut self, most: u32) {
        if self.most_samples != most {
            (self.most_samples, self.truth_asked) = (most, None);
        }
    }

    /// The beam to ask for, where there is a new one: from a full picture.
    pub(super) fn next_beam(&mut self) -> Option<BeamJob> {
        let [x, y] = self.beam.place.filter(|_| self.is_still())?;
        let job = self.asked.as_ref()?.id;
        let pane = usize::from(self.compare == Compare::Split && x >= self.divider);
        let at = |share: f32, size: u32| ((share * size as f32) as u32).min(size.saturating_sub(1));
        let pixel = [at(x, self.size[0]), at(y, self.size[1])];
        let wanted = BeamJob {
            job,
            pane,
            pixel,
            axis: self.beam.axis,
            aperture_deg: self.beam.aperture_deg,
        };
        (self.beam.asked.replace(wanted) != Some(wanted)).then_some(wanted)
    }

    /// What suits the scene, where a side asks for it.
    pub(super) fn next_suit(&mut self) -> Option<SuitJob> {
        let mut sides = self.choices.iter_mut().enumerate();
        let (side, choice) = sides.find(|(_, choice)| choice.suit == Suit::Wanted)?;
        choice.suit = Suit::Asked;
        Some(SuitJob {
            side,
            entry: choice.entry,
        })
    }

    /// Takes what suits the scene, unless the side shows another technique by now.
    pub(super) fn take_suited(&mut self, answer: SuitAnswer) {
        let SuitAnswer { of, found } = answer;
        let choice = &mut self.choices[of.side];
        if choice.suit != Suit::Asked || choice.entry.name != of.entry.name {
            return;
        }
        match found {
            Ok(Some(suited)) => {
                if let Some(resolution) = choice.take_suited(suited) {
                    self.shadows.resolution = resolution;
                }
            }
            Ok(None) => choice.suit = Suit::Said("nothing of it depends on the scene".to_owned()),
            Err(problem) => choice.suit = Suit::Said(problem),
        }
    }

    /// What the simulator is to be asked for, where the left technique has one.
    pub(super) fn next_orders(&mut self) -> Vec<Order> {
        let Some(row) = self.choices[0].entry.simulator else {
            return Vec::new();
        };
        if let Err(error) = self.simulator.choose(row) {
            self.problem = Some(error.to_string());
        }
        self.simulator.next_orders(&self.scene, &self.lights)
    }

    /// The beam that came back, where there is to be one and it is from what is shown.
    pub(super) fn traced(&self) -> Option<&BeamAnswer> {
        let job = self.asked.as_ref()?.id;
        self.beam
            .answer
            .as_ref()
            .filter(|answer| self.beam.place.is_some() && answer.of.job == job)
    }

    /// Asks for everything anew: the shaders changed.
    pub(super) fn forget_asked(&mut self) {
        if let Some(asked) = &mut self.asked {
            // No job has this size, so that the next one counts as new.
            asked.size = [0; 2];
        }
    }

    /// Takes a picture that came back.
    pub(super) fn receive(&mut self, picture: Picture) {
        let pane = picture.pane.min(1);
        if let Some(build) = &picture.build {
            self.builds[pane] = Some(build.total_ms());
        }
        let times = &mut self.history[pane];
        if picture.is_full {
            times.push_back(picture.stats.total_ms() as f32);
            times.drain(..times.len().saturating_sub(HISTORY));
        }
        if self.asked.as_ref().is_some_and(|job| job.id == picture.job) {
            self.problem = None;
        }
        self.pictures += 1;
        self.newest[pane] = Some(Newest {
            picture,
            version: self.pictures,
        });
    }

    /// Takes the numbers of a picture that is shown already.
    pub(super) fn take_numbers(&mut self, (pane, job): (usize, u64), image: Image) {
        let newest = self.newest[pane.min(1)].as_mut();
        if let Some(newest) = newest.filter(|newest| newest.picture.job == job) {
            newest.picture.image = Some(image);
        }
    }

    /// How many pictures came back.
    pub(super) fn pictures(&self) -> u64 {
        self.pictures
    }

    /// The number of the job that is asked for; another one with every change.
    pub(super) fn asked_job(&self) -> Option<u64> {
        self.asked.as_ref().map(|job| job.id)
    }

    /// Whether nothing is left to do: all sides show the full picture of what is asked for, and the
    /// settings are possible.
    pub(super) fn is_still(&self) -> bool {
        let Some(asked) = self.asked.as_ref().filter(|job| job.rest) else {
            return false;
        };
        let done = |newest: &Option<Newest>| {
            newest
                .as_ref()
                .is_some_and(|newest| newest.picture.job == asked.id && newest.picture.is_whole())
        };
        asked.size == self.size && self.newest[..asked.panes.len()].iter().all(done)
    }

    /// What is wrong, the scene first.
    pub(super) fn any_problem(&self) -> Option<&String> {
        self.scene_problem.as_ref().or(self.problem.as_ref())
    }

    /// That, or else why a shader was not taken.
    pub(super) fn any_error(&self) -> Option<&String> {
        let shader = self.shader.as_ref();
        self.any_problem()
            .or(shader.and_then(|told| told.as_ref().err()))
    }

    /// Whether something failed for good.
    pub(super) fn has_failed(&self) -> bool {
        self.problem.is_some()
    }

    /// Whether a picture of the job that is asked for is at rest although its view is not there.
    pub(super) fn view_name(&self) -> &'static str {
        VIEWS[self.view].name
    }

    /// Whether the full light is shown, whose components can be switched off.
    pub(super) fn shows_light(&self) -> bool {
        VIEWS[self.view].source == super::views::Source::Aov(Aov::Full)
    }
}

/// Whether two jobs want the same pictures.
fn same(a: &Job, b: &Job) -> bool {
    let same_pane = |(a, b): (&PaneJob, &PaneJob)| {
        a.entry.name == b.entry.name
            && a.settings == b.settings
            && a.view == b.view
            && a.layer == b.layer
            && a.components == b.components
    };
    let same_scene = a.scene.0 == b.scene.0
        && *a.lights == *b.lights
        && a.environment == b.environment
        && a.camera == b.camera;
    let same_size = a.size == b.size && a.shadows == b.shadows && a.continuous == b.continuous;
    same_scene
        && same_size
        && a.panes.len() == b.panes.len()
        && a.panes.iter().zip(&b.panes).all(same_pane)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gi::registry::all;

    /// Those of the stages that all techniques share, too.
    #[test]
    fn settings_that_are_given_are_kept() -> Result<(), SettingError> {
        let with_history = |entry: &&Entry| entry.all_settings().any(|s| s.name == "history");
        for entry in all().into_iter().filter(with_history) {
            let choice = Choice::new(entry, None, &["history = 8".to_owned()])?;
            assert_eq!(choice.pairs(), ["history=8"], "{}", entry.name);
        }
        Ok(())
    }
}
