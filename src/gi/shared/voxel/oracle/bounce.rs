//! Light from voxel to voxel.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::rays::sees_back;
use super::{
    Receiver, TraceEnd, TraceGrid, TraceSettings, TraceVoxel, VoxelIndex, corner_of,
    hemisphere_direction, seed_of, trace,
};

/// From where a voxel looks, as direction number `direction` of it: a side of its own, or where
/// `side` is `None` of the one radiance that it has for all directions, its front, opposed surfaces
/// in turn.
pub fn bounce_receiver(
    voxel: VoxelIndex,
    surface: &TraceVoxel,
    side: Option<usize>,
    direction: u32,
) -> Receiver {
    let front = surface.front();
    let is_back = side.map_or(
        surface.opposed_axis.is_some() && direction % 2 == 1,
        |side| side == 1,
    );
    let normal = if is_back { -front } else { front };
    Receiver {
        position: corner_of(voxel) + surface.mean_position,
        geometric_normal: normal,
        shading_normal: normal,
    }
}

/// The pattern of a voxel: points of a 64-point Hammersley set, repeated every 4×4×4 voxels,
/// neighbours 19/64 apart along x; the azimuths of each block are turned by a number of its own (a
/// hash of 24 bits).
pub fn voxel_pattern(voxel: VoxelIndex) -> DVec2 {
    let index = voxel
        .iter()
        .enumerate()
        .map(|(axis, at)| (at % 4) << (2 * axis))
        .sum::<u32>()
        * 19
        % 64;
    let radical_inverse: f64 = (0..6)
        .filter(|bit| index >> bit & 1 == 1)
        .map(|bit| 0.5f64.powi(bit + 1))
        .sum();
    let [x, y, z] = voxel.map(|at| at / 4);
    let mixed =
        x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77) ^ z.wrapping_mul(0xc2b2_ae3d);
    let hash = (mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d);
    let turn = f64::from(hash >> 8) / f64::from(1 << 24);
    DVec2::new(
        (f64::from(index) + 0.5) / 64.0,
        (radical_inverse + turn).fract(),
    )
}

/// E/π \[W/(m² sr)\] at a voxel, or one side of it, by `ray_count` rays through the others;
/// Rays start `start_offset` above the voxel, along the normal \[voxels\].
pub fn bounce_rays(
    grid: &TraceGrid,
    voxel: VoxelIndex,
    side: Option<usize>,
    ray_count: u32,
    start_offset: f64,
    settings: &TraceSettings,
    environment: DVec3,
) -> DVec3 {
    let golden_angle = PI * (3.0 - 5f64.sqrt());
    let pattern = voxel_pattern(voxel);
    let seen = |ray: u32| {
        let receiver = bounce_receiver(voxel, &grid.voxels[&voxel], side, ray);
        let sin_squared = (f64::from(ray) + pattern.x) / f64::from(ray_count);
        let direction = hemisphere_direction(
            receiver.shading_normal,
            sin_squared,
            f64::from(ray) * golden_angle + pattern.y * 2.0 * PI,
        );
        let settings = TraceSettings {
            seed: seed_of(voxel, side.unwrap_or(0) as u32),
            ray,
            ..*settings
        };
        match trace(
            grid,
            receiver.position + start_offset * receiver.geometric_normal,
            direction,
            &receiver,
            &settings,
        ) {
            TraceEnd::Miss(_) => environment,
            TraceEnd::Hit(hit) => {
                grid.voxels[&hit.voxel].radiance
                    [usize::from(sees_back(&grid.voxels[&hit.voxel], direction))]
            }
        }
    };
    (0..ray_count).map(seen).sum::<DVec3>() / f64::from(ray_count)
}
