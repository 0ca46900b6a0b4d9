//! Where probes are moved to that stand too near to a surface (Majercik et al. 2021, section 3).

use glam::Vec3;

use super::lattice::Lattice;
use super::list::ProbeList;
use super::rays::ProbeRays;
use super::volume::places_buffer;
use crate::graph::{Error, Frame, FrameStats, Gpu};
use crate::render::GpuScene;
use crate::render::bvh::SceneRays;

/// Steps in which probes move away from surfaces.
const STEPS: u32 = 3;

/// Rays, about, that are read back at a time.
const RAYS_AT_A_TIME: u32 = 1 << 20;

/// A probe moves by at most so much (cells).
const FARTHEST: f32 = 0.45;

/// A ray of a probe: its direction, and how far it goes (m).
pub type Seen = (Vec3, f32);

/// The places of the probes of a lattice (m), moved away from what `ray_count` rays of each meet
/// nearer than `distance` (cells), and what finding them cost.
pub fn relocate(
    (gpu, scene): (&Gpu, &GpuScene),
    triangles: &SceneRays,
    lattice: &Lattice,
    (distance, ray_count): (f32, u32),
) -> Result<(Vec<Vec3>, FrameStats), Error> {
    let homes: Vec<Vec3> = lattice.places().collect();
    let (mut places, mut stats) = (homes.clone(), FrameStats::default());
    let cell = lattice.cell();
    let at_a_time = (RAYS_AT_A_TIME / ray_count).max(1) as usize;
    for (places, homes) in places.chunks_mut(at_a_time).zip(homes.chunks(at_a_time)) {
        let count = places.len() as u32;
        let rays = ProbeRays::new(gpu, count, ray_count)?;
        let list = ProbeList::of_all(gpu, count)?;
        for _ in 0..STEPS {
            let from = places_buffer(gpu, places)?;
            let mut frame = Frame::new();
            frame.set_scene(&scene.set, &scene.materials);
            rays.trace_from(&mut frame, triangles, (&from, list.part(0, count)), None);
            stats.append(gpu.submit(frame)?);
            let seen = rays.read_distances(gpu, count)?;
            for ((place, home), rays) in places.iter_mut().zip(homes).zip(&seen) {
                *place = away(*place, *home, cell, distance * cell, rays);
            }
        }
    }
    Ok((places, stats))
}

/// Where a probe is moved to: away from the nearest surface that its rays meet, until it is
/// `distance` (m) off, but no nearer to what is behind it, and at most 0.45 cells from `home`. The
/// side of the surface decides nothing.
pub fn away(place: Vec3, home: Vec3, cell: f32, distance: f32, rays: &[Seen]) -> Vec3 {
    let nearest = rays.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let Some(&(towards, near)) = nearest.filter(|(_, near)| *near < distance) else {
        return place;
    };
    let behind = |ray: &&Seen| -ray.0.dot(towards);
    let opposite = rays.iter().max_by(|a, b| behind(a).total_cmp(&behind(b)));
    let room = opposite.map_or(0.0, |(_, far)| 0.5 * (far - near).max(0.0));
    let moved = place - (distance - near).min(room) * towards;
    home + (moved - home).clamp_length_max(FARTHEST * cell)
}
