//! What tools may ask of a technique besides its answer: how it looks inside, what it counts, how
//! it gathers at one place or what it keeps there, and what light it keeps. A technique that has
//! nothing to say of one of these keeps the default.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::Context;
use crate::graph::{Error, Frame, Gpu, Image};
use crate::render::GBuffer;

/// Name of the count of cells that hold something: what a store costs is told for each of them.
pub const OCCUPIED: &str = "voxels";

/// Name of the count of cells that dynamic models touch.
pub const DYNAMIC: &str = "dynamic_voxels";

/// A view that a technique has of itself: a row of [`super::entry::Entry::views`].
#[derive(Debug, PartialEq, Eq)]
pub struct ViewRow {
    /// Name on the command line, in the window and in scripts; no other view has it.
    pub name: &'static str,
    /// Other names on the command line.
    pub aliases: &'static [&'static str],
    /// What it shows, in one line.
    pub help: &'static str,
    /// Unit of its numbers; empty for none.
    pub unit: &'static str,
    /// How its numbers become colours.
    pub scale: Scale,
    /// Which channels of the image that [`Inspect::draw_view`] writes it shows.
    pub channels: Channels,
}

/// How numbers become colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Light: by exposure and tone map.
    Light,
    /// 0 to 1 as it is.
    Share,
    /// −1 to 1.
    Signed,
    /// Black at 0, white at the largest value of the picture.
    Range,
}

/// Channels of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// Red, green, blue.
    Rgb,
    /// Alpha, as a grey.
    Alpha,
}

/// Which way a beam looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BeamAxis {
    /// Along the shading normal, as wide as the first beam of the diffuse gather.
    Normal,
    /// As one of the beams of the pixel's diffuse gather.
    Diffuse(u32),
    /// Along the mirror direction, as wide as the lobe.
    Mirror,
}

/// The surface that a beam begins at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamStart {
    /// The pixel that sees it.
    pub pixel: [u32; 2],
    /// Which of the pixels that gather this is, counted along each axis; its own where all do.
    pub place: [u32; 2],
    /// In world space (m).
    pub position: Vec3,
    /// A unit vector on the viewer's side.
    pub geometric_normal: Vec3,
    /// A unit vector.
    pub shading_normal: Vec3,
    /// GGX roughness of its lobe; 0 where it has none.
    pub roughness: f32,
    /// Where it is seen from (m).
    pub eye: Vec3,
    /// Number of the frame, for patterns that change from frame to frame.
    pub walk: u32,
}

/// One sample of a beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamSample {
    /// From the beam's origin to the sample's middle (m).
    pub distance_m: f32,
    /// How wide the sample is (m).
    pub diameter_m: f32,
    /// The level that it is taken on, 0 the finest.
    pub level: f32,
    /// What the sample sends out (W/(m² sr)).
    pub radiance: Vec3,
    /// How much this step covers, 0 to 1.
    pub opacity: f32,
    /// How much all steps up to and with this one cover, 0 to 1.
    pub covered: f32,
    /// What all steps up to and with this one send to the origin (W/(m² sr)).
    pub gathered: Vec3,
}

/// One beam of a gather (a ray where it has no width) with every sample that it takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Beam {
    /// Where it begins (m).
    pub origin: Vec3,
    /// Its axis, a unit vector.
    pub direction: Vec3,
    /// The full angle γ (degrees); 0 for a ray.
    pub aperture_deg: f32,
    /// Its share of E/π, where it is one of the diffuse gather.
    pub weight: Option<f32>,
    /// Beams of the diffuse gather.
    pub count: u32,
    /// Front to back.
    pub samples: Vec<BeamSample>,
    /// What it sees, with the environment behind what is not covered (W/(m² sr)).
    pub radiance: Vec3,
    /// Ambient visibility.
    pub visibility: f32,
}

/// What a slot has to do with one side of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlotShare {
    /// Index of the slot.
    pub slot: usize,
    /// Share of its radiance in what is seen of the side; those of a side sum to 1.
    pub seen: f32,
    /// Share of the surface's area over which the slot's radiance is a mean, 0 to 1.
    pub area: f32,
}

/// The light of points of the surfaces that a slot holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlotLight {
    /// Sum over points of the diffuse radiance (W/(m² sr)) that leaves the side in the slot, times
    /// [`SlotShare::area`].
    pub radiance: Vec3,
    /// Sum of these areas over points whose front is in the slot, and over those whose back is; 0
    /// where there is no point.
    pub areas: [f32; 2],
}

/// The slots of one side of a surface; those that have nothing to do with it have shares of 0.
pub type SlotShares = [SlotShare; 3];

