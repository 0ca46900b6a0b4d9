//! One cone with its samples: what they come to is what the gathers write and what the oracle has.

use crate::support::compare::Largest;
use std::f32::consts::PI;

use crate::support::gather::{View, matter, occupied, random_volume, read_chain, volume};
use crate::support::scenes::bundled;
use crate::support::technique::{Case, frame};
use crate::support::{Random, gpu};
use glam::{DVec3, Vec3};
use lumivox::frame::{Renderer, Traced};
use lumivox::gi::Context;
use lumivox::gi::inspect::{Beam, BeamAxis, BeamStart};
use lumivox::gi::registry;
use lumivox::gi::registry::find;
use lumivox::gi::shared::cone::ConeTracer;
use lumivox::gi::shared::cone::oracle::{Cone, MarchSettings, march};
use lumivox::gi::shared::voxel::VoxelGrid;
use lumivox::gi::voxel_cones::mips;
use lumivox::graph::{Frame, Gpu};
use lumivox::image::{Aov, Image};
use lumivox::render::GpuScene;
use lumivox::scene::{Scene, Sky};

const SIZE: [u32; 2] = [32, 24];

fn renderer<'g>(
    gpu: &'g Gpu,
    scene: &Scene,
    (technique, preset): (&str, &'static str),
    pairs: &[(&str, &str)],
) -> Renderer<'g> {
    let case = Case {
        entry: find(technique).unwrap(),
        preset: Some(preset),
    };
    let (mut renderer, _) = Renderer::new(
        gpu,
        scene,
        case.entry,
        &case.settings(pairs),
        frame(SIZE[0], SIZE[1], 128),
    )
    .unwrap();
    renderer.render(&scene.camera).unwrap();
    renderer
}

fn cone(renderer: &Renderer<'_>, pixel: [u32; 2], axis: BeamAxis) -> Beam {
    match renderer.trace(pixel, axis, None).unwrap() {
        Traced::Beam(beam) => beam,
        other => panic!("pixel {pixel:?}: {other:?}"),
    }
}

/// What the samples of a cone come to: radiance without what is behind it, and what they cover.
fn sum(beam: &Beam) -> (Vec3, f32) {
    let (mut radiance, mut through) = (Vec3::ZERO, 1.0);
    for sample in &beam.samples {
        radiance += through * sample.opacity * sample.radiance;
        through *= 1.0 - sample.opacity;
    }
    (radiance, 1.0 - through)
}

const PIXELS: [[u32; 2]; 4] = [[16, 20], [5, 12], [16, 4], [27, 9]];

/// Through every structure, with one radiance a texel, six and their normals: E of a pixel is what
/// the samples of its cones come to.
#[test]
fn samples_of_a_pixels_cones_are_its_irradiance() {
    let gpu = gpu();
    let scene = bundled("cornell");
    type Case = (
        &'static str,
        &'static str,
        &'static [(&'static str, &'static str)],
    );
    let presets = ["cones", "anisotropic", "directional", "textbook"];
    let mut cases: Vec<Case> = ["voxel-mips", "svo", "clipmap"]
        .iter()
        .flat_map(|technique| presets.map(|preset| (*technique, preset, &[][..])))
        .collect();
    for technique in ["voxel-mips", "svo", "clipmap"] {
        cases.push((technique, "cones", &[("normals", "toksvig")]));
    }
    cases.push(("clipmap", "cones", &[("levels", "2"), ("resolution", "16")]));
    for (technique, preset, pairs) in cases {
        let all = [
            &[("resolution", "32"), ("cones", "5"), ("interleave", "1")],
            pairs,
        ]
        .concat();
        let renderer = renderer(&gpu, &scene, (technique, preset), &all);
        let diffuse = renderer.aov(Aov::Diffuse).unwrap();
        for pixel in PIXELS {
            let count = cone(&renderer, pixel, BeamAxis::Diffuse(0)).count;
            let mut irradiance = Vec3::ZERO;
            for index in 0..count {
                let beam = cone(&renderer, pixel, BeamAxis::Diffuse(index));
                let (radiance, covered) = sum(&beam);
                let last = beam.samples.last().unwrap();
                assert!(
                    (last.gathered - radiance).abs().largest() < 1e-5 * radiance.largest().max(1.0)
                        && (last.covered - covered).abs() < 1e-6
                );
                // The Cornell box has a dark environment.
                assert!(
                    (beam.radiance - radiance).abs().largest()
                        < 1e-4 * radiance.largest().max(1e-3),
                    "{} and {radiance}",
                    beam.radiance
                );
                irradiance += PI * beam.weight.unwrap() * radiance;
            }
            let expected = diffuse.pixels[(pixel[0] + SIZE[0] * pixel[1]) as usize];
            let error = (irradiance - expected).abs().largest() / expected.largest().max(1e-3);
            println!(
                "{technique} {preset} {pairs:?}, pixel {pixel:?}: {irradiance} of {expected}, \
                 {error:.1e} off"
            );
            assert!(
                expected.largest() > 0.0 && error < 5e-3,
                "{technique} {preset} {pairs:?}, pixel {pixel:?}: {irradiance}, not {expected}"
            );
        }
    }
}

