//! What a volume holds on one of its levels, and how it divides space, as the camera sees it: for
//! looking at, and for comparing structures.

use std::sync::Arc;

use super::tracer::face_turns;
use super::volume::{ConeOutput, FaceWeights, March, Volume};
use crate::gpu_struct;
use crate::graph::{Access, Binding, Frame, Image};
use crate::render::screen_groups;

gpu_struct! {
    /// Parameters of `cone.view`.
    pub struct ViewVoxelsParams {
        /// xyz: smallest corner of the grid (m); w: voxel size (m).
        pub grid: [f32; 4],
        /// Voxels along an edge of the grid.
        pub resolution: f32,
        /// 0 the finest.
        pub level: f32,
        /// Where this dispatch begins, from where a ray enters the grid (voxels).
        pub begin_distance: f32,
        /// Where it ends (voxels).
        pub end_distance: f32,
        /// Of the volume, from a face of what it stores to the next.
        pub face_stride: u32,
    }
}

pub(in crate::gi) const BINDINGS: [Binding; 1] =
    [Binding::image("seen_texels", Access::ComputeReadWrite)];

/// A volume that can be looked at.
pub struct VoxelVolume<'v> {
    /// What it holds: `light` (radiance, W/(m² sr)), `albedo`, `normal` or `emission`.
    pub name: &'static str,
    /// Itself.
    pub volume: Volume<'v>,
    /// Levels that it has.
    pub levels: u32,
}

impl VoxelVolume<'_> {
    /// Adds the passes that write what the camera of the frame sees of a level into an RGBA32F
    /// image of the frame's size: premultiplied by opacity, opacity.
    pub fn view(&self, frame: &mut Frame, level: u32, seen: &Arc<Image>) {
        self.add_view(frame, level, seen, ConeOutput::Light);
    }

    /// As [`VoxelVolume::view`], of the cells that the volume divides space into in place of what
    /// they hold: of an octree, the nodes of the level that are not empty, with the ends of its
    /// tiles, and the empty nodes on coarser levels; of a clipmap, the level that each place is
    /// read from; of dense mips, texels.
    pub fn view_structure(&self, frame: &mut Frame, level: u32, seen: &Arc<Image>) {
        self.add_view(frame, level, seen, ConeOutput::Structure);
    }

    fn add_view(&self, frame: &mut Frame, level: u32, seen: &Arc<Image>, output: ConeOutput) {
        let volume = &self.volume;
        // A cell costs a turn of the march, and a turn a level of the loops that look for its
        // texel.
        let loops = frame.loops();
        let turns = 2 + loops.lanes + self.levels + face_turns(volume.directionality);
        let stretch = (loops.budget / (3 * turns)) as f32 * 2f32.powi(level as i32);
        let weights = FaceWeights::Extinction;
        let [width, height, _] = seen.extent(0);
        let mut begin_distance = 0.0;
        while begin_distance < 1.8 * volume.grid.resolution as f32 {
            let end_distance = begin_distance + stretch;
            let params = ViewVoxelsParams {
                grid: volume.grid.row(),
                resolution: volume.grid.resolution as f32,
                level: level as f32,
                begin_distance,
                end_distance,
                face_stride: volume.face_stride,
            };
            let march = March::new(false, output, weights);
            volume
                .pass(frame, &volume.passes.view, march)
                .bind("seen_texels", seen)
                .push(&params)
                .dispatch(screen_groups([width, height]));
            begin_distance = end_distance;
        }
    }
}
