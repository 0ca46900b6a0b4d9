//! Probes from frame to frame: what is traced and lit anew, and when.

use glam::{DVec3, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::probes::irradiance::ENTRY;
use lumivox::gi::probes::rays::MomentFilter;
use lumivox::graph::{Frame, Gpu};
use lumivox::image::{Aov, Image};
use lumivox::scene::{Light, Scene};

use crate::probes::{Traced, ray_direction, scenes, texels, traced};
use crate::support::compare::{Largest, Worst};
use crate::support::gpu;
use crate::support::technique::{Surfaces, frame, largest_difference, small_lights, small_room};

/// How far a ray is inside of a box (m), negative where it does not come through it before
/// `distance`: slab by slab.
pub(super) fn inside_box(
    origin: DVec3,
    direction: DVec3,
    distance: f64,
    [low, high]: [DVec3; 2],
) -> f64 {
    let (mut first, mut last) = (0.0, distance);
    for axis in 0..3 {
        let [a, b] = [low, high].map(|corner| (corner[axis] - origin[axis]) / direction[axis]);
        let (enters, leaves) = if a < b { (a, b) } else { (b, a) };
        first = f64::max(first, enters);
        last = f64::min(last, leaves);
    }
    last - first
}

/// Checks that those rays are traced again that come through a box, those of probe 5, which has
/// moved, and no others: `again` is what they have in place of `hits` that were marked in between.
/// `inside`: how far a ray of a probe is inside of the box (m); none where rounding decides.
pub(super) fn check_traced_again(
    ([hits, again], count): ([&[[u32; 4]]; 2], u32),
    inside: impl Fn(u32, u32) -> Option<f64>,
) {
    let mut traced = [0, 0];
    for index in 0..hits.len() as u32 {
        let (probe, ray) = (index / count, index % count);
        let Some(inside) = inside(probe, ray).filter(|by| probe == 5 || by.abs() > 1e-3) else {
            continue;
        };
        let is_again = again[index as usize] == hits[index as usize];
        assert_eq!(is_again, probe == 5 || inside > 0.0, "{inside}");
        traced[usize::from(is_again)] += 1;
    }
    println!("{traced:?} kept and traced again");
    assert!(traced[0] > traced[1] && traced[1] > count);
}

/// Traces again after something has moved in a box, with hits and moments that nobody has traced.
fn trace_again(gpu: &Gpu, of: &Traced, moved: (Vec3, Vec3)) {
    let Traced {
        on_gpu,
        paths,
        volume,
        rays,
        ..
    } = of;
    let mut hits: Vec<[u32; 4]> = texels(gpu, &rays.hits);
    hits.iter_mut().for_each(|hit| hit[2] ^= 1);
    gpu.upload_image(&rays.hits, 0, 0, bytemuck::cast_slice(&hits))
        .unwrap();
    let mut frame = Frame::new();
    frame.set_scene(&on_gpu.set, &on_gpu.materials);
    let probes = volume.listed();
    rays.trace(&mut frame, (on_gpu, paths), volume, probes, Some(moved));
    let of = (volume, probes);
    rays.moments(&mut frame, &paths.rays, of, MomentFilter::Box, Some(moved));
    gpu.submit(frame).unwrap();
}

#[test]
fn rays_are_traced_again_that_come_through_what_moved_and_no_others() {
    let gpu = gpu();
    for scene in scenes() {
        let count = 64;
        let traced = traced(&gpu, &scene, [4, count], [5, 8]);
        let volume = &traced.volume;
        let places: Vec<Vec3> = volume.lattice.places().collect();
        // All but one stand where they stood.
        let mut before = places.clone();
        before[5] += 0.1;
        volume.put(&gpu, &places, &before).unwrap();
        let (low, high) = traced.on_gpu.bounds;
        let at = |share: f32| low + share * (high - low);
        let moved = (at(0.3), at(0.45));
        let hits_before: Vec<[u32; 4]> = texels(&gpu, &traced.rays.hits);
        let moments_before = gpu.read_image(&volume.moments, 0, 0).unwrap();
        trace_again(&gpu, &traced, moved);
        let hits: Vec<[u32; 4]> = texels(&gpu, &traced.rays.hits);
        let (mut kept, mut again) = (0, 0);
        for (probe, place) in (0..).zip(&places) {
            for ray in 0..count {
                let index = (probe * count + ray) as usize;
                let [triangle, .., distance] = hits_before[index];
                let distance = f64::from(f32::from_bits(distance));
                let direction = ray_direction(probe, ray, count);
                let corners = [moved.0, moved.1].map(Vec3::as_dvec3);
                let inside = inside_box(place.as_dvec3(), direction, distance, corners);
                // Who comes near to an edge may do either.
                if probe != 5 && inside.abs() < 1e-3 {
                    continue;
                }
                let is_again = hits[index] == hits_before[index];
                assert_eq!(is_again, probe == 5 || inside > 0.0, "{inside} {triangle}");
                kept += u32::from(!is_again);
                again += u32::from(is_again);
            }
        }
        println!("{}: {again} rays traced again, {kept} kept", scene.name);
        assert!(kept > again && again > count);
        // What rays met that nobody traced again does not matter here.
        assert!(moments_before == gpu.read_image(&volume.moments, 0, 0).unwrap());
    }
}

/// A room with a lamp, and the same with the lamp elsewhere.
fn rooms() -> [Scene; 2] {
    let (_, light) = small_lights()[0];
    let scene = small_room(Surfaces::Diffuse, vec![light]);
    let mut moved = scene.clone();
    if let Light::Point { position, .. } = &mut moved.lights[0] {
        *position += Vec3::new(0.3, -0.2, 0.2);
    }
    [scene, moved]
}

fn renderer<'g>(gpu: &'g Gpu, scene: &Scene, pairs: &[&str]) -> Renderer<'g> {
    let pairs = [&["probes=6", "rays=64"], pairs].concat();
    let settings = ENTRY.settings(None, &pairs).unwrap();
    let made = Renderer::new(gpu, scene, &ENTRY, &settings, frame(24, 16, 64));
    made.unwrap().0
}

