//! Light from far away: one radiance, or a map on the device for each direction and width.
//!
//! A map is octahedral (Meyer et al. 2010) around +y. Its mip levels have half as many texels along
//! an edge, each the mean over its own solid angle. Texels on the edge of the square have their
//! middles there, and hold what the texel has that the edge folds onto: so bilinear light between
//! texels has no seam.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};
use half::f16;
use rayon::prelude::*;

use crate::graph::{Error, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Owner, vk};
use crate::scene::{Environment, Sky};

/// Texels along an edge of the first level, at most, and of the last.
const EDGES: [u32; 2] = [4096, 4];
/// Radiance that half floats are held under: what filters add stays finite.
const MOST_STORED: f32 = 32_768.0;
/// A map that is darker than this is held in fewer digits: 2 to the other sign has to be a number.
const LEAST_EXPONENT: f32 = -100.0;
/// Places of a texel along each axis where the sky is looked up.
const PLACES: usize = 3;
/// Of a solid angle Ω, √Ω/k is the edge of the texels that it is looked up in. Between texels of
/// edge s light is bilinear, a filter of variance s²/4 along an axis; a disc has Ω/4π.
const TEXELS_ACROSS: f64 = 1.772_453_850_905_516;

/// Light from far away, on the device.
#[derive(Clone, Default)]
pub struct GpuEnvironment {
    /// Radiance (W/(m² sr)) from everywhere; black where there is a map.
    pub radiance: Vec3,
    map: Option<Map>,
}

/// A sky, and its levels.
#[derive(Clone)]
struct Map {
    sky: Arc<Sky>,
    levels: Arc<Vec<Level>>,
    image: Arc<Image>,
    /// 2 to this is the radiance of a stored 1, before it is scaled.
    exponent: i32,
}

/// One level: texels by rows, and the solid angle (sr) of what of each is in the square.
struct Level {
    edge: usize,
    texels: Vec<Vec3>,
    solid_angles: Vec<f32>,
}

impl GpuEnvironment {
    /// That of a scene; levels of `before` are used again where they are of the same map.
    pub(super) fn new(
        gpu: &Gpu,
        environment: &Environment,
        before: Option<&Self>,
    ) -> Result<Self, Error> {
        let Some(sky) = environment.sky() else {
            return Ok(GpuEnvironment {
                radiance: environment.uniform(),
                map: None,
            });
        };
        let before = before.and_then(|before| before.map.as_ref());
        let map = match before.filter(|before| before.sky.is_of_map(sky)) {
            Some(before) => Map {
                sky: Arc::clone(sky),
                ..before.clone()
            },
            None => Map::new(gpu, sky)?,
        };
        Ok(GpuEnvironment {
            radiance: Vec3::ZERO,
            map: Some(map),
        })
    }

    /// The sky, where there is one.
    pub fn sky(&self) -> Option<&Arc<Sky>> {
        self.map.as_ref().map(|map| &map.sky)
    }

    /// Mean radiance (W/(m² sr)) of about a solid angle (sr) around a unit direction: what shaders
    /// look up (`shared/environment.glsl`), but for the rounding of half floats.
    pub fn around(&self, direction: DVec3, solid_angle: f64) -> DVec3 {
        let Some(map) = &self.map else {
            return self.radiance.as_dvec3();
        };
        let turn = f64::from(map.sky.rotate_deg()).to_radians();
        let direction = glam::DQuat::from_rotation_y(-turn) * direction;
        f64::from(map.sky.scale()) * look_up(&map.levels, direction, solid_angle)
    }

    /// The largest radiance of any channel (W/(m² sr)) that a solid angle (sr) has, about.
    pub fn largest(&self, solid_angle: f64) -> f32 {
        let Some(map) = &self.map else {
            return self.radiance.max_element();
        };
        let edge = (4.0 / solid_angle).sqrt() * 2.0;
        let level = (map.levels.iter().rev()).find(|level| level.edge as f64 >= edge);
        let texels = &level.unwrap_or(&map.levels[0]).texels;
        map.sky.scale()
            * texels
                .iter()
                .fold(0.0, |most, texel| texel.max_element().max(most))
    }

    /// What shaders have of it: rgb of a stored 1 and, with a map, 1; then with a map the cosine
    /// and sine of its turn, and the edges of its first and last levels (texels).
    pub(super) fn constants(&self) -> [[f32; 4]; 2] {
        let Some(map) = &self.map else {
            return [self.radiance.extend(0.0).to_array(), [1.0, 0.0, 1.0, 1.0]];
        };
        let unit = map.sky.scale() * (map.exponent as f32).exp2();
        let (sin, cos) = map.sky.rotate_deg().to_radians().sin_cos();
        let [first, last] = [map.levels.first(), map.levels.last()]
            .map(|level| level.map_or(1.0, |level| level.edge as f32));
        [[unit, unit, unit, 1.0], [cos, sin, first, last]]
    }

