//! What is clear, in front of the picture and of the lights: against the oracle of its ways, the
//! reference, and pictures without it.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{Quat, Vec3};
use lumivox::frame::Renderer;
use lumivox::graph::{Buffer, BufferDesc, BufferUsage, Frame, Gpu, Owner};
use lumivox::image::{Aov, Image};
use lumivox::reference::{Bounces, Filter, ReferenceImage, Sampling, Settings, render};
use lumivox::render::clear::oracle::{ClearOracle, Way, clear_part};
use lumivox::render::clear::{ClearSurfaces, First};
use lumivox::render::{
    Follows, GBuffer, GpuScene, IndirectLight, Output, SightRays, exact_screen_image,
};
use lumivox::scene::{
    Environment, Light, LoadOptions, Material, Scene, Sky, Transmission, Triangle, Vertex,
};

use crate::support::compare::Worst;
use crate::support::scenes::{self, Corners, bundled};
use crate::support::technique::{Case, cases, default_cases, frame, is_sound, shoot};
use crate::support::{Random, gpu};

const SIZE: [u32; 2] = [48, 36];

fn glass(share: f32, filter: Vec3, index: f32) -> Material {
    Material {
        albedo: Vec3::ZERO,
        transmission: Some(Transmission {
            share,
            filter,
            index,
        }),
        ..Material::default()
    }
}

/// Adds a material and its triangles.
fn add(scene: &mut Scene, material: Material, triangles: &[[Vec3; 3]]) {
    let number = scene.materials.len() as u32;
    scene.materials.push(material);
    for corners in triangles {
        let first = scene.vertices.len() as u32;
        let normal = (corners[1] - corners[0])
            .cross(corners[2] - corners[0])
            .normalize_or(Vec3::Y);
        scene.vertices.extend(corners.map(|corner| Vertex {
            position: corner.to_array(),
            u: 0.0,
            normal: normal.to_array(),
            v: 0.0,
        }));
        scene.triangles.push(Triangle {
            vertices: [first, first + 1, first + 2],
            material: number,
        });
    }
}

/// A box, turned about the vertical.
fn cuboid(middle: Vec3, half: Vec3, turn: f32) -> Vec<Corners> {
    scenes::cuboid(middle, half, Quat::from_rotation_y(turn))
}

/// A vertical sheet before the camera of the Cornell box, left of its middle.
fn sheet(z: f32) -> Vec<[Vec3; 3]> {
    let corner = |x: f32, y: f32| Vec3::new(x, y, z);
    let [a, b, c, d] = [
        corner(-1.0, 0.0),
        corner(0.0, 0.0),
        corner(0.0, 2.0),
        corner(-1.0, 2.0),
    ];
    vec![[a, b, c], [a, c, d]]
}

/// A technique with a preset, or with its default.
fn case(name: &str, preset: Option<&str>) -> Case {
    let is_meant = |case: &Case| {
        case.entry.name == name && preset.is_none_or(|preset| case.preset == Some(preset))
    };
    cases().into_iter().find(is_meant).unwrap()
}

fn storage(gpu: &Gpu, rows: &[[f32; 4]]) -> Arc<Buffer> {
    let desc = BufferDesc {
        name: "rows".into(),
        size_bytes: size_of_val(rows) as u64,
        usage: BufferUsage::Storage,
        owner: Owner::Shared,
    };
    let buffer = gpu.create_buffer(&desc).unwrap();
    gpu.upload_buffer(&buffer, bytemuck::cast_slice(rows))
        .unwrap();
    buffer
}

/// What the device makes of the ways of a scene's pixels where nothing is met: the rays that it
/// asks for, step by step, and the picture.
struct Asked {
    rays: Vec<Vec<[f32; 8]>>,
    light: Vec<[f32; 4]>,
    depths: Vec<f32>,
}

