//! Technique `clipmap`: nested grids around the camera, each twice the extent of the one before
//! (Panteleev 2014; McLaren 2014), cone-traced.

mod entry;
mod filled;
pub mod layout;
pub mod space;
mod update;
pub mod volume;

use std::sync::Arc;

use glam::{IVec3, Vec3};

pub use entry::ENTRY;
pub use layout::{Inner, Layout, Place};
use space::ClipmapSpace;
use update::Level;
pub use volume::ClipmapVolume;

use super::{Gatherer, Parts, Relit, VoxelStore};
use crate::gi::Context;
use crate::gi::settings::Settings;
use crate::gi::shared::cone::volume::volume_passes;
use crate::gi::shared::cone::{Volume, VolumePasses, VoxelVolume};
use crate::gi::shared::voxel::trace::space::space_passes;
use crate::gi::shared::voxel::{
    Directionality, Interior, LightInputs, LightSettings, NormalLobe, Prefilter, Space,
    SpacePasses, Surface, VoxelBox, VoxelLight, VoxelRecords, VoxelSettings, VoxelWindow,
    WindowScratch, add_counts,
};
use crate::graph::compute::read;
use crate::graph::{Access, Binding, Buffer, Error, Frame, FrameStats, Gpu};

/// The passes of cones through the levels.
pub static CONES: VolumePasses = volume_passes!(
    "gi/voxel_cones/clipmap",
    ["N", "LEVELS"],
    [
        Binding::buffer("levels", Access::ComputeRead),
        Binding::sampled("clipmap", Access::ComputeSampled),
        Binding::sampled("top", Access::ComputeSampled),
        Binding::sampled("matter", Access::ComputeSampled),
        Binding::sampled("normals_of_levels", Access::ComputeSampled),
        Binding::sampled("normals_of_top", Access::ComputeSampled),
    ]
);

/// The passes of rays through the levels.
pub static RAYS: SpacePasses = space_passes!(
    "gi/voxel_cones/clipmap",
    ["SIDES", "N", "LEVELS"],
    [
        read("levels"),
        Binding::sampled("blocks", Access::ComputeSampled),
        read("surfaces"),
        read("voxel_radiance")
    ]
);

