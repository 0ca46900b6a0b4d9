//! What measuring a candidate is expected to gain.

use super::bound::{Aim, Bounds, Figures};
use super::estimate::Estimator;

/// The logarithm of a figure: a logistic distribution.
#[derive(Clone, Copy, Debug)]
struct Log {
    mean: f64,
    scale: f64,
}

/// Estimates of a candidate's figures.
#[derive(Clone, Copy, Debug)]
pub(super) struct Estimate {
    ms: Log,
    error: Log,
    bytes: Log,
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

/// Deviation of errors, to that of times and memory: a coarse grid may be right by luck where the
/// finer one beside it is wrong.
const SPREAD_OF_ERRORS: f64 = 1.75;

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
    let estimate = |index: usize| {
        let scale = estimator.deviation(index) * SCALE_OF_DEVIATION;
        let log = |means: &[f64], spread: f64| Log {
            mean: means[index],
            scale: spread * scale,
        };
        Estimate {
            ms: log(&ms, 1.0),
            error: log(&error, SPREAD_OF_ERRORS),
            bytes: log(&bytes, 1.0),
        }
    };
    (0..ms.len()).map(estimate).collect()
}

impl Log {
    /// The chance that the figure is at most this.
    fn chance(&self, most: f64) -> f64 {
        1.0 / (1.0 + ((self.mean - most.ln()) / self.scale).exp())
    }

    /// By how much its logarithm is expected to be below this one's, 0 where it is not.
    fn less(&self, most: f64) -> f64 {
        let above = (self.mean - most.ln()) / self.scale;
        self.scale
            * if above < -30.0 {
                -above
            } else {
                (-above).exp().ln_1p()
            }
    }
}

impl Estimate {
    /// Time (ms).
    pub(super) fn ms(&self) -> f64 {
        self.ms.mean.exp()
    }

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
        let fits = self.bytes.chance(bounds.max_bytes);
        match bounds.aim() {
            Aim::Time => fits * self.error.chance(bounds.max_error) * self.ms.less(known.ms),
            Aim::Error => {
                let wanted = (known.error - noise).max(f64::MIN_POSITIVE);
                fits * self.ms.chance(bounds.max_ms) * self.error.less(wanted)
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
        let of_figure = |(log, most, of_nearest): (Log, f64, f64)| match of_nearest < most {
            true => log.chance(most),
            false => log.less(most),
        };
        figures.into_iter().map(of_figure).product()
    }

    fn chance_of_all(&self, bounds: &Bounds) -> f64 {
        self.error.chance(bounds.max_error)
            * self.ms.chance(bounds.max_ms)
            * self.bytes.chance(bounds.max_bytes)
    }
}
