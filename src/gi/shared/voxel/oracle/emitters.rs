//! Light from points of surfaces that emit, along rays through the voxels or against triangles.

use glam::{DVec2, DVec3};

use super::rays::meets;
use super::{Receiver, TraceGrid, TraceSettings, corner_of, crossings};

/// A part of the surface that emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterPart {
    /// A corner, and the ways from it to the next, counter-clockwise as seen from the side that
    /// emits \[voxels\].
    pub corner: DVec3,
    /// See `corner`.
    pub edges: [DVec3; 2],
    /// Emitted radiance [W/(m² sr)].
    pub radiance: DVec3,
    /// Share of all power that parts before it have.
    pub before: f64,
    /// Density of drawn points [1/voxel²].
    pub density: f64,
}

/// How points are drawn and seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointSettings {
    /// Number of rays.
    pub ray_count: u32,
    /// Points that are compared for each ray.
    pub candidates: u32,
    /// Distance of the rays' origin from the surface along the geometric normal \[voxels\].
    pub start_offset: f64,
    /// The least distance to a point that counts \[voxels\].
    pub least_distance: f64,
    /// What counts as a hit.
    pub trace: TraceSettings,
    /// Two numbers of [0, 1) of the receiver's own.
    pub pattern: DVec2,
}

/// What reaches a surface point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// E [W/m²].
    pub irradiance: DVec3,
    /// How far the nearest decision was from the other one: a part or a point that is drawn, a
    /// voxel that is hit (parts, numbers of [0, 1), voxels).
    pub margin: f64,
}

/// A point that a ray goes to.
struct Point {
    position: DVec3,
    normal: DVec3,
    irradiance: DVec3,
}

/// E = 1/n Σ L cos θ cos θ' V / (d² p) over points of the parts, p being their density.
pub fn gather_emitters(
    grid: &TraceGrid,
    parts: &[EmitterPart],
    receiver: &Receiver,
    settings: &PointSettings,
) -> Reached {
    reach_points(parts, receiver, settings, |point, ray, margin| {
        is_hidden(grid, point, receiver, (settings, ray), margin)
    })
}

/// As [`gather_emitters`], of rays that only triangles stop, corners in voxels.
pub fn gather_emitters_triangles(
    triangles: &[[DVec3; 3]],
    parts: &[EmitterPart],
    receiver: &Receiver,
    settings: &PointSettings,
) -> Reached {
    let origin = receiver.position + settings.start_offset * receiver.geometric_normal;
    reach_points(parts, receiver, settings, |point, _, _| {
        let way = point.position - origin;
        let direction = way.normalize();
        let reach = way.length() - settings.start_offset;
        (triangles
            .iter()
            .filter_map(|corners| meets(corners, origin, direction)))
        .any(|distance| distance < reach)
    })
}

/// What reaches a surface from points of the parts that are not hidden, by point, ray and margin.
fn reach_points(
    parts: &[EmitterPart],
    receiver: &Receiver,
    settings: &PointSettings,
    is_hidden: impl Fn(&Point, u32, &mut f64) -> bool,
) -> Reached {
    let mut reached = Reached {
        irradiance: DVec3::ZERO,
        margin: f64::INFINITY,
    };
    for ray in 0..settings.ray_count {
        let point = chosen(parts, receiver, settings, ray, &mut reached.margin);
        if let Some(point) = point.filter(|point| point.irradiance != DVec3::ZERO)
            && !is_hidden(&point, ray, &mut reached.margin)
        {
            reached.irradiance += point.irradiance / f64::from(settings.ray_count);
        }
    }
    reached
}

