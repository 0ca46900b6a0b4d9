//! Nested lattices of probes around the camera.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec3, IVec3, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::probes::cascades::ENTRY;
use lumivox::gi::probes::cascades::layout::Layout;
use lumivox::gi::probes::cascades::need::{looks_up, needed};
use lumivox::gi::probes::cascades::place::{RAYS, place};
use lumivox::gi::probes::cascades::pool::{Key, Pool};
use lumivox::gi::probes::list::ProbeList;
use lumivox::gi::probes::oracle;
use lumivox::gi::probes::relocate::away;
use lumivox::graph::{BufferDesc, BufferUsage, Frame, Gpu, Owner};
use lumivox::image::{Aov, Image};
use lumivox::render::GpuScene;
use lumivox::render::bvh::oracle::RayOracle;
use lumivox::scene::{Camera, Scene};

use crate::probes::{scenes, seen, traced};
use crate::support::scenes::bundled;
use crate::support::technique::{frame, largest_difference};
use crate::support::{Random, gpu};

/// Bounds (m), an eye (m), probes along an edge, levels, and the finest spacing (m).
fn random_layout(random: &mut Random) -> (Layout, Vec3, (Vec3, Vec3), f32) {
    let vector = |random: &mut Random| Vec3::new(random.unit(), random.unit(), random.unit());
    let low = 20.0 * vector(random) - 10.0;
    let high = low + 30.0 * vector(random) * vector(random);
    let spacing = if random.below(2) == 0 {
        0.0
    } else {
        0.05 + random.unit()
    };
    let (probes, levels) = (4 + random.below(20), 1 + random.below(6));
    let layout = Layout::new((low, high), probes, levels, spacing);
    let eye = low + (high - low) * (1.6 * vector(random) - 0.3);
    (layout, eye, (low, high), spacing)
}

#[test]
fn levels_are_around_the_eye_and_inside_of_the_scene() {
    let mut random = Random::new(31);
    for _ in 0..500 {
        let (layout, eye, (low, high), spacing) = random_layout(&mut random);
        let windows = layout.windows(eye);
        assert_eq!(windows.len(), layout.levels as usize);
        for window in &windows {
            let lattice = &window.lattice;
            let cell = lattice.spacing.x;
            let last = lattice.place(lattice.probe_count() - 1);
            for axis in 0..3 {
                let [lower, upper] = [0, 1].map(|side| window.open >> (2 * axis + side) & 1 == 1);
                // Where a level ends before the scene does, the eye is in its middle, or the other
                // end is at the scene's border.
                let middle = 0.5 * (lattice.first[axis] + last[axis]);
                let off = (eye[axis] - middle) / cell;
                assert!(!lower || upper || off > -0.51, "{off}");
                assert!(!upper || lower || off < 0.51, "{off}");
                assert!(!(lower && upper) || off.abs() < 0.51, "{off}");
                assert!(lower || (lattice.first[axis] - low[axis]).abs() < 0.51 * cell);
                assert!(lower || lattice.counts[axis] == 2 || lattice.first[axis] > low[axis]);
                assert!(upper || last[axis] > high[axis] - 0.26 * cell);
                assert!(!lower || lattice.first[axis] > low[axis]);
                // What is flat has probes on both sides.
                if !lower && !upper && lattice.counts[axis] == 2 {
                    let scene = 0.5 * (low[axis] + high[axis]);
                    assert!((middle - scene).abs() < 1e-3 * cell.max(1.0));
                }
            }
            for probe in [0, lattice.probe_count() / 2, lattice.probe_count() - 1] {
                assert_eq!(window.find(window.at(probe)), Some(probe));
            }
            assert_eq!(window.find(window.first - IVec3::X), None);
            assert_eq!(window.find(window.first + lattice.counts.as_ivec3()), None);
        }
        for pair in windows.windows(2) {
            let cells = pair[1].lattice.spacing.x / pair[0].lattice.spacing.x;
            assert!((cells - 2.0).abs() < 1e-5);
        }
        // Without a spacing, the outermost holds the scene.
        let outermost = windows.last().unwrap();
        assert!(spacing > 0.0 || outermost.open == 0, "{}", outermost.open);
    }
}

