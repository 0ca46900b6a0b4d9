//! What cones march through: a dense texture of radiance with all mips.

use std::sync::Arc;

use super::groups::FilterGroups;
use super::{mark_matter, matter_image};
use crate::gi::shared::cone::volume::volume_passes;
use crate::gi::shared::cone::{Volume, VolumePasses};
use crate::gi::shared::voxel::{
    DenseTexels, Directionality, NormalLobe, Prefilter, VoxelGrid, Voxels,
};
use crate::gpu_struct;
use crate::graph::compute::read;
use crate::graph::{
    Access, Binding, Bound, Error, Frame, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Owner,
    Pass, vk,
};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `voxel_mips.filter`.
    pub struct FilterParams {
        /// First word of the list of the mip's groups.
        pub first_word: u32,
    }
}

/// One mip, or its six faces, from the next finer one, in listed groups of 4³ texels. Reads and
/// writes RGBA16F, radiance premultiplied by opacity; a thread a texel.
pub static FILTER: Pass = Pass {
    constants: &["FILTER", "FACES", "FINER_FACES"],
    ..Pass::compute(
        "voxel_mips.filter",
        "gi/voxel_cones/mips/filter.comp",
        &[
            Binding::image("finer", Access::ComputeRead),
            Binding::image("coarser", Access::ComputeWrite),
            read("groups"),
        ],
        FilterParams::LAYOUT,
    )
};

const NORMALS_OF_VOXELS: &str = "normals_of_voxels";

/// The passes of cones through the mips.
pub static CONES: VolumePasses = volume_passes!(
    "gi/voxel_cones/mips",
    ["SKIP_EMPTY", ""],
    [
        Binding::sampled("voxels", Access::ComputeSampled),
        Binding::sampled("matter", Access::ComputeSampled),
        Binding::sampled("faces", Access::ComputeSampled),
        Binding::sampled(NORMALS_OF_VOXELS, Access::ComputeSampled),
    ]
);

/// What cones march through.
pub(super) struct DenseVolume {
    /// RGBA16F, radiance premultiplied by opacity, n³ texels and all mips. Anisotropic voxels have
    /// only the finest mip here. Directional ones have six faces, side by side along x.
    pub(super) radiance: Arc<Image>,
    /// The coarser mips of anisotropic voxels, in the same format, with six faces.
    pub(super) coarser: Option<Arc<Image>>,
    /// As `radiance`: the mean normal of what shines, times its luminance. Where voxels shine by
    /// it, in this way; then the radiance is that of both sides together.
    normals: Option<(NormalLobe, Arc<Image>)>,
    directionality: Directionality,
    /// Where samples of it may see matter; one word without contents where nothing asks.
    matter: Arc<Image>,
    has_matter: bool,
    /// Where mips are made; absent where the hardware's linear filter makes all of them.
    pub(super) groups: Option<FilterGroups>,
}

impl DenseVolume {
    pub(super) fn new(
        gpu: &Gpu,
        resolution: u32,
        (directionality, lobe): (Directionality, Option<NormalLobe>),
        [skips_empty, blits]: [bool; 2],
    ) -> Result<Self, Error> {
        let has_matter = skips_empty || !blits;
        let all = resolution.ilog2() + 1;
        let [cubes, mips] = match directionality {
            Directionality::Isotropic => [1, all],
            Directionality::Anisotropic => [1, 1],
            Directionality::Directional(_) => [6, all],
        };
        let has_coarser = directionality == Directionality::Anisotropic;
        let coarser_cubes = if has_coarser { 6 } else { 1 };
        Ok(DenseVolume {
            radiance: radiance_image(gpu, "voxel_mips.radiance", resolution, cubes, mips)?,
            coarser: has_coarser
                .then(|| radiance_image(gpu, "voxel_mips.faces", resolution / 2, 6, all - 1))
                .transpose()?,
            normals: lobe
                .map(|lobe| {
                    let image = radiance_image(gpu, "voxel_mips.normals", resolution, 1, all)?;
                    Ok::<_, Error>((lobe, image))
                })
                .transpose()?,
            directionality,
            matter: matter_image(gpu, if has_matter { resolution } else { 4 })?,
            has_matter,
            groups: (!blits)
                .then(|| FilterGroups::new(gpu, resolution, cubes.max(coarser_cubes)))
                .transpose()?,
        })
    }

