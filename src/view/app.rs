//! The window's life: events in, one frame after the other, requests of the panels carried out.

use std::collections::VecDeque;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoopProxy};
use winit::window::WindowId;

use super::command::Wanted;
use super::drive::Driver;
use super::panels::{self, Canvas, Panels, Request, Scope};
use super::picture::{ToneMap, develop};
use super::reload::{Compiled, Watcher};
use super::session::{Choice, Session};
use super::simulator::{self, SimulatorWorker};
use super::sky::{self, SkyWorker};
use super::store::Remembered;
use super::truth::TruthWorker;
use super::views::VIEWS;
use super::window::{PaintOutput, Window};
use super::worker::{Event, Worker};
use super::{Options, ViewError};
use crate::gi::inspect::Scale;
use crate::image::{ImageError, write_exr, write_png};
use crate::scene::{Scene, SceneError, camera_toml};
use crate::vulkan::Shown;

/// A picture that is ready sooner than this is waited for, so that the frame after an input shows
/// it.
const QUICK: Duration = Duration::from_millis(14);

/// How long the window waits for something to happen while a picture is being rendered.
const BUSY_PERIOD: Duration = Duration::from_millis(80);

/// How often a script that leaves the window alone looks at it.
pub(super) const LOOK_PERIOD: Duration = Duration::from_millis(10);

/// A scene on its way.
type Loading = (OsString, Receiver<Result<Scene, SceneError>>);

/// What a frame of the window showed.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    /// The job that the picture is of.
    pub(super) job: u64,
    /// When the picture was there.
    pub(super) ready: Instant,
    /// Number of the frame that showed it.
    pub(super) frame: u64,
}

/// The whole window: what the user chose, what is drawn and what is being made.
pub(super) struct App {
    pub(super) options: Options,
    proxy: EventLoopProxy<()>,
    pub(super) ctx: egui::Context,
    pub(super) session: Session,
    pub(super) panels: Panels,
    pub(super) remembered: Remembered,
    store: Option<PathBuf>,
    pub(super) canvas: Canvas,
    pub(super) window: Option<Window>,
    pub(super) worker: Worker,
    truth: TruthWorker,
    simulator: SimulatorWorker,
    skies: SkyWorker,
    watcher: Option<Watcher>,
    pub(super) loading: Option<Loading>,
    pub(super) driver: Option<Driver>,
    /// Where the window's next picture goes.
    pub(super) capture: Option<PathBuf>,
    /// When frames of the last second were drawn.
    drawn: VecDeque<Instant>,
    pub(super) frames: u64,
    /// When the frame that is being made began.
    pub(super) frame_began: Instant,
    /// The left picture of the last frame that was drawn.
    pub(super) seen: Option<Seen>,
    redraw_at: Option<Instant>,
    last_quick: Duration,
    pub(super) closing: bool,
    failure: Option<ViewError>,
}

impl App {
    pub(super) fn new(mut options: Options, proxy: EventLoopProxy<()>) -> Result<Self, ViewError> {
        let notify = |proxy: &EventLoopProxy<()>| -> Box<dyn Fn() + Send> {
            let proxy = proxy.clone();
            // A loop that is gone needs no waking.
            Box::new(move || {
                let _ = proxy.send_event(());
            })
        };
        let choice = Choice::new(options.technique, options.preset.as_deref(), &options.set)?;
        let scene = std::mem::take(&mut options.scene);
        let mut session = Session::new(options.source.clone(), scene, choice, options.shadows);
        session.load = options.load;
        let driver = options.script.take().map(Driver::new);
        let store = if driver.is_some() {
            None
        } else {
            Remembered::path()
        };
        let mut remembered = store.as_deref().map(Remembered::read).unwrap_or_default();
        remembered.vsync = options.vsync.unwrap_or(remembered.vsync);
        options
            .source
            .to_str()
            .into_iter()
            .for_each(|source| remembered.add_recent(source));
        let watcher = options
            .shaders
            .clone()
            .map(|folder| Watcher::start(folder, notify(&proxy)))
            .transpose()?;
        let ctx = egui::Context::default();
        panels::set_style(&ctx, driver.is_some());
        // Ctrl and + − are ours: the scale is the display's, or the option's.
        ctx.options_mut(|options| options.zoom_with_keyboard = false);
        Ok(App {
            worker: Worker::start(options.gpu.clone(), notify(&proxy))?,
            truth: TruthWorker::start(notify(&proxy))?,
            simulator: SimulatorWorker::start("simulator", simulator::work, notify(&proxy))?,
            skies: SkyWorker::start("sky", sky::work, notify(&proxy))?,
            options,
            proxy,
            ctx,
            session,
            panels: Panels::default(),
            remembered,
            store,
            canvas: Canvas::default(),
            window: None,
            watcher,
            loading: None,
            driver,
            capture: None,
            drawn: VecDeque::new(),
            frames: 0,
            frame_began: Instant::now(),
            seen: None,
            redraw_at: None,
            last_quick: Duration::MAX,
            closing: false,
            failure: None,
        })
    }

