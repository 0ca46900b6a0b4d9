//! The volume while dynamic geometry comes and goes.
#![allow(clippy::unwrap_used)]

use glam::Vec3;

use super::*;
use crate::graph::GpuOptions;
use crate::scene::{Keyframe, Light, Material, Model, Motion, Pose, Scene, Triangle, Vertex};

/// A floor and a wall, and an emissive sheet that is outside of the grid at 0 s, in the wall at 1 s, over the floor at 2 s and outside again at 3 s.
fn scene() -> Scene {
    let mut scene = Scene::default();
    let mut quad = |material: Material, [a, b, c, d]: [[f32; 3]; 4]| {
        let first = scene.vertices.len() as u32;
        scene.vertices.extend([a, b, c, d].map(|position| Vertex { position, u: 0.0, normal: [0.0, 1.0, 0.0], v: 0.0 }));
        let index = scene.materials.len() as u32;
        scene.materials.push(material);
        scene.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|corners| Triangle { vertices: corners.map(|corner| first + corner), material: index }));
    };
    let matte = |albedo: [f32; 3]| Material { albedo: albedo.into(), ..Material::default() };
    quad(matte([0.7, 0.6, 0.5]), [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]]);
    quad(matte([0.2, 0.6, 0.3]), [[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 2.0, -1.0], [-1.0, 2.0, -1.0]]);
    let glowing = Material { emission: Vec3::new(3.0, 2.0, 1.0), ..matte([0.1, 0.2, 0.9]) };
    quad(glowing, [[-0.5, -0.4, 0.0], [0.5, -0.4, 0.0], [0.5, 0.4, 0.1], [-0.5, 0.4, 0.1]]);
    let pose = |rotate_deg: [f32; 3], translate: [f32; 3]| Pose { rotate_deg: rotate_deg.into(), translate: translate.into() };
    let poses = [pose([0.0; 3], [9.0, 0.0, 0.0]), pose([0.0; 3], [0.2, 1.0, -1.0]), pose([80.0, 20.0, 0.0], [0.3, 0.4, 0.1]), pose([0.0; 3], [0.0, 0.0, 50.0])];
    let keyframes = (0u8..).zip(poses).map(|(second, pose)| Keyframe { time_s: f32::from(second), pose }).collect();
    let motion = Some(Motion { first_vertex: 8, rest: scene.vertices[8..].to_vec(), keyframes });
    scene.models.push(Model { name: "sheet".into(), dynamic: true, first_triangle: 4, triangle_count: 2, motion });
    scene.lights = vec![Light::Point { position: Vec3::new(0.3, 1.7, 0.8), intensity: Vec3::splat(5.0) }];
    scene.set_time(0.0);
    scene
}

/// The technique, its scene, and light maps.
struct Setup<'g> {
    gpu: &'g Gpu,
    scene: GpuScene,
    maps: LightMaps,
    technique: VoxelMips,
}

const SIZE: [u32; 2] = [8, 8];

impl<'g> Setup<'g> {
    fn new(gpu: &'g Gpu, scene: &Scene, settings: &Settings) -> Self {
        let gpu_scene = GpuScene::new(gpu, scene).unwrap();
        let context = Context { gpu, scene: &gpu_scene, size: SIZE, eye: glam::Vec3::ZERO };
        let mut technique = super::new(&context, settings).unwrap();
        technique.build(&context).unwrap();
        let maps = LightMaps::new(gpu, &gpu_scene, 64, technique.needs_rsm()).unwrap();
        Setup { gpu, scene: gpu_scene, maps, technique }
    }

    fn go_to(&mut self, scene: &mut Scene, time_s: f32) {
        scene.set_time(time_s);
        self.scene.set_pose(self.gpu, scene).unwrap();
        self.technique.set_pose(&Context { gpu: self.gpu, scene: &self.scene, size: SIZE, eye: glam::Vec3::ZERO }).unwrap();
    }

    /// Every texel of every mip, lit.
    fn volume(&mut self, scene: &Scene) -> Vec<Vec<u8>> {
        self.scene.set_frame(self.gpu, &self.scene.frame_constants(&scene.camera, SIZE)).unwrap();
        let mut frame = Frame::new();
        frame.set_scene(&self.scene.set, &self.scene.materials);
        self.maps.draw(&mut frame, &self.scene);
        self.technique.update(&mut frame, &self.scene, &self.maps);
        self.gpu.submit(frame).unwrap();
        let volume = self.technique.volume.as_ref().unwrap();
        (0..volume.radiance.mips()).map(|mip| self.gpu.read_image(&volume.radiance, mip, 0).unwrap()).collect()
    }
}

/// Every bit of the volume is that of a technique built with the model there, and after the model has left, that from before it came.
#[test]
fn the_volume_follows_dynamic_geometry_and_forgets_it() {
    let gpu = Gpu::new(&GpuOptions { validate: true, ..GpuOptions::default() }).unwrap();
    for pairs in [&["resolution=32"][..], &["resolution=32", "injection=voxel", "opacity=coverage"], &["resolution=16", "mip_filter=box"]] {
        let settings = ENTRY.settings(Some("cones"), pairs).unwrap();
        let mut scene = scene();
        let mut follower = Setup::new(&gpu, &scene, &settings);
        let never_visited = follower.volume(&scene);
        for time_s in [1.0, 1.5, 2.0, 0.95, 3.0, 2.0, 0.0] {
            follower.go_to(&mut scene, time_s);
            let followed = follower.volume(&scene);
            let fresh = Setup::new(&gpu, &scene, &settings).volume(&scene);
            assert!(followed == fresh, "{pairs:?}, {time_s} s");
            let is_outside = follower.technique.dynamic.as_ref().unwrap().voxel_count == 0;
            assert_eq!(is_outside, time_s == 0.0 || time_s == 3.0);
            assert_eq!(followed == never_visited, is_outside, "{pairs:?}, {time_s} s");
        }
    }
    assert_eq!(gpu.validation_messages(), Vec::<String>::new());
}
