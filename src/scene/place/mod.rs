//! The camera and the lights of a model that comes with neither, placed by what rays see.
//!
//! All of it happens in units in which the model reaches from −1 to 1 along its longest side, so
//! that neither its size nor its place matters.
//!
//! Points all over the bounds tell whether the model is a place to be in: from most points of a
//! room or a hall, most rays end on the fronts of walls; around an object they escape, and inside a
//! solid they end on backs. The camera is where it sees most of the model, lights where they
//! reach most of what the camera sees.

mod inside;
mod outside;

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

use crate::scene::rays::{Accel, NO_TRIANGLE, Ray, corners};
use crate::scene::{Camera, Light, Scene, Triangle};

/// Radiance of the sky that is added where rays escape [W/(m² sr)]: dim beside the sun, and blue
/// enough to tell shadows from dirt.
const SKY: Vec3 = Vec3::new(0.14, 0.17, 0.22);

/// Points of the surface whose visibility is compared.
const SAMPLES: usize = 240;

/// Columns and rows of rays through a picture.
const GRID: [u32; 2] = [16, 9];

/// Share of what the camera sees that emitting surfaces must reach to be the only light.
const EMITTED_SHARE: f32 = 0.25;

/// What was chosen, and how to say it.
pub(super) struct Placement {
    /// From where, and to where.
    pub(super) camera: Camera,
    /// Where the camera stands, in words.
    pub(super) place: &'static str,
    /// The lights; none where what the model emits is enough.
    pub(super) lights: Vec<Light>,
    /// Radiance of the sky [W/(m² sr)]; zero where no ray escapes.
    pub(super) environment: Vec3,
}

/// A point of the surface.
#[derive(Clone, Copy)]
struct Sample {
    position: Vec3,
    /// Unit, on the front side.
    normal: Vec3,
    triangle: u32,
}

/// A point that the camera sees.
#[derive(Clone, Copy)]
struct Seen {
    position: Vec3,
    /// Unit, on the camera's side.
    normal: Vec3,
    triangle: u32,
    /// From the camera.
    distance: f32,
}

/// A model in units of half its longest side, around the middle of its bounds.
struct Space<'s> {
    scene: &'s Scene,
    accel: Accel,
    corners: Vec<[Vec3; 3]>,
    /// Half the extent of the bounds.
    half: Vec3,
    centre_m: DVec3,
    unit_m: f64,
}

/// Chooses camera, lights and sky; `None` without triangles.
pub(super) fn place(scene: &Scene) -> Option<Placement> {
    let space = Space::new(scene)?;
    let chosen = match inside::free_points(&space) {
        Some(free) => inside::place(&space, &free),
        None => outside::place(&space),
    };
    let seen = space.seen(&chosen.camera);
    let is_lit_by_itself = scene.is_emissive() && space.emitted_share(&seen) >= EMITTED_SHARE;
    let lights = if is_lit_by_itself {
        Vec::new()
    } else {
        chosen.lights
    };
    Some(Placement {
        camera: space.camera_m(&chosen.camera),
        place: chosen.place,
        lights,
        environment: if chosen.is_open { SKY } else { Vec3::ZERO },
    })
}

/// A choice, with the camera in units of the space and the lights in metres.
struct Chosen {
    camera: Camera,
    place: &'static str,
    lights: Vec<Light>,
    is_open: bool,
}

impl<'s> Space<'s> {
    fn new(scene: &'s Scene) -> Option<Self> {
        let (low, high) = scene.bounds()?;
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        let centre_m = 0.5 * (low + high);
        let unit_m = 0.5 * (high - low).max_element();
        let unit = |index: u32| {
            let position = Vec3::from(scene.vertices[index as usize].position);
            ((position.as_dvec3() - centre_m) / unit_m).as_vec3()
        };
        let corners: Vec<[Vec3; 3]> = scene
            .triangles
            .iter()
            .map(|triangle| triangle.vertices.map(unit))
            .collect();
        let is_masked = |triangle: usize| {
            let material = scene.triangles[triangle].material;
            scene.materials[material as usize].mask_texture.is_some()
        };
        Some(Space {
            scene,
            accel: Accel::of_corners(&corners, is_masked, 1.0),
            corners,
            half: (0.5 * (high - low) / unit_m).as_vec3(),
            centre_m,
            unit_m,
        })
    }

