//! The family of techniques that keep light in voxels and gather it by cones: [`VoxelCones`], over
//! a store of its own for each technique.

pub mod clipmap;
mod entry;
pub mod gatherer;
pub mod mips;
mod presets;
mod rules;
mod schedule;
mod store;
mod suit;
pub mod svo;

use std::sync::Arc;

pub use gatherer::Gatherer;
pub use store::{Relit, VoxelStore};

use schedule::Schedule;

use crate::gi::inspect::{Beam, BeamAxis, BeamStart, LightSlots, ViewRow};
use crate::gi::shared::cone::{EmissivePatches, EmitterMethod, VoxelVolume};
use crate::gi::shared::voxel::{
    EmissionSeenBy, EmitterPoints, Injection, LightBounces, LightInputs, Viewer, VoxelSlots,
};
use crate::gi::{CastRays, Change, Context, Inputs, Inspect, MapNeeds, Needs, Settings, Technique};
use crate::graph::{Error, Frame, FrameStats, Gpu, Image};
use crate::render::bvh::SceneRays;
use crate::render::{GBuffer, GpuScene, Receivers, SightRays, screen_image};

/// A technique of the family.
pub struct VoxelCones<S> {
    /// Voxels, their light, and what cones and rays go through.
    pub store: S,
    gatherer: Gatherer,
    emitters: Emitters,
    /// When models that have moved are voxelized.
    schedule: Schedule,
    /// Models were voxelized in this frame without having moved in it.
    is_late: bool,
    /// The voxels have the light that mirrors see.
    is_lit_for_mirrors: bool,
    /// Largest extent of the scene (m).
    extent_m: f32,
    /// The scene's triangles, where rays meet them; made by the first build.
    triangles: Option<SceneRays>,
    /// RGBA32F: indirect specular radiance; absent where nothing mirrors.
    specular: Option<Arc<Image>>,
    /// R32F: least that a cone to a light sees of it; absent where gathered light stays as it is.
    least_visibility: Option<Arc<Image>>,
}

/// What surfaces emit, where it does not come to the picture through the voxels.
enum Emitters {
    /// It comes through the voxels, or there is none.
    InVoxels,
    /// As patches, each seen by a cone.
    Patches(EmissivePatches),
    /// As points, which the rays of the gatherer go to.
    Points,
}

impl Emitters {
    fn new(gpu: &Gpu, scene: &GpuScene, settings: &Settings) -> Result<Self, Error> {
        let most = settings.count("emissive_patches");
        let is_met = settings.is("emitters", "auto") && surrounds(scene);
        Ok(match EmitterMethod::new(settings) {
            _ if scene.emitters.is_empty() || is_met => Emitters::InVoxels,
            EmitterMethod::Gather => Emitters::InVoxels,
            EmitterMethod::Points => Emitters::Points,
            EmitterMethod::Patches => {
                Emitters::Patches(EmissivePatches::new(gpu, scene, most.max(1))?)
            }
        })
    }

