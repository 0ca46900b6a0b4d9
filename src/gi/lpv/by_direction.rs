//! From cells to pixels, direction by direction.

use std::sync::Arc;

use super::cells::Cells;
use super::gather::Lookup;
use super::grid::GridRow;
use super::sweep::{Batch, Sweep};
use crate::gi::Inputs;
use crate::gpu_struct;
use crate::graph::{Access, Binding, Frame, Image, Pass, Sets, Shaders};
use crate::render::{Receivers, screen_groups};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.gather_directions` and `lpv.specular_directions`.
    pub struct DirectionParams {
        /// The grid.
        pub grid: GridRow,
        /// Off the surface (cells).
        pub shift: f32,
        /// Radiance of a stored 1 (W/(m² sr)).
        pub scale: f32,
        /// The first octant of the batch.
        pub first_octant: u32,
        /// How many it has.
        pub octant_count: u32,
        /// The first pair of directions of each.
        pub first_pair: u32,
        /// How many pairs of each it has at most.
        pub pair_count: u32,
        /// Squared width of the narrowest lobe (rad²).
        pub least_width: f32,
    }
}

/// Irradiance and ambient visibility of a batch of directions. A thread a pixel.
pub static GATHER_DIRECTIONS: Pass = Pass {
    name: "lpv.gather_directions",
    shaders: Shaders::Compute("gi/lpv/gather_directions.comp"),
    bindings: &[
        Binding::buffer("directions", Access::ComputeRead),
        Binding::image("radiance", Access::ComputeRead),
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::image("indirect_diffuse", Access::ComputeReadWrite),
    ],
    constants: &["MASKED", "ADD", "LAST"],
    params: Some(DirectionParams::LAYOUT),
    sets: Sets::Scene,
};

/// Specular radiance of a batch of directions. A thread a pixel.
pub static SPECULAR_DIRECTIONS: Pass = Pass {
    name: "lpv.specular_directions",
    shaders: Shaders::Compute("gi/lpv/specular_directions.comp"),
    bindings: &[
        Binding::buffer("directions", Access::ComputeRead),
        Binding::image("radiance", Access::ComputeRead),
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::sampled("specular", Access::ComputeSampled),
        Binding::image("indirect_specular", Access::ComputeReadWrite),
    ],
    constants: &["MASKED", "ADD", "LAST"],
    params: Some(DirectionParams::LAYOUT),
    sets: Sets::Scene,
};

/// What is answered: the diffuse light of surfaces, and where there is an image the specular light
/// of each pixel.
pub type Answer<'a> = (&'a Receivers<'a>, Option<&'a Arc<Image>>);

/// Adds the passes that sweep the last bounce, and after each batch of directions add what it
/// brings.
pub fn gather(
    frame: &mut Frame,
    given: &Inputs<'_>,
    cells: &Cells,
    lookup: Lookup,
    answer: Answer<'_>,
) {
    cells.propagate_last(
        frame,
        (given.scene, given.maps),
        &mut |frame, sweep, batch| {
            look_up(frame, given, (cells, sweep, batch), lookup, answer);
        },
    );
}

fn look_up(
    frame: &mut Frame,
    given: &Inputs<'_>,
    (cells, sweep, batch): (&Cells, &Sweep, Batch),
    lookup: Lookup,
    (receivers, specular): Answer<'_>,
) {
    let gbuffer = given.gbuffer;
    let params = DirectionParams {
        grid: cells.grid.row(0),
        shift: lookup.shift,
        scale: cells.scale,
        first_octant: batch.first_octant,
        octant_count: batch.octants,
        first_pair: batch.first_pair,
        pair_count: batch.pairs,
        // A lobe so wide has the solid angle of two directions: 2π α² = 8π/K.
        least_width: 4.0 / sweep.directions.all.len().max(1) as f32,
    };
    let is_first = batch.first_octant == 0 && batch.first_pair == 0;
    frame
        .pass(&GATHER_DIRECTIONS)
        .bind("directions", &sweep.list)
        .bind("radiance", &sweep.front)
        .bind("view_depth", receivers.view_depth)
        .bind("normals", receivers.normals)
        .bind("indirect_diffuse", receivers.light)
        .constant("MASKED", lookup.masked)
        .constant("ADD", !is_first)
        .constant("LAST", batch.is_last)
        .push(&params)
        .dispatch(receivers.groups());
    if let (Some(result), Some(specular)) = (specular, &gbuffer.specular) {
        // All pixels are answered for, whichever surfaces are.
        frame.set_scene(&given.scene.set, &given.scene.materials);
        frame
            .pass(&SPECULAR_DIRECTIONS)
            .bind("directions", &sweep.list)
            .bind("radiance", &sweep.front)
            .bind("view_depth", &gbuffer.view_depth)
            .bind("normals", &gbuffer.normals)
            .bind("specular", specular)
            .bind("indirect_specular", result)
            .constant("MASKED", lookup.masked)
            .constant("ADD", !is_first)
            .constant("LAST", batch.is_last)
            .push(&params)
            .dispatch(screen_groups(gbuffer.size));
        frame.set_scene(receivers.set, &given.scene.materials);
    }
}
