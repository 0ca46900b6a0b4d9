//! Triangles cut into patches, a quadtree each: a patch is split at the middles of its edges.

use glam::Vec3;

use crate::scene::Scene;
use crate::scene::rays::corners;

/// A part of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patch {
    /// Index into the scene's triangles.
    pub(super) triangle: u32,
    /// Barycentric coordinates of its corners, of the triangle's second and third vertex.
    pub(super) corners: [[f32; 2]; 3],
    /// Its surface (m²).
    pub(super) area_m2: f32,
    node: u32,
}

impl Patch {
    /// The four parts: one at each corner, and the one between them.
    pub(super) fn quarters(&self) -> [Patch; 4] {
        let [a, b, c] = self.corners;
        let middle = |p: [f32; 2], q: [f32; 2]| [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
        let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]].map(|corners| Patch {
            corners,
            area_m2: 0.25 * self.area_m2,
            ..*self
        })
    }

    /// The place of a point of the unit square, evenly spread (G. Turk 1990).
    pub(super) fn place(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let root = x.sqrt();
        let (second, third) = (root * (1.0 - y), root * y);
        let [a, b, c] = self.corners;
        [0, 1].map(|i| a[i] * (1.0 - second - third) + b[i] * second + c[i] * third)
    }
}

/// A node of a quadtree.
#[derive(Clone, Copy, Debug)]
enum Node {
    /// The patch with this index.
    Leaf(u32),
    /// The first of four nodes.
    Split(u32),
}

/// All patches of a scene. The first nodes are the roots, one a triangle.
pub(super) struct Patches {
    nodes: Vec<Node>,
    pub(super) all: Vec<Patch>,
}

impl Patches {
    /// Patches whose edges are no longer than this (m); `Err` has the number that there would be,
    /// where these are more than `most`.
    pub(super) fn new(scene: &Scene, edge_m: f32, most: u32) -> Result<Self, u64> {
        let levels: Vec<u32> = (scene.triangles.iter())
            .map(|triangle| {
                let [a, b, c] = corners(scene, triangle);
                let longest_m = a.distance(b).max(b.distance(c)).max(c.distance(a));
                (longest_m / edge_m).log2().ceil().clamp(0.0, 15.0) as u32
            })
            .collect();
        let count = levels.iter().map(|level| 1_u64 << (2 * level)).sum();
        if count > u64::from(most) {
            return Err(count);
        }
        let roots = (0..scene.triangles.len() as u32).map(|triangle| {
            let [a, b, c] = corners(scene, &scene.triangles[triangle as usize]).map(Vec3::as_dvec3);
            Patch {
                triangle,
                corners: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
                area_m2: (0.5 * (b - a).cross(c - a).length()) as f32,
                node: triangle,
            }
        });
        let mut patches = Patches {
            nodes: (0..scene.triangles.len() as u32).map(Node::Leaf).collect(),
            all: roots.collect(),
        };
        let mut level = 0;
        while patches
            .all
            .iter()
            .any(|patch| levels[patch.triangle as usize] > level)
        {
            for index in 0..patches.all.len() {
                if levels[patches.all[index].triangle as usize] > level {
                    patches.split(index);
                }
            }
            level += 1;
        }
        Ok(patches)
    }

    /// Splits a patch; its first quarter takes its index, the others come last.
    pub(super) fn split(&mut self, index: usize) {
        let parent = self.all[index];
        let first = self.nodes.len() as u32;
        self.nodes[parent.node as usize] = Node::Split(first);
        for (number, quarter) in (0..).zip(parent.quarters()) {
            let patch = Patch {
                node: first + number,
                ..quarter
            };
            let own = if number == 0 {
                self.all[index] = patch;
                index
            } else {
                self.all.push(patch);
                self.all.len() - 1
            };
            self.nodes.push(Node::Leaf(own as u32));
        }
    }

    /// The patch of a place on a triangle.
    pub(super) fn find(&self, triangle: u32, [u, v]: [f32; 2]) -> u32 {
        let mut place = [1.0 - u - v, u, v];
        let mut node = self.nodes[triangle as usize];
        loop {
            let first = match node {
                Node::Leaf(patch) => return patch,
                Node::Split(first) => first,
            };
            let quarter = place.iter().position(|&share| share >= 0.5).unwrap_or(3);
            place = match quarter {
                3 => place.map(|share| 1.0 - 2.0 * share),
                corner => {
                    let mut inner = place.map(|share| 2.0 * share);
                    inner[corner] -= 1.0;
                    inner
                }
            };
            node = self.nodes[first as usize + quarter];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Triangle, Vertex};

    fn triangle() -> Scene {
        let vertex = |position: [f32; 3]| Vertex {
            position,
            ..bytemuck::Zeroable::zeroed()
        };
        Scene {
            vertices: [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [1.0, 2.0, 0.0]]
                .map(vertex)
                .into(),
            triangles: vec![Triangle {
                vertices: [0, 1, 2],
                material: 0,
            }],
            ..Scene::default()
        }
    }

    /// Patches cover a triangle once, and each is found at the places that it has.
    #[test]
    fn patches_are_found_where_they_are() {
        let mut patches = Patches::new(&triangle(), 1.0, 100).unwrap_or_else(|_| panic!());
        for index in [0, 5, 15, 3, 3] {
            patches.split(index);
        }
        assert_eq!(patches.all.len(), 16 + 5 * 3);
        let area_m2: f32 = patches.all.iter().map(|patch| patch.area_m2).sum();
        assert!((area_m2 - 3.0).abs() < 1e-5, "{area_m2} m²");
        for (index, patch) in (0..).zip(&patches.all) {
            for x in [0.1, 0.5, 0.9] {
                for y in [0.1, 0.5, 0.9] {
                    assert_eq!(patches.find(0, patch.place([x, y])), index);
                }
            }
        }
    }

    #[test]
    fn too_many_patches_are_counted() {
        assert_eq!(Patches::new(&triangle(), 0.01, 1000).err(), Some(1 << 18));
    }
}