    fn point_m(&self, point: Vec3) -> Vec3 {
        (self.centre_m + point.as_dvec3() * self.unit_m).as_vec3()
    }

    /// The camera in metres. However far from the origin it is, eye and target stay two points.
    fn camera_m(&self, camera: &Camera) -> Camera {
        let eye = self.point_m(camera.eye);
        let forward = (camera.target - camera.eye).normalize();
        let least = f64::from(1e-5 * eye.abs().max_element()) / self.unit_m;
        let length = camera.target.distance(camera.eye).max(least as f32);
        Camera {
            eye,
            target: self.point_m(camera.eye + forward * length),
            ..*camera
        }
    }

    /// What a ray from a point of the air meets.
    fn trace(&self, origin: Vec3, direction: Vec3) -> Option<Seen> {
        let ray = Ray {
            origin,
            direction,
            leaves: NO_TRIANGLE,
        };
        let hit = self
            .accel
            .closest(|hit| self.scene.has_surface(hit), &ray)?;
        let [a, b, c] = self.corners[hit.triangle as usize];
        let position = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
        let front = normal([a, b, c]);
        let normal = if front.dot(direction) <= 0.0 {
            front
        } else {
            -front
        };
        Some(Seen {
            position,
            normal,
            triangle: hit.triangle,
            distance: origin.distance(position),
        })
    }

    fn shows_front(&self, seen: &Seen) -> bool {
        normal(self.corners[seen.triangle as usize]).dot(seen.normal) > 0.0
    }

    /// Whether nothing stands between a point of a triangle and a point of the air.
    fn is_clear(&self, position: Vec3, triangle: u32, to: Vec3) -> bool {
        let way = to - position;
        let distance = way.length();
        let ray = Ray {
            origin: position,
            direction: way / distance,
            leaves: triangle,
        };
        let is_solid = |hit| self.scene.has_surface(hit);
        !self.accel.is_occluded(is_solid, &ray, distance, triangle)
    }

    /// Points of those triangles that are `wanted`: half of them where the area is, half where the
    /// triangles are, because what is modelled finely is what the model is of.
    fn samples(&self, wanted: impl Fn(usize) -> bool) -> Vec<Sample> {
        let chosen: Vec<usize> = (0..self.corners.len())
            .filter(|index| wanted(*index))
            .collect();
        let area = |index: usize| {
            let [a, b, c] = self.corners[index];
            (b - a).cross(c - a).length()
        };
        let total: f64 = chosen.iter().map(|index| f64::from(area(*index))).sum();
        let share = |index: usize| {
            0.5 * f64::from(area(index)) / total.max(1e-30) + 0.5 / chosen.len() as f64
        };
        let (mut samples, mut sum) = (Vec::with_capacity(SAMPLES), 0.0);
        for &index in &chosen {
            sum += share(index);
            while ((samples.len() as f64 + 0.5) / SAMPLES as f64) < sum && samples.len() < SAMPLES {
                let [s, t, _] = spread(samples.len());
                let (u, v) = if s + t > 1.0 {
                    (1.0 - s, 1.0 - t)
                } else {
                    (s, t)
                };
                let [a, b, c] = self.corners[index];
                samples.push(Sample {
                    position: a + (b - a) * u + (c - a) * v,
                    normal: normal([a, b, c]),
                    triangle: index as u32,
                });
            }
        }
        samples
    }

    /// What a camera sees, by a grid of rays through a wide picture.
    fn seen(&self, camera: &Camera) -> Vec<Seen> {
        rays_of(camera)
            .filter_map(|ray| self.trace(camera.eye, ray))
            .collect()
    }

    /// The share of points that are seen which light from emitting surfaces reaches.
    fn emitted_share(&self, seen: &[Seen]) -> f32 {
        let emits = |index: usize| {
            let material = self.scene.triangles[index].material;
            self.scene.materials[material as usize].emission != Vec3::ZERO
        };
        let emitters = self.samples(emits);
        let reaches = |seen: &Seen, emitter: &Sample| {
            let way = emitter.position - seen.position;
            way.dot(seen.normal) > 0.0
                && way.dot(emitter.normal) < 0.0
                && self.is_clear(seen.position, seen.triangle, emitter.position - 1e-4 * way)
        };
        let step = (emitters.len() / 16).max(1);
        let few = || emitters.iter().step_by(step);
        let is_reached = |seen: &&Seen| {
            emits(seen.triangle as usize) || few().any(|emitter| reaches(seen, emitter))
        };
        seen.iter().filter(is_reached).count() as f32 / seen.len().max(1) as f32
    }
}

