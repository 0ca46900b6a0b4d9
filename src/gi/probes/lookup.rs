//! How surfaces look probes up.

use super::passes::{GATHER, GATHER_BY_RAYS, LookupParams, LookupRow};
use super::volume::{Maps, Volume};
use crate::gi::Settings;
use crate::graph::{Access, Binding, Frame, PassBuilder};
use crate::render::Receivers;
use crate::render::bvh::SceneRays;

/// What keeps a probe out that a surface does not see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// Nothing.
    None = 0,
    /// The side of the surface that it is on.
    Facing = 1,
    /// That, and the distances that it sees.
    Moments = 2,
    /// The side, and a ray to the probe.
    Rays = 3,
}

/// How surfaces look probes up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lookup {
    /// What keeps probes out.
    pub visibility: Visibility,
    /// How far off its surface a place looks probes up (cells).
    pub normal_bias: f32,
    /// Least share of a probe that visibility leaves.
    pub weight_floor: f32,
    /// Below this weight probes count less than their weight.
    pub crush: f32,
    /// Shells of further probes that a place asks whose eight are all hidden by distances.
    pub rings: u32,
}

impl Lookup {
    /// As the settings say.
    pub(super) fn new(settings: &Settings) -> Self {
        let visibility = if settings.is("visibility", "moments") {
            Visibility::Moments
        } else if settings.is("visibility", "rays") {
            Visibility::Rays
        } else if settings.is("visibility", "facing") {
            Visibility::Facing
        } else {
            Visibility::None
        };
        Lookup {
            visibility,
            normal_bias: settings.number("normal_bias"),
            weight_floor: settings.number("weight_floor"),
            crush: settings.number("crush"),
            rings: settings.count("rings"),
        }
    }

    /// For a volume.
    pub(super) fn row(&self, volume: &Volume) -> LookupRow {
        let (lattice, cell) = (&volume.lattice, volume.lattice.cell());
        LookupRow {
            first: lattice.first.extend(0.0).to_array(),
            spacing: lattice.spacing.extend(cell).to_array(),
            counts: lattice.counts.extend(0).to_array(),
            columns: volume.columns,
            normal_bias_m: self.normal_bias * cell,
            weight_floor: self.weight_floor,
            crush: self.crush,
        }
    }

    /// Binds [`LOOKUP_BINDINGS`] and gives [`LOOKUP_CONSTANTS`].
    pub(super) fn bind<'f>(
        &self,
        pass: PassBuilder<'f>,
        volume: &Volume,
        maps: &Maps,
    ) -> PassBuilder<'f> {
        pass.bind("probe_places", &volume.places)
            .bind("probe_scales", &maps.scales)
            .bind("probe_irradiance", &maps.irradiance)
            .bind("probe_moments", &volume.moments)
            .bind("probe_gradients", &maps.gradients)
            .constant(LOOKUP_CONSTANTS[0], volume.irradiance_texels)
            .constant(LOOKUP_CONSTANTS[1], volume.moment_texels)
            .constant(LOOKUP_CONSTANTS[2], self.visibility as u32)
            .constant(LOOKUP_CONSTANTS[3], self.rings)
            .constant(LOOKUP_CONSTANTS[4], volume.has_gradients)
            .constant(LOOKUP_CONSTANTS[5], volume.is_sh)
    }
}

/// Adds [`GATHER`] for surfaces, or [`GATHER_BY_RAYS`] where rays say what they see.
pub fn gather(
    frame: &mut Frame,
    receivers: &Receivers<'_>,
    triangles: &SceneRays,
    (volume, maps): (&Volume, &Maps),
    lookup: &Lookup,
) {
    let pass = if lookup.visibility == Visibility::Rays {
        triangles.bind(frame.pass(&GATHER_BY_RAYS))
    } else {
        frame.pass(&GATHER)
    };
    let pass = pass
        .bind("view_depth", receivers.view_depth)
        .bind("normals", receivers.normals)
        .bind("indirect_diffuse", receivers.light)
        .bind("probe_orphans", &volume.orphans);
    lookup
        .bind(pass, volume, maps)
        .push(&LookupParams {
            lookup: lookup.row(volume),
        })
        .dispatch(receivers.groups());
}

/// What a pass binds that looks probes up (`gi/probes/lookup.glsl`).
pub(super) const LOOKUP_BINDINGS: [Binding; 5] = [
    Binding::buffer("probe_places", Access::ComputeRead),
    Binding::buffer("probe_scales", Access::ComputeRead),
    Binding::sampled("probe_irradiance", Access::ComputeSampled),
    Binding::sampled("probe_moments", Access::ComputeSampled),
    Binding::sampled("probe_gradients", Access::ComputeSampled),
];

/// The constants that it has for that.
pub(super) const LOOKUP_CONSTANTS: [&str; 6] = [
    "IRRADIANCE_TEXELS",
    "MOMENT_TEXELS",
    "VISIBILITY",
    "RINGS",
    "HAS_GRADIENTS",
    "IS_SH",
];
