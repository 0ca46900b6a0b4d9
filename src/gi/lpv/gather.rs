//! From cells to pixels.

use std::sync::Arc;

use super::cells::Cells;
use super::grid::GridRow;
use crate::gi::Settings;
use crate::gpu_struct;
use crate::graph::{Access, Binding, Frame, Image, Pass, Sets, Shaders};
use crate::render::{GBuffer, Receivers, screen_groups};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.gather` and `lpv.specular`.
    pub struct LookupParams {
        /// The grid; of nested ones the outermost.
        pub grid: GridRow,
        /// Where each inner grid is from the first cell of the one around it (its own cells), 10
        /// bits an axis.
        pub inner: [u32; 4],
        /// Off the surface (cells).
        pub shift: f32,
        /// Radiance of a stored 1 (W/(m² sr)).
        pub scale: f32,
        /// Cells over which a grid goes over into the one around it.
        pub blend: f32,
    }
}

/// Irradiance and ambient visibility by a lookup off the surface. A thread a pixel.
pub static GATHER: Pass = Pass {
    name: "lpv.gather",
    shaders: Shaders::Compute("gi/lpv/gather.comp"),
    bindings: &[
        Binding::sampled("light", Access::ComputeSampled),
        Binding::sampled("light_band2", Access::ComputeSampled),
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::image("indirect_diffuse", Access::ComputeWrite),
    ],
    constants: &["LEVELS", "NESTED", "MASKED", "DAMPING", "HAS_BAND2"],
    params: Some(LookupParams::LAYOUT),
    sets: Sets::Scene,
};

/// Specular radiance by the same lookup. A thread a pixel.
pub static SPECULAR: Pass = Pass {
    name: "lpv.specular",
    shaders: Shaders::Compute("gi/lpv/specular.comp"),
    bindings: &[
        Binding::sampled("light", Access::ComputeSampled),
        Binding::sampled("light_band2", Access::ComputeSampled),
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::sampled("specular", Access::ComputeSampled),
        Binding::image("indirect_specular", Access::ComputeWrite),
    ],
    constants: &["LEVELS", "NESTED", "MASKED", "DAMPING", "HAS_BAND2"],
    params: Some(LookupParams::LAYOUT),
    sets: Sets::Scene,
};

/// How light is looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lookup {
    /// Off the surface (cells).
    pub shift: f32,
    /// Cells over which a grid goes over into the one around it.
    pub blend: f32,
    /// Whether cells behind the surface are left out.
    pub masked: bool,
    /// Whether light that falls off from the surface is damped.
    pub damping: bool,
}

impl Lookup {
    /// As the technique's settings say.
    pub(super) fn new(settings: &Settings, blend: f32) -> Self {
        Lookup {
            shift: settings.number("gather_shift"),
            blend,
            masked: settings.is("gather_filter", "masked"),
            damping: settings.is("damping", "on"),
        }
    }
}

/// Where each inner grid is from the first cell of the one around it (its own cells), 10 bits an
/// axis.
pub(super) fn inner_places(levels: &[Cells]) -> [u32; 4] {
    let mut inner = [0; 4];
    for (inner, pair) in inner.iter_mut().zip(levels.windows(2)) {
        let from = (pair[1].grid.first - 2 * pair[0].grid.first).as_uvec3();
        *inner = from.x | from.y << 10 | from.z << 20;
    }
    inner
}

fn params(levels: &[Cells], cells: &Cells, lookup: Lookup) -> LookupParams {
    LookupParams {
        grid: cells.grid.row(0),
        inner: inner_places(levels),
        shift: lookup.shift,
        scale: cells.scale,
        blend: lookup.blend,
    }
}

/// Adds [`GATHER`] for surfaces, from nested grids, outermost first.
pub fn gather(frame: &mut Frame, receivers: &Receivers<'_>, levels: &[Cells], lookup: Lookup) {
    let Some(cells) = levels.first() else { return };
    frame
        .pass(&GATHER)
        .bind("light", &cells.light.low)
        .bind("light_band2", cells.light.bound_band2())
        .bind("view_depth", receivers.view_depth)
        .bind("normals", receivers.normals)
        .bind("indirect_diffuse", receivers.light)
        .constant("LEVELS", levels.len() as u32)
        .constant("NESTED", levels.len() > 1)
        .constant("MASKED", lookup.masked)
        .constant("DAMPING", lookup.damping)
        .constant("HAS_BAND2", cells.light.band2.is_some())
        .push(&params(levels, cells, lookup))
        .dispatch(receivers.groups());
}

/// Adds [`SPECULAR`] for each pixel, from nested grids, outermost first.
pub fn mirror(
    frame: &mut Frame,
    gbuffer: &GBuffer,
    levels: &[Cells],
    lookup: Lookup,
    result: &Arc<Image>,
) {
    let (Some(cells), Some(specular)) = (levels.first(), &gbuffer.specular) else {
        return;
    };
    frame
        .pass(&SPECULAR)
        .bind("light", &cells.light.low)
        .bind("light_band2", cells.light.bound_band2())
        .bind("view_depth", &gbuffer.view_depth)
        .bind("normals", &gbuffer.normals)
        .bind("specular", specular)
        .bind("indirect_specular", result)
        .constant("LEVELS", levels.len() as u32)
        .constant("NESTED", levels.len() > 1)
        .constant("MASKED", lookup.masked)
        .constant("DAMPING", lookup.damping)
        .constant("HAS_BAND2", cells.light.band2.is_some())
        .push(&params(levels, cells, lookup))
        .dispatch(screen_groups(gbuffer.size));
}
