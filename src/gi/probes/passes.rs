//! The passes, and what they are told.

use super::list::LIST_BINDING;
use super::lookup::{LOOKUP_BINDINGS, LOOKUP_CONSTANTS};
use crate::gi::shared::paths;
use crate::gpu_struct;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Pass, Sets, Shaders};
use crate::render::bvh;
use crate::shader::{GpuStruct, StructLayout};

gpu_struct! {
    /// How places look probes up (`gi/probes/lookup_row.glsl`).
    pub struct LookupRow {
        /// xyz: the first probe (m).
        pub first: [f32; 4],
        /// xyz: between probes (m); w: the smallest of the three.
        pub spacing: [f32; 4],
        /// xyz: probes along each axis.
        pub counts: [u32; 4],
        /// Maps beside each other in the images.
        pub columns: u32,
        /// How far off its surface a place looks probes up (m).
        pub normal_bias_m: f32,
        /// Least share of a probe that visibility leaves.
        pub weight_floor: f32,
        /// Below this weight probes count less than their weight.
        pub crush: f32,
    }
}

/// The structs that its shaders read, but for those of paths.
pub(super) const STRUCTS: &[StructLayout] = &[("LookupRow", LookupRow::FIELDS)];

gpu_struct! {
    /// Parameters of `probes.explore`.
    pub struct ExploreParams {
        /// xyz: where paths begin (m).
        pub eye: [f32; 4],
        /// Number of paths.
        pub path_count: u32,
        /// Places of a path.
        pub place_count: u32,
    }
}

gpu_struct! {
    /// Parameters of `probes.trace`.
    pub struct TraceParams {
        /// xyz: smallest corner of the box in which something has moved (m).
        pub low: [f32; 4],
        /// xyz: its largest corner (m).
        pub high: [f32; 4],
        /// Rays of a probe.
        pub ray_count: u32,
        /// First of the list.
        pub first_probe: u32,
        /// Rays of those from there on.
        pub all: u32,
    }
}

gpu_struct! {
    /// Parameters of `probes.moments` and `probes.moments_power`.
    pub struct MomentParams {
        /// xyz: smallest corner of the box in which something has moved (m).
        pub low: [f32; 4],
        /// xyz: its largest corner (m).
        pub high: [f32; 4],
        /// xyz: smallest corner of the grid of voxels (m); w: edge of its voxels (m); only where
        /// rays meet those.
        pub grid: [f32; 4],
        /// Edge of the grid (voxels).
        pub resolution: u32,
        /// Maps beside each other in the image.
        pub columns: u32,
        /// Edge of a map (texels).
        pub edge: u32,
        /// First of the list.
        pub first_probe: u32,
        /// Texels of those from there on.
        pub all: u32,
        /// Rays of a probe.
        pub ray_count: u32,
        /// The smallest spacing (m).
        pub cell_m: f32,
        /// What counts as the farthest (cells).
        pub reach: f32,
    }
}

gpu_struct! {
    /// Parameters of `probes.surfaces` and `probes.light`.
    pub struct RayParams {
        /// Rays of a probe.
        pub ray_count: u32,
        /// First of the list.
        pub first_probe: u32,
        /// Rays of those from there on.
        pub all: u32,
    }
}

gpu_struct! {
    /// Parameters of `probes.bounce`.
    pub struct BounceParams {
        /// How places look probes up.
        pub lookup: LookupRow,
        /// Rays of a probe.
        pub ray_count: u32,
        /// First of the list.
        pub first_probe: u32,
        /// Rays of those from there on.
        pub all: u32,
    }
}

gpu_struct! {
    /// Parameters of `probes.blend` and `probes.blend_sh`.
    pub struct BlendParams {
        /// Maps beside each other in the image.
        pub columns: u32,
        /// Rays of a probe.
        pub ray_count: u32,
        /// First of the list.
        pub first_probe: u32,
        /// Number of those from there on.
        pub probe_count: u32,
        /// The smallest spacing (m).
        pub cell_m: f32,
        /// Share that stays of what maps have had.
        pub kept: f32,
    }
}

gpu_struct! {
    /// Parameters of `probes.gather`.
    pub struct LookupParams {
        /// How places look probes up.
        pub lookup: LookupRow,
    }
}

