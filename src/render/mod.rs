//! What all techniques share: the scene on the GPU, shadow and reflective shadow maps, G-buffer,
//! direct light, composite.

mod aov;
pub mod bvh;
pub mod clear;
mod corners;
pub mod emitters;
mod environment;
mod gpu_scene;
mod grid;
mod lights;
mod mean_normals;
pub mod oracle;
mod screen;

pub use aov::{
    MapChannel, SurfaceChannel, SurfacePixel, read_aov, read_indirect, read_light_map, read_pixel,
    read_pixels, read_surface, share_of_spread,
};
pub(crate) use aov::{float_from_half, read_weights};
pub use clear::{ClearSurfaces, SightRays};
pub use emitters::Emitter;
pub use environment::GpuEnvironment;
pub(crate) use gpu_scene::storage;
pub use gpu_scene::{
    DynamicGeometry, FrameConstants, GpuLight, GpuMaterial, GpuScene, SET_POSE, TextureUse,
};
pub use grid::Grid;
pub use lights::cascades::{Watcher, sphere_of_part, splits};
pub use lights::maps::{
    LightMaps, RSM, RSM_CASCADES, SHADOW_CASCADES, SHADOW_MAPS, TILE, ViewParams,
};
pub use lights::sampling::{UNDERSAMPLED, undersampled};
pub use lights::settings::{CASCADES, SUN_ANGLE_DEG, ShadowFilter, ShadowSettings};
pub use lights::views::{GpuLightView, LightCascades};
pub use screen::gbuffer::{Follows, GBUFFER, GBuffer};
pub use screen::motion::{BEHIND_PX, KEEP_POSE, MotionParams};
pub use screen::output::{
    COMPOSITE, DIRECT, DirectParams, IndirectLight, Output, exact_screen_image, screen_groups,
    screen_image, screen_image_of,
};
pub use screen::receivers::{PICK, Picked, Receivers};
pub use screen::terms_view::{TERMS_VIEW, Terms, TermsParams};

use crate::graph::Pass;
use crate::shader::{GpuStruct, StructLayout};

/// All passes of this module.
pub static PASSES: &[&Pass] = &[
    &SHADOW_MAPS,
    &SHADOW_CASCADES,
    &RSM,
    &RSM_CASCADES,
    &GBUFFER[0],
    &GBUFFER[1],
    &GBUFFER[2],
    &GBUFFER[3],
    &GBUFFER[4],
    &GBUFFER[5],
    &GBUFFER[6],
    &GBUFFER[7],
    &GBUFFER[8],
    &GBUFFER[9],
    &GBUFFER[10],
    &GBUFFER[11],
    &DIRECT,
    &clear::SHADOW,
    &clear::ENTER,
    &clear::PASS,
    &clear::COVER,
    &COMPOSITE,
    &PICK,
    &TERMS_VIEW,
];

/// The structs that this module shares with shaders, without the parameters of passes.
pub static STRUCTS: &[StructLayout] = &[
    FrameConstants::LAYOUT,
    ("Material", GpuMaterial::FIELDS),
    ("Light", GpuLight::FIELDS),
    ("LightView", GpuLightView::FIELDS),
    ("Clear", clear::GpuClear::FIELDS),
    ("Way", clear::GpuWay::FIELDS),
    ("SightRay", clear::GpuSightRay::FIELDS),
    ("Sight", clear::GpuSight::FIELDS),
];
