//! Technique `ray-traced`: paths of light through the triangles themselves. There is no store: what
//! more rays bring is less noise. With a cache, voxels have the light of a path's last place.

mod passes;
mod settings;

pub use passes::{GATHER, GATHER_CACHED, MIRROR, MIRROR_CACHED, PathParams, SEE, SEE_CACHED};

use std::sync::Arc;

use super::entry::{Directions, Entry, Stage, Substitution};
use super::shared::interleave::{self, Pattern};
use super::shared::paths::{self, Cache, Mirrors, PathScene, parts_of_rays, paths_a_thread};
use super::shared::voxel;
use super::{Change, Context, Inputs, Inspect, MapNeeds, Needs, Settings, Technique};
use crate::graph::compute::linear_groups;
use crate::graph::{Error, Frame, FrameStats, Gpu, Image, Pass, PassBuilder};
use crate::render::{Receivers, SightRays, screen_groups};
use settings::{PRESETS, RULES, RaySettings, SETTINGS};

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    bounces: |settings| Some(settings.count("bounces")),
    settings: &[
        SETTINGS,
        interleave::SETTINGS,
        interleave::SPECULAR_SETTINGS,
    ],
    rules: &[RULES, interleave::RULES, interleave::SPECULAR_RULES],
    presets: PRESETS,
    passes: &[
        &[
            &GATHER,
            &GATHER_CACHED,
            &MIRROR,
            &MIRROR_CACHED,
            &SEE,
            &SEE_CACHED,
        ],
        voxel::PASSES,
    ],
    structs: &[paths::STRUCTS, voxel::STRUCTS],
    stages: &[
        &Stage::store("hierarchy", paths::HOST_PASSES),
        &voxel::VOXELIZATION,
        &voxel::LIGHT_INJECTION,
        &Stage::picture("gather", &["ray_traced.gather"]),
        &Stage::picture("specular", &["ray_traced.mirror"]),
        &Stage::picture("through clear bodies", &["ray_traced.see"]),
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
    substitutions: &[SUBSTITUTIONS],
    ..Entry::new(
        "ray-traced",
        "paths of light, ray by ray through the triangles themselves",
        make,
    )
};

/// What an error budget tries in place of the settings.
const SUBSTITUTIONS: &[Substitution] = &[Substitution {
    name: "cache",
    help: "the lights themselves asked at the last place of a path",
    pairs: |settings| {
        if settings.is("cache", "voxels") {
            vec!["cache=none".into()]
        } else {
            Vec::new()
        }
    },
}];

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(RayTraced::new(context, settings)?))
}

struct RayTraced {
    settings: RaySettings,
    scene: Option<PathScene>,
    cache: Option<Cache>,
    mirrors: Option<Mirrors>,
}

impl RayTraced {
    fn new(context: &Context<'_>, settings: &Settings) -> Result<Self, Error> {
        let &Context { gpu, scene, .. } = context;
        let mirrors = Mirrors::new(context, settings, "ray_traced.specular")?;
        let settings = RaySettings::new(settings);
        let cache = (settings.cache_resolution)
            .map(|resolution| Cache::new(gpu, scene, resolution, (settings.uses_maps, false)))
            .transpose()?;
        Ok(RayTraced {
            settings,
            scene: None,
            cache,
            mirrors,
        })
    }

    /// First ray, and one beyond the last, of as many dispatches as keep the loops of a thread
    /// within what a device does.
    fn dispatches(&self, given: &Inputs<'_>, count: u32) -> impl Iterator<Item = [u32; 2]> {
        let most = paths_a_thread(given.scene, self.settings.bounces, self.settings.uses_maps);
        parts_of_rays(count, most)
    }

