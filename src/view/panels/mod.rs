//! What is drawn in the window: panels at the left, the picture, a status line.

mod beam;
mod canvas;
mod cost;
mod environment;
mod files;
mod help;
mod input;
mod lights;
mod look;
mod simulator;
mod technique;

use std::ffi::OsString;
use std::path::PathBuf;

use egui::{CollapsingHeader, Context, Rect, RichText, ScrollArea, SidePanel, TopBottomPanel, Ui};
use egui_file_dialog::{DialogState, FileDialog};

use super::session::Session;
use super::store::Remembered;
use super::views::VIEWS;
use super::worker::Picture;
use crate::vulkan::PlacedPicture;

pub(super) use canvas::Canvas;

/// Sections of the panels, in their order.
pub const SECTIONS: [&str; 9] = [
    "Scene",
    "Compare",
    "Technique",
    "Picture",
    "Beam",
    SIMULATOR,
    "Camera",
    "Lights",
    "Cost",
];

/// The section that is there with techniques that have a simulator.
const SIMULATOR: &str = "Simulator";

/// Width of the panels (points).
const WIDTH: f32 = 312.0;

/// What stands out.
const ACCENT: egui::Color32 = egui::Color32::from_rgb(255, 170, 60);

/// What is done.
const REST: egui::Color32 = egui::Color32::from_rgb(90, 170, 90);

/// Dark, with text that is read at any scale. Scripts have no use for animations.
pub(super) fn set_style(ctx: &Context, is_script: bool) {
    let mut visuals = egui::Visuals::dark();
    visuals.widgets.noninteractive.fg_stroke.color = egui::Color32::from_gray(205);
    visuals.widgets.inactive.fg_stroke.color = egui::Color32::from_gray(225);
    visuals.weak_text_alpha = 0.75;
    ctx.set_visuals(visuals);
    ctx.style_mut(|style| {
        style.spacing.slider_width = 100.0;
        if is_script {
            style.animation_time = 0.0;
        }
    });
}

/// The state of the panels themselves.
pub(super) struct Panels {
    /// Which sections are open.
    pub(super) open: [bool; SECTIONS.len()],
    pub(super) help: bool,
    /// Whether the status line tells times and rates.
    pub(super) times: bool,
    /// Path of the scene to open, as typed.
    pub(super) scene_path: String,
    /// Path of the picture to save, as typed.
    pub(super) save_path: String,
    /// Whether that path is about to be typed.
    pub(super) wants_path: bool,
    /// Browses for a scene.
    pub(super) dialog: FileDialog,
    /// Where the picture is (points).
    pub(super) picture: Rect,
    /// The pictures of the device, as they are placed beneath the panels.
    pub(super) pictures: Vec<PlacedPicture>,
    /// What is under the pointer.
    pub(super) readout: String,
    /// Where the pointer is over the picture (shares of it).
    pub(super) pointer: Option<[f32; 2]>,
    /// Whether a button or key is held down that changes the picture.
    pub(super) held: bool,
    /// What the status line says.
    pub(super) told: Told,
}

/// What the status line says of the picture, where there is room for one.
#[derive(Default)]
pub(super) struct Told {
    /// Its size, whether that is the full one, and its cost.
    pub(super) text: String,
    /// Whether the dot is green.
    pub(super) is_at_rest: bool,
}

impl Default for Panels {
    fn default() -> Self {
        let open = SECTIONS.map(|section| matches!(section, "Compare" | "Technique" | "Picture"));
        let (scene_path, save_path) = (String::new(), "lumivox.png".to_owned());
        Panels {
            open,
            help: false,
            times: true,
            scene_path,
            save_path,
            wants_path: false,
            dialog: files::dialog(),
            picture: Rect::NOTHING,
            pictures: Vec::new(),
            readout: String::new(),
            pointer: None,
            held: false,
            told: Told::default(),
        }
    }
}

impl Panels {
    /// Whether the section of the simulator is open.
    pub(super) fn shows_simulator(&self) -> bool {
        let mut sections = SECTIONS.iter().zip(self.open);
        sections.any(|(section, is_open)| is_open && *section == SIMULATOR)
    }

    /// Opens the dialog, as large as the window allows.
    pub(super) fn browse(&mut self, ctx: &Context) {
        // Its bars and margins are not counted.
        let most = ctx.content_rect().size() - egui::vec2(40.0, 90.0);
        self.dialog.config_mut().default_size = most.min(egui::vec2(720.0, 420.0));
        self.dialog.pick_file();
    }
}

