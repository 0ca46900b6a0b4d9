//! Every technique with every preset and every choice of its settings, over all kinds of surfaces
//! and lights, under the validation layer with synchronization validation: no message, and nothing
//! left in the allocator at exit.

use crate::support::covering::{Choice, covering_rows};
use crate::support::technique::{
    Case, Surfaces, cases, frame, is_sound, shoot, small_lights, small_room,
};
use crate::support::{expected_missing, gpu, own_gpu};
use lumivox::frame::Renderer;
use lumivox::gi::registry::TECHNIQUES;
use lumivox::gi::settings::{Domain, SettingError};
use lumivox::graph::{Error, GpuOptions};
use lumivox::image::Aov;

const SMALL: &[(&str, &str)] = &[("resolution", "16")];

/// Every preset with every kind of surface and of light, every kind of surface with every kind of
/// light. The device is closed at the end: what is still alive then is a message.
#[test]
fn every_technique_and_preset_is_silent() {
    let gpu = own_gpu(&GpuOptions::default());
    for (index, case) in cases().iter().enumerate() {
        for (turn, surfaces) in Surfaces::ALL.into_iter().enumerate() {
            let (name, light) = small_lights()[(index + turn) % 3];
            let what = format!("{}, {surfaces:?}, {name} light", case.name());
            let shot = shoot(
                &gpu,
                &small_room(surfaces, vec![light]),
                case,
                SMALL,
                frame(32, 24, 64),
            )
            .unwrap();
            assert!(
                is_sound(&shot.full),
                "{what}: a pixel is negative or not finite"
            );
            assert_eq!(gpu.validation_messages(), Vec::<String>::new(), "{what}");
        }
    }
}

/// Several lights, none, and an environment.
#[test]
fn every_number_of_lights_is_silent() {
    let gpu = gpu();
    let [(_, point), (_, spot), (_, directional)] = small_lights();
    for case in cases() {
        for lights in [vec![], vec![point, spot, directional], vec![point, point]] {
            let mut scene = small_room(Surfaces::Glossy, lights);
            scene.environment = glam::Vec3::splat(0.5).into();
            let shot = shoot(&gpu, &scene, &case, SMALL, frame(17, 9, 64)).unwrap();
            assert!(is_sound(&shot.full), "{}", case.name());
        }
    }
}

/// Every two choices of settings that are possible together, and every choice with every preset, on
/// a scene that has everything: words, and both ends of each number's range. Numbers of cells and
/// of probes are large, and so is the most points that there may be: those stay small. A number's
/// other values are the presets'.
#[test]
fn every_two_choices_of_settings_are_silent() {
    let gpu = gpu();
    let [(_, point), ..] = small_lights();
    let scene = small_room(Surfaces::Emissive, vec![point]);
    for entry in TECHNIQUES
        .iter()
        .copied()
        .filter(|entry| !entry.presets.is_empty())
    {
        let settings: Vec<_> = entry
            .settings
            .iter()
            .copied()
            .flatten()
            .filter(|setting| {
                !setting.name.ends_with("resolution")
                    && !["probes", "points_max", "cells", "refine"].contains(&setting.name)
            })
            .collect();
        let values: Vec<Vec<String>> = settings
            .iter()
            .map(|setting| values(setting.domain))
            .collect();
        let counts: Vec<usize> = std::iter::once(entry.presets.len())
            .chain(values.iter().map(Vec::len))
            .collect();
        let of =
            |row: &[Choice]| {
                let preset = row
                    .iter()
                    .find(|(factor, _)| *factor == 0)
                    .map_or(0, |(_, value)| *value);
                let case = Case {
                    entry,
                    preset: Some(entry.presets[preset].name),
                };
                let has = |name: &str| entry.all_settings().any(|one| one.name == name);
                let smallest = || format!("resolution={}", case.smallest_resolution());
                let mut pairs: Vec<String> = has("resolution").then(smallest).into_iter().collect();
                pairs.extend(has("cache_resolution").then(|| "cache_resolution=16".into()));
                pairs.extend(has("probes").then(|| "probes=4".into()));
                pairs.extend(has("cells").then(|| "cells=4".into()));
                pairs.extend(row.iter().filter(|(factor, _)| *factor > 0).map(
                    |(factor, value)| {
                        format!(
                            "{}={}",
                            settings[factor - 1].name,
                            values[factor - 1][*value]
                        )
                    },
                ));
                (case, pairs)
            };
        let is_legal = |row: &[Choice]| {
            let (case, pairs) = of(row);
            match entry.settings(case.preset, &pairs) {
                Ok(_) => true,
                Err(SettingError::Together(_)) => false,
                Err(error) => panic!("{} {pairs:?}: {error}", case.name()),
            }
        };
        let (rows, refused) = covering_rows(&counts, is_legal);
        println!(
            "{}: {} rows, {} pairs that are refused",
            entry.name,
            rows.len(),
            refused.len()
        );
        for row in &rows {
            let (case, pairs) = of(row);
            let what = format!("{} --set {}", case.name(), pairs.join(" --set "));
            let settings = entry.settings(case.preset, &pairs).unwrap();
            let shot = Renderer::new(&gpu, &scene, entry, &settings, frame(16, 8, 32)).and_then(
                |(mut renderer, _)| {
                    renderer.render(&scene.camera)?;
                    renderer.aov(Aov::Full)
                },
            );
            match shot {
                Ok(full) => {
                    assert!(is_sound(&full), "{what}: a pixel is negative or not finite");
                    assert_eq!(
                        expected_missing(&gpu, &settings),
                        None,
                        "{what}: renders without a feature that it needs"
                    );
                }
                Err(Error::FeatureMissing { feature, .. }) => {
                    assert_eq!(Some(feature), expected_missing(&gpu, &settings), "{what}")
                }
                Err(error) => panic!("{what}: {error}"),
            }
            assert_eq!(gpu.validation_messages(), Vec::<String>::new(), "{what}");
        }
    }
}

/// The words of a setting, or the ends of its range.
fn values(domain: Domain) -> Vec<String> {
    match domain {
        Domain::Choice(words) => words.iter().map(|word| (*word).to_owned()).collect(),
        Domain::OneOf(values) => values.iter().map(u32::to_string).collect(),
        Domain::Count { min, max } => vec![min.to_string(), max.min(64).to_string()],
        Domain::Number { min, max } => vec![min.to_string(), max.to_string()],
    }
}
