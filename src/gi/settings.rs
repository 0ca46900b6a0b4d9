//! Settings of techniques: named values with units, ranges and defaults.

use std::collections::BTreeMap;
use std::fmt;

/// Name of the setting that says how fine a technique divides space: cells along the largest extent
/// of the scene, or of its finest level. A technique that has one takes part in sweeps over
/// resolutions.
pub const RESOLUTION: &str = "resolution";

/// What values a setting takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Domain {
    /// A whole number in a closed range.
    Count {
        /// Smallest value that is accepted.
        min: u32,
        /// Largest value that is accepted.
        max: u32,
    },
    /// One of some whole numbers.
    OneOf(&'static [u32]),
    /// A real number in a closed range.
    Number {
        /// Smallest value that is accepted, in the setting's unit.
        min: f32,
        /// Largest value that is accepted, in the setting's unit.
        max: f32,
    },
    /// One of some words.
    Choice(&'static [&'static str]),
}

/// One setting of a technique: its name, its range and its default.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Name on the command line.
    pub name: &'static str,
    /// What it does, in one line.
    pub help: &'static str,
    /// Unit; empty for none.
    pub unit: &'static str,
    /// Possible values.
    pub domain: Domain,
    /// Default, as it would be written on the command line.
    pub default: &'static str,
}

/// What part of a technique a setting is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// How space is divided, and what is kept of the scene there.
    Structure,
    /// How light comes into that, and to what is seen.
    Light,
    /// How a pixel gathers light.
    Gather,
    /// How light goes on from there.
    Bounces,
    /// What pixels share, and what is of the picture alone.
    Screen,
    /// What no rule speaks of.
    Other,
}

impl Group {
    /// In the order in which they are listed.
    pub const ALL: [Group; 6] = [
        Group::Structure,
        Group::Light,
        Group::Gather,
        Group::Bounces,
        Group::Screen,
        Group::Other,
    ];

    /// Its name in lists.
    pub fn name(self) -> &'static str {
        match self {
            Group::Structure => "structure",
            Group::Light => "light",
            Group::Gather => "gather",
            Group::Bounces => "bounces",
            Group::Screen => "screen",
            Group::Other => "other",
        }
    }
}

/// What is said of some settings of a technique. A setting without a rule is in [`Group::Other`]
/// and always applies.
#[derive(Clone, Copy, Debug)]
pub struct Rule {
    /// What they are about.
    pub group: Group,
    /// Their names.
    pub settings: &'static [&'static str],
    /// Whether a change of them can have an effect while the others are as they are.
    pub applies: fn(&Settings) -> bool,
}

impl Rule {
    /// Of settings that apply whatever the others are.
    pub const fn always(group: Group, settings: &'static [&'static str]) -> Self {
        Rule {
            group,
            settings,
            applies: |_| true,
        }
    }
}

/// Names of settings, and values as they would be written on the command line.
pub type PresetValues = &'static [(&'static str, &'static str)];

/// Named values for some settings; the others keep their defaults.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// Name on the command line.
    pub name: &'static str,
    /// What it is for, in one line.
    pub help: &'static str,
    /// Names and values, in groups.
    pub values: &'static [PresetValues],
}

/// The value of a setting.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum Value {
    /// A whole number.
    Count(u32),
    /// A real number, in the setting's unit.
    Number(f32),
    /// One of the words of [`Domain::Choice`].
    Choice(&'static str),
}

impl fmt::Display for Value {
    /// As it would be written on the command line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Count(count) => write!(f, "{count}"),
            Value::Number(number) => write!(f, "{number}"),
            Value::Choice(word) => write!(f, "{word}"),
        }
    }
}

/// A value as a record has it.
#[derive(serde::Deserialize)]
#[serde(untagged)]
enum Recorded {
    Count(u32),
    Number(f32),
    Choice(String),
}

impl<'de> serde::Deserialize<'de> for Value {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(match Recorded::deserialize(deserializer)? {
            Recorded::Count(value) => Value::Count(value),
            Recorded::Number(value) => Value::Number(value),
            // It stays in memory: a process reads a few records, which have few words.
            Recorded::Choice(value) => Value::Choice(value.leak()),
        })
    }
}

/// A setting or preset that cannot be used as given.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum SettingError {
    /// The text is not KEY=VALUE.
    #[error("--set {0}: write it as KEY=VALUE")]
    NotAPair(String),
    /// There is no such setting.
    #[error("there is no setting {name}; there are: {known}")]
    Unknown {
        /// What was given.
        name: String,
        /// The names of all settings that the technique has.
        known: String,
    },
    /// The value is outside the setting's domain.
    #[error("setting {name}: {value} is not {domain}")]
    Value {
        /// Name of the setting.
        name: String,
        /// What was given.
        value: String,
        /// What is possible.
        domain: String,
    },
    /// The values are not possible together.
    #[error("{0}")]
    Together(String),
    /// There is no such preset.
    #[error("there is no preset {name}; there are: {known}")]
    Preset {
        /// What was given.
        name: String,
        /// The names of all presets that the technique has.
        known: String,
    },
}

/// Names, for a message.
pub(super) fn listed<'n>(names: impl Iterator<Item = &'n str>) -> String {
    let names: Vec<&str> = names.collect();
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}

impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Domain::Count { min, max } => write!(f, "a whole number from {min} to {max}"),
            Domain::OneOf(values) => write!(
                f,
                "one of {}",
                values
                    .iter()
                    .map(u32::to_string)
                    .collect::<Vec<_>>()
                    .join(", ")
            ),
            Domain::Number { min, max } => write!(f, "a number from {min} to {max}"),
            Domain::Choice(words) => write!(f, "one of {}", words.join(", ")),
        }
    }
}

impl Domain {
    fn parse(&self, text: &str) -> Option<Value> {
        match self {
            Domain::Count { min, max } => text
                .parse()
                .ok()
                .filter(|value| (min..=max).contains(&value))
                .map(Value::Count),
            Domain::OneOf(values) => text
                .parse()
                .ok()
                .filter(|value| values.contains(value))
                .map(Value::Count),
            Domain::Number { min, max } => text
                .parse()
                .ok()
                .filter(|value| (min..=max).contains(&value))
                .map(Value::Number),
            Domain::Choice(words) => words
                .iter()
                .find(|word| **word == text)
                .map(|word| Value::Choice(word)),
        }
    }
}

/// The values of all settings of one technique.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    values: BTreeMap<&'static str, Value>,
}

impl Settings {
    /// All defaults, replaced by the preset's values, then by the given `KEY=VALUE` pairs.
    pub fn new<S: AsRef<str>>(
        table: &[&[Setting]],
        presets: &[Preset],
        preset: Option<&str>,
        pairs: &[S],
    ) -> Result<Self, SettingError> {
        let mut settings = Settings {
            values: BTreeMap::new(),
        };
        for setting in table.iter().copied().flatten() {
            settings.set(table, setting.name, setting.default)?;
        }
        if let Some(name) = preset {
            let known = || listed(presets.iter().map(|preset| preset.name));
            let preset = presets
                .iter()
                .find(|preset| preset.name == name)
                .ok_or_else(|| SettingError::Preset {
                    name: name.to_owned(),
                    known: known(),
                })?;
            for (name, value) in preset.values.iter().copied().flatten() {
                settings.set(table, name, value)?;
            }
        }
        for pair in pairs {
            let (name, value) = pair
                .as_ref()
                .split_once('=')
                .ok_or_else(|| SettingError::NotAPair(pair.as_ref().to_owned()))?;
            settings.set(table, name.trim(), value.trim())?;
        }
        Ok(settings)
    }

    fn set(&mut self, table: &[&[Setting]], name: &str, value: &str) -> Result<(), SettingError> {
        let all = || table.iter().copied().flatten();
        let known = || listed(all().map(|setting| setting.name));
        let setting =
            all()
                .find(|setting| setting.name == name)
                .ok_or_else(|| SettingError::Unknown {
                    name: name.to_owned(),
                    known: known(),
                })?;
        let parsed = setting
            .domain
            .parse(value)
            .ok_or_else(|| SettingError::Value {
                name: name.to_owned(),
                value: value.to_owned(),
                domain: setting.domain.to_string(),
            })?;
        self.values.insert(setting.name, parsed);
        Ok(())
    }

    /// All names and values, sorted by name.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, Value)> {
        self.values.iter().map(|(name, value)| (*name, *value))
    }

    /// The value of the setting [`RESOLUTION`]; `None` where the technique has none.
    pub fn resolution(&self) -> Option<u32> {
        self.find_count(RESOLUTION)
    }

    /// The value of a whole-number setting; `None` where the technique has none of this name.
    pub fn find_count(&self, name: &str) -> Option<u32> {
        match self.values.get(name) {
            Some(Value::Count(value)) => Some(*value),
            _ => None,
        }
    }

    /// The value of a whole-number setting that the technique has.
    pub fn count(&self, name: &str) -> u32 {
        match self.values.get(name) {
            Some(Value::Count(value)) => *value,
            other => unreachable!("setting {name} is {other:?}, not a whole number"),
        }
    }

    /// The value of a real-number setting; `None` where the technique has none of this name.
    pub fn find_number(&self, name: &str) -> Option<f32> {
        match self.values.get(name) {
            Some(Value::Number(value)) => Some(*value),
            _ => None,
        }
    }

    /// The value of a real-number setting that the technique has.
    pub fn number(&self, name: &str) -> f32 {
        match self.values.get(name) {
            Some(Value::Number(value)) => *value,
            other => unreachable!("setting {name} is {other:?}, not a number"),
        }
    }

    /// Whether a word setting that the technique has is `word`.
    pub fn is(&self, name: &str, word: &str) -> bool {
        self.choice(name) == word
    }

    /// The value of a word setting; `None` where the technique has none of this name.
    pub fn find_choice(&self, name: &str) -> Option<&'static str> {
        match self.values.get(name) {
            Some(Value::Choice(value)) => Some(value),
            _ => None,
        }
    }

    /// The value of a word setting that the technique has.
    pub fn choice(&self, name: &str) -> &'static str {
        match self.values.get(name) {
            Some(Value::Choice(value)) => value,
            other => unreachable!("setting {name} is {other:?}, not a word"),
        }
    }
}
