//! Technique `voxel-mips`: dense 3D textures with a full mip chain (Hong 2015, section 4.1),
//! cone-traced.

pub mod matter;
pub mod oracle;

use std::sync::Arc;

pub use matter::{MARK_MATTER, MatterParams, REDUCE_MATTER, mark_matter, matter_image};

use super::{Parts, Relit, VoxelCones, VoxelStore};
use crate::gi::entry::{Directions, Entry, Part, Stage, Substitution};
use crate::gi::settings::{Domain, Preset, Setting, Settings};
use crate::gi::shared::cone::volume::volume_passes;
use crate::gi::shared::cone::{self, Bound, ConeTracer, Constant, Volume, VolumePasses};
use crate::gi::shared::interleave;
use crate::gi::shared::voxel::build::linear_groups;
use crate::gi::shared::voxel::{
    self, Accumulation, Bounces, Directionality, DynamicVoxels, FACE_SETTINGS, LightSettings,
    MIP_FILTER, Prefilter, RAY_SETTINGS, RaySettings, Sides, VoxelGrid, VoxelLight, VoxelRecords,
    VoxelSettings, Voxelizer, Voxels, bounce_rays, gather_rays,
};
use crate::gi::{Context, LitVoxels, Technique, VoxelVolume};
use crate::gpu_struct;
use crate::graph::{
    Access, Binding, Error, Frame, FrameStats, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Pass,
    Sets, Shaders, vk,
};
use crate::render::{GBuffer, LightMaps};
use crate::shader::GpuStruct;

/// One mip, or its six faces, from the next finer one. Reads and writes RGBA16F, radiance
/// premultiplied by opacity; a thread a texel.
pub static FILTER: Pass = Pass {
    name: "voxel_mips.filter",
    shaders: Shaders::Compute("gi/voxel_cones/mips/filter.comp"),
    bindings: &[
        Binding::image("finer", Access::ComputeRead),
        Binding::image("coarser", Access::ComputeWrite),
    ],
    push_bytes: 0,
    sets: Sets::None,
};

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
pub static CLEAR_DYNAMIC: Pass = Pass {
    name: "voxel_mips.clear_dynamic",
    shaders: Shaders::Compute("gi/voxel_cones/mips/clear_dynamic.comp"),
    bindings: &[
        Binding::buffer("voxels", Access::ComputeRead),
        Binding::image("dense_radiance", Access::ComputeWrite),
    ],
    push_bytes: size_of::<ClearParams>() as u32,
    sets: Sets::None,
};

static SETTINGS: &[Setting] = &[
    Setting {
        name: "gather",
        help: "cones through the mips, or exact rays through the finest level (no mips are made \
               then)",
        unit: "",
        domain: Domain::Choice(&["cones", "rays"]),
        default: "cones",
    },
    MIP_FILTER,
    Setting {
        name: "mip_method",
        help: "of the box filter: compute, or blit (the hardware's linear filter)",
        unit: "",
        domain: Domain::Choice(&["compute", "blit"]),
        default: "compute",
    },
];

static PRESETS: &[Preset] = &[
    Preset {
        name: "accurate",
        help: "exact rays, interleaved over 4×4 pixels: the least error for its time where walls \
               are flat",
        values: &[&[("gather", "rays")]],
    },
    Preset {
        name: "cones",
        help: "cones as they converge best: narrow, interleaved, kept off the receiver's plane, \
               through mips that stay opaque",
        values: &[],
    },
    Preset {
        name: "anisotropic",
        help: "as cones, through mips that look different along each axis from either side",
        values: &[voxel::ANISOTROPIC],
    },
    Preset {
        name: "directional",
        help: "as cones, through voxels of six faces on all levels, either side of which blocks",
        values: &[voxel::DIRECTIONAL],
    },
    Preset {
        name: "textbook",
        help: "as the papers have it: box-filtered mips, six cones of 60°",
        values: &[&[("mip_filter", "box")], cone::TEXTBOOK],
    },
];

static SUBSTITUTIONS: &[Substitution] = &[
    Substitution {
        name: "directions",
        help: "as many directions as the gather's settings allow, so that no light falls between \
               them",
        pairs: |settings| {
            if settings.is("gather", "rays") {
                more_rays(settings)
            } else {
                cone::more_cones(settings)
            }
        },
    },
    Substitution {
        name: "filtering",
        help: "exact rays through the finest voxels, instead of samples of filtered ones",
        pairs: |settings| {
            if settings.is("gather", "rays") {
                Vec::new()
            } else {
                vec!["gather=rays".into()]
            }
        },
    },
];