/// What the panels ask of the window.
pub(super) enum Request {
    /// Load this scene.
    Open(OsString),
    /// Write the left picture.
    Save(PathBuf),
    /// Write the window as it is.
    Screenshot(PathBuf),
    /// Put the command line into the clipboard.
    CopyCommand,
    /// Put the camera into the clipboard.
    CopyCamera,
    Fullscreen,
    Vsync(bool),
    Quit,
}

/// What the panels are drawn from.
pub(super) struct Scope<'s> {
    pub(super) session: &'s mut Session,
    pub(super) panels: &'s mut Panels,
    pub(super) remembered: &'s mut Remembered,
    pub(super) requests: Vec<Request>,
    /// Whether the render thread is at work.
    pub(super) is_busy: bool,
    /// As [`Canvas::errors`].
    pub(super) errors: &'s str,
    /// Width and height of the window (px).
    pub(super) window_size: [u32; 2],
    /// Windows frames a second.
    pub(super) rate: f32,
}

/// Draws everything.
pub(super) fn show(ctx: &Context, scope: &mut Scope<'_>, canvas: &Canvas) {
    scope.panels.held = false;
    scope.panels.told = Told {
        text: told(scope.session, scope.panels.times),
        is_at_rest: scope.session.is_still() && !scope.session.continuous,
    };
    // What is typed into the dialog moves no camera.
    if !matches!(scope.panels.dialog.state(), DialogState::Open) {
        input::keys(ctx, scope);
    }
    // What is smaller than this is a thumbnail: the picture alone.
    let is_roomy = ctx.content_rect().width() >= 420.0 && ctx.content_rect().height() >= 200.0;
    if scope.remembered.panels && is_roomy {
        TopBottomPanel::bottom("status").show(ctx, |ui| status(ui, scope));
        // The width stays the same: opening a section must not move the picture.
        SidePanel::left("panels")
            .resizable(false)
            .exact_width(WIDTH)
            .show(ctx, |ui| {
                ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                    for index in 0..SECTIONS.len() {
                        section(ui, scope, index);
                    }
                });
            });
    }
    canvas.show(ctx, scope);
    let has_simulator = scope.session.choices[0].entry.simulator.is_some();
    if scope.remembered.panels && is_roomy && has_simulator && scope.panels.shows_simulator() {
        simulator::show_drawing(ctx, &scope.session.simulator, scope.panels.picture);
    }
    if let Some(problem) = scope
        .session
        .any_error()
        .filter(|_| !(scope.remembered.panels && is_roomy))
    {
        // Where there is no status line to tell it.
        egui::Area::new("problem".into())
            .anchor(egui::Align2::LEFT_BOTTOM, [6.0, -6.0])
            .interactable(false)
            .show(ctx, |ui| {
                egui::Frame::popup(ui.style()).show(ui, |ui| {
                    ui.label(RichText::new(problem).color(ui.visuals().error_fg_color))
                });
            });
    }
    help::show(ctx, &mut scope.panels.help);
    files::show_dialog(ctx, scope);
}

fn section(ui: &mut Ui, scope: &mut Scope<'_>, index: usize) {
    if SECTIONS[index] == SIMULATOR && scope.session.choices[0].entry.simulator.is_none() {
        return;
    }
    let header = CollapsingHeader::new(RichText::new(SECTIONS[index]).strong())
        .open(Some(scope.panels.open[index]));
    let response = header.show(ui, |ui| match SECTIONS[index] {
        "Scene" => files::show(ui, scope),
        "Compare" => technique::show_compare(ui, scope),
        "Technique" => technique::show(ui, scope),
        "Picture" => look::show_picture(ui, scope),
        "Beam" => beam::show(ui, scope),
        SIMULATOR => simulator::show(ui, scope),
        "Camera" => look::show_camera(ui, scope),
        "Lights" => lights::show(ui, scope),
        _ => cost::show(ui, scope),
    });
    if response.header_response.clicked() {
        scope.panels.open[index] ^= true;
    }
    ui.add_space(2.0);
}

