//! What rows of the family have in common: settings, passes and stages.

use super::bands::{FINISH_BANDS, SEED_BANDS, STREAM};
use super::blockers::{CAMERA_GEOMETRY, GEOMETRY, MERGE, MERGE_CAMERA};
use super::by_direction::{GATHER_DIRECTIONS, SPECULAR_DIRECTIONS};
use super::cell_settings::{CellSettings, Source};
use super::faces::{FACES, LIGHT_SIDES, NEAREST, NUMBER_SIDES, SURFACES, Side};
use super::gather::{GATHER, SPECULAR};
use super::grid::GridRow;
use super::inject::INJECT;
use super::jacobi::{JACOBI, JACOBI_SUM};
use super::lobes::{FINISH, PROPAGATE, SEED};
use super::peel::PEEL;
use super::slices::SLICES;
use super::sweep::{SOURCES, SUM, SWEEP};
use super::view::VIEW;
use crate::gi::Settings;
use crate::gi::entry::{Stage, Substitution};
use crate::gi::settings::{Domain, Group, Rule, Setting, SettingError};
use crate::graph::Pass;
use crate::shader::{GpuStruct, StructLayout};

/// How cells are lit and looked up.
pub(super) static CELL_SETTINGS: &[Setting] = &[
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
    Setting {
        name: "gather_filter",
        help: "of the eight cells around the lookup, all, or those whose centre is not behind the \
               surface",
        unit: "",
        domain: Domain::Choice(&["trilinear", "masked"]),
        default: "trilinear",
    },
    Setting {
        name: "damping",
        help: "whether light is damped where it falls off from the surface, as it does where it \
               leaks: a look, not a measure of light",
        unit: "",
        domain: Domain::Choice(&["on", "off"]),
        default: "off",
    },
];

/// Around the scene, of one grid.
pub(super) const MARGIN: Setting = Setting {
    name: "margin",
    help: "empty cells at either end of every axis, within the resolution",
    unit: "cells",
    domain: Domain::Count { min: 1, max: 8 },
    default: "1",
};

/// How often lobes are handed on.
pub(super) const ITERATIONS: Setting = Setting {
    name: "iterations",
    help: "steps of all cells at once; light comes as many cells far",
    unit: "",
    domain: Domain::Count { min: 1, max: 1024 },
    default: "8",
};

/// How much of them.
pub(super) const GAIN: Setting = Setting {
    name: "gain",
    help: "fraction of the flux that goes on at each step",
    unit: "",
    domain: Domain::Number { min: 0.0, max: 1.0 },
    default: "1",
};

/// What becomes of flux below 0.
pub(super) const CLAMP_NEGATIVE: Setting = Setting {
    name: "clamp_negative",
    help: "whether flux through a face that two bands make negative is 0",
    unit: "",
    domain: Domain::Choice(&["on", "off"]),
    default: "on",
};

/// What else light may go along than discrete directions, and what stops it.
pub(super) static LOBE_SETTINGS: &[Setting] = &[
    Setting {
        name: "propagation",
        help: "discrete directions, swept once; or the published steps of all cells at once: \
               30 lobes (2010), one along each axis (2009), or streams that keep direction",
        unit: "",
        domain: Domain::Choice(&["ordinates", "lobes30", "axis6", "stream"]),
        default: "ordinates",
    },
    Setting {
        name: "scheme",
        help: "where a swept cell's light comes from: upwind, its three upwind neighbours; or \
               slices, the four cells of the slice before around the point that it comes from",
        unit: "",
        domain: Domain::Choice(&["upwind", "slices"]),
        default: "upwind",
    },
    Setting {
        name: "schedule",
        help: "of discrete directions: sweep, each cell once, from its upwind neighbours; or \
               jacobi, all cells at once, from the step before, which costs more",
        unit: "",
        domain: Domain::Choice(&["sweep", "jacobi"]),
        default: "sweep",
    },
    ITERATIONS,
    GAIN,
    CLAMP_NEGATIVE,
    Setting {
        name: "bands",
        help: "bands of spherical harmonics that streams keep: 4 have the least error; 3 have more \
               than 2, with a warning",
        unit: "",
        domain: Domain::OneOf(&[2, 3, 4]),
        default: "2",
    },
    Setting {
        name: "occlusion",
        help: "what stops light between two cells: opaque faces, nothing, or the blocking \
               potential of the surfaces that lights see",
        unit: "",
        domain: Domain::Choice(&["faces", "none", "fuzzy"]),
        default: "faces",
    },
    Setting {
        name: "blocker_layers",
        help: "layers of surfaces that the camera sees, which block light besides those that \
               lights see: 0, none; 1, the nearest; more, those behind by depth peeling. Light \
               then depends on the view",
        unit: "",
        domain: Domain::Count { min: 0, max: 4 },
        default: "0",
    },
];

