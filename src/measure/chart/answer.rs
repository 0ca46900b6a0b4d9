//! Which point to take for what: by the time that a frame may take, by the error that is small
//! enough, by memory.

use std::fmt;

use super::front::{Price, cheapest, distinct_front};
use super::point::{Point, bounces_text};
use super::section::{MIB, Section, bias_text, error_text, percent};
use crate::graph::Spread;
use crate::measure::draw::short;
use crate::reference::Bounces;
use crate::text::counted;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// The least error in frames of at most this many ms, all passes; geometry stands still.
    Frame(f64),
    /// The same among the points that are not [`ROUGH`] and have less error by pixel.
    CleanFrame(f64),
    /// The least error where a build and a frame together take at most this many ms.
    Moving(f64),
    /// The least time of a frame with an error of at most this; of times alike the least error.
    Time(f64),
    /// The least memory with an error of at most this; of equals the fastest.
    Memory(f64),
}

/// What to take for one goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Indirect bounces.
    pub bounces: Bounces,
    /// What is asked for.
    pub goal: Goal,
    /// Index of the point; `None` where none that was measured will do.
    pub point: Option<usize>,
}

/// A point that is taken for something.
#[derive(Clone, Debug, PartialEq)]
pub struct Pick {
    /// Index of the point.
    pub index: usize,
    /// What it is the answer to.
    pub goals: Vec<Goal>,
}

/// The answers of one number of bounces, point by point.
#[derive(Clone, Debug, PartialEq)]
pub struct Picks {
    /// Indirect bounces.
    pub bounces: Bounces,
    /// The chosen points, fastest first.
    pub picks: Vec<Pick>,
    /// What no point that was measured meets.
    pub unmet: Vec<Goal>,
}

/// Above this [fine error](Point::fine_error) a picture looks grainy, or wrong in what is small.
pub const ROUGH: f64 = 0.1;

/// Above this error a point is no answer to how much time a frame may take, unless there is no
/// better one.
pub(super) const USABLE: f64 = 0.5;

/// Costs that differ by less than this factor do not decide between two errors.
pub(super) const ALIKE: f64 = 1.1;

/// Errors for which the cheapest point is named.
const BOUNDS: [f64; 3] = [0.05, 0.1, 0.2];

/// Times that a frame may take, and these times powers of ten (ms).
const BUDGETS: [f64; 6] = [1.0, 1.5, 2.0, 3.0, 5.0, 7.0];

impl fmt::Display for Goal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Goal::Frame(ms) => write!(f, "light moves, {} ms a frame", short(ms)),
            Goal::CleanFrame(ms) => write!(f, "light moves, {} ms a frame, not rough", short(ms)),
            Goal::Moving(ms) => write!(f, "everything moves, {} ms a frame", short(ms)),
            Goal::Time(bound) => write!(f, "least time, error at most {}", percent(bound)),
            Goal::Memory(bound) => write!(f, "least memory, error at most {}", percent(bound)),
        }
    }
}

/// Points of one number of bounces that can be chosen, by index.
struct Choice<'s> {
    section: &'s Section,
    points: Vec<usize>,
    noise: f64,
}

