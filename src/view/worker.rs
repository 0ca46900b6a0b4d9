//! The thread that renders, so that the window answers while a frame takes seconds.
//!
//! It has a device of its own: neither its queue nor its waits are shared with the window's. It
//! works on one job at a time, the newest, and sends results back as events. A picture at rest has
//! the full size, and is made from the same state as a picture of `lumivox render`.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::beam::{BeamAnswer, BeamJob};
use super::pane::Pane;
use super::picture::Components;
use super::suit::{SuitAnswer, SuitJob};
use crate::gi::Settings;
use crate::gi::entry::Entry;
use crate::graph::{FrameStats, Gpu, GpuOptions, Messages};
use crate::image::Image;
use crate::render::ShadowSettings;
use crate::scene::{Camera, Environment, Light, Scene};
use crate::text::counted;

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
    pub(super) components: Components,
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
    /// The view's numbers; `None` where technique or scene have no such picture.
    pub(super) image: Option<Image>,
    /// Position in [`super::views::VIEWS`].
    pub(super) view: usize,
    /// Whether it has the size that was asked for.
    pub(super) is_full: bool,
    /// What the frame cost on the device.
    pub(super) stats: FrameStats,
    /// What the last build cost, where this frame was the first after it.
    pub(super) build: Option<FrameStats>,
    /// The frame with its reading back (ms).
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

/// What the worker says.
pub(super) enum Event {
    /// The device is open: its name.
    Opened(String),
    /// A side's picture is finished.
    Picture(Box<Picture>),
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
    job: Option<Job>,
    modules: Vec<(String, Vec<u32>)>,
    beam: Option<BeamJob>,
    suit: Option<SuitJob>,
    quit: bool,
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
    messages: Mutex<Option<Messages>>,
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

    /// Ends the thread and answers the validation messages of its device, its end included.
    pub(super) fn finish(mut self) -> Vec<String> {
        self.stop();
        let messages = self
            .shared
            .messages
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        messages.as_ref().map(Messages::list).unwrap_or_default()
    }

    fn stop(&mut self) {
        self.shared.inbox().quit = true;
        self.shared.wake.notify_one();
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            log::error!("the render thread panicked");
        }
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
    let gpu = match Gpu::new(options) {
        Ok(gpu) => gpu,
        Err(error) => return send(Event::NoDevice(error.to_string())),
    };
    *shared
        .messages
        .lock()
        .unwrap_or_else(PoisonError::into_inner) = Some(gpu.messages());
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
            match rendered {
                Ok(Some(mut picture)) => {
                    picture.wall_ms = started.elapsed().as_secs_f64() * 1e3;
                    send(Event::Picture(Box::new(picture)));
                }
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
