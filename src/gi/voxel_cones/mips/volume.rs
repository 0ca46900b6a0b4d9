//! What cones march through: a dense texture of radiance with all mips.

use std::sync::Arc;

use super::{mark_matter, matter_image};
use crate::gi::shared::cone::volume::volume_passes;
use crate::gi::shared::cone::{Volume, VolumePasses};
use crate::gi::shared::voxel::{Directionality, Prefilter, VoxelGrid, Voxels};
use crate::graph::{
    Access, Binding, Bound, Error, Frame, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Owner,
    Pass, Sets, Shaders, vk,
};

/// One mip, or its six faces, from the next finer one. Reads and writes RGBA16F, radiance
/// premultiplied by opacity; a thread a texel.
pub static FILTER: Pass = Pass {
    name: "voxel_mips.filter",
    shaders: Shaders::Compute("gi/voxel_cones/mips/filter.comp"),
    bindings: &[
        Binding::image("finer", Access::ComputeRead),
        Binding::image("coarser", Access::ComputeWrite),
    ],
    constants: &["FILTER", "FACES", "FINER_FACES"],
    params: None,
    sets: Sets::None,
};

/// The passes of cones through the mips.
pub static CONES: VolumePasses = volume_passes!(
    "gi/voxel_cones/mips",
    ["SKIP_EMPTY", ""],
    [
        Binding::sampled("voxels", Access::ComputeSampled),
        Binding::sampled("matter", Access::ComputeSampled),
        Binding::sampled("faces", Access::ComputeSampled),
    ]
);

/// What cones march through.
pub(super) struct DenseVolume {
    /// RGBA16F, radiance premultiplied by opacity, n³ texels and all mips. Anisotropic voxels have
    /// only the finest mip here. Directional ones have six faces, side by side along x.
    pub(super) radiance: Arc<Image>,
    /// The coarser mips of anisotropic voxels, in the same format, with six faces.
    pub(super) coarser: Option<Arc<Image>>,
    directionality: Directionality,
    /// Where samples of it may see matter; one word without contents where no cones skip what is
    /// empty.
    matter: Arc<Image>,
    skips_empty: bool,
}

impl DenseVolume {
    pub(super) fn new(
        gpu: &Gpu,
        resolution: u32,
        directionality: Directionality,
        skips_empty: bool,
    ) -> Result<Self, Error> {
        let all = resolution.ilog2() + 1;
        let [cubes, mips] = match directionality {
            Directionality::Isotropic => [1, all],
            Directionality::Anisotropic => [1, 1],
            Directionality::Directional(_) => [6, all],
        };
        let has_coarser = directionality == Directionality::Anisotropic;
        Ok(DenseVolume {
            radiance: radiance_image(gpu, "voxel_mips.radiance", resolution, cubes, mips)?,
            coarser: has_coarser
                .then(|| radiance_image(gpu, "voxel_mips.faces", resolution / 2, 6, all - 1))
                .transpose()?,
            directionality,
            matter: matter_image(gpu, if skips_empty { resolution } else { 4 })?,
            skips_empty,
        })
    }

    /// Adds the passes that mark where these voxels are.
    pub(super) fn mark_matter(&self, frame: &mut Frame, voxels: &Voxels) {
        if self.skips_empty {
            mark_matter(frame, &voxels.occupancy, &self.matter);
        }
    }

    pub(super) fn as_volume(&self, grid: VoxelGrid) -> Volume<'_> {
        let faces = (self.directionality != Directionality::Isotropic).then(|| {
            let faces = self.coarser.as_ref().unwrap_or(&self.radiance);
            (faces, self.directionality)
        });
        volume(grid, &self.radiance, &self.matter, faces)
    }
}

/// The volume of a 3D texture with all mips, radiance premultiplied by opacity; where coarser
/// levels have six faces, its finest level alone, and the levels with faces and which these are.
/// `matter`: where samples of it may be other than zero.
pub fn volume<'v>(
    grid: VoxelGrid,
    radiance: &'v Arc<Image>,
    matter: &'v Arc<Image>,
    faces: Option<(&'v Arc<Image>, Directionality)>,
) -> Volume<'v> {
    let (faces, directionality) = faces.unwrap_or((radiance, Directionality::Isotropic));
    Volume {
        passes: &CONES,
        grid,
        bound: [
            Some(("voxels", Bound::Image(radiance))),
            Some(("matter", Bound::Image(matter))),
            Some(("faces", Bound::Image(faces))),
            None,
        ],
        constants: [None; 2],
        directionality,
        sides: 1 + u32::from(directionality.faces().is_some()),
        voxels_across: grid.resolution,
        face_stride: 0,
    }
}

/// An RGBA16F image for the mips of several cubes, side by side along x.
pub fn radiance_image(
    gpu: &Gpu,
    name: &str,
    resolution: u32,
    cubes: u32,
    mips: u32,
) -> Result<Arc<Image>, Error> {
    gpu.create_image(&ImageDesc {
        name: name.into(),
        extent: [cubes * resolution, resolution, resolution],
        kind: ImageKind::D3,
        format: vk::Format::R16G16B16A16_SFLOAT,
        mips,
        layers: 1,
        usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
        owner: Owner::Store,
    })
}

/// Adds `voxel_mips.filter` for the mips of a volume from its finest one on, and for the mips of
/// `coarser`, which has the six faces of all other levels.
pub fn filter_mips(
    frame: &mut Frame,
    volume: &Arc<Image>,
    coarser: Option<&Arc<Image>>,
    filter: Prefilter,
) {
    let has_faces = |image: &Image| image.extent(0)[0] > image.extent(0)[1];
    let mut add = |finer: (&Arc<Image>, u32), mip: (&Arc<Image>, u32)| {
        let pass = frame
            .pass(&FILTER)
            .bind_mip("finer", finer.0, finer.1)
            .bind_mip("coarser", mip.0, mip.1);
        pass.constant("FILTER", filter as u32)
            .constant("FACES", has_faces(mip.0))
            .constant("FINER_FACES", has_faces(finer.0))
            .dispatch(mip.0.extent(mip.1).map(|texels| texels.div_ceil(4)));
    };
    (1..volume.mips()).for_each(|mip| add((volume, mip - 1), (volume, mip)));
    if let Some(coarser) = coarser {
        add((volume, 0), (coarser, 0));
        (1..coarser.mips()).for_each(|mip| add((coarser, mip - 1), (coarser, mip)));
    }
}
