//! Probes on the device against their twins.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, DVec4, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::probes::Lattice;
use lumivox::gi::probes::oracle::{self, Map, Place, direction_of};
use lumivox::gi::probes::rays::{MomentFilter, ProbeRays};
use lumivox::gi::probes::volume::{self, Kept, Volume};
use lumivox::gi::shared::paths::PathScene;
use lumivox::graph::{Frame, Gpu, Image};
use lumivox::render::GpuScene;
use lumivox::render::bvh::oracle::RayOracle;
use lumivox::scene::Scene;

use crate::support::compare::{Largest, Worst, larger};
use crate::support::scenes::{bundled, scene_of, soup};
use crate::support::voxels::half;
use crate::support::{Random, gpu};

pub(crate) const RAYS_A_ROW: u32 = 4096;

pub(crate) fn texels<const N: usize>(gpu: &Gpu, image: &Arc<Image>) -> Vec<[u32; N]> {
    let bytes = gpu.read_image(image, 0, 0).unwrap();
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
    words.as_chunks().0.to_vec()
}

/// Halfs of an image of maps, `N` a texel: of one probe, with its border.
fn halfs<const N: usize>(
    gpu: &Gpu,
    image: &Arc<Image>,
    (probe, columns, edge): (u32, u32, u32),
) -> Vec<[f64; N]> {
    let bytes = gpu.read_image(image, 0, 0).unwrap();
    let all: Vec<u16> = bytemuck::pod_collect_to_vec(&bytes);
    let wide = edge + 2;
    let first = [probe % columns * wide, probe / columns * wide];
    let places = (0..wide * wide).map(|at| [first[0] + at % wide, first[1] + at / wide]);
    let texel = |[x, y]: [u32; 2]| {
        let at = (x + y * columns * wide) as usize * N;
        std::array::from_fn(|part| half(all[at + part]))
    };
    places.map(texel).collect()
}

/// The same of a map of the oracle.
pub(crate) fn with_border(map: &Map) -> Vec<DVec4> {
    let wide = map.edge as i32 + 2;
    let places = (0..wide * wide).map(|at| glam::IVec2::new(at % wide - 1, at / wide - 1));
    places.map(|at| map.texel(at)).collect()
}

/// Probes of a lattice, with room for two bounces and gradients.
fn volume(gpu: &Gpu, lattice: Lattice, texels: [u32; 2]) -> Volume {
    volume_with(gpu, lattice, texels, true)
}

/// The same with gradients or without.
fn volume_with(
    gpu: &Gpu,
    lattice: Lattice,
    [light, moments]: [u32; 2],
    has_gradients: bool,
) -> Volume {
    let kept = Kept {
        irradiance: volume::Irradiance::Octahedral(light),
        moment_texels: Some(moments),
        has_gradients,
        bounces: 2,
    };
    let volume = Volume::new(gpu, lattice, &kept).unwrap();
    let places: Vec<Vec3> = lattice.places().collect();
    volume.put(gpu, &places, &[]).unwrap();
    volume
}

pub(crate) fn scenes() -> Vec<Scene> {
    let mut random = Random::new(23);
    let mut soup = scene_of(&soup(&mut random, 8), 0.0, &mut random);
    soup.name = "soup".into();
    vec![bundled("cornell"), soup]
}

/// A scene on the device, its triangles, and probes in it that have been traced.
pub(crate) struct Traced {
    pub(crate) on_gpu: GpuScene,
    pub(crate) paths: PathScene,
    pub(crate) volume: Volume,
    pub(crate) rays: ProbeRays,
    /// What rays have met, before it is packed.
    pub(crate) hits: Vec<[u32; 4]>,
}

pub(crate) fn traced(
    gpu: &Gpu,
    scene: &Scene,
    [probes, rays]: [u32; 2],
    edges: [u32; 2],
) -> Traced {
    let on_gpu = GpuScene::new(gpu, scene).unwrap();
    let (paths, _) = PathScene::build(gpu, &on_gpu).unwrap();
    let lattice = Lattice::within(on_gpu.bounds, probes, 0.3);
    let volume = volume(gpu, lattice, edges);
    let rays = ProbeRays::new(gpu, lattice.probe_count(), rays).unwrap();
    let mut traced = Traced {
        on_gpu,
        paths,
        volume,
        rays,
        hits: Vec::new(),
    };
    traced.trace(gpu);
    let Traced { on_gpu, paths, .. } = &traced;
    let mut frame = Frame::new();
    frame.set_scene(&on_gpu.set, &on_gpu.materials);
    let of = (&traced.volume, traced.volume.listed());
    (traced.rays).moments(&mut frame, &paths.rays, of, MomentFilter::Box, None);
    gpu.submit(frame).unwrap();
    traced
}

