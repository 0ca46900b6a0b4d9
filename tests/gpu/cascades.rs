//! Cascades of directional lights: texels that stay where they are, shadows without acne and
//! without leaks, maps that are drawn only when they have changed, surfaces that inject light once.

use glam::{Vec2, Vec3};
use lumivox::frame::{FrameSettings, Renderer};
use lumivox::gi::registry::find;
use lumivox::graph::{Frame, FrameStats, Gpu};
use lumivox::image::{Aov, Image};
use lumivox::metrics::stability::translation_spread;
use lumivox::render::{
    GpuLightView, GpuScene, LightCascades, LightMaps, MapChannel, ShadowSettings, UNDERSAMPLED,
    Watcher, read_light_map,
};
use lumivox::scene::{Camera, Light, Scene};

use crate::support::gpu;
use crate::support::scenes::{add_model, still};
use crate::support::technique::Builder;

const SUN: Vec3 = Vec3::new(0.3, -0.8, 0.52);

/// A street of boxes of many heights, 60 m long, with slanting roofs.
fn street(sun: Vec3) -> Scene {
    let mut builder = Builder::default();
    let stone = builder.matte("stone", Vec3::new(0.6, 0.5, 0.4));
    let ground = [Vec3::new(-8.0, 0.0, -30.0), Vec3::Z * 60.0, Vec3::X * 16.0];
    builder.quad(stone, ground[0], ground[1], ground[2]);
    for house in 0..20 {
        let side = if house % 2 == 0 { -5.0 } else { 3.0 };
        let low = Vec3::new(side, 0.0, 5.7 * (house / 2) as f32 - 29.0);
        let high = low + Vec3::new(2.0, 1.0 + 0.37 * (house % 7) as f32, 3.1);
        builder.cuboid(stone, low, high);
        let roof = Vec3::new(low.x - 0.2, high.y, low.z);
        builder.quad(stone, roof, Vec3::Z * 3.1, Vec3::new(2.4, 0.9, 0.0));
    }
    let camera = Camera {
        eye: Vec3::new(0.4, 1.7, 24.0),
        target: Vec3::new(-0.3, 1.2, 0.0),
        up: Vec3::Y,
        vfov_deg: 60.0,
    };
    builder.finish("street", vec![sun_of(sun)], Vec3::ZERO, camera)
}

fn sun_of(direction: Vec3) -> Light {
    Light::Directional {
        direction: direction.normalize(),
        irradiance: Vec3::splat(3.0),
    }
}

fn shadows(resolution: u32, cascades: u32) -> ShadowSettings {
    ShadowSettings {
        cascades,
        split_lambda: 0.8,
        ..ShadowSettings::of_resolution(resolution)
    }
}

/// Maps of all views as they hold them: depth, and of those for injection normal and reflected
/// share.
struct Drawn {
    rows: Vec<GpuLightView>,
    texels: Vec<[Option<Image>; 3]>,
}

fn draw(gpu: &Gpu, scene: &GpuScene, maps: &mut LightMaps, camera: Camera) -> Drawn {
    let watcher = Watcher {
        camera,
        aspect: 1.5,
        split_lambda: 0.8,
    };
    maps.follow(gpu, scene, Some(watcher)).unwrap();
    let mut frame = Frame::new();
    frame.set_scene(&scene.set, &scene.materials);
    maps.draw(&mut frame, scene);
    gpu.submit(frame).unwrap();
    let channels = [MapChannel::Depth, MapChannel::Normal, MapChannel::Reflected];
    let read = |view| channels.map(|channel| read_light_map(gpu, maps, channel, view).unwrap());
    Drawn {
        rows: maps.rows().to_vec(),
        texels: (0..maps.rows().len() as u32).map(read).collect(),
    }
}

/// Texels that are in both of two maps, and how many of them differ.
fn differing(a: &Drawn, b: &Drawn, view: usize, channel: usize) -> Option<(usize, usize)> {
    let (first, second) = (
        a.texels[view][channel].as_ref()?,
        b.texels[view][channel].as_ref()?,
    );
    let begins = |row: &GpuLightView| [row.light[2] as i32, row.light[3] as i32];
    let (from, to) = (begins(&a.rows[view]), begins(&b.rows[view]));
    let size = first.width as i32;
    let mut counts = (0, 0);
    for y in 0..size {
        for x in 0..size {
            let other = [x + from[0] - to[0], y + from[1] - to[1]];
            if other.iter().any(|at| !(0..size).contains(at)) {
                continue;
            }
            let texel = |image: &Image, [x, y]: [i32; 2]| {
                image.pixels[(x + y * size) as usize]
                    .to_array()
                    .map(f32::to_bits)
            };
            counts.0 += 1;
            counts.1 += usize::from(texel(first, [x, y]) != texel(second, other));
        }
    }
    Some(counts)
}

