//! Where shadow maps are coarser than the picture.

use glam::Vec3;

use super::super::GpuScene;
use super::maps::LightMaps;
use super::views::{GpuLightView, ViewRanges};
use crate::image::Image;
use crate::scene::{Camera, Light};

/// Name of the count of pixels that are finer than a shadow map there: the longer edge of the map's
/// texel (m, across the light) is more than the pixel's edge at its view depth (m, across the
/// view), and the surface faces the light.
pub const UNDERSAMPLED: &str = "undersampled_pixels";

/// Counts those pixels of a picture with these view depths (m) and geometric normals. A cascade is
/// the finest that has the point, without room for filters.
pub fn undersampled(
    scene: &GpuScene,
    maps: &LightMaps,
    camera: &Camera,
    (depth, normals): (&Image, &Image),
) -> u64 {
    let (width, height) = (depth.width, depth.height);
    let [.., forward] = camera.basis();
    let pixel_per_m = 2.0 * (0.5 * camera.vfov_deg.to_radians()).tan() / height as f32;
    let ranges = ViewRanges::of(&scene.lights, scene.cascades).lights;
    let is_coarse = |pixel: usize| {
        let depth_m = depth.pixels[pixel].x;
        let (x, y) = (pixel as u32 % width, pixel as u32 / width);
        let ray = camera.ray_direction(x as f32 + 0.5, y as f32 + 0.5, width, height);
        let point = camera.eye + depth_m / ray.dot(forward) * ray;
        let mut lights = scene.lights.iter().zip(&ranges);
        depth_m > 0.0
            && lights.any(|(light, [.., first, count])| {
                let rows = &maps.rows()[*first as usize..][..*count as usize];
                faces(light, point, normals.pixels[pixel])
                    && texel_m(rows, point).is_some_and(|texel_m| texel_m > depth_m * pixel_per_m)
            })
    };
    (0..depth.pixels.len())
        .filter(|pixel| is_coarse(*pixel))
        .count() as u64
}

fn faces(light: &Light, point: Vec3, normal: Vec3) -> bool {
    let to_light = match *light {
        Light::Directional { direction, .. } => -direction,
        Light::Point { position, .. } | Light::Spot { position, .. } => position - point,
    };
    normal.dot(to_light) > 0.0
}

/// The longer edge of a texel at a point (m), in the first view that has it.
fn texel_m(rows: &[GpuLightView], point: Vec3) -> Option<f32> {
    rows.iter().find_map(|row| {
        let [origin, right, down, forward] =
            [row.origin_kind, row.right, row.down, row.forward].map(|row| Vec3::from_slice(&row));
        let offset = point - origin;
        let reach = match row.origin_kind[3] == 0.0 {
            true => 1.0,
            false => offset.dot(forward),
        };
        let is_inside = reach > 0.0
            && [right, down]
                .iter()
                .all(|side| offset.dot(*side).abs() <= reach * side.length_squared());
        is_inside.then(|| 2.0 * right.length().max(down.length()) * reach / row.light[1] as f32)
    })
}