fn status(ui: &mut Ui, scope: &mut Scope<'_>) {
    let session = &*scope.session;
    ui.horizontal(|ui| {
        let (color, meaning) = if scope.panels.told.is_at_rest {
            (REST, "the picture is at rest")
        } else if session.has_failed() && !scope.is_busy {
            (ui.visuals().error_fg_color, "there is no such picture")
        } else {
            (ACCENT, "rendering")
        };
        let (dot, response) = ui.allocate_exact_size(egui::vec2(10.0, 10.0), egui::Sense::hover());
        ui.painter().circle_filled(dot.center(), 4.0, color);
        response.on_hover_text(meaning);
        ui.label(&scope.panels.told.text)
            .on_hover_text("size of the picture, time of its frame, memory on the device");
        if scope.panels.times {
            ui.label(format!("{:.0}/s", scope.rate))
                .on_hover_text("how often the window was drawn in the last second");
        }
        ui.separator();
        match (session.any_error(), &session.shader) {
            (Some(error), _) => drop(
                ui.add(
                    egui::Label::new(RichText::new(error).color(ui.visuals().error_fg_color))
                        .truncate(),
                ),
            ),
            _ if !scope.panels.readout.is_empty() => {
                drop(ui.add(egui::Label::new(&scope.panels.readout).truncate()))
            }
            (None, Some(Ok(text))) if session.note.is_empty() => {
                drop(ui.add(egui::Label::new(text).truncate()))
            }
            _ if session.note.is_empty() => drop(ui.label("F1: keys")),
            _ => drop(ui.add(egui::Label::new(&session.note).truncate())),
        }
    });
}

/// Sizes, times and memory of what is shown; a size once where both sides have it.
fn told(session: &Session, times: bool) -> String {
    let pictures: Vec<&Picture> = session.newest[..session.pane_count()]
        .iter()
        .flatten()
        .map(|newest| &newest.picture)
        .collect();
    let mut sizes: Vec<String> = pictures
        .iter()
        .map(|picture| told_size(picture, session.size))
        .collect();
    sizes.dedup();
    let sizes = sizes.join(" | ");
    let Some(last) = pictures.last().filter(|_| times) else {
        return sizes;
    };
    let times: Vec<String> = pictures
        .iter()
        .map(|picture| format!("{:.1}", picture.stats.total_ms()))
        .collect();
    let memory = cost::memory_in_all(&last.memory);
    format!("{sizes}, {} ms, {memory}", times.join(" | "))
}

fn told_size(picture: &Picture, wanted: [u32; 2]) -> String {
    if !picture.is_there() {
        return "no picture".to_owned();
    }
    let [width, height] = picture.size;
    // A light map has its own size, whatever the window's is.
    let is_whole = [width, height] == wanted || VIEWS[picture.view].is_map();
    let of = if is_whole {
        String::new()
    } else {
        format!("of {}×{} ", wanted[0], wanted[1])
    };
    let quality = match (picture.is_full, is_whole) {
        (false, _) => "quick",
        (true, true) => "full",
        (true, false) => "before",
    };
    format!("{width}×{height} {of}{quality}")
}

/// A row: a name with what it means, and a widget. Widgets end flush with the panel.
fn row<R>(ui: &mut Ui, name: &str, help: &str, widget: impl FnOnce(&mut Ui) -> R) -> R {
    ui.horizontal(|ui| {
        let width = 0.42 * ui.available_width();
        let label = ui.allocate_ui_with_layout(
            egui::vec2(width, ui.spacing().interact_size.y),
            egui::Layout::left_to_right(egui::Align::Center),
            |ui| {
                ui.set_min_width(width);
                ui.add(egui::Label::new(name).truncate())
            },
        );
        if !help.is_empty() {
            label.response.on_hover_text(help);
            label.inner.on_hover_text(help);
        }
        widget(ui)
    })
    .inner
}

/// A list to choose from; as wide as there is room.
fn choose<'t>(
    ui: &mut Ui,
    id: impl std::hash::Hash,
    current: &str,
    all: impl Iterator<Item = (&'t str, &'t str)>,
) -> Option<usize> {
    let mut chosen = None;
    let width = ui.available_width() - 8.0;
    egui::ComboBox::from_id_salt(id)
        .selected_text(current)
        .width(width)
        .truncate()
        .show_ui(ui, |ui| {
            for (index, (name, help)) in all.enumerate() {
                let response = ui.selectable_label(name == current, name);
                let response = if help.is_empty() {
                    response
                } else {
                    response.on_hover_text(help)
                };
                if response.clicked() && name != current {
                    chosen = Some(index);
                }
            }
        });
    chosen
}
