//! Exact rays through any structure of voxels: the picture is that of the dense grid.

use crate::support::compare::Largest;
use crate::support::gpu;
use crate::support::scenes::bundled;
use crate::support::technique::{
    Case, Surfaces, frame, largest_difference, moving_room, shoot, small_lights, write_failure,
};
use lumivox::frame::Renderer;
use lumivox::gi::registry::find;
use lumivox::graph::Gpu;
use lumivox::image::{Aov, Image};
use lumivox::scene::Scene;

/// Structures, and what makes one of them a grid around the scene like the others.
const STRUCTURES: [(&str, &[(&str, &str)]); 3] = [
    ("voxel-mips", &[]),
    ("svo", &[]),
    ("clipmap", &[("levels", "1")]),
];

fn indirect(gpu: &Gpu, scene: &Scene, technique: usize, pairs: &[(&str, &str)]) -> Image {
    let (name, own) = STRUCTURES[technique];
    let case = Case {
        entry: find(name).unwrap(),
        preset: Some("accurate"),
    };
    let pairs = [own, pairs].concat();
    shoot(gpu, scene, &case, &pairs, frame(48, 36, 128))
        .unwrap()
        .indirect
}

/// Share of pixels that differ by more than a thousandth of the mean.
fn share_apart(a: &Image, b: &Image) -> f64 {
    let mean = b
        .pixels
        .iter()
        .map(|pixel| pixel.element_sum() / 3.0)
        .sum::<f32>()
        / b.pixels.len() as f32;
    let pairs = a.pixels.iter().zip(&b.pixels);
    let apart = pairs.filter(|(a, b)| (**a - **b).abs().largest() > 1e-3 * f64::from(mean));
    apart.count() as f64 / a.pixels.len() as f64
}

/// Octree and dense grid have the same voxels, so only rays that graze one may differ, by rounding.
/// The levels of a clipmap are voxelized from another corner, so a few voxels differ as well.
#[test]
fn all_structures_give_one_picture() {
    let gpu = gpu();
    for (scene, resolution, pairs) in [
        ("cornell", "8", [("gather", "rays"), ("bounces", "1")]),
        ("cornell", "64", [("gather", "rays"), ("bounces", "3")]),
        (
            "glossy",
            "32",
            [("gather", "rays"), ("radiance", "isotropic")],
        ),
        (
            "two-rooms",
            "32",
            [("gather", "triangles"), ("bounces", "2")],
        ),
        ("atrium", "64", [("gather", "triangles"), ("bounces", "1")]),
        (
            "two-rooms",
            "32",
            [("radiance", "six-sided"), ("bounces", "2")],
        ),
        (
            "glossy",
            "32",
            [("gather", "triangles"), ("radiance", "six-sided")],
        ),
    ] {
        let scene = bundled(scene);
        let pairs = [&[("resolution", resolution)], &pairs[..]].concat();
        let dense = indirect(&gpu, &scene, 0, &pairs);
        let octree = indirect(&gpu, &scene, 1, &pairs);
        let apart = share_apart(&octree, &dense);
        println!(
            "{}, {pairs:?}: {apart:.4} of the octree's pixels differ",
            scene.name
        );
        if apart > 0.01 {
            write_failure(
                "ray_spaces_octree",
                &octree,
                Some(&dense),
                1.0,
                &format!("{apart}"),
            );
            panic!(
                "{}, {pairs:?}: {apart} of the octree's pixels differ",
                scene.name
            );
        }
        // Planted: light of 1% more.
        let mut brighter = dense.clone();
        brighter.pixels.iter_mut().for_each(|pixel| *pixel *= 1.01);
        assert!(
            share_apart(&brighter, &dense) > 0.3,
            "a brighter picture goes unnoticed"
        );
        if resolution == "8" {
            continue;
        }
        let level = indirect(&gpu, &scene, 2, &pairs);
        let means = [&level, &dense].map(|image| {
            image
                .pixels
                .iter()
                .map(|pixel| f64::from(pixel.element_sum()))
                .sum::<f64>()
        });
        println!(
            "{}, {pairs:?}: a level has {:.4} of the light",
            scene.name,
            means[0] / means[1]
        );
        assert!(
            (means[0] / means[1] - 1.0).abs() < 0.03,
            "{}: {means:?}",
            scene.name
        );
    }
}

/// Rays find the voxels of models that have moved, and nothing where these were.
#[test]
fn rays_follow_models_through_the_octree() {
    let gpu = gpu();
    let (_, light) = small_lights()[0];
    let mut scene = moving_room(Surfaces::Diffuse, light);
    for gather in ["rays", "triangles"] {
        let pictures = [0, 1].map(|technique: usize| {
            let case = Case {
                entry: find(STRUCTURES[technique].0).unwrap(),
                preset: Some("accurate"),
            };
            let settings = case.settings(&[("resolution", "32"), ("gather", gather)]);
            let frame = frame(48, 36, 128);
            let (mut renderer, _) =
                Renderer::new(&gpu, &scene, case.entry, &settings, frame).unwrap();
            [0.4, 1.0, 2.0].map(|time| {
                scene.set_time(time);
                renderer.set_pose(&scene).unwrap();
                renderer.render(&scene.camera).unwrap();
                renderer.aov(Aov::Indirect).unwrap()
            })
        });
        for (dense, octree) in pictures[0].iter().zip(&pictures[1]) {
            let apart = share_apart(octree, dense);
            assert!(apart <= 0.01, "{gather}: {apart} of the pixels differ");
        }
        let moved = largest_difference(&pictures[1][0], &pictures[1][2]);
        assert!(moved > 0.01, "{gather}: nothing has moved");
    }
}
