//! The search, whatever is measured and however.

use std::collections::{BTreeMap, BTreeSet};

use super::bound::{Aim, Bounds, Figures};
use super::estimate::Estimator;

/// One technique with all its settings, as the search knows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Name of the technique.
    pub technique: String,
    /// The preset that the settings started from.
    pub preset: Option<String>,
    /// The settings that have an effect, and their values as on the command line.
    pub settings: BTreeMap<String, String>,
    /// The settings of which a larger value costs more, all else alike.
    pub amounts: Vec<String>,
    /// Settings that differ from the preset's.
    pub changes: usize,
}

/// What measures candidates. They have numbers in the order in which they became known.
pub trait Trial {
    /// Why the search cannot go on.
    type Error;

    /// Measures a candidate in a round, from 1 on; later rounds make its time more certain.
    fn measure(&mut self, candidate: usize, round: u32) -> Result<(), Self::Error>;

    /// What was found of a measured candidate; `None` where there is nothing to compare, as the
    /// device refused it.
    fn figures(&self, candidate: usize) -> Option<Figures>;

    /// Standard error of the reference: errors that differ by less count as one.
    fn noise(&self) -> f64;

    /// How long a measurement takes in one round if the indirect light of a frame takes `ms`; only
    /// ratios count.
    fn effort(&self, candidate: usize, ms: f64) -> f64;

    /// Candidates that differ from this one in one setting by a step, and are not known yet. They
    /// are numbered from now on.
    fn neighbours(&mut self, candidate: usize) -> Vec<Candidate>;
}

/// How a search ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The best within the bounds.
    pub best: Option<usize>,
    /// All candidates, those that the local search added last.
    pub candidates: Vec<Candidate>,
    /// The candidates that were measured, in that order.
    pub measured: Vec<usize>,
    /// Candidates that the bounds ruled out before they were measured.
    pub ruled_out: usize,
    /// Estimated effort of one round of each candidate, as [`Trial::effort`] has it.
    pub efforts: Vec<f64>,
}

/// A search that is under way.
pub struct Search<'t, T: Trial> {
    trial: &'t mut T,
    bounds: Bounds,
    rounds: u32,
    candidates: Vec<Candidate>,
    estimator: Estimator,
    /// The measured candidates, and the rounds that each has had.
    measured: Vec<(usize, u32)>,
}

/// Estimates of the logarithms of a candidate's figures.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    ms: f64,
    error: f64,
    bytes: f64,
    /// Scale of their distributions, which are taken to be logistic.
    scale: f64,
}

/// The powers with which figures follow the product of a candidate's amounts, before anything is
/// measured: rough means over the recorded grids.
const POWERS: Figures = Figures {
    ms: 1.0,
    error: -0.3,
    bytes: 2.0,
};

/// The search ends where no candidate is expected to gain so much: a share of the best time or
/// error, times the chance that it meets the bounds.
const LEAST_GAIN: f64 = 0.005;

/// What meets the bounds for the first time gains so much, times the chance that it does.
const FIRST_GAIN: f64 = 0.5;

/// A candidate with more of an amount takes at least its smaller sibling's time over this.
const SLACK: f64 = 1.25;

/// Times of one round are this far apart at most where the machine is steady.
const SPREAD: f64 = 0.25;

/// Measurements of the local search.
const LOCAL: usize = 16;

impl<'t, T: Trial> Search<'t, T> {
    /// A search among candidates; `rounds` is how often the best are measured.
    pub fn new(trial: &'t mut T, bounds: Bounds, rounds: u32, candidates: Vec<Candidate>) -> Self {
        let mut estimator = Estimator::default();
        candidates
            .iter()
            .for_each(|candidate| estimator.add(candidate));
        Search {
            trial,
            bounds,
            rounds,
            candidates,
            estimator,
            measured: Vec::new(),
        }
    }

    /// Searches the candidates, then around the best of them.
    pub fn run(mut self) -> Result<Found, T::Error> {
        for candidate in self.simplest() {
            self.measure(candidate)?;
        }
        self.explore(usize::MAX)?;
        self.halve()?;
        let mut left = LOCAL;
        let mut centres = BTreeSet::new();
        while let Some(centre) = self.centre().filter(|centre| centres.insert(*centre)) {
            for neighbour in self.trial.neighbours(centre) {
                self.estimator.add(&neighbour);
                self.candidates.push(neighbour);
            }
            left -= self.explore(left)?;
            self.halve()?;
        }
        Ok(self.found())
    }