impl Traced {
    /// Traces from where the probes are now.
    pub(crate) fn trace(&mut self, gpu: &Gpu) {
        let Traced {
            on_gpu,
            paths,
            volume,
            rays,
            ..
        } = &self;
        let probes = volume.listed();
        let mut frame = Frame::new();
        frame.set_scene(&on_gpu.set, &on_gpu.materials);
        rays.trace_from(&mut frame, &paths.rays, (&volume.places, probes), None);
        gpu.submit(frame).unwrap();
        // Distances of what is to be packed are negative.
        let mut hits: Vec<[u32; 4]> = texels(gpu, &rays.hits);
        hits.iter_mut().for_each(|hit| hit[3] &= !(1 << 31));
        let mut frame = Frame::new();
        frame.set_scene(&on_gpu.set, &on_gpu.materials);
        rays.trace(&mut frame, (on_gpu, paths), volume, probes, None);
        gpu.submit(frame).unwrap();
        self.hits = hits;
    }
}

pub(crate) fn ray_direction(probe: u32, ray: u32, count: u32) -> DVec3 {
    oracle::turn_of(probe) * oracle::ray_set(count)[ray as usize]
}

/// What a ray sees, as the reference does (m).
pub(crate) fn seen(oracle: &RayOracle<'_>, from: Vec3, direction: DVec3) -> f64 {
    let hit = oracle.closest((from, direction.as_vec3(), None));
    hit.map_or(f64::INFINITY, |hit| f64::from(hit.distance))
}

#[test]
fn rays_and_moments_are_what_the_reference_sees() {
    let gpu = gpu();
    for scene in scenes() {
        let (count, edges) = (100, [5, 9]);
        let traced = traced(&gpu, &scene, [4, count], edges);
        let (volume, oracle) = (&traced.volume, RayOracle::new(&scene));
        let hits = &traced.hits;
        let (lattice, cell) = (&volume.lattice, f64::from(volume.lattice.cell()));
        let reach = 1.5 * f64::from(lattice.diagonal()) / cell;
        // Where a ray passes an edge, its rounding decides.
        let (mut rays, mut off, mut seen_texels, mut off_texels) = (0, 0, 0, 0);
        for probe in 0..lattice.probe_count() {
            let from = lattice.place(probe);
            for ray in 0..count {
                let index = probe * count + ray;
                let [triangle, .., distance] = hits[index as usize];
                let found = if triangle == u32::MAX {
                    f64::INFINITY
                } else {
                    f64::from(f32::from_bits(distance))
                };
                let expected = seen(&oracle, from, ray_direction(probe, ray, count));
                let is_same = found == expected || (found - expected).abs() <= 1e-4 * expected;
                rays += 1;
                off += u32::from(!is_same);
            }
            let expected = oracle::moments(edges[1], reach, |direction| {
                seen(&oracle, from, direction) / cell
            });
            let found: Vec<[f64; 2]> =
                halfs(&gpu, &volume.moments, (probe, volume.columns, edges[1]));
            for (found, expected) in found.iter().zip(with_border(&expected)) {
                let is_near =
                    |place: usize| (found[place] - expected[place]).abs() <= 2e-3 * expected[place];
                seen_texels += 1;
                off_texels += u32::from(!(is_near(0) && is_near(1)));
            }
        }
        let name = &scene.name;
        assert!(off * 500 <= rays, "{name}: {off} of {rays} rays");
        assert!(
            off_texels * 100 <= seen_texels,
            "{name}: {off_texels} of {seen_texels} texels"
        );
    }
}

/// What a ray of a probe met: its triangle, and how far it went (m), infinitely if it met nothing.
fn met([triangle, .., distance]: [u32; 4]) -> Option<(u32, f64)> {
    (triangle != u32::MAX).then(|| (triangle, f64::from(f32::from_bits(distance))))
}

