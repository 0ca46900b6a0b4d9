//! Probes on the device against their twins.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, DVec4, UVec3, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::Inputs;
use lumivox::gi::probes::Lattice;
use lumivox::gi::probes::explore::explore;
use lumivox::gi::probes::lookup::{Lookup, Visibility, gather};
use lumivox::gi::probes::oracle::{self, Map, Place, Probe, direction_of};
use lumivox::gi::probes::rays::ProbeRays;
use lumivox::gi::probes::snap::snap;
use lumivox::gi::probes::volume::Volume;
use lumivox::gi::shared::paths::PathScene;
use lumivox::gi::shared::voxel::VoxelGrid;
use lumivox::graph::{Frame, Gpu, Image};
use lumivox::render::bvh::SceneRays;
use lumivox::render::bvh::oracle::RayOracle;
use lumivox::render::{GpuScene, LightMaps};
use lumivox::scene::Scene;

use crate::support::compare::{Largest, Worst, larger};
use crate::support::gather::View;
use crate::support::scenes::{bundled, scene_of, soup};
use crate::support::voxels::{half, to_half};
use crate::support::{Random, gpu};

const RAYS_A_ROW: u32 = 4096;

const LOOKUP: Lookup = Lookup {
    visibility: Visibility::Moments,
    normal_bias: 0.25,
    weight_floor: 0.05,
    crush: 0.2,
};

/// World coordinates.
const METRES: VoxelGrid = VoxelGrid {
    origin: Vec3::ZERO,
    voxel_size: 1.0,
    resolution: 8,
};

