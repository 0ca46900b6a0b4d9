//! `cone.shadow` on the device against its CPU oracle, its penumbra against a path-traced light of
//! the same size, and what it saves.

use crate::support::compare::{Largest, Worst};
use std::f64::consts::PI;

use crate::support::gather::{
    View, errors, filter, matter, occupied, random_volume, read_chain, verdict, volume,
};
use crate::support::scenes::bundled;
use crate::support::technique::{
    Builder, Case, Surfaces, default_cases, default_cases_with, frame, shoot, small_lights,
    small_room, write_failure,
};
use crate::support::voxels::half;
use crate::support::{Random, gpu};
use glam::{DVec3, DVec4, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::Settings;
use lumivox::gi::registry::find;
use lumivox::gi::shared::cone::ConeTracer;
use lumivox::gi::shared::cone::oracle::{LightPlace, MarchSettings, Volume, light_visibility};
use lumivox::gi::shared::voxel::VoxelGrid;
use lumivox::gi::voxel_cones::mips;
use lumivox::graph::{Frame, Gpu};
use lumivox::image::Image;
use lumivox::metrics::{Channel, compare};
use lumivox::reference::{self, Bounces, Filter, Sampling};
use lumivox::render::GpuScene;
use lumivox::scene::{Camera, Light, Material, Scene, Specular, Triangle, Vertex};
use rayon::prelude::*;

fn settings(pairs: &[String]) -> Settings {
    let shadows = ["shadows=cones".to_owned()];
    find("voxel-mips")
        .unwrap()
        .settings(Some("textbook"), &[&shadows, pairs].concat())
        .unwrap()
}

/// Direct light at each receiver by the oracle, with the albedo that the G-buffer has.
fn by_oracle(
    gpu: &Gpu,
    chain: &[Volume],
    scene: &Scene,
    grid: &VoxelGrid,
    view: &View,
    settings: &Settings,
) -> Vec<DVec4> {
    let number = |name: &str| f64::from(settings.number(name));
    let march = MarchSettings {
        step_factor: number("step_factor"),
        opacity_exponent: number("opacity_exponent"),
        height_clamp: number("height_clamp"),
        max_distance: f64::INFINITY,
        ..MarchSettings::TEXTBOOK
    };
    let tan_half = (number("shadow_aperture").to_radians() / 2.0).tan();
    let (origin, voxel_size) = (grid.origin.as_dvec3(), f64::from(grid.voxel_size));
    let albedo: Vec<[u16; 4]> =
        bytemuck::pod_collect_to_vec(&gpu.read_image(&view.gbuffer.albedo, 0, 0).unwrap());
    let place = |light: &Light| match *light {
        Light::Directional { direction, .. } => LightPlace::Direction(-direction.as_dvec3()),
        Light::Point { position, .. } | Light::Spot { position, .. } => {
            LightPlace::Position((position.as_dvec3() - origin) / voxel_size)
        }
    };
    let of = |([x, y], receiver): &([u32; 2], _)| {
        let texel = albedo[(x + view.gbuffer.size[0] * y) as usize];
        let albedo = DVec3::new(half(texel[0]), half(texel[1]), half(texel[2]));
        let receiver: &lumivox::gi::shared::voxel::oracle::Receiver = receiver;
        let reflected = scene.lights.iter().map(|light| {
            let (direction, _, irradiance) =
                light.sample((origin + voxel_size * receiver.position).as_vec3());
            let cosine = |normal: DVec3| normal.dot(direction.as_dvec3()).max(0.0);
            if cosine(receiver.geometric_normal) == 0.0 {
                return DVec3::ZERO;
            }
            let seen = light_visibility(
                chain,
                receiver,
                number("start_offset"),
                place(light),
                tan_half,
                &march,
            );
            albedo / PI * irradiance.as_dvec3() * cosine(receiver.shading_normal) * seen
        });
        reflected.sum::<DVec3>().extend(1.0)
    };
    view.receivers.par_iter().map(of).collect()
}

#[test]
fn shadows_by_cones_are_the_oracles() {
    let gpu = gpu();
    let mut scene = bundled("cornell");
    // One of each kind, one outside of the grid, and one within a wall.
    let beyond = |x: f32| Light::Point {
        position: Vec3::new(x, 1.0, 0.2),
        intensity: Vec3::new(30.0, 20.0, 10.0),
    };
    scene.lights = small_lights()
        .map(|(_, light)| light)
        .into_iter()
        .chain([beyond(7.0), beyond(1.0)])
        .collect();
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let grid = VoxelGrid::around(gpu_scene.bounds, 32);
    let view = View::new(&gpu, &gpu_scene, &scene.camera, [32, 24], &grid);
    for seed in 0..8u64 {
        let mut random = Random::new(900 + seed);
        let finest = random_volume(32, [0.002, 0.01, 0.05][seed as usize % 3], &mut random);
        let (image, matter) = (volume(&gpu, &finest), matter(&gpu, &occupied(&finest), 32));
        let pairs = [
            format!("shadow_aperture={}", 1.0 + 24.0 * random.unit()),
            format!("step_factor={}", 0.25 + 1.5 * random.unit()),
            format!("opacity_exponent={}", 0.5 + 3.0 * random.unit()),
            format!(
                "height_clamp={}",
                if random.below(2) == 0 {
                    0.0
                } else {
                    1.0 + 6.0 * random.unit()
                }
            ),
            format!("start_offset={}", 0.5 + 2.0 * random.unit()),
        ];
        let settings = settings(&pairs);
        let mut frame = Frame::new();
        frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
        filter(&gpu, &mut frame, &image, random.below(2));
        let volume = mips::volume(grid, &image, &matter, None);
        ConeTracer::new(&gpu, &settings).unwrap().shadow(
            &mut frame,
            &gpu_scene,
            &view.gbuffer,
            volume,
            &view.result,
        );
        gpu.submit(frame).unwrap();
        let mut seen = view.results(&gpu);
        let expected = by_oracle(
            &gpu,
            &read_chain(&gpu, &image),
            &scene,
            &grid,
            &view,
            &settings,
        );
        let result = errors(&seen, &expected);
        println!(
            "shadows {seed}: worst error {:.1e}",
            result.0.last().unwrap()
        );
        verdict(&result).unwrap_or_else(|error| panic!("shadows {seed}, {pairs:?}: {error}"));
        seen[100] *= 1.02;
        seen.rotate_right(1);
        assert!(
            verdict(&errors(&seen, &expected)).is_err(),
            "another pixel's light goes unnoticed"
        );
    }
}

/// On a plane alone nothing is hidden, whatever the surface: what cones leave of the lights is what
/// shadow maps leave.
#[test]
fn an_open_plane_is_lit_as_by_maps() {
    let gpu = gpu();
    for specular in [
        None,
        Some(Specular {
            f0: Vec3::splat(0.5),
            roughness: 0.3,
            metalness: 0.0,
            texture: None,
        }),
    ] {
        let mut builder = Builder::default();
        let ground = builder.material(Material {
            albedo: Vec3::new(0.5, 0.4, 0.3),
            specular,
            ..Material::default()
        });
        builder.quad(
            ground,
            Vec3::new(-2.0, 0.0, -2.0),
            Vec3::Z * 4.0,
            Vec3::X * 4.0,
        );
        let camera = Camera {
            eye: Vec3::new(0.3, 2.0, 1.5),
            target: Vec3::ZERO,
            up: Vec3::Y,
            vfov_deg: 50.0,
        };
        let scene = builder.finish(
            "plane",
            small_lights().map(|(_, light)| light).to_vec(),
            Vec3::ZERO,
            camera,
        );
        for case in default_cases() {
            let lit = |shadows| {
                shoot(
                    &gpu,
                    &scene,
                    &case,
                    &[("resolution", "64"), ("shadows", shadows)],
                    frame(48, 36, 256),
                )
                .unwrap()
                .direct
            };
            let (cones, maps) = (lit("cones"), lit("maps"));
            let off = |(a, b): (&Vec3, &Vec3)| (*a - *b).abs().largest() / b.largest().max(1e-3);
            let worst = cones.pixels.iter().zip(&maps.pixels).map(off).worst();
            println!(
                "{}, glossy {}: {worst:.1e} off",
                case.name(),
                specular.is_some()
            );
            // Along the plane a clipmap's texels grow, and reach the cone that started over smaller
            // ones.
            let most = if case.entry.name == "clipmap" {
                0.15
            } else {
                0.01
            };
            assert!(worst <= most, "{}: {worst}", case.name());
        }
    }
}

#[test]
fn shadows_through_the_octree_are_those_through_mips() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let shot = |technique: &str| {
        let case = Case {
            entry: find(technique).unwrap(),
            preset: Some("cones"),
        };
        shoot(
            &gpu,
            &scene,
            &case,
            &[
                ("resolution", "64"),
                ("shadows", "cones"),
                ("shadow_aperture", "8"),
            ],
            frame(64, 48, 64),
        )
        .unwrap()
        .direct
    };
    let errors = compare(&shot("svo"), &shot("voxel-mips"), None, Channel::Rgb)
        .unwrap()
        .pixel;
    println!(
        "octree against mips: rel_rmse {:.5}, bias {:+.5}",
        errors.rel_rmse, errors.bias
    );
    assert!(errors.rel_rmse <= 0.01, "{errors:?}");
}

