//! What a search found, in words and for reports.

use serde::Serialize;

use super::bound::{Aim, Bounds, Figures};
use super::search::{Found, Search, Trial as _};
use super::trial::SceneTrial;
use super::view::{View, figures_of, time_of};
use crate::graph::Spread;
use crate::measure::chart::{Point, SweepError, bounces_text, render_command};
use crate::reference::Bounces;
use crate::text::{counted, short};

/// A measured point, as an answer names it.
#[derive(Clone, Debug, Serialize)]
pub struct Choice {
    /// Technique, preset, resolution and the settings that differ from the preset.
    pub name: String,
    /// Error of the indirect light over blocks, relative to the mean of the reference, in the view
    /// where it is largest.
    pub error: f64,
    /// Time of a frame's indirect light (ms), with a build where geometry moves, in the view where
    /// it is largest.
    pub ms: Spread,
    /// Bytes that the technique keeps in the world; the most over the views.
    pub bytes: u64,
    /// The command that renders its picture in the view of the largest error.
    pub command: String,
    /// All that was measured of it, a point for each view.
    pub views: Vec<Point>,
}

/// What a search found.
#[derive(Clone, Debug, Serialize)]
pub struct Fit {
    /// Name of the scene.
    pub scene: String,
    /// Indirect bounces.
    pub bounces: Bounces,
    /// Views of the scene that the bounds hold for: the scenes as commands name them.
    pub views: Vec<String>,
    /// Bound of the error; `None` where there is none, here and below.
    pub max_error: Option<f64>,
    /// Bound of the time (ms).
    pub max_ms: Option<f64>,
    /// Bound of the memory (bytes).
    pub max_bytes: Option<f64>,
    /// Whether the time has a build in it, as geometry moves.
    pub is_moving: bool,
    /// The best within the bounds.
    pub best: Option<Choice>,
    /// What meets the bounds too and has less of what is looked for than the best, but not for
    /// certain: of times by less than frames differ, of errors by less than the noise.
    pub as_good: Option<Choice>,
    /// The least error of all that takes less time than the best and does not meet the bounds, or
    /// is more wrong for certain.
    pub next_cheaper: Option<Choice>,
    /// What comes nearest to the bounds, where nothing meets them.
    pub nearest: Option<Choice>,
    /// Points of the grid.
    pub grid_points: usize,
    /// Points that were measured, those beside the grid among them.
    pub measured_points: usize,
    /// Those of them that had records before.
    pub known_points: usize,
    /// Points whose times were corrected, as the machine was slower or faster than else.
    pub corrected_points: usize,
    /// Points that a bound ruled out before they were measured.
    pub ruled_out_points: usize,
    /// Seconds that measuring took; what had a record took none.
    pub seconds: f64,
    /// Estimated seconds of all rounds of the whole grid.
    pub grid_seconds: f64,
}

/// A time differs if it is less by this factor.
const CHEAPER: f64 = 0.97;

impl Fit {
    /// Searches the cases of a trial.
    pub fn search(trial: &mut SceneTrial<'_>, bounces: Bounces) -> Result<Self, SweepError> {
        let (candidates, rounds) = (trial.candidates(), trial.rounds());
        let (bounds, grid_points) = (trial.bounds(), candidates.len());
        let found = Search::new(trial, bounds, rounds, candidates).run()?;
        loop {
            let all = figures_of_all(trial, &found);
            let noise = trial.noise();
            let beside = found.best.map_or([None, None], |best| {
                [
                    as_good(&bounds, &all, best),
                    next_cheaper(&bounds, &all, best, noise),
                ]
            });
            let mut is_known = true;
            for candidate in beside.into_iter().flatten() {
                is_known &= !trial.complete(candidate)?;
            }
            if is_known {
                return Ok(Fit::of(trial, &found, beside, bounces, grid_points));
            }
        }
    }

    fn of(
        trial: &SceneTrial<'_>,
        found: &Found,
        [as_good, next]: [Option<usize>; 2],
        bounces: Bounces,
        grid_points: usize,
    ) -> Self {
        let bounds = trial.bounds();
        let choice = |index: usize| Choice::of(trial, index);
        let nearest = match found.best {
            Some(_) => None,
            None => bounds.nearest(&figures_of_all(trial, found)),
        };
        let bound = |bound: f64| Some(bound).filter(|bound| bound.is_finite());
        let rounds_s: f64 = found.efforts[..grid_points].iter().sum();
        Fit {
            scene: trial.scene_name().to_owned(),
            bounces,
            views: trial
                .views()
                .iter()
                .map(|view| view.source().to_owned())
                .collect(),
            max_error: bound(bounds.max_error),
            max_ms: bound(bounds.max_ms),
            max_bytes: bound(bounds.max_bytes),
            is_moving: trial.is_moving(),
            best: found.best.and_then(choice),
            as_good: as_good.and_then(choice),
            next_cheaper: next.and_then(choice),
            nearest: nearest.and_then(choice),
            grid_points,
            measured_points: found.measured.len(),
            known_points: found.measured.len() - trial.measured_now(),
            corrected_points: trial.views().iter().map(View::corrected).sum(),
            ruled_out_points: found.ruled_out,
            seconds: trial.seconds(),
            grid_seconds: rounds_s * f64::from(trial.sweep_rounds()),
        }
    }