/// In random matter, distances, diameters, number and sum of samples are the oracle's.
#[test]
fn samples_are_the_oracles() {
    let gpu = gpu();
    let mut random = Random::new(5);
    let resolution = 16;
    let finest = random_volume(resolution, 0.1, &mut random);
    let image = volume(&gpu, &finest);
    let mut filtered = Frame::new();
    crate::support::gather::filter(&gpu, &mut filtered, &image, 1);
    gpu.submit(filtered).unwrap();
    let (chain, matter) = (
        read_chain(&gpu, &image),
        matter(&gpu, &occupied(&finest), resolution),
    );
    let mut scene = bundled("cornell");
    scene.environment = Vec3::new(0.5, 0.25, 0.125).into();
    let mut gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let image_of_sky = Image::from_fn(32, 16, |at| {
        Vec3::new(1.0 + (at % 32) as f32, 1.0 + (at / 32) as f32, 4.0) / 16.0
    });
    let sky = Sky::new(image_of_sky, 0.0).unwrap().with(1.5, 40.0);
    let skies = [scene.environment.clone(), sky.into()];
    let grid = VoxelGrid::around(gpu_scene.bounds, resolution);
    let all = [
        &["resolution=16"][..],
        &["resolution=16", "height_clamp=0"],
        &["resolution=16", "step_factor=0.5", "max_distance=0.7"],
    ];
    let all = skies
        .iter()
        .flat_map(|sky| all.iter().enumerate().map(move |case| (sky, case)));
    for (sky, (case, pairs)) in all {
        gpu_scene.set_lights(&gpu, &scene.lights, sky).unwrap();
        let _view = View::new(&gpu, &gpu_scene, &scene.camera, SIZE, &grid);
        let context = Context {
            gpu: &gpu,
            scene: &gpu_scene,
            size: SIZE,
            eye: scene.camera.eye,
            lend: registry::lend,
        };
        let settings = find("voxel-mips")
            .unwrap()
            .settings(Some("cones"), pairs)
            .unwrap();
        let tracer = ConeTracer::new(&gpu, &settings).unwrap();
        for aperture_deg in [2.0f32, 25.0, 60.0] {
            let unit = |random: &mut Random| {
                (Vec3::from([0; 3].map(|_: u32| random.unit())) - 0.5).normalize()
            };
            let place = grid.origin
                + grid.voxel_size
                    * resolution as f32
                    * (0.3 + 0.4 * Vec3::from([0; 3].map(|_: u32| random.unit())));
            let normal = unit(&mut random);
            let surface = BeamStart {
                pixel: [0; 2],
                place: [0; 2],
                position: place,
                geometric_normal: normal,
                shading_normal: normal,
                roughness: 0.2,
                eye: place + unit(&mut random) + normal,
                walk: 0,
            };
            let volume = mips::volume(grid, &image, &matter, None);
            let axis = if case == 0 {
                BeamAxis::Mirror
            } else {
                BeamAxis::Normal
            };
            let beam = tracer
                .trace(&context, volume, &surface, (axis, Some(aperture_deg)))
                .unwrap();
            let number = |name| f64::from(settings.number(name));
            let voxel = f64::from(grid.voxel_size);
            let reach = number("max_distance");
            let half_angle = f64::from(0.5 * aperture_deg.to_radians());
            let solid_angle = std::f64::consts::TAU * (1.0 - half_angle.cos());
            let behind = (gpu_scene.environment).around(beam.direction.as_dvec3(), solid_angle);
            let march_settings = MarchSettings {
                step_factor: number("step_factor"),
                opacity_exponent: number("opacity_exponent"),
                height_clamp: number("height_clamp"),
                max_distance: if reach > 0.0 {
                    reach / voxel
                } else {
                    4.0 * f64::from(resolution)
                },
                environment: behind,
                ..MarchSettings::TEXTBOOK
            };
            let (normal, direction) = (normal.as_dvec3(), beam.direction.as_dvec3());
            let origin = (place - grid.origin).as_dvec3() / voxel + number("start_offset") * normal;
            let off = ((beam.origin - grid.origin).as_dvec3() / voxel - origin).length();
            assert!(off < 1e-3, "the apex is {off} voxels off");
            let tan_half = half_angle.tan();
            let cosine = direction.dot(normal).max(0.0);
            let expected = march(
                &chain,
                &Cone {
                    origin,
                    direction,
                    tan_half,
                    height: number("start_offset"),
                    cosine,
                },
                &march_settings,
            );
            let difference = (beam.radiance.as_dvec3() - expected.radiance)
                .abs()
                .largest()
                / expected.radiance.largest();
            let (radiance, covered) = sum(&beam);
            let own: DVec3 = radiance.as_dvec3() + f64::from(1.0 - covered) * behind;
            println!(
                "{axis:?}, {aperture_deg}°: {} samples, {difference:.1e} off",
                beam.samples.len()
            );
            assert_eq!(beam.samples.len(), expected.step_count as usize);
            assert!(
                difference < 0.01
                    && (own - expected.radiance).abs().largest()
                        < 0.01 * expected.radiance.largest()
            );
            assert!((f64::from(beam.visibility) - expected.visibility).abs() < 0.01);
            // Steps follow each other without a gap, each centred on its sample.
            let mut begin = 0.0;
            for sample in &beam.samples {
                let step = settings.number("step_factor") * sample.diameter_m;
                assert!(
                    (begin + 0.5 * step - sample.distance_m).abs()
                        < 1e-3 * grid.voxel_size.max(sample.distance_m)
                );
                let level = (sample.diameter_m / grid.voxel_size).log2().clamp(0.0, 4.0);
                assert!(
                    (sample.level - level).abs() < 1e-3,
                    "level {} of diameter {} m",
                    sample.level,
                    sample.diameter_m
                );
                begin += step;
            }
        }
    }
}

