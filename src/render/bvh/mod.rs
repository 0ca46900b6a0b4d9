//! Rays against the triangles of a scene, in compute shaders (`glsl/render/bvh/`).
//!
//! [`SceneRays`] is made by those who trace, and by nobody else. What stands still is one
//! hierarchy, and each model that may move another, which follows the model's vertices. Triangles
//! are stored again, in the order of the leaves; hits are those of the reference, bit by bit.
//!
//! Where the device traces rays ([`Gpu::traces_rays`]), hierarchies are its own acceleration
//! structures, and it finds the triangles near a ray. Passes need not know: [`SceneRays::bind`]
//! decides.

mod emitters;
mod geometry;
pub mod oracle;
mod rows;
mod structures;
mod textures;
mod trees;
mod wide;

pub use emitters::{EmissiveTriangles, GpuEmitter};
pub use wide::WideBvh;

use std::sync::Arc;
use std::time::Instant;

use bytemuck::cast_slice;
use geometry::Geometry;
use rows::Rows;
use structures::Structures;
use textures::SceneTextures;
use trees::{Moving, TRIANGLE_TEXELS, Trees, Which};
use wide::{MOST_NODES, MOST_TRIANGLES, NODE_TEXELS};

use super::gpu_scene::{GpuScene, storage};
use crate::graph::{Access, Binding, Buffer, Error, FrameStats, Gpu, Owner, PassBuilder};

/// What a pass binds first that traces rays (`render/bvh/bindings.glsl`).
pub const BINDINGS: [Binding; 5] = [
    Binding::rays("bvh_tree"),
    Binding::sampled("bvh_triangles", Access::ComputeSampled),
    Binding::buffer("bvh_roots", Access::ComputeRead),
    Binding::buffer("texture_rows", Access::ComputeRead),
    Binding::sampled("texels", Access::ComputeSampled),
];

/// The first constants of a pass that traces rays, which [`SceneRays::bind`] gives.
pub const CONSTANTS: [&str; 3] = ["BVH_STACK", "BVH_ROOTS", "BVH_MASKS"];

/// Where rays start off a place on the depth buffer: its rounding, as a share of coordinates and
/// distances, and room (`render/bvh/start.glsl`).
pub const START_SHARE: f32 = 2e-5;

/// Turns of loops that a ray is trusted to stay below: boxes that it opens, and triangles that it
/// meets, of all lanes of a vector, which wait for each other.
pub const TURNS_A_RAY: u32 = 1024;

/// Nodes of which a traversal may put boxes off: a shader has as many words.
const LONGEST_STACK: u32 = 1024;

/// The work of the host on hierarchies, as passes ([`FrameStats::of_host`]): built, and brought up
/// to models that move.
pub const HOST_WORK: [&str; 2] = ["bvh.build", "bvh.follow"];

/// What finds the triangles near a ray.
enum Hierarchies {
    /// Shaders, node by node.
    Nodes(Rows),
    /// The device.
    Structures(Structures),
}

/// The triangles of a scene as shaders trace them.
pub struct SceneRays {
    hierarchies: Hierarchies,
    triangles: Rows,
    roots: Arc<Buffer>,
    textures: SceneTextures,
    stack: u32,
    root_count: u32,
    triangle_count: u32,
    has_masks: bool,
    moving: Vec<Moving>,
}

impl SceneRays {
    /// Of a scene as it is on the device, and what making it cost.
    pub fn build(gpu: &Gpu, scene: &GpuScene) -> Result<(Self, FrameStats), Error> {
        let began = Instant::now();
        let rays = SceneRays::new(gpu, scene)?;
        Ok((rays, FrameStats::of_host(HOST_WORK[0], began)))
    }

    /// Of a scene as it is on the device.
    pub fn new(gpu: &Gpu, scene: &GpuScene) -> Result<Self, Error> {
        SceneRays::of(gpu, scene, Which::All)
    }

