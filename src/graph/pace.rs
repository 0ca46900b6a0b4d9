//! Where frames are cut into submissions. A driver's watchdog ends a submission that takes some
//! seconds, and other work of the queue waits until it is done.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::Range;

use super::builder::Run;
use super::frame::{Frame, Step, Work};

/// A submission takes no longer on a GPU, by what its passes took before (ms).
pub(super) const LONGEST_MS: f64 = 200.0;

/// What watchdogs grant: 2 s on Windows, more elsewhere (ms).
const WATCHDOG_MS: f64 = 2_000.0;

/// A dispatch of as many workgroups is tried with a few first, where nothing is known of it.
const MANY_GROUPS: u64 = 4_096;

/// A whole step, in shares.
pub(super) const WHOLE: u32 = 1 << 16;

/// A step is cut into no more shares: what a submission itself costs would be more than its work.
const LEAST: u32 = WHOLE / 256;

/// So much of a dispatch is tried first.
const TRIED: u32 = WHOLE / 16;

/// Some steps, or a share of a single one, which are one submission.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) steps: Range<usize>,
    /// Which part of its one step, in 1/[`WHOLE`]; all of it, or all steps: 0 to [`WHOLE`].
    pub(super) share: [u32; 2],
    /// Whether it is waited for, since the next one depends on what it takes.
    pub(super) is_tried: bool,
}

impl Part {
    pub(super) fn of(steps: Range<usize>) -> Self {
        Part {
            steps,
            share: [0, WHOLE],
            is_tried: false,
        }
    }

    /// Whether its first step begins in it.
    pub(super) fn begins(&self) -> bool {
        self.share[0] == 0
    }

    /// Whether its last step ends in it.
    pub(super) fn ends(&self) -> bool {
        self.share[1] == WHOLE
    }

    /// How many steps have been done after it, where those before it have.
    pub(super) fn done(&self) -> usize {
        self.steps.end - usize::from(!self.ends())
    }
}

/// Which of `count` things are a share of them.
pub(super) fn shared_out(count: u32, [from, to]: [u32; 2]) -> Range<u32> {
    let at = |share: u32| (u64::from(count) * u64::from(share) / u64::from(WHOLE)) as u32;
    at(from)..at(to)
}

/// What steps have taken, and how long submissions may be.
pub(super) struct Pace {
    /// `None`: as long as they are.
    longest_ms: Option<f64>,
    /// Whether each step is a submission of its own.
    isolate: bool,
    /// Milliseconds of a workgroup, or of a step that has none, by the step's name and by the
    /// logarithm of its workgroups: a few take longer each, and passes run in many sizes.
    known: HashMap<String, BTreeMap<u32, f64>>,
    /// Steps that somebody has been warned of.
    named: HashSet<String>,
}

impl Pace {
    pub(super) fn new(longest_ms: Option<f64>, isolate: bool) -> Self {
        Pace {
            longest_ms,
            isolate,
            known: HashMap::new(),
            named: HashSet::new(),
        }
    }

    /// Whether each step is a submission of its own, which is waited for and timed by the host.
    pub(super) fn isolates(&self) -> bool {
        self.isolate
    }

    /// What steps took is of other settings.
    pub(super) fn forget(&mut self) {
        self.known.clear();
    }

    /// A step, or a share of it, took so long.
    pub(super) fn learn(&mut self, step: &Step, share: [u32; 2], ms: f64) {
        if self.longest_ms.is_none() {
            return;
        }
        let whole = ms * f64::from(WHOLE) / f64::from((share[1] - share[0]).max(1));
        let count = groups(step).max(1);
        if !self.known.contains_key(&step.name) {
            self.known.insert(step.name.clone(), BTreeMap::new());
        }
        if let Some(sizes) = self.known.get_mut(&step.name) {
            sizes.insert(count.ilog2(), whole / count as f64);
        }
    }

    /// What a step will take (ms), where one of its name and about its size is known.
    fn expected_ms(&self, step: &Step) -> Option<f64> {
        let count = groups(step).max(1);
        let each = self.known.get(&step.name)?.get(&count.ilog2())?;
        Some(each * count as f64)
    }

