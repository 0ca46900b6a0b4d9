//! Who gathers: all pixels, or one in a square; in the picture's order, or in parts that gather
//! along one direction each. Then the mean over each pixel's window.

use std::sync::Arc;

use super::ScreenSettings;
use crate::gi::shared::interleave::deinterleave;
use crate::gi::{Inputs, Technique};
use crate::gpu_struct;
use crate::graph::{Access, Binding, Error, Frame, Gpu, Image, Pass, Sets, Shaders, vk};
use crate::render::{
    FrameConstants, GpuScene, Grid, Picked, Receivers, screen_groups, screen_image, screen_image_of,
};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `screen.join`.
    pub struct JoinParams {
        /// Width and height of the picture in order (texels).
        pub size: [u32; 2],
    }
}

gpu_struct! {
    /// Parameters of `screen.left_over` and `screen.upsample`.
    pub struct CoarseParams {
        /// Width and height of the coarse picture (texels).
        pub size: [u32; 2],
        /// Width of a square of pixels that has one of its texels (px).
        pub scale: u32,
        /// Off a pixel's plane (footprints).
        pub plane_tolerance: f32,
        /// Least cosine of two normals.
        pub normal_cosine: f32,
    }
}

/// The parts of a split picture, put together again (Segovia et al. 2006). Reads RGBA32F, writes
/// RGBA32F, a thread a texel.
pub static JOIN: Pass = Pass {
    name: "screen.join",
    shaders: Shaders::Compute("gi/shared/screen/join.comp"),
    bindings: &[
        Binding::sampled("in_parts", Access::ComputeSampled),
        Binding::image("joined", Access::ComputeWrite),
    ],
    constants: &[],
    params: Some(JoinParams::LAYOUT),
    sets: Sets::Scene,
};

/// The surfaces of those pixels that no texel of a coarse picture beside them shows. Reads the
/// G-buffer, writes R32F; a thread a pixel.
pub static LEFT_OVER: Pass = Pass {
    name: "screen.left_over",
    shaders: Shaders::Compute("gi/shared/screen/left_over.comp"),
    bindings: &[
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::image("left_depth", Access::ComputeWrite),
    ],
    constants: &[],
    params: Some(CoarseParams::LAYOUT),
    sets: Sets::Scene,
};

/// From a coarse picture to all pixels: a bilinear sample of those texels that show a pixel's own
/// surface (joint bilateral upsampling, Kopf et al. 2007). Reads the G-buffer and RGBA32F, writes
/// RGBA32F; a thread a pixel.
pub static UPSAMPLE: Pass = Pass {
    name: "screen.upsample",
    shaders: Shaders::Compute("gi/shared/screen/upsample.comp"),
    bindings: &[
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::sampled("coarse", Access::ComputeSampled),
        Binding::sampled("left", Access::ComputeSampled),
        Binding::image("upsampled", Access::ComputeWrite),
    ],
    constants: &[],
    params: Some(CoarseParams::LAYOUT),
    sets: Sets::Scene,
};

/// A picture of fewer pixels, and what it leaves over.
struct Coarse {
    picked: Picked,
    /// R32F: view depth (m) of pixels that no texel beside them shows; 0 elsewhere.
    left_depth: Arc<Image>,
    /// RGBA32F: what those gathered.
    left: Arc<Image>,
    upsampled: Arc<Image>,
}

/// A picture in parts.
struct Split {
    picked: Picked,
    /// RGBA32F: what was gathered, in parts.
    in_parts: Arc<Image>,
}

/// Who gathers, and what they answered.
pub(super) struct Gather {
    /// RGBA32F: what was gathered, in order.
    gathered: Arc<Image>,
    coarse: Option<Coarse>,
    split: Option<Split>,
    /// RGBA32F: the means over windows; absent where there are none.
    windowed: Option<Arc<Image>>,
    /// In order.
    grid: Grid,
}