#[test]
fn power_moments_are_the_oracles() {
    let gpu = gpu();
    for scene in scenes() {
        let (count, edge) = (100, 9);
        let traced = traced(&gpu, &scene, [4, count], [5, edge]);
        let (volume, rays) = (&traced.volume, &traced.rays);
        let mut frame = Frame::new();
        frame.set_scene(&traced.on_gpu.set, &traced.on_gpu.materials);
        let of = (volume, volume.listed());
        rays.moments(
            &mut frame,
            &traced.paths.rays,
            of,
            MomentFilter::Power,
            None,
        );
        gpu.submit(frame).unwrap();
        let hits = &traced.hits;
        let read = rays.read_distances(&gpu, volume.lattice.probe_count());
        let cell = f64::from(volume.lattice.cell());
        let reach = 1.5 * f64::from(volume.lattice.diagonal()) / cell;
        for (probe, read) in (0..).zip(read.unwrap()) {
            let of = |ray: u32| hits[(probe * count + ray) as usize];
            let goes = (0..count).map(|ray| {
                let distance = met(of(ray)).map_or(f64::INFINITY, |(_, far)| far / cell);
                (ray_direction(probe, ray, count), distance)
            });
            let goes: Vec<(DVec3, f64)> = goes.collect();
            for ((direction, far), expected) in read.iter().zip(&goes) {
                assert!((direction.as_dvec3() - expected.0).length() < 1e-6);
                let far = f64::from(*far) / cell;
                let is_same = far == expected.1 || (far - expected.1).abs() < 1e-5;
                assert!(is_same, "{far}, not {}", expected.1);
            }
            let expected = with_border(&oracle::power_moments(edge, reach, &goes));
            let found: Vec<[f64; 2]> = halfs(&gpu, &volume.moments, (probe, volume.columns, edge));
            for (found, expected) in found.iter().zip(expected) {
                let off = [0, 1].map(|part| (found[part] - expected[part]).abs() / expected[part]);
                assert!(larger(off[0], off[1]) < 2e-3, "{}: {off:?}", scene.name);
            }
        }
    }
}

#[test]
fn gradients_are_the_oracles() {
    let gpu = gpu();
    let mut random = Random::new(11);
    for scene in scenes() {
        let (count, edge) = (96, 6);
        let traced = traced(&gpu, &scene, [3, count], [edge, 8]);
        let (volume, rays) = (&traced.volume, &traced.rays);
        let probe_count = volume.lattice.probe_count();
        let room = RAYS_A_ROW * (probe_count * count).div_ceil(RAYS_A_ROW);
        let lights: Vec<[f32; 4]> = (0..room).map(|_| random_light(&mut random, 3.0)).collect();
        gpu.upload_image(&rays.light, 0, 0, bytemuck::cast_slice(&lights))
            .unwrap();
        let [first, second] = [volume.lit(1), volume.lit(2)];
        let mut frame = Frame::new();
        frame.set_scene(&traced.on_gpu.set, &traced.on_gpu.materials);
        let probes = volume.listed();
        rays.blend(&mut frame, volume, probes, [first, first], (false, 0.0));
        rays.blend(&mut frame, volume, probes, [first, second], (true, 0.0));
        gpu.submit(frame).unwrap();
        let hits = &traced.hits;
        let cell = f64::from(volume.lattice.cell());
        for probe in 0..probe_count {
            let source = |ray: u32| {
                let index = (probe * count + ray) as usize;
                let [r, g, b, _] = lights[index].map(f64::from);
                let direction = ray_direction(probe, ray, count);
                let [_, u, v, _] = hits[index];
                let surface = met(hits[index]).map(|(triangle, far)| {
                    let place = place_on(&scene, (triangle, [u, v]), direction);
                    (far / cell, place.geometric_normal)
                });
                (direction, 0.2126 * r + 0.7152 * g + 0.0722 * b, surface)
            };
            let sources: Vec<oracle::Source> = (0..count).map(source).collect();
            let expected = with_border(&oracle::gradients(&sources, edge));
            let sizes = expected.iter().map(|e| e.truncate().abs().largest());
            let largest = sizes.worst();
            for (maps, times) in [(first, 1.0), (second, 2.0)] {
                let scales: Vec<f32> =
                    bytemuck::pod_collect_to_vec(&gpu.read_buffer(&maps.scales).unwrap());
                let scale = f64::from(scales[probe as usize]);
                let place = (probe, volume.columns, edge);
                let found: Vec<[f64; 4]> = halfs(&gpu, &maps.gradients, place);
                let off = found.iter().zip(&expected).map(|(found, expected)| {
                    let found = DVec3::new(found[0], found[1], found[2]) * scale;
                    (found - times * expected.truncate()).abs().largest() / largest
                });
                let off = off.worst();
                assert!(off < 4e-3, "{}, probe {probe}: off by {off}", scene.name);
            }
        }
    }
}

