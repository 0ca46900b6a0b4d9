//! What `lumivox view` relies on: one renderer makes pictures of several sizes, keeps its light
//! maps, takes other lights; scenes take overlays.

use crate::support::technique::{Surfaces, default_cases, frame, small_lights, small_room};
use crate::support::{Random, gpu, own_gpu};
use glam::Vec3;
use lumivox::frame::Renderer;
use lumivox::gi::registry::find;
use lumivox::graph::GpuOptions;
use lumivox::image::Aov;
use lumivox::render::{GpuScene, MapChannel, SurfaceChannel, Terms, screen_image};
use lumivox::scene::{Camera, Light, Scene, camera_toml, lights_toml};

#[test]
fn a_part_of_large_images_is_the_picture_of_small_ones() {
    let gpu = gpu();
    let scene = small_room(Surfaces::Glossy, vec![small_lights()[0].1]);
    for case in default_cases() {
        let settings = case.settings(&[("resolution", case.smallest_resolution())]);
        let (mut large, _) =
            Renderer::new(&gpu, &scene, case.entry, &settings, frame(96, 50, 64)).unwrap();
        let (mut small, _) =
            Renderer::new(&gpu, &scene, case.entry, &settings, frame(37, 29, 64)).unwrap();
        large.render(&scene.camera).unwrap();
        large.set_size([37, 29]);
        // The same for maps that are there already.
        large.render_again(&scene.camera).unwrap();
        small.render(&scene.camera).unwrap();
        for aov in Aov::ALL {
            assert_eq!(
                large.aov(aov).unwrap(),
                small.aov(aov).unwrap(),
                "{}, {aov}",
                case.name()
            );
        }
        for channel in [
            SurfaceChannel::GeometricNormal,
            SurfaceChannel::Roughness,
            SurfaceChannel::F0,
        ] {
            assert_eq!(
                large.surface(channel).unwrap(),
                small.surface(channel).unwrap(),
                "{}, {channel:?}",
                case.name()
            );
        }
        let map = |renderer: &Renderer<'_>| renderer.light_map(MapChannel::Depth, 0).unwrap();
        assert_eq!(map(&large), map(&small), "{}", case.name());
        assert!(
            map(&large).is_none_or(|map| map.pixels.iter().any(|depth| depth.x > 0.0)),
            "{}: an empty shadow map",
            case.name()
        );
    }
}

#[test]
fn lights_are_replaced_on_the_device() {
    let gpu = gpu();
    let [(_, first), (_, second), (_, third)] = small_lights();
    let mut scene = small_room(Surfaces::Glossy, vec![first]);
    let case = &default_cases()[1];
    let settings = case.settings(&[("resolution", case.smallest_resolution())]);
    let mut uploaded = GpuScene::new(&gpu, &scene).unwrap();
    for lights in [vec![second, third, first], Vec::new(), vec![third]] {
        scene.lights = lights;
        scene.environment = (scene.environment.uniform() + 0.25).into();
        uploaded
            .set_lights(&gpu, &scene.lights, &scene.environment)
            .unwrap();
        let (mut kept, _) =
            Renderer::of(&gpu, uploaded, case.entry, &settings, frame(40, 30, 64)).unwrap();
        let (mut fresh, _) =
            Renderer::new(&gpu, &scene, case.entry, &settings, frame(40, 30, 64)).unwrap();
        kept.render(&scene.camera).unwrap();
        fresh.render(&scene.camera).unwrap();
        assert_eq!(
            kept.aov(Aov::Full).unwrap(),
            fresh.aov(Aov::Full).unwrap(),
            "{} lights",
            scene.lights.len()
        );
        uploaded = kept.into_scene();
    }
}

