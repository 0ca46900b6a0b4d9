//! What rays walk through: the voxels of all levels, and their light, side by side.

use std::sync::Arc;

use super::RAYS;
use super::layout::{Layout, Place};
use super::update::Level;
use crate::gi::shared::voxel::build::buffer;
use crate::gi::shared::voxel::trace::surfaces::{SURFACE_BYTES, pack_surfaces};
use crate::gi::shared::voxel::{LightSettings, Space};
use crate::gpu_struct;
use crate::graph::compute::{linear_groups, read, write};
use crate::graph::{Bound, Buffer, Error, Frame, FrameStats, Gpu, Pass};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `clipmap.pack_blocks`.
    pub struct PackBlocksParams {
        /// Blocks of a level.
        pub block_count: u32,
        /// Blocks of all finer levels.
        pub first_block: u32,
        /// Number of the level's first voxel among those of all levels.
        pub first_voxel: u32,
    }
}

/// Occupancy of a level's blocks, and the number of each block's first voxel. A thread a block.
pub static PACK_BLOCKS: Pass = Pass::compute(
    "clipmap.pack_blocks",
    "gi/voxel_cones/clipmap/pack_blocks.comp",
    &[read("occupancy"), read("block_bases"), write("blocks")],
    PackBlocksParams::LAYOUT,
);

/// Bytes of a block: its occupancy, and the number of its first voxel.
const BLOCK_BYTES: u64 = 12;

/// The voxels of all levels. Each level has room for as many as its window has.
pub(super) struct ClipmapSpace {
    layout: Layout,
    settings: LightSettings,
    /// A row a level, as the volume has them.
    rows: Arc<Buffer>,
    blocks: Arc<Buffer>,
    surfaces: Arc<Buffer>,
    radiance: Arc<Buffer>,
    /// Voxels that there is room for, a level each.
    capacities: Vec<u32>,
}

impl ClipmapSpace {
    /// Empty, and without room for voxels.
    pub(super) fn new(gpu: &Gpu, layout: Layout, settings: LightSettings) -> Result<Self, Error> {
        let levels = u64::from(layout.levels);
        let blocks = levels * u64::from(layout.resolution / 4).pow(3);
        Ok(ClipmapSpace {
            layout,
            settings,
            rows: buffer(gpu, "clipmap.ray_rows", 32 * levels)?,
            blocks: buffer(gpu, "clipmap.blocks", BLOCK_BYTES * blocks)?,
            surfaces: buffer(gpu, "clipmap.surfaces", 0)?,
            radiance: buffer(gpu, "clipmap.radiance", 0)?,
            capacities: Vec::new(),
        })
    }

    /// Number of a level's first voxel.
    fn first_voxel(&self, level: usize) -> u32 {
        self.capacities[..level].iter().sum()
    }

    /// Brings it up to the levels, of which some have moved.
    pub(super) fn follow(
        &mut self,
        gpu: &Gpu,
        levels: &[Level],
        places: &[Place],
    ) -> Result<FrameStats, Error> {
        let capacity = |level: &Level| level.window.voxels.capacity();
        let capacities: Vec<u32> = levels.iter().map(capacity).collect();
        let grows = capacities != self.capacities;
        if grows {
            let count = capacities.iter().sum();
            self.surfaces = buffer(gpu, "clipmap.surfaces", SURFACE_BYTES * u64::from(count))?;
            let bytes = self.settings.radiance_bytes(count);
            self.radiance = buffer(gpu, "clipmap.radiance", bytes)?;
            self.capacities = capacities;
        }
        let block_count = (self.layout.resolution / 4).pow(3);
        let mut frame = Frame::new();
        for (index, level) in levels.iter().enumerate() {
            if !grows && level.new.is_empty() {
                continue;
            }
            let (voxels, first_voxel) = (&level.window.voxels, self.first_voxel(index));
            frame
                .pass(&PACK_BLOCKS)
                .bind("occupancy", &voxels.occupancy)
                .bind("block_bases", &voxels.block_bases)
                .bind("blocks", &self.blocks)
                .push(&PackBlocksParams {
                    block_count,
                    first_block: block_count * index as u32,
                    first_voxel,
                })
                .dispatch(linear_groups(block_count));
            let records = (&voxels.records, voxels.voxel_count);
            pack_surfaces(&mut frame, records, &self.surfaces, first_voxel);
        }
        let outermost = places[places.len() - 1].first;
        let rows: Vec<_> = (0u32..)
            .zip(places)
            .map(|(level, place)| self.layout.rows(level, *place, outermost))
            .collect();
        gpu.upload_buffer(&self.rows, bytemuck::cast_slice(&rows))?;
        gpu.submit(frame)
    }

    /// Adds the copy of the light of a level's voxels.
    pub(super) fn light(&self, frame: &mut Frame, index: usize, level: &Level) {
        let bytes = self
            .settings
            .radiance_bytes(level.window.voxels.voxel_count);
        if bytes > 0 {
            let first = self.settings.radiance_bytes(self.first_voxel(index));
            frame.copy_buffer(
                "clipmap.merge_radiance",
                (&level.light.radiance, 0),
                (&self.radiance, first),
                bytes,
            );
        }
    }

    /// What rays go through, of levels whose outermost one is here.
    pub(super) fn as_space(&self, outermost: Place) -> Space<'_> {
        let (n, levels) = (self.layout.resolution, self.layout.levels);
        let mut grid = self.layout.grid(outermost.first);
        grid.resolution = n << (levels - 1);
        Space {
            passes: &RAYS,
            grid,
            bound: vec![
                ("levels", Bound::Buffer(&self.rows)),
                ("blocks", Bound::Buffer(&self.blocks)),
                ("surfaces", Bound::Buffer(&self.surfaces)),
                ("voxel_radiance", Bound::Buffer(&self.radiance)),
            ],
            constants: vec![("N", n), ("LEVELS", levels)],
            sides: self.settings.sides,
            // A line crosses at most 3 n voxels of each level, on either side of the finer one.
            cells: 3 * n * levels + 1,
        }
    }
}
