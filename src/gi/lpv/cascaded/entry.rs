//! The row of the registry.

use super::make;
use crate::gi::Settings;
use crate::gi::entry::{Entry, Substitution};
use crate::gi::lpv::ledger::LEDGER;
use crate::gi::lpv::scroll::{SHIFT_FACES, SHIFT_SIDES};
use crate::gi::lpv::settings::{
    self, CELL_SETTINGS, LOBE_SETTINGS, LOBES_REPLACED, PASSES, RULES, STAGES, STRUCTS,
    SUBSTITUTIONS, without_lobes,
};
use crate::gi::lpv::simulator::SIMULATOR;
use crate::gi::lpv::structure::GRID_STRUCTURE;
use crate::gi::lpv::view::VIEWS;
use crate::gi::settings::{Domain, Group, Preset, Rule, Setting, SettingError};

static SETTINGS: &[Setting] = &[
    Setting {
        name: "resolution",
        help: "cells along an edge of each grid",
        unit: "cells",
        domain: Domain::OneOf(&[8, 16, 32, 64, 128]),
        default: "32",
    },
    Setting {
        name: "levels",
        help: "number of nested grids, each with twice the extent of the one inside it; grids \
               that the scene does not fill are left out",
        unit: "",
        domain: Domain::Count { min: 1, max: 5 },
        default: "3",
    },
    Setting {
        name: "cell_size",
        help: "edge of a cell of the finest grid; 0: such that the outermost grid just holds the \
               scene",
        unit: "m",
        domain: Domain::Number { min: 0.0, max: 1e6 },
        default: "0",
    },
    Setting {
        name: "nesting",
        help: "what comes in at a grid's border: inflow, the light of the grid around it; or \
               independent, the environment alone, as published",
        unit: "",
        domain: Domain::Choice(&["inflow", "independent"]),
        default: "inflow",
    },
    Setting {
        name: "blend",
        help: "cells over which a grid's light goes over into that of the grid around it",
        unit: "cells",
        domain: Domain::Number { min: 0.0, max: 8.0 },
        default: "2",
    },
];

static OWN_RULES: &[Rule] = &[
    Rule::always(Group::Structure, &["levels", "cell_size"]),
    Rule {
        group: Group::Bounces,
        settings: &["nesting"],
        applies: |settings| settings.count("levels") > 1,
    },
    Rule {
        group: Group::Gather,
        settings: &["blend"],
        applies: |settings| settings.count("levels") > 1,
    },
];

static PRESETS: &[Preset] = &[
    Preset {
        name: "accurate",
        help: "directions swept from the outermost grid inwards, light from opaque faces: cells \
               may be smaller than texels of the maps",
        values: &[&[("source", "faces")]],
    },
    Preset {
        name: "textbook",
        help: "the published method: three independent grids, 8 steps of 30 lobes in each",
        values: &[&[
            ("nesting", "independent"),
            ("propagation", "lobes30"),
            ("occlusion", "fuzzy"),
            ("rsm_texels", "256"),
            ("gather_shift", "0.5"),
        ]],
    },
];

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    bounces: |settings| Some(settings.count("bounces")),
    settings: &[SETTINGS, CELL_SETTINGS, LOBE_SETTINGS],
    rules: &[RULES, OWN_RULES],
    check,
    substitutions: &[
        SUBSTITUTIONS,
        &[
            Substitution {
                pairs: |settings| {
                    without_lobes(settings, &["propagation=ordinates", "nesting=inflow"])
                },
                ..LOBES_REPLACED
            },
            Substitution {
                name: "nesting",
                help: "light from outer to inner grids",
                pairs: |settings| {
                    if settings.is("propagation", "ordinates") {
                        vec!["nesting=inflow".to_owned()]
                    } else {
                        Vec::new()
                    }
                },
            },
        ],
    ],
    presets: PRESETS,
    passes: &[
        PASSES,
        &[&SHIFT_FACES, &SHIFT_SIDES, &GRID_STRUCTURE, &LEDGER],
    ],
    structs: &[STRUCTS],
    views: &[&VIEWS],
    simulator: Some(&SIMULATOR),
    stages: STAGES,
    ..Entry::new(
        "lpv-cascaded",
        "nested light propagation volumes around the camera, the outer lighting the inner",
        make,
    )
};

fn check(settings: &Settings) -> Result<(), SettingError> {
    settings::check(settings)?;
    if settings.is("nesting", "inflow") && !settings.is("propagation", "ordinates") {
        return Err(SettingError::Together(
            "nesting=inflow: only propagation=ordinates hands light on to inner grids; give \
             nesting=independent, or that propagation"
                .to_owned(),
        ));
    }
    for (name, needed) in [("schedule", "sweep"), ("scheme", "upwind")] {
        if settings.is("nesting", "inflow") && !settings.is(name, needed) {
            return Err(SettingError::Together(format!(
                "nesting=inflow: only {name}={needed} hands light on to inner grids; give \
                 nesting=independent, or that {name}"
            )));
        }
    }
    Ok(())
}
