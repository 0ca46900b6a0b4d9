//! Submissions: what goes with the next one, what runs, and what it has cost.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

use ash::vk;

use super::frame::{Frame, Step};
use super::journal::JournalFrame;
use super::pace::{Pace, Part, WHOLE};
use super::plan::{Barrier, State, plan};
use super::record::{Pipelines, Recorder};
use super::sets::SharedSets;
use super::stats::{FrameStats, HostWork};
use crate::vulkan::{Commands, DescriptorPool, Device, Error, Handover, HostCommands, Timestamps};

/// How many frames may run while the next one is recorded.
pub const FRAMES_IN_FLIGHT: usize = 2;

/// Runs one frame after the other, in the order in which they are given.
pub(super) struct Runner {
    device: Arc<Device>,
    shared: Arc<SharedSets>,
    trace: bool,
    pub(super) pace: Pace,
    #[cfg(feature = "tracy")]
    zones: super::tracy::Zones,
    /// Those in which nothing runs.
    slots: Vec<Slot>,
    /// Oldest first.
    running: VecDeque<Running>,
    /// What frames have cost that nobody waited for.
    finished: Vec<FrameStats>,
    pub(super) pipelines: Pipelines,
    pub(super) state: State,
    pub(super) journal: Option<Vec<JournalFrame>>,
    pub(super) waiting: Waiting,
    pub(super) host: HostWork,
}

/// What one frame is recorded into.
struct Slot {
    /// For each submission; as many as a frame had at most.
    commands: Vec<Commands>,
    timestamps: Timestamps,
}

/// A frame that was submitted, at least in part.
#[derive(Default)]
struct Submitted {
    /// How many submissions it is.
    parts: usize,
    /// How many of the first have been waited for.
    waited: usize,
    /// Until they are done.
    pools: Vec<DescriptorPool>,
    /// Steps that all or a share was submitted of.
    steps: usize,
    /// What steps took by the host's clock (ms), where each was waited for.
    host_ms: Vec<f64>,
}

/// A frame that has not been waited for.
struct Running {
    slot: Slot,
    frame: Frame,
    submitted: Submitted,
}

/// What commands use that another program runs. It has to live until they are done.
#[must_use = "what the commands use goes with it"]
pub struct Recorded {
    _frame: Frame,
    _pool: DescriptorPool,
}

/// What goes with the next submission.
#[derive(Default)]
pub(super) struct Waiting {
    /// Uploads, and passes whose results the host does not ask for, in their order.
    pub(super) steps: Vec<Step>,
    /// Bytes that are uploaded.
    pub(super) bytes: u64,
    /// What was submitted early, and that nobody has been told about.
    pub(super) stats: FrameStats,
}

impl Runner {
    /// Of a device; `trace`: whether barriers are printed.
    pub(super) fn new(
        device: &Arc<Device>,
        shared: &Arc<SharedSets>,
        trace: bool,
        pace: Pace,
    ) -> Result<Self, Error> {
        let slot = || {
            Ok(Slot {
                commands: vec![Commands::new(device)?],
                timestamps: Timestamps::new(device, 128)?,
            })
        };
        Ok(Runner {
            device: Arc::clone(device),
            shared: Arc::clone(shared),
            trace,
            pace,
            #[cfg(feature = "tracy")]
            zones: super::tracy::Zones::new(
                &device.adapter().info.name,
                device.adapter().limits.timestamp_period_ns,
            ),
            slots: (0..FRAMES_IN_FLIGHT)
                .map(|_| slot())
                .collect::<Result<_, Error>>()?,
            running: VecDeque::new(),
            finished: Vec::new(),
            pipelines: Pipelines::default(),
            state: State::default(),
            journal: None,
            waiting: Waiting::default(),
            host: HostWork::default(),
        })
    }

    /// Runs a frame after what waits for it, but without the barriers that `keep` turns down, and
    /// waits for it.
    pub(super) fn run(
        &mut self,
        frame: Frame,
        keep: impl Fn(&Barrier) -> bool,
    ) -> Result<FrameStats, Error> {
        let mut stats = std::mem::take(&mut self.waiting.stats);
        match self.begin(frame, keep)? {
            Some(own) => stats.append(own),
            None => {
                self.wait()?;
                stats.append(self.finished.pop().unwrap_or_default());
            }
        }
        Ok(stats)
    }

    /// The same without waiting for it.
    pub(super) fn run_ahead(&mut self, frame: Frame) -> Result<(), Error> {
        let stats = std::mem::take(&mut self.waiting.stats);
        self.finished
            .extend((stats != FrameStats::default()).then_some(stats));
        let done = self.begin(frame, |_| true)?;
        self.finished.extend(done);
        Ok(())
    }