/// A point light 0.4 m under the ceiling: the ceiling behind it hides nothing, however wide the
/// cone.
#[test]
fn what_is_behind_a_light_does_not_hide_it() {
    let gpu = gpu();
    let mut builder = Builder::default();
    let white = builder.matte("white", Vec3::splat(0.7));
    builder.room(
        [white; 6],
        Vec3::new(-1.0, 0.0, -1.0),
        Vec3::new(1.0, 2.0, 1.0),
        false,
    );
    let camera = Camera {
        eye: Vec3::new(0.0, 1.0, 0.9),
        target: Vec3::new(0.0, 0.0, -0.2),
        up: Vec3::Y,
        vfov_deg: 40.0,
    };
    let light = Light::Point {
        position: Vec3::new(0.0, 1.6, 0.0),
        intensity: Vec3::splat(3.0),
    };
    let scene = builder.finish("room", vec![light], Vec3::ZERO, camera);
    let case = Case {
        entry: find("voxel-mips").unwrap(),
        preset: Some("cones"),
    };
    let lit = |pairs: &[(&str, &str)]| {
        shoot(
            &gpu,
            &scene,
            &case,
            &[&[("resolution", "64")], pairs].concat(),
            frame(48, 36, 512),
        )
        .unwrap()
        .direct
    };
    let maps = lit(&[]);
    for aperture in ["1", "10", "25"] {
        let errors = compare(
            &lit(&[("shadows", "cones"), ("shadow_aperture", aperture)]),
            &maps,
            None,
            Channel::Rgb,
        )
        .unwrap()
        .pixel;
        println!(
            "{aperture}°: bias {:+.4}, rel_rmse {:.4}",
            errors.bias, errors.rel_rmse
        );
        assert!(errors.bias.abs() <= 0.01, "{aperture}°: {errors:?}");
    }
}

