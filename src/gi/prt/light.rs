//! The light, as one number for each function that transfer is kept of.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use super::fold;
use super::transfer::TransferSettings;
use crate::gi::Settings;
use crate::gi::shared::sh;
use crate::image::luminance;
use crate::render::GpuScene;
use crate::scene::{Light, Sky};

/// What damps high bands.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Window {
    None,
    Hann(f64),
    Lanczos(f64),
}

/// The light of a scene, kept for as long as it is the same.
pub(super) struct Lights {
    window: Window,
    /// What of a sky's bands above is put into those that are kept ([`fold`]); none: nothing.
    folded: Option<Vec<f32>>,
    /// What is known of the last sky's map, before it is scaled and turned.
    map: Option<(Arc<Sky>, Map)>,
    /// What it was worked out of.
    made_of: Option<(Vec<Light>, Vec3, Option<Arc<Sky>>)>,
    now: Vec<[f32; 3]>,
}

/// Harmonics of a sky's map.
struct Map {
    kept: Vec<DVec3>,
    /// Those of bands above, where they are used.
    above: Vec<DVec3>,
}

impl Map {
    fn new(order: u32, sky: &Sky, is_folded: bool) -> Self {
        let kept = project_sky(order, sky);
        if let Some(told) = told_of_loss(&kept, sky) {
            log::warn!("prt: {told}");
        }
        let mut all = match is_folded {
            true => fold::project(sky),
            false => Vec::new(),
        };
        let above = match held_share(&all, sky) >= LEAST_HELD {
            true => all.split_off(kept.len()),
            false => Vec::new(),
        };
        Map { kept, above }
    }
}

impl Lights {
    pub(super) fn new(settings: &Settings) -> Self {
        let width = f64::from(settings.number("window_width"));
        Lights {
            window: match settings.choice("window") {
                "hann" => Window::Hann(width),
                "lanczos" => Window::Lanczos(width),
                _ => Window::None,
            },
            folded: None,
            map: None,
            made_of: None,
            now: Vec::new(),
        }
    }

    /// Sets what of bands above is kept from now on.
    pub(super) fn set_folded(&mut self, folded: Option<Vec<f32>>) {
        (self.folded, self.map, self.made_of) = (folded, None, None);
    }

    /// A row a function, as they were last.
    pub(super) fn now(&self) -> &[[f32; 3]] {
        &self.now
    }

    /// A row a function, where the light is another than before.
    pub(super) fn of(
        &mut self,
        scene: &GpuScene,
        transfer: &TransferSettings,
    ) -> Option<Vec<[f32; 3]>> {
        let environment = &scene.environment;
        let of = (
            scene.lights.clone(),
            environment.radiance,
            environment.sky().cloned(),
        );
        if self.made_of.as_ref() == Some(&of) {
            return None;
        }
        let mut harmonics = self.harmonics(environment.radiance, of.2.as_ref(), transfer.order);
        let factors = match self.window {
            Window::None => vec![1.0; transfer.order as usize],
            Window::Hann(width) => sh::hann(transfer.order as usize, width),
            Window::Lanczos(width) => sh::lanczos(transfer.order as usize, width),
        };
        for (l, factor) in (0..).zip(&factors) {
            harmonics[l * l..(l + 1) * (l + 1)]
                .iter_mut()
                .for_each(|rgb| *rgb *= *factor);
        }
        let mut rows: Vec<[f32; 3]> = harmonics.iter().map(|rgb| rgb.as_vec3().into()).collect();
        if transfer.has_lights {
            // What emits is in its column as bright as it is.
            rows.extend(scene.is_emissive.then_some([1.0; 3]));
            rows.extend(scene.lights.iter().map(|light| match *light {
                Light::Directional { irradiance, .. } => irradiance.to_array(),
                Light::Point { intensity, .. } | Light::Spot { intensity, .. } => {
                    intensity.to_array()
                }
            }));
        }
        self.made_of = Some(of);
        self.now.clone_from(&rows);
        Some(rows)
    }

    fn harmonics(&mut self, radiance: Vec3, sky: Option<&Arc<Sky>>, order: u32) -> Vec<DVec3> {
        let Some(sky) = sky else {
            let mut all = vec![DVec3::ZERO; (order * order) as usize];
            all[0] = (4.0 * PI).sqrt() * radiance.as_dvec3();
            return all;
        };
        let is_known = |(known, _): &&(Arc<Sky>, Map)| known.is_of_map(sky);
        let map = match self.map.take().filter(|map| is_known(&map)) {
            Some((_, map)) => map,
            None => Map::new(order, sky, self.folded.is_some()),
        };
        let turn = DMat3::from_rotation_y(f64::from(sky.rotate_deg()).to_radians());
        let all: Vec<DVec3> = map.kept.iter().chain(&map.above).copied().collect();
        let mut harmonics = fold::turned(&all, turn);
        let above = harmonics.split_off(map.kept.len());
        if let Some(folded) = &self.folded {
            fold::add(&mut harmonics, &above, folded);
        }
        self.map = Some((Arc::clone(sky), map));
        let scale = f64::from(sky.scale());
        harmonics.iter_mut().for_each(|rgb| *rgb *= scale);
        harmonics
    }
}

/// The most bands that harmonics may have.
const MOST_BANDS: u32 = 10;