/// One of the candidates of a ray, drawn by what each sends where nothing hides it (Talbot et al.
/// 2005): as the last of them that took the place of those before it.
fn chosen(
    parts: &[EmitterPart],
    receiver: &Receiver,
    settings: &PointSettings,
    ray: u32,
    margin: &mut f64,
) -> Option<Point> {
    let (ray, pattern) = (f64::from(ray), settings.pattern);
    let turned = |number: f64, step: f64| (number + step).fract();
    let u = turned(
        (ray + pattern.x) / f64::from(settings.ray_count),
        0.618_033_988_749_894_9,
    );
    let at = DVec2::new(
        turned(pattern.x, ray * 0.819_172_513_396_164_5),
        turned(pattern.y, ray * 0.671_043_606_703_789_3),
    );
    let mut choice = turned(pattern.y, ray * 0.618_033_988_749_894_9);
    let (mut sum, mut best): (f64, Option<(Point, f64)>) = (0.0, None);
    for candidate in (0..settings.candidates).map(f64::from) {
        let within = DVec2::new(
            turned(at.x, candidate * 0.754_877_666_246_692_7),
            turned(at.y, candidate * 0.569_840_290_998_053_2),
        );
        let number = turned(u, candidate / f64::from(settings.candidates));
        let point = drawn(parts, number, within, receiver, settings, margin);
        let weight = point.irradiance.dot(DVec3::new(0.2126, 0.7152, 0.0722));
        if weight <= 0.0 {
            continue;
        }
        sum += weight;
        let share = weight / sum;
        if share < 1.0 {
            *margin = margin.min((choice - share).abs());
        }
        if choice < share {
            best = Some((point, weight));
            choice /= share;
        } else {
            choice = (choice - share) / (1.0 - share);
        }
    }
    best.map(|(point, weight)| Point {
        irradiance: point.irradiance * sum / (weight * f64::from(settings.candidates)),
        ..point
    })
}

/// The point that a number and a place within a part draw.
fn drawn(
    parts: &[EmitterPart],
    number: f64,
    within: DVec2,
    receiver: &Receiver,
    settings: &PointSettings,
    margin: &mut f64,
) -> Point {
    let index = parts.partition_point(|part| part.before <= number) - 1;
    let end = parts.get(index + 1).map_or(1.0, |next| next.before);
    let apart = (number - parts[index].before).min(end - number);
    *margin = margin.min(apart * parts.len() as f64);
    let part = &parts[index];
    let root = within.x.sqrt();
    let [to_second, to_third] = part.edges;
    let position = part.corner + root * (1.0 - within.y) * to_second + root * within.y * to_third;
    let normal = to_second.cross(to_third).normalize();
    let way = position - receiver.position;
    let direction = way.normalize();
    let cosine = if direction.dot(receiver.geometric_normal) > 0.0 {
        direction.dot(receiver.shading_normal).max(0.0)
    } else {
        0.0
    };
    let squared = way.length_squared().max(settings.least_distance.powi(2));
    let leaving = (-normal.dot(direction)).max(0.0);
    Point {
        position,
        normal,
        irradiance: part.radiance * (cosine * leaving / (squared * part.density)),
    }
}

/// Whether a voxel hides a point: one that a ray hits before it, and that lies neither under the
/// receiver's tangent plane nor under the point's.
fn is_hidden(
    grid: &TraceGrid,
    point: &Point,
    receiver: &Receiver,
    (settings, ray): (&PointSettings, u32),
    margin: &mut f64,
) -> bool {
    let trace = TraceSettings {
        ray,
        ..settings.trace
    };
    let origin = receiver.position + settings.start_offset * receiver.geometric_normal;
    let way = point.position - origin;
    let reach = way.length();
    let mut is_hidden = false;
    for crossing in crossings(grid, origin, way / reach, receiver, &trace) {
        let surface = corner_of(crossing.voxel) + grid.voxels[&crossing.voxel].mean_position;
        let height = (surface - point.position).dot(point.normal) - settings.trace.self_height;
        let hits = crossing.margin.min(height).min(reach - crossing.entry);
        *margin = margin.min(hits.abs()).min(crossing.exit - crossing.entry);
        is_hidden |= hits >= 0.0;
    }
    is_hidden
}

/// What reaches a flat receiver from whole parts that nothing hides, E, by points spread evenly
/// over each: what the mean of all draws is.
pub fn unhidden(parts: &[EmitterPart], receiver: &Receiver, points_a_part: u32) -> DVec3 {
    let light = |part: &EmitterPart, number: f64| {
        let (x, y) = (
            (number * 0.754_877_666_246_692_7).fract(),
            (number * 0.569_840_290_998_053_2).fract(),
        );
        let root = x.sqrt();
        let [to_second, to_third] = part.edges;
        let across = to_second.cross(to_third);
        let way =
            part.corner + root * (1.0 - y) * to_second + root * y * to_third - receiver.position;
        let direction = way.normalize();
        let cosine = direction.dot(receiver.shading_normal).max(0.0);
        let leaving = (-across.normalize().dot(direction)).max(0.0);
        part.radiance * (0.5 * across.length() * cosine * leaving / way.length_squared())
    };
    let part = |part: &EmitterPart| {
        (0..points_a_part)
            .map(|number| light(part, f64::from(number) + 0.5))
            .sum::<DVec3>()
            / f64::from(points_a_part)
    };
    parts.iter().map(part).sum()
}
