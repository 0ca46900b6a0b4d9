//! What lies inside of closed bodies (`surface=solid`): voxels that no triangle touches, between a
//! surface that looks back along each axis and the next, which looks ahead (Villegas & Ramírez,
//! section XI).

use std::sync::Arc;

use super::passes::{COLUMNS, ColumnParams, FILL, FillParams};
use super::{Voxelizer, buffer};
use crate::gi::shared::voxel::VoxelBox;
use crate::graph::compute::linear_groups;
use crate::graph::{Buffer, Error, Frame, Gpu};
use crate::render::GpuScene;
use crate::render::bvh::SceneRays;

/// The static triangles of a scene, for finding what is inside of them.
pub struct Interior {
    rays: SceneRays,
    /// Smallest corner of all triangles (m).
    low: glam::Vec3,
}

impl Interior {
    /// Of a scene as it is on the device.
    pub fn new(gpu: &Gpu, scene: &GpuScene) -> Result<Arc<Self>, Error> {
        Ok(Arc::new(Interior {
            rays: SceneRays::of_static(gpu, scene)?,
            low: (scene.host.static_bounds()).map_or(glam::Vec3::ZERO, |(low, _)| low),
        }))
    }
}

/// Where columns keep what they find: a bit a voxel for each axis.
pub(super) fn columns_buffer(gpu: &Gpu, resolution: u32) -> Result<Arc<Buffer>, Error> {
    let n = u64::from(resolution);
    buffer(gpu, "voxel.inside", 3 * n * n * n.div_ceil(32) * 4)
}

impl Voxelizer {
    /// Fragments of what is inside of bodies, in some voxels of the grid, after those of surfaces;
    /// nothing where only surfaces are voxelized. As [`Voxelizer::add_fragments`].
    pub(in crate::gi::shared::voxel) fn add_interior(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        clip: VoxelBox,
        [occupancy, fragments, emission, counters]: [&Arc<Buffer>; 4],
        capacity: u32,
    ) {
        let (Some(interior), Some(inside)) = (&self.interior, &self.columns) else {
            return;
        };
        let size = (clip.end - clip.low).as_uvec3();
        let [clip_x, clip_y, clip_z] =
            (clip.low.as_uvec3() | (clip.end - 1).as_uvec3() << 16u32).to_array();
        let resolution = self.grid.resolution;
        frame.fill("voxel.clear", inside, 0);
        for axis in 0..3 {
            let [across, up] = [(axis + 1) % 3, (axis + 2) % 3].map(|axis| size[axis].div_ceil(8));
            interior
                .rays
                .bind(frame.pass(&COLUMNS))
                .bind("inside", inside)
                .push(&ColumnParams {
                    origin_size: self.grid.row(),
                    axis: axis as u32,
                    resolution,
                    clip_x,
                    clip_y,
                    clip_z,
                    start: interior.low[axis] - self.grid.voxel_size,
                })
                .dispatch([across, up, 1]);
        }
        frame
            .pass(&FILL)
            .bind("occupancy", occupancy)
            .bind("fragments", fragments)
            .bind("fragment_emission", emission)
            .bind("fragment_count", counters)
            .bind("inside", inside)
            .constant("EMISSIVE", scene.is_emissive)
            .push(&FillParams {
                resolution,
                clip_x,
                clip_y,
                clip_z,
                capacity,
            })
            .dispatch(linear_groups(size.x * size.y * size.z));
    }
}