impl Choice<'_> {
    fn point(&self, member: usize) -> &Point {
        &self.section.points[self.points[member]]
    }

    fn prices(&self, cost: impl Fn(&Point) -> Option<Spread>) -> Vec<Price> {
        // What has no cost is never chosen.
        const NONE: Spread = Spread {
            median: f64::INFINITY,
            min: f64::INFINITY,
            max: f64::INFINITY,
            n: 0,
        };
        let price = |&index: &usize| {
            let point = &self.section.points[index];
            Price {
                cost: cost(point).unwrap_or(NONE),
                error: point.error.map_or(f64::INFINITY, |error| error.rel_rmse),
            }
        };
        self.points.iter().map(price).collect()
    }

    fn answers(&self) -> Vec<(Goal, Option<usize>)> {
        let (frames, moving) = (self.prices(Point::frame_ms), self.prices(Point::moving_ms));
        // All memory, as in the tables: where a point takes little memory, its structure is the
        // smaller part of it.
        let bytes = self.prices(|point| {
            let bytes = point.memory_bytes as f64;
            Some(Spread {
                median: bytes,
                min: bytes,
                max: bytes,
                n: 1,
            })
        });
        let mut answers: Vec<(Goal, Option<usize>)> = Vec::new();
        for (ms, member) in budgets(&frames, self.noise) {
            answers.push((Goal::Frame(ms), Some(member)));
            if is_rough(self.point(member)) {
                let by_pixel = |member: usize| {
                    self.point(member)
                        .pixel_error
                        .map_or(f64::INFINITY, |error| error.rel_rmse)
                };
                let looks_better = |other: usize| {
                    !is_rough(self.point(other)) && by_pixel(other) < by_pixel(member)
                };
                let clean = |&other: &usize| {
                    frames[other].cost.median <= ms
                        && frames[other].error <= USABLE
                        && looks_better(other)
                };
                let clean: Vec<usize> = (0..frames.len()).filter(clean).collect();
                let best = best(
                    &clean.iter().map(|&other| frames[other]).collect::<Vec<_>>(),
                    self.noise,
                );
                answers.extend(best.map(|best| (Goal::CleanFrame(ms), Some(clean[best]))));
            }
        }
        answers.extend(
            budgets(&moving, self.noise)
                .into_iter()
                .map(|(ms, member)| (Goal::Moving(ms), Some(member))),
        );
        for bound in BOUNDS {
            answers.push((Goal::Time(bound), least_of_alike(&frames, bound)));
        }
        for bound in BOUNDS {
            answers.push((
                Goal::Memory(bound),
                cheapest(&bytes, bound, |member| frames[member].cost.median),
            ));
        }
        answers
    }
}

/// The best of all whose error is as good as the least, within the noise, and that cost hardly more
/// than the cheapest of them.
fn best(prices: &[Price], noise: f64) -> Option<usize> {
    let least = prices
        .iter()
        .map(|price| price.error)
        .fold(f64::INFINITY, f64::min);
    least_of_alike(prices, least + noise)
}

/// The least error of all that cost hardly more than the cheapest with an error of at most `bound`:
/// which of them is the fastest changes from run to run, and their errors do not.
fn least_of_alike(prices: &[Price], bound: f64) -> Option<usize> {
    let cheapest = prices[cheapest(prices, bound, |member| prices[member].error)?]
        .cost
        .median;
    let costs_as_much = |&member: &usize| prices[member].cost.median <= ALIKE * cheapest;
    (0..prices.len())
        .filter(costs_as_much)
        .min_by(|a, b| prices[*a].error.total_cmp(&prices[*b].error))
}

/// The smallest budget that holds a time (ms).
fn budget(ms: f64) -> f64 {
    let decade = 10_f64.powf(ms.log10().floor());
    BUDGETS
        .iter()
        .map(|step| step * decade)
        .find(|budget| *budget >= ms)
        .unwrap_or(10.0 * decade)
}

/// Budgets (ms), and the best that each buys; those that buy nothing more than a smaller one are
/// left out.
fn budgets(prices: &[Price], noise: f64) -> Vec<(f64, usize)> {
    let finite: Vec<usize> = (0..prices.len())
        .filter(|&member| prices[member].cost.median.is_finite())
        .collect();
    let distinct = distinct_front(
        &finite
            .iter()
            .map(|&member| prices[member])
            .collect::<Vec<_>>(),
        noise,
    );
    let mut budgets: Vec<f64> = distinct
        .into_iter()
        .map(|member| budget(prices[finite[member]].cost.median))
        .collect();
    budgets.dedup();
    let mut found: Vec<(f64, usize)> = Vec::new();
    for (rank, ms) in budgets.iter().enumerate() {
        let fitting: Vec<usize> = finite
            .iter()
            .copied()
            .filter(|&member| prices[member].cost.median <= *ms)
            .collect();
        let Some(member) = best(
            &fitting
                .iter()
                .map(|&member| prices[member])
                .collect::<Vec<_>>(),
            noise,
        )
        .map(|best| fitting[best]) else {
            continue;
        };
        let is_usable = prices[member].error <= USABLE || rank + 1 == budgets.len();
        if is_usable && found.last().is_none_or(|(_, known)| *known != member) {
            found.push((*ms, member));
        }
    }
    found
}

