//! What lines of sight see that are no pixel's own, in the finest texels of a volume.

use super::tracer::ConeTracer;
use super::volume::{ConeOutput, March, Volume};
use crate::gpu_struct;
use crate::graph::compute::linear_groups;
use crate::graph::{Access, Binding, Frame};
use crate::render::SightRays;

gpu_struct! {
    /// Parameters of `cone.see`.
    pub struct SeeParams {
        /// xyz: smallest corner of the grid (m); w: voxel size (m).
        pub grid: [f32; 4],
        /// Voxels along an edge of the grid.
        pub resolution: f32,
        /// Number of lines.
        pub ray_count: u32,
        /// Of the volume, from a face of what it stores to the next.
        pub face_stride: u32,
    }
}

pub(in crate::gi) const BINDINGS: [Binding; 2] = [
    Binding::buffer("sight_rays", Access::ComputeRead),
    Binding::buffer("sights", Access::ComputeWrite),
];

impl ConeTracer {
    /// Adds the pass that says what is seen along lines of sight.
    pub fn see(&self, frame: &mut Frame, volume: Volume<'_>, sights: SightRays<'_>) {
        let march = March::new(true, ConeOutput::Light, self.settings.face_weights);
        volume
            .pass(frame, &volume.passes.see, march)
            .bind("sight_rays", sights.rays)
            .bind("sights", sights.sights)
            .push(&SeeParams {
                grid: volume.grid.row(),
                resolution: volume.grid.resolution as f32,
                ray_count: sights.count,
                face_stride: volume.face_stride,
            })
            .dispatch(linear_groups(sights.count));
    }
}
