//! Candidates of a search, from the cases of a grid, and the cases around one.

use super::candidate::Candidate;
use crate::gi::entry::Entry;
use crate::gi::settings::{Domain, Group, RESOLUTION, Setting, Settings, Value};
use crate::measure::bench::Case;
use crate::measure::chart::bounces_of;
use crate::measure::table::value_text;
use crate::reference::Bounces;

/// A case as the search knows it.
pub fn candidate_of(case: &Case) -> Candidate {
    let Case {
        entry, settings, ..
    } = case;
    let has_effect = |(name, _): &(&str, Value)| entry.applies(name, settings);
    let values = settings.iter().filter(has_effect);
    let amounts = [Some(RESOLUTION), (entry.directions_setting)(settings)];
    let has = |name: &&str| settings.find_count(name).is_some() && entry.applies(name, settings);
    Candidate {
        technique: entry.name.to_owned(),
        preset: case.preset.clone(),
        settings: values
            .map(|(name, value)| (name.to_owned(), value_text(&value)))
            .collect(),
        amounts: amounts
            .into_iter()
            .flatten()
            .filter(has)
            .map(str::to_owned)
            .collect(),
        changes: case.changes().len(),
    }
}

/// The cases of a grid, each with the setting that makes it compute so many bounces. Those that
/// cannot are left out, and what is there twice then is there once.
pub fn cases_at(grid: &[Case], bounces: Bounces) -> Vec<Case> {
    let mut cases: Vec<Case> = Vec::new();
    for case in grid.iter().filter_map(|case| with_bounces(case, bounces)) {
        if !contains(&cases, &case) {
            cases.push(case);
        }
    }
    cases
}

/// Whether a case is among others, whatever its preset is called.
fn contains(cases: &[Case], case: &Case) -> bool {
    let is_same =
        |known: &Case| std::ptr::eq(known.entry, case.entry) && known.settings == case.settings;
    cases.iter().any(is_same)
}

fn with_bounces(case: &Case, bounces: Bounces) -> Option<Case> {
    if bounces_of(case) == bounces {
        return Some(case.clone());
    }
    let groups = case.entry.groups().into_iter();
    let of_bounces = groups.filter(|(group, _)| *group == Group::Bounces);
    let settings = of_bounces.flat_map(|(_, settings)| settings);
    let changed = settings.flat_map(|setting| {
        let values = values(setting).into_iter();
        values.filter_map(|value| with(case, setting.name, &value))
    });
    changed
        .into_iter()
        .find(|changed| bounces_of(changed) == bounces)
}

/// All values of a setting that has few.
fn values(setting: &Setting) -> Vec<String> {
    match setting.domain {
        Domain::Count { min, max } if max - min < 64 => {
            (min..=max).map(|value| value.to_string()).collect()
        }
        Domain::OneOf(values) => values.iter().map(u32::to_string).collect(),
        Domain::Choice(words) => words.iter().map(|word| (*word).to_owned()).collect(),
        Domain::Count { .. } | Domain::Number { .. } => Vec::new(),
    }
}

/// A case with another value of one setting; `None` where the values are not possible together.
fn with(case: &Case, name: &str, value: &str) -> Option<Case> {
    let Case {
        entry,
        preset,
        settings,
    } = case;
    let pair = |name: &str, value: &str| format!("{name}={value}");
    let all = settings
        .iter()
        .map(|(name, value)| pair(name, &value_text(&value)));
    let pairs: Vec<String> = all.chain([pair(name, value)]).collect();
    Some(Case {
        entry,
        preset: preset.clone(),
        settings: entry.settings(preset.as_deref(), &pairs).ok()?,
    })
}

/// The cases that differ from one in a number that has an effect: half and twice as much, or the
/// one before and after in a list. They compute as many bounces, and none is among `known`.
pub fn neighbours(case: &Case, known: &[Case]) -> Vec<Case> {
    let Case {
        entry, settings, ..
    } = case;
    let mut found: Vec<Case> = Vec::new();
    for setting in numbers_with_effect(entry, settings) {
        for value in steps(setting, settings) {
            let Some(changed) = with(case, setting.name, &value) else {
                continue;
            };
            let is_new = !contains(known, &changed) && !contains(&found, &changed);
            if is_new && bounces_of(&changed) == bounces_of(case) {
                found.push(changed);
            }
        }
    }
    found
}

fn numbers_with_effect(
    entry: &'static Entry,
    settings: &Settings,
) -> impl Iterator<Item = &'static Setting> {
    let all = entry.all_settings();
    all.filter(|setting| entry.applies(setting.name, settings))
}

