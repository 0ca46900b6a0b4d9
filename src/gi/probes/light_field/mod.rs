//! Technique `light-field-probes`: probes that know what they see, texel by texel. Rays of surfaces
//! go through their maps, and not through triangles (McGuire et al. 2017; Luo 2022, section 4.3).

mod passes;
mod settings;
mod view;

pub use passes::{FieldGatherParams, GATHER, MIRROR};

use std::sync::Arc;

use glam::Vec3;

use super::borrowed::Borrowed;
use super::field::{self, Field, LOOKUP};
use super::passes::{
    BLEND_SH, BOUNCE, EXPLORE, LIGHT as LIGHT_RAYS, MOMENTS, SURFACES, TRACE as TRACE_RAYS,
};
use super::placement::Standing;
use super::prefiltered::{PREFILTER, Parallax, Prefiltered, REFLECT};
use super::rays::{Lighting, MomentFilter, Moved, ProbeRays};
use super::settings::{PLACEMENT, PLACEMENT_RULES};
use super::volume::{Irradiance, Kept, Volume};
use crate::gi::entry::{Directions, Entry, Stage};
use crate::gi::inspect::ViewRow;
use crate::gi::shared::bounces::LightBounces;
use crate::gi::shared::interleave::{self, Pattern};
use crate::gi::shared::paths::{self, Mirrors, PathScene, parts_of_rays};
use crate::gi::{Change, Context, Inputs, Inspect, Needs, Settings, Technique};
use crate::graph::{Error, Frame, FrameStats, Gpu, Image, PassBuilder};
use crate::render::bvh::TURNS_A_RAY;
use crate::render::{GBuffer, GpuScene, Receivers, screen_groups};
use crate::scene::union;
use settings::{FieldRaySettings, MOMENT_TEXELS, PRESETS, RULES, SETTINGS};
use view::{VIEW, VIEWS};

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    bounces: |settings| LightBounces::new(settings).count(),
    frames_to_rest: |settings| LightBounces::new(settings).frames_to_rest(),
    settings: &[
        PLACEMENT,
        SETTINGS,
        interleave::SETTINGS,
        interleave::SPECULAR_SETTINGS,
    ],
    rules: &[
        PLACEMENT_RULES,
        RULES,
        interleave::RULES,
        interleave::SPECULAR_RULES,
    ],
    presets: PRESETS,
    borrows: true,
    passes: &[&[
        &EXPLORE,
        &TRACE_RAYS,
        &SURFACES,
        &MOMENTS,
        &LIGHT_RAYS,
        &BOUNCE,
        &BLEND_SH,
        &field::TRACE,
        &field::LIGHT,
        &GATHER,
        &PREFILTER,
        &REFLECT,
        &MIRROR,
        &VIEW,
    ]],
    views: &[&VIEWS],
    structs: &[paths::STRUCTS, super::passes::STRUCTS],
    stages: &[
        &Stage::store("hierarchy", paths::HOST_PASSES),
        &Stage::store("placement", &["probes.explore"]),
        &Stage::store(
            "tracing",
            &[
                "light_field.trace",
                "probes.trace",
                "probes.surfaces",
                "probes.moments",
            ],
        ),
        &Stage::store("lighting", &["light_field.light", "light_field.prefilter"]),
        &Stage::store(
            "irradiance",
            &["probes.light", "probes.bounce", "probes.blend_sh"],
        ),
        &Stage::picture("gather", &["light_field.gather"]),
        &Stage::picture("specular", &["light_field.reflect", "light_field.mirror"]),
    ],
    directions: &[
        Directions {
            pass: &GATHER,
            count: Some(|settings| settings.count("rays")),
        },
        Directions {
            pass: &MIRROR,
            count: None,
        },
    ],
    directions_setting: |_| Some("rays"),
    ..Entry::new(
        "light-field-probes",
        "a lattice of probes that know what they see, and rays through that",
        make,
    )
};

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    let has_cones = context.scene.is_glossy && settings.is("specular", "cones");
    Ok(Box::new(LightFieldProbes {
        standing: Standing::new(settings),
        texels: settings.count("radiance_texels"),
        probe_rays: settings.count("probe_rays"),
        bounces: LightBounces::new(settings),
        uses_maps: settings.is("hit_light", "maps"),
        field_rays: FieldRaySettings::new(settings),
        mirrors: Mirrors::new(context, settings, "light_field.specular")?,
        parallax: Parallax::new(settings),
        borrowed: Borrowed::new(context, settings, (false, has_cones))?,
        built: None,
    }))
}

