//! Probes that see, and surfaces that mirror, what another technique keeps.

use glam::Vec3;
use lumivox::frame::Renderer;
use lumivox::gi::entry::Entry;
use lumivox::gi::probes::{cascades, irradiance, light_field};
use lumivox::gi::registry;
use lumivox::graph::Gpu;
use lumivox::image::{Aov, Image};
use lumivox::scene::Scene;

use super::probes_mirror::glossy_box;
use super::probes_reflect::metal_blocks;
use super::probes_voxels::{off, with_lamp};
use crate::support::gpu;
use crate::support::scenes::bundled;
use crate::support::technique::{frame, largest_difference};

const ENTRIES: [&Entry; 2] = [&irradiance::ENTRY, &cascades::ENTRY];

/// Techniques whose surfaces may mirror by cones through the stores of others.
const MIRRORING: [&Entry; 3] = [&irradiance::ENTRY, &cascades::ENTRY, &light_field::ENTRY];

/// Techniques that lend their stores, and the kinds of these.
const LENDERS: [[&str; 2]; 3] = [
    ["voxel-mips", "dense"],
    ["svo", "sparse"],
    ["clipmap", "nested"],
];

/// Of those that they have.
const PROBES: [[&str; 2]; 2] = [["probes", "8"], ["probes_per_frame", "0"]];

fn renderer<'g>(
    gpu: &'g Gpu,
    scene: &Scene,
    entry: &'static Entry,
    pairs: &[&str],
) -> Renderer<'g> {
    let has = |name: &str| entry.all_settings().any(|setting| setting.name == name);
    let known = PROBES.iter().filter(|[name, _]| has(name));
    let pairs: Vec<String> = known
        .map(|[name, value]| format!("{name}={value}"))
        .chain(pairs.iter().map(ToString::to_string))
        .collect();
    let settings = entry.settings(None, &pairs).unwrap();
    let of = frame(48, 36, 128);
    Renderer::new(gpu, scene, entry, &settings, of).unwrap().0
}

/// After so many frames.
fn light(gpu: &Gpu, entry: &'static Entry, frames: u32, pairs: &[&str]) -> Image {
    let scene = bundled("cornell");
    let mut renderer = renderer(gpu, &scene, entry, pairs);
    for _ in 0..frames {
        renderer.render(&scene.camera).unwrap();
    }
    renderer.aov(Aov::Indirect).unwrap()
}

#[test]
fn light_is_that_of_triangles_about() {
    let gpu = gpu();
    for entry in ENTRIES {
        for (more, frames) in [
            (&[][..], 1),
            (&["bounces=2"][..], 1),
            (&["bounces=feedback"][..], 8),
            (&["moment_filter=power"][..], 1),
        ] {
            let expected = light(&gpu, entry, frames, more);
            let found = LENDERS.map(|[_, store]| {
                let store = format!("store={store}");
                let pairs = ["source=store", "source_resolution=32", &store];
                light(&gpu, entry, frames, &[&pairs, more].concat())
            });
            let all = found.each_ref().map(|found| off(found, &expected));
            println!("{} {more:?}: {all:.4?}", entry.name);
            assert!(all.iter().all(|off| *off < 0.1), "{more:?}: {all:?}");
            // A dense grid and an octree of the same voxels are one space.
            let [dense, octree, _] = &found;
            let between = off(dense, octree);
            assert!(between < 1e-3, "{more:?}: {between}");
        }
    }
}

