//! What a frame does: which probes it traces, which it lights, and how often light is fed back.

use glam::Vec4;

use super::layout::Window;
use super::pool::Key;
use super::store::Store;
use crate::gi::probes::rays::Moved;
use crate::gi::shared::bounces::LightBounces;
use crate::graph::{Error, Gpu};

/// What a frame does: numbers of probes, one after the other in the list.
#[derive(Default)]
pub(super) struct Work {
    /// Of each level, those that keep what they see, but where something has moved.
    pub(super) kept: Vec<u32>,
    /// Of each level, those that are placed, traced and lit for the first time.
    pub(super) new: Vec<u32>,
    /// Those that are lit again.
    pub(super) again: u32,
    /// The box in which models have moved since the last frame (m).
    pub(super) moved: Option<Moved>,
    /// How often light is fed back.
    pub(super) rounds: u32,
}

impl Work {
    /// Whether it changes the light of a probe.
    pub(super) fn lights(&self) -> bool {
        self.again > 0 || self.new.iter().any(|count| *count > 0)
    }
}

/// How much a frame does.
pub(super) struct Pace {
    /// Probes that a frame traces or lights; 0: all.
    pub(super) per_frame: u32,
    pub(super) bounces: LightBounces,
    /// Light has its bounces where it is taken from.
    pub(super) is_cast: bool,
}

impl Pace {
    /// Decides what the next frame does, and lists the probes of it. `has_moved`: probes have come
    /// or gone.
    pub(super) fn advance(
        &self,
        gpu: &Gpu,
        (store, windows): (&mut Store, &[Window]),
        (moved, has_moved): (Option<Moved>, bool),
    ) -> Result<Work, Error> {
        let levels = windows.len() as u32;
        let kept: Vec<(Key, u32)> = match moved {
            Some(_) => store.pool.lit().collect(),
            None => Vec::new(),
        };
        let most = if store.is_dark { 0 } else { self.per_frame };
        let turn = store.pool.advance(most);
        let placed = || kept.iter().chain(&turn.new);
        let all = placed().chain(&turn.again);
        let rows: Vec<[u32; 2]> = all.map(|(key, slot)| [*slot, key.seed()]).collect();
        store.list.put(gpu, &rows)?;
        let home = |(key, _): &(Key, u32)| windows[key.level(levels) as usize].home(key.at());
        let homes: Vec<Vec4> = placed().map(home).collect();
        gpu.upload_buffer(&store.homes, bytemuck::cast_slice(&homes))?;
        if !turn.new.is_empty() || has_moved {
            store.publish(gpu, windows)?;
        }
        let rounds = match self.bounces {
            _ if self.is_cast => 0,
            LightBounces::Count(count) => count - 1,
            LightBounces::Feedback if store.is_dark => self.bounces.frames_to_rest() - 1,
            LightBounces::Feedback => 1,
        };
        store.is_dark = false;
        Ok(Work {
            kept: by_level(&kept, levels),
            new: by_level(&turn.new, levels),
            again: turn.again.len() as u32,
            moved,
            rounds,
        })
    }
}

/// How many of these each level has, coarsest first.
fn by_level(probes: &[(Key, u32)], levels: u32) -> Vec<u32> {
    let mut counts = vec![0; levels as usize];
    for (key, _) in probes {
        counts[(levels - 1 - key.level(levels)) as usize] += 1;
    }
    counts
}
