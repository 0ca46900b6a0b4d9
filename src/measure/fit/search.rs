//! The search, whatever is measured and however.

use std::collections::{BTreeMap, BTreeSet};

use super::bound::{Aim, Bounds, Figures};
use super::candidate::Candidate;
use super::estimate::Estimator;
use super::gain::{Estimate, estimates};

/// What measures candidates. They have numbers in the order in which they became known.
pub trait Trial {
    /// Why the search cannot go on.
    type Error;

    /// Measures a candidate in a round, from 1 on; later rounds make its time more certain.
    fn measure(&mut self, candidate: usize, round: u32) -> Result<(), Self::Error>;

    /// Measures what it left out of a candidate, as a bound had ruled the candidate out already.
    /// Returns whether there was anything.
    fn complete(&mut self, candidate: usize) -> Result<bool, Self::Error>;

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
    /// What the local search found each candidate around; none of those that it began with.
    centres: Vec<Option<usize>>,
    estimator: Estimator,
    /// The measured candidates, and the rounds that each has had.
    measured: Vec<(usize, u32)>,
}

/// The search ends where no candidate is expected to gain so much: a share of the best time or
/// error, times the chance that it meets the bounds.
const LEAST_GAIN: f64 = 0.005;

/// A candidate with more of an amount takes at least its smaller sibling's time over this.
const SLACK: f64 = 1.25;