fn ask(gpu: &Gpu, scene: &Scene) -> Asked {
    let mut on_gpu = GpuScene::new(gpu, scene).unwrap();
    let clear = ClearSurfaces::new(gpu, &mut on_gpu, true, SIZE)
        .unwrap()
        .expect("something is clear");
    let constants = on_gpu.frame_constants(&scene.camera, SIZE);
    on_gpu.set_frame(gpu, &constants).unwrap();
    let gbuffer = GBuffer::new(gpu, &on_gpu, SIZE, Follows::Nothing).unwrap();
    let output = Output::new(gpu, SIZE).unwrap();
    let count = (SIZE[0] * SIZE[1]) as usize;
    let nothing = storage(gpu, &vec![[0.0, 0.0, 0.0, 1.0]; count]);
    let diffuse = exact_screen_image(gpu, "diffuse", SIZE).unwrap();
    let light = IndirectLight {
        diffuse: Arc::clone(&diffuse),
        specular: None,
    };
    let mut frame = Frame::new();
    frame.set_scene(&on_gpu.set, &on_gpu.materials);
    clear.draw_shadows(&mut frame, &on_gpu);
    gbuffer.draw(&mut frame, &on_gpu);
    frame.clear_image("test.diffuse", &diffuse, [0.0; 4]);
    frame.clear_image("test.direct", &output.direct, [0.0; 4]);
    let mut kept = Vec::new();
    let see = |frame: &mut Frame, sights: SightRays<'_>| {
        let rows = storage(gpu, &vec![[0.0; 4]; 2 * count]);
        let bytes = (32 * count) as u64;
        frame.copy_buffer("test.rays", (sights.rays, 0), (&rows, 0), bytes);
        let sight_bytes = (16 * count) as u64;
        frame.copy_buffer(
            "test.sights",
            (&nothing, 0),
            (sights.sights, 0),
            sight_bytes,
        );
        kept.push(rows);
    };
    let covered = clear.draw(&mut frame, (&on_gpu, &gbuffer, &output), &light, see);
    gpu.submit(frame).unwrap();
    let read = |buffer: &Arc<Buffer>| {
        bytemuck::pod_collect_to_vec::<u8, [f32; 8]>(&gpu.read_buffer(buffer).unwrap())
    };
    let image = |image| gpu.read_image(image, 0, 0).unwrap();
    Asked {
        rays: kept.iter().map(read).collect(),
        light: bytemuck::pod_collect_to_vec(&image(covered.specular.as_ref().unwrap())),
        depths: bytemuck::pod_collect_to_vec(&image(&gbuffer.view_depth)),
    }
}

/// Sheets, boxes and balls of many indices in front of a wall, some within each other, some half
/// clear, a few without area, and a camera that may be within one.
fn cluttered(random: &mut Random, round: u32) -> Scene {
    let mut scene = bundled("two-rooms");
    scene.lights.clear();
    scene.environment = Environment::from(Vec3::new(0.4, 0.7, 1.0));
    scene.camera.eye = Vec3::new(0.0, 0.0, 5.0);
    scene.camera.target = Vec3::ZERO;
    scene.vertices.clear();
    scene.triangles.clear();
    scene.models.clear();
    let wall = |x: f32, y: f32| Vec3::new(x, y, -2.5);
    let wall = [wall(-1.0, -9.0), wall(9.0, -9.0), wall(9.0, 9.0)];
    add(&mut scene, Material::default(), &[wall]);
    let point = |random: &mut Random, size: f32| {
        size * Vec3::new(
            random.unit() - 0.5,
            random.unit() - 0.5,
            random.unit() - 0.5,
        )
    };
    for body in 0..6 {
        let index = [1.0, 1.2, 1.5, 2.4][random.below(4) as usize];
        let share = [1.0, 1.0, 0.7][random.below(3) as usize];
        let filter = Vec3::new(random.unit(), random.unit(), random.unit());
        let at = point(random, 3.0);
        let mut triangles = cuboid(
            at,
            Vec3::splat(0.2) + point(random, 0.2).abs() * 4.0,
            random.unit() * 3.0,
        );
        if body == 0 {
            triangles.push([at; 3]);
        }
        add(&mut scene, glass(share, filter, index), &triangles);
    }
    let ball = bundled("lit-sphere,subdivisions=2");
    let turned = |corner: u32| Vec3::from(ball.vertices[corner as usize].position) * -0.8;
    let triangles: Vec<[Vec3; 3]> = (ball.triangles.iter())
        .map(|triangle| triangle.vertices.map(turned))
        .collect();
    add(&mut scene, glass(1.0, Vec3::splat(0.9), 1.6), &triangles);
    for _ in 0..3 {
        let at = point(random, 4.0);
        let corners = [0; 3].map(|_: u32| at + point(random, 3.0));
        add(
            &mut scene,
            glass(0.9, point(random, 1.0).abs(), 1.0),
            &[corners],
        );
    }
    if round == 2 {
        let around = cuboid(scene.camera.eye, Vec3::splat(0.5), 0.3);
        add(&mut scene, glass(1.0, Vec3::ONE, 1.3), &around);
    }
    scene
}

