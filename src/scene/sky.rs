//! Light from far away that differs by direction: an equirectangular map around the scene.
//!
//! Direction (x, y, z) is at u = atan2(x, −z)/2π modulo 1 and v = acos(y)/π. Row 0 is at +y, and
//! values are at the middles of texels. Between them light is bilinear, around the map along u and
//! up to its edges along v.

use std::f64::consts::{PI, TAU};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Vec3;

use super::clear_sky::ClearSky;
use super::hash::Fnv;
use super::sun::{self, Sun};
use super::{Light, SceneError};
use crate::image::{Image, luminance, read_exr};

/// Smallest and largest side of a map (texels).
const SIDES: std::ops::RangeInclusive<u32> = 2..=16_384;

/// A direction drawn in proportion to the light that comes from there, about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkySample {
    /// Unit direction.
    pub direction: Vec3,
    /// Density [1/sr].
    pub density: f32,
}

/// Where a map comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum SkySource {
    /// A file.
    File(PathBuf),
    /// A model.
    Clear(ClearSky),
}

/// What a scene file says of a map.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SkyEntry {
    /// Where it comes from.
    pub(super) source: SkySource,
    /// Radiance of a texel of 1 [W/(m² sr)].
    pub(super) scale: f32,
    /// About +y, counter-clockwise from above (°).
    pub(super) rotate_deg: f32,
    /// The brightest disc is a directional light.
    pub(super) splits_sun: bool,
}

/// An environment map, scaled and turned.
#[derive(Clone)]
pub struct Sky {
    map: Arc<Map>,
    scale: f32,
    rotate_deg: f32,
    /// Added to u of a direction, 0 to 1.
    turn: f64,
    /// Of all that it is.
    hash: u128,
}

/// The texels of a map, and how they are drawn.
struct Map {
    image: Image,
    /// Running sum of the probabilities of rows, ending at 1.
    rows: Vec<f64>,
    /// Of each row: running sum of those of its texels, ending at 1.
    columns: Vec<f32>,
    hash: u128,
    /// `None`: an image in memory.
    source: Option<SkySource>,
    /// What was taken out, and the map before.
    sun: Option<(Sun, Arc<Map>)>,
}

impl Map {
    /// What is wrong with it, in words, where a side or a texel is out of range.
    fn new(image: Image, source: Option<SkySource>) -> Result<Self, String> {
        let Image { width, height, .. } = image;
        if !SIDES.contains(&width) || !SIDES.contains(&height) {
            let (least, most) = (SIDES.start(), SIDES.end());
            return Err(format!(
                "the map has {width}×{height} texels; sides have {least} to {most}"
            ));
        }
        let is_bad = |pixel: &Vec3| !pixel.is_finite() || pixel.min_element() < 0.0;
        if let Some(first) = image.pixels.iter().position(is_bad) {
            let count = image.pixels.iter().filter(|pixel| is_bad(pixel)).count();
            let (x, y) = (first as u32 % width, first as u32 / width);
            let [r, g, b] = image.pixels[first].to_array();
            let are = if count == 1 { "texel is" } else { "texels are" };
            return Err(format!(
                "{count} {are} negative, infinite or no number; the first is at column {x}, row \
                 {y}: {r}, {g}, {b}"
            ));
        }
        let mut hash = Fnv::default();
        hash.bytes(bytemuck::cast_slice(&image.pixels));
        hash.bytes(bytemuck::cast_slice(&[width, height]));
        let (rows, columns) = distribution(&image);
        Ok(Map {
            image,
            rows,
            columns,
            hash: hash.value(),
            source,
            sun: None,
        })
    }
}

impl PartialEq for Sky {
    fn eq(&self, other: &Self) -> bool {
        self.hash == other.hash
    }
}

impl fmt::Debug for Sky {
    /// What tells it from others, in short.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Image { width, height, .. } = self.map.image;
        write!(f, "Sky({width}x{height} {:032x})", self.hash)
    }
}

impl Sky {
    /// A map of radiance [W/(m² sr)], turned about +y by `rotate_deg`, counter-clockwise from
    /// above; what is wrong with it, in words, where a side or a texel is out of range.
    pub fn new(image: Image, rotate_deg: f32) -> Result<Self, String> {
        let map = Arc::new(Map::new(image, None)?);
        Ok(Sky::of(map, 1.0, rotate_deg))
    }

