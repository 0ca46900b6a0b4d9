//! The row of the registry.

use super::faces::{FACES, LIGHT_SIDES, NEAREST, NUMBER_SIDES, SURFACES, Side};
use super::gather::{GATHER, SPECULAR};
use super::grid::GridRow;
use super::inject::INJECT;
use super::sweep::{SOURCES, SUM, SWEEP};
use super::view::{CELLS, VIEW};
use super::{Settings, make};
use crate::gi::entry::{Entry, Stage};
use crate::gi::settings::{Domain, Group, Preset, Rule, Setting, SettingError};
use crate::shader::GpuStruct;

static SETTINGS: &[Setting] = &[
    Setting {
        name: "resolution",
        help: "cells along the longest side of the scene, with an empty one at either end",
        unit: "cells",
        domain: Domain::Count { min: 8, max: 256 },
        default: "64",
    },
    Setting {
        name: "directions",
        help: "discrete directions that light goes along, at least 8; 0: three times the \
               resolution",
        unit: "",
        domain: Domain::Count { min: 0, max: 1024 },
        default: "0",
    },
    Setting {
        name: "source",
        help: "where light starts: texels of reflective shadow maps, or opaque faces, lit where \
               the segment between two cells meets a surface",
        unit: "",
        domain: Domain::Choice(&["rsm", "faces"]),
        default: "rsm",
    },
    Setting {
        name: "bounces",
        help: "bounces, each a sweep; from the second on, light comes from opaque faces",
        unit: "",
        domain: Domain::Count { min: 1, max: 8 },
        default: "1",
    },
    Setting {
        name: "rsm_texels",
        help: "texels along an edge of each reflective shadow map that inject light",
        unit: "texels",
        domain: Domain::Count { min: 16, max: 2048 },
        default: "128",
    },
    Setting {
        name: "injection_shift",
        help: "how far off the surface its light is injected, times |nx| + |ny| + |nz|",
        unit: "cells",
        domain: Domain::Number { min: 0.0, max: 2.0 },
        default: "0.5",
    },
    Setting {
        name: "gather_shift",
        help: "how far off the surface light is looked up, times |nx| + |ny| + |nz|",
        unit: "cells",
        domain: Domain::Number { min: 0.0, max: 2.0 },
        default: "1",
    },
];

static RULES: &[Rule] = &[
    Rule::always(Group::Structure, &["resolution"]),
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
    help: "discrete directions swept through opaque faces: it converges as cells shrink",
    values: &[],
}];

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    bounces: |settings| Some(settings.count("bounces")),
    settings: &[SETTINGS],
    rules: &[RULES],
    check,
    presets: PRESETS,
    passes: &[&[
        &FACES,
        &NUMBER_SIDES,
        &NEAREST,
        &SURFACES,
        &INJECT,
        &LIGHT_SIDES,
        &SOURCES,
        &SWEEP,
        &SUM,
        &GATHER,
        &SPECULAR,
        &VIEW,
    ]],
    structs: &[&[("CellGrid", GridRow::FIELDS), Side::LAYOUT]],
    views: &[std::slice::from_ref(&CELLS)],
    stages: &[
        &Stage::store(
            "opaque faces",
            &[
                "lpv.clear_faces",
                "lpv.faces",
                "lpv.number_sides",
                "lpv.nearest",
                "lpv.surfaces",
            ],
        ),
        &Stage::store(
            "light injection",
            &["lpv.clear_flux", "lpv.inject", "lpv.light_sides"],
        ),
        &Stage::store("propagation", &["lpv.sources", "lpv.sweep", "lpv.sum"]),
        &Stage::picture("gather", &["lpv.gather"]),
        &Stage::picture("specular", &["lpv.specular"]),
    ],
    ..Entry::new(
        "lpv",
        "light propagation volume, swept along discrete directions",
        make,
    )
};

fn check(settings: &Settings) -> Result<(), SettingError> {
    match settings.count("directions") {
        count @ 1..8 => Err(SettingError::Together(format!(
            "directions={count}: light needs at least one direction in each of the 8 octants; \
             give 8 or more, or 0 for three times the resolution"
        ))),
        _ => Ok(()),
    }
}
