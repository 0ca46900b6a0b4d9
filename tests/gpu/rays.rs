//! Rays against triangles on the device, against those of the reference.

use glam::{DVec3, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::ray_traced;
use lumivox::graph::{Frame, Gpu, GpuOptions};
use lumivox::image::luminance;
use lumivox::render::GpuScene;
use lumivox::render::bvh::oracle::{OracleHit, OracleRay, RayOracle};
use lumivox::render::bvh::{START_SHARE, SceneRays};
use lumivox::scene::Scene;
use rayon::prelude::*;

use crate::support::compare::Largest;
use crate::support::gather::{METRES, View};
use crate::support::passes::RAYS;
use crate::support::scenes::{add_model, bundled, lump, random_pose, scene_of, soup, still};
use crate::support::surfaces::with_lobe_textures;
use crate::support::technique::frame;
use crate::support::{Missing, Random, gpu, own_gpu, skipped, words};

/// Barycentric coordinates of a ray along a triangle are rounded by so much.
const EDGE: f32 = 1e-4;

const NOTHING: u32 = u32::MAX;

/// What rays meet on the device, and their longest distances.
fn trace(
    gpu: &Gpu,
    (scene, rays): (&GpuScene, &SceneRays),
    asked: &[(OracleRay, f32)],
    any: bool,
) -> Vec<Option<OracleHit>> {
    let rows: Vec<u32> = asked
        .iter()
        .flat_map(|((origin, direction, leaves), reach)| {
            let ([x, y, z], [a, b, c]) = (origin.to_array(), direction.to_array());
            let mut row = [x, y, z, *reach, a, b, c, 0.0].map(f32::to_bits);
            row[7] = leaves.unwrap_or(NOTHING);
            row
        })
        .collect();
    let given = words(gpu, "rays", &rows);
    let hits = words(gpu, "hits", &vec![0; 4 * asked.len()]);
    let mut frame = Frame::new();
    frame.set_scene(&scene.set, &scene.materials);
    let count = asked.len() as u32;
    rays.bind(frame.pass(&RAYS))
        .bind("rays", &given)
        .bind("hits", &hits)
        .push(&[count, u32::from(any)])
        .dispatch([count.div_ceil(64), 1, 1]);
    gpu.submit(frame).unwrap();
    let rows: Vec<[u32; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&hits).unwrap());
    let hit = |[triangle, distance, u, v]: [u32; 4]| OracleHit {
        triangle,
        distance: f32::from_bits(distance),
        at: [u, v].map(f32::from_bits),
    };
    let is_hit = |row: &[u32; 4]| row[0] != NOTHING;
    rows.into_iter()
        .map(|row| is_hit(&row).then(|| hit(row)))
        .collect()
}

fn random_direction(random: &mut Random) -> Vec3 {
    loop {
        let at = Vec3::from([(); 3].map(|()| 2.0 * random.unit() - 1.0));
        if (0.01..=1.0).contains(&at.length_squared()) {
            return at.normalize();
        }
    }
}

/// Kinds of rays: from anywhere, along axes, at corners and edges, in the plane of triangles, and
/// off surfaces.
const ALL_KINDS: &[u32] = &[0, 0, 2, 3, 4, 5, 6, 6];

/// Those that are not aimed at where rounding decides.
const FREE_KINDS: &[u32] = &[0, 6];