    fn found(self) -> Found {
        let ruled_out = (0..self.candidates.len())
            .filter(|candidate| !self.is_measured(*candidate) && self.is_ruled_out(*candidate));
        let efforts = self.estimates().into_iter().enumerate();
        let efforts = efforts.map(|(index, estimate)| self.trial.effort(index, estimate.ms.exp()));
        Found {
            best: self.bounds.best(&self.figures(), self.trial.noise()),
            ruled_out: ruled_out.count(),
            efforts: efforts.collect(),
            measured: self
                .measured
                .iter()
                .map(|(candidate, _)| *candidate)
                .collect(),
            candidates: self.candidates,
        }
    }

    /// One candidate of each technique: the one with the fewest changes, and the least amounts.
    fn simplest(&self) -> Vec<usize> {
        let mut simplest: BTreeMap<&str, usize> = BTreeMap::new();
        for (index, candidate) in self.candidates.iter().enumerate() {
            let rank = |candidate: &Candidate| (candidate.changes, candidate.total_amount());
            let known = simplest.entry(&candidate.technique).or_insert(index);
            if rank(candidate) < rank(&self.candidates[*known]) {
                *known = index;
            }
        }
        simplest.into_values().collect()
    }

    fn measure(&mut self, candidate: usize) -> Result<(), T::Error> {
        self.trial.measure(candidate, 1)?;
        self.measured.push((candidate, 1));
        if self.trial.figures(candidate).is_some() {
            self.estimator.observe(candidate);
        }
        Ok(())
    }

    fn is_measured(&self, candidate: usize) -> bool {
        self.measured
            .iter()
            .any(|(measured, _)| *measured == candidate)
    }

    /// The figures of what was measured.
    fn figures(&self) -> Vec<(usize, Figures)> {
        let measured = self.measured.iter();
        measured
            .filter_map(|&(candidate, _)| Some((candidate, self.trial.figures(candidate)?)))
            .collect()
    }

    /// What the local search starts from.
    fn centre(&self) -> Option<usize> {
        let all = self.figures();
        let best = self.bounds.best(&all, self.trial.noise());
        best.or_else(|| self.bounds.nearest(&all))
    }

    /// Measures what promises most, until nothing promises enough or `limit` measurements were
    /// made. Returns how many were made.
    fn explore(&mut self, limit: usize) -> Result<usize, T::Error> {
        let mut count = 0;
        while count < limit {
            let Some(next) = self.most_promising() else {
                break;
            };
            self.measure(next)?;
            count += 1;
        }
        Ok(count)
    }

    /// The candidate with the largest gain for its effort.
    fn most_promising(&self) -> Option<usize> {
        let all = self.figures();
        let best = self.bounds.best(&all, 0.0);
        let best = best.and_then(|best| self.trial.figures(best));
        let estimates = self.estimates();
        let is_open = |candidate: &usize| {
            !self.is_measured(*candidate)
                && estimates[*candidate].gain(&self.bounds, best, self.trial.noise()) >= LEAST_GAIN
                && !self.is_ruled_out(*candidate)
        };
        let promise = |candidate: usize| {
            let estimate = estimates[candidate];
            estimate.gain(&self.bounds, best, self.trial.noise())
                / self.trial.effort(candidate, estimate.ms.exp())
        };
        let open = (0..self.candidates.len()).filter(is_open);
        open.max_by(|a, b| promise(*a).total_cmp(&promise(*b)))
    }

    fn estimates(&self) -> Vec<Estimate> {
        let all = self.figures();
        let means = |of: fn(&Figures) -> f64, power: f64| {
            let logs: Vec<f64> = all.iter().map(|(_, it)| of(it).ln()).collect();
            self.estimator.means(&logs, power)
        };
        let ms = means(|it| it.ms, POWERS.ms);
        let error = means(|it| it.error, POWERS.error);
        let bytes = means(|it| it.bytes, POWERS.bytes);
        let estimate = |index: usize| Estimate {
            ms: ms[index],
            error: error[index],
            bytes: bytes[index],
            scale: self.estimator.deviation(index) * SCALE_OF_DEVIATION,
        };
        (0..self.candidates.len()).map(estimate).collect()
    }

    /// Whether a bound rules a candidate out, as a sibling with less of everything shows.
    fn is_ruled_out(&self, candidate: usize) -> bool {
        let all = self.figures();
        let best = self.bounds.best(&all, 0.0);
        let best_ms = best
            .and_then(|best| self.trial.figures(best))
            .map(|best| best.ms);
        let most_ms = match self.bounds.aim() {
            Aim::Time => best_ms.unwrap_or(f64::INFINITY).min(self.bounds.max_ms),
            Aim::Error => self.bounds.max_ms,
        };
        self.measured.iter().any(|&(measured, _)| {
            let is_too_much = match self.trial.figures(measured) {
                None => true,
                Some(it) => it.bytes > self.bounds.max_bytes || it.ms > SLACK * most_ms,
            };
            is_too_much && self.candidates[measured].is_less(&self.candidates[candidate])
        })
    }

