//! What several subcommands need.

use std::ffi::{OsStr, OsString};
use std::io::{ErrorKind, Write as _};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Duration;

use crate::gi::entry::Entry;
use crate::gi::registry::{DEFAULT, find, owners};
use crate::gi::{SettingError, Settings};
use crate::graph::{DeviceChoice, Faults, GpuOptions, ScreenFormat};
use crate::measure::bench::{Case, choose_timing};
use crate::measure::chart::quoted;
use crate::measure::report::Timing;
use crate::metrics::Channel;
use crate::reference::{MAX_SIZE_PX, cache_dir};
use crate::scene::{LoadOptions, Scene, Up};
use indicatif::{ProgressBar, ProgressStyle};

use super::CliError;
use super::files::Files;

/// How scenes are loaded, shared by the commands that open scenes.
#[derive(clap::Args)]
#[command(next_help_heading = "Scene")]
pub(super) struct LoadArgs {
    /// Render missing textures and materials mid-grey instead of failing.
    #[arg(long)]
    allow_missing_textures: bool,
    /// The axis that points up in an .obj given alone; a .toml says it by `rotate_deg`.
    #[arg(long, value_name = "y|z", default_value = "y", value_parser = parse_up)]
    up: Up,
}

impl LoadArgs {
    /// The same, for [`Scene::open`].
    pub(super) fn options(&self) -> LoadOptions {
        LoadOptions {
            allow_missing_textures: self.allow_missing_textures,
            up: self.up,
        }
    }
}

/// An axis that points up, by its name.
pub(super) fn parse_up(text: &str) -> Result<Up, String> {
    match text {
        "y" => Ok(Up::Y),
        "z" => Ok(Up::Z),
        _ => Err(String::from("write y or z")),
    }
}

/// The scene argument, shared by the commands that take a scene.
#[derive(clap::Args)]
#[command(next_help_heading = "Scene")]
pub(super) struct SceneArgs {
    /// `bundled:NAME`, or the path of a .toml, .obj, .gltf or .glb file. A model alone gets a
    /// camera, a light and, as a .png, an exposure.
    scene: OsString,
    #[command(flatten)]
    load: LoadArgs,
    /// TOML in the scene format that replaces the scene's camera, light or environment, as
    /// `lumivox view` copies it: 'camera = { eye = [0.0, 1.0, 2.0], target = [0.0, 1.0, 0.0]
    /// }'; may be repeated.
    #[arg(long, value_name = "TOML")]
    with: Vec<String>,
    #[command(flatten)]
    time: TimeArgs,
}

impl SceneArgs {
    /// Loads the scene, at the time that was asked for; none of its files is one that is written.
    pub(super) fn open(&self, files: &mut Files) -> Result<Scene, CliError> {
        files.read_source(&self.scene)?;
        let mut scene = Scene::open(&self.scene, &self.load.options()).map_err(CliError::input)?;
        files.read_scene(&scene)?;
        self.time.apply(&mut scene)?;
        self.with
            .iter()
            .try_for_each(|text| scene.overlay("--with", text))
            .map_err(CliError::input)?;
        Ok(scene)
    }

    /// The scene and its options, as a command line has them, at a time (s) and with more that
    /// replaces parts of the scene.
    pub(super) fn words(&self, time_s: Option<f32>, with: &[String]) -> String {
        let quoted = |word: &OsStr| quoted(&word.to_string_lossy());
        let mut words = vec![quoted(&self.scene)];
        let mut option = |name: &str, value: Option<String>| {
            words.extend(value.map(|value| format!("{name} {value}")));
        };
        option("--up", (self.load.up == Up::Z).then(|| "z".to_owned()));
        option("--time", time_s.map(|time_s| time_s.to_string()));
        for text in self.with.iter().chain(with) {
            option("--with", Some(quoted(text.as_ref())));
        }
        if self.load.allow_missing_textures {
            words.push("--allow-missing-textures".to_owned());
        }
        words.join(" ")
    }

    /// Whether it stands on the command line how a part of the scene is replaced.
    pub(super) fn replaces(&self) -> bool {
        !self.with.is_empty()
    }

    /// As it stands on the command line.
    pub(super) fn source(&self) -> &OsStr {
        &self.scene
    }

