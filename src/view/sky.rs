//! Skies that are worked out beside the window: one takes a third of a second.

use std::sync::Arc;
use std::sync::mpsc::Receiver;

use super::beside::Beside;
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

/// The thread that makes skies.
pub(super) type SkyWorker = Beside<WantedSky, MadeSky>;

/// Makes the sky that was asked for last, as long as any is.
pub(super) fn work(wanted: &Receiver<WantedSky>, tell: &dyn Fn(MadeSky)) {
    while let Ok(first) = wanted.recv() {
        let newest = wanted.try_iter().last().unwrap_or(first);
        let sky = newest.make();
        tell((newest, sky));
    }
}
