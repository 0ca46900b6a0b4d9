//! How lights look into the scene: one view or cascades of a directional light, one view of a spot
//! light, six of a point light.

use glam::{Mat4, Vec3, Vec4};

use super::cascades::{self, Column, Watcher};
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
        /// x: index of the light; y: map size (texels); zw: of a cascade, its first texel, counted
        /// from the anchor.
        pub light: [u32; 4],
        /// Of a cascade: xyz: where texels are counted from, on the near plane (m); w: 1 + its
        /// number, 0 the finest. Else 0.
        pub anchor: [f32; 4],
        /// xy: of a cascade, 1 where the scene goes on beyond its edge to the right, and below.
        pub border: [f32; 4],
    }
}

/// Light views of a point light, one a side of a cube.
pub(in super::super) const POINT_VIEWS: u32 = 6;

/// How many maps directional lights have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightCascades {
    /// Cascades of a directional light; with 1, one map of the whole scene serves everything.
    pub count: u32,
    /// Whether light is looked up elsewhere than where the camera sees it, so that there have to
    /// be maps around the camera too.
    pub everywhere: bool,
}

impl LightCascades {
    /// One map a light.
    pub const ONE: LightCascades = LightCascades {
        count: 1,
        everywhere: true,
    };

    /// Whether any of these lights has cascades.
    pub(in super::super) fn are_of(self, lights: &[Light]) -> bool {
        let is_directional = |light: &Light| matches!(light, Light::Directional { .. });
        self.count > 1 && lights.iter().any(is_directional)
    }
}

/// Which views lights have.
pub(in super::super) struct ViewRanges {
    /// A light: first view and number of views for lookups anywhere, and the same for what the
    /// camera sees.
    pub lights: Vec<[u32; 4]>,
    /// Number of views for lookups anywhere; the others are behind them.
    pub anywhere: u32,
}

impl ViewRanges {
    /// Of these lights.
    pub(in super::super) fn of(lights: &[Light], cascades: LightCascades) -> Self {
        let mut next = 0;
        let mut take = |count: u32| {
            next += count;
            [next - count, count]
        };
        let anywhere: Vec<[u32; 2]> = lights
            .iter()
            .map(|light| match light {
                Light::Point { .. } => take(POINT_VIEWS),
                Light::Directional { .. } if cascades.everywhere => take(cascades.count),
                Light::Directional { .. } if cascades.count > 1 => take(0),
                Light::Directional { .. } | Light::Spot { .. } => take(1),
            })
            .collect();
        let [anywhere_count, _] = take(0);
        let lights = lights.iter().zip(anywhere).map(|(light, anywhere)| {
            let seen = match light {
                Light::Directional { .. } if cascades.count > 1 => take(cascades.count),
                _ => anywhere,
            };
            [anywhere[0], anywhere[1], seen[0], seen[1]]
        });
        ViewRanges {
            lights: lights.collect(),
            anywhere: anywhere_count,
        }
    }
}

/// Parts of a light that its views depend on, and what its maps hold besides: all but its power.
pub(super) fn without_power(light: &Light) -> Light {
    let mut light = *light;
    match &mut light {
        Light::Directional { irradiance, .. } => *irradiance = Vec3::ZERO,
        Light::Point { intensity, .. } | Light::Spot { intensity, .. } => *intensity = Vec3::ZERO,
    }
    light
}

/// What the views are made for.
pub(super) struct Viewed<'s> {
    pub(super) lights: &'s [Light],
    /// Smallest and largest corner of all that light can fall on (m).
    pub(super) bounds: (Vec3, Vec3),
    /// Width and height of a map (texels).
    pub(super) size: u32,
    pub(super) cascades: LightCascades,
    /// The camera that cascades follow; without one, each holds the whole scene.
    pub(super) watcher: Option<Watcher>,
}