impl Section {
    /// What to take, for each number of bounces.
    pub fn answers(&self) -> Vec<Answer> {
        let can_be_chosen = |point: &Point| {
            point.error.is_some()
                && point.frame_ms().is_some()
                && point.bounces != Bounces::Count(0)
        };
        let mut bounces: Vec<Bounces> = self
            .points
            .iter()
            .filter(|point| can_be_chosen(point))
            .map(|point| point.bounces)
            .collect();
        bounces.sort();
        bounces.dedup();
        let answers_of = |bounces: Bounces| {
            let is_member = |index: &usize| {
                self.points[*index].bounces == bounces && can_be_chosen(&self.points[*index])
            };
            let points: Vec<usize> = (0..self.points.len()).filter(is_member).collect();
            let choice = Choice {
                section: self,
                noise: self.noise(&points),
                points,
            };
            let answer = |(goal, member): (Goal, Option<usize>)| Answer {
                bounces,
                goal,
                point: member.map(|member| choice.points[member]),
            };
            choice.answers().into_iter().map(answer).collect::<Vec<_>>()
        };
        bounces.into_iter().flat_map(answers_of).collect()
    }

    /// The same, each point once.
    pub fn picks(&self) -> Vec<Picks> {
        let mut all: Vec<Picks> = Vec::new();
        for Answer {
            bounces,
            goal,
            point,
        } in self.answers()
        {
            if all.last().is_none_or(|last| last.bounces != bounces) {
                all.push(Picks {
                    bounces,
                    picks: Vec::new(),
                    unmet: Vec::new(),
                });
            }
            let Some(Picks { picks, unmet, .. }) = all.last_mut() else {
                continue;
            };
            match (
                point,
                picks.iter_mut().find(|pick| Some(pick.index) == point),
            ) {
                (None, _) => unmet.push(goal),
                (Some(_), Some(pick)) => pick.goals.push(goal),
                (Some(index), None) => picks.push(Pick {
                    index,
                    goals: vec![goal],
                }),
            }
        }
        let ms = |pick: &Pick| {
            self.points[pick.index]
                .frame_ms()
                .map_or(f64::INFINITY, |spread| spread.median)
        };
        all.iter_mut()
            .for_each(|picks| picks.picks.sort_by(|a, b| ms(a).total_cmp(&ms(b))));
        all
    }

    /// The best point of one technique in frames of at most `ms`, chosen as the answers are.
    pub fn best_of(&self, technique: &str, bounces: Bounces, ms: f64) -> Option<usize> {
        let fits = |index: &usize| {
            let point = &self.points[*index];
            point.technique == technique
                && point.bounces == bounces
                && point.error.is_some()
                && point.frame_ms().is_some_and(|spread| spread.median <= ms)
        };
        let points: Vec<usize> = (0..self.points.len()).filter(fits).collect();
        let choice = Choice {
            section: self,
            noise: self.noise(&points),
            points,
        };
        best(&choice.prices(Point::frame_ms), choice.noise).map(|member| choice.points[member])
    }

    /// A line a pick, and one of what was not reached.
    pub fn answer_lines(&self) -> Vec<String> {
        let mut lines: Vec<String> = self.machine.text().into_iter().collect();
        for Picks {
            bounces,
            picks,
            unmet,
        } in self.picks()
        {
            lines.extend(picks.iter().map(|pick| {
                format!(
                    "{}, {}: {}",
                    bounces_text(bounces),
                    goals_text(&pick.goals).join("; "),
                    self.point_text(&self.points[pick.index])
                )
            }));
            if !unmet.is_empty() {
                lines.push(format!(
                    "{}, {}: not reached; {}",
                    bounces_text(bounces),
                    goals_text(&unmet).join("; "),
                    self.least_error_text(bounces)
                ));
            }
        }
        lines
    }

