//! The windowed demo: techniques side by side on a scene, everything changed by hand, and what it
//! costs.
//!
//! Techniques are rendered on another thread, in short submissions, so that the window answers
//! while a frame takes seconds. Their light stays on the device: the window draws it as colours,
//! and egui's panels over it. What is shown at rest is, bit for bit, what `lumivox render` writes.

mod app;
mod beam;
mod beside;
mod camera;
mod command;
mod drive;
mod pane;
mod panels;
mod picture;
mod reload;
mod script;
mod session;
mod simulator;
mod sky;
mod store;
mod suit;
mod truth;
mod views;
mod window;
mod worker;

use std::collections::VecDeque;
use std::ffi::OsString;
use std::path::PathBuf;

use winit::event_loop::EventLoop;

use crate::gi::SettingError;
use crate::gi::entry::Entry;
use crate::graph::{Error, GpuOptions};
use crate::render::ShadowSettings;
use crate::scene::{LoadOptions, Scene};
use crate::text::counted;

pub use panels::SECTIONS;
pub use script::{Action, Line, ScriptError, parse as parse_script};

/// What a window opens with.
pub struct Options {
    /// The scene as it was named, for recent scenes and command lines.
    pub source: OsString,
    /// The loaded scene.
    pub scene: Scene,
    /// How it was loaded, and how others are.
    pub load: LoadOptions,
    /// The technique of the left side.
    pub technique: &'static Entry,
    /// Its preset; `None` for the default.
    pub preset: Option<String>,
    /// `KEY=VALUE` on top of the preset.
    pub set: Vec<String>,
    /// The maps of the lights.
    pub shadows: ShadowSettings,
    /// Width and height of the window (px); `None` for the remembered one.
    pub size: Option<[u32; 2]>,
    /// Pixels of a point; `None` for what the display says.
    pub scale: Option<f32>,
    /// Whether pictures wait for the display; `None` for what is remembered.
    pub vsync: Option<bool>,
    /// The device, and whether it is validated.
    pub gpu: GpuOptions,
    /// The device as the user named it.
    pub device: Option<String>,
    /// GLSL that is compiled again when it changes; `None` to watch nothing.
    pub shaders: Option<PathBuf>,
    /// Actions that drive the window; with them, nothing is remembered.
    pub script: Option<VecDeque<Line>>,
}

/// Why there is no window, or why it closed.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// There is no display.
    #[error(
        "no window can be opened ({0}); without a display, render to a file instead: lumivox \
         render SCENE -o FILE.png"
    )]
    NoDisplay(String),
    /// A setting cannot be used as given.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// Vulkan could not do what was asked.
    #[error(transparent)]
    Vulkan(#[from] Error),
    /// The system has no more threads.
    #[error("a thread cannot be started: {0}")]
    Thread(#[from] std::io::Error),
    /// An action of the script failed.
    #[error("the script's action `{action}`: {problem}")]
    Script {
        /// The action that failed, as the script has it.
        action: String,
        /// What went wrong, in words.
        problem: String,
    },
    /// The validation layer had something to say.
    #[error("{}, the first: {first}", counted(*count, "validation message"))]
    Validation {
        /// Number of messages.
        count: usize,
        /// Text of the first one.
        first: String,
    },
}

/// Names of what a side of the window can show.
pub fn view_names() -> impl Iterator<Item = &'static str> {
    views::VIEWS.iter().map(|view| view.name)
}

/// Opens the window and stays until it is closed.
pub fn run(options: Options) -> Result<(), ViewError> {
    let no_display = |error: &dyn std::fmt::Display| ViewError::NoDisplay(error.to_string());
    let events = EventLoop::<()>::with_user_event()
        .build()
        .map_err(|error| no_display(&error))?;
    let mut app = app::App::new(options, events.create_proxy())?;
    let ended = events.run_app(&mut app);
    app.finish()?;
    ended.map_err(|error| no_display(&error))
}
