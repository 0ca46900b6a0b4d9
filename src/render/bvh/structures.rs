//! The hierarchies of a scene as acceleration structures of the device.

use std::sync::Arc;

use glam::Vec3;

use super::trees::Trees;
use crate::graph::{AccelerationStructure, Error, Gpu, Owner};

/// A structure of each tree, and one of all of them.
pub(super) struct Structures {
    pub(super) all: Arc<AccelerationStructure>,
    /// Those of models that may move.
    moving: Vec<Arc<AccelerationStructure>>,
}

impl Structures {
    /// Of trees without nodes.
    pub(super) fn new(gpu: &Gpu, trees: &Trees) -> Result<Self, Error> {
        let owned = |name| (name, Owner::Store);
        let still_count = trees.roots.len() - trees.moving.len();
        let mut parts = Vec::new();
        for (index, corners) in trees.corners.iter().enumerate() {
            let moves = index >= still_count;
            parts.push(gpu.build_triangles(owned("bvh.blas"), &rows(corners), moves)?);
        }
        let moving = parts[still_count..].to_vec();
        let all = gpu.build_parts(owned("bvh.tlas"), parts)?;
        Ok(Structures { all, moving })
    }

    /// Brings a model that moves up to where its triangles are.
    pub(super) fn follow(
        &self,
        gpu: &Gpu,
        model: usize,
        corners: &[[Vec3; 3]],
    ) -> Result<(), Error> {
        gpu.follow_triangles(&self.moving[model], &rows(corners))
    }

    /// Joins all again, after models have moved.
    pub(super) fn join(&self, gpu: &Gpu) -> Result<(), Error> {
        if self.moving.is_empty() {
            return Ok(());
        }
        gpu.follow_parts(&self.all)
    }
}

fn rows(corners: &[[Vec3; 3]]) -> Vec<[[f32; 3]; 3]> {
    let row = |corners: &[Vec3; 3]| corners.map(|corner| corner.to_array());
    corners.iter().map(row).collect()
}
