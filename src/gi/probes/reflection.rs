//! Reflection probes: a lattice of light fields that surfaces mirror alone, beside probes that have
//! their irradiance.

use std::sync::Arc;

use glam::Vec3;

use super::field::{Field, RADIANCE_TEXELS};
use super::lattice::Lattice;
use super::mirror::FEW_MIRROR_RAYS;
use super::prefiltered::{PARALLAX, PARALLAX_RULE, Parallax, Prefiltered};
use super::rays::Moved;
use super::volume::{Irradiance, Kept, Volume};
use crate::gi::Inputs;
use crate::gi::settings::{Domain, Group, Rule, Setting, Settings};
use crate::graph::{Error, Frame, Gpu, Image};
use crate::render::bvh::SceneRays;

/// How glossy surfaces mirror.
pub(super) const REFLECTION_SETTINGS: &[Setting] = &[
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
pub(super) const REFLECTION_RULES: &[Rule] = &[
    Rule {
        group: Group::Structure,
        settings: &["reflection_probes", RADIANCE_TEXELS.name],
        applies: |settings| settings.is("specular", "prefiltered"),
    },
    PARALLAX_RULE,
];

/// How many reflection probes there are, and how they are looked up.
#[derive(Clone, Copy)]
pub(super) struct ReflectionSettings {
    /// Along the longest side of what they are in.
    pub(super) probes: u32,
    texels: u32,
    parallax: Parallax,
}

impl ReflectionSettings {
    /// As the settings say; none where nothing is averaged beforehand.
    pub(super) fn new(settings: &Settings) -> Option<Self> {
        Parallax::new(settings).map(|parallax| ReflectionSettings {
            probes: settings.count("reflection_probes"),
            texels: settings.count(RADIANCE_TEXELS.name),
            parallax,
        })
    }

    /// All through these bounds (m).
    pub(super) fn lattice(&self, bounds: (Vec3, Vec3)) -> Lattice {
        Lattice::within(bounds, self.probes, OUTER_LAYER)
    }
}

/// Puts them where their lattice has them: they never move from there, and are traced all at once.
fn put(gpu: &Gpu, volume: &Volume) -> Result<(), Error> {
    let places: Vec<Vec3> = volume.lattice.places().collect();
    volume.put(gpu, &places, &places)
}

/// The reflection probes of a scene.
pub(super) struct ReflectionProbes {
    volume: Volume,
    field: Field,
    prefiltered: Prefiltered,
}

/// How far inside of the scene's bounds the outermost stand (spacings): all are in the middle of
/// the room that they answer for.
pub(super) const OUTER_LAYER: f32 = 0.5;

impl ReflectionProbes {
    /// Makes room for them, on this lattice. [`ReflectionProbes::trace`] is next.
    pub(super) fn new(gpu: &Gpu, lattice: Lattice, how: ReflectionSettings) -> Result<Self, Error> {
        let kept = Kept {
            irradiance: Irradiance::Harmonics,
            moment_texels: None,
            has_gradients: false,
            bounces: 1,
        };
        let volume = Volume::new(gpu, lattice, &kept)?;
        put(gpu, &volume)?;
        let field = Field::new(gpu, &volume, how.texels)?;
        Ok(ReflectionProbes {
            prefiltered: Prefiltered::new(gpu, &field, how.parallax)?,
            volume,
            field,
        })
    }

    /// Adds the pass that finds out what they see, all of it or as [`Field::trace`] has it.
    pub(super) fn trace(&self, frame: &mut Frame, triangles: &SceneRays, moved: Option<Moved>) {
        self.field.trace(frame, triangles, &self.volume, moved);
    }

    /// Whether they stand elsewhere than on this lattice.
    pub(super) fn is_elsewhere(&self, lattice: &Lattice) -> bool {
        self.volume.lattice != *lattice
    }

    /// Puts them on another lattice of as many. [`ReflectionProbes::trace`] of all is next.
    pub(super) fn move_to(&mut self, gpu: &Gpu, lattice: Lattice) -> Result<(), Error> {
        self.volume = self.volume.looked_up_by(lattice);
        put(gpu, &self.volume)
    }

    /// Adds the passes that average what they see, after those that light it, which `light` adds.
    pub(super) fn light(&self, frame: &mut Frame, light: impl FnOnce(&mut Frame, &Field)) {
        light(frame, &self.field);
        self.prefiltered.filter(frame, &self.field);
    }

    /// Adds the pass by which surfaces mirror them, as [`Prefiltered::reflect`] has it.
    pub(super) fn reflect(
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
