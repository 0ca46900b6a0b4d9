//! What is shown of the light, and how; the camera.

use egui::{DragValue, Slider, Ui};

use super::{Request, Scope, choose, row};
use crate::render::{CASCADES, ShadowFilter, ShadowSettings};
use crate::view::camera::{BOOKMARKS, Mode};
use crate::view::picture::ToneMap;
use crate::view::session::Compare;
use crate::view::views::{Layers, VIEWS};

/// View, components, exposure, tone map.
pub(super) fn show_picture(ui: &mut Ui, scope: &mut Scope<'_>) {
    let session = &mut *scope.session;
    if session.compare == Compare::Difference {
        ui.label("the difference is of all light");
    } else {
        let view = &VIEWS[session.view];
        let unit = if view.unit.is_empty() {
            String::new()
        } else {
            format!(" [{}]", view.unit)
        };
        let chosen = row(ui, "view", &format!("{}{unit}", view.help), |ui| {
            choose(
                ui,
                "view",
                view.name,
                VIEWS.iter().map(|view| (view.name, view.help)),
            )
        });
        if let Some(chosen) = chosen {
            (session.view, session.layer) = (chosen, 0);
        }
        if let Some(layers) = view.layers() {
            let (name, help) = match layers {
                Layers::Maps => (
                    "map",
                    "which map: one for a directional or spot light, six for a point light, in \
                     the order of the lights",
                ),
                Layers::Levels => (
                    "level",
                    "0 is the finest; each is half as fine as the one before",
                ),
            };
            let most = session.newest[0]
                .as_ref()
                .map_or(0, |newest| newest.picture.layers.saturating_sub(1));
            row(ui, name, help, |ui| {
                ui.add(Slider::new(&mut session.layer, 0..=most))
            });
        }
        if session.shows_light() {
            let c = &mut session.components;
            ui.horizontal_wrapped(|ui| {
                ui.checkbox(&mut c.direct, "direct")
                    .on_hover_text("L_direct: light of the lights, reflected once");
                ui.checkbox(&mut c.diffuse, "diffuse")
                    .on_hover_text("ρ/π · E_i: indirect light from diffuse surfaces");
                ui.checkbox(&mut c.specular, "specular")
                    .on_hover_text("L_s: indirect light from glossy surfaces");
                ui.checkbox(&mut c.emission, "emission")
                    .on_hover_text("L_e: what surfaces send out themselves, and the environment");
                let help =
                    "everything times the ambient visibility: for looks only, no part of the light";
                ui.checkbox(&mut c.visibility, "× AO").on_hover_text(help);
            });
        }
    }
    let help = "stops: one more is twice as bright";
    let held = row(ui, "exposure [EV]", help, |ui| {
        ui.add(Slider::new(&mut session.exposure_ev, -10.0..=10.0).max_decimals(2))
            .dragged()
    });
    scope.panels.held |= held;
    row(ui, "tone map", "how light becomes colours", |ui| {
        ui.selectable_value(&mut session.tone_map, ToneMap::Clamp, "clamp")
            .on_hover_text("as `lumivox render` writes PNG files");
        ui.selectable_value(&mut session.tone_map, ToneMap::Reinhard, "Reinhard")
            .on_hover_text("compresses highlights, white at 4 (Reinhard et al. 2002)");
    });
    let maps = [256, 512, 1024, 2048, 4096].map(|size: u32| size.to_string());
    let help = "width and height of each shadow map and reflective shadow map (texels)";
    let shadows = &mut session.shadows;
    let current = shadows.resolution.to_string();
    let chosen = row(ui, "light maps", help, |ui| {
        choose(
            ui,
            "maps",
            &current,
            maps.iter().map(|size| (size.as_str(), "")),
        )
    });
    shadows.resolution = chosen
        .and_then(|index| maps[index].parse().ok())
        .unwrap_or(shadows.resolution);
    show_shadows(ui, shadows);
    ui.checkbox(&mut session.continuous, "frames all the time")
        .on_hover_text("render again although nothing changes, for the history of times");
}

