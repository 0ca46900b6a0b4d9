//! Radiosity: a second reference, for diffuse scenes, that shares the path tracer's first vertex
//! and nothing behind it (B. Kahl 2019, section 3.4.2; M. Cohen, J. Wallace, *Radiosity and
//! Realistic Image Synthesis*, 1993).
//!
//! Both sides of all triangles are cut into patches. The irradiance of a side i is
//!
//! ```text
//! E_i = A_i + Σ_j F_ij ρ_j E_j
//! ```
//!
//! A_i comes from the lights, emitters and the environment, and F_ij is the share of the rays from
//! i that meet j: they leave places all over the patch, with the density of a cosine. ρ_j is the
//! albedo where a ray meets j. The equation is solved by iteration, a bounce a turn. A picture's
//! rays then see ρ/π E of the patches that they meet (final gather).
//!
//! A patch is split where its quarters differ and the picture would show it. How much light of a
//! patch reaches the picture, its importance, follows the same links backwards (B. Smits, J. Arvo,
//! D. Salesin, *An Importance-Driven Radiosity Algorithm*, 1992).

use std::f32::consts::PI;

use glam::Vec3;
use rayon::prelude::*;

use super::form_factors::{Links, Purpose, Quarter, Seen, Side, quarters, rays_of, sample, watch};
use super::patches::{Patch, Patches};
use super::render::render_seeing;
use super::result::ReferenceImage;
use super::world::{Surface, World};
use super::{Bounces, ReferenceError, Settings, validate_scene};
use crate::image::luminance;
use crate::scene::Scene;

/// How finely surfaces are cut, and how many rays find what they see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadiositySettings {
    /// Rays from a side of a patch whose edge is as long as [`RadiositySettings::edge`] says, a
    /// power of two of 64 or more; smaller patches have fewer, by their surface, but 64 at least.
    pub rays: u32,
    /// Longest edge of a patch before any is split, in units of the diagonal of the scene.
    pub edge: f32,
    /// A patch is split while the picture's mean indirect light would differ by more than this
    /// share, were all of the patch like one of its quarters.
    pub max_error: f32,
    /// Most patches.
    pub max_patches: u32,
}

impl Default for RadiositySettings {
    fn default() -> Self {
        RadiositySettings {
            rays: 2048,
            edge: 1.0 / 16.0,
            max_error: 5e-5,
            max_patches: 200_000,
        }
    }
}

/// How often patches are split at most.
const ROUNDS: u32 = 6;

/// Bounces over which importance is followed.
const IMPORTANCE_TURNS: u32 = 8;

/// Fewest rays of a side.
const LEAST_RAYS: u32 = 64;

/// Differences between quarters count where they are this many standard errors.
const SIGNIFICANT: f32 = 3.0;

/// All bounces are there when one adds less than this share.
const CONVERGED: f32 = 1e-5;

/// Most turns of the iteration: with it even walls of albedo 0.99 end.
const MOST_TURNS: u32 = 4096;

/// The irradiance of all patches of a scene.
pub struct Radiosity {
    patches: Patches,
    /// Of each side [W/m²]: 2 · patch + 1 for the back.
    irradiance: Vec<Vec3>,
    rays: u64,
}

impl Radiosity {
    /// Solves a scene; `bounces` and the seed are those of `settings`. `progress` gets the share
    /// that is done, 0 to 1.
    ///
    /// # Errors
    ///
    /// The scene has a specular lobe, would have more patches than may be, or cannot be traced.
    pub fn solve(
        scene: &Scene,
        settings: &Settings,
        radiosity: &RadiositySettings,
        progress: &(dyn Fn(f32) + Sync),
    ) -> Result<Self, ReferenceError> {
        radiosity.validate()?;
        validate_scene(scene)?;
        validate_diffuse(scene)?;
        Self::of_world(&World::new(scene), settings, radiosity, progress)
    }

