//! Technique `lpv`: one grid of equal cells.

use super::cell_settings::CellSettings;
use super::faces::COMPARE;
use super::ledger::{LEDGER, LOBE_LEDGER};
use super::one_grid::OneGrid;
use super::settings::{
    self, BY_DIRECTION, LOBES_REPLACED, MARGIN, PASSES, RULES, STAGES, STRUCTS, SUBSTITUTIONS,
    check_margin,
};
use super::simulator::SIMULATOR;
use super::structure::GRID_STRUCTURE;
use super::view::VIEWS;
use crate::gi::entry::Entry;
use crate::gi::settings::{Domain, Group, Preset, Rule, Setting};
use crate::gi::{Context, Settings, Technique};
use crate::graph::Error;

static SETTINGS: &[Setting] = &[
    Setting {
        name: "resolution",
        help: "cells along the longest side of the scene, with the margin at either end",
        unit: "cells",
        domain: Domain::Count { min: 8, max: 256 },
        default: "64",
    },
    MARGIN,
    Setting {
        name: "bounce_change",
        help: "bounces end where what opaque faces send changes by this much or less, over the \
               whole; 0: with the last",
        unit: "",
        domain: Domain::Number { min: 0.0, max: 1.0 },
        default: "0",
    },
    Setting {
        name: "lookup",
        help: "what pixels look up: nine harmonics of each cell, or every direction, while the \
               last bounce is swept",
        unit: "",
        domain: Domain::Choice(&["harmonics", "directions"]),
        default: "harmonics",
    },
];

static OWN_RULES: &[Rule] = &[
    Rule::always(Group::Structure, &["margin"]),
    Rule {
        group: Group::Bounces,
        settings: &["bounce_change"],
        applies: |settings| settings.count("bounces") > 1,
    },
    Rule {
        group: Group::Gather,
        settings: &["lookup"],
        applies: |settings| CellSettings::new(settings).sweeps(),
    },
];

static PRESETS: &[Preset] = &[
    Preset {
        name: "accurate",
        help: "discrete directions swept through opaque faces: it converges as cells shrink",
        values: &[],
    },
    Preset {
        name: "best",
        help: "the least error: each pixel looks every direction up, in cells before its surface",
        values: &[&[
            ("lookup", "directions"),
            ("gather_filter", "masked"),
            ("gather_shift", "0.5"),
        ]],
    },
    Preset {
        name: "textbook",
        help: "the published method: 8 steps of 30 lobes, fuzzy occlusion, lookup half a cell off",
        values: &[&[
            ("resolution", "32"),
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
    settings: &[SETTINGS, settings::CELL_SETTINGS, settings::LOBE_SETTINGS],
    rules: &[RULES, OWN_RULES],
    check: |settings| check_margin(settings).and_then(|()| settings::check(settings)),
    substitutions: &[SUBSTITUTIONS, &[LOBES_REPLACED]],
    presets: PRESETS,
    passes: &[
        PASSES,
        BY_DIRECTION,
        &[&COMPARE],
        &[&GRID_STRUCTURE, &LEDGER, &LOBE_LEDGER],
    ],
    structs: &[STRUCTS],
    views: &[&VIEWS],
    simulator: Some(&SIMULATOR),
    stages: STAGES,
    ..Entry::new(
        "lpv",
        "light propagation volume, swept along discrete directions or stepped as published",
        make,
    )
};

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    settings::warn(settings);
    Ok(Box::new(OneGrid::new(context, settings)?))
}
