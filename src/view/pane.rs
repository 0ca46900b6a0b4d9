//! One side of the window, on the render thread: a renderer that is kept for as long as it fits.

use std::sync::Arc;
use std::time::Instant;

use glam::Vec4;

use super::beam::{BeamAnswer, BeamJob};
use super::views::{Source, VIEWS, View};
use super::worker::{Job, PaneJob, Picture};
use crate::frame::{FrameSettings, Renderer};
use crate::gi::Settings;
use crate::gi::entry::{Entry, Suited};
use crate::graph::{Error, FrameStats, Gpu, Image as GpuImage};
use crate::image::Image;
use crate::render::{GpuScene, RSM, SHADOW_MAPS, ShadowSettings, Terms, exact_screen_image};
use crate::scene::{Camera, Environment, Light};

/// How long a picture may take while something moves (ms).
const QUICK_MS: f64 = 60.0;

/// Pictures are allocated in steps of this many pixels: a window that is dragged larger then rarely
/// needs new ones.
const STEP_PX: u32 = 128;

/// Passes that a quick picture does without, since only the camera moves.
const LIGHT_MAPS: [&str; 2] = [SHADOW_MAPS.name, RSM.name];

/// Frames of a picture at rest; `lumivox render --frames` is given the same.
pub(super) fn rest_frames(job: &PaneJob) -> u32 {
    job.entry.rest(&job.settings)
}

/// A renderer, what it was made for and what it has done.
pub(super) struct Pane<'g> {
    renderer: Renderer<'g>,
    made_for: MadeFor,
    build: Option<FrameStats>,
    /// Frames since it was built.
    frames: u32,
    /// Time of one pixel of a frame (ms), as the last one took.
    pixel_ms: f64,
    /// What the newest picture was of: job, and whether it was in full.
    shown: Option<(u64, bool)>,
    /// Light that was shown; the window may still show it.
    lights: Vec<Arc<GpuImage>>,
    /// What the newest picture shows of its light, until its numbers have been read.
    unread: Option<Terms>,
    /// Where the camera was in the last frame.
    camera: Option<Camera>,
}

struct MadeFor {
    scene: u64,
    lights: Vec<Light>,
    environment: Environment,
    technique: &'static str,
    settings: Settings,
    shadows: ShadowSettings,
}

impl MadeFor {
    fn of(job: &Job, pane: &PaneJob) -> Self {
        MadeFor {
            scene: job.scene.0,
            lights: job.lights.to_vec(),
            environment: job.environment.clone(),
            technique: pane.entry.name,
            settings: pane.settings.clone(),
            shadows: job.shadows,
        }
    }

    fn has_light_of(&self, job: &Job) -> bool {
        *self.lights == *job.lights && self.environment == job.environment
    }

    /// Whether only the lights and the environment may differ.
    fn fits(&self, job: &Job, pane: &PaneJob) -> bool {
        self.scene == job.scene.0
            && self.technique == pane.entry.name
            && self.shadows == job.shadows
            && self.settings == pane.settings
    }
}

impl<'g> Pane<'g> {
    /// Makes sure that the slot holds a pane that fits, and keeps what it can of the old one.
    pub(super) fn follow(
        slot: &mut Option<Pane<'g>>,
        gpu: &'g Gpu,
        job: &Job,
        index: usize,
    ) -> Result<(), Error> {
        let wanted = &job.panes[index];
        let is_large_enough =
            |pane: &Pane<'_>| (0..2).all(|axis| pane.renderer.capacity()[axis] >= job.size[axis]);
        if let Some(pane) = slot
            .as_mut()
            .filter(|pane| pane.made_for.fits(job, wanted) && is_large_enough(pane))
        {
            if pane.made_for.has_light_of(job) {
                return Ok(());
            }
            if pane.renderer.takes_lights(&job.lights) {
                return pane.relight(job);
            }
        }
        // The old one goes first, so that changing needs no more memory than having; the scene on
        // the device stays where only the technique changes.
        let old = slot
            .take()
            .filter(|pane| pane.made_for.scene == job.scene.0);
        let mut uploaded = match old {
            Some(Pane {
                renderer, made_for, ..
            }) => {
                let mut uploaded = renderer.into_scene();
                if !made_for.has_light_of(job) {
                    uploaded.set_lights(gpu, &job.lights, &job.environment)?;
                }
                uploaded
            }
            None => {
                let mut uploaded = GpuScene::new(gpu, &job.scene.1)?;
                uploaded.set_lights(gpu, &job.lights, &job.environment)?;
                uploaded
            }
        };
        uploaded.eye = job.camera.eye;
        let size = job.size.map(|size| size.next_multiple_of(STEP_PX));
        let frame = FrameSettings {
            size,
            shadows: job.shadows,
        };
        let (renderer, build) = Renderer::of(gpu, uploaded, wanted.entry, &wanted.settings, frame)?;
        let made_for = MadeFor::of(job, wanted);
        *slot = Some(Pane {
            renderer,
            made_for,
            build: Some(build),
            frames: 0,
            pixel_ms: 0.0,
            shown: None,
            lights: Vec::new(),
            unread: None,
            camera: None,
        });
        Ok(())
    }

    /// Follows lights that have moved and another environment.
    fn relight(&mut self, job: &Job) -> Result<(), Error> {
        self.renderer.relight(&job.lights, &job.environment)?;
        self.renderer.cut();
        self.made_for.lights = job.lights.to_vec();
        self.made_for.environment = job.environment.clone();
        (self.frames, self.shown, self.camera) = (0, None, None);
        Ok(())
    }

    /// What was shown is of other shaders.
    pub(super) fn shaders_changed(&mut self) {
        (self.shown, self.camera) = (None, None);
        // The store was built by the old ones; what fails here fails again, and is told, when the
        // picture is asked for.
        self.build = self.renderer.rebuild().ok();
        self.renderer.cut();
        self.frames = 0;
    }

