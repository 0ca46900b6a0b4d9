//! What a point that was not measured will cost, told by those that were.
//!
//! The logarithm of a figure is a sum of effects: of the technique, of the preset, and of the value
//! of each setting. An effect on one technique is likely one on the others too. This is a Gaussian
//! process (Rasmussen & Williams, Gaussian Processes for Machine Learning, 2006, section 2.2). Its
//! covariance of two points adds a variance for each thing that they have alike.

use std::collections::BTreeMap;

use super::candidate::Candidate;

/// Variances of the effects, as squares of standard deviations of natural logarithms. They are
/// rough: a technique takes some times as long as another, a preset twice, a word a third more.
mod prior {
    /// The mean of all.
    pub(super) const MEAN: f64 = 3.0 * 3.0;
    /// A technique.
    pub(super) const TECHNIQUE: f64 = 0.8 * 0.8;
    /// A preset by its name, whatever the technique.
    pub(super) const PRESET: f64 = 0.4 * 0.4;
    /// A preset of one technique.
    pub(super) const FAMILY: f64 = 0.4 * 0.4;
    /// A value, whatever the technique.
    pub(super) const VALUE: f64 = 0.25 * 0.25;
    /// A value in one technique.
    pub(super) const OWN_VALUE: f64 = 0.1 * 0.1;
    /// The power with which a figure follows a number, whatever the technique.
    pub(super) const POWER: f64 = 0.5 * 0.5;
    /// The same in one technique.
    pub(super) const OWN_POWER: f64 = 0.3 * 0.3;
    /// The same in one preset of a technique.
    pub(super) const FAMILY_POWER: f64 = 0.2 * 0.2;
    /// What no effect explains, and the noise of a measurement.
    pub(super) const NOISE: f64 = 0.1 * 0.1;
}

/// Effects of two numbers differ the more the larger their ratio is: by all at this power of e.
const ALIKE_WITHIN: f64 = 0.7;

/// A value of a setting.
#[derive(Clone, Debug, PartialEq)]
enum Value {
    /// A word, or a number without a logarithm.
    Word(String),
    /// The logarithm of a number above 0.
    Log(f64),
}

/// What an estimate goes by.
#[derive(Clone, Debug)]
struct Features {
    technique: String,
    preset: Option<String>,
    values: BTreeMap<String, Value>,
    /// Logarithm of the product of all amounts.
    log_amount: f64,
}

/// One observation: a row of the Cholesky factor of the covariances, over all points.
#[derive(Debug)]
struct Row {
    point: usize,
    divisor: f64,
    over_points: Vec<f64>,
}

/// Estimates of all points from those that were measured.
#[derive(Debug, Default)]
pub(super) struct Estimator {
    points: Vec<Features>,
    /// Where the logarithm of a setting is about 0: that of the first point that has it.
    origins: BTreeMap<String, f64>,
    rows: Vec<Row>,
}

impl Features {
    fn of(candidate: &Candidate) -> Self {
        let value = |text: &String| match text.parse::<f64>() {
            Ok(number) if number > 0.0 && number.is_finite() => Value::Log(number.ln()),
            _ => Value::Word(text.clone()),
        };
        let values = candidate.settings.iter();
        Features {
            technique: candidate.technique.clone(),
            preset: candidate.preset.clone(),
            values: values
                .map(|(name, text)| (name.clone(), value(text)))
                .collect(),
            log_amount: candidate.total_amount().ln(),
        }
    }
}

impl Estimator {
    /// Adds a point that is not measured yet.
    pub(super) fn add(&mut self, candidate: &Candidate) {
        let features = Features::of(candidate);
        for (name, value) in &features.values {
            if let Value::Log(log) = value {
                self.origins.entry(name.clone()).or_insert(*log);
            }
        }
        self.points.push(features);
        let new = self.points.len() - 1;
        for row in 0..self.rows.len() {
            let value = self.over(row, new);
            self.rows[row].over_points.push(value);
        }
    }

    /// Adds that a point was measured.
    pub(super) fn observe(&mut self, point: usize) {
        let variance = self.variance(point) + prior::NOISE;
        self.rows.push(Row {
            point,
            divisor: variance.sqrt(),
            over_points: Vec::new(),
        });
        let row = self.rows.len() - 1;
        let over_points = (0..self.points.len())
            .map(|other| self.over(row, other))
            .collect();
        self.rows[row].over_points = over_points;
    }

    /// The entry of a row at a point, from the rows above it.
    fn over(&self, row: usize, point: usize) -> f64 {
        let Row {
            point: measured,
            divisor,
            ..
        } = self.rows[row];
        let above = self.rows[..row].iter();
        let known: f64 = above
            .map(|above| above.over_points[measured] * above.over_points[point])
            .sum();
        (self.covariance(measured, point) - known) / divisor
    }

    /// Variance of what is not known yet of a point.
    fn variance(&self, point: usize) -> f64 {
        let rows = self.rows.iter();
        let known: f64 = rows.map(|row| row.over_points[point].powi(2)).sum();
        (self.covariance(point, point) - known).max(0.0)
    }

