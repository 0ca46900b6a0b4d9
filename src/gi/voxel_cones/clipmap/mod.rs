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

use super::{Parts, Relit, VoxelCones, VoxelStore};
use crate::gi::entry::{Entry, Part, Stage};
use crate::gi::settings::{Domain, Preset, Setting, Settings};
use crate::gi::shared::cone::volume::volume_passes;
use crate::gi::shared::cone::{self, ConeTracer, Volume, VolumePasses};
use crate::gi::shared::interleave;
use crate::gi::shared::voxel::{
    self, Bounces, Directionality, FACE_SETTINGS, LightSettings, MIP_FILTER, Prefilter, Sides,
    VoxelBox, VoxelLight, VoxelRecords, VoxelSettings, VoxelWindow, WindowScratch,
};
use crate::gi::{Context, Technique, VoxelVolume};
use crate::graph::{Access, Binding, Buffer, Error, Frame, FrameStats, Gpu, Pass};
use crate::render::LightMaps;
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

/// The passes of cones through the levels.
pub static CONES: VolumePasses = volume_passes!(
    "gi/voxel_cones/clipmap",
    [
        Binding::buffer("levels", Access::ComputeRead),
        Binding::sampled("clipmap", Access::ComputeSampled),
        Binding::sampled("top", Access::ComputeSampled),
    ]
);

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    name: "clipmap",
    summary: "nested voxel grids around the camera, cone-traced",
    bounces: |settings| Bounces::new(settings).count(),
    settings: &[SETTINGS, voxel::SETTINGS, FACE_SETTINGS, cone::SETTINGS],
    check: cone::check,
    presets: PRESETS,
    passes: &[voxel::PASSES, PASSES, &CONES.all(), interleave::PASSES],
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
        &super::GATHER,
        &super::SPECULAR,
        &cone::SOFT_SHADOWS,
    ],
    directions: &super::directions(&CONES),
    substitutions: &[cone::SUBSTITUTIONS, voxel::SUBSTITUTIONS],
    voxels: None,
    make,
};

/// Levels of voxels, their light and their texels.
pub struct Clipmap {
    layout: Layout,
    voxel_settings: VoxelSettings,
    light_settings: LightSettings,
    is_staggered: bool,
    /// Lights stand still.
    keeps_light: bool,
    /// The texels of all levels.
    pub volume: ClipmapVolume,
    levels: Vec<Level>,
    /// The levels whose texels this frame makes anew.
    due: Vec<usize>,
    scratch: WindowScratch,
    /// The depths of tiles of the maps that have been bound since models moved last.
    bound: Option<Arc<Buffer>>,
    /// Number of frames since the last build.
    frame: u32,
    /// Where dynamic models were at the last update.
    pose: Option<(Vec3, Vec3)>,
}

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(VoxelCones::<Clipmap>::new(
        context, settings, "clipmap",
    )?))
}

impl VoxelStore for Clipmap {
    fn new(context: &Context<'_>, settings: &Settings, parts: &Parts) -> Result<Self, Error> {
        let Context { gpu, scene, .. } = *context;
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
                emission_apart: parts.has_patches,
                ..LightSettings::new(settings, sides)
            },
            is_staggered: settings.is("level_updates", "staggered"),
            keeps_light: settings.is("light_updates", "on-change"),
            volume: ClipmapVolume::new(gpu, layout, Prefilter::new(settings), directionality)?,
            levels: Vec::new(),
            due: Vec::new(),
            scratch: WindowScratch::new(gpu, scene)?,
            bound: None,
            frame: 0,
            pose: None,
        })
    }

    fn light_settings(&self) -> &LightSettings {
        &self.light_settings
    }

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

    fn follow_models(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        let Some(dynamic) = &context.scene.dynamic else {
            return Ok(FrameStats::default());
        };
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

    fn follow_camera(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        self.follow(context, &self.places(context.eye), None)
    }

    fn forget_lights(&mut self) {
        self.bound = None;
        self.levels
            .iter_mut()
            .for_each(|level| level.lit = VoxelBox::NONE);
    }

    fn light(&mut self, frame: &mut Frame, maps: &LightMaps, _is_last: bool) -> bool {
        self.due = self.due();
        self.light_due(frame, maps);
        !self.due.is_empty()
    }

    fn bounce(&self, frame: &mut Frame, cones: &ConeTracer) {
        let Some(volume) = self.seen_by_voxels() else {
            return;
        };
        for Level { window, light, .. } in &self.levels {
            if let Some(irradiance) = &light.irradiance {
                cones.bounce(
                    frame,
                    &VoxelRecords::from(&window.voxels),
                    volume,
                    irradiance,
                );
            }
        }
    }

    fn relight(&mut self, frame: &mut Frame, maps: &LightMaps, relit: Relit) {
        for index in self.due.iter().copied() {
            let Level { window, light, .. } = &self.levels[index];
            let records = VoxelRecords::from(&window.voxels);
            light.relight(frame, &records, maps, None, relit.viewer);
            let (extent, inner) = (self.levels[index].extent(), self.inner(index).region());
            self.write_level(frame, index, extent, inner);
        }
        self.filter_top(frame, self.outermost().extent());
    }

    fn volume(&self) -> Option<Volume<'_>> {
        let outermost = self.levels.last()?;
        Some(self.volume.as_volume(outermost.place))
    }

    fn volumes(&self) -> Vec<VoxelVolume<'_>> {
        let volume = VoxelStore::volume(self).into_iter();
        let volumes = volume.map(|volume| VoxelVolume {
            name: "light",
            volume,
            levels: self.layout.levels + self.volume.top.mips(),
        });
        volumes.collect()
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
