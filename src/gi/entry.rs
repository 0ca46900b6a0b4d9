//! What the program knows of a technique before it is made: a row of the registry.

use super::inspect::ViewRow;
use super::settings::{Group, Preset, Rule, Setting, SettingError, Settings};
use super::shared::screen::settings::{self as screen, ScreenSettings};
use super::simulator::SimulatorRow;
use super::{Context, StoreKind, Technique, Wanted};
use crate::graph::{Error, Pass};
use crate::shader::StructLayout;

/// One technique. [`Entry::new`] is one with the least: no settings, and nothing to look at.
pub struct Entry {
    /// Name on the command line.
    pub name: &'static str,
    /// What it is, in one line.
    pub summary: &'static str,
    /// Number of indirect bounces that it computes with these settings, `None` for all of them; it
    /// is compared with the reference at this count.
    pub bounces: fn(&Settings) -> Option<u32>,
    /// Frames, at least 1, until a picture of what stands still has all its light: more than one
    /// where each frame's store goes on from the one before.
    pub frames_to_rest: fn(&Settings) -> u32,
    /// Its own settings, in groups; [`Entry::all_settings`] has those of all techniques too.
    pub settings: &'static [&'static [Setting]],
    /// What its settings are about, and when they have an effect, in groups.
    pub rules: &'static [&'static [Rule]],
    /// Whether values of settings are possible together.
    pub check: fn(&Settings) -> Result<(), SettingError>,
    /// Its presets; the first is the default.
    pub presets: &'static [Preset],
    /// The passes that it may run, in groups.
    pub passes: &'static [&'static [&'static Pass]],
    /// The structs that it shares with shaders, but for the parameters of passes, in groups.
    pub structs: &'static [&'static [StructLayout]],
    /// What its passes do, as the literature tells it; every pass that it runs is in one stage.
    pub stages: &'static [&'static Stage],
    /// The passes that gather along directions.
    pub directions: &'static [Directions],
    /// The setting that says along how many directions a pixel gathers, with these settings.
    pub directions_setting: fn(&Settings) -> Option<&'static str>,
    /// What an error budget tries in place of parts of it, in groups.
    pub substitutions: &'static [&'static [Substitution]],
    /// `KEY=VALUE` pairs with which [`super::Inspect::light_slots`] hold the light of surfaces that
    /// emit too; none where they do already.
    pub emission_in_slots: fn(&Settings) -> Vec<String>,
    /// What suits a scene, where the user leaves the choice.
    pub suit: Suit,
    /// The views that it has of itself, in groups; which of them are there depends on the settings.
    pub views: &'static [&'static [ViewRow]],
    /// How others use its store, where it lends that.
    pub lends: Option<Lends>,
    /// It may use the stores of others.
    pub borrows: bool,
    /// Its method on the CPU, to be watched step by step.
    pub simulator: Option<&'static SimulatorRow>,
    /// Makes it.
    pub make: Make,
}

/// What a stage makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Part {
    /// The world-space store: what a technique builds, and what it updates for the light.
    Store,
    /// The picture of the indirect light.
    Picture,
    /// What all techniques share.
    Shared,
}

/// A step of a technique, and the passes that it is made of.
#[derive(Debug, PartialEq, Eq)]
pub struct Stage {
    /// What it is called; stages that techniques share have one name.
    pub name: &'static str,
    /// What it makes.
    pub part: Part,
    /// Names of its passes, clears and copies too.
    pub passes: &'static [&'static str],
}

impl Stage {
    /// A step that makes the store.
    pub const fn store(name: &'static str, passes: &'static [&'static str]) -> Self {
        let part = Part::Store;
        Stage { name, part, passes }
    }

    /// A step that makes the picture.
    pub const fn picture(name: &'static str, passes: &'static [&'static str]) -> Self {
        let part = Part::Picture;
        Stage { name, part, passes }
    }
}

/// How many directions a pass gathers along, so that its time can be told by the direction.
#[derive(Clone, Copy)]
pub struct Directions {
    /// The pass.
    pub pass: &'static Pass,
    /// How many at each pixel with a surface; `None` is one at each pixel with a glossy surface.
    pub count: Option<fn(&Settings) -> u32>,
}

/// An approximation of a technique that its own settings can replace by a better one, so that the
/// error that goes with it can be told apart.
pub struct Substitution {
    /// What is replaced.
    pub name: &'static str,
    /// By what, in one line.
    pub help: &'static str,
    /// `KEY=VALUE` pairs to set on top of these settings; none where it is as good already.
    pub pairs: fn(&Settings) -> Vec<String>,
}

/// What a technique chooses for a scene, and what it would need beyond that.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Suited {
    /// `KEY=VALUE` pairs on top of the default preset.
    pub pairs: Vec<String>,
    /// Width and height of each light map (texels); `None` for the default.
    pub shadow_resolution: Option<u32>,
    /// What of the scene the choice was made by, in words.
    pub because: String,
    /// What is not right all the same, and what it would need; `None` where all is.
    pub needs: Option<String>,
}

/// Chooses settings for a scene, by what it measures there, beside the pairs that are set already;
/// `None` where nothing depends on scenes.
pub type Suit = fn(&Context<'_>, &[String]) -> Result<Option<Suited>, Error>;

/// What the last of some `KEY=VALUE` pairs with this key says.
pub fn value_of<'a>(pairs: &'a [String], key: &str) -> Option<&'a str> {
    let named = |pair: &'a String| {
        let (name, value) = pair.split_once('=')?;
        (name.trim() == key).then_some(value.trim())
    };
    pairs.iter().rev().find_map(named)
}

