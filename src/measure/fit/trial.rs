//! Measuring the candidates of a search on a scene.

use std::time::Instant;

use super::bound::Figures;
use super::candidate::Candidate;
use super::cases::{candidate_of, neighbours};
use super::search::Trial;
use crate::graph::Spread;
use crate::measure::bench::Case;
use crate::measure::chart::{Cost, Point, Progress, Section, Sweep, SweepError, SweepRun};
use crate::measure::records::Records;

/// What a search is doing.
#[derive(Clone, Copy)]
pub enum TrialProgress<'p> {
    /// It measures a case.
    Measuring(&'p Case),
    /// It has measured a point, or found its record.
    Done(&'p Point),
}

/// A trial that measures cases as points of a sweep, with a record each; what has one is not
/// measured again.
pub struct SceneTrial<'t> {
    sweep: &'t Sweep<'t>,
    run: SweepRun<'t>,
    records: &'t mut Records<Point>,
    /// Whether geometry moves, so that a frame has a build.
    is_moving: bool,
    cases: Vec<Case>,
    points: Vec<Option<Point>>,
    /// Measurements that were made: seconds without those of the frames.
    overheads_s: Vec<f64>,
    seconds: f64,
    progress: &'t mut dyn FnMut(TrialProgress<'_>),
}

/// Bytes of what keeps nothing in the world: their logarithm is one.
const LEAST_BYTES: f64 = 1.0;

/// Seconds that a measurement takes beside its frames before one was made.
const OVERHEAD_S: f64 = 1.0;

impl<'t> SceneTrial<'t> {
    /// A trial of cases; the reference of `run` is prepared already. `is_moving` adds a build to
    /// the time of a frame.
    pub fn new(
        sweep: &'t Sweep<'t>,
        run: SweepRun<'t>,
        records: &'t mut Records<Point>,
        is_moving: bool,
        cases: Vec<Case>,
        progress: &'t mut dyn FnMut(TrialProgress<'_>),
    ) -> Self {
        SceneTrial {
            sweep,
            run,
            records,
            is_moving,
            points: vec![None; cases.len()],
            cases,
            overheads_s: Vec::new(),
            seconds: 0.0,
            progress,
        }
    }

    /// The candidates of the cases that it began with.
    pub fn candidates(&self) -> Vec<Candidate> {
        self.cases.iter().map(candidate_of).collect()
    }

    /// What was measured of a candidate, all rounds together.
    pub fn point(&self, candidate: usize) -> Option<&Point> {
        self.points[candidate].as_ref()
    }

    /// Seconds that measurements took; what had a record took none.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Name of the scene.
    pub fn scene_name(&self) -> &str {
        self.sweep.scene_name()
    }

    /// Whether a frame has a build.
    pub fn is_moving(&self) -> bool {
        self.is_moving
    }

    /// Rounds that a sweep measures every point in.
    pub fn sweep_rounds(&self) -> u32 {
        self.sweep.round_count()
    }

    /// Rounds that the best are measured in: one more than all points of a sweep have.
    pub fn rounds(&self) -> u32 {
        self.sweep.round_count() + 1
    }

    /// The time that counts (ms).
    pub fn time_of(&self, point: &Point) -> Option<Spread> {
        point.cost(if self.is_moving {
            Cost::Rebuild
        } else {
            Cost::Frame
        })
    }

    /// Puts the rounds of all points together, as if the machine had been as fast at each.
    fn settle(&mut self) {
        let measured: Vec<Case> = self.measured_cases();
        let points = Section::new(self.sweep.points(&measured, self.records), None).points;
        for point in points {
            let is_it = |case: &Case| self.sweep.key(case) == point.key;
            if let Some(index) = self.cases.iter().position(is_it) {
                self.points[index] = Some(point);
            }
        }
    }

    fn measured_cases(&self) -> Vec<Case> {
        let pairs = self.cases.iter().zip(&self.points);
        pairs
            .filter(|(_, point)| point.is_some())
            .map(|(case, _)| case.clone())
            .collect()
    }
}

impl Trial for SceneTrial<'_> {
    type Error = SweepError;

    fn measure(&mut self, candidate: usize, round: u32) -> Result<(), SweepError> {
        let case = &self.cases[candidate];
        let is_missing = self.sweep.is_missing(case, round, self.records);
        if is_missing {
            (self.progress)(TrialProgress::Measuring(case));
        }
        let start = Instant::now();
        self.run
            .measure(case, round, self.records, &mut |_: Progress<'_>| {})?;
        let elapsed_s = start.elapsed().as_secs_f64();
        let rounds = self.sweep.points(std::slice::from_ref(case), self.records);
        let Some(point) = rounds.last() else {
            return Ok(());
        };
        if is_missing {
            self.seconds += elapsed_s;
            let frame_ms = point.median_ms("frame").unwrap_or(0.0);
            let in_frames_s = 1e-3 * frame_ms * self.sweep.frames_of(case);
            self.overheads_s.push((elapsed_s - in_frames_s).max(0.0));
        }
        (self.progress)(TrialProgress::Done(point));
        self.points[candidate] = Some(point.clone());
        self.settle();
        Ok(())
    }

    fn figures(&self, candidate: usize) -> Option<Figures> {
        let point = self.points[candidate].as_ref()?;
        let error = point.error.filter(|_| point.failure.is_none())?.rel_rmse;
        let time = self.time_of(point)?;
        Some(Figures {
            ms: time.median,
            fastest_ms: time.min,
            error: error.max(f64::EPSILON),
            bytes: point
                .structure_bytes
                .map_or(LEAST_BYTES, |bytes| bytes as f64)
                .max(LEAST_BYTES),
        })
    }

    fn noise(&self) -> f64 {
        let points = self.points.iter().flatten();
        points.filter_map(|point| point.noise).fold(0.0, f64::max)
    }

    fn effort(&self, candidate: usize, ms: f64) -> f64 {
        let overhead = Spread::of(&self.overheads_s).map_or(OVERHEAD_S, |spread| spread.median);
        let shared_ms = self
            .points
            .iter()
            .flatten()
            .find_map(|point| point.median_ms("shared"));
        let frame_s = 1e-3 * (ms + shared_ms.unwrap_or(0.0));
        overhead + frame_s * self.sweep.frames_of(&self.cases[candidate])
    }

    fn neighbours(&mut self, candidate: usize) -> Vec<Candidate> {
        let cases = neighbours(&self.cases[candidate], &self.cases);
        let candidates = cases.iter().map(candidate_of).collect();
        self.points.extend(cases.iter().map(|_| None));
        self.cases.extend(cases);
        candidates
    }
}
