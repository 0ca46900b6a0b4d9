//! Global illumination: the seam that every technique stands behind.
//!
//! A technique answers one question: given surfaces, what are the indirect diffuse irradiance, the
//! ambient visibility and, at each pixel, the indirect specular radiance ([`IndirectLight`])? It
//! keeps its own world-space store between frames. [`registry`] lists all techniques;
//! [`entry::Entry`] is what is known of one before it is made, [`Technique`] what it does in a
//! frame, and [`Inspect`] what tools may ask. [`shared::screen`] says for which surfaces it
//! gathers, and what pixels share of it.

pub mod entry;
pub mod gtao;
pub mod inspect;
pub mod lpv;
pub mod none;
pub mod probes;
pub mod prt;
pub mod ray_traced;
pub mod registry;
pub mod settings;
pub mod shared;
pub mod simulator;
pub mod voxel_cones;

pub use crate::render::IndirectLight;
pub use inspect::Inspect;
pub use settings::{SettingError, Settings};

use std::sync::Arc;

use glam::Vec3;

use crate::graph::{Buffer, Error, Frame, FrameStats, Gpu, Image};
use crate::render::{GBuffer, GpuScene, LightMaps, Receivers, SightRays};

/// What a technique is made for, and where it stands.
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
    /// Makes another technique, whose store this one may use.
    pub lend: Lend,
}

/// Makes a technique that has such a store, for another one that wants it.
pub type Lend = fn(&Context<'_>, &Wanted) -> Result<Box<dyn Technique>, Error>;

/// How a world-space store divides space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreKind {
    /// Into equal cells, all of which are there.
    Dense,
    /// Into cells that are there where surfaces are.
    Sparse,
    /// Into cells that are larger farther from the camera.
    Nested,
}

impl StoreKind {
    /// Names that settings have for them, in the order of [`StoreKind::ALL`].
    pub const NAMES: [&str; 3] = ["dense", "sparse", "nested"];

    /// All of them.
    pub const ALL: [StoreKind; 3] = [StoreKind::Dense, StoreKind::Sparse, StoreKind::Nested];

    /// Its name.
    pub const fn name(self) -> &'static str {
        StoreKind::NAMES[self as usize]
    }
}

/// What one technique wants of another's store.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// How it divides space.
    pub kind: StoreKind,
    /// Along the largest extent of what it holds (cells).
    pub resolution: u32,
    /// Indirect bounces of a picture that is gathered from it, as settings have them.
    pub bounces: String,
    /// Rays are cast through it: [`Technique::cast`].
    pub casts: bool,
    /// It mirrors: [`Technique::mirror`].
    pub mirrors: bool,
}

/// Rays that one technique casts through the store of another (`gi/shared/cast.glsl`).
#[derive(Clone, Copy)]
pub struct CastRays<'r> {
    /// Two rows a ray. xyz: where it starts (m), and where it goes; w: bits of the numbers of its
    /// family and of the ray in it. A ray that goes nowhere is not cast.
    pub rays: &'r Arc<Buffer>,
    /// A row a ray. rgb: radiance (W/(m² sr)); w: how far that is (m), infinite where nothing is.
    pub hits: &'r Arc<Buffer>,
    /// Number of rays.
    pub count: u32,
    /// Rays of a family, over all directions: as wide they see the environment.
    pub of_family: u32,
}

/// The pass that casts them has this name, whichever store it is of.
pub const CAST: &str = "store.cast";

/// Which maps of the lights a technique reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MapNeeds {
    /// None, not for the direct light either: none are drawn.
    Nothing,
    /// Shadow maps for the direct light of what the camera sees.
    Direct,
    /// Shadow maps, also for lookups anywhere in the scene.
    Shadows,
    /// Reflective shadow maps.
    Reflective,
}

/// What a technique reads of what all techniques share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Needs {
    /// Maps of the lights.
    pub maps: MapNeeds,
    /// Whether it reads [`GBuffer::motion`], which is drawn for it alone.
    pub motion: bool,
    /// Width and height (texels) of reflective shadow maps that it has use for, where that may be
    /// less than shadow maps have.
    pub rsm_size: Option<u32>,
}

