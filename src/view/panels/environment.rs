//! The environment: one radiance, or a sky that is scaled and turned.

use std::sync::Arc;

use egui::{DragValue, Slider, Ui};
use glam::Vec3;

use super::lights::show_power;
use super::row;
use crate::scene::{ClearSky, Environment, Sky, SkySource};

/// Shows what it is, and how it may differ.
pub(super) fn show(ui: &mut Ui, environment: &mut Environment, held: &mut bool) {
    let mut wanted = None;
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
                // As bright as a picture at exposure 1 can show.
                wanted = Some((ClearSky::default(), 0.02, 0.0));
            }
        }
        Environment::Map(sky) => {
            let (mut scale, mut rotate_deg) = (sky.scale(), sky.rotate_deg());
            let speed = 0.01 * f64::from(scale.max(1e-3));
            let drag = DragValue::new(&mut scale).range(0.0..=1e9).speed(speed);
            row(
                ui,
                "sky scale",
                "radiance of a texel of 1 [W/(m² sr)]",
                |ui| {
                    *held |= ui.add(drag).dragged();
                },
            );
            let slider = Slider::new(&mut rotate_deg, 0.0..=360.0).suffix("°");
            row(
                ui,
                "turned",
                "about +y, counter-clockwise from above",
                |ui| {
                    *held |= ui.add(slider).dragged();
                },
            );
            if let Some(SkySource::Clear(clear)) = sky.source() {
                let mut clear = *clear;
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
                if sky.source() != Some(&SkySource::Clear(clear)) {
                    wanted = Some((clear, scale, rotate_deg));
                }
            }
            let hint = "the brightest disc of the sky is a directional light";
            let mut splits = sky.sun().is_some();
            row(ui, "sun as a light", hint, |ui| {
                if ui.checkbox(&mut splits, "").changed() {
                    let other = if splits {
                        sky.split_sun()
                    } else {
                        Some(sky.whole())
                    };
                    if let Some(other) = other {
                        *sky = Arc::new(other);
                    }
                }
            });
            if (scale, rotate_deg) != (sky.scale(), sky.rotate_deg()) {
                *sky = Arc::new(sky.with(scale, rotate_deg));
            }
            if ui
                .button("constant")
                .on_hover_text("no map any more")
                .clicked()
            {
                *environment = Vec3::ZERO.into();
                return;
            }
        }
    }
    if let Some((clear, scale, rotate_deg)) = wanted
        && let Ok(sky) = Sky::clear(clear)
    {
        let whole = sky.with(scale, rotate_deg);
        let split = environment.sun().and_then(|_| whole.split_sun());
        *environment = split.unwrap_or(whole).into();
    }
}