    /// What the bounds are, in words.
    pub fn bounds_text(&self) -> String {
        let error = self
            .max_error
            .map(|error| format!("an error of at most {}", percent(error)));
        let ms = self
            .max_ms
            .map(|ms| format!("a time of at most {} ms", short(ms)));
        let bytes = self
            .max_bytes
            .map(|bytes| format!("a memory of at most {} MiB", short(bytes / MIB)));
        let all: Vec<String> = [error, ms, bytes].into_iter().flatten().collect();
        all.join(" and ")
    }

    /// The answer, a line for each thing that it says.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let views = match self.views.len() {
            1 => String::new(),
            count => format!(", {}", counted(count, "view")),
        };
        let bounces = bounces_text(self.bounces) + &views;
        match (&self.best, &self.nearest) {
            (Some(best), _) => {
                lines.push(format!("{}, {bounces}: {}", self.scene, best.name));
                lines.push(format!("  {}", self.figures_text(best)));
                lines.extend(self.views_text(best));
                lines.push(format!("  {}", self.reason()));
                lines.extend(self.as_good_text());
                lines.push(format!("  {}", self.cheaper_text(best)));
            }
            (None, Some(nearest)) => {
                let asked = self.bounds_text();
                lines.push(format!("{}, {bounces}: nothing has {asked}", self.scene));
                lines.push(format!("  nearest: {}", nearest.name));
                lines.push(format!("  {}", self.figures_text(nearest)));
                lines.extend(self.views_text(nearest));
            }
            (None, None) => lines.push(format!(
                "{}, {bounces}: no point has an error that could be judged",
                self.scene
            )),
        }
        lines.push(format!("  {}", self.effort_text()));
        if self.corrected_points > 0 {
            lines.push(format!(
                "  the machine was not steady: times of {} were corrected",
                counted(self.corrected_points, "point")
            ));
        }
        let shown = self.best.as_ref().or(self.nearest.as_ref());
        lines.extend(shown.map(|choice| choice.command.clone()));
        lines
    }

    fn figures_text(&self, choice: &Choice) -> String {
        let Spread {
            median, min, max, ..
        } = choice.ms;
        let of = if self.is_moving {
            "for a build and the indirect light of a frame"
        } else {
            "for the indirect light of a frame"
        };
        format!(
            "error {}, {} ms {of} ({} to {}), {:.2} MiB",
            percent(choice.error),
            short(median),
            short(min),
            short(max),
            choice.bytes as f64 / MIB
        )
    }

    /// The figures of each view, where there are several.
    fn views_text(&self, choice: &Choice) -> Option<String> {
        let figures = |point: &Point| figures_of(point, self.is_moving);
        let all: Vec<Figures> = choice.views.iter().filter_map(figures).collect();
        let list =
            |text: &dyn Fn(&Figures) -> String| all.iter().map(text).collect::<Vec<_>>().join(", ");
        (self.views.len() > 1).then(|| {
            format!(
                "  the largest of its views, which have {} in {} ms",
                list(&|it| percent(it.error)),
                list(&|it| short(it.ms))
            )
        })
    }

    fn reason(&self) -> String {
        let what = match self.max_error {
            Some(_) => "the least time",
            None => "the least error",
        };
        format!("it has {what} of all that have {}", self.bounds_text())
    }

    /// What may be better than the answer.
    fn as_good_text(&self) -> Option<String> {
        let other = self.as_good.as_ref()?;
        let within = match self.max_error {
            Some(_) => "less by what times are off",
            None => "less by the reference's noise",
        };
        Some(format!(
            "  {within}: {}: {} ms, and an error of {}",
            other.name,
            short(other.ms.median),
            percent(other.error)
        ))
    }

    fn cheaper_text(&self, best: &Choice) -> String {
        let Some(next) = &self.next_cheaper else {
            return "nothing that was measured takes less time".to_owned();
        };
        format!(
            "next cheaper: {}: {} ms, and an error of {} instead of {}",
            next.name,
            short(next.ms.median),
            percent(next.error),
            percent(best.error)
        )
    }

    fn effort_text(&self) -> String {
        let all = counted(self.grid_points, "point");
        let before = match self.known_points {
            0 => String::new(),
            known => format!(" ({known} of them before)"),
        };
        format!(
            "{} measured{before} for a grid of {all}, {} ruled out unmeasured by the bounds; {} s, \
             where the whole grid would take about {} s",
            self.measured_points,
            self.ruled_out_points,
            short(self.seconds),
            short(self.grid_seconds)
        )
    }
}

