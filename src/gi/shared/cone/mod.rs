//! Cone sets and cone marching, shared by the voxel techniques.

pub mod oracle;
pub(in crate::gi) mod patches;
mod sets;
mod settings;
pub(in crate::gi) mod shadow;
pub(in crate::gi) mod trace;
pub(in crate::gi) mod tracer;
pub(in crate::gi) mod view;
pub(in crate::gi) mod volume;

pub use patches::{EmissivePatches, GpuPatch, Patch, PatchParams, patches};
pub use sets::{Cone, ConeSet, KahlRings, check, cone_set, diffuse_set, kahl_set};
pub use settings::{NARROWEST, SETTINGS, SUBSTITUTIONS, TEXTBOOK, diffuse_count, more_cones};
pub use shadow::{SOFT_SHADOWS, ShadowConeParams};
pub use trace::{TraceAxis, TraceParams, TraceSample, TraceSurface, TracedCone};
pub use tracer::{BounceConeParams, ConeParams, ConeSettings, ConeTracer, SpecularParams};
pub use view::{ViewVoxelsParams, VoxelVolume};
pub use volume::{Bound, Constant, FaceWeights, Volume, VolumePasses};

use crate::shader::{Field, GpuStruct};

/// All structs that this module shares with shaders.
pub static STRUCTS: &[(&str, &[Field])] = &[
    (ConeParams::NAME, ConeParams::FIELDS),
    (SpecularParams::NAME, SpecularParams::FIELDS),
    (ShadowConeParams::NAME, ShadowConeParams::FIELDS),
    (GpuPatch::NAME, GpuPatch::FIELDS),
    (PatchParams::NAME, PatchParams::FIELDS),
    (BounceConeParams::NAME, BounceConeParams::FIELDS),
    (ViewVoxelsParams::NAME, ViewVoxelsParams::FIELDS),
    (TraceParams::NAME, TraceParams::FIELDS),
];
