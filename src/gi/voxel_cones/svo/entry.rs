//! The row of the registry.

use super::super::entry::{
    GATHER, HIERARCHY, RAYS_TO_EMITTERS, SPECULAR, SUBSTITUTIONS, THROUGH_BODIES, VIEWS,
    directions, entry, lends, view,
};
use super::super::{VoxelCones, presets, schedule, suit};
use super::{
    CONES, RAYS, Svo, attributes, brick_passes, dynamic_passes, indirection, nodes, pieces, space,
    touched,
};
use crate::gi::entry::{Entry, Stage};
use crate::gi::inspect::{Scale, ViewRow};
use crate::gi::settings::{Domain, Preset, Setting, Settings};
use crate::gi::shared::cone;
use crate::gi::shared::interleave;
use crate::gi::shared::voxel::{self, FACE_SETTINGS, MIP_FILTER, RAY_SETTINGS};
use crate::gi::{Context, StoreKind, Technique};
use crate::graph::{Error, Pass};
use crate::shader::{GpuStruct, StructLayout};

static SETTINGS: &[Setting] = &[
    Setting {
        name: "lattice",
        help: "where the bricks' texels are: centres (as in the dense mips; a texel is made of 2³ \
               finer ones) or corners (of voxels, as published: voxels spread to eight corners, a \
               level is the 27-tap Gaussian of the finer one)",
        unit: "",
        domain: Domain::Choice(&["centres", "corners"]),
        default: "centres",
    },
    MIP_FILTER,
    Setting {
        name: "filter_split",
        help: "on corners, whether one pass filters a level, or three: for the centres, the faces \
               and edges, and the corners of bricks, so that threads have equal work",
        unit: "",
        domain: Domain::Choice(&["one", "three"]),
        default: "one",
    },
    Setting {
        name: "filter",
        help: "tiles whose bricks an update makes anew: touched (tiles that hold light, or did in \
               the last update; all tiles on corners) or all; both give the same bits",
        unit: "",
        domain: Domain::Choice(&["touched", "all"]),
        default: "touched",
    },
    Setting {
        name: "attributes",
        help: "also makes bricks of the voxels' albedo, mean normal and, where the scene emits, \
               emission: they can then be seen on all levels; no cone reads them",
        unit: "",
        domain: Domain::Choice(&["off", "on"]),
        default: "off",
    },
];

static PRESETS: &[Preset] = &[
    presets::ACCURATE,
    presets::FAST,
    presets::TRIANGLES,
    presets::CONES,
    presets::ANISOTROPIC,
    presets::DIRECTIONAL,
    presets::textbook(
        "as the papers have it: voxels spread to corners, Gaussian bricks, six cones of 60°",
        &[
            &[
                ("lattice", "corners"),
                ("mip_filter", "box"),
                ("filter_split", "three"),
            ],
            cone::TEXTBOOK,
        ],
    ),
];

/// What it can show of its attributes.
static ATTRIBUTE_VIEWS: &[ViewRow] = &[
    view(
        "voxel-albedo",
        &["albedo"],
        "albedo of the bricks (attributes=on), on any level",
        "",
        Scale::Share,
    ),
    view(
        "voxel-normal",
        &["normal"],
        "normal of the bricks (attributes=on), on any level",
        "",
        Scale::Signed,
    ),
    view(
        "voxel-emission",
        &["emission"],
        "emission of the bricks (attributes=on), on any level",
        "W/(m² sr)",
        Scale::Light,
    ),
];

/// The passes of this module.
pub(super) static PASSES: &[&Pass] = &[
    &nodes::REDUCE_POINTS,
    &nodes::FLAG_NODES,
    &nodes::SCAN_NODES,
    &nodes::ALLOCATE_TILES,
    &nodes::LINK_LEAVES,
    &nodes::LINK_NEIGHBOURS,
    &indirection::INDEX_TILES,
    &brick_passes::WRITE_LEAVES,
    &brick_passes::WRITE_NORMALS,
    &attributes::WRITE_ATTRIBUTES,
    &brick_passes::TRANSFER_BORDERS,
    &brick_passes::SUM_BORDERS,
    &brick_passes::FILTER,
    &brick_passes::COPY_BRICKS,
    &dynamic_passes::MARK_AFFECTED,
    &dynamic_passes::FLAG_DYNAMIC,
    &dynamic_passes::ALLOCATE_DYNAMIC,
    &dynamic_passes::FLAG_TEXELS,
    &dynamic_passes::KEEP_STATIC,
    &touched::FLAG_TOUCHED,
    &touched::LIST_TOUCHED,
    &pieces::INJECT_RSM,
    &space::INDEX_CELLS,
    &space::MERGE_RADIANCE,
];

/// The structs that this module shares with shaders, without the parameters of passes.
pub(super) static STRUCTS: &[StructLayout] = &[nodes::Level::LAYOUT, touched::Touched::LAYOUT];

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
    views: &[VIEWS, ATTRIBUTE_VIEWS],
    passes: &[
        voxel::PASSES,
        PASSES,
        &CONES.all(),
        &RAYS.all(),
        RAYS_TO_EMITTERS,
    ],
    structs: &[voxel::STRUCTS, STRUCTS, cone::STRUCTS],
    stages: &[
        &HIERARCHY,
        &voxel::VOXELIZATION,
        &Stage::store(
            "node flagging and allocation",
            &[
                "svo.copy_occupancy",
                "svo.clear",
                "svo.reduce_points",
                "svo.flag_nodes",
                "svo.scan_nodes",
                "svo.allocate_tiles",
                "svo.link_leaves",
                "svo.link_neighbours",
                "svo.mark_affected",
                "svo.flag_dynamic",
                "svo.allocate_dynamic",
                "svo.flag_texels",
                "svo.grow",
                "svo.copy_bricks",
                "svo.index_cells",
                "svo.index_tiles",
            ],
        ),
        &voxel::LIGHT_INJECTION,
        &Stage::store(
            "touched tiles",
            &["svo.clear_touched", "svo.flag_touched", "svo.list_touched"],
        ),
        &Stage::store(
            "leaf writing",
            &[
                "svo.clear_bricks",
                "svo.merge_radiance",
                "svo.write_leaves",
                "svo.write_normals",
                "svo.write_attributes",
            ],
        ),
        &Stage::store(
            "border transfer",
            &["svo.transfer_borders", "svo.sum_borders", "svo.keep_static"],
        ),
        &Stage::store("mip filtering", &["svo.filter"]),
        &voxel::BOUNCES,
        &voxel::CASTING,
        &GATHER,
        &SPECULAR,
        &THROUGH_BODIES,
        &cone::SOFT_SHADOWS,
    ],
    directions: &directions(&CONES, &RAYS),
    lends: lends(StoreKind::Sparse),
    substitutions: &[SUBSTITUTIONS, voxel::SUBSTITUTIONS],
    suit: suit::suit,
    ..entry(
        "svo",
        "sparse voxel octree, traced by exact rays or by cones",
        make,
    )
};

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(VoxelCones::<Svo>::new(context, settings, "svo")?))
}
