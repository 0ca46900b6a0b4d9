//! The thread that renders, so that the window answers while a frame takes seconds.
//!
//! It works on one job at a time, the newest, and sends results back as events. A picture at rest
//! has the full size, and is made from the same state as a picture of `lumivox render`. Light stays
//! on the device, which is the window's; its submissions are short, so that the window's come in
//! between.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::beam::{BeamAnswer, BeamJob};
use super::pane::Pane;
use super::suit::{SuitAnswer, SuitJob};
use crate::gi::Settings;
use crate::gi::entry::Entry;
use crate::graph::{Device, FrameStats, Gpu, GpuOptions, Image as GpuImage};
use crate::image::Image;
use crate::render::{ShadowSettings, Terms};
use crate::scene::{Camera, Environment, Light, Scene};
use crate::text::counted;

/// How long a frame of the window may wait for one of the thread's submissions (ms).
const LONGEST_SUBMISSION_MS: f64 = 20.0;

/// What one side of the window is to show.
#[derive(Clone)]
pub(super) struct PaneJob {
    /// The technique that renders.
    pub(super) entry: &'static Entry,
    /// The values of all its settings.
    pub(super) settings: Settings,
    /// Position in [`super::views::VIEWS`].
    pub(super) view: usize,
    /// Which light map, for views of those.
    pub(super) layer: u32,
    /// Terms of the view `full`.
    pub(super) components: Terms,
}

/// What the window is to show.
#[derive(Clone)]
pub(super) struct Job {
    /// Grows with every change.
    pub(super) id: u64,
    /// The scene; another one has another number.
    pub(super) scene: (u64, Arc<Scene>),
    /// The lights in place of the scene's.
    pub(super) lights: Arc<[Light]>,
    /// The environment in place of the scene's.
    pub(super) environment: Environment,
    /// The camera that the picture is taken with.
    pub(super) camera: Camera,
    /// One or two sides.
    pub(super) panes: Vec<PaneJob>,
    /// Width and height (px).
    pub(super) size: [u32; 2],
    /// The maps of the lights.
    pub(super) shadows: ShadowSettings,
    /// Whether nothing moves, so that the full picture is wanted.
    pub(super) rest: bool,
    /// Whether frames are wanted even where nothing changes.
    pub(super) continuous: bool,
}

/// One side's picture and what it cost.
pub(super) struct Picture {
    /// The job that it is of.
    pub(super) job: u64,
    /// 0 left, 1 right.
    pub(super) pane: usize,
    /// What is shown, RGBA32F, where it is light (W/(m² sr)).
    pub(super) light: Option<Arc<GpuImage>>,
    /// The view's numbers; of light only where they were read. Without both, technique or scene
    /// have no such picture.
    pub(super) image: Option<Image>,
    /// Width and height (px).
    pub(super) size: [u32; 2],
    /// Position in [`super::views::VIEWS`].
    pub(super) view: usize,
    /// Whether it has the size that was asked for.
    pub(super) is_full: bool,
    /// What the frame cost on the device.
    pub(super) stats: FrameStats,
    /// What the last build cost, where this frame was the first after it.
    pub(super) build: Option<FrameStats>,
    /// The frame, with what it waits for (ms).
    pub(super) wall_ms: f64,
    /// When the window could first take it.
    pub(super) ready: Instant,
    /// Counts by name.
    pub(super) counts: Vec<(&'static str, u64)>,
    /// How many light maps or levels the view has.
    pub(super) layers: u32,
    /// Every living resource of the device, by name (bytes).
    pub(super) memory: Vec<(String, u64)>,
}

impl Picture {
    /// Whether it is in full, and so are its numbers.
    pub(super) fn is_whole(&self) -> bool {
        self.is_full && (self.light.is_none() || self.image.is_some())
    }