#[test]
fn probes_have_the_same_place_whatever_window_shows_them() {
    let mut random = Random::new(32);
    for _ in 0..200 {
        let (layout, eye, ..) = random_layout(&mut random);
        let other = eye + layout.finest * Vec3::new(2.0, -1.0, 0.7);
        let pairs = layout.windows(eye).into_iter().zip(layout.windows(other));
        for (a, b) in pairs {
            for probe in 0..a.lattice.probe_count() {
                let Some(again) = b.find(a.at(probe)) else {
                    continue;
                };
                let [place, there] = [a.lattice.place(probe), b.lattice.place(again)];
                assert!(place.distance(there) < 1e-4 * a.lattice.spacing.x.max(1.0));
            }
        }
    }
}

/// Whether each probe is lit by now, by a pool and by hand.
#[test]
fn a_pool_holds_what_is_needed_and_lights_all_in_turn() {
    let mut random = Random::new(33);
    let levels = 3;
    for case in 0..60 {
        let mut capacity = 40 + random.below(60);
        let mut pool = Pool::new(capacity);
        let mut slots: BTreeMap<Key, u32> = BTreeMap::new();
        for _ in 0..20 {
            let count = random.below(120);
            let needed: BTreeSet<Key> = (0..count)
                .map(|_| {
                    let at = IVec3::new(random.below(6) as i32, random.below(4) as i32 - 9, 0);
                    Key::new(random.below(levels), levels, at)
                })
                .collect();
            assert_eq!(pool.room(), capacity);
            if random.below(5) == 0 {
                capacity += random.below(9);
            }
            pool.grow(capacity);
            assert_eq!(pool.room(), capacity);
            if needed.len() > capacity as usize {
                continue;
            }
            pool.hold(&needed);
            assert_eq!(pool.held() as usize, needed.len());
            slots.retain(|key, _| needed.contains(key));
            // Whoever stays has its light and its slot.
            let lit: BTreeMap<Key, u32> = pool.lit().collect();
            assert_eq!(lit, slots);
            let most = random.below(30);
            // Who was lit again, and who had light before.
            let mut again: Vec<(Key, BTreeSet<Key>)> = Vec::new();
            for _ in 0..random.below(12) {
                let turn = pool.advance(most);
                let unlit = needed.len() - slots.len();
                let is_coarsest = |key: &Key| key.level(levels) == levels - 1;
                let free = turn.new.iter().filter(|(key, _)| is_coarsest(key)).count();
                for (key, slot) in &turn.new {
                    assert!(needed.contains(key) && *slot < capacity);
                    assert_eq!(
                        slots.insert(*key, *slot),
                        None,
                        "lit twice for the first time"
                    );
                }
                let all = turn.new.len() + turn.again.len();
                if most == 0 {
                    assert_eq!(all, needed.len(), "case {case}");
                } else {
                    assert!(all <= (most as usize).max(free));
                    let is_busy = all >= (most as usize).min(needed.len());
                    assert!(is_busy && turn.new.len() >= unlit.min(most as usize));
                }
                for (key, slot) in &turn.again {
                    assert_eq!(slots[key], *slot);
                    // All others have their turn before.
                    if let Some(last) = again.iter().rposition(|(before, _)| before == key) {
                        let since = again[last..].iter().map(|(key, _)| *key);
                        let since: BTreeSet<Key> = since.collect();
                        assert!(again[last].1.is_subset(&since), "somebody waits");
                    }
                    let is_new = |key: &&Key| turn.new.iter().any(|(new, _)| new == *key);
                    let old = slots.keys().filter(|key| !is_new(key));
                    again.push((*key, old.copied().collect()));
                }
            }
            let different: BTreeSet<u32> = slots.values().copied().collect();
            assert_eq!(different.len(), slots.len(), "two probes in a slot");
        }
    }
}