    fn point_text(&self, point: &Point) -> String {
        let changes = if point.changes.is_empty() {
            String::new()
        } else {
            format!(" with {}", point.changes_text())
        };
        let time = |what: &str, spread: Option<Spread>| {
            spread.map(
                |Spread {
                     median, min, max, ..
                 }| {
                    format!(
                        "{what} {} ms ({} to {})",
                        short(median),
                        short(min),
                        short(max)
                    )
                },
            )
        };
        let memory = format!(
            "{} MiB{}",
            mib(point.memory_bytes),
            point
                .structure_bytes
                .map(|bytes| format!(" (structure {})", mib(bytes)))
                .unwrap_or_default()
        );
        let error = point.error.map(|error| {
            format!(
                "error {}, bias {}",
                error_text(error.rel_rmse),
                bias_text(error.bias)
            )
        });
        let worst = point.worst_material().filter(|_| point.materials.len() > 1);
        let worst = worst.map(|(name, error)| {
            format!(
                "on {name} error {}, bias {}",
                error_text(error.rel_rmse),
                bias_text(error.bias)
            )
        });
        let fine = point.pixel_error.map(|error| {
            format!(
                "by pixel {}{}",
                error_text(error.rel_rmse),
                if is_rough(point) { " (rough)" } else { "" }
            )
        });
        let parts = [
            time("frame", point.frame_ms()),
            time("with a build", point.moving_ms()),
            Some(memory),
            error,
            worst,
            fine,
        ];
        format!(
            "{}{changes}: {}",
            point.name(),
            parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
        )
    }

    /// The least error at this number of bounces, for goals that no point reached.
    pub(super) fn least_error_text(&self, bounces: Bounces) -> String {
        let errors: Vec<f64> = self
            .points
            .iter()
            .filter(|point| point.bounces == bounces)
            .filter_map(|point| Some(point.error?.rel_rmse))
            .collect();
        format!(
            "the least error of {} is {}",
            counted(errors.len(), "point"),
            error_text(errors.iter().copied().fold(f64::INFINITY, f64::min))
        )
    }
}

/// Goals in words; goals of one kind are joined.
pub(super) fn goals_text(goals: &[Goal]) -> Vec<String> {
    let bounds = |pick: fn(&Goal) -> Option<f64>| {
        goals
            .iter()
            .filter_map(pick)
            .map(percent)
            .collect::<Vec<_>>()
            .join(", ")
    };
    let time = bounds(|goal| {
        if let Goal::Time(bound) = goal {
            Some(*bound)
        } else {
            None
        }
    });
    let memory = bounds(|goal| {
        if let Goal::Memory(bound) = goal {
            Some(*bound)
        } else {
            None
        }
    });
    let budgets = goals
        .iter()
        .filter(|goal| matches!(goal, Goal::Frame(_) | Goal::CleanFrame(_) | Goal::Moving(_)))
        .map(ToString::to_string);
    let of_errors = [("least time", time), ("least memory", memory)]
        .into_iter()
        .filter(|(_, bounds)| !bounds.is_empty());
    budgets
        .chain(of_errors.map(|(what, bounds)| format!("{what}, error at most {bounds}")))
        .collect()
}

/// Whether its picture is [`ROUGH`].
pub(super) fn is_rough(point: &Point) -> bool {
    point.fine_error().is_some_and(|error| error > ROUGH)
}

/// The bytes as a text in MiB.
pub(super) fn mib(bytes: u64) -> String {
    short(bytes as f64 / MIB)
}

#[cfg(test)]
mod tests {
    use super::super::point::PointError;
    use super::super::point::tests::point;
    use super::super::section::tests::section;
    use super::*;

    fn named(section: &Section, bounces: u32, goal: Goal) -> Option<&str> {
        let answers = section.answers();
        let found = answers
            .iter()
            .find(|answer| answer.bounces == Bounces::Count(bounces) && answer.goal == goal);
        found.map(|answer| {
            answer.point.map_or("not measured", |index| {
                section.points[index].technique.as_str()
            })
        })
    }

