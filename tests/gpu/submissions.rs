//! Frames that are cut into several submissions, and their long dispatches with them.

use crate::support::technique::{
    Case, Surfaces, TINY, default_cases, frame, small_lights, small_room,
};
use crate::support::{gpu, own_gpu};
use lumivox::frame::Renderer;
use lumivox::gi::registry::find;
use lumivox::graph::{FrameStats, Gpu, GpuOptions};
use lumivox::image::{Aov, Image};
use lumivox::scene::Scene;

/// Pictures of a store that was built twice, and what a frame of it costs.
fn rendered(gpu: &Gpu, case: &Case, scene: &Scene, size: [u32; 2]) -> (Vec<Image>, FrameStats) {
    let settings = case.settings(TINY);
    let frame = frame(size[0], size[1], 64);
    let (mut renderer, _) = Renderer::new(gpu, scene, case.entry, &settings, frame).unwrap();
    renderer.render(&scene.camera).unwrap();
    // What is built anew is built of what is known.
    renderer.rebuild().unwrap();
    let stats = renderer.render(&scene.camera).unwrap();
    let pictures = Aov::ALL.map(|aov| renderer.aov(aov).unwrap());
    (pictures.to_vec(), stats)
}

/// A submission of 0.05 ms is less than most passes take: they are run in shares.
#[test]
fn pictures_in_shares_are_those_of_whole_frames() {
    let mut scene = small_room(Surfaces::Glossy, Vec::new());
    scene.lights = small_lights().map(|(_, light)| light).to_vec();
    let whole = gpu();
    let cut = [false, true].map(|isolate_passes| {
        own_gpu(&GpuOptions {
            longest_submission_ms: Some(0.05),
            isolate_passes,
            ..GpuOptions::default()
        })
    });
    for case in default_cases() {
        let (expected, at_once) = rendered(&whole, &case, &scene, [72, 40]);
        assert_eq!(at_once.host.submissions, 1, "{}", case.name());
        let names = |stats: &FrameStats| {
            let passes = stats.passes.iter();
            passes
                .map(|pass| (pass.name.clone(), pass.runs))
                .collect::<Vec<_>>()
        };
        for gpu in &cut {
            let before = gpu.host_work();
            let (pictures, stats) = rendered(gpu, &case, &scene, [72, 40]);
            for ((aov, picture), expected) in Aov::ALL.iter().zip(&pictures).zip(&expected) {
                let pixels = picture.pixels.iter().zip(&expected.pixels);
                let others = pixels.filter(|(one, other)| one != other).count();
                let (case, aov, isolated) = (case.name(), aov.name(), gpu.isolates_passes());
                assert_eq!(
                    others, 0,
                    "{case}: pixels of {aov}, passes isolated: {isolated}"
                );
            }
            assert_eq!(names(&stats), names(&at_once), "{}", case.name());
            assert!(stats.total_ms() > 0.0, "{}", case.name());
            let work = gpu.host_work().since(before);
            if !gpu.isolates_passes() {
                let passes = stats.passes.len() as u64;
                let submissions = stats.host.submissions;
                assert!(submissions > passes, "{}: {submissions}", case.name());
            }
            println!("{}: {:?}, of two frames {work:?}", case.name(), stats.host);
        }
    }
}

/// What nothing is known of is tried with a few workgroups first, and then runs as a whole.
#[test]
fn large_dispatches_are_tried_before_they_run() {
    let scene = small_room(Surfaces::Diffuse, vec![small_lights()[0].1]);
    let case = Case {
        entry: find("voxel-mips").unwrap(),
        preset: None,
    };
    let settings = case.settings(TINY);
    let gpu = own_gpu(&GpuOptions {
        longest_submission_ms: Some(1e9),
        ..GpuOptions::default()
    });
    let (mut renderer, _) =
        Renderer::new(&gpu, &scene, case.entry, &settings, frame(520, 512, 64)).unwrap();
    let [first, second] = [(); 2].map(|()| renderer.render(&scene.camera).unwrap());
    assert!(first.host.submissions > 2, "{:?}", first.host);
    assert_eq!(second.host.submissions, 1);
    let tried = renderer.aov(Aov::Full).unwrap();
    renderer.render(&scene.camera).unwrap();
    assert!(tried == renderer.aov(Aov::Full).unwrap());
}
