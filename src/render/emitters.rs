//! The surfaces of a scene that emit, cut into small flat parts.

use std::collections::BinaryHeap;

use glam::{Vec2, Vec3};

use crate::image::luminance;
use crate::scene::{Material, Scene, Triangle};

/// A flat part of the surface that emits, all of it alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emitter {
    /// Its corners, counter-clockwise as seen from the side that emits (m).
    pub corners: [Vec3; 3],
    /// Their mean (m).
    pub position: Vec3,
    /// Unit normal of the side that emits.
    pub normal: Vec3,
    /// Area of this part (m²).
    pub area: f32,
    /// Mean of the emitted radiance (W/(m² sr)).
    pub radiance: Vec3,
}

impl Emitter {
    /// Luminance of radiance times area (W/sr).
    pub fn intensity(&self) -> f32 {
        luminance(self.radiance) * self.area
    }
}

/// No part gives off more than this share of all emitted light.
const LARGEST_SHARE: f32 = 1.0 / 1024.0;

/// Cuts at most: what the texture of a part shows only after it is cut may be bright without bound.
const MOST_CUTS: usize = 8192;

/// Points at which the texture of a part is read.
const POINTS: u32 = 16;

/// Part of a triangle, and where its corners are in the texture.
#[derive(Clone, Copy)]
struct Part {
    uv: [Vec2; 3],
    /// Index into [`Scene::materials`].
    material: u32,
    emitter: Emitter,
}

impl Part {
    fn new(scene: &Scene, material: u32, corners: [Vec3; 3], uv: [Vec2; 3]) -> Self {
        let [a, b, c] = corners;
        let across = (b - a).cross(c - a);
        let radiance = mean_radiance(scene, &scene.materials[material as usize], uv);
        let emitter = Emitter {
            corners,
            position: (a + b + c) / 3.0,
            normal: across.normalize_or_zero(),
            area: 0.5 * across.length(),
            radiance,
        };
        Part {
            uv,
            material,
            emitter,
        }
    }

    fn of(scene: &Scene, triangle: &Triangle) -> Self {
        let vertices = triangle
            .vertices
            .map(|index| scene.vertices[index as usize]);
        Part::new(
            scene,
            triangle.material,
            vertices.map(|vertex| Vec3::from(vertex.position)),
            vertices.map(|vertex| Vec2::new(vertex.u, vertex.v)),
        )
    }

    /// Its halves, parted at the middle of its longest edge.
    fn halves(&self, scene: &Scene) -> [Part; 2] {
        let corners = self.emitter.corners;
        let ends = |edge: usize| [edge, (edge + 1) % 3, (edge + 2) % 3];
        let length = |edge: usize| corners[ends(edge)[0]].distance_squared(corners[ends(edge)[1]]);
        let longest = (0..3).fold(0, |longest, edge| {
            if length(edge) > length(longest) {
                edge
            } else {
                longest
            }
        });
        let [a, b, c] = ends(longest);
        let (middle, uv) = (
            (corners[a] + corners[b]) / 2.0,
            (self.uv[a] + self.uv[b]) / 2.0,
        );
        [[a, c], [b, c]].map(|kept| {
            let (mut corners, mut uvs) = (corners, self.uv);
            let moved = if kept[0] == a { b } else { a };
            (corners[moved], uvs[moved]) = (middle, uv);
            Part::new(scene, self.material, corners, uvs)
        })
    }
}

impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Part {}

impl PartialOrd for Part {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Part {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.emitter
            .intensity()
            .total_cmp(&other.emitter.intensity())
    }
}

/// The parts of all surfaces that emit, where they are now: triangles, cut up where one gives off
/// much of the light, so that they can be grouped.
pub fn emitters(scene: &Scene) -> Vec<Emitter> {
    let emitting = scene
        .triangles
        .iter()
        .filter(|triangle| scene.materials[triangle.material as usize].emission != Vec3::ZERO);
    let mut parts: BinaryHeap<Part> = emitting.map(|triangle| Part::of(scene, triangle)).collect();
    let most = LARGEST_SHARE
        * parts
            .iter()
            .map(|part| part.emitter.intensity())
            .sum::<f32>();
    for _ in 0..MOST_CUTS {
        let Some(part) = parts
            .peek()
            .copied()
            .filter(|part| part.emitter.intensity() > most)
        else {
            break;
        };
        parts.pop();
        parts.extend(part.halves(scene));
    }
    parts
        .into_iter()
        .map(|part| part.emitter)
        .filter(|emitter| emitter.intensity() > 0.0)
        .collect()
}

/// Mean over a triangle with these texture coordinates; nothing where its mask leaves no surface.
fn mean_radiance(scene: &Scene, material: &Material, [a, b, c]: [Vec2; 3]) -> Vec3 {
    let textures = [material.emission_texture, material.mask_texture]
        .map(|texture| texture.map(|texture| &scene.textures[texture as usize]));
    if textures == [None; 2] {
        return material.emission;
    }
    let at = |i: u32| {
        // Evenly over the triangle: the square's R₂ sequence, folded along its diagonal.
        let square = Vec2::new(0.754_877_7, 0.569_840_3) * (i as f32 + 0.5);
        let (u, v) = (square.x.fract(), square.y.fract());
        let [u, v] = if u + v > 1.0 {
            [1.0 - u, 1.0 - v]
        } else {
            [u, v]
        };
        let uv = a + u * (b - a) + v * (c - a);
        let [tint, mask] = textures.map(|texture| {
            texture.map_or(Vec3::ONE, |texture| texture.sample(uv.x, uv.y).truncate())
        });
        if mask.x < 0.5 { Vec3::ZERO } else { tint }
    };
    material.emission * (0..POINTS).map(at).sum::<Vec3>() / POINTS as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bundled(name: &str) -> Scene {
        Scene::bundled(name, &[]).unwrap_or_default()
    }

    fn power(emitters: &[Emitter]) -> Vec3 {
        emitters
            .iter()
            .map(|emitter| emitter.area * emitter.radiance)
            .sum()
    }

    #[test]
    fn parts_are_the_whole() {
        let scene = bundled("cornell-lamp");
        let parts = emitters(&scene);
        let area: f32 = parts.iter().map(|part| part.area).sum();
        assert!(
            (1024..=2100).contains(&parts.len()) && (area - 0.25).abs() < 1e-5,
            "{} parts of {area} m²",
            parts.len()
        );
        assert!(
            (power(&parts) / (0.25 * 17.0 * Vec3::new(1.0, 0.87, 0.65)) - 1.0)
                .abs()
                .max_element()
                < 1e-4
        );
        assert!(
            parts
                .iter()
                .all(|part| part.normal.distance(Vec3::NEG_Y) < 1e-5
                    && part.position.abs().cmple(Vec3::new(0.25, 2.0, 0.25)).all())
        );
        assert_eq!(emitters(&bundled("cornell")), []);
    }

    #[test]
    fn textures_tint_their_part_alone() {
        let scene = bundled("emissive-gallery");
        let window = emitters(&scene)
            .into_iter()
            .filter(|part| part.position.x < -4.9);
        let colors: Vec<Vec3> = window
            .map(|part| part.radiance.normalize_or_zero())
            .collect();
        assert!(
            colors.len() > 100 && colors.iter().any(|color| color.distance(colors[0]) > 0.5),
            "one colour for a picture"
        );
    }
}
