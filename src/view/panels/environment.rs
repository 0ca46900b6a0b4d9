//! The environment: one radiance, or a sky that is scaled and turned.

use std::sync::Arc;

use egui::{DragValue, Slider, Ui};
use glam::Vec3;

use super::lights::show_power;
use super::row;
use crate::scene::{ClearSky, Environment, Sky, SkySource};
use crate::view::sky::{WantedSky, Whole};

/// Shows what it is, and how it may differ. What takes a while to work out is `wanted`.
pub(super) fn show(
    ui: &mut Ui,
    environment: &mut Environment,
    wanted: &mut Option<WantedSky>,
    held: &mut bool,
) {
    match environment {
        Environment::Uniform(radiance) => {
            show_power(
                ui,
                "environment",
                "constant radiance that comes from everywhere [W/(m² sr)]",
                radiance,
                held,
            );
            let hint = "a cloudless sky with a sun, in place of the constant";
            if ui.button("clear sky").on_hover_text(hint).clicked() {
                *wanted = Some(WantedSky {
                    whole: Whole::Clear(ClearSky::default()),
                    splits: false,
                });
            }
        }
        Environment::Map(sky) => {
            show_sky(ui, sky, wanted, held);
            let button = ui.button("constant").on_hover_text("no map any more");
            if button.clicked() {
                *environment = Vec3::ZERO.into();
                *wanted = None;
            }
        }
    }
}

fn show_sky(ui: &mut Ui, sky: &mut Arc<Sky>, wanted: &mut Option<WantedSky>, held: &mut bool) {
    let (mut scale, mut rotate_deg) = (sky.scale(), sky.rotate_deg());
    let speed = 0.01 * f64::from(scale.max(1e-3));
    let drag = DragValue::new(&mut scale).range(0.0..=1e9).speed(speed);
    let hint = "radiance of a texel of 1 [W/(m² sr)]";
    row(ui, "sky scale", hint, |ui| {
        *held |= ui.add(drag).dragged();
    });
    let slider = Slider::new(&mut rotate_deg, 0.0..=360.0).suffix("°");
    let hint = "about +y, counter-clockwise from above";
    row(ui, "turned", hint, |ui| {
        *held |= ui.add(slider).dragged();
    });
    if (scale, rotate_deg) != (sky.scale(), sky.rotate_deg()) {
        *sky = Arc::new(sky.with(scale, rotate_deg));
    }
    let now = wanted.clone().unwrap_or_else(|| WantedSky {
        whole: match sky.source() {
            Some(SkySource::Clear(clear)) => Whole::Clear(*clear),
            _ => Whole::Map(Arc::clone(sky)),
        },
        splits: sky.sun().is_some(),
    });
    let mut next = now.clone();
    if let Whole::Clear(clear) = &mut next.whole {
        let height = Slider::new(&mut clear.sun_height_deg, 0.0..=90.0).suffix("°");
        row(ui, "sun", "height of the sun over the horizon", |ui| {
            *held |= ui.add(height).dragged();
        });
        row(ui, "disc of the sun", "whether it is in the sky", |ui| {
            ui.checkbox(&mut clear.has_sun, "");
        });
        let turbidity = Slider::new(&mut clear.turbidity, 1.0..=10.0);
        row(ui, "turbidity", "haze: 2 is clear, 6 is hazy", |ui| {
            *held |= ui.add(turbidity).dragged();
        });
    }
    let hint = "the brightest disc of the sky is a directional light";
    row(ui, "sun as a light", hint, |ui| {
        ui.checkbox(&mut next.splits, "");
    });
    if next != now {
        *wanted = Some(next);
    }
}