    /// Ends the threads, remembers the window, and tells what went wrong.
    pub(super) fn finish(mut self) -> Result<(), ViewError> {
        if let (Some(window), Some(path)) = (&self.window, &self.store) {
            self.remembered.fullscreen = window.is_fullscreen();
            if !self.remembered.fullscreen && !window.is_minimised() {
                self.remembered.size = window
                    .raw
                    .inner_size()
                    .to_logical::<f64>(window.raw.scale_factor())
                    .into();
            }
            self.remembered.write(path);
        }
        // All that is on the device goes before it, and what is left is told.
        self.worker.stop();
        (self.session.newest, self.canvas) = ([None, None], Canvas::default());
        let messages = self.window.take().map(|window| {
            let messages = window.messages.clone();
            drop(window);
            messages.list()
        });
        let messages = messages.unwrap_or_default();
        match (self.failure, messages.first()) {
            (Some(failure), _) => Err(failure),
            (None, Some(first)) => Err(ViewError::Validation {
                count: messages.len(),
                first: first.clone(),
            }),
            (None, None) => Ok(()),
        }
    }

    fn fail(&mut self, event_loop: &ActiveEventLoop, failure: ViewError) {
        self.failure.get_or_insert(failure);
        event_loop.exit();
    }

    /// One frame of the window.
    fn frame(&mut self, event_loop: &ActiveEventLoop) -> Result<(), ViewError> {
        self.frame_began = Instant::now();
        self.receive(Duration::ZERO);
        let is_scripted = self.driver.as_ref();
        if is_scripted.is_some_and(|driver| !driver.lets_window_alone()) {
            self.drive()?;
        }
        if self.closing {
            event_loop.exit();
            return Ok(());
        }
        let Some(window) = &mut self.window else {
            return Ok(());
        };
        let size = window.size();
        if size.contains(&0) || !window.painter.prepare(size)? {
            return Ok(());
        }
        self.canvas.update(&self.ctx, &self.session);
        let newest = self.session.newest[0]
            .as_ref()
            .filter(|newest| self.canvas.shows(newest.version));
        let seen = newest.map(|newest| Seen {
            job: newest.picture.job,
            ready: newest.picture.ready,
            frame: self.frames,
        });
        let mut input = window.egui.take_egui_input(&window.raw);
        if let Some(driver) = &mut self.driver {
            driver.add_input(&mut input);
        }
        let dropped: Vec<PathBuf> = input
            .dropped_files
            .iter()
            .filter_map(|file| file.path.clone())
            .collect();
        // What is drawn of it is drawn again until it is false.
        let is_busy = self.worker.is_busy();
        let mut scope = Scope {
            session: &mut self.session,
            panels: &mut self.panels,
            remembered: &mut self.remembered,
            requests: dropped
                .into_iter()
                .map(|path| Request::Open(path.into()))
                .collect(),
            is_busy,
            errors: self.canvas.errors(),
            window_size: size,
            rate: self.drawn.len() as f32,
        };
        let canvas = &self.canvas;
        let output = self
            .ctx
            .run(input, |ctx| panels::show(ctx, &mut scope, canvas));
        let requests = std::mem::take(&mut scope.requests);
        window
            .egui
            .handle_platform_output(&window.raw, output.platform_output);
        for request in requests {
            self.carry_out(request);
        }
        self.ask();
        let primitives = self.ctx.tessellate(output.shapes, output.pixels_per_point);
        let painted = PaintOutput {
            textures: &output.textures_delta,
            primitives: &primitives,
            pixels_per_point: output.pixels_per_point,
            pictures: &self.panels.pictures,
        };
        let Some(window) = &mut self.window else {
            return Ok(());
        };
        match window.paint(&painted, self.capture.is_some())? {
            Shown::Nothing => self.redraw_at = Some(Instant::now()),
            shown => {
                self.count_frame();
                self.seen = seen;
                if let (Shown::Captured(capture), Some(path)) = (shown, self.capture.take()) {
                    let [width, height] = capture.size;
                    let written = image::save_buffer_with_format(
                        &path,
                        &capture.rgb,
                        width,
                        height,
                        image::ExtendedColorType::Rgb8,
                        image::ImageFormat::Png,
                    );
                    self.session.note = match written {
                        Ok(()) => format!("saved {}", path.display()),
                        Err(error) => format!("cannot write {}: {error}", path.display()),
                    };
                }
            }
        }
        let delay = output
            .viewport_output
            .values()
            .map(|viewport| viewport.repaint_delay)
            .min()
            .unwrap_or(Duration::MAX);
        let delay = if is_busy || self.worker.is_busy() || self.loading.is_some() {
            delay.min(BUSY_PERIOD)
        } else {
            delay
        };
        self.redraw_by(Instant::now().checked_add(delay));
        Ok(())
    }

