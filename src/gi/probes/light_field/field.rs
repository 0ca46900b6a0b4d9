//! The light fields of all probes: what each sees, texel by texel of an octahedral map.

use std::sync::Arc;

use super::passes::{FieldLightParams, FieldTraceParams, LIGHT, TRACE};
use crate::gi::Inputs;
use crate::gi::probes::lookup::Lookup;
use crate::gi::probes::rays::{Moved, corners};
use crate::gi::probes::volume::{Maps, Volume, store_image};
use crate::gi::shared::paths::PathScene;
use crate::graph::{Error, Frame, Gpu, Image, vk};
use crate::render::bvh::SceneRays;

/// The maps of all probes beside each other, each without a border
/// (`gi/probes/light_field/texels.glsl`).
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

    fn groups(&self) -> [u32; 3] {
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
        lookup
            .bind(pass, volume, reflected.unwrap_or(volume.lit(1)))
            .bind("field_hits", &self.hits)
            .bind("field_radiance", &self.radiance)
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