/// Places on surfaces that light paths from the eye come to. Writes places; a thread a path.
pub static EXPLORE: Pass = Pass {
    name: "probes.explore",
    shaders: Shaders::Compute("gi/probes/explore.comp"),
    bindings: &join::<_, 5, 1, 6>(
        bvh::BINDINGS,
        [Binding::buffer("seen_places", Access::ComputeWrite)],
    ),
    constants: &bvh::CONSTANTS,
    params: Some(ExploreParams::LAYOUT),
    sets: Sets::Scene,
};

/// What each ray meets first, where that may have changed. Reads places, writes RGBA32UI; a thread
/// a ray.
pub static TRACE: Pass = Pass {
    name: "probes.trace",
    shaders: Shaders::Compute("gi/probes/trace.comp"),
    bindings: &join::<_, 5, 4, 9>(
        bvh::BINDINGS,
        [
            Binding::buffer("probe_places", Access::ComputeRead),
            Binding::sampled("ray_set", Access::ComputeSampled),
            Binding::image("ray_hits", Access::ComputeReadWrite),
            LIST_BINDING,
        ],
    ),
    constants: &join::<_, 3, 1, 4>(bvh::CONSTANTS, ["KEEPS"]),
    params: Some(TraceParams::LAYOUT),
    sets: Sets::Scene,
};

/// Packs what each ray has met: the surface there. Reads and writes RGBA32UI; a thread a ray.
pub static SURFACES: Pass = Pass {
    name: "probes.surfaces",
    shaders: Shaders::Compute("gi/probes/surfaces.comp"),
    bindings: &join::<_, 5, 3, 8>(
        bvh::BINDINGS,
        [
            Binding::sampled("ray_set", Access::ComputeSampled),
            Binding::image("ray_hits", Access::ComputeReadWrite),
            LIST_BINDING,
        ],
    ),
    constants: &join::<_, 3, 2, 5>(bvh::CONSTANTS, ["EMITTERS", "BUMPS"]),
    params: Some(RayParams::LAYOUT),
    sets: Sets::Scene,
};

/// Mean and mean square of the distance that a probe sees, by direction. Reads places, writes
/// RG16F; a thread a texel.
pub static MOMENTS: Pass = Pass {
    name: "probes.moments",
    shaders: Shaders::Compute("gi/probes/moments.comp"),
    bindings: &join::<_, 5, 3, 8>(
        bvh::BINDINGS,
        [
            Binding::buffer("probe_places", Access::ComputeRead),
            Binding::image("probe_moments", Access::ComputeWrite),
            LIST_BINDING,
        ],
    ),
    constants: &join::<_, 3, 1, 4>(bvh::CONSTANTS, ["KEEPS"]),
    params: Some(MomentParams::LAYOUT),
    sets: Sets::Scene,
};

/// The same, over all rays of a probe. Reads hits, writes RG16F; a thread a texel.
pub static MOMENTS_POWER: Pass = Pass {
    name: "probes.moments_power",
    shaders: Shaders::Compute("gi/probes/moments_power.comp"),
    bindings: &[
        Binding::sampled("ray_set", Access::ComputeSampled),
        Binding::sampled("ray_hits", Access::ComputeSampled),
        Binding::image("probe_moments", Access::ComputeWrite),
        LIST_BINDING,
    ],
    constants: &[],
    params: Some(MomentParams::LAYOUT),
    sets: Sets::Scene,
};

/// What each ray brings of the lights and of what emits. Reads hits, writes RGBA32F; a thread a
/// ray.
pub static LIGHT: Pass = Pass {
    name: "probes.light",
    shaders: Shaders::Compute("gi/probes/light.comp"),
    bindings: &join::<_, 12, 2, 14>(
        join::<_, 9, 3, 12>(paths::BINDINGS, RAYS),
        [
            Binding::buffer("probe_places", Access::ComputeRead),
            LIST_BINDING,
        ],
    ),
    constants: &paths::CONSTANTS,
    params: Some(RayParams::LAYOUT),
    sets: Sets::Scene,
};

/// What each ray brings of the light that probes have. Reads hits and maps, writes RGBA32F; a
/// thread a ray.
pub static BOUNCE: Pass = Pass {
    name: "probes.bounce",
    shaders: Shaders::Compute("gi/probes/bounce.comp"),
    bindings: &join::<_, 17, 1, 18>(
        join::<_, 12, 5, 17>(join::<_, 9, 3, 12>(paths::BINDINGS, RAYS), LOOKUP_BINDINGS),
        [LIST_BINDING],
    ),
    constants: &join::<_, 6, 6, 12>(paths::CONSTANTS, LOOKUP_CONSTANTS),
    params: Some(BounceParams::LAYOUT),
    sets: Sets::Scene,
};

