//! The frame, top to bottom.

use std::sync::Arc;

use glam::Vec3;

use crate::gi::entry::{Entry, Part, Stage, Suited};
use crate::gi::registry;
use crate::gi::shared::screen::{self, Screen};
use crate::gi::{Change, Context, IndirectLight, Inputs, MapNeeds, Settings, Technique};
use crate::graph::{Error, Frame, FrameStats, Gpu, Handover, HostCommands, Recorded};
use crate::render::{
    ClearSurfaces, Follows, GBuffer, GpuScene, KEEP_POSE, LightCascades, LightMaps, Output,
    SET_POSE, ShadowSettings, Watcher,
};
use crate::scene::{Camera, Environment, Light, Scene};

/// What all techniques share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameSettings {
    /// Width and height of the pictures (px).
    pub size: [u32; 2],
    /// The maps of the lights.
    pub shadows: ShadowSettings,
}

/// The stages of a frame that all techniques share.
pub static STAGES: &[&Stage] = &[
    &Stage {
        name: "moving vertices",
        part: Part::Shared,
        passes: &[KEEP_POSE, SET_POSE],
    },
    &Stage {
        name: "light maps",
        part: Part::Shared,
        passes: &["render.shadow_maps", "render.rsm"],
    },
    &screen::SOME_PIXELS,
    &screen::WINDOW,
    &screen::REUSE,
    &screen::BLURRING,
    &Stage {
        name: "surfaces and composite",
        part: Part::Shared,
        passes: &["render.gbuffer", "render.direct", "render.composite"],
    },
    &Stage {
        name: "clear surfaces",
        part: Part::Shared,
        passes: &["clear.shadow", "clear.enter", "clear.pass", "clear.cover"],
    },
];

/// What a technique is told before there is a renderer.
fn context<'c>(gpu: &'c Gpu, scene: &'c GpuScene, size: [u32; 2]) -> Context<'c> {
    Context {
        gpu,
        scene,
        size,
        eye: scene.eye,
        lend: registry::lend,
    }
}

/// What a technique is told about the renderer's state. (A method would borrow all of it.)
macro_rules! context {
    ($renderer:ident) => {
        Context {
            gpu: $renderer.gpu,
            scene: &$renderer.scene,
            size: $renderer.settings.size,
            eye: $renderer.eye,
            lend: registry::lend,
        }
    };
}

mod inspect;

pub use inspect::Traced;

/// One scene, one technique, one size: renders frames.
pub struct Renderer<'g> {
    gpu: &'g Gpu,
    scene: GpuScene,
    maps: LightMaps,
    /// Reflective maps, where they are smaller than shadow maps.
    small_rsm: Option<LightMaps>,
    gbuffer: GBuffer,
    output: Output,
    clear: Option<ClearSurfaces>,
    screen: Screen,
    technique: Box<dyn Technique>,
    settings: FrameSettings,
    /// Frames until the technique's light of what has changed is as it stays.
    frames_to_rest: u32,
    /// The largest width and height (px); the images have this size.
    capacity: [u32; 2],
    /// Whether the technique's structure is as it should be. Where something failed on the way,
    /// the next frame builds it anew.
    is_whole: bool,
    /// Nothing but the camera has changed since the last frame.
    is_still: bool,
    /// Where the camera was last (m).
    eye: Vec3,
    /// The camera of the last frame.
    camera: Option<Camera>,
    /// The last frame's answer.
    light: Option<IndirectLight>,
}

impl<'g> Renderer<'g> {
    /// Uploads the scene and builds the technique's static structure; returns what building cost.
    pub fn new(
        gpu: &'g Gpu,
        scene: &Scene,
        entry: &Entry,
        settings: &Settings,
        frame: FrameSettings,
    ) -> Result<(Self, FrameStats), Error> {
        Renderer::of(gpu, GpuScene::new(gpu, scene)?, entry, settings, frame)
    }

