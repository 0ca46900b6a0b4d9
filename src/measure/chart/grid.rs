//! Grids: which techniques are measured with which settings.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use crate::gi::entry::Entry;
use crate::gi::registry::{all, find};
use crate::gi::settings::SettingError;
use crate::measure::bench::Case;

/// The grid of `lumivox chart` without `--grid`.
pub const DEFAULT_GRID: &str = include_str!("default.toml");

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GridToml {
    sweep: Vec<BlockToml>,
}

/// One block: the product of techniques, presets and values.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BlockToml {
    /// Absent: all that have a setting at all, and the settings and presets that are named here.
    technique: Option<Vec<Spanned<String>>>,
    /// Absent: all of each technique.
    preset: Option<Vec<Spanned<String>>>,
    #[serde(default)]
    set: BTreeMap<Spanned<String>, Spanned<Vec<Spanned<toml::Value>>>>,
}

/// A grid that cannot be used, and the line that is wrong.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("{origin}:{line}: {problem}")]
pub struct GridError {
    origin: String,
    line: usize,
    problem: String,
}

struct Reader<'t> {
    origin: &'t str,
    text: &'t str,
}

/// All cases of a grid, in its order; those that two blocks share are there once. `origin` names
/// the file in errors.
pub fn grid_cases(origin: &str, text: &str) -> Result<Vec<Case>, GridError> {
    let reader = Reader { origin, text };
    let grid: GridToml = toml::from_str(text)
        .map_err(|error| reader.error(error.span().unwrap_or(0..0), error.message().to_owned()))?;
    let mut cases: Vec<Case> = Vec::new();
    for block in &grid.sweep {
        for case in reader.block(block)? {
            if !cases.iter().any(|known| {
                std::ptr::eq(known.entry, case.entry) && known.settings == case.settings
            }) {
                cases.push(case);
            }
        }
    }
    if cases.is_empty() {
        return Err(reader.error(
            0..0,
            "there is no [[sweep]] with a technique and a preset, so that there is nothing to \
             measure"
                .to_owned(),
        ));
    }
    Ok(cases)
}

impl Reader<'_> {
    fn error(&self, span: Range<usize>, problem: impl Into<String>) -> GridError {
        let before = self.text.get(..span.start).unwrap_or("");
        GridError {
            origin: self.origin.to_owned(),
            line: 1 + before.matches('\n').count(),
            problem: problem.into(),
        }
    }

    fn block(&self, block: &BlockToml) -> Result<Vec<Case>, GridError> {
        let entries = self.techniques(block)?;
        let choices = self.choices(block, &entries)?;
        let mut cases = Vec::new();
        for entry in entries {
            let presets: Vec<Option<&str>> = match &block.preset {
                Some(presets) => presets
                    .iter()
                    .map(|preset| Some(preset.get_ref().as_str()))
                    .collect(),
                None if entry.presets.is_empty() => vec![None],
                None => entry
                    .presets
                    .iter()
                    .map(|preset| Some(preset.name))
                    .collect(),
            };
            for preset in presets {
                for pairs in product(&choices) {
                    let named = || {
                        [
                            &[entry.name],
                            preset.as_slice(),
                            &pairs.iter().map(String::as_str).collect::<Vec<_>>(),
                        ]
                        .concat()
                        .join(" ")
                    };
                    let settings_of = |pairs: &[String]| {
                        entry.settings(preset, pairs).map_err(|error| {
                            self.error(start(block), format!("{}: {error}", named()))
                        })
                    };
                    // What has no effect beside the rest makes no point of its own.
                    let all = settings_of(&pairs)?;
                    let idle = entry.without_effect(&pairs, &all);
                    let has_effect = |pair: &&String| {
                        pair.split('=')
                            .next()
                            .is_none_or(|name| !idle.contains(&name))
                    };
                    let kept: Vec<String> = pairs.iter().filter(has_effect).cloned().collect();
                    let settings = settings_of(&kept)?;
                    cases.push(Case {
                        entry,
                        preset: preset.map(str::to_owned),
                        settings,
                    });
                }
            }
        }
        Ok(cases)
    }

    /// The techniques that a block names, or all that have what it names. A name that no technique
    /// has, or that a named technique lacks, is an error.
    fn techniques(&self, block: &BlockToml) -> Result<Vec<&'static Entry>, GridError> {
        let named = |name: &Spanned<String>| {
            find(name.get_ref()).map_err(|error| self.error(name.span(), error.to_string()))
        };
        let mut left: Vec<&'static Entry> = match &block.technique {
            Some(names) => names.iter().map(named).collect::<Result<_, _>>()?,
            None => all()
                .into_iter()
                .filter(|entry| entry.settings.iter().any(|group| !group.is_empty()))
                .collect(),
        };
        let settings = block
            .set
            .keys()
            .map(|name| (name, "setting", has_setting as fn(&Entry, &str) -> bool));
        let presets = block
            .preset
            .iter()
            .flatten()
            .map(|name| (name, "preset", has_preset as fn(&Entry, &str) -> bool));
        for (name, what, has) in settings.chain(presets) {
            let (have, lack): (Vec<&'static Entry>, Vec<&'static Entry>) = left
                .iter()
                .copied()
                .partition(|entry| has(entry, name.get_ref()));
            match lack.first() {
                Some(entry) if block.technique.is_some() => {
                    return Err(self.error(
                        name.span(),
                        format!(
                            "the technique {} has no {what} {}; see lumivox techniques",
                            entry.name,
                            name.get_ref()
                        ),
                    ));
                }
                _ if have.is_empty() => {
                    return Err(self.error(
                        name.span(),
                        format!(
                            "no technique has the {what} {} beside what stands before it; see \
                             lumivox techniques",
                            name.get_ref()
                        ),
                    ));
                }
                _ => left = have,
            }
        }
        Ok(left)
    }

    /// The settings and their values, as they would be written on the command line; each is one
    /// that every technique of the block takes.
    fn choices(
        &self,
        block: &BlockToml,
        entries: &[&Entry],
    ) -> Result<Vec<Vec<String>>, GridError> {
        let pair = |name: &str, value: &Spanned<toml::Value>| {
            let text = match value.get_ref() {
                toml::Value::String(word) => word.clone(),
                toml::Value::Integer(number) => number.to_string(),
                toml::Value::Float(number) => number.to_string(),
                other => {
                    return Err(self.error(
                        value.span(),
                        format!("setting {name}: {other} is neither a number nor a word"),
                    ));
                }
            };
            let pair = format!("{name}={text}");
            for entry in entries {
                match entry.settings(None, &[&pair]) {
                    // Others in the block may make it possible.
                    Ok(_) | Err(SettingError::Together(_)) => {}
                    Err(error) => {
                        return Err(self.error(value.span(), format!("{}: {error}", entry.name)));
                    }
                }
            }
            Ok(pair)
        };
        let values =
            |(name, values): (&Spanned<String>, &Spanned<Vec<Spanned<toml::Value>>>)| match values
                .get_ref()
                .as_slice()
            {
                [] => Err(self.error(
                    values.span(),
                    format!(
                        "setting {}: the list is empty; give a value or leave the setting out",
                        name.get_ref()
                    ),
                )),
                list => list
                    .iter()
                    .map(|value| pair(name.get_ref(), value))
                    .collect(),
            };
        block.set.iter().map(values).collect()
    }
}

