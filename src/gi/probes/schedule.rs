//! Which probes a frame lights.

use super::list::{Listed, ProbeList};
use crate::gi::Settings;
use crate::gi::settings::{Domain, Setting, SettingError};
use crate::gi::shared::bounces::LightBounces;
use crate::graph::{Error, Gpu};

/// Probes of a frame.
pub(super) const PROBES_PER_FRAME: Setting = Setting {
    name: "probes_per_frame",
    help: "probes that a frame lights anew, in turn; 0: all of them",
    unit: "probes",
    domain: Domain::Count {
        min: 0,
        max: 1 << 18,
    },
    default: "0",
};

/// How long probes remember.
pub(super) const HYSTERESIS: Setting = Setting {
    name: "hysteresis",
    help: "share of its light that a probe keeps from what it had before, each time that it is lit",
    unit: "",
    domain: Domain::Number {
        min: 0.0,
        max: 0.99,
    },
    default: "0",
};

/// When rays of probes are traced.
pub(super) const TRACE: Setting = Setting {
    name: "trace",
    help: "when rays of probes are traced: once, and again where models have moved; or each-frame, \
           turned anew where hysteresis averages them",
    unit: "",
    domain: Domain::Choice(&["once", "each-frame"]),
    default: "once",
};

/// Bounces for which there is room where they are fed back: after the second, one and the other in
/// turn.
const FEEDBACK_BOUNCES: u32 = 3;

/// Which probes a frame lights, and how much they keep.
pub struct Schedule {
    /// Probes that a frame lights; 0: all.
    per_frame: u32,
    /// Whether rays are traced in each frame.
    pub traces: bool,
    hysteresis: f32,
    /// Those of this frame, where they are not all as they are.
    list: Option<ProbeList>,
    count: u32,
    /// The first that has not had its turn yet.
    next: u32,
    /// The frame, the first of which lights all.
    frame: u32,
}

impl Schedule {
    /// As the settings say.
    pub(super) fn new(settings: &Settings) -> Self {
        Schedule {
            per_frame: settings.count("probes_per_frame"),
            traces: settings.is("trace", "each-frame"),
            hysteresis: settings.number("hysteresis"),
            list: None,
            count: 0,
            next: 0,
            frame: 0,
        }
    }

    /// Whether rays go another way in each frame.
    fn turns(&self) -> bool {
        self.traces && self.hysteresis > 0.0
    }

    /// Whether probes are lit one after the other, or remember: then each map is the next one's.
    pub fn is_gradual(&self) -> bool {
        self.per_frame > 0 || self.hysteresis > 0.0
    }

    /// So many probes are there, and none has light.
    pub fn restart(&mut self, gpu: &Gpu, count: u32) -> Result<(), Error> {
        let needs_list = self.per_frame > 0 || self.turns();
        self.list = (needs_list)
            .then(|| ProbeList::of_all(gpu, count))
            .transpose()?;
        self.count = count;
        self.next = 0;
        self.frame = 0;
        Ok(())
    }

    /// Goes on to the next frame. The first one lights all.
    pub fn advance(&mut self, gpu: &Gpu) -> Result<(), Error> {
        self.frame = self.frame.saturating_add(1);
        let Some(list) = &self.list else {
            return Ok(());
        };
        let (lit, first) = (self.lit(), self.next);
        let turn = if self.turns() { turn_of(self.frame) } else { 0 };
        let rows: Vec<[u32; 2]> = (0..lit)
            .map(|index| (first + index) % self.count.max(1))
            .map(|probe| [probe, probe ^ turn])
            .collect();
        self.next = (first + lit) % self.count.max(1);
        list.put(gpu, &rows)
    }

    fn is_first(&self) -> bool {
        self.frame <= 1
    }

    /// Number of probes that this frame lights.
    fn lit(&self) -> u32 {
        if self.per_frame == 0 || self.is_first() {
            self.count
        } else {
            self.per_frame.min(self.count)
        }
    }

    /// The probes that this frame lights, of `all`.
    pub fn probes<'l>(&'l self, all: Listed<'l>) -> Listed<'l> {
        let own = self.list.as_ref();
        own.map_or(all, |list| list.part(0, self.lit()))
    }

    /// The share of its light that a probe keeps.
    pub fn kept(&self) -> f32 {
        if self.is_first() {
            0.0
        } else {
            self.hysteresis
        }
    }

    /// The bounces that this frame adds to the first: from how many to how many, where the last
    /// frame had `lit`. Where maps are each the next one's, two stand for all; the first frame lets
    /// them come to rest.
    pub fn bounces(&self, bounces: LightBounces, lit: u32) -> Vec<[u32; 2]> {
        match bounces {
            LightBounces::Count(count) => (2..=count).map(|bounce| [bounce - 1, bounce]).collect(),
            LightBounces::Feedback if self.is_gradual() && self.is_first() => {
                let more = vec![[2, 2]; bounces.frames_to_rest() as usize - 2];
                [vec![[1, 2]], more].concat()
            }
            LightBounces::Feedback if self.is_gradual() => vec![[2, 2]],
            LightBounces::Feedback if lit > 0 => vec![[lit, lit + 1]],
            LightBounces::Feedback => Vec::new(),
        }
    }

    /// Bounces for which maps have room.
    pub fn room(&self, bounces: LightBounces) -> u32 {
        match bounces {
            LightBounces::Count(count) => count,
            LightBounces::Feedback if self.is_gradual() => 2,
            LightBounces::Feedback => FEEDBACK_BOUNCES,
        }
    }
}

/// Whether these settings are possible together.
pub(super) fn check(settings: &Settings) -> Result<(), SettingError> {
    let bounces = LightBounces::new(settings).count().unwrap_or(2);
    if bounces > 2 && Schedule::new(settings).is_gradual() {
        return Err(SettingError::Together(format!(
            "bounces={bounces}: with probes_per_frame or hysteresis a probe does not have the \
             light of every bounce at a time; give bounces=feedback, 1 or 2"
        )));
    }
    Ok(())
}

/// What is new in the seeds of a frame.
fn turn_of(frame: u32) -> u32 {
    frame.wrapping_mul(0x9e37_79b9)
}

/// Frames until a picture of what stands still is as it stays: hysteresis averages rays of so many
/// that the first frame's share is a hundredth.
pub(super) fn frames_to_rest(settings: &Settings) -> u32 {
    let bounces = LightBounces::new(settings);
    let schedule = Schedule::new(settings);
    let of_bounces = if schedule.is_gradual() {
        1
    } else {
        bounces.frames_to_rest()
    };
    let averaged = if schedule.turns() {
        (0.01f32.ln() / schedule.hysteresis.ln()).ceil() as u32
    } else {
        1
    };
    of_bounces.max(averaged)
}
