//! What exact rays walk through: the space of a store, as data, and the passes through it.

use super::emitters;
use super::{BOUNCE, BounceRayParams, PIXEL, RayParams};
use crate::gi::shared::voxel::{Sides, VoxelGrid};
use crate::gi::{CAST, CastRays};
use crate::gpu_struct;
use crate::graph::compute::linear_groups;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Bound, Frame, Loops, Pass, PassBuilder, Sets, Shaders};
use crate::render::bvh;
use crate::shader::{GpuStruct, StructLayout};

/// The passes through a store's space. Each store has entry shaders of its own that include a pass
/// of `gi/shared/voxel/trace` and the store's space.
pub struct SpacePasses {
    /// E = π / n Σ L over cosine-distributed rays through the voxels. Reads the G-buffer, writes
    /// RGBA32F (irradiance, ambient visibility); a thread a pixel.
    pub gather_rays: Pass,
    /// The same by rays against the scene's triangles, which see the light of the voxels that they
    /// hit them in.
    pub gather_triangles: Pass,
    /// E/π = 1/n Σ L over cosine-distributed rays from each voxel. Reads voxels, writes half
    /// floats; a thread a side of a voxel.
    pub bounce_rays: Pass,
    /// E = 1/n Σ L cos θ cos θ' V / (d² p) over points of what emits, p being their density. Reads
    /// the G-buffer and the voxels, adds to RGBA32F (irradiance, ambient visibility); a thread a
    /// pixel.
    pub gather_emitters: Pass,
    /// The same at the sides of voxels. Reads the voxels, adds to half floats (E/π); a thread a
    /// side.
    pub bounce_emitters: Pass,
    /// What rays of another technique bring. Reads rays and voxels, writes hits; a thread a ray.
    pub cast: Pass,
}

impl SpacePasses {
    /// All of them.
    pub const fn all(&'static self) -> [&'static Pass; 6] {
        [
            &self.gather_rays,
            &self.gather_triangles,
            &self.bounce_rays,
            &self.gather_emitters,
            &self.bounce_emitters,
            &self.cast,
        ]
    }
}

/// [`SpacePasses`] whose entry shaders are in a folder, from the constants and the bindings of the
/// space.
macro_rules! space_passes {
    ($folder:literal, [$($constant:literal),*], [$($binding:expr),*]) => {{
        use $crate::gi::shared::voxel::trace::space;
        const BINDINGS: &[$crate::graph::Binding] = &[$($binding),*];
        const SPACE: [$crate::graph::Binding; BINDINGS.len()] = [$($binding),*];
        space::SpacePasses {
            gather_rays: space::gather_rays(
                concat!($folder, "/gather_rays.comp"),
                const { &space::of_pixel::<{ SPACE.len() }, { SPACE.len() + 3 }>(SPACE) },
                &[$($constant),*],
            ),
            gather_triangles: space::gather_triangles(
                concat!($folder, "/gather_triangles.comp"),
                const {
                    &space::of_triangles::<
                        { SPACE.len() },
                        { SPACE.len() + 3 },
                        { SPACE.len() + 8 },
                    >(SPACE)
                },
                const {
                    use $crate::render::bvh::CONSTANTS;
                    &[CONSTANTS[0], CONSTANTS[1], CONSTANTS[2], $($constant),*]
                },
            ),
            bounce_rays: space::bounce_rays(
                concat!($folder, "/bounce_rays.comp"),
                const { &space::of_voxel::<{ SPACE.len() }, { SPACE.len() + 2 }>(SPACE) },
                &[$($constant),*],
            ),
            gather_emitters: space::gather_emitters(
                concat!($folder, "/gather_emitters.comp"),
                const { &space::of_pixel_and_parts::<{ SPACE.len() }, { SPACE.len() + 4 }>(SPACE) },
                &[$($constant),*],
            ),
            bounce_emitters: space::bounce_emitters(
                concat!($folder, "/bounce_emitters.comp"),
                const { &space::of_voxel_and_parts::<{ SPACE.len() }, { SPACE.len() + 3 }>(SPACE) },
                &[$($constant),*],
            ),
            cast: space::cast(
                concat!($folder, "/cast.comp"),
                const { &space::of_cast::<{ SPACE.len() }, { SPACE.len() + 2 }>(SPACE) },
                &[$($constant),*],
            ),
        }
    }};
}
pub(in crate::gi) use space_passes;

const fn pass(
    name: &'static str,
    shader: &'static str,
    bindings: &'static [Binding],
    constants: &'static [&'static str],
    params: StructLayout,
) -> Pass {
    Pass {
        name,
        shaders: Shaders::Compute(shader),
        bindings,
        constants,
        params: Some(params),
        sets: Sets::Scene,
    }
}

pub(in crate::gi) const fn gather_rays(
    shader: &'static str,
    bindings: &'static [Binding],
    constants: &'static [&'static str],
) -> Pass {
    pass(
        "voxel.gather_rays",
        shader,
        bindings,
        constants,
        RayParams::LAYOUT,
    )
}

pub(in crate::gi) const fn gather_triangles(
    shader: &'static str,
    bindings: &'static [Binding],
    constants: &'static [&'static str],
) -> Pass {
    pass(
        "voxel.gather_triangles",
        shader,
        bindings,
        constants,
        RayParams::LAYOUT,
    )
}

pub(in crate::gi) const fn bounce_rays(
    shader: &'static str,
    bindings: &'static [Binding],
    constants: &'static [&'static str],
) -> Pass {
    pass(
        "voxel.bounce",
        shader,
        bindings,
        constants,
        BounceRayParams::LAYOUT,
    )
}

