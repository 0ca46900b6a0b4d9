//! Settings that suit a scene: what techniques choose by themselves.

use crate::support::gpu;
use crate::support::scenes::bundled;
use crate::support::technique::{Surfaces, small_lights, small_room};
use lumivox::gi::Context;
use lumivox::gi::entry::Suited;
use lumivox::gi::registry;
use lumivox::gi::registry::{TECHNIQUES, find};
use lumivox::gi::shared::voxel::Survey;
use lumivox::graph::Gpu;
use lumivox::render::GpuScene;
use lumivox::scene::Scene;

fn suited(gpu: &Gpu, scene: &Scene, technique: &str) -> Option<Suited> {
    suited_beside(gpu, scene, technique, &[])
}

fn suited_beside(gpu: &Gpu, scene: &Scene, technique: &str, set: &[&str]) -> Option<Suited> {
    let set: Vec<String> = set.iter().map(|pair| (*pair).to_owned()).collect();
    let gpu_scene = GpuScene::new(gpu, scene).unwrap();
    let context = Context {
        gpu,
        scene: &gpu_scene,
        size: [32, 24],
        eye: scene.camera.eye,
        lend: registry::lend,
    };
    (find(technique).unwrap().suit)(&context, &set).unwrap()
}

/// Whatever is chosen is possible, twice the same, and over as soon as the choice is made: nothing
/// of it stays on the device.
#[test]
fn what_is_chosen_is_possible() {
    let gpu = gpu();
    let [(_, light), ..] = small_lights();
    let scene = small_room(Surfaces::Masked, vec![light]);
    for entry in TECHNIQUES {
        let before = gpu.memory();
        let first = suited(&gpu, &scene, entry.name);
        assert_eq!(first, suited(&gpu, &scene, entry.name), "{}", entry.name);
        assert_eq!(before, gpu.memory(), "{}", entry.name);
        let pairs = first.map(|suited| suited.pairs).unwrap_or_default();
        entry.settings(None, &pairs).unwrap();
    }
}

/// What is set by name stays, and what goes with another gather or resolution is not chosen.
#[test]
fn what_is_set_stays() {
    let gpu = gpu();
    let scene = bundled("pergola");
    let of = |set: &[&str]| suited_beside(&gpu, &scene, "voxel-mips", set).unwrap();
    let coarse = of(&["resolution = 16"]);
    assert_eq!(
        coarse.pairs,
        ["gather=triangles", "radiance=six-sided", "rays=32"]
    );
    assert!(coarse.needs.unwrap().contains("resolution=32"));
    let cones = of(&["gather=cones", "resolution=32"]);
    assert!(cones.pairs.is_empty(), "{:?}", cones.pairs);
    assert!(!cones.needs.unwrap().contains("rays meet"));
    // What is finer than any choice is not looked at.
    let fine = suited_beside(&gpu, &scene, "svo", &["resolution=2048"]).unwrap();
    assert_eq!((fine.pairs.len(), fine.needs), (3, None));
    let rays = of(&["gather=rays"]).pairs;
    assert_eq!(rays[..2], ["gather=rays", "radiance=two-sided"]);
}

/// Flat walls need no finer voxels than the default has; thin parts do, as far as memory goes, and
/// what is still not right is said. Rays meet triangles where they are few, or thin.
#[test]
fn thin_parts_are_measured() {
    let gpu = gpu();
    let at_triangles = ["gather=triangles", "radiance=six-sided", "rays=32"];
    let expected = [
        ("cornell", &at_triangles[..], "resolution=128"),
        (
            "glossy",
            &["gather=rays", "radiance=two-sided"],
            "resolution=128",
        ),
    ];
    for (name, rays, resolution) in expected {
        let flat = suited(&gpu, &bundled(name), "voxel-mips").unwrap();
        assert_eq!(flat.pairs, [rays, &[resolution]].concat(), "{name}");
        assert_eq!((flat.shadow_resolution, flat.needs), (Some(1024), None));
    }
    let scene = bundled("pergola");
    let thin = suited(&gpu, &scene, "voxel-mips").unwrap();
    println!("{thin:?}");
    assert_eq!(
        thin.pairs,
        [&at_triangles[..], &["resolution=256"]].concat()
    );
    assert_eq!(suited(&gpu, &scene, "svo"), Some(thin), "the same light");
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let [coarse, fine] = [32, 64].map(|n| Survey::new(&gpu, &gpu_scene, n).unwrap());
    assert!(
        coarse.mixed > fine.mixed && coarse.voxels < fine.voxels,
        "{coarse:?}, {fine:?}"
    );
}