/// A store that a technique lends to others.
#[derive(Clone, Copy)]
pub struct Lends {
    /// How it divides space.
    pub kind: StoreKind,
    /// `KEY=VALUE` pairs with which it is as another technique wants it.
    pub pairs: fn(&Wanted) -> Vec<String>,
}

/// Makes a technique with these settings.
pub type Make = fn(&Context<'_>, &Settings) -> Result<Box<dyn Technique>, Error>;

impl Entry {
    /// A technique of one bounce, whose picture is done after one frame.
    pub const fn new(name: &'static str, summary: &'static str, make: Make) -> Self {
        Entry {
            name,
            summary,
            bounces: |_| Some(1),
            frames_to_rest: |_| 1,
            settings: &[],
            rules: &[],
            check: |_| Ok(()),
            presets: &[],
            passes: &[],
            structs: &[],
            stages: &[],
            directions: &[],
            directions_setting: |_| None,
            substitutions: &[],
            emission_in_slots: |_| Vec::new(),
            suit: |_, _| Ok(None),
            views: &[],
            lends: None,
            borrows: false,
            simulator: None,
            make,
        }
    }

    /// Its settings and those of the stages that every technique has; none where it has none of its
    /// own, as it makes no light then.
    pub fn all_settings(&self) -> impl Iterator<Item = &'static Setting> {
        self.tables().into_iter().flatten()
    }

    fn tables(&self) -> Vec<&'static [Setting]> {
        let mut tables = self.settings.to_vec();
        if tables.iter().any(|table| !table.is_empty()) {
            tables.push(screen::SETTINGS);
        }
        tables
    }

    /// Frames, at least 1, until a picture of what stands still is as it stays.
    pub fn rest(&self, settings: &Settings) -> u32 {
        (self.frames_to_rest)(settings).max(self.screen(settings).frames_to_rest())
    }

    /// How the stages that every technique has are run.
    pub fn screen(&self, settings: &Settings) -> ScreenSettings {
        let directions =
            (self.directions_setting)(settings).filter(|name| self.applies(name, settings));
        ScreenSettings::new(
            settings,
            directions.and_then(|name| settings.find_count(name)),
        )
    }

    /// The view of a name, or of an alias.
    pub fn view(&self, name: &str) -> Option<&'static ViewRow> {
        let mut views = self.views.iter().copied().flatten();
        views.find(|view| view.name == name || view.aliases.contains(&name))
    }

    fn rule(&self, setting: &str) -> Option<&'static Rule> {
        let mut rules = self.rules.iter().copied().flatten().chain(screen::RULES);
        rules.find(|rule| rule.settings.contains(&setting))
    }

    /// The groups that it has settings in, with those settings.
    pub fn groups(&self) -> Vec<(Group, Vec<&'static Setting>)> {
        let in_group = |group: Group| {
            let all = self.all_settings();
            let of = |setting: &&Setting| {
                self.rule(setting.name)
                    .map_or(Group::Other, |rule| rule.group)
                    == group
            };
            (group, all.filter(of).collect::<Vec<_>>())
        };
        let groups = Group::ALL.into_iter().map(in_group);
        groups.filter(|(_, all)| !all.is_empty()).collect()
    }

    /// Whether a change of this setting can have an effect with these settings.
    pub fn applies(&self, setting: &str, settings: &Settings) -> bool {
        self.rule(setting)
            .is_none_or(|rule| (rule.applies)(settings))
    }

    /// The names in `KEY=VALUE` pairs whose settings have no effect with these settings.
    pub fn without_effect<'p>(&self, pairs: &'p [String], settings: &Settings) -> Vec<&'p str> {
        let mut idle = Vec::new();
        for name in pairs.iter().filter_map(|pair| pair.split('=').next()) {
            if !idle.contains(&name.trim()) && !self.applies(name.trim(), settings) {
                idle.push(name.trim());
            }
        }
        idle
    }

    /// The default preset, or the named one, with `KEY=VALUE` pairs on top.
    pub fn settings<S: AsRef<str>>(
        &self,
        preset: Option<&str>,
        pairs: &[S],
    ) -> Result<Settings, SettingError> {
        let settings = Settings::new(
            &self.tables(),
            self.presets,
            preset.or(self.presets.first().map(|preset| preset.name)),
            pairs,
        )?;
        (self.check)(&settings).map(|()| settings)
    }
}
