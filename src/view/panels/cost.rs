//! What it costs: time by pass, with its history; memory by name; counts.

use std::collections::VecDeque;

use egui::{Align2, Color32, FontId, RichText, Sense, Stroke, Ui, pos2, vec2};

use super::Scope;
use crate::graph::PassTime;
use crate::view::session::HISTORY;

/// Everything, one side after the other.
pub(super) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let session = &*scope.session;
    ui.label(format!(
        "renders on {}",
        if session.device.is_empty() {
            "…"
        } else {
            &session.device
        }
    ));
    let count = session.pane_count();
    for index in 0..count {
        let Some(newest) = &session.newest[index] else {
            continue;
        };
        let picture = &newest.picture;
        if count == 2 {
            ui.separator();
            ui.label(RichText::new(["left", "right"][index]).italics());
        }
        let quality = if picture.is_full {
            ""
        } else {
            " (quick picture)"
        };
        ui.label(
            RichText::new(format!("frame {:.2} ms{quality}", picture.stats.total_ms())).strong(),
        );
        if let Some(build) = session.builds[index] {
            // A sum of nothing is −0.
            ui.label(format!("last build {:.2} ms", build.abs()));
        }
        history(ui, &session.history[index]);
        bars(ui, &picture.stats.passes);
        ui.add_space(4.0);
        ui.label(RichText::new("counts").strong());
        if picture.counts.is_empty() {
            ui.label(RichText::new("none").weak());
        }
        picture
            .counts
            .iter()
            .for_each(|(name, count)| figure(ui, name, &count.to_string()));
    }
    if let Some(newest) = &session.newest[count - 1] {
        memory(ui, &newest.picture.memory);
    }
}

/// A name at the left, a number at the right.
pub(super) fn figure(ui: &mut Ui, name: &str, number: &str) {
    ui.horizontal(|ui| {
        let width = ui.available_width();
        let height = ui.text_style_height(&egui::TextStyle::Body);
        let (rect, response) = ui.allocate_exact_size(vec2(width, height), Sense::hover());
        let font = FontId::proportional(12.0);
        let color = ui.visuals().text_color();
        let right = ui.painter().text(
            rect.right_center(),
            Align2::RIGHT_CENTER,
            number,
            font.clone(),
            color,
        );
        let clip = egui::Rect::from_min_max(rect.min, pos2(right.left() - 6.0, rect.bottom()));
        ui.painter().with_clip_rect(clip).text(
            rect.left_center(),
            Align2::LEFT_CENTER,
            name,
            font,
            color,
        );
        response.on_hover_text(format!("{name}: {number}"));
    });
}

/// Times by pass, the longest the whole width.
fn bars(ui: &mut Ui, passes: &[PassTime]) {
    let most = passes.iter().map(|pass| pass.gpu_ms).fold(1e-6, f64::max);
    for pass in passes {
        let (rect, response) =
            ui.allocate_exact_size(vec2(ui.available_width(), 16.0), Sense::hover());
        let mut bar = rect.shrink2(vec2(0.0, 1.0));
        bar.set_width((rect.width() * (pass.gpu_ms / most) as f32).max(1.0));
        ui.painter()
            .rect_filled(bar, 2.0, Color32::from_rgb(38, 84, 124));
        let (font, color) = (FontId::proportional(12.0), ui.visuals().strong_text_color());
        let number = format!("{:.2} ms", pass.gpu_ms);
        let right = ui.painter().text(
            rect.right_center() - vec2(3.0, 0.0),
            Align2::RIGHT_CENTER,
            number,
            font.clone(),
            color,
        );
        let clip = egui::Rect::from_min_max(rect.min, pos2(right.left() - 6.0, rect.bottom()));
        ui.painter().with_clip_rect(clip).text(
            rect.left_center() + vec2(4.0, 0.0),
            Align2::LEFT_CENTER,
            &pass.name,
            font,
            color,
        );
        response.on_hover_text(format!(
            "{}: {:.3} ms in {} runs",
            pass.name, pass.gpu_ms, pass.runs
        ));
    }
}

/// Frame times, the newest at the right.
fn history(ui: &mut Ui, times: &VecDeque<f32>) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 54.0), Sense::hover());
    ui.painter()
        .rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    let most = times.iter().copied().fold(1e-3, f32::max);
    let font = FontId::proportional(10.0);
    ui.painter().text(
        rect.left_top() + vec2(3.0, 2.0),
        Align2::LEFT_TOP,
        format!("{most:.1} ms"),
        font.clone(),
        ui.visuals().weak_text_color(),
    );
    ui.painter().text(
        rect.left_bottom() + vec2(3.0, -2.0),
        Align2::LEFT_BOTTOM,
        "0",
        font,
        ui.visuals().weak_text_color(),
    );
    let step = rect.width() / HISTORY as f32;
    let at = |index: usize, time: f32| {
        pos2(
            rect.right() - (times.len() - 1 - index) as f32 * step,
            rect.bottom() - 2.0 - time / most * (rect.height() - 6.0),
        )
    };
    let points: Vec<_> = times
        .iter()
        .enumerate()
        .map(|(index, time)| at(index, *time))
        .collect();
    if let [point] = points[..] {
        ui.painter().circle_filled(point, 2.0, super::ACCENT);
    }
    ui.painter().line(points, Stroke::new(1.5, super::ACCENT));
    response.on_hover_text(format!(
        "time of the last {} full frames on the device; \"frames all the time\" renders without \
         end",
        times.len()
    ));
}

fn mib(bytes: u64) -> String {
    format!("{:.2} MiB", bytes as f64 / f64::from(1 << 20))
}

/// The memory of all resources.
pub(super) fn memory_in_all(memory: &[(String, u64)]) -> String {
    mib(memory.iter().map(|(_, bytes)| bytes).sum())
}

fn memory(ui: &mut Ui, memory: &[(String, u64)]) {
    let mut by_name: Vec<(&str, u64)> = Vec::new();
    for (name, bytes) in memory {
        match by_name.iter_mut().find(|(known, _)| known == name) {
            Some((_, sum)) => *sum += bytes,
            None => by_name.push((name, *bytes)),
        }
    }
    by_name.sort_by_key(|(_, bytes)| std::cmp::Reverse(*bytes));
    ui.separator();
    ui.label(RichText::new(format!("memory {}", memory_in_all(memory))).strong());
    by_name
        .iter()
        .for_each(|(name, bytes)| figure(ui, name, &mib(*bytes)));
}