    /// Records a frame, after what waits, into a command buffer of another program, which is to run
    /// after all that was submitted so far and before all that is submitted from now on.
    pub(super) fn record_for_host(
        &mut self,
        mut frame: Frame,
        commands: &HostCommands,
        handed: &[Handover],
    ) -> Result<Recorded, Error> {
        let Waiting {
            steps,
            bytes,
            stats,
        } = std::mem::take(&mut self.waiting);
        let count = steps.len();
        frame.steps.splice(0..0, steps);
        match self.record_into(&frame, commands, handed) {
            Ok(pool) => {
                self.finished
                    .extend((stats != FrameStats::default()).then_some(stats));
                Ok(Recorded {
                    _frame: frame,
                    _pool: pool,
                })
            }
            Err(error) => {
                self.waiting = Waiting {
                    steps: frame.steps.drain(..count).collect(),
                    bytes,
                    stats,
                };
                Err(error)
            }
        }
    }

    fn record_into(
        &mut self,
        frame: &Frame,
        HostCommands(commands): &HostCommands,
        handed: &[Handover],
    ) -> Result<DescriptorPool, Error> {
        for id in self.device.take_retired() {
            self.state.forget(id);
        }
        self.pipelines.make(&self.device, &self.shared, frame)?;
        let written = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        let mut before = self.state.clone();
        for Handover { image, .. } in handed {
            before.enter(image.id(), written);
        }
        let (barriers, mut after) = plan(&frame.uses(), &before);
        for Handover { image, before, .. } in handed {
            commands.hand_over(image, [*before, written]);
        }
        let mut recorder = Recorder {
            device: &self.device,
            shared: &self.shared,
            commands,
            timestamps: None,
            pipelines: &mut self.pipelines,
            notes: None,
            trace: self.trace,
        };
        let pool = recorder.record(frame, &barriers, &Part::of(0..frame.steps.len()))?;
        for Handover {
            image,
            after: layout,
            ..
        } in handed
        {
            commands.hand_over(image, [after.layout(image.id()), *layout]);
            after.forget(image.id());
        }
        self.state = after;
        Ok(pool)
    }

    /// Vulkan objects that came with frames of many submissions, and stay.
    pub(super) fn object_count(&self) -> usize {
        let more = self.slots.iter().map(|slot| slot.commands.len() - 1);
        more.sum::<usize>() + self.pipelines.object_count()
    }

    /// Waits for all frames that run, and tells what each has cost that nobody waited for before.
    pub(super) fn finish(&mut self) -> Result<Vec<FrameStats>, Error> {
        self.wait()?;
        Ok(std::mem::take(&mut self.finished))
    }

    /// Waits for all frames that run.
    pub(super) fn wait(&mut self) -> Result<(), Error> {
        while !self.running.is_empty() {
            self.wait_for_oldest()?;
        }
        Ok(())
    }

    /// Plans, records and submits a frame after what waits for it; its cost, where it has been
    /// waited for.
    fn begin(
        &mut self,
        mut frame: Frame,
        keep: impl Fn(&Barrier) -> bool,
    ) -> Result<Option<FrameStats>, Error> {
        let Waiting { steps, bytes, .. } = std::mem::take(&mut self.waiting);
        let count = steps.len();
        frame.steps.splice(0..0, steps);
        let mut submitted = Submitted::default();
        let begun = self.start(&mut frame, keep, &mut submitted);
        // What waited may not have run, where there still is a device.
        if matches!(&begun, Err(error) if !matches!(error, Error::DeviceLost { .. })) {
            let left = submitted.steps.min(count)..count.min(frame.steps.len());
            self.waiting.steps = frame.steps.drain(left).collect();
            self.waiting.bytes = bytes;
        }
        begun
    }

