//! A technique by itself, in a scene whose models and camera move; and every texel of what it
//! keeps.

use std::sync::Arc;

use glam::Vec3;
use lumivox::gi::entry::Entry;
use lumivox::gi::shared::cone::{Bound, Volume};
use lumivox::gi::{Context, Settings, Technique};
use lumivox::graph::{Frame, Gpu, Image};
use lumivox::render::{GpuScene, LightMaps};
use lumivox::scene::Scene;

const SIZE: [u32; 2] = [8, 8];

/// A technique, its scene, and light maps.
pub struct Walker<'g> {
    gpu: &'g Gpu,
    scene: Scene,
    /// The scene on the device.
    pub gpu_scene: GpuScene,
    maps: LightMaps,
    /// The technique.
    pub technique: Box<dyn Technique>,
    /// That the last frame ran of the technique's own.
    pub passes: usize,
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
        };
        let mut technique = (entry.make)(&context, settings).unwrap();
        technique.build(&context).unwrap();
        let maps = LightMaps::new(gpu, &gpu_scene, 64, technique.needs_rsm()).unwrap();
        Walker {
            gpu,
            scene: scene.clone(),
            gpu_scene,
            maps,
            technique,
            passes: 0,
        }
    }

    /// Moves the models.
    pub fn set_time(&mut self, time_s: f32, eye: Vec3) {
        self.scene.set_time(time_s);
        self.gpu_scene.set_pose(self.gpu, &self.scene).unwrap();
        self.technique
            .set_pose(&Context {
                gpu: self.gpu,
                scene: &self.gpu_scene,
                size: SIZE,
                eye,
            })
            .unwrap();
    }

    /// Every texel of every level and mip, lit, for a camera at `eye`.
    pub fn texels(&mut self, eye: Vec3) -> Vec<Vec<u8>> {
        let Walker {
            gpu,
            scene,
            gpu_scene,
            maps,
            technique,
            passes,
        } = self;
        gpu_scene
            .set_frame(gpu, &gpu_scene.frame_constants(&scene.camera, SIZE))
            .unwrap();
        technique
            .set_view(&Context {
                gpu,
                scene: gpu_scene,
                size: SIZE,
                eye,
            })
            .unwrap();
        let mut frame = Frame::new();
        frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
        maps.draw(&mut frame, gpu_scene);
        technique.update(&mut frame, gpu_scene, maps);
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
    for bound in volume.bound {
        if let Bound::Image(image) = bound
            && image.name() != MATTER
            && !images.iter().any(|known| Arc::ptr_eq(known, image))
        {
            images.push(image);
        }
    }
    images
}

/// Where a volume's samples may see matter: no light.
const MATTER: &str = "voxel_mips.matter";

fn read(gpu: &Gpu, image: &Arc<Image>) -> Vec<Vec<u8>> {
    (0..image.mips())
        .map(|mip| gpu.read_image(image, mip, 0).unwrap())
        .collect()
}
