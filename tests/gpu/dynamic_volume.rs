//! The dense volume while dynamic geometry comes and goes.

use crate::support::gpu;
use crate::support::walker::Walker;
use glam::Vec3;
use lumivox::gi::registry::find;
use lumivox::scene::{Keyframe, Light, Material, Model, Motion, Pose, Scene, Triangle, Vertex};

/// A floor and a wall, and an emissive sheet that is outside of the grid at 0 s, in the wall at 1
/// s, over the floor at 2 s and outside again at 3 s.
fn scene() -> Scene {
    let mut scene = Scene::default();
    let mut quad = |material: Material, [a, b, c, d]: [[f32; 3]; 4]| {
        let first = scene.vertices.len() as u32;
        scene.vertices.extend([a, b, c, d].map(|position| Vertex {
            position,
            u: 0.0,
            normal: [0.0, 1.0, 0.0],
            v: 0.0,
        }));
        let index = scene.materials.len() as u32;
        scene.materials.push(material);
        scene
            .triangles
            .extend([[0, 1, 2], [0, 2, 3]].map(|corners| Triangle {
                vertices: corners.map(|corner| first + corner),
                material: index,
            }));
    };
    let matte = |albedo: [f32; 3]| Material {
        albedo: albedo.into(),
        ..Material::default()
    };
    quad(
        matte([0.7, 0.6, 0.5]),
        [
            [-1.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
            [1.0, 0.0, -1.0],
            [-1.0, 0.0, -1.0],
        ],
    );
    quad(
        matte([0.2, 0.6, 0.3]),
        [
            [-1.0, 0.0, -1.0],
            [1.0, 0.0, -1.0],
            [1.0, 2.0, -1.0],
            [-1.0, 2.0, -1.0],
        ],
    );
    let glowing = Material {
        emission: Vec3::new(3.0, 2.0, 1.0),
        ..matte([0.1, 0.2, 0.9])
    };
    quad(
        glowing,
        [
            [-0.5, -0.4, 0.0],
            [0.5, -0.4, 0.0],
            [0.5, 0.4, 0.1],
            [-0.5, 0.4, 0.1],
        ],
    );
    let pose = |rotate_deg: [f32; 3], translate: [f32; 3]| Pose {
        rotate_deg: rotate_deg.into(),
        translate: translate.into(),
    };
    let poses = [
        pose([0.0; 3], [9.0, 0.0, 0.0]),
        pose([0.0; 3], [0.2, 1.0, -1.0]),
        pose([80.0, 20.0, 0.0], [0.3, 0.4, 0.1]),
        pose([0.0; 3], [0.0, 0.0, 50.0]),
    ];
    let keyframes = (0u8..)
        .zip(poses)
        .map(|(second, pose)| Keyframe {
            time_s: f32::from(second),
            pose,
        })
        .collect();
    let motion = Some(Motion {
        first_vertex: 8,
        rest: scene.vertices[8..].to_vec(),
        keyframes,
    });
    scene.models.push(Model {
        name: "sheet".into(),
        dynamic: true,
        first_triangle: 4,
        triangle_count: 2,
        motion,
    });
    scene.lights = vec![Light::Point {
        position: Vec3::new(0.3, 1.7, 0.8),
        intensity: Vec3::splat(5.0),
    }];
    scene.set_time(0.0);
    scene
}

/// Every bit of the volume is that of a technique built with the model there, and after the model
/// has left, that from before it came.
#[test]
fn the_volume_follows_dynamic_geometry_and_forgets_it() {
    let gpu = gpu();
    let entry = find("voxel-mips").unwrap();
    for pairs in [
        &["resolution=32"][..],
        &["resolution=32", "injection=voxel", "opacity=coverage"],
        &["resolution=16", "mip_filter=box"],
        &["resolution=16", "mip_filter=box", "mip_method=blit"],
        &["resolution=32", "anisotropic=on"],
        &["resolution=32", "faces=both"],
    ] {
        let settings = entry.settings(Some("cones"), pairs).unwrap();
        let mut scene = scene();
        let new = |scene: &Scene| Walker::new(&gpu, scene, entry, &settings, Vec3::ZERO);
        let mut follower = new(&scene);
        let never_visited = follower.texels(Vec3::ZERO);
        for time_s in [1.0, 1.5, 2.0, 0.95, 3.0, 2.0, 0.0] {
            scene.set_time(time_s);
            follower.set_time(time_s, Vec3::ZERO);
            let followed = follower.texels(Vec3::ZERO);
            assert!(
                followed == new(&scene).texels(Vec3::ZERO),
                "{pairs:?}, {time_s} s"
            );
            let is_outside = follower.count("dynamic_voxels") == 0;
            assert_eq!(is_outside, time_s == 0.0 || time_s == 3.0);
            assert_eq!(
                followed == never_visited,
                is_outside,
                "{pairs:?}, {time_s} s"
            );
        }
    }
}
