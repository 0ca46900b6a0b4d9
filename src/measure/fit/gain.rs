//! What measuring a candidate is expected to gain.

use super::bound::{Aim, Bounds, Figures};
use super::estimate::Estimator;

/// Estimates of the logarithms of a candidate's figures.
#[derive(Clone, Copy, Debug)]
pub(super) struct Estimate {
    pub(super) ms: f64,
    error: f64,
    bytes: f64,
    /// Scale of their distributions, which are taken to be logistic.
    scale: f64,
}

/// The powers with which figures follow the product of a candidate's amounts, before anything is
/// measured: rough means over the recorded grids.
const POWERS: Figures = Figures {
    ms: 1.0,
    fastest_ms: 1.0,
    error: -0.3,
    bytes: 2.0,
};

/// What meets the bounds for the first time gains so much, times the chance that it does.
const FIRST_GAIN: f64 = 0.5;

/// Scale of a logistic distribution with a standard deviation of 1: sqrt(3) / pi.
const SCALE_OF_DEVIATION: f64 = 0.551_328_895_421_792;

/// What comes nearer to the bounds without meeting them gains this share of how much nearer it is.
const NEARER_GAIN: f64 = 0.2;

/// Estimates of all candidates, from the figures of the measured ones, in the order in which they
/// were observed.
pub(super) fn estimates(estimator: &Estimator, measured: &[(usize, Figures)]) -> Vec<Estimate> {
    let means = |of: fn(&Figures) -> f64, power: f64| {
        let logs: Vec<f64> = measured.iter().map(|(_, it)| of(it).ln()).collect();
        estimator.means(&logs, power)
    };
    let ms = means(|it| it.ms, POWERS.ms);
    let error = means(|it| it.error, POWERS.error);
    let bytes = means(|it| it.bytes, POWERS.bytes);
    let estimate = |index: usize| Estimate {
        ms: ms[index],
        error: error[index],
        bytes: bytes[index],
        scale: estimator.deviation(index) * SCALE_OF_DEVIATION,
    };
    (0..ms.len()).map(estimate).collect()
}

impl Estimate {
    /// What is expected to be gained if this is measured, while `known` is the best that is known,
    /// or else what comes nearest to the bounds.
    pub(super) fn gain(&self, bounds: &Bounds, known: Option<Figures>, noise: f64) -> f64 {
        let Some(known) = known else {
            return FIRST_GAIN * self.chance_of_all(bounds);
        };
        if !bounds.are_met(&known) {
            let nearer = self.gain_of_nearer(bounds, &known);
            return (FIRST_GAIN * self.chance_of_all(bounds)).max(NEARER_GAIN * nearer);
        }
        let fits = self.chance(self.bytes, bounds.max_bytes);
        match bounds.aim() {
            Aim::Time => {
                fits * self.chance(self.error, bounds.max_error) * self.less(self.ms, known.ms)
            }
            Aim::Error => {
                let wanted = (known.error - noise).max(f64::MIN_POSITIVE);
                fits * self.chance(self.ms, bounds.max_ms) * self.less(self.error, wanted)
            }
        }
    }

    /// By how much the logarithm of the excess is expected to be below that of the nearest.
    fn gain_of_nearer(&self, bounds: &Bounds, nearest: &Figures) -> f64 {
        let excess = bounds.excess(nearest);
        let figures = [
            (self.error, excess * bounds.max_error, nearest.error),
            (self.ms, excess * bounds.max_ms, nearest.ms),
            (self.bytes, excess * bounds.max_bytes, nearest.bytes),
        ];
        let of_figure = |(log, most, of_nearest): (f64, f64, f64)| match of_nearest < most {
            true => self.chance(log, most),
            false => self.less(log, most),
        };
        figures.into_iter().map(of_figure).product()
    }

    fn chance_of_all(&self, bounds: &Bounds) -> f64 {
        self.chance(self.error, bounds.max_error)
            * self.chance(self.ms, bounds.max_ms)
            * self.chance(self.bytes, bounds.max_bytes)
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
