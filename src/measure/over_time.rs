//! A sequence against its reference, frame by frame.

use serde::Serialize;

use super::draw::{Chart, LineAxis, LinePanel, Panels, Scale, Series, Ticks};
use crate::image::{GuideImage, Image};
use crate::metrics::stability::{excess_flicker, lag, popping, shown_change, squares};
use crate::metrics::{Channel, Errors, MetricError, compare};

/// The technique's own pictures, as they would be without history.
#[derive(Clone, Copy, Debug, Default)]
pub struct Own<'i> {
    /// Of this frame.
    pub converged: Option<&'i Image>,
    /// Before and after a change of light.
    pub change: Option<[&'i Image; 2]>,
}

/// One frame of a sequence.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrameErrors {
    /// Over pixels.
    pub pixel: Errors,
    /// Over blocks, where there is a guide with any.
    pub block: Option<Errors>,
    /// [`lag`] against the technique's own converged picture.
    pub lag: Option<f64>,
    /// [`shown_change`] between the technique's own converged pictures.
    pub shown: Option<f64>,
}

/// What is constant over a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Steadiness {
    /// [`excess_flicker`] of means of [`SQUARE_PX`]² pixels.
    pub flicker: f64,
    /// [`popping`] of the same.
    pub popping: f64,
}

/// Side of the squares whose means are compared from frame to frame (px): smaller than what one
/// sees flicker, larger than the reference's noise.
pub const SQUARE_PX: u32 = 4;

/// A sequence.
#[derive(Clone, Debug, Default)]
pub struct OverTime {
    /// Its frames so far.
    pub frames: Vec<FrameErrors>,
    /// Means of squares, of the sequence and of its reference.
    squares: [Vec<Image>; 2],
}

impl OverTime {
    /// Adds the next frame.
    pub fn add(
        &mut self,
        [image, reference]: [&Image; 2],
        guide: Option<&GuideImage>,
        channel: Channel,
        own: Own<'_>,
    ) -> Result<(), MetricError> {
        let comparison = compare(image, reference, guide, channel)?;
        let converged = own.converged.map(|converged| lag(image, converged));
        let shown = own.change.map(|change| shown_change(image, change));
        self.frames.push(FrameErrors {
            pixel: comparison.pixel,
            block: comparison.block,
            lag: converged.transpose()?,
            shown: shown.transpose()?,
        });
        let [images, references] = &mut self.squares;
        images.push(squares(image, SQUARE_PX));
        references.push(squares(reference, SQUARE_PX));
        Ok(())
    }

    /// Flicker and popping; `None` of a single frame.
    pub fn steadiness(&self) -> Result<Option<Steadiness>, MetricError> {
        let [images, references] = &self.squares;
        if images.len() < 2 {
            return Ok(None);
        }
        Ok(Some(Steadiness {
            flicker: excess_flicker(images, references)?,
            popping: popping(images, references)?,
        }))
    }

    /// A number of each frame that has it, by the number of the frame.
    pub fn values(&self, of: impl Fn(&FrameErrors) -> Option<f64>) -> Vec<(f64, f64)> {
        let frames = self.frames.iter().enumerate();
        frames
            .filter_map(|(number, frame)| Some((number as f64, of(frame)?)))
            .collect()
    }

    /// Mean over the frames that have it.
    pub fn mean(&self, of: impl Fn(&FrameErrors) -> Option<f64>) -> Option<f64> {
        let values = self.values(of);
        let sum: f64 = values.iter().map(|value| value.1).sum();
        (!values.is_empty()).then(|| sum / values.len() as f64)
    }

    /// Error, bias and what else there is, frame by frame.
    pub fn chart(&self, title: String, notes: Vec<String>) -> Chart {
        let series = |name: &str, of: &dyn Fn(&FrameErrors) -> Option<f64>| Series {
            name: name.to_owned(),
            points: self.values(of),
        };
        let panel = |y_label: &str, series: Vec<Series>| LinePanel {
            y_label: y_label.to_owned(),
            y_scale: Scale::Linear,
            series: (series.into_iter())
                .filter(|series| !series.points.is_empty())
                .collect(),
            floor: None,
        };
        let both = |of: &dyn Fn(&Errors) -> f64| {
            vec![
                series("pixel", &|frame| Some(of(&frame.pixel))),
                series("block", &|frame| frame.block.as_ref().map(of)),
            ]
        };
        let panels = [
            panel("rel_rmse", both(&|errors| errors.rel_rmse)),
            panel("bias", both(&|errors| errors.bias)),
            panel("lag", vec![series("lag", &|frame| frame.lag)]),
            panel(
                "share of the change that is shown",
                vec![series("shown", &|frame| frame.shown)],
            ),
        ];
        let axis = LineAxis {
            label: "frame".to_owned(),
            ticks: Ticks::Linear,
        };
        let panels = panels.into_iter().filter(|panel| !panel.series.is_empty());
        Chart {
            title,
            notes,
            panels: Panels::Lines(axis, panels.collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn grey(value: f32) -> Image {
        Image::from_fn(8, 8, |_| Vec3::splat(value))
    }

    /// By hand: the light rises from 1 to 3 at once, and is shown by halves.
    #[test]
    fn a_late_sequence_by_hand() -> Result<(), Box<dyn std::error::Error>> {
        let mut over_time = OverTime::default();
        let (before, after) = (grey(1.0), grey(3.0));
        let own = Own {
            converged: Some(&after),
            change: Some([&before, &after]),
        };
        for value in [2.0, 2.5, 2.75] {
            let images = [&grey(value), &after];
            over_time.add(images, None, Channel::Luminance, own)?;
        }
        let near = |found: Vec<(f64, f64)>, expected: [f64; 3]| {
            assert_eq!(found.len(), 3);
            let pairs = found.iter().zip(expected);
            assert!(
                pairs
                    .into_iter()
                    .all(|(found, value)| (found.1 - value).abs() < 1e-6),
                "{found:?}"
            );
        };
        near(over_time.values(|frame| frame.shown), [0.5, 0.75, 0.875]);
        let thirds = [1.0, 0.5, 0.25].map(|off| off / 3.0);
        near(over_time.values(|frame| frame.lag), thirds);
        near(over_time.values(|frame| Some(frame.pixel.rel_rmse)), thirds);
        assert!(
            over_time
                .mean(|frame| frame.block.as_ref().map(|_| 1.0))
                .is_none()
        );
        let steadiness = over_time.steadiness()?.ok_or("three frames")?;
        assert!((steadiness.flicker - 0.375 / 3.0).abs() < 1e-6);
        assert!((steadiness.popping - 0.5 / 3.0).abs() < 1e-6);
        let chart = over_time.chart("t".to_owned(), Vec::new());
        assert!(chart.svg()?.contains("share of the change"));
        // Sequences of other sizes are refused.
        let images = [&Image::new(4, 4), &after];
        assert!(
            over_time
                .add(images, None, Channel::Luminance, own)
                .is_err()
        );
        Ok(())
    }
}