#[test]
fn overlays_read_back_to_the_bit() {
    let mut random = Random::new(7);
    for _ in 0..200 {
        let mut vector = |scale: f32| Vec3::from([0; 3].map(|_| (random.unit() - 0.5) * scale));
        let camera = Camera {
            eye: vector(30.0),
            target: vector(30.0),
            up: Vec3::Y,
            vfov_deg: 40.0 + vector(20.0).x,
        };
        let (position, direction) = (vector(1e3), vector(1.0).normalize());
        let power = vector(1e-3).abs();
        let lights = vec![
            Light::Directional {
                direction,
                irradiance: power,
            },
            Light::Point {
                position,
                intensity: power,
            },
            Light::Spot {
                position,
                direction,
                intensity: power,
                inner_deg: 10.1,
                outer_deg: 33.3,
            },
        ];
        let mut scene = Scene::default();
        scene.overlay("--with", &camera_toml(&camera)).unwrap();
        scene.overlay("--with", &lights_toml(&lights)).unwrap();
        assert_eq!((scene.camera, &scene.lights), (camera, &lights));
        scene
            .overlay("--with", "environment = { radiance = [1.0, 2.0, 3.0] }")
            .unwrap();
        assert_eq!(
            (scene.camera, scene.environment.clone()),
            (camera, Vec3::new(1.0, 2.0, 3.0).into())
        );
        scene.overlay("--with", &lights_toml(&[])).unwrap();
        assert!(scene.lights.is_empty());
    }
}

#[test]
fn overlays_that_cannot_be_name_the_key() {
    for (text, says) in [
        (
            "camera = { eye = [0.0, 0.0, 0.0], target = [0.0, 0.0, 0.0] }",
            "camera.target",
        ),
        ("light = [{ kind = \"lamp\" }]", "light[0].kind"),
        ("lights = []", "lights"),
        (
            "model = [{ path = \"a.obj\" }]",
            "only camera, light and environment",
        ),
    ] {
        let error = Scene::default()
            .overlay("--with", text)
            .unwrap_err()
            .to_string();
        assert!(
            error.contains(says) && error.contains("--with"),
            "{text}: {error}"
        );
    }
}

/// Reflective maps have as many texels as voxels have use for, and no more than shadow maps.
#[test]
fn reflective_maps_are_as_fine_as_voxels_need() {
    let gpu = gpu();
    let scene = small_room(Surfaces::Diffuse, vec![small_lights()[0].1]);
    // A voxel of the clipmap's only level is as large as those of the others.
    let techniques = [("voxel-mips", ""), ("svo", ""), ("clipmap", "levels=1")];
    for (technique, own) in techniques {
        let entry = find(technique).unwrap();
        for (per_voxel, shadows, expected) in [
            ("4", 256, 64),
            ("2", 256, 32),
            ("0", 256, 256),
            ("4", 32, 32),
        ] {
            let pairs = [
                "resolution=16".to_owned(),
                format!("rsm_per_voxel={per_voxel}"),
                "injection=rsm".to_owned(),
                own.to_owned(),
            ];
            let pairs: Vec<_> = pairs.iter().filter(|pair| !pair.is_empty()).collect();
            let settings = entry.settings(Some("cones"), &pairs).unwrap();
            let frame = frame(32, 16, shadows);
            let (mut renderer, _) = Renderer::new(&gpu, &scene, entry, &settings, frame).unwrap();
            renderer.render(&scene.camera).unwrap();
            let size = |channel| renderer.light_map(channel, 0).unwrap().unwrap().size();
            let sizes = [MapChannel::Depth, MapChannel::Normal, MapChannel::Reflected].map(size);
            let expected = [shadows, expected, expected].map(|size| (size, size));
            assert_eq!(sizes, expected, "{technique}, {pairs:?}");
            let light = renderer.aov(Aov::Indirect).unwrap();
            assert!(
                light.pixels.iter().any(|light| light.y > 0.0),
                "{technique}, {pairs:?}: it is dark"
            );
        }
    }
}

