//! Technique `voxel-mips`: dense 3D textures with a full mip chain (Hong 2015, section 4.1), cone-traced.

pub mod matter;
pub mod oracle;

use std::sync::Arc;

pub use matter::{MARK_MATTER, MatterParams, REDUCE_MATTER, mark_matter, matter_image};

use super::cone::{self, ConeTracer, Volume};
use super::interleave::{self, deinterleave};
use super::registry::{Directions, Entry, Part, Stage};
use super::settings::{Domain, Preset, Setting, Settings};
use super::voxel::{self, Injection, MIP_FILTER, Prefilter, RAY_SETTINGS, RaySettings, Sides, VoxelLight, VoxelSettings, Voxelizer, Voxels, gather_rays};
use super::{Context, IndirectLight, Technique};
use crate::graph::{Access, Binding, Error, Frame, FrameStats, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Pass, Sets, Shaders, vk};
use crate::render::{GBuffer, GpuScene, LightMaps, screen_image};
use crate::shader::GpuStruct;

/// One mip from the next finer one. Reads and writes RGBA16F, radiance premultiplied by opacity; a thread a texel.
pub static FILTER: Pass = Pass {
    name: "voxel_mips.filter",
    shaders: Shaders::Compute("gi/voxel_mips/filter.comp"),
    bindings: &[Binding::image("finer", Access::ComputeRead), Binding::image("coarser", Access::ComputeWrite)],
    push_bytes: 0,
    sets: Sets::None,
};

static SETTINGS: &[Setting] = &[
    Setting {
        name: "gather",
        help: "cones through the mips, or exact rays through the finest level (no mips are made then)",
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
    Preset { name: "accurate", help: "the best measured error per millisecond: exact rays, interleaved over 4×4 pixels", values: &[("gather", "rays")] },
    Preset {
        name: "cones",
        help: "cones as they converge best: narrow, interleaved, kept off the receiver's plane, through mips that stay opaque",
        values: &[],
    },
    Preset {
        name: "textbook",
        help: "as the papers have it: box-filtered mips, six cones of 60°",
        values: &[
            ("mip_filter", "box"),
            ("cone_set", "papers"),
            ("cones", "6"),
            ("aperture_scale", "1"),
            ("step_factor", "0.5"),
            ("opacity_exponent", "1"),
            ("height_clamp", "0"),
            ("start_offset", "1.5"),
            ("interleave", "1"),
        ],
    },
];

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    name: "voxel-mips",
    summary: "dense voxel mips, cone-traced",
    bounces: 1,
    settings: &[voxel::SETTINGS, SETTINGS, cone::SETTINGS, RAY_SETTINGS],
    presets: PRESETS,
    passes: &[voxel::PASSES, &[&MARK_MATTER, &REDUCE_MATTER, &FILTER], cone::PASSES, interleave::PASSES],
    structs: &[voxel::STRUCTS, &[(MatterParams::NAME, MatterParams::FIELDS)], cone::STRUCTS, interleave::STRUCTS],
    stages: &[
        &voxel::VOXELIZATION,
        &Stage { name: "clearing", part: Part::Store, passes: &["voxel_mips.clear"] },
        &Stage { name: "empty space", part: Part::Store, passes: &["voxel_mips.mark_matter", "voxel_mips.reduce_matter"] },
        &voxel::LIGHT_INJECTION,
        &Stage { name: "mip filtering", part: Part::Store, passes: &["voxel_mips.filter", "voxel_mips.blit"] },
        &Stage { name: "gather", part: Part::Picture, passes: &["cone.gather", "voxel.gather_rays", "gi.deinterleave"] },
        &Stage { name: "specular", part: Part::Picture, passes: &["cone.specular"] },
    ],
    directions: &[
        Directions { pass: &cone::GATHER, setting: Some("cones") },
        Directions { pass: &voxel::GATHER_RAYS, setting: Some("rays") },
        Directions { pass: &cone::SPECULAR, setting: None },
    ],
    voxels: Some(voxel::list_voxels),
    make,
};

/// What cones march through.
struct DenseVolume {
    /// RGBA16F, radiance premultiplied by opacity, n³ texels and all mips.
    radiance: Arc<Image>,
    /// Where samples of it may see matter.
    matter: Arc<Image>,
}

