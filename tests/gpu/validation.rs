//! Every technique with every preset and every choice of its settings, over all kinds of surfaces and lights, under the validation layer with
//! synchronization validation: no message, and nothing left in the allocator at exit.

use crate::support::gpu;
use crate::support::technique::{Case, Surfaces, cases, frame, is_sound, shoot, small_lights, small_room};
use lumivox::gi::registry::TECHNIQUES;
use lumivox::gi::settings::{Domain, SettingError};
use lumivox::graph::Error;

const SMALL: &[(&str, &str)] = &[("resolution", "16")];

/// Dropping the device fails the test on any message; a leak at exit is one.
#[test]
fn every_technique_and_preset_is_silent() {
    let gpu = gpu();
    for case in cases() {
        for surfaces in Surfaces::ALL {
            for (name, light) in small_lights() {
                let what = format!("{}, {surfaces:?}, {name} light", case.name());
                let shot = shoot(&gpu, &small_room(surfaces, vec![light]), &case, SMALL, frame(32, 24, 64)).unwrap();
                assert!(is_sound(&shot.full), "{what}: a pixel is negative or not finite");
                assert_eq!(gpu.validation_messages(), Vec::<String>::new(), "{what}");
            }
        }
    }
    let left: Vec<_> = gpu.memory();
    assert!(left.is_empty(), "still allocated after every renderer is gone: {left:?}");
}

/// Several lights, none, and an environment.
#[test]
fn every_number_of_lights_is_silent() {
    let gpu = gpu();
    let [(_, point), (_, spot), (_, directional)] = small_lights();
    for case in cases() {
        for lights in [vec![], vec![point, spot, directional], vec![point, point]] {
            let mut scene = small_room(Surfaces::Glossy, lights);
            scene.environment = glam::Vec3::splat(0.5);
            let shot = shoot(&gpu, &scene, &case, SMALL, frame(17, 9, 64)).unwrap();
            assert!(is_sound(&shot.full), "{}", case.name());
        }
    }
}

/// Each word of each setting, and each end of each number's range (but for resolutions, which are large), on a scene that has everything: with the default preset,
/// and with one of the others in turn.
#[test]
fn every_choice_of_every_setting_is_silent() {
    let gpu = gpu();
    let [(_, point), ..] = small_lights();
    for entry in TECHNIQUES.iter().copied() {
        let mut others = entry.presets.iter().skip(1).cycle();
        for setting in entry.settings.iter().copied().flatten().filter(|setting| setting.name != "resolution") {
            let values: Vec<String> = match setting.domain {
                Domain::Choice(words) => words.iter().map(|word| (*word).to_owned()).collect(),
                Domain::OneOf(values) => values.iter().map(u32::to_string).collect(),
                Domain::Count { min, max } => vec![min.to_string(), max.min(64).to_string()],
                Domain::Number { min, max } => vec![min.to_string(), max.to_string()],
            };
            for value in values {
                let other = others.next();
                for preset in entry.presets.first().into_iter().chain(other) {
                    let case = Case { entry, preset: Some(preset.name) };
                    let what = format!("{} --set {}={value}", case.name(), setting.name);
                    let pairs = [("resolution", case.smallest_resolution()), (setting.name, value.as_str())];
                    if let Err(SettingError::Together(_)) = entry.settings(case.preset, &pairs.map(|(name, value)| format!("{name}={value}"))) {
                        continue;
                    }
                    match shoot(&gpu, &small_room(Surfaces::Emissive, vec![point]), &case, &pairs, frame(16, 8, 32)) {
                        Ok(shot) => assert!(is_sound(&shot.full), "{what}: a pixel is negative or not finite"),
                        Err(Error::FeatureMissing { .. }) => eprintln!("{what}: this device lacks a feature that it needs"),
                        Err(error) => panic!("{what}: {error}"),
                    }
                    assert_eq!(gpu.validation_messages(), Vec::<String>::new(), "{what}");
                }
            }
        }
    }
}