/// What a window shows of a frame's light is what is read of it, to the bit.
#[test]
fn terms_that_are_shown_are_those_that_are_read() {
    let gpu = gpu();
    let scene = small_room(Surfaces::Emissive, vec![small_lights()[0].1]);
    let glossy = small_room(Surfaces::Glossy, vec![small_lights()[0].1]);
    let none = Terms::NONE;
    let sums = [
        (Aov::Full, Terms::ALL),
        (
            Aov::Direct,
            Terms {
                direct: true,
                ..none
            },
        ),
        (
            Aov::Specular,
            Terms {
                specular: true,
                ..none
            },
        ),
        (
            Aov::Emission,
            Terms {
                emission: true,
                ..none
            },
        ),
        (
            Aov::Indirect,
            Terms {
                diffuse: true,
                specular: true,
                ..none
            },
        ),
    ];
    let read = |light: &_| -> Vec<[f32; 4]> {
        bytemuck::pod_collect_to_vec(&gpu.read_image(light, 0, 0).unwrap())
    };
    for (scene, case) in [
        (&scene, &default_cases()[1]),
        (&glossy, &default_cases()[1]),
    ] {
        let settings = case.settings(&[("resolution", case.smallest_resolution())]);
        let (mut renderer, _) =
            Renderer::new(&gpu, scene, case.entry, &settings, frame(48, 32, 64)).unwrap();
        let light = screen_image(&gpu, "test.light", [48, 32]).unwrap();
        renderer.show(Terms::ALL, &light).unwrap();
        assert!(
            read(&light).iter().all(|texel| *texel == [0.0; 4]),
            "before any frame"
        );
        renderer.render(&scene.camera).unwrap();
        let shown_of = |terms| {
            renderer.show(terms, &light).unwrap();
            read(&light)
        };
        let shown = sums.map(|(aov, terms)| (aov, shown_of(terms)));
        // Of two terms, one is the sum less the other.
        let diffuse = shown_of(Terms {
            diffuse: true,
            ..none
        });
        let looks = shown_of(Terms {
            visibility: true,
            ..Terms::ALL
        });
        for (aov, shown) in &shown {
            let read = renderer.aov(*aov).unwrap();
            let colors = shown.iter().map(|[r, g, b, _]| Vec3::new(*r, *g, *b));
            assert!(colors.eq(read.pixels.iter().copied()), "{aov}");
        }
        let open = renderer.aov(Aov::Visibility).unwrap();
        let depth = renderer.aov(Aov::Depth).unwrap();
        for pixel in 0..open.pixels.len() {
            let [all, specular, indirect] = [0, 2, 4].map(|at| shown[at].1[pixel]);
            let rest = indirect[0] - specular[0];
            assert!((diffuse[pixel][0] - rest).abs() <= 1e-6 * indirect[0].abs());
            let factor = if depth.pixels[pixel].x > 0.0 {
                open.pixels[pixel].x
            } else {
                1.0
            };
            assert_eq!(looks[pixel][0], factor * all[0]);
        }
    }
}

/// Pictures are the same without compiled pipelines on disk, with those of the device before, and
/// with files that are damaged. Some drivers keep nothing there.
#[test]
fn pipelines_on_disk_change_no_picture() {
    let folder = tempfile::tempdir().unwrap();
    let scene = small_room(Surfaces::Diffuse, vec![small_lights()[0].1]);
    let entry = find("voxel-mips").unwrap();
    let settings = entry.settings(None, &["resolution=16"]).unwrap();
    let picture = || {
        let gpu = own_gpu(&GpuOptions {
            cache_dir: Some(folder.path().to_owned()),
            ..GpuOptions::default()
        });
        let (mut renderer, _) =
            Renderer::new(&gpu, &scene, entry, &settings, frame(32, 24, 64)).unwrap();
        renderer.render(&scene.camera).unwrap();
        renderer.aov(Aov::Full).unwrap()
    };
    let first = picture();
    assert!(first == picture(), "with what the first device left");
    for file in std::fs::read_dir(folder.path()).unwrap() {
        let path = file.unwrap().path();
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    }
    assert!(first == picture(), "with damaged files");
}
