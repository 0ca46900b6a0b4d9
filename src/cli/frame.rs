//! What all techniques share, as options: the maps of the lights.

use crate::frame::FrameSettings;
use crate::render::{CASCADES, ShadowFilter, ShadowSettings};

/// What all techniques share.
#[derive(clap::Args)]
#[command(next_help_heading = "Frame")]
pub(super) struct FrameArgs {
    /// Width and height of each shadow map and reflective shadow map (texels) [default: 1024; of
    /// chart, fit and stress 256].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(16..=8192))]
    shadow_resolution: Option<u32>,
    /// Maps of a directional light: 1 of the whole scene, or cascades that follow the camera
    /// [default: 1].
    #[arg(long, value_name = "N", value_parser = parse_cascades)]
    cascades: Option<u32>,
    /// Where cascades end: logarithmic (1) to uniform (0) [default: 0.995].
    #[arg(long, value_name = "X", value_parser = parse_share)]
    split_lambda: Option<f32>,
    /// How direct light compares with shadow maps: point, pcf or pcss [default: pcf].
    #[arg(long, value_name = "FILTER")]
    shadow_filter: Option<ShadowFilter>,
    /// Angular diameter of directional lights for pcss (degrees) [default: 0.53, the sun's].
    #[arg(long, value_name = "DEG", value_parser = parse_sun_angle)]
    sun_angle: Option<f32>,
}

impl FrameArgs {
    /// The maps of the lights; `resolution` is the default of their width and height (texels).
    fn shadows_of(&self, resolution: u32) -> ShadowSettings {
        let default = ShadowSettings::of_resolution(self.shadow_resolution.unwrap_or(resolution));
        let chosen = ShadowSettings {
            cascades: self.cascades.unwrap_or(default.cascades),
            split_lambda: self.split_lambda.unwrap_or(default.split_lambda),
            filter: self.shadow_filter.unwrap_or(default.filter),
            sun_angle_deg: self.sun_angle.unwrap_or(default.sun_angle_deg),
            ..default
        };
        if self.split_lambda.is_some() && chosen.cascades == 1 {
            log::warn!("--split-lambda: no effect without --cascades 2 or more");
        }
        if self.sun_angle.is_some() && chosen.filter != ShadowFilter::Pcss {
            log::warn!("--sun-angle: no effect without --shadow-filter pcss");
        }
        chosen
    }

    /// The maps of the lights.
    pub(super) fn shadows(&self) -> ShadowSettings {
        self.shadows_of(1024)
    }

    /// For pictures of this width and height (px).
    pub(super) fn settings(&self, size: (u32, u32)) -> FrameSettings {
        self.suited(size, None)
    }

    /// The same; `resolution` is the default of maps' width and height that suits a scene (texels).
    pub(super) fn suited(
        &self,
        (width, height): (u32, u32),
        resolution: Option<u32>,
    ) -> FrameSettings {
        FrameSettings {
            size: [width, height],
            shadows: self.shadows_of(resolution.unwrap_or(1024)),
        }
    }

    /// For the small pictures that are measured by the hundred.
    pub(super) fn small(&self, (width, height): (u32, u32)) -> FrameSettings {
        FrameSettings {
            size: [width, height],
            shadows: self.shadows_of(256),
        }
    }
}

fn parse_cascades(text: &str) -> Result<u32, String> {
    let (least, most) = (CASCADES.start(), CASCADES.end());
    let count = text.parse().ok().filter(|count| CASCADES.contains(count));
    count.ok_or_else(|| format!("write a whole number of {least} to {most}"))
}

fn parse_share(text: &str) -> Result<f32, String> {
    let share = text
        .parse()
        .ok()
        .filter(|share| (0.0..=1.0).contains(share));
    share.ok_or_else(|| String::from("write a number of 0 to 1"))
}

fn parse_sun_angle(text: &str) -> Result<f32, String> {
    let angle = text.parse().ok();
    angle
        .filter(|angle| *angle > 0.0 && *angle <= 20.0)
        .ok_or_else(|| String::from("write a number above 0 and up to 20"))
}
