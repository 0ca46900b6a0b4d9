//! What rays walk through: the voxels of all levels, and their light, side by side.

use std::sync::Arc;

use super::RAYS;
use super::layout::{Layout, Place};
use super::update::Level;
use crate::gi::shared::voxel::build::buffer;
use crate::gi::shared::voxel::trace::blocks::RayBlocks;
use crate::gi::shared::voxel::trace::surfaces::{SURFACE_BYTES, pack_surfaces};
use crate::gi::shared::voxel::{LightSettings, Space, VoxelBox};
use crate::graph::{Bound, Buffer, Error, Frame, Gpu};

/// The voxels of all levels. Each level has room for as many as its window has.
pub(super) struct ClipmapSpace {
    layout: Layout,
    settings: LightSettings,
    /// A row a level, as the volume has them.
    rows: Arc<Buffer>,
    blocks: RayBlocks,
    surfaces: Arc<Buffer>,
    radiance: Arc<Buffer>,
    /// Voxels that there is room for, a level each.
    capacities: Vec<u32>,
    /// Whether a level's light is here.
    is_lit: Vec<bool>,
}

impl ClipmapSpace {
    /// Empty, and without room for voxels.
    pub(super) fn new(gpu: &Gpu, layout: Layout, settings: LightSettings) -> Result<Self, Error> {
        let levels = u64::from(layout.levels);
        Ok(ClipmapSpace {
            layout,
            settings,
            rows: buffer(gpu, "clipmap.ray_rows", 32 * levels)?,
            blocks: RayBlocks::new(gpu, layout.resolution, layout.levels)?,
            surfaces: buffer(gpu, "clipmap.surfaces", 0)?,
            radiance: buffer(gpu, "clipmap.radiance", 0)?,
            capacities: Vec::new(),
            is_lit: Vec::new(),
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
    ) -> Result<(), Error> {
        let capacity = |level: &Level| level.window.voxels.capacity();
        let capacities: Vec<u32> = levels.iter().map(capacity).collect();
        let grows = capacities != self.capacities;
        if grows {
            let count = capacities.iter().sum();
            self.surfaces = buffer(gpu, "clipmap.surfaces", SURFACE_BYTES * u64::from(count))?;
            let bytes = self.settings.radiance_bytes(count);
            self.radiance = buffer(gpu, "clipmap.radiance", bytes)?;
            self.is_lit = vec![false; capacities.len()];
            self.capacities = capacities;
        }
        let mut frame = Frame::new();
        for (index, level) in levels.iter().enumerate() {
            let (voxels, first_voxel) = (&level.window.voxels, self.first_voxel(index));
            let finer = index.checked_sub(1).map(|finer| &levels[finer]);
            let is_new = grows || !level.new.is_empty();
            // Empty cubes lie where places begin, which is where the outermost level does.
            let around = [finer, levels.last()].into_iter().flatten();
            if is_new || around.into_iter().any(|level| !level.new.is_empty()) {
                let hidden = finer.map_or(VoxelBox::NONE, |finer| {
                    let extent = self.layout.extent(finer.place.first);
                    let first = level.place.first;
                    VoxelBox {
                        low: extent.low - first,
                        end: extent.end - first,
                    }
                });
                let outermost = places[places.len() - 1].first << (levels.len() - 1 - index) as i32;
                let place = (level.place.first - outermost, hidden);
                let own = (voxels, first_voxel);
                self.blocks.pack(&mut frame, index as u32, own, place);
            }
            if is_new {
                let records = (&voxels.records, voxels.voxel_count);
                pack_surfaces(&mut frame, records, &self.surfaces, first_voxel);
            }
        }
        let outermost = places[places.len() - 1].first;
        let rows: Vec<_> = (0u32..)
            .zip(places)
            .map(|(level, place)| self.layout.rows(level, *place, outermost))
            .collect();
        gpu.upload_buffer(&self.rows, bytemuck::cast_slice(&rows))?;
        gpu.enqueue(frame);
        Ok(())
    }

    /// For a level whose voxels are lit anew.
    pub(super) fn forget_light(&mut self, index: usize) {
        self.is_lit[index] = false;
    }

    /// Adds the copies of the light of levels that is not here.
    pub(super) fn light(&mut self, frame: &mut Frame, levels: &[Level]) {
        for (index, level) in levels.iter().enumerate() {
            let count = level.window.voxels.voxel_count;
            let bytes = self.settings.radiance_bytes(count);
            if !std::mem::replace(&mut self.is_lit[index], true) && bytes > 0 {
                let first = self.settings.radiance_bytes(self.first_voxel(index));
                frame.copy_buffer(
                    "clipmap.merge_radiance",
                    (&level.light.radiance, 0),
                    (&self.radiance, first),
                    bytes,
                );
            }
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
                ("blocks", Bound::Image(self.blocks.image())),
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
