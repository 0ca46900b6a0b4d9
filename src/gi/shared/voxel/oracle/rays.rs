//! Rays through the voxels.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::fragments::{ONE_PLANE, front_of};
use super::{VoxelIndex, corner_of};

/// What a ray needs to know of an occupied voxel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TraceVoxel {
    /// Centroid of the surface from the voxel's smallest corner \[voxels\].
    pub mean_position: DVec3,
    /// Mean normal, not of unit length; of opposed surfaces in parallel planes, their unit normal.
    pub mean_normal: DVec3,
    /// Axis along which its surface is opposed.
    pub opposed_axis: Option<usize>,
    /// Whether surfaces that are not opposed meet like the walls of a room.
    pub is_concave: bool,
    /// Areas seen from one side along each axis [voxel faces].
    pub across: DVec3,
    /// Radiance of the front and of the back [W/(m² sr)].
    pub radiance: [DVec3; 2],
}

impl TraceVoxel {
    /// The direction that parts the two sides of the surface.
    pub fn front(&self) -> DVec3 {
        front_of(self.mean_normal, self.opposed_axis)
    }

    /// Share of the rays along a direction that a voxel of several planes stops: the area that it
    /// shows them over that of its outline.
    pub fn stopped_share(&self, direction: DVec3) -> f64 {
        let outline = direction.abs();
        self.across.dot(outline) / outline.element_sum()
    }

    fn is_one_plane(&self) -> bool {
        self.mean_normal.length_squared() >= ONE_PLANE
    }
}

/// The occupied voxels that rays can hit.
#[derive(Clone, Debug, Default)]
pub struct TraceGrid {
    /// Voxels along an edge of the grid.
    pub resolution: u32,
    /// The occupied voxels.
    pub voxels: BTreeMap<VoxelIndex, TraceVoxel>,
}

/// A surface point that looks at the voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Grid position \[voxels\].
    pub position: DVec3,
    /// Unit normal of the surface, towards the viewer.
    pub geometric_normal: DVec3,
    /// Unit normal about which directions are distributed.
    pub shading_normal: DVec3,
}

/// What counts as a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceSettings {
    /// A voxel whose mean position lies lower than this over the receiver's tangent plane is the
    /// receiver itself \[voxels\].
    pub self_height: f64,
    /// A ray must meet the voxel's own plane ahead, within the voxel enlarged by this \[voxels\];
    /// negative: every voxel that it passes through is hit.
    pub contour_slack: f64,
    /// What tells the receiver from others ([`seed_of`]).
    pub seed: u32,
    /// Number of the ray among those of the receiver.
    pub ray: u32,
}

/// PCG hash (Jarzynski & Olano 2020).
fn scrambled(number: u32) -> u32 {
    let state = number.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// What tells a receiver from others: the pixel or voxel that it is, and the frame or side.
pub fn seed_of([x, y, z]: [u32; 3], number: u32) -> u32 {
    scrambled((x | y << 11 | z << 22) ^ scrambled(number))
}

/// A number of [0, 1) for a ray at a voxel. Those of a receiver's rays are golden ratios apart.
fn chance(voxel: VoxelIndex, settings: &TraceSettings) -> f64 {
    let turn = settings.ray.wrapping_mul(0x9e37_79b9);
    f64::from(seed_of(voxel, settings.seed).wrapping_add(turn) >> 8) / f64::from(1 << 24)
}

/// A ray's way through one occupied voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The occupied voxel that the ray passes through.
    pub voxel: VoxelIndex,
    /// Distance at which the ray enters it, 0 where it starts inside \[voxels\].
    pub entry: f64,
    /// Distance at which the ray leaves it \[voxels\]: where exit − entry is within rounding, the
    /// ray only grazes the voxel.
    pub exit: f64,
    /// How far the ray is from the other decision \[voxels, or shares of rays\]: not negative is a
    /// hit, negative a miss.
    pub margin: f64,
}

/// The end of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TraceEnd {
    /// The first voxel hit.
    Hit(Crossing),
    /// Nothing: the ray leaves the grid at this distance \[voxels\], 0 where it starts outside.
    Miss(f64),
}

/// Every occupied voxel whose inside a ray from inside the grid passes through, by distance of
/// entry.
pub fn crossings(
    grid: &TraceGrid,
    origin: DVec3,
    direction: DVec3,
    receiver: &Receiver,
    settings: &TraceSettings,
) -> Vec<Crossing> {
    let crossing = |(&voxel, surface): (&VoxelIndex, &TraceVoxel)| {
        let (entry, exit) = box_interval(origin, direction, corner_of(voxel), 1.0)?;
        (exit > entry).then(|| Crossing {
            voxel,
            entry,
            exit,
            margin: hit_margin(voxel, surface, origin, direction, receiver, settings),
        })
    };
    let starts_inside = origin.cmpge(DVec3::ZERO).all()
        && origin.cmplt(DVec3::splat(f64::from(grid.resolution))).all();
    let mut found: Vec<Crossing> = grid
        .voxels
        .iter()
        .filter(|_| starts_inside)
        .filter_map(crossing)
        .collect();
    found.sort_by(|a, b| a.entry.total_cmp(&b.entry));
    found
}

