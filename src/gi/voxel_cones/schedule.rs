//! When models that have moved are voxelized: in that frame, or in every n-th (Kahl 2019, section
//! 6.3.2: `vox_freq`).

use crate::gi::Settings;
use crate::gi::settings::{Domain, Setting};

/// Its setting.
pub(super) static SETTINGS: &[Setting] = &[Setting {
    name: "voxelize_every",
    help: "models that move are voxelized in one of so many frames, and stand in the voxels where \
           they were until then; 1: in each",
    unit: "frames",
    domain: Domain::Count { min: 1, max: 64 },
    default: "1",
}];

/// Which frame is next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Schedule {
    every: u32,
    /// Frames since models were voxelized.
    age: u32,
    /// Models have moved since.
    is_stale: bool,
}

impl Schedule {
    /// From a technique's settings. Nothing has moved.
    pub(super) fn new(settings: &Settings) -> Self {
        Schedule::of(settings.count("voxelize_every"))
    }

    const fn of(every: u32) -> Self {
        Schedule {
            every,
            age: every,
            is_stale: false,
        }
    }

    /// Everything has been voxelized.
    pub(super) fn start(&mut self) {
        *self = Schedule::of(self.every);
    }

    /// Models have moved; whether they are to be voxelized at once.
    pub(super) fn moved(&mut self) -> bool {
        self.is_stale = self.every > 1;
        !self.is_stale
    }

    /// Whether they are to be voxelized in the frame that begins. Asked once a frame.
    pub(super) fn is_due(&mut self) -> bool {
        self.age = self.age.saturating_add(1);
        let is_due = self.is_stale && self.age >= self.every;
        if is_due {
            (self.age, self.is_stale) = (0, false);
        }
        is_due
    }
}

/// Frames after models have stood still until voxels are where they are.
pub(super) fn frames_behind(settings: &Settings) -> u32 {
    settings.count("voxelize_every") - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One of three frames of a model that moves, the first among them, and the last one's pose at
    /// most two frames after it stands.
    #[test]
    fn one_frame_of_so_many_is_due() {
        let mut schedule = Schedule::of(3);
        let due: Vec<bool> = (0..12)
            .map(|frame| {
                assert!(frame >= 8 || !schedule.moved());
                schedule.is_due()
            })
            .collect();
        let frames: Vec<usize> = (0..12).filter(|frame| due[*frame]).collect();
        assert_eq!(frames, [0, 3, 6, 9]);
    }

    #[test]
    fn by_default_a_move_is_followed_at_once() {
        let mut schedule = Schedule::of(1);
        for _ in 0..3 {
            assert!(schedule.moved() && !schedule.is_due());
        }
    }
}