fn expected(scene: &Scene, depths: &[f32]) -> Vec<[Way; 2]> {
    let clear = clear_part(scene).unwrap();
    let oracle = ClearOracle::new(&clear);
    let [right, up, forward] = scene.camera.basis();
    let tan = (0.5 * scene.camera.vfov_deg.to_radians()).tan();
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let of = |(index, depth): (usize, &f32)| {
        let [x, y] = [index as u32 % SIZE[0], index as u32 / SIZE[0]];
        let ndc = |at: u32, size: u32| (at as f32 + 0.5) / size as f32 * 2.0 - 1.0;
        let ray = forward + ndc(x, SIZE[0]) * (tan * aspect) * right - ndc(y, SIZE[1]) * tan * up;
        let end_m = if *depth > 0.0 {
            depth * ray.length()
        } else {
            f32::INFINITY
        };
        First::ALL.map(|first| oracle.way(scene.camera.eye, ray.normalize(), end_m, first))
    };
    depths.iter().enumerate().map(of).collect()
}

/// Whether a ray that was asked for is a line of the oracle's.
fn is_line(found: &[f32; 8], way: &Way, step: usize) -> bool {
    let direction = Vec3::new(found[4], found[5], found[6]);
    let Some(line) = way.lines.get(step) else {
        return direction == Vec3::ZERO;
    };
    // What is as good as nothing is not followed.
    if line.left.max_element() < 2e-4 {
        return true;
    }
    let is_end = if line.end_m.is_finite() {
        (found[3] - line.end_m).abs() < 2e-3 * (1.0 + line.end_m)
    } else {
        found[3].is_infinite()
    };
    (Vec3::new(found[0], found[1], found[2]) - line.origin).length() < 2e-3
        && (direction - line.direction).length() < 2e-3
        && is_end
}

/// Rays at the border of a surface may meet it or not, and what follows is another way.
const OTHER_WAYS: f32 = 0.02;

#[test]
fn ways_are_the_oracles() {
    let gpu = gpu();
    let mut random = Random::new(27);
    let (mut bodies, mut sheets) = (0, 0);
    for round in 0..4 {
        let scene = cluttered(&mut random, round);
        let asked = ask(&gpu, &scene);
        let ways = expected(&scene, &asked.depths);
        let steps = First::ALL.map(|first| first.sight_count() as usize);
        assert_eq!(asked.rays.len(), steps[0] + steps[1]);
        let (mut others, mut count) = (0, 0);
        for (pixel, ways) in ways.iter().enumerate() {
            let mut is_same = true;
            for (first, way) in ways.iter().enumerate() {
                for step in 0..steps[first] {
                    let rays = &asked.rays[first * steps[0] + step];
                    is_same &= is_line(&rays[pixel], way, step);
                }
            }
            let environment = scene.environment.uniform();
            let ended = |way: &Way| {
                let last = way.lines.last().filter(|line| line.end_m.is_infinite());
                last.map_or(Vec3::ZERO, |line| line.left)
            };
            let straight = ways[0].filter.unwrap_or(Vec3::ZERO);
            let left = straight + ended(&ways[0]) + ended(&ways[1]);
            let is_open = asked.depths[pixel] == 0.0 || ways[0].filter.is_none();
            let sent = match (ways[0].is_behind, is_open) {
                (false, _) => Vec3::ZERO,
                (true, true) => left * environment,
                // The direct light of what is behind was never drawn: alpha is 0 there.
                (true, false) => straight * environment,
            };
            let found = Vec3::from_slice(&asked.light[pixel][..3]);
            is_same &= (found - sent).length() < 4e-3;
            count += usize::from(ways[0].is_behind);
            bodies += usize::from(ways[0].filter.is_none());
            sheets += usize::from(ways[0].is_behind && ways[0].filter.is_some());
            others += usize::from(!is_same);
        }
        println!("round {round}: {others} of {count} pixels differ");
        assert!(
            others as f32 <= OTHER_WAYS * count as f32,
            "round {round}: {others} of {count} pixels have another way"
        );
    }
    assert!(bodies > 1000 && sheets > 100, "{bodies}, {sheets}");
}

