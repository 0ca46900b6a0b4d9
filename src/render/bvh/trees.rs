//! The hierarchies of a scene, one behind the other, and those of models that move.

use std::ops::Range;

use glam::Vec3;

use super::super::gpu_scene::GpuScene;
use super::geometry::Geometry;
use super::rows::Rows;
use super::wide::{CHILDREN, LEAF, NODE_WORDS, WIDTH, WideBvh, has_area};

/// Texels of a triangle: the first corner, and the edges from it to the others. The fourth word of
/// the first is the triangle's number.
pub(super) const TRIANGLE_TEXELS: usize = 3;

/// 32-bit words of a triangle.
const TRIANGLE_WORDS: usize = 4 * TRIANGLE_TEXELS;

/// Set in the number of a triangle whose material has a mask.
const MASKED: u32 = 1 << 31;

/// Which triangles of a scene.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Which {
    All,
    /// Those of no dynamic model.
    Static,
}

/// What stands still, and each model that may move.
#[derive(Default)]
pub(super) struct Trees {
    pub(super) nodes: Vec<u32>,
    /// In the order of the leaves.
    pub(super) triangles: Vec<u32>,
    /// The root of each, or its first triangle where the device has hierarchies of its own.
    pub(super) roots: Vec<u32>,
    /// The corners of the triangles of each, where the device has hierarchies of its own (m).
    pub(super) corners: Vec<Vec<[Vec3; 3]>>,
    /// Nodes on the longest way from a root.
    pub(super) depth: u32,
    pub(super) has_masks: bool,
    pub(super) moving: Vec<Moving>,
}

/// A model that may move, and where its tree is.
pub(super) struct Moving {
    vertices: Range<usize>,
    /// Of each triangle, counted from the first of these.
    corners: Vec<[u32; 3]>,
    bvh: WideBvh,
    first_node: usize,
    first_triangle: usize,
}

impl Trees {
    /// Of the triangles of a scene. Without nodes, triangles stay in their order.
    pub(super) fn new(
        scene: &GpuScene,
        geometry: &Geometry,
        which: Which,
        has_nodes: bool,
    ) -> Self {
        let mut trees = Trees::default();
        let group_count = match which {
            Which::All => usize::MAX,
            Which::Static => 1,
        };
        let groups = geometry.groups(scene).into_iter().take(group_count);
        for (index, mut triangles) in groups.enumerate() {
            let moves = index > 0;
            // What moves may have an area elsewhere.
            if !moves {
                triangles.retain(|one| has_area(&geometry.of(*one), geometry.units_per_m));
            }
            if !triangles.is_empty() {
                trees.add((scene, geometry), &triangles, (moves, has_nodes));
            }
        }
        trees
    }

    fn add(
        &mut self,
        (scene, geometry): (&GpuScene, &Geometry),
        triangles: &[u32],
        (moves, has_nodes): (bool, bool),
    ) {
        let corners = geometry.corners(triangles);
        let (first_node, first_triangle) = (self.node_count(), self.triangle_count());
        let bvh = if has_nodes {
            self.roots.push(first_node as u32);
            WideBvh::new(&corners, geometry.units_per_m)
        } else {
            self.roots.push(first_triangle as u32);
            WideBvh::without_nodes(corners.len())
        };
        self.depth = self.depth.max(bvh.depth);
        self.nodes
            .extend(relocated(&bvh, first_node, first_triangle));
        for slot in &bvh.triangles {
            let triangle = triangles[*slot as usize];
            let material = geometry.materials[triangle as usize] as usize;
            let is_masked = scene.material_textures[material][3].is_some();
            self.has_masks |= is_masked;
            let mut words = [0; TRIANGLE_WORDS];
            place(&mut words, &corners[*slot as usize]);
            words[3] = triangle | if is_masked { MASKED } else { 0 };
            self.triangles.extend(words);
        }
        if !has_nodes {
            self.corners.push(corners);
        }
        if moves {
            let vertices = geometry.vertices(triangles);
            let first = vertices.start as u32;
            let of = |triangle: &u32| {
                geometry.triangles[*triangle as usize].map(|vertex| vertex - first)
            };
            self.moving.push(Moving {
                vertices,
                corners: triangles.iter().map(of).collect(),
                bvh,
                first_node,
                first_triangle,
            });
        }
    }

    pub(super) fn node_count(&self) -> usize {
        self.nodes.len() / NODE_WORDS
    }

    pub(super) fn triangle_count(&self) -> usize {
        self.triangles.len() / TRIANGLE_WORDS
    }

    /// The first node and the first triangle of what may move, or one beyond the last.
    pub(super) fn first_moving(&self) -> (usize, usize) {
        let of = |model: &Moving| (model.first_node, model.first_triangle);
        let none = (self.node_count(), self.triangle_count());
        self.moving.first().map_or(none, of)
    }
}

impl Moving {
    /// The vertices between its first and its last.
    pub(super) fn vertices(&self) -> &Range<usize> {
        &self.vertices
    }

    /// The corners of its triangles, by where its vertices are (m).
    pub(super) fn corners(&self, positions: &[Vec3]) -> Vec<[Vec3; 3]> {
        let of = |corners: &[u32; 3]| corners.map(|vertex| positions[vertex as usize]);
        self.corners.iter().map(of).collect()
    }

    /// Brings nodes up to where the corners of its triangles are (m).
    pub(super) fn refit(&mut self, corners: &[[Vec3; 3]], nodes: &mut Rows) {
        self.bvh.refit(corners);
        let words = relocated(&self.bvh, self.first_node, self.first_triangle);
        nodes.words_from(NODE_WORDS * self.first_node)[..words.len()].copy_from_slice(&words);
    }

    /// Brings triangles up to where their corners are (m).
    pub(super) fn follow(&self, corners: &[[Vec3; 3]], triangles: &mut Rows) {
        triangles
            .words_from(TRIANGLE_WORDS * self.first_triangle)
            .chunks_exact_mut(TRIANGLE_WORDS)
            .zip(&self.bvh.triangles)
            .for_each(|(words, slot)| place(words, &corners[*slot as usize]));
    }
}

/// Writes where a triangle is: edges are rounded as by the reference, which subtracts the same.
fn place(words: &mut [u32], &[a, b, c]: &[Vec3; 3]) {
    for (texel, at) in words.chunks_exact_mut(4).zip([a, b - a, c - a]) {
        texel[..3].copy_from_slice(&at.to_array().map(f32::to_bits));
    }
}

/// The words of a tree's nodes, where it is behind others.
fn relocated(bvh: &WideBvh, first_node: usize, first_triangle: usize) -> Vec<u32> {
    let mut words = bvh.nodes.clone();
    for node in words.chunks_exact_mut(NODE_WORDS) {
        let is_there = node[3] >> 24;
        for (child, word) in node[CHILDREN..][..WIDTH].iter_mut().enumerate() {
            if is_there >> child & 1 == 1 {
                *word += if *word < LEAF {
                    first_node
                } else {
                    first_triangle
                } as u32;
            }
        }
    }
    words
}