impl Needs {
    /// These maps, reflective ones as fine as shadow maps, and no motion.
    pub const fn maps(maps: MapNeeds) -> Self {
        Needs {
            maps,
            motion: false,
            rsm_size: None,
        }
    }
}

/// What has changed since the last frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// Dynamic models have moved. Told in a scene that has them.
    Models,
    /// Lights have moved.
    Lights,
    /// The camera may have moved. Told before each frame.
    Camera,
}

/// What the passes of a frame are given.
#[derive(Clone, Copy)]
pub struct Inputs<'i> {
    /// The scene.
    pub scene: &'i GpuScene,
    /// The maps that the technique needs.
    pub maps: &'i LightMaps,
    /// Those of them that are reflective: the same, or smaller ones ([`Needs::rsm_size`]).
    pub rsm: &'i LightMaps,
    /// What each pixel sees.
    pub gbuffer: &'i GBuffer,
    /// RGBA32F: where a technique that shadows the direct light itself writes that light.
    pub direct: &'i Arc<Image>,
    /// Nothing but the camera has changed since the last frame: models, lights, environment and
    /// what was built are the same.
    pub is_still: bool,
}

/// One complete way to compute indirect light.
pub trait Technique: Inspect {
    /// What its passes read: only that is drawn.
    fn needs(&self) -> Needs;

    /// Builds what does not change between frames, for example from static geometry, with the
    /// dynamic models where they are. Called once before the first frame, and again by benchmarks;
    /// what it allocates is sized by what it counts.
    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error>;

    /// Brings what was built up to a change. The default builds anew after models have moved.
    fn follow(&mut self, context: &Context<'_>, change: Change) -> Result<FrameStats, Error> {
        match change {
            Change::Models => self.build(context),
            Change::Lights | Change::Camera => Ok(FrameStats::default()),
        }
    }

    /// Adds the passes that bring the world-space store up to this frame's light. Of a scene that
    /// is still it keeps what those would only make again.
    fn update(&mut self, frame: &mut Frame, given: &Inputs<'_>);

    /// Adds the passes that gather the diffuse light of these surfaces. Called once a frame or
    /// more; what is gathered in one call is read before the next.
    fn gather(&mut self, frame: &mut Frame, given: &Inputs<'_>, receivers: &Receivers<'_>);

    /// Whether [`Technique::add_apart`] adds anything.
    fn adds_apart(&self) -> bool {
        false
    }

    /// Adds to the diffuse light of each pixel what has no noise, and is not shared with other
    /// pixels or kept for later frames. The default adds nothing.
    fn add_apart(&mut self, _frame: &mut Frame, _given: &Inputs<'_>, _diffuse: &Arc<Image>) {}

    /// Adds the passes that mirror light at each pixel; returns the indirect specular radiance, as
    /// [`IndirectLight::specular`] has it. The default mirrors nothing.
    fn mirror(&mut self, _frame: &mut Frame, _given: &Inputs<'_>) -> Option<Arc<Image>> {
        None
    }

    /// Whether [`Technique::see`] sees anything.
    fn sees(&self) -> bool {
        false
    }

    /// Adds the pass that says what is seen along given lines of sight, as it is lit in this frame:
    /// for pixels that show what is behind something clear. The default sees nothing.
    fn see(&mut self, _frame: &mut Frame, _given: &Inputs<'_>, _sights: SightRays<'_>) {}

    /// Adds the pass that casts rays of another technique through its store, as it is in this
    /// frame, where [`Wanted::casts`] was wanted of it.
    fn cast(&self, _frame: &mut Frame, _rays: CastRays<'_>) {}

    /// How far outside of a box in which models have moved (m) such rays may meet something else
    /// than before: by default anywhere.
    fn cast_margin(&self) -> f32 {
        f32::INFINITY
    }

    /// Writes [`Inputs::direct`], where the technique shadows the direct light itself. Otherwise,
    /// as by default, it is drawn with shadow maps.
    fn shadow_direct(&mut self, _frame: &mut Frame, _given: &Inputs<'_>) -> bool {
        false
    }
}
