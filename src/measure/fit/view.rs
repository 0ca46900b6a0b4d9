//! The views of a scene that bounds hold for, and what was measured of each.

use super::bound::Figures;
use crate::graph::Spread;
use crate::measure::bench::Case;
use crate::measure::chart::{Cost, Point, Progress, Section, Sweep, SweepError, SweepRun};
use crate::measure::records::Records;

/// One view of a scene.
pub struct View<'v> {
    /// The scene as commands name it, with its options.
    source: String,
    sweep: &'v Sweep<'v>,
    run: SweepRun<'v>,
    /// All rounds of each candidate together; `None` where it was not measured.
    points: Vec<Option<Point>>,
    /// Candidates that it has ruled out.
    ruled_out: usize,
    /// Points whose times were corrected, as the machine was slower or faster than else.
    corrected: usize,
}

/// Bytes of what keeps nothing in the world: their logarithm is one.
const LEAST_BYTES: f64 = 1.0;

impl<'v> View<'v> {
    /// A view that `run` measures, which has its reference already. `source` is the scene as
    /// commands name it.
    pub fn new(source: String, sweep: &'v Sweep<'v>, run: SweepRun<'v>) -> Self {
        View {
            source,
            sweep,
            run,
            points: Vec::new(),
            ruled_out: 0,
            corrected: 0,
        }
    }

    /// The scene as commands name it, with its options.
    pub fn source(&self) -> &str {
        &self.source
    }

    pub(super) fn sweep(&self) -> &'v Sweep<'v> {
        self.sweep
    }

    /// How many candidates it has ruled out.
    pub(super) fn ruled_out(&self) -> usize {
        self.ruled_out
    }

    /// How many points have times that were corrected.
    pub(super) fn corrected(&self) -> usize {
        self.corrected
    }

    pub(super) fn add_ruled_out(&mut self) {
        self.ruled_out += 1;
    }

    /// What was measured of a candidate.
    pub(super) fn point(&self, candidate: usize) -> Option<&Point> {
        self.points.get(candidate)?.as_ref()
    }

    /// All that was measured.
    pub(super) fn measured(&self) -> impl Iterator<Item = &Point> {
        self.points.iter().flatten()
    }

    /// Takes the scene on the device from a view that has it, if it can be used here.
    pub(super) fn take_scene(&mut self, from: &mut View<'v>) {
        let scene = from.run.uploaded().take();
        if self.sweep.differs_in_camera_alone(from.sweep) {
            *self.run.uploaded() = scene;
        }
    }

    /// Measures a round of a candidate, unless it has a record. Returns what is known of it now.
    pub(super) fn measure(
        &mut self,
        candidate: usize,
        cases: &[Case],
        round: u32,
        records: &mut Records<Point>,
    ) -> Result<Option<&Point>, SweepError> {
        let case = &cases[candidate];
        self.run
            .measure(case, round, records, &mut |_: Progress<'_>| {})?;
        let rounds = self.sweep.points(std::slice::from_ref(case), records);
        self.points.resize(cases.len(), None);
        self.points[candidate] = rounds.into_iter().last();
        self.settle(cases, records);
        Ok(self.point(candidate))
    }

    /// Puts the rounds of all points together, as if the machine had been as fast at each.
    fn settle(&mut self, cases: &[Case], records: &Records<Point>) {
        let pairs = cases.iter().zip(&self.points);
        let measured: Vec<Case> = pairs
            .filter(|(_, point)| point.is_some())
            .map(|(case, _)| case.clone())
            .collect();
        let section = Section::new(self.sweep.points(&measured, records), None);
        self.corrected = section.machine.corrected;
        for point in section.points {
            let is_it = |case: &Case| self.sweep.key(case) == point.key;
            if let Some(index) = cases.iter().position(is_it) {
                self.points[index] = Some(point);
            }
        }
    }
}

/// The time of a point that counts (ms): with a build where geometry moves.
pub(super) fn time_of(point: &Point, is_moving: bool) -> Option<Spread> {
    point.cost(match is_moving {
        true => Cost::Rebuild,
        false => Cost::Frame,
    })
}

/// What a point costs and how wrong it is; `None` where nothing could be compared.
pub(super) fn figures_of(point: &Point, is_moving: bool) -> Option<Figures> {
    let error = point.error.filter(|_| point.failure.is_none())?.rel_rmse;
    let time = time_of(point, is_moving)?;
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
