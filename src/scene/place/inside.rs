//! Rooms and halls: a camera that stands in the air and sees most of them, and point lights.

use glam::Vec3;

use super::{
    Chosen, SAMPLES, Sample, Seen, Space, best, direction, outside, quantile, rays_of, sphere,
    spread,
};
use crate::scene::light::LIGHT_MAX;
use crate::scene::{Camera, Light};

/// Points in the bounds that are looked around from.
const POINTS: usize = 96;

/// Rays that look around from each.
const RAYS: usize = 26;

/// Share of the rays from a point in a room that may escape, as through a missing roof.
const ESCAPES_MAX: f32 = 0.3;

/// Share of the rays that end on fronts, of those from a point in the air of a room.
const FRONTS_MIN: f32 = 0.35;

/// Share of the bounds that is air of a room, of a model to be seen from inside.
const AIR_MIN: f32 = 0.35;

/// Share of the bounds that is enclosed, of a room whose walls face outwards.
const TURNED_AIR_MIN: f32 = 0.8;

/// Share of the rays from there that end on fronts: on what stands in that room.
const TURNED_FRONTS_MIN: f32 = 0.01;

/// Least distance of the camera from all surfaces, of half the longest side.
const CLEARANCE: f32 = 0.04;

/// What stands nearer to the camera hides the room.
const NEAR: f32 = 0.12;

/// Vertical field of view \[degrees\].
const VFOV_DEG: f32 = 60.0;

/// Share of what the camera sees that has nothing above it, of a court rather than a room.
const OPEN_MIN: f32 = 0.25;

/// Share of it that the sun must reach to light a court.
const SUNLIT_MIN: f32 = 0.25;

/// Most lights of a room.
const LIGHTS_MAX: usize = 3;

/// How much more evenly the room must be lit for another light.
const LIGHT_WORTH: f32 = 1.08;

/// Irradiance that the lights give to half of what is seen, at least [W/m²].
const IRRADIANCE: f32 = 1.0;

/// Most that they give to all but the brightest twentieth [W/m²].
const IRRADIANCE_MAX: f32 = 6.0;

/// A point in the air of a room.
#[derive(Clone, Copy)]
pub(super) struct Free {
    point: Vec3,
    /// Distance to the nearest surface.
    clearance: f32,
    /// Share of the rays that escape.
    escapes: f32,
    /// How far up it is between floor and ceiling, 0 to 1.
    height: f32,
}

/// What rays from a point of the bounds meet.
struct Around {
    free: Free,
    /// Share of those that meet something and meet its front.
    fronts: f32,
}

fn look_around(space: &Space, point: Vec3) -> Around {
    let seen: Vec<Seen> = sphere(RAYS)
        .filter_map(|ray| space.trace(point, ray))
        .collect();
    let fronts = seen.iter().filter(|seen| space.shows_front(seen)).count();
    let reach = |side: f32| {
        let rays = sphere(RAYS).filter(|ray| ray.y * side > 0.5);
        rays.map(|ray| match space.trace(point, ray) {
            Some(seen) => side * (seen.position.y - point.y),
            None => space.half.y - side * point.y,
        })
        .fold(0.0, f32::max)
    };
    let (below, above) = (reach(-1.0), reach(1.0));
    Around {
        free: Free {
            point,
            clearance: seen
                .iter()
                .fold(f32::INFINITY, |least, seen| least.min(seen.distance)),
            escapes: 1.0 - seen.len() as f32 / RAYS as f32,
            height: below / (below + above).max(f32::MIN_POSITIVE),
        },
        fronts: fronts as f32 / seen.len().max(1) as f32,
    }
}

/// Points in the air, where the model is a room or a hall. A room may have walls that face
/// outwards; then something that faces the air stands in it, or it would be a solid.
pub(super) fn free_points(space: &Space) -> Option<Vec<Free>> {
    let point = |index| (2.0 * Vec3::from(spread(index)) - 1.0) * space.half;
    let around = (0..POINTS).map(|index| look_around(space, point(index)));
    let enclosed: Vec<Around> = around
        .filter(|around| around.free.escapes <= ESCAPES_MAX)
        .collect();
    let (air, backs): (Vec<&Around>, Vec<&Around>) = enclosed
        .iter()
        .partition(|around| around.fronts >= FRONTS_MIN);
    let is_share = |count: usize, least: f32| count as f32 >= least * POINTS as f32;
    let points = |of: &[&Around]| of.iter().map(|around| around.free).collect::<Vec<_>>();
    if is_share(air.len(), AIR_MIN) {
        return Some(points(&air));
    }
    let fronts = backs.iter().map(|around| around.fronts).sum::<f32>() / backs.len().max(1) as f32;
    let is_turned = is_share(backs.len(), TURNED_AIR_MIN) && fronts >= TURNED_FRONTS_MIN;
    let outside_of_things: Vec<&Around> = backs
        .into_iter()
        .filter(|around| around.fronts > 0.0)
        .collect();
    is_turned.then(|| points(&outside_of_things))
}

