//! How points of a grid are measured, as options.

use std::time::Duration;

use crate::measure::bench::BenchSettings;
use crate::metrics::Channel;

use super::CliError;
use super::common::{DeviceArgs, TimingArgs, parse_channel, parse_size};
use super::compared::ComparedArgs;
use super::frame::FrameArgs;

/// How points of a grid are measured.
#[derive(clap::Args)]
#[command(next_help_heading = "Measurement")]
pub(super) struct MeasureArgs {
    /// Frames to measure, half in each of two rounds. One before them warms up (16 with
    /// `bounces=feedback`).
    #[arg(
        long,
        value_name = "N",
        default_value_t = 5,
        value_parser = clap::value_parser!(u32).range(1..=100_000),
    )]
    frames: u32,
    /// Builds of the static structure to measure, half in each round, after the first.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 3,
        value_parser = clap::value_parser!(u32).range(1..=100_000),
    )]
    rebuilds: u32,
    /// Width and height (px).
    #[arg(long, value_name = "WxH", default_value = "160x120", value_parser = parse_size)]
    size: (u32, u32),
    /// Compare luminance, or red, green and blue.
    #[arg(
        long,
        value_name = "luminance|rgb",
        default_value = "luminance",
        value_parser = parse_channel,
    )]
    channel: Channel,
    #[command(flatten)]
    compared: ComparedArgs,
    #[command(flatten)]
    frame: FrameArgs,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    timing: TimingArgs,
}

impl MeasureArgs {
    /// The device that was asked for, and how it is to measure.
    pub(super) fn settings(&self) -> Result<BenchSettings, CliError> {
        let gpu = self.device.options()?;
        Ok(BenchSettings {
            timing: self.timing.choice(&gpu)?,
            gpu,
            frame: self.frame.small(self.size),
            warm_up: true,
            frames: self.frames,
            at_least: Duration::ZERO,
            rebuilds: self.rebuilds,
            times: Vec::new(),
            still: false,
            walk: None,
            throughput: None,
            samples: false,
            channel: self.channel,
            visibility: self.compared.visibility()?,
        })
    }
}