    /// The image of the map, where there is one.
    pub(super) fn image(&self) -> Option<&Arc<Image>> {
        self.map.as_ref().map(|map| &map.image)
    }

    /// The image of the map, or where there is none a texel that nothing reads.
    pub(super) fn image_or_none(&self, gpu: &Gpu) -> Result<Arc<Image>, Error> {
        if let Some(image) = self.image() {
            return Ok(Arc::clone(image));
        }
        let level = Level {
            edge: 1,
            texels: vec![Vec3::ZERO],
            solid_angles: Vec::new(),
        };
        upload(gpu, &[level], 1.0)
    }
}

impl Map {
    fn new(gpu: &Gpu, sky: &Arc<Sky>) -> Result<Self, Error> {
        let levels = levels_of(sky);
        let largest =
            (levels[0].texels.iter()).fold(0.0f32, |most, texel| texel.max_element().max(most));
        // Of a map without light any will do.
        let exponent = (largest / MOST_STORED).log2().ceil().max(LEAST_EXPONENT) as i32;
        let image = upload(gpu, &levels, (-exponent as f32).exp2())?;
        Ok(Map {
            sky: Arc::clone(sky),
            levels: Arc::new(levels),
            image,
            exponent,
        })
    }
}

fn upload(gpu: &Gpu, levels: &[Level], factor: f32) -> Result<Arc<Image>, Error> {
    let edge = levels[0].edge as u32;
    let image = gpu.create_image(&ImageDesc {
        name: "scene.sky".into(),
        extent: [edge, edge, 1],
        kind: ImageKind::D2,
        format: vk::Format::R16G16B16A16_SFLOAT,
        mips: levels.len() as u32,
        layers: 1,
        usage: ImageUsage::SAMPLED,
        owner: Owner::Shared,
    })?;
    for (mip, level) in (0..).zip(levels) {
        let halves: Vec<[u16; 4]> = (level.texels.iter())
            .map(|texel| (factor * *texel).extend(1.0).to_array())
            .map(|texel| texel.map(|value| f16::from_f32(value).to_bits()))
            .collect();
        gpu.upload_image(&image, mip, 0, bytemuck::cast_slice(&halves))?;
    }
    gpu.make_ready(&[&image]);
    Ok(image)
}

/// All levels of a sky, before it is scaled and turned. Texels of the first are about as wide as
/// those of the sky.
fn levels_of(sky: &Sky) -> Vec<Level> {
    let [most, least] = EDGES;
    let edge = (sky.image().width / 2).next_power_of_two();
    let mut levels = vec![first_level(
        &sky.with(1.0, 0.0),
        edge.clamp(least, most) as usize,
    )];
    while let Some(last) = levels.last()
        && last.edge > least as usize
    {
        levels.push(last.halved());
    }
    levels
}

fn first_level(sky: &Sky, edge: usize) -> Level {
    let reach = 1.0 / (edge - 1) as f64;
    let row = |y: usize| {
        (0..edge).map(move |x| {
            let middle = DVec2::new(x as f64, y as f64) * 2.0 * reach - 1.0;
            // What of the texel is in the square.
            let low = (middle - reach).max(DVec2::splat(-1.0));
            let size = (middle + reach).min(DVec2::ONE) - low;
            let (mut light, mut solid_angle) = (DVec3::ZERO, 0.0);
            for place in 0..PLACES * PLACES {
                let at = DVec2::new((place % PLACES) as f64, (place / PLACES) as f64);
                let at = low + (at + 0.5) / PLACES as f64 * size;
                let direction = direction_of(at);
                // Of an octahedron's face a part has |d|₁³ times its solid angle in the square.
                let share = direction.abs().element_sum().powi(3) * size.element_product()
                    / (PLACES * PLACES) as f64;
                light += share * sky.radiance(direction.as_vec3()).as_dvec3();
                solid_angle += share;
            }
            ((light / solid_angle).as_vec3(), solid_angle as f32)
        })
    };
    let (texels, solid_angles) = (0..edge).into_par_iter().flat_map_iter(row).unzip();
    Level::folded(edge, texels, solid_angles)
}

