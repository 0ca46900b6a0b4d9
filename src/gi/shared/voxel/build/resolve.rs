//! Fragments to voxels: a list of fragments a voxel, and of each list one record.

use std::ops::Range;
use std::sync::Arc;

use super::passes::{
    LINK_FRAGMENTS, LinkParams, OpposedParams, RESOLVE_OPPOSED, RESOLVE_VOXELS, RUNNING_AVERAGE,
    ResolveParams, Voxel,
};
use super::settings::Accumulation;
use super::{FragmentLists, GridBuffers, Triangles, Voxelizer, Voxels, average_image, buffer};
use crate::graph::compute::linear_groups;
use crate::graph::{Buffer, Error, Frame, FrameStats, Gpu, Image};
use crate::render::GpuScene;

impl Voxelizer {
    pub(super) fn resolve(
        &self,
        gpu: &Gpu,
        scene: &GpuScene,
        which: Triangles,
        GridBuffers {
            occupancy,
            block_bases,
            ..
        }: &GridBuffers,
        [fragments, emission]: [Arc<Buffer>; 2],
        [fragment_count, voxel_count]: [u32; 2],
    ) -> Result<(Voxels, FragmentLists, FrameStats), Error> {
        let is_dynamic = which == Triangles::Static;
        let capacity = u64::from(voxel_count)
            + if is_dynamic {
                u64::from(self.dynamic_room[1])
            } else {
                0
            };
        let lists = FragmentLists::new(gpu, [fragments, emission], capacity)?;
        let records = buffer(gpu, "voxel.records", size_of::<Voxel>() as u64 * capacity)?;
        let voxel_emission = scene
            .is_emissive
            .then(|| buffer(gpu, "voxel.emission", 16 * capacity))
            .transpose()?;
        let faces = self
            .settings
            .faces
            .map(|_| buffer(gpu, "voxel.faces", 8 * capacity))
            .transpose()?;
        let running = self.settings.accumulation == Accumulation::RunningAverage;
        let averages = if running {
            average_image(gpu, self.grid.resolution)?
        } else {
            Arc::clone(&self.no_image)
        };
        let mut frame = Frame::new();
        frame.fill("voxel.clear", &lists.heads, 0);
        if running {
            let link = LinkParams {
                resolution: self.grid.resolution,
                fragment_count,
                first_fragment: 0,
            };
            frame.clear_image("voxel.clear", &averages, 0);
            frame
                .pass(&RUNNING_AVERAGE)
                .bind("fragments", &lists.fragments)
                .bind("averages", &averages)
                .push(&link)
                .dispatch(linear_groups(fragment_count));
        }
        let (occupancy, block_bases) = (Arc::clone(occupancy), Arc::clone(block_bases));
        let (grid, lattice, emission, hidden_count) =
            (self.grid, self.grid.lattice(), voxel_emission, 0);
        let voxels = Voxels {
            grid,
            lattice,
            occupancy,
            block_bases,
            records,
            emission,
            faces,
            voxel_count,
            hidden_count,
            fragment_count,
            is_dynamic,
            filled: None,
        };
        self.add_resolve(
            &mut frame,
            scene,
            &voxels,
            &lists,
            &averages,
            [0..fragment_count, 0..voxel_count],
        );
        let stats = gpu.submit(frame)?;
        Ok((voxels, lists, stats))
    }

    /// A range of fragments into lists, and a range of voxels from their lists to records.
    fn add_resolve(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        voxels: &Voxels,
        lists: &FragmentLists,
        averages: &Arc<Image>,
        [fragments, slots]: [Range<u32>; 2],
    ) {
        let running = self.settings.accumulation == Accumulation::RunningAverage;
        let (fragment_count, voxel_count) = (fragments.len() as u32, slots.len() as u32);
        frame
            .pass(&LINK_FRAGMENTS)
            .bind("occupancy", &voxels.occupancy)
            .bind("block_bases", &voxels.block_bases)
            .bind("fragments", &lists.fragments)
            .bind("heads", &lists.heads)
            .push(&LinkParams {
                resolution: self.grid.resolution,
                fragment_count,
                first_fragment: fragments.start,
            })
            .dispatch(linear_groups(fragment_count));
        frame.fill("voxel.clear", &lists.opposed_count, 0);
        let voxel_emission = voxels.emission.as_ref().unwrap_or(&self.nothing);
        let emission_unit = scene.largest_emission.max(f32::MIN_POSITIVE);
        frame
            .pass(&RESOLVE_VOXELS)
            .bind("fragments", &lists.fragments)
            .bind("fragment_emission", &lists.emission)
            .bind("heads", &lists.heads)
            .bind("voxels", &voxels.records)
            .bind("voxel_emission", voxel_emission)
            .bind("averages", averages)
            .bind(
                "voxel_faces",
                voxels.faces.as_ref().unwrap_or(&self.nothing),
            )
            .bind("opposed", &lists.opposed)
            .bind("opposed_count", &lists.opposed_count)
            .constant("EMISSIVE", scene.is_emissive)
            .constant("COVERAGE", self.settings.coverage)
            .constant("RUNNING", running)
            .constant("FACES", self.settings.faces.map_or(0, |faces| faces as u32))
            .push(&ResolveParams {
                voxel_count,
                emission_unit,
                first_voxel: slots.start,
            })
            .dispatch(linear_groups(voxel_count));
        frame
            .pass(&RESOLVE_OPPOSED)
            .bind("fragments", &lists.fragments)
            .bind("fragment_emission", &lists.emission)
            .bind("heads", &lists.heads)
            .bind("voxels", &voxels.records)
            .bind("voxel_emission", voxel_emission)
            .bind("opposed", &lists.opposed)
            .bind("opposed_count", &lists.opposed_count)
            .constant("EMISSIVE", scene.is_emissive)
            .push(&OpposedParams { emission_unit })
            .dispatch_indirect(&lists.opposed_count, 0);
    }

    /// The same for dynamic geometry.
    pub(in crate::gi::shared::voxel) fn add_dynamic_resolve(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        voxels: &Voxels,
        lists: &FragmentLists,
        ranges: [Range<u32>; 2],
    ) {
        self.add_resolve(frame, scene, voxels, lists, &self.no_image, ranges);
    }
}