fn has_setting(entry: &Entry, name: &str) -> bool {
    entry.all_settings().any(|setting| setting.name == name)
}

fn has_preset(entry: &Entry, name: &str) -> bool {
    entry.presets.iter().any(|preset| preset.name == name)
}

/// Where a block's settings start.
fn start(block: &BlockToml) -> Range<usize> {
    block
        .set
        .keys()
        .map(Spanned::span)
        .min_by_key(|span| span.start)
        .unwrap_or(0..0)
}

/// One of each list, in every combination; the last list changes fastest.
fn product(choices: &[Vec<String>]) -> Vec<Vec<String>> {
    let longer = |all: Vec<Vec<String>>, choice: &Vec<String>| {
        all.iter()
            .flat_map(|before| {
                choice
                    .iter()
                    .map(|value| before.iter().cloned().chain([value.clone()]).collect())
            })
            .collect()
    };
    choices.iter().fold(vec![Vec::new()], longer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gi::registry::TECHNIQUES;

    fn problem(text: &str) -> String {
        grid_cases("grid.toml", text)
            .err()
            .map(|error| error.to_string())
            .unwrap_or_default()
    }

    /// All presets of all techniques, with more than the sixty points that a chart is expected to
    /// have, and none twice.
    #[test]
    fn the_default_grid_covers_every_technique() -> Result<(), GridError> {
        let cases = grid_cases("default.toml", DEFAULT_GRID)?;
        assert!(cases.len() >= 60, "{}", cases.len());
        for entry in TECHNIQUES.iter().filter(|entry| !entry.presets.is_empty()) {
            for preset in entry.presets {
                assert!(
                    cases.iter().any(|case| std::ptr::eq(case.entry, *entry)
                        && case.preset.as_deref() == Some(preset.name)),
                    "{} {}",
                    entry.name,
                    preset.name
                );
            }
        }
        for (index, case) in cases.iter().enumerate() {
            assert!(!cases[..index].iter().any(
                |known| known.entry.name == case.entry.name && known.settings == case.settings
            ));
        }
        Ok(())
    }

    /// Lobes have no directions, and rays no cones.
    #[test]
    fn what_has_no_effect_makes_no_point() -> Result<(), GridError> {
        let text = r#"
            [[sweep]]
            technique = ["lpv"]
            preset = ["textbook", "accurate"]
            set = { resolution = [16], directions = [24, 48] }"#;
        let cases = grid_cases("grid.toml", text)?;
        let found: Vec<_> = cases
            .iter()
            .map(|case| (case.preset.as_deref(), case.settings.count("directions")))
            .collect();
        assert_eq!(
            found,
            [
                (Some("textbook"), 0),
                (Some("accurate"), 24),
                (Some("accurate"), 48)
            ]
        );
        Ok(())
    }

    #[test]
    fn stages_that_all_techniques_share_are_swept() -> Result<(), GridError> {
        let text = r#"
            [[sweep]]
            technique = ["svo"]
            preset = ["cones"]
            set = { history = [0, 8] }"#;
        let mut frames: Vec<u32> = grid_cases("grid.toml", text)?
            .iter()
            .map(|case| case.settings.count("history"))
            .collect();
        frames.dedup();
        assert_eq!(frames, [0, 8]);
        Ok(())
    }

    #[test]
    fn a_block_is_a_product() -> Result<(), GridError> {
        let text = r#"
            [[sweep]]
            technique = ["svo", "voxel-mips"]
            preset = ["cones"]
            set = { resolution = [16, 32], step_factor = [0.5, 1, 2], bounces = [2] }
            [[sweep]]
            technique = ["none"]
            [[sweep]]
            technique = ["svo"]
            preset = ["cones"]
            set = { resolution = [16], step_factor = [2.0], bounces = ["2"] }"#;
        let cases = grid_cases("grid.toml", text)?;
        assert_eq!(
            cases.iter().map(|case| case.entry.name).collect::<Vec<_>>(),
            [["svo"; 6], ["voxel-mips"; 6]]
                .concat()
                .into_iter()
                .chain(["none"])
                .collect::<Vec<_>>()
        );
        let values: Vec<(u32, f32)> = cases[..6]
            .iter()
            .map(|case| {
                (
                    case.settings.count("resolution"),
                    case.settings.number("step_factor"),
                )
            })
            .collect();
        assert_eq!(
            values,
            [
                (16, 0.5),
                (16, 1.0),
                (16, 2.0),
                (32, 0.5),
                (32, 1.0),
                (32, 2.0)
            ]
        );
        assert!(
            cases[..12]
                .iter()
                .all(|case| case.settings.is("bounces", "2"))
        );
        Ok(())
    }

    #[test]
    fn errors_name_the_line() {
        let cases = [
            ("", "grid.toml:1: missing field `sweep`"),
            (
                "sweep = []",
                "grid.toml:1: there is no [[sweep]] with a technique",
            ),
            (
                "[[sweep]]\nresolution = [1]",
                "grid.toml:2: unknown field `resolution`",
            ),
            (
                "[[sweep]]\n\ntechnique = [\"svo\",\n\"raster\"]",
                "grid.toml:4: there is no technique raster",
            ),
            (
                "[[sweep]]\ntechnique = [\"svo\"]\npreset = [\"nice\"]",
                "grid.toml:3: the technique svo has no preset nice",
            ),
            (
                "[[sweep]]\ntechnique = [\"svo\"]\n[sweep.set]\ncones = [6]\nlevels = [4]",
                "grid.toml:5: the technique svo has no setting levels",
            ),
            (
                "[[sweep]]\n[sweep.set]\ncones = [6]\nfingers = [4]",
                "grid.toml:4: no technique has the setting fingers",
            ),
            (
                "[[sweep]]\n[sweep.set]\ncones = [6,\n7]",
                "grid.toml:4: voxel-mips: setting cones: 7 is not one of",
            ),
            (
                "[[sweep]]\n[sweep.set]\ncones = 6",
                "grid.toml:3: invalid type: integer `6`",
            ),
            (
                "[[sweep]]\n[sweep.set]\ncones = []",
                "grid.toml:3: setting cones: the list is empty",
            ),
            (
                "[[sweep]]\n[sweep.set]\ncones = [true]",
                "grid.toml:3: setting cones: true is neither",
            ),
            ("[[sweep]]\ncones = [", "grid.toml:2: "),
            (
                "[[sweep]]\ntechnique = [\"svo\"]\n[sweep.set]\ncone_set = [\"kahl\"]\nkahl_front \
                 = [\"off\"]\nkahl_intermediate = [\"off\"]",
                "grid.toml:4: svo accurate cone_set=kahl kahl_front=off kahl_intermediate=off: ",
            ),
        ];
        cases.iter().for_each(|(text, message)| {
            assert!(
                problem(text).starts_with(message),
                "{:?} for {text:?}",
                problem(text)
            )
        });
    }
}
