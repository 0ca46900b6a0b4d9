//! What devices and drivers rarely do, planted: the device is lost, memory is not there, features
//! are missing. Each is a typed error that says what it was, and nothing is left behind.

use crate::support::passes::{COPY, COUNT, DOUBLE};
use crate::support::technique::{
    Case, Surfaces, frame, is_sound, moving_room, small_lights, small_room,
};
use crate::support::{expected_missing, gpu, own_gpu, read_words, words};
use glam::Vec3;
use lumivox::frame::Renderer;
use lumivox::gi::entry::Entry;
use lumivox::gi::registry::{TECHNIQUES, find};
use lumivox::gi::settings::Domain;
use lumivox::graph::{
    DrawBatch, Error, Faults, Frame, Gpu, GpuOptions, ImageDesc, ImageKind, ImageUsage, Owner,
    Targets, vk,
};
use lumivox::image::{Aov, Image};
use lumivox::scene::{Camera, Scene};
use lumivox::vulkan::IMAGE_ATOMICS;

/// A technique's default preset.
fn default_case(entry: &'static Entry) -> Case {
    Case {
        entry,
        preset: entry.presets.first().map(|preset| preset.name),
    }
}

fn room() -> Scene {
    let [(_, point), ..] = small_lights();
    small_room(Surfaces::Emissive, vec![point])
}

fn lost(finished: u64, steps: usize) -> Faults {
    Faults {
        loss: Some((finished, steps)),
        ..Faults::default()
    }
}

/// In one submission, and where each pass has its own.
#[test]
fn a_lost_device_is_told_with_the_last_pass_that_finished() {
    let names = [
        "none of this frame",
        "first",
        "test.double",
        "test.copy",
        "last",
    ];
    let together = (0..=4).map(|steps| (false, lost(0, steps), names[steps]));
    let apart = (0..4).map(|steps| (true, lost(steps as u64, 0), names[steps]));
    for isolate_passes in [false, true] {
        let gpu = own_gpu(&GpuOptions {
            isolate_passes,
            ..GpuOptions::default()
        });
        let [a, b] = ["a", "b"].map(|name| words(&gpu, name, &[1; 64]));
        // Uploads go with the next submission: with this one.
        gpu.read_buffer(&a).unwrap();
        for (_, faults, last) in together
            .clone()
            .chain(apart.clone())
            .filter(|(apart, ..)| *apart == isolate_passes)
        {
            let mut frame = Frame::new();
            frame.fill("first", &a, 3);
            frame
                .pass(&DOUBLE)
                .bind("values", &a)
                .constant("WORKGROUP", 64u32)
                .push(&64u32)
                .dispatch([1, 1, 1]);
            frame
                .pass(&COPY)
                .bind("source", &a)
                .bind("target", &b)
                .push(&64u32)
                .dispatch([1, 1, 1]);
            frame.fill("last", &a, 0);
            gpu.plant(faults.clone());
            match gpu.submit(frame) {
                Err(Error::DeviceLost { last_pass }) => {
                    assert_eq!(last_pass, last, "{faults:?}, isolated: {isolate_passes}")
                }
                other => panic!("{faults:?}: {other:?}"),
            }
            // It stays lost.
            assert!(matches!(gpu.read_buffer(&b), Err(Error::DeviceLost { .. })));
        }
    }
}

/// In the middle of a frame of every technique. Dropping what is left of it is silent.
#[test]
fn a_renderer_whose_device_is_lost_goes_in_peace() {
    for entry in TECHNIQUES.iter().copied() {
        let gpu = own_gpu(&GpuOptions::default());
        let case = default_case(entry);
        let scene = room();
        let settings = case.settings(&[("resolution", case.smallest_resolution())]);
        let (mut renderer, _) =
            Renderer::new(&gpu, &scene, entry, &settings, frame(16, 8, 32)).unwrap();
        renderer.render(&scene.camera).unwrap();
        gpu.take_journal();
        renderer.render(&scene.camera).unwrap();
        let frames = gpu.take_journal();
        let (index, names) = frames
            .iter()
            .map(|frame| &frame.names)
            .enumerate()
            .max_by_key(|(_, names)| names.len())
            .unwrap();
        let steps = names.len() - 1;
        assert!(names[0] != names[steps - 1], "{}: {names:?}", entry.name);
        gpu.plant(lost(index as u64, steps));
        match renderer.render(&scene.camera) {
            Err(error @ Error::DeviceLost { .. }) => {
                assert_eq!(
                    error.to_string(),
                    format!(
                        "the device was lost; the last pass that finished is {}",
                        names[steps - 1]
                    ),
                    "{}",
                    entry.name
                );
            }
            other => panic!("{}: {other:?}", entry.name),
        }
        for error in [
            renderer.render(&scene.camera).err(),
            renderer.aov(Aov::Full).err(),
            renderer.rebuild().err(),
        ] {
            assert!(
                error.is_none_or(|error| matches!(error, Error::DeviceLost { .. })),
                "{}",
                entry.name
            );
        }
    }
}

