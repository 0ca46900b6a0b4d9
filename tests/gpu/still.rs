//! Frames of a scene that is still while its camera moves: what is kept, and that it is right.

use crate::support::gpu;
use crate::support::technique::{
    Case, Surfaces, TINY, cases, default_cases, frame, moving_room, small_lights, small_room,
    walked,
};
use glam::Vec3;
use lumivox::frame::{self, Renderer};
use lumivox::gi::entry::{Part, Stage};
use lumivox::gi::registry::{find, stages};
use lumivox::graph::FrameStats;
use lumivox::image::Aov;
use lumivox::scene::{Light, Material, Scene, Specular};

/// The passes of a frame that draw light maps, or light a store.
fn of_light(case: &Case, stats: &FrameStats) -> Vec<String> {
    let maps = |stage: &&Stage| stage.name == "light maps";
    let own = stages(case.entry).into_iter();
    let lights: Vec<&str> = (own.filter(|stage| stage.part == Part::Store))
        .chain(frame::STAGES.iter().copied().filter(maps))
        .flat_map(|stage| stage.passes.iter().copied())
        .collect();
    let names = stats.passes.iter().map(|pass| pass.name.clone());
    names
        .filter(|name| lights.contains(&name.as_str()))
        .collect()
}

/// Frames with a camera that walks and then stands: the pictures of frames made anew, and the light
/// passes of the last one.
fn walk(case: &Case, scene: &Scene, pairs: &[(&str, &str)]) -> Vec<String> {
    let gpu = gpu();
    let settings = case.settings(&[TINY, pairs].concat());
    let renderer = || Renderer::new(&gpu, scene, case.entry, &settings, frame(32, 16, 32)).unwrap();
    let ((mut keeps, _), (mut anew, _)) = (renderer(), renderer());
    let mut last = Vec::new();
    for (index, way_m) in [0.0, 0.0, 0.05, 0.3, 3.4, 3.4].into_iter().enumerate() {
        let camera = walked(&scene.camera, way_m);
        last = of_light(case, &keeps.render_again(&camera).unwrap());
        anew.render(&camera).unwrap();
        for aov in [Aov::Full, Aov::Indirect] {
            assert!(
                keeps.aov(aov).unwrap() == anew.aov(aov).unwrap(),
                "{}, {pairs:?}, frame {index}: {aov} is another",
                case.name()
            );
        }
        let light = anew.aov(Aov::Indirect).unwrap();
        assert!(
            index > 0
                || case.bounces() == 0
                || light.pixels.iter().any(|light| *light != Vec3::ZERO),
            "{}: there is no light",
            case.name()
        );
    }
    last
}

/// A room with a lamp of each kind, and a sky.
fn lit(mut scene: Scene) -> Scene {
    scene.environment = Vec3::new(0.2, 0.3, 0.4).into();
    scene.lights = small_lights().map(|(_, light)| light).to_vec();
    scene
}

#[test]
fn a_still_scene_keeps_its_light_and_a_moving_camera_sees_the_same() {
    for case in cases() {
        for surfaces in [Surfaces::Glossy, Surfaces::Emissive] {
            let scene = lit(small_room(surfaces, Vec::new()));
            let left = walk(&case, &scene, &[]);
            // What the camera sees is among the blockers in the one, and the other gathers from
            // each direction as it sweeps.
            let is_excused = matches!(
                (case.entry.name, case.preset),
                ("lpv" | "lpv-octree" | "lpv-cascaded", Some("textbook")) | ("lpv", Some("best"))
            );
            assert!(
                left.is_empty() || is_excused,
                "{}, {surfaces:?}: {left:?}",
                case.name()
            );
        }
    }
}

/// A mirror that sees the lamp in the voxels, while pixels gather it in another way, leaves its own
/// light there: the next frame's pixels have to have theirs back.
#[test]
fn mirrors_of_lamps_leave_no_light_to_the_next_frame() {
    for technique in ["voxel-mips", "svo", "clipmap"] {
        let case = Case {
            entry: find(technique).unwrap(),
            preset: Some("accurate"),
        };
        let mut scene = lit(small_room(Surfaces::Emissive, Vec::new()));
        let emits = |material: &&mut Material| material.emission != Vec3::ZERO;
        let lamps = scene.materials.iter_mut().filter(emits);
        for lamp in lamps {
            lamp.specular = Some(Specular {
                f0: Vec3::splat(0.5),
                roughness: 0.3,
                metalness: 0.0,
                texture: None,
            });
        }
        let left = walk(&case, &scene, &[]);
        assert!(
            left.iter().any(|pass| pass == "voxel.light"),
            "{technique}: voxels are lit for one viewer alone: {left:?}"
        );
    }
}

type Pairs = &'static [(&'static str, &'static str)];

