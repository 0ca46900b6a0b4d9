//! What a frame cost, and the median over many.

use std::time::Instant;

use serde::{Deserialize, Serialize};

/// The time of one pass in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    /// Name of the pass.
    pub name: String,
    /// Time on the GPU, or of the host's own work, summed over all runs of the pass in the frame
    /// (ms).
    pub gpu_ms: f64,
    /// How often the pass ran in the frame.
    pub runs: u32,
}

/// What the host did beside recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct HostWork {
    /// Submissions, readbacks among them. Passes that are timed one by one count as one.
    pub submissions: u64,
    /// How often it waited for the device.
    pub waits: u64,
    /// Buffers and images, or parts of them, that bytes were brought to. They go with the next
    /// submission.
    pub uploads: u64,
    /// Constants, such as those of a frame, which come with its commands.
    pub writes: u64,
    /// Buffers and images, or parts of them, that were read back.
    pub readbacks: u64,
}

impl HostWork {
    /// What was done between an earlier state and this one.
    pub fn since(self, before: HostWork) -> HostWork {
        HostWork {
            submissions: self.submissions - before.submissions,
            waits: self.waits - before.waits,
            uploads: self.uploads - before.uploads,
            writes: self.writes - before.writes,
            readbacks: self.readbacks - before.readbacks,
        }
    }

    /// The larger of each.
    pub fn max(self, other: HostWork) -> HostWork {
        HostWork {
            submissions: self.submissions.max(other.submissions),
            waits: self.waits.max(other.waits),
            uploads: self.uploads.max(other.uploads),
            writes: self.writes.max(other.writes),
            readbacks: self.readbacks.max(other.readbacks),
        }
    }
}

/// What one frame cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameStats {
    /// The passes, in the order of their first run.
    pub passes: Vec<PassTime>,
    /// The passes of counting runs, and the same by the host, which are not among `passes`. They
    /// only find out how large a buffer has to be, or how work has to be split.
    pub counting: Vec<PassTime>,
    /// What the host did, where the whole of a frame, build or pose is told.
    pub host: HostWork,
}

impl FrameStats {
    /// Sum over all passes (ms).
    pub fn total_ms(&self) -> f64 {
        self.passes.iter().map(|pass| pass.gpu_ms).sum()
    }

    /// Time of one pass (ms); `None` if it did not run.
    pub fn pass_ms(&self, name: &str) -> Option<f64> {
        self.passes
            .iter()
            .find(|pass| pass.name == name)
            .map(|pass| pass.gpu_ms)
    }

    /// Adds what another submission cost; passes of one name are summed.
    pub fn append(&mut self, other: FrameStats) {
        sum(&mut self.passes, other.passes);
        sum(&mut self.counting, other.counting);
    }

    /// Work of the host that a frame waits for, from `began` until now, as a pass of its own.
    pub fn of_host(name: &str, began: Instant) -> Self {
        let mut stats = FrameStats::default();
        stats.add(name, 1e3 * began.elapsed().as_secs_f64());
        stats
    }

    /// The same cost as that of a counting run.
    pub fn into_counting(mut self) -> Self {
        sum(&mut self.counting, std::mem::take(&mut self.passes));
        self
    }

    pub(crate) fn add(&mut self, name: &str, gpu_ms: f64) {
        sum(
            &mut self.passes,
            vec![PassTime {
                name: name.to_owned(),
                gpu_ms,
                runs: 1,
            }],
        );
    }
}

fn sum(passes: &mut Vec<PassTime>, others: Vec<PassTime>) {
    for pass in others {
        match passes.iter_mut().find(|known| known.name == pass.name) {
            Some(known) => {
                known.gpu_ms += pass.gpu_ms;
                known.runs += pass.runs;
            }
            None => passes.push(pass),
        }
    }
}

/// Median, smallest and largest of several measurements (ms).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Median; the mean of the middle two for an even number.
    pub median: f64,
    /// Smallest measurement (ms).
    pub min: f64,
    /// Largest measurement (ms).
    pub max: f64,
    /// Number of measurements.
    pub n: usize,
}

impl Spread {
    /// The spread of these measurements (ms); `None` where there is none.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        let (low, high) = (sorted[(sorted.len() - 1) / 2], sorted[sorted.len() / 2]);
        Some(Spread {
            median: 0.5 * (low + high),
            min,
            max,
            n: sorted.len(),
        })
    }
}

/// One row of a report: a pass over many frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassTimes {
    /// Name of the pass.
    pub name: String,
    /// Time on the GPU (ms).
    pub gpu_ms: Spread,
}

impl PassTimes {
    /// Rows of passes that were measured once.
    pub fn once(passes: &[PassTime]) -> Vec<PassTimes> {
        let mut times = TimesAccumulator::default();
        times.add(passes);
        times.rows()
    }
}

/// Collects the pass times of many frames.
#[derive(Clone, Debug, Default)]
pub struct TimesAccumulator {
    passes: Vec<(String, Vec<f64>)>,
}

impl TimesAccumulator {
    /// Adds the passes of one frame.
    pub fn add(&mut self, passes: &[PassTime]) {
        for pass in passes {
            match self.passes.iter_mut().find(|(name, _)| *name == pass.name) {
                Some((_, values)) => values.push(pass.gpu_ms),
                None => self.passes.push((pass.name.clone(), vec![pass.gpu_ms])),
            }
        }
    }

    /// One row for each pass, in the order of their first run.
    pub fn rows(&self) -> Vec<PassTimes> {
        self.passes
            .iter()
            .filter_map(|(name, values)| {
                Some(PassTimes {
                    name: name.clone(),
                    gpu_ms: Spread::of(values)?,
                })
            })
            .collect()
    }
}
