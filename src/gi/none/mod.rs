//! No indirect light: direct light alone, and the skeleton of a technique.

use super::entry::{Entry, Part, Stage};
use super::settings::Settings;
use super::{Context, IndirectLight, Technique};
use crate::graph::{Error, Frame, FrameStats, Gpu};
use crate::render::{GBuffer, GpuScene, LightMaps, screen_image};

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    name: "none",
    summary: "no indirect light",
    bounces: |_| Some(0),
    settings: &[],
    check: |_| Ok(()),
    presets: &[],
    passes: &[],
    structs: &[],
    stages: &[&Stage {
        name: "gather",
        part: Part::Picture,
        passes: &["none.clear"],
    }],
    directions: &[],
    substitutions: &[],
    voxels: Option::None,
    make,
};

fn make(context: &Context<'_>, _settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(None {
        light: IndirectLight {
            diffuse: screen_image(context.gpu, "none.diffuse", context.size)?,
            specular: Option::None,
        },
    }))
}

struct None {
    light: IndirectLight,
}

impl Technique for None {
    fn build(&mut self, _context: &Context<'_>) -> Result<FrameStats, Error> {
        Ok(FrameStats::default())
    }

    fn set_pose(&mut self, _context: &Context<'_>) -> Result<FrameStats, Error> {
        Ok(FrameStats::default())
    }

    fn needs_rsm(&self) -> bool {
        false
    }

    fn update(&mut self, _frame: &mut Frame, _scene: &GpuScene, _maps: &LightMaps) {}

    fn gather(
        &mut self,
        frame: &mut Frame,
        _scene: &GpuScene,
        _maps: &LightMaps,
        _gbuffer: &GBuffer,
    ) -> IndirectLight {
        frame.clear_image("none.clear", &self.light.diffuse, [0.0; 4]);
        self.light.clone()
    }

    fn counts(&self, _gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        Ok(Vec::new())
    }
}