const LIGHT_HEIGHT_M: f32 = 2.0;
const SEEN_HALF_WIDTH_M: f64 = 0.9;
const COLUMNS: u32 = 128;
/// Not on a border between voxels.
const EDGE_M: f32 = -0.02;

/// A slab that covers x < [`EDGE_M`] at half the height of the light over a floor, seen from below
/// the slab: a strip along x.
fn slab_and_floor(light: Option<Light>, lamp_radius_m: f32) -> Scene {
    let mut builder = Builder::default();
    let ground = builder.matte("ground", Vec3::splat(0.5));
    let black = builder.matte("black", Vec3::ZERO);
    builder.quad(
        ground,
        Vec3::new(-2.0, 0.0, -2.0),
        Vec3::Z * 4.0,
        Vec3::X * 4.0,
    );
    builder.cuboid(
        black,
        Vec3::new(-2.0, 1.0, -2.0),
        Vec3::new(EDGE_M, 1.06, 2.0),
    );
    if lamp_radius_m > 0.0 {
        let lamp = builder.material(Material {
            name: "lamp".into(),
            albedo: Vec3::ZERO,
            emission: Vec3::splat(10.0),
            ..Material::default()
        });
        let rim = |i: u32| {
            let (sin, cos) = (std::f32::consts::TAU * i as f32 / 48.0).sin_cos();
            [lamp_radius_m * sin, LIGHT_HEIGHT_M, lamp_radius_m * cos]
        };
        for i in 0..48 {
            let first = builder.scene.vertices.len() as u32;
            let corners = [[0.0, LIGHT_HEIGHT_M, 0.0], rim(i + 1), rim(i)];
            builder
                .scene
                .vertices
                .extend(corners.map(|position| Vertex {
                    position,
                    u: 0.0,
                    normal: [0.0, -1.0, 0.0],
                    v: 0.0,
                }));
            builder.scene.triangles.push(Triangle {
                vertices: [first, first + 1, first + 2],
                material: lamp,
            });
        }
    }
    let vfov_deg = (2.0 * (8.0 / f64::from(COLUMNS)).atan()).to_degrees() as f32;
    let camera = Camera {
        eye: Vec3::Y * SEEN_HALF_WIDTH_M as f32,
        target: Vec3::ZERO,
        up: Vec3::NEG_Z,
        vfov_deg,
    };
    builder.finish("slab", light.into_iter().collect(), Vec3::ZERO, camera)
}

