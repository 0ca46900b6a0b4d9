//! Voxelization and voxel light, shared by the voxel techniques.
//!
//! Triangles become fragments (one a touched voxel) in one pass; fragments of one voxel become one voxel record. Occupied voxels have compact indices in
//! a fixed order (`gi/voxel/grid.glsl`), so that only they are stored, lit and cleared. `oracle` is the CPU twin.

pub mod export;
mod grid;
pub mod light;
mod list;
pub mod oracle;
pub mod passes;
pub mod rays;
pub mod voxelize;

pub use grid::VoxelGrid;
pub use light::{CLEAR_LIGHT, INJECT_RSM, INJECT_RSM_SPARSE, Injection, LIGHT, LIGHT_DENSE, Sides, VoxelLight, VoxelLookup, VoxelRecords};
pub use list::{OccupiedVoxel, VoxelList, list_voxels};
pub use passes::{FRAGMENTS_COMPUTE, FRAGMENTS_RASTER, FRAGMENTS_RASTER_HW};
pub use rays::{GATHER_RAYS, RAY_SETTINGS, RaySettings, gather_rays};
pub use voxelize::{Accumulation, Method, VoxelSettings, Voxelizer, Voxels};

use crate::gi::registry::{Part, Stage};
use crate::gi::settings::{Domain, Setting};
use crate::graph::Pass;
use crate::shader::{Field, GpuStruct};

/// Settings of voxelization and voxel light.
pub static SETTINGS: &[Setting] = &[
    Setting {
        name: "resolution",
        help: "voxels along the largest extent of the scene",
        unit: "voxels",
        domain: Domain::OneOf(&[8, 16, 32, 64, 128, 256, 512, 1024]),
        default: "128",
    },
    Setting {
        name: "voxelization",
        help: "triangles to fragments: raster (geometry shader, software conservative), raster-hw (hardware conservative) or compute; all give the same voxels",
        unit: "",
        domain: Domain::Choice(&["compute", "raster", "raster-hw"]),
        default: "compute",
    },
    Setting {
        name: "accumulation",
        help: "albedo of a voxel: exact (independent of thread order) or running-average (the papers' compare-and-swap in RGBA8; differs between runs)",
        unit: "",
        domain: Domain::Choice(&["exact", "running-average"]),
        default: "exact",
    },
    Setting {
        name: "opacity",
        help: "of a voxel: binary (touched is opaque) or coverage (fraction of its face that is covered, seen along the dominant axis)",
        unit: "",
        domain: Domain::Choice(&["binary", "coverage"]),
        default: "binary",
    },
    Setting {
        name: "injection",
        help: "direct light into voxels: rsm (flux of reflective shadow maps) or voxel (each voxel shaded from its own albedo and normal)",
        unit: "",
        domain: Domain::Choice(&["rsm", "voxel"]),
        default: "rsm",
    },
];

/// All passes of this module.
pub static PASSES: &[&Pass] = &[
    &FRAGMENTS_COMPUTE,
    &FRAGMENTS_RASTER,
    &FRAGMENTS_RASTER_HW,
    &passes::COUNT_BLOCKS,
    &passes::SCAN_GROUPS,
    &passes::INDEX_BLOCKS,
    &passes::LINK_FRAGMENTS,
    &passes::RUNNING_AVERAGE,
    &passes::RESOLVE_VOXELS,
    &INJECT_RSM,
    &LIGHT,
    &LIGHT_DENSE,
    &GATHER_RAYS,
];

/// Triangles to voxels.
pub static VOXELIZATION: Stage = Stage {
    name: "voxelization",
    part: Part::Store,
    passes: &[
        "voxel.clear",
        "voxel.fragments",
        "voxel.count_blocks",
        "voxel.scan_groups",
        "voxel.index_blocks",
        "voxel.link_fragments",
        "voxel.running_average",
        "voxel.resolve",
    ],
};

/// Direct light into voxels.
pub static LIGHT_INJECTION: Stage = Stage { name: "light injection", part: Part::Store, passes: &["voxel.clear_light", "voxel.inject_rsm", "voxel.light"] };

/// All structs that this module shares with shaders.
pub static STRUCTS: &[(&str, &[Field])] = &[
    (passes::FragmentParams::NAME, passes::FragmentParams::FIELDS),
    (passes::Fragment::NAME, passes::Fragment::FIELDS),
    (passes::Voxel::NAME, passes::Voxel::FIELDS),
    (passes::CountParams::NAME, passes::CountParams::FIELDS),
    (passes::ScanParams::NAME, passes::ScanParams::FIELDS),
    (passes::LinkParams::NAME, passes::LinkParams::FIELDS),
    (passes::ResolveParams::NAME, passes::ResolveParams::FIELDS),
    (light::InjectParams::NAME, light::InjectParams::FIELDS),
    (light::LightParams::NAME, light::LightParams::FIELDS),
    (rays::RayParams::NAME, rays::RayParams::FIELDS),
];
