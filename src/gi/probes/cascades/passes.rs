//! The passes, and what they are told.

use crate::gi::probes::list::LIST_BINDING;
use crate::gi::probes::lookup::{LOOKUP_BINDINGS, LOOKUP_CONSTANTS};
use crate::gi::probes::mirror::MIRRORED;
use crate::gi::probes::passes::{ORPHANS_BINDING, RAYS};
use crate::gi::shared::paths;
use crate::gpu_struct;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Pass, Sets, Shaders};
use crate::render::bvh;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `cascades.need`.
    pub struct NeedParams {
        /// xyz: place of the level's first probe (m); w: spacing (m).
        pub first: [f32; 4],
        /// xyz: probes along each axis.
        pub counts: [u32; 4],
        /// Triangles of the scene.
        pub triangle_count: u32,
        /// First bit of the level.
        pub first_bit: u32,
        /// How far from a probe places look it up (spacings).
        pub reach: f32,
    }
}

gpu_struct! {
    /// Parameters of `cascades.place`.
    pub struct PlaceParams {
        /// xyz: smallest corner of the box in which something has moved (m).
        pub low: [f32; 4],
        /// xyz: its largest corner (m).
        pub high: [f32; 4],
        /// Rays of a probe.
        pub ray_count: u32,
        /// First of the list.
        pub first_probe: u32,
        /// Number of those from there on.
        pub probe_count: u32,
        /// That they keep from surfaces (spacings).
        pub distance: f32,
    }
}

gpu_struct! {
    /// Parameters of `cascades.gather`.
    pub struct LevelParams {
        /// Number of levels.
        pub level_count: u32,
    }
}

gpu_struct! {
    /// Parameters of `cascades.bounce`.
    pub struct LevelBounceParams {
        /// Number of levels.
        pub level_count: u32,
        /// Rays of a probe.
        pub ray_count: u32,
        /// First of the list.
        pub first_probe: u32,
        /// Rays of those from there on.
        pub all: u32,
    }
}

/// Which probes of a level some place of a triangle looks up. Writes a bit a probe; a thread a
/// triangle.
pub static NEED: Pass = Pass {
    name: "cascades.need",
    shaders: Shaders::Compute("gi/probes/cascades/need.comp"),
    bindings: &[Binding::buffer("needed_probes", Access::ComputeReadWrite)],
    constants: &[],
    params: Some(NeedParams::LAYOUT),
    sets: Sets::Scene,
};

/// Puts probes away from what is too near. Writes places; a workgroup a probe.
pub static PLACE: Pass = Pass {
    name: "cascades.place",
    shaders: Shaders::Compute("gi/probes/cascades/place.comp"),
    bindings: &join::<_, 5, 4, 9>(
        bvh::BINDINGS,
        [
            Binding::buffer("probe_places", Access::ComputeReadWrite),
            Binding::sampled("ray_set", Access::ComputeSampled),
            LIST_BINDING,
            Binding::buffer("probe_homes", Access::ComputeRead),
        ],
    ),
    constants: &join::<_, 3, 1, 4>(bvh::CONSTANTS, ["KEEPS"]),
    params: Some(PlaceParams::LAYOUT),
    sets: Sets::Scene,
};

/// What each ray brings of the light that probes have. Reads hits and maps, writes RGBA32F; a
/// thread a ray.
pub static BOUNCE: Pass = Pass {
    name: "cascades.bounce",
    shaders: Shaders::Compute("gi/probes/cascades/bounce.comp"),
    bindings: &join::<_, 19, 1, 20>(
        join::<_, 12, 7, 19>(join::<_, 9, 3, 12>(paths::BINDINGS, RAYS), LEVEL_BINDINGS),
        [LIST_BINDING],
    ),
    constants: &join::<_, 6, 6, 12>(paths::CONSTANTS, LOOKUP_CONSTANTS),
    params: Some(LevelBounceParams::LAYOUT),
    sets: Sets::Scene,
};

/// Irradiance and ambient visibility of surfaces. Reads the G-buffer and maps, writes RGBA32F; a
/// thread a pixel.
pub static GATHER: Pass = Pass {
    name: "cascades.gather",
    shaders: Shaders::Compute("gi/probes/cascades/gather.comp"),
    bindings: &join::<_, 10, 1, 11>(
        join::<_, 3, 7, 10>(
            [
                Binding::sampled("view_depth", Access::ComputeSampled),
                Binding::sampled("normals", Access::ComputeSampled),
                Binding::image("indirect_diffuse", Access::ComputeWrite),
            ],
            LEVEL_BINDINGS,
        ),
        [ORPHANS_BINDING],
    ),
    constants: &LOOKUP_CONSTANTS,
    params: Some(LevelParams::LAYOUT),
    sets: Sets::Scene,
};

