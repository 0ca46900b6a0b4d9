//! The twin of rays through light fields, in f64. Crossings of texels are found one by one, as the
//! planes through the probe that they are, and sorted.

use glam::{DVec2, DVec3, IVec2};

use super::{direction_of, octahedral};

/// What a texel knows: how far off the surface is (cells), and its normal on the probe's side.
pub type Seen = Option<(f64, DVec3)>;

/// What a probe sees by direction.
#[derive(Clone, Debug)]
pub struct FieldMap {
    /// Texels along an edge.
    pub edge: u32,
    /// `edge`² of them, row by row.
    pub texels: Vec<Seen>,
    /// Their radiance (W/(m² sr)).
    pub radiance: Vec<DVec3>,
}

/// What a ray meets in a texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Texel {
    /// The plane of its surface.
    Plane,
    /// That surface, at most so thick (m), where a cell is so large (m).
    Thickness(f64, f64),
}

/// How a ray ends in the map of a probe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Met {
    /// At a surface.
    Surface = 0,
    /// It meets nothing.
    Nothing = 1,
    /// Where the probe does not see.
    Unknown = 2,
}

/// Of how many of its own edges a texel's surface may be off.
const SLACK: f64 = 0.75;
/// The least thickness (m).
const LEAST_THICKNESS: f64 = 0.03;

impl FieldMap {
    fn index(&self, texel: IVec2) -> usize {
        (texel.x + texel.y * self.edge as i32) as usize
    }

    /// The texel that a direction falls on.
    fn texel_of(&self, direction: DVec3) -> IVec2 {
        let place = (octahedral(direction) * 0.5 + 0.5) * f64::from(self.edge);
        let last = IVec2::splat(self.edge as i32 - 1);
        place.floor().as_ivec2().clamp(IVec2::ZERO, last)
    }

    fn to_texel(&self, texel: IVec2) -> DVec3 {
        direction_of(texel.as_dvec2() + 0.5, self.edge)
    }

    /// How far the surface of a texel may be off (cells).
    fn slack(&self, distance: f64) -> f64 {
        SLACK * 4.0 / f64::from(self.edge) * distance
    }