/// Rays of these kinds.
fn rays_in(scene: &Scene, kinds: &[u32], count: usize, random: &mut Random) -> Vec<OracleRay> {
    let (low, high) = scene.bounds().unwrap_or((Vec3::ZERO, Vec3::ONE));
    let anywhere = |random: &mut Random| {
        let share = Vec3::from([(); 3].map(|()| 1.2 * random.unit() - 0.1));
        low + share * (high - low)
    };
    let corners = |random: &mut Random| {
        let index = random.below(scene.triangles.len() as u32);
        let vertices = scene.triangles[index as usize].vertices;
        let corners = vertices.map(|at| Vec3::from(scene.vertices[at as usize].position));
        (index, corners)
    };
    let mut rays = Vec::with_capacity(count);
    while rays.len() < count {
        let kind = if scene.triangles.is_empty() {
            0
        } else {
            kinds[random.below(kinds.len() as u32) as usize]
        };
        let origin = anywhere(random);
        let ray = match kind {
            0 => (origin, random_direction(random), None),
            2 => {
                let mut axis = [0.0; 3];
                axis[random.below(3) as usize] = if random.below(2) == 0 { 1.0 } else { -1.0 };
                (origin, Vec3::from(axis), None)
            }
            3 => {
                let (_, corners) = corners(random);
                (origin, (corners[0] - origin).normalize_or(Vec3::X), None)
            }
            4 => {
                let (_, [a, b, _]) = corners(random);
                let to = a + random.unit() * (b - a);
                (origin, (to - origin).normalize_or(Vec3::X), None)
            }
            5 => {
                let (_, [a, b, c]) = corners(random);
                let along = (b + random.unit() * (c - b) - a).normalize_or(Vec3::X);
                (a - along, along, None)
            }
            _ => {
                let (index, [a, b, c]) = corners(random);
                let (u, v) = (random.unit(), random.unit());
                let (u, v) = if u + v > 1.0 {
                    (1.0 - u, 1.0 - v)
                } else {
                    (u, v)
                };
                let at = a * (1.0 - u - v) + b * u + c * v;
                (at, random_direction(random), Some(index))
            }
        };
        rays.push(ray);
    }
    rays
}

/// Of rays whose hit differs from that of the reference's hierarchy.
#[derive(Debug, Default, PartialEq)]
struct Differing {
    /// As near, on another triangle.
    ties: usize,
    /// The device has the nearest of all triangles; the hierarchy passes by it.
    reference_misses: usize,
    /// A ray through the edge of a triangle, within rounding, hits it or passes by.
    edges: usize,
    /// What the device says is so, but it passes by something nearer: a triangle that its own test,
    /// which rounds otherwise, does not find near the ray.
    device_passes: usize,
    /// Something else, in words: the device is wrong.
    wrong: Vec<String>,
}

