//! The ways of rays through what is clear, on the host: the twin of `render/clear/way.glsl`.

use glam::Vec3;

use super::{First, passes};
use crate::scene::Scene;
use crate::scene::clear::{fresnel, refract};
use crate::scene::rays::{Hit, NO_TRIANGLE, Ray};
use crate::scene::surfaces::Surfaces;

/// Sheets that a ray passes before the first body.
const MOST_SHEETS: u32 = 16;

/// A line of sight, up to the next clear surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Where it starts (m).
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// Where it ends (m); infinite where no clear surface is on its way.
    pub end_m: f32,
    /// What is left of the light along it.
    pub left: Vec3,
}

/// What a ray of a pixel meets.
#[derive(Clone, Debug, PartialEq)]
pub struct Way {
    /// What sheets leave of the light of the surface at its end; `None` where a body is before it.
    pub filter: Option<Vec3>,
    /// It meets something clear.
    pub is_behind: bool,
    /// From the first body: lines of sight, one behind the other, of which nothing hides the end.
    pub lines: Vec<Line>,
}

/// The clear surfaces of a scene as the reference traces them.
pub struct ClearOracle<'s> {
    surfaces: Surfaces<'s>,
}

/// The surfaces of which more than half is clear.
pub fn clear_part(scene: &Scene) -> Option<Scene> {
    scene.clear_part()
}

impl<'s> ClearOracle<'s> {
    /// Of [`clear_part`].
    pub fn new(clear: &'s Scene) -> Self {
        ClearOracle {
            surfaces: Surfaces::new(clear),
        }
    }

    /// The way of a ray to a surface at a distance.
    pub fn way(&self, origin: Vec3, direction: Vec3, end_m: f32, first: First) -> Way {
        let mut way = Way {
            filter: Some(Vec3::ONE),
            is_behind: false,
            lines: Vec::new(),
        };
        let (mut left, mut end_m) = (Vec3::ONE, end_m);
        let mut ray = Ray {
            origin,
            direction,
            leaves: NO_TRIANGLE,
        };
        for _ in 0..MOST_SHEETS {
            let Some((hit, distance_m)) = self.met(&ray, end_m) else {
                break;
            };
            way.is_behind = true;
            let is_mirrored = first == First::Mirrored;
            if let Some(mut passed) = self.bent(hit, &ray, is_mirrored, &mut left) {
                way.filter = None;
                while way.lines.len() < first.sight_count() as usize {
                    let next = self.met(&passed, f32::INFINITY);
                    way.lines.push(Line {
                        origin: passed.origin,
                        direction: passed.direction,
                        end_m: next.map_or(f32::INFINITY, |(_, distance_m)| distance_m),
                        left,
                    });
                    let Some((hit, _)) = next else { break };
                    passed = self
                        .bent(hit, &passed, false, &mut left)
                        .unwrap_or_else(|| self.straight(hit, &passed, &mut left));
                }
                return way;
            }
            ray = self.straight(hit, &ray, &mut left);
            end_m -= distance_m;
        }
        way.filter = Some(left);
        way
    }

    /// What a ray meets before an end (m), and how far.
    fn met(&self, ray: &Ray, end_m: f32) -> Option<(Hit, f32)> {
        let hit = self.surfaces.closest(ray)?;
        let distance_m = (self.surfaces.place(hit).position - ray.origin).dot(ray.direction);
        (distance_m < end_m).then_some((hit, distance_m))
    }

    /// A ray on from the surface of a body; `None` at a sheet.
    fn bent(&self, hit: Hit, ray: &Ray, is_mirrored: bool, left: &mut Vec3) -> Option<Ray> {
        let transmission = self.surfaces.material(hit).transmission?;
        if transmission.index == 1.0 {
            return None;
        }
        let place = self.surfaces.place(hit);
        let is_front = place.front.dot(ray.direction) <= 0.0;
        let side = if is_front { place.front } else { -place.front };
        let normal = if place.shading.dot(side) >= 0.0 {
            place.shading
        } else {
            -place.shading
        };
        let eta = if is_front {
            1.0 / transmission.index
        } else {
            transmission.index
        };
        let cosine = (-normal.dot(ray.direction)).clamp(0.0, 1.0);
        let mirrored = (ray.direction + 2.0 * cosine * normal).normalize();
        let goes = |direction, offset_m: f32| Ray {
            origin: place.position + offset_m * side,
            direction,
            leaves: hit.triangle,
        };
        let Some(refracted) = refract(cosine, eta) else {
            return Some(goes(mirrored, place.offset_m));
        };
        let reflectance = fresnel(cosine, refracted, eta);
        if is_mirrored {
            *left *= reflectance;
            return Some(goes(mirrored, place.offset_m));
        }
        *left *= (1.0 - reflectance) * passes(&transmission);
        let bent = eta * ray.direction + (eta * cosine - refracted) * normal;
        Some(goes(bent.normalize(), -place.offset_m))
    }

    /// A ray on through a sheet.
    fn straight(&self, hit: Hit, ray: &Ray, left: &mut Vec3) -> Ray {
        let place = self.surfaces.place(hit);
        let transmission = self.surfaces.material(hit).transmission;
        *left *= transmission.as_ref().map_or(Vec3::ONE, passes);
        let along = if place.front.dot(ray.direction) <= 0.0 {
            -place.front
        } else {
            place.front
        };
        Ray {
            origin: place.position + place.offset_m * along,
            leaves: hit.triangle,
            ..*ray
        }
    }
}