/// 4,096 directions in each interleaving window.
fn more_rays(settings: &Settings) -> Vec<String> {
    vec![format!(
        "rays={}",
        (4096 / settings.count("interleave").pow(2)).max(settings.count("rays"))
    )]
}

/// The passes of cones through the mips.
pub static CONES: VolumePasses = volume_passes!(
    "gi/voxel_cones/mips",
    [
        Binding::sampled("voxels", Access::ComputeSampled),
        Binding::sampled("matter", Access::ComputeSampled),
        Binding::sampled("faces", Access::ComputeSampled),
    ]
);
static CONE_DIRECTIONS: [Directions; 2] = super::directions(&CONES);

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    name: "voxel-mips",
    summary: "dense voxel mips, cone-traced",
    bounces: |settings| Bounces::new(settings).count(),
    settings: &[
        voxel::RESOLUTION,
        voxel::SETTINGS,
        SETTINGS,
        FACE_SETTINGS,
        cone::SETTINGS,
        RAY_SETTINGS,
    ],
    check: cone::check,
    presets: PRESETS,
    passes: &[
        voxel::PASSES,
        &[&CLEAR_DYNAMIC, &MARK_MATTER, &REDUCE_MATTER, &FILTER],
        &CONES.all(),
        interleave::PASSES,
    ],
    structs: &[
        voxel::STRUCTS,
        &[
            (ClearParams::NAME, ClearParams::FIELDS),
            (MatterParams::NAME, MatterParams::FIELDS),
        ],
        cone::STRUCTS,
        interleave::STRUCTS,
    ],
    stages: &[
        &voxel::VOXELIZATION,
        &Stage {
            name: "clearing",
            part: Part::Store,
            passes: &["voxel_mips.clear", "voxel_mips.clear_dynamic"],
        },
        &Stage {
            name: "empty space",
            part: Part::Store,
            passes: &["voxel_mips.mark_matter", "voxel_mips.reduce_matter"],
        },
        &voxel::LIGHT_INJECTION,
        &Stage {
            name: "mip filtering",
            part: Part::Store,
            passes: &["voxel_mips.filter", "voxel_mips.blit"],
        },
        &voxel::BOUNCES,
        &super::GATHER,
        &super::SPECULAR,
        &cone::SOFT_SHADOWS,
    ],
    directions: &[
        CONE_DIRECTIONS[0],
        Directions {
            pass: &voxel::GATHER_RAYS,
            count: Some(|settings| settings.count("rays")),
        },
        CONE_DIRECTIONS[1],
    ],
    substitutions: &[SUBSTITUTIONS, voxel::SUBSTITUTIONS],
    voxels: Some(voxel::list_voxels),
    make,
};

/// What cones march through.
struct DenseVolume {
    /// RGBA16F, radiance premultiplied by opacity, n³ texels and all mips. Of anisotropic voxels
    /// there is no mip but the finest; of directional ones there are six faces, side by side
    /// along x.
    radiance: Arc<Image>,
    /// Likewise, all but the finest mip of anisotropic voxels, with six faces.
    coarser: Option<Arc<Image>>,
    directionality: Directionality,
    /// Where samples of it may see matter; one word without contents where no cones skip what is
    /// empty.
    matter: Arc<Image>,
    skips_empty: bool,
}

/// Voxels, their light and its mips.
pub struct Mips {
    filter: Prefilter,
    /// Whether the hardware's linear filter makes the mips.
    blits: bool,
    light_settings: LightSettings,
    bounce_directions: u32,
    /// Fragments can be added to a voxel and taken away again.
    is_exact: bool,
    rays: Option<RaySettings>,
    voxelizer: Voxelizer,
    /// Absent where nothing traces cones.
    volume: Option<DenseVolume>,
    lit: Option<(Voxels, VoxelLight)>,
    /// Only in a scene with dynamic models.
    dynamic: Option<DynamicVoxels>,
}

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(VoxelCones::<Mips>::new(
        context,
        settings,
        "voxel_mips",
    )?))
}

impl DenseVolume {
    fn new(
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
    fn mark_matter(&self, frame: &mut Frame, voxels: &Voxels) {
        if self.skips_empty {
            mark_matter(frame, &voxels.occupancy, &self.matter);
        }
    }

    fn as_volume(&self, grid: VoxelGrid) -> Volume<'_> {
        let faces = (self.directionality != Directionality::Isotropic).then(|| {
            let faces = self.coarser.as_ref().unwrap_or(&self.radiance);
            (faces, self.directionality)
        });
        volume(grid, &self.radiance, &self.matter, faces)
    }
}