fn has_directions(settings: &Settings) -> bool {
    settings.is("propagation", "ordinates")
}

/// Their groups, and when they have an effect.
pub(super) static RULES: &[Rule] = &[
    Rule::always(Group::Structure, &["resolution"]),
    Rule::always(Group::Light, &["source"]),
    Rule {
        group: Group::Light,
        settings: &["rsm_texels"],
        applies: |settings| settings.is("source", "rsm") || settings.is("occlusion", "fuzzy"),
    },
    Rule {
        group: Group::Light,
        settings: &["injection_shift"],
        applies: |settings| settings.is("source", "rsm"),
    },
    Rule::always(Group::Bounces, &["propagation", "occlusion", "bounces"]),
    Rule {
        group: Group::Bounces,
        settings: &["blocker_layers"],
        applies: |settings| settings.is("occlusion", "fuzzy"),
    },
    Rule {
        group: Group::Bounces,
        settings: &["directions"],
        applies: has_directions,
    },
    Rule {
        group: Group::Bounces,
        settings: &["schedule"],
        applies: has_directions,
    },
    Rule {
        group: Group::Bounces,
        settings: &["scheme"],
        applies: |settings| has_directions(settings) && settings.is("schedule", "sweep"),
    },
    Rule {
        group: Group::Bounces,
        settings: &["iterations"],
        applies: |settings| !has_directions(settings) || settings.is("schedule", "jacobi"),
    },
    Rule {
        group: Group::Bounces,
        settings: &["gain"],
        applies: |settings| !has_directions(settings),
    },
    Rule {
        group: Group::Bounces,
        settings: &["clamp_negative"],
        applies: |settings| {
            settings.is("propagation", "lobes30") || settings.is("propagation", "axis6")
        },
    },
    Rule {
        group: Group::Bounces,
        settings: &["bands"],
        applies: |settings| settings.is("propagation", "stream"),
    },
    Rule::always(Group::Gather, &["gather_shift", "gather_filter"]),
    Rule {
        group: Group::Gather,
        settings: &["damping"],
        applies: |settings| !CellSettings::new(settings).keeps_directions,
    },
];

/// What an error budget tries where directions are swept.
pub(super) static SUBSTITUTIONS: &[Substitution] = &[
    Substitution {
        name: "directions",
        help: "four times as many directions, so that less light falls between them",
        pairs: |settings| {
            let cells = CellSettings::new(settings);
            let more = (4 * cells.directions).min(1024);
            if cells.lobes.is_none() && more > cells.directions {
                vec![format!("directions={more}")]
            } else {
                Vec::new()
            }
        },
    },
    Substitution {
        name: "schedule",
        help: "each cell once in upwind order, so that light comes as far as there are cells",
        pairs: |settings| {
            if CellSettings::new(settings).lobes.is_none()
                && settings.find_choice("schedule") == Some("jacobi")
            {
                vec!["schedule=sweep".to_owned()]
            } else {
                Vec::new()
            }
        },
    },
    Substitution {
        name: "texels",
        help: "four times as many texels of the maps along each edge",
        pairs: |settings| {
            let cells = CellSettings::new(settings);
            if cells.source == Source::Rsm && cells.rsm_texels <= 512 {
                vec![format!("rsm_texels={}", 4 * cells.rsm_texels)]
            } else {
                Vec::new()
            }
        },
    },
    Substitution {
        name: "source",
        help: "light that starts at opaque faces, not in the cells before them",
        pairs: |settings| {
            let cells = CellSettings::new(settings);
            if cells.source == Source::Rsm && cells.lobes.is_none() {
                vec!["source=faces".to_owned(), "occlusion=faces".to_owned()]
            } else {
                Vec::new()
            }
        },
    },
];

/// By what an error budget replaces lobes; with these pairs besides.
pub(super) fn without_lobes(settings: &Settings, besides: &[&str]) -> Vec<String> {
    if CellSettings::new(settings).lobes.is_none() {
        return Vec::new();
    }
    let pairs = ["occlusion=faces", "gather_shift=1"];
    pairs
        .iter()
        .chain(besides)
        .map(|pair| (*pair).to_owned())
        .collect()
}

/// What [`without_lobes`] replaces.
pub(super) const LOBES_REPLACED: Substitution = Substitution {
    name: "lobes",
    help: "discrete directions through opaque faces, not lobes",
    pairs: |settings| without_lobes(settings, &["propagation=ordinates"]),
};

