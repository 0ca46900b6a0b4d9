//! The command line of `lumivox render` that makes the picture in the window.

use std::ffi::OsStr;

use super::pane::rest_frames;
use super::picture::{Look, ToneMap, aov_of};
use super::views::{Source, View};
use super::worker::PaneJob;
use crate::image::Aov;
use crate::render::ShadowSettings;
use crate::scene::{
    Camera, Environment, Light, LoadOptions, Scene, Up, camera_toml, environment_toml, lights_toml,
};
use crate::text::number;

/// What a command line is made from.
pub(super) struct Wanted<'w> {
    /// As it was named.
    pub(super) source: &'w OsStr,
    /// As it was loaded.
    pub(super) scene: &'w Scene,
    /// How it was loaded.
    pub(super) load: LoadOptions,
    /// The lights as they are now.
    pub(super) lights: &'w [Light],
    /// The environment as it is now.
    pub(super) environment: Environment,
    /// The camera as it is now.
    pub(super) camera: Camera,
    /// The technique and what is shown.
    pub(super) pane: &'w PaneJob,
    /// Preset and settings as the user chose them.
    pub(super) technique: (Option<&'static str>, &'w [String]),
    /// The view that is shown.
    pub(super) view: &'w View,
    /// Width and height (px).
    pub(super) size: [u32; 2],
    /// The maps of the lights.
    pub(super) shadows: ShadowSettings,
    /// Exposure and tone map.
    pub(super) look: Look,
    /// The device, where the user named one.
    pub(super) device: Option<&'w str>,
    /// The file that is written.
    pub(super) output: &'w str,
}

impl Wanted<'_> {
    /// The words after `lumivox`. If `lumivox render` has no option for a part of the picture, the
    /// error names that part.
    pub(super) fn words(&self) -> Result<Vec<String>, String> {
        let shown = self.shown()?;
        let Some(source) = self.source.to_str() else {
            return Err("the scene's path is not UTF-8".to_owned());
        };
        let mut words = vec!["render".to_owned(), source.to_owned()];
        let mut add = |option: &str, value: String| words.extend([option.to_owned(), value]);
        if self.camera != self.scene.camera {
            add("--with", camera_toml(&self.camera));
        }
        if *self.lights != *self.scene.lights {
            // The environment brings its own.
            let is_own = |light: &&Light| Some(**light) != self.environment.sun();
            let lights: Vec<Light> = self.lights.iter().filter(is_own).copied().collect();
            add("--with", lights_toml(&lights));
        }
        if self.environment != self.scene.environment {
            add(
                "--with",
                environment_toml(&self.environment).ok_or("the sky is in no file")?,
            );
        }
        add("--technique", self.pane.entry.name.to_owned());
        self.technique
            .0
            .iter()
            .for_each(|preset| add("--preset", (*preset).to_owned()));
        self.technique
            .1
            .iter()
            .for_each(|pair| add("--set", pair.clone()));
        add("--size", format!("{}x{}", self.size[0], self.size[1]));
        add("--shadow-resolution", self.shadows.resolution.to_string());
        for (name, value) in self.shadows.changes() {
            add(&format!("--{name}"), value);
        }
        match shown {
            Shown::Aov(Aov::Full) => {}
            Shown::Aov(aov) => add("--aov", aov.to_string()),
            Shown::Own(view) => {
                add("--view", view.to_owned());
                add("--level", self.pane.layer.to_string());
            }
        }
        if rest_frames(self.pane) > 1 {
            add("--frames", rest_frames(self.pane).to_string());
        }
        if self.load.up == Up::Z {
            add("--up", "z".to_owned());
        }
        if self.look.exposure != 1.0 || Scene::is_model_alone(self.source) {
            add("--exposure", number(self.look.exposure));
        }
        self.device
            .iter()
            .for_each(|device| add("--device", (*device).to_owned()));
        add("-o", self.output.to_owned());
        if self.load.allow_missing_textures {
            words.push("--allow-missing-textures".to_owned());
        }
        Ok(words)
    }

    /// The whole line, quoted for a shell.
    pub(super) fn line(&self) -> Result<String, String> {
        Ok(format!(
            "lumivox {}",
            self.words()?
                .iter()
                .map(|word| quoted(word))
                .collect::<Vec<_>>()
                .join(" ")
        ))
    }

    fn shown(&self) -> Result<Shown, String> {
        let is_png = self.output.to_lowercase().ends_with(".png");
        if is_png && self.look.tone_map != ToneMap::Clamp {
            return Err("`lumivox render` has no tone map but the clamp".to_owned());
        }
        match self.view.source {
            Source::Aov(Aov::Full) => {
                aov_of(self.pane.components).map(Shown::Aov).ok_or_else(|| {
                    "`lumivox render` has no output of these components alone; save the picture \
                     instead"
                        .to_owned()
                })
            }
            Source::Aov(aov) => Ok(Shown::Aov(aov)),
            Source::Own(view) => Ok(Shown::Own(view.name)),
            _ => Err(format!(
                "`lumivox render` has no output {}; save the picture instead",
                self.view.name
            )),
        }
    }
}

/// What `lumivox render` writes.
enum Shown {
    Aov(Aov),
    Own(&'static str),
}

/// A word as a POSIX shell reads it.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=,".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_with_spaces_and_quotes_are_quoted() {
        assert_eq!(quoted("bundled:cornell"), "bundled:cornell");
        assert_eq!(quoted("a b"), "'a b'");
        assert_eq!(quoted("it's"), "'it'\\''s'");
        assert_eq!(quoted(""), "''");
    }
}
