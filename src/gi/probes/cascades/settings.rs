//! Settings, presets and rules.

use crate::gi::StoreKind;
use crate::gi::probes::borrowed::{SOURCE_RESOLUTION, STORE};
use crate::gi::probes::source::borrows;
use crate::gi::settings::{Domain, Group, Preset, Rule, Setting};

/// The settings that other techniques of probes do not have.
pub(super) const SETTINGS: &[Setting] = &[
    Setting {
        name: "probes",
        help: "most probes along an edge of each level",
        unit: "probes",
        domain: Domain::Count { min: 4, max: 32 },
        default: "16",
    },
    Setting {
        name: "levels",
        help: "number of nested lattices around the camera, each with twice the spacing of the one \
               inside it; levels that the scene does not fill are left out",
        unit: "",
        domain: Domain::Count { min: 1, max: 10 },
        default: "3",
    },
    Setting {
        name: "spacing",
        help: "between probes of the finest level; 0: such that the outermost level just holds the \
               scene",
        unit: "m",
        domain: Domain::Number { min: 0.0, max: 1e6 },
        default: "0",
    },
    Setting {
        name: "surface_distance",
        help: "how far off surfaces probes are moved, if they stand nearer, in spacings",
        unit: "cells",
        domain: Domain::Number { min: 0.0, max: 0.5 },
        default: "0.2",
    },
    Setting {
        name: "bounces",
        help: "indirect bounces: 1, 2, or feedback: one more each time that a probe is lit, from \
               what probes had then",
        unit: "",
        domain: Domain::Choice(&["1", "2", "feedback"]),
        default: "1",
    },
    Setting {
        name: "source",
        help: "what rays of probes meet: triangles, or store, the voxels of another technique, \
               which have the light",
        unit: "",
        domain: Domain::Choice(&["triangles", "store"]),
        default: "triangles",
    },
    Setting {
        default: StoreKind::Nested.name(),
        ..STORE
    },
    SOURCE_RESOLUTION,
    Setting {
        name: "probes_per_frame",
        help: "probes that a frame traces or lights, new ones first, then the others in turn; 0: \
               all of them. Those of the coarsest level come at once",
        unit: "probes",
        domain: Domain::Count {
            min: 0,
            max: 1 << 18,
        },
        default: "512",
    },
];

/// Probes that are lit in little time. They are moved less than those that surfaces vote for, so
/// surfaces look them up from further off.
const SPARING: &[(&str, &str)] = &[("irradiance", "sh2"), ("normal_bias", "0.25")];

/// The presets.
pub(super) const PRESETS: &[Preset] = &[
    Preset {
        name: "default",
        help: "3 levels of 16 probes along an edge, 512 of them lit in a frame",
        values: &[SPARING],
    },
    Preset {
        name: "large",
        help: "as default, but of 8 levels, the finest of which is fine also in a large scene",
        values: &[SPARING, &[("levels", "8")]],
    },
    Preset {
        name: "accurate",
        help: "1024 rays a probe, all of them lit in each frame",
        values: &[SPARING, &[("rays", "1024"), ("probes_per_frame", "0")]],
    },
];

/// In which group settings are, and when they have an effect.
pub(super) const RULES: &[Rule] = &[
    Rule::always(
        Group::Structure,
        &[
            "probes",
            "levels",
            "spacing",
            "surface_distance",
            "irradiance",
            "moment_texels",
            "moment_filter",
        ],
    ),
    Rule {
        group: Group::Structure,
        settings: &["irradiance_texels"],
        applies: |settings| settings.is("irradiance", "oct"),
    },
    Rule::always(
        Group::Light,
        &["rays", "hit_light", "probes_per_frame", "source"],
    ),
    Rule {
        group: Group::Light,
        settings: &[STORE.name, SOURCE_RESOLUTION.name],
        applies: borrows,
    },
    Rule::always(Group::Gather, &["normal_bias", "weight_floor", "crush"]),
    Rule::always(Group::Bounces, &["bounces"]),
];