/// The technique and what it keeps.
struct VoxelMips {
    filter: Prefilter,
    /// Whether the hardware's linear filter makes the mips.
    blits: bool,
    injection: Injection,
    rays: Option<RaySettings>,
    cones: ConeTracer,
    interleave: u32,
    voxelizer: Voxelizer,
    /// Absent where nothing traces cones.
    volume: Option<DenseVolume>,
    store: Option<(Voxels, VoxelLight)>,
    light: IndirectLight,
    /// The gather's result before the tile's patterns are averaged; absent without interleaving.
    interleaved: Option<Arc<Image>>,
}

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    let Context { gpu, scene, size } = *context;
    let voxel_settings = VoxelSettings::new(settings);
    let rays = settings.is("gather", "rays").then(|| RaySettings::new(settings));
    let specular = scene.is_glossy && settings.is("specular", "on");
    let interleave = settings.count("interleave");
    let filter = Prefilter::new(settings);
    Ok(Box::new(VoxelMips {
        filter,
        blits: filter == Prefilter::Box && settings.is("mip_method", "blit"),
        injection: Injection::new(settings),
        volume: (rays.is_none() || specular).then(|| DenseVolume::new(gpu, voxel_settings.resolution)).transpose()?,
        rays,
        cones: ConeTracer::new(gpu, settings)?,
        interleave,
        voxelizer: Voxelizer::new(gpu, scene, voxel_settings)?,
        store: None,
        light: IndirectLight {
            diffuse: screen_image(gpu, "voxel_mips.diffuse", size)?,
            specular: specular.then(|| screen_image(gpu, "voxel_mips.specular", size)).transpose()?,
        },
        interleaved: (interleave > 1).then(|| screen_image(gpu, "voxel_mips.interleaved", size)).transpose()?,
    }))
}

impl DenseVolume {
    fn new(gpu: &Gpu, resolution: u32) -> Result<Self, Error> {
        let extent = [resolution; 3];
        let radiance = gpu.create_image(&ImageDesc {
            name: "voxel_mips.radiance".into(),
            extent,
            kind: ImageKind::D3,
            format: vk::Format::R16G16B16A16_SFLOAT,
            mips: ImageDesc::full_mips(extent),
            layers: 1,
            usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
        })?;
        Ok(DenseVolume { radiance, matter: matter_image(gpu, resolution)? })
    }

    fn as_volume(&self) -> Volume<'_> {
        Volume::Dense { radiance: &self.radiance, matter: &self.matter }
    }
}

impl VoxelMips {
    fn add_mips(&self, frame: &mut Frame, volume: &Arc<Image>) {
        if self.blits {
            frame.blit_mips("voxel_mips.blit", volume);
            return;
        }
        for mip in 1..volume.mips() {
            let groups = volume.extent(mip)[0].div_ceil(4);
            frame.pass(&FILTER).bind_mip(volume, mip - 1).bind_mip(volume, mip).constants(&[self.filter as u32]).dispatch([groups; 3]);
        }
    }
}

impl Technique for VoxelMips {
    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        // The old store goes first, so that rebuilding needs no more memory than building.
        self.store = None;
        let (voxels, mut stats) = self.voxelizer.run(context.gpu, context.scene)?;
        if let Some(volume) = &self.volume {
            let mut frame = Frame::new();
            frame.clear_image("voxel_mips.clear", &volume.radiance, [0.0; 4]);
            mark_matter(&mut frame, &voxels.occupancy, &volume.matter);
            stats.append(context.gpu.submit(frame)?);
        }
        let light = VoxelLight::new(context.gpu, context.scene, &voxels, self.injection, self.rays.map_or(Sides::One, |rays| rays.sides))?;
        self.store = Some((voxels, light));
        Ok(stats)
    }

    fn needs_rsm(&self) -> bool {
        self.injection == Injection::Rsm
    }

    fn update(&mut self, frame: &mut Frame, _scene: &GpuScene, maps: &LightMaps) {
        let Some((voxels, light)) = &self.store else { return };
        let radiance = self.volume.as_ref().map(|volume| &volume.radiance);
        light.update(frame, voxels, maps, radiance);
        if let Some(radiance) = radiance {
            self.add_mips(frame, radiance);
        }
    }

    fn gather(&mut self, frame: &mut Frame, _scene: &GpuScene, gbuffer: &GBuffer) -> IndirectLight {
        let Some((voxels, light)) = &self.store else { return self.light.clone() };
        let target = self.interleaved.as_ref().unwrap_or(&self.light.diffuse);
        match (&self.rays, &self.volume) {
            (Some(rays), _) => gather_rays(frame, gbuffer, voxels, light, rays, target),
            (None, Some(volume)) => self.cones.gather(frame, gbuffer, &voxels.grid, volume.as_volume(), target),
            (None, None) => unreachable!("cones have a volume to march through"),
        }
        if let Some(interleaved) = &self.interleaved {
            deinterleave(frame, gbuffer, interleaved, &self.light.diffuse, self.interleave);
        }
        if let (Some(specular), Some(volume)) = (&self.light.specular, &self.volume) {
            self.cones.specular(frame, gbuffer, &voxels.grid, volume.as_volume(), specular);
        }
        self.light.clone()
    }

    fn count_samples(&self, gpu: &Gpu, scene: &GpuScene, gbuffer: &GBuffer) -> Result<Vec<(&'static str, u64)>, Error> {
        let (Some((voxels, _)), Some(volume)) = (&self.store, &self.volume) else { return Ok(Vec::new()) };
        self.cones.count_samples(gpu, scene, gbuffer, &voxels.grid, volume.as_volume(), [self.rays.is_none(), self.light.specular.is_some()])
    }

    fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let Some((voxels, light)) = &self.store else { return Ok(Vec::new()) };
        let mut counts = vec![("fragments", u64::from(voxels.fragment_count)), ("voxels", u64::from(voxels.voxel_count))];
        counts.extend(light.counts(gpu)?);
        Ok(counts)
    }
}