    /// Measures the best again, round by round, and fewer in each: a quarter of those before, of
    /// which none is so slow that it can no longer be the best.
    fn halve(&mut self) -> Result<(), T::Error> {
        for round in 2..=self.rounds {
            let share = (self.measured.len() >> (2 * (round - 1))).max(2);
            for candidate in self.contenders(share) {
                let had = self
                    .measured
                    .iter_mut()
                    .find(|(measured, _)| *measured == candidate);
                if let Some((_, had)) = had.filter(|(_, had)| *had < round) {
                    *had = round;
                    self.trial.measure(candidate, round)?;
                }
            }
        }
        Ok(())
    }

    /// Those that may be the best if times are a little off, best first.
    fn contenders(&self, most: usize) -> Vec<usize> {
        let mut all = self.figures();
        let within = Bounds {
            max_ms: self.bounds.max_ms * (1.0 + SPREAD),
            ..self.bounds
        };
        let value = |it: &Figures| match self.bounds.aim() {
            Aim::Time => it.ms / (1.0 + SPREAD),
            Aim::Error => it.error - self.trial.noise(),
        };
        let best = self
            .bounds
            .best(&all, 0.0)
            .and_then(|best| self.trial.figures(best));
        all.retain(|(_, it)| {
            let may_be_best = best.is_none_or(|best| match self.bounds.aim() {
                Aim::Time => value(it) <= best.ms,
                Aim::Error => value(it) <= best.error,
            });
            within.are_met(it) && may_be_best
        });
        all.sort_by(|a, b| value(&a.1).total_cmp(&value(&b.1)));
        all.truncate(most);
        all.into_iter().map(|(candidate, _)| candidate).collect()
    }
}

/// Scale of a logistic distribution with a standard deviation of 1: sqrt(3) / pi.
const SCALE_OF_DEVIATION: f64 = 0.551_328_895_421_792;

impl Estimate {
    /// What is expected to be gained if this is measured, while `best` is the best that is known.
    fn gain(&self, bounds: &Bounds, best: Option<Figures>, noise: f64) -> f64 {
        let Some(best) = best else {
            return FIRST_GAIN
                * self.chance(self.error, bounds.max_error)
                * self.chance(self.ms, bounds.max_ms)
                * self.chance(self.bytes, bounds.max_bytes);
        };
        let fits = self.chance(self.bytes, bounds.max_bytes);
        match bounds.aim() {
            Aim::Time => {
                fits * self.chance(self.error, bounds.max_error) * self.less(self.ms, best.ms)
            }
            Aim::Error => {
                let wanted = (best.error - noise).max(f64::MIN_POSITIVE);
                fits * self.chance(self.ms, bounds.max_ms) * self.less(self.error, wanted)
            }
        }
    }

    /// The chance that a figure is at most this.
    fn chance(&self, log: f64, most: f64) -> f64 {
        1.0 / (1.0 + ((log - most.ln()) / self.scale).exp())
    }

    /// By how much the logarithm of a figure is expected to be below this one's, 0 where it is not.
    fn less(&self, log: f64, most: f64) -> f64 {
        let above = (log - most.ln()) / self.scale;
        self.scale
            * if above < -30.0 {
                -above
            } else {
                (-above).exp().ln_1p()
            }
    }
}

impl Candidate {
    fn amount(&self, name: &str) -> Option<f64> {
        self.settings
            .get(name)?
            .parse()
            .ok()
            .filter(|amount| *amount > 0.0)
    }

    /// The product of all amounts: what has less of each has less.
    pub(super) fn total_amount(&self) -> f64 {
        self.amounts
            .iter()
            .filter_map(|name| self.amount(name))
            .product()
    }

    /// Whether it is the other one with less of some amount and more of none.
    fn is_less(&self, other: &Candidate) -> bool {
        let is_no_more = |name: &String| {
            self.amount(name)
                .zip(other.amount(name))
                .is_some_and(|(less, more)| less <= more)
        };
        let is_alike = |(name, value): (&String, &String)| {
            other.settings.get(name) == Some(value) || self.amounts.contains(name)
        };
        self.technique == other.technique
            && self.amounts == other.amounts
            && self.settings.len() == other.settings.len()
            && self.settings.iter().all(is_alike)
            && self.amounts.iter().all(is_no_more)
    }
}
