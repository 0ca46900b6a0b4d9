//! The row of the registry.

use super::super::entry::{GATHER, SPECULAR, directions, entry};
use super::super::{VoxelCones, presets};
use super::suit::suit;
use super::{CLEAR_DYNAMIC, CONES, FILTER, MARK_MATTER, Mips, REDUCE_MATTER};
use crate::gi::entry::{Directions, Entry, Stage, Substitution};
use crate::gi::settings::{Domain, Preset, Setting, Settings};
use crate::gi::shared::cone;
use crate::gi::shared::interleave::{self, Pattern};
use crate::gi::shared::screen;
use crate::gi::shared::voxel::{self, FACE_SETTINGS, MIP_FILTER, RAY_SETTINGS};
use crate::gi::{Context, Technique};
use crate::graph::Error;

static SETTINGS: &[Setting] = &[
    Setting {
        name: "gather",
        help: "cones through the mips, or exact rays through the finest level (no mips are made \
               then)",
        unit: "",
        domain: Domain::Choice(&["cones", "rays"]),
        default: "cones",
    },
    MIP_FILTER,
    Setting {
        name: "mip_method",
        help: "what runs the box filter: compute, or blit (the hardware's linear filter)",
        unit: "",
        domain: Domain::Choice(&["compute", "blit"]),
        default: "compute",
    },
];

static PRESETS: &[Preset] = &[
    Preset {
        name: "accurate",
        help: "exact rays, interleaved over 4×4 pixels: the least error for its time where walls \
               are flat",
        values: &[&[("gather", "rays")]],
    },
    Preset {
        name: "fast",
        help: "as accurate, but one ray a pixel, with the light of earlier frames and of \
               neighbours",
        values: &[
            &[
                ("gather", "rays"),
                ("rays", "1"),
                ("interleave_window", "off"),
            ],
            screen::settings::FAST,
        ],
    },
    presets::CONES,
    presets::ANISOTROPIC,
    presets::DIRECTIONAL,
    presets::TEXTBOOK,
];

static SUBSTITUTIONS: &[Substitution] = &[
    Substitution {
        name: "directions",
        help: "as many directions as the gather's settings allow, so that no light falls between \
               them",
        pairs: |settings| {
            if settings.is("gather", "rays") {
                more_rays(settings)
            } else {
                cone::more_cones(settings)
            }
        },
    },
    Substitution {
        name: "filtering",
        help: "exact rays through the finest voxels, instead of samples of filtered ones",
        pairs: |settings| {
            if settings.is("gather", "rays") {
                Vec::new()
            } else {
                vec!["gather=rays".into()]
            }
        },
    },
];

/// 4,096 directions in each interleaving window.
fn more_rays(settings: &Settings) -> Vec<String> {
    vec![format!(
        "rays={}",
        (4096 / Pattern::new(settings).count()).max(settings.count("rays"))
    )]
}

static CONE_DIRECTIONS: [Directions; 2] = directions(&CONES);

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    settings: &[
        voxel::RESOLUTION,
        voxel::SETTINGS,
        SETTINGS,
        FACE_SETTINGS,
        cone::SETTINGS,
        interleave::SETTINGS,
        interleave::SPECULAR_SETTINGS,
        RAY_SETTINGS,
    ],
    presets: PRESETS,
    passes: &[
        voxel::PASSES,
        &[&CLEAR_DYNAMIC, &MARK_MATTER, &REDUCE_MATTER, &FILTER],
        &CONES.all(),
    ],
    structs: &[voxel::STRUCTS, cone::STRUCTS],
    stages: &[
        &voxel::VOXELIZATION,
        &Stage::store(
            "clearing",
            &["voxel_mips.clear", "voxel_mips.clear_dynamic"],
        ),
        &Stage::store(
            "empty space",
            &["voxel_mips.mark_matter", "voxel_mips.reduce_matter"],
        ),
        &voxel::LIGHT_INJECTION,
        &Stage::store("mip filtering", &["voxel_mips.filter", "voxel_mips.blit"]),
        &voxel::BOUNCES,
        &GATHER,
        &SPECULAR,
        &cone::SOFT_SHADOWS,
    ],
    directions: &[
        CONE_DIRECTIONS[0],
        Directions {
            pass: &voxel::GATHER_RAYS,
            count: Some(|settings| settings.count("rays")),
        },
        CONE_DIRECTIONS[1],
    ],
    directions_setting: |settings| Some(settings.choice("gather")),
    substitutions: &[SUBSTITUTIONS, voxel::SUBSTITUTIONS],
    suit,
    ..entry("voxel-mips", "dense voxel mips, cone-traced", make)
};

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(VoxelCones::<Mips>::new(
        context,
        settings,
        "voxel_mips",
    )?))
}