/// How the maps of directional lights are laid and read.
fn show_shadows(ui: &mut Ui, shadows: &mut ShadowSettings) {
    let help = "maps of a directional light: 1 of the whole scene, or cascades that follow the \
                camera";
    row(ui, "cascades", help, |ui| {
        ui.add(Slider::new(&mut shadows.cascades, CASCADES))
    });
    if shadows.cascades > 1 {
        let help = "where cascades end: logarithmic (1) to uniform (0)";
        row(ui, "split lambda", help, |ui| {
            ui.add(Slider::new(&mut shadows.split_lambda, 0.0..=1.0).max_decimals(2))
        });
    }
    let help = "how the direct light compares with shadow maps";
    row(ui, "shadow filter", help, |ui| {
        for filter in ShadowFilter::ALL {
            ui.selectable_value(&mut shadows.filter, filter, filter.name());
        }
    });
    if shadows.filter == ShadowFilter::Pcss {
        let help = "angular diameter of directional lights (degrees)";
        row(ui, "sun angle [°]", help, |ui| {
            ui.add(Slider::new(&mut shadows.sun_angle_deg, 0.05..=20.0).max_decimals(2))
        });
    }
}

/// Where the camera is and how it moves.
pub(super) fn show_camera(ui: &mut Ui, scope: &mut Scope<'_>) {
    let controls = &mut scope.session.controls;
    ui.horizontal(|ui| {
        ui.selectable_value(&mut controls.mode, Mode::Fly, "fly")
            .on_hover_text("drag to look around, W A S D Q E to fly");
        ui.selectable_value(&mut controls.mode, Mode::Orbit, "orbit")
            .on_hover_text("drag to go around the target, wheel or + − for the distance");
        if ui.button("frame scene").on_hover_text("F").clicked() {
            let picture = scope.panels.picture;
            controls.frame_scene((picture.width() / picture.height().max(1.0)).max(1e-3));
        }
        if ui
            .button("home")
            .on_hover_text("Home: the scene's own camera")
            .clicked()
        {
            controls.go_home();
        }
    });
    let mut held = false;
    let camera = &mut controls.camera;
    for (name, help, vector) in [
        ("eye [m]", "position", &mut camera.eye),
        ("target [m]", "what is looked at", &mut camera.target),
    ] {
        let old = *vector;
        row(ui, name, help, |ui| {
            ui.spacing_mut().item_spacing.x = 3.0;
            for axis in 0..3 {
                held |= ui
                    .add(
                        DragValue::new(&mut vector[axis])
                            .speed(0.01)
                            .max_decimals(3),
                    )
                    .dragged();
            }
        });
        if !vector.is_finite() {
            *vector = old;
        }
    }
    if camera.basis().iter().any(|axis| !axis.is_finite()) {
        // Typed so that there is no view: as far from straight down as a drag goes.
        camera.target = camera.eye - camera.up.any_orthonormal_vector();
    }
    row(ui, "field of view [°]", "vertical", |ui| {
        held |= ui
            .add(Slider::new(&mut camera.vfov_deg, 1.0..=175.0).max_decimals(1))
            .dragged()
    });
    row(ui, "speed [m/s]", "of flying; wheel, or + and −", |ui| {
        ui.add(
            DragValue::new(&mut controls.speed)
                .range(1e-4..=1e5)
                .speed(0.01),
        )
    });
    scope.panels.held |= held;
    ui.horizontal_wrapped(|ui| {
        ui.label("bookmarks");
        ui.spacing_mut().item_spacing.x = 1.0;
        for slot in 0..BOOKMARKS {
            let name = format!("{}", slot + 1);
            let response = ui.selectable_label(controls.bookmarks[slot].is_some(), name);
            let response = response.on_hover_text(
                "click to go there (or to set it, where it is empty); right click to set it. \
                 Keys: the digit, Ctrl and the digit",
            );
            match controls.bookmarks[slot].filter(|_| !response.secondary_clicked()) {
                Some(camera) if response.clicked() => controls.camera = camera,
                None if response.clicked() || response.secondary_clicked() => {
                    controls.bookmarks[slot] = Some(controls.camera)
                }
                _ => {}
            }
        }
    });
    if ui
        .button("copy camera as TOML")
        .on_hover_text("for a scene file, or after --with")
        .clicked()
    {
        scope.requests.push(Request::CopyCamera);
    }
}
