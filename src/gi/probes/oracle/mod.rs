//! The twin on the CPU, in f64: directions, maps, and how surfaces look them up.

mod field;
mod lookup;

pub use field::{FieldMap, Met, Seen, Texel};
pub use lookup::{Asked, Place, Probe, Probes, is_orphan, light_of_levels, light_of_probes};

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec2, DVec3, DVec4, IVec2, UVec3};

use crate::gi::shared::sh;

/// Octahedral place of a direction in [−1, 1]² (Meyer et al. 2010).
pub fn octahedral(direction: DVec3) -> DVec2 {
    let p = direction.truncate() / direction.abs().element_sum();
    let sign = |value: f64| if value >= 0.0 { 1.0 } else { -1.0 };
    if direction.z >= 0.0 {
        p
    } else {
        DVec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
    }
}

/// Unit direction of an octahedral place.
pub fn direction(p: DVec2) -> DVec3 {
    let z = 1.0 - p.abs().element_sum();
    let fold = (-z).max(0.0);
    let folded = |value: f64| value + if value >= 0.0 { -fold } else { fold };
    DVec3::new(folded(p.x), folded(p.y), z).normalize()
}

/// Direction of a place in a map of `edge`² texels, in texels from its first corner.
pub fn direction_of(place: DVec2, edge: u32) -> DVec3 {
    direction(place * 2.0 / f64::from(edge) - 1.0)
}

/// Ray `ray` of `count`, before it is turned: a point of a Fibonacci set.
pub fn fibonacci(ray: u32, count: u32) -> DVec3 {
    let z = 1.0 - (2.0 * f64::from(ray) + 1.0) / f64::from(count);
    let phi = TAU / 2f64.powi(32) * f64::from(ray.wrapping_mul(1_640_531_527));
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * phi.cos(), r * phi.sin(), z)
}

/// Directions of the rays of a probe before they are turned: a Fibonacci set along a curve through
/// its octahedral map (Morton 1966), so that rays whose numbers are near go the same way.
pub fn ray_set(count: u32) -> Vec<DVec3> {
    let mut set: Vec<DVec3> = (0..count).map(|ray| fibonacci(ray, count)).collect();
    set.sort_by_cached_key(|direction| {
        let place = (octahedral(*direction) + 1.0) * 32_767.5;
        spread_bits(place.x as u32) | spread_bits(place.y as u32) << 1
    });
    set
}

/// A number of 16 bits with a 0 before each of them.
fn spread_bits(number: u32) -> u32 {
    [
        (8, 0x00ff_00ff),
        (4, 0x0f0f_0f0f),
        (2, 0x3333_3333),
        (1, 0x5555_5555),
    ]
    .into_iter()
    .fold(number, |bits, (shift, mask)| (bits | bits << shift) & mask)
}

/// Three random integers (Jarzynski & Olano 2020).
fn pcg3(mut v: UVec3) -> UVec3 {
    let mix = |v: UVec3| {
        let x = v.x.wrapping_add(v.y.wrapping_mul(v.z));
        let y = v.y.wrapping_add(v.z.wrapping_mul(x));
        UVec3::new(x, y, v.z.wrapping_add(x.wrapping_mul(y)))
    };
    v = UVec3::from(
        v.to_array()
            .map(|v| v.wrapping_mul(1_664_525).wrapping_add(1_013_904_223)),
    );
    v = mix(v);
    mix(v ^ (v >> 16))
}

/// The turn of a probe's rays (Shoemake 1992).
pub fn turn_of(probe: u32) -> DMat3 {
    let random = pcg3(UVec3::new(probe, 0x9e37_79b9, 0x85eb_ca6b));
    let [x, y, z] = random
        .to_array()
        .map(|v| f64::from(v >> 8) / f64::from(1 << 24));
    let (a, b) = ((1.0 - x).sqrt(), x.sqrt());
    let turn = glam::DQuat::from_xyzw(
        a * (TAU * y).sin(),
        a * (TAU * y).cos(),
        b * (TAU * z).sin(),
        b * (TAU * z).cos(),
    );
    DMat3::from_quat(turn)
}

/// A function of the direction: texels of an octahedral map, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Along an edge.
    pub edge: u32,
    /// `edge`² of them.
    pub texels: Vec<DVec4>,
}

impl Map {
    /// From the value of each texel, by its place.
    pub fn of(edge: u32, value: impl Fn(UVec3) -> DVec4) -> Self {
        let places = (0..edge * edge).map(|texel| UVec3::new(texel % edge, texel / edge, 0));
        let texels = places.map(value).collect();
        Map { edge, texels }
    }

    /// A texel, or one of the border beyond the edge.
    pub fn texel(&self, at: IVec2) -> DVec4 {
        let last = self.edge as i32 - 1;
        let inside = |value: i32| (0..=last).contains(&value);
        let at = match (inside(at.x), inside(at.y)) {
            (true, true) => at,
            (false, true) => IVec2::new(at.x.clamp(0, last), last - at.y),
            (true, false) => IVec2::new(last - at.x, at.y.clamp(0, last)),
            (false, false) => IVec2::new(last - at.x.clamp(0, last), last - at.y.clamp(0, last)),
        };
        self.texels[(at.x + at.y * (last + 1)) as usize]
    }

