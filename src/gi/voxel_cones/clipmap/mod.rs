//! Technique `clipmap`: nested grids around the camera, each twice the extent of the one before
//! (Panteleev 2014; McLaren 2014), cone-traced.

pub mod layout;
mod update;
pub mod volume;

use std::sync::Arc;

use glam::{IVec3, Vec3};

pub use layout::{Inner, Layout, Place};
use update::Level;
pub use volume::ClipmapVolume;

use crate::gi::registry::{Directions, Entry, Part, Stage};
use crate::gi::settings::{Domain, Preset, Setting, Settings};
use crate::gi::shared::cone::{self, ConeTracer, EmissivePatches};
use crate::gi::shared::interleave::{self, deinterleave};
use crate::gi::shared::voxel::{
    self, Bounces, Directionality, FACE_SETTINGS, Injection, LightSettings, MIP_FILTER, Prefilter,
    Sides, Viewer, VoxelBox, VoxelLight, VoxelSettings, VoxelWindow, WindowScratch,
};
use crate::gi::{Context, IndirectLight, Probe, ProbeAxis, ProbeSurface, Technique, VoxelVolume};
use crate::graph::{Buffer, Error, Frame, FrameStats, Gpu, Image, Pass};
use crate::render::{GBuffer, GpuScene, LightMaps, Output, screen_image};
use crate::shader::{Field, GpuStruct};

static SETTINGS: &[Setting] = &[
    Setting {
        name: "resolution",
        help: "voxels along an edge of each level",
        unit: "voxels",
        domain: Domain::OneOf(&[16, 32, 64, 128, 256]),
        default: "128",
    },
    Setting {
        name: "levels",
        help: "levels, each twice the extent of the one before; those that the scene does not \
               fill are left out",
        unit: "",
        domain: Domain::Count { min: 1, max: 7 },
        default: "5",
    },
    Setting {
        name: "voxel_size",
        help: "edge of a voxel of the finest level; 0: such that the outermost level just holds \
               the scene",
        unit: "m",
        domain: Domain::Number { min: 0.0, max: 1e6 },
        default: "0",
    },
    Setting {
        name: "level_updates",
        help: "when a level follows the camera and the lights: every-frame, or staggered (level l \
               in every 2^l-th frame)",
        unit: "",
        domain: Domain::Choice(&["every-frame", "staggered"]),
        default: "every-frame",
    },
    Setting {
        name: "light_updates",
        help: "when voxels are lit: every-frame, or on-change (what is new in levels that move, \
               and everything when a light or a model does)",
        unit: "",
        domain: Domain::Choice(&["every-frame", "on-change"]),
        default: "every-frame",
    },
    MIP_FILTER,
];

static PRESETS: &[Preset] = &[
    Preset {
        name: "accurate",
        help: "as cones, but 32 of them and so narrow that they read the finest levels",
        values: &[cone::NARROWEST],
    },
    Preset {
        name: "cones",
        help: "cones as they converge best for their time: narrow, interleaved, kept off the \
               receiver's plane, through texels that stay opaque",
        values: &[],
    },
    Preset {
        name: "anisotropic",
        help: "as cones, through levels that look different along each axis from either side",
        values: &[voxel::ANISOTROPIC],
    },
    Preset {
        name: "directional",
        help: "as cones, through voxels of six faces on all levels, either side of which blocks",
        values: &[voxel::DIRECTIONAL],
    },
    Preset {
        name: "textbook",
        help: "as the papers have it: box-filtered levels, six cones of 60°",
        values: &[&[("mip_filter", "box")], cone::TEXTBOOK],
    },
];

/// The passes of this module.
pub static PASSES: &[&Pass] = &[
    &volume::WRITE_VOXELS,
    &volume::CLEAR_BOX,
    &volume::FILTER_INNER,
    &volume::FILTER_TOP,
];

