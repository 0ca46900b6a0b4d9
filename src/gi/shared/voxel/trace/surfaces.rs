//! What rays read of the voxels that they meet, packed: where the records of all voxels are in
//! several buffers, or would be more than one may hold.

use std::sync::Arc;

use crate::gpu_struct;
use crate::graph::compute::{linear_groups, read, write};
use crate::graph::{Buffer, Frame, Pass};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `voxel.pack_surfaces`.
    pub struct PackParams {
        /// Number of the first voxel among all.
        pub first_voxel: u32,
        /// Number of records.
        pub voxel_count: u32,
    }
}

/// Bytes of a packed surface: mean position, mean normal, sides, and area across the axes
/// (`gi/shared/voxel/records.glsl`).
pub const SURFACE_BYTES: u64 = 12;

/// What rays read of each voxel. A thread a voxel.
pub static PACK_SURFACES: Pass = Pass::compute(
    "voxel.pack_surfaces",
    "gi/shared/voxel/trace/pack_surfaces.comp",
    &[read("voxels"), write("surfaces")],
    PackParams::LAYOUT,
);

/// Adds the pass for the records of some voxels, the first of which is number `first_voxel`.
pub fn pack_surfaces(
    frame: &mut Frame,
    (records, voxel_count): (&Arc<Buffer>, u32),
    surfaces: &Arc<Buffer>,
    first_voxel: u32,
) {
    frame
        .pass(&PACK_SURFACES)
        .bind("voxels", records)
        .bind("surfaces", surfaces)
        .push(&PackParams {
            first_voxel,
            voxel_count,
        })
        .dispatch(linear_groups(voxel_count));
}