fn reference(scene: &Scene, size: [u32; 2], bounces: Bounces, spp: u32) -> ReferenceImage {
    let settings = Settings {
        width: size[0],
        height: size[1],
        bounces,
        filter: Filter::Center,
        sampling: Sampling::Fixed { spp },
        ..Settings::default()
    };
    render(scene, &settings, &|_| {}).unwrap()
}

/// Share of all light by which pixels at the edges of shadows and of textures may differ; 6.8% at
/// most was measured.
const EDGES: f32 = 0.1;

/// The direct light is filtered by panes and stops at bodies, for each kind of light, as in the
/// reference.
#[test]
fn shadows_of_what_is_clear_are_the_references() {
    let gpu = gpu();
    let position = Vec3::new(5.0, 4.2, 0.4);
    let sun = bundled("glass").lights[0];
    let point = Light::Point {
        position,
        intensity: Vec3::splat(200.0),
    };
    let spot = Light::Spot {
        position,
        direction: (Vec3::new(0.0, 0.6, 0.0) - position).normalize(),
        intensity: Vec3::splat(200.0),
        inner_deg: 25.0,
        outer_deg: 30.0,
    };
    let rooms = [vec![sun], vec![point], vec![spot, sun]].map(|lights| {
        let mut room = bundled("glass");
        room.lights = lights;
        room.environment = Vec3::ZERO.into();
        room
    });
    // A block stands between the light and a pane at the back wall.
    let mut before = bundled("cornell");
    add(
        &mut before,
        glass(1.0, Vec3::new(0.9, 0.3, 0.2), 1.0),
        &sheet(-0.95),
    );
    before.lights = vec![Light::Point {
        position: Vec3::new(0.2, 0.9, 0.9),
        intensity: Vec3::splat(2.0),
    }];
    let rooms = rooms.map(|room| (room, EDGES));
    for (scene, edges) in rooms.into_iter().chain([(before, 0.1 * EDGES)]) {
        let size = [96, 54];
        let seen = reference(&scene, size, Bounces::Count(0), 1).direct;
        let (case, pairs) = (case("ray-traced", None), [("rays", "1")]);
        let shot = shoot(&gpu, &scene, &case, &pairs, frame(96, 54, 1024)).unwrap();
        let colored = |pixel: &Vec3| {
            pixel.max_element() > 0.1 && pixel.min_element() < 0.5 * pixel.max_element()
        };
        let lit = seen.pixels.iter().filter(|pixel| colored(pixel)).count();
        let pairs = shot.direct.pixels.iter().zip(&seen.pixels);
        let off: f32 = pairs
            .map(|(found, expected)| (*found - *expected).length())
            .sum();
        let all: f32 = seen.pixels.iter().map(|pixel| pixel.length()).sum();
        println!(
            "{lit} coloured pixels, off by {:.4} of all light",
            off / all
        );
        assert!(lit > 150, "{lit} coloured pixels");
        assert!(off < edges * all, "off by {} of all light", off / all);
    }
}