struct Built {
    scene: PathScene,
    volume: Volume,
    /// Where the probes stand (m).
    places: Vec<Vec3>,
    /// Where models that move were when probes were traced (m).
    models: Option<Moved>,
    /// Of which probes have their irradiance.
    rays: ProbeRays,
    field: Field,
    /// What surfaces mirror of it without rays.
    prefiltered: Option<Prefiltered>,
    /// Bounces of the last picture.
    lit: u32,
}

struct LightFieldProbes {
    standing: Standing,
    texels: u32,
    probe_rays: u32,
    bounces: LightBounces,
    uses_maps: bool,
    field_rays: FieldRaySettings,
    mirrors: Option<Mirrors>,
    /// How reflections are looked up that are averaged beforehand.
    parallax: Option<Parallax>,
    /// Surfaces mirror what is in that store.
    borrowed: Option<Borrowed>,
    built: Option<Built>,
}

impl LightFieldProbes {
    /// Whether anything asks for the irradiance of probes.
    fn has_irradiance(&self) -> bool {
        self.bounces.any() || !self.field_rays.unknown_by_rays
    }

    /// Bounces that probes' irradiance has in a picture of so many: one less is what texels
    /// reflect, and all are what answers for the unknown.
    fn bounces_of_probes(&self, bounces: u32) -> u32 {
        bounces - u32::from(self.field_rays.unknown_by_rays)
    }

    /// Puts the probes where the scene needs them as it is, and finds out what they see.
    fn place(
        &self,
        &Context { gpu, scene, .. }: &Context<'_>,
        built: &mut Built,
    ) -> Result<FrameStats, Error> {
        let (triangles, how) = (&built.scene.rays, (self.probe_rays, LOOKUP.normal_bias));
        let at = (&built.volume, &mut built.places);
        let stats = (self.standing).put((gpu, scene), triangles, at, how)?;
        let models = scene.dynamic.as_ref().map(|dynamic| dynamic.bounds);
        let before = std::mem::replace(&mut built.models, models);
        let moved = before.zip(models).map(|(before, now)| union(before, now));
        let mut frame = Frame::new();
        frame.set_scene(&scene.set, &scene.materials);
        (built.field).trace(&mut frame, triangles, &built.volume, moved);
        if self.has_irradiance() {
            let (paths, volume) = (&built.scene, &built.volume);
            let probes = volume.listed();
            (built.rays).trace(&mut frame, (scene, paths), volume, probes, moved);
            let of = (volume, probes);
            (built.rays).moments(&mut frame, triangles, of, MomentFilter::Box, moved);
        }
        gpu.enqueue(frame);
        Ok(stats)
    }

    /// First ray, and one beyond the last, of as many dispatches as keep the loops of a thread
    /// within what a device does.
    fn dispatches(&self, scene: &GpuScene, count: u32) -> impl Iterator<Item = [u32; 2]> {
        let lights = if self.uses_maps {
            0
        } else {
            scene.lights.len() as u32
        };
        let unknown = TURNS_A_RAY * (1 + lights);
        let most = (scene.set.loops().budget / (PROBES_A_RAY * 4 * self.texels + unknown)).max(1);
        parts_of_rays(count, most)
    }

