//! One beam of the gather: which one, its samples as a table, and the beam over the picture.

use egui::ecolor::Hsva;
use egui::{
    Checkbox, Color32, DragValue, Painter, Pos2, Rect, RichText, ScrollArea, Slider, Stroke, Ui,
    pos2,
};
use glam::Vec3;

use super::cost::figure as figure_row;
use super::{Scope, row};
use crate::frame::Traced;
use crate::gi::inspect::{Beam, BeamAxis};
use crate::image::luminance;
use crate::scene::Camera;
use crate::text::counted;
use crate::view::beam::{BeamState, figure_table, table};
use crate::view::session::{Compare, Session};
use crate::view::views::VIEWS;

/// Heads of the table's columns, each six characters wide.
const HEADS: &str = "  t[m]   d[m]  level      L      α     Σα     ΣL";

/// Height of the table (points).
const TABLE: f32 = 240.0;

/// The section of the panels.
pub(super) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let session = &mut *scope.session;
    let [width, height] = session.size;
    let traced = session
        .traced()
        .and_then(|answer| answer.found.as_ref().ok());
    let (count, has_beams) = match traced {
        Some(Traced::Beam(beam)) => (beam.count, true),
        Some(Traced::Figures(_)) => (1, false),
        _ => (1, true),
    };
    let mut is_on = session.beam.place.is_some();
    let help = "P: at the pointer; Escape: away. A beam from the surface there, as the technique \
                traces it, with every sample that it takes; or what it gathers from, where it has \
                no beams";
    if ui
        .checkbox(&mut is_on, "trace a beam")
        .on_hover_text(help)
        .changed()
    {
        session.beam.toggle(None);
    }
    let beam = &mut session.beam;
    let Some(place) = &mut beam.place else {
        ui.label(RichText::new("press P over the picture").weak());
        return;
    };
    row(ui, "pixel", "where the beam begins", |ui| {
        for (share, size) in place.iter_mut().zip([width, height]) {
            let mut at = (*share * size as f32) as u32;
            if ui
                .add(DragValue::new(&mut at).range(0..=size.saturating_sub(1)))
                .changed()
            {
                *share = (at as f32 + 0.5) / size.max(1) as f32;
            }
        }
    });
    ui.checkbox(&mut beam.follows, "follow the pointer");
    if has_beams {
        choose_beam(ui, beam, count);
    }
    show_answer(ui, scope.session);
}

/// Which beam: its axis and width.
fn choose_beam(ui: &mut Ui, beam: &mut BeamState, count: u32) {
    row(ui, "direction", "of its axis", |ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        let axes = [
            (
                "normal",
                BeamAxis::Normal,
                "along the shading normal, as wide as a diffuse beam",
            ),
            (
                "diffuse",
                BeamAxis::Diffuse(0),
                "one of the beams of the diffuse gather, as this pixel turns them",
            ),
            (
                "mirror",
                BeamAxis::Mirror,
                "along the mirror direction, as wide as the surface is rough",
            ),
        ];
        for (name, axis, help) in axes {
            let is_chosen = std::mem::discriminant(&beam.axis) == std::mem::discriminant(&axis);
            if ui
                .selectable_label(is_chosen, name)
                .on_hover_text(help)
                .clicked()
                && !is_chosen
            {
                beam.axis = axis;
            }
        }
    });
    if let BeamAxis::Diffuse(index) = &mut beam.axis {
        row(ui, "number", "which one of the set", |ui| {
            // What is not known yet does not change what was chosen.
            let most = (count - 1).max(*index);
            ui.add(Slider::new(index, 0..=most))
        });
    }
    row(
        ui,
        "aperture [°]",
        "γ, the full angle; off: the technique's own",
        |ui| {
            let mut is_set = beam.aperture_deg.is_some();
            if ui.add(Checkbox::without_text(&mut is_set)).changed() {
                beam.aperture_deg = is_set.then_some(10.0);
            }
            if let Some(aperture) = &mut beam.aperture_deg {
                ui.add(
                    Slider::new(aperture, 0.1..=120.0)
                        .logarithmic(true)
                        .max_decimals(1),
                );
            }
        },
    );
    ui.checkbox(&mut beam.lists_empty, "list samples of empty space");
}

