//! Where probes are moved to: beside the surfaces that look them up, on the side that is seen.

use glam::Vec3;

use super::lattice::Lattice;

/// A place on a surface (m), and the normal of the side that is seen.
pub type Seen = (Vec3, Vec3);

/// A probe moves by at most so much (cells).
pub(super) const FARTHEST: f32 = 0.75;
/// Surfaces are one plane if their normals' cosine is this or more…
const SAME_COSINE: f32 = 0.98;
/// …and they are no further apart (cells).
const SAME_OFFSET: f32 = 0.1;

/// Puts each probe `distance` (cells) off the plane of the seen place nearest to it, on the side
/// that most of the places around it on this plane are seen from. A probe that no place looks up,
/// `normal_bias` (cells) off its surface, stays, and so does one that cannot get through a wall.
pub fn snap(lattice: &Lattice, seen: &[Seen], distance: f32, normal_bias: f32) -> Vec<Vec3> {
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); lattice.probe_count() as usize];
    let bias = normal_bias * lattice.cell();
    for (index, (place, normal)) in (0..).zip(seen) {
        for probe in lattice.cage(*place + bias * *normal) {
            around[probe as usize].push(index);
        }
    }
    let probes = (0..).zip(&around);
    probes
        .map(|(probe, around)| {
            let around = around.iter().map(|index| &seen[*index as usize]);
            beside(lattice.place(probe), lattice.cell(), around, distance)
        })
        .collect()
}

/// Where one probe is moved to, by the places that look it up.
fn beside<'s>(
    probe: Vec3,
    cell: f32,
    around: impl Iterator<Item = &'s Seen> + Clone,
    distance: f32,
) -> Vec3 {
    let far = |(place, _): &&Seen| place.distance_squared(probe);
    let nearest = around.clone().min_by(|a, b| far(a).total_cmp(&far(b)));
    let Some((place, normal)) = nearest else {
        return probe;
    };
    let off = |other: &Vec3| (other - place).dot(*normal);
    let votes: i64 = around
        .filter(|(other, _)| off(other).abs() <= SAME_OFFSET * cell)
        .map(|(_, side)| side.dot(*normal))
        .map(|cosine| i64::from(cosine >= SAME_COSINE) - i64::from(cosine <= -SAME_COSINE))
        .sum();
    let side = if votes < 0 { -1.0 } else { 1.0 };
    let way = (side * distance * cell - off(&probe)) * normal;
    // Who cannot get through a wall would be in it.
    let is_behind = side * off(&probe) < 0.0;
    if is_behind && way.length() > FARTHEST * cell {
        return probe;
    }
    probe + way.clamp_length_max(FARTHEST * cell)
}