    /// Whether there is anything to see.
    pub(super) fn is_there(&self) -> bool {
        self.light.is_some() || self.image.is_some()
    }
}

/// What the worker says.
pub(super) enum Event {
    /// The device is open: its name.
    Opened(String),
    /// A side's picture is finished.
    Picture(Box<Picture>),
    /// The numbers of a side's picture in full that was sent before.
    Numbers {
        /// The side, 0 left, and the job.
        of: (usize, u64),
        /// The numbers.
        image: Image,
    },
    /// A beam with its samples.
    Traced(Box<BeamAnswer>),
    /// What was chosen for the scene.
    Suited(SuitAnswer),
    /// What a side asks for cannot be done.
    Failed {
        /// 0 left, 1 right.
        pane: usize,
        /// Why it cannot be done.
        problem: String,
    },
    /// There is no device; nothing will follow.
    NoDevice(String),
    /// A shader module was taken, or refused.
    Shader(Result<String, String>),
}

#[derive(Default)]
struct Inbox {
    device: Option<Arc<Device>>,
    job: Option<Job>,
    modules: Vec<(String, Vec<u32>)>,
    beam: Option<BeamJob>,
    suit: Option<SuitJob>,
    quit: bool,
    /// Whether numbers are wanted of pictures in full that follow each other.
    reads: bool,
    /// Whether a job is being worked on.
    busy: bool,
}

impl Inbox {
    /// Whether there is something to do beside a job.
    fn has_other_work(&self) -> bool {
        self.beam.is_some() || self.suit.is_some() || !self.modules.is_empty()
    }
}

#[derive(Default)]
struct Shared {
    inbox: Mutex<Inbox>,
    wake: Condvar,
    events: Mutex<Vec<Event>>,
    answered: Condvar,
}

impl Shared {
    fn inbox(&self) -> MutexGuard<'_, Inbox> {
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The thread, seen from the window.
pub(super) struct Worker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts the thread; `notify` is called after each event, on that thread.
    pub(super) fn start(
        options: GpuOptions,
        notify: Box<dyn Fn() + Send>,
    ) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let inner = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("render".to_owned())
            .spawn(move || work(&inner, &options, &*notify))?;
        Ok(Worker {
            shared,
            thread: Some(thread),
        })
    }

    /// Begins to work, on the window's device.
    pub(super) fn open(&self, device: Arc<Device>) {
        self.shared.inbox().device = Some(device);
        self.shared.wake.notify_one();
    }

    /// Whether numbers are wanted of each picture while pictures follow each other.
    pub(super) fn read_all(&self, reads: bool) {
        self.shared.inbox().reads = reads;
    }

    /// Asks for this instead of whatever was asked for before.
    pub(super) fn ask(&self, job: Job) {
        self.shared.inbox().job = Some(job);
        self.shared.wake.notify_one();
    }

    /// Asks for a beam from the picture that was last sent in full.
    pub(super) fn ask_beam(&self, job: BeamJob) {
        self.shared.inbox().beam = Some(job);
        self.shared.wake.notify_one();
    }

    /// Asks for what suits the scene that was last rendered.
    pub(super) fn ask_suit(&self, job: SuitJob) {
        self.shared.inbox().suit = Some(job);
        self.shared.wake.notify_one();
    }

    /// Hands a shader module over, to be taken in place of the embedded one.
    pub(super) fn replace_module(&self, stem: String, words: Vec<u32>) {
        self.shared.inbox().modules.push((stem, words));
        self.shared.wake.notify_one();
    }

    /// Whether it is at work.
    pub(super) fn is_busy(&self) -> bool {
        let inbox = self.shared.inbox();
        inbox.busy || inbox.job.is_some() || inbox.has_other_work()
    }

    /// All events since the last call.
    pub(super) fn events(&self) -> Vec<Event> {
        std::mem::take(
            &mut *self
                .shared
                .events
                .lock()
                .unwrap_or_else(PoisonError::into_inner),
        )
    }

    /// As [`Worker::events`], after waiting a little for the first.
    pub(super) fn events_within(&self, most: Duration) -> Vec<Event> {
        let events = self
            .shared
            .events
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let waited = self
            .shared
            .answered
            .wait_timeout_while(events, most, |events| events.is_empty());
        std::mem::take(&mut *waited.unwrap_or_else(PoisonError::into_inner).0)
    }

    /// Ends the thread, and forgets what it has sent.
    pub(super) fn stop(&mut self) {
        self.shared.inbox().quit = true;
        self.shared.wake.notify_one();
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            log::error!("the render thread panicked");
        }
        drop(self.events());
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.stop();
    }
}