fn texels<const N: usize>(gpu: &Gpu, image: &Arc<Image>) -> Vec<[u32; N]> {
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
fn with_border(map: &Map) -> Vec<DVec4> {
    let wide = map.edge as i32 + 2;
    let places = (0..wide * wide).map(|at| glam::IVec2::new(at % wide - 1, at / wide - 1));
    places.map(|at| map.texel(at)).collect()
}

/// Probes of a lattice, with room for two bounces.
fn volume(gpu: &Gpu, lattice: Lattice, [light, moments]: [u32; 2]) -> Volume {
    let volume = Volume::new(gpu, lattice, (light, Some(moments)), 2).unwrap();
    let places: Vec<Vec3> = lattice.places().collect();
    volume.put(gpu, &places).unwrap();
    volume
}

fn scenes() -> Vec<Scene> {
    let mut random = Random::new(23);
    let mut soup = scene_of(&soup(&mut random, 8), 0.0, &mut random);
    soup.name = "soup".into();
    vec![bundled("cornell"), soup]
}

/// A scene on the device, its triangles, and probes in it that have been traced.
struct Traced {
    on_gpu: GpuScene,
    paths: PathScene,
    volume: Volume,
    rays: ProbeRays,
}

fn traced(gpu: &Gpu, scene: &Scene, [probes, rays]: [u32; 2], texels: [u32; 2]) -> Traced {
    let on_gpu = GpuScene::new(gpu, scene).unwrap();
    let (paths, _) = PathScene::build(gpu, &on_gpu).unwrap();
    let lattice = Lattice::within(on_gpu.bounds, probes, 0.3);
    let volume = volume(gpu, lattice, texels);
    let rays = ProbeRays::new(gpu, lattice.probe_count(), rays).unwrap();
    let mut frame = Frame::new();
    frame.set_scene(&on_gpu.set, &on_gpu.materials);
    rays.trace(&mut frame, &paths.rays, &volume);
    gpu.submit(frame).unwrap();
    Traced {
        on_gpu,
        paths,
        volume,
        rays,
    }
}

fn ray_direction(probe: u32, ray: u32, count: u32) -> DVec3 {
    oracle::turn_of(probe) * oracle::fibonacci(ray, count)
}

/// What a ray sees, as the reference does (m).
fn seen(oracle: &RayOracle<'_>, from: Vec3, direction: DVec3) -> f64 {
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
        let hits: Vec<[u32; 4]> = texels(&gpu, &traced.rays.hits);
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

fn random_light(random: &mut Random, scale: f32) -> [f32; 4] {
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
    for (count, edge, scale) in [
        (32, 4, 1e-12),
        (100, 8, 1.0),
        (64, 16, 3e7),
        (777, 11, 2e3),
        (8192, 16, 1.0),
    ] {
        let lattice = Lattice::within(on_gpu.bounds, 2, 0.5);
        let volume = volume(&gpu, lattice, [edge, 8]);
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
                rays.blend(&mut frame, &volume, [part, half], maps, adds);
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

/// Random maps, with what the device has of them.
struct RandomMaps {
    probes: Vec<[Map; 2]>,
    places: Vec<Vec3>,
}

impl RandomMaps {
    /// Fills the first maps of a volume, and its moments; moves the probes.
    fn new(gpu: &Gpu, volume: &Volume, random: &mut Random) -> Self {
        let (count, columns) = (volume.lattice.probe_count(), volume.columns);
        let rows = count.div_ceil(columns);
        let edges = [volume.irradiance_texels, volume.moment_texels];
        let reach = 1.5 * f64::from(volume.lattice.diagonal() / volume.lattice.cell());
        let rounded = |value: f64| half(to_half(value));
        let mut texel = |which: usize| {
            let [a, b, c, d] = [(); 4].map(|()| f64::from(random.unit()));
            if which == 0 {
                DVec4::new(a, b, c, d).map(rounded)
            } else {
                let mean = a * reach;
                DVec4::new(mean, mean * mean + 0.3 * b * b, 0.0, 0.0).map(rounded)
            }
        };
        let mut map = |which: usize| {
            let edge = edges[which];
            let texels = (0..edge * edge).map(|_| texel(which)).collect();
            Map { edge, texels }
        };
        let probes: Vec<[Map; 2]> = (0..count).map(|_| [0, 1].map(&mut map)).collect();
        for which in [0, 1] {
            let (wide, parts) = (edges[which] + 2, [4, 2][which]);
            let mut halfs = vec![0u16; (columns * wide * rows * wide) as usize * parts];
            for (probe, maps) in (0..).zip(&probes) {
                let first = UVec3::new(probe % columns, probe / columns, 0) * wide;
                for (at, texel) in (0..).zip(with_border(&maps[which])) {
                    let place = first + UVec3::new(at % wide, at / wide, 0);
                    let index = (place.x + place.y * columns * wide) as usize * parts;
                    for part in 0..parts {
                        halfs[index + part] = to_half(texel[part]);
                    }
                }
            }
            let image = [&volume.lit(1).irradiance, &volume.moments][which];
            gpu.upload_image(image, 0, 0, bytemuck::cast_slice(&halfs))
                .unwrap();
        }
        let scales: Vec<f32> = (0..count)
            .map(|probe| [0.5, 4.0][probe as usize % 2])
            .collect();
        let probe_scales = &volume.lit(1).scales;
        gpu.upload_buffer(probe_scales, bytemuck::cast_slice(&scales))
            .unwrap();
        let mut moved = |probe: u32| {
            let by = Vec3::from([(); 3].map(|()| random.unit() - 0.5));
            volume.lattice.place(probe) + 0.8 * by * volume.lattice.spacing
        };
        let places: Vec<Vec3> = (0..count).map(&mut moved).collect();
        let rows: Vec<[f32; 4]> = places.iter().map(|at| at.extend(0.0).to_array()).collect();
        gpu.upload_buffer(&volume.places, bytemuck::cast_slice(&rows))
            .unwrap();
        let scaled = |(probe, [light, moments]): (usize, [Map; 2])| {
            let scale = f64::from(scales[probe]);
            let texels = light.texels.iter();
            let texels = texels.map(|t| (t.truncate() * scale).extend(t.w)).collect();
            [Map { texels, ..light }, moments]
        };
        RandomMaps {
            probes: probes.into_iter().enumerate().map(scaled).collect(),
            places,
        }
    }

    fn probe(&self, index: u32) -> Probe {
        let [irradiance, moments] = self.probes[index as usize].clone();
        Probe {
            place: self.places[index as usize].as_dvec3(),
            irradiance,
            moments,
        }
    }
}

/// How surfaces look up in the tests.
fn lookups() -> [Lookup; 4] {
    let with = |visibility| Lookup {
        visibility,
        ..LOOKUP
    };
    [
        LOOKUP,
        with(Visibility::None),
        with(Visibility::Facing),
        Lookup {
            normal_bias: 0.0,
            weight_floor: 0.0,
            crush: 0.5,
            ..LOOKUP
        },
    ]
}

#[test]
fn lookups_are_the_oracles() {
    let gpu = gpu();
    let mut random = Random::new(41);
    for scene in scenes() {
        let traced = traced(&gpu, &scene, [5, 32], [6, 8]);
        let maps = RandomMaps::new(&gpu, &traced.volume, &mut random);
        let view = View::new(&gpu, &traced.on_gpu, &scene.camera, [40, 30], &METRES);
        for lookup in lookups() {
            let mut frame = Frame::new();
            frame.set_scene(&traced.on_gpu.set, &traced.on_gpu.materials);
            let volume = (&traced.volume, traced.volume.lit(1));
            gather(&mut frame, &view.all(&traced.on_gpu), volume, &lookup);
            gpu.submit(frame).unwrap();
            let lattice = &traced.volume.lattice;
            let expected = view.receivers.iter().map(|(_, receiver)| {
                let place = Place {
                    position: receiver.position,
                    geometric_normal: receiver.geometric_normal,
                    shading_normal: receiver.shading_normal,
                };
                oracle::light_of_probes(lattice, |probe| maps.probe(probe), &place, &lookup)
            });
            let off = view.results(&gpu).into_iter().zip(expected);
            let off = off.map(|(found, expected)| (found - expected).abs().largest());
            let off = off.worst();
            assert!(off < 4e-3, "{}, {lookup:?}: off by {off}", scene.name);
        }
    }
}

/// One bounce: what hits reflect of random light.
#[test]
fn bounced_light_is_the_oracles() {
    let gpu = gpu();
    let mut random = Random::new(5);
    for scene in scenes() {
        let count = 64;
        let traced = traced(&gpu, &scene, [4, count], [6, 8]);
        let Traced {
            on_gpu,
            paths,
            volume,
            rays,
        } = &traced;
        let maps = RandomMaps::new(&gpu, volume, &mut random);
        let view = View::new(&gpu, on_gpu, &scene.camera, [8, 8], &METRES);
        let light_maps = LightMaps::new(&gpu, on_gpu, 64, false).unwrap();
        let given = Inputs {
            scene: on_gpu,
            maps: &light_maps,
            gbuffer: &view.gbuffer,
            direct: &view.result,
        };
        let mut frame = Frame::new();
        frame.set_scene(&on_gpu.set, &on_gpu.materials);
        let half = volume.lattice.probe_count() / 2;
        let all = [half, half];
        rays.bounce(
            &mut frame,
            &given,
            paths,
            (volume, volume.lit(1)),
            &LOOKUP,
            all,
        );
        gpu.submit(frame).unwrap();
        let hits: Vec<[u32; 4]> = texels(&gpu, &rays.hits);
        let found: Vec<[u32; 4]> = texels(&gpu, &rays.light);
        let (mut worst, mut largest) = (0.0f64, 0.0f64);
        for probe in half..2 * half {
            for ray in 0..count {
                let index = (probe * count + ray) as usize;
                let [triangle, u, v, _] = hits[index];
                let found = DVec4::from(
                    found[index - (half * count) as usize]
                        .map(|bits| f64::from(f32::from_bits(bits))),
                );
                if triangle == u32::MAX {
                    assert_eq!(found, DVec4::ZERO);
                    continue;
                }
                let place = place_on(&scene, (triangle, [u, v]), ray_direction(probe, ray, count));
                let light = oracle::light_of_probes(
                    &volume.lattice,
                    |probe| maps.probe(probe),
                    &place,
                    &LOOKUP,
                );
                let material = scene.triangles[triangle as usize].material;
                let albedo = scene.materials[material as usize].albedo.as_dvec3();
                let expected = light.truncate() * albedo / PI;
                let off = (found.truncate() - expected).abs().largest();
                worst = larger(worst, off);
                largest = larger(largest, expected.largest());
            }
        }
        assert!(largest > 0.1, "{}: no light", scene.name);
        assert!(worst < 4e-3 * largest, "{}: off by {worst}", scene.name);
    }
}

/// The surface that a ray meets.
fn place_on(scene: &Scene, (triangle, at): (u32, [u32; 2]), direction: DVec3) -> Place {
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

/// A lattice of 5³ probes, a metre apart, from the origin on.
fn metre_lattice() -> Lattice {
    Lattice::within((Vec3::splat(-0.5), Vec3::splat(4.5)), 5, 0.5)
}

/// Places on the plane z = `height`, seen from `side`.
fn wall(height: f32, side: f32) -> Vec<(Vec3, Vec3)> {
    let places = (0..400u16).map(|at| (f32::from(at % 20), f32::from(at / 20)));
    places
        .map(|(x, y)| (Vec3::new(0.2 * x, 0.2 * y, height), side * Vec3::Z))
        .collect()
}

#[test]
fn probes_snap_to_the_side_that_is_seen() {
    let lattice = metre_lattice();
    let moved = |seen: &[(Vec3, Vec3)], probe: u32| {
        let (before, after) = (
            lattice.place(probe),
            snap(&lattice, seen, 0.15, 0.0)[probe as usize],
        );
        assert_eq!(before.truncate(), after.truncate(), "along the wall");
        [before.z, after.z]
    };
    let middle = |z: u32| 2 + 5 * (2 + 5 * z);
    // A wall between two layers: both go to its side, the far one through it.
    let seen = wall(1.4, 1.0);
    let [[_, low], [_, high]] = [1, 2].map(|z| moved(&seen, middle(z)));
    assert!(
        (low - 1.55).abs() < 1e-5 && (high - 1.55).abs() < 1e-5,
        "{low}, {high}"
    );
    // Seen from the other side it is the same on that side.
    let [_, low] = moved(&wall(1.4, -1.0), middle(1));
    assert!((low - 1.25).abs() < 1e-5, "{low}");
    // The majority decides between two sides.
    let mut both = wall(1.4, 1.0);
    both.extend(wall(1.4, -1.0).into_iter().take(100));
    assert!((moved(&both, middle(1))[1] - 1.55).abs() < 1e-5);
    // Whoever nobody asks stays, and nobody goes further than three quarters of a cell.
    assert_eq!(moved(&seen, middle(4))[1], 4.0);
    let [before, after] = moved(&wall(1.95, -1.0), middle(1));
    assert!((after - before - 0.75).abs() < 1e-5, "{after}");
    // Another plane, a third of a cell off, has no say, nor has one that is turned.
    let mut near = wall(1.4, 1.0);
    let further = wall(1.05, -1.0);
    near.extend(further.iter().chain(&further));
    assert!((moved(&near, middle(2))[1] - 1.55).abs() < 1e-5);
    let mut turned = wall(1.4, 1.0);
    let tilted = |(place, _): (Vec3, Vec3)| (place, Vec3::new(0.6, 0.0, -0.8));
    turned.extend(wall(1.4, 1.0).into_iter().chain(wall(1.4, 1.0)).map(tilted));
    assert!((moved(&turned, middle(2))[1] - 1.55).abs() < 1e-5);
    // Votes go where look-ups go: half a cell off the surface that is the next layer.
    let off = snap(&lattice, &wall(1.9, 1.0), 0.15, 0.5)[middle(1) as usize];
    assert_eq!(off, lattice.place(middle(1)));
    assert_eq!(snap(&lattice, &[], 0.15, 0.0).len(), 125);
}

/// Paths from the eye come to surfaces alone, and only to sides that can be seen from the air that
/// the eye is in: in a closed box not to its outside.
#[test]
fn explored_places_are_seen_sides_of_surfaces() {
    let gpu = gpu();
    let scene = bundled("furnace");
    let on_gpu = GpuScene::new(&gpu, &scene).unwrap();
    let rays = SceneRays::new(&gpu, &on_gpu).unwrap();
    let (seen, _) = explore(&gpu, &on_gpu, &rays).unwrap();
    assert_eq!(seen.len(), 4 << 16, "nothing leaves a closed box");
    let (low, high) = on_gpu.bounds;
    let middle = 0.5 * (low + high);
    for (place, normal) in &seen {
        let to_walls = (*place - low).abs().min((*place - high).abs());
        assert!(to_walls.min_element() < 1e-4, "{place} is on no wall");
        assert!(
            normal.dot(middle - *place) > 0.0,
            "{place} is seen from outside"
        );
    }
}

/// Where paths leave the scene they end.
#[test]
fn explored_paths_end_outside() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let mut open = scene.clone();
    open.triangles.truncate(8);
    let on_gpu = GpuScene::new(&gpu, &open).unwrap();
    let rays = SceneRays::new(&gpu, &on_gpu).unwrap();
    let (seen, _) = explore(&gpu, &on_gpu, &rays).unwrap();
    assert!((1..4 << 16).contains(&seen.len()), "{} places", seen.len());
    let (low, high) = on_gpu.bounds;
    for (place, normal) in &seen {
        assert!(place.cmpge(low - 1e-3).all() && place.cmple(high + 1e-3).all());
        assert!((normal.length() - 1.0).abs() < 1e-4);
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
    for bounces in 1..=5 {
        let pairs = [
            format!("bounces={bounces}"),
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
            assert!(off < 2e-3, "{bounces} bounces: off by {off}");
        }
    }
}

#[test]
fn a_lattice_has_its_outer_layer_inside() {
    let bounds = (Vec3::new(-1.0, 0.0, 2.0), Vec3::new(3.0, 1.0, 3.0));
    for (count, outer) in [(2, 0.5), (4, 0.25), (16, 0.05), (64, 0.25)] {
        let lattice = Lattice::within(bounds, count, outer);
        assert_eq!(lattice.counts.max_element(), count);
        let [first, last] = [0, lattice.probe_count() - 1].map(|probe| lattice.place(probe));
        let off = first - bounds.0 - outer * lattice.spacing;
        assert!(off.abs().largest() < 1e-5, "{lattice:?}");
        let off = bounds.1 - last - outer * lattice.spacing;
        assert!(off.abs().largest() < 1e-5, "{lattice:?}");
    }
    // A plane has probes on both sides, a point is no error.
    let plane = Lattice::within((Vec3::ZERO, Vec3::new(4.0, 0.0, 4.0)), 8, 0.25);
    assert!(plane.first.y < 0.0 && plane.place(plane.probe_count() - 1).y > 0.0);
    let point = Lattice::within((Vec3::ONE, Vec3::ONE), 8, 0.25);
    assert!(point.cell() > 0.0);
}