    /// The time \[s\], where one is asked for.
    pub(super) fn time_s(&self) -> Option<f32> {
        self.time.time_s()
    }
}

/// The time at which a scene with keyframes is shown.
#[derive(clap::Args)]
pub(super) struct TimeArgs {
    /// Seconds at which the models with keyframes are shown [default: 0].
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    time: Option<f32>,
}

impl TimeArgs {
    /// The time (s), where one is asked for.
    pub(super) fn time_s(&self) -> Option<f32> {
        self.time
    }

    /// Moves the scene's models.
    pub(super) fn apply(&self, scene: &mut Scene) -> Result<(), CliError> {
        let Some(time_s) = self.time else {
            return Ok(());
        };
        if !time_s.is_finite() {
            return Err(CliError::input(format!(
                "--time is {time_s}; it must be a number of seconds"
            )));
        }
        if !scene.moves() {
            log::warn!(
                "{}: no model has keyframes; --time changes nothing",
                scene.name
            );
        }
        scene.set_time(time_s);
        Ok(())
    }
}

/// Which technique, with which settings.
#[derive(clap::Args)]
#[command(next_help_heading = "Technique")]
pub(super) struct TechniqueArgs {
    /// Technique; `lumivox techniques` lists them.
    #[arg(long, default_value = DEFAULT)]
    technique: String,
    /// Preset of the technique.
    #[arg(long)]
    pub(super) preset: Option<String>,
    /// One setting of the technique, on top of the preset; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) set: Vec<String>,
}

impl TechniqueArgs {
    /// The technique and all its settings, `more` on top of those that are set here.
    pub(super) fn choose(
        &self,
        more: impl IntoIterator<Item = String>,
    ) -> Result<(&'static Entry, Settings), CliError> {
        let entry = find(&self.technique).map_err(CliError::input)?;
        let set: Vec<String> = self.set.iter().cloned().chain(more).collect();
        let settings = settings(entry, self.preset.as_deref(), &set)?;
        warn_of_idle([(entry, &settings)], &self.set);
        if entry.screen(&settings).shows_patterns() {
            log::warn!(
                "interleave_window=off: without history and blur each pixel has its own directions \
                 alone, which is noise; --set history=32, or --set blur=even"
            );
        }
        Ok((entry, settings))
    }

    /// The preset that the settings started from.
    pub(super) fn preset(&self, entry: &Entry) -> Option<String> {
        self.preset
            .clone()
            .or_else(|| entry.presets.first().map(|preset| preset.name.to_owned()))
    }
}

/// The settings of a technique. What it does not know is said with who does.
pub(super) fn settings(
    entry: &Entry,
    preset: Option<&str>,
    pairs: &[String],
) -> Result<Settings, CliError> {
    entry.settings(preset, pairs).map_err(bad_setting)
}

/// A setting that cannot be used; one of other techniques is said to be theirs.
pub(super) fn bad_setting(error: SettingError) -> CliError {
    let SettingError::Unknown { name, known } = &error else {
        return CliError::input(error);
    };
    let owners = owners(name).join(" and ");
    if owners.is_empty() {
        return CliError::input(error);
    }
    CliError::input(format!(
        "there is no setting {name}: it is one of {owners}; there are: {known}"
    ))
}

/// Names the given settings that have an effect in none of these cases.
pub(super) fn warn_of_idle<'c>(
    cases: impl IntoIterator<Item = (&'c Entry, &'c Settings)>,
    given: &[String],
) {
    let all_idle = cases
        .into_iter()
        .map(|(entry, settings)| entry.without_effect(given, settings))
        .reduce(|mut idle, other| {
            idle.retain(|name| other.contains(name));
            idle
        });
    let idle = all_idle.unwrap_or_default();
    if !idle.is_empty() {
        log::warn!(
            "--set: no effect together with the others: {}",
            idle.join(", ")
        );
    }
}

/// As [`warn_of_idle`], of what is measured.
pub(super) fn warn_of_idle_in(cases: &[Case], given: &[String]) {
    warn_of_idle(cases.iter().map(|case| (case.entry, &case.settings)), given);
}

