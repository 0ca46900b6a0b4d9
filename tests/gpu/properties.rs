//! Properties of settings: two or three that are legal together give finite light of no negative
//! value; those that are not are refused in words that name them.
//!
//! The seed is fixed, so that each run tries the same cases.

use std::collections::BTreeSet;

use lumivox::gi::registry::find;
use lumivox::gi::settings::{Domain, Setting, SettingError};
use lumivox::graph::Error;
use proptest::prelude::*;
use proptest::sample::Index;
use proptest::test_runner::{RngSeed, TestRunner};

use crate::support::gpu;
use crate::support::technique::{
    Case, Surfaces, bounce_cases, frame, is_sound, shoot, small_lights, small_room,
};

/// Cases; measured, each takes a seventh of a second.
const CASES: u32 = 96;

/// A value of a setting's domain, its ends as likely as all that lies between; counts up to 64,
/// since many of anything take long.
fn value(setting: &Setting, place: &Index, share: u16) -> String {
    match setting.domain {
        Domain::Choice(words) => (*place.get(words)).to_owned(),
        Domain::OneOf(values) => place.get(values).to_string(),
        Domain::Count { min, max } => {
            let most = max.min(64).max(min);
            [
                min,
                most,
                min + place.index((most - min + 1) as usize) as u32,
            ][share as usize % 3]
                .to_string()
        }
        Domain::Number { min, max } => {
            let between = min + (max - min) * (f32::from(share) / f32::from(u16::MAX)).powi(3);
            [min, max, between][share as usize % 3].to_string()
        }
    }
}

