//! The triangles of a scene on the device, on the host.

use std::ops::Range;

use glam::Vec3;

use super::super::gpu_scene::GpuScene;
use crate::graph::{Error, Gpu};
use crate::scene::rays::units_of;

/// What a hierarchy is made of.
pub(super) struct Geometry {
    positions: Vec<Vec3>,
    /// Vertices of each triangle.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Material of each triangle.
    pub(super) materials: Vec<u32>,
    /// A power of two that brings coordinates near to 1.
    pub(super) units_per_m: f32,
}

impl Geometry {
    /// As the device has them now.
    pub(super) fn read(gpu: &Gpu, scene: &GpuScene) -> Result<Self, Error> {
        let buffers = &scene.buffers;
        let positions: Vec<[f32; 3]> = rows(&gpu.read_buffer(&buffers.positions)?);
        let mut triangles: Vec<[u32; 3]> = rows(&gpu.read_buffer(&buffers.triangle_vertices)?);
        let mut materials: Vec<u32> = rows(&gpu.read_buffer(&buffers.triangle_materials)?);
        // Buffers are no smaller than 16 bytes.
        let last = scene.batches.last();
        let count = last.map_or(0, |batch| batch.first_triangle + batch.triangle_count) as usize;
        triangles.truncate(count);
        materials.truncate(count);
        let positions: Vec<Vec3> = positions.into_iter().map(Vec3::from).collect();
        let units_per_m = units_of(positions.iter().copied().chain([scene.eye]));
        Ok(Geometry {
            positions,
            triangles,
            materials,
            units_per_m,
        })
    }

    /// The triangles that stand still, and then those of each model that may move.
    pub(super) fn groups(&self, scene: &GpuScene) -> Vec<Vec<u32>> {
        let models: Vec<_> = scene
            .dynamic
            .iter()
            .flat_map(|dynamic| dynamic.triangles())
            .collect();
        let all = 0..self.triangles.len();
        let stands_still = |triangle: &usize| !models.iter().any(|model| model.contains(triangle));
        let mut groups = vec![all.filter(stands_still).map(|index| index as u32).collect()];
        groups.extend(models.iter().map(|model| {
            let numbers = model.clone().map(|index| index as u32);
            numbers.collect::<Vec<u32>>()
        }));
        groups
    }

    /// The vertices of triangles, and those between them.
    pub(super) fn vertices(&self, triangles: &[u32]) -> Range<usize> {
        let all = || {
            let triangles = triangles.iter();
            triangles.flat_map(|triangle| self.triangles[*triangle as usize])
        };
        let first = all().min().unwrap_or(0) as usize;
        first..all().max().map_or(first, |last| last as usize + 1)
    }

    /// World-space corners of triangles (m).
    pub(super) fn corners(&self, triangles: &[u32]) -> Vec<[Vec3; 3]> {
        triangles.iter().map(|index| self.of(*index)).collect()
    }

    /// World-space corners of a triangle (m).
    pub(super) fn of(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|vertex| self.positions[vertex as usize])
    }
}

/// The whole rows of a buffer.
fn rows<T: bytemuck::Pod>(bytes: &[u8]) -> Vec<T> {
    let whole = bytes.len() / size_of::<T>() * size_of::<T>();
    bytemuck::pod_collect_to_vec(&bytes[..whole])
}
