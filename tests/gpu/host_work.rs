//! What the host does for a frame: a device must not wait for it.

use crate::support::gpu;
use crate::support::technique::{
    Case, Surfaces, cases, default_cases, frame, moving_room, small_lights, small_room, walked,
};
use lumivox::frame::Renderer;
use lumivox::graph::HostWork;
use lumivox::scene::Scene;

/// What makes techniques small.
const SMALL: &[(&str, &str)] = &[
    ("resolution", "16"),
    ("probes", "4"),
    ("cells", "4"),
    ("cache_resolution", "16"),
    ("source_resolution", "16"),
    ("reflection_probes", "3"),
    ("radiance_texels", "16"),
];

fn room() -> Scene {
    let mut scene = small_room(Surfaces::Glossy, Vec::new());
    scene.lights = small_lights().map(|(_, light)| light).to_vec();
    scene
}

/// Host work of frames with a camera that has stood as long as the light needs, of one that is made
/// anew, and the most of a walk.
fn frames(case: &Case, scene: &Scene) -> [HostWork; 3] {
    let gpu = gpu();
    let settings = case.settings(SMALL);
    let size = frame(32, 16, 32);
    let (mut renderer, _) = Renderer::new(&gpu, scene, case.entry, &settings, size).unwrap();
    for _ in 0..case.entry.rest(&settings) + 1 {
        renderer.render_again(&scene.camera).unwrap();
    }
    let at_rest = renderer.render_again(&scene.camera).unwrap().host;
    let anew = renderer.render(&scene.camera).unwrap().host;
    let walk = [0.05, 0.3, 1.0, 2.0, 3.4].map(|way_m| {
        let camera = walked(&scene.camera, way_m);
        renderer.render_again(&camera).unwrap().host
    });
    [
        at_rest,
        anew,
        walk.into_iter().reduce(HostWork::max).unwrap(),
    ]
}

/// Techniques whose store moves with the camera, and the submissions of a frame in which all of its
/// levels do.
const FOLLOW_CAMERA: &[(&str, u64)] =
    &[("clipmap", 11), ("lpv-cascaded", 5), ("probe-cascades", 8)];

/// One submission, which brings nothing but the frame's constants, and nothing is read back.
#[test]
fn frames_at_rest_are_one_submission() {
    let scene = room();
    let mut wrong = Vec::new();
    for case in cases() {
        let [at_rest, anew, walk] = frames(&case, &scene);
        println!("{}: at rest {at_rest:?}, walk {walk:?}", case.name());
        for (what, host) in [("at rest", at_rest), ("anew", anew)] {
            let HostWork {
                submissions,
                uploads,
                writes,
                readbacks,
            } = host;
            // The probes whose turn it is are another list in each frame.
            let turns = u64::from(case.entry.name == "probe-cascades");
            if (submissions, readbacks) != (1, 0) || uploads > turns || writes > 2 {
                wrong.push(format!("{} {what}: {host:?}", case.name()));
            }
        }
        let follows = FOLLOW_CAMERA
            .iter()
            .find(|(name, _)| *name == case.entry.name);
        if walk.submissions > follows.map_or(1, |(_, most)| *most) {
            wrong.push(format!("{} in a walk: {walk:?}", case.name()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Submissions that bring a technique's structure up to models that have moved, at most. Each count
/// that is read back is one.
const POSES: &[(&str, u64)] = &[
    ("voxel-mips", 4),
    ("svo", 6),
    ("clipmap", 15),
    ("lpv", 2),
    ("lpv-cascaded", 7),
    ("lpv-octree", 3),
    ("irradiance-probes", 4),
    ("light-field-probes", 3),
    ("probe-cascades", 2),
    ("ray-traced", 2),
    ("prt", 1),
];

#[test]
fn models_that_move_take_few_submissions() {
    let [(_, light), ..] = small_lights();
    let scene = moving_room(Surfaces::Diffuse, light);
    let mut wrong = Vec::new();
    for case in default_cases() {
        let gpu = gpu();
        let settings = case.settings(SMALL);
        let size = frame(32, 16, 32);
        let (mut renderer, _) = Renderer::new(&gpu, &scene, case.entry, &settings, size).unwrap();
        renderer.render_again(&scene.camera).unwrap();
        // The first poses may have to make room.
        let poses = [0.2, 0.5, 0.8].map(|time_s| {
            let mut moved = scene.clone();
            moved.set_time(time_s);
            let pose = renderer.set_pose(&moved).unwrap().host;
            renderer.render_again(&scene.camera).unwrap();
            pose
        });
        let host = poses[2];
        println!("{}: {host:?}", case.name());
        let most = POSES.iter().find(|(name, _)| *name == case.entry.name);
        if most.is_none_or(|(_, most)| host.submissions > *most) {
            wrong.push(format!("{}: {host:?}", case.name()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
