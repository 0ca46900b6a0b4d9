//! The simulator of the left technique: settings, buttons, figures, and its drawing in a window of
//! its own.

use egui::epaint::{Mesh, Vertex, WHITE_UV};
use egui::{Color32, Context, DragValue, Rect, RichText, Sense, Stroke, Ui, Window, pos2, vec2};

use super::technique::widget;
use super::{Scope, cost, row};
use crate::gi::Settings;
use crate::gi::settings::{Domain, Setting};
use crate::gi::simulator::{Drawing, Ink, Shape, SimulatorRow};
use crate::view::simulator::{Order, SimulatorState};

/// Width of the drawing at first (points).
const DRAWING: f32 = 420.0;

/// Edge of a cell in which lines are as wide as they say (points); in smaller ones they are finer.
const CELL: f32 = 20.0;

/// The section of the panels.
pub(super) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let session = &mut *scope.session;
    let state = &mut session.simulator;
    let Some((row_of, settings, shown)) = state.values() else {
        return;
    };
    ui.label(RichText::new(row_of.summary).weak());
    let mut changed = list(ui, row_of, (row_of.settings, settings), &[]);
    let report = state.report.as_ref();
    let waiting = report.map_or(0, |report| report.waiting);
    let known = report.map(|report| &report.known);
    let most = match known {
        Some(Ok(known)) => known.most.as_slice(),
        _ => &[],
    };
    let (mut orders, mut starts_over) = (Vec::new(), false);
    ui.horizontal_wrapped(|ui| {
        for (index, action) in row_of.actions.iter().enumerate() {
            if ui.button(action.name).on_hover_text(action.help).clicked() {
                orders.push(Order::Act(index));
            }
        }
        starts_over = ui
            .button("start over")
            .on_hover_text("with these settings, and the lights as they are now")
            .clicked();
    });
    let mut steps = state.steps;
    row(
        ui,
        "all actions",
        "a whole run, one action after the other",
        |ui| {
            ui.add(DragValue::new(&mut steps).range(1..=1024).suffix(" steps"));
            if waiting > 0 {
                if ui.button("stop").clicked() {
                    orders.push(Order::Stop);
                }
                ui.label(format!("{waiting} to come"));
            } else if ui.button("run").clicked() {
                orders.push(Order::Run(steps));
            }
        },
    );
    ui.separator();
    changed = list(ui, row_of, (row_of.shown, shown), most).or(changed);
    ui.separator();
    match known {
        None => drop(ui.label("…")),
        Some(Err(problem)) => {
            drop(ui.label(RichText::new(problem).color(ui.visuals().error_fg_color)))
        }
        Some(Ok(known)) => known
            .figures
            .iter()
            .for_each(|(name, value)| cost::figure(ui, name, value)),
    }
    state.steps = steps;
    orders.into_iter().for_each(|order| state.order(order));
    if starts_over {
        state.start_over();
    }
    if let Some((name, value)) = changed {
        // Widgets give values that are possible.
        drop(state.set(name, &value));
    }
}

/// Rows of the settings that have an effect; the one that was changed, with its new value.
fn list(
    ui: &mut Ui,
    of: &SimulatorRow,
    (settings, values): (&'static [Setting], &Settings),
    most: &[(&str, u32)],
) -> Option<(&'static str, String)> {
    let mut changed = None;
    for setting in settings {
        if !of.applies(setting.name, values) {
            continue;
        }
        let Some((_, value)) = values.iter().find(|(name, _)| *name == setting.name) else {
            continue;
        };
        let limit = most.iter().find(|(name, _)| *name == setting.name);
        let shown = match (setting.domain, limit) {
            (Domain::Count { min, max }, Some((_, most))) => Setting {
                domain: Domain::Count {
                    min,
                    max: max.min(*most).max(min),
                },
                ..*setting
            },
            _ => *setting,
        };
        // What has one value is no choice.
        if matches!(shown.domain, Domain::Count { min, max } if min == max) {
            continue;
        }
        let unit = if setting.unit.is_empty() {
            String::new()
        } else {
            format!(" [{}]", setting.unit)
        };
        let name = format!("{}{unit}", setting.name);
        let help = format!(
            "{}\n{}, {} by default",
            setting.help, shown.domain, setting.default
        );
        let text = value.to_string();
        let new = row(ui, &name, &help, |ui| widget(ui, &shown, &text, &mut false));
        if let Some(new) = new.filter(|new| *new != text) {
            changed = Some((setting.name, new));
        }
    }
    changed
}

/// The drawing, over the picture, while the section is open.
pub(super) fn show_drawing(ctx: &Context, state: &SimulatorState, picture: Rect) {
    let Some(Ok(known)) = state.report.as_ref().map(|report| &report.known) else {
        return;
    };
    let drawing = &known.drawing;
    let room = (picture.size() - vec2(36.0, 110.0)).min_elem();
    Window::new(&drawing.title)
        .id("simulator".into())
        .default_pos(picture.min + vec2(10.0, 10.0))
        .default_width(DRAWING.min(room).max(120.0))
        .show(ctx, |ui| {
            let [width, height] = drawing.size.map(|size| size.max(1) as f32);
            let across = ui.available_width().min(room * (width / height).max(1.0));
            let (rect, _) =
                ui.allocate_exact_size(vec2(across, across * height / width), Sense::hover());
            draw(ui, rect, drawing);
            ui.label(RichText::new(&drawing.legend).weak());
        });
}

fn draw(ui: &Ui, rect: Rect, drawing: &Drawing) {
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    painter.rect_filled(rect, 0.0, Color32::WHITE);
    let scale = rect.width() / drawing.size[0].max(1) as f32;
    let place = |[x, y]: [f64; 2]| {
        pos2(
            rect.left() + scale * x as f32,
            rect.bottom() - scale * y as f32,
        )
    };
    let fine = (scale / CELL).clamp(0.25, 1.0);
    let stroke = |ink: &Ink| {
        let [red, green, blue] = ink.rgb;
        Stroke::new(
            fine * ink.width_px as f32,
            Color32::from_rgb(red, green, blue),
        )
    };
    for shape in &drawing.shapes {
        match shape {
            Shape::Line(ends, ink) => {
                painter.line_segment(ends.map(place), stroke(ink));
            }
            Shape::Star {
                centre,
                outline,
                ink,
            } => {
                let points: Vec<_> = outline.iter().copied().map(place).collect();
                // Areas of a drawing do not overlap: a mixture with the white below them.
                let color = Color32::WHITE.lerp_to_gamma(stroke(ink).color, Shape::FILL as f32);
                let vertex = |pos| Vertex {
                    pos,
                    uv: WHITE_UV,
                    color,
                };
                let mut mesh = Mesh::default();
                mesh.vertices.push(vertex(place(*centre)));
                mesh.vertices.extend(points.iter().copied().map(vertex));
                let count = points.len() as u32;
                (0..count).for_each(|at| mesh.add_triangle(0, 1 + at, 1 + (at + 1) % count));
                painter.add(mesh);
                painter.add(egui::Shape::closed_line(points, stroke(ink)));
            }
        }
    }
}
