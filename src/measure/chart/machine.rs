//! How fast the machine was at each point, by the passes that all points share.

use std::collections::{BTreeMap, BTreeSet};

use super::point::Point;
use crate::frame;
use crate::gi::entry::Part;
use crate::graph::{PassTimes, Spread};

/// Measurements whose shared passes took more than this times the median, or less than its inverse,
/// were taken while the machine was slower or faster than else.
pub(super) const STEADY: f64 = 1.1;

/// How steady the machine was while points were measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machine {
    /// The longest time of the shared passes of a measurement, over the median.
    pub slowest: f64,
    /// The shortest, likewise.
    pub fastest: f64,
    /// Points of which a measurement was corrected.
    pub corrected: usize,
}

impl Machine {
    /// A machine that was always as fast.
    pub const STEADY: Machine = Machine {
        slowest: 1.0,
        fastest: 1.0,
        corrected: 0,
    };

    /// Makes all points as if the machine had been equally fast at each: the times of a measurement
    /// are divided by how slow it was, where that is beyond [`STEADY`]. Then the rounds of a point
    /// become one, and every frame gets the same shared passes, the median over all points that
    /// have them. The spread that is left is that of indirect light.
    pub(super) fn settle(measured: Vec<Point>) -> (Vec<Point>, Self) {
        let slowness = slowness(&measured);
        let mut machine = Machine {
            slowest: slowness.iter().copied().fold(1.0, f64::max),
            fastest: slowness.iter().copied().fold(1.0, f64::min),
            ..Machine::STEADY
        };
        let mut corrected = BTreeSet::new();
        let steady = measured
            .into_iter()
            .zip(slowness)
            .map(|(mut point, slowness)| {
                if is_unsteady(slowness) {
                    corrected.insert(point.key.clone());
                    correct(&mut point, slowness);
                }
                point
            });
        let mut points = together(steady);
        machine.corrected = corrected.len();
        settle_shared_passes(&mut points);
        (points, machine)
    }

    /// What a reader has to know; `None` where the machine was steady.
    pub fn text(&self) -> Option<String> {
        (self.corrected > 0).then(|| {
            let Machine {
                slowest,
                fastest,
                corrected,
            } = self;
            format!(
                "The machine was not steady. Passes that all points share took {fastest:.2} to \
                 {slowest:.2} times their median. Points measured at another speed, their times \
                 corrected by those passes: {corrected}."
            )
        })
    }
}

/// One point of all rounds of a key, in the order in which keys come first. Its times have the
/// median of the rounds' medians, and their extremes; all else is the last round's.
fn together(measured: impl Iterator<Item = Point>) -> Vec<Point> {
    let mut order: BTreeMap<String, usize> = BTreeMap::new();
    let mut points: Vec<Vec<Point>> = Vec::new();
    for point in measured {
        let index = *order.entry(point.key.clone()).or_insert(points.len());
        match points.get_mut(index) {
            Some(rounds) => rounds.push(point),
            None => points.push(vec![point]),
        }
    }
    points.into_iter().filter_map(one_of_rounds).collect()
}

fn one_of_rounds(mut rounds: Vec<Point>) -> Option<Point> {
    // What failed in one round has no times in it.
    if rounds.iter().any(|round| round.failure.is_none()) {
        rounds.retain(|round| round.failure.is_none());
    }
    let mut point = rounds.pop()?;
    put_together(&mut point.totals, &rounds, |round| &round.totals);
    put_together(&mut point.build, &rounds, |round| &round.build);
    put_together(&mut point.passes, &rounds, |round| &round.passes);
    Some(point)
}

/// Adds the times of other rounds to the rows of the same names.
fn put_together(rows: &mut [PassTimes], rounds: &[Point], of: fn(&Point) -> &[PassTimes]) {
    for row in rows {
        let others = rounds.iter().flat_map(of);
        let same = others.filter(|other| other.name == row.name);
        row.gpu_ms = spread_of(same.map(|other| other.gpu_ms), row.gpu_ms);
    }
}

fn spread_of(others: impl Iterator<Item = Spread>, last: Spread) -> Spread {
    let spreads: Vec<Spread> = others.chain([last]).collect();
    let medians: Vec<f64> = spreads.iter().map(|spread| spread.median).collect();
    Spread {
        median: Spread::of(&medians).map_or(last.median, |medians| medians.median),
        min: spreads
            .iter()
            .fold(last.min, |min, spread| min.min(spread.min)),
        max: spreads
            .iter()
            .fold(last.max, |max, spread| max.max(spread.max)),
        n: spreads.iter().map(|spread| spread.n).sum(),
    }
}

/// Whether the machine was slower or faster than at most measurements.
fn is_unsteady(slowness: f64) -> bool {
    !(1.0 / STEADY..=STEADY).contains(&slowness)
}

