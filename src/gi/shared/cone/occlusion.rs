//! Ambient visibility by cones of its own: a set, a reach and a falloff apart from those that
//! gather light (Hong 2015, section 2.5.3.3.8; Villegas & Ramírez, section VIII-B).

use super::march::{ConeKind, ConeSettings};
use super::sets::cone_set;
use super::tracer::{ConeParams, ConeTracer, DeviceSet, gather_params, tan_half};
use super::volume::{ConeOutput, March, Volume};
use crate::gi::Settings;
use crate::graph::{Error, Frame, Gpu};
use crate::render::Receivers;

/// Cones of the ambient visibility alone.
pub(super) struct OcclusionCones {
    set: DeviceSet,
    kind: ConeKind,
    /// Longest reach (m); 0: to the end of the grid.
    reach_m: f32,
    /// λ of a sample's distance, and of the cone's radius there (1/m).
    falloffs: [f32; 2],
}

impl OcclusionCones {
    /// From a technique's settings; `None` where they have none.
    pub(super) fn new(
        gpu: &Gpu,
        settings: &Settings,
        kind: ConeKind,
    ) -> Result<Option<Self>, Error> {
        let count = settings.count("occlusion_cones");
        if count == 0 {
            return Ok(None);
        }
        let mut set = cone_set(count, true, settings.number("aperture_scale"));
        let aperture = settings.number("occlusion_aperture");
        if aperture > 0.0 {
            let cones = set.cones.iter_mut();
            cones.for_each(|cone| cone.tan_half_aperture = tan_half(aperture));
        }
        let falloff = settings.number("occlusion_falloff");
        Ok(Some(OcclusionCones {
            set: DeviceSet::new(gpu, "cone.occlusion_set", &set)?,
            kind,
            reach_m: settings.number("occlusion_distance"),
            falloffs: if settings.is("occlusion_weight", "radius") {
                [0.0, falloff]
            } else {
                [falloff, 0.0]
            },
        }))
    }

    /// Whether they skip empty space.
    pub(super) fn is_narrow(&self) -> bool {
        self.set.is_narrow
    }
}

impl ConeTracer {
    /// Adds the ambient visibility by cones of its own to what was gathered; nothing where the
    /// settings have none.
    pub fn occlusion(&self, frame: &mut Frame, receivers: &Receivers<'_>, volume: Volume<'_>) {
        let Some(cones) = &self.occlusion else {
            return;
        };
        let [ao_falloff, radius_falloff] = cones.falloffs;
        let settings = ConeSettings {
            max_distance_m: cones.reach_m,
            ao_falloff,
            radius_falloff,
            ..self.settings.of_kind(cones.kind)
        };
        let march = March::new(cones.is_narrow(), ConeOutput::Light, settings.face_weights);
        for params in gather_params(frame.loops(), &settings, &cones.set, volume) {
            let params = ConeParams {
                is_occlusion: 1,
                ..params
            };
            volume
                .pass(frame, &volume.passes.occlusion, march)
                .bind("view_depth", receivers.view_depth)
                .bind("normals", receivers.normals)
                .bind("cones", &cones.set.cones)
                .bind("indirect_diffuse", receivers.light)
                .push(&params)
                .dispatch(receivers.groups());
        }
    }
}
