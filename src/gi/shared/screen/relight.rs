//! Where light has changed: a few pixels of the frame before gather once more.

use std::sync::Arc;

use super::gather::Gather;
use crate::gi::shared::interleave::Pattern;
use crate::gi::{Inputs, Technique};
use crate::graph::{Access, Binding, Error, Frame, Gpu, Image, Pass, Sets, Shaders};
use crate::render::{FrameConstants, GpuScene, Grid, Picked, screen_groups, screen_image};

/// What a few pixels see and gathered. Reads the G-buffer and RGBA32F; writes R32F, RGBA32UI and
/// RGBA32F, a thread a texel.
pub static REMEMBER: Pass = Pass {
    name: "screen.remember",
    shaders: Shaders::Compute("gi/shared/screen/remember.comp"),
    bindings: &[
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::sampled("motion", Access::ComputeSampled),
        Binding::sampled("gathered", Access::ComputeSampled),
        Binding::image("kept_depth", Access::ComputeWrite),
        Binding::image("kept_normals", Access::ComputeWrite),
        Binding::image("kept_light", Access::ComputeWrite),
    ],
    constants: &[],
    params: None,
    sets: Sets::Scene,
};

/// ρ = Σ L′ / Σ L and λ = Σ|L′ − ρL| / Σ max(L′, ρL) over the texels around each, by a Gaussian.
/// L is what they gathered in the frame before, L′ the same in this frame's light. Writes RGBA32F
/// (ρ, λ), a thread a texel.
pub static RELIGHT: Pass = Pass {
    name: "screen.relight",
    shaders: Shaders::Compute("gi/shared/screen/relight.comp"),
    bindings: &[
        Binding::sampled("kept_depth", Access::ComputeSampled),
        Binding::sampled("kept_light", Access::ComputeSampled),
        Binding::sampled("light_again", Access::ComputeSampled),
        Binding::image("change", Access::ComputeWrite),
    ],
    constants: &[],
    params: None,
    sets: Sets::Scene,
};

/// A few pixels of a frame.
struct Kept {
    picked: Picked,
    /// RGBA32F: what they gathered.
    light: Arc<Image>,
}

/// By how much light has changed, and where.
pub(super) struct Change<'c> {
    /// RGBA32F: ρ; λ, 0 to 1.
    pub(super) image: &'c Arc<Image>,
    /// Width and height (texels).
    pub(super) size: [u32; 2],
    /// Width of a texel (px).
    pub(super) px: u32,
}

/// Where light has changed.
pub(super) struct Relight {
    kept: [Kept; 2],
    /// Which of them is of this frame.
    now: usize,
    /// RGBA32F: what the pixels of the frame before gather now.
    again: Arc<Image>,
    /// RGBA32F: ρ and λ.
    change: Arc<Image>,
    /// One in so many pixels that gather, along each axis.
    tile: u32,
    /// Whether there is a frame before.
    has_before: bool,
    /// Frames to come that light is compared in with the one before.
    frames_to_compare: u32,
}

impl Relight {
    pub(super) fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        (tile, scale): (u32, u32),
        size: [u32; 2],
    ) -> Result<Self, Error> {
        let size = Grid::coarse(size, scale).sparse(tile, [0; 2]).size;
        let kept = |name: &str| -> Result<Kept, Error> {
            Ok(Kept {
                picked: Picked::new(gpu, scene, name, size)?,
                light: screen_image(gpu, &format!("{name}.light"), size)?,
            })
        };
        Ok(Relight {
            kept: [kept("screen.kept")?, kept("screen.kept_before")?],
            now: 0,
            again: screen_image(gpu, "screen.light_again", size)?,
            change: screen_image(gpu, "screen.change", size)?,
            tile,
            has_before: false,
            frames_to_compare: 0,
        })
    }

    pub(super) fn forget(&mut self) {
        self.has_before = false;
    }

    /// Light is to be compared with that of the frame before, in so many frames.
    pub(super) fn expect_change(&mut self, frames: u32) {
        self.frames_to_compare = self.frames_to_compare.max(frames);
    }

    /// Frame `number` is seen with these constants, by pixels that gather in this grid.
    pub(super) fn set(
        &mut self,
        gpu: &Gpu,
        seen_with: &FrameConstants,
        (grid, number): (Grid, u32),
    ) -> Result<(), Error> {
        // All pixels of a tile, one after the other, neighbours far apart in time.
        let tile = Pattern::of([self.tile; 2]);
        let at = number % tile.count() * tile.stride() % tile.count();
        let grid = grid.sparse(self.tile, [at % self.tile, at / self.tile]);
        self.kept[self.now].picked.set(gpu, seen_with, grid)
    }

    /// Adds the passes that find where light has changed; `None` where it has not.
    pub(super) fn find(
        &self,
        frame: &mut Frame,
        given: &Inputs<'_>,
        technique: &mut dyn Technique,
    ) -> Option<Change<'_>> {
        if self.frames_to_compare == 0 || !self.has_before {
            return None;
        }
        let Kept { picked, light } = &self.kept[1 - self.now];
        picked.enter(frame, given.scene);
        technique.gather(frame, given, &picked.receivers(&self.again));
        frame
            .pass(&RELIGHT)
            .bind("kept_depth", &picked.view_depth)
            .bind("kept_light", light)
            .bind("light_again", &self.again)
            .bind("change", &self.change)
            .dispatch(screen_groups(picked.grid().size));
        frame.set_scene(&given.scene.set, &given.scene.materials);
        Some(Change {
            image: &self.change,
            size: picked.grid().size,
            px: self.tile * picked.grid().scale,
        })
    }

    /// Adds the pass that keeps a few pixels for the next frame.
    pub(super) fn remember(&self, frame: &mut Frame, given: &Inputs<'_>, gather: &Gather) {
        let Kept { picked, light } = &self.kept[self.now];
        let gbuffer = given.gbuffer;
        picked.enter(frame, given.scene);
        frame
            .pass(&REMEMBER)
            .bind("view_depth", &gbuffer.view_depth)
            .bind("normals", &gbuffer.normals)
            .bind("motion", gbuffer.motion_asked_for())
            .bind("gathered", gather.gathered())
            .bind("kept_depth", &picked.view_depth)
            .bind("kept_normals", &picked.normals)
            .bind("kept_light", light)
            .dispatch(screen_groups(picked.grid().size));
        frame.set_scene(&given.scene.set, &given.scene.materials);
    }

    pub(super) fn keep_frame(&mut self) {
        self.now = 1 - self.now;
        self.has_before = true;
        self.frames_to_compare = self.frames_to_compare.saturating_sub(1);
    }
}
