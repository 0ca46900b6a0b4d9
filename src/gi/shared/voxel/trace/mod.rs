//! Gathering by exact rays: through the voxels of a store, or against the scene's triangles, where
//! voxels are a cache of light.

pub mod blocks;
pub mod emitters;
mod settings;
pub mod space;
pub mod surfaces;

use std::sync::Arc;

use emitters::EmitterPoints;
pub use settings::{RAY_SETTINGS, RaySettings, more_rays};
pub use space::{Space, SpacePasses};

use super::VoxelRecords;
use crate::gpu_struct;
use crate::graph::compute::linear_groups;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Buffer, Error, Frame, Gpu, Loops, Pass, Sets, Shaders};
use crate::render::bvh::{self, SceneRays, TURNS_A_RAY};
use crate::render::{GpuScene, Receivers};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `voxel.gather_rays`, `voxel.gather_triangles` and `voxel.gather_emitters`.
    pub struct RayParams {
        /// xyz: smallest corner of the space (m); w: edge of its finest voxels (m).
        pub grid: [f32; 4],
        /// Edge of the space (voxels).
        pub resolution: u32,
        /// Parts of what emits; 0 where rays do not go to points of it.
        pub part_count: u32,
        /// Rays a pixel, of all dispatches.
        pub ray_count: u32,
        /// First ray of this dispatch.
        pub first_ray: u32,
        /// One beyond its last ray.
        pub end_ray: u32,
        /// Of a tile of pixels, as [`crate::gi::shared::interleave::Pattern`] packs it.
        pub pattern: u32,
        /// Start along the geometric normal (voxels); not read against triangles.
        pub start_offset: f32,
        /// Lowest surface over the tangent planes that can be hit (voxels).
        pub self_height: f32,
        /// Slack of the contour test (voxels); negative: off.
        pub contour_slack: f32,
        /// λ of the ambient visibility (1/m).
        pub ao_falloff: f32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.bounce` by rays and of `voxel.bounce_emitters`.
    pub struct BounceRayParams {
        /// xyz: smallest corner of the space (m); w: edge of its finest voxels (m).
        pub grid: [f32; 4],
        /// xyz: first voxel of the grid that the voxels are of (their size).
        pub first_voxel: [f32; 4],
        /// Edge of the space (voxels).
        pub resolution: u32,
        /// Number of voxels that gather.
        pub voxel_count: u32,
        /// Parts of what emits; 0 where rays do not go to points of it.
        pub part_count: u32,
        /// Rays a side, of all dispatches.
        pub ray_count: u32,
        /// First ray of this dispatch.
        pub first_ray: u32,
        /// One beyond its last ray.
        pub end_ray: u32,
        /// Edge of the voxels that gather (voxels of the space).
        pub voxel_scale: f32,
        /// Start along the normal (voxels).
        pub start_offset: f32,
        /// Lowest surface over the tangent plane that can be hit (voxels).
        pub self_height: f32,
        /// Slack of the contour test (voxels); negative: off.
        pub contour_slack: f32,
    }
}

/// What a pass over pixels binds before the space.
const PIXEL: [Binding; 3] = [
    Binding::sampled("view_depth", Access::ComputeSampled),
    Binding::sampled("normals", Access::ComputeSampled),
    Binding::image("indirect_diffuse", Access::ComputeReadWrite),
];

/// What a pass over voxels binds before the space.
const BOUNCE: [Binding; 2] = [
    Binding::buffer("gathering_voxels", Access::ComputeRead),
    Binding::buffer("voxel_irradiance", Access::ComputeReadWrite),
];

/// [`SpacePasses::gather_emitters`] by rays against the scene's triangles, which needs no space.
pub static GATHER_EMITTERS_BY_TRIANGLES: Pass = Pass {
    name: "voxel.gather_emitters_triangles",
    shaders: Shaders::Compute("gi/shared/voxel/trace/emitters_by_rays.comp"),
    bindings: &join::<_, 5, 4, 9>(bvh::BINDINGS, emitters::PIXEL),
    constants: &bvh::CONSTANTS,
    params: Some(RayParams::LAYOUT),
    sets: Sets::Scene,
};

/// Rays of pixels and of voxels.
pub struct RayTracer {
    /// How they are traced.
    pub settings: RaySettings,
    /// Rays of a voxel, or of a side of it.
    bounce_directions: u32,
    /// Points of what emits, where rays go to them.
    pub points: Option<EmitterPoints>,
}

impl RayTracer {
    /// Nothing is built yet.
    pub fn new(settings: RaySettings, bounce_directions: u32) -> Self {
        RayTracer {
            settings,
            bounce_directions,
            points: None,
        }
    }

    /// Brings points up to models that have moved.
    pub fn follow(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<(), Error> {
        (self.points.as_mut()).map_or(Ok(()), |points| points.follow(gpu, scene))
    }

    /// Adds the gather of a picture; `triangles` are those of the scene, where rays meet them.
    pub fn gather(
        &self,
        frame: &mut Frame,
        receivers: &Receivers<'_>,
        space: &Space<'_>,
        triangles: Option<&SceneRays>,
    ) {
        let s = &self.settings;
        let triangles = triangles.filter(|_| s.meets_triangles);
        let loops = frame.loops();
        let turns = space.turns(loops) + triangles.map_or(0, |_| TURNS_A_RAY);
        for rays in dispatches(loops, s.count, turns) {
            let pass = match triangles {
                Some(triangles) => {
                    triangles.bind(space.pass(frame, &space.passes.gather_triangles))
                }
                None => space.pass(frame, &space.passes.gather_rays),
            };
            pass.bind("view_depth", receivers.view_depth)
                .bind("normals", receivers.normals)
                .bind("indirect_diffuse", receivers.light)
                .push(&self.pixel_params(space, 0, rays))
                .dispatch(receivers.groups());
        }
        if let Some(points) = &self.points {
            self.gather_emitters(frame, receivers, space, triangles, points);
        }
    }

    /// Adds what reaches these surfaces from points of what emits to what was gathered, by as many
    /// rays a pixel as the gather has. With `triangles` only these hide the points, otherwise
    /// voxels do.
    pub fn gather_emitters(
        &self,
        frame: &mut Frame,
        receivers: &Receivers<'_>,
        space: &Space<'_>,
        triangles: Option<&SceneRays>,
        points: &EmitterPoints,
    ) {
        let loops = frame.loops();
        let turns = triangles.map_or(space.turns(loops), |_| TURNS_A_RAY);
        for rays in dispatches(loops, self.settings.count, turns + emitters::TURNS) {
            let pass = match triangles {
                Some(triangles) => triangles.bind(frame.pass(&GATHER_EMITTERS_BY_TRIANGLES)),
                None => space.pass(frame, &space.passes.gather_emitters),
            };
            pass.bind("emitter_parts", &points.parts)
                .bind("view_depth", receivers.view_depth)
                .bind("normals", receivers.normals)
                .bind("indirect_diffuse", receivers.light)
                .push(&self.pixel_params(space, points.count, rays))
                .dispatch(receivers.groups());
        }
    }

    /// Adds `voxel.bounce` of voxels whose grid is a part of the space, or is coarser.
    pub fn bounce(
        &self,
        frame: &mut Frame,
        voxels: &VoxelRecords,
        space: &Space<'_>,
        irradiance: &Arc<Buffer>,
    ) {
        let loops = frame.loops();
        for rays in dispatches(loops, self.bounce_directions, space.turns(loops)) {
            space
                .pass(frame, &space.passes.bounce_rays)
                .bind("gathering_voxels", &voxels.records)
                .bind("voxel_irradiance", irradiance)
                .push(&self.voxel_params(space, voxels, 0, rays))
                .dispatch(linear_groups(space.sides as u32 * voxels.voxel_count));
        }
        if let Some(points) = &self.points {
            self.bounce_emitters(frame, voxels, space, irradiance, points);
        }
    }

    /// Adds what reaches the voxels from points of what emits to what they gathered.
    pub fn bounce_emitters(
        &self,
        frame: &mut Frame,
        voxels: &VoxelRecords,
        space: &Space<'_>,
        irradiance: &Arc<Buffer>,
        points: &EmitterPoints,
    ) {
        let loops = frame.loops();
        for rays in dispatches(
            loops,
            self.bounce_directions,
            space.turns(loops) + emitters::TURNS,
        ) {
            space
                .pass(frame, &space.passes.bounce_emitters)
                .bind("emitter_parts", &points.parts)
                .bind("gathering_voxels", &voxels.records)
                .bind("voxel_irradiance", irradiance)
                .push(&self.voxel_params(space, voxels, points.count, rays))
                .dispatch(linear_groups(space.sides as u32 * voxels.voxel_count));
        }
    }

    /// What rays `first_ray` up to `end_ray` of pixels are told.
    fn pixel_params(
        &self,
        space: &Space<'_>,
        part_count: u32,
        [first_ray, end_ray]: [u32; 2],
    ) -> RayParams {
        let s = &self.settings;
        RayParams {
            grid: space.grid.row(),
            resolution: space.grid.resolution,
            part_count,
            ray_count: s.count,
            first_ray,
            end_ray,
            pattern: s.pattern.bits(),
            start_offset: s.start_offset,
            self_height: s.self_height,
            contour_slack: s.contour_slack,
            ao_falloff: s.ao_falloff,
        }
    }

    /// What rays `first_ray` up to `end_ray` of voxels are told.
    fn voxel_params(
        &self,
        space: &Space<'_>,
        voxels: &VoxelRecords,
        part_count: u32,
        [first_ray, end_ray]: [u32; 2],
    ) -> BounceRayParams {
        let (s, grid) = (&self.settings, &voxels.grid);
        let first_voxel = ((grid.origin - space.grid.origin) / grid.voxel_size).round();
        BounceRayParams {
            grid: space.grid.row(),
            first_voxel: first_voxel.extend(0.0).to_array(),
            resolution: space.grid.resolution,
            voxel_count: voxels.voxel_count,
            part_count,
            ray_count: self.bounce_directions,
            first_ray,
            end_ray,
            voxel_scale: grid.voxel_size / space.grid.voxel_size,
            start_offset: s.start_offset,
            self_height: s.self_height,
            contour_slack: s.contour_slack,
        }
    }
}

/// First ray, and one beyond the last, of as many dispatches as keep a thread's loops within their
/// budget.
fn dispatches(loops: Loops, count: u32, turns: u32) -> impl Iterator<Item = [u32; 2]> {
    let most = (loops.budget / turns).max(1);
    (0..count)
        .step_by(most as usize)
        .map(move |first| [first, (first + most).min(count)])
}
