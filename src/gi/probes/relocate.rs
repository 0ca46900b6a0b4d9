//! Where probes are moved to that stand too near to a surface (Majercik et al. 2021, section 3).

use glam::Vec3;

/// A probe moves by at most so much (cells).
const FARTHEST: f32 = 0.45;

/// A ray of a probe: its direction, and how far it goes (m).
pub type Seen = (Vec3, f32);

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