/// Light along x, as a share of that on the open side; `fall` is how the unhidden light falls with
/// the cosine to the light.
fn profile(strip: &Image, fall: i32) -> Vec<f64> {
    let (width, height) = strip.size();
    let column = |i: u32| {
        let x = (2.0 * (f64::from(i) + 0.5) / f64::from(width) - 1.0) * SEEN_HALF_WIDTH_M;
        let cosine = f64::from(LIGHT_HEIGHT_M) / x.hypot(f64::from(LIGHT_HEIGHT_M));
        (0..height)
            .map(|row| f64::from(strip.pixels[(i + width * row) as usize].x))
            .sum::<f64>()
            / cosine.powi(fall)
    };
    let all: Vec<f64> = (0..width).map(column).collect();
    let open = all[all.len() - 6..].iter().sum::<f64>() / 6.0;
    all.iter().map(|value| value / open).collect()
}

/// Where along x the light first is this share (m).
fn crossing(profile: &[f64], share: f64) -> f64 {
    let at = profile
        .windows(2)
        .position(|pair| pair[0] < share && share <= pair[1])
        .expect("the profile rises from shadow to light");
    (at as f64 + (share - profile[at]) / (profile[at + 1] - profile[at])) * 2.0 * SEEN_HALF_WIDTH_M
        / profile.len() as f64
}

/// Radius of a disc at the light's height that is seen as large from the floor below.
fn lamp_radius_m(aperture_deg: f32) -> f32 {
    LIGHT_HEIGHT_M * (0.5 * aperture_deg.to_radians()).tan()
}

fn traced_profile(scene: &Scene, (width, height): (u32, u32)) -> Vec<f64> {
    let sampling = Sampling::Fixed { spp: 256 };
    let settings = reference::Settings {
        width,
        height,
        bounces: Bounces::Count(1),
        filter: Filter::Center,
        sampling,
        seed: 1,
        ..reference::Settings::default()
    };
    profile(
        &reference::render(scene, &settings, &|_| {})
            .unwrap()
            .indirect(),
        4,
    )
}

/// A cone's penumbra against that of a disc which is seen as large: how far the places of 10% and
/// 90% light are apart, and where there is half. Touched voxels, the filter's texels and g make the
/// slab larger by up to 2 voxels of 0.033 m, whose shadow is twice as wide.
#[test]
fn penumbra_is_that_of_a_light_so_large() {
    let gpu = gpu();
    let size = (COLUMNS, 8);
    for aperture_deg in [5.0f32, 10.0, 20.0] {
        let traced = traced_profile(&slab_and_floor(None, lamp_radius_m(aperture_deg)), size);
        let light = Light::Point {
            position: Vec3::Y * LIGHT_HEIGHT_M,
            intensity: Vec3::splat(5.0),
        };
        for technique in ["voxel-mips", "svo"] {
            let case = Case {
                entry: find(technique).unwrap(),
                preset: Some("cones"),
            };
            let pairs = [
                ("resolution", "128"),
                ("shadows", "cones"),
                ("shadow_aperture", &aperture_deg.to_string()),
            ];
            let strip = shoot(
                &gpu,
                &slab_and_floor(Some(light), 0.0),
                &case,
                &pairs,
                frame(size.0, size.1, 64),
            )
            .unwrap()
            .direct;
            let cones = profile(&strip, 3);
            let [width, expected] =
                [&cones, &traced].map(|profile| crossing(profile, 0.9) - crossing(profile, 0.1));
            let middle = crossing(&cones, 0.5) - crossing(&traced, 0.5);
            println!(
                "{technique}, {aperture_deg}°: 10% to 90% in {width:.3} m, path-traced \
                 {expected:.3} m; half light {middle:+.3} m apart"
            );
            if (width / expected - 1.0).abs() > 0.45 || middle.abs() > 0.15 {
                write_failure(
                    &format!("penumbra.{technique}.{aperture_deg}"),
                    &strip,
                    None,
                    1.0,
                    &format!("{cones:.3?}\n{traced:.3?}"),
                );
                panic!(
                    "{technique}, {aperture_deg}°: {width} m for {expected} m, half light \
                     {middle} m apart"
                );
            }
        }
    }
}