    /// Draws the window again at this time at the latest.
    fn redraw_by(&mut self, at: Option<Instant>) {
        self.redraw_at = [self.redraw_at.take(), at].into_iter().flatten().min();
    }

    fn count_frame(&mut self) {
        self.frames += 1;
        let now = Instant::now();
        self.drawn.push_back(now);
        while self
            .drawn
            .front()
            .is_some_and(|drawn| now.duration_since(*drawn) > Duration::from_secs(1))
        {
            self.drawn.pop_front();
        }
    }

    /// Takes what came back from the threads, after waiting a little for the render thread.
    fn receive(&mut self, most: Duration) {
        for event in if most.is_zero() {
            self.worker.events()
        } else {
            self.worker.events_within(most)
        } {
            match event {
                Event::Opened(name) => self.session.device = name,
                Event::Picture(picture) => {
                    if !picture.is_full || picture.wall_ms < QUICK.as_secs_f64() * 1e3 {
                        self.last_quick = Duration::from_secs_f64(picture.wall_ms.max(0.0) * 1e-3);
                    }
                    self.session.receive(*picture);
                }
                Event::Failed { pane, problem } => {
                    self.session.newest[pane.min(1)] = None;
                    self.session.problem = Some(problem);
                }
                Event::Numbers { of, image } => self.session.take_numbers(of, image),
                Event::Suited(answer) => self.session.take_suited(answer),
                Event::Traced(answer) => self.session.beam.answer = Some(*answer),
                Event::NoDevice(problem) => self.session.problem = Some(problem),
                Event::Shader(result) => {
                    if result.is_ok() {
                        self.session.forget_asked();
                    }
                    self.session.shader = Some(result);
                }
            }
        }
        for compiled in self
            .watcher
            .iter()
            .flat_map(Watcher::take)
            .collect::<Vec<_>>()
        {
            match compiled {
                Compiled::Module(stem, words) => self.worker.replace_module(stem, words),
                Compiled::Failed(problem) => self.session.shader = Some(Err(problem)),
            }
        }
        match self.truth.take() {
            Some(Ok(truth)) => self.session.truth = Some(truth),
            Some(Err(problem)) => self.session.problem = Some(problem),
            None => {}
        }
        if let Some(report) = self.simulator.take() {
            self.session.simulator.report = Some(report);
        }
        if let Some(made) = self.skies.take() {
            self.session.take_sky(made);
        }
        self.receive_scene();
    }

    fn receive_scene(&mut self) {
        let Some((source, receiver)) = &self.loading else {
            return;
        };
        let Ok(loaded) = receiver.try_recv() else {
            return;
        };
        let source = source.clone();
        self.loading = None;
        match loaded {
            Ok(scene) => {
                source
                    .to_str()
                    .into_iter()
                    .for_each(|source| self.remembered.add_recent(source));
                self.session.open(source, scene);
            }
            Err(error) => self.session.scene_problem = Some(error.to_string()),
        }
    }

