//! Technique `voxel-mips`: dense 3D textures with a full mip chain (Hong 2015, section 4.1),
//! cone-traced.

pub mod matter;
pub mod oracle;

use std::sync::Arc;

pub use matter::{MARK_MATTER, MatterParams, REDUCE_MATTER, mark_matter, matter_image};

use crate::gi::registry::{Directions, Entry, Part, Stage, Substitution};
use crate::gi::settings::{Domain, Preset, Setting, Settings};
use crate::gi::shared::cone::{self, ConeTracer, EmissivePatches, Volume};
use crate::gi::shared::interleave::{self, deinterleave};
use crate::gi::shared::voxel::build::linear_groups;
use crate::gi::shared::voxel::{
    self, Accumulation, Bounces, Directionality, DynamicVoxels, FACE_SETTINGS, Injection,
    LightSettings, MIP_FILTER, Prefilter, RAY_SETTINGS, RaySettings, Sides, Viewer, VoxelLight,
    VoxelRecords, VoxelSettings, Voxelizer, Voxels, bounce_rays, gather_rays,
};
use crate::gi::{
    Context, IndirectLight, LitVoxels, Probe, ProbeAxis, ProbeSurface, Technique, VoxelVolume,
};
use crate::gpu_struct;
use crate::graph::{
    Access, Binding, Error, Frame, FrameStats, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Pass,
    Sets, Shaders, vk,
};
use crate::render::{GBuffer, GpuScene, LightMaps, Output, screen_image};
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
        cone::PASSES,
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
        &Stage {
            name: "gather",
            part: Part::Picture,
            passes: &[
                "cone.gather",
                "voxel.gather_rays",
                "cone.occlusion",
                "gi.deinterleave",
            ],
        },
        &Stage {
            name: "specular",
            part: Part::Picture,
            passes: &["cone.specular"],
        },
        &cone::SOFT_SHADOWS,
    ],
    directions: &[
        Directions {
            pass: &cone::GATHER.dense,
            count: Some(cone::diffuse_count),
        },
        Directions {
            pass: &voxel::GATHER_RAYS,
            count: Some(|settings| settings.count("rays")),
        },
        Directions {
            pass: &cone::SPECULAR.dense,
            count: None,
        },
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

/// The technique and what it keeps.
struct VoxelMips {
    filter: Prefilter,
    /// Whether the hardware's linear filter makes the mips.
    blits: bool,
    light_settings: LightSettings,
    bounce_directions: u32,
    /// Fragments can be added to a voxel and taken away again.
    is_exact: bool,
    rays: Option<RaySettings>,
    cones: ConeTracer,
    /// Of surfaces that emit, where cones see them.
    patches: Option<EmissivePatches>,
    interleave: u32,
    voxelizer: Voxelizer,
    /// Absent where nothing traces cones.
    volume: Option<DenseVolume>,
    store: Option<(Voxels, VoxelLight)>,
    /// Only in a scene with dynamic models.
    dynamic: Option<DynamicVoxels>,
    light: IndirectLight,
    /// The gather's result before the tile's patterns are averaged; absent without interleaving.
    interleaved: Option<Arc<Image>>,
}

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    let Context {
        gpu, scene, size, ..
    } = *context;
    let directionality = Directionality::new(settings);
    let rays = settings
        .is("gather", "rays")
        .then(|| RaySettings::new(settings));
    let specular = scene.is_glossy && settings.is("specular", "on");
    let interleave = settings.count("interleave");
    let filter = Prefilter::new(settings);
    let cones = ConeTracer::new(gpu, settings)?;
    let skips_empty = specular || cones.needs_matter();
    let has_volume = rays.is_none() || specular || cones.is_beside_gather();
    let voxel_settings = VoxelSettings {
        faces: directionality.faces().filter(|_| has_volume),
        ..VoxelSettings::new(settings)
    };
    let sides = if voxel_settings.faces.is_some() {
        Sides::Two
    } else {
        Sides::One
    };
    let patches = EmissivePatches::new(gpu, scene, settings)?;
    Ok(Box::new(VoxelMips {
        filter,
        blits: directionality == Directionality::Isotropic
            && filter == Prefilter::Box
            && settings.is("mip_method", "blit"),
        light_settings: LightSettings {
            emission_apart: patches.is_some(),
            ..LightSettings::new(settings, rays.map_or(sides, |rays| rays.sides))
        },
        bounce_directions: settings.count("bounce_directions"),
        is_exact: voxel_settings.accumulation == Accumulation::Exact,
        volume: has_volume
            .then(|| DenseVolume::new(gpu, voxel_settings.resolution, directionality, skips_empty))
            .transpose()?,
        rays,
        cones,
        patches,
        interleave,
        voxelizer: Voxelizer::new(gpu, scene, voxel_settings)?,
        store: None,
        dynamic: None,
        light: IndirectLight {
            diffuse: screen_image(gpu, "voxel_mips.diffuse", size)?,
            specular: specular
                .then(|| screen_image(gpu, "voxel_mips.specular", size))
                .transpose()?,
        },
        interleaved: (interleave > 1)
            .then(|| screen_image(gpu, "voxel_mips.interleaved", size))
            .transpose()?,
    }))
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

    fn as_volume(&self) -> Volume<'_> {
        let faces = (self.directionality != Directionality::Isotropic).then(|| {
            (
                self.coarser.as_ref().unwrap_or(&self.radiance),
                self.directionality,
            )
        });
        Volume::Dense {
            radiance: &self.radiance,
            matter: &self.matter,
            faces,
        }
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

impl VoxelMips {
    fn add_bounce(&self, frame: &mut Frame, voxels: &Voxels, light: &VoxelLight) {
        let Some(irradiance) = &light.irradiance else {
            return;
        };
        match (&self.rays, &self.volume) {
            (Some(rays), _) => bounce_rays(
                frame,
                voxels,
                &light.radiance,
                irradiance,
                rays,
                self.bounce_directions,
            ),
            (None, Some(volume)) => self.cones.bounce(
                frame,
                &voxels.grid,
                &VoxelRecords::from(voxels),
                volume.as_volume(),
                irradiance,
            ),
            (None, None) => unreachable!("cones have a volume to march through"),
        }
    }

    /// Lights the voxels once more, and their mips.
    fn relight(&self, frame: &mut Frame, maps: &LightMaps, viewer: Viewer) {
        let Some((voxels, light)) = &self.store else {
            return;
        };
        light.relight(
            frame,
            &VoxelRecords::from(voxels),
            maps,
            self.volume.as_ref().map(|volume| &volume.radiance),
            viewer,
        );
        if let Some(volume) = &self.volume {
            self.add_mips(frame, volume);
        }
    }

    fn add_mips(&self, frame: &mut Frame, volume: &DenseVolume) {
        if self.blits {
            frame.blit_mips("voxel_mips.blit", &volume.radiance);
        } else {
            filter_mips(
                frame,
                &volume.radiance,
                volume.coarser.as_ref(),
                self.filter,
            );
        }
    }
}

impl Technique for VoxelMips {
    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        // The old store goes first, so that rebuilding needs no more memory than building.
        (self.store, self.dynamic) = (None, None);
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
        self.store = Some((voxels, light));
        Ok(stats)
    }

    fn set_pose(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        if let Some(patches) = &mut self.patches {
            patches.follow(context.gpu, context.scene)?;
        }
        let (Some(dynamic), Some((voxels, light))) = (&mut self.dynamic, &mut self.store) else {
            return if context.scene.dynamic.is_some() {
                self.build(context)
            } else {
                Ok(FrameStats::default())
            };
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

    fn needs_rsm(&self) -> bool {
        self.light_settings.injection == Injection::Rsm
    }

    fn needs_light_maps(&self) -> bool {
        self.light_settings.reads_maps() || !self.cones.has_shadows()
    }

    fn update(&mut self, frame: &mut Frame, _scene: &GpuScene, maps: &LightMaps) {
        let Some((voxels, light)) = &self.store else {
            return;
        };
        let volume = self.volume.as_ref();
        let radiance = volume.map(|volume| &volume.radiance);
        light.update(frame, voxels, maps, radiance);
        let count = self.light_settings.bounces.before_the_picture();
        for bounce in 1..=count {
            // Rays see the finest level alone, so mips are for the picture only.
            if let (None, Some(volume)) = (&self.rays, volume) {
                self.add_mips(frame, volume);
            }
            self.add_bounce(frame, voxels, light);
            let viewer = if bounce == count {
                Viewer::Picture
            } else {
                Viewer::Voxels
            };
            light.relight(frame, &VoxelRecords::from(voxels), maps, radiance, viewer);
        }
        if let Some(volume) = volume {
            self.add_mips(frame, volume);
        }
        if self.light_settings.bounces == Bounces::Feedback {
            self.add_bounce(frame, voxels, light);
            if self.patches.is_some() {
                self.relight(frame, maps, Viewer::Picture);
            }
        }
    }

    fn gather(
        &mut self,
        frame: &mut Frame,
        _scene: &GpuScene,
        maps: &LightMaps,
        gbuffer: &GBuffer,
    ) -> IndirectLight {
        let Some((voxels, light)) = &self.store else {
            return self.light.clone();
        };
        let target = self.interleaved.as_ref().unwrap_or(&self.light.diffuse);
        match (&self.rays, &self.volume) {
            (Some(rays), _) => gather_rays(frame, gbuffer, voxels, light, rays, target),
            (None, Some(volume)) => {
                self.cones
                    .gather(frame, gbuffer, &voxels.grid, volume.as_volume(), target)
            }
            (None, None) => unreachable!("cones have a volume to march through"),
        }
        if let Some(volume) = &self.volume {
            self.cones
                .occlusion(frame, gbuffer, &voxels.grid, volume.as_volume(), target);
        }
        if let Some(interleaved) = &self.interleaved {
            deinterleave(
                frame,
                gbuffer,
                interleaved,
                &self.light.diffuse,
                self.interleave,
            );
        }
        if let (Some(patches), Some(volume)) = (&self.patches, &self.volume) {
            self.cones.patches(
                frame,
                gbuffer,
                &voxels.grid,
                volume.as_volume(),
                patches,
                &self.light.diffuse,
            );
        }
        if let (Some(specular), Some(volume)) = (&self.light.specular, &self.volume) {
            if self.patches.is_some() {
                self.relight(frame, maps, Viewer::Voxels);
            }
            self.cones
                .specular(frame, gbuffer, &voxels.grid, volume.as_volume(), specular);
        }
        self.light.clone()
    }

    fn direct(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        maps: &LightMaps,
        gbuffer: &GBuffer,
        output: &Output,
    ) {
        match (&self.store, &self.volume) {
            (Some((voxels, _)), Some(volume)) if self.cones.has_shadows() => {
                self.cones.shadow(
                    frame,
                    scene,
                    gbuffer,
                    &voxels.grid,
                    volume.as_volume(),
                    &output.direct,
                );
            }
            _ => output.draw_direct(frame, scene, maps, gbuffer),
        }
    }

    fn count_samples(
        &self,
        gpu: &Gpu,
        scene: &GpuScene,
        gbuffer: &GBuffer,
    ) -> Result<Vec<(&'static str, u64)>, Error> {
        let (Some((voxels, _)), Some(volume)) = (&self.store, &self.volume) else {
            return Ok(Vec::new());
        };
        self.cones.count_samples(
            gpu,
            scene,
            gbuffer,
            &voxels.grid,
            volume.as_volume(),
            [self.rays.is_none(), self.light.specular.is_some()],
        )
    }

    fn probe(
        &self,
        context: &Context<'_>,
        surface: &ProbeSurface,
        axis: ProbeAxis,
        aperture_deg: Option<f32>,
    ) -> Result<Option<Probe>, Error> {
        let (Some((voxels, _)), Some(volume)) = (&self.store, &self.volume) else {
            return Ok(None);
        };
        self.cones
            .probe(
                context,
                &voxels.grid,
                volume.as_volume(),
                surface,
                (axis, aperture_deg),
            )
            .map(Some)
    }

    fn volumes(&self) -> Vec<VoxelVolume<'_>> {
        let volume = self.volume.iter().zip(&self.store);
        volume
            .map(|(volume, (voxels, _))| VoxelVolume {
                name: "light",
                grid: voxels.grid,
                volume: volume.as_volume(),
                levels: voxels.grid.resolution.ilog2() + 1,
            })
            .collect()
    }

    fn lit_voxels(&mut self) -> Vec<LitVoxels<'_>> {
        self.store
            .iter_mut()
            .map(|(voxels, light)| LitVoxels {
                voxels: VoxelRecords::from(&*voxels),
                light,
            })
            .collect()
    }

    fn voxel_size(&self) -> Option<f32> {
        self.store
            .as_ref()
            .map(|(voxels, _)| voxels.grid.voxel_size)
    }

    fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let Some((voxels, light)) = &self.store else {
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
