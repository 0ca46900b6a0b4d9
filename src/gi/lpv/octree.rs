//! Technique `lpv-octree`: cells are larger far from surfaces.

use super::faces::{FACES, LIGHT_SIDES, NEAREST, NUMBER_SIDES, SURFACES};
use super::gather::{GATHER, SPECULAR};
use super::inject::INJECT;
use super::leaf_sweep::{LEAF_SOURCES, LEAF_SUM, LEAF_SWEEP};
use super::leaves::LeafSettings;
use super::one_grid::OneGrid;
use super::settings::{
    CELL_SETTINGS, LIGHT_INJECTION, LOOKUP, OPAQUE_FACES, REFLECTION, STRUCTS, check_directions,
};
use super::view::{CELLS, VIEW};
use crate::gi::entry::{Entry, Stage};
use crate::gi::settings::{Domain, Group, Preset, Rule, Setting};
use crate::gi::{Context, Settings, Technique};
use crate::graph::{Error, Pass};

static SETTINGS: &[Setting] = &[
    Setting {
        name: "resolution",
        help: "cells along the longest side of the scene, with an empty one at either end; as \
               small as leaves are near surfaces",
        unit: "cells",
        domain: Domain::Count { min: 8, max: 256 },
        default: "64",
    },
    Setting {
        name: "guard",
        help: "blocks around a leaf that hold no opaque face either",
        unit: "blocks",
        domain: Domain::Count { min: 1, max: 4 },
        default: "1",
    },
    Setting {
        name: "max_level",
        help: "level of the largest leaves, which have an edge of 2^level cells: higher is faster \
               and blurs light on its way; 0: each cell is a leaf",
        unit: "",
        domain: Domain::Count { min: 0, max: 8 },
        default: "1",
    },
];

static RULES: &[Rule] = &[
    Rule::always(Group::Structure, &["resolution", "max_level"]),
    Rule {
        group: Group::Structure,
        settings: &["guard"],
        applies: |settings| settings.count("max_level") > 0,
    },
    Rule::always(Group::Light, &["source"]),
    Rule {
        group: Group::Light,
        settings: &["rsm_texels", "injection_shift"],
        applies: |settings| settings.is("source", "rsm"),
    },
    Rule::always(Group::Bounces, &["directions", "bounces"]),
    Rule::always(Group::Gather, &["gather_shift"]),
];

static PRESETS: &[Preset] = &[Preset {
    name: "accurate",
    help: "discrete directions swept through leaves: single cells near surfaces, larger far off",
    values: &[],
}];

static PASSES: &[&Pass] = &[
    &FACES,
    &NUMBER_SIDES,
    &NEAREST,
    &SURFACES,
    &INJECT,
    &LIGHT_SIDES,
    &LEAF_SOURCES,
    &LEAF_SWEEP,
    &LEAF_SUM,
    &GATHER,
    &SPECULAR,
    &VIEW,
];

/// From leaves to all others.
static PROPAGATION: Stage = Stage::store(
    "propagation",
    &["lpv.leaf_sources", "lpv.leaf_sweep", "lpv.leaf_sum"],
);

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    bounces: |settings| Some(settings.count("bounces")),
    settings: &[SETTINGS, CELL_SETTINGS],
    rules: &[RULES],
    check: check_directions,
    presets: PRESETS,
    passes: &[PASSES],
    structs: &[STRUCTS],
    views: &[std::slice::from_ref(&CELLS)],
    stages: &[
        &OPAQUE_FACES,
        &LIGHT_INJECTION,
        &PROPAGATION,
        &LOOKUP,
        &REFLECTION,
    ],
    ..Entry::new(
        "lpv-octree",
        "light propagation volume swept along discrete directions, in larger cells far from \
         surfaces",
        make,
    )
};

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    let leaves = LeafSettings {
        guard: settings.count("guard"),
        max_level: settings.count("max_level"),
    };
    Ok(Box::new(OneGrid::new(context, settings, Some(leaves))?))
}