    /// A cloudless sky; what is wrong with its parameters, in words, where one is out of range.
    pub fn clear(sky: ClearSky) -> Result<Self, String> {
        let map = Map::new(sky.image()?, Some(SkySource::Clear(sky)))?;
        Ok(Sky::of(Arc::new(map), 1.0, 0.0))
    }

    fn of(map: Arc<Map>, scale: f32, rotate_deg: f32) -> Self {
        let rotate_deg = rotate_deg.rem_euclid(360.0);
        let mut hash = Fnv::default();
        hash.bytes(bytemuck::bytes_of(&map.hash));
        hash.bytes(bytemuck::cast_slice(&[scale, rotate_deg]));
        Sky {
            map,
            scale,
            rotate_deg,
            turn: f64::from(rotate_deg) / 360.0,
            hash: hash.value(),
        }
    }

    /// The same map, with radiance `scale` [W/(m² sr)] for a texel of 1, turned by `rotate_deg`.
    #[must_use]
    pub fn with(&self, scale: f32, rotate_deg: f32) -> Self {
        Sky::of(Arc::clone(&self.map), scale, rotate_deg)
    }

    /// The map without its brightest disc, which is [`Sky::sun`] then; `None` where no disc stands
    /// out, or where it is taken out already.
    #[must_use]
    pub fn split_sun(&self) -> Option<Self> {
        if self.map.sun.is_some() {
            return None;
        }
        let (rest, sun) = sun::split(self.image())?;
        let mut map = Map::new(rest, self.map.source.clone()).ok()?;
        let mut hash = Fnv::default();
        hash.bytes(bytemuck::cast_slice(&[map.hash, self.map.hash]));
        map.hash = hash.value();
        map.sun = Some((sun, Arc::clone(&self.map)));
        Some(Sky::of(Arc::new(map), self.scale, self.rotate_deg))
    }

    /// The map as it was before its sun was taken out.
    #[must_use]
    pub fn whole(&self) -> Self {
        let sun = self.map.sun.as_ref();
        let map = sun.map_or(&self.map, |(_, whole)| whole);
        Sky::of(Arc::clone(map), self.scale, self.rotate_deg)
    }

    /// The light of the disc that was taken out, as far as the sky is scaled and turned.
    pub fn sun(&self) -> Option<Light> {
        let (sun, _) = self.map.sun.as_ref()?;
        let turn = glam::Quat::from_rotation_y(self.rotate_deg.to_radians());
        Some(Light::Directional {
            direction: -(turn * sun.to_sun).normalize(),
            irradiance: self.scale * sun.irradiance,
        })
    }

    /// About the width of the disc that was taken out (°).
    pub fn sun_width_deg(&self) -> Option<f32> {
        self.map.sun.as_ref().map(|(sun, _)| sun.width_deg)
    }

    /// Whether another has the same texels, however scaled and turned.
    pub fn is_of_map(&self, other: &Sky) -> bool {
        self.map.hash == other.map.hash
    }

    /// The map that a scene file names.
    pub(super) fn read(entry: &SkyEntry) -> Result<Self, SceneError> {
        let path = match &entry.source {
            SkySource::File(path) => path.as_path(),
            SkySource::Clear(_) => Path::new("clear_sky"),
        };
        let problem = |problem: String| {
            let hint = "give an equirectangular map, .exr or .hdr, of finite texels";
            SceneError::file(path, problem, hint)
        };
        let image = match &entry.source {
            SkySource::File(path) => read(path),
            SkySource::Clear(clear) => clear.image(),
        };
        let map = Map::new(image.map_err(problem)?, Some(entry.source.clone())).map_err(problem)?;
        let brightest =
            (map.image.pixels.iter()).fold(0.0, |most: f32, texel| most.max(texel.max_element()));
        if !(brightest * entry.scale).is_finite() {
            return Err(problem(format!(
                "`scale = {}` makes texels too bright for numbers: the largest is {brightest}",
                entry.scale
            )));
        }
        let sky = Sky::of(Arc::new(map), entry.scale, entry.rotate_deg);
        if !entry.splits_sun {
            return Ok(sky);
        }
        let Some(split) = sky.split_sun() else {
            let told = "`split_sun` finds no small bright disc: the map stays whole";
            log::warn!("{}: {told}", path.display());
            return Ok(sky);
        };
        split.tell_sun(path);
        Ok(split)
    }