fn compare(
    (scene, oracle): (&Scene, &RayOracle<'_>),
    rays: &[OracleRay],
    found: &[Option<OracleHit>],
) -> Differing {
    let kinds: Vec<Kind> = rays
        .par_iter()
        .zip(found)
        .map(|(ray, found)| kind((scene, oracle), ray, found))
        .collect();
    let mut differing = Differing::default();
    for kind in kinds {
        match kind {
            Kind::Same => {}
            Kind::Tie => differing.ties += 1,
            Kind::ReferenceMisses => differing.reference_misses += 1,
            Kind::Edge => differing.edges += 1,
            Kind::DevicePasses => differing.device_passes += 1,
            Kind::Wrong(what) => differing.wrong.push(what),
        }
    }
    differing
}

/// Whether a hit is on the edge of its triangle, or the ray runs along the triangle: its distance
/// may be anything then.
fn is_edge(scene: &Scene, (_, direction, _): &OracleRay, hit: &OracleHit) -> bool {
    let vertices = scene.triangles[hit.triangle as usize].vertices;
    let [a, b, c] = vertices.map(|at| Vec3::from(scene.vertices[at as usize].position));
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let [u, v] = hit.at;
    u.min(v).min(1.0 - u - v) < EDGE || normal.dot(*direction).abs() < EDGE
}

enum Kind {
    Same,
    Tie,
    ReferenceMisses,
    Edge,
    DevicePasses,
    Wrong(String),
}

fn kind(
    (scene, oracle): (&Scene, &RayOracle<'_>),
    ray: &OracleRay,
    found: &Option<OracleHit>,
) -> Kind {
    let wanted = oracle.closest(*ray);
    if *found == wanted {
        return Kind::Same;
    }
    let distance = |hit: &Option<OracleHit>| hit.map_or(f32::INFINITY, |hit| hit.distance);
    // What the device says of its triangle is so.
    let is_true = found.is_none_or(|hit| oracle.meets(hit.triangle, *ray) == Some(hit));
    if is_true && distance(found) == distance(&wanted) {
        return Kind::Tie;
    }
    let of_all = oracle.closest_of_all(*ray);
    if is_true && distance(found) == distance(&of_all) {
        return Kind::ReferenceMisses;
    }
    if is_true && of_all.is_some_and(|hit| is_edge(scene, ray, &hit)) {
        return Kind::Edge;
    }
    if is_true && distance(found) > distance(&of_all) {
        return Kind::DevicePasses;
    }
    Kind::Wrong(format!(
        "{ray:?}: {found:?}; the reference {wanted:?}; of all {of_all:?}"
    ))
}

/// Rays through a scene: the nearest hit, some hit, and hits up to a distance.
fn check(gpu: &Gpu, scene: &Scene, count: usize, seed: u64) {
    let gpu_scene = GpuScene::new(gpu, scene).unwrap();
    let rays = SceneRays::new(gpu, &gpu_scene).unwrap();
    check_with(gpu, scene, (&gpu_scene, &rays), count, seed);
}

fn check_with(gpu: &Gpu, scene: &Scene, device: (&GpuScene, &SceneRays), count: usize, seed: u64) {
    let asked = rays_in(scene, ALL_KINDS, count, &mut Random::new(seed));
    let endless = |ray: &OracleRay| (*ray, f32::INFINITY);
    let endless: Vec<(OracleRay, f32)> = asked.iter().map(endless).collect();
    let found = trace(gpu, device, &endless, false);
    let oracle = RayOracle::new(scene);
    let differing = compare((scene, &oracle), &asked, &found);
    let name = &scene.name;
    assert_eq!(differing.wrong, [""; 0], "{name}");
    // Nodes pass by nothing.
    let (passed, has_queries) = (differing.device_passes, gpu.traces_rays());
    let allowed = if has_queries { count / 200 } else { 0 };
    assert!(passed <= allowed, "{name}: {passed} of {count}");
    // Some hit is one of those that there are; up to the nearest hit there is none.
    let some = trace(gpu, device, &endless, true);
    for ((ray, nearest), some) in asked.iter().zip(&found).zip(&some) {
        assert_eq!(nearest.is_some(), some.is_some(), "{name}: {ray:?}");
        assert!(some.is_none_or(|hit| oracle.meets(hit.triangle, *ray) == Some(hit)));
    }
    let up_to = |share: f32| -> Vec<(OracleRay, f32)> {
        let reach = |hit: &Option<OracleHit>| hit.map_or(1.0, |hit| share * hit.distance);
        asked
            .iter()
            .zip(&found)
            .map(|(ray, hit)| (*ray, reach(hit)))
            .collect()
    };
    let before = trace(gpu, device, &up_to(0.9999), true);
    let beyond = trace(gpu, device, &up_to(1.0001), true);
    let mut missed = 0;
    for (index, nearest) in found.iter().enumerate() {
        let ray = &asked[index];
        assert!(before[index].is_none(), "{name}: {ray:?}: {nearest:?}");
        let is_sure = nearest.is_some_and(|hit| !is_edge(scene, ray, &hit));
        missed += usize::from(is_sure && beyond[index].is_none());
    }
    // Of needles, what runs along them is not known as well.
    assert!(1000 * missed <= count, "{name}: {missed} of {count}");
}

/// Runs a test with rays by shaders, and with rays by the device where it can.
fn each_way(test: impl Fn(&Gpu)) {
    let with = |device_rays| {
        own_gpu(&GpuOptions {
            device_rays: Some(device_rays),
            ..GpuOptions::default()
        })
    };
    let by_shaders = with(false);
    test(&by_shaders);
    if by_shaders.features().ray_query {
        test(&with(true));
    } else {
        skipped(&Missing::Other("VK_KHR_ray_query"));
    }
}

/// Of rays that are not aimed at edges or along triangles, the device finds all but every hit.
fn check_free(gpu: &Gpu, scene: &Scene, count: usize, seed: u64) {
    let gpu_scene = GpuScene::new(gpu, scene).unwrap();
    let rays = SceneRays::new(gpu, &gpu_scene).unwrap();
    let free = rays_in(scene, FREE_KINDS, count, &mut Random::new(seed));
    let endless: Vec<(OracleRay, f32)> = free.iter().map(|ray| (*ray, f32::INFINITY)).collect();
    let found = trace(gpu, (&gpu_scene, &rays), &endless, false);
    let differing = compare((scene, &RayOracle::new(scene)), &free, &found);
    let missed = differing.edges + differing.device_passes;
    assert_eq!(differing.wrong, [""; 0], "{}", scene.name);
    assert!(
        5000 * missed <= count,
        "{}: {missed} of {count}",
        scene.name
    );
}

#[test]
fn rays_meet_what_the_references_meet() {
    each_way(references_meet_the_same);
}

fn references_meet_the_same(gpu: &Gpu) {
    for (seed, name) in ["cornell", "atrium", "street", "emissive-gallery", "glossy"]
        .into_iter()
        .enumerate()
    {
        check(gpu, &bundled(name), 100_000, seed as u64);
        check_free(gpu, &bundled(name), 100_000, 100 + seed as u64);
    }
}

#[test]
fn degenerate_triangles_and_empty_scenes() {
    each_way(degenerate);
}

fn degenerate(gpu: &Gpu) {
    let mut random = Random::new(7);
    check(gpu, &Scene::default(), 100, 1);
    for count in [1, 2, 5] {
        let triangles = lump(count, 8);
        check(
            gpu,
            &scene_of(&triangles, 0.0, &mut random),
            2_000,
            u64::from(count),
        );
    }
    for seed in 0..4 {
        let mut triangles = soup(&mut random, 32);
        let first = triangles[0];
        // A point, a line, and the same triangle twice.
        triangles.extend([[first[0]; 3], [first[0], first[1], first[1]], first, first]);
        check(gpu, &scene_of(&triangles, 0.0, &mut random), 5_000, seed);
    }
}

#[test]
fn boxes_follow_models() {
    each_way(models_move);
}

fn models_move(gpu: &Gpu) {
    let mut random = Random::new(11);
    let mut scene = bundled("two-rooms");
    let poses: Vec<_> = (0..3).map(|_| random_pose(&mut random, 2.0)).collect();
    let cube = |random: &mut Random| scene_of(&soup(random, 4), 0.0, random);
    add_model(&mut scene, cube(&mut random), &poses);
    add_model(
        &mut scene,
        cube(&mut random),
        &[still(Vec3::ZERO), still(Vec3::new(3.0, 1.0, 2.0))],
    );
    let mut gpu_scene = GpuScene::new(gpu, &scene).unwrap();
    let mut rays = SceneRays::new(gpu, &gpu_scene).unwrap();
    for (seed, time_s) in [0.0, 0.4, 1.3, 9.0].into_iter().enumerate() {
        scene.set_time(time_s);
        gpu_scene.set_pose(gpu, &scene).unwrap();
        rays.follow(gpu, &gpu_scene).unwrap();
        check_with(gpu, &scene, (&gpu_scene, &rays), 5_000, seed as u64);
    }
}

/// A comparison that could not fail would prove nothing.
#[test]
fn a_wrong_hit_is_found() {
    let scene = &bundled("cornell");
    let oracle = RayOracle::new(scene);
    let rays = rays_in(scene, ALL_KINDS, 500, &mut Random::new(3));
    let right: Vec<_> = rays.iter().map(|ray| oracle.closest_of_all(*ray)).collect();
    assert_eq!(compare((scene, &oracle), &rays, &right).wrong.len(), 0);
    let hit = right
        .iter()
        .zip(&rays)
        .position(|(hit, ray)| hit.is_some_and(|hit| !is_edge(scene, ray, &hit)));
    let hit = hit.unwrap();
    let changed = |change: fn(&mut OracleHit)| {
        let mut wrong = right.clone();
        wrong[hit].iter_mut().for_each(change);
        compare((scene, &oracle), &rays, &wrong).wrong.len()
    };
    assert_eq!(changed(|hit| hit.triangle ^= 1), 1);
    assert_eq!(changed(|hit| hit.distance *= 1.001), 1);
    let mut missed = right.clone();
    missed[hit] = None;
    assert_eq!(compare((scene, &oracle), &rays, &missed).device_passes, 1);
}

/// Diffuse light (luminance) of two frames by `ray-traced`, each with other directions.
fn two_frames(gpu: &Gpu, name: &str, hit_roughness: &str) -> [Vec<f32>; 2] {
    let scene = bundled(name);
    let pairs = [
        "rays=4",
        "interleave=1",
        "history=1",
        "specular=off",
        &format!("hit_roughness={hit_roughness}"),
    ];
    let settings = ray_traced::ENTRY.settings(None, &pairs).unwrap();
    let size = frame(96, 54, 64);
    let (mut renderer, _) =
        Renderer::new(gpu, &scene, &ray_traced::ENTRY, &settings, size).unwrap();
    [(); 2].map(|()| {
        renderer.render(&scene.camera).unwrap();
        let light = renderer.indirect_light().unwrap();
        light
            .irradiance
            .pixels
            .iter()
            .map(|pixel| luminance(*pixel))
            .collect()
    })
}

/// Rougher hits bring the same light with less noise, and are what they are in scenes without
/// lobes.
#[test]
fn rougher_hits_have_less_noise() {
    let gpu = gpu();
    let [polished, rough] = ["0", "0.3"].map(|roughness| two_frames(&gpu, "glossy", roughness));
    let noise = |[one, other]: &[Vec<f32>; 2]| {
        let squares = one.iter().zip(other).map(|(a, b)| f64::from(a - b).powi(2));
        squares.sum::<f64>()
    };
    let [from, to] = [&polished, &rough].map(noise);
    assert!(
        from.is_finite() && to < 0.2 * from,
        "noise² of {from} became {to}"
    );
    let [before, after] = [&polished, &rough].map(|frames| {
        frames
            .iter()
            .flatten()
            .map(|light| f64::from(*light))
            .sum::<f64>()
    });
    assert!(
        (after / before - 1.0).abs() < 0.05,
        "{before} became {after}"
    );
    let diffuse = ["0", "0.3"].map(|roughness| two_frames(&gpu, "cornell", roughness));
    assert_eq!(diffuse[0], diffuse[1], "a scene without lobes");
}

/// Texels that are all alike make the light that their factors make: at the pixel, and where its
/// rays hit.
#[test]
fn lobes_of_texels_are_those_of_factors() {
    let (gpu, plain) = (gpu(), bundled("glossy"));
    let pairs = ["rays=4", "interleave=1", "bounces=2"];
    let settings = ray_traced::ENTRY.settings(None, &pairs).unwrap();
    let lights = [&plain, &with_lobe_textures(&plain)].map(|scene| {
        let size = frame(96, 54, 64);
        let (mut renderer, _) =
            Renderer::new(&gpu, scene, &ray_traced::ENTRY, &settings, size).unwrap();
        renderer.render(&scene.camera).unwrap();
        let light = renderer.indirect_light().unwrap();
        [light.irradiance, light.specular]
    });
    let [expected, found] = lights;
    for (expected, found) in expected.iter().zip(&found) {
        let far = |(a, b): &(&Vec3, &Vec3)| a.distance(**b) > 2e-3 * (1.0 + a.length());
        let far = expected
            .pixels
            .iter()
            .zip(&found.pixels)
            .filter(far)
            .count();
        // A ray that is rounded to another side of an edge sees something else.
        assert!(far <= expected.pixels.len() / 200, "{far} pixels differ");
    }
}

/// The places of pixels, from which rays start, are on the planes of what they see, whatever a
/// rasterizer does to corners. Pictures are small, so that corners move far.
#[test]
fn places_of_pixels_lie_on_their_planes() {
    let gpu = gpu();
    for name in ["cornell", "atrium"] {
        let scene = bundled(name);
        let on_gpu = GpuScene::new(&gpu, &scene).unwrap();
        let view = View::new(&gpu, &on_gpu, &scene.camera, [24, 18], &METRES);
        let (oracle, eye) = (RayOracle::new(&scene), scene.camera.eye);
        let is_on_plane = |place: DVec3| {
            let direction = (place.as_vec3() - eye).normalize();
            let Some(hit) = oracle.closest((eye, direction, None)) else {
                return false;
            };
            let corners = scene.triangles[hit.triangle as usize]
                .vertices
                .map(|vertex| Vec3::from(scene.vertices[vertex as usize].position).as_dvec3());
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a).normalize();
            let largest = place.abs().max((eye.as_dvec3() - place).abs()).largest();
            normal.dot(place - a).abs() < 0.3 * f64::from(START_SHARE) * largest
        };
        let places = view.receivers.iter().map(|(_, receiver)| receiver.position);
        let on_plane = places.filter(|place| is_on_plane(*place)).count();
        // At an edge a pixel may have either surface; the atrium has many.
        let (all, name) = (view.receivers.len(), &scene.name);
        assert!(on_plane * 8 > all * 7, "{name}: {on_plane} of {all}");
    }
}