    fn goals(section: &Section) -> Vec<String> {
        let name = |answer: Answer| {
            format!(
                "{}: {}",
                answer.goal,
                answer
                    .point
                    .map_or("–", |index| section.points[index].technique.as_str())
            )
        };
        section
            .answers()
            .into_iter()
            .filter(|answer| answer.bounces == Bounces::Count(1))
            .map(name)
            .collect()
    }

    /// Frames take 14, 104 and 1004 ms, builds 1 ms each; `b` is slower and worse than `a`.
    #[test]
    fn each_goal_has_its_cheapest_point() {
        let wanted = [
            "light moves, 15 ms a frame: a",
            "light moves, 1500 ms a frame: c",
            "everything moves, 15 ms a frame: a",
            "everything moves, 1500 ms a frame: c",
            "least time, error at most 5%: c",
            "least time, error at most 10%: c",
            "least time, error at most 20%: a",
            "least memory, error at most 5%: c",
            "least memory, error at most 10%: c",
            "least memory, error at most 20%: a",
        ];
        assert_eq!(goals(&section()), wanted);
        assert_eq!(named(&section(), 2, Goal::Time(0.05)), Some("d"));
        let mut slowed = section();
        slowed.points[0] = point("a", 1, [9.0, 200.0], 1 << 20, 0.15);
        assert_eq!(named(&slowed, 1, Goal::Frame(15.0)), Some("a"));
        assert_eq!(
            named(&slowed, 1, Goal::Moving(150.0)),
            Some("b"),
            "{:?}",
            goals(&slowed)
        );
    }

    /// What is better by less than the noise of 0.002 is not worth more time.
    #[test]
    fn noise_buys_nothing() {
        let mut close = section();
        close.points[1] = point("b", 1, [99.0, 1.0], 2 << 20, 0.149);
        assert_eq!(named(&close, 1, Goal::Frame(150.0)), None);
        close.points[1] = point("b", 1, [99.0, 1.0], 2 << 20, 0.14);
        assert_eq!(named(&close, 1, Goal::Frame(150.0)), Some("b"));
    }

    /// A grainy pick has a clean one beside it; without the grain it has none.
    #[test]
    fn grainy_picks_have_clean_ones_beside_them() {
        let mut grainy = section();
        assert_eq!(named(&grainy, 1, Goal::CleanFrame(1500.0)), None);
        grainy.points[2].pixel_error = Some(PointError {
            rel_rmse: 0.14,
            bias: 0.0,
        });
        assert!(is_rough(&grainy.points[2]));
        assert_eq!(
            named(&grainy, 1, Goal::CleanFrame(1500.0)),
            None,
            "a is worse by pixel too"
        );
        grainy.points[2].pixel_error = Some(PointError {
            rel_rmse: 0.2,
            bias: 0.0,
        });
        assert_eq!(named(&grainy, 1, Goal::CleanFrame(1500.0)), Some("a"));
        let text = grainy
            .answer_lines()
            .into_iter()
            .find(|text| text.contains(": c cones"))
            .unwrap_or_default();
        assert!(text.contains("by pixel 20.0% (rough)"), "{text}");
    }

    /// Settings are told each time, bias is said to be whose it is, and what nobody measured is not
    /// called impossible.
    #[test]
    fn answers_in_words_leave_nothing_out() {
        let lines = section().answer_lines();
        let wanted = "1 bounce, light moves, 1500 ms a frame; everything moves, 1500 ms a frame; \
                      least time, error at most 5%, 10%; least memory, error at most 5%, 10%: c \
                      cones 64³ with cones=999: frame 1004 ms (904 to 1205), with a build 1005 ms \
                      (904 to 1206), 6 MiB (structure 3), error 4.0%, bias -2.0%, on lamp error \
                      8.0%, bias +4.0%, by pixel 4.3%";
        assert!(lines.contains(&wanted.to_owned()), "{lines:#?}");
        let mut worse = section();
        worse.points.retain(|point| point.technique == "b");
        let wanted = "1 bounce, least time, error at most 5%, 10%; least memory, error at most \
                      5%, 10%: not reached; the least error of 1 point is 16.0%";
        assert!(
            worse.answer_lines().contains(&wanted.to_owned()),
            "{:#?}",
            worse.answer_lines()
        );
    }