    fn start(
        &mut self,
        frame: &mut Frame,
        keep: impl Fn(&Barrier) -> bool,
        submitted: &mut Submitted,
    ) -> Result<Option<FrameStats>, Error> {
        for id in self.device.take_retired() {
            self.state.forget(id);
        }
        let (mut barriers, state) = plan(&frame.uses(), &self.state);
        barriers
            .iter_mut()
            .for_each(|barriers| barriers.retain(&keep));
        if let Some(journal) = &mut self.journal {
            let names = frame.names();
            journal.push(JournalFrame {
                names: names.into_iter().map(str::to_owned).collect(),
                uses: frame.uses(),
                issued: Vec::new(),
            });
        }
        self.pipelines.make(&self.device, &self.shared, frame)?;
        let mut slot = self.take_slot(frame)?;
        let result = self.submit(&mut slot, frame, &barriers, submitted);
        if let Err(error) = result {
            // What was submitted uses what goes now, and has done what it did.
            if self.wait_for_parts(&slot, submitted).is_ok() {
                self.state = plan(&frame.uses()[..submitted.steps], &self.state).1;
            }
            self.slots.push(slot);
            return Err(error);
        }
        self.state = state;
        if self.pace.isolates() {
            #[cfg(feature = "tracy")]
            self.zones
                .add(&frame.steps, &slot.timestamps.read(ticks_of(frame)));
            self.slots.push(slot);
            let mut stats = FrameStats::default();
            tell(&mut stats, &frame.steps, &submitted.host_ms);
            return Ok(Some(stats));
        }
        self.running.push_back(Running {
            slot,
            frame: std::mem::take(frame),
            submitted: std::mem::take(submitted),
        });
        Ok(None)
    }

    /// Records and submits a frame, part by part.
    fn submit(
        &mut self,
        slot: &mut Slot,
        frame: &Frame,
        barriers: &[Vec<Barrier>],
        submitted: &mut Submitted,
    ) -> Result<(), Error> {
        let isolates = self.pace.isolates();
        submitted.host_ms = vec![0.0; if isolates { frame.steps.len() } else { 0 }];
        let (mut done, mut share) = (0, 0);
        // A frame without steps is still one, empty, submission.
        while done < frame.steps.len() || submitted.parts == 0 {
            let pipelines = &self.pipelines;
            let mut part = (self.pace).next(frame, (done, share), |step| pipelines.can_cut(step));
            let loss = self.device.planted_loss();
            if let Some(steps) = loss {
                part.steps.end = part.steps.end.min(done + steps);
            }
            self.host.submissions += u64::from(!isolates || submitted.parts == 0);
            let began = self.submit_part(slot, frame, barriers, (&part, submitted))?;
            if part.is_tried || isolates || loss.is_some() {
                let waited = self.wait_for_parts(slot, submitted);
                let ms = 1e3 * began.elapsed().as_secs_f64();
                waited
                    .and(loss.map_or(Ok(()), |_| Err(vk::Result::ERROR_DEVICE_LOST)))
                    .map_err(|result| lost_in(slot, frame, result))?;
                self.took(frame, &part, ms, &mut submitted.host_ms);
            }
            (done, share) = (part.done(), if part.ends() { 0 } else { part.share[1] });
        }
        Ok(())
    }

    /// A part of one step took so long by the host's clock, and its step what is summed up.
    fn took(&mut self, frame: &Frame, part: &Part, ms: f64, host_ms: &mut [f64]) {
        let at = part.steps.start;
        if part.is_tried {
            self.pace.learn(&frame.steps[at], part.share, ms);
        }
        let Some(sum) = host_ms.get_mut(at) else {
            return;
        };
        *sum += ms;
        if part.ends() {
            self.pace.learn(&frame.steps[at], [0, WHOLE], *sum);
        }
    }

    /// Records and submits a part; when it was submitted.
    fn submit_part(
        &mut self,
        slot: &mut Slot,
        frame: &Frame,
        barriers: &[Vec<Barrier>],
        (part, submitted): (&Part, &mut Submitted),
    ) -> Result<Instant, Error> {
        if slot.commands.len() == submitted.parts {
            slot.commands.push(Commands::new(&self.device)?);
        }
        let commands = &slot.commands[submitted.parts];
        commands.begin()?;
        let journal = self.journal.as_mut();
        let mut recorder = Recorder {
            device: &self.device,
            shared: &self.shared,
            commands,
            timestamps: Some(&slot.timestamps),
            pipelines: &mut self.pipelines,
            notes: journal
                .and_then(|journal| journal.last_mut())
                .map(|frame| &mut frame.issued),
            trace: self.trace,
        };
        submitted
            .pools
            .push(recorder.record(frame, barriers, part)?);
        let began = commands
            .submit(self.pace.isolates() || part.is_tried)
            .map_err(|result| failure(frame, &[], result))?;
        (submitted.parts, submitted.steps) = (submitted.parts + 1, part.steps.end);
        Ok(began)
    }

    /// Waits for what was submitted of a frame.
    fn wait_for_parts(&mut self, slot: &Slot, submitted: &mut Submitted) -> Result<(), vk::Result> {
        while submitted.waited < submitted.parts {
            self.host.waits += 1;
            submitted.waited += 1;
            slot.commands[submitted.waited - 1].wait()?;
        }
        Ok(())
    }

