//! How lights look into the scene: one view of a directional or spot light, six of a point light.

use glam::{Mat4, Vec3, Vec4};

use super::super::gpu_scene::POINT_VIEWS;
use crate::gpu_struct;
use crate::scene::Light;

gpu_struct! {
    /// One light view as the shaders read it (`LightView` in `shared/light_view.glsl`).
    pub struct GpuLightView {
        /// World to clip space; depth is reversed.
        pub clip_from_world: [[f32; 4]; 4],
        /// xyz: light position, or the map's centre on its near plane (m); w: 0 parallel, 1
        /// perspective.
        pub origin_kind: [f32; 4],
        /// xyz: from the map's centre to its right edge (m, or per unit of view depth); w: depth
        /// range of a parallel view (m).
        pub right: [f32; 4],
        /// xyz: from the map's centre to its lower edge, likewise.
        pub down: [f32; 4],
        /// xyz: unit direction of travel; w: depth of the near plane (m).
        pub forward: [f32; 4],
        /// x: index of the light; y: map size (texels).
        pub light: [u32; 4],
    }
}

/// The views of all lights, in the order of the lights.
pub(super) fn light_views(lights: &[Light], bounds: (Vec3, Vec3), size: u32) -> Vec<GpuLightView> {
    let size_m = (bounds.1 - bounds.0).length().max(1e-6);
    let mut views = Vec::new();
    for (index, light) in lights.iter().enumerate() {
        let light_index = [index as u32, size, 0, 0];
        match *light {
            Light::Directional { direction, .. } => {
                views.push(parallel_view(direction, bounds, light_index))
            }
            Light::Point { position, .. } => {
                for (forward, right, down) in CUBE_FACES {
                    views.push(perspective_view(
                        position,
                        forward,
                        right,
                        down,
                        1e-4 * size_m,
                        light_index,
                    ));
                }
            }
            Light::Spot {
                position,
                direction,
                outer_deg,
                ..
            } => {
                let right = direction.any_orthonormal_vector();
                let extent = outer_deg.to_radians().tan() * 1.01;
                views.push(perspective_view(
                    position,
                    direction,
                    right * extent,
                    direction.cross(right) * extent,
                    1e-4 * size_m,
                    light_index,
                ));
            }
        }
    }
    views
}

/// Forward, right and down of the six views of a point light: +x, −x, +y, −y, +z, −z.
const CUBE_FACES: [(Vec3, Vec3, Vec3); POINT_VIEWS as usize] = [
    (Vec3::X, Vec3::Z, Vec3::NEG_Y),
    (Vec3::NEG_X, Vec3::NEG_Z, Vec3::NEG_Y),
    (Vec3::Y, Vec3::X, Vec3::Z),
    (Vec3::NEG_Y, Vec3::X, Vec3::NEG_Z),
    (Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y),
    (Vec3::NEG_Z, Vec3::X, Vec3::NEG_Y),
];

/// A parallel view that covers the whole scene.
fn parallel_view(direction: Vec3, bounds: (Vec3, Vec3), light: [u32; 4]) -> GpuLightView {
    let (low, high) = bounds;
    let right = direction.any_orthonormal_vector();
    let down = direction.cross(right);
    let corners = (0..8).map(|i| {
        Vec3::select(
            glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0),
            high,
            low,
        )
    });
    let range = |axis: Vec3| {
        corners
            .clone()
            .map(|corner| corner.dot(axis))
            .fold((f32::MAX, f32::MIN), |(a, b), x| (a.min(x), b.max(x)))
    };
    let ((x0, x1), (y0, y1), (z0, z1)) = (range(right), range(down), range(direction));
    // A little more than the scene, so that no surface lies on the border or on the near plane.
    let margin = 1e-3 * (high - low).length().max(1e-6);
    let half = Vec3::new(
        0.5 * (x1 - x0) + margin,
        0.5 * (y1 - y0) + margin,
        z1 - z0 + 2.0 * margin,
    );
    let origin = right * (0.5 * (x0 + x1)) + down * (0.5 * (y0 + y1)) + direction * (z0 - margin);
    let world = Mat4::from_cols(
        right.extend(0.0),
        down.extend(0.0),
        direction.extend(0.0),
        origin.extend(1.0),
    );
    let clip = Mat4::from_cols(
        Vec4::new(1.0 / half.x, 0.0, 0.0, 0.0),
        Vec4::new(0.0, 1.0 / half.y, 0.0, 0.0),
        Vec4::new(0.0, 0.0, -1.0 / half.z, 0.0),
        Vec4::new(0.0, 0.0, 1.0, 1.0),
    );
    GpuLightView {
        clip_from_world: (clip * world.inverse()).to_cols_array_2d(),
        origin_kind: origin.extend(0.0).to_array(),
        right: (right * half.x).extend(half.z).to_array(),
        down: (down * half.y).extend(0.0).to_array(),
        forward: direction.extend(0.0).to_array(),
        light,
    }
}

/// A perspective view; `right` and `down` reach the map's edges at unit depth.
fn perspective_view(
    position: Vec3,
    forward: Vec3,
    right: Vec3,
    down: Vec3,
    near_m: f32,
    light: [u32; 4],
) -> GpuLightView {
    let world = Mat4::from_cols(
        right.extend(0.0),
        down.extend(0.0),
        forward.extend(0.0),
        position.extend(1.0),
    );
    let clip = Mat4::from_cols(
        Vec4::X,
        Vec4::Y,
        Vec4::new(0.0, 0.0, 0.0, 1.0),
        Vec4::new(0.0, 0.0, near_m, 0.0),
    );
    GpuLightView {
        clip_from_world: (clip * world.inverse()).to_cols_array_2d(),
        origin_kind: position.extend(1.0).to_array(),
        right: right.extend(0.0).to_array(),
        down: down.extend(0.0).to_array(),
        forward: forward.extend(near_m).to_array(),
        light,
    }
}
