//! Rules of settings: what does not apply with others has no effect on the picture.

use std::collections::BTreeSet;

use glam::Vec3;
use lumivox::gi::Settings;
use lumivox::gi::entry::Entry;
use lumivox::gi::registry::TECHNIQUES;
use lumivox::gi::settings::{Domain, Setting};
use lumivox::gi::shared::screen;
use lumivox::graph::Gpu;
use lumivox::scene::Scene;

use crate::support::gpu;
use crate::support::technique::{
    Case, Surfaces, bounce_cases, cases, default_cases, frame, shoot, small_lights, small_room,
};

/// On top of a technique's cones, those of them that it has.
const COMBINATIONS: [&[(&str, &str)]; 9] = [
    &[("gather", "rays"), ("specular", "off")],
    &[
        ("gather", "rays"),
        ("specular", "off"),
        ("shadows", "cones"),
        ("bounces", "2"),
    ],
    &[
        ("gather", "rays"),
        ("specular", "off"),
        ("occlusion_cones", "4"),
    ],
    &[("cone_set", "kahl"), ("kahl_side", "on")],
    &[
        ("occlusion_cones", "4"),
        ("occlusion_falloff", "1"),
        ("specular", "off"),
    ],
    &[
        ("faces", "front"),
        ("shadows", "cones"),
        ("specular_falloff", "4"),
    ],
    &[("anisotropic", "on"), ("mip_filter", "box")],
    &[("lattice", "corners"), ("mip_filter", "box")],
    &[("voxel_occlusion", "rays-soft"), ("bounces", "2")],
];

/// On top of the published steps of techniques that have lobes.
const STREAMS: &[(&str, &str)] = &[("propagation", "stream"), ("bands", "4")];

/// On top of techniques whose bounces may end early.
const BOUNCES: &[(&str, &str)] = &[("bounces", "3")];

/// On top of the default presets of techniques that place probes.
const MOVED: &[(&str, &str)] = &[("placement", "snap")];

/// On top of the default presets of techniques that may keep harmonics in place of maps.
const MAPS: &[(&str, &str)] = &[("irradiance", "oct")];

/// On top of the default presets of techniques whose rays may meet voxels.
const VOXELS: &[(&str, &str)] = &[("source", "voxels"), ("source_resolution", "32")];

/// On top of the default presets of techniques whose probes the scene may be drawn around.
const RASTER: &[(&str, &str)] = &[("source", "raster"), ("raster_texels", "16")];

/// On top of the default presets of techniques that may use the stores of others.
const BORROWED: &[&[(&str, &str)]] = &[
    &[("source", "store"), ("source_resolution", "32")],
    &[("specular", "cones"), ("source_resolution", "32")],
];

/// On top of the default presets of techniques whose surfaces may mirror reflection probes.
const PREFILTERED: &[(&str, &str)] = &[("specular", "prefiltered"), ("radiance_texels", "16")];

/// On top of the default presets: what pixels share.
const SHARED: [&[(&str, &str)]; 2] = [
    &[("history", "2"), ("blur", "even")],
    &[("blur", "a-trous"), ("gather_scale", "2")],
];

/// Another value than the one that a setting has.
fn other_value(setting: &Setting, settings: &Settings) -> String {
    let after = |position: Option<usize>, count: usize| (position.unwrap_or(0) + 1) % count;
    match setting.domain {
        Domain::Choice(words) => {
            let now = settings.choice(setting.name);
            words[after(words.iter().position(|word| *word == now), words.len())].to_owned()
        }
        Domain::OneOf(values) => {
            let now = settings.count(setting.name);
            values[after(values.iter().position(|value| *value == now), values.len())].to_string()
        }
        Domain::Count { min, .. } if settings.count(setting.name) == min => (min + 1).to_string(),
        Domain::Count { min, .. } => min.to_string(),
        Domain::Number { min, max } if settings.number(setting.name) == min => {
            (min + 0.5 * (max - min).min(1.0)).to_string()
        }
        Domain::Number { min, .. } => min.to_string(),
    }
}

