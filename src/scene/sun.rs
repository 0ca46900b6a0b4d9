//! The brightest disc of a map, taken out to be a directional light.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use crate::image::{Image, luminance};

/// What was taken out of a map, before it is scaled and turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sun {
    /// Unit direction of its middle.
    pub(super) to_sun: Vec3,
    /// On a surface that faces it (W/m²).
    pub(super) irradiance: Vec3,
    /// Of a disc that is all as bright as its brightest place (°).
    pub(super) width_deg: f32,
}

/// Texels with this part of the largest luminance, and beside the largest, are of the disc.
const PART_OF_DISC: f32 = 0.1;
/// A disc with a larger radius is no sun: its light has soft edges (°).
const MOST_RADIUS_DEG: f64 = 10.0;
/// The disc has so many times the mean luminance of what is around it.
const LEAST_CONTRAST: f32 = 4.0;

/// The map without its brightest disc, and the disc; `None` where none stands out.
///
/// Texels of the disc, and those around it that it covers in part, keep the mean of a ring around
/// them. What they lose is the light: it brings a facing surface as much irradiance as they did.
pub(super) fn split(image: &Image) -> Option<(Image, Sun)> {
    let Image { width, height, .. } = *image;
    let of = |at: usize| luminance(image.pixels[at]);
    let brightest = (0..image.pixels.len()).reduce(|a, b| if of(b) > of(a) { b } else { a })?;
    let least = PART_OF_DISC * of(brightest);
    if least <= 0.0 {
        return None;
    }
    let disc = connected(image, brightest, least);
    let middle: DVec3 = disc
        .iter()
        .map(|at| f64::from(of(*at)) * solid_angle(image, *at) * direction(image, *at))
        .sum();
    let middle = middle.normalize();
    let angle = |at: usize| direction(image, at).dot(middle).clamp(-1.0, 1.0).acos();
    let radius = disc.iter().fold(0.0, |most: f64, at| most.max(angle(*at)));
    if radius > MOST_RADIUS_DEG.to_radians() {
        return None;
    }
    // Of texels that the disc covers in part the middle is up to half a diagonal away.
    let texel = (TAU / f64::from(width)).hypot(PI / f64::from(height));
    let (inner, outer) = (radius + texel, 2.0 * radius + 3.0 * texel);
    let angles: Vec<(usize, f64)> = (0..image.pixels.len())
        .map(|at| (at, angle(at)))
        .filter(|(_, angle)| *angle <= outer)
        .collect();
    let mut ring = (Vec3::ZERO, 0.0);
    for (at, _) in angles.iter().filter(|(_, angle)| *angle > inner) {
        let own = solid_angle(image, *at) as f32;
        ring = (ring.0 + own * image.pixels[*at], ring.1 + own);
    }
    let around = ring.0 / ring.1.max(f32::MIN_POSITIVE);
    if of(brightest) < LEAST_CONTRAST * luminance(around) {
        return None;
    }
    let mut rest = image.clone();
    let (mut irradiance, mut toward) = (DVec3::ZERO, DVec3::ZERO);
    let mut taken = Vec::new();
    for (at, _) in angles.iter().filter(|(_, angle)| *angle <= inner) {
        let texel = &mut rest.pixels[*at];
        let more = (*texel - around).max(Vec3::ZERO);
        *texel -= more;
        let own = solid_angle(image, *at);
        toward += own * f64::from(luminance(more)) * direction(image, *at);
        taken.push((*at, own * more.as_dvec3()));
    }
    let to_sun = toward.normalize();
    for (at, flux) in taken {
        irradiance += direction(image, at).dot(to_sun) * flux;
    }
    let sun = Sun {
        to_sun: to_sun.as_vec3(),
        irradiance: irradiance.as_vec3(),
        width_deg: width_deg(luminance(irradiance.as_vec3()), of(brightest)),
    };
    Some((rest, sun))
}

/// Width of a disc that brings so much where it has such a radiance (°).
fn width_deg(irradiance: f32, radiance: f32) -> f32 {
    let sin = (irradiance / (std::f32::consts::PI * radiance)).sqrt();
    2.0 * sin.min(1.0).asin().to_degrees()
}

/// Texels that hang together with one, all of some luminance; the map goes on around u.
fn connected(image: &Image, first: usize, least: f32) -> Vec<usize> {
    let [width, height] = [image.width, image.height].map(i64::from);
    let mut is_known = vec![false; image.pixels.len()];
    let (mut found, mut next) = (Vec::new(), vec![first]);
    is_known[first] = true;
    while let Some(at) = next.pop() {
        found.push(at);
        let (x, y) = (at as i64 % width, at as i64 / width);
        for (dx, dy) in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy))) {
            let row = y + dy;
            if row < 0 || row >= height {
                continue;
            }
            let other = (row * width + (x + dx).rem_euclid(width)) as usize;
            if !is_known[other] && luminance(image.pixels[other]) >= least {
                is_known[other] = true;
                next.push(other);
            }
        }
    }
    found.sort_unstable();
    found
}

/// Unit direction of the middle of a texel.
fn direction(image: &Image, at: usize) -> DVec3 {
    let (x, y) = (at as u32 % image.width, at as u32 / image.width);
    let u = (f64::from(x) + 0.5) / f64::from(image.width);
    let v = (f64::from(y) + 0.5) / f64::from(image.height);
    let ((sin, cos), (flat, up)) = ((TAU * u).sin_cos(), (PI * v).sin_cos());
    DVec3::new(flat * sin, up, -flat * cos)
}

/// How much a texel of 1 brings to the sphere (sr): its tent of the bilinear light between rows,
/// which goes on as it is beyond the first and the last.
fn solid_angle(image: &Image, at: usize) -> f64 {
    let y = at as u32 / image.width;
    let high = PI / f64::from(image.height);
    let middle = high * (f64::from(y) + 0.5);
    let slope = |to: f64| (to.sin() - middle.sin()) / high;
    let above = match y {
        0 => 1.0 - middle.cos(),
        _ => -middle.cos() - slope(middle - high),
    };
    let below = match y + 1 == image.height {
        true => 1.0 + middle.cos(),
        false => middle.cos() - slope(middle + high),
    };
    (above + below) * TAU / f64::from(image.width)
}