    fn follow(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<(), Error> {
        match self {
            Emitters::InVoxels | Emitters::Points => Ok(()),
            Emitters::Patches(patches) => patches.follow(gpu, scene),
        }
    }

    /// Who sees it in the voxels.
    fn seen_by(&self) -> EmissionSeenBy {
        match self {
            Emitters::InVoxels => EmissionSeenBy::All,
            Emitters::Patches(_) => EmissionSeenBy::VoxelsAndMirror,
            Emitters::Points => EmissionSeenBy::Mirror,
        }
    }
}

/// Whether what emits is so large that directions of a gather meet it with less noise than points
/// of it: half of the faces of the scene's bounds.
fn surrounds(scene: &GpuScene) -> bool {
    let size = scene.bounds.1 - scene.bounds.0;
    let faces = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
    let area: f32 = scene.emitters.iter().map(|emitter| emitter.area).sum();
    area >= 0.5 * faces
}

/// What voxels are lit by in a frame.
fn light_inputs<'f>(given: &Inputs<'f>, triangles: &'f Option<SceneRays>) -> LightInputs<'f> {
    LightInputs {
        maps: given.maps,
        rsm: given.rsm,
        triangles: triangles.as_ref(),
    }
}

/// What a store is made with, besides its settings.
pub struct Parts {
    /// How cones and rays are traced.
    pub gatherer: Gatherer,
    /// Whether there is a specular cone.
    pub has_specular: bool,
    /// Whether cones see mirror images, what is behind clear bodies, or patches of what emits.
    pub has_cones: bool,
    /// Who sees in the voxels what surfaces emit.
    pub emission: EmissionSeenBy,
}

impl<S: VoxelStore> VoxelCones<S> {
    /// Nothing is built yet. `name` names the technique's image.
    pub fn new(context: &Context<'_>, settings: &Settings, name: &str) -> Result<Self, Error> {
        let Context {
            gpu, scene, size, ..
        } = *context;
        let has_specular = scene.is_glossy && settings.is("specular", "on");
        let emitters = Emitters::new(gpu, scene, settings)?;
        let mut gatherer = Gatherer::new(gpu, settings)?;
        if let (Emitters::Points, Some(rays)) = (&emitters, &mut gatherer.rays) {
            rays.points = Some(EmitterPoints::new(gpu, scene)?);
        }
        let parts = Parts {
            gatherer,
            has_specular,
            has_cones: has_specular
                || matches!(emitters, Emitters::Patches(_))
                || scene.has_clear_bodies(),
            emission: emitters.seen_by(),
        };
        let least_visibility = parts.gatherer.cones.least_visibility(gpu, size)?;
        Ok(VoxelCones {
            least_visibility,
            store: S::new(context, settings, &parts)?,
            gatherer: parts.gatherer,
            emitters,
            schedule: Schedule::new(settings),
            is_late: false,
            is_lit_for_mirrors: false,
            extent_m: (scene.bounds.1 - scene.bounds.0).max_element(),
            triangles: None,
            specular: has_specular
                .then(|| screen_image(gpu, &format!("{name}.specular"), size))
                .transpose()?,
        })
    }
}

impl<S: VoxelStore> Technique for VoxelCones<S> {
    fn needs(&self) -> Needs {
        let light = self.store.light_settings();
        let maps = if light.injection == Injection::Rsm {
            MapNeeds::Reflective
        } else if light.reads_maps() {
            MapNeeds::Shadows
        } else if !self.gatherer.cones.has_shadows() {
            MapNeeds::Direct
        } else {
            MapNeeds::Nothing
        };
        Needs {
            rsm_size: light.rsm_size(self.extent_m, self.store.voxel_size()),
            ..Needs::maps(maps)
        }
    }

    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        // Models may have moved since these were made.
        self.emitters.follow(context.gpu, context.scene)?;
        if let Some(rays) = &mut self.gatherer.rays {
            rays.follow(context.gpu, context.scene)?;
        }
        self.triangles = None;
        let mut stats = FrameStats::default();
        if self.meets_triangles() {
            let (triangles, built) = SceneRays::build(context.gpu, context.scene)?;
            self.triangles = Some(triangles);
            stats.append(built);
        }
        stats.append(self.store.build(context)?);
        self.schedule.start();
        Ok(stats)
    }

    fn follow(&mut self, context: &Context<'_>, change: Change) -> Result<FrameStats, Error> {
        match change {
            Change::Models => {
                self.emitters.follow(context.gpu, context.scene)?;
                if let Some(rays) = &mut self.gatherer.rays {
                    rays.follow(context.gpu, context.scene)?;
                }
                let mut stats = FrameStats::default();
                if let Some(triangles) = &mut self.triangles {
                    stats.append(triangles.follow(context.gpu, context.scene)?);
                }
                if self.schedule.moved() {
                    stats.append(self.store.follow_models(context)?);
                }
                Ok(stats)
            }
            Change::Lights => {
                self.store.forget_lights();
                Ok(FrameStats::default())
            }
            Change::Camera => {
                let mut stats = FrameStats::default();
                if self.schedule.is_due() {
                    stats.append(self.store.follow_models(context)?);
                    self.is_late = true;
                }
                stats.append(self.store.follow_camera(context)?);
                Ok(stats)
            }
        }
    }