    /// A pass, or the one that reads the cache, with what paths read of the scene.
    fn pass<'f>(
        &self,
        frame: &'f mut Frame,
        [pass, cached]: [&'static Pass; 2],
        scene: &PathScene,
        given: &Inputs<'_>,
    ) -> PassBuilder<'f> {
        let uses_maps = self.settings.uses_maps;
        match &self.cache {
            Some(cache) => cache.bind(scene.bind(frame.pass(cached), given, uses_maps)),
            None => scene.bind(frame.pass(pass), given, uses_maps),
        }
    }

    /// What the paths of a dispatch are told.
    fn params(
        &self,
        ray_count: u32,
        [first_ray, end_ray]: [u32; 2],
        pattern: Pattern,
    ) -> PathParams {
        PathParams {
            grid: self.cache.as_ref().map_or([0.0; 4], Cache::row),
            resolution: self.settings.cache_resolution.unwrap_or(0),
            ray_count,
            first_ray,
            end_ray,
            pattern: pattern.bits(),
            bounces: self.settings.bounces,
            hit_roughness: self.settings.hit_roughness,
        }
    }
}

impl Technique for RayTraced {
    fn needs(&self) -> Needs {
        Needs::maps(match (self.settings.uses_maps, &self.cache) {
            (true, Some(_)) => MapNeeds::Reflective,
            (true, None) => MapNeeds::Shadows,
            (false, _) => MapNeeds::Direct,
        })
    }

    fn build(&mut self, &Context { gpu, scene, .. }: &Context<'_>) -> Result<FrameStats, Error> {
        self.scene = None;
        let (own, mut stats) = PathScene::build(gpu, scene)?;
        self.scene = Some(own);
        if let Some(cache) = &mut self.cache {
            stats.append(cache.grid.build(gpu, scene)?);
        }
        Ok(stats)
    }

    fn follow(
        &mut self,
        &Context { gpu, scene, .. }: &Context<'_>,
        change: Change,
    ) -> Result<FrameStats, Error> {
        let (Change::Models, Some(own)) = (change, &mut self.scene) else {
            return Ok(FrameStats::default());
        };
        let mut stats = own.follow(gpu, scene)?;
        if let Some(cache) = &mut self.cache {
            stats.append(cache.grid.follow(gpu, scene)?);
        }
        Ok(stats)
    }

    fn update(&mut self, frame: &mut Frame, given: &Inputs<'_>) {
        if let (Some(cache), Some(scene), false) = (&self.cache, &self.scene, given.is_still) {
            cache.light(frame, given, &scene.rays);
        }
    }

    fn gather(&mut self, frame: &mut Frame, given: &Inputs<'_>, receivers: &Receivers<'_>) {
        let Some(scene) = &self.scene else { return };
        let s = &self.settings;
        for rays in self.dispatches(given, s.rays) {
            self.pass(frame, [&GATHER, &GATHER_CACHED], scene, given)
                .bind("view_depth", receivers.view_depth)
                .bind("normals", receivers.normals)
                .bind("indirect_diffuse", receivers.light)
                .push(&self.params(s.rays, rays, s.pattern))
                .dispatch(receivers.groups());
        }
    }

    fn mirror(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> Option<Arc<Image>> {
        let (scene, mirrors) = (self.scene.as_ref()?, self.mirrors.as_ref()?);
        let specular = given.gbuffer.specular.as_ref()?;
        for rays in self.dispatches(given, mirrors.rays) {
            let pass = self.pass(frame, [&MIRROR, &MIRROR_CACHED], scene, given);
            (mirrors.bind(pass, given.gbuffer, specular))
                .push(&self.params(mirrors.rays, rays, mirrors.pattern))
                .dispatch(screen_groups(given.gbuffer.size));
        }
        Some(Arc::clone(&mirrors.light))
    }

    fn sees(&self) -> bool {
        true
    }

    fn see(&mut self, frame: &mut Frame, given: &Inputs<'_>, sights: SightRays<'_>) {
        let Some(scene) = &self.scene else { return };
        let s = &self.settings;
        for rays in self.dispatches(given, s.rays) {
            self.pass(frame, [&SEE, &SEE_CACHED], scene, given)
                .bind("sight_rays", sights.rays)
                .bind("sights", sights.sights)
                .push(&self.params(s.rays, rays, s.pattern))
                .dispatch(linear_groups(sights.count));
        }
    }
}

impl Inspect for RayTraced {
    fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let scene = self.scene.as_ref();
        let mut counts = scene.map(PathScene::counts).unwrap_or_default();
        if let Some(cache) = &self.cache {
            counts.extend(cache.grid.counts(gpu)?);
        }
        Ok(counts)
    }
}