fn work(shared: &Shared, options: &GpuOptions, notify: &dyn Fn()) {
    let send = |mut event: Event| {
        let mut events = shared.events.lock().unwrap_or_else(PoisonError::into_inner);
        if let Event::Picture(picture) = &mut event {
            // Under the lock, so that every later look finds it.
            picture.ready = Instant::now();
        }
        events.push(event);
        drop(events);
        shared.answered.notify_one();
        notify();
    };
    let Some(device) = wait_for_device(shared) else {
        return;
    };
    let options = GpuOptions {
        longest_submission_ms: Some(LONGEST_SUBMISSION_MS),
        ..options.clone()
    };
    let gpu = match Gpu::on(device, &options) {
        Ok(gpu) => gpu,
        Err(error) => return send(Event::NoDevice(error.to_string())),
    };
    send(Event::Opened(gpu.info().name.clone()));
    let mut panes: [Option<Pane<'_>>; 2] = [None, None];
    let mut last: Option<Job> = None;
    loop {
        let (job, modules, beam, suit) = {
            let mut inbox = shared.inbox();
            let again = last.as_ref().is_some_and(|job| job.continuous);
            while !inbox.quit && inbox.job.is_none() && !inbox.has_other_work() && !again {
                inbox.busy = false;
                inbox = shared
                    .wake
                    .wait(inbox)
                    .unwrap_or_else(PoisonError::into_inner);
            }
            if inbox.quit {
                return;
            }
            inbox.busy = true;
            (
                inbox.job.take(),
                std::mem::take(&mut inbox.modules),
                inbox.beam.take(),
                inbox.suit.take(),
            )
        };
        let changed = !modules.is_empty();
        for (stem, words) in modules {
            let result = gpu.replace_module(&stem, words);
            send(Event::Shader(
                result
                    .map(|count| format!("{stem}: built into {}", counted(count, "pipeline")))
                    .map_err(|error| error.to_string()),
            ));
        }
        if changed {
            panes.iter_mut().flatten().for_each(Pane::shaders_changed);
        }
        // The picture that it begins in is there already; one that is not is asked for again.
        if let Some(answer) = beam.and_then(|beam| panes.get(beam.pane)?.as_ref()?.beam(&beam)) {
            send(Event::Traced(Box::new(answer)));
            if job.is_none() && !changed && suit.is_none() {
                continue;
            }
        }
        if let Some(job) = job.or_else(|| last.take()) {
            panes
                .iter_mut()
                .skip(job.panes.len())
                .for_each(|pane| *pane = None);
            serve(shared, &gpu, &mut panes, &job, &send);
            last = Some(job);
        }
        // Of the scene that is shown now.
        if let Some(suit) = suit {
            send(Event::Suited(suit.answer(panes.iter().flatten().next())));
        }
    }
}

/// The device of the window, once there is one; `None` where the thread is to end.
fn wait_for_device(shared: &Shared) -> Option<Arc<Device>> {
    let inbox = shared.inbox();
    let waits = |inbox: &mut Inbox| !inbox.quit && inbox.device.is_none();
    let waited = shared.wake.wait_while(inbox, waits);
    waited.unwrap_or_else(PoisonError::into_inner).device.take()
}

/// Renders all sides: each first as large as is quick, then, at rest, in full. Ends early where
/// something newer is wanted.
fn serve<'g>(
    shared: &Shared,
    gpu: &'g Gpu,
    panes: &mut [Option<Pane<'g>>; 2],
    job: &Job,
    send: &dyn Fn(Event),
) {
    let is_superseded = || {
        let inbox = shared.inbox();
        inbox.quit || inbox.job.is_some()
    };
    // Where frames follow each other for their times, quick ones between them would only flicker.
    let passes: &[bool] = if job.continuous && job.rest {
        &[true]
    } else {
        &[false, true]
    };
    for &is_full in passes {
        for index in 0..job.panes.len().min(panes.len()) {
            if is_superseded() {
                return;
            }
            let slot = &mut panes[index];
            let started = Instant::now();
            let rendered = Pane::follow(slot, gpu, job, index).and_then(|()| match slot {
                Some(pane) => pane.render(gpu, job, index, is_full),
                None => Ok(None),
            });
            let sent = rendered.map(|picture| {
                if let Some(mut picture) = picture {
                    picture.wall_ms = started.elapsed().as_secs_f64() * 1e3;
                    send(Event::Picture(Box::new(picture)));
                }
            });
            let reads = is_full && job.rest && (!job.continuous || shared.inbox().reads);
            let read = sent.and_then(|()| match slot {
                Some(pane) if reads => pane.numbers(gpu, job),
                _ => Ok(None),
            });
            let of = (index, job.id);
            match read {
                Ok(Some(image)) => send(Event::Numbers { of, image }),
                Ok(None) => {}
                Err(error) => {
                    *slot = None;
                    if is_full || !job.rest {
                        send(Event::Failed {
                            pane: index,
                            problem: error.to_string(),
                        });
                    }
                }
            }
        }
        if !job.rest {
            return;
        }
    }
}