    fn update(&mut self, frame: &mut Frame, given: &Inputs<'_>) {
        let bounces = self.store.light_settings().bounces;
        let count = bounces.before_the_picture();
        let lights = light_inputs(given, &self.triangles);
        let is_late = std::mem::take(&mut self.is_late);
        let is_lit_for_mirrors = std::mem::take(&mut self.is_lit_for_mirrors);
        let is_still = given.is_still && !is_late;
        if !is_still {
            self.store.forget_lights();
        } else if bounces != LightBounces::Feedback && self.store.is_lit() {
            if is_lit_for_mirrors {
                self.store.relight(frame, lights, Relit::FOR_PICTURE);
            }
            return;
        }
        if !self.store.light(frame, lights, count == 0) {
            return;
        }
        for bounce in 1..=count {
            self.store.bounce(frame, &self.gatherer);
            let relit = if bounce == count {
                Relit::FOR_PICTURE
            } else {
                Relit::FOR_VOXELS
            };
            self.store.relight(frame, lights, relit);
        }
        if bounces == LightBounces::Feedback {
            self.store.bounce(frame, &self.gatherer);
            if self.emitters.seen_by() != EmissionSeenBy::All {
                self.store.relight(frame, lights, Relit::FOR_PICTURE);
            }
        }
    }

    fn gather(&mut self, frame: &mut Frame, given: &Inputs<'_>, receivers: &Receivers<'_>) {
        let Gatherer { cones, rays } = &self.gatherer;
        if let (Some(rays), Some(space)) = (rays, self.store.space()) {
            rays.gather(frame, receivers, &space, self.triangles.as_ref());
        }
        if let Some(volume) = self.store.volume() {
            if rays.is_none() {
                cones.gather(frame, receivers, volume);
            }
            cones.occlusion(frame, receivers, volume);
            if let Some(least) = &self.least_visibility {
                cones.obscure(frame, given.scene, receivers, volume, least);
            }
        }
    }

    fn adds_apart(&self) -> bool {
        matches!(self.emitters, Emitters::Patches(_))
    }

    fn add_apart(&mut self, frame: &mut Frame, given: &Inputs<'_>, diffuse: &Arc<Image>) {
        if let (Emitters::Patches(patches), Some(volume)) = (&self.emitters, self.store.volume()) {
            (self.gatherer.cones).patches(frame, given.gbuffer, volume, patches, diffuse);
        }
    }

