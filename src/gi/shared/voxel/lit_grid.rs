//! A dense grid of voxels around the scene, and their light.

use glam::IVec3;

use super::trace::blocks::RayBlocks;
use super::{
    Accumulation, DynamicVoxels, LightSettings, VoxelBox, VoxelLight, VoxelSettings, Voxelizer,
    Voxels,
};
use crate::graph::{Bound, Error, Frame, FrameStats, Gpu};
use crate::render::GpuScene;

/// Voxelizes the scene into one grid, keeps the voxels and their light, and follows models.
pub struct LitGrid {
    light_settings: LightSettings,
    /// Fragments can be added to a voxel and taken away again.
    is_exact: bool,
    /// Rays go through it.
    has_rays: bool,
    voxelizer: Voxelizer,
    /// The voxels and their light, after the first [`LitGrid::build`].
    pub lit: Option<(Voxels, VoxelLight)>,
    /// What rays read of them; absent where none do.
    pub blocks: Option<RayBlocks>,
    /// What moves among them; only in a scene with dynamic models.
    pub dynamic: Option<DynamicVoxels>,
}

/// What `gi/shared/voxel/trace/lit_grid.glsl` reads of a grid, by name.
pub fn bound<'v>(
    voxels: &'v Voxels,
    blocks: &'v RayBlocks,
    light: &'v VoxelLight,
) -> [(&'static str, Bound<'v>); 3] {
    [
        ("blocks", Bound::Image(blocks.image())),
        ("voxel_records", Bound::Buffer(&voxels.records)),
        ("voxel_radiance", Bound::Buffer(&light.radiance)),
    ]
}

fn pack(gpu: &Gpu, blocks: Option<&RayBlocks>, voxels: &Voxels) {
    let mut frame = Frame::new();
    if let Some(blocks) = blocks {
        blocks.pack(&mut frame, 0, (voxels, 0), (IVec3::ZERO, VoxelBox::NONE));
    }
    gpu.enqueue(frame);
}

impl LitGrid {
    /// Nothing is built yet. `has_rays`: rays go through it.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: VoxelSettings,
        light_settings: LightSettings,
        has_rays: bool,
    ) -> Result<Self, Error> {
        Ok(LitGrid {
            has_rays,
            blocks: None,
            light_settings,
            is_exact: settings.accumulation == Accumulation::Exact,
            voxelizer: Voxelizer::new(gpu, scene, settings)?,
            lit: None,
            dynamic: None,
        })
    }

    /// How far outside of a box in which models have moved (voxels) voxels may be others than
    /// before, or have other numbers: those of the blocks of 4×4×4 that models touch. None where
    /// all may.
    pub fn change_margin(&self) -> Option<f32> {
        self.dynamic.as_ref().map(|_| 1.0 + 4.0)
    }

    /// How the voxels are lit.
    pub fn light_settings(&self) -> &LightSettings {
        &self.light_settings
    }

    /// Voxelizes the scene with its models where they are, and makes room for the light.
    pub fn build(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<FrameStats, Error> {
        // The old voxels go first, so that rebuilding needs no more memory than building.
        (self.lit, self.blocks, self.dynamic) = (None, None, None);
        let (voxels, stats) = if scene.dynamic.is_some() && self.is_exact {
            let (voxels, dynamic, stats) = self.voxelizer.run_dynamic(gpu, scene)?;
            self.dynamic = Some(dynamic);
            (voxels, stats)
        } else {
            self.voxelizer.run(gpu, scene)?
        };
        let light = VoxelLight::new(gpu, scene, &voxels, self.light_settings)?;
        let blocks = (self.has_rays).then(|| RayBlocks::new(gpu, voxels.grid.resolution, 1));
        self.blocks = blocks.transpose()?;
        pack(gpu, self.blocks.as_ref(), &voxels);
        self.lit = Some((voxels, light));
        Ok(stats)
    }

    /// Brings the voxels up to the models after they have moved; builds them anew where they cannot
    /// follow.
    pub fn follow(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<FrameStats, Error> {
        let (Some(dynamic), Some((voxels, light))) = (&mut self.dynamic, &mut self.lit) else {
            return self.build(gpu, scene);
        };
        let (stats, _) = dynamic.update(gpu, scene, &mut self.voxelizer, voxels, None)?;
        pack(gpu, self.blocks.as_ref(), voxels);
        light.follow(gpu, scene, voxels, dynamic.slots(voxels).start)?;
        Ok(stats)
    }

    /// Counts of fragments, voxels and light, for the report.
    pub fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let Some((voxels, light)) = &self.lit else {
            return Ok(Vec::new());
        };
        let own = u64::from(voxels.voxel_count - voxels.hidden_count);
        let mut counts = vec![
            ("fragments", u64::from(voxels.fragment_count)),
            ("voxels", own),
        ];
        let dynamic = self.dynamic.as_ref();
        counts.extend(dynamic.map(|dynamic| ("dynamic_voxels", u64::from(dynamic.voxel_count))));
        counts.extend(light.counts(gpu)?);
        Ok(counts)
    }
}