/// The first hit of a ray.
pub fn trace(
    grid: &TraceGrid,
    origin: DVec3,
    direction: DVec3,
    receiver: &Receiver,
    settings: &TraceSettings,
) -> TraceEnd {
    let leaves = || {
        box_interval(origin, direction, DVec3::ZERO, f64::from(grid.resolution))
            .map_or(0.0, |(entry, exit)| if entry > 0.0 { 0.0 } else { exit })
    };
    let first = crossings(grid, origin, direction, receiver, settings)
        .into_iter()
        .find(|crossing| crossing.margin >= 0.0);
    first.map_or_else(|| TraceEnd::Miss(leaves()), TraceEnd::Hit)
}

/// Share of a light that voxels hide. The light is at a distance `reach` \[voxels\] in the given
/// direction. Any hit voxel hides all of it. With κ = `kappa` \[voxels\], each voxel hit at a
/// distance t makes the hidden share ν ← ν + (1 − ν) κ/t (Villegas & Ramírez, section VI-C).
pub fn occlusion(
    grid: &TraceGrid,
    receiver: &Receiver,
    start_offset: f64,
    direction: DVec3,
    reach: f64,
    settings: &TraceSettings,
    kappa: Option<f64>,
) -> f64 {
    let origin = receiver.position + start_offset * receiver.geometric_normal;
    let all = crossings(grid, origin, direction, receiver, settings);
    let hits = all
        .iter()
        .filter(|crossing| crossing.margin >= 0.0 && crossing.entry < reach);
    let hides = |crossing: &Crossing| {
        kappa.map_or(1.0, |kappa| (kappa / crossing.entry.max(1e-6)).min(1.0))
    };
    hits.fold(0.0, |hidden, crossing| {
        hidden + (1.0 - hidden) * hides(crossing)
    })
}

/// Distances, not negative, between which a ray is inside a closed cube.
fn box_interval(origin: DVec3, direction: DVec3, corner: DVec3, edge: f64) -> Option<(f64, f64)> {
    let (mut entry, mut exit) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        let (low, high) = (
            corner[axis] - origin[axis],
            corner[axis] + edge - origin[axis],
        );
        if direction[axis] == 0.0 {
            if low > 0.0 || high < 0.0 {
                return None;
            }
            continue;
        }
        let (first, second) = (low / direction[axis], high / direction[axis]);
        entry = entry.max(first.min(second));
        exit = exit.min(first.max(second));
    }
    (entry <= exit).then_some((entry, exit))
}

/// Below this cosine a ray runs along the voxel's plane, and the whole voxel is hit.
const ALONG_PLANE: f64 = 1e-3;

/// Area within the unit cube of the plane through a point of it [voxel faces].
fn area_of_plane(normal: DVec3, point: DVec3) -> f64 {
    let n = normal.abs().max(DVec3::splat(0.01));
    let d = n.dot(DVec3::select(normal.cmplt(DVec3::ZERO), 1.0 - point, point));
    // The volume behind the plane is a pyramid less those beyond the cube; this is its slope.
    let corner = |of: [f64; 3]| (d - n.dot(DVec3::from(of))).max(0.0).powi(2);
    let [one, two] = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[0.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 0.0]],
    ]
    .map(|corners| corners.map(corner).iter().sum::<f64>());
    (d * d - one + two - corner([1.0; 3])) * n.length() / (2.0 * n.x * n.y * n.z)
}

/// From this share of its plane on, a surface is whole.
const NEARLY_WHOLE: f64 = 0.9;

/// A plane of less area than this in a voxel \[faces\] is whole.
const CORNER: f64 = 0.05;

/// Margin of a plane's holes: how far `chance` is from the other side of the share of it that is
/// surface, or that share from where the plane is whole.
fn hole_margin(surface: &TraceVoxel, chance: f64) -> f64 {
    let whole = area_of_plane(surface.mean_normal, surface.mean_position);
    let share = surface.across.length() / whole.max(CORNER);
    let is_whole = (CORNER - whole).max(share - NEARLY_WHOLE);
    (share - chance).max(is_whole)
}