    /// Of what never moves in it.
    pub fn of_static(gpu: &Gpu, scene: &GpuScene) -> Result<Self, Error> {
        SceneRays::of(gpu, scene, Which::Static)
    }

    fn of(gpu: &Gpu, scene: &GpuScene, which: Which) -> Result<Self, Error> {
        let geometry = Geometry::read(gpu, scene)?;
        if geometry.triangles.len() > MOST_TRIANGLES {
            let feature = "numbers of more than 27 bits in a leaf (134,217,727 triangles)";
            return Err(too_many(geometry.triangles.len(), "triangles", feature));
        }
        let textures = SceneTextures::new(gpu, scene)?;
        let traced_by_device = gpu.traces_rays();
        let trees = Trees::new(scene, &geometry, which, !traced_by_device);
        drop(geometry);
        if trees.node_count() > MOST_NODES {
            let feature = "numbers of more than 23 bits in a traversal (8,388,608 nodes)";
            return Err(too_many(trees.node_count(), "nodes", feature));
        }
        if trees.depth > LONGEST_STACK {
            let feature = "a stack of more than 1024 nodes";
            return Err(too_many(trees.depth as usize, "levels of nodes", feature));
        }
        let (first_node, first_triangle) = trees.first_moving();
        let hierarchies = if traced_by_device {
            Hierarchies::Structures(Structures::new(gpu, &trees)?)
        } else {
            let nodes = (&trees.nodes[..], NODE_TEXELS);
            Hierarchies::Nodes(Rows::new(gpu, "bvh.nodes", nodes, first_node)?)
        };
        let triangles = (&trees.triangles[..], TRIANGLE_TEXELS);
        Ok(SceneRays {
            hierarchies,
            triangles: Rows::new(gpu, "bvh.triangles", triangles, first_triangle)?,
            roots: storage(gpu, ("bvh.roots", Owner::Store), cast_slice(&trees.roots))?,
            textures,
            // In steps, so that like scenes have one pipeline.
            stack: trees.depth.max(1).next_multiple_of(16),
            root_count: trees.roots.len() as u32,
            triangle_count: trees.triangle_count() as u32,
            has_masks: trees.has_masks,
            moving: trees.moving,
        })
    }

    /// Brings models up to where their vertices are: triangles and boxes. Returns what that cost.
    pub fn follow(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<FrameStats, Error> {
        let began = Instant::now();
        for (index, model) in self.moving.iter_mut().enumerate() {
            let positions = scene
                .dynamic
                .as_ref()
                .map(|dynamic| dynamic.positions_of(model.vertices()));
            let corners = model.corners(positions.unwrap_or_default());
            model.follow(&corners, &mut self.triangles);
            match &mut self.hierarchies {
                Hierarchies::Nodes(nodes) => model.refit(&corners, nodes),
                Hierarchies::Structures(structures) => {
                    structures.follow(gpu, index, &corners)?;
                }
            }
        }
        match &self.hierarchies {
            Hierarchies::Nodes(nodes) => nodes.upload(gpu)?,
            Hierarchies::Structures(structures) => structures.join(gpu)?,
        }
        self.triangles.upload(gpu)?;
        Ok(FrameStats::of_host(HOST_WORK[1], began))
    }

    /// Binds [`BINDINGS`] and gives [`CONSTANTS`].
    pub fn bind<'f>(&self, pass: PassBuilder<'f>) -> PassBuilder<'f> {
        let pass = match &self.hierarchies {
            Hierarchies::Nodes(nodes) => pass.bind("bvh_tree", &nodes.image),
            Hierarchies::Structures(structures) => pass.bind("bvh_tree", &structures.all),
        };
        pass.bind("bvh_triangles", &self.triangles.image)
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

/// A scene that has more of something than shaders have numbers for.
fn too_many(count: usize, what: &str, feature: &'static str) -> Error {
    Error::FeatureMissing {
        what: format!("rays through {count} {what}"),
        feature,
    }
}
