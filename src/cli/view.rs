//! `lumivox view`: the windowed demo.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::gi::registry::{DEFAULT, find};
use crate::graph::GpuOptions;
use crate::measure::report::Timing;
use crate::scene::Scene;
use crate::view::{Options, ViewError, parse_script, run as run_view};

use super::CliError;
use super::common::{DeviceArgs, LoadArgs, TimingArgs, parse_size, settings, warn_of_idle};
use super::frame::FrameArgs;

/// Open a window: techniques side by side, everything changed by hand, and what it costs.
#[derive(clap::Args)]
#[command(after_help = "Example:\n\
\x20 lumivox view bundled:atrium")]
pub(crate) struct Args {
    /// `bundled:NAME`, or the path of a .toml, .obj, .gltf or .glb file.
    #[arg(default_value = "bundled:cornell")]
    scene: OsString,
    /// Technique; `lumivox techniques` lists them.
    #[arg(long, default_value = DEFAULT)]
    technique: String,
    /// Preset of the technique.
    #[arg(long)]
    preset: Option<String>,
    /// One setting of the technique, on top of the preset; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Width and height of the window (px) [default: as it was closed].
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// Pixels of a point [default: what the display says].
    #[arg(long, value_name = "X", value_parser = parse_scale)]
    scale: Option<f32>,
    /// Do not wait for the display.
    #[arg(long)]
    no_vsync: bool,
    /// The folder of shaders that are compiled again when they change [default: glsl, where it is
    /// in the folder that this runs in].
    #[arg(long, value_name = "DIR")]
    glsl: Option<PathBuf>,
    /// Run with the Vulkan validation layer and synchronization validation; any message is a
    /// failure at the end.
    #[arg(long)]
    validate: bool,
    /// Carry out the actions of a file, then close; docs/view.md lists them.
    #[arg(long, value_name = "FILE", hide = true)]
    script: Option<PathBuf>,
    #[command(flatten)]
    load: LoadArgs,
    #[command(flatten)]
    frame: FrameArgs,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    timing: TimingArgs,
}

/// Loads the scene and opens the window.
pub(crate) fn run(args: &Args) -> Result<(), CliError> {
    let technique = find(&args.technique).map_err(CliError::input)?;
    let chosen = settings(technique, args.preset.as_deref(), &args.set)?;
    warn_of_idle([(technique, &chosen)], &args.set);
    let unreadable = |path: &Path, error: &dyn std::fmt::Display| {
        CliError::input(format!("{}: {error}", path.display()))
    };
    let script = match &args.script {
        Some(path) => {
            let text = std::fs::read_to_string(path).map_err(|error| unreadable(path, &error))?;
            Some(parse_script(&text).map_err(|error| unreadable(path, &error))?)
        }
        None => None,
    };
    if let Some(folder) = args.glsl.as_ref().filter(|folder| !folder.is_dir()) {
        return Err(CliError::input(format!(
            "--glsl {}: there is no such folder",
            folder.display()
        )));
    }
    let shaders = args
        .glsl
        .clone()
        .or_else(|| Some(PathBuf::from("glsl")).filter(|folder| folder.join("render").is_dir()));
    let load = args.load.options();
    let scene = Scene::open(&args.scene, &load).map_err(CliError::input)?;
    let gpu = args.device.options()?;
    let isolate_passes = args.timing.choice(&gpu)? == Timing::Host;
    let options = Options {
        source: args.scene.clone(),
        scene,
        load,
        technique,
        preset: args.preset.clone(),
        set: args.set.clone(),
        shadows: args.frame.shadows(),
        size: args.size.map(Into::into),
        scale: args.scale,
        vsync: args.no_vsync.then_some(false),
        gpu: GpuOptions {
            validate: gpu.validate || args.validate,
            isolate_passes,
            ..gpu
        },
        device: args.device.name(),
        shaders,
        script,
    };
    run_view(options).map_err(|error| match error {
        ViewError::Setting(_) => CliError::input(error),
        error => CliError::failed(error),
    })
}

fn parse_scale(text: &str) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|scale| (0.5..=4.0).contains(scale))
        .ok_or_else(|| String::from("write a number from 0.5 to 4"))
}