/// Margin of the rules: the surface is not the receiver itself, and is not a corner that the ray
/// leaves from within the layers of its planes. Surfaces of several planes stop all rays where they
/// are concave, and otherwise a share. One plane is met ahead, within the enlarged voxel, where it
/// has no hole.
fn hit_margin(
    voxel: VoxelIndex,
    surface: &TraceVoxel,
    origin: DVec3,
    direction: DVec3,
    receiver: &Receiver,
    settings: &TraceSettings,
) -> f64 {
    let position = corner_of(voxel) + surface.mean_position;
    let mut margin =
        (position - receiver.position).dot(receiver.geometric_normal) - settings.self_height;
    if settings.contour_slack < 0.0 {
        return margin;
    }
    let (normal, chance) = (surface.mean_normal, chance(voxel, settings));
    if !surface.is_one_plane() {
        if surface.opposed_axis.is_none() && sees_back(surface, direction) {
            let off = (origin - corner_of(voxel) - 0.5).abs();
            let outside = DVec3::select(normal.abs().cmpgt(DVec3::splat(0.1)), off, DVec3::ZERO)
                .max_element()
                - 0.5;
            margin = margin.min(outside - settings.contour_slack);
        }
        return if surface.is_concave {
            margin
        } else {
            margin.min(surface.stopped_share(direction) - chance)
        };
    }
    let cosine = normal.dot(direction);
    if cosine.abs() < ALONG_PLANE {
        return margin;
    }
    let along = normal.dot(position - origin) / cosine;
    let met = origin + direction * along - corner_of(voxel);
    let inside = met.min(1.0 - met).min_element() + settings.contour_slack;
    // A ray that starts on the plane is in front of it.
    let ahead = along - settings.contour_slack * cosine.signum();
    margin
        .min(inside)
        .min(ahead)
        .min(hole_margin(surface, chance))
}

/// Whether a ray sees the back of a voxel that it hits. A corner has several planes that are not
/// opposed: there the ray sees the front if it meets the front of any of them.
pub(super) fn sees_back(voxel: &TraceVoxel, direction: DVec3) -> bool {
    if voxel.opposed_axis.is_some() || voxel.is_one_plane() {
        direction.dot(voxel.front()) > 0.0
    } else {
        (direction * voxel.mean_normal).min_element() > -0.05
    }
}

/// Settings of a gather by rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GatherSettings {
    /// Number of rays.
    pub ray_count: u32,
    /// Distance of the rays' origin from the surface along the geometric normal \[voxels\].
    pub start_offset: f64,
    /// What counts as a hit.
    pub trace: TraceSettings,
    /// λ of the ambient visibility's 1 / (1 + λ r), for distances in voxels [1/voxel].
    pub ao_falloff: f64,
    /// Two numbers of [0, 1) that shift sin²θ by a part of a stratum and the azimuth by a part of
    /// a turn ([`interleaved_offset`](crate::gi::shared::interleave::oracle::interleaved_offset)).
    pub pattern: DVec2,
    /// Constant radiance of the environment [W/(m² sr)].
    pub environment: DVec3,
}

/// What reaches a surface point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gathered {
    /// Indirect diffuse irradiance E [W/m²].
    pub irradiance: DVec3,
    /// 1 − occlusion, an occluder at distance r counting 1 / (1 + λ r).
    pub visibility: f64,
}

/// E = π / n Σ L_i over n cosine-distributed directions: sin²θ is stratified and azimuths are
/// golden angles apart (Vogel 1979). A direction below the geometric surface sees nothing.
pub fn gather_rays(grid: &TraceGrid, receiver: &Receiver, settings: &GatherSettings) -> Gathered {
    gather(receiver, settings, |origin, direction, ray| {
        let trace_settings = TraceSettings {
            ray,
            ..settings.trace
        };
        match trace(grid, origin, direction, receiver, &trace_settings) {
            TraceEnd::Miss(_) => None,
            TraceEnd::Hit(hit) => {
                let voxel = &grid.voxels[&hit.voxel];
                let radiance = voxel.radiance[usize::from(sees_back(voxel, direction))];
                Some((radiance, hit.entry))
            }
        }
    })
}

/// As [`gather_rays`], of rays against triangles, corners in voxels: the nearest hit has the
/// radiance of the voxel that it lies in, on the side that the ray comes from.
pub fn gather_triangles(
    grid: &TraceGrid,
    triangles: &[[DVec3; 3]],
    receiver: &Receiver,
    settings: &GatherSettings,
) -> Gathered {
    gather(receiver, settings, |origin, direction, _| {
        let met = triangles.iter().filter_map(|triangle| {
            let distance = meets(triangle, origin, direction)?;
            Some((distance, triangle))
        });
        let (distance, [a, b, c]) = met.min_by(|one, other| one.0.total_cmp(&other.0))?;
        let normal = (*b - *a).cross(*c - *a).normalize();
        let facing = normal * -normal.dot(direction).signum();
        let place = origin + distance * direction;
        let radiance = radiance_at(grid, place, facing);
        Some((radiance.unwrap_or(DVec3::ZERO), distance))
    })
}

