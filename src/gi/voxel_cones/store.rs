//! What a technique of the family keeps: voxels, their light, and a volume for cones.

use super::Parts;
use super::gatherer::Gatherer;
use crate::gi::shared::cone::{Volume, VoxelVolume};
use crate::gi::shared::voxel::{LightInputs, LightSettings, LitVoxels, Space, Viewer};
use crate::gi::{Context, Settings};
use crate::graph::{Error, Frame, FrameStats, Gpu};

/// Why the voxels are lit once more.
#[derive(Clone, Copy)]
pub struct Relit {
    /// Who looks at them next.
    pub viewer: Viewer,
    /// Whether the volume is read before voxels are lit again; where nothing reads it until then,
    /// a store need not make it.
    pub is_last: bool,
}

impl Relit {
    /// Before the next bounce.
    pub const FOR_VOXELS: Relit = Relit {
        viewer: Viewer::Voxels,
        is_last: false,
    };
    /// Before the gather.
    pub const FOR_PICTURE: Relit = Relit {
        viewer: Viewer::Picture,
        is_last: true,
    };
}

/// The store of a technique.
pub trait VoxelStore: Sized {
    /// Nothing is built yet.
    fn new(context: &Context<'_>, settings: &Settings, parts: &Parts) -> Result<Self, Error>;

    /// How voxels are lit.
    fn light_settings(&self) -> &LightSettings;

    /// Voxelizes the scene, with its dynamic models where they are, and allocates what their light
    /// needs.
    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error>;

    /// Brings what was built up to the dynamic models, after they have moved.
    fn follow_models(&mut self, context: &Context<'_>) -> Result<FrameStats, Error>;

    /// Brings what was built up to the camera.
    fn follow_camera(&mut self, _context: &Context<'_>) -> Result<FrameStats, Error> {
        Ok(FrameStats::default())
    }

    /// Forgets light that it keeps from frame to frame.
    fn forget_lights(&mut self) {}

    /// Whether all of it has the light of the last frame, which holds as long as nothing but the
    /// camera changes.
    fn is_lit(&self) -> bool {
        true
    }

    /// Adds the passes that light the voxels directly and make the volume; `is_last` as in
    /// [`Relit`]. False where nothing has changed.
    fn light(&mut self, frame: &mut Frame, lights: LightInputs<'_>, is_last: bool) -> bool;

    /// Adds the passes by which voxels gather from each other.
    fn bounce(&self, frame: &mut Frame, gatherer: &Gatherer);

    /// Adds the passes that light the voxels once more, with what they gathered, and make the
    /// volume.
    fn relight(&mut self, frame: &mut Frame, lights: LightInputs<'_>, relit: Relit);

    /// What the cones of the picture march through. `None` before it is built, and where nothing
    /// traces cones.
    fn volume(&self) -> Option<Volume<'_>>;

    /// What the rays of the picture, and of its voxels, go through. `None` before it is built, and
    /// where nothing traces rays.
    fn space(&self) -> Option<Space<'_>>;

    /// The volumes that can be looked at, the light first.
    fn volumes(&self) -> Vec<VoxelVolume<'_>>;

    /// Its voxels and their light, a piece of the grid each; none where they are in several grids.
    fn lit_voxels(&mut self) -> Vec<LitVoxels<'_>> {
        Vec::new()
    }

    /// Edge of the finest voxels (m); `None` before it is built.
    fn voxel_size(&self) -> Option<f32>;

    /// Edge of its largest voxels that surfaces are in (m); `None` before it is built.
    fn largest_voxel(&self) -> Option<f32> {
        self.voxel_size()
    }

    /// Counts for the report, by name.
    fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error>;
}