/// What came back.
fn show_answer(ui: &mut Ui, session: &Session) {
    match session.traced().map(|answer| answer.found.as_ref()) {
        None => drop(ui.label("…")),
        Some(Err(problem)) => {
            drop(ui.label(RichText::new(problem).color(ui.visuals().error_fg_color)))
        }
        Some(Ok(Traced::NoSurface)) => drop(ui.label("this pixel sees no surface")),
        Some(Ok(Traced::NoBeams)) => drop(
            ui.label("with these settings the technique gathers without beams; try another preset"),
        ),
        Some(Ok(Traced::Figures(figures))) => {
            for (name, value) in figures {
                figure_row(ui, name, value);
            }
            let help = "names and values as CSV, into the clipboard";
            if ui.button("copy figures").on_hover_text(help).clicked() {
                ui.ctx().copy_text(figure_table(figures));
            }
        }
        Some(Ok(Traced::Beam(beam))) => list(ui, beam, session.beam.lists_empty),
    }
}

/// What the beam sees, and its samples.
fn list(ui: &mut Ui, beam: &Beam, lists_empty: bool) {
    let rgb = |light: Vec3| {
        format!(
            "{} {} {}",
            figure(light.x).trim(),
            figure(light.y).trim(),
            figure(light.z).trim()
        )
    };
    let taken = beam
        .samples
        .iter()
        .filter(|sample| sample.opacity > 0.0)
        .count();
    ui.label(format!(
        "γ {:.2}°, {}, {taken} of them with matter",
        beam.aperture_deg,
        counted(beam.samples.len(), "sample")
    ));
    ui.label(format!("L = {} W/(m² sr)", rgb(beam.radiance)))
        .on_hover_text(
            "radiance that the beam sees, with the environment behind what is not covered",
        );
    if let Some(weight) = beam.weight {
        let help = "π w L: what this beam adds to the irradiance E_i";
        ui.label(format!(
            "E += {} W/m², w {weight:.4}",
            rgb(std::f32::consts::PI * weight * beam.radiance)
        ))
        .on_hover_text(help);
    }
    let help = "distance and diameter; level; radiance (luminance, W/(m² sr)); opacity of the \
                step; of all steps so far; radiance of all steps so far";
    ui.label(RichText::new(HEADS).monospace().size(9.5).strong())
        .on_hover_text(help);
    let rows: Vec<_> = beam
        .samples
        .iter()
        .filter(|sample| lists_empty || sample.opacity > 0.0)
        .collect();
    let height = ui.text_style_height(&egui::TextStyle::Small);
    ScrollArea::vertical()
        .id_salt("samples")
        .max_height(TABLE)
        .auto_shrink([false, true])
        .show_rows(ui, height, rows.len(), |ui, shown| {
            for sample in &rows[shown] {
                let level = format!("{:>6.2}", sample.level);
                let columns = [
                    figure(sample.distance_m),
                    figure(sample.diameter_m),
                    level,
                    figure(luminance(sample.radiance)),
                    figure(sample.opacity),
                    figure(sample.covered),
                    figure(luminance(sample.gathered)),
                ];
                let text = RichText::new(columns.join(" ")).monospace().size(9.5);
                let text = if sample.opacity > 0.0 {
                    text
                } else {
                    text.weak()
                };
                ui.label(text).on_hover_text(format!(
                    "L = {}, ΣL = {} W/(m² sr)",
                    rgb(sample.radiance),
                    rgb(sample.gathered)
                ));
            }
        });
    if ui
        .button("copy table")
        .on_hover_text("all samples as CSV, into the clipboard")
        .clicked()
    {
        ui.ctx().copy_text(table(beam));
    }
}

