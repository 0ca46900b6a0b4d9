//! Interleaved sampling (Keller & Heidrich 2001; Hong 2015, section 3): each pixel of an n×n tile
//! gathers over its own directions, then the results are averaged over the neighbours on the same
//! surface. `oracle` is the CPU twin.

pub mod oracle;

use std::sync::Arc;

use crate::gpu_struct;
use crate::graph::{Access, Binding, Frame, Image, Pass, Sets, Shaders};
use crate::render::{GBuffer, screen_groups};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `gi.deinterleave`.
    pub struct DeinterleaveParams {
        /// n, the window's width (px); even.
        pub interleave: u32,
    }
}

/// Mean over a window n pixels wide around the pixel, on its own surface. Reads the G-buffer and an
/// RGBA32F image, writes an RGBA32F image; a thread a pixel.
pub static DEINTERLEAVE: Pass = Pass {
    name: "gi.deinterleave",
    shaders: Shaders::Compute("gi/shared/interleave/deinterleave.comp"),
    bindings: &[
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::sampled("interleaved", Access::ComputeSampled),
        Binding::image("indirect_diffuse", Access::ComputeWrite),
    ],
    constants: &[],
    params: Some(DeinterleaveParams::LAYOUT),
    sets: Sets::Scene,
};

/// All passes of this module.
pub static PASSES: &[&Pass] = &[&DEINTERLEAVE];

/// Adds [`DEINTERLEAVE`] to the frame: from `interleaved` to `result`, both as large as the
/// picture.
pub fn deinterleave(
    frame: &mut Frame,
    gbuffer: &GBuffer,
    interleaved: &Arc<Image>,
    result: &Arc<Image>,
    interleave: u32,
) {
    frame
        .pass(&DEINTERLEAVE)
        .bind("view_depth", &gbuffer.view_depth)
        .bind("normals", &gbuffer.normals)
        .bind("interleaved", interleaved)
        .bind("indirect_diffuse", result)
        .push(&DeinterleaveParams { interleave })
        .dispatch(screen_groups(gbuffer.size));
}
