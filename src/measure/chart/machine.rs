//! How fast the machine was at each point, by the passes that all points share.

use std::collections::BTreeMap;

use super::point::Point;
use crate::frame;
use crate::graph::{PassTimes, Spread};

/// Points whose shared passes took more than this times the median, or less than its inverse, were
/// measured while the machine was slower or faster than else.
pub(super) const STEADY: f64 = 1.1;

/// How steady the machine was while points were measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machine {
    /// The longest time of the shared passes of a point, over the median.
    pub slowest: f64,
    /// The shortest, likewise.
    pub fastest: f64,
    /// Points whose times were corrected.
    pub corrected: usize,
}

impl Machine {
    /// A machine that was always as fast.
    pub const STEADY: Machine = Machine {
        slowest: 1.0,
        fastest: 1.0,
        corrected: 0,
    };

    /// Makes all points as if the machine had been equally fast at each: times are divided by how
    /// slow it was, where that is beyond [`STEADY`]. Then every frame gets the same shared passes,
    /// the median over all points that have them. The spread that is left is that of indirect
    /// light.
    pub(super) fn settle(points: &mut [Point]) -> Self {
        let slowness = slowness(points);
        let mut machine = Machine {
            slowest: slowness.iter().copied().fold(1.0, f64::max),
            fastest: slowness.iter().copied().fold(1.0, f64::min),
            ..Machine::STEADY
        };
        for (point, slowness) in points.iter_mut().zip(&slowness) {
            if is_unsteady(*slowness) {
                machine.corrected += 1;
                correct(point, *slowness);
            }
        }
        settle_shared_passes(points);
        machine
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

/// Whether the machine was slower or faster than at most points.
pub(super) fn is_unsteady(slowness: f64) -> bool {
    !(1.0 / STEADY..=STEADY).contains(&slowness)
}

/// The time of each point's shared passes, over the medians of these passes; 1 where it has none.
pub(super) fn slowness(points: &[Point]) -> Vec<f64> {
    let medians = shared_medians(points);
    points
        .iter()
        .map(|point| {
            let shared = point.passes.iter().filter(is_shared);
            let (own, median) = shared
                .filter_map(|pass| Some((pass.gpu_ms.median, medians.get(&pass.name)?)))
                .fold((0.0, 0.0), |sum, (own, median)| {
                    (sum.0 + own, sum.1 + median)
                });
            if own > 0.0 && median > 0.0 {
                own / median
            } else {
                1.0
            }
        })
        .collect()
}

fn is_shared(pass: &&PassTimes) -> bool {
    frame::STAGES
        .iter()
        .any(|stage| stage.passes.contains(&pass.name.as_str()))
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
                point.passes = ["render.gbuffer", "render.direct"]
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