/// Six characters.
fn figure(number: f32) -> String {
    match number.abs() {
        0.0 => format!("{:>6}", "0"),
        size if size < 1e-3 => format!("{number:>6.0e}"),
        size if size < 10.0 => format!("{number:>6.3}"),
        size if size < 1000.0 => format!("{number:>6.1}"),
        _ => format!("{number:>6.0}"),
    }
}

/// Draws the beam over the side that it begins in: its axis, and a circle for each sample, coloured
/// by level as in the view `structure`, strong where it is opaque.
pub(super) fn draw(ui: &Ui, rect: Rect, session: &Session) {
    let Some(answer) = session
        .traced()
        .filter(|_| !VIEWS[session.view].is_map() || session.compare == Compare::Difference)
    else {
        return;
    };
    let split_x = rect.left() + session.divider * rect.width();
    let clip = match (session.compare, answer.of.pane) {
        (Compare::Split, 0) => Rect::from_min_max(rect.min, pos2(split_x, rect.bottom())),
        (Compare::Split, _) => Rect::from_min_max(pos2(split_x, rect.top()), rect.max),
        _ => rect,
    };
    let painter = ui.painter().with_clip_rect(clip.intersect(ui.clip_rect()));
    let [x, y] =
        [0, 1].map(|axis| (answer.of.pixel[axis] as f32 + 0.5) / session.size[axis].max(1) as f32);
    let begin = pos2(
        rect.left() + x * rect.width(),
        rect.top() + y * rect.height(),
    );
    let cross = Stroke::new(1.0, Color32::WHITE);
    painter.line_segment(
        [begin - egui::vec2(6.0, 0.0), begin + egui::vec2(6.0, 0.0)],
        cross,
    );
    painter.line_segment(
        [begin - egui::vec2(0.0, 6.0), begin + egui::vec2(0.0, 6.0)],
        cross,
    );
    if let Ok(Traced::Beam(beam)) = &answer.found {
        draw_beam(&painter, rect, &session.controls.camera, beam);
    }
}

fn draw_beam(painter: &Painter, rect: Rect, camera: &Camera, beam: &Beam) {
    let [right, up, forward] = camera.basis();
    // Points of a length of one at a distance of one.
    let scale = 0.5 * rect.height() / (0.5 * camera.vfov_deg.to_radians()).tan();
    let project = |at: Vec3| -> Option<(Pos2, f32)> {
        let from_eye = at - camera.eye;
        let depth = from_eye.dot(forward);
        let point =
            rect.center() + scale / depth * egui::vec2(from_eye.dot(right), -from_eye.dot(up));
        (depth > 1e-3).then_some((point, scale / depth))
    };
    let mut before = project(beam.origin);
    for sample in &beam.samples {
        let centre = project(beam.origin + sample.distance_m * beam.direction);
        if let (Some((from, _)), Some((to, _))) = (before, centre) {
            painter.line_segment([from, to], Stroke::new(1.0, Color32::from_white_alpha(160)));
        }
        if let Some((point, points)) = centre {
            let alpha = 0.25 + 0.75 * sample.opacity.clamp(0.0, 1.0);
            let color = Color32::from(Hsva::new((sample.level / 6.0).fract(), 1.0, 1.0, alpha));
            painter.circle_stroke(
                point,
                (0.5 * sample.diameter_m * points).max(1.5),
                Stroke::new(if sample.opacity > 0.0 { 2.0 } else { 1.0 }, color),
            );
        }
        before = centre;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_six_characters() {
        for number in [0.0, 1e-5, 0.004, 0.25, 9.9994, 12.5, 999.9, 1234.0, 99999.0] {
            assert_eq!(
                figure(number).chars().count(),
                6,
                "{number}: {}",
                figure(number)
            );
        }
    }
}