/// Levels of voxels, their light and their texels.
pub struct Clipmap {
    layout: Layout,
    voxel_settings: VoxelSettings,
    light_settings: LightSettings,
    is_staggered: bool,
    /// The texels of all levels; absent where nothing traces cones.
    pub volume: Option<ClipmapVolume>,
    /// The voxels of all levels as rays go through them; absent where cones gather.
    space: Option<ClipmapSpace>,
    levels: Vec<Level>,
    /// The levels whose texels this frame makes anew.
    due: Vec<usize>,
    scratch: WindowScratch,
    /// The depths of tiles of the maps that have been bound since models moved last, and how often
    /// the maps had moved.
    bound: Option<(Arc<Buffer>, u64)>,
    /// Whether the shaders have been told where the levels are since the last build.
    is_placed: bool,
    /// Number of frames since the last build.
    frame: u32,
    /// Where dynamic models were at the last update.
    pose: Option<(Vec3, Vec3)>,
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
        let lobe = NormalLobe::new(settings);
        let sides = (parts.gatherer).sides(faces.is_some() || lobe.is_some());
        let light_settings = LightSettings {
            stores_faces: faces.is_some(),
            emission: parts.emission,
            ..LightSettings::new(settings, sides)
        };
        let filter = Prefilter::new(settings);
        let volume = (parts.gatherer.needs_volume(parts.has_cones))
            .then(|| ClipmapVolume::new(gpu, layout, filter, (directionality, lobe)));
        let space =
            (parts.gatherer.rays.is_some()).then(|| ClipmapSpace::new(gpu, layout, light_settings));
        Ok(Clipmap {
            layout,
            voxel_settings: VoxelSettings {
                faces,
                ..VoxelSettings::new(settings)
            },
            light_settings,
            is_staggered: settings.is("level_updates", "staggered"),
            volume: volume.transpose()?,
            space: space.transpose()?,
            levels: Vec::new(),
            due: Vec::new(),
            scratch: WindowScratch::new(gpu, scene)?,
            bound: None,
            is_placed: false,
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
        let interior = (self.voxel_settings.surface == Surface::Solid)
            .then(|| Interior::new(gpu, scene))
            .transpose()?;
        for level in 0..self.layout.levels {
            let window = VoxelWindow::new(
                gpu,
                scene,
                self.voxel_settings,
                (self.layout.anchor, self.layout.size_of(level)),
                interior.clone(),
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
        if let Some(volume) = &self.volume {
            volume.clear(&mut frame);
        }
        let mut stats = gpu.submit(frame)?;
        (self.bound, self.is_placed) = (None, false);
        (self.frame, self.pose) = (0, scene.dynamic.as_ref().map(|dynamic| dynamic.bounds));
        let places = self.layout.places(context.eye);
        // One after the other: the fragments of a whole level take much memory.
        for level in 0..self.levels.len() {
            stats.append(self.move_levels(context, level..level + 1, &places, &[])?);
        }
        self.tell_places(gpu, &places)?;
        stats.append(gpu.submit_waiting()?);
        // From here on slabs are voxelized, which have few fragments.
        let levels = self.levels.iter();
        let counts = levels.map(|level| level.window.voxels.fragment_count / 8);
        self.scratch = WindowScratch::with_room(gpu, scene, counts)?;
        Ok(stats)
    }

    fn follow_models(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        let Some(dynamic) = &context.scene.dynamic else {
            return Ok(FrameStats::default());
        };
        if self.levels.is_empty() {
            return self.build(context);
        }
        // What has moved may shadow anything.
        self.forget_lights();
        let places: Vec<Place> = self.levels.iter().map(|level| level.place).collect();
        let stood = self.pose.replace(dynamic.bounds);
        let stale: Vec<(Vec3, Vec3)> = stood.into_iter().chain([dynamic.bounds]).collect();
        self.follow(context, &places, &stale)
    }

    fn follow_camera(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        // What comes into view has models where they are by now.
        if let (Some((low, high)), Some(dynamic)) = (&mut self.pose, &context.scene.dynamic) {
            *low = low.min(dynamic.bounds.0);
            *high = high.max(dynamic.bounds.1);
        }
        self.follow(context, &self.places(context.eye), &[])
    }

    fn forget_lights(&mut self) {
        self.bound = None;
        self.levels
            .iter_mut()
            .for_each(|level| level.lit = VoxelBox::NONE);
    }

    fn is_lit(&self) -> bool {
        let changes = |index| self.is_changed(index);
        !self.is_staggered && !(0..self.levels.len()).any(changes)
    }

    fn light(&mut self, frame: &mut Frame, lights: LightInputs<'_>, _is_last: bool) -> bool {
        self.due = self.due();
        self.light_due(frame, lights);
        !self.due.is_empty()
    }

    fn bounce(&self, frame: &mut Frame, gatherer: &Gatherer) {
        let (volume, space) = (self.seen_by_voxels(), self.space());
        for Level { window, light, .. } in &self.levels {
            if let Some(irradiance) = &light.irradiance {
                let records = VoxelRecords::from(&window.voxels);
                gatherer.bounce(frame, &records, (volume, space.as_ref()), irradiance);
            }
        }
    }

    fn relight(&mut self, frame: &mut Frame, lights: LightInputs<'_>, relit: Relit) {
        for index in self.due.iter().copied() {
            let Level { window, light, .. } = &self.levels[index];
            let records = VoxelRecords::from(&window.voxels);
            light.relight(frame, &records, lights, None, relit.viewer);
            self.write_level(frame, index, self.levels[index].extent());
            if let Some(space) = &mut self.space {
                space.forget_light(index);
            }
        }
        if let Some(space) = &mut self.space {
            space.light(frame, &self.levels);
        }
        self.filter_top(frame, self.outermost().extent());
    }

    fn volume(&self) -> Option<Volume<'_>> {
        let outermost = self.levels.last()?;
        Some(self.volume.as_ref()?.as_volume(outermost.place))
    }

    fn space(&self) -> Option<Space<'_>> {
        let outermost = self.levels.last()?;
        Some(self.space.as_ref()?.as_space(outermost.place))
    }

    fn volumes(&self) -> Vec<VoxelVolume<'_>> {
        let volume = VoxelStore::volume(self).into_iter();
        let volumes = volume.map(|volume| VoxelVolume {
            name: "light",
            volume,
            levels: self.layout.levels + self.layout.top_mips(),
        });
        volumes.collect()
    }

    fn voxel_size(&self) -> Option<f32> {
        Some(self.layout.voxel_size)
    }

    fn largest_voxel(&self) -> Option<f32> {
        let outermost = self.layout.levels.saturating_sub(1);
        Some(self.layout.voxel_size * (1_u64 << outermost) as f32)
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
            add_counts(&mut counts, level.light.counts(gpu)?);
        }
        Ok(counts)
    }
}