pub(in crate::gi) const fn gather_emitters(
    shader: &'static str,
    bindings: &'static [Binding],
    constants: &'static [&'static str],
) -> Pass {
    let params = RayParams::LAYOUT;
    pass("voxel.gather_emitters", shader, bindings, constants, params)
}

pub(in crate::gi) const fn bounce_emitters(
    shader: &'static str,
    bindings: &'static [Binding],
    constants: &'static [&'static str],
) -> Pass {
    let params = BounceRayParams::LAYOUT;
    pass("voxel.bounce_emitters", shader, bindings, constants, params)
}

pub(in crate::gi) const fn cast(
    shader: &'static str,
    bindings: &'static [Binding],
    constants: &'static [&'static str],
) -> Pass {
    pass(CAST, shader, bindings, constants, CastParams::LAYOUT)
}

/// Bindings of a pass over rays of another technique.
pub(in crate::gi) const fn of_cast<const SPACE: usize, const ALL: usize>(
    space: [Binding; SPACE],
) -> [Binding; ALL] {
    join::<_, 2, SPACE, ALL>(
        [
            Binding::buffer("cast_rays", Access::ComputeRead),
            Binding::buffer("cast_hits", Access::ComputeWrite),
        ],
        space,
    )
}

/// Bindings of a pass over pixels that goes to points of what emits.
pub(in crate::gi) const fn of_pixel_and_parts<const SPACE: usize, const ALL: usize>(
    space: [Binding; SPACE],
) -> [Binding; ALL] {
    join::<_, 4, SPACE, ALL>(emitters::PIXEL, space)
}

/// Bindings of a pass over voxels that goes to points of what emits.
pub(in crate::gi) const fn of_voxel_and_parts<const SPACE: usize, const ALL: usize>(
    space: [Binding; SPACE],
) -> [Binding; ALL] {
    join::<_, 3, SPACE, ALL>(emitters::BOUNCE, space)
}

/// Bindings of a pass over pixels.
pub(in crate::gi) const fn of_pixel<const SPACE: usize, const ALL: usize>(
    space: [Binding; SPACE],
) -> [Binding; ALL] {
    join::<_, 3, SPACE, ALL>(PIXEL, space)
}

/// Bindings of a pass over pixels that also meets triangles.
pub(in crate::gi) const fn of_triangles<
    const SPACE: usize,
    const PIXELS: usize,
    const ALL: usize,
>(
    space: [Binding; SPACE],
) -> [Binding; ALL] {
    join::<_, 5, PIXELS, ALL>(bvh::BINDINGS, join::<_, 3, SPACE, PIXELS>(PIXEL, space))
}

/// Bindings of a pass over voxels.
pub(in crate::gi) const fn of_voxel<const SPACE: usize, const ALL: usize>(
    space: [Binding; SPACE],
) -> [Binding; ALL] {
    join::<_, 2, SPACE, ALL>(BOUNCE, space)
}

/// The space of a store, for one frame.
pub struct Space<'v> {
    /// The store's passes.
    pub passes: &'static SpacePasses,
    /// Where it is, in its finest voxels.
    pub grid: VoxelGrid,
    /// What it reads, by name.
    pub bound: Vec<(&'static str, Bound<'v>)>,
    /// Its constants, by name, but for the radiances of a voxel.
    pub constants: Vec<(&'static str, u32)>,
    /// Radiances of a voxel.
    pub sides: Sides,
    /// Cells on a line through it, at most.
    pub cells: u32,
}

gpu_struct! {
    /// Parameters of `store.cast`.
    pub struct CastParams {
        /// xyz: smallest corner of the space (m); w: edge of its finest voxels (m).
        pub grid: [f32; 4],
        /// Edge of the space (voxels).
        pub resolution: u32,
        /// Number of rays.
        pub ray_count: u32,
        /// Slack of the contour test (voxels).
        pub contour_slack: f32,
        /// Rays of a family, over all directions.
        pub family: u32,
    }
}

impl Space<'_> {
    /// Turns of a shader's loops that a ray is trusted to stay below. Empty cells have a loop of
    /// their own, which turns until the last lane has come to a surface: in the worst case for one
    /// lane after the other. The loop around it turns once a surface.
    pub(super) fn turns(&self, loops: Loops) -> u32 {
        (loops.lanes + 1) * self.cells
    }

    /// Adds [`SpacePasses::cast`].
    pub fn cast(&self, frame: &mut Frame, rays: CastRays<'_>, contour_slack: f32) {
        self.pass(frame, &self.passes.cast)
            .bind("cast_rays", rays.rays)
            .bind("cast_hits", rays.hits)
            .push(&CastParams {
                grid: self.grid.row(),
                resolution: self.grid.resolution,
                ray_count: rays.count,
                contour_slack,
                family: rays.of_family,
            })
            .dispatch(linear_groups(rays.count));
    }

    /// Adds one of its passes, with what it reads and its constants.
    pub(super) fn pass<'f>(&self, frame: &'f mut Frame, pass: &'static Pass) -> PassBuilder<'f> {
        let sides = ("SIDES", self.sides as u32);
        let pass = (self.constants.iter().chain([&sides]))
            .fold(frame.pass(pass), |pass, &(name, value)| {
                pass.constant(name, value)
            });
        (self.bound.iter()).fold(pass, |pass, &(name, bound)| pass.bind(name, bound))
    }
}