/// The camera moves by sixteen steps of a part of a texel, and turns: what two maps have in common
/// is the same in both, bit by bit.
#[test]
fn texels_in_two_maps_are_the_same() {
    let gpu = gpu();
    let scene = street(SUN);
    let mut on_gpu = GpuScene::new(&gpu, &scene).unwrap();
    let cascades = LightCascades {
        count: 3,
        everywhere: true,
    };
    on_gpu.set_cascades(&gpu, cascades).unwrap();
    let mut maps = LightMaps::new(&gpu, &on_gpu, 128, true).unwrap();
    let first = draw(&gpu, &on_gpu, &mut maps, scene.camera);
    assert_eq!(first.rows.len(), 6);
    let (mut shifted, mut compared) = (0, 0);
    for step in 1..=16 {
        let by = Vec3::new(0.011, 0.0013, -0.027) * step as f32;
        let camera = Camera {
            eye: scene.camera.eye + by,
            target: scene.camera.target + by + 0.2 * Vec3::X * step as f32,
            ..scene.camera
        };
        let now = draw(&gpu, &on_gpu, &mut maps, camera);
        for view in 0..now.rows.len() {
            shifted += usize::from(now.rows[view].light != first.rows[view].light);
            assert_eq!(now.rows[view].right, first.rows[view].right);
            for channel in 0..3 {
                let Some((common, others)) = differing(&first, &now, view, channel) else {
                    continue;
                };
                compared += common;
                assert_eq!(
                    others, 0,
                    "step {step}, view {view}, channel {channel}: {others} of {common} differ"
                );
            }
        }
    }
    assert!(shifted > 5 && compared > 1_000_000, "{shifted}, {compared}");
}

fn renderer<'g>(
    gpu: &'g Gpu,
    scene: &Scene,
    technique: (&str, &[&str]),
    size: [u32; 2],
    shadows: ShadowSettings,
) -> Renderer<'g> {
    let entry = find(technique.0).unwrap();
    let settings = entry.settings(None, technique.1).unwrap();
    let frame = FrameSettings { size, shadows };
    Renderer::new(gpu, scene, entry, &settings, frame)
        .unwrap()
        .0
}

fn maps_drawn(stats: &FrameStats) -> usize {
    let is_map = |name: &str| ["render.shadow_maps", "render.rsm"].contains(&name);
    let maps = stats.passes.iter().filter(|pass| is_map(&pass.name));
    maps.map(|pass| pass.runs as usize).sum()
}

/// A still scene draws no map. A light that only changes its power draws none, one that turns draws
/// its own; a camera that moves far draws cascades; models draw those maps that see them.
#[test]
fn maps_are_drawn_when_they_have_changed() {
    let gpu = gpu();
    let mut scene = street(SUN);
    scene.lights.push(Light::Spot {
        position: Vec3::new(0.0, 5.0, -20.0),
        direction: Vec3::NEG_Y,
        intensity: Vec3::ONE,
        inner_deg: 10.0,
        outer_deg: 20.0,
    });
    let mut box_builder = Builder::default();
    let red = box_builder.matte("red", Vec3::X);
    box_builder.cuboid(red, Vec3::ZERO, Vec3::splat(0.5));
    let model = box_builder.finish("box", Vec::new(), Vec3::ZERO, scene.camera);
    let far = Vec3::new(-0.2, 0.1, -20.0);
    add_model(&mut scene, model, &[still(far), still(far + 0.5 * Vec3::X)]);
    for (technique, cascades, all) in [("none", 1, 2), ("none", 3, 4), ("voxel-mips", 3, 7)] {
        let settings: &[&str] = if technique == "none" {
            &[]
        } else {
            &["resolution=16", "injection=rsm"]
        };
        let shadows = ShadowSettings {
            split_lambda: 1.0,
            ..shadows(64, cascades)
        };
        let mut renderer = renderer(&gpu, &scene, (technique, settings), [24, 16], shadows);
        let mut camera = scene.camera;
        let draws = |renderer: &mut Renderer<'_>, camera: &Camera| {
            maps_drawn(&renderer.render_again(camera).unwrap())
        };
        let name = format!("{technique}, {cascades} cascades");
        assert_eq!(
            draws(&mut renderer, &camera),
            all,
            "{name}: the first frame"
        );
        assert_eq!(draws(&mut renderer, &camera), 0, "{name}: a still scene");
        assert_eq!(
            maps_drawn(&renderer.render(&camera).unwrap()),
            all,
            "{name}"
        );
        let mut changed = scene.clone();
        changed.lights[0] = Light::Directional {
            direction: SUN.normalize(),
            irradiance: Vec3::ONE,
        };
        renderer.move_lights(&changed).unwrap();
        assert_eq!(draws(&mut renderer, &camera), 0, "{name}: another power");
        changed.lights[0] = sun_of(SUN + 0.1 * Vec3::X);
        renderer.move_lights(&changed).unwrap();
        assert_eq!(
            draws(&mut renderer, &camera),
            all - 1,
            "{name}: the sun turns"
        );
        let mut moved = scene.clone();
        moved.set_time(1.0);
        renderer.set_pose(&moved).unwrap();
        let found = draws(&mut renderer, &camera);
        assert!(
            if cascades == 1 {
                found == all
            } else {
                (1..all).contains(&found)
            },
            "{name}: a far model moves, {found} of {all}"
        );
        camera.eye -= 12.0 * Vec3::Z;
        camera.target -= 12.0 * Vec3::Z;
        let found = draws(&mut renderer, &camera);
        assert!(
            if cascades == 1 {
                found == 0
            } else {
                (1..all).contains(&found)
            },
            "{name}: the camera moves, {found} of {all}"
        );
    }
}