/// The volume of a 3D texture with all mips, radiance premultiplied by opacity; where coarser
/// levels
/// have six faces, its finest level alone, and the levels with faces and which these are. `matter`:
/// where samples of it may be other than zero.
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
        bound: [radiance, matter, faces].map(Bound::Image),
        constants: [Constant::SkipsEmpty, Constant::Is(0)],
        directionality,
        sides: 1 + u32::from(directionality.faces().is_some()),
        voxels_across: grid.resolution,
        face_stride: 0,
    }
}

/// RGBA16F for the mips of so many cubes, side by side along x.
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
    })
}

/// Adds `voxel_mips.filter` for the mips of a volume from its finest one on, and for those of
/// `coarser`, which has the six faces of all other levels.
pub fn filter_mips(
    frame: &mut Frame,
    volume: &Arc<Image>,
    coarser: Option<&Arc<Image>>,
    filter: Prefilter,
) {
    let has_faces = |image: &Image| u32::from(image.extent(0)[0] > image.extent(0)[1]);
    let mut add = |finer: (&Arc<Image>, u32), mip: (&Arc<Image>, u32)| {
        let pass = frame
            .pass(&FILTER)
            .bind_mip(finer.0, finer.1)
            .bind_mip(mip.0, mip.1);
        pass.constants(&[filter as u32, has_faces(mip.0), has_faces(finer.0)])
            .dispatch(mip.0.extent(mip.1).map(|texels| texels.div_ceil(4)));
    };
    (1..volume.mips()).for_each(|mip| add((volume, mip - 1), (volume, mip)));
    if let Some(coarser) = coarser {
        add((volume, 0), (coarser, 0));
        (1..coarser.mips()).for_each(|mip| add((coarser, mip - 1), (coarser, mip)));
    }
}

impl Mips {
    fn add_mips(&self, frame: &mut Frame, is_last: bool) {
        // Rays see the finest level alone, so mips are for the picture only.
        let Some(volume) = self
            .volume
            .as_ref()
            .filter(|_| is_last || self.rays.is_none())
        else {
            return;
        };
        if self.blits {
            frame.blit_mips("voxel_mips.blit", &volume.radiance);
        } else {
            let coarser = volume.coarser.as_ref();
            filter_mips(frame, &volume.radiance, coarser, self.filter);
        }
    }

    fn radiance(&self) -> Option<&Arc<Image>> {
        self.volume.as_ref().map(|volume| &volume.radiance)
    }
}

impl VoxelStore for Mips {
    fn new(context: &Context<'_>, settings: &Settings, parts: &Parts) -> Result<Self, Error> {
        let Context { gpu, scene, .. } = *context;
        let directionality = Directionality::new(settings);
        let rays = settings
            .is("gather", "rays")
            .then(|| RaySettings::new(settings));
        let filter = Prefilter::new(settings);
        let skips_empty = parts.has_specular || parts.cones.needs_matter();
        let has_volume = rays.is_none() || parts.has_specular || parts.cones.is_beside_gather();
        let voxel_settings = VoxelSettings {
            faces: directionality.faces().filter(|_| has_volume),
            ..VoxelSettings::new(settings)
        };
        let sides = if voxel_settings.faces.is_some() {
            Sides::Two
        } else {
            Sides::One
        };
        let sides = rays.map_or(sides, |rays| rays.sides);
        let resolution = voxel_settings.resolution;
        Ok(Mips {
            filter,
            blits: directionality == Directionality::Isotropic
                && filter == Prefilter::Box
                && settings.is("mip_method", "blit"),
            light_settings: LightSettings {
                emission_apart: parts.has_patches,
                ..LightSettings::new(settings, sides)
            },
            bounce_directions: settings.count("bounce_directions"),
            is_exact: voxel_settings.accumulation == Accumulation::Exact,
            volume: has_volume
                .then(|| DenseVolume::new(gpu, resolution, directionality, skips_empty))
                .transpose()?,
            rays,
            voxelizer: Voxelizer::new(gpu, scene, voxel_settings)?,
            lit: None,
            dynamic: None,
        })
    }

