//! Light fields as the camera sees them.

use std::sync::Arc;

use crate::gi::inspect::{Scale, ViewRow};
use crate::gi::probes::field::Field;
use crate::gi::probes::field::LOOKUP;
use crate::gi::probes::lookup::{LOOKUP_BINDINGS, LOOKUP_CONSTANTS};
use crate::gi::probes::passes::LookupRow;
use crate::gi::probes::view::{RADIUS, row};
use crate::gi::probes::volume::Volume;
use crate::gpu_struct;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Frame, Image, Pass, Sets, Shaders};
use crate::render::{GBuffer, screen_groups};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `light_field.view`.
    struct FieldViewParams {
        /// How places look probes up.
        lookup: LookupRow,
        /// Radius of a sphere (m).
        radius_m: f32,
        /// From the first probe to the last (cells).
        reach: f32,
        /// Which of the views.
        view: u32,
        /// Number of probes.
        probe_count: u32,
    }
}

/// Probes as spheres in front of surfaces, by what they see, or the images of their maps. Reads the
/// G-buffer and maps, writes RGBA32F; a thread a pixel.
pub(super) static VIEW: Pass = Pass {
    name: "light_field.view",
    shaders: Shaders::Compute("gi/probes/light_field/view.comp"),
    bindings: &join::<_, 8, 2, 10>(
        join::<_, 3, 5, 8>(
            [
                Binding::sampled("view_depth", Access::ComputeSampled),
                Binding::sampled("normals", Access::ComputeSampled),
                Binding::image("seen", Access::ComputeWrite),
            ],
            LOOKUP_BINDINGS,
        ),
        [
            Binding::sampled("field_surfaces", Access::ComputeSampled),
            Binding::sampled("field_radiance", Access::ComputeSampled),
        ],
    ),
    constants: &join::<_, 6, 1, 7>(LOOKUP_CONSTANTS, ["FIELD_TEXELS"]),
    params: Some(FieldViewParams::LAYOUT),
    sets: Sets::Scene,
};

/// The views, in the order of the shader.
pub(super) static VIEWS: [ViewRow; 4] = [
    row(
        "probe-radiance",
        "W/(m² sr)",
        Scale::Light,
        "probes as spheres, by the radiance that comes from where the sphere faces",
    ),
    row(
        "probe-distances",
        "",
        Scale::Share,
        "probes as spheres, by how far they see there: 1 is all across the lattice",
    ),
    row(
        "probe-radiance-maps",
        "W/(m² sr)",
        Scale::Light,
        "the octahedral maps of radiance of all probes, beside each other",
    ),
    row(
        "probe-distance-maps",
        "",
        Scale::Share,
        "the octahedral maps of how far all probes see: 1 is all across the lattice",
    ),
];

/// Adds the pass that draws one of them.
pub(super) fn draw(
    frame: &mut Frame,
    view: &ViewRow,
    (volume, field): (&Volume, &Field),
    (gbuffer, seen): (&GBuffer, &Arc<Image>),
) {
    let [width, height, _] = seen.extent(0);
    let lattice = &volume.lattice;
    let across = (lattice.spacing * (lattice.counts - 1).as_vec3()).length();
    let pass = frame
        .pass(&VIEW)
        .bind("view_depth", &gbuffer.view_depth)
        .bind("normals", &gbuffer.normals)
        .bind("seen", seen)
        .bind("field_surfaces", &field.surfaces)
        .bind("field_radiance", &field.radiance)
        .constant("FIELD_TEXELS", field.edge);
    LOOKUP
        .bind(pass, volume, volume.lit(1))
        .push(&FieldViewParams {
            lookup: LOOKUP.row(volume),
            radius_m: RADIUS * lattice.cell(),
            reach: across / lattice.cell(),
            view: VIEWS.iter().position(|row| row == view).unwrap_or(0) as u32,
            probe_count: lattice.probe_count(),
        })
        .dispatch(screen_groups([width, height]));
}