impl Level {
    /// The next level: each texel has what of these is in it.
    fn halved(&self) -> Level {
        let edge = self.edge / 2;
        // Along an axis: the texels under each, and how much of them.
        let scale = (self.edge - 1) as f64 / (edge - 1) as f64;
        let under = |at: usize| {
            let [low, high] = [-0.5, 0.5]
                .map(|side| ((at as f64 + side) * scale).clamp(0.0, (self.edge - 1) as f64));
            let all =
                (low + 0.5).floor() as usize..=((high + 0.5).floor() as usize).min(self.edge - 1);
            all.map(move |own| {
                let within = |side: f64| (own as f64 + side).clamp(0.0, (self.edge - 1) as f64);
                let (begin, end) = (within(-0.5), within(0.5));
                (
                    own,
                    ((high.min(end) - low.max(begin)).max(0.0) / (end - begin)) as f32,
                )
            })
            .collect::<Vec<_>>()
        };
        let under: Vec<Vec<(usize, f32)>> = (0..edge).map(under).collect();
        let texel = |at: usize| {
            let (mut light, mut solid_angle) = (Vec3::ZERO, 0.0);
            for (y, down) in &under[at / edge] {
                for (x, across) in &under[at % edge] {
                    let own = y * self.edge + x;
                    let share = down * across * self.solid_angles[own];
                    light += share * self.texels[own];
                    solid_angle += share;
                }
            }
            (light / solid_angle, solid_angle)
        };
        let (texels, solid_angles) = (0..edge * edge).into_par_iter().map(texel).unzip();
        Level::folded(edge, texels, solid_angles)
    }

    /// That of texels each of which has its own part of the square.
    fn folded(edge: usize, texels: Vec<Vec3>, solid_angles: Vec<f32>) -> Self {
        let mut level = Level {
            edge,
            texels,
            solid_angles,
        };
        level.fold();
        level
    }

    /// Texels that the edge folds onto each other are one: all take its mean.
    fn fold(&mut self) {
        let last = self.edge - 1;
        let mut share = |places: &[[usize; 2]]| {
            let own = |[x, y]: &[usize; 2]| y * self.edge + x;
            let part = |at: usize| self.solid_angles[at];
            let all: f32 = places.iter().map(|place| part(own(place))).sum();
            let mean = (places.iter().map(own))
                .map(|at| part(at) / all * self.texels[at])
                .sum();
            places
                .iter()
                .for_each(|place| self.texels[own(place)] = mean);
        };
        for side in [0, last] {
            for along in 1..self.edge / 2 {
                share(&[[side, along], [side, last - along]]);
                share(&[[along, side], [last - along, side]]);
            }
        }
        share(&[[0, 0], [0, last], [last, 0], [last, last]]);
    }

    /// Bilinear, at a place of the square.
    fn at(&self, place: DVec2) -> DVec3 {
        let at = (place * 0.5 + 0.5) * (self.edge - 1) as f64;
        let low = at.floor().min(DVec2::splat(self.edge as f64 - 2.0));
        let (share, [x, y]) = (at - low, low.to_array().map(|low| low as usize));
        let texel = |x: usize, y: usize| self.texels[y * self.edge + x].as_dvec3();
        let row = |y: usize| texel(x, y).lerp(texel(x + 1, y), share.x);
        row(y).lerp(row(y + 1), share.y)
    }
}

/// The mean over about a solid angle, of a map that is not turned.
fn look_up(levels: &[Level], direction: DVec3, solid_angle: f64) -> DVec3 {
    let sum = direction.abs().element_sum();
    let solid_angle = solid_angle.clamp(1e-9, 2.0 * TAU);
    // Texels along an edge of a level of the wanted width.
    let edge = 1.0 + 2.0 * TEXELS_ACROSS * (sum.powi(3) / solid_angle).sqrt();
    let level = (levels[0].edge as f64 / edge)
        .log2()
        .clamp(0.0, (levels.len() - 1) as f64);
    let place = place_of(direction);
    let (finer, share) = (level.floor() as usize, level.fract());
    let coarser = (finer + 1).min(levels.len() - 1);
    levels[finer]
        .at(place)
        .lerp(levels[coarser].at(place), share)
}

/// The place of a direction in the square, −1 to 1: +y is in the middle, −y at its corners.
fn place_of(direction: DVec3) -> DVec2 {
    let d = direction / direction.abs().element_sum();
    let signs = DVec2::new(1f64.copysign(d.x), 1f64.copysign(d.z));
    let flat = DVec2::new(d.x, d.z);
    if d.y >= 0.0 {
        flat
    } else {
        (1.0 - DVec2::new(flat.y, flat.x).abs()) * signs
    }
}

/// The unit direction of a place in the square.
fn direction_of(place: DVec2) -> DVec3 {
    let up = 1.0 - place.abs().element_sum();
    let fold = f64::max(-up, 0.0);
    let signs = DVec2::new(1f64.copysign(place.x), 1f64.copysign(place.y));
    let flat = place - fold * signs;
    DVec3::new(flat.x, up, flat.y).normalize()
}