    /// Renders one picture; `None` where the newest is as good.
    pub(super) fn render(
        &mut self,
        gpu: &Gpu,
        job: &Job,
        index: usize,
        is_full: bool,
    ) -> Result<Option<Picture>, Error> {
        let wanted = &job.panes[index];
        let size = if is_full {
            job.size
        } else {
            self.quick_size(job)
        };
        let rest_frames = rest_frames(wanted);
        // While something moves, one frame of many is quick, whatever its size.
        let has_all = job.rest || job.continuous || rest_frames == 1;
        let is_full = size == job.size && has_all;
        if !job.continuous
            && self
                .shown
                .is_some_and(|(id, was_full)| id == job.id && (was_full || !is_full))
        {
            return Ok(None);
        }
        let is_exact = is_full && job.rest && !job.continuous && rest_frames > 1;
        if is_exact && (self.frames != 0 || self.camera != Some(job.camera)) {
            // Later frames depend on earlier ones: the picture at rest starts over.
            self.build = Some(self.renderer.rebuild()?);
            self.renderer.cut();
            self.frames = 0;
        }
        self.renderer.set_size(size);
        let mut stats = FrameStats::default();
        for _ in 0..if is_exact { rest_frames } else { 1 } {
            stats = if is_full {
                self.renderer.render(&job.camera)?
            } else {
                self.renderer.render_again(&job.camera)?
            };
            self.frames += 1;
            let ms: f64 = stats
                .passes
                .iter()
                .filter(|pass| !LIGHT_MAPS.contains(&pass.name.as_str()))
                .map(|pass| pass.gpu_ms)
                .sum();
            // The first frame may have compiled its pipelines.
            self.pixel_ms =
                if self.frames == 1 { 0.25 * ms } else { ms } / f64::from(size[0] * size[1]);
        }
        self.camera = Some(job.camera);
        self.shown = Some((job.id, is_full));
        let view = &VIEWS[wanted.view];
        self.unread = view.terms(wanted.components);
        let (light, image) = match self.unread {
            Some(terms) => {
                let light = self.light(gpu)?;
                self.renderer.show(terms, &light)?;
                (Some(light), None)
            }
            None => (None, view.read(&self.renderer, wanted.layer)?),
        };
        Ok(Some(Picture {
            job: job.id,
            pane: index,
            size: image.as_ref().map_or(size, |image| image.size().into()),
            light,
            image,
            view: wanted.view,
            is_full,
            stats,
            build: self.build.take(),
            wall_ms: 0.0,
            ready: Instant::now(),
            counts: self.renderer.counts()?,
            layers: self.layers(view),
            memory: gpu.memory(),
        }))
    }

    /// An image for light that nobody shows any more, or a new one.
    fn light(&mut self, gpu: &Gpu) -> Result<Arc<GpuImage>, Error> {
        let mut unused = self
            .lights
            .iter()
            .filter(|light| Arc::strong_count(light) == 1);
        if let Some(light) = unused.next() {
            return Ok(Arc::clone(light));
        }
        let light = exact_screen_image(gpu, "window.light", self.renderer.capacity())?;
        self.lights.push(Arc::clone(&light));
        Ok(light)
    }

    /// The numbers of the newest picture, where it is light, in full, and they were not read yet.
    pub(super) fn numbers(&mut self, gpu: &Gpu, job: &Job) -> Result<Option<Image>, Error> {
        let is_shown = self.shown == Some((job.id, true));
        let Some(terms) = self.unread.take().filter(|_| is_shown) else {
            return Ok(None);
        };
        // The window may be sampling the image that it shows.
        let light = self.light(gpu)?;
        self.renderer.show(terms, &light)?;
        let texels: Vec<Vec4> = bytemuck::pod_collect_to_vec(&gpu.read_image(&light, 0, 0)?);
        let columns = light.extent(0)[0] as usize;
        let [width, height] = job.size;
        Ok(Some(Image::from_fn(width, height, |pixel| {
            let (x, y) = (pixel % width as usize, pixel / width as usize);
            texels[y * columns + x].truncate()
        })))
    }

    /// What a technique chooses for the scene.
    pub(super) fn suit(&self, entry: &Entry) -> Result<Option<Suited>, Error> {
        self.renderer.suit(entry, &[])
    }

    /// Traces a beam from the newest picture; `None` where that is not the picture that was meant,
    /// or not in full.
    pub(super) fn beam(&self, job: &BeamJob) -> Option<BeamAnswer> {
        let is_shown = self.shown == Some((job.job, true));
        is_shown.then(|| BeamAnswer {
            of: *job,
            found: self
                .renderer
                .trace(job.pixel, job.axis, job.aperture_deg)
                .map_err(|error| error.to_string()),
        })
    }

    /// How many light maps or levels a view has.
    fn layers(&self, view: &View) -> u32 {
        match view.source {
            Source::LightMap(_) => self.renderer.light_map_count(),
            Source::Own(view) => self.renderer.levels(view),
            Source::Aov(_) | Source::Surface(_) => 0,
        }
    }

    /// The size that is quick to render: a half, a quarter or an eighth in each direction where the
    /// whole is not.
    fn quick_size(&self, job: &Job) -> [u32; 2] {
        let pixels = f64::from(job.size[0] * job.size[1]) * job.panes.len() as f64;
        let divisor = if self.frames == 0 {
            4
        } else {
            [1, 2, 4]
                .into_iter()
                .find(|d| self.pixel_ms * pixels / f64::from(d * d) <= QUICK_MS)
                .unwrap_or(8)
        };
        job.size.map(|size| size.div_ceil(divisor))
    }
}