    /// As [`Renderer::new`], of a scene that is on the device already.
    pub fn of(
        gpu: &'g Gpu,
        mut scene: GpuScene,
        entry: &Entry,
        settings: &Settings,
        frame: FrameSettings,
    ) -> Result<(Self, FrameStats), Error> {
        let eye = scene.eye;
        gpu.forget_times();
        let mut technique = (entry.make)(&context(gpu, &scene, frame.size), settings)?;
        let clear = ClearSurfaces::new(gpu, &mut scene, technique.sees(), frame.size)?;
        let mut build = technique.build(&context(gpu, &scene, frame.size))?;
        build.append(gpu.submit_waiting()?);
        let needs = technique.needs();
        let cascades = LightCascades {
            count: frame.shadows.cascades,
            everywhere: needs.maps > MapNeeds::Direct || frame.shadows.cascades == 1,
        };
        scene.set_cascades(gpu, cascades)?;
        let size = frame.shadows.resolution;
        let is_reflective = needs.maps == MapNeeds::Reflective;
        let small_rsm = needs.rsm_size.filter(|rsm| {
            // Cascades divide space by the size of their maps.
            is_reflective && *rsm < size && frame.shadows.cascades == 1
        });
        let small_rsm = small_rsm
            .map(|size| LightMaps::new(gpu, &scene, size, true))
            .transpose()?;
        let maps = match needs.maps {
            MapNeeds::Nothing => LightMaps::none(gpu)?,
            _ => LightMaps::new(gpu, &scene, size, is_reflective && small_rsm.is_none())?,
        };
        let frames_to_rest = (entry.frames_to_rest)(settings);
        let screen = Screen::new(
            gpu,
            &scene,
            (entry.screen(settings), technique.adds_apart()),
            frame.size,
        )?;
        let follows = if needs.motion {
            screen.follows().max(Follows::Motion)
        } else {
            screen.follows()
        };
        let gbuffer = GBuffer::new(gpu, &scene, frame.size, follows)?;
        let output = Output::new(gpu, frame.size)?;
        Ok((
            Renderer {
                gpu,
                scene,
                maps,
                small_rsm,
                gbuffer,
                output,
                clear,
                screen,
                technique,
                settings: frame,
                frames_to_rest,
                capacity: frame.size,
                is_whole: true,
                is_still: false,
                eye,
                camera: None,
                light: None,
            },
            build,
        ))
    }

    fn all_maps_mut(&mut self) -> impl Iterator<Item = &mut LightMaps> {
        [&mut self.maps].into_iter().chain(&mut self.small_rsm)
    }

    /// The next frame is the first of its history: what it shows has nothing to do with the frame
    /// before.
    pub fn cut(&mut self) {
        self.screen.forget();
        self.gbuffer.forget_frame();
    }

    /// What a technique chooses for the scene, beside the pairs that are set already.
    pub fn suit(&self, entry: &Entry, set: &[String]) -> Result<Option<Suited>, Error> {
        (entry.suit)(&context!(self), set)
    }

    /// The scene on the device, for another renderer.
    pub fn into_scene(self) -> GpuScene {
        self.scene
    }

    /// From the next frame on, pictures have this width and height (px), at most the ones that the
    /// renderer was made with. They are the same, bit for bit, as from a renderer of that size.
    pub fn set_size(&mut self, size: [u32; 2]) {
        let fits = (0..2).all(|axis| (1..=self.capacity[axis]).contains(&size[axis]));
        assert!(
            fits,
            "pictures of {size:?} px do not fit into {:?} px",
            self.capacity
        );
        if size != self.settings.size {
            self.screen.forget();
        }
        (self.settings.size, self.gbuffer.size) = (size, size);
    }

    /// The largest width and height (px).
    pub fn capacity(&self) -> [u32; 2] {
        self.capacity
    }

    /// Builds the technique's static structure again.
    pub fn rebuild(&mut self) -> Result<FrameStats, Error> {
        (self.is_whole, self.is_still) = (false, false);
        let before = self.gpu.host_work();
        let mut stats = self.technique.build(&context!(self))?;
        stats.append(self.gpu.submit_waiting()?);
        stats.host = self.gpu.host_work().since(before);
        self.is_whole = true;
        Ok(stats)
    }