/// A wall as thick as a texel of the map on a ground, seen from above.
fn wall(sun: Vec3, thickness: f32) -> Scene {
    let mut builder = Builder::default();
    let stone = builder.matte("stone", Vec3::splat(0.5));
    let corner = Vec3::new(-4.0, 0.0, -4.0);
    builder.quad(stone, corner, Vec3::Z * 8.0, Vec3::X * 8.0);
    let low = Vec3::new(-thickness, 0.0, -3.9);
    builder.cuboid(stone, low, Vec3::new(0.0, 1.0, 3.9));
    let camera = Camera {
        eye: Vec3::new(0.0, 3.0, 0.0),
        target: Vec3::ZERO,
        up: Vec3::NEG_Z,
        vfov_deg: 40.0,
    };
    builder.finish("wall", vec![sun_of(sun)], Vec3::ZERO, camera)
}

/// At twenty heights of the sun, a wall as thick as a texel throws a shadow without a hole from its
/// foot on, and no ground is dark that is not in it. The shadow's end may be off by a texel, which
/// is longer on the ground where the sun is low.
#[test]
fn a_wall_of_one_texel_leaks_nothing_and_ground_has_no_acne() {
    let gpu = gpu();
    let size = [96, 64];
    let (mut lit, mut dark) = (0, 0);
    let (mut leaks, mut acne) = ((0, 0.0f32), (0, 0.0f32));
    for step in 0..20 {
        let height_deg = 3.0 + 4.5 * step as f32;
        let (sin, cos) = height_deg.to_radians().sin_cos();
        let azimuth = Vec3::new(1.0, 0.0, 0.13 * step as f32 - 1.0).normalize();
        let sun = azimuth * cos - Vec3::Y * sin;
        let mut on_gpu = GpuScene::new(&gpu, &wall(sun, 0.05)).unwrap();
        let cascades = LightCascades {
            count: 2,
            everywhere: false,
        };
        on_gpu.set_cascades(&gpu, cascades).unwrap();
        let mut maps = LightMaps::new(&gpu, &on_gpu, 128, false).unwrap();
        let scene = wall(sun, 0.05);
        let watcher = Watcher {
            camera: scene.camera,
            aspect: 1.5,
            split_lambda: 0.8,
        };
        maps.follow(&gpu, &on_gpu, Some(watcher)).unwrap();
        let longest = |row: &GpuLightView| {
            let edges = [row.right, row.down].map(|side| Vec3::from_slice(&side).length());
            2.0 * edges[0].max(edges[1]) / 128.0
        };
        let texel_m = maps
            .rows()
            .iter()
            .map(longest)
            .fold(0.0, |a: f32, b| a.max(b));
        let scene = wall(sun, texel_m);
        let mut renderer = renderer(&gpu, &scene, ("none", &[]), size, shadows(128, 2));
        renderer.render(&scene.camera).unwrap();
        let direct = renderer.aov(Aov::Direct).unwrap();
        let depth = renderer.aov(Aov::Depth).unwrap();
        let whole = 0.5 / std::f32::consts::PI * 3.0 * sin;
        let [.., forward] = scene.camera.basis();
        for (index, pixel) in direct.pixels.iter().enumerate() {
            let at = Vec2::new(
                (index as u32 % size[0]) as f32 + 0.5,
                (index as u32 / size[0]) as f32 + 0.5,
            );
            let ray = scene.camera.ray_direction(at.x, at.y, size[0], size[1]);
            let point = scene.camera.eye + depth.pixels[index].x / ray.dot(forward) * ray;
            if point.y.abs() > 1e-3 || point.z.abs() > 1.2 {
                continue;
            }
            // How high the sun's ray is where it leaves the wall, less the wall's height.
            let above = point.x * sin / (cos * azimuth.x) - 1.0;
            let margin = 2.0 * texel_m / (cos * azimuth.x);
            if point.x > 1e-3 && above < -margin {
                dark += 1;
                if pixel.x > 0.0 {
                    leaks = (leaks.0 + 1, leaks.1.max(pixel.x / whole));
                    println!(
                        "{height_deg}°: {point} is in the shadow: {}",
                        pixel.x / whole
                    );
                }
            }
            if point.x < -texel_m - 1e-3 || above > margin {
                lit += 1;
                if pixel.x < 0.999 * whole {
                    acne = (acne.0 + 1, acne.1.max(1.0 - pixel.x / whole));
                    println!("{height_deg}°: {point} is lit: {}", pixel.x / whole);
                }
            }
        }
    }
    println!("{leaks:?} of {dark} leak, {acne:?} of {lit} have acne");
    assert!(lit > 10_000 && dark > 5_000, "{lit} lit, {dark} dark");
    assert!(
        leaks.0 == 0 && acne.0 == 0,
        "{leaks:?} leak, {acne:?} have acne"
    );
}

