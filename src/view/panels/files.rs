//! Scenes in, pictures and texts out.

use std::path::PathBuf;

use egui::{Align2, Context, Key, Modifiers, RichText, TextEdit, Ui};
use egui_file_dialog::{FileDialog, FileDialogKeyBindings, KeyBinding};

use super::{Request, Scope};
use crate::scene::bundled;
use crate::text::counted;

/// Opening, saving, copying.
pub(super) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let scene = &scope.session.scene.1;
    ui.label(RichText::new(scope.session.source.to_string_lossy()).strong());
    ui.label(format!(
        "{}, {}, {}",
        counted(scene.triangles.len(), "triangle"),
        counted(scene.materials.len(), "material"),
        counted(scene.textures.len(), "texture")
    ));
    ui.horizontal(|ui| {
        let width = ui.available_width() - 96.0;
        let hint = "scene.toml, model.obj, model.glb, bundled:NAME";
        let typed = ui
            .add(
                TextEdit::singleline(&mut scope.panels.scene_path)
                    .hint_text(hint)
                    .desired_width(width),
            )
            .on_hover_text("Ctrl+L");
        if std::mem::take(&mut scope.panels.wants_path) {
            typed.request_focus();
        }
        let entered = typed.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        if (ui.button("open").clicked() || entered) && !scope.panels.scene_path.trim().is_empty() {
            scope
                .requests
                .push(Request::Open(scope.panels.scene_path.trim().into()));
        }
        if ui
            .button("…")
            .on_hover_text("Ctrl+O: browse; files can also be dropped on the window")
            .clicked()
        {
            scope.panels.browse(ui.ctx());
        }
    });
    ui.horizontal(|ui| {
        ui.menu_button("bundled scenes …", |ui| {
            for scene in bundled::TABLE {
                if ui
                    .button(scene.name)
                    .on_hover_text(scene.description)
                    .clicked()
                {
                    scope
                        .requests
                        .push(Request::Open(format!("bundled:{}", scene.name).into()));
                    ui.close();
                }
            }
        });
        if !scope.remembered.recent.is_empty() {
            ui.menu_button("recent scenes …", |ui| {
                for source in &scope.remembered.recent {
                    if ui.button(source).clicked() {
                        scope.requests.push(Request::Open(source.into()));
                        ui.close();
                    }
                }
            });
        }
    });
    ui.separator();
    ui.horizontal(|ui| {
        let width = ui.available_width() - 124.0;
        ui.add(TextEdit::singleline(&mut scope.panels.save_path).desired_width(width))
            .on_hover_text("the left picture: .png as it looks, .exr linear");
        if ui.button("save").clicked() {
            scope
                .requests
                .push(Request::Save(scope.panels.save_path.trim().into()));
        }
        if ui
            .button("window")
            .on_hover_text("F12: the window with its panels, as PNG")
            .clicked()
        {
            scope.requests.push(Request::Screenshot(window_path()));
        }
    });
    if ui
        .button("copy `lumivox render` command")
        .on_hover_text("Ctrl+C: the command line that renders the left picture")
        .clicked()
    {
        scope.requests.push(Request::CopyCommand);
    }
    ui.horizontal(|ui| {
        let mut vsync = scope.remembered.vsync;
        if ui
            .checkbox(&mut vsync, "vsync")
            .on_hover_text("pictures wait for the display")
            .changed()
        {
            scope.requests.push(Request::Vsync(vsync));
        }
        if ui.button("fullscreen").on_hover_text("F11").clicked() {
            scope.requests.push(Request::Fullscreen);
        }
    });
}

/// Where F12 writes.
pub(super) fn window_path() -> PathBuf {
    PathBuf::from("lumivox-window.png")
}

/// The dialog that browses for a scene.
pub(super) fn dialog() -> FileDialog {
    let keys = FileDialogKeyBindings {
        edit_path: vec![
            KeyBinding::key(Key::Slash),
            KeyBinding::keyboard_shortcut(Modifiers::COMMAND, Key::L),
        ],
        new_folder: Vec::new(),
        ..FileDialogKeyBindings::default()
    };
    FileDialog::new()
        .title("Open a scene")
        .add_file_filter_extensions(SCENES, vec!["toml", "obj", "gltf", "glb"])
        .default_file_filter(SCENES)
        .keybindings(keys)
        .show_new_folder_button(false)
        .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
        .as_modal(true)
}

/// Name of the dialog's filter.
const SCENES: &str = "scenes (.toml, .obj, .gltf, .glb)";

/// Draws the dialog where it is open, and opens what was chosen.
pub(super) fn show_dialog(ctx: &Context, scope: &mut Scope<'_>) {
    let dialog = &mut scope.panels.dialog;
    dialog.update(ctx);
    if let Some(path) = dialog.take_picked() {
        scope.requests.push(Request::Open(path.into()));
    }
}