    /// Moves the dynamic models to where they are in the scene that this was made of, after
    /// [`Scene::set_time`], and brings the technique's structure up to it. Models that stand where
    /// they stood cost nothing.
    pub fn set_pose(&mut self, scene: &Scene) -> Result<FrameStats, Error> {
        let before_pose = self.gpu.host_work();
        let mut stats = FrameStats::default();
        self.gbuffer.keep_pose(self.gpu, &self.scene);
        let places = |scene: &GpuScene| scene.dynamic.as_ref().map(|models| models.bounds);
        let before = places(&self.scene);
        if let Some(clear) = &mut self.clear
            && clear.set_pose(self.gpu, scene)?
        {
            self.is_still = false;
            self.screen.expect_change(self.frames_to_rest);
            // What reflective maps have of the lights has passed clear surfaces.
            (self.all_maps_mut()).for_each(LightMaps::forget);
        }
        let moved = self.scene.set_pose(self.gpu, scene);
        if matches!(moved, Ok(false)) {
            return Ok(stats);
        }
        let was_whole = std::mem::take(&mut self.is_whole);
        self.is_still = false;
        self.screen.expect_change(self.frames_to_rest);
        for bounds in [before, places(&self.scene)].into_iter().flatten() {
            (self.all_maps_mut()).for_each(|maps| maps.moved_in(bounds));
        }
        moved?;
        if was_whole {
            stats.append(self.technique.follow(&context!(self), Change::Models)?);
        }
        stats.host = self.gpu.host_work().since(before_pose);
        self.is_whole = was_whole;
        Ok(stats)
    }

    /// Moves the lights to where they are in a scene that has as many, of the same kinds, and takes
    /// its environment; the next frame shows it.
    pub fn move_lights(&mut self, scene: &Scene) -> Result<(), Error> {
        self.relight(&scene.lights, &scene.environment)
    }

    /// Whether [`Renderer::relight`] takes these lights.
    pub fn takes_lights(&self, lights: &[Light]) -> bool {
        self.scene.has_kinds_of(lights)
    }

    /// The same with these lights and this environment.
    pub fn relight(&mut self, lights: &[Light], environment: &Environment) -> Result<(), Error> {
        self.is_still = false;
        self.screen.doubt();
        self.screen.expect_change(self.frames_to_rest);
        self.scene.move_lights(self.gpu, lights)?;
        self.scene.set_environment(self.gpu, environment)?;
        if let Some(clear) = &mut self.clear {
            clear.relight();
            clear.set_environment(self.gpu, (&self.scene, environment))?;
        }
        self.technique
            .follow(&context!(self), Change::Lights)
            .map(drop)
    }

    /// Renders one frame: lights, visible surfaces, world-space store, indirect light, what pixels
    /// share of it, direct light, composite.
    pub fn render(&mut self, camera: &Camera) -> Result<FrameStats, Error> {
        (self.all_maps_mut()).for_each(LightMaps::forget);
        self.is_still = false;
        self.render_again(camera)
    }

    /// As [`Renderer::render`], without waiting for the frame: [`Gpu::finish`] tells what it cost.
    /// Returns the cost of what had to be waited for all the same, because the host asks how much
    /// there is of something.
    pub fn render_ahead(&mut self, camera: &Camera) -> Result<FrameStats, Error> {
        (self.all_maps_mut()).for_each(LightMaps::forget);
        self.is_still = false;
        let ahead = |gpu: &Gpu, frame| gpu.submit_ahead(frame);
        self.draw(camera, ahead).map(|(stats, ())| stats)
    }

    /// As [`Renderer::render`], with what still holds of the frame before: light maps, and the
    /// light of the technique's store. A map is drawn again if its light has moved, if models have
    /// moved that it sees, or if it is a cascade that has moved with the camera; the store is lit
    /// again if anything but the camera has changed. The same picture in less time.
    pub fn render_again(&mut self, camera: &Camera) -> Result<FrameStats, Error> {
        let (mut stats, own) = self.draw(camera, Gpu::submit)?;
        stats.append(own);
        Ok(stats)
    }