/// Chooses among points in the air.
pub(super) fn place(space: &Space, free: &[Free]) -> Chosen {
    let camera = camera(space, free);
    let seen = space.seen(&camera);
    let escapes = free.iter().map(|free| free.escapes).sum::<f32>() / free.len() as f32;
    let sun = || outside::sun(space, azimuth_deg(&camera), &seen);
    let under_sky = || open_share(space, &seen) >= OPEN_MIN;
    let lights = match under_sky().then(sun) {
        Some((sun, lit_share)) if lit_share >= SUNLIT_MIN => vec![sun],
        _ => lights(space, free, &camera, &seen),
    };
    Chosen {
        lights,
        camera,
        place: "inside it, where it sees most",
        is_open: escapes > 0.01,
    }
}

fn looking(eye: Vec3, forward: Vec3) -> Camera {
    Camera {
        eye,
        target: eye + 0.5 * forward,
        up: Vec3::Y,
        vfov_deg: VFOV_DEG,
    }
}

/// The camera that sees most of the surface, at a height between floor and ceiling where people or
/// painters stand.
fn camera(space: &Space, free: &[Free]) -> Camera {
    let samples = space.samples(|_| true);
    let mut choices: Vec<(f32, Camera)> = Vec::new();
    for at in free.iter().filter(|free| free.clearance >= CLEARANCE) {
        let visible: Vec<&Sample> = samples
            .iter()
            .filter(|sample| space.is_clear(sample.position, sample.triangle, at.point))
            .collect();
        choices.extend((0..16).map(|step| {
            let camera = looking(at.point, pitched(at.point, 22.5 * step as f32, &visible));
            (
                share_in_picture(&camera, &visible) * standing(at.height),
                camera,
            )
        }));
    }
    choices.sort_by(|one, other| other.0.total_cmp(&one.0));
    choices.truncate(12);
    let mut cameras: Vec<Camera> = Vec::new();
    for (_, camera) in &choices {
        cameras.extend([*camera, stepped_back(space, camera)]);
    }
    let rated = cameras.iter().map(|camera| {
        let visible: Vec<&Sample> = samples
            .iter()
            .filter(|sample| space.is_clear(sample.position, sample.triangle, camera.eye))
            .collect();
        let height = look_around(space, camera.eye).free.height;
        share_in_picture(camera, &visible) * standing(height) * openness(space, camera)
    });
    let first = || looking(free[0].point, Vec3::NEG_Z);
    best(rated).map_or_else(first, |index| cameras[index])
}

/// A direction of this azimuth, a little up or down towards what is visible there.
fn pitched(eye: Vec3, azimuth_deg: f32, visible: &[&Sample]) -> Vec3 {
    let level = direction(azimuth_deg, 0.0);
    let towards = visible
        .iter()
        .map(|sample| (sample.position - eye).normalize_or_zero())
        .filter(|towards| towards.dot(level) > 0.6)
        .sum::<Vec3>()
        .normalize_or(level);
    (level + Vec3::Y * towards.y.clamp(-0.25, 0.15)).normalize()
}

/// The share of all samples that are visible and in the picture.
fn share_in_picture(camera: &Camera, visible: &[&Sample]) -> f32 {
    let [right, up, forward] = camera.basis();
    let tan_y = (0.5 * camera.vfov_deg.to_radians()).tan();
    let is_in = |sample: &&&Sample| {
        let to = sample.position - camera.eye;
        let depth = to.dot(forward);
        depth > 0.0
            && to.dot(right).abs() <= 1.6 * tan_y * depth
            && to.dot(up).abs() <= tan_y * depth
    };
    visible.iter().filter(is_in).count() as f32 / SAMPLES as f32
}

/// How well a camera stands at a height between floor (0) and ceiling (1).
fn standing(height: f32) -> f32 {
    (-((height - 0.38) / 0.25).powi(2)).exp().max(0.02)
}

/// The same view from further back, as far as the room goes.
fn stepped_back(space: &Space, camera: &Camera) -> Camera {
    let [_, _, forward] = camera.basis();
    let level = Vec3::new(forward.x, 0.0, forward.z).normalize_or(forward);
    let room = space
        .trace(camera.eye, -level)
        .map_or(0.0, |seen| seen.distance);
    looking(
        camera.eye - level * (room - 1.5 * CLEARANCE).max(0.0),
        forward,
    )
}