/// Builds and renders one small frame. Where the frame fails, the next one does not.
fn build_and_render(gpu: &Gpu, scene: &Scene, case: &Case) -> Result<Image, Error> {
    let settings = case.settings(&[("resolution", case.smallest_resolution())]);
    let (mut renderer, _) = Renderer::new(gpu, scene, case.entry, &settings, frame(16, 8, 32))?;
    if let Err(error) = renderer.render(&scene.camera) {
        renderer.render(&scene.camera).unwrap();
        assert!(
            is_sound(&renderer.aov(Aov::Full).unwrap()),
            "{}: the frame after {error}",
            case.name()
        );
        return Err(error);
    }
    renderer.aov(Aov::Full)
}

/// Every allocation of a build, a frame and its picture fails once: the error tells of it with the
/// numbers, nothing stays, and the device goes on.
#[test]
fn every_allocation_may_fail() {
    let gpu = gpu();
    let scene = room();
    for entry in TECHNIQUES.iter().copied() {
        let case = default_case(entry);
        gpu.plant(Faults::default());
        let expected = build_and_render(&gpu, &scene, &case).unwrap();
        let count = gpu.plant(Faults::default());
        assert!(count > 20, "{}: {count} allocations", entry.name);
        for index in 0..count {
            gpu.plant(Faults {
                allocation: Some(index),
                ..Faults::default()
            });
            let error = build_and_render(&gpu, &scene, &case)
                .map(drop)
                .expect_err(&format!(
                    "{}: allocation {index} failed, and nobody told",
                    entry.name
                ));
            let text = error.to_string();
            let Error::OutOfMemory {
                resource,
                wanted,
                available,
            } = error
            else {
                panic!("{}: allocation {index}: {text}", entry.name)
            };
            assert!(
                wanted > 0
                    && available > 0
                    && [resource, wanted.to_string(), available.to_string()]
                        .iter()
                        .all(|part| text.contains(part)),
                "{text}"
            );
            assert_eq!(
                (gpu.memory(), gpu.memory_total()),
                (vec![], 0),
                "{}: left by allocation {index}",
                entry.name
            );
            assert_eq!(
                gpu.validation_messages(),
                Vec::<String>::new(),
                "{}: allocation {index}",
                entry.name
            );
        }
        gpu.plant(Faults::default());
        assert_eq!(
            build_and_render(&gpu, &scene, &case).unwrap(),
            expected,
            "{}: after all failures",
            entry.name
        );
    }
}

/// To rounding: bricks of an octree that is built anew lie in a pool of another size, and probes in
/// other places of their images, where texture coordinates round differently. Measured, that is
/// 2·10⁻⁴ at most; light below a billionth counts as none.
fn is_same(a: &Image, b: &Image) -> bool {
    let close = |(a, b): (&Vec3, &Vec3)| (*a - *b).abs().cmple(5e-4 * b.abs() + 1e-9).all();
    a.size() == b.size() && a.pixels.iter().zip(&b.pixels).all(close)
}

