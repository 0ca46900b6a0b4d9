//! Cone sets and cone marching, shared by the voxel techniques.

pub mod oracle;
mod patches;
mod probe;
mod sets;
mod settings;
mod shadow;
mod tracer;
mod view;
mod volume;

pub use patches::{EmissivePatches, GpuPatch, PATCHES, Patch, PatchParams, patches};
pub use probe::{PROBE, Probe, ProbeAxis, ProbeParams, ProbeSample, ProbeSurface};
pub use sets::{Cone, ConeSet, KahlRings, check, cone_set, diffuse_set, kahl_set};
pub use settings::{NARROWEST, SETTINGS, SUBSTITUTIONS, TEXTBOOK, diffuse_count, more_cones};
pub use shadow::{SHADOW, SOFT_SHADOWS, ShadowConeParams};
pub use tracer::{
    BOUNCE, BounceConeParams, ConeParams, ConeSettings, ConeTracer, GATHER, OCCLUSION, SPECULAR,
    SpecularParams,
};
pub use view::{VIEW, ViewVoxelsParams, VoxelVolume};
pub use volume::{FaceWeights, Volume, VolumePass};

use crate::graph::Pass;
use crate::shader::{Field, GpuStruct};

/// The passes through a dense volume.
pub static PASSES: &[&Pass] = &[
    &GATHER.dense,
    &OCCLUSION.dense,
    &SPECULAR.dense,
    &SHADOW.dense,
    &PATCHES.dense,
    &BOUNCE.dense,
    &VIEW.dense,
    &PROBE.dense,
];

/// The passes through a sparse volume.
pub static SPARSE_PASSES: &[&Pass] = &[
    &GATHER.sparse,
    &OCCLUSION.sparse,
    &SPECULAR.sparse,
    &SHADOW.sparse,
    &PATCHES.sparse,
    &BOUNCE.sparse,
    &VIEW.sparse,
    &PROBE.sparse,
];

/// The passes through a clipmap.
pub static CLIPMAP_PASSES: &[&Pass] = &[
    &GATHER.clipmap,
    &OCCLUSION.clipmap,
    &SPECULAR.clipmap,
    &SHADOW.clipmap,
    &PATCHES.clipmap,
    &BOUNCE.clipmap,
    &VIEW.clipmap,
    &PROBE.clipmap,
];

/// All structs that this module shares with shaders.
pub static STRUCTS: &[(&str, &[Field])] = &[
    (ConeParams::NAME, ConeParams::FIELDS),
    (SpecularParams::NAME, SpecularParams::FIELDS),
    (ShadowConeParams::NAME, ShadowConeParams::FIELDS),
    (GpuPatch::NAME, GpuPatch::FIELDS),
    (PatchParams::NAME, PatchParams::FIELDS),
    (BounceConeParams::NAME, BounceConeParams::FIELDS),
    (ViewVoxelsParams::NAME, ViewVoxelsParams::FIELDS),
    (ProbeParams::NAME, ProbeParams::FIELDS),
];
