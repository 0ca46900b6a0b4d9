//! The family of techniques that keep light in voxels and gather it by cones: [`VoxelCones`], over
//! a
//! store of its own for each technique.

pub mod clipmap;
pub mod mips;
mod store;
pub mod svo;

use std::sync::Arc;

pub use store::{Relit, VoxelStore};

use crate::gi::entry::{Directions, Part, Stage};
use crate::gi::shared::cone::{self, ConeTracer, EmissivePatches, VolumePasses};
use crate::gi::shared::interleave::deinterleave;
use crate::gi::shared::voxel::{Bounces, Injection, Viewer};
use crate::gi::{
    Context, IndirectLight, LitVoxels, Settings, Technique, TraceAxis, TraceSurface, TracedCone,
    VoxelVolume,
};
use crate::graph::{Error, Frame, FrameStats, Gpu, Image};
use crate::render::{GBuffer, GpuScene, LightMaps, Output, screen_image};

/// Gathering along directions.
pub(crate) static GATHER: Stage = Stage {
    name: "gather",
    part: Part::Picture,
    passes: &[
        "cone.gather",
        "voxel.gather_rays",
        "cone.occlusion",
        "gi.deinterleave",
    ],
};

/// Glossy reflection.
pub(crate) static SPECULAR: Stage = Stage {
    name: "specular",
    part: Part::Picture,
    passes: &["cone.specular"],
};

/// The diffuse and the specular cones of a store.
const fn directions(cones: &'static VolumePasses) -> [Directions; 2] {
    [
        Directions {
            pass: &cones.gather,
            count: Some(cone::diffuse_count),
        },
        Directions {
            pass: &cones.specular,
            count: None,
        },
    ]
}

/// A technique of the family.
pub struct VoxelCones<S> {
    /// Voxels, their light, and the volume that cones march through.
    pub store: S,
    cones: ConeTracer,
    /// Of surfaces that emit, where cones see them.
    patches: Option<EmissivePatches>,
    interleave: u32,
    light: IndirectLight,
    /// The gather's result before the tile's patterns are averaged; absent without interleaving.
    interleaved: Option<Arc<Image>>,
}

/// What a store is made with, besides its settings.
pub struct Parts {
    /// How cones are traced.
    pub cones: ConeTracer,
    /// Whether there is a specular cone.
    pub has_specular: bool,
    /// Whether patches give what surfaces emit, and voxels keep it apart.
    pub has_patches: bool,
}

impl<S: VoxelStore> VoxelCones<S> {
    /// Nothing is built yet. `name` is that of the technique's images.
    pub fn new(context: &Context<'_>, settings: &Settings, name: &str) -> Result<Self, Error> {
        let Context {
            gpu, scene, size, ..
        } = *context;
        let image = |kind: &str| screen_image(gpu, &format!("{name}.{kind}"), size);
        let specular = scene.is_glossy && settings.is("specular", "on");
        let interleave = settings.count("interleave");
        let patches = EmissivePatches::new(gpu, scene, settings)?;
        let parts = Parts {
            cones: ConeTracer::new(gpu, settings)?,
            has_specular: specular,
            has_patches: patches.is_some(),
        };
        Ok(VoxelCones {
            store: S::new(context, settings, &parts)?,
            cones: parts.cones,
            patches,
            interleave,
            light: IndirectLight {
                diffuse: image("diffuse")?,
                specular: specular.then(|| image("specular")).transpose()?,
            },
            interleaved: (interleave > 1).then(|| image("interleaved")).transpose()?,
        })
    }
}