/// Where nothing traces cones, or a pixel sees nothing, there is no cone; apertures and axes are
/// those that were asked for.
#[test]
fn where_there_is_no_beam_it_is_said() {
    let gpu = gpu();
    let scene = bundled("glossy");
    let cones = renderer(
        &gpu,
        &scene,
        ("voxel-mips", "cones"),
        &[("resolution", "32")],
    );
    let pixel = [16, 20];
    let mirror = cone(&cones, pixel, BeamAxis::Mirror);
    let normal = cone(&cones, pixel, BeamAxis::Normal);
    assert!(mirror.direction.dot(normal.direction) < 0.999 && mirror.weight.is_none());
    let Traced::Beam(wide) = cones.trace(pixel, BeamAxis::Normal, Some(50.0)).unwrap() else {
        panic!("a cone")
    };
    assert!((wide.aperture_deg - 50.0).abs() < 1e-3 && wide.samples.len() < normal.samples.len());
    assert_eq!(
        cones.trace([SIZE[0], 0], BeamAxis::Normal, None).unwrap(),
        Traced::NoSurface
    );
    // The second has a volume, for its mirrors.
    for scene in [bundled("cornell"), scene] {
        let rays = renderer(
            &gpu,
            &scene,
            ("voxel-mips", "accurate"),
            &[("resolution", "32")],
        );
        assert_eq!(
            rays.trace(pixel, BeamAxis::Normal, None).unwrap(),
            Traced::NoBeams
        );
    }
}
