//! Light of the frames before.

use std::sync::Arc;

use bytemuck::Zeroable;

use super::ScreenSettings;
use super::relight::Change;
use crate::gpu_struct;
use crate::graph::pass::join;
use crate::graph::{
    Access, Binding, Error, Frame, Gpu, Image, Pass, PassBuilder, Sets, Shaders, vk,
};
use crate::render::{FrameConstants, GBuffer, screen_groups, screen_image, screen_image_of};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `screen.history`.
    pub struct HistoryParams {
        /// xyz: where the frame before was seen from (m); w: 1 where there was one.
        pub eye_before: [f32; 4],
        /// As in [`FrameConstants`], of the frame before.
        pub ray_right_before: [f32; 4],
        /// As in [`FrameConstants`], of the frame before.
        pub ray_up_before: [f32; 4],
        /// As in [`FrameConstants`], of the frame before.
        pub ray_forward_before: [f32; 4],
        /// Width and height of what says where light has changed (texels).
        pub change_size: [u32; 2],
        /// Width of one of its texels (px); 0 where light has not changed.
        pub change_px: f32,
        /// Change that takes half of a frame's weight.
        pub change_slack: f32,
        /// What history and this frame's visibility weigh at most (frames).
        pub longest: f32,
        /// What history and this frame's light weigh at most (frames).
        pub longest_light: f32,
        /// Off a pixel's plane (footprints).
        pub plane_tolerance: f32,
        /// Least cosine of two normals.
        pub normal_cosine: f32,
    }
}

/// What all passes of history bind.
const COMMON: [Binding; 10] = [
    Binding::sampled("view_depth", Access::ComputeSampled),
    Binding::sampled("normals", Access::ComputeSampled),
    Binding::sampled("motion", Access::ComputeSampled),
    Binding::sampled("gathered", Access::ComputeSampled),
    Binding::sampled("light_before", Access::ComputeSampled),
    Binding::sampled("guide_before", Access::ComputeSampled),
    Binding::sampled("change", Access::ComputeSampled),
    Binding::sampled("material", Access::ComputeSampled),
    Binding::sampled("material_before", Access::ComputeSampled),
    Binding::image("light_now", Access::ComputeWrite),
];

const fn history_pass(
    name: &'static str,
    module: &'static str,
    bindings: &'static [Binding],
) -> Pass {
    Pass {
        name,
        shaders: Shaders::Compute(module),
        bindings,
        constants: &["TESTS_MATERIAL"],
        params: Some(HistoryParams::LAYOUT),
        sets: Sets::Scene,
    }
}

/// Mean of what was gathered and of what the frame before had at the same place of the surface, by
/// weight. Reads the G-buffer with motion and the frame before; writes light and a guide.
pub static HISTORY: Pass = history_pass(
    "screen.history",
    "gi/shared/screen/history.comp",
    &join::<_, 10, 1, 11>(COMMON, [Binding::image("guide_now", Access::ComputeWrite)]),
);

/// The same, and the mean of the luminance over frames and of its square.
pub static HISTORY_MOMENTS: Pass = history_pass(
    "screen.history",
    "gi/shared/screen/history_moments.comp",
    &join::<_, 10, 3, 13>(
        COMMON,
        [
            Binding::image("guide_now", Access::ComputeWrite),
            Binding::sampled("moments_before", Access::ComputeSampled),
            Binding::image("moments_now", Access::ComputeWrite),
        ],
    ),
);

/// The same of mirrored light, which weighs fewer frames where the eye moves and the lobe is
/// narrow. Its weight (frames) is in alpha.
pub static HISTORY_MIRRORED: Pass = history_pass(
    "screen.history_mirrored",
    "gi/shared/screen/history_mirrored.comp",
    &join::<_, 10, 1, 11>(
        COMMON,
        [Binding::sampled("specular", Access::ComputeSampled)],
    ),
);

/// What history weighs at most while lights change, and nothing says where (frames).
const LONGEST_IN_DOUBT: u32 = 4;

/// What is kept of a frame.
struct Kept {
    /// RGBA32F: as what was gathered.
    light: Arc<Image>,
    /// RGBA32UI: view depth, normal, weights (`gi/shared/screen/history.comp`).
    guide: Arc<Image>,
    /// RGBA32F: mirrored light and its weight; absent where that has no noise.
    mirrored: Option<Arc<Image>>,
    /// RGBA32F: mean of the luminance and of its square; absent where nothing asks.
    moments: Option<Arc<Image>>,
}

/// Light of the frames before.
pub(super) struct History {
    kept: [Kept; 2],
    /// Which of them is of this frame.
    now: usize,
    /// What the frame before was seen with.
    before: Option<FrameConstants>,
    /// Frames so far.
    pub(super) frames: u32,
    /// Whether lights have changed since the frame before, and nothing says where.
    pub(super) is_doubtful: bool,
}