gpu_struct! {
    /// Parameters of `cascades.mirror`.
    pub struct LevelMirrorParams {
        /// Number of levels.
        pub level_count: u32,
        /// Rays of all dispatches.
        pub ray_count: u32,
        /// First ray of this dispatch, which adds to what those before it left.
        pub first_ray: u32,
        /// One beyond its last ray.
        pub end_ray: u32,
        /// Of a tile of pixels, as [`crate::gi::shared::interleave::Pattern`] packs it.
        pub pattern: u32,
        /// 1: what rays hit reflects the light of probes too.
        pub has_light: u32,
    }
}

gpu_struct! {
    /// Parameters of `cascades.light_field`.
    pub struct LevelFieldParams {
        /// Number of levels.
        pub level_count: u32,
        /// Edge of a map (texels).
        pub edge: u32,
        /// Maps beside each other in the images.
        pub columns: u32,
        /// Number of reflection probes.
        pub probe_count: u32,
    }
}

/// What reflection probes see of the lights and of the levels. Reads hits and maps, writes R32UI; a
/// thread a texel.
pub static LIGHT_FIELD: Pass = Pass {
    name: "cascades.light_field",
    shaders: Shaders::Compute("gi/probes/cascades/light_field.comp"),
    bindings: &join::<_, 11, 7, 18>(
        join::<_, 9, 2, 11>(
            paths::BINDINGS,
            [
                Binding::sampled("field_hits", Access::ComputeSampled),
                Binding::image("field_radiance", Access::ComputeWrite),
            ],
        ),
        LEVEL_BINDINGS,
    ),
    constants: &join::<_, 12, 1, 13>(
        join::<_, 6, 6, 12>(paths::CONSTANTS, LOOKUP_CONSTANTS),
        ["REFLECTS"],
    ),
    params: Some(LevelFieldParams::LAYOUT),
    sets: Sets::Scene,
};

/// Light that glossy surfaces mirror, by rays. Reads the G-buffer and maps, adds to an RGBA32F
/// image; a thread a pixel.
pub static MIRROR: Pass = Pass {
    name: "cascades.mirror",
    shaders: Shaders::Compute("gi/probes/cascades/mirror.comp"),
    bindings: &join::<_, 13, 7, 20>(MIRRORED, LEVEL_BINDINGS),
    constants: &join::<_, 12, 1, 13>(
        join::<_, 6, 6, 12>(paths::CONSTANTS, LOOKUP_CONSTANTS),
        ["MIRRORS_LEFT"],
    ),
    params: Some(LevelMirrorParams::LAYOUT),
    sets: Sets::Scene,
};

gpu_struct! {
    /// Parameters of `cascades.view`.
    pub struct LevelViewParams {
        /// Radius of a sphere (m).
        pub radius_m: f32,
        /// The farthest that a probe sees (cells).
        pub reach: f32,
        /// Which of the views.
        pub view: u32,
        /// Of which level.
        pub level: u32,
        /// Number of levels.
        pub level_count: u32,
    }
}

/// Probes of a level as spheres in front of surfaces. Reads the G-buffer and maps, writes RGBA32F;
/// a thread a pixel.
pub static VIEW: Pass = Pass {
    name: "cascades.view",
    shaders: Shaders::Compute("gi/probes/cascades/view.comp"),
    bindings: &join::<_, 3, 7, 10>(
        [
            Binding::sampled("view_depth", Access::ComputeSampled),
            Binding::sampled("normals", Access::ComputeSampled),
            Binding::image("seen", Access::ComputeWrite),
        ],
        LEVEL_BINDINGS,
    ),
    constants: &LOOKUP_CONSTANTS,
    params: Some(LevelViewParams::LAYOUT),
    sets: Sets::Scene,
};

/// What a pass binds that looks probes of all levels up (`gi/probes/cascades/lookup.glsl`).
const LEVEL_BINDINGS: [Binding; 7] = join::<_, 5, 2, 7>(
    LOOKUP_BINDINGS,
    [
        Binding::buffer("probe_table", Access::ComputeRead),
        Binding::buffer("lookup_rows", Access::ComputeRead),
    ],
);