#[test]
fn probes_are_needed_that_places_look_up() {
    let gpu = gpu();
    for scene in scenes() {
        let on_gpu = GpuScene::new(&gpu, &scene).unwrap();
        let layout = Layout::new(on_gpu.bounds, 9, 3, 0.0);
        let windows = layout.windows(scene.camera.eye);
        let bias = 0.2;
        let (found, _) = needed(&gpu, &on_gpu, &windows, bias).unwrap();
        let corners: Vec<[Vec3; 3]> = (scene.triangles.iter())
            .map(|triangle| {
                (triangle.vertices)
                    .map(|vertex| Vec3::from(scene.vertices[vertex as usize].position))
            })
            .collect();
        let (mut all, mut kept) = (0, 0);
        for (level, window) in (0..).zip(&windows) {
            for probe in 0..window.lattice.probe_count() {
                let by = |bias| {
                    let lattice = &window.lattice;
                    let mut corners = corners.iter();
                    corners.any(|corners| looks_up(lattice, probe, *corners, bias))
                };
                let is_found = found.contains(&Key::new(level, 3, window.at(probe)));
                assert!(is_found || !by(bias - 1e-4), "level {level}, probe {probe}");
                assert!(!is_found || by(bias + 1e-4), "level {level}, probe {probe}");
                all += 1;
                kept += u32::from(is_found);
            }
        }
        println!("{}: {kept} of {all} probes are needed", scene.name);
        assert!(kept > 50 && kept < all);
        // Every place asks for probes that are there.
        for [a, b, c] in &corners {
            let (place, normal) = ((*a + *b + *c) / 3.0, (*b - *a).cross(*c - *a));
            for side in [-1.0, 1.0] {
                let finest = &windows[0].lattice;
                let moved = place + side * bias * finest.spacing.x * normal.normalize_or_zero();
                let within = (moved - finest.first) / finest.spacing;
                let last = (finest.counts - 1).as_vec3();
                if within.cmplt(Vec3::ZERO).any() || within.cmpgt(last).any() {
                    continue;
                }
                for probe in finest.cage(moved) {
                    assert!(found.contains(&Key::new(0, 3, windows[0].at(probe))));
                }
            }
        }
    }
}

#[test]
fn probes_are_moved_as_on_the_host() {
    let gpu = gpu();
    for scene in scenes() {
        let count = 256;
        let traced = traced(&gpu, &scene, [5, count], [5, 8]);
        let lattice = &traced.volume.lattice;
        let (cell, distance) = (lattice.cell(), 0.35);
        let probe_count = lattice.probe_count();
        let homes: Vec<[f32; 4]> = (lattice.places())
            .map(|place| place.extend(cell).to_array())
            .collect();
        let on_device = gpu
            .create_buffer(&BufferDesc {
                name: "homes".into(),
                size_bytes: 16 * u64::from(probe_count),
                usage: BufferUsage::Storage,
                owner: Owner::Store,
            })
            .unwrap();
        gpu.upload_buffer(&on_device, bytemuck::cast_slice(&homes))
            .unwrap();
        let list = ProbeList::of_all(&gpu, probe_count).unwrap();
        let mut frame = Frame::new();
        frame.set_scene(&traced.on_gpu.set, &traced.on_gpu.materials);
        let places = &traced.volume.places;
        let probes = list.part(0, probe_count);
        let triangles = &traced.paths.rays;
        place(
            &mut frame,
            triangles,
            &traced.rays,
            probes,
            [&on_device, places],
            (distance, None),
        );
        gpu.submit(frame).unwrap();
        let found: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(places).unwrap());
        let reference = RayOracle::new(&scene);
        let set = oracle::ray_set(count);
        let (mut moved, mut off) = (0, Vec::new());
        for (probe, [x, y, z, w]) in (0..).zip(found) {
            assert_eq!(w, 0.0);
            let home = lattice.place(probe);
            let mut at = home;
            for _ in 0..3 {
                let rays: Vec<(Vec3, f32)> = (0..RAYS)
                    .map(|ray| oracle::turn_of(probe) * set[(ray * count / RAYS) as usize])
                    .map(|direction: DVec3| {
                        (direction.as_vec3(), seen(&reference, at, direction) as f32)
                    })
                    .collect();
                at = away(at, home, cell, distance * cell, &rays);
            }
            moved += u32::from(at != home);
            off.push(f64::from(at.distance(Vec3::new(x, y, z)) / cell));
        }
        // Where two surfaces are as near, rounding decides.
        let apart = off.iter().filter(|off| **off > 1e-3).count();
        println!("{}: {moved} moved, {apart} elsewhere", scene.name);
        assert!(moved > 3 && apart <= probe_count as usize / 50);
    }
}

fn renderer<'g>(gpu: &'g Gpu, scene: &Scene, pairs: &[&str]) -> Renderer<'g> {
    let small = ["probes=6", "rays=32", "moment_texels=8", "spacing=0.12"];
    let settings = ENTRY.settings(None, &[&small, pairs].concat()).unwrap();
    let made = Renderer::new(gpu, scene, &ENTRY, &settings, frame(24, 16, 64));
    made.unwrap().0
}

/// The indirect light of the next frame.
fn next(renderer: &mut Renderer<'_>, camera: &Camera) -> Image {
    renderer.render(camera).unwrap();
    renderer.aov(Aov::Indirect).unwrap()
}

fn count(renderer: &mut Renderer<'_>, name: &str) -> u64 {
    let counts = renderer.counts().unwrap();
    counts.iter().find(|(other, _)| *other == name).unwrap().1
}