impl Gather {
    pub(super) fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: &ScreenSettings,
        size: [u32; 2],
    ) -> Result<Self, Error> {
        let grid = Grid::coarse(size, settings.scale);
        let image = |name: &str| screen_image(gpu, name, grid.size);
        let coarse = || -> Result<Coarse, Error> {
            Ok(Coarse {
                picked: Picked::new(gpu, scene, "screen.coarse", grid.size)?,
                left_depth: screen_image_of(
                    gpu,
                    "screen.left_depth",
                    size,
                    vk::Format::R32_SFLOAT,
                )?,
                left: screen_image(gpu, "screen.left", size)?,
                upsampled: screen_image(gpu, "screen.upsampled", size)?,
            })
        };
        let split = || -> Result<Split, Error> {
            let size = grid.split(settings.pattern.size).size;
            Ok(Split {
                picked: Picked::new(gpu, scene, "screen.split", size)?,
                in_parts: screen_image(gpu, "screen.in_parts", size)?,
            })
        };
        let has_pattern = settings.pattern.count() > 1;
        Ok(Gather {
            gathered: image("screen.gathered")?,
            coarse: (settings.scale > 1).then(coarse).transpose()?,
            split: (settings.splits && has_pattern).then(split).transpose()?,
            windowed: (settings.has_window && has_pattern)
                .then(|| image("screen.windowed"))
                .transpose()?,
            grid,
        })
    }

    /// The next frame is seen with these constants.
    pub(super) fn set(
        &mut self,
        gpu: &Gpu,
        settings: &ScreenSettings,
        seen_with: &FrameConstants,
    ) -> Result<(), Error> {
        let [width, height, ..] = seen_with.size_px;
        self.grid = Grid::coarse([width, height], settings.scale);
        if let Some(coarse) = &mut self.coarse {
            coarse.picked.set(gpu, seen_with, self.grid)?;
        }
        if let Some(split) = &mut self.split {
            let parts = self.grid.split(settings.pattern.size);
            split.picked.set(gpu, seen_with, parts)?;
        }
        Ok(())
    }

    /// Which pixels gather, in order.
    pub(super) fn grid(&self) -> Grid {
        self.grid
    }

    /// What each of them gathered alone.
    pub(super) fn gathered(&self) -> &Arc<Image> {
        &self.gathered
    }

    /// Adds the passes; returns the light of each pixel.
    pub(super) fn add(
        &self,
        frame: &mut Frame,
        given: &Inputs<'_>,
        technique: &mut dyn Technique,
        settings: &ScreenSettings,
    ) -> Arc<Image> {
        if let Some(coarse) = &self.coarse {
            coarse.gather_left(frame, given, technique, self.params(settings));
            coarse.picked.pick(frame, given.scene, given.gbuffer);
        }
        if let Some(split) = &self.split {
            split.picked.pick(frame, given.scene, given.gbuffer);
            technique.gather(frame, given, &split.picked.receivers(&split.in_parts));
            split.join(frame, &self.gathered, self.grid);
        }
        let receivers = match &self.coarse {
            Some(coarse) => {
                coarse.picked.enter(frame, given.scene);
                coarse.picked.receivers(&self.gathered)
            }
            None => {
                frame.set_scene(&given.scene.set, &given.scene.materials);
                given.gbuffer.receivers(given.scene, &self.gathered)
            }
        };
        if self.split.is_none() {
            technique.gather(frame, given, &receivers);
        }
        let windowed = match &self.windowed {
            Some(windowed) => {
                let shared = (settings.pattern, settings.limits);
                deinterleave(frame, &receivers, windowed, shared);
                windowed
            }
            None => &self.gathered,
        };
        frame.set_scene(&given.scene.set, &given.scene.materials);
        match &self.coarse {
            Some(coarse) => coarse.upsample(frame, given, windowed, self.params(settings)),
            None => Arc::clone(windowed),
        }
    }

    fn params(&self, settings: &ScreenSettings) -> CoarseParams {
        CoarseParams {
            size: self.grid.size,
            scale: self.grid.scale,
            plane_tolerance: settings.limits.plane_tolerance,
            normal_cosine: settings.limits.normal_cosine,
        }
    }
}

impl Coarse {
    /// Finds the pixels that no texel shows, and gathers for each of them.
    fn gather_left(
        &self,
        frame: &mut Frame,
        given: &Inputs<'_>,
        technique: &mut dyn Technique,
        params: CoarseParams,
    ) {
        let gbuffer = given.gbuffer;
        frame
            .pass(&LEFT_OVER)
            .bind("view_depth", &gbuffer.view_depth)
            .bind("normals", &gbuffer.normals)
            .bind("left_depth", &self.left_depth)
            .push(&params)
            .dispatch(screen_groups(gbuffer.size));
        let left = Receivers {
            view_depth: &self.left_depth,
            ..gbuffer.receivers(given.scene, &self.left)
        };
        technique.gather(frame, given, &left);
    }

    fn upsample(
        &self,
        frame: &mut Frame,
        given: &Inputs<'_>,
        coarse: &Arc<Image>,
        params: CoarseParams,
    ) -> Arc<Image> {
        let gbuffer = given.gbuffer;
        frame
            .pass(&UPSAMPLE)
            .bind("view_depth", &gbuffer.view_depth)
            .bind("normals", &gbuffer.normals)
            .bind("coarse", coarse)
            .bind("left", &self.left)
            .bind("upsampled", &self.upsampled)
            .push(&params)
            .dispatch(screen_groups(gbuffer.size));
        Arc::clone(&self.upsampled)
    }
}

impl Split {
    fn join(&self, frame: &mut Frame, joined: &Arc<Image>, grid: Grid) {
        frame
            .pass(&JOIN)
            .bind("in_parts", &self.in_parts)
            .bind("joined", joined)
            .push(&JoinParams { size: grid.size })
            .dispatch(screen_groups(self.picked.grid().size));
    }
}
