//! Technique `ray-traced`: paths of light through the triangles themselves. No store, no bias:
//! what more rays bring is less noise.

mod passes;
mod settings;

pub use passes::{GATHER, GatherParams, MIRROR, MirrorParams};

use std::sync::Arc;

use super::entry::{Directions, Entry, Stage};
use super::shared::interleave;
use super::shared::loops::LOOP_BUDGET;
use super::{Change, Context, Inputs, Inspect, MapNeeds, Needs, Settings, Technique};
use crate::graph::{Error, Frame, FrameStats, Gpu, Image, PassBuilder};
use crate::render::bvh::{EmissiveTriangles, GpuEmitter, SceneRays};
use crate::render::{GpuScene, LightMaps, Receivers, screen_groups, screen_image};
use crate::shader::GpuStruct;
use settings::{PRESETS, RULES, RaySettings, SETTINGS};

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    bounces: |settings| Some(settings.count("bounces")),
    settings: &[
        SETTINGS,
        interleave::SETTINGS,
        interleave::SPECULAR_SETTINGS,
    ],
    rules: &[RULES],
    presets: PRESETS,
    passes: &[&[&GATHER, &MIRROR]],
    structs: &[&[("GpuEmitter", GpuEmitter::FIELDS)]],
    stages: &[
        &Stage::picture("gather", &["ray_traced.gather"]),
        &Stage::picture("specular", &["ray_traced.mirror"]),
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
        "ray-traced",
        "paths of light, ray by ray through the triangles themselves",
        make,
    )
};

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(RayTraced::new(context, settings)?))
}

/// Where the rays of a pixel start: the rounding of positions from the depth buffer, as a share of
/// distances and coordinates, and room.
const START_OFFSET: f32 = 2e-5;

/// Turns of loops that a ray is trusted to stay below: boxes that it opens, and triangles that it
/// meets, of all lanes of a vector, which wait for each other.
const TURNS_A_RAY: u32 = 1024;

struct Scene {
    rays: SceneRays,
    emitters: EmissiveTriangles,
}

struct RayTraced {
    settings: RaySettings,
    scene: Option<Scene>,
    mirrored: Option<Arc<Image>>,
}

impl RayTraced {
    fn new(
        &Context {
            gpu, scene, size, ..
        }: &Context<'_>,
        settings: &Settings,
    ) -> Result<Self, Error> {
        let settings = RaySettings::new(settings);
        let mirrors = scene.is_glossy && settings.mirror_rays.is_some();
        let mirrored = mirrors
            .then(|| screen_image(gpu, "ray_traced.specular", size))
            .transpose()?;
        Ok(RayTraced {
            settings,
            scene: None,
            mirrored,
        })
    }

    /// First ray, and one beyond the last, of as many dispatches as keep the loops of a thread
    /// within `LOOP_BUDGET`.
    fn dispatches(&self, given: &Inputs<'_>, count: u32) -> impl Iterator<Item = [u32; 2]> {
        let lights = if self.settings.uses_maps {
            0
        } else {
            given.scene.lights.len() as u32
        };
        let rays = self.settings.bounces * (1 + lights + u32::from(given.scene.is_emissive));
        let most = (LOOP_BUDGET / (TURNS_A_RAY * rays)).max(1);
        (0..count)
            .step_by(most as usize)
            .map(move |first| [first, (first + most).min(count)])
    }

    /// Binds what paths read of the scene.
    fn bind<'f>(
        &self,
        scene: &Scene,
        maps: &LightMaps,
        pass: PassBuilder<'f>,
        has_bumps: bool,
    ) -> PassBuilder<'f> {
        scene
            .rays
            .bind(pass)
            .bind("emitters", &scene.emitters.rows)
            .bind("emitter_densities", &scene.emitters.densities)
            .bind("light_views", &maps.views)
            .bind("shadow_maps", &maps.depth)
            .constant("EMITTERS", scene.emitters.count)
            .constant("SHADOW_MAPS", self.settings.uses_maps)
            .constant("BUMPS", has_bumps)
    }
}

impl Scene {
    fn new(gpu: &Gpu, scene: &GpuScene) -> Result<Self, Error> {
        Ok(Scene {
            rays: SceneRays::new(gpu, scene)?,
            emitters: EmissiveTriangles::new(gpu, scene)?,
        })
    }
}

impl Technique for RayTraced {
    fn needs(&self) -> Needs {
        Needs {
            maps: if self.settings.uses_maps {
                MapNeeds::Shadows
            } else {
                MapNeeds::Direct
            },
            motion: false,
        }
    }

    fn build(&mut self, &Context { gpu, scene, .. }: &Context<'_>) -> Result<FrameStats, Error> {
        self.scene = None;
        self.scene = Some(Scene::new(gpu, scene)?);
        Ok(FrameStats::default())
    }

    fn follow(
        &mut self,
        &Context { gpu, scene, .. }: &Context<'_>,
        change: Change,
    ) -> Result<FrameStats, Error> {
        if let (Change::Models, Some(own)) = (change, &mut self.scene) {
            own.rays.follow(gpu, scene)?;
            own.emitters.follow(gpu, scene)?;
        }
        Ok(FrameStats::default())
    }

    fn update(&mut self, _frame: &mut Frame, _given: &Inputs<'_>) {}

    fn gather(&mut self, frame: &mut Frame, given: &Inputs<'_>, receivers: &Receivers<'_>) {
        let Some(scene) = &self.scene else { return };
        let s = &self.settings;
        for [first_ray, end_ray] in self.dispatches(given, s.rays) {
            let has_bumps = given.scene.has_bumps();
            self.bind(scene, given.maps, frame.pass(&GATHER), has_bumps)
                .bind("view_depth", receivers.view_depth)
                .bind("normals", receivers.normals)
                .bind("indirect_diffuse", receivers.light)
                .push(&GatherParams {
                    ray_count: s.rays,
                    first_ray,
                    end_ray,
                    pattern: s.pattern.bits(),
                    bounces: s.bounces,
                    start_offset: START_OFFSET,
                })
                .dispatch(receivers.groups());
        }
    }

    fn mirror(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> Option<Arc<Image>> {
        let (scene, mirrored) = (self.scene.as_ref()?, self.mirrored.as_ref()?);
        let (count, specular) = (self.settings.mirror_rays?, given.gbuffer.specular.as_ref()?);
        for [first_ray, end_ray] in self.dispatches(given, count) {
            let has_bumps = given.scene.has_bumps();
            self.bind(scene, given.maps, frame.pass(&MIRROR), has_bumps)
                .bind("view_depth", &given.gbuffer.view_depth)
                .bind("normals", &given.gbuffer.normals)
                .bind("albedo", &given.gbuffer.albedo)
                .bind("specular", specular)
                .bind("indirect_specular", mirrored)
                .push(&MirrorParams {
                    ray_count: count,
                    first_ray,
                    end_ray,
                    pattern: self.settings.specular_pattern.bits(),
                    bounces: self.settings.bounces,
                    start_offset: START_OFFSET,
                })
                .dispatch(screen_groups(given.gbuffer.size));
        }
        Some(Arc::clone(mirrored))
    }
}

impl Inspect for RayTraced {
    fn counts(&self, _gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let scene = self.scene.as_ref();
        let mut counts = scene.map(|scene| scene.rays.counts()).unwrap_or_default();
        counts.extend(scene.map(|scene| ("emissive_triangles", scene.emitters.count.into())));
        Ok(counts)
    }
}