/// The Vulkan device to run on.
#[derive(clap::Args)]
#[command(next_help_heading = "Device")]
pub(super) struct DeviceArgs {
    /// Device, by index or part of its name; `lumivox devices` lists them.
    #[arg(long, value_name = "INDEX|NAME")]
    device: Option<String>,
    /// Who traces rays against triangles: device (VK_KHR_ray_query), or shader [default: shader on
    /// a CPU device and where the device cannot, device elsewhere].
    #[arg(long, value_name = "device|shader", value_parser = parse_rays)]
    rays: Option<bool>,
    /// What light in images of the screen's size is kept in [default: rgba32f].
    #[arg(long, value_name = "rgba32f|rgba16f", value_parser = parse_screen_format)]
    screen_format: Option<ScreenFormat>,
}

fn parse_screen_format(text: &str) -> Result<ScreenFormat, String> {
    match text {
        "rgba32f" => Ok(ScreenFormat::Float32),
        "rgba16f" => Ok(ScreenFormat::Float16),
        _ => Err(String::from("write rgba32f or rgba16f")),
    }
}

fn parse_rays(text: &str) -> Result<bool, String> {
    match text {
        "device" => Ok(true),
        "shader" => Ok(false),
        _ => Err(String::from("write device or shader")),
    }
}

impl DeviceArgs {
    /// How to open it; without a choice, the best device. For tests, `LUMIVOX_VALIDATE=1` is
    /// `--validate` for every command, and `LUMIVOX_FAULTS` says what goes wrong.
    pub(super) fn options(&self) -> Result<GpuOptions, CliError> {
        let device = self
            .device
            .as_deref()
            .map(DeviceChoice::from)
            .unwrap_or_default();
        let faults: Faults = std::env::var("LUMIVOX_FAULTS")
            .unwrap_or_default()
            .parse()
            .map_err(CliError::input)?;
        let validate = std::env::var_os("LUMIVOX_VALIDATE").is_some_and(|value| value == "1");
        Ok(GpuOptions {
            device,
            device_rays: self.rays,
            screen_format: self.screen_format.unwrap_or_default(),
            validate,
            faults,
            cache_dir: Some(cache_dir()),
            progress: Some(show_work),
            ..GpuOptions::default()
        })
    }

    /// As it was named.
    pub(super) fn name(&self) -> Option<String> {
        self.device.clone()
    }
}

/// How passes are timed.
#[derive(clap::Args)]
#[command(next_help_heading = "Device")]
pub(super) struct TimingArgs {
    /// Where times come from: the device's timestamps, or the host, which submits every pass by
    /// itself [default: host on a CPU device, device elsewhere].
    #[arg(long, value_name = "host|device", value_parser = parse_timing)]
    timing: Option<Timing>,
}

impl TimingArgs {
    /// The choice; without one, what suits the device.
    pub(super) fn choice(&self, options: &GpuOptions) -> Result<Timing, CliError> {
        self.timing
            .map_or_else(|| choose_timing(options), Ok)
            .map_err(CliError::failed)
    }
}

fn parse_timing(text: &str) -> Result<Timing, String> {
    match text {
        "host" => Ok(Timing::Host),
        // As records have it.
        "device" | "timestamps" => Ok(Timing::Timestamps),
        _ => Err(String::from("write host or device")),
    }
}

/// What went wrong with the standard output, if anything.
static UNSAID: OnceLock<std::io::Error> = OnceLock::new();

/// Prints a line; [`check_said`] tells a failure.
pub(super) fn say(line: &str) {
    said(writeln!(std::io::stdout(), "{line}"));
}

/// Keeps the first failure of the standard output. A closed pipe is none: its reader has enough.
pub(super) fn said(result: std::io::Result<()>) {
    if let Err(error) = result
        && error.kind() != ErrorKind::BrokenPipe
    {
        UNSAID.get_or_init(|| error);
    }
}

/// An error if something could not be printed.
pub(super) fn check_said() -> Result<(), CliError> {
    said(std::io::stdout().flush());
    match UNSAID.get() {
        Some(error) => Err(CliError::failed(format!(
            "cannot write to the standard output: {error}; give it a place that has space"
        ))),
        None => Ok(()),
    }
}

