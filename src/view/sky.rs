//! Skies that are worked out beside the window: one takes a third of a second.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use crate::scene::{ClearSky, Sky};

/// Where a sky is made from.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Whole {
    /// A model.
    Clear(ClearSky),
    /// A map with its sun.
    Map(Arc<Sky>),
}

/// A sky that is asked for.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct WantedSky {
    /// The sky with its sun.
    pub(super) whole: Whole,
    /// Whether the sun is taken out of it.
    pub(super) splits: bool,
}

impl WantedSky {
    /// Works it out; `None` where the model has no such sky.
    fn make(&self) -> Option<Sky> {
        let whole = match &self.whole {
            Whole::Clear(clear) => Sky::clear(*clear).ok()?,
            Whole::Map(sky) => sky.whole(),
        };
        let split = if self.splits { whole.split_sun() } else { None };
        Some(split.unwrap_or(whole))
    }
}

/// What was asked for, and the sky.
pub(super) type MadeSky = (WantedSky, Option<Sky>);

/// The thread, seen from the window.
pub(super) struct SkyWorker {
    wanted: Option<Sender<WantedSky>>,
    made: Arc<Mutex<Option<MadeSky>>>,
    thread: Option<JoinHandle<()>>,
}

impl SkyWorker {
    /// Starts the thread; `notify` is called after each sky, on that thread.
    pub(super) fn start(notify: Box<dyn Fn() + Send>) -> std::io::Result<Self> {
        let (wanted, receiver) = channel();
        let made = Arc::new(Mutex::new(None));
        let tell = Arc::clone(&made);
        let thread = std::thread::Builder::new()
            .name("sky".to_owned())
            .spawn(move || {
                while let Some(wanted) = newest(&receiver) {
                    let sky = wanted.make();
                    *tell.lock().unwrap_or_else(PoisonError::into_inner) = Some((wanted, sky));
                    notify();
                }
            })?;
        Ok(SkyWorker {
            wanted: Some(wanted),
            made,
            thread: Some(thread),
        })
    }

    /// Asks for this sky instead of those that have not been begun.
    pub(super) fn ask(&self, wanted: WantedSky) {
        if let Some(sender) = &self.wanted {
            // A thread that panicked is told of when the window closes.
            let _ = sender.send(wanted);
        }
    }

    /// What is new since the last call.
    pub(super) fn take(&self) -> Option<MadeSky> {
        self.made
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take()
    }
}

impl Drop for SkyWorker {
    fn drop(&mut self) {
        self.wanted = None;
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            log::error!("the sky's thread panicked");
        }
    }
}

/// Waits for something to be asked for; `None` at the end.
fn newest(receiver: &Receiver<WantedSky>) -> Option<WantedSky> {
    let first = receiver.recv().ok()?;
    Some(receiver.try_iter().last().unwrap_or(first))
}