/// The passes from surfaces to cells and from cells to pixels.
pub(super) static PASSES: &[&Pass] = &[
    &FACES,
    &NUMBER_SIDES,
    &NEAREST,
    &SURFACES,
    &INJECT,
    &LIGHT_SIDES,
    &SOURCES,
    &SWEEP,
    &SUM,
    &SLICES,
    &JACOBI,
    &JACOBI_SUM,
    &GEOMETRY,
    &MERGE,
    &PEEL,
    &CAMERA_GEOMETRY,
    &MERGE_CAMERA,
    &SEED,
    &PROPAGATE,
    &FINISH,
    &SEED_BANDS,
    &STREAM,
    &FINISH_BANDS,
    &GATHER,
    &SPECULAR,
    &VIEW,
];

/// The passes of a lookup direction by direction.
pub(super) static BY_DIRECTION: &[&Pass] = &[&GATHER_DIRECTIONS, &SPECULAR_DIRECTIONS];

/// Structs of their buffers.
pub(super) static STRUCTS: &[StructLayout] = &[("CellGrid", GridRow::FIELDS), Side::LAYOUT];

/// Which neighbours cannot see each other.
pub(super) static OPAQUE_FACES: Stage = Stage::store(
    "opaque faces",
    &[
        "lpv.clear_faces",
        "lpv.faces",
        "lpv.number_sides",
        "lpv.nearest",
        "lpv.surfaces",
        "lpv.shift_faces",
        "lpv.shift_sides",
        "lpv.level_faces",
    ],
);

/// Light into cells.
pub(super) static LIGHT_INJECTION: Stage = Stage::store(
    "light injection",
    &[
        "lpv.clear_flux",
        "lpv.inject",
        "lpv.light_sides",
        "lpv.compare",
    ],
);

/// What blocks lobes.
static GEOMETRY_VOLUME: Stage = Stage::store(
    "geometry volume",
    &[
        "lpv.clear_areas",
        "lpv.geometry",
        "lpv.merge",
        "lpv.peel",
        "lpv.camera_geometry",
        "lpv.merge_camera",
    ],
);

/// From cells to all others.
static PROPAGATION: Stage = Stage::store(
    "propagation",
    &[
        "lpv.sources",
        "lpv.sweep",
        "lpv.sum",
        "lpv.slices",
        "lpv.jacobi",
        "lpv.jacobi_sum",
        "lpv.seed",
        "lpv.propagate",
        "lpv.finish",
        "lpv.seed_bands",
        "lpv.stream",
        "lpv.finish_bands",
    ],
);

/// From cells to pixels.
pub(super) static LOOKUP: Stage =
    Stage::picture("gather", &["lpv.gather", "lpv.gather_directions"]);

/// Glossy reflection.
pub(super) static REFLECTION: Stage =
    Stage::picture("specular", &["lpv.specular", "lpv.specular_directions"]);

/// The steps of techniques that keep cells in grids.
pub(super) static STAGES: &[&Stage] = &[
    &OPAQUE_FACES,
    &LIGHT_INJECTION,
    &GEOMETRY_VOLUME,
    &PROPAGATION,
    &LOOKUP,
    &REFLECTION,
];

/// Whether the margin leaves cells for the scene.
pub(super) fn check_margin(settings: &Settings) -> Result<(), SettingError> {
    let (margin, cells) = (settings.count("margin"), settings.count("resolution"));
    if 2 * margin < cells {
        return Ok(());
    }
    Err(SettingError::Together(format!(
        "margin={margin}: resolution={cells} leaves no cell for the scene; give a margin below {}",
        cells.div_ceil(2)
    )))
}

/// Warns of settings that give more error than others that cost less.
pub(super) fn warn(settings: &Settings) {
    if settings.is("propagation", "stream") && settings.count("bands") == 3 {
        log::warn!("bands=3: streams in three bands have more error than in two; give 2 or 4");
    }
}

/// Settings that do not go together.
pub(super) fn check(settings: &Settings) -> Result<(), SettingError> {
    if !has_directions(settings) {
        return Ok(());
    }
    let occlusion = settings.choice("occlusion");
    if occlusion == "fuzzy" {
        return Err(SettingError::Together(
            "occlusion=fuzzy: propagation=ordinates has opaque faces or nothing; give \
             occlusion=faces or none, or another propagation"
                .to_owned(),
        ));
    }
    if occlusion == "none" && (settings.is("source", "faces") || settings.count("bounces") > 1) {
        return Err(SettingError::Together(
            "occlusion=none: with propagation=ordinates, light that starts at faces and further \
             bounces need occlusion=faces"
                .to_owned(),
        ));
    }
    check_directions(settings)
}

/// Each octant is to have directions.
pub(super) fn check_directions(settings: &Settings) -> Result<(), SettingError> {
    match settings.count("directions") {
        count @ 1..8 => Err(SettingError::Together(format!(
            "directions={count}: light needs at least one direction in each of the 8 octants; \
             give 8 or more, or 0 for three times the resolution"
        ))),
        _ => Ok(()),
    }
}