    /// A slot with as many timestamps as a frame has; waits for the oldest frame where there is
    /// none.
    fn take_slot(&mut self, frame: &Frame) -> Result<Slot, Error> {
        if self.slots.is_empty() {
            self.wait_for_oldest()?;
        }
        let count = ticks_of(frame);
        let last = self.slots.last_mut();
        if let Some(slot) = last.filter(|slot| slot.timestamps.count() < count) {
            slot.timestamps = Timestamps::new(&self.device, count.next_power_of_two())?;
        }
        let slot = self.slots.pop();
        let slot = slot.unwrap_or_else(|| unreachable!("a frame that is done gives its slot back"));
        slot.timestamps.reset();
        Ok(slot)
    }

    fn wait_for_oldest(&mut self) -> Result<(), Error> {
        let Some(running) = self.running.pop_front() else {
            return Ok(());
        };
        let Running {
            slot,
            frame,
            mut submitted,
        } = running;
        let done = self.wait_for_parts(&slot, &mut submitted);
        let ticks = slot.timestamps.read(ticks_of(&frame));
        self.slots.push(slot);
        done.map_err(|result| failure(&frame, &ticks, result))?;
        #[cfg(feature = "tracy")]
        self.zones.add(&frame.steps, &ticks);
        let mut stats = FrameStats::default();
        let ms = self.pass_ms(&ticks);
        for (step, ms) in frame.steps.iter().zip(&ms) {
            self.pace.learn(step, [0, WHOLE], *ms);
        }
        tell(&mut stats, &frame.steps, &ms);
        self.finished.push(stats);
        Ok(())
    }

    /// Milliseconds between the two timestamps of each step.
    fn pass_ms(&self, ticks: &[Option<u64>]) -> Vec<f64> {
        let limits = &self.device.adapter().limits;
        let ms_per_tick = f64::from(limits.timestamp_period_ns) * 1e-6;
        let elapsed = |pair: &[Option<u64>]| match pair {
            [Some(start), Some(end)] => elapsed_ticks(*start, *end, limits.timestamp_bits),
            _ => 0,
        };
        let ticks = ticks.chunks_exact(2).map(elapsed);
        ticks.map(|ticks| ticks as f64 * ms_per_tick).collect()
    }
}

impl Drop for Runner {
    fn drop(&mut self) {
        // What runs is used until it is done; on a lost device nothing runs.
        if let Err(error) = self.wait() {
            log::debug!("the last frames: {error}");
            for mut running in std::mem::take(&mut self.running) {
                let _ = self.wait_for_parts(&running.slot, &mut running.submitted);
            }
        }
    }
}

/// Ticks between two timestamps of so many bits, which begin anew at 0 when all are set.
fn elapsed_ticks(start: u64, end: u64, bits: u32) -> u64 {
    let unused = 64 - bits.clamp(1, 64);
    end.wrapping_sub(start) << unused >> unused
}

fn ticks_of(frame: &Frame) -> u32 {
    u32::try_from(2 * frame.steps.len()).unwrap_or(u32::MAX)
}

/// Adds what steps took (ms), of those that are told.
fn tell(stats: &mut FrameStats, steps: &[Step], ms: &[f64]) {
    let timed = steps.iter().zip(ms).filter(|(step, _)| step.is_told);
    timed.for_each(|(step, ms)| stats.add(&step.name, *ms));
}

/// [`failure`] of a frame that its slot has run.
fn lost_in(slot: &Slot, frame: &Frame, result: vk::Result) -> Error {
    failure(frame, &slot.timestamps.read(ticks_of(frame)), result)
}

/// Says which pass was the last to finish.
fn failure(frame: &Frame, ticks: &[Option<u64>], result: vk::Result) -> Error {
    if result != vk::Result::ERROR_DEVICE_LOST {
        return Error::Vulkan {
            what: "running a frame".to_owned(),
            result,
        };
    }
    let finished = frame
        .steps
        .iter()
        .zip(ticks.chunks_exact(2))
        .take_while(|(_, pair)| pair.iter().all(Option::is_some))
        .last();
    Error::DeviceLost {
        last_pass: finished.map_or("none of this frame".to_owned(), |(step, _)| {
            step.name.clone()
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timestamps_begin_anew() {
        assert_eq!(elapsed_ticks(5, 12, 64), 7);
        assert_eq!(elapsed_ticks(u64::MAX - 1, 3, 64), 5);
        assert_eq!(elapsed_ticks((1 << 36) - 2, 1, 36), 3);
        // What the other bits hold is nothing.
        assert_eq!(elapsed_ticks(7 << 40 | 5, 2 << 40 | 12, 36), 7);
    }
}
