//! How surfaces look probes up.

use glam::{DVec3, DVec4, IVec3, UVec3};

use super::{Irradiance, Map};
use crate::gi::probes::lattice::Lattice;
use crate::gi::probes::lookup::{Lookup, Visibility};

/// A probe.
pub struct Probe {
    /// Where it stands (m).
    pub place: DVec3,
    /// Its light.
    pub irradiance: Irradiance,
    /// xyz: how its luminance changes with the place (W/m² a cell), where that is kept.
    pub gradients: Option<Map>,
    /// xy: mean and mean square of the distance that it sees (cells).
    pub moments: Map,
}

/// All probes, and what tells whether a place sees another.
pub struct Probes<'p> {
    /// Where they stood before they were moved.
    pub lattice: &'p Lattice,
    /// Each that is there.
    pub probe: &'p dyn Fn(u32) -> Probe,
    /// Whether it is.
    pub is_there: &'p dyn Fn(u32) -> bool,
    /// Whether nothing is between two places (m).
    pub sees: &'p dyn Fn(DVec3, DVec3) -> bool,
}

/// A place on a surface.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// m.
    pub position: DVec3,
    /// Of its plane, of unit length.
    pub geometric_normal: DVec3,
    /// The one that it is shaded with.
    pub shading_normal: DVec3,
}

/// The least sum of weights of the eight probes around a place with which no further ones are
/// asked.
const LEAST_SEEN: f64 = 1e-3;

/// Chebyshev's bound of the share that sees as far as `distance`, cubed.
fn chebyshev(moments: DVec4, distance: f64) -> f64 {
    if distance <= moments.x {
        return 1.0;
    }
    let variance = (moments.y - moments.x * moments.x).abs();
    (variance / (variance + (distance - moments.x).powi(2))).powi(3)
}

impl Probes<'_> {
    fn cell(&self) -> f64 {
        f64::from(self.lattice.cell())
    }

    fn moved(&self, place: &Place, lookup: &Lookup) -> DVec3 {
        place.position + f64::from(lookup.normal_bias) * self.cell() * place.geometric_normal
    }

    /// What the side that a probe is on makes of it, and the share of it that a place sees.
    fn sight(&self, probe: &Probe, place: &Place, lookup: &Lookup) -> [f64; 2] {
        if lookup.visibility == Visibility::None {
            return [1.0, 1.0];
        }
        let way = probe.place - place.position;
        let facing = place.geometric_normal.dot(way.normalize_or_zero()) * 0.5 + 0.5;
        let moved = self.moved(place, lookup);
        let share = match lookup.visibility {
            Visibility::None | Visibility::Facing => 1.0,
            Visibility::Moments => {
                let seen = moved - probe.place;
                let moments = probe.moments.at(seen.normalize_or(DVec3::Z));
                chebyshev(moments, seen.length() / self.cell())
            }
            Visibility::Rays => f64::from(u8::from((self.sees)(moved, probe.place))),
        };
        [facing * facing + 0.2, share]
    }

    /// Irradiance of a probe, with its gradient, and ambient visibility.
    fn light(&self, probe: &Probe, place: &Place) -> DVec4 {
        let light = probe.irradiance.at(place.shading_normal);
        let Some(gradients) = &probe.gradients else {
            return light;
        };
        let gradient = gradients.at(place.shading_normal).truncate();
        let change = gradient.dot(place.position - probe.place) / self.cell();
        let own = light.truncate().dot(DVec3::new(0.2126, 0.7152, 0.0722));
        let factor = (1.0 + change / own.max(1e-30)).clamp(0.0, 3.0);
        (light.truncate() * factor).extend(light.w)
    }
}

fn crushed(weight: f64, lookup: &Lookup) -> f64 {
    let crush = f64::from(lookup.crush);
    if weight < crush {
        weight.powi(3) / (crush * crush)
    } else {
        weight
    }
}

/// One of the eight probes around a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked {
    /// Which.
    pub probe: u32,
    /// Its trilinear weight; 0 where it is not there.
    pub share: f64,
    /// What the side that it is on makes of it, 0.2 to 1.2.
    pub facing: f64,
    /// The share of it that the place sees.
    pub sight: f64,
    /// What it counts, before all eight are made to sum to 1.
    pub weight: f64,
}

impl Probes<'_> {
    /// The first of the eight probes around a place, along each axis.
    fn first_around(&self, place: &Place, lookup: &Lookup) -> (UVec3, DVec3) {
        let last = (self.lattice.counts - 1).as_dvec3();
        let off = self.moved(place, lookup) - self.lattice.first.as_dvec3();
        let at = (off / self.lattice.spacing.as_dvec3()).clamp(DVec3::ZERO, last);
        let low = at.floor().min(last - 1.0);
        (low.as_uvec3(), at - low)
    }

    /// The eight probes around a place.
    pub fn around(&self, place: &Place, lookup: &Lookup) -> [Asked; 8] {
        let (low, between) = self.first_around(place, lookup);
        std::array::from_fn(|corner| {
            let corner = corner as u32;
            let step = UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
            let along = step.as_dvec3();
            let share = along * between + (1.0 - along) * (1.0 - between);
            let share = share.max(DVec3::splat(1e-3)).element_product();
            let probe = self.lattice.index(low + step);
            if !(self.is_there)(probe) {
                return Asked {
                    probe,
                    share: 0.0,
                    facing: 0.0,
                    sight: 0.0,
                    weight: 0.0,
                };
            }
            let [facing, sight] = self.sight(&(self.probe)(probe), place, lookup);
            let floored = sight.max(f64::from(lookup.weight_floor));
            Asked {
                probe,
                share,
                facing,
                sight,
                weight: share * crushed(facing * floored, lookup),
            }
        })
    }
}

