//! A technique by itself, in a scene whose models and camera move; and every texel of what it
//! keeps.

use std::sync::Arc;

use glam::Vec3;
use lumivox::gi::entry::Entry;
use lumivox::gi::registry;
use lumivox::gi::shared::cone::{Volume, VoxelVolume};
use lumivox::gi::shared::voxel::Space;
use lumivox::gi::voxel_cones::clipmap::Clipmap;
use lumivox::gi::voxel_cones::mips::Mips;
use lumivox::gi::voxel_cones::svo::Svo;
use lumivox::gi::voxel_cones::{VoxelCones, VoxelStore};
use lumivox::gi::{Change, Context, Inputs, MapNeeds, Settings, Technique};
use lumivox::graph::Bound;
use lumivox::graph::{Frame, Gpu, Image};
use lumivox::render::{Follows, GBuffer, GpuScene, LightMaps, Output};
use lumivox::scene::Scene;

const SIZE: [u32; 2] = [8, 8];

/// A technique of the family, whatever its store is.
pub trait WithVolumes: Technique {
    /// The volumes that it keeps, the light first.
    fn volumes(&self) -> Vec<VoxelVolume<'_>>;
    /// What rays go through.
    fn space(&self) -> Option<Space<'_>>;
}

impl<S: VoxelStore> WithVolumes for VoxelCones<S> {
    fn volumes(&self) -> Vec<VoxelVolume<'_>> {
        self.store.volumes()
    }

    fn space(&self) -> Option<Space<'_>> {
        self.store.space()
    }
}

fn make(entry: &Entry, context: &Context<'_>, settings: &Settings) -> Box<dyn WithVolumes> {
    let name = entry.name;
    match name {
        "voxel-mips" => Box::new(VoxelCones::<Mips>::new(context, settings, name).unwrap()),
        "svo" => Box::new(VoxelCones::<Svo>::new(context, settings, name).unwrap()),
        "clipmap" => Box::new(VoxelCones::<Clipmap>::new(context, settings, name).unwrap()),
        _ => panic!("{name} keeps no volumes"),
    }
}

/// A technique, its scene, and what frames are made of.
pub struct Walker<'g> {
    gpu: &'g Gpu,
    scene: Scene,
    /// The scene on the device.
    pub gpu_scene: GpuScene,
    maps: LightMaps,
    gbuffer: GBuffer,
    output: Output,
    /// The technique.
    pub technique: Box<dyn WithVolumes>,
    /// Number of the technique's own passes that the last frame ran.
    pub passes: usize,
    /// Frames are told that nothing but the camera has changed.
    pub is_still: bool,
}

impl<'g> Walker<'g> {
    /// Builds it for a camera at `eye`.
    pub fn new(gpu: &'g Gpu, scene: &Scene, entry: &Entry, settings: &Settings, eye: Vec3) -> Self {
        let gpu_scene = GpuScene::new(gpu, scene).unwrap();
        let context = Context {
            gpu,
            scene: &gpu_scene,
            size: SIZE,
            eye,
            lend: registry::lend,
        };
        let mut technique = make(entry, &context, settings);
        technique.build(&context).unwrap();
        let maps = LightMaps::new(
            gpu,
            &gpu_scene,
            64,
            technique.needs().maps == MapNeeds::Reflective,
        )
        .unwrap();
        let gbuffer = GBuffer::new(gpu, &gpu_scene, SIZE, Follows::Nothing).unwrap();
        Walker {
            gpu,
            scene: scene.clone(),
            gpu_scene,
            maps,
            gbuffer,
            output: Output::new(gpu, SIZE).unwrap(),
            technique,
            passes: 0,
            is_still: false,
        }
    }

    /// Moves the models.
    pub fn set_time(&mut self, time_s: f32, eye: Vec3) {
        self.scene.set_time(time_s);
        self.gpu_scene.set_pose(self.gpu, &self.scene).unwrap();
        let context = Context {
            gpu: self.gpu,
            scene: &self.gpu_scene,
            size: SIZE,
            eye,
            lend: registry::lend,
        };
        self.technique.follow(&context, Change::Models).unwrap();
    }

    /// Every texel of every level and mip, lit, for a camera at `eye`.
    pub fn texels(&mut self, eye: Vec3) -> Vec<Vec<u8>> {
        let Walker {
            gpu,
            scene,
            gpu_scene,
            maps,
            gbuffer,
            output,
            technique,
            passes,
            is_still,
        } = self;
        gpu_scene
            .set_frame(gpu, &gpu_scene.frame_constants(&scene.camera, SIZE))
            .unwrap();
        let context = Context {
            gpu,
            scene: gpu_scene,
            size: SIZE,
            eye,
            lend: registry::lend,
        };
        technique.follow(&context, Change::Camera).unwrap();
        let mut frame = Frame::new();
        frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
        maps.draw(&mut frame, gpu_scene);
        let given = Inputs {
            scene: gpu_scene,
            maps,
            rsm: maps,
            gbuffer,
            direct: &output.direct,
            is_still: *is_still,
        };
        technique.update(&mut frame, &given);
        let stats = gpu.submit(frame).unwrap();
        *passes = stats
            .passes
            .iter()
            .filter(|pass| !pass.name.starts_with("render."))
            .count();
        technique
            .volumes()
            .iter()
            .flat_map(|volume| images(volume.volume))
            .flat_map(|image| read(gpu, image))
            .collect()
    }

    /// A count of the report.
    pub fn count(&self, name: &str) -> u64 {
        let counts = self.technique.counts(self.gpu).unwrap();
        counts
            .iter()
            .find(|(known, _)| *known == name)
            .unwrap_or_else(|| panic!("{name} is not in {counts:?}"))
            .1
    }
}

/// The images of a volume that hold light; where the same one is bound twice, once.
fn images(volume: Volume<'_>) -> Vec<&Arc<Image>> {
    let mut images: Vec<&Arc<Image>> = Vec::new();
    for (_, bound) in volume.bound.into_iter().flatten() {
        if let Bound::Image(image) = bound
            && !PLACES.contains(&image.name())
            && !images.iter().any(|known| Arc::ptr_eq(known, image))
        {
            images.push(image);
        }
    }
    images
}

/// Images that say where light is, and hold none.
const PLACES: [&str; 3] = ["voxel_mips.matter", "clipmap.matter", "svo.indirection"];

fn read(gpu: &Gpu, image: &Arc<Image>) -> Vec<Vec<u8>> {
    (0..image.mips())
        .map(|mip| gpu.read_image(image, mip, 0).unwrap())
        .collect()
}
