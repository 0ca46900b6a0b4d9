//! Triangles to fragments.

use std::sync::Arc;

use super::Voxelizer;
use super::passes::{FRAGMENTS_COMPUTE, FRAGMENTS_RASTER, FRAGMENTS_RASTER_HW, FragmentParams};
use super::settings::{Method, Surface};
use crate::gi::shared::voxel::VoxelBox;
use crate::graph::{BatchDispatch, Buffer, DrawBatch, Frame, Targets};
use crate::render::{GpuScene, TextureUse};
use crate::scene::Batch;

impl Voxelizer {
    /// Fragments of some triangles in some voxels of the grid into `[occupancy, fragments,
    /// emission, counters]`, those beyond `capacity` counted only.
    pub(in crate::gi::shared::voxel) fn add_fragments(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        batches: &[Batch],
        clip: VoxelBox,
        [occupancy, fragments, emission, counters]: [&Arc<Buffer>; 4],
        capacity: u32,
    ) {
        // For a part of the grid, the batches are short runs of triangles.
        let alike = if clip == self.whole() {
            1
        } else {
            batches
                .iter()
                .map(|batch| batch.triangle_count.div_ceil(64))
                .sum()
        };
        let [clip_x, clip_y, clip_z] =
            (clip.low.as_uvec3() | (clip.end - 1).as_uvec3() << 16u32).to_array();
        let params = |batch: &Batch| FragmentParams {
            origin_inverse_size: self
                .whole_origin
                .extend(1.0 / self.grid.voxel_size)
                .to_array(),
            first_voxel: self.first_voxel.as_vec3().extend(self.grains).to_array(),
            resolution: self.grid.resolution,
            first_triangle: batch.first_triangle,
            triangle_count: batch.triangle_count,
            material: batch.material,
            capacity,
            emission_unit: scene.largest_emission.max(f32::MIN_POSITIVE),
            clip_x,
            clip_y,
            clip_z,
        };
        // A material pays for the textures that it has: one variant for each kind.
        for kind in TextureUse::ALL {
            let is_of = |batch: &&Batch| scene.texture_use[batch.material as usize] == kind;
            let batches: Vec<_> = batches.iter().filter(is_of).collect();
            if batches.is_empty() {
                continue;
            }
            let pass = match self.settings.method {
                Method::Compute => &FRAGMENTS_COMPUTE,
                Method::Raster => &FRAGMENTS_RASTER,
                Method::RasterHw => &FRAGMENTS_RASTER_HW,
            };
            let builder = frame
                .pass(pass)
                .bind("occupancy", occupancy)
                .bind("fragments", fragments)
                .bind("fragment_emission", emission)
                .bind("fragment_count", counters)
                .constant("EMISSIVE", scene.is_emissive)
                .constant("MASKED", kind == TextureUse::Masked)
                .constant("TEXTURED", kind != TextureUse::None)
                .constant("THIN", self.settings.surface == Surface::Thin);
            if self.settings.method == Method::Compute {
                let dispatch = |batch: &&Batch| BatchDispatch {
                    material: batch.material,
                    push: bytemuck::bytes_of(&params(batch)).to_vec(),
                    groups: self.triangle_groups(batch.triangle_count, alike),
                };
                builder.dispatch_batches(batches.iter().map(dispatch).collect());
            } else {
                let draw = |batch: &&Batch| DrawBatch {
                    material: batch.material,
                    push: bytemuck::bytes_of(&params(batch)).to_vec(),
                    first_vertex: 0,
                    vertex_count: 3 * batch.triangle_count,
                    ..Default::default()
                };
                builder.draw(
                    Targets::none([self.grid.resolution; 2]),
                    batches.iter().map(draw).collect(),
                );
            }
        }
    }

    /// Workgroups of 64 triangles, and how many share the columns of the same triangles where there
    /// are few: of the batch, or of many small ones `alike`.
    fn triangle_groups(&self, triangle_count: u32, alike: u32) -> [u32; 3] {
        let groups = triangle_count.div_ceil(64);
        let sharing = (64 / groups.max(alike)).clamp(1, self.grid.resolution.pow(2).div_ceil(256));
        [groups, sharing.max(self.sharing), 1]
    }
}