/// A camera and a model that move; of the allocations of their frames each of the first eight, and
/// then every third, fails once: the frame after is as if nothing had been.
#[test]
fn a_walk_goes_on_after_a_failure() {
    let gpu = gpu();
    let [(_, point), ..] = small_lights();
    let mut scene = moving_room(Surfaces::Emissive, point);
    let here = scene.camera;
    let there = Camera {
        eye: here.eye - Vec3::new(0.9, 0.0, 0.8),
        ..here
    };
    let walk = [(here, 0.0), (there, 0.7), (here, 1.4)];
    for entry in TECHNIQUES.iter().copied() {
        let case = default_case(entry);
        let settings = case.settings(&[("resolution", case.smallest_resolution())]);
        let (mut renderer, _) =
            Renderer::new(&gpu, &scene, entry, &settings, frame(16, 8, 32)).unwrap();
        let mut step = |camera: &Camera, time_s: f32, faults: Faults| {
            gpu.plant(faults);
            scene.set_time(time_s);
            renderer.set_pose(&scene)?;
            renderer.render(camera)?;
            let count = gpu.plant(Faults::default());
            renderer.aov(Aov::Full).map(|picture| (picture, count))
        };
        // The first round makes room.
        walk.iter()
            .for_each(|(camera, time_s)| drop(step(camera, *time_s, Faults::default()).unwrap()));
        let expected =
            walk.map(|(camera, time_s)| step(&camera, time_s, Faults::default()).unwrap());
        assert!(!is_same(&expected[0].0, &expected[2].0));
        let most = expected.iter().map(|(_, count)| *count).max().unwrap();
        for index in (0..most).filter(|index| *index < 8 || index % 3 == 0) {
            let mut failures = 0;
            for ((camera, time_s), (picture, _)) in walk.iter().zip(&expected) {
                let (found, _) = step(
                    camera,
                    *time_s,
                    Faults {
                        allocation: Some(index),
                        ..Faults::default()
                    },
                )
                .unwrap_or_else(|error| {
                    assert!(matches!(error, Error::OutOfMemory { .. }), "{error}");
                    failures += 1;
                    step(camera, *time_s, Faults::default()).unwrap()
                });
                assert!(
                    is_same(&found, picture),
                    "{}: at {time_s} s, after allocation {index}: {found:?}, not {picture:?}",
                    entry.name
                );
            }
            assert!(
                failures > 0,
                "{}: allocation {index} failed, and nobody told",
                entry.name
            );
        }
    }
}

/// What a device lacks is refused by its name, exactly where it is needed; all else works, and is
/// silent.
#[test]
fn a_missing_feature_is_refused_where_it_is_needed() {
    let absent = |names: &[&str]| Faults {
        absent: names.iter().map(|name| (*name).to_owned()).collect(),
        ..Faults::default()
    };
    let scene = room();
    let mut refused = Vec::new();
    for names in [
        &[][..],
        &["geometryShader"],
        &[
            "geometryShader",
            "VK_EXT_conservative_rasterization",
            "samplerAnisotropy",
            "shaderInt64",
        ],
    ] {
        let gpu = own_gpu(&GpuOptions {
            faults: absent(names),
            ..GpuOptions::default()
        });
        assert!(!names.contains(&"geometryShader") || !gpu.features().geometry_shader);
        for entry in TECHNIQUES.iter().copied() {
            let case = default_case(entry);
            let methods = entry
                .settings
                .iter()
                .copied()
                .flatten()
                .find(|setting| setting.name == "voxelization")
                .map(|setting| setting.domain);
            let methods: Vec<_> = if let Some(Domain::Choice(words)) = methods {
                words.to_vec()
            } else {
                vec!["-"]
            };
            for method in methods {
                let settings = case.settings(&[
                    ("resolution", case.smallest_resolution()),
                    ("voxelization", method),
                ]);
                let expected = expected_missing(&gpu, &settings);
                let built = Renderer::new(&gpu, &scene, entry, &settings, frame(16, 8, 32))
                    .and_then(|(mut renderer, _)| renderer.render(&scene.camera));
                let found = match &built {
                    Ok(_) => None,
                    Err(Error::FeatureMissing { feature, .. }) => Some(*feature),
                    Err(error) => panic!("{} {method} without {names:?}: {error}", entry.name),
                };
                assert_eq!(found, expected, "{} {method} without {names:?}", entry.name);
                refused.extend(found.map(|feature| (names.len(), feature)));
            }
        }
    }
    assert!(refused.contains(&(1, "geometryShader")), "{refused:?}");
}