/// A sheet filters the picture of each technique exactly, where no light passes it.
#[test]
fn sheets_filter_every_picture() {
    let gpu = gpu();
    let filter = Vec3::new(0.8, 0.5, 0.25);
    let mut scene = bundled("cornell-lamp");
    let mut behind = scene.clone();
    add(&mut behind, glass(1.0, filter, 1.0), &sheet(0.6));
    add(&mut behind, glass(0.75, Vec3::ONE, 1.0), &sheet(0.58));
    // Without it no triangle and no row of materials has another number.
    scene.materials.clone_from(&behind.materials);
    for case in default_cases() {
        let name = case.name();
        let pairs = [("resolution", "16")];
        let shots = [&scene, &behind]
            .map(|scene| shoot(&gpu, scene, &case, &pairs, frame(24, 24, 64)).unwrap());
        let [without, with] = &shots;
        let mut worst = 0.0f32;
        let mut filtered = 0;
        for (index, (found, plain)) in with
            .full
            .pixels
            .iter()
            .zip(&without.full.pixels)
            .enumerate()
        {
            // The sheet ends in the middle of the picture.
            let is_behind = index % 24 < 12;
            let expected = if is_behind {
                *plain * filter * 0.75
            } else {
                *plain
            };
            worst = worst.max((*found - expected).length() / plain.length().max(1e-2));
            filtered += usize::from(is_behind && *plain != Vec3::ZERO);
            if is_behind {
                assert_eq!(with.direct.pixels[index], Vec3::ZERO, "{name}");
            }
        }
        println!("{name}: {worst:.1e} of {filtered}");
        assert!(is_sound(&with.full) && filtered > 50, "{name}");
        assert!(worst < 2e-3, "{name}: {worst}");
    }
}

/// A scene behind a slab of glass that is turned against the picture, and which pixels are.
fn behind_slab(name: &str) -> (Scene, Vec<bool>) {
    let mut scene = bundled(name);
    let along = (scene.camera.target - scene.camera.eye).normalize();
    let middle = scene.camera.eye + 0.53 * along;
    let turn = f32::atan2(-along.x, -along.z);
    let slab = cuboid(middle, Vec3::new(0.5, 0.6, 0.06), turn + 0.4);
    add(
        &mut scene,
        glass(1.0, Vec3::new(0.9, 0.95, 0.8), 1.5),
        &slab,
    );
    let ways = expected(&scene, &vec![0.0; (SIZE[0] * SIZE[1]) as usize]);
    let is_behind = ways.iter().map(|ways| ways[0].is_behind).collect();
    (scene, is_behind)
}

/// Issue 27's bar on cones and on rays: the light through a slab, against the reference's.
const THROUGH_SLAB: f64 = 0.15;

#[test]
fn cones_and_rays_see_through_a_slab() {
    let gpu = gpu();
    let (scene, is_behind) = behind_slab("cornell");
    let seen = reference(&scene, SIZE, Bounces::Count(1), 256)
        .light
        .specular;
    for (name, preset, pairs) in [
        ("ray-traced", None, &[][..]),
        ("voxel-mips", Some("cones"), &[("resolution", "128")][..]),
        ("voxel-mips", Some("accurate"), &[("resolution", "128")]),
        ("svo", Some("cones"), &[("resolution", "128")]),
        ("clipmap", Some("cones"), &[("resolution", "128")]),
    ] {
        let case = case(name, preset);
        let shot = shoot(&gpu, &scene, &case, pairs, frame(SIZE[0], SIZE[1], 512)).unwrap();
        let (mut squares, mut size, mut count) = (0.0, 0.0, 0);
        for (pixel, expected) in seen.pixels.iter().enumerate() {
            if is_behind[pixel] {
                let off = shot.light.specular.pixels[pixel] - *expected;
                squares += f64::from(off.length_squared());
                size += f64::from(expected.length_squared());
                count += 1;
            }
        }
        let rel_rmse = (squares / size).sqrt();
        println!("{}: rel_rmse {rel_rmse:.4} of {count} pixels", case.name());
        assert!(count > 300, "{count}");
        assert!(rel_rmse < THROUGH_SLAB, "{}: {rel_rmse}", case.name());
    }
}

/// A technique that sees along no rays leaves bodies out, and they alone.
#[test]
fn bodies_are_left_out_where_nothing_sees_along_rays() {
    let gpu = gpu();
    let (behind, _) = behind_slab("cornell");
    let pairs = [("resolution", "16")];
    let case = case("lpv", None);
    let mut plain = bundled("cornell");
    plain.materials.clone_from(&behind.materials);
    let [with, without] = [&behind, &plain]
        .map(|scene| shoot(&gpu, scene, &case, &pairs, frame(24, 24, 64)).unwrap());
    assert_eq!(with.full.pixels, without.full.pixels);
}