    /// Each technique at its best: what is better by less than the noise of 0.002 is not taken, nor
    /// is what does not fit.
    #[test]
    fn techniques_are_compared_at_their_best() {
        let mut section = section();
        section
            .points
            .push(point("a", 1, [19.0, 1.0], 1 << 20, 0.1));
        section
            .points
            .push(point("a", 1, [29.0, 1.0], 1 << 20, 0.099));
        let best = |technique, ms| section.best_of(technique, Bounces::Count(1), ms);
        assert_eq!(
            [
                best("a", 15.0),
                best("a", 30.0),
                best("a", f64::INFINITY),
                best("b", 30.0),
                best("d", 1e9)
            ],
            [Some(0), Some(4), Some(4), None, None]
        );
    }

    /// Less memory is less of all memory, although another point's structure is smaller.
    #[test]
    fn memory_is_all_of_it() {
        let mut section = section();
        section.points[1] = point("b", 1, [99.0, 1.0], 1 << 10, 0.04);
        section.points[1].memory_bytes = 60 << 20;
        assert_eq!(named(&section, 1, Goal::Memory(0.05)), Some("c"));
        section.points[1].memory_bytes = 5 << 20;
        assert_eq!(named(&section, 1, Goal::Memory(0.05)), Some("b"));
    }

    fn price(cost: f64, error: f64) -> Price {
        Price {
            cost: Spread {
                median: cost,
                min: cost,
                max: cost,
                n: 1,
            },
            error,
        }
    }

    /// The cheapest of all points as good as the best is taken, but a saving of a twentieth of the
    /// time does not count.
    #[test]
    fn a_little_time_does_not_decide() {
        assert_eq!(
            best(
                &[price(95.0, 0.06), price(98.0, 0.05), price(120.0, 0.045)],
                0.02
            ),
            Some(1)
        );
        assert_eq!(
            best(
                &[price(80.0, 0.06), price(98.0, 0.05), price(120.0, 0.045)],
                0.02
            ),
            Some(0)
        );
        assert_eq!(best(&[], 0.02), None);
    }

    /// Of two that are equally fast but for the machine's noise, the one with less error is taken
    /// whichever came out faster.
    #[test]
    fn the_fastest_is_the_same_in_every_run() {
        for times in [[51.8, 56.0], [52.0, 49.0]] {
            let prices = [
                price(times[0], 0.044),
                price(times[1], 0.037),
                price(30.0, 0.09),
            ];
            assert_eq!(least_of_alike(&prices, 0.05), Some(1));
            assert_eq!(least_of_alike(&prices, 0.03), None);
        }
        assert_eq!(
            least_of_alike(&[price(50.0, 0.044), price(60.0, 0.037)], 0.05),
            Some(0)
        );
    }

    #[test]
    fn budgets_hold_their_times() {
        assert_eq!(
            [0.9, 1.0, 1.01, 13.0, 16.0, 71.0, 123.0, 7001.0].map(budget),
            [1.0, 1.0, 1.5, 15.0, 20.0, 100.0, 150.0, 10000.0]
        );
        assert_eq!(
            budgets(
                &[
                    price(12.0, 0.9),
                    price(13.0, 0.3),
                    price(14.0, 0.2),
                    price(40.0, 0.1)
                ],
                0.01
            ),
            [(15.0, 2), (50.0, 3)]
        );
        assert_eq!(
            budgets(&[price(12.0, 0.9), price(40.0, 0.8)], 0.01),
            [(50.0, 1)],
            "no answer is good, so that the best is given"
        );
        assert!(budgets(&[], 0.01).is_empty());
    }
}
