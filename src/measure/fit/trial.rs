//! Measuring the candidates of a search on views of a scene.

use std::collections::BTreeSet;
use std::time::Instant;

use super::bound::{Bounds, Figures};
use super::candidate::Candidate;
use super::cases::{candidate_of, neighbours};
use super::search::{SPREAD, Trial};
use super::view::{View, figures_of};
use crate::graph::Spread;
use crate::measure::bench::Case;
use crate::measure::chart::{Point, SweepError};
use crate::measure::records::Records;

/// What a search is doing.
#[derive(Clone, Copy)]
pub enum TrialProgress<'p> {
    /// It measures a case.
    Measuring(&'p Case),
    /// It has measured a point, or found its record.
    Done(&'p Point),
}

/// A trial that measures cases as points of sweeps, one sweep for each view, with a record each;
/// what has one is not measured again. The figures of a candidate are the worst over the views.
/// Once a view has ruled a candidate out, the others are left out.
pub struct SceneTrial<'t> {
    views: Vec<View<'t>>,
    /// The view that was measured last: it has the scene on the device.
    last: usize,
    records: &'t mut Records<Point>,
    bounds: Bounds,
    /// Whether geometry moves, so that a frame has a build.
    is_moving: bool,
    cases: Vec<Case>,
    /// Measurements that were made: seconds without those of the frames.
    overheads_s: Vec<f64>,
    /// The candidates of which something was measured.
    measured: BTreeSet<usize>,
    seconds: f64,
    progress: &'t mut dyn FnMut(TrialProgress<'_>),
}

/// Seconds that a measurement takes beside its frames before one was made.
const OVERHEAD_S: f64 = 1.0;

/// How a trial measures.
pub struct TrialSettings {
    /// What is asked for.
    pub bounds: Bounds,
    /// Whether geometry moves: a build adds to the time of a frame.
    pub is_moving: bool,
}

impl<'t> SceneTrial<'t> {
    /// A trial of cases on views of one scene, at least one.
    pub fn new(
        views: Vec<View<'t>>,
        records: &'t mut Records<Point>,
        settings: &TrialSettings,
        cases: Vec<Case>,
        progress: &'t mut dyn FnMut(TrialProgress<'_>),
    ) -> Self {
        assert!(!views.is_empty(), "a scene is measured in a view at least");
        SceneTrial {
            views,
            last: 0,
            records,
            bounds: settings.bounds,
            is_moving: settings.is_moving,
            cases,
            overheads_s: Vec::new(),
            measured: BTreeSet::new(),
            seconds: 0.0,
            progress,
        }
    }

    /// The candidates of the cases that it began with.
    pub fn candidates(&self) -> Vec<Candidate> {
        self.cases.iter().map(candidate_of).collect()
    }

    /// The views, in the order in which they were given.
    pub fn views(&self) -> &[View<'t>] {
        &self.views
    }

    /// Seconds that measurements took; what had a record took none.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Candidates of which something was measured; the others had records.
    pub fn measured_now(&self) -> usize {
        self.measured.len()
    }

    /// Name of the scene.
    pub fn scene_name(&self) -> &str {
        self.views[0].sweep().scene_name()
    }

    /// What is asked for.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Whether a frame has a build.
    pub fn is_moving(&self) -> bool {
        self.is_moving
    }

    /// Rounds that a sweep measures every point in.
    pub fn sweep_rounds(&self) -> u32 {
        self.views[0].sweep().round_count()
    }

    /// Rounds that the best are measured in: one more than all points of a sweep have.
    pub fn rounds(&self) -> u32 {
        self.sweep_rounds() + 1
    }

    fn measure_view(
        &mut self,
        view: usize,
        candidate: usize,
        round: u32,
    ) -> Result<(), SweepError> {
        let case = &self.cases[candidate];
        let sweep = self.views[view].sweep();
        let is_missing = sweep.is_missing(case, round, self.records);
        if !is_missing && self.views[view].point(candidate).is_some() {
            return Ok(());
        }
        if let Ok([now, last]) = self.views.get_disjoint_mut([view, self.last]) {
            now.take_scene(last);
        }
        self.last = view;
        if is_missing {
            (self.progress)(TrialProgress::Measuring(case));
        }
        let frames = sweep.frames_of(case);
        let start = Instant::now();
        let point = self.views[view].measure(candidate, &self.cases, round, self.records)?;
        let elapsed_s = start.elapsed().as_secs_f64();
        let Some(point) = point else {
            return Ok(());
        };
        if is_missing {
            self.measured.insert(candidate);
            self.seconds += elapsed_s;
            let in_frames_s = 1e-3 * point.median_ms("frame").unwrap_or(0.0) * frames;
            self.overheads_s.push((elapsed_s - in_frames_s).max(0.0));
        }
        (self.progress)(TrialProgress::Done(point));
        Ok(())
    }

    /// The views, those first that have ruled out most.
    fn order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.views.len()).collect();
        order.sort_by_key(|view| std::cmp::Reverse(self.views[*view].ruled_out()));
        order
    }

    /// Whether what is known of a candidate rules it out.
    fn is_ruled_out(&self, candidate: usize) -> bool {
        let Some(figures) = self.figures(candidate) else {
            return true;
        };
        let others = (0..self.cases.len()).filter(|other| *other != candidate);
        let complete: Vec<(usize, Figures)> = others
            .filter(|other| self.is_complete(*other))
            .filter_map(|other| Some((other, self.figures(other)?)))
            .collect();
        let best = self.bounds.best(&complete, 0.0);
        let best = best.and_then(|best| self.figures(best));
        let noise = self.noise();
        self.bounds
            .rule_out(&figures, best.as_ref(), 1.0 + SPREAD, noise)
    }

    fn is_complete(&self, candidate: usize) -> bool {
        self.views
            .iter()
            .all(|view| view.point(candidate).is_some())
    }
}