/// How much of the picture is neither something near nor nothing at all, 0 to 1.
fn openness(space: &Space, camera: &Camera) -> f32 {
    let rays = rays_of(camera);
    let rated = rays.map(|ray| match space.trace(camera.eye, ray) {
        None => 0.5,
        Some(seen) => (seen.distance / NEAR).min(1.0),
    });
    let rated: Vec<f32> = rated.collect();
    rated.iter().sum::<f32>() / rated.len() as f32
}

/// The azimuth from what a camera looks at to the camera, as in [`direction`].
fn azimuth_deg(camera: &Camera) -> f32 {
    let back = camera.eye - camera.target;
    back.x.atan2(back.z).to_degrees()
}

/// The share of points that have nothing above them. Rays lean away from walls.
fn open_share(space: &Space, seen: &[Seen]) -> f32 {
    let is_open = |seen: &&Seen| {
        let above = seen.position + 4.0 * (Vec3::Y + 0.2 * seen.normal).normalize();
        space.is_clear(seen.position, seen.triangle, above)
    };
    let open = seen.iter().filter(|seen| seen.normal.y > -0.1);
    open.filter(is_open).count() as f32 / seen.len().max(1) as f32
}

/// Point lights that reach most of what the camera sees, most evenly, from above: one, or as many
/// as make it much more even.
fn lights(space: &Space, free: &[Free], camera: &Camera, seen: &[Seen]) -> Vec<Light> {
    let some: Vec<&Seen> = seen.iter().step_by(2).collect();
    let irradiances = |free: &Free| -> Vec<f32> {
        let irradiance = |seen: &&Seen| {
            let way = free.point - seen.position;
            let cosine = way.normalize_or_zero().dot(seen.normal);
            let is_lit = cosine > 0.0 && space.is_clear(seen.position, seen.triangle, free.point);
            if is_lit {
                cosine / way.length_squared()
            } else {
                0.0
            }
        };
        some.iter().map(irradiance).collect()
    };
    let each: Vec<Vec<f32>> = free.iter().map(irradiances).collect();
    let (mut total, mut chosen, mut score) = (vec![0.0; some.len()], Vec::new(), 0.0);
    while chosen.len() < LIGHTS_MAX {
        let with = |index: usize| total.iter().zip(&each[index]).map(|(sum, more)| sum + more);
        let rated =
            |index: usize| evenness(&with(index).collect::<Vec<_>>()) * hanging(&free[index]);
        let Some(next) = best((0..free.len()).map(rated)) else {
            break;
        };
        let is_there = chosen.contains(&free[next].point);
        if is_there || (!chosen.is_empty() && rated(next) < LIGHT_WORTH * score) {
            break;
        }
        score = rated(next);
        total = with(next).collect();
        chosen.push(free[next].point);
    }
    total.retain(|value| *value > 0.0);
    let (middle, bright) = (quantile(&mut total, 0.5), quantile(&mut total, 0.95));
    let unit_intensity = match middle > 0.0 {
        true => (IRRADIANCE / middle).min(IRRADIANCE_MAX / bright),
        false => IRRADIANCE,
    };
    let intensity = f64::from(unit_intensity) * space.unit_m * space.unit_m;
    let intensity = Vec3::splat((intensity as f32).clamp(f32::MIN_POSITIVE, LIGHT_MAX));
    let points = if chosen.is_empty() {
        vec![camera.eye]
    } else {
        chosen
    };
    let light = |point: &Vec3| Light::Point {
        position: space.point_m(*point),
        intensity,
    };
    points.iter().map(light).collect()
}

/// How evenly points are lit, 0 to 1. What is brighter than all but a twentieth of the lit points
/// counts no more than they do, and what is dark counts nothing.
fn evenness(irradiances: &[f32]) -> f32 {
    let mut lit: Vec<f32> = irradiances.iter().copied().filter(|v| *v > 0.0).collect();
    let bright = quantile(&mut lit, 0.95).max(f32::MIN_POSITIVE);
    let roots = lit.iter().map(|value| (value / bright).min(1.0).sqrt());
    roots.sum::<f32>() / irradiances.len().max(1) as f32
}

/// How well a lamp hangs at a point: above heads, and away from ceiling and walls.
fn hanging(free: &Free) -> f32 {
    let above = (1.0 - 1.2 * (free.height - 0.62).abs()).max(0.3);
    above * (free.clearance / (4.0 * CLEARANCE)).min(1.0)
}
