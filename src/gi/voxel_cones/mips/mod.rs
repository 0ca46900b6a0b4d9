//! Technique `voxel-mips`: dense 3D textures with a full mip chain (Hong 2015, section 4.1),
//! cone-traced.

mod entry;
pub mod groups;
pub mod matter;
pub mod oracle;
pub mod volume;

pub use entry::ENTRY;
pub use groups::{FilterGroups, LIST_GROUPS};
pub use matter::{MARK_MATTER, MatterParams, REDUCE_MATTER, mark_matter, matter_image};
use volume::DenseVolume;
pub use volume::{CONES, FILTER, filter_mips, radiance_image, volume};

use super::{Gatherer, Parts, Relit, VoxelStore};
use crate::gi::Context;
use crate::gi::settings::Settings;
use crate::gi::shared::cone::{Volume, VoxelVolume};
use crate::gi::shared::voxel::trace::blocks::RayBlocks;
use crate::gi::shared::voxel::trace::space::space_passes;
use crate::gi::shared::voxel::{
    DenseTexels, Directionality, LightInputs, LightSettings, LitGrid, LitVoxels, NormalLobe,
    Prefilter, Space, SpacePasses, VoxelLight, VoxelRecords, VoxelSettings, Voxels, lit_grid,
};
use crate::gpu_struct;
use crate::graph::compute::linear_groups;
use crate::graph::compute::read;
use crate::graph::{Access, Binding, Error, Frame, FrameStats, Gpu, Pass};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `voxel_mips.clear_dynamic`.
    pub struct ClearParams {
        /// First record.
        pub first_voxel: u32,
        /// Number of records.
        pub voxel_count: u32,
    }
}

/// The texels of the voxels in touched blocks become empty. Reads records, writes RGBA16F; a thread
/// a voxel.
pub static CLEAR_DYNAMIC: Pass = Pass::compute(
    "voxel_mips.clear_dynamic",
    "gi/voxel_cones/mips/clear_dynamic.comp",
    &[
        Binding::buffer("voxels", Access::ComputeRead),
        Binding::image("cleared", Access::ComputeWrite),
    ],
    ClearParams::LAYOUT,
);

/// The passes of rays through the grid.
pub static RAYS: SpacePasses = space_passes!(
    "gi/voxel_cones/mips",
    ["SIDES"],
    [
        Binding::sampled("blocks", Access::ComputeSampled),
        read("voxel_records"),
        read("voxel_radiance")
    ]
);

/// The space of a dense grid of voxels with their light.
pub fn space<'v>(voxels: &'v Voxels, blocks: &'v RayBlocks, light: &'v VoxelLight) -> Space<'v> {
    Space {
        passes: &RAYS,
        grid: voxels.grid,
        bound: lit_grid::bound(voxels, blocks, light).to_vec(),
        constants: Vec::new(),
        sides: light.settings.sides,
        // A line crosses at most 3 n voxels of an n³ grid.
        cells: 3 * voxels.grid.resolution + 1,
    }
}

/// Voxels, their light and its mips.
pub struct Mips {
    filter: Prefilter,
    /// Whether cones gather the diffuse light.
    has_cones: bool,
    /// Absent where nothing traces cones.
    volume: Option<DenseVolume>,
    grid: LitGrid,
}

impl Mips {
    fn add_mips(&self, frame: &mut Frame, is_last: bool) {
        // Rays see the finest level alone, so mips are for the picture only.
        let Some(volume) = self.volume.as_ref().filter(|_| is_last || self.has_cones) else {
            return;
        };
        volume.filter(frame, self.filter);
    }

    fn texels(&self) -> Option<DenseTexels<'_>> {
        self.volume.as_ref().map(DenseVolume::texels)
    }
}

impl VoxelStore for Mips {
    fn new(context: &Context<'_>, settings: &Settings, parts: &Parts) -> Result<Self, Error> {
        let Context { gpu, scene, .. } = *context;
        let directionality = Directionality::new(settings);
        let filter = Prefilter::new(settings);
        let skips_empty = parts.has_cones || parts.gatherer.cones.needs_matter();
        let has_volume = parts.gatherer.needs_volume(parts.has_cones);
        let faces = directionality.faces().filter(|_| has_volume);
        let lobe = NormalLobe::new(settings);
        let sides = (parts.gatherer).sides(faces.is_some() || lobe.is_some());
        let voxel_settings = VoxelSettings {
            faces,
            ..VoxelSettings::new(settings)
        };
        let resolution = voxel_settings.resolution;
        let light_settings = LightSettings {
            emission: parts.emission,
            ..LightSettings::new(settings, sides)
        };
        let blits = directionality == Directionality::Isotropic
            && filter == Prefilter::Box
            && settings.is("mip_method", "blit");
        let has_rays = parts.gatherer.rays.is_some();
        Ok(Mips {
            filter,
            volume: has_volume
                .then(|| {
                    let texels = (directionality, lobe);
                    DenseVolume::new(gpu, resolution, texels, [skips_empty, blits])
                })
                .transpose()?,
            has_cones: !has_rays,
            grid: LitGrid::new(gpu, scene, voxel_settings, light_settings, has_rays)?,
        })
    }

