//! The row of the registry.

use super::super::entry::{
    GATHER, HIERARCHY, RAYS_TO_EMITTERS, SPECULAR, SUBSTITUTIONS, THROUGH_BODIES, directions,
    entry, lends,
};
use super::super::{VoxelCones, presets, schedule, suit};
use super::{CLEAR_DYNAMIC, CONES, FILTER, LIST_GROUPS, MARK_MATTER, Mips, RAYS, REDUCE_MATTER};
use crate::gi::entry::{Entry, Stage};
use crate::gi::settings::{Domain, Preset, Setting, Settings};
use crate::gi::shared::cone;
use crate::gi::shared::interleave;
use crate::gi::shared::voxel::{self, FACE_SETTINGS, MIP_FILTER, RAY_SETTINGS};
use crate::gi::{Context, StoreKind, Technique};
use crate::graph::Error;

static SETTINGS: &[Setting] = &[
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
    presets::ACCURATE,
    presets::FAST,
    presets::TRIANGLES,
    presets::CONES,
    presets::ANISOTROPIC,
    presets::DIRECTIONAL,
    presets::TEXTBOOK,
];

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    settings: &[
        voxel::RESOLUTION,
        voxel::SETTINGS,
        SETTINGS,
        FACE_SETTINGS,
        schedule::SETTINGS,
        cone::SETTINGS,
        interleave::SETTINGS,
        interleave::SPECULAR_SETTINGS,
        RAY_SETTINGS,
    ],
    presets: PRESETS,
    passes: &[
        voxel::PASSES,
        &[
            &CLEAR_DYNAMIC,
            &MARK_MATTER,
            &REDUCE_MATTER,
            &LIST_GROUPS,
            &FILTER,
        ],
        &CONES.all(),
        &RAYS.all(),
        RAYS_TO_EMITTERS,
    ],
    structs: &[voxel::STRUCTS, cone::STRUCTS],
    stages: &[
        &HIERARCHY,
        &voxel::VOXELIZATION,
        &Stage::store(
            "clearing",
            &["voxel_mips.clear", "voxel_mips.clear_dynamic"],
        ),
        &Stage::store(
            "empty space",
            &[
                "voxel_mips.mark_matter",
                "voxel_mips.reduce_matter",
                "voxel_mips.list_groups",
            ],
        ),
        &voxel::LIGHT_INJECTION,
        &Stage::store("mip filtering", &["voxel_mips.filter", "voxel_mips.blit"]),
        &voxel::BOUNCES,
        &voxel::CASTING,
        &GATHER,
        &SPECULAR,
        &THROUGH_BODIES,
        &cone::SOFT_SHADOWS,
    ],
    directions: &directions(&CONES, &RAYS),
    lends: lends(StoreKind::Dense),
    substitutions: &[SUBSTITUTIONS, voxel::SUBSTITUTIONS],
    suit: suit::suit,
    ..entry(
        "voxel-mips",
        "dense voxels with mips, traced by exact rays or by cones",
        make,
    )
};

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(VoxelCones::<Mips>::new(
        context,
        settings,
        "voxel_mips",
    )?))
}