    /// Standard deviation of the estimates of a point's logarithms.
    pub(super) fn deviation(&self, point: usize) -> f64 {
        self.variance(point).sqrt()
    }

    /// Estimates of a logarithm at all points, from its values at the measured ones, in the order
    /// in which they were observed. Before anything is known it follows a point's amounts with
    /// this `power`.
    pub(super) fn means(&self, measured: &[f64], power: f64) -> Vec<f64> {
        let trends = self.points.iter().map(|point| power * point.log_amount);
        let mut means: Vec<f64> = trends.collect();
        let surprises = self.rows.iter().zip(measured);
        let surprises = surprises.map(|(row, value)| value - means[row.point]);
        let level = surprises.sum::<f64>() / measured.len().max(1) as f64;
        means.iter_mut().for_each(|mean| *mean += level);
        for (row, value) in self.rows.iter().zip(measured) {
            let surprise = (value - means[row.point]) / row.divisor;
            for (mean, over) in means.iter_mut().zip(&row.over_points) {
                *mean += surprise * over;
            }
        }
        means
    }

    fn covariance(&self, a: usize, b: usize) -> f64 {
        let (a, b) = (&self.points[a], &self.points[b]);
        let is_technique = a.technique == b.technique;
        let is_preset = a.preset == b.preset;
        let when = |holds: bool, variance: f64| if holds { variance } else { 0.0 };
        let alike = prior::MEAN
            + when(is_technique, prior::TECHNIQUE)
            + when(is_preset, prior::PRESET)
            + when(is_technique && is_preset, prior::FAMILY);
        let of_value = prior::VALUE + when(is_technique, prior::OWN_VALUE);
        let of_power = prior::POWER
            + when(is_technique, prior::OWN_POWER)
            + when(is_technique && is_preset, prior::FAMILY_POWER);
        let of_setting = |(name, value): (&String, &Value)| match (value, b.values.get(name)) {
            (Value::Log(a), Some(Value::Log(b))) => {
                let origin = self.origins.get(name).copied().unwrap_or(0.0);
                of_value * (-(a - b).abs() / ALIKE_WITHIN).exp()
                    + of_power * (a - origin) * (b - origin)
            }
            (value, Some(other)) => when(value == other, of_value),
            (_, None) => 0.0,
        };
        alike + a.values.iter().map(of_setting).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(technique: &str, resolution: u32) -> Candidate {
        Candidate {
            technique: technique.to_owned(),
            preset: None,
            settings: BTreeMap::from([("resolution".to_owned(), resolution.to_string())]),
            amounts: vec!["resolution".to_owned()],
            changes: 0,
        }
    }

    /// Planted: a technique takes five times as long as another, and both follow the resolution by
    /// a power of 1.5. What one of them shows at every resolution tells of the other, of which one
    /// resolution was measured.
    #[test]
    fn effects_carry_over() {
        let law = |point: &Candidate| {
            let factor: f64 = if point.technique == "slow" { 5.0 } else { 1.0 };
            factor.ln() + 1.5 * point.total_amount().ln()
        };
        let points: Vec<Candidate> = ["fast", "slow"]
            .into_iter()
            .flat_map(|technique| [8, 16, 32, 64].map(|resolution| point(technique, resolution)))
            .collect();
        let mut estimator = Estimator::default();
        points.iter().for_each(|point| estimator.add(point));
        let before = estimator.deviation(7);
        let measured = [0, 1, 2, 3, 4];
        measured
            .into_iter()
            .for_each(|index| estimator.observe(index));
        let logs = measured.map(|index| law(&points[index]));
        let means = estimator.means(&logs, 1.0);
        for index in measured {
            assert!(
                (means[index] - law(&points[index])).abs() < 0.15,
                "{index}: {means:?}"
            );
            assert!(estimator.deviation(index) < 0.11);
        }
        let off = |index: usize| (means[index] - law(&points[index])).abs();
        assert!(off(5) < 0.25, "{means:?}");
        for index in [5, 6, 7] {
            assert!(
                off(index) < 2.0 * estimator.deviation(index),
                "{index}: {means:?}"
            );
        }
        assert!(estimator.deviation(7) < 0.5 * before);
        assert!(
            estimator.deviation(5) < estimator.deviation(7),
            "the nearer is surer"
        );
    }

    /// What is added after measurements has the same estimate as what was there before them.
    #[test]
    fn a_late_point_is_estimated_alike() {
        let points = [point("a", 8), point("a", 16), point("b", 8), point("b", 32)];
        let (mut early, mut late) = (Estimator::default(), Estimator::default());
        points.iter().for_each(|point| early.add(point));
        points[..3].iter().for_each(|point| late.add(point));
        for measured in [0, 2, 1] {
            early.observe(measured);
            late.observe(measured);
        }
        late.add(&points[3]);
        let logs = [1.0, 2.0, 1.5];
        assert!((early.means(&logs, 1.0)[3] - late.means(&logs, 1.0)[3]).abs() < 1e-12);
        assert!((early.deviation(3) - late.deviation(3)).abs() < 1e-12);
    }
}
