//! How eight texels of premultiplied radiance become one, in dense mips and in bricks (`gi/voxel/prefilter.glsl`).

use crate::gi::Settings;
use crate::gi::settings::{Domain, Setting};

/// The setting that chooses a [`Prefilter`].
pub const MIP_FILTER: Setting = Setting {
    name: "mip_filter",
    help: "2³ texels to one of the next level: box (their mean), directional (composited along six directions, then averaged: thin walls stay opaque) or \
           directional-max (that, as opaque as along its most opaque axis)",
    unit: "",
    domain: Domain::Choice(&["directional", "directional-max", "box"]),
    default: "directional",
};

/// A filter; its number is the `mode` of `filter_eight` in the shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prefilter {
    /// The mean.
    Box = 0,
    /// Composited along six directions, then averaged.
    Directional = 1,
    /// Likewise, with the opacity of the most opaque axis.
    DirectionalMax = 2,
}

impl Prefilter {
    /// From a technique's settings.
    pub fn new(settings: &Settings) -> Self {
        match settings.choice(MIP_FILTER.name) {
            "box" => Prefilter::Box,
            "directional" => Prefilter::Directional,
            _ => Prefilter::DirectionalMax,
        }
    }
}