/// How slow the machine was at each measurement: the median, over its shared passes, of a pass's
/// time to its median over all points; 1 where it has none. A single pass may be disturbed while
/// the machine is steady: of rules that were compared, with this one the rounds of a point agree
/// best (`docs/chart.md`).
fn slowness(points: &[Point]) -> Vec<f64> {
    let medians = shared_medians(points);
    points
        .iter()
        .map(|point| {
            let shared = point.passes.iter().filter(is_shared);
            let ratio = |pass: &PassTimes| Some(pass.gpu_ms.median / medians.get(&pass.name)?);
            let mut ratios: Vec<f64> = shared.filter_map(ratio).collect();
            ratios.retain(|ratio| ratio.is_finite() && *ratio > 0.0);
            Spread::of(&ratios).map_or(1.0, |ratios| ratios.median)
        })
        .collect()
}

fn is_shared(pass: &&PassTimes) -> bool {
    // Those of pictures depend on settings, and are in few points.
    let mut stages = frame::STAGES.iter();
    stages.any(|stage| stage.part == Part::Shared && stage.passes.contains(&pass.name.as_str()))
}

fn shared_medians(points: &[Point]) -> BTreeMap<String, f64> {
    let mut times: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for pass in points
        .iter()
        .flat_map(|point| &point.passes)
        .filter(is_shared)
    {
        times
            .entry(pass.name.clone())
            .or_default()
            .push(pass.gpu_ms.median);
    }
    times
        .into_iter()
        .filter_map(|(name, times)| Some((name, Spread::of(&times)?.median)))
        .collect()
}

fn correct(point: &mut Point, slowness: f64) {
    for row in [&mut point.totals, &mut point.build, &mut point.passes]
        .into_iter()
        .flatten()
    {
        let Spread {
            median,
            min,
            max,
            n,
        } = row.gpu_ms;
        row.gpu_ms = Spread {
            median: median / slowness,
            min: min / slowness,
            max: max / slowness,
            n,
        };
    }
}