/// Times of one round are this far apart at most where the machine is steady.
pub(super) const SPREAD: f64 = 0.25;

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
            centres: vec![None; candidates.len()],
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
        loop {
            while self.explore_one()? {}
            if !self.ask_others()? {
                break;
            }
        }
        self.halve()?;
        let mut centres = BTreeSet::new();
        for _ in 0..LOCAL {
            let centre = self.centre();
            if let Some(centre) = centre.filter(|centre| centres.insert(*centre)) {
                for neighbour in self.trial.neighbours(centre) {
                    self.estimator.add(&neighbour);
                    self.candidates.push(neighbour);
                    self.centres.push(Some(centre));
                }
            }
            if !self.explore_one()? {
                break;
            }
            // Only what seems better is worth another round.
            if self.centre() != centre {
                self.halve()?;
            }
        }
        self.halve()?;
        while let Some(centre) = self.centre() {
            if !self.trial.complete(centre)? {
                break;
            }
        }
        Ok(self.found())
    }

    fn found(self) -> Found {
        let too_much = self.too_much();
        let is_ruled_out = |candidate: &usize| {
            !self.is_measured(*candidate) && self.is_ruled_out(*candidate, &too_much)
        };
        let ruled_out = (0..self.candidates.len()).filter(is_ruled_out).count();
        let estimates = estimates(&self.estimator, &self.figures());
        let effort =
            |(index, estimate): (usize, &Estimate)| self.trial.effort(index, estimate.ms());
        let measured = self.measured.iter();
        Found {
            best: self.best(self.trial.noise()),
            measured: measured.map(|(candidate, _)| *candidate).collect(),
            ruled_out,
            efforts: estimates.iter().enumerate().map(effort).collect(),
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
        self.best(self.trial.noise()).or_else(|| self.nearest())
    }

    /// What comes nearest to the bounds.
    fn nearest(&self) -> Option<usize> {
        self.bounds.nearest(&self.figures())
    }

    /// The best that meets the bounds. A change that the local search made counts only if it takes
    /// less time than the fastest frame without it, and changes the picture or the memory: it has
    /// to be more than noise.
    fn best(&self, noise: f64) -> Option<usize> {
        let is_gain = |(candidate, it): &(usize, Figures)| {
            let centre = self.centres[*candidate].and_then(|centre| self.trial.figures(centre));
            let centre = centre.filter(|centre| self.bounds.are_met(centre));
            let is_for_time = self.bounds.aim() == Aim::Time;
            centre.is_none_or(|centre| {
                let has_effect = (it.error, it.bytes) != (centre.error, centre.bytes);
                has_effect && (!is_for_time || it.ms < centre.fastest_ms)
            })
        };
        let mut all = self.figures();
        all.retain(is_gain);
        self.bounds.best(&all, noise)
    }

    /// The figures of the best that is known, where something meets the bounds.
    fn best_figures(&self) -> Option<Figures> {
        self.trial.figures(self.best(0.0)?)
    }

    /// Measures the settings of the best in other techniques that have them, with each of their
    /// amounts from the least on: one that is bad at its simplest may be good there, which no
    /// estimate expects. Returns whether any was measured.
    fn ask_others(&mut self) -> Result<bool, T::Error> {
        let Some(best) = self.best(0.0).or_else(|| self.nearest()) else {
            return Ok(false);
        };
        let best = self.candidates[best].clone();
        let mut others: Vec<usize> = (0..self.candidates.len())
            .filter(|other| self.candidates[*other].is_elsewhere(&best))
            .collect();
        let amount = |other: &usize| self.candidates[*other].total_amount();
        others.sort_by(|a, b| amount(a).total_cmp(&amount(b)));
        let mut any = false;
        for other in others {
            if !self.is_measured(other) && !self.is_ruled_out(other, &self.too_much()) {
                self.measure(other)?;
                any = true;
            }
        }
        Ok(any)
    }

    /// Measures what promises most. Returns whether anything promises enough.
    fn explore_one(&mut self) -> Result<bool, T::Error> {
        let next = self.most_promising();
        next.map_or(Ok(()), |next| self.measure(next))?;
        Ok(next.is_some())
    }

    /// The candidate with the largest gain for its effort.
    fn most_promising(&self) -> Option<usize> {
        let known = self.best(0.0).or_else(|| self.nearest());
        let known = known.and_then(|known| self.trial.figures(known));
        let noise = self.trial.noise();
        let estimates = estimates(&self.estimator, &self.figures());
        let too_much = self.too_much();
        let promise = |(candidate, estimate): (usize, &Estimate)| {
            let gain = estimate.gain(&self.bounds, known, noise);
            let effort = self.trial.effort(candidate, estimate.ms());
            let is_open = gain >= LEAST_GAIN
                && !self.is_measured(candidate)
                && !self.is_ruled_out(candidate, &too_much);
            is_open.then_some((candidate, gain / effort))
        };
        let open = estimates.iter().enumerate().filter_map(promise);
        open.max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(candidate, _)| candidate)
    }

    /// Measured candidates of which a bound rules out all that have more: the device refused them,
    /// or they take too much memory or time.
    fn too_much(&self) -> Vec<usize> {
        let best_ms = self.best_figures().map_or(f64::INFINITY, |best| best.ms);
        let most_ms = match self.bounds.aim() {
            Aim::Time => best_ms.min(self.bounds.max_ms),
            Aim::Error => self.bounds.max_ms,
        };
        let is_too_much = |candidate: &usize| match self.trial.figures(*candidate) {
            None => true,
            Some(it) => it.bytes > self.bounds.max_bytes || it.ms > SLACK * most_ms,
        };
        let measured = self.measured.iter().map(|(candidate, _)| *candidate);
        measured.filter(is_too_much).collect()
    }

    fn is_ruled_out(&self, candidate: usize, too_much: &[usize]) -> bool {
        let is_less = |less: &usize| self.candidates[*less].is_less(&self.candidates[candidate]);
        too_much.iter().any(is_less)
    }

    /// Measures the best again, round by round, and fewer in each: a quarter of those before, of
    /// which none is so slow that it can no longer be the best. Then the best has all rounds.
    fn halve(&mut self) -> Result<(), T::Error> {
        for round in 2..=self.rounds {
            let share = (self.measured.len() >> (2 * (round - 1))).max(2);
            for candidate in self.contenders(share) {
                self.measure_again(candidate, round)?;
            }
        }
        while let Some(best) = self.best(self.trial.noise()) {
            if self.trial.complete(best)? {
                continue;
            }
            let round = self.rounds_of(best) + 1;
            if round > self.rounds {
                break;
            }
            self.measure_again(best, round)?;
        }
        Ok(())
    }

    fn rounds_of(&self, candidate: usize) -> u32 {
        let mut measured = self.measured.iter();
        let found = measured.find(|(measured, _)| *measured == candidate);
        found.map_or(0, |(_, rounds)| *rounds)
    }

    fn measure_again(&mut self, candidate: usize, round: u32) -> Result<(), T::Error> {
        let mut measured = self.measured.iter_mut();
        let known = measured.find(|(measured, had)| *measured == candidate && *had < round);
        let Some((_, had)) = known else {
            return Ok(());
        };
        *had = round;
        self.trial.measure(candidate, round)
    }

    /// Those that may be the best if times are a little off, best first.
    fn contenders(&self, most: usize) -> Vec<usize> {
        let within = Bounds {
            max_ms: self.bounds.max_ms * (1.0 + SPREAD),
            ..self.bounds
        };
        let noise = self.trial.noise();
        let value = |it: &Figures| match self.bounds.aim() {
            Aim::Time => it.ms,
            Aim::Error => it.error,
        };
        let most_value =
            self.best_figures()
                .map_or(f64::INFINITY, |best| match self.bounds.aim() {
                    Aim::Time => best.ms * (1.0 + SPREAD),
                    Aim::Error => best.error + noise,
                });
        let mut all = self.figures();
        all.retain(|(_, it)| within.are_met(it) && value(it) <= most_value);
        all.sort_by(|a, b| value(&a.1).total_cmp(&value(&b.1)));
        all.truncate(most);
        all.into_iter().map(|(candidate, _)| candidate).collect()
    }
}
