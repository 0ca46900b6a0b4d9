//! Settings, presets and rules.

use crate::gi::settings::{Domain, Group, Preset, Rule, Setting};
use crate::gi::shared::paths::HIT_LIGHT;

/// The settings of irradiance probes.
pub(super) const SETTINGS: &[Setting] = &[
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
        help: "where probes stand: on the lattice, or snapped: beside the surfaces that look them \
               up, on the side that is seen",
        unit: "",
        domain: Domain::Choice(&["lattice", "snap"]),
        default: "snap",
    },
    Setting {
        name: "snap_distance",
        help: "how far off a surface a snapped probe stands, in the smallest spacing",
        unit: "cells",
        domain: Domain::Number {
            min: 0.05,
            max: 0.5,
        },
        default: "0.15",
    },
    Setting {
        name: "rays",
        help: "rays of a probe: traced when it is built, lit in each frame",
        unit: "rays",
        domain: Domain::Count { min: 32, max: 8192 },
        default: "256",
    },
    HIT_LIGHT,
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
        name: "visibility",
        help: "what keeps a probe out that a surface does not see: none, facing (the side of the \
               surface that it is on), or moments (that, and the distances that it sees)",
        unit: "",
        domain: Domain::Choice(&["none", "facing", "moments"]),
        default: "moments",
    },
    Setting {
        name: "normal_bias",
        help: "how far off its surface a place looks probes up, in the smallest spacing",
        unit: "cells",
        domain: Domain::Number { min: 0.0, max: 1.0 },
        default: "0.25",
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
    Setting {
        name: "bounces",
        help: "indirect bounces",
        unit: "",
        domain: Domain::Count { min: 1, max: 8 },
        default: "1",
    },
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
        name: "accurate",
        help: "1024 rays a probe",
        values: &[&[("rays", "1024")]],
    },
];

/// In which group settings are, and when they have an effect.
pub(super) const RULES: &[Rule] = &[
    Rule::always(
        Group::Structure,
        &["probes", "outer_layer", "placement", "irradiance_texels"],
    ),
    Rule {
        group: Group::Structure,
        settings: &["snap_distance"],
        applies: |settings| settings.is("placement", "snap"),
    },
    Rule {
        group: Group::Structure,
        settings: &["moment_texels"],
        applies: |settings| settings.is("visibility", "moments"),
    },
    Rule::always(Group::Light, &["rays", "hit_light"]),
    Rule::always(Group::Gather, &["visibility", "normal_bias"]),
    Rule {
        group: Group::Gather,
        settings: &["weight_floor"],
        applies: |settings| settings.is("visibility", "moments"),
    },
    Rule {
        group: Group::Gather,
        settings: &["crush"],
        applies: |settings| !settings.is("visibility", "none"),
    },
    Rule::always(Group::Bounces, &["bounces"]),
];
