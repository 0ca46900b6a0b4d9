//! What is asked for: bounds, and what is best within them.

use std::cmp::Ordering;

/// What a candidate costs, and how wrong it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Time of a frame's indirect light (ms), above 0.
    pub ms: f64,
    /// The least time of all frames that were measured (ms).
    pub fastest_ms: f64,
    /// Error of the indirect light, relative to the mean of the reference, above 0.
    pub error: f64,
    /// Bytes that the technique keeps in the world.
    pub bytes: f64,
}

impl Figures {
    /// The largest of each over several views of a scene; `None` without views. A bound that they
    /// meet, all views meet.
    pub fn worst(views: &[Figures]) -> Option<Figures> {
        let slowest = views.iter().max_by(|a, b| a.ms.total_cmp(&b.ms))?;
        let most = |of: fn(&Figures) -> f64| views.iter().map(of).fold(0.0, f64::max);
        Some(Figures {
            error: most(|it| it.error),
            bytes: most(|it| it.bytes),
            ..*slowest
        })
    }
}

/// What the figures may be at most; infinite where nothing is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Bound of the error. Where there is one, the least time is looked for, and otherwise the
    /// least error.
    pub max_error: f64,
    /// Bound of the time (ms).
    pub max_ms: f64,
    /// Bound of the memory (bytes).
    pub max_bytes: f64,
}

/// What is to be as small as possible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// Time, where an error is allowed.
    Time,
    /// Error, where the costs are bounded.
    Error,
}

/// Of times that differ by less than this factor none counts as the least: the memory decides, then
/// who was known first, so that a change of a setting has to gain something.
const SAME_TIME: f64 = 1.05;

impl Bounds {
    /// Nothing is asked.
    pub const NONE: Bounds = Bounds {
        max_error: f64::INFINITY,
        max_ms: f64::INFINITY,
        max_bytes: f64::INFINITY,
    };

    /// What is to be as small as possible within the bounds.
    pub fn aim(&self) -> Aim {
        if self.max_error.is_finite() {
            Aim::Time
        } else {
            Aim::Error
        }
    }

    /// Whether figures are within all bounds.
    pub fn are_met(&self, figures: &Figures) -> bool {
        self.excess(figures) <= 1.0
    }

    /// The largest ratio of a figure and its bound: above 1 where a bound is not met.
    pub fn excess(&self, figures: &Figures) -> f64 {
        let Figures {
            ms, error, bytes, ..
        } = *figures;
        (error / self.max_error)
            .max(ms / self.max_ms)
            .max(bytes / self.max_bytes)
    }

    /// Whether figures rule a candidate out even if its time is less by the factor `slack`: they
    /// are beyond a bound, or worse than those of the best that is known, where there is one.
    pub fn rule_out(
        &self,
        figures: &Figures,
        best: Option<&Figures>,
        slack: f64,
        noise: f64,
    ) -> bool {
        let faster = Figures {
            ms: figures.ms / slack,
            ..*figures
        };
        let is_worse = best.is_some_and(|best| match self.aim() {
            Aim::Time => faster.ms > best.ms,
            Aim::Error => faster.error > best.error + noise,
        });
        is_worse || !self.are_met(&faster)
    }

    /// The best of all that are within the bounds. Errors that differ by less than `noise` count
    /// as one, and so do times within 5%.
    pub fn best(&self, all: &[(usize, Figures)], noise: f64) -> Option<usize> {
        let met: Vec<(usize, Figures)> = all
            .iter()
            .filter(|(_, figures)| self.are_met(figures))
            .copied()
            .collect();
        let least = |of: fn(&Figures) -> f64| {
            let values = met.iter().map(|(_, figures)| of(figures));
            values.fold(f64::INFINITY, f64::min)
        };
        let (least_ms, least_error) = (least(|it| it.ms), least(|it| it.error));
        let best = match self.aim() {
            Aim::Time => {
                let rank = |(index, it): &(usize, Figures)| [it.bytes, *index as f64];
                met.iter()
                    .filter(|(_, it)| it.ms <= SAME_TIME * least_ms)
                    .min_by(|a, b| compare(&rank(a), &rank(b)))
            }
            Aim::Error => {
                let rank = |(index, it): &(usize, Figures)| [it.ms, it.bytes, *index as f64];
                met.iter()
                    .filter(|(_, it)| it.error <= least_error + noise)
                    .min_by(|a, b| compare(&rank(a), &rank(b)))
            }
        };
        best.map(|(index, _)| *index)
    }

