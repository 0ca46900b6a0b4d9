//! The row of the registry.

use super::super::entry::{
    GATHER, HIERARCHY, RAYS_TO_EMITTERS, SPECULAR, SUBSTITUTIONS, THROUGH_BODIES, directions,
    entry, lends,
};
use super::super::{VoxelCones, presets, schedule};
use super::{CONES, Clipmap, RAYS, filled, volume};
use crate::gi::entry::{Entry, Stage};
use crate::gi::settings::{Domain, Preset, Setting, Settings};
use crate::gi::shared::cone;
use crate::gi::shared::interleave;
use crate::gi::shared::voxel::{self, FACE_SETTINGS, MIP_FILTER, RAY_SETTINGS};
use crate::gi::{Context, StoreKind, Technique};
use crate::graph::{Error, Pass};

static SETTINGS: &[Setting] = &[
    Setting {
        name: "resolution",
        help: "voxels along an edge of each level",
        unit: "voxels",
        domain: Domain::OneOf(&[16, 32, 64, 128, 256]),
        default: "128",
    },
    Setting {
        name: "levels",
        help: "number of levels, each with twice the extent of the one before; levels that the \
               scene does not fill are left out",
        unit: "",
        domain: Domain::Count { min: 1, max: 7 },
        default: "5",
    },
    Setting {
        name: "voxel_size",
        help: "edge of a voxel of the finest level; 0: such that the outermost level just holds \
               the scene",
        unit: "m",
        domain: Domain::Number { min: 0.0, max: 1e6 },
        default: "0",
    },
    Setting {
        name: "level_updates",
        help: "when a level follows the camera and the lights: every-frame, or staggered (level l \
               in every 2^l-th frame)",
        unit: "",
        domain: Domain::Choice(&["every-frame", "staggered"]),
        default: "every-frame",
    },
    MIP_FILTER,
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

/// The passes of this module.
pub(super) static PASSES: &[&Pass] = &[
    &filled::MARK_FILLED,
    &filled::SPREAD_FILLED,
    &volume::WRITE_VOXELS,
    &volume::CLEAR_BOX,
    &volume::FILTER_INNER,
    &volume::FILTER_TOP,
];

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    settings: &[
        SETTINGS,
        voxel::SETTINGS,
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
        PASSES,
        &CONES.all(),
        &RAYS.all(),
        RAYS_TO_EMITTERS,
    ],
    structs: &[voxel::STRUCTS, cone::STRUCTS],
    stages: &[
        &HIERARCHY,
        &voxel::VOXELIZATION,
        &Stage::store("clearing", &["clipmap.clear", "clipmap.clear_box"]),
        &Stage::store(
            "empty space",
            &["clipmap.mark_filled", "clipmap.spread_filled"],
        ),
        &voxel::LIGHT_INJECTION,
        &Stage::store(
            "leaf writing",
            &["clipmap.write_voxels", "clipmap.merge_radiance"],
        ),
        &Stage::store(
            "mip filtering",
            &["clipmap.filter_inner", "clipmap.filter_top"],
        ),
        &voxel::BOUNCES,
        &voxel::CASTING,
        &GATHER,
        &SPECULAR,
        &THROUGH_BODIES,
        &cone::SOFT_SHADOWS,
    ],
    directions: &directions(&CONES, &RAYS),
    lends: lends(StoreKind::Nested),
    substitutions: &[SUBSTITUTIONS, voxel::SUBSTITUTIONS],
    ..entry(
        "clipmap",
        "nested voxel grids around the camera, traced by exact rays or by cones",
        make,
    )
};

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(VoxelCones::<Clipmap>::new(
        context, settings, "clipmap",
    )?))
}