/// A scene on the device goes from a technique that shows bodies to one that leaves them out, and
/// back.
#[test]
fn another_technique_has_its_own_shadows() {
    let gpu = gpu();
    let (behind, _) = behind_slab("cornell");
    let size = frame(24, 24, 64);
    let mut on_gpu = GpuScene::new(&gpu, &behind).unwrap();
    for name in ["ray-traced", "lpv", "ray-traced"] {
        let case = case(name, None);
        let settings = case.settings(&[("resolution", "16")]);
        let made = Renderer::of(&gpu, on_gpu, case.entry, &settings, size);
        let (mut renderer, _) = made.unwrap();
        renderer.render(&behind.camera).unwrap();
        let passed_on = renderer.aov(Aov::Full).unwrap();
        on_gpu = renderer.into_scene();
        let fresh = shoot(&gpu, &behind, &case, &[("resolution", "16")], size).unwrap();
        assert_eq!(passed_on.pixels, fresh.full.pixels, "{name}");
    }
}

/// A map of the sky, before and after it has changed, and a lamp are seen through a ball.
#[test]
fn a_ball_shows_the_sky_and_a_lamp() {
    let gpu = gpu();
    let ball = bundled("lit-sphere,subdivisions=4");
    let turned = |corner: u32| Vec3::from(ball.vertices[corner as usize].position) * -1.0;
    let triangles: Vec<[Vec3; 3]> = (ball.triangles.iter())
        .map(|triangle| triangle.vertices.map(turned))
        .collect();
    let mut scene = bundled("cornell");
    scene.lights.clear();
    scene.triangles.clear();
    scene.models.clear();
    scene.camera.eye = Vec3::new(0.0, 0.0, 4.0);
    scene.camera.target = Vec3::ZERO;
    scene.camera.vfov_deg = 40.0;
    let far = |x: f32, y: f32| Vec3::new(x, y, -5.0);
    let lamp = Material {
        emission: Vec3::new(3.0, 2.0, 1.0),
        ..Material::default()
    };
    add(
        &mut scene,
        lamp,
        &[[far(-1.0, -1.0), far(2.0, -1.0), far(-1.0, 2.0)]],
    );
    add(&mut scene, glass(1.0, Vec3::ONE, 1.5), &triangles);
    let sky = |shift: f32| -> Environment {
        let map = Image::from_fn(64, 32, |at| {
            let turn = std::f32::consts::TAU * (at % 64) as f32 / 64.0 + shift;
            Vec3::new(1.0 + 0.5 * turn.cos(), 1.0, 1.0 + 0.5 * turn.sin())
        });
        Sky::new(map, 0.0).unwrap().into()
    };
    scene.environment = sky(0.0);
    let case = case("ray-traced", None);
    let settings = case.settings(&[]);
    let size = frame(40, 40, 64);
    let (mut renderer, _) = Renderer::new(&gpu, &scene, case.entry, &settings, size).unwrap();
    for shift in [0.0, 2.0] {
        scene.environment = sky(shift);
        renderer.move_lights(&scene).unwrap();
        renderer.render(&scene.camera).unwrap();
        let found = renderer.aov(Aov::Full).unwrap();
        let seen = reference(&scene, [40, 40], Bounces::Count(1), 512).radiance();
        let pairs = found.pixels.iter().zip(&seen.pixels);
        let off = pairs
            .clone()
            .map(|(found, seen)| (*found - *seen).length_squared());
        let size = pairs.map(|(_, seen)| seen.length_squared());
        let rel_rmse = (off.sum::<f32>() / size.sum::<f32>()).sqrt();
        println!("sky turned by {shift}: rel_rmse {rel_rmse:.4}");
        // What the ball mirrors within is left out.
        assert!(rel_rmse < 0.08, "{shift}: {rel_rmse}");
    }
}