fn settle_shared_passes(points: &mut [Point]) {
    let medians = shared_medians(points);
    for point in points {
        let shared: f64 = point
            .passes
            .iter()
            .filter(is_shared)
            .filter_map(|pass| medians.get(&pass.name))
            .sum();
        let own = point.total("indirect").unwrap_or(Spread {
            median: 0.0,
            min: 0.0,
            max: 0.0,
            n: point.setup.frames as usize,
        });
        let frame = Spread {
            median: own.median + shared,
            min: own.min + shared,
            max: own.max + shared,
            n: own.n,
        };
        let shared = Spread {
            median: shared,
            min: shared,
            max: shared,
            n: own.n,
        };
        for total in &mut point.totals {
            match total.name.as_str() {
                "shared" => total.gpu_ms = shared,
                "frame" => total.gpu_ms = frame,
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::answer::Answer;
    use super::super::point::tests::point;
    use super::super::run::order;
    use super::super::section::Section;
    use super::*;

    /// Points of three techniques, in the order in which a sweep measures them.
    fn measured() -> Vec<Point> {
        let mut points = Vec::new();
        for step in 1..=8 {
            let cost = f64::from(1 << step);
            for (technique, share) in [("a", 1.0), ("b", 0.8), ("c", 1.3)] {
                let error = 0.5 / (cost * share).sqrt();
                let cost = cost * (0.5 + 0.5 * share);
                let bytes = (1e6 * share) as u64;
                let mut point = point(technique, 1, [cost, 0.1 * cost], bytes, error);
                point.passes = ["render.gbuffer", "render.direct", "render.composite"]
                    .into_iter()
                    .map(|name| PassTimes {
                        name: name.to_owned(),
                        gpu_ms: Spread {
                            median: 2.0,
                            min: 1.9,
                            max: 2.2,
                            n: 3,
                        },
                    })
                    .collect();
                points.push(point);
            }
        }
        points
    }

    fn picks(points: Vec<Point>) -> Vec<String> {
        Section::new(points, None)
            .answers()
            .iter()
            .map(|answer: &Answer| format!("{:?} {:?}", answer.goal, answer.point))
            .collect()
    }

    /// The points as two rounds measure them, the second in the other order. The machine takes
    /// `slowness(when)` times as long, where `when` goes from 0 to 1; passes that all points share
    /// show it or not.
    fn in_rounds(slowness: impl Fn(f64) -> f64, is_shown: bool) -> Vec<Point> {
        let points = measured();
        let count = points.len();
        let mut rounds = Vec::new();
        for round in 1..=2 {
            for (turn, index) in order(count, round).into_iter().enumerate() {
                let when = (turn + (round as usize - 1) * count) as f64;
                let slowness = slowness(when / (2 * count - 1) as f64);
                let mut point = Point {
                    round: Some(round),
                    ..points[index].clone()
                };
                let passes = point.passes.clone();
                correct(&mut point, 1.0 / slowness);
                if !is_shown {
                    point.passes = passes;
                }
                rounds.push((index, point));
            }
        }
        // As a sweep gives them: all rounds of a case, case by case.
        rounds.sort_by_key(|(index, _)| *index);
        rounds.into_iter().map(|(_, point)| point).collect()
    }

    /// A machine that gets slower and slower, by two thirds in all, is evened out by the order of
    /// the rounds alone, where no pass shows it. The first round alone is far off.
    #[test]
    fn rounds_even_out_a_drift_that_no_pass_shows() {
        let points = in_rounds(|when| 0.75 + 0.5 * when, false);
        assert_eq!(points.len(), 2 * measured().len());
        let first = points.iter().filter(|point| point.round == Some(1));
        let first: Vec<Point> = first.cloned().collect();
        let off = |points: Vec<Point>| {
            let steady = Section::new(measured(), None).points;
            let points = Section::new(points, None).points;
            let ratios = points.iter().zip(&steady).filter_map(|(point, steady)| {
                assert_eq!(point.key, steady.key);
                Some(point.median_ms("indirect")? / steady.median_ms("indirect")?)
            });
            ratios.map(|ratio| (ratio - 1.0).abs()).fold(0.0, f64::max)
        };
        assert!(off(points) < 1e-9);
        assert!(off(first) > 0.2);
    }

    /// The machine is slower or faster for a third of the run: each measurement is corrected by its
    /// own passes.
    #[test]
    fn a_busy_time_changes_no_answer() {
        let steady = picks(measured());
        for planted in [0.4, 2.1] {
            for begin in [0.0, 0.2, 0.4, 0.6] {
                let busy = begin..begin + 1.0 / 3.0;
                let slowness = |when: f64| if busy.contains(&when) { planted } else { 1.0 };
                let points = in_rounds(slowness, true);
                assert_eq!(picks(points.clone()), steady, "{planted} from {begin}");
                let machine = Section::new(points, None).machine;
                assert!((8..=16).contains(&machine.corrected), "{machine:?}");
            }
        }
    }

    /// Two rounds and one more: the median of their medians, their extremes, and all that was
    /// measured; what failed once counts only where nothing else is there.
    #[test]
    fn rounds_become_one_point() {
        let round = |round: u32, ms: f64| Point {
            key: "same".to_owned(),
            round: Some(round),
            ..point("a", 1, [ms, ms], 1, 0.1)
        };
        let one = |rounds: &[Point]| {
            let mut points = together(rounds.iter().cloned());
            assert_eq!(points.len(), 1);
            points.remove(0)
        };
        let rounds = [round(1, 10.0), round(2, 30.0), round(3, 12.0)];
        let build = one(&rounds).total("build").map(|build| {
            let Spread {
                median,
                min,
                max,
                n,
            } = build;
            ([median, min, max], n)
        });
        assert_eq!(build, Some(([12.0, 9.0, 36.0], 9)));
        let mean = one(&rounds[..2]).total("build").map(|build| build.median);
        assert_eq!(mean, Some(20.0));
        let failed = Point {
            failure: Some("gone".to_owned()),
            totals: Vec::new(),
            ..round(2, 30.0)
        };
        assert_eq!(one(&[rounds[0].clone(), failed.clone()]), rounds[0]);
        assert_eq!(one(std::slice::from_ref(&failed)), failed);
    }

    /// One shared pass took five times as long: the machine was steady all the same.
    #[test]
    fn a_disturbed_pass_changes_nothing() {
        let mut points = measured();
        points[4].passes[0].gpu_ms.median = 10.0;
        points[4].passes[0].gpu_ms.min = 10.0;
        let section = Section::new(points, None);
        assert_eq!(section.machine.corrected, 0);
        let steady = Section::new(measured(), None).points;
        let indirect = |points: &[Point]| points[4].total("indirect");
        assert_eq!(indirect(&section.points), indirect(&steady));
    }

    /// A third of the points is measured while the machine is slower or faster: the answers are
    /// those of a steady machine, and it is told.
    #[test]
    fn a_busy_machine_changes_no_answer() {
        let steady = picks(measured());
        for planted in [0.4, 1.5, 2.1] {
            for first in 0..3 {
                let mut points = measured();
                for point in points.iter_mut().skip(first).step_by(3) {
                    correct(point, 1.0 / planted);
                }
                assert_eq!(picks(points.clone()), steady, "{planted} from {first}");
                let machine = Section::new(points, None).machine;
                assert_eq!(machine.corrected, 8);
                let slowness = format!("{planted:.2}");
                assert!(machine.text().is_some_and(|text| text.contains(&slowness)));
            }
        }
        assert_eq!(Section::new(measured(), None).machine.text(), None);
    }
}