/// Goes along, and ends in the picture that a renderer has which was made there; in between, every
/// place has light from a level that has it.
#[test]
fn a_walk_ends_in_the_picture_of_that_place() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let walk = |share: f32| {
        let mut camera = scene.camera;
        let way = camera.target - camera.eye;
        camera.eye += share * way;
        camera.target += share * way;
        camera
    };
    for (bounces, budget) in [("bounces=1", 0), ("bounces=1", 40), ("bounces=2", 40)] {
        let budget = format!("probes_per_frame={budget}");
        let mut walker = renderer(&gpu, &scene, &[bounces, &budget]);
        let mut rooms = BTreeSet::new();
        let [mut least, mut probes] = [f64::INFINITY, 0.0];
        for step in 0..12u16 {
            let camera = walk(0.5 + 0.04 * f32::from(step));
            let found = next(&mut walker, &camera);
            let mut anew = renderer(&gpu, &scene, &[bounces]);
            let expected = next(&mut anew, &camera);
            let sum = |image: &Image| -> f64 {
                let all = image.pixels.iter();
                all.map(|pixel| f64::from(pixel.element_sum())).sum()
            };
            least = least.min(sum(&found) / sum(&expected));
            probes = count(&mut walker, "probes") as f64;
            rooms.insert(count(&mut walker, "probe_room"));
            if budget == "probes_per_frame=0" {
                let off = largest_difference(&found, &expected);
                assert!(off < 1e-3, "step {step}: {off}");
            }
        }
        assert!(
            least > 0.7,
            "{bounces}, {budget}: {least} of the light on the way"
        );
        // What is there already keeps its light where room is made for more.
        assert!(rooms.len() > 1, "{rooms:?}");
        // Each has its turn, and with two bounces what others have then.
        let camera = walk(0.5 + 0.04 * 11.0);
        let rounds = 2 * (probes / 40.0).ceil() as u32;
        let found = (0..rounds).map(|_| next(&mut walker, &camera)).last();
        let expected = next(&mut renderer(&gpu, &scene, &[bounces]), &camera);
        let off = largest_difference(&found.unwrap(), &expected);
        println!("{bounces}, {budget}: {least} of the light on the way, {off} off at the end");
        assert!(off < 1e-3, "{bounces}, {budget}: {off}");
    }
}

#[test]
fn feedback_comes_to_rest_at_once_and_after_a_change() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let mut moved = scene.clone();
    moved.lights.iter_mut().for_each(|light| {
        if let lumivox::scene::Light::Point { position, .. } = light {
            position.x += 0.1;
        }
    });
    let feedback = ["bounces=feedback", "levels=2"];
    let mut follower = renderer(
        &gpu,
        &scene,
        &[&feedback[..], &["probes_per_frame=100"]].concat(),
    );
    let first = next(&mut follower, &scene.camera);
    let at_rest = (0..60).map(|_| next(&mut follower, &scene.camera)).last();
    let off = largest_difference(&first, &at_rest.unwrap());
    assert!(off < 0.02, "{off} at first");
    follower.move_lights(&moved).unwrap();
    let probes = count(&mut follower, "probes");
    let rounds = 16 * probes.div_ceil(100);
    let found = (0..rounds)
        .map(|_| next(&mut follower, &scene.camera))
        .last();
    let expected = next(&mut renderer(&gpu, &moved, &feedback), &scene.camera);
    let off = largest_difference(&found.unwrap(), &expected);
    println!("{off} off, {rounds} frames after a light has moved");
    assert!(off < 0.02, "{off}");
}

/// Finer levels are nearer to the truth, where the camera is.
#[test]
fn finer_levels_are_nearer_to_the_truth() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let mut camera = scene.camera;
    camera.eye = camera.eye.lerp(camera.target, 0.8);
    let picture = |pairs: &[&str]| {
        let settings = ENTRY.settings(None, pairs).unwrap();
        let made = Renderer::new(&gpu, &scene, &ENTRY, &settings, frame(48, 27, 256));
        next(&mut made.unwrap().0, &camera)
    };
    let truth = picture(&["probes=32", "levels=1"]);
    let errors = [1, 2, 3].map(|levels| {
        let found = picture(&["probes=8", &format!("levels={levels}")]);
        let off = found.pixels.iter().zip(&truth.pixels);
        let squares: f64 = off
            .map(|(a, b)| f64::from((*a - *b).length_squared()))
            .sum();
        squares.sqrt()
    });
    println!("{errors:?}");
    assert!(errors[2] < 0.8 * errors[0], "{errors:?}");
}