/// The shadow of a disc that emits is the gather's: its penumbra against the path-traced one.
#[test]
fn penumbra_of_an_emitting_disc_is_the_gathers() {
    let gpu = gpu();
    let size = (COLUMNS, 8);
    let scene = slab_and_floor(None, lamp_radius_m(20.0));
    let traced = traced_profile(&scene, size);
    for (technique, preset) in [
        ("voxel-mips", "accurate"),
        ("voxel-mips", "cones"),
        ("svo", "accurate"),
    ] {
        let case = Case {
            entry: find(technique).unwrap(),
            preset: Some(preset),
        };
        let strip = shoot(
            &gpu,
            &scene,
            &case,
            &[("resolution", "128")],
            frame(size.0, size.1, 64),
        )
        .unwrap()
        .indirect;
        let gathered = profile(&strip, 4);
        let [width, expected] =
            [&gathered, &traced].map(|profile| crossing(profile, 0.9) - crossing(profile, 0.1));
        let middle = crossing(&gathered, 0.5) - crossing(&traced, 0.5);
        println!(
            "{}: 10% to 90% in {width:.3} m, path-traced {expected:.3} m; half light {middle:+.3} \
             m apart",
            case.name()
        );
        assert!(
            (width / expected - 1.0).abs() <= 0.6 && middle.abs() <= 0.15,
            "{}: {gathered:.3?}\n{traced:.3?}",
            case.name()
        );
    }
}

/// By default there is no pass and no byte for cones of shadows and occlusion; with them, and
/// voxels lit by rays, there are no maps.
#[test]
fn what_is_not_asked_for_costs_nothing() {
    let gpu = gpu();
    let [(_, light), ..] = small_lights();
    let scene = small_room(Surfaces::Diffuse, vec![light]);
    let cones = [
        ("shadows", "cones"),
        ("occlusion_cones", "4"),
        ("injection", "voxel"),
        ("voxel_occlusion", "rays-hard"),
    ];
    for case in default_cases_with("shadows=cones") {
        for (pairs, own, maps) in [
            (&[][..], false, true),
            (&cones[..2], true, true),
            (&cones[..3], true, true),
            (&cones, true, false),
        ] {
            let pairs = [&[("resolution", "16")], pairs].concat();
            let (mut renderer, _) = Renderer::new(
                &gpu,
                &scene,
                case.entry,
                &case.settings(&pairs),
                frame(16, 16, 64),
            )
            .unwrap();
            let stats = renderer.render(&scene.camera).unwrap();
            let runs = |name: &str| stats.passes.iter().any(|pass| pass.name == name);
            let bytes = |name: &str| {
                gpu.memory()
                    .iter()
                    .filter(|(known, _)| known == name)
                    .map(|(_, bytes)| *bytes)
                    .sum::<u64>()
            };
            let what = format!("{}, {pairs:?}", case.name());
            assert_eq!(
                [
                    runs("cone.shadow"),
                    runs("cone.occlusion"),
                    bytes("cone.occlusion_set") > 0
                ],
                [own; 3],
                "{what}"
            );
            assert_eq!(runs("render.direct"), !own, "{what}");
            assert_eq!(
                [
                    runs("render.shadow_maps") || runs("render.rsm"),
                    bytes("light.depth") > 10_000
                ],
                [maps; 2],
                "{what}"
            );
        }
    }
}
