//! Scenes in, pictures and texts out.

use std::path::{Path, PathBuf};

use egui::{RichText, TextEdit, Ui};

use super::{Request, Scope};
use crate::scene::bundled;

/// Opening, saving, copying.
pub(super) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let scene = &scope.session.scene.1;
    ui.label(RichText::new(scope.session.source.to_string_lossy()).strong());
    ui.label(format!("{} triangles, {} materials, {} textures", scene.triangles.len(), scene.materials.len(), scene.textures.len()));
    ui.horizontal(|ui| {
        let width = ui.available_width() - 96.0;
        let hint = "scene.toml, model.obj, bundled:NAME";
        let typed = ui.add(TextEdit::singleline(&mut scope.panels.scene_path).hint_text(hint).desired_width(width));
        let entered = typed.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        if (ui.button("open").clicked() || entered) && !scope.panels.scene_path.trim().is_empty() {
            scope.requests.push(Request::Open(scope.panels.scene_path.trim().into()));
        }
        if ui.button("…").on_hover_text("browse folders; files can also be dropped on the window").clicked() {
            scope.panels.browsing = match scope.panels.browsing.take() {
                Some(_) => None,
                None => std::env::current_dir().ok(),
            };
        }
    });
    if let Some(folder) = scope.panels.browsing.clone() {
        browse(ui, scope, &folder);
    }
    ui.horizontal(|ui| {
        ui.menu_button("bundled scenes …", |ui| {
            for scene in bundled::TABLE {
                if ui.button(scene.name).on_hover_text(scene.description).clicked() {
                    scope.requests.push(Request::Open(format!("bundled:{}", scene.name).into()));
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
        ui.add(TextEdit::singleline(&mut scope.panels.save_path).desired_width(width)).on_hover_text("the left picture: .png as it looks, .exr linear");
        if ui.button("save").clicked() {
            scope.requests.push(Request::Save(scope.panels.save_path.trim().into()));
        }
        if ui.button("window").on_hover_text("F12: the window with its panels, as PNG").clicked() {
            scope.requests.push(Request::Screenshot(window_path()));
        }
    });
    if ui.button("copy `lumivox render` command").on_hover_text("Ctrl+C: the command line that renders the left picture").clicked() {
        scope.requests.push(Request::CopyCommand);
    }
    ui.horizontal(|ui| {
        let mut vsync = scope.remembered.vsync;
        if ui.checkbox(&mut vsync, "vsync").on_hover_text("pictures wait for the display").changed() {
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

fn browse(ui: &mut Ui, scope: &mut Scope<'_>, folder: &Path) {
    ui.label(RichText::new(folder.display().to_string()).weak());
    let mut entries: Vec<(bool, String)> = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let is_folder = entry.path().is_dir();
        let lower = name.to_lowercase();
        if !name.starts_with('.') && (is_folder || lower.ends_with(".toml") || lower.ends_with(".obj")) {
            entries.push((!is_folder, name));
        }
    }
    entries.sort();
    egui::ScrollArea::vertical().id_salt("browse").max_height(160.0).show(ui, |ui| {
        if folder.parent().is_some() && ui.selectable_label(false, "..").clicked() {
            scope.panels.browsing = folder.parent().map(Path::to_owned);
        }
        for (is_file, name) in entries {
            let text = if is_file { name.clone() } else { format!("{name}/") };
            if !ui.selectable_label(false, text).clicked() {
                continue;
            }
            let path = folder.join(&name);
            if is_file {
                scope.requests.push(Request::Open(path.into()));
                scope.panels.browsing = None;
            } else {
                scope.panels.browsing = Some(path);
            }
        }
    });
}
