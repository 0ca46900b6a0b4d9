//! The loop over blocks and batches: who is sampled how often.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use super::path::{Beyond, Terms};
use super::result::{Accumulator, ReferenceImage};
use super::sampler::Sampler;
use super::world::{Surface, World};
use super::{Filter, ReferenceError, Sampling, Settings, validate_scene};
use crate::image::{GuideImage, luminance};
use crate::scene::Scene;
use crate::scene::rays::{NO_TRIANGLE, Ray};

/// Side of the blocks that are rendered by one thread and judged by adaptive sampling (px).
const BLOCK_PX: u32 = 8;

/// Batches that a variance is estimated from, at least (where there are as many samples).
const MIN_BATCHES: u32 = 8;

/// Largest number of samples in a batch: beyond it stratification gains little.
const MAX_BATCH_SPP: u32 = 64;

/// Samples in a batch of adaptive sampling.
const ADAPTIVE_BATCH_SPP: u32 = 16;

/// A block's relative error is judged against its mean plus this share of the image's mean, so that
/// black blocks come to an end.
const DARK_SHARE: f32 = 0.01;

/// Renders a scene. `progress` is called now and then, from any thread, with the share done, 0 to
/// 1.
pub fn render(
    scene: &Scene,
    settings: &Settings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<ReferenceImage, ReferenceError> {
    settings.validate()?;
    validate_scene(scene)?;
    Ok(render_seeing(&World::new(scene), settings, None, progress))
}

/// Radiance that a surface reflects [W/(m² sr)].
pub(super) type Reflected<'a> = &'a (dyn Fn(&Surface) -> Vec3 + Sync);

/// The same of a scene that is prepared and valid, with other light than that of paths behind the
/// second vertex, where there is any.
pub(super) fn render_seeing(
    world: &World<'_>,
    settings: &Settings,
    reflected: Option<Reflected<'_>>,
    progress: &(dyn Fn(f32) + Sync),
) -> ReferenceImage {
    let camera = PixelCamera::new(world.scene, settings);
    let mut blocks = Block::all(settings);
    let job = Job {
        world,
        camera,
        settings,
        reflected,
        batch_spp: batch_spp(settings.sampling),
        progress,
    };
    match settings.sampling {
        Sampling::Fixed { spp } => {
            job.render_round(&mut blocks, spp.div_ceil(job.batch_spp), 0.0, 1.0)
        }
        Sampling::Adaptive { max_error, max_spp } => {
            job.render_adaptively(&mut blocks, max_error, max_spp.div_ceil(job.batch_spp))
        }
    }
    progress(1.0);
    job.assemble(&blocks)
}

/// What is seen at the pixel centres, without any light.
pub fn guide(scene: &Scene, width: u32, height: u32) -> Result<GuideImage, ReferenceError> {
    let settings = Settings {
        width,
        height,
        ..Settings::default()
    };
    settings.validate()?;
    validate_scene(scene)?;
    let world = World::new(scene);
    let camera = PixelCamera::new(scene, &settings);
    let job = Job {
        world: &world,
        camera,
        settings: &settings,
        reflected: None,
        batch_spp: 1,
        progress: &|_| {},
    };
    Ok(job.assemble(&Block::all(&settings)).guide)
}

/// Samples per batch, a power of two.
fn batch_spp(sampling: Sampling) -> u32 {
    match sampling {
        Sampling::Fixed { spp } => {
            let target = (spp / MIN_BATCHES).clamp(1, MAX_BATCH_SPP);
            1 << target.ilog2()
        }
        Sampling::Adaptive { max_spp, .. } => {
            let target = (max_spp / MIN_BATCHES).clamp(1, ADAPTIVE_BATCH_SPP);
            1 << target.ilog2()
        }
    }
}

/// The camera with its basis worked out: [`crate::scene::Camera::ray_direction`] for many rays.
pub(super) struct PixelCamera {
    eye: Vec3,
    corner: Vec3,
    per_x_px: Vec3,
    per_y_px: Vec3,
    forward: Vec3,
}

impl PixelCamera {
    pub(super) fn new(scene: &Scene, settings: &Settings) -> Self {
        let camera = &scene.camera;
        let [right, up, forward] = camera.basis();
        let tan_y = (0.5 * camera.vfov_deg.to_radians()).tan();
        let tan_x = tan_y * settings.width as f32 / settings.height as f32;
        PixelCamera {
            eye: camera.eye,
            corner: forward - right * tan_x + up * tan_y,
            per_x_px: right * (2.0 * tan_x / settings.width as f32),
            per_y_px: up * (-2.0 * tan_y / settings.height as f32),
            forward,
        }
    }

    pub(super) fn ray(&self, x_px: f32, y_px: f32) -> Ray {
        let direction = (self.corner + self.per_x_px * x_px + self.per_y_px * y_px).normalize();
        Ray {
            origin: self.eye,
            direction,
            leaves: NO_TRIANGLE,
        }
    }
}

/// A block of pixels and what is known of them.
struct Block {
    x_px: u32,
    y_px: u32,
    width: u32,
    pixels: Vec<Accumulator>,
    is_active: bool,
}

impl Block {
    fn all(settings: &Settings) -> Vec<Block> {
        let columns = settings.width.div_ceil(BLOCK_PX);
        let rows = settings.height.div_ceil(BLOCK_PX);
        let block = |index: u32| {
            let (x_px, y_px) = (index % columns * BLOCK_PX, index / columns * BLOCK_PX);
            let (width, height) = (
                BLOCK_PX.min(settings.width - x_px),
                BLOCK_PX.min(settings.height - y_px),
            );
            Block {
                x_px,
                y_px,
                width,
                pixels: vec![Accumulator::default(); (width * height) as usize],
                is_active: true,
            }
        };
        (0..columns * rows).map(block).collect()
    }

    /// Image coordinates of a pixel of the block.
    fn pixel(&self, index: usize) -> (u32, u32) {
        (
            self.x_px + index as u32 % self.width,
            self.y_px + index as u32 / self.width,
        )
    }

    /// Mean luminance of the radiance.
    fn mean(&self) -> f32 {
        self.pixels
            .iter()
            .map(|pixel| luminance(pixel.mean().radiance()))
            .sum::<f32>()
            / self.pixels.len() as f32
    }

    /// Standard error of that mean; the pixels are independent.
    fn standard_error(&self) -> f32 {
        self.pixels
            .iter()
            .map(Accumulator::radiance_variance)
            .sum::<f32>()
            .sqrt()
            / self.pixels.len() as f32
    }
}

/// One call of [`render`].
struct Job<'a> {
    world: &'a World<'a>,
    camera: PixelCamera,
    settings: &'a Settings,
    reflected: Option<Reflected<'a>>,
    batch_spp: u32,
    progress: &'a (dyn Fn(f32) + Sync),
}