    fn of_world(
        world: &World<'_>,
        settings: &Settings,
        radiosity: &RadiositySettings,
        progress: &(dyn Fn(f32) + Sync),
    ) -> Result<Self, ReferenceError> {
        let scene = world.scene;
        let (low, high) = scene.bounds().unwrap_or_default();
        let edge_m = radiosity.edge * low.distance(high);
        let patches = Patches::new(scene, edge_m, radiosity.max_patches).map_err(|count| {
            ReferenceError::Scene {
                scene: scene.name.clone(),
                problem: format!(
                    "patches of {edge_m:.3} m and less would be {count}; {} may be at most",
                    radiosity.max_patches
                ),
            }
        })?;
        let mut solved = Radiosity {
            patches,
            irradiance: Vec::new(),
            rays: 0,
        };
        // Half of the surface of a square patch of that edge.
        let full_m2 = 0.5 * edge_m * edge_m;
        let sample = |sides: &mut Vec<Option<Side>>, all: &[Patch], purpose: Purpose| {
            sides.resize(2 * all.len(), None);
            let unknown = sides
                .par_iter_mut()
                .enumerate()
                .filter(|(_, side)| side.is_none());
            unknown.for_each(|(index, side)| {
                let patch = &all[index / 2];
                let rays = (radiosity.rays as f32 * patch.area_m2 / full_m2) as u32;
                let batch = 1 << (rays.clamp(LEAST_RAYS, radiosity.rays) / purpose.share()).ilog2();
                let stream = (settings.seed, purpose);
                *side = Some(sample(world, stream, patch, index % 2 == 1, batch));
            });
        };
        let mut sides = Vec::new();
        let watched = watch(world, settings);
        for round in 0..ROUNDS {
            sample(&mut sides, &solved.patches.all, Purpose::Decide);
            let links = solved.solve_sampled(&sides, settings.bounces);
            progress((round + 1) as f32 / (ROUNDS + 1) as f32);
            let split = solved.uneven(&sides, &links, &watched, radiosity.max_error);
            let room = (radiosity.max_patches as usize - solved.patches.all.len()) / 3;
            if split.len() > room {
                log::warn!(
                    "{} of {} patches are too coarse for an error of {}, and {} may be at most; \
                     {room} are split",
                    split.len(),
                    solved.patches.all.len(),
                    radiosity.max_error,
                    radiosity.max_patches
                );
            }
            for patch in split.iter().take(room) {
                solved.patches.split(*patch);
                (sides[2 * patch], sides[2 * patch + 1]) = (None, None);
            }
            if split.is_empty() {
                break;
            }
        }
        // Patches that looked bright by chance have been split. So the rays that decided must not
        // be those that measure.
        sides.clear();
        sample(&mut sides, &solved.patches.all, Purpose::Measure);
        let links = solved.solve_sampled(&sides, settings.bounces);
        solved.rays = links.all.len() as u64;
        progress(1.0);
        Ok(solved)
    }

    /// Number of patches; each has two sides.
    pub fn patch_count(&self) -> usize {
        self.patches.all.len()
    }

    /// Number of rays that met a surface.
    pub fn ray_count(&self) -> u64 {
        self.rays
    }

    /// The mean irradiance of a side of a triangle [W/m²].
    pub fn mean_irradiance(&self, triangle: u32, is_back: bool) -> Vec3 {
        let own = |(_, patch): &(usize, &Patch)| patch.triangle == triangle;
        let patches = self.patches.all.iter().enumerate().filter(own);
        let (sum, area_m2) = patches.fold((Vec3::ZERO, 0.0), |(sum, area_m2), (index, patch)| {
            let irradiance = self.irradiance[2 * index + usize::from(is_back)];
            (sum + patch.area_m2 * irradiance, area_m2 + patch.area_m2)
        });
        sum / area_m2
    }

    /// Radiance that a surface reflects [W/(m² sr)].
    fn reflected(&self, scene: &Scene, surface: &Surface) -> Vec3 {
        let seen = Seen::of(scene, surface);
        let patch = self.patches.find(seen.triangle, seen.place);
        seen.albedo / PI * self.irradiance[seen.side(patch)]
    }

    /// Solves for what the rays of all sides have found, and returns what they meet.
    fn solve_sampled(&mut self, sides: &[Option<Side>], bounces: Bounces) -> Links {
        let links = Links::new(&self.patches, sides);
        self.irradiance = bounce(sides, &links, bounces);
        links
    }

    /// The share of each side's irradiance in the picture's mean luminance [1/sr], and that mean.
    fn importance(
        &self,
        sides: &[Option<Side>],
        links: &Links,
        watched: &[Seen],
    ) -> (Vec<f32>, f32) {
        let mut direct = vec![0.0; sides.len()];
        let mut mean = 0.0;
        for seen in watched {
            let side = seen.side(self.patches.find(seen.triangle, seen.place));
            let weight = luminance(seen.albedo) / (PI * watched.len() as f32);
            direct[side] += weight;
            mean += weight * luminance(self.irradiance[side]);
        }
        let rays = rays_of(sides);
        let mut importance = direct.clone();
        for _ in 0..IMPORTANCE_TURNS {
            let mut next = direct.clone();
            for (index, own) in importance.iter().enumerate().filter(|(_, own)| **own > 0.0) {
                let share = own / rays[index];
                for (side, albedo) in &links.all[links.first[index]..links.first[index + 1]] {
                    next[*side as usize] += share * luminance(*albedo);
                }
            }
            importance = next;
        }
        (importance, mean)
    }