    /// As [`Renderer::render`], recorded into a command buffer of another program, and copied to an
    /// image of its, in that image's size and format: radiance [W/(m² sr)]. What [`Gpu::record`]
    /// says of commands and of what is returned holds here. Where the host asks how much there is
    /// of something, as in a store that moves with the camera, that is submitted and waited for.
    pub fn record(
        &mut self,
        camera: &Camera,
        commands: &HostCommands,
        target: &Handover,
    ) -> Result<Recorded, Error> {
        (self.all_maps_mut()).for_each(LightMaps::forget);
        self.is_still = false;
        let radiance = Arc::clone(&self.output.radiance);
        let record = |gpu: &Gpu, mut frame: Frame| {
            frame.blit("frame.hand_over", &radiance, &target.image);
            gpu.record(frame, commands, std::slice::from_ref(target))
        };
        self.draw(camera, record).map(|(_, recorded)| recorded)
    }

    /// Draws, and gives the frame away; what the frame does for whoever takes it comes back, beside
    /// the cost of what had to be waited for before.
    fn draw<T>(
        &mut self,
        camera: &Camera,
        submit: impl FnOnce(&Gpu, Frame) -> Result<T, Error>,
    ) -> Result<(FrameStats, T), Error> {
        let before = self.gpu.host_work();
        if !self.is_whole {
            self.cut();
        }
        let mut seen_with = self.scene.frame_constants(camera, self.settings.size);
        self.screen.set(self.gpu, &mut seen_with)?;
        self.scene.set_frame(self.gpu, &seen_with)?;
        (self.eye, self.camera) = (camera.eye, Some(*camera));
        let mut stats = if self.is_whole {
            FrameStats::default()
        } else {
            self.rebuild()?
        };
        self.is_whole = false;
        let is_still = std::mem::take(&mut self.is_still);
        let [width, height] = self.settings.size;
        let watcher = Watcher {
            camera: *camera,
            aspect: width as f32 / height as f32,
            split_lambda: self.settings.shadows.split_lambda,
        };
        for maps in [&mut self.maps].into_iter().chain(&mut self.small_rsm) {
            maps.follow(self.gpu, &self.scene, Some(watcher))?;
        }
        stats.append(self.technique.follow(&context!(self), Change::Camera)?);
        let mut frame = Frame::new();
        frame.set_scene(&self.scene.set, &self.scene.materials);
        if let Some(clear) = &self.clear {
            clear.draw_shadows(&mut frame, &self.scene);
        }
        self.maps.draw(&mut frame, &self.scene);
        if let Some(rsm) = &self.small_rsm {
            rsm.draw(&mut frame, &self.scene);
        }
        self.gbuffer.draw(&mut frame, &self.scene);
        let given = Inputs {
            scene: &self.scene,
            maps: &self.maps,
            rsm: self.small_rsm.as_ref().unwrap_or(&self.maps),
            gbuffer: &self.gbuffer,
            direct: &self.output.direct,
            is_still,
        };
        self.technique.update(&mut frame, &given);
        let mut light = (self.screen).light(&mut frame, &given, &mut *self.technique);
        if !self.technique.shadow_direct(&mut frame, &given) {
            let maps = (&self.maps, &self.settings.shadows);
            self.output
                .draw_direct(&mut frame, &self.scene, maps, &self.gbuffer);
        }
        if let Some(clear) = &self.clear {
            let picture = (&self.scene, &self.gbuffer, &self.output);
            light = clear.draw(&mut frame, picture, &light, |frame, sights| {
                self.technique.see(frame, &given, sights);
            });
        }
        self.output
            .draw_composite(&mut frame, &self.gbuffer, &light);
        self.light = Some(light);
        let taken = submit(self.gpu, frame)?;
        self.gbuffer.keep_frame(&seen_with);
        self.screen.keep_frame(&seen_with);
        (self.all_maps_mut()).for_each(LightMaps::keep);
        self.clear.iter_mut().for_each(ClearSurfaces::keep);
        stats.host = self.gpu.host_work().since(before);
        (self.is_whole, self.is_still) = (true, true);
        Ok((stats, taken))
    }
}