    fn light_settings(&self) -> &LightSettings {
        self.grid.light_settings()
    }

    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        let stats = self.grid.build(context.gpu, context.scene)?;
        if let (Some(volume), Some((voxels, _))) = (&self.volume, &self.grid.lit) {
            let mut frame = Frame::new();
            volume.clear_mips(&mut frame, 0);
            volume.mark_matter(&mut frame, voxels);
            context.gpu.enqueue(frame);
        }
        Ok(stats)
    }

    fn follow_models(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        let (Some(dynamic), Some((voxels, _))) = (&self.grid.dynamic, &self.grid.lit) else {
            return self.build(context);
        };
        if let Some(volume) = &self.volume {
            let slots = dynamic.slots(voxels);
            let params = ClearParams {
                first_voxel: slots.start,
                voxel_count: slots.len() as u32,
            };
            let mut frame = Frame::new();
            if volume.groups.is_some() {
                volume.clear_mips(&mut frame, 1);
            }
            for image in volume.finest() {
                frame
                    .pass(&CLEAR_DYNAMIC)
                    .bind("voxels", &voxels.records)
                    .bind_mip("cleared", image, 0)
                    .push(&params)
                    .dispatch(linear_groups(params.voxel_count));
            }
            context.gpu.enqueue(frame);
        }
        let stats = self.grid.follow(context.gpu, context.scene)?;
        if let (Some(volume), Some((voxels, _))) = (&self.volume, &self.grid.lit) {
            let mut frame = Frame::new();
            volume.mark_matter(&mut frame, voxels);
            context.gpu.enqueue(frame);
        }
        Ok(stats)
    }

    fn light(&mut self, frame: &mut Frame, lights: LightInputs<'_>, is_last: bool) -> bool {
        let Some((voxels, light)) = &self.grid.lit else {
            return false;
        };
        light.update(frame, voxels, lights, self.texels());
        self.add_mips(frame, is_last);
        true
    }

    fn bounce(&self, frame: &mut Frame, gatherer: &Gatherer) {
        if let Some((voxels, light)) = &self.grid.lit
            && let Some(irradiance) = &light.irradiance
        {
            let through = (self.volume(), self.space());
            let records = VoxelRecords::from(voxels);
            gatherer.bounce(frame, &records, (through.0, through.1.as_ref()), irradiance);
        }
    }

    fn relight(&mut self, frame: &mut Frame, lights: LightInputs<'_>, relit: Relit) {
        let Some((voxels, light)) = &self.grid.lit else {
            return;
        };
        let records = VoxelRecords::from(voxels);
        light.relight(frame, &records, lights, self.texels(), relit.viewer);
        self.add_mips(frame, relit.is_last);
    }

    fn volume(&self) -> Option<Volume<'_>> {
        let (voxels, _) = self.grid.lit.as_ref()?;
        let volume = self.volume.as_ref()?;
        Some(volume.as_volume(voxels.grid))
    }

    fn space(&self) -> Option<Space<'_>> {
        let (voxels, light) = self.grid.lit.as_ref()?;
        Some(space(voxels, self.grid.blocks.as_ref()?, light))
    }

    fn volumes(&self) -> Vec<VoxelVolume<'_>> {
        let volumes = self.volume().into_iter().map(|volume| VoxelVolume {
            name: "light",
            levels: volume.grid.resolution.ilog2() + 1,
            volume,
        });
        volumes.collect()
    }

    fn lit_voxels(&mut self) -> Vec<LitVoxels<'_>> {
        self.grid
            .lit
            .iter_mut()
            .map(|(voxels, light)| LitVoxels {
                voxels: VoxelRecords::from(&*voxels),
                light,
            })
            .collect()
    }

    fn voxel_size(&self) -> Option<f32> {
        let (voxels, _) = self.grid.lit.as_ref()?;
        Some(voxels.grid.voxel_size)
    }

    fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        self.grid.counts(gpu)
    }
}
