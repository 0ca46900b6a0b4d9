//! The settings that suit a scene, where no preset is named.

use crate::frame::FrameSettings;
use crate::gi::Context;
use crate::gi::entry::{Entry, Suited};
use crate::gi::registry;
use crate::gi::settings::Settings;
use crate::graph::Gpu;
use crate::render::GpuScene;
use crate::scene::Scene;

use super::CliError;
use super::common::{TechniqueArgs, bad_setting, warn_of_idle};
use super::frame::FrameArgs;

/// What a command says of the settings that suit a scene.
pub(super) struct Suiting<'a> {
    pub(super) technique: &'a TechniqueArgs,
    pub(super) frame: &'a FrameArgs,
    /// Width and height (px).
    pub(super) size: [u32; 2],
    /// Whether the choice is not said.
    pub(super) quiet: bool,
}

/// The settings of a technique, and of the frame.
pub(super) struct Chosen {
    pub(super) settings: Settings,
    pub(super) frame: FrameSettings,
    /// What was chosen for the scene, why, and what it would need to be right; `None` where a
    /// preset is named, or nothing depends on scenes.
    pub(super) suited: Option<String>,
}

impl Suiting<'_> {
    /// The settings of a technique, and of the frame; on top of them what suits the scene, which
    /// is said in a line, where no preset is named. What is set by name stays.
    pub(super) fn of(
        &self,
        (entry, settings): (&'static Entry, Settings),
        gpu: &Gpu,
        (gpu_scene, scene): (&GpuScene, &Scene),
    ) -> Result<Chosen, CliError> {
        let (args, frame, size) = (self.technique, self.frame, self.size.into());
        let context = Context {
            gpu,
            scene: gpu_scene,
            size: self.size,
            eye: scene.camera.eye,
            lend: registry::lend,
        };
        let suited = match args.preset {
            Some(_) => None,
            None => (entry.suit)(&context, &args.set).map_err(CliError::failed)?,
        };
        let Some(mut suited) = suited else {
            return Ok(Chosen {
                settings,
                frame: frame.settings(size),
                suited: None,
            });
        };
        let named: Vec<&str> = args.set.iter().map(|pair| name_of(pair)).collect();
        suited.pairs.retain(|pair| !named.contains(&name_of(pair)));
        let pairs: Vec<String> = suited.pairs.iter().chain(&args.set).cloned().collect();
        // What had no effect before has been said.
        let said = entry.without_effect(&args.set, &settings);
        let unsaid = |pair: &&String| !said.contains(&name_of(pair));
        let new: Vec<String> = args.set.iter().filter(unsaid).cloned().collect();
        let settings = entry.settings(None, &pairs).map_err(bad_setting)?;
        warn_of_idle([(entry, &settings)], &new);
        let frame = frame.suited(size, suited.shadow_resolution);
        let line = line_of(&suited, &settings, &frame);
        if !self.quiet {
            eprintln!("chosen for this scene: {line}");
        }
        Ok(Chosen {
            settings,
            frame,
            suited: Some(line),
        })
    }
}

/// The name in `name=value`.
fn name_of(pair: &str) -> &str {
    pair.split('=').next().unwrap_or_default().trim()
}

/// What was chosen for the scene, why, and what it would need to be right.
fn line_of(suited: &Suited, settings: &Settings, frame: &FrameSettings) -> String {
    let is_chosen = |name: &str| suited.pairs.iter().any(|pair| name_of(pair) == name);
    let pairs: Vec<String> = settings
        .iter()
        .filter(|(name, _)| is_chosen(name))
        .map(|(name, value)| format!("{name}={value}"))
        .chain([format!("maps of {}²", frame.shadows.resolution)])
        .collect();
    let needs = suited.needs.iter().map(|needs| format!("; {needs}"));
    format!(
        "{} ({}){}",
        pairs.join(", "),
        suited.because,
        needs.collect::<String>()
    )
}
