//! Interleaved sampling (Keller & Heidrich 2001; Hong 2015, section 3): each pixel of an n×n tile
//! gathers over its own directions, then the results are averaged over the neighbours on the same
//! surface. `oracle` is the CPU twin.

pub mod oracle;

use std::sync::Arc;

use crate::gpu_struct;
use crate::graph::{Access, Binding, Frame, Image, Pass, Sets, Shaders};
use crate::render::{GBuffer, screen_groups};
use crate::shader::{Field, GpuStruct};

gpu_struct! {
    /// Parameters of `gi.deinterleave`.
    pub struct DeinterleaveParams {
        /// n, even.
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
    push_bytes: size_of::<DeinterleaveParams>() as u32,
    sets: Sets::Scene,
};

/// All passes of this module.
pub static PASSES: &[&Pass] = &[&DEINTERLEAVE];

/// All structs that this module shares with shaders.
pub static STRUCTS: &[(&str, &[Field])] = &[(DeinterleaveParams::NAME, DeinterleaveParams::FIELDS)];

/// Adds the pass.
pub fn deinterleave(
    frame: &mut Frame,
    gbuffer: &GBuffer,
    interleaved: &Arc<Image>,
    result: &Arc<Image>,
    interleave: u32,
) {
    frame
        .pass(&DEINTERLEAVE)
        .bind(&gbuffer.view_depth)
        .bind(&gbuffer.normals)
        .bind(interleaved)
        .bind(result)
        .push(&DeinterleaveParams { interleave })
        .dispatch(screen_groups(gbuffer.size));
}