    fn light_settings(&self) -> &LightSettings {
        &self.light_settings
    }

    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        // The old voxels go first, so that rebuilding needs no more memory than building.
        (self.lit, self.dynamic) = (None, None);
        let (voxels, mut stats) = if context.scene.dynamic.is_some() && self.is_exact {
            let (voxels, dynamic, stats) =
                self.voxelizer.run_dynamic(context.gpu, context.scene)?;
            self.dynamic = Some(dynamic);
            (voxels, stats)
        } else {
            self.voxelizer.run(context.gpu, context.scene)?
        };
        if let Some(volume) = &self.volume {
            let mut frame = Frame::new();
            frame.clear_image("voxel_mips.clear", &volume.radiance, [0.0; 4]);
            volume.mark_matter(&mut frame, &voxels);
            stats.append(context.gpu.submit(frame)?);
        }
        let light = VoxelLight::new(context.gpu, context.scene, &voxels, self.light_settings)?;
        self.lit = Some((voxels, light));
        Ok(stats)
    }

    fn follow_models(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        let (Some(dynamic), Some((voxels, light))) = (&mut self.dynamic, &mut self.lit) else {
            return self.build(context);
        };
        let mut stats = FrameStats::default();
        if let Some(volume) = &self.volume {
            let slots = dynamic.slots(voxels);
            let params = ClearParams {
                first_voxel: slots.start,
                voxel_count: slots.len() as u32,
            };
            let mut frame = Frame::new();
            frame
                .pass(&CLEAR_DYNAMIC)
                .bind(&voxels.records)
                .bind_mip(&volume.radiance, 0)
                .push(&params)
                .dispatch(linear_groups(params.voxel_count));
            stats.append(context.gpu.submit(frame)?);
        }
        stats.append(dynamic.update(context.gpu, context.scene, &mut self.voxelizer, voxels)?);
        if let Some(volume) = &self.volume {
            let mut frame = Frame::new();
            volume.mark_matter(&mut frame, voxels);
            stats.append(context.gpu.submit(frame)?);
        }
        light.follow(
            context.gpu,
            context.scene,
            voxels,
            dynamic.slots(voxels).start,
        )?;
        Ok(stats)
    }

    fn light(&mut self, frame: &mut Frame, maps: &LightMaps, is_last: bool) -> bool {
        let Some((voxels, light)) = &self.lit else {
            return false;
        };
        light.update(frame, voxels, maps, self.radiance());
        self.add_mips(frame, is_last);
        true
    }

    fn bounce(&self, frame: &mut Frame, cones: &ConeTracer) {
        let Some((voxels, light)) = &self.lit else {
            return;
        };
        let Some(irradiance) = &light.irradiance else {
            return;
        };
        if let Some(rays) = &self.rays {
            let (radiance, directions) = (&light.radiance, self.bounce_directions);
            bounce_rays(frame, voxels, radiance, irradiance, rays, directions);
        } else if let Some(volume) = self.volume() {
            cones.bounce(frame, &VoxelRecords::from(voxels), volume, irradiance);
        }
    }

    fn relight(&mut self, frame: &mut Frame, maps: &LightMaps, relit: Relit) {
        let Some((voxels, light)) = &self.lit else {
            return;
        };
        let records = VoxelRecords::from(voxels);
        light.relight(frame, &records, maps, self.radiance(), relit.viewer);
        self.add_mips(frame, relit.is_last);
    }

    fn volume(&self) -> Option<Volume<'_>> {
        let (voxels, _) = self.lit.as_ref()?;
        let volume = self.volume.as_ref()?;
        Some(volume.as_volume(voxels.grid))
    }

    fn is_gathered_by_cones(&self) -> bool {
        self.rays.is_none()
    }

    fn gather(&self, frame: &mut Frame, gbuffer: &GBuffer, target: &Arc<Image>) -> bool {
        if let (Some(rays), Some((voxels, light))) = (&self.rays, &self.lit) {
            gather_rays(frame, gbuffer, voxels, light, rays, target);
        }
        self.rays.is_some()
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
        self.lit
            .iter_mut()
            .map(|(voxels, light)| LitVoxels {
                voxels: VoxelRecords::from(&*voxels),
                light,
            })
            .collect()
    }

    fn voxel_size(&self) -> Option<f32> {
        let (voxels, _) = self.lit.as_ref()?;
        Some(voxels.grid.voxel_size)
    }

    fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let Some((voxels, light)) = &self.lit else {
            return Ok(Vec::new());
        };
        let mut counts = vec![
            ("fragments", u64::from(voxels.fragment_count)),
            (
                "voxels",
                u64::from(voxels.voxel_count - voxels.hidden_count),
            ),
        ];
        counts.extend(
            self.dynamic
                .as_ref()
                .map(|dynamic| ("dynamic_voxels", u64::from(dynamic.voxel_count))),
        );
        counts.extend(light.counts(gpu)?);
        Ok(counts)
    }
}
