//! Commands that a page tells: they measure a point again, render it, or put it to the stress test.

use std::path::Path;

use super::point::Point;
use crate::gi::registry;
use crate::measure::report::Timing;
use crate::metrics::Channel;

/// Measures a point again.
pub(super) fn measure(source: &str, point: &Point) -> String {
    let setup = &point.setup;
    let channel = if setup.channel == Channel::Luminance {
        ""
    } else {
        " --channel rgb"
    };
    let visibility = setup.visibility.map_or(String::new(), |occlusion| {
        let distance = occlusion
            .distance_m
            .map_or(String::new(), |m| format!(" --occlusion-distance {m}"));
        let falloff = occlusion.falloff;
        format!(" --aov visibility{distance} --occlusion-falloff {falloff}")
    });
    let timing = if setup.timing == Timing::Host {
        "host"
    } else {
        "timestamps"
    };
    format!(
        "lumivox bench {source}{}{}{}{} --frames {} --rebuilds {} \
         --max-error {}{channel}{visibility} --timing {timing} -o again",
        technique(point),
        resolution(point.resolution()),
        changes(point),
        picture(point),
        setup.frames,
        setup.rebuilds,
        setup.max_error
    )
}

/// Renders the picture of a point of the scene `source`.
pub fn render(source: &str, point: &Point) -> String {
    let resolution = point
        .resolution()
        .map(|resolution| format!(" --set resolution={resolution}"))
        .unwrap_or_default();
    let frames = match frames_to_rest(point) {
        1 => String::new(),
        frames => format!(" --frames {frames}"),
    };
    format!(
        "lumivox render {source}{}{resolution}{}{}{frames} -o picture.png",
        technique(point),
        changes(point),
        picture(point)
    )
}

/// Frames until its picture has all its light; 1 where this program has no such technique.
fn frames_to_rest(point: &Point) -> u32 {
    let pairs = point
        .settings
        .iter()
        .map(|(name, value)| format!("{name}={value}"));
    registry::find(&point.technique)
        .ok()
        .and_then(|entry| {
            let settings = entry.settings(None, &pairs.collect::<Vec<_>>()).ok()?;
            Some(entry.rest(&settings))
        })
        .unwrap_or(1)
}

/// Puts it to the stress test, at a resolution that the suite can have.
pub(super) fn stress(folder: &Path, point: &Point, resolution: Option<u32>) -> String {
    let resolution = self::resolution(
        resolution
            .map(|resolution| resolution.to_string())
            .as_deref(),
    );
    format!(
        "lumivox stress{}{resolution}{} -o {}",
        technique(point),
        changes(point),
        quoted(&folder.display().to_string())
    )
}

/// A word of a command line as a shell reads it and no program takes it for an option.
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./:=,+@%".contains(c);
    let word = if word.starts_with('-') {
        format!("./{word}")
    } else {
        word.to_owned()
    };
    if !word.is_empty() && word.chars().all(is_plain) {
        word
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

fn technique(point: &Point) -> String {
    format!(
        " --technique {}{}",
        point.technique,
        point
            .preset
            .as_ref()
            .map(|preset| format!(" --preset {preset}"))
            .unwrap_or_default()
    )
}

fn resolution(resolution: Option<&str>) -> String {
    resolution
        .map(|resolution| format!(" --resolution {resolution}"))
        .unwrap_or_default()
}

fn changes(point: &Point) -> String {
    point
        .changes
        .iter()
        .map(|(name, value)| format!(" --set {name}={value}"))
        .collect()
}

fn shadow_options(point: &Point) -> String {
    let shadows = point.setup.shadows.iter();
    shadows
        .map(|(name, value)| format!(" --{name} {value}"))
        .collect()
}

fn picture(point: &Point) -> String {
    let setup = &point.setup;
    format!(
        " --size {}x{} --shadow-resolution {}{}",
        setup.size[0],
        setup.size[1],
        setup.shadow_resolution,
        shadow_options(point)
    )
}

#[cfg(test)]
mod tests {
    use super::super::point::tests::point;
    use super::*;

    #[test]
    fn words_survive_the_shell() {
        assert_eq!(
            ["bundled:cornell", "a b", "it's", "", "-a.toml"].map(quoted),
            ["bundled:cornell", "'a b'", r"'it'\''s'", "''", "./-a.toml"]
        );
    }

    /// A picture with feedback is that of a frame in which the light has all its bounces.
    #[test]
    fn feedback_is_rendered_until_it_has_its_light() {
        let mut point = point("svo", 1, [9.0, 1.0], 1 << 20, 0.04);
        assert!(!render("room.toml", &point).contains("--frames"));
        point.settings.insert("bounces".into(), "feedback".into());
        assert!(render("room.toml", &point).contains(" --frames 17 -o picture.png"));
    }
}
