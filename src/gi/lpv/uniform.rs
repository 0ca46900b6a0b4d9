//! Technique `lpv`: one grid of equal cells.

use super::ledger::{LEDGER, LOBE_LEDGER};
use super::one_grid::OneGrid;
use super::settings::{
    self, LOBES_REPLACED, MARGIN, PASSES, RULES, STAGES, STRUCTS, SUBSTITUTIONS, check_margin,
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
];

static OWN_RULES: &[Rule] = &[Rule::always(Group::Structure, &["margin"])];

static PRESETS: &[Preset] = &[
    Preset {
        name: "accurate",
        help: "discrete directions swept through opaque faces: it converges as cells shrink",
        values: &[],
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
    passes: &[PASSES, &[&GRID_STRUCTURE, &LEDGER, &LOBE_LEDGER]],
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
    Ok(Box::new(OneGrid::new(context, settings)?))
}
