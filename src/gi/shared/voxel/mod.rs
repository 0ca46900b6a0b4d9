//! Voxelization and voxel light, shared by the voxel techniques.
//!
//! Triangles become fragments (one a touched voxel) in one pass; fragments of one voxel become one
//! voxel record. Occupied voxels have compact indices in a fixed order
//! (`gi/shared/voxel/grid.glsl`), so
//! that only they are stored, lit and cleared. `oracle` is the CPU twin.

pub mod build;
pub mod dynamic;
pub mod dynamic_passes;
pub mod export;
mod grid;
pub mod light;
pub mod lit_grid;
pub mod oracle;
mod prefilter;
mod survey;
pub mod trace;
mod voxel_box;
pub mod window;
pub mod window_passes;
mod window_scratch;

pub use super::bounces::LightBounces;
pub use build::list::{OccupiedVoxel, VoxelList, list_voxels};
pub use build::passes::{FRAGMENTS_COMPUTE, FRAGMENTS_RASTER, FRAGMENTS_RASTER_HW};
pub use build::settings::{Accumulation, Method, Surface, VoxelSettings};
pub use build::{Interior, Voxelizer, Voxels};
pub use dynamic::DynamicVoxels;
pub use grid::{Lattice, VoxelGrid};
pub use light::inject::{BOUND_TILES, INJECT_RSM, LIST_TILES, VoxelLookup, bound_tiles};
pub use light::passes::{LIGHT, LIGHT_BY_RAYS, LIGHT_BY_RAYS_DENSE, LIGHT_DENSE};
pub use light::settings::{
    Attenuation, EmissionSeenBy, Injection, LightSettings, Occlusion, Sides, Viewer,
};
pub use light::slots::{LitVoxels, VoxelSlots};
pub use light::{CLEAR_LIGHT, DenseTexels, LightInputs, VoxelLight, VoxelRecords, add_counts};
pub use lit_grid::LitGrid;
pub use prefilter::{
    ANISOTROPIC, DIRECTIONAL, Directionality, FACE_SETTINGS, Faces, MIP_FILTER, NormalLobe,
    Prefilter,
};
pub use survey::Survey;
pub use trace::emitters::{CANDIDATES, EmitterPoints, GpuEmitterPart, emitter_rows};
pub use trace::{RAY_SETTINGS, RaySettings, RayTracer, Space, SpacePasses, more_rays};
pub use voxel_box::VoxelBox;
pub use window::{VoxelWindow, WindowMove, move_windows};
pub use window_scratch::WindowScratch;

use crate::gi::CAST;
use crate::gi::entry::{Stage, Substitution};
use crate::gi::settings::{Domain, Setting};
use crate::graph::Pass;
use crate::shader::{GpuStruct, StructLayout};

/// The setting that says how fine a grid around the scene is.
pub static RESOLUTION: &[Setting] = &[Setting {
    name: "resolution",
    help: "voxels along the largest extent of the scene",
    unit: "voxels",
    domain: Domain::OneOf(&[8, 16, 32, 64, 128, 256, 512, 1024, 2048]),
    default: "128",
}];

/// Settings of voxelization and voxel light.
pub static SETTINGS: &[Setting] = &[
    Setting {
        name: "voxelization",
        help: "triangles to fragments: raster (geometry shader, software conservative), raster-hw \
               (hardware conservative) or compute; all give the same voxels",
        unit: "",
        domain: Domain::Choice(&["compute", "raster", "raster-hw"]),
        default: "compute",
    },
    Setting {
        name: "surface",
        help: "voxels that a triangle is in: conservative (all that it touches) or thin (those \
               whose cross of face centres it meets: no path from face to face leads through); \
               solid: conservative, and black ones inside of closed static bodies",
        unit: "",
        domain: Domain::Choice(&["conservative", "thin", "solid"]),
        default: "conservative",
    },
    Setting {
        name: "accumulation",
        help: "albedo of a voxel: exact (independent of thread order) or running-average (the \
               papers' compare-and-swap in RGBA8; differs between runs)",
        unit: "",
        domain: Domain::Choice(&["exact", "running-average"]),
        default: "exact",
    },
    Setting {
        name: "opacity",
        help: "opacity of a voxel, as cones see it: binary (any touched voxel is opaque) or \
               coverage (covered fraction of its face, seen along the dominant axis)",
        unit: "",
        domain: Domain::Choice(&["binary", "coverage"]),
        default: "binary",
    },
    Setting {
        name: "injection",
        help: "direct light into voxels: rsm (flux of reflective shadow maps) or voxel (each \
               voxel shaded from its own albedo and normal)",
        unit: "",
        domain: Domain::Choice(&["rsm", "voxel"]),
        default: "rsm",
    },
    Setting {
        name: "rsm_per_voxel",
        help: "texels of reflective shadow maps along an edge of a voxel, were a map as wide as \
               the scene; at most as many as shadow maps have; 0: just as many",
        unit: "texels",
        domain: Domain::Count { min: 0, max: 64 },
        default: "4",
    },
    Setting {
        name: "attenuation",
        help: "how light on shaded voxels (injection = voxel, and holes of rsm) depends on its \
               angle: standard (cosine to the mean normal) or normal-weighted (cosines to the \
               faces on the mean normal's side, weighted with the squares of its components)",
        unit: "",
        domain: Domain::Choice(&["standard", "normal-weighted"]),
        default: "standard",
    },
    Setting {
        name: "voxel_occlusion",
        help: "what hides a light from voxels that are shaded: the shadow map (at their mean \
               position), shadow-map-area (the same, but a voxel with several planes is lit by the \
               area that the map shows in it), the shadow map moved half a voxel along the normal, \
               rays-hard (the first voxel that a ray to the light hits), rays-soft (all that it \
               hits, nearer ones more) or triangles (rays against the scene's own triangles, from \
               points of the voxel's surface)",
        unit: "",
        domain: Domain::Choice(&[
            "shadow-map",
            "shadow-map-area",
            "shadow-map-moved",
            "rays-hard",
            "rays-soft",
            "triangles",
        ]),
        default: "shadow-map",
    },
    Setting {
        name: "occlusion_kappa",
        help: "κ of rays-soft: a voxel hit at a distance t hides κ/t of what is left of the light",
        unit: "voxels",
        domain: Domain::Number { min: 0.0, max: 1e4 },
        default: "8",
    },
    Setting {
        name: "bounces",
        help: "indirect bounces: 1 (what voxels reflect of the lights and emit), 2 to 4 (voxels \
               also reflect what they gather from each other, once more for each), or feedback \
               (one more with each frame, from the voxels of the last one: all of them after some \
               frames)",
        unit: "",
        domain: Domain::Choice(&["1", "2", "3", "4", "feedback"]),
        default: "1",
    },
    Setting {
        name: "bounce_directions",
        help: "cones or rays by which each voxel, or each side of it, gathers a bounce; \
               neighbours take different ones",
        unit: "",
        domain: Domain::Count { min: 1, max: 256 },
        default: "8",
    },
];

