//! Cone sets and cone marching, shared by the voxel techniques.

mod march;
mod occlusion;
pub mod oracle;
pub(in crate::gi) mod patches;
pub(in crate::gi) mod see;
mod sets;
mod settings;
pub(in crate::gi) mod shadow;
pub(in crate::gi) mod trace;
pub(in crate::gi) mod tracer;
pub(in crate::gi) mod view;
pub(in crate::gi) mod volume;

pub use march::{ConeSettings, MarchSettings};
pub use patches::{EmissivePatches, EmitterMethod, GpuPatch, Patch, PatchParams, patches};
pub use see::SeeParams;
pub use sets::{Cone, ConeSet, KahlRings, check, cone_set, diffuse_set, kahl_set};
pub use settings::{SETTINGS, TEXTBOOK, diffuse_count, more_cones};
pub use shadow::{ObscureParams, SOFT_SHADOWS, ShadowConeParams};
pub use trace::TraceParams;
pub use tracer::{BounceConeParams, ConeParams, ConeTracer, SpecularParams};
pub use view::{ViewVoxelsParams, VoxelVolume};
pub use volume::{FaceWeights, Volume, VolumePasses};

use crate::shader::{GpuStruct, StructLayout};

/// The structs that this module shares with shaders, but for the parameters of passes.
pub static STRUCTS: &[StructLayout] = &[GpuPatch::LAYOUT, MarchSettings::LAYOUT];