    /// The submission after the first `done` steps of a frame and a share of the next; `can_cut`
    /// says which steps may be. Never empty before the end.
    pub(super) fn next(
        &mut self,
        frame: &Frame,
        (done, share): (usize, u32),
        can_cut: impl Fn(&Step) -> bool,
    ) -> Part {
        let steps = &frame.steps;
        let Some(longest_ms) = self.longest_ms else {
            let end = if self.isolate { done + 1 } else { steps.len() };
            return Part::of(done..end.min(steps.len()));
        };
        let mut sum_ms = 0.0;
        for (at, step) in steps.iter().enumerate().skip(done) {
            let from = if at == done { share } else { 0 };
            let step_ms = self.expected_ms(step);
            let may_be_long = match step_ms {
                None => groups(step) >= MANY_GROUPS,
                Some(ms) => ms > longest_ms,
            };
            if may_be_long && can_cut(step) {
                if at > done {
                    return Part::of(done..at);
                }
                let size = match step_ms {
                    None => TRIED,
                    Some(ms) => ((longest_ms / ms * f64::from(WHOLE)) as u32).max(LEAST),
                };
                return Part {
                    steps: at..at + 1,
                    share: [from, from.saturating_add(size).min(WHOLE)],
                    is_tried: step_ms.is_none(),
                };
            }
            if from > 0 {
                // The rest of what was tried, or of what was thought longer.
                let share = [from, WHOLE];
                return Part {
                    share,
                    ..Part::of(at..at + 1)
                };
            }
            let ms = step_ms.unwrap_or(0.0);
            self.name(step, ms);
            if at > done && (sum_ms + ms > longest_ms || self.isolate) {
                return Part::of(done..at);
            }
            sum_ms += ms;
        }
        Part::of(done..steps.len())
    }

    /// Warns of a step that cannot be cut and that a watchdog may end.
    fn name(&mut self, step: &Step, ms: f64) {
        if ms > WATCHDOG_MS && self.named.insert(step.name.clone()) {
            log::warn!(
                "the pass {} took {:.1} s and cannot be cut: a driver may take the device for \
                 hung (Windows after 2 s); a smaller picture, or settings with less work, take \
                 less",
                step.name,
                1e-3 * ms,
            );
        }
    }
}

/// Workgroups of a step; 0 where it has none, or the host does not know them.
fn groups(step: &Step) -> u64 {
    let Work::Pass(call) = &step.work else {
        return 0;
    };
    let (Run::Dispatch(batches) | Run::Chain(batches)) = &call.run else {
        return 0;
    };
    let of = |groups: [u32; 3]| groups.map(u64::from).iter().product::<u64>();
    batches.iter().map(|batch| of(batch.groups)).sum()
}

#[cfg(test)]
mod tests {
    use super::super::builder::{BatchDispatch, PassCall};
    use super::super::pass::{Pass, Sets, Shaders};
    use super::*;

    static PASS: Pass = Pass {
        name: "test.pass",
        shaders: Shaders::Compute("test/double.comp"),
        bindings: &[],
        constants: &[],
        params: None,
        sets: Sets::None,
    };

    /// One dispatch of so many workgroups.
    fn dispatch(groups: u32) -> Frame {
        let batch = BatchDispatch {
            groups: [groups, 1, 1],
            ..BatchDispatch::default()
        };
        let call = PassCall {
            pass: &PASS,
            resources: Vec::new(),
            constants: Vec::new(),
            scene_has: None,
            push: Vec::new(),
            scene: None,
            materials: None,
            run: Run::Dispatch(vec![batch]),
            condition: None,
        };
        let mut frame = Frame::new();
        frame.push_untold(PASS.name.to_owned(), Vec::new(), Work::Pass(Box::new(call)));
        frame
    }

    #[test]
    fn what_nothing_is_known_of_is_tried_where_it_is_large() {
        let mut pace = Pace::new(Some(100.0), false);
        let whole = Part::of(0..1);
        let small = dispatch(MANY_GROUPS as u32 - 1);
        assert_eq!(pace.next(&small, (0, 0), |_| true), whole);
        let large = dispatch(MANY_GROUPS as u32);
        let tried = pace.next(&large, (0, 0), |_| true);
        assert_eq!((tried.share, tried.is_tried), ([0, TRIED], true));
        assert_eq!(pace.next(&large, (0, 0), |_| false), whole);
        // A sixteenth in 1 ms: the rest fits. In 50 ms: two sixteenths do.
        for (ms, end) in [(1.0, WHOLE), (50.0, 3 * TRIED)] {
            pace.learn(&large.steps[0], tried.share, ms);
            let rest = pace.next(&large, (0, TRIED), |_| true);
            assert_eq!((rest.share, rest.is_tried), ([TRIED, end], false));
        }
    }