/// Sums over the eight probes around a surface.
struct CageLight {
    /// Irradiance (W/m²), and in w the ambient visibility.
    light: DVec4,
    /// Weights without their floor.
    seen: f64,
    /// Trilinear weights of those that are there.
    present: f64,
}

fn light_of_cage(probes: &Probes<'_>, place: &Place, lookup: &Lookup) -> CageLight {
    let (mut sum, mut weights, mut seen, mut present) = (DVec4::ZERO, 0.0, 0.0, 0.0);
    for asked in probes.around(place, lookup) {
        if asked.share == 0.0 {
            continue;
        }
        sum += asked.weight * probes.light(&(probes.probe)(asked.probe), place);
        weights += asked.weight;
        seen += asked.share * crushed(asked.facing * asked.sight, lookup);
        present += asked.share;
    }
    CageLight {
        light: sum / weights.max(1e-30),
        seen,
        present,
    }
}

/// Whether a surface sees none of the eight probes around it.
pub fn is_orphan(probes: &Probes<'_>, place: &Place, lookup: &Lookup) -> bool {
    light_of_cage(probes, place, lookup).seen < LEAST_SEEN
}

/// Irradiance (W/m²), and in w the ambient visibility, of the eight probes around a surface, and
/// of further ones where all eight are hidden.
pub fn light_of_probes(probes: &Probes<'_>, place: &Place, lookup: &Lookup) -> DVec4 {
    let CageLight { light, seen, .. } = light_of_cage(probes, place, lookup);
    if lookup.visibility != Visibility::Moments || seen >= LEAST_SEEN {
        return light;
    }
    let first = probes.first_around(place, lookup).0.as_ivec3();
    let further = (1..=lookup.rings as i32)
        .find_map(|ring| light_of_shell(probes, (first, ring), place, lookup));
    further.map_or(light, |further| further.lerp(light, seen / LEAST_SEEN))
}

/// The same by nested lattices, finest first, each with a bit for each side beyond which there are
/// more probes (−x, +x, −y, …): equation (1) of `docs/gi/probe_cascades.md`.
pub fn light_of_levels(levels: &[(Probes<'_>, u32)], place: &Place, lookup: &Lookup) -> DVec4 {
    let (mut sum, mut left) = (DVec4::ZERO, 1.0);
    for (index, (probes, open)) in levels.iter().enumerate() {
        if index + 1 == levels.len() {
            sum += left * light_of_probes(probes, place, lookup);
            break;
        }
        let off = probes.moved(place, lookup) - probes.lattice.first.as_dvec3();
        let low = off / probes.lattice.spacing.as_dvec3();
        let high = (probes.lattice.counts - 1).as_dvec3() - low;
        let sides = (0..6).filter(|side| open >> side & 1 == 1);
        let inside = sides.map(|side: usize| [low, high][side % 2][side / 2]);
        let inside = inside.fold(1.0, f64::min).max(0.0);
        if inside == 0.0 {
            continue;
        }
        let of_cage = light_of_cage(probes, place, lookup);
        let share = inside * of_cage.present * (of_cage.seen / LEAST_SEEN).min(1.0);
        sum += left * share * of_cage.light;
        left *= 1.0 - share;
    }
    sum
}

/// The mean of the probes of a shell around eight that a place sees; `None` where it sees none.
fn light_of_shell(
    probes: &Probes<'_>,
    (low, ring): (IVec3, i32),
    place: &Place,
    lookup: &Lookup,
) -> Option<DVec4> {
    let (mut sum, mut weights) = (DVec4::ZERO, 0.0);
    let counts = probes.lattice.counts.as_ivec3();
    let edge = 2 + 2 * ring;
    for index in 0..edge.pow(3) {
        let step = IVec3::new(index % edge, index / edge % edge, index / (edge * edge));
        let is_shell = step.min_element() == 0 || step.max_element() == edge - 1;
        let at = low + step - ring;
        if !is_shell || at.min_element() < 0 || at.cmpge(counts).any() {
            continue;
        }
        let index = probes.lattice.index(at.as_uvec3());
        if !(probes.is_there)(index) {
            continue;
        }
        let probe = (probes.probe)(index);
        let [facing, sight] = probes.sight(&probe, place, lookup);
        let far = (probe.place - place.position).length_squared() / probes.cell().powi(2);
        let weight = crushed(facing * sight, lookup) / far.max(1e-2);
        sum += weight * probes.light(&probe, place);
        weights += weight;
    }
    (weights >= LEAST_SEEN).then(|| sum / weights)
}