/// A sky of whose luminance harmonics hold a smaller share, squared, is none that they hold.
const LEAST_HELD: f64 = 0.5;

/// Share of the square of a sky's luminance that its first harmonics hold.
fn held_share(harmonics: &[DVec3], sky: &Sky) -> f64 {
    let squares = harmonics
        .iter()
        .map(|rgb| f64::from(luminance(rgb.as_vec3())).powi(2));
    squares.sum::<f64>() / squared(sky)
}

/// What to say where harmonics hold less than half of the square of a sky's luminance.
fn told_of_loss(plain: &[DVec3], sky: &Sky) -> Option<String> {
    // No number, where the sky is black.
    let share = held_share(plain, sky);
    if share.is_nan() || share >= LEAST_HELD {
        return None;
    }
    let order = plain.len().isqrt();
    let more = project_sky(MOST_BANDS, sky);
    let enough = (order + 1..=MOST_BANDS as usize)
        .find(|order| held_share(&more[..order * order], sky) >= LEAST_HELD);
    let advice = enough.map_or_else(
        || {
            format!(
                "no order up to {MOST_BANDS} holds half; `environment.split_sun` takes a sun out"
            )
        },
        |enough| format!("`order={enough}` holds half"),
    );
    let percent = 100.0 * share;
    Some(format!(
        "`order={order}` holds {percent:.1}% of the square of the sky's light, and blurs the rest; \
         {advice}"
    ))
}

/// ∫ L² dω of a sky's luminance, before it is scaled.
fn squared(sky: &Sky) -> f64 {
    let image = sky.image();
    let (width, height) = (f64::from(image.width), f64::from(image.height));
    let rows = (0..).zip(image.pixels.chunks(image.width as usize));
    rows.map(|(y, row): (u32, _)| {
        let edge = |y: u32| (PI * f64::from(y) / height).cos();
        let solid_angle = (edge(y) - edge(y + 1)) * TAU / width;
        let squares = row.iter().map(|texel| f64::from(luminance(*texel)).powi(2));
        solid_angle * squares.sum::<f64>()
    })
    .sum()
}

/// Radiance of a sky as harmonics, red, green and blue of each, before it is scaled and turned:
/// texels by their solid angles, and where they are large, by places in each.
pub fn project_sky(order: u32, sky: &Sky) -> Vec<DVec3> {
    let image = sky.image();
    let parts = 256u32.div_ceil(image.width).max(1);
    let (width, height) = (parts * image.width, parts * image.height);
    let plain = sky.with(1.0, 0.0);
    let functions = (order * order) as usize;
    let row = |y: u32| {
        let edge = |y: u32| (PI * f64::from(y) / f64::from(height)).cos();
        let solid_angle = (edge(y) - edge(y + 1)) * TAU / f64::from(width);
        let (mut sums, mut basis) = (vec![DVec3::ZERO; functions], vec![0.0; functions]);
        let middle = PI * (f64::from(y) + 0.5) / f64::from(height);
        for x in 0..width {
            let (sin, cos) = (TAU * (f64::from(x) + 0.5) / f64::from(width)).sin_cos();
            let direction = DVec3::new(middle.sin() * sin, middle.cos(), -middle.sin() * cos);
            sh::evaluate(order as usize, direction, &mut basis);
            let light = solid_angle * plain.radiance(direction.as_vec3()).as_dvec3();
            for (sum, basis) in sums.iter_mut().zip(&basis) {
                *sum += *basis * light;
            }
        }
        sums
    };
    let rows: Vec<Vec<DVec3>> = (0..height).into_par_iter().map(row).collect();
    (0..functions)
        .map(|at| rows.iter().map(|row| row[at]).sum())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;

    /// A disc of so many degrees in a dim sky, at +y.
    fn disc(width_deg: f32) -> Sky {
        let image = Image::from_fn(256, 128, |index| {
            let from_top = ((index / 256) as f32 + 0.5) / 128.0 * 180.0;
            let is_in = from_top < 0.5 * width_deg;
            Vec3::splat(if is_in { 10.0 } else { 0.001 })
        });
        let sky = Sky::new(image, 0.0);
        sky.unwrap_or_else(|problem| panic!("{problem}"))
    }

    /// Of a disc that is wide enough half is held, by more bands the narrower it is; of a narrow
    /// one no order holds half. A black sky loses nothing.
    #[test]
    fn what_bands_lose_is_told() {
        let told = |width_deg: f32, order| {
            let sky = disc(width_deg);
            told_of_loss(&project_sky(order, &sky), &sky)
        };
        assert_eq!(told(180.0, 4), None);
        assert_eq!(told(60.0, 6), None);
        let some = told(40.0, 3);
        let order = some.as_ref().and_then(|some| some.split("`order=").nth(2));
        let order: u32 = order
            .and_then(|text| text.split('`').next())
            .and_then(|text| text.parse().ok())
            .unwrap_or_default();
        assert!((4..=10).contains(&order), "{some:?}");
        assert_eq!(told(40.0, order), None);
        assert!(told(40.0, order - 1).is_some());
        let none = told(5.0, 6);
        assert!(none.is_some_and(|text| text.contains("split_sun")));
        assert_eq!(told(0.0, 2), None);
    }
}