impl History {
    /// `mirrors`: mirrored light has a history too; `has_moments`: luminance has moments.
    pub(super) fn new(
        gpu: &Gpu,
        size: [u32; 2],
        [mirrors, has_moments]: [bool; 2],
    ) -> Result<Self, Error> {
        let moments = || screen_image(gpu, "screen.moments", size);
        let mirrored = || screen_image(gpu, "screen.history_mirrored", size);
        let kept = || -> Result<Kept, Error> {
            Ok(Kept {
                light: screen_image(gpu, "screen.history", size)?,
                guide: screen_image_of(gpu, "screen.guide", size, vk::Format::R32G32B32A32_UINT)?,
                mirrored: mirrors.then(mirrored).transpose()?,
                moments: has_moments.then(moments).transpose()?,
            })
        };
        Ok(History {
            kept: [kept()?, kept()?],
            now: 0,
            before: None,
            frames: 0,
            is_doubtful: false,
        })
    }

    pub(super) fn forget(&mut self) {
        (self.before, self.frames, self.is_doubtful) = (None, 0, false);
    }

    /// What this frame's pixels know besides their light.
    pub(super) fn guide(&self) -> &Arc<Image> {
        &self.kept[self.now].guide
    }

    /// Mean of the luminance over this frame and those before, and of its square.
    pub(super) fn moments(&self) -> Option<&Arc<Image>> {
        self.kept[self.now].moments.as_ref()
    }

    /// [`History::guide`] of the frame that was drawn last.
    pub(super) fn last_guide(&self) -> &Arc<Image> {
        &self.kept[1 - self.now].guide
    }

    /// Adds the pass; returns the light with that of frames before, which weighs less where it has
    /// changed.
    pub(super) fn add(
        &self,
        frame: &mut Frame,
        gbuffer: &GBuffer,
        (gathered, change): (&Arc<Image>, Option<&Change<'_>>),
        settings: &ScreenSettings,
    ) -> Arc<Image> {
        let (now, before) = (&self.kept[self.now], &self.kept[1 - self.now]);
        let moments = now.moments.as_ref().zip(before.moments.as_ref());
        let pass = match moments {
            Some((now, before)) => frame
                .pass(&HISTORY_MOMENTS)
                .bind("moments_before", before)
                .bind("moments_now", now),
            None => frame.pass(&HISTORY),
        };
        self.bind(pass, gbuffer, change)
            .bind("gathered", gathered)
            .bind("light_before", &before.light)
            .bind("light_now", &now.light)
            .bind("guide_now", &now.guide)
            .push(&self.params(change, settings))
            .dispatch(screen_groups(gbuffer.size));
        Arc::clone(&now.light)
    }

    /// Adds the pass of mirrored light; as [`History::add`].
    pub(super) fn add_mirrored(
        &self,
        frame: &mut Frame,
        gbuffer: &GBuffer,
        (mirrored, change): (&Arc<Image>, Option<&Change<'_>>),
        settings: &ScreenSettings,
    ) -> Arc<Image> {
        let [now, before] = [self.now, 1 - self.now].map(|at| self.kept[at].mirrored.as_ref());
        let (Some(now), Some(light_before), Some(specular)) = (now, before, &gbuffer.specular)
        else {
            return Arc::clone(mirrored);
        };
        self.bind(frame.pass(&HISTORY_MIRRORED), gbuffer, change)
            .bind("gathered", mirrored)
            .bind("light_before", light_before)
            .bind("light_now", now)
            .bind("specular", specular)
            .push(&self.params(change, settings))
            .dispatch(screen_groups(gbuffer.size));
        Arc::clone(now)
    }

    /// Binds what all passes of history read of this frame and of the one before.
    fn bind<'f>(
        &self,
        pass: PassBuilder<'f>,
        gbuffer: &GBuffer,
        change: Option<&Change<'_>>,
    ) -> PassBuilder<'f> {
        let before = &self.kept[1 - self.now];
        let unchanged = &before.light;
        let [material, material_before] = match &gbuffer.materials {
            Some([now, before]) => [now, before],
            None => [&gbuffer.normals; 2],
        };
        pass.constant("TESTS_MATERIAL", gbuffer.materials.is_some())
            .bind("material", material)
            .bind("material_before", material_before)
            .bind("view_depth", &gbuffer.view_depth)
            .bind("normals", &gbuffer.normals)
            .bind("motion", gbuffer.motion_asked_for())
            .bind("guide_before", &before.guide)
            .bind("change", change.map_or(unchanged, |change| change.image))
    }

    fn params(&self, change: Option<&Change<'_>>, settings: &ScreenSettings) -> HistoryParams {
        let longest = settings.longest_history.max(1);
        let longest_light = if self.is_doubtful {
            longest.min(LONGEST_IN_DOUBT)
        } else {
            longest
        };
        let seen = self.before.unwrap_or(FrameConstants::zeroed());
        let [x, y, z, _] = seen.eye_ws;
        HistoryParams {
            eye_before: [x, y, z, f32::from(u8::from(self.before.is_some()))],
            ray_right_before: seen.ray_right,
            ray_up_before: seen.ray_up,
            ray_forward_before: seen.ray_forward,
            change_size: change.map_or([1; 2], |change| change.size),
            change_px: change.map_or(0.0, |change| change.px as f32),
            change_slack: settings.relight_slack,
            longest: longest as f32,
            longest_light: longest_light as f32,
            plane_tolerance: settings.limits.plane_tolerance,
            normal_cosine: settings.limits.normal_cosine,
        }
    }

    pub(super) fn keep_frame(&mut self, seen_with: &FrameConstants) {
        self.before = Some(*seen_with);
        self.now = 1 - self.now;
        self.frames = self.frames.wrapping_add(1);
        self.is_doubtful = false;
    }
}
