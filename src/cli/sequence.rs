//! Sequences of pictures: how the scene goes on, and how the files are called.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use crate::measure::report::SequenceRow;
use crate::scene::{Scene, Shot};

use super::CliError;

/// The frames that are rendered.
#[derive(clap::Args)]
#[command(next_help_heading = "Sequence")]
pub(super) struct SequenceArgs {
    /// Frames to render, each to a file of its own where the name of the image has # for its
    /// number. Without it, `render` writes the last. Times are medians over all but the first.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=100_000),
    )]
    pub(super) frames: u32,
    #[command(flatten)]
    pub(super) path: PathArgs,
}

impl SequenceArgs {
    /// As [`PathArgs::check`].
    pub(super) fn check(&self) -> Result<(), CliError> {
        self.path.check(self.frames)
    }

    /// As [`PathArgs::row`].
    pub(super) fn row(&self, shot: &Shot) -> Option<SequenceRow> {
        self.path.row(self.frames, shot)
    }
}

/// How a scene goes on from frame to frame.
#[derive(clap::Args)]
#[command(next_help_heading = "Sequence")]
pub(super) struct PathArgs {
    /// Frames a second: models with keyframes move, from --time on [default: they stand still].
    #[arg(long, value_name = "F")]
    fps: Option<f32>,
    /// Turn the camera about its up from frame to frame (degrees, to the left).
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    pan: Option<f32>,
    /// Move the camera along its view from frame to frame (metres, ahead).
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    dolly: Option<f32>,
}

impl PathArgs {
    /// The options that are given.
    pub(super) fn given(&self) -> Vec<&'static str> {
        self.values()
            .into_iter()
            .filter_map(|(option, value, ..)| value.map(|_| option))
            .collect()
    }

    /// Each option, its value and the values that can be used, so that no frame of a sequence is
    /// at a place or time without bounds.
    fn values(&self) -> [(&'static str, Option<f32>, RangeInclusive<f32>); 3] {
        [
            ("--fps", self.fps, 0.001..=1e6),
            ("--pan", self.pan, -360.0..=360.0),
            ("--dolly", self.dolly, -1e4..=1e4),
        ]
    }

    /// An error unless the values can be used. A warning where there are no frames to use them.
    pub(super) fn check(&self, frames: u32) -> Result<(), CliError> {
        for (option, value, range) in self.values() {
            if let Some(value) = value.filter(|value| !range.contains(value)) {
                let (least, most) = (range.start(), range.end());
                return Err(CliError::input(format!(
                    "{option} is {value}; it must be {least} to {most}"
                )));
            }
        }
        let given = self.given().join(", ");
        if frames == 1 && !given.is_empty() {
            log::warn!("there is one frame; no effect: {given}");
        }
        Ok(())
    }

    /// The frames of a scene, as it is in the first, at `start_s` (s).
    pub(super) fn shot(&self, scene: &Scene, start_s: Option<f32>) -> Shot {
        if self.fps.is_some() && !scene.moves() {
            log::warn!(
                "{}: no model has keyframes; --fps changes nothing",
                scene.name
            );
        }
        Shot {
            first: scene.camera,
            start_s: start_s.unwrap_or(0.0),
            step_s: self.fps.map(f32::recip),
            pan_deg: self.pan.unwrap_or(0.0),
            dolly_m: self.dolly.unwrap_or(0.0),
        }
    }

    /// For reports; `None` of one frame.
    pub(super) fn row(&self, frames: u32, shot: &Shot) -> Option<SequenceRow> {
        (frames > 1).then(|| SequenceRow {
            frames,
            fps: self.fps,
            last_time_s: self.fps.map(|_| shot.time_s(frames - 1)),
            pan_deg: shot.pan_deg,
            dolly_m: shot.dolly_m,
        })
    }
}

/// A file name with a run of `#` where each frame has its number, from 0 on.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Numbered {
    folder: PathBuf,
    before: String,
    digits: usize,
    after: String,
}

impl Numbered {
    /// The name in a path, where it has a run of `#`; two are an error.
    pub(super) fn of(path: &Path) -> Result<Option<Numbered>, CliError> {
        let name = path.file_name().and_then(|name| name.to_str());
        let Some((before, rest)) = name.and_then(|name| name.split_once('#')) else {
            return Ok(None);
        };
        let after = rest.trim_start_matches('#');
        if after.contains('#') {
            return Err(CliError::input(format!(
                "{}: write one run of # for the number of the frame",
                path.display()
            )));
        }
        Ok(Some(Numbered {
            folder: path.with_file_name(""),
            before: before.to_owned(),
            digits: 1 + rest.len() - after.len(),
            after: after.to_owned(),
        }))
    }

    /// The file of a frame.
    pub(super) fn path(&self, frame: u32) -> PathBuf {
        let Numbered {
            before,
            digits,
            after,
            ..
        } = self;
        self.folder.join(format!("{before}{frame:0digits$}{after}"))
    }

    /// How many frames there are, from 0 on without a gap.
    pub(super) fn count(&self) -> u32 {
        (0..)
            .find(|frame| !self.path(*frame).exists())
            .unwrap_or(u32::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_numbers() -> Result<(), CliError> {
        let of = |name: &str, frame| {
            Ok::<_, CliError>(Numbered::of(Path::new(name))?.map(|name| name.path(frame)))
        };
        assert_eq!(of("a/b_####.exr", 7)?, Some("a/b_0007.exr".into()));
        assert_eq!(of("#.png", 12)?, Some("12.png".into()));
        assert_eq!(of("a##.exr", 123)?, Some("a123.exr".into()));
        assert_eq!(of("a#/b.exr", 7)?, None);
        assert!(of("a#b#.exr", 7).is_err());
        Ok(())
    }
}
