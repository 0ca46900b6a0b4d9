//! Axes of charts: ranges, ticks and numbers.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};

use super::Scale;

/// Smallest and largest of the `values`, with a little room on each side.
pub(super) fn range(values: impl Iterator<Item = f64>, scale: Scale) -> Range<f64> {
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
    if low > high {
        return 0.5..1.5;
    }
    match scale {
        Scale::Log => low / 1.3..high * 1.3,
        Scale::Linear => {
            let pad = 0.08 * (high - low).max(1e-3 * high.abs()).max(1e-6);
            low - pad..high + pad
        }
    }
}

/// An axis with ticks of our choice.
#[derive(Clone)]
pub(super) struct Axis {
    /// Smallest and largest value.
    pub(super) range: Range<f64>,
    /// How the values are spread.
    pub(super) scale: Scale,
    /// Where there are ticks.
    pub(super) ticks: Vec<f64>,
}

impl Ranged for Axis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (low, high): (i32, i32)) -> i32 {
        let share = match self.scale {
            Scale::Linear => (value - self.range.start) / (self.range.end - self.range.start),
            Scale::Log => {
                (value / self.range.start).ln() / (self.range.end / self.range.start).ln()
            }
        };
        low + (share * f64::from(high - low)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        // Light lines are asked for in a second turn; there are none.
        if hint.weight().allow_light_points() {
            Vec::new()
        } else {
            self.ticks.clone()
        }
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl From<Axis> for Range<f64> {
    fn from(axis: Axis) -> Self {
        axis.range
    }
}

/// Multiples of 1, 2 or 5 times a power of ten, about eight of them.
pub(super) fn linear_ticks(range: &Range<f64>) -> Vec<f64> {
    let raw = (range.end - range.start) / 8.0;
    let power = 10.0f64.powf(raw.log10().floor());
    let step = power
        * [1.0, 2.0, 5.0, 10.0]
            .into_iter()
            .find(|digit| digit * power >= raw)
            .unwrap_or(10.0);
    let indices = (range.start / step).ceil() as i64..=(range.end / step).floor() as i64;
    indices.map(|index| index as f64 * step).collect()
}

/// Round numbers in a range of positive ones, few of them.
pub(super) fn log_ticks(range: &Range<f64>) -> Vec<f64> {
    let decades = (range.end / range.start).log10();
    let digits: &[f64] = if decades < 1.0 {
        &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]
    } else {
        &[1.0, 2.0, 5.0]
    };
    let powers = range.start.log10().floor() as i32..=range.end.log10().ceil() as i32;
    powers
        .flat_map(|power| digits.iter().map(move |digit| digit * 10.0f64.powi(power)))
        .filter(|tick| range.contains(tick))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_few_and_inside() {
        assert_eq!(log_ticks(&(0.015..1.1)), [0.02, 0.05, 0.1, 0.2, 0.5, 1.0]);
        assert_eq!(
            linear_ticks(&(-0.7..0.11)),
            [-0.6000000000000001, -0.4, -0.2, 0.0]
        );
        assert_eq!(log_ticks(&(11.0..45.0)), [15.0, 20.0, 30.0, 40.0]);
    }
}
