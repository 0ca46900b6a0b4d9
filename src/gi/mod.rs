//! Global illumination: the seam that every technique stands behind.
//!
//! A technique answers one question: given the G-buffer, what are, at each pixel, the indirect
//! diffuse irradiance, the indirect specular radiance and the ambient visibility
//! ([`IndirectLight`])? It keeps its own world-space store between frames. All techniques are rows
//! of [`registry::TECHNIQUES`].

pub mod entry;
pub mod none;
pub mod registry;
pub mod settings;
pub mod shared;
pub mod voxel_cones;

pub use crate::render::IndirectLight;
pub use settings::{SettingError, Settings};
pub use shared::cone::{TraceAxis, TraceSurface, TracedCone, VoxelVolume};
pub use shared::voxel::LitVoxels;

use glam::Vec3;

use crate::graph::{Error, Frame, FrameStats, Gpu};
use crate::render::{GBuffer, GpuScene, LightMaps, Output};

/// What a technique is made for.
#[derive(Clone, Copy)]
pub struct Context<'c> {
    /// The device.
    pub gpu: &'c Gpu,
    /// The scene.
    pub scene: &'c GpuScene,
    /// Width and height of the pictures (px).
    pub size: [u32; 2],
    /// Where the camera is (m).
    pub eye: Vec3,
}

/// One complete way to compute indirect light.
pub trait Technique {
    /// Builds what does not change between frames (for example the voxels of static geometry), with
    /// the dynamic models where they are. Called once before the first frame, and again by
    /// benchmarks; what it allocates is sized by what it counts.
    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error>;

    /// Brings what was built up to the dynamic models of the scene, after they have moved; in a
    /// scene without any, there is nothing to do.
    fn set_pose(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        if context.scene.dynamic.is_some() {
            self.build(context)
        } else {
            Ok(FrameStats::default())
        }
    }

    /// Brings what was built up to the camera, before each frame; what does not depend on it has
    /// nothing to do.
    fn set_view(&mut self, _context: &Context<'_>) -> Result<FrameStats, Error> {
        Ok(FrameStats::default())
    }

    /// Forgets what it keeps of the lights from frame to frame, as they have moved; what is lit
    /// anew in each frame has nothing to do.
    fn forget_lights(&mut self) {}

    /// Whether `update` reads reflective shadow maps, or shadow maps suffice.
    fn needs_rsm(&self) -> bool;

    /// Whether anything that `update` or `direct` adds reads maps of the lights; without, none are
    /// drawn.
    fn needs_light_maps(&self) -> bool {
        true
    }

    /// Adds the passes that bring the world-space store up to this frame's light.
    fn update(&mut self, frame: &mut Frame, scene: &GpuScene, maps: &LightMaps);

    /// Adds the passes that answer for each pixel of the G-buffer.
    fn gather(
        &mut self,
        frame: &mut Frame,
        scene: &GpuScene,
        maps: &LightMaps,
        gbuffer: &GBuffer,
    ) -> IndirectLight;

    /// Adds the direct light, after `gather`: by shadow maps, where a technique has no shadows of
    /// its own.
    fn direct(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        maps: &LightMaps,
        gbuffer: &GBuffer,
        output: &Output,
    ) {
        output.draw_direct(frame, scene, maps, gbuffer);
    }

    /// Samples that the cones of a gather take, by the name of its pass, over the whole picture:
    /// counted on the device in a run of its own, after a frame. None where nothing traces
    /// cones.
    fn count_samples(
        &self,
        _gpu: &Gpu,
        _scene: &GpuScene,
        _gbuffer: &GBuffer,
    ) -> Result<Vec<(&'static str, u64)>, Error> {
        Ok(Vec::new())
    }

    /// One cone as its gathers trace them, through what the last frame left, with its samples.
    /// `None` where nothing traces cones. `aperture_deg` in place of its own.
    fn trace(
        &self,
        _context: &Context<'_>,
        _surface: &TraceSurface,
        _axis: TraceAxis,
        _aperture_deg: Option<f32>,
    ) -> Result<Option<TracedCone>, Error> {
        Ok(None)
    }

    /// The volumes that it keeps, the light first, so that they can be looked at. None where it has
    /// none.
    fn volumes(&self) -> Vec<VoxelVolume<'_>> {
        Vec::new()
    }

    /// Its voxels and their light, a piece of the grid each, so that an error budget can read and
    /// replace them. None where it has no voxels.
    fn lit_voxels(&mut self) -> Vec<LitVoxels<'_>> {
        Vec::new()
    }

    /// Edge of its finest voxels (m); `None` where it has none.
    fn voxel_size(&self) -> Option<f32> {
        None
    }

    /// Counts for the report, by name; some are read back from the device.
    fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error>;
}
