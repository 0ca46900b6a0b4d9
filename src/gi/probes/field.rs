//! The light fields of all probes: what each sees, texel by texel of an octahedral map.

use std::sync::Arc;

use super::lookup::{LOOKUP_BINDINGS, LOOKUP_CONSTANTS, Lookup, Visibility};
use super::passes::LookupRow;
use super::rays::{Moved, corners};
use super::volume::{Maps, Volume, store_image};
use crate::gi::Inputs;
use crate::gi::settings::{Domain, Setting};
use crate::gi::shared::paths::{self, PathScene};
use crate::gpu_struct;
use crate::graph::pass::join;
use crate::graph::{
    Access, Binding, Error, Frame, Gpu, Image, Pass, PassBuilder, Sets, Shaders, vk,
};
use crate::render::bvh::{self, SceneRays};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `light_field.trace`.
    pub struct FieldTraceParams {
        /// xyz: smallest corner of the box in which something has moved (m).
        pub low: [f32; 4],
        /// xyz: its largest corner (m).
        pub high: [f32; 4],
        /// Maps beside each other in the images.
        pub columns: u32,
        /// Edge of a map (texels).
        pub edge: u32,
        /// Number of probes.
        pub probe_count: u32,
        /// The smallest spacing (m).
        pub cell_m: f32,
    }
}

gpu_struct! {
    /// Parameters of `light_field.light`.
    pub struct FieldLightParams {
        /// How places look probes up.
        pub lookup: LookupRow,
        /// Edge of a map (texels).
        pub edge: u32,
        /// Maps beside each other in the images.
        pub columns: u32,
        /// Number of probes.
        pub probe_count: u32,
    }
}

/// What a probe sees.
pub(super) const RADIANCE_TEXELS: Setting = Setting {
    name: "radiance_texels",
    help: "edge of a probe's octahedral map of what it sees",
    unit: "texels",
    domain: Domain::Count { min: 16, max: 256 },
    default: "64",
};

/// How surfaces look up the irradiance of its probes.
pub(super) const LOOKUP: Lookup = Lookup {
    visibility: Visibility::Moments,
    normal_bias: 0.1,
    weight_floor: 0.05,
    crush: 0.2,
    rings: 2,
};

/// The surface that each texel of each probe sees, where that may have changed. Reads places,
/// writes RG32UI and R32UI; a thread a texel.
pub static TRACE: Pass = Pass {
    name: "light_field.trace",
    shaders: Shaders::Compute("gi/probes/field_trace.comp"),
    bindings: &join::<_, 5, 3, 8>(
        bvh::BINDINGS,
        [
            Binding::buffer("probe_places", Access::ComputeRead),
            Binding::image("field_hits", Access::ComputeWrite),
            Binding::image("field_surfaces", Access::ComputeReadWrite),
        ],
    ),
    constants: &join::<_, 3, 1, 4>(bvh::CONSTANTS, ["KEEPS"]),
    params: Some(FieldTraceParams::LAYOUT),
    sets: Sets::Scene,
};

/// Its radiance. Reads hits and the maps of irradiance, writes R32UI; a thread a texel.
pub static LIGHT: Pass = Pass {
    name: "light_field.light",
    shaders: Shaders::Compute("gi/probes/field_light.comp"),
    bindings: &join::<_, 11, 5, 16>(
        join::<_, 9, 2, 11>(
            paths::BINDINGS,
            [
                Binding::sampled("field_hits", Access::ComputeSampled),
                Binding::image("field_radiance", Access::ComputeWrite),
            ],
        ),
        LOOKUP_BINDINGS,
    ),
    constants: &join::<_, 12, 1, 13>(
        join::<_, 6, 6, 12>(paths::CONSTANTS, LOOKUP_CONSTANTS),
        ["REFLECTS"],
    ),
    params: Some(FieldLightParams::LAYOUT),
    sets: Sets::Scene,
};

/// The maps of all probes beside each other, each without a border
/// (`gi/probes/field_texels.glsl`).
pub struct Field {
    /// Edge of a map (texels).
    pub edge: u32,
    /// Maps beside each other in the images.
    pub columns: u32,
    /// Number of probes.
    pub probe_count: u32,
    /// RG32UI: the triangle that a texel sees, and where on it.
    pub hits: Arc<Image>,
    /// R32UI: how far off that is (cells), half a word, and the normal there.
    pub surfaces: Arc<Image>,
    /// R32UI: its radiance (W/(m² sr)), with an exponent that the channels share.
    pub radiance: Arc<Image>,
}

impl Field {
    /// Makes room for maps of `edge`² texels of all probes.
    pub fn new(gpu: &Gpu, volume: &Volume, edge: u32) -> Result<Self, Error> {
        let (columns, probe_count) = (volume.columns, volume.lattice.probe_count());
        let size = [columns * edge, probe_count.div_ceil(columns) * edge];
        let image = |name, format| store_image(gpu, name, size, format);
        Ok(Field {
            edge,
            columns,
            probe_count,
            hits: image("light_field.hits", vk::Format::R32G32_UINT)?,
            surfaces: image("light_field.surfaces", vk::Format::R32_UINT)?,
            radiance: image("light_field.radiance", vk::Format::R32_UINT)?,
        })
    }

    /// Maps beside each other, and below each other.
    pub(super) fn layout(&self) -> [u32; 2] {
        [self.columns, self.probe_count.div_ceil(self.columns)]
    }

    /// Workgroups of passes that have a thread a texel.
    pub(super) fn groups(&self) -> [u32; 3] {
        let [width, height, _] = self.hits.extent(0);
        [width.div_ceil(8), height.div_ceil(8), 1]
    }

    /// Adds [`TRACE`]: what all probes see from where they stand. With a box in which something has
    /// moved (m), texels of probes that stand where they were, and do not see through it, keep what
    /// they see.
    pub fn trace(
        &self,
        frame: &mut Frame,
        triangles: &SceneRays,
        volume: &Volume,
        moved: Option<Moved>,
    ) {
        let [low, high] = corners(moved);
        triangles
            .bind(frame.pass(&TRACE))
            .bind("probe_places", &volume.places)
            .bind("field_hits", &self.hits)
            .bind("field_surfaces", &self.surfaces)
            .constant("KEEPS", moved.is_some())
            .push(&FieldTraceParams {
                low,
                high,
                columns: self.columns,
                edge: self.edge,
                probe_count: self.probe_count,
                cell_m: volume.lattice.cell(),
            })
            .dispatch(self.groups());
    }

    /// Binds what they see, and its radiance to be written.
    pub(super) fn bind_lit<'f>(&self, pass: PassBuilder<'f>) -> PassBuilder<'f> {
        pass.bind("field_hits", &self.hits)
            .bind("field_radiance", &self.radiance)
    }

    /// Adds [`LIGHT`]: the light of what all probes see; with `reflected`, also what that reflects
    /// of the irradiance in these maps, of probes that may be others.
    pub fn light(
        &self,
        frame: &mut Frame,
        given: &Inputs<'_>,
        scene: &PathScene,
        (volume, lookup): (&Volume, &Lookup),
        (reflected, uses_maps): (Option<&Maps>, bool),
    ) {
        let pass = scene.bind(frame.pass(&LIGHT), given, uses_maps);
        let pass = lookup.bind(pass, volume, reflected.unwrap_or(volume.lit(1)));
        self.bind_lit(pass)
            .constant("REFLECTS", reflected.is_some())
            .push(&FieldLightParams {
                lookup: lookup.row(volume),
                edge: self.edge,
                columns: self.columns,
                probe_count: self.probe_count,
            })
            .dispatch(self.groups());
    }
}