/// Directions of a grid of rays through a picture of 16:9.
fn rays_of(camera: &Camera) -> impl Iterator<Item = Vec3> {
    let [columns, rows] = GRID;
    (0..columns * rows).map(move |index| {
        let (x, y) = (
            (index % columns) as f32 + 0.5,
            (index / columns) as f32 + 0.5,
        );
        camera.ray_direction(x, y, columns, rows)
    })
}

/// The unit normal of a triangle's front.
fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    (b - a).cross(c - a).normalize_or(DVec3::Y).as_vec3()
}

/// The `index`th of points that fill the unit cube evenly (M. Roberts' R3 sequence, 2018).
fn spread(index: usize) -> [f32; 3] {
    const STEPS: [f64; 3] = [0.819_172_513_396, 0.671_043_606_703, 0.549_700_477_901];
    STEPS.map(|step| ((0.5 + step * (index as f64 + 1.0)) % 1.0) as f32)
}

/// `count` unit directions, evenly over the sphere.
fn sphere(count: usize) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |index| {
        let y = 1.0 - (2.0 * index as f32 + 1.0) / count as f32;
        let (sin, cos) = (index as f32 * PI * (3.0 - 5f32.sqrt())).sin_cos();
        let radius = (1.0 - y * y).sqrt();
        Vec3::new(radius * cos, y, radius * sin)
    })
}

/// A unit direction: the azimuth goes from +z to +x, the elevation up.
fn direction(azimuth_deg: f32, elevation_deg: f32) -> Vec3 {
    let (sin, cos) = azimuth_deg.to_radians().sin_cos();
    let (up, out) = elevation_deg.to_radians().sin_cos();
    Vec3::new(sin * out, up, cos * out)
}

/// The index of the largest value, the first of equal ones.
fn best(values: impl Iterator<Item = f32>) -> Option<usize> {
    let better = |best: Option<(usize, f32)>, (index, value): (usize, f32)| match best {
        Some((_, least)) if value <= least => best,
        _ => Some((index, value)),
    };
    values
        .enumerate()
        .fold(None, better)
        .map(|(index, _)| index)
}

/// The value below which a share of them is; zero of none.
fn quantile(values: &mut [f32], share: f32) -> f32 {
    values.sort_unstable_by(f32::total_cmp);
    let index = (share * values.len() as f32) as usize;
    values
        .get(index.min(values.len().saturating_sub(1)))
        .copied()
        .unwrap_or(0.0)
}

/// Height of a terrain over its shorter side, at most.
const RELIEF: f64 = 0.35;

/// Whether a model looks as if z pointed up in it: it has a floor across its lowest z and no wall
/// at its highest, nor the same along y, or it is flat along z alone, or an open terrain along it.
pub(super) fn looks_z_up(scene: &Scene) -> bool {
    let Some((low, high)) = scene.bounds() else {
        return false;
    };
    let extent = (high - low).as_dvec3();
    let is_lower = |axis: usize, share: f64| {
        let others = [(axis + 1) % 3, (axis + 2) % 3].map(|other| extent[other]);
        extent[axis] < share * others[0].min(others[1])
    };
    let is_flat = |axis: usize| is_lower(axis, 0.1);
    let cover = |axis: usize, from_top: bool| cover(scene, [low, high], axis, from_top);
    let stands_on = |axis: usize| cover(axis, false) > 0.8 && cover(axis, true) < 0.8;
    let is_terrain =
        is_lower(2, RELIEF) && facing(scene, [low, high], 2) > 0.8 && covers_ground(scene);
    (stands_on(2) && !stands_on(1)) || (is_flat(2) && !is_flat(1)) || is_terrain
}