/// An error unless the value of an option is finite and above 0.
pub(super) fn check_positive(option: &str, value: Option<f32>) -> Result<(), CliError> {
    match value.filter(|value| !(value.is_finite() && *value > 0.0)) {
        Some(value) => Err(CliError::input(format!(
            "{option} is {value}; it must be a number above 0"
        ))),
        None => Ok(()),
    }
}

/// A size written as WIDTHxHEIGHT.
pub(super) fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parts = text
        .split_once('x')
        .and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    let (width, height) =
        parts.ok_or_else(|| String::from("write WIDTHxHEIGHT, as in 1280x720"))?;
    let is_possible = |size: &u32| (1..=MAX_SIZE_PX).contains(size);
    if is_possible(&width) && is_possible(&height) {
        Ok((width, height))
    } else {
        Err(format!("width and height must be 1 to {MAX_SIZE_PX} px"))
    }
}

/// A time in seconds, more than 0 and at most an hour.
pub(super) fn parse_seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok().filter(|s: &f64| *s > 0.0 && *s <= 3600.0);
    let seconds = seconds.ok_or("write seconds, more than 0 and at most 3600, as in 2.5")?;
    Ok(Duration::from_secs_f64(seconds))
}

/// A channel by its name.
pub(super) fn parse_channel(text: &str) -> Result<Channel, String> {
    match text {
        "luminance" => Ok(Channel::Luminance),
        "rgb" => Ok(Channel::Rgb),
        _ => Err(String::from("write luminance or rgb")),
    }
}

/// An error if a scene is named twice.
pub(super) fn check_scenes(scenes: &[Scene]) -> Result<(), CliError> {
    let hashes: Vec<u128> = scenes.iter().map(Scene::content_hash).collect();
    match (0..scenes.len()).find(|index| hashes[..*index].contains(&hashes[*index])) {
        Some(twice) => Err(CliError::input(format!(
            "the scene {} is there twice; name each scene once",
            scenes[twice].name
        ))),
        None => Ok(()),
    }
}

/// Values of a list, each once.
pub(super) fn each_once<T: PartialEq + Clone>(values: &[T]) -> Vec<T> {
    values
        .iter()
        .enumerate()
        .filter(|(index, value)| !values[..*index].contains(value))
        .map(|(_, value)| value.clone())
        .collect()
}

/// A bar on stderr, where that is a terminal.
pub(super) fn progress_bar(quiet: bool, steps: usize) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let style =
        ProgressStyle::with_template("{msg:12} {bar:40} {pos}/{len} {elapsed} (about {eta} left)")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(steps as u64).with_style(style)
}

/// Shows on stderr, where that is a terminal, how far the host is with work that takes long.
fn show_work(what: &'static str, share: f32) {
    static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);
    let mut bar = BAR.lock().unwrap_or_else(PoisonError::into_inner);
    if share >= 1.0 {
        if let Some(bar) = bar.take() {
            bar.finish_and_clear();
        }
        return;
    }
    let shown = bar.get_or_insert_with(|| {
        let style = ProgressStyle::with_template(
            "{msg:12} {bar:40} {percent}% {elapsed} (about {eta} left)",
        )
        .unwrap_or_else(|_| ProgressStyle::default_bar());
        ProgressBar::new(1000).with_style(style).with_message(what)
    });
    shown.set_position((1000.0 * share) as u64);
}

/// What a piece of work is and how long it takes, on stderr while it runs, where that is a
/// terminal: for work that cannot say how far it is.
pub(super) fn while_shown<T>(quiet: bool, what: String, work: impl FnOnce() -> T) -> T {
    if quiet {
        return work();
    }
    let style = ProgressStyle::with_template("{spinner} {msg} {elapsed}")
        .unwrap_or_else(|_| ProgressStyle::default_spinner());
    let spinner = ProgressBar::new_spinner()
        .with_style(style)
        .with_message(what);
    spinner.enable_steady_tick(Duration::from_millis(100));
    let result = work();
    spinner.finish_and_clear();
    result
}

/// Something that turns and counts on stderr, where that is a terminal and nobody knows how many
/// steps there are.
pub(super) fn progress_count(quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{spinner} {msg:24} {pos} measured {elapsed}")
        .unwrap_or_else(|_| ProgressStyle::default_spinner());
    ProgressBar::new_spinner().with_style(style)
}