    /// Asks the threads for what is to be seen now.
    fn ask(&mut self) {
        let held = self.panels.held || self.driver.as_ref().is_some_and(Driver::holds);
        if let Some(job) = self.session.next_job(held) {
            self.worker.ask(job);
            let patience = self.driver.as_ref().and_then(Driver::picture_patience);
            if self.last_quick < QUICK || patience.is_some() {
                self.receive(patience.unwrap_or(QUICK));
            }
            self.redraw_at = Some(Instant::now());
        }
        if !held {
            self.redraw_by(self.session.rests_at());
        }
        self.worker.read_all(self.panels.pointer.is_some());
        if let Some(beam) = self.session.next_beam() {
            self.worker.ask_beam(beam);
        }
        if let Some(wanted) = self.session.next_sky() {
            self.skies.ask(wanted);
        }
        if let Some(suit) = self.session.next_suit() {
            self.worker.ask_suit(suit);
        }
        if self.panels.shows_simulator() {
            let orders = self.session.next_orders();
            orders
                .into_iter()
                .for_each(|order| self.simulator.ask(order));
        }
        if let Some(truth) = self.session.next_truth() {
            if truth.is_some() {
                self.session.truth = None;
            }
            self.truth.ask(truth);
        }
    }

    fn carry_out(&mut self, request: Request) {
        match request {
            Request::Open(source) => self.open(source),
            Request::Save(path) => {
                self.session.note = match self.save(&path) {
                    Ok(()) => format!("saved {}", path.display()),
                    Err(problem) => problem,
                }
            }
            Request::Screenshot(path) => self.capture = Some(path),
            Request::CopyCommand => match self.command_line() {
                Ok(line) => {
                    self.ctx.copy_text(line);
                    self.session.note = "the command line is in the clipboard".to_owned();
                }
                Err(problem) => self.session.note = problem,
            },
            Request::CopyCamera => {
                self.ctx
                    .copy_text(camera_toml(&self.session.controls.camera));
                self.session.note = "the camera is in the clipboard".to_owned();
            }
            Request::Fullscreen => self
                .window
                .iter()
                .for_each(|window| window.set_fullscreen(!window.is_fullscreen())),
            Request::Vsync(on) => {
                self.remembered.vsync = on;
                self.window
                    .iter_mut()
                    .for_each(|window| window.painter.set_vsync(on));
            }
            Request::Quit => self.closing = true,
        }
        self.redraw_at = Some(Instant::now());
    }

    /// Loads a scene on a thread of its own.
    pub(super) fn open(&mut self, source: OsString) {
        let (send, receiver) = channel();
        self.session.scene_problem = None;
        let options = self.session.load;
        let (name, proxy) = (source.clone(), self.proxy.clone());
        let work = move || {
            // Whoever opens another scene meanwhile does not wait for this one.
            let _ = send.send(Scene::open(&name, &options));
            let _ = proxy.send_event(());
        };
        match std::thread::Builder::new()
            .name("scene".to_owned())
            .spawn(work)
        {
            Ok(_) => {
                self.session.note = format!("loading {}", source.to_string_lossy());
                self.loading = Some((source, receiver));
            }
            Err(error) => {
                self.session.scene_problem = Some(format!("a thread cannot be started: {error}"))
            }
        }
    }