/// Places in which a technique keeps the light that leaves surfaces, so that an error budget can
/// read and replace it. A *slot* holds one radiance.
pub trait LightSlots: Sync {
    /// Number of slots.
    fn count(&self) -> usize;

    /// Distance between neighbouring places (m).
    fn spacing(&self) -> f32;

    /// Area of the surface whose light a slot holds (m²).
    fn area_m2(&self, slot: usize) -> f32;

    /// The slots of a surface at a world-space position (m): of the side that `normal` points to,
    /// and of the other side; the same slots twice where both sides share them. `None` where
    /// nothing is kept.
    fn at(&self, position: Vec3, normal: Vec3) -> Option<[SlotShares; 2]>;

    /// What each slot sends out (W/(m² sr)).
    fn radiance(&self, gpu: &Gpu) -> Result<Vec<Vec3>, Error>;

    /// Replaces the direct light of later frames by that of points, by slot. Slots without a point
    /// stay holes.
    fn set_direct(&mut self, gpu: &Gpu, light: &[SlotLight]) -> Result<(), Error>;
}

/// Where the light is and has gone that a technique hands on from place to place: flux by colour
/// (W).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// By surfaces and lights.
    pub injected: DVec3,
    /// From the environment, through the border.
    pub entered: DVec3,
    /// By surfaces.
    pub absorbed: DVec3,
    /// Out through the border.
    pub left: DVec3,
    /// Still on its way after the last step.
    pub on_its_way: DVec3,
}

impl Energy {
    /// What is in no other account (W); negative where light is made.
    pub fn lost(&self) -> DVec3 {
        self.injected + self.entered - self.absorbed - self.left - self.on_its_way
    }

    /// All accounts by name, and what is lost (W).
    pub fn rows(&self) -> [(&'static str, DVec3); 6] {
        [
            ("injected", self.injected),
            ("entered", self.entered),
            ("absorbed", self.absorbed),
            ("left", self.left),
            ("on_its_way", self.on_its_way),
            ("lost", self.lost()),
        ]
    }
}

/// What tools may ask.
pub trait Inspect {
    /// Counts for the report, by name; some are read back from the device.
    fn counts(&self, _gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        Ok(Vec::new())
    }

    /// Edge of the finest cells of its store (m); `None` where it has no cells.
    fn cell_size(&self) -> Option<f32> {
        None
    }

    /// Where the last frame's light has gone. It is counted on the device in a run of its own;
    /// `None` where nothing counts it.
    fn energy(&self, _context: &Context<'_>) -> Result<Option<Energy>, Error> {
        Ok(None)
    }

    /// Samples that the gather of the last frame took over the whole picture, by the name of the
    /// pass. They are counted on the device in a run of its own.
    fn count_samples(
        &self,
        _context: &Context<'_>,
        _gbuffer: &GBuffer,
    ) -> Result<Vec<(&'static str, u64)>, Error> {
        Ok(Vec::new())
    }

    /// Levels that a view has, 0 the finest; 0 levels where there is no such view with these
    /// settings.
    fn levels(&self, _view: &ViewRow) -> u32 {
        0
    }

    /// Adds the passes that write a level of a view into `seen`, as the camera of the frame sees
    /// it in `gbuffer`: RGBA32F, of the frame's size. Only called for views and levels that there
    /// are.
    fn draw_view(
        &self,
        _frame: &mut Frame,
        (_view, _level): (&ViewRow, u32),
        _gbuffer: &GBuffer,
        _seen: &Arc<Image>,
    ) {
    }

    /// One beam of the gather, through what the last frame left, with its samples; `aperture_deg`
    /// in place of its own width. `None` where it gathers without beams.
    fn beam(
        &self,
        _context: &Context<'_>,
        _start: &BeamStart,
        _axis: BeamAxis,
        _aperture_deg: Option<f32>,
    ) -> Result<Option<Beam>, Error> {
        Ok(None)
    }

    /// What it keeps where the light of a surface comes from, through what the last frame left:
    /// names, and numbers in words with their units. For where it gathers without beams; empty
    /// where it keeps nothing.
    fn figures_at(
        &self,
        _context: &Context<'_>,
        _start: &BeamStart,
    ) -> Result<Vec<(&'static str, String)>, Error> {
        Ok(Vec::new())
    }

    /// The light that it keeps on surfaces; `None` where it keeps none, or none that can be
    /// replaced.
    fn light_slots(&mut self, _gpu: &Gpu) -> Result<Option<Box<dyn LightSlots + '_>>, Error> {
        Ok(None)
    }
}