/// The structs that this module shares with shaders.
pub static STRUCTS: &[(&str, &[Field])] = &[
    (volume::WriteParams::NAME, volume::WriteParams::FIELDS),
    (volume::ClearBoxParams::NAME, volume::ClearBoxParams::FIELDS),
    (volume::InnerParams::NAME, volume::InnerParams::FIELDS),
    (volume::TopParams::NAME, volume::TopParams::FIELDS),
];

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    name: "clipmap",
    summary: "nested voxel grids around the camera, cone-traced",
    bounces: |settings| Bounces::new(settings).count(),
    settings: &[SETTINGS, voxel::SETTINGS, FACE_SETTINGS, cone::SETTINGS],
    check: cone::check,
    presets: PRESETS,
    passes: &[
        voxel::PASSES,
        PASSES,
        cone::CLIPMAP_PASSES,
        interleave::PASSES,
    ],
    structs: &[voxel::STRUCTS, STRUCTS, cone::STRUCTS, interleave::STRUCTS],
    stages: &[
        &voxel::VOXELIZATION,
        &Stage {
            name: "clearing",
            part: Part::Store,
            passes: &["clipmap.clear", "clipmap.clear_box"],
        },
        &voxel::LIGHT_INJECTION,
        &Stage {
            name: "leaf writing",
            part: Part::Store,
            passes: &["clipmap.write_voxels"],
        },
        &Stage {
            name: "mip filtering",
            part: Part::Store,
            passes: &["clipmap.filter_inner", "clipmap.filter_top"],
        },
        &voxel::BOUNCES,
        &Stage {
            name: "gather",
            part: Part::Picture,
            passes: &["cone.gather", "cone.occlusion", "gi.deinterleave"],
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
            pass: &cone::GATHER.clipmap,
            count: Some(cone::diffuse_count),
        },
        Directions {
            pass: &cone::SPECULAR.clipmap,
            count: None,
        },
    ],
    substitutions: &[cone::SUBSTITUTIONS, voxel::SUBSTITUTIONS],
    voxels: None,
    make,
};

/// The technique and what it keeps.
pub struct Clipmap {
    layout: Layout,
    voxel_settings: VoxelSettings,
    light_settings: LightSettings,
    is_staggered: bool,
    /// Lights stand still.
    keeps_light: bool,
    cones: ConeTracer,
    /// Of surfaces that emit, where cones see them.
    patches: Option<EmissivePatches>,
    interleave: u32,
    /// The texels of all levels.
    pub volume: ClipmapVolume,
    levels: Vec<Level>,
    scratch: WindowScratch,
    /// The depths of tiles of the maps that have been bound since models moved last.
    bound: Option<Arc<Buffer>>,
    /// Number of frames since the last build.
    frame: u32,
    /// Where dynamic models were at the last update.
    pose: Option<(Vec3, Vec3)>,
    light: IndirectLight,
    /// The gather's result before the tile's patterns are averaged; absent without interleaving.
    interleaved: Option<Arc<Image>>,
}

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(Clipmap::new(context, settings)?))
}

impl Clipmap {
    /// Nothing is built yet.
    pub fn new(context: &Context<'_>, settings: &Settings) -> Result<Self, Error> {
        let Context {
            gpu, scene, size, ..
        } = *context;
        let specular = scene.is_glossy && settings.is("specular", "on");
        let interleave = settings.count("interleave");
        let patches = EmissivePatches::new(gpu, scene, settings)?;
        let layout = Layout::new(
            scene.bounds,
            settings.count("resolution"),
            settings.count("levels"),
            settings.number("voxel_size"),
        );
        let directionality = Directionality::new(settings);
        let faces = directionality.faces();
        let sides = if faces.is_some() {
            Sides::Two
        } else {
            Sides::One
        };
        Ok(Clipmap {
            layout,
            voxel_settings: VoxelSettings {
                faces,
                ..VoxelSettings::new(settings)
            },
            light_settings: LightSettings {
                stores_faces: faces.is_some(),
                emission_apart: patches.is_some(),
                ..LightSettings::new(settings, sides)
            },
            is_staggered: settings.is("level_updates", "staggered"),
            keeps_light: settings.is("light_updates", "on-change"),
            cones: ConeTracer::new(gpu, settings)?,
            patches,
            interleave,
            volume: ClipmapVolume::new(gpu, layout, Prefilter::new(settings), directionality)?,
            levels: Vec::new(),
            scratch: WindowScratch::new(gpu, scene)?,
            bound: None,
            frame: 0,
            pose: None,
            light: IndirectLight {
                diffuse: screen_image(gpu, "clipmap.diffuse", size)?,
                specular: specular
                    .then(|| screen_image(gpu, "clipmap.specular", size))
                    .transpose()?,
            },
            interleaved: (interleave > 1)
                .then(|| screen_image(gpu, "clipmap.interleaved", size))
                .transpose()?,
        })
    }
}