    /// Says what was taken out, in one line.
    fn tell_sun(&self, path: &Path) {
        let (Some(sun), Some(width_deg)) = (self.sun(), self.sun_width_deg()) else {
            return;
        };
        let (to_sun, _, irradiance) = sun.sample(Vec3::ZERO);
        let [r, g, b] = irradiance.to_array();
        log::warn!(
            "{}: the sun is a directional light: {:.1}° up, {width_deg:.2}° wide, {r:.4} {g:.4} \
             {b:.4} W/m²",
            path.display(),
            to_sun.y.asin().to_degrees(),
        );
    }

    /// Where the map comes from; `None`: an image in memory.
    pub fn source(&self) -> Option<&SkySource> {
        self.map.source.as_ref()
    }

    /// Whether no light comes from anywhere.
    pub fn is_black(&self) -> bool {
        self.scale == 0.0 || (self.image().pixels.iter()).all(|pixel| *pixel == Vec3::ZERO)
    }

    /// Its texels before it is scaled and turned.
    pub fn image(&self) -> &Image {
        &self.map.image
    }

    /// Radiance of a texel of 1 [W/(m² sr)].
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// All that it is, in a number.
    pub fn hash(&self) -> u128 {
        self.hash
    }

    /// How far it is turned (°), 0 to 360.
    pub fn rotate_deg(&self) -> f32 {
        self.rotate_deg
    }

    /// Radiance from a unit direction [W/(m² sr)].
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let between = self.between(direction);
        let part = |(row, column, share): (usize, usize, f64)| {
            let texel = self.image().pixels[row * self.image().width as usize + column];
            texel * share as f32
        };
        self.scale * between.map(part).into_iter().sum::<Vec3>()
    }

    /// Draws a direction by two numbers of [0, 1). A texel is drawn by its luminance times solid
    /// angle, and a place by what it adds to the bilinear light: a tent around its middle.
    pub fn sample(&self, numbers: [f32; 2]) -> SkySample {
        let Image { width, height, .. } = *self.image();
        let [a, b] = numbers.map(f64::from);
        let row = find(self.map.rows.len(), |row| self.map.rows[row] <= a);
        let of_row = self.row(row);
        let column = find(of_row.len(), |column| f64::from(of_row[column]) <= b);
        let begin = row
            .checked_sub(1)
            .map_or(0.0, |before| self.map.rows[before]);
        let (left, right) = range_in(of_row, column);
        let x = column as f64 + 0.5 + tent(b, left.into(), right.into());
        // Beyond the poles light goes on as it is at the last row: the tent folds back.
        let y = (row as f64 + 0.5 + tent(a, begin, self.map.rows[row])).abs();
        let y = f64::from(height) - (f64::from(height) - y).abs();
        let (u, v) = (x / f64::from(width) - self.turn, y / f64::from(height));
        let ((sin, cos), (flat, up)) = ((u * TAU).sin_cos(), (v * PI).sin_cos());
        let direction = Vec3::new((flat * sin) as f32, up as f32, (-flat * cos) as f32);
        SkySample {
            direction,
            density: self.density(direction),
        }
    }

    /// Density with which [`Sky::sample`] draws a unit direction [1/sr].
    pub fn density(&self, direction: Vec3) -> f32 {
        let Image { width, height, .. } = *self.image();
        let part = |(row, column, share): (usize, usize, f64)| {
            let begin = row
                .checked_sub(1)
                .map_or(0.0, |before| self.map.rows[before]);
            let (left, right) = range_in(self.row(row), column);
            share * (self.map.rows[row] - begin) * f64::from(right - left)
        };
        let in_texels: f64 = self.between(direction).map(part).into_iter().sum();
        let y = f64::from(direction.y);
        let flat = (1.0 - y * y).max(1e-12).sqrt();
        let texels = f64::from(width) * f64::from(height);
        (in_texels * texels / (TAU * PI * flat)) as f32
    }

    /// The four texels around a direction, by row and column, and their shares.
    fn between(&self, direction: Vec3) -> [(usize, usize, f64); 4] {
        let [width, height] = [self.image().width, self.image().height].map(i64::from);
        let [u, v] = self.place(direction);
        let [x, y] = [u * width as f64 - 0.5, v * height as f64 - 0.5];
        let (left, top) = (x.floor() as i64, y.floor() as i64);
        let (across, down) = (x - x.floor(), y - y.floor());
        let texel = |dx: i64, dy: i64| {
            let row = (top + dy).clamp(0, height - 1) as usize;
            let column = (left + dx).rem_euclid(width) as usize;
            let along = |step: i64, share: f64| if step == 0 { 1.0 - share } else { share };
            (row, column, along(dx, across) * along(dy, down))
        };
        [texel(0, 0), texel(1, 0), texel(0, 1), texel(1, 1)]
    }

    /// u and v of a direction, 0 to 1.
    fn place(&self, direction: Vec3) -> [f64; 2] {
        let direction = direction.as_dvec3();
        let u = direction.x.atan2(-direction.z) / TAU + self.turn;
        let v = direction.y.clamp(-1.0, 1.0).acos() / PI;
        [u.rem_euclid(1.0), v]
    }

    fn row(&self, row: usize) -> &[f32] {
        let width = self.image().width as usize;
        &self.map.columns[row * width..(row + 1) * width]
    }
}

