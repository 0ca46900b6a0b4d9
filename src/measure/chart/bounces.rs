//! What a number of bounces leaves out of the full solution, and which setting adds it.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::pictures::PictureFolder;
use super::point::{Point, SweepSetup};
use super::run::SweepError;
use crate::gi::entry::Entry;
use crate::gi::settings::{Domain, Setting, Settings};
use crate::measure::bench::Truth;
use crate::measure::table::value_text;
use crate::metrics::compare;
use crate::reference::{Bounces, ReferenceError, ReferenceImage, cached};
use crate::scene::Scene;

/// What a reference lacks that has fewer than all bounces.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Indirect bounces of the reference.
    pub bounces: Bounces,
    /// mean(R − F) / mean F of the indirect light: R has these bounces, F has all of them.
    pub bias: f64,
}

/// The setting of a technique that adds bounces.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BounceSetting {
    /// Its name.
    pub name: &'static str,
    /// The values with which the technique computes more bounces.
    pub values: Vec<String>,
}

impl BounceSetting {
    /// The first setting that makes a technique compute more bounces than with `settings`; `None`
    /// if it computes all, or has no such setting.
    pub fn of(entry: &Entry, settings: &Settings) -> Option<Self> {
        let now = (entry.bounces)(settings)?;
        let pair = |name: &str, value: &str| format!("{name}={value}");
        let has_more = |name: &'static str, value: &str| {
            let mut pairs: Vec<String> = settings
                .iter()
                .map(|(name, value)| pair(name, &value_text(&value)))
                .collect();
            pairs.push(pair(name, value));
            entry
                .settings(None, &pairs)
                .is_ok_and(|changed| (entry.bounces)(&changed).is_none_or(|count| count > now))
        };
        let all = entry.all_settings();
        all.map(|setting| BounceSetting {
            name: setting.name,
            values: ends(setting)
                .into_iter()
                .filter(|value| has_more(setting.name, value))
                .collect(),
        })
        .find(|setting| !setting.values.is_empty())
    }
}

/// All values of a setting, or the ends of its range.
fn ends(setting: &Setting) -> Vec<String> {
    match setting.domain {
        Domain::Count { min, max } => vec![min.to_string(), max.to_string()],
        Domain::OneOf(values) => values.iter().map(u32::to_string).collect(),
        Domain::Number { min, max } => vec![min.to_string(), max.to_string()],
        Domain::Choice(words) => words.iter().map(|word| (*word).to_owned()).collect(),
    }
}

/// The numbers of bounces at which points were judged, without those that have all; none where
/// visibility is compared.
pub(super) fn judged(points: &[Point]) -> Vec<Bounces> {
    let mut bounces: Vec<Bounces> = points
        .iter()
        .filter(|point| point.error.is_some() && point.setup.visibility.is_none())
        .filter(|point| point.bounces != Bounces::Full)
        .map(|point| point.bounces)
        .collect();
    bounces.sort();
    bounces.dedup();
    bounces
}

/// Measures what is left out at each number of bounces at which points of one setup were judged,
/// unless the folder of pictures says it already. `cache` is the folder of references; `progress`
/// is told before a full reference is rendered.
pub fn measure_left_out(
    scene: &Scene,
    points: &[Point],
    cache: &Path,
    pictures: &PictureFolder,
    progress: &mut dyn FnMut(),
) -> Result<(), SweepError> {
    let Some(setup) = points.first().map(|point| &point.setup) else {
        return Ok(());
    };
    let missing: Vec<Bounces> = judged(points)
        .into_iter()
        .filter(|bounces| pictures.left_out(setup, *bounces).is_none())
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    progress();
    let full = reference(scene, setup, Bounces::Full, cache)?;
    for bounces in missing {
        let some = reference(scene, setup, bounces, cache)?;
        let comparison = compare(
            &some.indirect(),
            &full.indirect(),
            Some(&full.guide),
            setup.channel,
        )?;
        let bias = comparison.block.unwrap_or(comparison.pixel).bias;
        if bias.is_finite() {
            pictures.write_left_out(setup, &LeftOut { bounces, bias })?;
        }
    }
    Ok(())
}

fn reference(
    scene: &Scene,
    setup: &SweepSetup,
    bounces: Bounces,
    cache: &Path,
) -> Result<ReferenceImage, ReferenceError> {
    let settings = Truth::settings(setup.size, bounces, setup.max_error, setup.visibility);
    cached(scene, &settings, cache, &|_| {})
}

#[cfg(test)]
mod tests {
    use super::super::point::tests::point;
    use super::*;
    use crate::gi::registry::find;

    /// The setting is found by what it does to the count, whatever its name; a technique that
    /// computes all bounces needs none, and one without settings has none.
    #[test]
    fn the_setting_that_adds_bounces_is_found() -> Result<(), Box<dyn std::error::Error>> {
        let setting = |technique: &str, pairs: &[&str]| -> Result<_, Box<dyn std::error::Error>> {
            let entry = find(technique)?;
            Ok(BounceSetting::of(entry, &entry.settings(None, pairs)?))
        };
        let values = |found: Option<BounceSetting>| found.map(|found| found.values.join(" "));
        assert_eq!(
            setting("svo", &[])?,
            Some(BounceSetting {
                name: "bounces",
                values: ["2", "3", "4", "feedback"].map(str::to_owned).to_vec(),
            })
        );
        assert_eq!(
            values(setting("svo", &["bounces=3"])?).as_deref(),
            Some("4 feedback")
        );
        assert_eq!(setting("svo", &["bounces=feedback"])?, None);
        assert_eq!(setting("none", &[])?, None);
        Ok(())
    }

    /// Points without an error were judged at nothing, and all bounces leave nothing out.
    #[test]
    fn only_what_was_judged_is_asked_for() {
        let mut points = [2, 1, 1, 0].map(|bounces| point("a", bounces, [9.0, 1.0], 1, 0.1));
        points[3].error = None;
        assert_eq!(judged(&points), [Bounces::Count(1), Bounces::Count(2)]);
        points[0].bounces = Bounces::Full;
        assert_eq!(judged(&points), [Bounces::Count(1)]);
    }
}