/// Settings of a technique that apply, or that do not.
fn applying(entry: &'static Entry, settings: &Settings, do_apply: bool) -> Vec<&'static Setting> {
    let all = entry.all_settings();
    all.filter(|setting| entry.applies(setting.name, settings) == do_apply)
        .collect()
}

/// The preset of cones of every technique.
fn cone_cases() -> Vec<Case> {
    let all = bounce_cases().into_iter();
    all.filter(|case| case.preset == Some("cones")).collect()
}

/// Every preset, and the combinations, each once.
fn combinations() -> Vec<(Case, Vec<(&'static str, &'static str)>)> {
    let presets = bounce_cases().into_iter().map(|case| (case, Vec::new()));
    let has = |case: &Case, name: &str| {
        let mut all = case.entry.all_settings();
        all.any(|setting| setting.name == name)
    };
    let more = cone_cases().into_iter().flat_map(|case| {
        COMBINATIONS
            .iter()
            .filter(move |pairs| pairs.iter().all(|(name, _)| has(&case, name)))
            .map(move |pairs| (case, pairs.to_vec()))
    });
    let lobes = bounce_cases().into_iter().filter(|case| {
        case.preset == Some("textbook") && STREAMS.iter().all(|(name, _)| has(case, name))
    });
    let streams = lobes.map(|case| (case, STREAMS.to_vec()));
    let early = bounce_cases().into_iter();
    let early = early.filter(|case| case.preset == Some("accurate") && has(case, "bounce_change"));
    let bounces = early.map(|case| (case, BOUNCES.to_vec()));
    let placing = default_cases().into_iter();
    let placing = placing.filter(|case| has(case, "placement"));
    let moved = placing.map(|case| (case, MOVED.to_vec()));
    let mapped = default_cases().into_iter();
    let mapped = mapped.filter(|case| has(case, "irradiance"));
    let mapped = mapped.map(|case| (case, MAPS.to_vec()));
    let voxels = default_cases().into_iter();
    let voxels = voxels.filter(|case| has(case, "raster_texels"));
    let voxels = voxels.flat_map(|case| [VOXELS, RASTER].map(|pairs| (case, pairs.to_vec())));
    let borrowed = default_cases().into_iter();
    let borrowed = borrowed.filter(|case| case.entry.borrows);
    let borrowed =
        borrowed.flat_map(|case| BORROWED.iter().map(move |pairs| (case, pairs.to_vec())));
    let reflected = default_cases().into_iter();
    let reflected = reflected.filter(|case| has(case, "parallax"));
    let reflected = reflected.map(|case| (case, PREFILTERED.to_vec()));
    let windowed = default_cases().into_iter();
    let windowed = windowed.filter(|case| has(case, "window_width"));
    let windowed = windowed.map(|case| (case, vec![("window", "hann"), ("refine", "1")]));
    let shared = default_cases().into_iter();
    let shared = shared.flat_map(|case| SHARED.map(|pairs| (case, pairs.to_vec())));
    // Visibility alone has no bounce.
    let skies = cases().into_iter();
    let skies = skies.filter(|case| has(case, "thin_occluders"));
    let skies = skies.flat_map(|case| {
        let pairs = [Vec::new()]
            .into_iter()
            .chain(SHARED.map(|pairs| pairs.to_vec()));
        pairs.map(move |pairs| (case, [vec![("light", "sky")], pairs].concat()))
    });
    (presets.chain(more).chain(streams).chain(bounces))
        .chain(skies)
        .chain(moved)
        .chain(windowed)
        .chain(mapped)
        .chain(voxels)
        .chain(borrowed)
        .chain(reflected)
        .chain(shared)
        .collect()
}

/// A room in which the voxels' light, glossy reflection and emission are to be seen.
fn room() -> Scene {
    let mut scene = small_room(Surfaces::Glossy, vec![small_lights()[0].1]);
    scene.materials[1].emission = Vec3::new(1.0, 2.0, 4.0);
    scene
}

/// Whether the pictures of a case differ when these settings are changed.
fn differs(
    gpu: &Gpu,
    scene: &Scene,
    (case, pairs): &(Case, Vec<(&'static str, &'static str)>),
    changed: &[&'static Setting],
) -> bool {
    let mut pairs = pairs.clone();
    pairs.push(("resolution", case.smallest_resolution()));
    let settings = case.settings(&pairs);
    let values: Vec<(&str, String)> = changed
        .iter()
        .map(|setting| (setting.name, other_value(setting, &settings)))
        .collect();
    let mut with = pairs.clone();
    with.extend(values.iter().map(|(name, value)| (*name, value.as_str())));
    let [before, after] = [&pairs, &with].map(|pairs| {
        shoot(gpu, scene, case, pairs, frame(24, 16, 64)).unwrap_or_else(|e| panic!("{e}"))
    });
    before.full != after.full || before.direct != after.direct || before.light != after.light
}

#[test]
fn what_does_not_apply_leaves_the_picture_as_it_is_bit_by_bit() {
    let (gpu, scene) = (gpu(), room());
    for combination in combinations() {
        let (case, pairs) = &combination;
        let idle = applying(case.entry, &case.settings(pairs), false);
        if !differs(&gpu, &scene, &combination, &idle) {
            continue;
        }
        let guilty: Vec<&str> = idle
            .into_iter()
            .filter(|setting| differs(&gpu, &scene, &combination, &[setting]))
            .map(|setting| setting.name)
            .collect();
        panic!("{} {pairs:?}: {guilty:?} have an effect", case.name());
    }
}

/// The comparison notices what applies.
#[test]
fn what_applies_changes_the_picture() {
    let (gpu, scene) = (gpu(), room());
    for case in cone_cases() {
        let pairs = vec![("cone_set", "kahl")];
        let applies = applying(case.entry, &case.settings(&pairs), true);
        let side = applies.iter().find(|setting| setting.name == "kahl_side");
        assert!(
            differs(&gpu, &scene, &(case, pairs), &[side.unwrap()]),
            "{}: kahl_side changes nothing",
            case.name()
        );
    }
}

/// Every setting of the library's own techniques has one rule, and applies in some combination.
#[test]
fn every_setting_has_a_rule_and_applies_somewhere() {
    let mut known = BTreeSet::new();
    for entry in TECHNIQUES {
        for name in entry.all_settings().map(|s| s.name) {
            let rules = entry
                .rules
                .iter()
                .copied()
                .flatten()
                .chain(screen::settings::RULES);
            let count = rules.filter(|rule| rule.settings.contains(&name)).count();
            assert_eq!(count, 1, "rules of {}'s {name}", entry.name);
            known.insert(name);
            let applies = combinations().iter().any(|(case, pairs)| {
                case.entry.name == entry.name && entry.applies(name, &case.settings(pairs))
            });
            assert!(applies, "{}'s {name} never applies", entry.name);
        }
    }
    for rule in TECHNIQUES
        .iter()
        .flat_map(|entry| entry.rules.iter().copied().flatten())
        .chain(screen::settings::RULES)
    {
        for name in rule.settings {
            assert!(
                known.contains(name),
                "there is a rule of {name}, which no technique has"
            );
        }
    }
}
