//! How cones are marched: what every pass that does is told.

use super::tracer::ConeSettings;
use super::volume::Volume;
use crate::gpu_struct;

gpu_struct! {
    /// How a cone is marched, as `gi/shared/cone/march.glsl` reads it.
    pub struct MarchSettings {
        /// Voxels along an edge of the grid.
        pub resolution: f32,
        /// β.
        pub step_factor: f32,
        /// g.
        pub opacity_exponent: f32,
        /// k; 0: off.
        pub height_clamp: f32,
        /// Longest distance (voxels).
        pub max_distance: f32,
        /// Edge of a voxel (m).
        pub voxel_size_m: f32,
        /// λ (1/m).
        pub ao_falloff: f32,
        /// Start along the geometric normal (texels read there).
        pub start_offset: f32,
    }
}

impl ConeSettings {
    /// Through a volume, without the falloff of ambient visibility.
    pub(super) fn march(&self, volume: Volume<'_>) -> MarchSettings {
        MarchSettings {
            resolution: volume.grid.resolution as f32,
            step_factor: self.step_factor,
            opacity_exponent: self.opacity_exponent,
            height_clamp: self.height_clamp,
            max_distance: self.max_distance(&volume.grid),
            voxel_size_m: volume.grid.voxel_size,
            ao_falloff: 0.0,
            start_offset: self.start_offset,
        }
    }
}
