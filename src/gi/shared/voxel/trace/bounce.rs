//! Light from voxel to voxel by rays: each side of each voxel gathers what the others send
//! (Villegas & Ramírez, section IX).

use std::sync::Arc;

use super::RaySettings;
use crate::gi::shared::loops::LOOP_BUDGET;
use crate::gi::shared::voxel::Voxels;
use crate::gi::shared::voxel::build::linear_groups;
use crate::gpu_struct;
use crate::graph::{Access, Binding, Buffer, Frame, Pass, Sets, Shaders};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `voxel.bounce` by rays.
    pub struct BounceRayParams {
        /// Voxels along an edge of the grid.
        pub resolution: u32,
        /// Number of occupied voxels.
        pub voxel_count: u32,
        /// Rays a side, of all dispatches.
        pub ray_count: u32,
        /// First ray of this dispatch.
        pub first_ray: u32,
        /// One beyond its last ray.
        pub end_ray: u32,
        /// Start along the normal (voxels).
        pub start_offset: f32,
        /// Lowest surface over the tangent plane that can be hit (voxels).
        pub self_height: f32,
        /// Slack of the contour test (voxels); negative: off.
        pub contour_slack: f32,
    }
}

/// E/π = 1/n Σ L over cosine-distributed rays. Reads the voxels and their radiance, writes half
/// floats; a thread a side of a voxel.
pub static BOUNCE_RAYS: Pass = Pass {
    name: "voxel.bounce",
    shaders: Shaders::Compute("gi/shared/voxel/trace/bounce_rays.comp"),
    bindings: &[
        Binding::buffer("occupancy", Access::ComputeRead),
        Binding::buffer("block_bases", Access::ComputeRead),
        Binding::buffer("voxel_records", Access::ComputeRead),
        Binding::buffer("voxel_radiance", Access::ComputeRead),
        Binding::buffer("voxel_irradiance", Access::ComputeReadWrite),
    ],
    constants: &["SIDES"],
    params: Some(BounceRayParams::LAYOUT),
    sets: Sets::Scene,
};

/// Adds `voxel.bounce` by `ray_count` rays a side, in as many dispatches as keep a ray's worst walk
/// through the grid within `LOOP_BUDGET`.
pub fn bounce_rays(
    frame: &mut Frame,
    voxels: &Voxels,
    radiance: &Arc<Buffer>,
    irradiance: &Arc<Buffer>,
    settings: &RaySettings,
    ray_count: u32,
) {
    let (resolution, sides) = (voxels.grid.resolution, settings.sides as u32);
    let rays_a_dispatch = (LOOP_BUDGET / (3 * resolution + 1)).max(1);
    for first_ray in (0..ray_count).step_by(rays_a_dispatch as usize) {
        let params = BounceRayParams {
            resolution,
            voxel_count: voxels.voxel_count,
            ray_count,
            first_ray,
            end_ray: (first_ray + rays_a_dispatch).min(ray_count),
            start_offset: settings.start_offset,
            self_height: settings.self_height,
            contour_slack: settings.contour_slack,
        };
        frame
            .pass(&BOUNCE_RAYS)
            .bind("occupancy", &voxels.occupancy)
            .bind("block_bases", &voxels.block_bases)
            .bind("voxel_records", &voxels.records)
            .bind("voxel_radiance", radiance)
            .bind("voxel_irradiance", irradiance)
            .constant("SIDES", sides)
            .push(&params)
            .dispatch(linear_groups(sides * voxels.voxel_count));
    }
}
