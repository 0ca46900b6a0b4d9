//! Rays against the triangles of a scene, in compute shaders (`glsl/render/bvh/`).
//!
//! [`SceneRays`] is made by those who trace, and by nobody else. What stands still is one
//! hierarchy, and each model that may move another, whose boxes follow the model's vertices.
//! Triangles are read where every pass reads them; hits are those of the reference, bit by bit.

mod emitters;
mod geometry;
pub mod oracle;
mod textures;
mod wide;

pub use emitters::{EmissiveTriangles, GpuEmitter};
pub use wide::WideBvh;

use std::ops::Range;
use std::sync::Arc;

use bytemuck::cast_slice;
use geometry::Geometry;
use glam::Vec3;
use textures::SceneTextures;
use wide::{LEAF, MOST_TRIANGLES, NODE_WORDS, WIDTH, has_area};

use super::gpu_scene::{GpuScene, storage};
use crate::graph::{Access, Binding, Buffer, Error, Gpu, Owner, PassBuilder};

/// What a pass binds first that traces rays (`render/bvh/bindings.glsl`).
pub const BINDINGS: [Binding; 5] = [
    Binding::buffer("bvh_nodes", Access::ComputeRead),
    Binding::buffer("bvh_triangles", Access::ComputeRead),
    Binding::buffer("bvh_roots", Access::ComputeRead),
    Binding::buffer("texture_rows", Access::ComputeRead),
    Binding::sampled("texels", Access::ComputeSampled),
];

/// The first constants of a pass that traces rays, which [`SceneRays::bind`] gives.
pub const CONSTANTS: [&str; 3] = ["BVH_STACK", "BVH_ROOTS", "BVH_MASKS"];

/// Boxes that a traversal may put off: a shader has this many words twice.
const LONGEST_STACK: u32 = 1024;

/// Set in the number of a triangle whose material has a mask.
const MASKED: u32 = 1 << 31;

/// A model that may move, and where its nodes are.
struct Moving {
    /// Its vertices.
    vertices: Range<usize>,
    /// Of each triangle, counted from the first of these.
    triangles: Vec<[u32; 3]>,
    bvh: WideBvh,
    first_node: usize,
    first_triangle: usize,
}

/// The triangles of a scene as shaders trace them.
pub struct SceneRays {
    nodes: Arc<Buffer>,
    triangles: Arc<Buffer>,
    roots: Arc<Buffer>,
    textures: SceneTextures,
    stack: u32,
    root_count: u32,
    triangle_count: u32,
    has_masks: bool,
    moving: Vec<Moving>,
    /// All nodes, where some may move.
    words: Vec<u32>,
}

/// The words of a tree's nodes, where it is behind others.
fn relocated(bvh: &WideBvh, first_node: usize, first_triangle: usize) -> Vec<u32> {
    let mut words = bvh.nodes.clone();
    for node in words.chunks_exact_mut(NODE_WORDS) {
        let is_there = node[3] >> 24;
        for (child, word) in node[4..4 + WIDTH].iter_mut().enumerate() {
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

impl SceneRays {
    /// Of a scene as it is on the device.
    pub fn new(gpu: &Gpu, scene: &GpuScene) -> Result<Self, Error> {
        let geometry = Geometry::read(gpu, scene)?;
        if geometry.triangles.len() > MOST_TRIANGLES {
            return Err(Error::FeatureMissing {
                what: format!("rays against {} triangles", geometry.triangles.len()),
                feature: "numbers of more than 27 bits in a leaf (134,217,727 triangles)",
            });
        }
        let textures = SceneTextures::new(gpu, scene)?;
        let groups = geometry.groups(scene);
        let (mut nodes, mut order, mut roots, mut moving) = (vec![], vec![], vec![], vec![]);
        let mut stack = 1;
        for (index, mut triangles) in groups.into_iter().enumerate() {
            // What moves may have an area elsewhere.
            if index == 0 {
                triangles.retain(|one| has_area(&geometry.of(*one), geometry.units_per_m));
            }
            let bvh = WideBvh::new(&geometry.corners(&triangles), geometry.units_per_m);
            let (first_node, first_triangle) = (nodes.len() / NODE_WORDS, order.len());
            if bvh.nodes.is_empty() {
                continue;
            }
            roots.push(first_node as u32);
            stack = stack.max(bvh.stack);
            nodes.extend(relocated(&bvh, first_node, first_triangle));
            let number = |slot: &u32| {
                let triangle = triangles[*slot as usize];
                let material = geometry.materials[triangle as usize] as usize;
                let is_masked = scene.material_textures[material][3].is_some();
                triangle | if is_masked { MASKED } else { 0 }
            };
            order.extend(bvh.triangles.iter().map(number));
            if index > 0 {
                let vertices = geometry.vertices(&triangles);
                let first = vertices.start as u32;
                let of = |triangle: &u32| {
                    geometry.triangles[*triangle as usize].map(|vertex| vertex - first)
                };
                moving.push(Moving {
                    vertices,
                    triangles: triangles.iter().map(of).collect(),
                    bvh,
                    first_node,
                    first_triangle,
                });
            }
        }
        if stack > LONGEST_STACK {
            return Err(Error::FeatureMissing {
                what: format!("rays through a hierarchy that puts off {stack} boxes"),
                feature: "a stack of more than 1024 boxes",
            });
        }
        let buffer = |name, words: &[u32]| storage(gpu, (name, Owner::Store), cast_slice(words));
        Ok(SceneRays {
            nodes: buffer("bvh.nodes", &nodes)?,
            triangles: buffer("bvh.triangles", &order)?,
            roots: buffer("bvh.roots", &roots)?,
            textures,
            // In steps, so that like scenes have one pipeline.
            stack: stack.next_multiple_of(16),
            root_count: roots.len() as u32,
            triangle_count: order.len() as u32,
            has_masks: order.iter().any(|number| number & MASKED != 0),
            words: if moving.is_empty() { Vec::new() } else { nodes },
            moving,
        })
    }

    /// Brings the boxes of models up to where their vertices are.
    pub fn follow(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<(), Error> {
        for model in &mut self.moving {
            let positions = geometry::positions_of(gpu, scene, &model.vertices)?;
            let corners = |triangle: &[u32; 3]| triangle.map(|vertex| positions[vertex as usize]);
            let corners: Vec<[Vec3; 3]> = model.triangles.iter().map(corners).collect();
            model.bvh.refit(&corners);
            let words = relocated(&model.bvh, model.first_node, model.first_triangle);
            self.words[NODE_WORDS * model.first_node..][..words.len()].copy_from_slice(&words);
        }
        if self.moving.is_empty() {
            return Ok(());
        }
        gpu.upload_buffer(&self.nodes, cast_slice(&self.words))
    }

    /// Binds [`BINDINGS`] and gives [`CONSTANTS`].
    pub fn bind<'f>(&self, pass: PassBuilder<'f>) -> PassBuilder<'f> {
        pass.bind("bvh_nodes", &self.nodes)
            .bind("bvh_triangles", &self.triangles)
            .bind("bvh_roots", &self.roots)
            .bind("texture_rows", &self.textures.rows)
            .bind("texels", &self.textures.texels)
            .constant("BVH_STACK", self.stack)
            .constant("BVH_ROOTS", self.root_count)
            .constant("BVH_MASKS", self.has_masks)
    }

    /// Counts, by name.
    pub fn counts(&self) -> Vec<(&'static str, u64)> {
        vec![
            ("bvh_triangles", self.triangle_count.into()),
            ("bvh_trees", self.root_count.into()),
        ]
    }
}