    fn mirror(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> Option<Arc<Image>> {
        let specular = Arc::clone(self.specular.as_ref()?);
        self.light_for_mirrors(frame, given);
        let volume = self.store.volume()?;
        let seen = (given.scene, given.gbuffer);
        (self.gatherer.cones).specular(frame, seen, volume, &specular);
        Some(specular)
    }

    fn sees(&self) -> bool {
        true
    }

    fn see(&mut self, frame: &mut Frame, given: &Inputs<'_>, sights: SightRays<'_>) {
        self.light_for_mirrors(frame, given);
        if let Some(volume) = self.store.volume() {
            self.gatherer.cones.see(frame, volume, sights);
        }
    }

    fn cast(&self, frame: &mut Frame, rays: CastRays<'_>) {
        if let (Some(tracer), Some(space)) = (&self.gatherer.rays, self.store.space()) {
            space.cast(frame, rays, tracer.settings.contour_slack);
        }
    }

    fn cast_margin(&self) -> f32 {
        // The voxels of what moves begin outside of its box.
        let largest = self.store.largest_voxel();
        largest.map_or(f32::INFINITY, |edge| 2.0 * edge)
    }

    fn shadow_direct(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> bool {
        let cones = &self.gatherer.cones;
        let shadowed = self.store.volume().filter(|_| cones.has_shadows());
        if let Some(volume) = shadowed {
            cones.shadow(frame, given.scene, given.gbuffer, volume, given.direct);
        }
        shadowed.is_some()
    }
}

impl<S: VoxelStore> VoxelCones<S> {
    /// Lights the voxels as mirrors, and pixels behind something clear, see them: the image of a
    /// lamp is in the voxels alone. Once a frame.
    fn light_for_mirrors(&mut self, frame: &mut Frame, given: &Inputs<'_>) {
        if self.emitters.seen_by() == EmissionSeenBy::All || self.is_lit_for_mirrors {
            return;
        }
        self.is_lit_for_mirrors = true;
        let relit = Relit {
            viewer: Viewer::Mirror,
            is_last: true,
        };
        let lights = light_inputs(given, &self.triangles);
        self.store.relight(frame, lights, relit);
    }

    /// Whether rays of pixels or of voxels meet the scene's triangles.
    fn meets_triangles(&self) -> bool {
        let rays = self.gatherer.rays.as_ref();
        rays.is_some_and(|rays| rays.settings.meets_triangles)
            || self.store.light_settings().meets_triangles()
    }

    /// The volume that a view shows.
    fn viewed(&self, view: &ViewRow) -> Option<VoxelVolume<'_>> {
        let name = match view.name {
            "voxels" | "voxel-opacity" | "structure" => "light",
            name => name.strip_prefix("voxel-")?,
        };
        let mut volumes = self.store.volumes().into_iter();
        volumes.find(|volume| volume.name == name)
    }
}

impl<S: VoxelStore> Inspect for VoxelCones<S> {
    fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let mut counts = self.store.counts(gpu)?;
        counts.extend(self.triangles.iter().flat_map(SceneRays::counts));
        Ok(counts)
    }

    fn cell_size(&self) -> Option<f32> {
        self.store.voxel_size()
    }

    fn count_samples(
        &self,
        context: &Context<'_>,
        gbuffer: &GBuffer,
    ) -> Result<Vec<(&'static str, u64)>, Error> {
        let Some(volume) = self.store.volume() else {
            return Ok(Vec::new());
        };
        let counted = [self.gatherer.rays.is_none(), self.specular.is_some()];
        (self.gatherer.cones).count_samples(context.gpu, context.scene, gbuffer, volume, counted)
    }

    fn levels(&self, view: &ViewRow) -> u32 {
        self.viewed(view).map_or(0, |volume| volume.levels)
    }

    fn draw_view(
        &self,
        frame: &mut Frame,
        (view, level): (&ViewRow, u32),
        _gbuffer: &GBuffer,
        seen: &Arc<Image>,
    ) {
        match self.viewed(view) {
            Some(volume) if view.name == "structure" => volume.view_structure(frame, level, seen),
            Some(volume) => volume.view(frame, level, seen),
            None => {}
        }
    }

    fn beam(
        &self,
        context: &Context<'_>,
        start: &BeamStart,
        axis: BeamAxis,
        aperture_deg: Option<f32>,
    ) -> Result<Option<Beam>, Error> {
        if self.gatherer.rays.is_some() && axis != BeamAxis::Mirror {
            return Ok(None);
        }
        let traced = self.store.volume().map(|volume| {
            (self.gatherer.cones).trace(context, volume, start, (axis, aperture_deg))
        });
        traced.transpose()
    }

    fn light_slots(&mut self, gpu: &Gpu) -> Result<Option<Box<dyn LightSlots + '_>>, Error> {
        let slots = VoxelSlots::read(gpu, self.store.lit_voxels())?;
        Ok(slots.map(|slots| Box::new(slots) as Box<dyn LightSlots>))
    }
}
