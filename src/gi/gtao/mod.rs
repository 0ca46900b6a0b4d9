//! Technique `gtao`: ambient visibility from the picture alone, by the horizons that its depths
//! show (J. Jiménez, X.-C. Wu, A. Pesce, A. Jarabo, *Practical Real-Time Strategies for Accurate
//! Indirect Occlusion*, 2016). There is no store. Surfaces send no light; that of the environment
//! is there where it is wanted.

pub mod oracle;
mod settings;

use std::sync::Arc;

use super::entry::{Directions, Entry, Stage};
use super::shared::interleave::{self, Pattern};
use super::{Context, Inputs, Inspect, MapNeeds, Needs, Settings, Technique};
use crate::gpu_struct;
use crate::graph::{Access, Binding, Error, Frame, FrameStats, Image, Pass, Sets, Shaders};
use crate::render::Receivers;
use crate::shader::GpuStruct;
use settings::{PRESETS, RULES, SETTINGS};

gpu_struct! {
    /// Parameters of `gtao.gather`.
    pub struct GtaoParams {
        /// Slices of a pixel.
        pub slices: u32,
        /// Samples along each half of a slice.
        pub steps: u32,
        /// Of a tile of pixels, as [`Pattern`] packs it.
        pub pattern: u32,
        /// Of the farthest occluders (m); 0: any.
        pub distance: f32,
        /// λ of an occluder's weight 1 / (1 + λ r) (1/m).
        pub falloff: f32,
        /// Share of a horizon that what is behind it takes back.
        pub thin: f32,
        /// 0: without the light of the environment.
        pub has_sky: u32,
    }
}

/// Ambient visibility, and the light of the environment that it lets through. Reads the G-buffer,
/// writes RGBA32F; a thread a pixel.
pub static GATHER: Pass = Pass {
    name: "gtao.gather",
    shaders: Shaders::Compute("gi/gtao/gather.comp"),
    bindings: &[
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::sampled("picture_depth", Access::ComputeSampled),
        Binding::image("indirect_diffuse", Access::ComputeWrite),
    ],
    constants: &[],
    params: Some(GtaoParams::LAYOUT),
    sets: Sets::Scene,
};

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    // The sky's light is the first bounce; surfaces send none.
    bounces: |settings| Some(u32::from(settings.is("light", "sky"))),
    settings: &[SETTINGS, interleave::SETTINGS],
    rules: &[RULES, interleave::RULES],
    presets: PRESETS,
    passes: &[&[&GATHER]],
    stages: &[&Stage::picture("gather", &["gtao.gather"])],
    directions: &[Directions {
        pass: &GATHER,
        count: Some(|settings| 2 * settings.count("slices")),
    }],
    directions_setting: |_| Some("slices"),
    ..Entry::new(
        "gtao",
        "ambient visibility by horizons in the picture; no light, or that of the sky",
        make,
    )
};

fn make(_context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(Horizons {
        params: params(settings),
    }))
}

/// What the settings say.
fn params(settings: &Settings) -> GtaoParams {
    GtaoParams {
        slices: settings.count("slices"),
        steps: settings.count("slice_steps"),
        pattern: Pattern::new(settings).bits(),
        distance: settings.number("occlusion_distance"),
        falloff: settings.number("occlusion_falloff"),
        thin: settings.number("thin_occluders"),
        has_sky: u32::from(settings.is("light", "sky")),
    }
}

struct Horizons {
    params: GtaoParams,
}

impl Technique for Horizons {
    fn needs(&self) -> Needs {
        Needs::maps(MapNeeds::Direct)
    }

    fn build(&mut self, _context: &Context<'_>) -> Result<FrameStats, Error> {
        Ok(FrameStats::default())
    }

    fn update(&mut self, _frame: &mut Frame, _given: &Inputs<'_>) {}

    fn gather(&mut self, frame: &mut Frame, given: &Inputs<'_>, receivers: &Receivers<'_>) {
        let picture_depth: &Arc<Image> = &given.gbuffer.view_depth;
        frame
            .pass(&GATHER)
            .bind("view_depth", receivers.view_depth)
            .bind("normals", receivers.normals)
            .bind("picture_depth", picture_depth)
            .bind("indirect_diffuse", receivers.light)
            .push(&self.params)
            .dispatch(receivers.groups());
    }
}

impl Inspect for Horizons {}