/// The share of the bounds' face along an axis that open surfaces cover: what faces up less what
/// faces down, so that closed things count nothing.
fn facing(scene: &Scene, [low, high]: [Vec3; 2], axis: usize) -> f64 {
    let extent = (high - low).as_dvec3();
    let area = |triangle: &Triangle| {
        let [a, b, c] = corners(scene, triangle).map(Vec3::as_dvec3);
        0.5 * (b - a).cross(c - a)[axis]
    };
    let face = extent[(axis + 1) % 3] * extent[(axis + 2) % 3];
    scene.triangles.iter().map(area).sum::<f64>() / face.max(f64::MIN_POSITIVE)
}

/// Whether surfaces are in the way nearly everywhere along z, as leaves and lattices are not.
fn covers_ground(scene: &Scene) -> bool {
    const RAYS: usize = 64;
    let Some(space) = Space::new(scene) else {
        return false;
    };
    let is_met = |index: &usize| {
        let [x, y, _] = spread(*index);
        let above = ((2.0 * Vec3::new(x, y, 0.0) - 1.0) * space.half).with_z(2.0);
        space.trace(above, Vec3::NEG_Z).is_some()
    };
    (0..RAYS).filter(is_met).count() as f32 > 0.9 * RAYS as f32
}

/// The share of the bounds' lowest or highest face along an axis that surfaces there cover, those
/// counted twice that lie twice.
fn cover(scene: &Scene, [low, high]: [Vec3; 2], axis: usize, from_top: bool) -> f64 {
    let extent = (high - low).as_dvec3();
    let band = 0.02 * extent[axis];
    let is_there = |corner: &DVec3| match from_top {
        true => f64::from(high[axis]) - corner[axis] <= band,
        false => corner[axis] - f64::from(low[axis]) <= band,
    };
    let area = |triangle: &Triangle| {
        let corners = corners(scene, triangle).map(Vec3::as_dvec3);
        let [a, b, c] = corners;
        match corners.iter().all(is_there) {
            true => 0.5 * (b - a).cross(c - a)[axis].abs(),
            false => 0.0,
        }
    };
    let face = extent[(axis + 1) % 3] * extent[(axis + 2) % 3];
    scene.triangles.iter().map(area).sum::<f64>() / face.max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Vertex};

    /// Squares of 1 m side by side, 20 by 20, at heights along +z; those that are not `wanted` are
    /// left out.
    fn ground(height: impl Fn(f32, f32) -> f32, wanted: impl Fn(usize) -> bool) -> Scene {
        let mut scene = Scene {
            materials: vec![Material::default()],
            ..Scene::default()
        };
        for square in (0..400).filter(|square| wanted(*square)) {
            let first = scene.vertices.len() as u32;
            for [right, up] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
                let (x, y) = ((square % 20 + right) as f32, (square / 20 + up) as f32);
                scene.vertices.push(Vertex {
                    position: [x, y, height(x, y)],
                    u: 0.0,
                    normal: [0.0, 0.0, 1.0],
                    v: 0.0,
                });
            }
            for vertices in [[0, 1, 2], [0, 2, 3]] {
                let vertices = vertices.map(|corner| first + corner);
                scene.triangles.push(Triangle {
                    vertices,
                    material: 0,
                });
            }
        }
        scene
    }

    /// The same with y upwards, as it should be.
    fn turned(mut scene: Scene) -> Scene {
        for vertex in &mut scene.vertices {
            let [x, y, z] = vertex.position;
            vertex.position = [x, z, -y];
        }
        scene
    }

    #[test]
    fn hills_along_z_look_so() {
        let hills = |x: f32, y: f32| 2.0 * (0.3 * x).sin() * (0.4 * y).cos();
        let all = |_: usize| true;
        assert!(looks_z_up(&ground(hills, all)));
        assert!(!looks_z_up(&turned(ground(hills, all))));
    }

    /// Loose leaves before a window, each in several layers: they face +z as much as hills do.
    #[test]
    fn leaves_that_hang_do_not() {
        let some = |square: usize| square % 5 < 2 || square == 399;
        let wave = |x: f32, y: f32| 2.0 * (0.9 * x).sin() * (0.7 * y).cos();
        let mut leaves = ground(wave, some);
        for _ in 0..2 {
            let layer = leaves.triangles.clone();
            leaves.triangles.extend(layer);
        }
        let bounds = leaves.bounds().map(|(low, high)| [low, high]);
        assert!(bounds.is_some_and(|bounds| facing(&leaves, bounds, 2) > 0.8));
        assert!(!looks_z_up(&leaves));
    }
}