/// The indirect light of the next frame.
fn next(renderer: &mut Renderer<'_>, scene: &Scene) -> Image {
    renderer.render(&scene.camera).unwrap();
    renderer.aov(Aov::Indirect).unwrap()
}

#[test]
fn probes_that_are_lit_in_turn_are_all_lit_after_a_round() {
    let gpu = gpu();
    let [scene, moved] = rooms();
    for bounces in ["bounces=1", "bounces=feedback"] {
        let mut at_once = renderer(&gpu, &scene, &[bounces]);
        let mut in_turn = renderer(&gpu, &scene, &[bounces, "probes_per_frame=30"]);
        let counts = in_turn.counts().unwrap();
        let probes = counts.iter().find(|(name, _)| *name == "probes").unwrap().1;
        let round = probes.div_ceil(30);
        let rest = if bounces == "bounces=1" { 1u32 } else { 24 };
        // The first frame has all its light, however few are lit in the next.
        let first = next(&mut in_turn, &scene);
        let expected = (0..rest)
            .map(|_| next(&mut at_once, &scene))
            .last()
            .unwrap();
        let off = largest_difference(&first, &expected);
        assert!(off < 0.01, "{bounces}: {off} at first");
        for renderer in [&mut at_once, &mut in_turn] {
            renderer.move_lights(&moved).unwrap();
        }
        let expected = (0..rest)
            .map(|_| next(&mut at_once, &moved))
            .last()
            .unwrap();
        let frames = round * u64::from(rest);
        let offs = (0..frames).map(|_| largest_difference(&next(&mut in_turn, &moved), &expected));
        let offs: Vec<f64> = offs.collect();
        let last = offs[offs.len() - 1];
        println!("{bounces}: {} off, {last} after {frames} frames", offs[0]);
        assert!(offs[0] > 0.05, "{bounces}: a frame lights a part");
        assert!(last < 0.01, "{bounces}: {last}");
    }
}

#[test]
fn what_probes_remember_decays_by_their_hysteresis() {
    let gpu = gpu();
    let [scene, moved] = rooms();
    for irradiance in ["irradiance=oct", "irradiance=sh2"] {
        let [mut before, mut after] =
            [&scene, &moved].map(|scene| renderer(&gpu, scene, &[irradiance]));
        let [before, after] =
            [next(&mut before, &scene), next(&mut after, &moved)].map(|image| image.pixels);
        let mut remembers = renderer(&gpu, &scene, &[irradiance, "hysteresis=0.7"]);
        next(&mut remembers, &scene);
        remembers.move_lights(&moved).unwrap();
        let largest = after.iter().map(|pixel| pixel.largest());
        let largest = largest.worst();
        for frame in 1..5 {
            let found = next(&mut remembers, &moved).pixels;
            let left = 0.7f32.powi(frame);
            let pixels = found.iter().zip(before.iter().zip(&after));
            let off = pixels.map(|(found, (before, after))| {
                let expected = left * *before + (1.0 - left) * *after;
                (*found - expected).largest()
            });
            let off = off.worst() / largest;
            assert!(off < 3e-3, "{irradiance}, frame {frame}: {off}");
        }
    }
}

#[test]
fn rays_that_are_turned_in_each_frame_come_to_the_mean_of_many() {
    let gpu = gpu();
    let [scene, _] = rooms();
    let expected = next(&mut renderer(&gpu, &scene, &["rays=8192"]), &scene);
    let error = |pairs: &[&str], frames: u32| {
        let mut renderer = renderer(&gpu, &scene, pairs);
        let last = (0..frames).map(|_| next(&mut renderer, &scene)).last();
        let last = last.unwrap();
        let off = last.pixels.iter().zip(&expected.pixels);
        let off: f64 = off
            .map(|(a, b)| f64::from((*a - *b).length_squared()))
            .sum();
        let all: f64 = (expected.pixels.iter())
            .map(|b| f64::from(b.length_squared()))
            .sum();
        (off / all).sqrt()
    };
    let once = error(&["rays=32"], 1);
    let each = error(&["rays=32", "trace=each-frame"], 3);
    assert_eq!(once, each, "the same rays without hysteresis");
    let averaged = error(&["rays=32", "trace=each-frame", "hysteresis=0.95"], 60);
    println!("32 rays {once}, averaged {averaged}");
    assert!(averaged < 0.4 * once, "{averaged}, {once}");
}
