//! How cones are marched, of each kind: what every pass that does is told.

use super::volume::{FaceWeights, Volume};
use crate::gi::Settings;
use crate::gi::shared::interleave::Pattern;
use crate::gi::shared::voxel::VoxelGrid;
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
        /// A cone ends where less than this passes through.
        pub early_stop: f32,
        /// A sample of more opacity than this fills its cone; 1: none.
        pub first_hit: f32,
        /// Of samples near the cone's apex, whose opacity fades: s; 0: of none.
        pub near_strength: f32,
        /// λ (1/m) of the cone's radius in place of its distance.
        pub radius_falloff: f32,
    }
}

/// How cones are traced.
#[derive(Clone, Copy, Debug)]
pub struct ConeSettings {
    /// Which directions the pixels of a tile take.
    pub pattern: Pattern,
    /// Which directions of the glossy lobe they take.
    pub specular_pattern: Pattern,
    pub(super) step_factor: f32,
    pub(super) opacity_exponent: f32,
    pub(super) height_clamp: f32,
    pub(super) start_offset: f32,
    pub(super) max_distance_m: f32,
    pub(super) ao_falloff: f32,
    pub(super) radius_falloff: f32,
    pub(super) early_stop: f32,
    pub(super) first_hit: f32,
    pub(super) near_strength: f32,
    pub(super) face_weights: FaceWeights,
}

/// What cones of one kind have apart from the others.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConeKind {
    /// Start along the geometric normal (texels read there).
    pub(super) start_offset: f32,
    pub(super) step_factor: f32,
    /// s of [`MarchSettings::near_strength`].
    near_strength: f32,
}

impl ConeKind {
    /// Settings whose names begin with `kind`.
    pub(super) fn new(settings: &Settings, kind: &str) -> Self {
        let own = |name: &str| settings.number(&format!("{kind}_{name}"));
        let (start, step) = (own("start"), own("step"));
        let near_strength = settings.find_number(&format!("{kind}_strength"));
        let start_offset = if start < 0.0 {
            settings.number("start_offset")
        } else {
            start
        };
        let step_factor = if step == 0.0 {
            settings.number("step_factor")
        } else {
            step
        };
        ConeKind {
            start_offset,
            step_factor,
            near_strength: near_strength.unwrap_or(0.0),
        }
    }
}

impl ConeSettings {
    /// The same for cones of a kind, of which none ends at its first hit.
    pub(super) fn of_kind(&self, kind: ConeKind) -> Self {
        ConeSettings {
            start_offset: kind.start_offset,
            step_factor: kind.step_factor,
            near_strength: kind.near_strength,
            first_hit: 1.0,
            ..*self
        }
    }

    /// Through a volume, without the falloff of ambient visibility and to the end.
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
            early_stop: self.early_stop,
            first_hit: 1.0,
            near_strength: self.near_strength,
            radius_falloff: 0.0,
        }
    }

    /// Longest distance (voxels).
    pub(super) fn max_distance(&self, grid: &VoxelGrid) -> f32 {
        if self.max_distance_m > 0.0 {
            self.max_distance_m / grid.voxel_size
        } else {
            4.0 * grid.resolution as f32
        }
    }
}