/// A folder for the files of a test.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A room with a pane and a block of glass that move.
fn moving_glass() -> Scene {
    let folder = folder("moving-glass");
    bundled("cornell").write(&folder).unwrap();
    let mtl = "newmtl pane\nKd 0 0 0\nd 0\nTf 0.9 0.3 0.2\nillum 4\n\
               newmtl block\nKd 0 0 0\nd 0\nNi 1.4\nTf 0.9 0.9 0.9\nillum 7\n";
    std::fs::write(folder.join("glass.mtl"), mtl).unwrap();
    let mut obj = String::from("mtllib glass.mtl\n");
    let mut first = 1;
    for (name, at) in [("pane", Vec3::ZERO), ("block", Vec3::new(0.0, -0.5, 0.0))] {
        let half = if name == "pane" {
            Vec3::new(0.4, 0.0, 0.4)
        } else {
            Vec3::new(0.2, 0.2, 0.05)
        };
        obj += &format!("usemtl {name}\n");
        for triangle in cuboid(at, half, 0.2) {
            let area = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
            if area.length() == 0.0 {
                continue;
            }
            for corner in triangle {
                obj += &format!("v {} {} {}\n", corner.x, corner.y, corner.z);
            }
            obj += &format!("f {} {} {}\n", first, first + 1, first + 2);
            first += 3;
        }
    }
    std::fs::write(folder.join("glass.obj"), obj).unwrap();
    let toml = "[[model]]\npath = \"cornell.obj\"\n\
                [[model]]\npath = \"glass.obj\"\ndynamic = true\n\
                [[model.keyframe]]\ntime_s = 0.0\ntranslate = [-0.2, 1.3, 0.2]\n\
                [[model.keyframe]]\ntime_s = 1.0\ntranslate = [0.3, 1.2, 0.3]\n\
                rotate_deg = [0.0, 50.0, 0.0]\n\
                [camera]\neye = [0.0, 1.0, 0.98]\ntarget = [0.0, 1.0, -1.0]\nvfov_deg = 75.0\n\
                [[light]]\nkind = \"point\"\nposition = [0.0, 1.6, 0.0]\n\
                intensity = [2.0, 1.8, 1.5]\n";
    let path = folder.join("scene.toml");
    std::fs::write(&path, toml).unwrap();
    Scene::open(path.to_str().unwrap(), &LoadOptions::default()).unwrap()
}

/// Glass that has moved, and lights that have moved behind it, look as to a new renderer.
#[test]
fn moved_glass_is_that_of_a_new_renderer() {
    let gpu = gpu();
    for name in ["ray-traced", "voxel-mips", "lpv"] {
        let case = case(name, None);
        // Light that voxels had in the frame before would differ.
        let settings = case.settings(&[("resolution", "16"), ("bounces", "1")]);
        let mut scene = moving_glass();
        let size = frame(32, 32, 64);
        let make = |scene: &Scene| {
            let made = Renderer::new(&gpu, scene, case.entry, &settings, size);
            made.unwrap().0
        };
        let picture = |renderer: &mut Renderer<'_>, scene: &Scene| -> Image {
            renderer.cut();
            renderer.render_again(&scene.camera).unwrap();
            renderer.aov(Aov::Full).unwrap()
        };
        let mut moved = make(&scene);
        let before = picture(&mut moved, &scene);
        scene.set_time(0.7);
        moved.set_pose(&scene).unwrap();
        let followed = picture(&mut moved, &scene);
        assert_ne!(before.pixels, followed.pixels, "{name}");
        let fresh = picture(&mut make(&scene), &scene);
        let difference = |a: &Image, b: &Image| {
            let pairs = a.pixels.iter().zip(&b.pixels);
            pairs.map(|(a, b)| f64::from((*a - *b).length())).worst()
        };
        let far = difference(&followed, &fresh);
        assert!(far < 1e-4, "{name}: moved glass is off by {far}");
        scene.lights[0] = Light::Point {
            position: Vec3::new(0.4, 1.8, 0.3),
            intensity: Vec3::splat(2.0),
        };
        moved.move_lights(&scene).unwrap();
        let relit = picture(&mut moved, &scene);
        let far = difference(&relit, &picture(&mut make(&scene), &scene));
        assert!(far < 1e-4, "{name}: a moved light is off by {far}");
    }
}