    /// What comes nearest to the bounds; of what is as near the fastest.
    pub fn nearest(&self, all: &[(usize, Figures)]) -> Option<usize> {
        let distance = |figures: &Figures| [self.excess(figures).max(1.0), figures.ms];
        all.iter()
            .min_by(|a, b| compare(&distance(&a.1), &distance(&b.1)))
            .map(|(index, _)| *index)
    }
}

fn compare(a: &[f64], b: &[f64]) -> Ordering {
    let pairs = a.iter().zip(b).map(|(a, b)| a.total_cmp(b));
    pairs.fold(Ordering::Equal, Ordering::then)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(figures: &[[f64; 3]]) -> Vec<(usize, Figures)> {
        let figures = figures.iter().map(|&[ms, error, bytes]| Figures {
            ms,
            fastest_ms: ms,
            error,
            bytes,
        });
        figures.enumerate().collect()
    }

    /// Planted: the fastest is too wrong, the next two take as long, and the second of them needs
    /// less memory.
    #[test]
    fn an_error_bound_takes_the_least_time() {
        let all = all(&[
            [1.0, 0.5, 1.0],
            [2.0, 0.1, 9.0],
            [2.02, 0.1, 4.0],
            [3.0, 0.1, 1.0],
        ]);
        let bounds = Bounds {
            max_error: 0.1,
            ..Bounds::NONE
        };
        assert_eq!((bounds.aim(), bounds.best(&all, 0.0)), (Aim::Time, Some(2)));
        let small = Bounds {
            max_bytes: 3.0,
            ..bounds
        };
        assert_eq!(small.best(&all, 0.0), Some(3));
        let fast = Bounds {
            max_ms: 1.5,
            ..bounds
        };
        assert_eq!(fast.best(&all, 0.0), None);
        assert_eq!(fast.nearest(&all), Some(1), "a third too slow");
    }

    /// Planted: one view is the slowest, another the most wrong, a third needs the most memory.
    #[test]
    fn the_worst_view_counts() {
        let views: Vec<Figures> = all(&[[3.0, 0.1, 1.0], [1.0, 0.4, 1.0], [2.0, 0.2, 5.0]])
            .into_iter()
            .map(|(_, figures)| figures)
            .collect();
        let worst = Figures::worst(&views).unwrap_or(views[0]);
        assert_eq!((worst.ms, worst.error, worst.bytes), (3.0, 0.4, 5.0));
        assert_eq!(worst.fastest_ms, 3.0, "of the slowest view");
        assert!(Figures::worst(&[]).is_none());
    }

    /// Planted: what a bound rules out for certain, and what a slower machine may have spoiled.
    #[test]
    fn ruled_out_is_what_cannot_be_the_best() {
        let [good, wrong, slow, large] = [
            [1.0, 0.1, 1.0],
            [1.0, 0.11, 1.0],
            [1.3, 0.05, 1.0],
            [1.0, 0.1, 9.0],
        ]
        .map(|[ms, error, bytes]| Figures {
            ms,
            fastest_ms: ms,
            error,
            bytes,
        });
        let bounds = Bounds {
            max_error: 0.1,
            max_bytes: 4.0,
            ..Bounds::NONE
        };
        let is_out = |it: &Figures, slack| bounds.rule_out(it, Some(&good), slack, 0.02);
        assert!(is_out(&wrong, 1.25) && is_out(&large, 1.25) && is_out(&slow, 1.25));
        assert!(!is_out(&good, 1.25) && !is_out(&slow, 1.5));
        assert!(
            !bounds.rule_out(&slow, None, 1.25, 0.02),
            "nothing is better yet"
        );
        let fast = Bounds {
            max_ms: 1.1,
            ..Bounds::NONE
        };
        let is_out = |it: &Figures, slack| fast.rule_out(it, Some(&good), slack, 0.005);
        assert!(is_out(&wrong, 1.25) && is_out(&slow, 1.0) && !is_out(&slow, 1.25));
        assert!(
            !fast.rule_out(&wrong, Some(&good), 1.25, 0.02),
            "as good within the noise"
        );
    }

    /// Planted: errors within the noise are one, and the fastest of them is taken.
    #[test]
    fn a_time_bound_takes_the_least_error() {
        let all = all(&[
            [1.0, 0.5, 1.0],
            [2.0, 0.105, 1.0],
            [3.0, 0.1, 1.0],
            [9.0, 0.01, 1.0],
        ]);
        let bounds = Bounds {
            max_ms: 4.0,
            ..Bounds::NONE
        };
        assert_eq!(
            (bounds.aim(), bounds.best(&all, 0.0)),
            (Aim::Error, Some(2))
        );
        assert_eq!(bounds.best(&all, 0.01), Some(1));
    }
}