/// The views of all lights, as [`ViewRanges`] says.
pub(super) fn light_views(viewed: &Viewed<'_>) -> Vec<GpuLightView> {
    let Viewed {
        lights,
        bounds,
        size,
        cascades,
        watcher,
    } = viewed;
    let size_m = (bounds.1 - bounds.0).length().max(1e-6);
    let (mut anywhere, mut seen) = (Vec::new(), Vec::new());
    for (index, light) in (0..).zip(*lights) {
        let of = [index, *size];
        match *light {
            Light::Directional { direction, .. } if cascades.count == 1 => {
                anywhere.push(whole_view(direction, *bounds, of));
            }
            Light::Directional { direction, .. } => {
                let column = Column::of_scene(direction, *bounds);
                let around = |count, middle| {
                    cascades::around(&column, middle, count, (index, *size)).into_iter()
                };
                let whole = || (0..cascades.count).flat_map(|_| around(1, Vec3::ZERO));
                match watcher {
                    Some(watcher) => {
                        if cascades.everywhere {
                            anywhere.extend(around(cascades.count, watcher.camera.eye));
                        }
                        let count = cascades.count;
                        let of = (index, *size);
                        seen.extend(cascades::of_camera(&column, *bounds, watcher, count, of));
                    }
                    None => {
                        if cascades.everywhere {
                            anywhere.extend(whole());
                        }
                        seen.extend(whole());
                    }
                }
            }
            Light::Point { position, .. } => {
                for axes in CUBE_FACES {
                    anywhere.push(perspective_view(position, axes, 1e-4 * size_m, of));
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
                let axes = (direction, right * extent, direction.cross(right) * extent);
                anywhere.push(perspective_view(position, axes, 1e-4 * size_m, of));
            }
        }
    }
    anywhere.append(&mut seen);
    anywhere
}

/// Whether a view may see something of a box (m).
pub(super) fn sees(view: &GpuLightView, (low, high): (Vec3, Vec3)) -> bool {
    let [origin, right, down, forward] =
        [view.origin_kind, view.right, view.down, view.forward].map(|row| Vec3::from_slice(&row));
    let is_parallel = view.origin_kind[3] == 0.0;
    let corners = corners(low, high).map(|corner| {
        let offset = corner - origin;
        let reach = if is_parallel {
            1.0
        } else {
            offset.dot(forward)
        };
        let at = [right, down].map(|side| offset.dot(side) / side.length_squared());
        (at, reach)
    });
    let is_beyond =
        |axis: usize, sign: f32| corners.iter().all(|(at, reach)| sign * at[axis] > *reach);
    let is_beside = (0..2).any(|axis| is_beyond(axis, 1.0) || is_beyond(axis, -1.0));
    let is_behind = !is_parallel && corners.iter().all(|(_, reach)| *reach <= 0.0);
    !is_beside && !is_behind
}

fn corners(low: Vec3, high: Vec3) -> [Vec3; 8] {
    std::array::from_fn(|i| {
        Vec3::select(
            glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0),
            high,
            low,
        )
    })
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
fn whole_view(direction: Vec3, (low, high): (Vec3, Vec3), light: [u32; 2]) -> GpuLightView {
    let right = direction.any_orthonormal_vector();
    let down = direction.cross(right);
    let corners = corners(low, high);
    let range = |axis: Vec3| {
        corners
            .map(|corner| corner.dot(axis))
            .into_iter()
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
    parallel_view([right, down, direction], origin, half, light)
}

/// A parallel view; `half` is half its width and height, and its depth (m).
pub(super) fn parallel_view(
    [right, down, direction]: [Vec3; 3],
    origin: Vec3,
    half: Vec3,
    [light, size]: [u32; 2],
) -> GpuLightView {
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
        light: [light, size, 0, 0],
        anchor: [0.0; 4],
        border: [0.0; 4],
    }
}

/// A perspective view; `right` and `down` reach the map's edges at unit depth.
fn perspective_view(
    position: Vec3,
    (forward, right, down): (Vec3, Vec3, Vec3),
    near_m: f32,
    [light, size]: [u32; 2],
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
        light: [light, size, 0, 0],
        anchor: [0.0; 4],
        border: [0.0; 4],
    }
}