impl Technique for Clipmap {
    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        let Context { gpu, scene, .. } = *context;
        self.levels.clear();
        self.scratch = WindowScratch::new(gpu, scene)?;
        for level in 0..self.layout.levels {
            let window = VoxelWindow::new(
                gpu,
                scene,
                self.voxel_settings,
                self.layout.anchor,
                self.layout.size_of(level),
            )?;
            let light = VoxelLight::new(gpu, scene, &window.voxels, self.light_settings)?;
            self.levels.push(Level {
                window,
                light,
                place: Place {
                    first: IVec3::ZERO,
                    middle: Vec3::ZERO,
                },
                inner: Inner::NONE,
                lit: VoxelBox::NONE,
                stale: VoxelBox::NONE,
                new: Vec::new(),
            });
        }
        let mut frame = Frame::new();
        self.volume.clear(&mut frame);
        let mut stats = gpu.submit(frame)?;
        self.bound = None;
        (self.frame, self.pose) = (0, scene.dynamic.as_ref().map(|dynamic| dynamic.bounds));
        stats.append(self.follow(context, &self.layout.places(context.eye), None)?);
        // From here on slabs are voxelized, which have few fragments.
        self.scratch = WindowScratch::new(gpu, scene)?;
        Ok(stats)
    }

    fn set_pose(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        let Some(dynamic) = &context.scene.dynamic else {
            return Ok(FrameStats::default());
        };
        if let Some(patches) = &mut self.patches {
            patches.follow(context.gpu, context.scene)?;
        }
        if self.levels.is_empty() {
            return self.build(context);
        }
        let mut stats = FrameStats::default();
        // What has moved may shadow anything.
        self.forget_lights();
        let places: Vec<Place> = self.levels.iter().map(|level| level.place).collect();
        for bounds in [self.pose.replace(dynamic.bounds), Some(dynamic.bounds)] {
            stats.append(self.follow(context, &places, bounds)?);
        }
        Ok(stats)
    }

    fn set_view(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        self.follow(context, &self.places(context.eye), None)
    }

    fn forget_lights(&mut self) {
        self.bound = None;
        self.levels
            .iter_mut()
            .for_each(|level| level.lit = VoxelBox::NONE);
    }

    fn needs_rsm(&self) -> bool {
        self.light_settings.injection == Injection::Rsm
    }

    fn needs_light_maps(&self) -> bool {
        self.light_settings.reads_maps() || !self.cones.has_shadows()
    }

    fn update(&mut self, frame: &mut Frame, _scene: &GpuScene, maps: &LightMaps) {
        let due = self.due();
        if due.iter().any(|index| !self.levels[*index].is_lit()) {
            self.bound_tiles(frame, maps);
        }
        let mut changed = VoxelBox::NONE;
        for index in due.iter().copied() {
            changed = self.update_level(frame, maps, index);
            if let Some(coarser) = self.levels.get_mut(index + 1) {
                coarser.stale = coarser.stale.around(changed.coarser());
            }
        }
        self.frame += 1;
        if due
            .last()
            .is_some_and(|last| *last + 1 == self.levels.len())
        {
            self.filter_top(frame, changed);
        }
        if due.is_empty() {
            return;
        }
        let count = self.light_settings.bounces.before_the_picture();
        for bounce in 1..=count {
            self.bounce(frame);
            self.relight(
                frame,
                maps,
                &due,
                if bounce == count {
                    Viewer::Picture
                } else {
                    Viewer::Voxels
                },
            );
        }
        if self.light_settings.bounces == Bounces::Feedback {
            self.bounce(frame);
            if self.patches.is_some() {
                self.relight(frame, maps, &due, Viewer::Picture);
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
        let Some(outermost) = self.levels.last() else {
            return self.light.clone();
        };
        let (grid, volume) = (
            self.layout.grid(outermost.place.first),
            self.volume.as_volume(),
        );
        let target = self.interleaved.as_ref().unwrap_or(&self.light.diffuse);
        self.cones.gather(frame, gbuffer, &grid, volume, target);
        self.cones.occlusion(frame, gbuffer, &grid, volume, target);
        if let Some(interleaved) = &self.interleaved {
            deinterleave(
                frame,
                gbuffer,
                interleaved,
                &self.light.diffuse,
                self.interleave,
            );
        }
        if let Some(patches) = &self.patches {
            self.cones
                .patches(frame, gbuffer, &grid, volume, patches, &self.light.diffuse);
        }
        if let Some(specular) = &self.light.specular {
            if self.patches.is_some() {
                self.relight(
                    frame,
                    maps,
                    &(0..self.levels.len()).collect::<Vec<_>>(),
                    Viewer::Voxels,
                );
            }
            self.cones.specular(frame, gbuffer, &grid, volume, specular);
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
        match self.levels.last() {
            Some(outermost) if self.cones.has_shadows() => {
                self.cones.shadow(
                    frame,
                    scene,
                    gbuffer,
                    &self.layout.grid(outermost.place.first),
                    self.volume.as_volume(),
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
        let Some(outermost) = self.levels.last() else {
            return Ok(Vec::new());
        };
        let grid = self.layout.grid(outermost.place.first);
        self.cones.count_samples(
            gpu,
            scene,
            gbuffer,
            &grid,
            self.volume.as_volume(),
            [true, self.light.specular.is_some()],
        )
    }

    fn probe(
        &self,
        context: &Context<'_>,
        surface: &ProbeSurface,
        axis: ProbeAxis,
        aperture_deg: Option<f32>,
    ) -> Result<Option<Probe>, Error> {
        let Some(outermost) = self.levels.last() else {
            return Ok(None);
        };
        let grid = self.layout.grid(outermost.place.first);
        self.cones
            .probe(
                context,
                &grid,
                self.volume.as_volume(),
                surface,
                (axis, aperture_deg),
            )
            .map(Some)
    }

    fn volumes(&self) -> Vec<VoxelVolume<'_>> {
        let Some(outermost) = self.levels.last() else {
            return Vec::new();
        };
        let (grid, volume) = (
            self.layout.grid(outermost.place.first),
            self.volume.as_volume(),
        );
        vec![VoxelVolume {
            name: "light",
            grid,
            volume,
            levels: self.layout.levels + self.volume.top.mips(),
        }]
    }

    fn voxel_size(&self) -> Option<f32> {
        Some(self.layout.voxel_size)
    }

    fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let mut counts = vec![(
            "voxels",
            self.levels
                .iter()
                .map(|level| u64::from(level.window.voxels.voxel_count))
                .sum(),
        )];
        counts.push(("levels", self.levels.len() as u64));
        for level in &self.levels {
            for (name, count) in level.light.counts(gpu)? {
                match counts.iter_mut().find(|(known, _)| *known == name) {
                    Some((_, sum)) => *sum += count,
                    None => counts.push((name, count)),
                }
            }
        }
        Ok(counts)
    }
}