/// What an error budget tries in place of the settings above.
pub static SUBSTITUTIONS: &[Substitution] = &[Substitution {
    name: "bounce directions",
    help: "64 directions by which each voxel gathers from the others",
    pairs: |settings| {
        let is_better =
            LightBounces::new(settings).any() && settings.count("bounce_directions") < 64;
        if is_better {
            vec!["bounce_directions=64".into()]
        } else {
            Vec::new()
        }
    },
}];

/// All passes of this module.
pub static PASSES: &[&Pass] = &[
    &FRAGMENTS_COMPUTE,
    &FRAGMENTS_RASTER,
    &FRAGMENTS_RASTER_HW,
    &build::passes::COLUMNS,
    &build::passes::FILL,
    &build::passes::COUNT_BLOCKS,
    &build::passes::SCAN_GROUPS,
    &build::passes::INDEX_BLOCKS,
    &build::passes::LINK_FRAGMENTS,
    &build::passes::RUNNING_AVERAGE,
    &build::passes::RESOLVE_VOXELS,
    &build::passes::RESOLVE_OPPOSED,
    &dynamic_passes::RESTORE_BLOCKS,
    &dynamic_passes::COUNT_TOUCHED,
    &dynamic_passes::SCAN_TOUCHED,
    &dynamic_passes::INDEX_TOUCHED,
    &dynamic_passes::CONTINUE_LISTS,
    &window_passes::SHIFT_BLOCKS,
    &window_passes::EMPTY_BLOCKS,
    &window_passes::MOVE_RECORDS,
    &BOUND_TILES,
    &LIST_TILES,
    &INJECT_RSM,
    &LIGHT,
    &LIGHT_DENSE,
    &LIGHT_BY_RAYS,
    &LIGHT_BY_RAYS_DENSE,
    &trace::blocks::PACK_BLOCKS,
    &trace::surfaces::PACK_SURFACES,
];

/// Triangles to voxels.
pub static VOXELIZATION: Stage = Stage::store(
    "voxelization",
    &[
        "voxel.clear",
        "voxel.fragments",
        "voxel.columns",
        "voxel.fill",
        "voxel.count_blocks",
        "voxel.scan_groups",
        "voxel.index_blocks",
        "voxel.link_fragments",
        "voxel.running_average",
        "voxel.resolve",
        "voxel.resolve_opposed",
        "voxel.restore_blocks",
        "voxel.count_touched",
        "voxel.scan_touched",
        "voxel.index_touched",
        "voxel.continue_lists",
        "voxel.grow",
        "voxel.shift_blocks",
        "voxel.empty_blocks",
        "voxel.move_records",
        "voxel.pack_blocks",
        "voxel.pack_surfaces",
    ],
);

/// Direct light into voxels.
pub static LIGHT_INJECTION: Stage = Stage::store(
    "light injection",
    &[
        "voxel.clear_light",
        "voxel.bound_tiles",
        "voxel.list_tiles",
        "voxel.inject_rsm",
        "voxel.light",
    ],
);

/// Light from voxel to voxel.
pub static BOUNCES: Stage = Stage::store("bounces", &["voxel.bounce", "voxel.bounce_emitters"]);

/// Rays of other techniques.
pub static CASTING: Stage = Stage::store("casting", &[CAST]);

/// The structs that this module shares with shaders, without the parameters of passes.
pub static STRUCTS: &[StructLayout] = &[
    build::passes::Fragment::LAYOUT,
    build::passes::Voxel::LAYOUT,
    dynamic_passes::TouchedBlock::LAYOUT,
    dynamic_passes::TouchedCounters::LAYOUT,
    GpuEmitterPart::LAYOUT,
];
