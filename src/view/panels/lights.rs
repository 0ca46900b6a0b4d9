//! Lights: add, remove, move, colour, intensity.

use egui::{DragValue, RichText, Ui};
use glam::Vec3;

use super::{Scope, environment, row};
use crate::scene::Light;

/// All lights and the environment.
pub(super) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let (low, high) = scope
        .session
        .scene
        .1
        .bounds()
        .unwrap_or((Vec3::ZERO, Vec3::ONE));
    let size_m = (high - low).length().max(1e-3);
    let held = &mut scope.panels.held;
    let mut removed = None;
    let lights = &mut scope.session.lights;
    for (index, light) in lights.iter_mut().enumerate() {
        ui.push_id(index, |ui| {
            ui.horizontal(|ui| {
                ui.label(RichText::new(format!("{} {}", index + 1, kind(light))).strong());
                if ui.small_button("remove").clicked() {
                    removed = Some(index);
                }
            });
            show_light(ui, light, size_m, held);
        });
        ui.separator();
    }
    if let Some(index) = removed {
        lights.remove(index);
    }
    ui.horizontal(|ui| {
        ui.label("add:");
        let eye = scope.session.controls.camera;
        let [_, _, forward] = eye.basis();
        // Where the view goes, inside the scene.
        let position = (eye.eye + forward * 0.2 * size_m).clamp(low, high);
        let intensity = Vec3::splat(0.02 * size_m * size_m);
        if ui.button("point").clicked() {
            lights.push(Light::Point {
                position,
                intensity,
            });
        }
        if ui.button("spot").clicked() {
            lights.push(Light::Spot {
                position: eye.eye,
                direction: forward,
                intensity: 4.0 * intensity,
                inner_deg: 20.0,
                outer_deg: 30.0,
            });
        }
        if ui.button("directional").clicked() {
            lights.push(Light::Directional {
                direction: Vec3::new(0.3, -1.0, 0.2).normalize(),
                irradiance: Vec3::splat(3.0),
            });
        }
    });
    let mut environment = scope.session.environment.clone();
    environment::show(ui, &mut environment, &mut scope.session.wanted_sky, held);
    scope.session.set_environment(environment);
}

fn kind(light: &Light) -> &'static str {
    match light {
        Light::Directional { .. } => "directional",
        Light::Point { .. } => "point",
        Light::Spot { .. } => "spot",
    }
}

fn show_light(ui: &mut Ui, light: &mut Light, size_m: f32, held: &mut bool) {
    match light {
        Light::Directional {
            direction,
            irradiance,
        } => {
            show_direction(ui, direction, held);
            show_power(
                ui,
                "irradiance [W/m²]",
                "on a plane perpendicular to the beam",
                irradiance,
                held,
            );
        }
        Light::Point {
            position,
            intensity,
        } => {
            show_position(ui, position, size_m, held);
            show_power(
                ui,
                "intensity [W/sr]",
                "in every direction",
                intensity,
                held,
            );
        }
        Light::Spot {
            position,
            direction,
            intensity,
            inner_deg,
            outer_deg,
        } => {
            show_position(ui, position, size_m, held);
            show_direction(ui, direction, held);
            show_power(ui, "intensity [W/sr]", "on the axis", intensity, held);
            row(
                ui,
                "half angles [°]",
                "full inside the first, nothing beyond the second",
                |ui| {
                    *held |= ui
                        .add(
                            DragValue::new(inner_deg)
                                .range(0.0..=*outer_deg)
                                .speed(0.2)
                                .max_decimals(1),
                        )
                        .dragged();
                    *held |= ui
                        .add(
                            DragValue::new(outer_deg)
                                .range(inner_deg.max(0.01)..=89.9)
                                .speed(0.2)
                                .max_decimals(1),
                        )
                        .dragged();
                },
            );
        }
    }
}

fn show_position(ui: &mut Ui, position: &mut Vec3, size_m: f32, held: &mut bool) {
    row(
        ui,
        "position [m]",
        "x, y (up), z; drag a number to move the light",
        |ui| three(ui, position, 0.002 * size_m, held),
    );
}

fn show_direction(ui: &mut Ui, direction: &mut Vec3, held: &mut bool) {
    let mut new = *direction;
    row(ui, "direction", "of travel: x, y (up), z", |ui| {
        three(ui, &mut new, 0.01, held)
    });
    if new != *direction
        && let Some(unit) = new.as_dvec3().try_normalize()
    {
        *direction = unit.as_vec3();
    }
}

fn three(ui: &mut Ui, vector: &mut Vec3, speed: f32, held: &mut bool) {
    ui.spacing_mut().item_spacing.x = 3.0;
    for axis in 0..3 {
        *held |= ui
            .add(
                DragValue::new(&mut vector[axis])
                    .speed(speed)
                    .max_decimals(3),
            )
            .dragged();
    }
}

/// A colour, and how much of it there is: the largest channel.
pub(super) fn show_power(ui: &mut Ui, name: &str, help: &str, power: &mut Vec3, held: &mut bool) {
    let most = power.max_element();
    let color = if most > 0.0 { *power / most } else { Vec3::ONE };
    row(ui, name, help, |ui| {
        let mut level = most;
        let response = ui.add(
            DragValue::new(&mut level)
                .range(0.0..=1e9)
                .speed(0.01 * f64::from(most.max(0.1)))
                .max_decimals(3),
        );
        *held |= response.dragged();
        let mut rgb = color.to_array();
        let picked = ui.color_edit_button_rgb(&mut rgb).changed();
        if response.changed() || picked {
            *power = Vec3::from(rgb) * level;
        }
    });
}