    /// What it shows in a direction, interpolated between four texels.
    pub fn at(&self, direction: DVec3) -> DVec4 {
        let place = (octahedral(direction) * 0.5 + 0.5) * f64::from(self.edge) - 0.5;
        let (low, part) = (place.floor(), place - place.floor());
        let corner = |x: i32, y: i32| {
            let share = DVec2::new(
                if x == 0 { 1.0 - part.x } else { part.x },
                if y == 0 { 1.0 - part.y } else { part.y },
            );
            self.texel(low.as_ivec2() + IVec2::new(x, y)) * share.element_product()
        };
        corner(0, 0) + corner(1, 0) + corner(0, 1) + corner(1, 1)
    }
}

/// Irradiance by direction, and the share of it that meets nothing, of rays with their radiance
/// and, in w, whether they meet nothing: E(n) = π Σ L max(0, n·ω) / Σ max(0, n·ω).
pub fn blend(rays: &[(DVec3, DVec4)], edge: u32) -> Map {
    Map::of(edge, |at| {
        let normal = direction_of(at.truncate().as_dvec2() + 0.5, edge);
        let (mut sum, mut weights) = (DVec4::ZERO, 0.0);
        for (direction, light) in rays {
            let cosine = normal.dot(*direction).max(0.0);
            sum += cosine * *light;
            weights += cosine;
        }
        let mean = sum / weights.max(1e-30);
        (mean.truncate() * PI).extend(mean.w)
    })
}

/// Radiance, and the share of directions that meets nothing, as spherical harmonics of three bands:
/// 4π/n Σ (L − L̄) Y(ω) of rays as [`blend`] has them, and their mean L̄ itself.
pub fn blend_harmonics(rays: &[(DVec3, DVec4)]) -> [DVec4; 9] {
    let count = rays.len() as f64;
    let mean = rays.iter().map(|(_, light)| *light).sum::<DVec4>() / count;
    let mut sums = [DVec4::ZERO; 9];
    for (direction, light) in rays {
        let mut basis = [0.0; 9];
        sh::evaluate(3, *direction, &mut basis);
        for (sum, basis) in sums.iter_mut().zip(basis) {
            *sum += basis * (*light - mean);
        }
    }
    let mut coefficients = sums.map(|sum| sum * (4.0 * PI / count));
    coefficients[0] = 2.0 * PI.sqrt() * mean;
    coefficients
}

/// The light of a probe.
#[derive(Clone, Debug, PartialEq)]
pub enum Irradiance {
    /// rgb: irradiance (W/m²); a: share of it that meets nothing.
    Map(Map),
    /// The same of [`blend_harmonics`].
    Harmonics(Vec<DVec4>),
}

impl Irradiance {
    /// On a surface of this normal.
    pub fn at(&self, normal: DVec3) -> DVec4 {
        match self {
            Irradiance::Map(map) => map.at(normal),
            Irradiance::Harmonics(coefficients) => {
                let sum = sh::irradiance(coefficients, normal).max(DVec4::ZERO);
                sum.truncate().extend(sum.w / PI)
            }
        }
    }
}

/// Mean and mean square of distances (cells) by direction, of 2×2 rays through each texel; beyond
/// `reach` all are one.
pub fn moments(edge: u32, reach: f64, distance: impl Fn(DVec3) -> f64) -> Map {
    Map::of(edge, |at| {
        let within = [0.25, 0.75].map(|x| [0.25, 0.75].map(|y| DVec2::new(x, y)));
        let rays = within.as_flattened().iter();
        let seen = rays.map(|within| {
            let direction = direction_of(at.truncate().as_dvec2() + *within, edge);
            distance(direction).min(reach)
        });
        let sum: DVec2 = seen.map(|r| DVec2::new(r, r * r)).sum();
        (sum / 4.0).extend(0.0).extend(0.0)
    })
}

/// The same over all rays of a probe, with how far each goes (cells; infinitely where it meets
/// nothing), by the 50th power of the cosine (Majercik et al. 2019).
pub fn power_moments(edge: u32, reach: f64, rays: &[(DVec3, f64)]) -> Map {
    Map::of(edge, |at| {
        let axis = direction_of(at.truncate().as_dvec2() + 0.5, edge);
        let (mut sum, mut weights) = (DVec2::ZERO, 0.0);
        for (direction, distance) in rays {
            let weight = axis.dot(*direction).max(0.0).powi(50);
            let r = distance.min(reach);
            sum += weight * DVec2::new(r, r * r);
            weights += weight;
        }
        (sum / weights.max(1e-30)).extend(0.0).extend(0.0)
    })
}

/// A ray of a probe for gradients: its direction, the luminance that it brings (W/(m² sr)), and,
/// where it meets a surface, how far off (cells) and the surface's normal, either way.
pub type Source = (DVec3, f64, Option<(f64, DVec3)>);

/// How the luminance of irradiance changes with the place (W/m² a cell), by direction: equation
/// (6) of `docs/gi/probes.md`.
pub fn gradients(rays: &[Source], edge: u32) -> Map {
    Map::of(edge, |at| {
        let n = direction_of(at.truncate().as_dvec2() + 0.5, edge);
        let of_ray = |(direction, light, met): &Source| {
            let (distance, surface) = (*met)?;
            let cosine = n.dot(*direction);
            let towards = -surface.dot(*direction);
            let facing = surface * towards.signum() / towards.abs().max(0.1);
            let change = cosine * (facing + 4.0 * *direction) - n;
            (cosine > 0.0).then(|| light / distance.max(0.25) * change)
        };
        let sum: DVec3 = rays.iter().filter_map(of_ray).sum();
        (4.0 * PI / rays.len() as f64 * sum).extend(0.0)
    })
}