/// Distance at which a ray meets a triangle, from either side: the signed volumes of its edges with
/// the ray have one sign.
pub(super) fn meets([a, b, c]: &[DVec3; 3], origin: DVec3, direction: DVec3) -> Option<f64> {
    let volumes = [(a, b), (b, c), (c, a)]
        .map(|(from, to)| direction.dot((*from - origin).cross(*to - origin)));
    let sum: f64 = volumes.iter().sum();
    let is_inside = volumes.iter().all(|volume| volume * sum >= 0.0) && sum != 0.0;
    let at = (volumes[1] * *a + volumes[2] * *b + volumes[0] * *c) / sum;
    let distance = direction.dot(at - origin);
    (is_inside && distance > 0.0).then_some(distance)
}

/// Radiance of a surface at a place [voxels], whose normal faces the viewer: of the voxel there, or
/// of the first that is found along the normal; none in empty space.
fn radiance_at(grid: &TraceGrid, place: DVec3, facing: DVec3) -> Option<DVec3> {
    let found = [0.0, -0.05, 0.05, -0.5, 0.5].into_iter().find_map(|step| {
        let cell = (place + step * facing).floor();
        let is_inside = cell.min_element() >= 0.0 && cell.max_element() < grid.resolution.into();
        let index = cell.to_array().map(|at| at as u32);
        is_inside.then(|| grid.voxels.get(&index)).flatten()
    })?;
    Some(found.radiance[usize::from(facing.dot(found.front()) < 0.0)])
}

/// What directions, numbered from 0, see, each by its radiance and its distance [voxels], or
/// nothing.
fn gather(
    receiver: &Receiver,
    settings: &GatherSettings,
    seen: impl Fn(DVec3, DVec3, u32) -> Option<(DVec3, f64)>,
) -> Gathered {
    let golden_angle = PI * (3.0 - 5f64.sqrt());
    let count = f64::from(settings.ray_count);
    let origin = receiver.position + settings.start_offset * receiver.geometric_normal;
    let (mut radiance, mut occlusion) = (DVec3::ZERO, 0.0);
    for number in 0..settings.ray_count {
        let ray = f64::from(number);
        let direction = hemisphere_direction(
            receiver.shading_normal,
            (ray + settings.pattern.x) / count,
            ray * golden_angle + settings.pattern.y * 2.0 * PI,
        );
        if direction.dot(receiver.geometric_normal) <= 0.0 {
            continue;
        }
        match seen(origin, direction, number) {
            None => radiance += settings.environment,
            Some((seen, distance)) => {
                radiance += seen;
                occlusion += 1.0 / (1.0 + settings.ao_falloff * distance);
            }
        }
    }
    Gathered {
        irradiance: PI / count * radiance,
        visibility: 1.0 - occlusion / count,
    }
}

/// Direction at sin²θ and azimuth φ \[rad\] about a unit normal, in the tangent frame of Duff et
/// al. 2017 ("Building an orthonormal basis, revisited").
pub fn hemisphere_direction(normal: DVec3, sin_squared: f64, azimuth_rad: f64) -> DVec3 {
    let sign = if normal.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    let tangent = DVec3::new(
        1.0 + sign * normal.x * normal.x * a,
        sign * b,
        -sign * normal.x,
    );
    let bitangent = DVec3::new(b, sign + normal.y * normal.y * a, -normal.y);
    let sine = sin_squared.clamp(0.0, 1.0).sqrt();
    sine * azimuth_rad.cos() * tangent
        + sine * azimuth_rad.sin() * bitangent
        + (1.0 - sin_squared).max(0.0).sqrt() * normal
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the volume behind the plane, which points count.
    #[test]
    fn planes_have_the_area_of_their_part_in_the_cube() {
        let n = 128;
        let behind = |normal: DVec3, offset: f64| {
            let inside = |index: u32| {
                let at = [index % n, index / n % n, index / (n * n)].map(f64::from);
                (DVec3::from(at) + 0.5).dot(normal) / f64::from(n) < offset
            };
            f64::from((0..n.pow(3)).filter(|index| inside(*index)).count() as u32)
                / f64::from(n.pow(3))
        };
        for (normal, offset) in [
            (DVec3::new(1.0, 2.0, 3.0), 0.8),
            (DVec3::new(-1.0, 2.0, 0.5), 0.3),
            (DVec3::new(1.0, 1.0, 1.0), 0.3),
            (DVec3::new(-0.3, -0.2, -0.9), -0.7),
        ] {
            let (length, step) = (normal.length(), 0.04);
            let (normal, offset) = (normal / length, offset / length);
            let slope =
                (behind(normal, offset + step) - behind(normal, offset - step)) / (2.0 * step);
            let area = area_of_plane(normal, offset * normal);
            assert!(
                (area - slope).abs() < 0.05 * slope,
                "{normal}: {area}, {slope}"
            );
        }
    }
}
