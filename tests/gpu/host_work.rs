//! What the host does for a frame: a device must not wait for it.

use crate::support::gpu;
use crate::support::technique::{
    Case, Surfaces, TINY, cases, default_cases, frame, moving_room, small_lights, small_room,
    walked,
};
use glam::Vec3;
use lumivox::frame::Renderer;
use lumivox::graph::{FRAMES_IN_FLIGHT, HostWork};
use lumivox::image::Aov;
use lumivox::scene::Scene;

fn room() -> Scene {
    let mut scene = small_room(Surfaces::Glossy, Vec::new());
    scene.lights = small_lights().map(|(_, light)| light).to_vec();
    scene
}

/// Host work of frames with a camera that has stood as long as the light needs, of one that is made
/// anew, and the most of a walk.
fn frames(case: &Case, scene: &Scene) -> [HostWork; 3] {
    let gpu = gpu();
    let settings = case.settings(TINY);
    let size = frame(32, 16, 32);
    let (mut renderer, _) = Renderer::new(&gpu, scene, case.entry, &settings, size).unwrap();
    for _ in 0..case.entry.rest(&settings) + 1 {
        renderer.render_again(&scene.camera).unwrap();
    }
    let at_rest = renderer.render_again(&scene.camera).unwrap().host;
    let anew = renderer.render(&scene.camera).unwrap().host;
    // The first time round pools may have to grow.
    let [_, walk] = [(); 2].map(|()| {
        let frames = [0.05, 0.3, 1.0, 2.0, 3.4].map(|way_m| {
            let camera = walked(&scene.camera, way_m);
            renderer.render_again(&camera).unwrap().host
        });
        frames.into_iter().reduce(HostWork::max).unwrap()
    });
    [at_rest, anew, walk]
}

/// Techniques whose store moves with the camera: a frame that has to know how much comes into it is
/// two submissions.
const FOLLOW_CAMERA: &[&str] = &["clipmap", "lpv-cascaded", "probe-cascades"];

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
                waits,
                uploads,
                writes,
                readbacks,
            } = host;
            // The probes whose turn it is are another list in each frame.
            let turns = u64::from(case.entry.name == "probe-cascades");
            if (submissions, waits, readbacks) != (1, 1, 0) || uploads > turns || writes > 2 {
                wrong.push(format!("{} {what}: {host:?}", case.name()));
            }
        }
        let follows = FOLLOW_CAMERA.contains(&case.entry.name);
        if walk.submissions > 1 + u64::from(follows) {
            wrong.push(format!("{} in a walk: {walk:?}", case.name()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn frames_of_models_that_move_are_two_submissions() {
    let [(_, light), ..] = small_lights();
    let scene = moving_room(Surfaces::Diffuse, light);
    let mut wrong = Vec::new();
    for case in default_cases() {
        let gpu = gpu();
        let settings = case.settings(TINY);
        let size = frame(32, 16, 32);
        let (mut renderer, _) = Renderer::new(&gpu, &scene, case.entry, &settings, size).unwrap();
        renderer.render_again(&scene.camera).unwrap();
        // The first time round pools may have to grow.
        let [_, most] = [(); 2].map(|()| {
            let frames = [0.2, 0.5, 0.8].map(|time_s| {
                let mut moved = scene.clone();
                moved.set_time(time_s);
                let before = gpu.host_work();
                renderer.set_pose(&moved).unwrap();
                renderer.render_again(&scene.camera).unwrap();
                gpu.host_work().since(before)
            });
            frames.into_iter().reduce(HostWork::max).unwrap()
        });
        println!("{}: {most:?}", case.name());
        if most.submissions > 2 {
            wrong.push(format!("{}: {most:?}", case.name()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Frames that nobody waits for show what frames show that are waited for, and cost as many passes;
/// camera and models move from frame to frame.
#[test]
fn frames_in_flight_are_those_that_are_waited_for() {
    let [(_, light), ..] = small_lights();
    let mut scene = moving_room(Surfaces::Glossy, light);
    let mut wrong = Vec::new();
    for case in default_cases() {
        let gpu = gpu();
        let settings = case.settings(TINY);
        let size = frame(32, 16, 32);
        scene.set_time(0.0);
        let [mut waited, mut ahead] = [(); 2].map(|()| {
            let made = Renderer::new(&gpu, &scene, case.entry, &settings, size);
            made.unwrap().0
        });
        let steps = [(0.0, 0.05), (0.2, 0.3), (0.2, 1.0), (0.8, 2.0), (0.1, 0.1)];
        let mut passes = [Vec::new(), Vec::new()];
        let mut waits = 0;
        for (time_s, way_m) in steps {
            scene.set_time(time_s);
            let camera = walked(&scene.camera, way_m);
            let mut stats = waited.set_pose(&scene).unwrap();
            stats.append(waited.render(&camera).unwrap());
            passes[0].extend(stats.passes);
        }
        for (time_s, way_m) in steps {
            scene.set_time(time_s);
            let camera = walked(&scene.camera, way_m);
            passes[1].extend(ahead.set_pose(&scene).unwrap().passes);
            let before = gpu.host_work();
            passes[1].extend(ahead.render_ahead(&camera).unwrap().passes);
            waits += gpu.host_work().since(before).waits;
        }
        let finished = gpu.finish().unwrap();
        passes[1].extend(finished.into_iter().flat_map(|stats| stats.passes));
        let [all, of_ahead] = passes.map(|passes| {
            let mut runs: Vec<(String, u32)> = Vec::new();
            for pass in passes {
                match runs.iter_mut().find(|(name, _)| *name == pass.name) {
                    Some((_, known)) => *known += pass.runs,
                    None => runs.push((pass.name, pass.runs)),
                }
            }
            runs.sort();
            runs
        });
        if all != of_ahead {
            wrong.push(format!("{}: {all:?}, but {of_ahead:?}", case.name()));
        }
        let pictures = [&waited, &ahead].map(|renderer| renderer.aov(Aov::Full).unwrap());
        if pictures[0] != pictures[1] || pictures[0].pixels.iter().all(|pixel| *pixel == Vec3::ZERO)
        {
            wrong.push(format!("{}: the picture", case.name()));
        }
        println!("{}: {waits} waits in {} frames", case.name(), steps.len());
        let counts = FOLLOW_CAMERA.contains(&case.entry.name);
        if !counts && waits > (steps.len() - FRAMES_IN_FLIGHT) as u64 {
            wrong.push(format!("{}: {waits} waits", case.name()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
