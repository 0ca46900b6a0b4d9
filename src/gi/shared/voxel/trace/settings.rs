//! Settings of the gather by rays.

use crate::gi::Settings;
use crate::gi::settings::{Domain, Setting};
use crate::gi::shared::interleave::Pattern;
use crate::gi::shared::voxel::Sides;

/// Settings of the gather by rays.
pub static RAY_SETTINGS: &[Setting] = &[
    Setting {
        name: "gather",
        help: "what a pixel gathers by: cones through filtered voxels, rays (exact ones through \
               the finest voxels), or triangles (exact rays against the scene's own triangles, \
               which have the light of the voxels that they are in)",
        unit: "",
        domain: Domain::Choice(&["cones", "rays", "triangles"]),
        default: "cones",
    },
    Setting {
        name: "rays",
        help: "rays that each pixel casts, with gather = rays or triangles",
        unit: "",
        domain: Domain::Count { min: 1, max: 4096 },
        default: "16",
    },
    Setting {
        name: "radiance",
        help: "radiance of a voxel that a ray hits: isotropic (the mean over its surface), \
               two-sided (one for each side: walls thinner than a voxel do not glow through) or \
               six-sided (one for each face: nor do edges whose planes are lit differently)",
        unit: "",
        domain: Domain::Choice(&["isotropic", "two-sided", "six-sided"]),
        default: "two-sided",
    },
    Setting {
        name: "ray_start",
        help: "start of a ray over the surface, along its normal",
        unit: "voxels",
        domain: Domain::Number { min: 0.0, max: 8.0 },
        default: "0.05",
    },
    Setting {
        name: "self_height",
        help: "a voxel whose surface lies lower than this over the receiver's tangent plane is \
               the receiver itself",
        unit: "voxels",
        domain: Domain::Number {
            min: -8.0,
            max: 8.0,
        },
        default: "0.1",
    },
    Setting {
        name: "contour_slack",
        help: "a ray must meet the mean plane of a voxel's surface inside the voxel enlarged by \
               this; −1: any touched voxel is hit",
        unit: "voxels",
        domain: Domain::Number {
            min: -1.0,
            max: 8.0,
        },
        default: "0.1",
    },
];

/// 4,096 directions in each interleaving window.
pub fn more_rays(settings: &Settings) -> Vec<String> {
    vec![format!(
        "rays={}",
        (4096 / Pattern::new(settings).count()).max(settings.count("rays"))
    )]
}

/// How rays are gathered.
#[derive(Clone, Copy, Debug)]
pub struct RaySettings {
    pub(super) count: u32,
    /// Whether rays of pixels meet the scene's triangles in place of voxels.
    pub meets_triangles: bool,
    /// Radiances of a voxel.
    pub sides: Sides,
    pub(super) pattern: Pattern,
    /// Start along the normal (voxels).
    pub start_offset: f32,
    /// Lowest surface over the tangent plane that can be hit (voxels).
    pub self_height: f32,
    /// Slack of the contour test (voxels); negative: off.
    pub contour_slack: f32,
    pub(super) ao_falloff: f32,
}

impl RaySettings {
    /// From a technique's settings.
    pub fn new(settings: &Settings) -> Self {
        RaySettings {
            count: settings.count("rays"),
            meets_triangles: settings.is("gather", "triangles"),
            sides: match settings.choice("radiance") {
                "isotropic" => Sides::One,
                "two-sided" => Sides::Two,
                _ => Sides::Six,
            },
            pattern: Pattern::new(settings),
            start_offset: settings.number("ray_start"),
            self_height: settings.number("self_height"),
            contour_slack: settings.number("contour_slack"),
            ao_falloff: settings.number("ao_falloff"),
        }
    }
}