/// With no more than every device of Vulkan 1.3 allows, small scenes are as they are. What is too
/// large says what it may be.
#[test]
fn the_least_limits_of_vulkan_suffice() {
    let of_limits = |least_limits: bool| {
        own_gpu(&GpuOptions {
            faults: Faults {
                least_limits,
                ..Faults::default()
            },
            ..GpuOptions::default()
        })
    };
    let [own, least] = [false, true].map(of_limits);
    assert_eq!(least.limits().extent_3d, 256);
    let scene = room();
    for case in TECHNIQUES.iter().copied().map(default_case) {
        let settings = case.settings(&[("resolution", case.smallest_resolution())]);
        let [picture, expected] = [&least, &own].map(|gpu| {
            let made = Renderer::new(gpu, &scene, case.entry, &settings, frame(16, 8, 32));
            let (mut renderer, _) = made?;
            renderer.render(&scene.camera)?;
            renderer.aov(Aov::Full)
        });
        // Rows of its leaves are 2048 texels, of images of three dimensions.
        if case.entry.name == "lpv-octree" {
            let error = picture.unwrap_err();
            assert!(matches!(error, Error::ImageTooLarge { .. }), "{error}");
            continue;
        }
        assert_eq!(picture.unwrap(), expected.unwrap(), "{}", case.name());
    }
    let case = default_case(find("voxel-mips").unwrap());
    let settings = case.settings(&[("resolution", "512"), ("gather", "cones")]);
    let made = Renderer::new(&least, &scene, case.entry, &settings, frame(16, 8, 32));
    let error = made.err().unwrap().to_string();
    let told = ["512x512x512", "256x256x256"].map(|size| error.contains(size));
    assert_eq!(told, [true; 2], "{error}");
}

/// Averages that run need atomics in images; sums do without.
#[test]
fn running_averages_are_refused_without_atomics() {
    let gpu = own_gpu(&GpuOptions {
        faults: Faults {
            absent: vec![IMAGE_ATOMICS.into()],
            ..Faults::default()
        },
        ..GpuOptions::default()
    });
    let scene = room();
    for (word, expected) in [("exact", None), ("running-average", Some(IMAGE_ATOMICS))] {
        let case = default_case(find("voxel-mips").unwrap());
        let settings = case.settings(&[("resolution", "16"), ("accumulation", word)]);
        let built = Renderer::new(&gpu, &scene, case.entry, &settings, frame(16, 8, 32))
            .and_then(|(mut renderer, _)| renderer.render(&scene.camera));
        let found = match built {
            Ok(_) => None,
            Err(Error::FeatureMissing { feature, .. }) => Some(feature),
            Err(error) => panic!("{word}: {error}"),
        };
        assert_eq!(found, expected, "{word}");
        assert_eq!(expected_missing(&gpu, &settings), expected, "{word}");
    }
}

/// A pass that needs what is not there is refused by name, and the device goes on.
#[test]
fn a_pass_without_its_feature_is_refused() {
    let gpu = own_gpu(&GpuOptions {
        faults: Faults {
            absent: vec!["geometryShader".into()],
            ..Faults::default()
        },
        ..GpuOptions::default()
    });
    let desc = ImageDesc {
        name: "counts".into(),
        extent: [16, 16, 2],
        kind: ImageKind::D3,
        format: vk::Format::R32_UINT,
        mips: 1,
        layers: 1,
        usage: ImageUsage::STORAGE,
        owner: Owner::Shared,
    };
    let counts = gpu.create_image(&desc).unwrap();
    let mut frame = Frame::new();
    frame.pass(&COUNT).bind("counts", &counts).draw(
        Targets::none([16, 16]),
        vec![DrawBatch {
            vertex_count: 6,
            ..DrawBatch::default()
        }],
    );
    let error = gpu.submit(frame).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the pass test.count needs geometryShader, which this device lacks"
    );
    let values = words(&gpu, "values", &[4]);
    let mut frame = Frame::new();
    frame
        .pass(&DOUBLE)
        .bind("values", &values)
        .constant("WORKGROUP", 64u32)
        .push(&1u32)
        .dispatch([1, 1, 1]);
    gpu.submit(frame).unwrap();
    assert_eq!(read_words(&gpu, &values), [9]);
}

/// A device without what nobody can do without is refused, and told with what it lacks.
#[test]
fn a_device_without_what_is_required_is_refused() {
    for name in [
        "maintenance4",
        "fragmentStoresAndAtomics",
        "rgba16f 3D storage images",
    ] {
        match Gpu::new(&GpuOptions {
            faults: Faults {
                absent: vec![name.into()],
                ..Faults::default()
            },
            ..GpuOptions::default()
        }) {
            Err(Error::DeviceRefused { missing, .. }) => assert_eq!(missing, name),
            Err(other) => panic!("{other}"),
            Ok(_) => panic!("a device without {name} was opened"),
        }
    }
}