/// A preset of a technique, and two or three of its settings but the resolution and the number of
/// probes, each with a value that it may have.
fn triples() -> impl Strategy<Value = (Case, Vec<(&'static str, String)>)> {
    (
        any::<Index>(),
        prop::collection::vec((any::<Index>(), any::<Index>(), any::<u16>()), 2..=3),
    )
        .prop_map(|(case, chosen)| {
            let case = *case.get(&bounce_cases());
            let settings: Vec<&'static Setting> = case
                .entry
                .settings
                .iter()
                .copied()
                .flatten()
                .filter(|setting| !SMALL.contains(&setting.name))
                .collect();
            let pair = |(setting, place, share): &(Index, Index, u16)| {
                let setting = *setting.get(&settings);
                (setting.name, value(setting, place, *share))
            };
            let mut pairs: Vec<(&'static str, String)> = chosen.iter().map(pair).collect();
            let mut seen = BTreeSet::new();
            pairs.retain(|(name, _)| seen.insert(*name));
            (case, pairs)
        })
}

/// Settings that make a build large; they are as small as can be.
const SMALL: [&str; 4] = ["resolution", "probes", "cells", "refine"];

/// How many of a technique's settings a message names.
fn named(case: &Case, message: &str) -> usize {
    let words: BTreeSet<&str> = message
        .split(|c: char| !c.is_alphanumeric() && c != '_')
        .collect();
    case.entry
        .settings
        .iter()
        .copied()
        .flatten()
        .filter(|setting| words.contains(setting.name))
        .count()
}

#[test]
fn settings_that_are_legal_together_give_sound_light() {
    let gpu = gpu();
    let config = ProptestConfig {
        cases: CASES,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(17),
        max_shrink_iters: 32,
        ..ProptestConfig::default()
    };
    let lights = small_lights().map(|(_, light)| light);
    let strategy = (triples(), any::<Index>(), 0usize..4);
    let tried = TestRunner::new(config).run(&strategy, |((case, pairs), surfaces, light)| {
        let mut all = vec![
            ("resolution", case.smallest_resolution()),
            ("probes", "4"),
            ("cells", "4"),
        ];
        all.retain(|(name, _)| case.has(name));
        all.extend(pairs.iter().map(|(name, value)| (*name, value.as_str())));
        let what = format!("{} {all:?}", case.name());
        match case.entry.settings(
            case.preset,
            &all.iter()
                .map(|(name, value)| format!("{name}={value}"))
                .collect::<Vec<_>>(),
        ) {
            Ok(_) => {}
            Err(SettingError::Together(message)) => {
                prop_assert!(named(&case, &message) >= 2, "{what}: {message}");
                return Ok(());
            }
            Err(error) => return Err(TestCaseError::fail(format!("{what}: {error}"))),
        }
        let scene = small_room(
            *surfaces.get(&Surfaces::ALL),
            lights
                .get(light)
                .map_or(lights.to_vec(), |light| vec![*light]),
        );
        match shoot(&gpu, &scene, &case, &all, frame(16, 8, 32)) {
            Ok(shot) => {
                for (name, image) in [
                    ("full", &shot.full),
                    ("direct", &shot.direct),
                    ("indirect", &shot.indirect),
                    ("irradiance", &shot.light.irradiance),
                    ("specular", &shot.light.specular),
                ] {
                    prop_assert!(
                        is_sound(image),
                        "{what}: {name} has a pixel that is negative or not finite"
                    );
                }
                prop_assert!(
                    shot.full
                        .pixels
                        .iter()
                        .any(|pixel| pixel.max_element() > 0.0),
                    "{what}: there is light, and the picture is black"
                );
            }
            Err(Error::FeatureMissing { .. }) => {}
            // More points than are allowed, or than memory holds.
            Err(Error::Unsuited { problem, .. }) if problem.contains("the lattice has") => {}
            Err(error) => return Err(TestCaseError::fail(format!("{what}: {error}"))),
        }
        prop_assert_eq!(gpu.validation_messages(), Vec::<String>::new(), "{}", what);
        Ok(())
    });
    tried.unwrap_or_else(|error| panic!("{error}"));
}

/// Every choice of every two settings that the technique refuses is refused in words that name
/// both; without those that are known to be refused this would prove nothing.
#[test]
fn settings_that_are_not_legal_together_are_named() {
    let mut refused = BTreeSet::new();
    for case in bounce_cases() {
        let choices: Vec<String> = case
            .entry
            .all_settings()
            .flat_map(|setting| match setting.domain {
                Domain::Choice(words) => words
                    .iter()
                    .map(|word| format!("{}={word}", setting.name))
                    .collect(),
                _ => Vec::new(),
            })
            .collect();
        for (index, one) in choices.iter().enumerate() {
            for other in &choices[..index] {
                if let Err(error) = case.entry.settings(case.preset, &[one, other]) {
                    let message = error.to_string();
                    assert!(
                        matches!(error, SettingError::Together(_)) && named(&case, &message) >= 2,
                        "{} {one} {other}: {message}",
                        case.name()
                    );
                    refused.insert(message);
                }
            }
        }
    }
    assert!(
        refused.iter().any(|message| message.contains("toksvig")),
        "{refused:#?}"
    );
    let kahl = [
        "cone_set=kahl",
        "kahl_front=off",
        "kahl_intermediate=off",
        "kahl_side=off",
    ];
    let message = find("svo")
        .unwrap()
        .settings(None, &kahl)
        .unwrap_err()
        .to_string();
    assert!(
        ["cone_set", "kahl_front", "kahl_intermediate", "kahl_side"]
            .iter()
            .all(|name| message.contains(name)),
        "{message}"
    );
}

/// A value that a setting cannot have is refused in words that name the setting, the value and what
/// is possible.
#[test]
fn values_outside_of_their_domain_are_refused() {
    for case in bounce_cases() {
        for setting in case.entry.all_settings() {
            let outside = match setting.domain {
                Domain::Count { min, max } => [
                    min.checked_sub(1)
                        .map_or("-1".to_owned(), |value| value.to_string()),
                    (u64::from(max) + 1).to_string(),
                    "1.5".to_owned(),
                ],
                Domain::OneOf(_) => ["7".to_owned(), "-8".to_owned(), "99999999999".to_owned()],
                Domain::Number { min, max } => [
                    "nan".to_owned(),
                    (min - 1.0).to_string(),
                    (max * 1.01 + 1.0).to_string(),
                ],
                Domain::Choice(_) => [
                    "".to_owned(),
                    "On".to_owned(),
                    "1 ".to_owned() + setting.default,
                ],
            };
            for value in outside {
                let message = case
                    .entry
                    .settings(case.preset, &[format!("{}={value}", setting.name)])
                    .unwrap_err()
                    .to_string();
                assert!(
                    message.contains(setting.name)
                        && message.contains(value.trim())
                        && message.contains(&setting.domain.to_string()),
                    "{message}"
                );
            }
        }
    }
}