    /// The patches whose quarters differ too much, the worst first.
    fn uneven(
        &self,
        sides: &[Option<Side>],
        links: &Links,
        watched: &[Seen],
        max_error: f32,
    ) -> Vec<usize> {
        let (importance, mean) = self.importance(sides, links, watched);
        // How far off a quarter is [W/m²].
        let unevenness = |index: usize| -> f32 {
            let side_mean = luminance(self.irradiance[index]);
            let (mut link, mut off) = (links.first[index], 0.0_f32);
            for quarter in quarters(&sides[index]) {
                let mut sum = luminance(quarter.direct + quarter.sent);
                let mut squares = quarter.squares;
                for (seen, albedo) in &links.all[link..link + quarter.seen.len()] {
                    let light = luminance(*albedo * self.irradiance[*seen as usize]);
                    (sum, squares) = (sum + light, squares + light * light);
                }
                link += quarter.seen.len();
                let count = quarter.rays.max(1) as f32;
                let own = sum / count;
                let variance = (squares / count - own * own).max(0.0) / count;
                let far = (own - side_mean).abs();
                if quarter.rays > 0 && far > SIGNIFICANT * variance.sqrt() {
                    off = off.max(far);
                }
            }
            off
        };
        let off: Vec<f32> = (0..sides.len())
            .into_par_iter()
            .map(|index| importance[index] * unevenness(index))
            .collect();
        let mut uneven: Vec<(usize, f32)> = (off.chunks_exact(2).enumerate())
            .map(|(patch, sides)| (patch, sides[0].max(sides[1])))
            .filter(|(_, off)| *off > max_error * mean)
            .collect();
        uneven.sort_by(|a, b| b.1.total_cmp(&a.1));
        uneven.into_iter().map(|(patch, _)| patch).collect()
    }
}

/// The irradiance of all sides [W/m²] after so many bounces, the picture's own not counted.
fn bounce(sides: &[Option<Side>], links: &Links, bounces: Bounces) -> Vec<Vec3> {
    let rays = rays_of(sides);
    let mean = |light: fn(&Quarter) -> Vec3| -> Vec<Vec3> {
        let sum = |side: &Option<Side>| quarters(side).iter().map(light).sum::<Vec3>();
        let sums = sides.iter().map(sum).zip(&rays);
        sums.map(|(sum, rays)| sum / *rays).collect()
    };
    let direct = mean(|quarter| quarter.direct);
    let constant = mean(|quarter| quarter.direct + quarter.sent);
    let turns = match bounces {
        Bounces::Count(count) => count.saturating_sub(1).min(MOST_TURNS),
        Bounces::Full => MOST_TURNS,
    };
    let mut irradiance = direct;
    for _ in 0..turns {
        let next: Vec<Vec3> = (0..sides.len())
            .into_par_iter()
            .map(|index| {
                let links = &links.all[links.first[index]..links.first[index + 1]];
                let seen: Vec3 = (links.iter())
                    .map(|(side, albedo)| *albedo * irradiance[*side as usize])
                    .sum();
                constant[index] + seen / rays[index]
            })
            .collect();
        let [changed, all] = [
            next.iter()
                .zip(&irradiance)
                .map(|(a, b)| (*a - *b).abs().element_sum())
                .sum::<f32>(),
            next.iter().map(|light| light.element_sum()).sum::<f32>(),
        ];
        irradiance = next;
        if changed <= CONVERGED * all {
            break;
        }
    }
    irradiance
}

/// Renders a scene from a solution of its radiosity, which it returns too: the first vertex is the
/// path tracer's, with `settings.sampling`.
pub fn render_radiosity(
    scene: &Scene,
    settings: &Settings,
    radiosity: &RadiositySettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<(ReferenceImage, Radiosity), ReferenceError> {
    settings.validate()?;
    radiosity.validate()?;
    validate_scene(scene)?;
    validate_diffuse(scene)?;
    let world = World::new(scene);
    let solved = Radiosity::of_world(&world, settings, radiosity, &|share| progress(0.5 * share))?;
    let reflected = |surface: &Surface| solved.reflected(scene, surface);
    let image = render_seeing(&world, settings, Some(&reflected), &|share| {
        progress(0.5 + 0.5 * share);
    });
    Ok((image, solved))
}

fn validate_diffuse(scene: &Scene) -> Result<(), ReferenceError> {
    let scatters = |material: &&crate::scene::Material| {
        material.specular.is_some() || material.transmission.is_some()
    };
    match scene.materials.iter().find(scatters) {
        Some(material) => Err(ReferenceError::Scene {
            scene: scene.name.clone(),
            problem: format!(
                "radiosity is for diffuse scenes, and material {} has a specular lobe or is clear; \
                 use the path tracer",
                material.name
            ),
        }),
        None => Ok(()),
    }
}

impl RadiositySettings {
    fn validate(&self) -> Result<(), ReferenceError> {
        let fields = [
            (
                self.rays.is_power_of_two() && (LEAST_RAYS..=65536).contains(&self.rays),
                "patch_rays",
                self.rays.to_string(),
                "a power of two, 64 to 65536",
            ),
            (
                self.edge >= 1e-4 && self.edge <= 1.0,
                "patch_edge",
                self.edge.to_string(),
                "0.0001 to 1",
            ),
            (
                self.max_error > 0.0 && self.max_error.is_finite(),
                "patch_error",
                self.max_error.to_string(),
                "above 0",
            ),
            (
                (1..=1 << 24).contains(&self.max_patches),
                "max_patches",
                self.max_patches.to_string(),
                "1 to 16777216",
            ),
        ];
        match fields.into_iter().find(|(is_valid, ..)| !is_valid) {
            Some((_, field, value, range)) => Err(ReferenceError::Setting {
                field,
                value,
                range,
            }),
            None => Ok(()),
        }
    }
}