/// Technique, preset, settings that no preset has, and what is still done in each frame.
const OTHERS: &[(&str, &str, Pairs, &[&str])] = &[
    ("voxel-mips", "cones", &[("bounces", "2")], &[]),
    ("voxel-mips", "accurate", &[("bounces", "3")], &[]),
    ("svo", "directional", &[("bounces", "2")], &[]),
    ("svo", "cones", &[("injection", "voxel")], &[]),
    ("clipmap", "cones", &[("bounces", "2")], &[]),
    ("ray-traced", "cached", &[], &[]),
    ("irradiance-probes", "default", &[("bounces", "2")], &[]),
    (
        "irradiance-probes",
        "default",
        &[("bounces", "3"), ("specular", "prefiltered")],
        &[],
    ),
    (
        "irradiance-probes",
        "default",
        &[("source", "store"), ("store", "nested")],
        &["probes.aim", "store.cast", "probes.take", "probes.blend"],
    ),
    (
        "irradiance-probes",
        "default",
        &[("source", "store"), ("store", "sparse"), ("bounces", "2")],
        &[],
    ),
    ("light-field-probes", "default", &[("bounces", "2")], &[]),
    (
        "probe-cascades",
        "default",
        &[("bounces", "2"), ("specular", "prefiltered")],
        &[],
    ),
    (
        "probe-cascades",
        "default",
        &[("source", "store"), ("store", "dense")],
        &[],
    ),
    ("lpv", "accurate", &[("bounces", "2")], &[]),
    ("lpv-cascaded", "accurate", &[("bounces", "2")], &[]),
];

#[test]
fn so_do_settings_that_no_preset_has() {
    for (technique, preset, pairs, still_done) in OTHERS {
        let case = Case {
            entry: find(technique).unwrap(),
            preset: Some(preset),
        };
        let left = walk(&case, &lit(small_room(Surfaces::Glossy, Vec::new())), pairs);
        assert!(
            left.iter().all(|name| still_done.contains(&name.as_str())),
            "{technique}.{preset} {pairs:?}: {left:?}"
        );
    }
}

/// Probes that are lit in turn, so many a frame, are lit until all have had their turns.
#[test]
fn probes_that_are_lit_in_turn_come_to_rest() {
    let gpu = gpu();
    let mut scene = lit(small_room(Surfaces::Diffuse, Vec::new()));
    for bounces in ["1", "2"] {
        let case = Case {
            entry: find("probe-cascades").unwrap(),
            preset: Some("default"),
        };
        let pairs = [("probes_per_frame", "40"), ("bounces", bounces)];
        let settings = case.settings(&pairs);
        let renderer = |scene: &Scene| {
            Renderer::new(&gpu, scene, case.entry, &settings, frame(32, 16, 32)).unwrap()
        };
        let (mut keeps, _) = renderer(&scene);
        keeps.render_again(&scene.camera).unwrap();
        for light in &mut scene.lights {
            if let Light::Point { position, .. } | Light::Spot { position, .. } = light {
                *position += Vec3::new(0.1, -0.2, 0.1);
            }
        }
        keeps.move_lights(&scene).unwrap();
        let mut frames = 0;
        while !of_light(&case, &keeps.render_again(&scene.camera).unwrap()).is_empty() {
            frames += 1;
            assert!(frames < 1000, "{bounces} bounces: they never come to rest");
        }
        assert!(frames > 2, "{bounces} bounces: all at once");
        let (mut anew, _) = renderer(&scene);
        anew.render(&scene.camera).unwrap();
        let [kept, new] = [&keeps, &anew].map(|renderer| renderer.aov(Aov::Full).unwrap());
        assert!(kept == new, "{bounces} bounces: another picture at rest");
    }
}

/// What changes is seen in the next frame, as a renderer sees it that keeps nothing.
#[test]
fn what_changes_is_seen_at_once() {
    let gpu = gpu();
    for case in default_cases() {
        let mut scene = lit(moving_room(Surfaces::Emissive, small_lights()[0].1));
        let settings = case.settings(TINY);
        let renderer =
            || Renderer::new(&gpu, &scene, case.entry, &settings, frame(32, 16, 32)).unwrap();
        let ((mut keeps, _), (mut anew, _)) = (renderer(), renderer());
        // Transfer is built in each of them.
        let changes = if case.entry.name == "prt" { 0..5 } else { 0..6 };
        for change in changes {
            match change {
                2 => {
                    scene.set_time(1.0);
                    for renderer in [&mut keeps, &mut anew] {
                        renderer.set_pose(&scene).unwrap();
                    }
                }
                3 => {
                    for light in &mut scene.lights {
                        if let Light::Point { position, .. } | Light::Spot { position, .. } = light
                        {
                            *position += Vec3::new(0.1, -0.2, 0.1);
                        }
                    }
                    for renderer in [&mut keeps, &mut anew] {
                        renderer.move_lights(&scene).unwrap();
                    }
                }
                4 => {
                    scene.environment = Vec3::new(0.3, 0.5, 0.9).into();
                    for renderer in [&mut keeps, &mut anew] {
                        renderer.move_lights(&scene).unwrap();
                    }
                }
                5 => {
                    for renderer in [&mut keeps, &mut anew] {
                        renderer.rebuild().unwrap();
                    }
                }
                _ => {}
            }
            keeps.render_again(&scene.camera).unwrap();
            anew.render(&scene.camera).unwrap();
            let [kept, new] = [&keeps, &anew].map(|renderer| renderer.aov(Aov::Full).unwrap());
            assert!(
                kept == new,
                "{}: another picture after change {change}",
                case.name()
            );
        }
    }
}