    /// A pass with what rays through the field read.
    fn bind<'f>(
        &self,
        pass: PassBuilder<'f>,
        built: &Built,
        given: &Inputs<'_>,
    ) -> PassBuilder<'f> {
        let unknown_by_rays = self.field_rays.unknown_by_rays;
        let asked = self.bounces_of_probes(built.lit);
        let pass = built.scene.bind(pass, given, self.uses_maps);
        LOOKUP
            .bind(pass, &built.volume, built.volume.lit(asked))
            .bind("field_surfaces", &built.field.surfaces)
            .bind("field_radiance", &built.field.radiance)
            .constant("FIELD_TEXELS", self.texels)
            .constant("THICKNESS_TRACE", self.field_rays.has_thickness)
            .constant("UNKNOWN_BY_RAYS", unknown_by_rays)
            .constant("REFLECTS", built.lit > 1)
    }

    /// What the rays of a dispatch are told.
    fn params(
        &self,
        volume: &Volume,
        ray_count: u32,
        [first_ray, end_ray]: [u32; 2],
        pattern: Pattern,
    ) -> FieldGatherParams {
        FieldGatherParams {
            lookup: LOOKUP.row(volume),
            ray_count,
            first_ray,
            end_ray,
            pattern: pattern.bits(),
            origin_bias: self.field_rays.origin_bias,
            thickness_m: self.field_rays.thickness_m,
        }
    }
}

/// Probes that a ray asks at most.
const PROBES_A_RAY: u32 = 8;

/// Bounces for which probes have room where they are fed back: after the second, one and the other
/// in turn.
const FEEDBACK_BOUNCES: u32 = 3;