/// How far from the middle of a texel (texels) a number of `begin` to `end` falls in its tent.
fn tent(number: f64, begin: f64, end: f64) -> f64 {
    let share = ((number - begin) / (end - begin)).clamp(0.0, 1.0);
    if share < 0.5 {
        (2.0 * share).sqrt() - 1.0
    } else {
        1.0 - (2.0 - 2.0 * share).sqrt()
    }
}

fn range_in(running: &[f32], index: usize) -> (f32, f32) {
    let begin = index.checked_sub(1).map_or(0.0, |before| running[before]);
    (begin, running[index])
}

/// The first of `count` for which a sorted condition does not hold, or the last.
fn find(count: usize, is_before: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, count - 1);
    while low < high {
        let middle = usize::midpoint(low, high);
        if is_before(middle) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low
}

/// Probabilities of texels as running sums: of rows, and in each row of its texels; in a black map
/// as if it were white.
fn distribution(image: &Image) -> (Vec<f64>, Vec<f32>) {
    let width = image.width as usize;
    let is_black = image.pixels.iter().all(|pixel| luminance(*pixel) == 0.0);
    let (mut rows, mut columns) = (Vec::new(), Vec::with_capacity(image.pixels.len()));
    for (row, texels) in image.pixels.chunks(width).enumerate() {
        let mut sum = 0.0;
        let running: Vec<f64> = (texels.iter())
            .map(|texel| {
                sum += if is_black {
                    1.0
                } else {
                    f64::from(luminance(*texel))
                };
                sum
            })
            .collect();
        // A row without light is never drawn.
        let total = if sum > 0.0 { sum } else { 1.0 };
        columns.extend(running.iter().map(|part| (part / total) as f32));
        let middle = (row as f64 + 0.5) / f64::from(image.height);
        rows.push(rows.last().copied().unwrap_or(0.0) + sum * (PI * middle).sin());
    }
    let total = rows.last().copied().unwrap_or(1.0);
    (rows.into_iter().map(|part| part / total).collect(), columns)
}

/// A map of a file, by its extension.
fn read(path: &Path) -> Result<Image, String> {
    let extension = path
        .extension()
        .map(|extension| extension.to_ascii_lowercase());
    match extension.as_deref().and_then(std::ffi::OsStr::to_str) {
        Some("exr") => read_exr(path).map_err(|error| error.to_string()),
        Some("hdr") => {
            let decoded = image::ImageReader::open(path)
                .and_then(image::ImageReader::with_guessed_format)
                .map_err(|error| error.to_string())?
                .decode()
                .map_err(|error| error.to_string())?
                .into_rgb32f();
            let (width, height) = decoded.dimensions();
            let pixels = decoded.pixels().map(|pixel| Vec3::from_array(pixel.0));
            Ok(Image {
                width,
                height,
                pixels: pixels.collect(),
            })
        }
        _ => Err("it is neither an .exr nor an .hdr file".to_owned()),
    }
}