    /// One workgroup alone takes longer than its share of many.
    #[test]
    fn what_a_few_workgroups_take_tells_nothing_of_many() {
        let (few, many) = (dispatch(1), dispatch(4000));
        let mut pace = Pace::new(Some(100.0), false);
        pace.learn(&many.steps[0], [0, WHOLE], 400.0);
        pace.learn(&few.steps[0], [0, WHOLE], 0.1);
        let part = pace.next(&many, (0, 0), |_| true);
        assert_eq!(part.share, [0, WHOLE / 4]);
        // Of as many to a power of two.
        let part = pace.next(&dispatch(2000), (0, 0), |_| true);
        assert_eq!(part.share, [0, WHOLE]);
        let part = pace.next(&dispatch(3000), (0, 0), |_| true);
        assert_eq!(part.share, [0, WHOLE / 3]);
    }

    /// Steps without work; what each takes is told to the pace.
    fn frame(names: &[&str]) -> Frame {
        let mut frame = Frame::new();
        for name in names {
            frame.push_untold((*name).to_owned(), Vec::new(), Work::Nothing);
        }
        frame
    }

    /// The parts of a frame whose steps take so long.
    fn parts(pace: &mut Pace, frame: &Frame, can_cut: bool) -> Vec<(Range<usize>, [u32; 2])> {
        let mut parts = Vec::new();
        let (mut done, mut share) = (0, 0);
        while done < frame.steps.len() {
            let part = pace.next(frame, (done, share), |_| can_cut);
            done = part.done();
            share = if part.ends() { 0 } else { part.share[1] };
            parts.push((part.steps, part.share));
        }
        parts
    }

    fn taught(ms: &[(&'static str, f64)]) -> (Pace, Frame) {
        let names: Vec<&str> = ms.iter().map(|(name, _)| *name).collect();
        let frame = frame(&names);
        let mut pace = Pace::new(Some(100.0), false);
        for (step, (_, ms)) in frame.steps.iter().zip(ms) {
            pace.learn(step, [0, WHOLE], *ms);
        }
        (pace, frame)
    }

    #[test]
    fn a_frame_is_cut_before_it_is_too_long() {
        let all = [0, WHOLE];
        let (mut pace, frame) = taught(&[("a", 40.0), ("b", 50.0), ("c", 20.0), ("d", 90.0)]);
        let expected = vec![(0..2, all), (2..3, all), (3..4, all)];
        assert_eq!(parts(&mut pace, &frame, true), expected);
        pace.forget();
        assert_eq!(parts(&mut pace, &frame, true), [(0..4, all)]);
        let mut pace = Pace::new(None, false);
        pace.learn(&frame.steps[0], all, 1e9);
        assert_eq!(parts(&mut pace, &frame, true), [(0..4, all)]);
    }

    #[test]
    fn a_long_step_is_cut_into_shares_where_it_can_be() {
        let all = [0, WHOLE];
        let (mut pace, frame) = taught(&[("a", 40.0), ("long", 250.0), ("c", 20.0)]);
        let fits = WHOLE * 2 / 5;
        let expected = vec![
            (0..1, all),
            (1..2, [0, fits]),
            (1..2, [fits, 2 * fits]),
            (1..2, [2 * fits, WHOLE]),
            (2..3, all),
        ];
        assert_eq!(parts(&mut pace, &frame, true), expected);
        let whole = vec![(0..1, all), (1..2, all), (2..3, all)];
        assert_eq!(parts(&mut pace, &frame, false), whole);
    }

    #[test]
    fn a_share_tells_what_the_whole_takes() {
        let (mut pace, frame) = taught(&[("a", 1.0)]);
        pace.learn(&frame.steps[0], [0, WHOLE / 4], 100.0);
        let quarter = WHOLE / 4;
        let parts = parts(&mut pace, &frame, true);
        assert_eq!(parts.len(), 4);
        assert_eq!(parts[1], (0..1, [quarter, 2 * quarter]));
    }

    #[test]
    fn only_what_a_watchdog_may_end_is_named_and_once() {
        let (mut pace, frame) = taught(&[("short", 90.0), ("long", 2_500.0)]);
        for _ in 0..2 {
            parts(&mut pace, &frame, false);
            assert!(pace.named.iter().eq(["long"]), "{:?}", pace.named);
        }
        let (mut pace, frame) = taught(&[("long", 2_500.0)]);
        parts(&mut pace, &frame, true);
        assert!(pace.named.is_empty());
    }

    #[test]
    fn shares_are_all_without_gaps() {
        for count in [1, 2, 7, 4096, 70_000] {
            let cuts = [0, 1, 300, 30_000, 65_535, WHOLE];
            let ranges = cuts
                .windows(2)
                .map(|pair| shared_out(count, [pair[0], pair[1]]));
            let mut next = 0;
            for range in ranges {
                assert_eq!(range.start, next);
                next = range.end;
            }
            assert_eq!(next, count);
        }
    }
}