    /// Writes the left picture: linear EXR, or PNG as it looks.
    pub(super) fn save(&self, path: &Path) -> Result<(), String> {
        let full = self.session.newest[0]
            .as_ref()
            .filter(|newest| newest.picture.is_full);
        let Some(picture) = full.map(|newest| &newest.picture) else {
            return Err("the picture is not ready yet; save it when it is at rest".to_owned());
        };
        let (view, look) = (&VIEWS[picture.view], self.session.look());
        let Some(image) = &picture.image else {
            return Err(if picture.is_there() {
                "the picture's numbers are not read yet; save it when it is at rest".to_owned()
            } else {
                format!("there is no {} here", view.name)
            });
        };
        let written = match path
            .extension()
            .and_then(|extension| extension.to_str())
            .map(str::to_lowercase)
            .as_deref()
        {
            Some("exr") => write_exr(path, image),
            Some("png") if view.scale == Scale::Light && look.tone_map == ToneMap::Clamp => {
                write_png(path, image, look.exposure)
            }
            Some("png") => {
                let rgb = develop(image, view, look).concat();
                let written = image::save_buffer_with_format(
                    path,
                    &rgb,
                    image.width,
                    image.height,
                    image::ExtendedColorType::Rgb8,
                    image::ImageFormat::Png,
                );
                written.map_err(|source| ImageError::Write {
                    path: path.to_owned(),
                    source: source.into(),
                })
            }
            _ => {
                return Err(format!(
                    "{}: the name must end in .exr or .png",
                    path.display()
                ));
            }
        };
        written.map_err(|error| error.to_string())
    }

    /// Calls `then` with what makes up the left picture's command line.
    fn with_wanted<R>(&self, then: impl FnOnce(&Wanted<'_>) -> R) -> R {
        let session = &self.session;
        let (pane, pairs) = (session.left_job(), session.choices[0].pairs());
        then(&Wanted {
            source: &session.source,
            scene: &session.scene.1,
            load: session.load,
            lights: &session.lights,
            environment: session.environment.clone(),
            camera: session.controls.camera,
            technique: (session.choices[0].preset, &pairs),
            view: &VIEWS[pane.view],
            pane: &pane,
            size: session.size,
            shadows: session.shadows,
            look: session.look(),
            device: self.options.device.as_deref(),
            output: self.panels.save_path.trim(),
        })
    }

    fn command_line(&self) -> Result<String, String> {
        self.with_wanted(|wanted| wanted.line())
    }

    /// The words of the left picture's command line, after `lumivox`.
    pub(super) fn command_words(&self) -> Result<Vec<String>, String> {
        self.with_wanted(|wanted| wanted.words())
    }
}

impl ApplicationHandler<()> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_some() {
            return;
        }
        match Window::open(event_loop, &self.options, &self.remembered, &self.ctx) {
            Ok(window) => {
                window.raw.request_redraw();
                self.worker.open(Arc::clone(&window.device));
                self.window = Some(window);
            }
            Err(failure) => self.fail(event_loop, failure),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(window) = &mut self.window else {
            return;
        };
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::RedrawRequested => {
                self.redraw_at = None;
                if let Err(failure) = self.frame(event_loop) {
                    self.fail(event_loop, failure);
                }
            }
            event => {
                let response = window.egui.on_window_event(&window.raw, &event);
                if response.repaint || matches!(event, WindowEvent::Resized(_)) {
                    window.raw.request_redraw();
                }
            }
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, (): ()) {
        self.window
            .iter()
            .for_each(|window| window.raw.request_redraw());
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(window) = &self.window else { return };
        let now = Instant::now();
        let is_due = self.redraw_at.is_some_and(|at| at <= now);
        let is_scripted = self
            .driver
            .as_ref()
            .map(|driver| !driver.lets_window_alone());
        if is_scripted == Some(false) && !is_due {
            // The script looks at the window, but draws nothing and wakes nothing.
            if let Err(failure) = self.drive() {
                self.fail(event_loop, failure);
            }
            let look_at = now + LOOK_PERIOD;
            event_loop.set_control_flow(ControlFlow::WaitUntil(
                self.redraw_at.map_or(look_at, |at| at.min(look_at)),
            ));
        } else if self.driver.is_some() && window.size().contains(&0) {
            // No redraws come for a window that nobody sees; the script goes on.
            if let Err(failure) = self.frame(event_loop) {
                self.fail(event_loop, failure);
            }
            std::thread::sleep(Duration::from_millis(5));
            event_loop.set_control_flow(ControlFlow::Poll);
        } else if is_due || is_scripted == Some(true) {
            window.raw.request_redraw();
            event_loop.set_control_flow(ControlFlow::Wait);
        } else {
            event_loop.set_control_flow(
                self.redraw_at
                    .map_or(ControlFlow::Wait, ControlFlow::WaitUntil),
            );
        }
    }
}