impl<S: VoxelStore> Technique for VoxelCones<S> {
    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        self.store.build(context)
    }

    fn set_pose(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        if context.scene.dynamic.is_none() {
            return Ok(FrameStats::default());
        }
        if let Some(patches) = &mut self.patches {
            patches.follow(context.gpu, context.scene)?;
        }
        self.store.follow_models(context)
    }

    fn set_view(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        self.store.follow_camera(context)
    }

    fn forget_lights(&mut self) {
        self.store.forget_lights();
    }

    fn needs_rsm(&self) -> bool {
        self.store.light_settings().injection == Injection::Rsm
    }

    fn needs_light_maps(&self) -> bool {
        self.store.light_settings().reads_maps() || !self.cones.has_shadows()
    }

    fn update(&mut self, frame: &mut Frame, _scene: &GpuScene, maps: &LightMaps) {
        let bounces = self.store.light_settings().bounces;
        let count = bounces.before_the_picture();
        if !self.store.light(frame, maps, count == 0) {
            return;
        }
        for bounce in 1..=count {
            self.store.bounce(frame, &self.cones);
            let relit = if bounce == count {
                Relit::FOR_PICTURE
            } else {
                Relit::FOR_VOXELS
            };
            self.store.relight(frame, maps, relit);
        }
        if bounces == Bounces::Feedback {
            self.store.bounce(frame, &self.cones);
            if self.patches.is_some() {
                self.store.relight(frame, maps, Relit::FOR_PICTURE);
            }
        }
    }

    fn gather(
        &mut self,
        frame: &mut Frame,
        _scene: &GpuScene,
        maps: &LightMaps,
        gbuffer: &GBuffer,
    ) -> IndirectLight {
        let (cones, light) = (&self.cones, &self.light);
        let target = self.interleaved.as_ref().unwrap_or(&light.diffuse);
        let has_gathered = self.store.gather(frame, gbuffer, target);
        if let Some(volume) = self.store.volume() {
            if !has_gathered {
                cones.gather(frame, gbuffer, volume, target);
            }
            cones.occlusion(frame, gbuffer, volume, target);
        }
        if let Some(interleaved) = &self.interleaved {
            deinterleave(frame, gbuffer, interleaved, &light.diffuse, self.interleave);
        }
        if let (Some(patches), Some(volume)) = (&self.patches, self.store.volume()) {
            cones.patches(frame, gbuffer, volume, patches, &light.diffuse);
        }
        if light.specular.is_some() && self.patches.is_some() {
            // The mirror image of a lamp is in the voxels alone.
            let relit = Relit {
                viewer: Viewer::Voxels,
                is_last: true,
            };
            self.store.relight(frame, maps, relit);
        }
        if let (Some(specular), Some(volume)) = (&light.specular, self.store.volume()) {
            cones.specular(frame, gbuffer, volume, specular);
        }
        light.clone()
    }

    fn direct(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        maps: &LightMaps,
        gbuffer: &GBuffer,
        output: &Output,
    ) {
        match self.store.volume() {
            Some(volume) if self.cones.has_shadows() => {
                self.cones
                    .shadow(frame, scene, gbuffer, volume, &output.direct);
            }
            _ => output.draw_direct(frame, scene, maps, gbuffer),
        }
    }

    fn count_samples(
        &self,
        gpu: &Gpu,
        scene: &GpuScene,
        gbuffer: &GBuffer,
    ) -> Result<Vec<(&'static str, u64)>, Error> {
        let Some(volume) = self.store.volume() else {
            return Ok(Vec::new());
        };
        let counted = [
            self.store.is_gathered_by_cones(),
            self.light.specular.is_some(),
        ];
        self.cones
            .count_samples(gpu, scene, gbuffer, volume, counted)
    }

    fn trace(
        &self,
        context: &Context<'_>,
        surface: &TraceSurface,
        axis: TraceAxis,
        aperture_deg: Option<f32>,
    ) -> Result<Option<TracedCone>, Error> {
        let traced = self.store.volume().map(|volume| {
            self.cones
                .trace(context, volume, surface, (axis, aperture_deg))
        });
        traced.transpose()
    }

    fn volumes(&self) -> Vec<VoxelVolume<'_>> {
        self.store.volumes()
    }

    fn lit_voxels(&mut self) -> Vec<LitVoxels<'_>> {
        self.store.lit_voxels()
    }

    fn voxel_size(&self) -> Option<f32> {
        self.store.voxel_size()
    }

    fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        self.store.counts(gpu)
    }
}