/// Irradiance above a lit disc changes as its integral does (no device).
#[test]
fn gradients_are_differences() {
    let (radius, height) = (1.0, 1.3);
    let normal = DVec3::new(0.3, -0.2, -1.0).normalize();
    // E = ∫ L (n·v)(−n_j·v)/|v|⁴ dA over the disc in the plane z = 0, L = 1.
    let steps = 400;
    let irradiance = |place: DVec3| {
        let mut sum = 0.0;
        for i in 0..steps {
            for j in 0..steps {
                let r = radius * (f64::from(i) + 0.5) / f64::from(steps);
                let angle = 2.0 * PI * (f64::from(j) + 0.5) / f64::from(steps);
                let v = DVec3::new(r * angle.cos(), r * angle.sin(), 0.0) - place;
                let far = v.length_squared();
                sum += normal.dot(v).max(0.0) * -v.z / (far * far) * r;
            }
        }
        sum * radius / f64::from(steps) * 2.0 * PI / f64::from(steps)
    };
    let place = DVec3::new(0.4, 0.1, height);
    let count = 200_000;
    let source = |ray: u32| {
        let direction = oracle::fibonacci(ray, count);
        let far = -place.z / direction.z;
        let at = place + far * direction;
        let is_hit = far > 0.0 && at.truncate().length() < radius;
        (
            direction,
            f64::from(u8::from(is_hit)),
            (far > 0.0).then_some((far, DVec3::Z)),
        )
    };
    let sources: Vec<oracle::Source> = (0..count).map(source).collect();
    // One texel of a map whose middle is the normal would do; the finest map has one near it.
    let edge = 64;
    let map = oracle::gradients(&sources, edge);
    let found = map.at(normal).truncate();
    for (axis, step) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().zip([1e-3; 3]) {
        let change = irradiance(place + step * axis) - irradiance(place - step * axis);
        let expected = change / (2.0 * step);
        let off = (found.dot(axis) - expected).abs();
        assert!(off < 0.02, "{axis}: {} for {expected}", found.dot(axis));
    }
}

pub(crate) fn random_light(random: &mut Random, scale: f32) -> [f32; 4] {
    let escapes = random.below(4) == 0;
    let [r, g, b] = [(); 3].map(|()| random.unit() * scale);
    [r, g, b, f32::from(u8::from(escapes))]
}

#[test]
fn blended_maps_are_the_oracles() {
    let gpu = gpu();
    let mut random = Random::new(7);
    let scene = bundled("cornell");
    let on_gpu = GpuScene::new(&gpu, &scene).unwrap();
    // Without gradients half of the texels are those that look the opposite way.
    for (count, edge, scale, has_gradients) in [
        (32, 4, 1e-12, true),
        (33, 4, 1e-12, false),
        (100, 8, 1.0, true),
        (100, 8, 1.0, false),
        (64, 16, 3e7, false),
        (777, 11, 2e3, false),
        (8192, 16, 1.0, true),
        (1024, 16, 1.0, false),
    ] {
        let lattice = Lattice::within(on_gpu.bounds, 2, 0.5);
        let volume = volume_with(&gpu, lattice, [edge, 8], has_gradients);
        let rays = ProbeRays::new(&gpu, lattice.probe_count(), count).unwrap();
        let all = lattice.probe_count() * count;
        let room = RAYS_A_ROW * all.div_ceil(RAYS_A_ROW);
        let lights: Vec<[f32; 4]> = (0..room)
            .map(|_| random_light(&mut random, scale))
            .collect();
        let [first, second] = [volume.lit(1), volume.lit(2)];
        // In two parts, each of whose rays begin the image.
        let half = lattice.probe_count() / 2;
        let blend = |maps, adds: bool| {
            for (part, from) in [(0, 0), (half, half * count)] {
                let mut of_part: Vec<[f32; 4]> = lights[from as usize..].to_vec();
                of_part.resize(room as usize, [0.0; 4]);
                if adds {
                    of_part.iter_mut().for_each(|light| light[3] = 0.0);
                }
                gpu.upload_image(&rays.light, 0, 0, bytemuck::cast_slice(&of_part))
                    .unwrap();
                let mut frame = Frame::new();
                frame.set_scene(&on_gpu.set, &on_gpu.materials);
                let part = volume.all.part(part, half);
                rays.blend(&mut frame, &volume, part, maps, (adds, 0.0));
                gpu.submit(frame).unwrap();
            }
        };
        blend([first, first], false);
        blend([first, second], true);
        for probe in 0..lattice.probe_count() {
            let of = |ray: u32| lights[(probe * count + ray) as usize].map(f64::from);
            let brought: Vec<(DVec3, DVec4)> = (0..count)
                .map(|ray| (ray_direction(probe, ray, count), DVec4::from(of(ray))))
                .collect();
            let expected = with_border(&oracle::blend(&brought, edge));
            let largest = expected.iter().map(|e| e.truncate().largest()).worst();
            for (maps, times) in [(first, 1.0), (second, 2.0)] {
                let scales: Vec<f32> =
                    bytemuck::pod_collect_to_vec(&gpu.read_buffer(&maps.scales).unwrap());
                let scale = f64::from(scales[probe as usize]);
                assert_eq!(scale.log2().fract(), 0.0);
                let place = (probe, volume.columns, edge);
                let found: Vec<[f64; 4]> = halfs(&gpu, &maps.irradiance, place);
                let off = found.iter().zip(&expected).map(|(found, expected)| {
                    let light = DVec3::new(found[0], found[1], found[2]) * scale;
                    let light = (light - times * expected.truncate()).abs() / largest;
                    larger(light.largest(), (found[3] - expected.w).abs())
                });
                let off = off.worst();
                assert!(off < 3e-3, "{count} rays, {edge}² texels: off by {off}");
            }
        }
    }
}