    /// Adds the passes that mark where these voxels are.
    pub(super) fn mark_matter(&self, frame: &mut Frame, voxels: &Voxels) {
        if self.has_matter {
            mark_matter(frame, &voxels.occupancy, &self.matter);
        }
        if let Some(groups) = &self.groups {
            groups.list(frame, &self.matter);
        }
    }

    /// Adds the passes that empty the mips from `first` on.
    pub(super) fn clear_mips(&self, frame: &mut Frame, first: u32) {
        let images = [
            (Some(&self.radiance), first),
            (self.normals(), first),
            (self.coarser.as_ref(), 0),
        ];
        for (image, first) in images {
            if let Some(image) = image.filter(|image| first < image.mips()) {
                frame.clear_mips("voxel_mips.clear", image, first..image.mips(), [0.0; 4]);
            }
        }
    }

    /// Adds the passes that make the mips from the finest one on.
    pub(super) fn filter(&self, frame: &mut Frame, filter: Prefilter) {
        for image in self.finest() {
            match &self.groups {
                Some(groups) => filter_mips(frame, image, self.coarser.as_ref(), filter, groups),
                None => frame.blit_mips("voxel_mips.blit", image),
            }
        }
    }

    /// The textures whose mip 0 is written voxel by voxel.
    pub(super) fn finest(&self) -> impl Iterator<Item = &Arc<Image>> {
        std::iter::once(&self.radiance).chain(self.normals())
    }

    fn normals(&self) -> Option<&Arc<Image>> {
        self.normals.as_ref().map(|(_, image)| image)
    }

    /// The same, as lighting writes them.
    pub(super) fn texels(&self) -> DenseTexels<'_> {
        DenseTexels {
            radiance: &self.radiance,
            normals: self.normals(),
        }
    }

    pub(super) fn as_volume(&self, grid: VoxelGrid) -> Volume<'_> {
        let faces = (self.directionality != Directionality::Isotropic).then(|| {
            let faces = self.coarser.as_ref().unwrap_or(&self.radiance);
            (faces, self.directionality)
        });
        let mut volume = volume(grid, &self.radiance, &self.matter, faces);
        if let Some((lobe, normals)) = &self.normals {
            volume.bound[3] = Some((NORMALS_OF_VOXELS, Bound::Image(normals)));
            (volume.lobe, volume.sides) = (Some(*lobe), 2);
        }
        volume
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
            Some((NORMALS_OF_VOXELS, Bound::Image(radiance))),
            None,
            None,
        ],
        constants: [None; 2],
        directionality,
        lobe: None,
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

/// Adds `voxel_mips.filter` for the mips of a volume from its finest one on, or for those of
/// `coarser`, where that has the six faces of all other levels. Texels out of the listed groups
/// stay as they are.
pub fn filter_mips(
    frame: &mut Frame,
    volume: &Arc<Image>,
    coarser: Option<&Arc<Image>>,
    filter: Prefilter,
    groups: &FilterGroups,
) {
    let has_faces = |image: &Image| image.extent(0)[0] > image.extent(0)[1];
    let mut add = |level: u32, finer: (&Arc<Image>, u32), mip: (&Arc<Image>, u32)| {
        let (lists, first_word) = groups.of_mip(level);
        let pass = frame
            .pass(&FILTER)
            .bind_mip("finer", finer.0, finer.1)
            .bind_mip("coarser", mip.0, mip.1)
            .bind("groups", lists);
        pass.constant("FILTER", filter as u32)
            .constant("FACES", has_faces(mip.0))
            .constant("FINER_FACES", has_faces(finer.0))
            .push(&FilterParams { first_word })
            .dispatch_indirect(lists, 4 * u64::from(first_word));
    };
    if let Some(coarser) = coarser {
        add(1, (volume, 0), (coarser, 0));
        (1..coarser.mips()).for_each(|mip| add(mip + 1, (coarser, mip - 1), (coarser, mip)));
    } else {
        (1..volume.mips()).for_each(|mip| add(mip, (volume, mip - 1), (volume, mip)));
    }
}