/// What a pass binds that reads what rays meet, and writes what they bring.
pub(super) const RAYS: [Binding; 3] = [
    Binding::sampled("ray_set", Access::ComputeSampled),
    Binding::sampled("ray_hits", Access::ComputeSampled),
    Binding::image("ray_light", Access::ComputeWrite),
];

/// Irradiance of each probe by direction, and how it changes with the place. Reads what rays meet
/// and bring, writes RGBA16F maps and their scales; a workgroup a probe.
pub static BLEND: Pass = Pass {
    name: "probes.blend",
    shaders: Shaders::Compute("gi/probes/blend.comp"),
    bindings: &[
        Binding::sampled("ray_set", Access::ComputeSampled),
        Binding::sampled("ray_hits", Access::ComputeSampled),
        Binding::sampled("ray_light", Access::ComputeSampled),
        Binding::sampled("before", Access::ComputeSampled),
        Binding::sampled("gradients_before", Access::ComputeSampled),
        Binding::buffer("scales_before", Access::ComputeRead),
        Binding::buffer("probe_scales", Access::ComputeReadWrite),
        Binding::image("probe_irradiance", Access::ComputeReadWrite),
        Binding::image("probe_gradients", Access::ComputeReadWrite),
        LIST_BINDING,
    ],
    constants: &["IRRADIANCE_TEXELS", "ADDS", "HAS_GRADIENTS"],
    params: Some(BlendParams::LAYOUT),
    sets: Sets::Scene,
};

/// The same as spherical harmonics of three bands. Reads what rays bring, writes 3×3 texels of
/// RGBA16F a probe and their scales; a workgroup a probe.
pub static BLEND_SH: Pass = Pass {
    name: "probes.blend_sh",
    shaders: Shaders::Compute("gi/probes/blend_sh.comp"),
    bindings: &[
        Binding::sampled("ray_set", Access::ComputeSampled),
        Binding::sampled("ray_light", Access::ComputeSampled),
        Binding::sampled("before", Access::ComputeSampled),
        Binding::buffer("scales_before", Access::ComputeRead),
        Binding::buffer("probe_scales", Access::ComputeReadWrite),
        Binding::image("probe_irradiance", Access::ComputeReadWrite),
        LIST_BINDING,
    ],
    constants: &["ADDS"],
    params: Some(BlendParams::LAYOUT),
    sets: Sets::Scene,
};

/// Irradiance and ambient visibility of surfaces. Reads the G-buffer and maps, writes RGBA32F; a
/// thread a pixel.
pub static GATHER: Pass = Pass {
    name: "probes.gather",
    shaders: Shaders::Compute("gi/probes/gather.comp"),
    bindings: &GATHER_BINDINGS,
    constants: &LOOKUP_CONSTANTS,
    params: Some(LookupParams::LAYOUT),
    sets: Sets::Scene,
};

/// The same, where a ray to each probe says whether a surface sees it.
pub static GATHER_BY_RAYS: Pass = Pass {
    name: "probes.gather_by_rays",
    shaders: Shaders::Compute("gi/probes/gather_by_rays.comp"),
    bindings: &join::<_, 5, 9, 14>(bvh::BINDINGS, GATHER_BINDINGS),
    constants: &join::<_, 3, 6, 9>(bvh::CONSTANTS, LOOKUP_CONSTANTS),
    params: Some(LookupParams::LAYOUT),
    sets: Sets::Scene,
};

const GATHER_BINDINGS: [Binding; 9] = join::<_, 8, 1, 9>(
    join::<_, 3, 5, 8>(
        [
            Binding::sampled("view_depth", Access::ComputeSampled),
            Binding::sampled("normals", Access::ComputeSampled),
            Binding::image("indirect_diffuse", Access::ComputeWrite),
        ],
        LOOKUP_BINDINGS,
    ),
    [ORPHANS_BINDING],
);

/// What a pass binds that counts surfaces which see no probe.
pub(super) const ORPHANS_BINDING: Binding =
    Binding::buffer("probe_orphans", Access::ComputeReadWrite);