impl Trial for SceneTrial<'_> {
    type Error = SweepError;

    fn measure(&mut self, candidate: usize, round: u32) -> Result<(), SweepError> {
        for view in self.order() {
            (1..=round).try_for_each(|round| self.measure_view(view, candidate, round))?;
            if self.is_ruled_out(candidate) {
                self.views[view].add_ruled_out();
                break;
            }
        }
        Ok(())
    }

    fn complete(&mut self, candidate: usize) -> Result<bool, SweepError> {
        let is_left_out = |view: &usize| self.views[*view].point(candidate).is_none();
        let left_out: Vec<usize> = self.order().into_iter().filter(is_left_out).collect();
        let rounds = self.rounds();
        for view in &left_out {
            (1..=rounds).try_for_each(|round| self.measure_view(*view, candidate, round))?;
        }
        Ok(!left_out.is_empty())
    }

    fn figures(&self, candidate: usize) -> Option<Figures> {
        let points = self.views.iter().filter_map(|view| view.point(candidate));
        let all: Option<Vec<Figures>> = points
            .map(|point| figures_of(point, self.is_moving))
            .collect();
        Figures::worst(&all?)
    }

    fn noise(&self) -> f64 {
        let points = self.views.iter().flat_map(View::measured);
        points.filter_map(|point| point.noise).fold(0.0, f64::max)
    }

    fn effort(&self, candidate: usize, ms: f64) -> f64 {
        let overhead = Spread::of(&self.overheads_s).map_or(OVERHEAD_S, |spread| spread.median);
        let mut points = self.views.iter().flat_map(View::measured);
        let shared_ms = points.find_map(|point| point.median_ms("shared"));
        let frame_s = 1e-3 * (ms + shared_ms.unwrap_or(0.0));
        let frames = self.views[0].sweep().frames_of(&self.cases[candidate]);
        self.views.len() as f64 * (overhead + frame_s * frames)
    }

    fn neighbours(&mut self, candidate: usize) -> Vec<Candidate> {
        let cases = neighbours(&self.cases[candidate], &self.cases);
        let candidates = cases.iter().map(candidate_of).collect();
        self.cases.extend(cases);
        candidates
    }
}