impl Job<'_> {
    /// Gives every active block `batches` more batches; progress runs from `from` to `to`.
    fn render_round(&self, blocks: &mut [Block], batches: u32, from: f32, to: f32) {
        let active = blocks.iter().filter(|block| block.is_active).count();
        let done = AtomicUsize::new(0);
        blocks
            .par_iter_mut()
            .filter(|block| block.is_active)
            .for_each(|block| {
                for index in 0..block.pixels.len() {
                    let (x, y) = block.pixel(index);
                    let pixel = &mut block.pixels[index];
                    for _ in 0..batches {
                        let mean = self.render_batch(x, y, pixel.batches());
                        pixel.add(mean);
                    }
                }
                let share = (done.fetch_add(1, Ordering::Relaxed) + 1) as f32 / active as f32;
                (self.progress)(from + (to - from) * share);
            });
    }

    /// Rounds of growing length until no block and no neighbour of it is over the bar.
    fn render_adaptively(&self, blocks: &mut [Block], max_error: f32, max_batches: u32) {
        let (mut batches, mut shown) = (0, 0.0);
        let mut remaining = blocks.len();
        while batches < max_batches && remaining > 0 {
            let round = (batches / 2).max(MIN_BATCHES).min(max_batches - batches);
            // The blocks that are left say how far the end is, at best; the shown share only grows.
            let settled = 1.0 - remaining as f32 / blocks.len() as f32;
            let goal = settled
                .max((batches + round) as f32 / max_batches as f32)
                .clamp(shown, 0.99);
            self.render_round(blocks, round, shown, goal);
            shown = goal;
            batches += round;
            self.judge(blocks, max_error);
            remaining = blocks.iter().filter(|block| block.is_active).count();
        }
    }

    /// Decides which blocks go on: those over the bar, and their neighbours, lest a lucky block
    /// stop early.
    fn judge(&self, blocks: &mut [Block], max_error: f32) {
        let means: Vec<f32> = blocks.iter().map(Block::mean).collect();
        let image_mean = means.iter().sum::<f32>() / means.len().max(1) as f32;
        let is_over: Vec<bool> = blocks
            .iter()
            .zip(&means)
            .map(|(block, mean)| {
                block.standard_error() > max_error * (mean + DARK_SHARE * image_mean)
            })
            .collect();
        let columns = self.settings.width.div_ceil(BLOCK_PX) as usize;
        let rows = is_over.len() / columns;
        for (index, block) in blocks.iter_mut().enumerate() {
            let (row, column) = (index / columns, index % columns);
            let mut nearby = (row.saturating_sub(1)..(row + 2).min(rows)).flat_map(|y| {
                (column.saturating_sub(1)..(column + 2).min(columns)).map(move |x| (x, y))
            });
            block.is_active &= nearby.any(|(x, y)| is_over[y * columns + x]);
        }
    }

    /// The mean of one batch of samples of a pixel.
    fn render_batch(&self, x: u32, y: u32, batch: u32) -> Terms {
        let center = match self.settings.filter {
            Filter::Center => Some(self.first_hit(x as f32 + 0.5, y as f32 + 0.5)),
            Filter::Box => None,
        };
        let lights = match &center {
            Some((_, Some(surface))) if self.world.has_exact_lights() => Some(
                self.world
                    .light_from_lights(surface, &mut Sampler::new(0, 0, 1)),
            ),
            _ => None,
        };
        let stream = Sampler::stream(self.settings.seed, y * self.settings.width + x, batch);
        let mut sum = Terms::default();
        for index in 0..self.batch_spp {
            let mut sampler = Sampler::new(stream, index, self.batch_spp);
            let (direction, first) = match center {
                Some(first) => first,
                None => {
                    let [dx, dy] = sampler.next_2d();
                    self.first_hit(x as f32 + dx, y as f32 + dy)
                }
            };
            let terms = match first {
                Some(surface) => {
                    let beyond = Beyond {
                        bounces: self.settings.bounces,
                        reflected: self.reflected.map(|reflected| reflected as _),
                        occlusion: self.settings.occlusion,
                    };
                    self.world
                        .shade_first(&surface, lights, beyond, &mut sampler)
                }
                None => Terms {
                    emission: self.world.scene.environment.radiance(direction),
                    visibility: 1.0,
                    ..Terms::default()
                },
            };
            sum = sum.zip(terms, |a, b| a + b);
        }
        let scale = 1.0 / self.batch_spp as f32;
        sum.zip(sum, |a, _| a * scale)
    }

    /// Where the camera looks there, and what it sees.
    fn first_hit(&self, x_px: f32, y_px: f32) -> (Vec3, Option<Surface>) {
        let ray = self.camera.ray(x_px, y_px);
        (ray.direction, self.world.trace(&ray))
    }

    /// The blocks as images, with what is seen at the pixel centres.
    fn assemble(&self, blocks: &[Block]) -> ReferenceImage {
        let mut image = ReferenceImage::new(self.settings.width, self.settings.height);
        for block in blocks {
            for (index, pixel) in block.pixels.iter().enumerate() {
                let (x, y) = block.pixel(index);
                let slot = (y * self.settings.width + x) as usize;
                image.set(slot, pixel, self.batch_spp);
                if let (_, Some(surface)) = self.first_hit(x as f32 + 0.5, y as f32 + 0.5) {
                    let depth_m = (surface.position - self.camera.eye).dot(self.camera.forward);
                    image.set_surface(slot, &surface, depth_m);
                }
            }
        }
        image
    }
}