/// What lights reach is the same with cascades: each surface is in one map.
#[test]
fn surfaces_inject_once() {
    let gpu = gpu();
    let scene = street(SUN);
    let injected = |shadows: ShadowSettings| {
        let set = ["resolution=32", "source=rsm"];
        let mut renderer = renderer(&gpu, &scene, ("lpv", &set), [16, 16], shadows);
        renderer.render(&scene.camera).unwrap();
        let energy = renderer.energy().unwrap().unwrap();
        energy.rows()[0].1.x
    };
    let one = injected(shadows(512, 1));
    for (cascades, resolution) in [(2, 256), (3, 128), (4, 100), (6, 64)] {
        let found = injected(shadows(resolution, cascades));
        println!("{cascades} cascades of {resolution}²: {found} W for {one} W");
        assert!(
            (found / one - 1.0).abs() < 0.02,
            "{cascades}: {found} for {one}"
        );
    }
}

/// What stands in the scene moves with the camera by parts of a texel, while the scene's bounds and
/// with them the texels stay: the direct light hardly changes.
#[test]
fn direct_light_does_not_swim() {
    let gpu = gpu();
    let picture = |step: u32| {
        let by = 0.01 * step as f32 * Vec3::new(1.0, 0.0, 0.7);
        let mut scene = street(SUN);
        for vertex in &mut scene.vertices {
            vertex.position = (Vec3::from(vertex.position) + by).to_array();
        }
        let mut builder = Builder::default();
        let stone = builder.matte("stone", Vec3::ONE);
        for corner in [Vec3::new(-12.0, -1.0, -40.0), Vec3::new(12.0, 8.0, 40.0)] {
            builder.quad(stone, corner, 0.01 * Vec3::X, 0.01 * Vec3::Y);
        }
        let bounds = builder.finish("bounds", Vec::new(), Vec3::ZERO, scene.camera);
        add_model(&mut scene, bounds, &[still(Vec3::ZERO)]);
        scene.camera.eye += by;
        scene.camera.target += by;
        let mut renderer = renderer(&gpu, &scene, ("none", &[]), [96, 64], shadows(1024, 4));
        renderer.render(&scene.camera).unwrap();
        renderer.aov(Aov::Direct).unwrap()
    };
    let pictures: Vec<Image> = (0..6).map(picture).collect();
    let spread = translation_spread(&pictures).unwrap();
    println!("spread {spread}");
    assert!(spread <= 0.01, "{spread}");
}

/// More cascades leave fewer pixels with too coarse a map; of maps without a texel to spare there
/// is none.
#[test]
fn coarse_maps_are_counted() {
    let gpu = gpu();
    let scene = street(SUN);
    let count = |shadows: ShadowSettings| {
        let mut renderer = renderer(&gpu, &scene, ("none", &[]), [48, 32], shadows);
        renderer.render(&scene.camera).unwrap();
        let counts = renderer.counts_of_report().unwrap();
        counts
            .iter()
            .find(|(name, _)| *name == UNDERSAMPLED)
            .unwrap()
            .1
    };
    let found =
        [(64, 1), (64, 4), (4096, 1)].map(|(size, cascades)| count(shadows(size, cascades)));
    println!("{found:?} pixels");
    assert!(
        found[0] > found[1] && found[1] > 0 && found[2] == 0,
        "{found:?}"
    );
}