impl Technique for LightFieldProbes {
    fn needs(&self) -> Needs {
        let own = paths::needs(self.uses_maps);
        (self.borrowed.as_ref()).map_or(own, |borrowed| borrowed.needs(own))
    }

    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        self.built = None;
        let &Context { gpu, scene, .. } = context;
        let (own, mut stats) = PathScene::build(gpu, scene)?;
        if let Some(borrowed) = &mut self.borrowed {
            stats.append(borrowed.build(context)?);
        }
        let lattice = self.standing.lattice(scene);
        let has_irradiance = self.has_irradiance();
        let kept = Kept {
            irradiance: Irradiance::Harmonics,
            moment_texels: has_irradiance.then_some(MOMENT_TEXELS),
            has_gradients: false,
            bounces: self.bounces.count().map_or(FEEDBACK_BOUNCES, |count| {
                self.bounces_of_probes(count).max(1)
            }),
        };
        let volume = Volume::new(gpu, lattice, &kept)?;
        let traced = if has_irradiance {
            lattice.probe_count()
        } else {
            1
        };
        let field = Field::new(gpu, &volume, self.texels)?;
        let parallax = self.mirrors.as_ref().and(self.parallax);
        let mut built = Built {
            scene: own,
            places: Vec::new(),
            models: None,
            prefiltered: parallax
                .map(|parallax| Prefiltered::new(gpu, &field, parallax))
                .transpose()?,
            field,
            rays: ProbeRays::new(gpu, traced, self.probe_rays)?,
            volume,
            lit: 0,
        };
        stats.append(self.place(context, &mut built)?);
        self.built = Some(built);
        Ok(stats)
    }

    fn follow(&mut self, context: &Context<'_>, change: Change) -> Result<FrameStats, Error> {
        let is_moved = change == Change::Models;
        if self.built.is_none() && is_moved {
            return self.build(context);
        }
        let mut stats = FrameStats::default();
        if let Some(borrowed) = &mut self.borrowed {
            stats.append(borrowed.follow(context, change)?);
        }
        let Some(mut built) = self.built.take_if(|_| is_moved) else {
            return Ok(stats);
        };
        stats.append(built.scene.follow(context.gpu, context.scene)?);
        stats.append(self.place(context, &mut built)?);
        self.built = Some(built);
        Ok(stats)
    }

    fn update(&mut self, frame: &mut Frame, given: &Inputs<'_>) {
        let Some(last) = self.built.as_ref().map(|built| built.lit) else {
            return;
        };
        let lit = self.bounces.count().unwrap_or(last + 1);
        let of_probes = self.bounces_of_probes(lit);
        let Some(built) = &mut self.built else { return };
        if let Some(borrowed) = &mut self.borrowed {
            borrowed.update(frame, given);
        }
        if given.is_still && self.bounces != LightBounces::Feedback {
            return;
        }
        built.lit = lit;
        if of_probes > 0 {
            let first = match self.bounces {
                LightBounces::Count(_) => 2,
                LightBounces::Feedback => of_probes.max(2),
            };
            let bounces: Vec<[u32; 2]> = (first..=of_probes).map(|lit| [lit - 1, lit]).collect();
            let how = Lighting {
                lookup: &LOOKUP,
                bounces: &bounces,
                uses_maps: self.uses_maps,
                kept: 0.0,
                voxels: None,
            };
            let of = (&built.volume, built.volume.listed());
            (built.rays).light(frame, given, &built.scene, of, how);
        }
        let reflected = (built.lit > 1).then(|| built.volume.lit(built.lit - 1));
        let probes = (&built.volume, &LOOKUP);
        (built.field).light(
            frame,
            given,
            &built.scene,
            probes,
            (reflected, self.uses_maps),
        );
        if let Some(prefiltered) = &built.prefiltered {
            prefiltered.filter(frame, &built.field);
        }
    }

    fn gather(&mut self, frame: &mut Frame, given: &Inputs<'_>, receivers: &Receivers<'_>) {
        let Some(built) = &self.built else { return };
        let FieldRaySettings { rays, pattern, .. } = self.field_rays;
        for part in self.dispatches(given.scene, rays) {
            self.bind(frame.pass(&GATHER), built, given)
                .bind("view_depth", receivers.view_depth)
                .bind("normals", receivers.normals)
                .bind("indirect_diffuse", receivers.light)
                .push(&self.params(&built.volume, rays, part, pattern))
                .dispatch(receivers.groups());
        }
    }

    fn mirror(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> Option<Arc<Image>> {
        if let Some(borrowed) = &mut self.borrowed {
            return borrowed.mirror(frame, given);
        }
        let (built, mirrors) = (self.built.as_ref()?, self.mirrors.as_ref()?);
        let specular = given.gbuffer.specular.as_ref()?;
        let (count, pattern) = (mirrors.rays, mirrors.pattern);
        if let Some(prefiltered) = &built.prefiltered {
            let of = (&built.volume, &built.field);
            let to = (given.gbuffer, specular, &mirrors.light);
            prefiltered.reflect(frame, (given.scene, &built.scene.rays), of, to);
        }
        for part in self.dispatches(given.scene, count) {
            let pass = self.bind(frame.pass(&MIRROR), built, given);
            (mirrors.bind(pass, given.gbuffer, specular))
                .constant("MIRRORS_LEFT", built.prefiltered.is_some())
                .push(&self.params(&built.volume, count, part, pattern))
                .dispatch(screen_groups(given.gbuffer.size));
        }
        Some(Arc::clone(&mirrors.light))
    }
}

impl Inspect for LightFieldProbes {
    fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let Some(built) = &self.built else {
            return Ok(Vec::new());
        };
        let mut counts = built.scene.counts();
        if let Some(borrowed) = &self.borrowed {
            counts.extend(borrowed.counts(gpu)?);
        }
        counts.push(("probes", built.volume.lattice.probe_count().into()));
        Ok(counts)
    }

    fn levels(&self, view: &ViewRow) -> u32 {
        u32::from(self.built.is_some() && VIEWS.contains(view))
    }

    fn draw_view(
        &self,
        frame: &mut Frame,
        (view, _level): (&ViewRow, u32),
        gbuffer: &GBuffer,
        seen: &Arc<Image>,
    ) {
        let Some(built) = &self.built else { return };
        let of = (&built.volume, &built.field);
        view::draw(frame, view, of, (gbuffer, seen));
    }
}