/// As a renderer that was made when they stood there.
#[test]
fn borrowed_stores_follow_models_and_the_camera() {
    let gpu = gpu();
    let mut scene = with_lamp(bundled("cornell"), [[0.5, 1.2, 0.2], [-0.5, 0.9, 0.4]]);
    for (entry, store) in [
        (&irradiance::ENTRY, "store=dense"),
        (&irradiance::ENTRY, "store=sparse"),
        (&cascades::ENTRY, "store=nested"),
    ] {
        let pairs = ["source=store", "source_resolution=32", store];
        scene.set_time(0.0);
        let mut following = renderer(&gpu, &scene, entry, &pairs);
        following.render(&scene.camera).unwrap();
        let before = following.aov(Aov::Indirect).unwrap();
        scene.set_time(1.0);
        following.set_pose(&scene).unwrap();
        let mut camera = scene.camera;
        camera.eye += Vec3::new(0.1, 0.05, -0.1);
        following.render(&camera).unwrap();
        let mut made = renderer(&gpu, &scene, entry, &pairs);
        made.render(&camera).unwrap();
        let [found, expected] = [&following, &made].map(|of| of.aov(Aov::Indirect).unwrap());
        let off = largest_difference(&found, &expected);
        println!("{} {store}: {off}", entry.name);
        assert!(largest_difference(&found, &before) > 0.1);
        assert!(off < 1e-3, "{} {store}: {off}", entry.name);
    }
}

/// Surfaces mirror what they do by the technique itself.
#[test]
fn cones_are_those_of_the_lender() {
    let gpu = gpu();
    let scene = glossy_box(0.3);
    for [lender, store] in LENDERS {
        let own = [
            "resolution=32",
            "gather=cones",
            "radiance=six-sided",
            "emitters=gather",
        ];
        let lending = registry::find(lender).unwrap();
        let settings = lending.settings(None, &own).unwrap();
        let of = frame(48, 36, 128);
        let (mut itself, _) = Renderer::new(&gpu, &scene, lending, &settings, of).unwrap();
        itself.render(&scene.camera).unwrap();
        let expected = itself.indirect_light().unwrap().specular;
        assert!(expected.pixels.iter().any(|pixel| *pixel != Vec3::ZERO));
        for entry in MIRRORING {
            let store = format!("store={store}");
            let pairs = ["specular=cones", "source_resolution=32", &store];
            let mut renderer = renderer(&gpu, &scene, entry, &pairs);
            renderer.render(&scene.camera).unwrap();
            let found = renderer.indirect_light().unwrap().specular;
            let off = largest_difference(&found, &expected);
            println!("{} {lender}: {off}", entry.name);
            assert!(off < 1e-4, "{} {lender}: {off}", entry.name);
        }
    }
}

/// What rays of surfaces hit has as many bounces behind it as through triangles.
#[test]
fn rays_mirror_as_many_bounces_as_through_triangles() {
    let gpu = gpu();
    let scene = metal_blocks(0.2);
    for entry in ENTRIES {
        let mirrored = |pairs: &[&str]| {
            let mut renderer = renderer(&gpu, &scene, entry, pairs);
            renderer.render(&scene.camera).unwrap();
            renderer.indirect_light().unwrap().specular
        };
        let [one, two] = ["bounces=1", "bounces=2"].map(|bounces| mirrored(&[bounces]));
        let of_store = |bounces| {
            let pairs = ["source=store", "source_resolution=32", bounces];
            mirrored(&pairs)
        };
        let found = ["bounces=1", "bounces=2"].map(of_store);
        let further = off(&one, &two);
        let offs = [off(&found[0], &one), off(&found[1], &two)];
        println!("{}: {offs:.4?}, a bounce {further:.4}", entry.name);
        assert!(offs[0] < 1e-5 && offs[1] < 0.2 * further, "{offs:?}");
    }
}

#[test]
fn what_a_store_cannot_do_is_an_error_in_words() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let of = |pairs: &[&str]| irradiance::ENTRY.settings(None, pairs);
    for (pairs, words) in [
        (["source=store", "gradient=on"], "give gradient=off"),
        (
            ["source=store", "bounces=5"],
            "give bounces=feedback, or 1 to 4",
        ),
    ] {
        let error = of(&pairs).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    let pairs = ["source=store", "store=nested", "source_resolution=512"];
    let settings = of(&pairs).unwrap();
    let made = Renderer::new(&gpu, &scene, &irradiance::ENTRY, &settings, frame(8, 8, 8));
    let error = made.map(|_| ()).unwrap_err().to_string();
    let words = "the store of clipmap: setting resolution: 512 is not one of";
    assert!(error.starts_with(words), "{error}");
}
