//! Technique `lpv-octree`: cells are larger far from surfaces, or there are whole levels of larger
//! ones.

use super::faces::{FACES, LIGHT_SIDES, NEAREST, NUMBER_SIDES, SURFACES};
use super::gather::{GATHER, SPECULAR};
use super::inject::INJECT;
use super::leaf_sweep::{LEAF_SOURCES, LEAF_SUM, LEAF_SWEEP};
use super::levels::{DOWN_SAMPLE, LEVEL_FACES, MERGE_LEVELS};
use super::lobes::{FINISH, PROPAGATE, SEED};
use super::one_grid::OneGrid;
use super::settings::{
    CELL_SETTINGS, CLAMP_NEGATIVE, GAIN, ITERATIONS, LIGHT_INJECTION, LOBES_REPLACED, LOOKUP,
    MARGIN, OPAQUE_FACES, REFLECTION, STRUCTS, SUBSTITUTIONS, check_directions, check_margin,
    without_lobes,
};
use super::simulator::SIMULATOR;
use super::structure::{LEAF_STRUCTURE, LEVEL_STRUCTURE};
use super::view::{VIEW, VIEWS};
use crate::gi::entry::{Entry, Stage, Substitution};
use crate::gi::settings::{Domain, Group, Preset, Rule, Setting, SettingError};
use crate::gi::{Context, Settings, Technique};
use crate::graph::{Error, Pass};

static SETTINGS: &[Setting] = &[
    Setting {
        name: "octree",
        help: "leaves: cells are larger far from surfaces, and directions are swept through them; \
               levels: whole grids of larger and larger cells, in which lobes are handed on (2012)",
        unit: "",
        domain: Domain::Choice(&["leaves", "levels"]),
        default: "leaves",
    },
    Setting {
        name: "resolution",
        help: "cells along the longest side of the scene, with the margin at either end; as \
               small as leaves are near surfaces",
        unit: "cells",
        domain: Domain::Count { min: 8, max: 256 },
        default: "64",
    },
    MARGIN,
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
    Setting {
        name: "transfer",
        help: "what a level begins with: the mean of what the finer one begins with, of which the \
               finest that has light counts, as published; or the sum of what the finer one has \
               left after its steps, where levels add up",
        unit: "",
        domain: Domain::Choice(&["mean", "residual"]),
        default: "mean",
    },
    Setting {
        name: "propagation",
        help: "how lobes are handed on: 30 of them (2010), one along each axis (2009), or streams \
               that keep direction",
        unit: "",
        domain: Domain::Choice(&["lobes30", "axis6", "stream"]),
        default: "lobes30",
    },
    ITERATIONS,
    GAIN,
    CLAMP_NEGATIVE,
    Setting {
        name: "occlusion",
        help: "what stops lobes between two cells: opaque faces, of larger cells where any part \
               is, or nothing",
        unit: "",
        domain: Domain::Choice(&["faces", "none"]),
        default: "faces",
    },
];

fn has_leaves(settings: &Settings) -> bool {
    settings.is("octree", "leaves")
}

fn has_levels(settings: &Settings) -> bool {
    settings.is("octree", "levels")
}

static RULES: &[Rule] = &[
    Rule::always(Group::Structure, &["octree", "resolution", "margin"]),
    Rule {
        group: Group::Structure,
        settings: &["max_level"],
        applies: has_leaves,
    },
    Rule {
        group: Group::Structure,
        settings: &["guard"],
        applies: |settings| has_leaves(settings) && settings.count("max_level") > 0,
    },
    Rule {
        group: Group::Structure,
        settings: &["transfer"],
        applies: has_levels,
    },
    Rule::always(Group::Light, &["source"]),
    Rule {
        group: Group::Light,
        settings: &["rsm_texels", "injection_shift"],
        applies: |settings| settings.is("source", "rsm"),
    },
    Rule {
        group: Group::Bounces,
        settings: &["directions"],
        applies: has_leaves,
    },
    Rule {
        group: Group::Bounces,
        settings: &["propagation", "iterations", "gain", "occlusion"],
        applies: has_levels,
    },
    Rule {
        group: Group::Bounces,
        settings: &["clamp_negative"],
        applies: |settings| has_levels(settings) && !settings.is("propagation", "stream"),
    },
    Rule::always(Group::Bounces, &["bounces"]),
    Rule::always(Group::Gather, &["gather_shift", "gather_filter", "damping"]),
];

static PRESETS: &[Preset] = &[
    Preset {
        name: "accurate",
        help: "discrete directions swept through leaves: single cells near surfaces, larger far \
               off",
        values: &[],
    },
    Preset {
        name: "textbook",
        help: "the published method: 4 steps of 30 lobes in each level, each alone, with a \
               propagation factor of 3, which is a gain of ¾; lookup half a cell off",
        values: &[&[
            ("octree", "levels"),
            ("resolution", "32"),
            ("iterations", "4"),
            ("gain", "0.75"),
            ("occlusion", "none"),
            ("rsm_texels", "256"),
            ("gather_shift", "0.5"),
        ]],
    },
];

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
    &LEVEL_FACES,
    &SEED,
    &DOWN_SAMPLE,
    &PROPAGATE,
    &MERGE_LEVELS,
    &FINISH,
    &GATHER,
    &SPECULAR,
    &VIEW,
    &LEAF_STRUCTURE,
    &LEVEL_STRUCTURE,
];

/// From leaves, or cells of levels, to all others.
static PROPAGATION: Stage = Stage::store(
    "propagation",
    &[
        "lpv.leaf_sources",
        "lpv.leaf_sweep",
        "lpv.leaf_sum",
        "lpv.seed",
        "lpv.down_sample",
        "lpv.propagate",
        "lpv.merge_levels",
        "lpv.finish",
    ],
);

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    bounces: |settings| Some(settings.count("bounces")),
    settings: &[SETTINGS, CELL_SETTINGS],
    rules: &[RULES],
    check,
    substitutions: &[
        SUBSTITUTIONS,
        &[
            Substitution {
                pairs: |settings| without_lobes(settings, &["octree=leaves"]),
                ..LOBES_REPLACED
            },
            Substitution {
                name: "leaves",
                help: "single cells everywhere",
                pairs: |settings| {
                    if settings.is("octree", "leaves") {
                        vec!["max_level=0".to_owned()]
                    } else {
                        Vec::new()
                    }
                },
            },
        ],
    ],
    presets: PRESETS,
    passes: &[PASSES],
    structs: &[STRUCTS],
    views: &[&VIEWS],
    simulator: Some(&SIMULATOR),
    stages: &[
        &OPAQUE_FACES,
        &LIGHT_INJECTION,
        &PROPAGATION,
        &LOOKUP,
        &REFLECTION,
    ],
    ..Entry::new(
        "lpv-octree",
        "light propagation volume swept in larger cells far from surfaces, or stepped in levels of \
         them as published",
        make,
    )
};

fn check(settings: &Settings) -> Result<(), SettingError> {
    check_margin(settings)?;
    if has_leaves(settings) {
        check_directions(settings)
    } else {
        Ok(())
    }
}

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(OneGrid::new(context, settings)?))
}
