//! Gathering by exact rays through the occupied voxels.

pub mod bounce;
pub mod emitters;

use super::{Sides, VoxelLight, Voxels};
use crate::gi::Settings;
use crate::gi::settings::{Domain, Setting};
use crate::gi::shared::interleave::Pattern;
use crate::gi::shared::loops::LOOP_BUDGET;
use crate::gpu_struct;
use crate::graph::{Access, Binding, Frame, Pass, Sets, Shaders};
use crate::render::Receivers;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `voxel.gather_rays`.
    pub struct RayParams {
        /// xyz: smallest corner of the grid (m); w: voxel size (m).
        pub grid: [f32; 4],
        /// Voxels along an edge of the grid.
        pub resolution: u32,
        /// Rays a pixel, of all dispatches.
        pub ray_count: u32,
        /// First ray of this dispatch.
        pub first_ray: u32,
        /// One beyond its last ray.
        pub end_ray: u32,
        /// Of a tile of pixels, as [`Pattern`] packs it.
        pub pattern: u32,
        /// Start along the geometric normal (voxels).
        pub start_offset: f32,
        /// Lowest surface over the tangent plane that can be hit (voxels).
        pub self_height: f32,
        /// Slack of the contour test (voxels); negative: off.
        pub contour_slack: f32,
        /// λ of the ambient visibility (1/m).
        pub ao_falloff: f32,
    }
}

/// E = π / n Σ L over cosine-distributed rays. Reads the G-buffer and the voxels, writes RGBA32F
/// (irradiance, ambient visibility); a thread a pixel.
pub static GATHER_RAYS: Pass = Pass {
    name: "voxel.gather_rays",
    shaders: Shaders::Compute("gi/shared/voxel/trace/gather_rays.comp"),
    bindings: &[
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::buffer("occupancy", Access::ComputeRead),
        Binding::buffer("block_bases", Access::ComputeRead),
        Binding::buffer("voxel_records", Access::ComputeRead),
        Binding::buffer("voxel_radiance", Access::ComputeRead),
        Binding::image("indirect_diffuse", Access::ComputeReadWrite),
    ],
    constants: &["SIDES"],
    params: Some(RayParams::LAYOUT),
    sets: Sets::Scene,
};

/// Settings of the gather by rays.
pub static RAY_SETTINGS: &[Setting] = &[
    Setting {
        name: "rays",
        help: "rays that each pixel casts, with gather = rays",
        unit: "",
        domain: Domain::Count { min: 1, max: 4096 },
        default: "16",
    },
    Setting {
        name: "radiance",
        help: "radiance of a voxel that a ray hits: isotropic (the mean over its surface) or \
               two-sided (one for each side: walls thinner than a voxel do not glow through)",
        unit: "",
        domain: Domain::Choice(&["isotropic", "two-sided"]),
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

/// How rays are gathered.
#[derive(Clone, Copy, Debug)]
pub struct RaySettings {
    /// Rays of a pixel.
    pub count: u32,
    /// Radiances of a voxel.
    pub sides: Sides,
    /// Which directions the pixels of a tile take.
    pub pattern: Pattern,
    /// Start along the normal (voxels).
    pub start_offset: f32,
    /// Lowest surface over the tangent plane that can be hit (voxels).
    pub self_height: f32,
    /// Slack of the contour test (voxels); negative: off.
    pub contour_slack: f32,
    ao_falloff: f32,
}

impl RaySettings {
    /// From a technique's settings.
    pub fn new(settings: &Settings) -> Self {
        RaySettings {
            count: settings.count("rays"),
            sides: if settings.is("radiance", "two-sided") {
                Sides::Two
            } else {
                Sides::One
            },
            pattern: Pattern::new(settings),
            start_offset: settings.number("ray_start"),
            self_height: settings.number("self_height"),
            contour_slack: settings.number("contour_slack"),
            ao_falloff: settings.number("ao_falloff"),
        }
    }
}

/// Adds the pass, in as many dispatches as keep a ray's worst walk through the grid within
/// `LOOP_BUDGET`.
pub fn gather_rays(
    frame: &mut Frame,
    receivers: &Receivers<'_>,
    voxels: &Voxels,
    light: &VoxelLight,
    settings: &RaySettings,
) {
    let resolution = voxels.grid.resolution;
    // A line crosses at most 3 n voxels of an n³ grid, and each is a turn of the loop.
    let rays_a_dispatch = (LOOP_BUDGET / (3 * resolution + 1)).max(1);
    for first_ray in (0..settings.count).step_by(rays_a_dispatch as usize) {
        let params = RayParams {
            grid: voxels.grid.row(),
            resolution,
            ray_count: settings.count,
            first_ray,
            end_ray: (first_ray + rays_a_dispatch).min(settings.count),
            pattern: settings.pattern.bits(),
            start_offset: settings.start_offset,
            self_height: settings.self_height,
            contour_slack: settings.contour_slack,
            ao_falloff: settings.ao_falloff,
        };
        frame
            .pass(&GATHER_RAYS)
            .bind("view_depth", receivers.view_depth)
            .bind("normals", receivers.normals)
            .bind("occupancy", &voxels.occupancy)
            .bind("block_bases", &voxels.block_bases)
            .bind("voxel_records", &voxels.records)
            .bind("voxel_radiance", &light.radiance)
            .bind("indirect_diffuse", receivers.light)
            .constant("SIDES", light.settings.sides as u32)
            .push(&params)
            .dispatch(receivers.groups());
    }
}
