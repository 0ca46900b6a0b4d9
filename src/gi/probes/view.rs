//! The probes as the camera sees them.

use std::sync::Arc;

use super::lookup::{LOOKUP_BINDINGS, LOOKUP_CONSTANTS, Lookup};
use super::passes::LookupRow;
use super::snap;
use super::volume::{Maps, Volume};
use crate::gi::inspect::{Channels, Scale, ViewRow};
use crate::gpu_struct;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Frame, Image, Pass, Sets, Shaders};
use crate::render::{GBuffer, screen_groups};
use crate::shader::GpuStruct;

/// Radius of a sphere (cells).
pub(super) const RADIUS: f32 = 0.1;

gpu_struct! {
    /// Parameters of `probes.view`.
    pub struct ViewParams {
        /// How places look probes up.
        pub lookup: LookupRow,
        /// Radius of a sphere (m).
        pub radius_m: f32,
        /// How far a probe moves at most (m).
        pub farthest_m: f32,
        /// The farthest that a probe sees (cells).
        pub reach: f32,
        /// Which of the views.
        pub view: u32,
    }
}

/// Probes as spheres in front of surfaces, or the images of maps. Reads the G-buffer and maps,
/// writes RGBA32F; a thread a pixel.
pub static VIEW: Pass = Pass {
    name: "probes.view",
    shaders: Shaders::Compute("gi/probes/view.comp"),
    bindings: &join::<_, 3, 5, 8>(
        [
            Binding::sampled("view_depth", Access::ComputeSampled),
            Binding::sampled("normals", Access::ComputeSampled),
            Binding::image("seen", Access::ComputeWrite),
        ],
        LOOKUP_BINDINGS,
    ),
    constants: &LOOKUP_CONSTANTS,
    params: Some(ViewParams::LAYOUT),
    sets: Sets::Scene,
};

/// A view in colours.
pub(super) const fn row(
    name: &'static str,
    unit: &'static str,
    scale: Scale,
    help: &'static str,
) -> ViewRow {
    ViewRow {
        name,
        aliases: &[],
        help,
        unit,
        scale,
        channels: Channels::Rgb,
    }
}

const PROBES: ViewRow = row(
    "probes",
    "W/m²",
    Scale::Light,
    "probes as spheres, by the irradiance of a surface that faces as the sphere does; surfaces by \
     the irradiance that they look up",
);

const DISTANCES: ViewRow = row(
    "probe-distances",
    "",
    Scale::Share,
    "probes as spheres, by the mean distance that they see: 1 is the farthest",
);

const SIGHT: ViewRow = row(
    "probe-sight",
    "",
    Scale::Share,
    "the share of the eight probes around a surface that it sees; red where it sees none",
);

/// The views, in the order of the shader.
pub(super) static VIEWS: [ViewRow; 6] = [
    PROBES,
    DISTANCES,
    row(
        "probe-moves",
        "",
        Scale::Signed,
        "probes as spheres, by the way from the lattice to where they stand: ±1 is as far as they \
         may go",
    ),
    SIGHT,
    row(
        "probe-irradiance-maps",
        "W/m²",
        Scale::Light,
        "the octahedral maps of irradiance of all probes, beside each other",
    ),
    row(
        "probe-distance-maps",
        "",
        Scale::Share,
        "the octahedral maps of distances of all probes: red the mean, green the standard \
         deviation; 1 is the farthest",
    ),
];

/// Those that there are of each of several lattices.
pub(super) static LEVEL_VIEWS: [ViewRow; 3] = [PROBES, DISTANCES, SIGHT];

/// Whether there is such a view of a volume.
pub(super) fn is_there(view: &ViewRow, volume: &Volume) -> bool {
    let is_drawn = match view.name {
        "probe-distances" | "probe-sight" | "probe-distance-maps" => volume.has_moments,
        "probe-irradiance-maps" => !volume.is_sh,
        _ => true,
    };
    VIEWS.contains(view) && is_drawn
}

/// The number that the shader has for a view.
pub(super) fn index_of(view: &ViewRow) -> u32 {
    VIEWS.iter().position(|row| row == view).unwrap_or(0) as u32
}

/// Adds the pass that draws one of them.
pub(super) fn draw(
    frame: &mut Frame,
    view: &ViewRow,
    (volume, maps, lookup): (&Volume, &Maps, &Lookup),
    (gbuffer, seen): (&GBuffer, &Arc<Image>),
) {
    let [width, height, _] = seen.extent(0);
    let cell = volume.lattice.cell();
    let pass = frame
        .pass(&VIEW)
        .bind("view_depth", &gbuffer.view_depth)
        .bind("normals", &gbuffer.normals)
        .bind("seen", seen);
    lookup
        .bind(pass, volume, maps)
        .push(&ViewParams {
            lookup: lookup.row(volume),
            radius_m: RADIUS * cell,
            farthest_m: snap::FARTHEST * cell,
            reach: volume.reach(),
            view: index_of(view),
        })
        .dispatch(screen_groups([width, height]));
}
