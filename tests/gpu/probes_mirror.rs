//! What glossy surfaces mirror by rays whose hits the lights and probes light: the reference's.

use glam::Vec3;
use lumivox::frame::Renderer;
use lumivox::gi::entry::Entry;
use lumivox::gi::probes::{cascades, irradiance};
use lumivox::graph::Gpu;
use lumivox::image::{GuideImage, Image};
use lumivox::reference::{self, Bounces, Filter, Sampling};
use lumivox::scene::{Scene, Specular};

use crate::support::gpu;
use crate::support::scenes::bundled;
use crate::support::technique::{block_errors, frame};

pub(super) const SIZE: [u32; 2] = [96, 72];

const ENTRIES: [&Entry; 2] = [&irradiance::ENTRY, &cascades::ENTRY];

/// The box, all of it glossy.
pub(super) fn glossy_box(roughness: f32) -> Scene {
    let mut scene = bundled("cornell");
    for material in &mut scene.materials {
        material.specular = Some(Specular {
            f0: Vec3::splat(0.8),
            roughness,
            metalness: 0.0,
            texture: None,
        });
    }
    scene
}

pub(super) fn expected(scene: &Scene, bounces: u32) -> (Image, GuideImage) {
    let settings = reference::Settings {
        width: SIZE[0],
        height: SIZE[1],
        bounces: Bounces::Count(bounces),
        filter: Filter::Center,
        sampling: Sampling::Fixed { spp: 400 },
        seed: 3,
        ..reference::Settings::default()
    };
    let image = reference::render(scene, &settings, &|_| {}).unwrap();
    (image.light.specular, image.guide)
}

fn mirrored(gpu: &Gpu, scene: &Scene, entry: &'static Entry, pairs: &[&str]) -> Image {
    let settings = entry.settings(None, pairs).unwrap();
    let of = frame(SIZE[0], SIZE[1], 128);
    let (mut renderer, _) = Renderer::new(gpu, scene, entry, &settings, of).unwrap();
    renderer.render(&scene.camera).unwrap();
    renderer.indirect_light().unwrap().specular
}

/// One bounce is the reference's but for noise, most of it of mirrored highlights. Of two, what
/// hits reflect of the second comes from probes: as much, and nearly from where it should.
#[test]
fn mirrored_light_is_the_references() {
    let gpu = gpu();
    for (roughness, bounces, most) in [(0.1, 1, 0.09), (0.5, 1, 0.03), (0.5, 2, 0.11)] {
        let scene = glossy_box(roughness);
        let (expected, guide) = expected(&scene, bounces);
        for entry in ENTRIES {
            let (count, rays) = (format!("bounces={bounces}"), "mirror_rays=64");
            let all = [&count, rays, "probes=8", "probes_per_frame=0"];
            let found = mirrored(&gpu, &scene, entry, &all);
            let errors = block_errors(&found, &expected, &guide);
            println!("{} {roughness} {bounces}: {errors:.4?}", entry.name);
            assert!(
                errors.rel_rmse < most && errors.bias.abs() < 0.05,
                "{errors:?}"
            );
        }
    }
}

/// Whether shadow maps or rays say which light reaches what rays hit, it is about the same; without
/// reflections there is none.
#[test]
fn mirrored_light_by_maps_and_none() {
    let gpu = gpu();
    let scene = glossy_box(0.2);
    let (_, guide) = expected(&scene, 1);
    for entry in ENTRIES {
        let [by_rays, by_maps, none] = ["hit_light=rays", "hit_light=maps", "specular=off"]
            .map(|pair| mirrored(&gpu, &scene, entry, &["probes=6", pair]));
        let off = block_errors(&by_maps, &by_rays, &guide).rel_rmse;
        println!("{}: {off}", entry.name);
        assert!(off > 0.0 && off < 0.1, "{}: {off}", entry.name);
        assert!(none.pixels.iter().all(|pixel| *pixel == Vec3::ZERO));
    }
}