impl Choice {
    /// What a trial has measured of a candidate in all views.
    fn of(trial: &SceneTrial<'_>, candidate: usize) -> Option<Self> {
        let views: Vec<(&View<'_>, &Point)> = trial
            .views()
            .iter()
            .filter_map(|view| Some((view, view.point(candidate)?)))
            .collect();
        let error_of = |point: &Point| point.error.map_or(0.0, |error| error.rel_rmse);
        let (view, point) = *views
            .iter()
            .max_by(|a, b| error_of(a.1).total_cmp(&error_of(b.1)))?;
        let points = || views.iter().map(|(_, point)| *point);
        let times = points().filter_map(|point| time_of(point, trial.is_moving()));
        let ms = times.max_by(|a, b| a.median.total_cmp(&b.median))?;
        let changes = match point.changes.is_empty() {
            true => String::new(),
            false => format!(" with {}", point.changes_text()),
        };
        Some(Choice {
            name: format!("{}{changes}", point.name()),
            error: error_of(point),
            ms,
            bytes: points()
                .filter_map(|point| point.structure_bytes)
                .max()
                .unwrap_or(0),
            command: render_command(view.source(), point),
            views: points().cloned().collect(),
        })
    }
}

/// The figures of all that was measured.
fn figures_of_all(trial: &SceneTrial<'_>, found: &Found) -> Vec<(usize, Figures)> {
    let measured = found.measured.iter();
    measured
        .filter_map(|&index| Some((index, trial.figures(index)?)))
        .collect()
}

/// Of all that meets the bounds, what has less of what is looked for than the best: it is not the
/// best, as it has not so for certain.
fn as_good(bounds: &Bounds, all: &[(usize, Figures)], best: usize) -> Option<usize> {
    let best = all.iter().find(|(index, _)| *index == best)?.1;
    let value = |it: &Figures| match bounds.aim() {
        Aim::Time => it.ms / CHEAPER,
        Aim::Error => it.error,
    };
    let most = match bounds.aim() {
        Aim::Time => best.ms,
        Aim::Error => best.error,
    };
    let better = all
        .iter()
        .filter(|(_, it)| bounds.are_met(it) && value(it) < most)
        // What changes nothing is no other answer.
        .filter(|(_, it)| (it.error, it.bytes) != (best.error, best.bytes));
    better
        .min_by(|a, b| value(&a.1).total_cmp(&value(&b.1)))
        .map(|(index, _)| *index)
}

/// Of all that takes less time than the best, meets the other bounds and is more wrong than they
/// allow, or than the best and the noise, the least error.
fn next_cheaper(
    bounds: &Bounds,
    all: &[(usize, Figures)],
    best: usize,
    noise: f64,
) -> Option<usize> {
    let best = all.iter().find(|(index, _)| *index == best)?.1;
    let good = match bounds.aim() {
        Aim::Time => bounds.max_error,
        Aim::Error => best.error + noise,
    };
    let others = Bounds {
        max_error: f64::INFINITY,
        ..*bounds
    };
    let cheaper = all
        .iter()
        .filter(|(_, it)| it.ms < CHEAPER * best.ms && it.error > good && others.are_met(it));
    cheaper
        .min_by(|a, b| a.1.error.total_cmp(&b.1.error))
        .map(|(index, _)| *index)
}

/// A share in per cent, with three digits.
fn percent(share: f64) -> String {
    format!("{}%", short(100.0 * share))
}

const MIB: f64 = 1024.0 * 1024.0;

#[cfg(test)]
mod tests {
    use super::*;

    /// Planted: 1 is the best; 0, 2 and 3 are cheaper and worse, 3 the least so, and 4 needs too
    /// much memory.
    #[test]
    fn the_next_cheaper_loses_least() {
        let all = [
            [1.0, 0.5, 1.0],
            [4.0, 0.05, 1.0],
            [2.0, 0.2, 1.0],
            [3.8, 0.06, 1.0],
            [1.0, 0.06, 9.0],
        ];
        let all = all.map(|[ms, error, bytes]| Figures {
            ms,
            fastest_ms: ms,
            error,
            bytes,
        });
        let all: Vec<(usize, Figures)> = all.into_iter().enumerate().collect();
        let bounds = Bounds {
            max_error: 0.055,
            max_bytes: 4.0,
            ..Bounds::NONE
        };
        assert_eq!(bounds.best(&all, 0.0), Some(1));
        assert_eq!(next_cheaper(&bounds, &all, 1, 0.0), Some(3));
        assert_eq!(next_cheaper(&bounds, &all, 0, 0.0), None);
        let fast = Bounds {
            max_ms: 5.0,
            max_error: f64::INFINITY,
            ..bounds
        };
        assert_eq!(next_cheaper(&fast, &all, 1, 0.0), Some(3));
        assert_eq!(
            next_cheaper(&fast, &all, 1, 0.02),
            Some(2),
            "3 is within the noise"
        );
        assert_eq!(as_good(&bounds, &all, 1), None);
        let loose = Bounds {
            max_error: 0.2,
            ..bounds
        };
        assert_eq!(as_good(&loose, &all, 1), Some(2), "faster, and allowed");
        assert_eq!(as_good(&fast, &all, 3), Some(1), "less wrong, and allowed");
    }
}
