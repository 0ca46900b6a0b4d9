//! What all techniques share: the scene on the GPU, shadow and reflective shadow maps, G-buffer,
//! direct light, composite.

mod aov;
mod direct;
pub mod emitters;
mod gbuffer;
mod gpu_scene;
pub mod light_views;
pub mod oracle;

pub(crate) use aov::float_from_half;
pub use aov::{MapChannel, SurfaceChannel, read_aov, read_light_map, read_surface};
pub use direct::{COMPOSITE, DIRECT, IndirectLight, Output};
pub(crate) use direct::{screen_groups, screen_image};
pub use emitters::Emitter;
pub use gbuffer::{
    GBUFFER_DIFFUSE, GBUFFER_EMISSIVE, GBUFFER_GLOSSY, GBUFFER_GLOSSY_EMISSIVE, GBuffer,
};
pub(crate) use gpu_scene::storage;
pub use gpu_scene::{
    DynamicGeometry, FrameConstants, GpuLight, GpuMaterial, GpuScene, SET_POSE, TextureUse,
};
pub use light_views::{GpuLightView, LightMaps, RSM, SHADOW_MAPS, TILE};

use crate::graph::Pass;
use crate::shader::{Field, GpuStruct};

/// All passes of this module.
pub static PASSES: &[&Pass] = &[
    &SHADOW_MAPS,
    &RSM,
    &GBUFFER_DIFFUSE,
    &GBUFFER_GLOSSY,
    &GBUFFER_EMISSIVE,
    &GBUFFER_GLOSSY_EMISSIVE,
    &DIRECT,
    &COMPOSITE,
];

/// All structs that this module shares with shaders.
pub static STRUCTS: &[(&str, &[Field])] = &[
    (FrameConstants::NAME, FrameConstants::FIELDS),
    ("Vertex", crate::scene::Vertex::FIELDS),
    ("Material", GpuMaterial::FIELDS),
    ("Light", GpuLight::FIELDS),
    ("LightView", GpuLightView::FIELDS),
    (
        light_views::ViewParams::NAME,
        light_views::ViewParams::FIELDS,
    ),
];