/// The surface that a ray meets.
pub(crate) fn place_on(scene: &Scene, (triangle, at): (u32, [u32; 2]), direction: DVec3) -> Place {
    let vertices = scene.triangles[triangle as usize]
        .vertices
        .map(|at| scene.vertices[at as usize]);
    let [a, b, c] = vertices.map(|vertex| Vec3::from(vertex.position).as_dvec3());
    let [u, v] = at.map(|bits| f64::from(f32::from_bits(bits)));
    let [na, nb, nc] = vertices.map(|vertex| Vec3::from(vertex.normal).as_dvec3());
    let front = (b - a).cross(c - a).normalize();
    let geometric_normal = if front.dot(direction) <= 0.0 {
        front
    } else {
        -front
    };
    let shading = (na * (1.0 - u - v) + nb * u + nc * v).normalize_or(front);
    Place {
        position: a * (1.0 - u - v) + b * u + c * v,
        geometric_normal,
        shading_normal: if shading.dot(geometric_normal) < 0.0 {
            -shading
        } else {
            shading
        },
    }
}

/// Directions of texels, and their order around the fold, need no device.
#[test]
fn maps_go_on_beyond_their_borders() {
    for edge in [4, 5, 16] {
        let map = Map::of(edge, |at| {
            direction_of(at.truncate().as_dvec2() + 0.5, edge).extend(1.0)
        });
        // A smooth function stays smooth over every fold: a step of 1e-4 changes it by as little.
        let mut random = Random::new(3);
        for _ in 0..2000 {
            let [x, y, z] = [(); 3].map(|()| f64::from(random.unit()) - 0.5);
            let kinds = [
                DVec3::new(x, y, z),
                DVec3::new(x, 0.0, z),
                DVec3::new(x, y, 1e-5 * z),
            ];
            let towards = kinds[random.below(3) as usize].normalize_or(DVec3::X);
            let step = 1e-4 * DVec3::new(y, z, x);
            let change = map.at(towards) - map.at((towards + step).normalize());
            assert!(change.length() < 1e-3, "{edge}² texels at {towards}");
        }
    }
}

/// A closed room of albedo ½ has L_e (1 + ½ + … ½ᵏ⁻¹) of k bounces, whichever maps they end in.
#[test]
fn every_bounce_adds_its_share() {
    let gpu = gpu();
    let scene = bundled("furnace");
    let emitted = scene.materials[0].emission.x;
    let albedo = scene.materials[0].albedo.x;
    let entry = &lumivox::gi::probes::irradiance::ENTRY;
    for (bounces, irradiance) in (1..=5).flat_map(|of| [(of, "oct"), (of, "sh2")]) {
        let pairs = [
            format!("bounces={bounces}"),
            format!("irradiance={irradiance}"),
            "probes=4".into(),
            "rays=64".into(),
        ];
        let settings = entry.settings(None, &pairs).unwrap();
        let frame = crate::support::technique::frame(16, 16, 16);
        let (mut renderer, _) = Renderer::new(&gpu, &scene, entry, &settings, frame).unwrap();
        renderer.render(&scene.camera).unwrap();
        let all: f32 = (0..bounces).map(|bounce| albedo.powi(bounce)).sum();
        let expected = std::f32::consts::PI * emitted * all;
        let light = renderer.indirect_light().unwrap();
        for found in &light.irradiance.pixels {
            let off = (found / expected - 1.0).abs().largest();
            assert!(off < 2e-3, "{bounces} bounces, {irradiance}: off by {off}");
        }
    }
}