/// The values one step from a setting's own. A 0 has none: it is an off switch.
fn steps(setting: &Setting, settings: &Settings) -> Vec<String> {
    match setting.domain {
        Domain::Count { min, max } => {
            let Some(value) = settings.find_count(setting.name).filter(|value| *value > 0) else {
                return Vec::new();
            };
            let steps = [value / 2, value.saturating_mul(2)].map(|step| step.clamp(min, max));
            let steps = steps.into_iter().filter(|step| *step != value && *step > 0);
            steps.map(|step| step.to_string()).collect()
        }
        Domain::OneOf(values) => {
            let own = settings.find_count(setting.name);
            let Some(place) = values.iter().position(|value| Some(*value) == own) else {
                return Vec::new();
            };
            let places = [place.checked_sub(1), Some(place + 1)]
                .into_iter()
                .flatten();
            let steps = places.filter_map(|place| values.get(place));
            steps
                .filter(|step| **step > 0)
                .map(u32::to_string)
                .collect()
        }
        Domain::Number { min, max } => {
            let Some(value) = settings
                .find_number(setting.name)
                .filter(|value| *value > 0.0)
            else {
                return Vec::new();
            };
            let steps = [0.5 * value, 2.0 * value].map(|step| step.clamp(min, max));
            let steps = steps
                .into_iter()
                .filter(|step| *step != value && *step > 0.0);
            steps.map(|step| step.to_string()).collect()
        }
        Domain::Choice(_) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gi::registry::all;
    use crate::measure::chart::{DEFAULT_GRID, grid_cases};

    fn grid() -> Vec<Case> {
        grid_cases("default", DEFAULT_GRID).unwrap_or_else(|error| panic!("{error}"))
    }

    /// A technique with a setting of bounces takes part at every number of bounces, and no case is
    /// there twice.
    #[test]
    fn the_grid_has_the_bounces_that_are_asked_for() {
        let grid = grid();
        for bounces in [Bounces::Count(1), Bounces::Count(2), Bounces::Full] {
            let cases = cases_at(&grid, bounces);
            assert!(cases.len() > 100, "{bounces:?}: {}", cases.len());
            for (index, case) in cases.iter().enumerate() {
                assert_eq!(bounces_of(case), bounces);
                assert!(!contains(&cases[..index], case));
            }
        }
        let one = cases_at(&grid, Bounces::Count(1));
        let of_grid = grid
            .iter()
            .filter(|case| bounces_of(case) == Bounces::Count(1));
        assert_eq!(one.len(), of_grid.count(), "those of the grid, and no more");
    }

    /// Every default case has neighbours, each with one value changed, which is possible and has an
    /// effect.
    #[test]
    fn neighbours_differ_in_one_number() {
        for entry in all()
            .into_iter()
            .filter(|entry| entry.all_settings().next().is_some())
        {
            let settings = entry.settings::<&str>(None, &[]);
            let case = Case {
                entry,
                preset: None,
                settings: settings.unwrap_or_else(|error| panic!("{error}")),
            };
            let found = neighbours(&case, &[]);
            assert!(!found.is_empty(), "{}", entry.name);
            for neighbour in &found {
                let pairs = case.settings.iter().zip(neighbour.settings.iter());
                let changed: Vec<&str> = pairs
                    .filter(|(own, other)| own != other)
                    .map(|((name, _), _)| name)
                    .collect();
                let [name] = changed[..] else {
                    panic!("{changed:?}")
                };
                assert!(entry.applies(name, &case.settings), "{name}");
            }
            assert!(neighbours(&case, &found).is_empty(), "all are known");
        }
    }

    /// The amounts are the resolution, and the directions of what gathers along some.
    #[test]
    fn candidates_have_what_has_an_effect() {
        let grid = grid();
        let find = |preset: &str| {
            let is_it = |case: &&Case| {
                case.entry.name == "voxel-mips" && case.preset.as_deref() == Some(preset)
            };
            let case = grid
                .iter()
                .find(is_it)
                .unwrap_or_else(|| panic!("no {preset}"));
            candidate_of(case)
        };
        let [rays, cones] = ["accurate", "cones"].map(find);
        assert_eq!(rays.amounts, ["resolution", "rays"]);
        assert_eq!(cones.amounts, ["resolution", "cones"]);
        assert!(!rays.settings.contains_key("cones") && !cones.settings.contains_key("rays"));
    }
}