    /// Where a ray from the probe's frame (cells) leaves one texel for the next, beyond `begin`.
    fn crossings(&self, (origin, direction): (DVec3, DVec3), begin: f64) -> Vec<f64> {
        let mut crossings = Vec::new();
        let mut add = |normal: DVec3, side: Option<DVec3>| {
            let t = -normal.dot(origin) / normal.dot(direction);
            let at = side.map(|side| side * (origin + t * direction));
            let is_inside = at.is_none_or(|at| at.min_element() >= -1e-9 * at.abs().max_element());
            if t.is_finite() && t > begin && is_inside {
                crossings.push(t);
            }
        };
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            add(axis, None);
        }
        for octant in 0..8 {
            let sign = |bit: u32| if octant >> bit & 1 == 0 { 1.0 } else { -1.0 };
            let side = DVec3::new(sign(0), sign(1), sign(2));
            for border in 0..=self.edge {
                // The place in the map is a component of `mapped` by that of `side`.
                let c = 2.0 * f64::from(border) / f64::from(self.edge) - 1.0;
                let mapped = if side.z > 0.0 {
                    [DVec3::X, DVec3::Y]
                } else {
                    [
                        side.x * (side - side * DVec3::Y),
                        side.y * (side - side * DVec3::X),
                    ]
                };
                for mapped in mapped {
                    add(mapped - c * side, Some(side));
                }
            }
        }
        crossings.sort_by(f64::total_cmp);
        crossings
    }

    /// How a ray from the probe's frame (cells) ends that is free up to `begin`, and where.
    pub fn march(&self, ray: (DVec3, DVec3), begin: f64, kind: Texel) -> (Met, f64) {
        let (origin, direction) = ray;
        let mut steps: Vec<(IVec2, f64, f64)> = Vec::new();
        let mut from = begin;
        for to in self
            .crossings(ray, begin)
            .into_iter()
            .chain([f64::INFINITY])
        {
            let middle = if to.is_finite() {
                origin + 0.5 * (from + to) * direction
            } else {
                origin + (2.0 * from.abs() + 1e6) * direction
            };
            let texel = self.texel_of(middle);
            match steps.last_mut() {
                Some(last) if last.0 == texel => last.2 = to,
                _ => steps.push((texel, from, to)),
            }
            from = to;
        }
        for (index, step) in steps.into_iter().enumerate() {
            let starts = index == 0 && begin == 0.0;
            let (met, at) = match kind {
                Texel::Plane => self.plane(ray, step, starts),
                Texel::Thickness(most, cell) => self.thickness(ray, step, (most, cell)),
            };
            if met != Met::Nothing {
                return (met, at);
            }
        }
        (Met::Nothing, f64::INFINITY)
    }

    fn plane(
        &self,
        (origin, direction): (DVec3, DVec3),
        (texel, begin, end): (IVec2, f64, f64),
        starts: bool,
    ) -> (Met, f64) {
        let Some((distance, normal)) = self.texels[self.index(texel)] else {
            return (Met::Nothing, end);
        };
        let height = |t: f64| normal.dot(origin + t * direction - distance * self.to_texel(texel));
        if height(begin) < -self.slack(distance) {
            return (Met::Unknown, begin);
        }
        let towards = normal.dot(direction);
        if towards >= 0.0 || (starts && height(begin) <= 0.0) {
            return (Met::Nothing, end);
        }
        let at = (begin - height(begin) / towards).max(begin);
        if at <= end {
            (Met::Surface, at)
        } else {
            (Met::Nothing, end)
        }
    }

    fn thickness(
        &self,
        (origin, direction): (DVec3, DVec3),
        (texel, begin, end): (IVec2, f64, f64),
        (most_m, cell_m): (f64, f64),
    ) -> (Met, f64) {
        let Some((distance, normal)) = self.texels[self.index(texel)] else {
            return (Met::Nothing, end);
        };
        let [first, last] = [begin, end].map(|t| {
            if t.is_finite() {
                (origin + t * direction).length()
            } else {
                t
            }
        });
        if first.max(last) < distance {
            return (Met::Nothing, end);
        }
        let to_texel = self.to_texel(texel);
        let at = (distance * to_texel - origin).dot(direction).max(begin);
        let thickness_m = LEAST_THICKNESS
            + (most_m - LEAST_THICKNESS)
                * direction.dot(to_texel).max(0.0)
                * (2.0 - direction.dot(normal).abs())
                * (0.1 * at * cell_m).clamp(0.05, 1.0);
        let is_hit =
            first.min(last) < distance + thickness_m / cell_m && normal.dot(direction) < 0.0;
        let met = if is_hit { Met::Surface } else { Met::Unknown };
        (met, at)
    }

    /// Radiance at a place that the probe sees (cells): between four texels, as far as they show
    /// the surface there.
    pub fn radiance_at(&self, place: DVec3) -> DVec3 {
        let at = (octahedral(place) * 0.5 + 0.5) * f64::from(self.edge) - 0.5;
        let (low, part) = (at.floor(), at - at.floor());
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        let mut nearest = (-1.0, DVec3::ZERO);
        for corner in [[0, 0], [1, 0], [0, 1], [1, 1]] {
            let step = IVec2::from(corner);
            let share = DVec2::ONE - (part - step.as_dvec2()).abs();
            let weight = share.element_product();
            // Beyond an edge the direction is that of the texel that is shown there.
            let texel = self.shown_at(low.as_ivec2() + step);
            let light = self.radiance[self.index(texel)];
            if weight > nearest.0 {
                nearest = (weight, light);
            }
            let Some((distance, normal)) = self.texels[self.index(texel)] else {
                continue;
            };
            let off = normal.dot(place - distance * self.to_texel(texel));
            if off.abs() <= self.slack(distance) {
                sum += weight * light;
                weights += weight;
            }
        }
        if weights > 0.0 {
            sum / weights
        } else {
            nearest.1
        }
    }

    /// The texel that is shown at a place one beyond an edge at most.
    fn shown_at(&self, texel: IVec2) -> IVec2 {
        let size = self.edge as i32;
        let is_out = |value: i32| value < 0 || value >= size;
        let inside = texel.clamp(IVec2::ZERO, IVec2::splat(size - 1));
        let mirrored = IVec2::splat(size - 1) - inside;
        IVec2::new(
            if is_out(texel.y) {
                mirrored.x
            } else {
                inside.x
            },
            if is_out(texel.x) {
                mirrored.y
            } else {
                inside.y
            },
        )
    }
}
