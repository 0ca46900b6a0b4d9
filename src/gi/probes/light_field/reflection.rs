//! Reflection probes: a lattice of light fields that surfaces mirror alone, beside probes that have
//! their irradiance.

use std::sync::Arc;

use glam::Vec3;

use super::field::Field;
use super::prefiltered::{PARALLAX, PARALLAX_RULE, Parallax, Prefiltered};
use super::settings::RADIANCE_TEXELS;
use crate::gi::Inputs;
use crate::gi::probes::lattice::Lattice;
use crate::gi::probes::lookup::Lookup;
use crate::gi::probes::mirror::FEW_MIRROR_RAYS;
use crate::gi::probes::rays::Moved;
use crate::gi::probes::volume::{Irradiance, Kept, Maps, Volume};
use crate::gi::settings::{Domain, Group, Rule, Setting, Settings};
use crate::gi::shared::paths::PathScene;
use crate::graph::{Error, Frame, Gpu, Image};
use crate::render::GpuScene;
use crate::render::bvh::SceneRays;

/// How glossy surfaces mirror.
pub(in crate::gi::probes) const REFLECTION_SETTINGS: &[Setting] = &[
    Setting {
        name: "specular",
        help: "glossy reflections: rays, which meet triangles that the lights light, and probes \
               after more bounces; prefiltered, of reflection probes up to roughness 0.35, rays \
               to 0.65, and beyond the mean of all that they see in front of a surface; cones, \
               through the store of another technique; or off",
        unit: "",
        domain: Domain::Choice(&["rays", "prefiltered", "cones", "off"]),
        default: "rays",
    },
    FEW_MIRROR_RAYS,
    Setting {
        name: "reflection_probes",
        help: "reflection probes along the longest side of the scene",
        unit: "probes",
        domain: Domain::Count { min: 2, max: 32 },
        default: "8",
    },
    RADIANCE_TEXELS,
    PARALLAX,
];

/// In which group those are that other techniques have not, and when they have an effect.
pub(in crate::gi::probes) const REFLECTION_RULES: &[Rule] = &[
    Rule {
        group: Group::Structure,
        settings: &["reflection_probes", RADIANCE_TEXELS.name],
        applies: |settings| settings.is("specular", "prefiltered"),
    },
    PARALLAX_RULE,
];

/// How many reflection probes there are, and how they are looked up.
#[derive(Clone, Copy)]
pub(in crate::gi::probes) struct ReflectionSettings {
    probes: u32,
    texels: u32,
    parallax: Parallax,
}

impl ReflectionSettings {
    /// As the settings say; none where nothing is averaged beforehand.
    pub(in crate::gi::probes) fn new(settings: &Settings) -> Option<Self> {
        Parallax::new(settings).map(|parallax| ReflectionSettings {
            probes: settings.count("reflection_probes"),
            texels: settings.count(RADIANCE_TEXELS.name),
            parallax,
        })
    }
}

/// The reflection probes of a scene.
pub(in crate::gi::probes) struct ReflectionProbes {
    volume: Volume,
    field: Field,
    prefiltered: Prefiltered,
}

/// How far inside of the scene's bounds the outermost stand (spacings): all are in the middle of
/// the room that they answer for.
const OUTER_LAYER: f32 = 0.5;

impl ReflectionProbes {
    /// Makes room for them, on a lattice. [`ReflectionProbes::trace`] is next.
    pub(in crate::gi::probes) fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        how: ReflectionSettings,
    ) -> Result<Self, Error> {
        let lattice = Lattice::within(scene.lit_bounds(), how.probes, OUTER_LAYER);
        let kept = Kept {
            irradiance: Irradiance::Harmonics,
            moment_texels: None,
            has_gradients: false,
            bounces: 1,
        };
        let volume = Volume::new(gpu, lattice, &kept)?;
        let places: Vec<Vec3> = lattice.places().collect();
        // They never stand elsewhere; the first trace is of all.
        volume.put(gpu, &places, &places)?;
        let field = Field::new(gpu, &volume, how.texels)?;
        Ok(ReflectionProbes {
            prefiltered: Prefiltered::new(gpu, &field, how.parallax)?,
            volume,
            field,
        })
    }

    /// Adds the pass that finds out what they see, all of it or as [`Field::trace`] has it.
    pub(in crate::gi::probes) fn trace(
        &self,
        frame: &mut Frame,
        triangles: &SceneRays,
        moved: Option<Moved>,
    ) {
        self.field.trace(frame, triangles, &self.volume, moved);
    }

    /// Adds the passes that light what they see, and average it. `probes`: of which it reflects the
    /// light in these maps, if there are any.
    pub(in crate::gi::probes) fn light(
        &self,
        frame: &mut Frame,
        given: &Inputs<'_>,
        scene: &PathScene,
        probes: (&Volume, &Lookup),
        how: (Option<&Maps>, bool),
    ) {
        self.field.light(frame, given, scene, probes, how);
        self.prefiltered.filter(frame, &self.field);
    }

    /// Adds the pass by which surfaces mirror them, as [`Prefiltered::reflect`] has it.
    pub(in crate::gi::probes) fn reflect(
        &self,
        frame: &mut Frame,
        given: &Inputs<'_>,
        triangles: &SceneRays,
        (specular, light): (&Arc<Image>, &Arc<Image>),
    ) {
        let of = (&self.volume, &self.field);
        let to = (given.gbuffer, specular, light);
        (self.prefiltered).reflect(frame, (given.scene, triangles), of, to);
    }
}
