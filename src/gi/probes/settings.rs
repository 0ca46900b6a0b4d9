//! Settings, presets and rules.

use super::schedule::{HYSTERESIS, PROBES_PER_FRAME, TRACE};
use crate::gi::settings::{Domain, Group, Preset, Rule, Setting};
use crate::gi::shared::paths::HIT_LIGHT;

/// Where probes stand.
pub(super) const PLACEMENT: &[Setting] = &[
    Setting {
        name: "probes",
        help: "probes along the longest side of the scene",
        unit: "probes",
        domain: Domain::Count { min: 2, max: 64 },
        default: "16",
    },
    Setting {
        name: "outer_layer",
        help: "how far inside of the scene's bounds the outermost probes stand, in spacings",
        unit: "cells",
        domain: Domain::Number {
            min: 0.05,
            max: 0.5,
        },
        default: "0.25",
    },
    Setting {
        name: "placement",
        help: "where probes stand: on the lattice, relocated: away from what is too near, or \
               snapped: beside the surfaces that look them up, on the side that is seen",
        unit: "",
        domain: Domain::Choice(&["lattice", "relocate", "snap"]),
        default: "snap",
    },
    Setting {
        name: "surface_distance",
        help: "how far off a surface a moved probe stands, in the smallest spacing",
        unit: "cells",
        domain: Domain::Number {
            min: 0.05,
            max: 0.5,
        },
        default: "0.15",
    },
];

/// How often light goes from probe to probe.
pub(super) const BOUNCES: Setting = Setting {
    name: "bounces",
    help: "indirect bounces: so many in each frame, or feedback: one more with each frame, \
           from what probes had in the last one",
    unit: "",
    domain: Domain::Choice(&["1", "2", "3", "4", "5", "6", "7", "8", "feedback"]),
    default: "1",
};

/// What probes keep of the light, and of what they see.
pub(super) const KEPT_SETTINGS: &[Setting] = &[
    Setting {
        name: "rays",
        help: "rays of a probe",
        unit: "rays",
        domain: Domain::Count { min: 32, max: 8192 },
        default: "256",
    },
    HIT_LIGHT,
    Setting {
        name: "irradiance",
        help: "how a probe keeps its irradiance: oct, an octahedral map, or sh2, spherical \
               harmonics of three bands",
        unit: "",
        domain: Domain::Choice(&["oct", "sh2"]),
        default: "oct",
    },
    Setting {
        name: "irradiance_texels",
        help: "edge of a probe's octahedral map of irradiance",
        unit: "texels",
        domain: Domain::Count { min: 4, max: 16 },
        default: "8",
    },
    Setting {
        name: "moment_texels",
        help: "edge of a probe's octahedral map of the distances that it sees",
        unit: "texels",
        domain: Domain::Count { min: 8, max: 32 },
        default: "16",
    },
    Setting {
        name: "moment_filter",
        help: "over which rays the distances of a direction are averaged: a box of rays of its \
               own, or all rays of the probe by a power of the cosine",
        unit: "",
        domain: Domain::Choice(&["box", "power"]),
        default: "box",
    },
];

/// How surfaces look probes up.
pub(super) const LOOKUP_SETTINGS: &[Setting] = &[
    Setting {
        name: "normal_bias",
        help: "how far off its surface a place looks probes up, in the smallest spacing",
        unit: "cells",
        domain: Domain::Number { min: 0.0, max: 1.0 },
        default: "0.1",
    },
    Setting {
        name: "weight_floor",
        help: "least share of a probe that its distances leave",
        unit: "",
        domain: Domain::Number { min: 0.0, max: 0.2 },
        default: "0.05",
    },
    Setting {
        name: "crush",
        help: "probes of a smaller weight count less than their weight",
        unit: "",
        domain: Domain::Number { min: 0.0, max: 0.5 },
        default: "0.2",
    },
];

/// The other settings of irradiance probes.
pub(super) const SETTINGS: &[Setting] = &[
    TRACE,
    Setting {
        name: "gradient",
        help: "whether probes also know how their irradiance changes with the place",
        unit: "",
        domain: Domain::Choice(&["on", "off"]),
        default: "off",
    },
    Setting {
        name: "visibility",
        help: "what keeps a probe out that a surface does not see: none, facing (the side of the \
               surface that it is on), moments (that, and the distances that it sees), or rays \
               (the side, and a ray to it)",
        unit: "",
        domain: Domain::Choice(&["none", "facing", "moments", "rays"]),
        default: "moments",
    },
    Setting {
        name: "rings",
        help: "shells of further probes that a place asks whose eight probes are all hidden",
        unit: "shells",
        domain: Domain::Count { min: 0, max: 2 },
        default: "2",
    },
    BOUNCES,
    PROBES_PER_FRAME,
    HYSTERESIS,
];

/// The presets.
pub(super) const PRESETS: &[Preset] = &[
    Preset {
        name: "default",
        help: "16 probes along the longest side, 256 rays each, which are traced once",
        values: &[],
    },
    Preset {
        name: "fast",
        help: "as default, but shadow maps say which light reaches what rays hit",
        values: &[&[("hit_light", "maps")]],
    },
    Preset {
        name: "textbook",
        help: "as in Majercik et al. 2019: probes move away from surfaces, distances by a power \
               of the cosine",
        values: &[&[
            ("outer_layer", "0.05"),
            ("placement", "relocate"),
            ("surface_distance", "0.2"),
            ("moment_filter", "power"),
            ("normal_bias", "0.25"),
            ("rings", "0"),
        ]],
    },
    Preset {
        name: "accurate",
        help: "1024 rays a probe",
        values: &[&[("rays", "1024")]],
    },
];

/// In which group the settings of where probes stand are, and when they have an effect.
pub(super) const PLACEMENT_RULES: &[Rule] = &[
    Rule::always(Group::Structure, &["probes", "outer_layer", "placement"]),
    Rule {
        group: Group::Structure,
        settings: &["surface_distance"],
        applies: |settings| !settings.is("placement", "lattice"),
    },
];

/// The same of the other settings.
pub(super) const RULES: &[Rule] = &[
    Rule::always(Group::Structure, &["irradiance"]),
    Rule {
        group: Group::Structure,
        settings: &["irradiance_texels", "gradient"],
        applies: |settings| settings.is("irradiance", "oct"),
    },
    Rule {
        group: Group::Structure,
        settings: &["moment_texels", "moment_filter"],
        applies: |settings| settings.is("visibility", "moments"),
    },
    Rule::always(
        Group::Light,
        &[
            "rays",
            "hit_light",
            "trace",
            "probes_per_frame",
            "hysteresis",
        ],
    ),
    Rule::always(Group::Gather, &["visibility", "normal_bias"]),
    Rule {
        group: Group::Gather,
        settings: &["weight_floor"],
        applies: |settings| {
            settings.is("visibility", "moments") || settings.is("visibility", "rays")
        },
    },
    Rule {
        group: Group::Gather,
        settings: &["rings"],
        applies: |settings| settings.is("visibility", "moments"),
    },
    Rule {
        group: Group::Gather,
        settings: &["crush"],
        applies: |settings| !settings.is("visibility", "none"),
    },
    Rule::always(Group::Bounces, &["bounces"]),
];
