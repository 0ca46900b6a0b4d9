//! How surfaces look probes up, and the bounces that hits make of it, on the device against the
//! oracle.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

use glam::{DVec3, DVec4, UVec3, Vec3};
use lumivox::gi::Inputs;
use lumivox::gi::probes::Lattice;
use lumivox::gi::probes::cascades::layout::Layout;
use lumivox::gi::probes::cascades::pool::Key;
use lumivox::gi::probes::cascades::store::Store;
use lumivox::gi::probes::lookup::{Lookup, Visibility, gather};
use lumivox::gi::probes::oracle::{self, Irradiance, Map, Place, Probe, Probes};
use lumivox::gi::probes::rays::ProbeRays;
use lumivox::gi::probes::volume::{self, Kept, Volume};
use lumivox::gi::shared::paths::PathScene;
use lumivox::gi::shared::voxel::oracle::Receiver;
use lumivox::graph::{Frame, Gpu};
use lumivox::render::bvh::oracle::RayOracle;
use lumivox::render::{GpuScene, LightMaps};

use crate::probes::{
    RAYS_A_ROW, Traced, place_on, random_light, ray_direction, scenes, seen, texels, traced,
    with_border,
};
use crate::support::compare::{Largest, Worst, larger};
use crate::support::gather::{METRES, View};
use crate::support::voxels::{half, to_half};
use crate::support::{Random, gpu, read_words};

const LOOKUP: Lookup = Lookup {
    visibility: Visibility::Moments,
    normal_bias: 0.25,
    weight_floor: 0.05,
    crush: 0.2,
    rings: 2,
};

/// Blended harmonics are the oracle's, and so is what surfaces look up of them.
#[test]
fn harmonics_are_the_oracles() {
    let gpu = gpu();
    let mut random = Random::new(13);
    for (scene, count) in scenes().into_iter().zip([100, 777]) {
        let on_gpu = GpuScene::new(&gpu, &scene).unwrap();
        let (paths, _) = PathScene::build(&gpu, &on_gpu).unwrap();
        let lattice = Lattice::within(on_gpu.bounds, 3, 0.3);
        let kept = Kept {
            irradiance: volume::Irradiance::Harmonics,
            moment_texels: None,
            has_gradients: false,
            bounces: 2,
        };
        let volume = Volume::new(&gpu, lattice, &kept).unwrap();
        let places: Vec<Vec3> = lattice.places().collect();
        volume.put(&gpu, &places, &[]).unwrap();
        let probe_count = lattice.probe_count();
        let rays = ProbeRays::new(&gpu, probe_count, count).unwrap();
        let room = RAYS_A_ROW * (probe_count * count).div_ceil(RAYS_A_ROW);
        let lights: Vec<[f32; 4]> = (0..room).map(|_| random_light(&mut random, 3.0)).collect();
        gpu.upload_image(&rays.light, 0, 0, bytemuck::cast_slice(&lights))
            .unwrap();
        let [first, second] = [volume.lit(1), volume.lit(2)];
        let view = View::new(&gpu, &on_gpu, &scene.camera, [40, 30], &METRES);
        let lookup = Lookup {
            visibility: Visibility::Facing,
            ..LOOKUP
        };
        let mut frame = Frame::new();
        frame.set_scene(&on_gpu.set, &on_gpu.materials);
        let probes = volume.listed();
        rays.blend(&mut frame, &volume, probes, [first, first], (false, 0.0));
        rays.blend(&mut frame, &volume, probes, [first, second], (true, 0.0));
        let receivers = view.all(&on_gpu);
        gather(
            &mut frame,
            &receivers,
            &paths.rays,
            (&volume, second),
            &lookup,
        );
        gpu.submit(frame).unwrap();
        // Twice the light, and the share that meets nothing of the first.
        let harmonics: Vec<[DVec4; 9]> = (0..probe_count)
            .map(|probe| {
                let of = |ray: u32| lights[(probe * count + ray) as usize].map(f64::from);
                let brought = (0..count)
                    .map(|ray| (ray_direction(probe, ray, count), DVec4::from(of(ray))))
                    .collect::<Vec<_>>();
                oracle::blend_harmonics(&brought).map(|c| (2.0 * c.truncate()).extend(c.w))
            })
            .collect();
        let probe = |probe: u32| Probe {
            place: places[probe as usize].as_dvec3(),
            irradiance: Irradiance::Harmonics(harmonics[probe as usize].to_vec()),
            gradients: None,
            moments: Map::of(1, |_| DVec4::ZERO),
        };
        let probes = Probes {
            lattice: &lattice,
            probe: &probe,
            is_there: &|_| true,
            sees: &|_, _| true,
        };
        let found = view.results(&gpu);
        let off = found
            .iter()
            .zip(&view.receivers)
            .map(|(found, (_, receiver))| {
                let place = Place {
                    position: receiver.position,
                    geometric_normal: receiver.geometric_normal,
                    shading_normal: receiver.shading_normal,
                };
                (*found - oracle::light_of_probes(&probes, &place, &lookup))
                    .abs()
                    .largest()
            });
        let off = off.worst();
        assert!(off < 2e-2, "{}: off by {off}", scene.name);
    }
}

/// Random maps, with what the device has of them.
struct RandomMaps {
    probes: Vec<[Map; 3]>,
    places: Vec<Vec3>,
}

impl RandomMaps {
    /// Fills the first maps of a volume, and its moments; moves the probes. A share
    /// `sight` of them sees far, the others next to nothing.
    fn new(gpu: &Gpu, volume: &Volume, sight: f64, random: &mut Random) -> Self {
        let (count, columns) = (volume.lattice.probe_count(), volume.columns);
        let rows = count.div_ceil(columns);
        let irradiance_texels = volume.irradiance_texels;
        let edges = [irradiance_texels, volume.moment_texels, irradiance_texels];
        let reach = 1.5 * f64::from(volume.lattice.diagonal() / volume.lattice.cell());
        let rounded = |value: f64| half(to_half(value));
        let mut texel = |which: usize, far: f64| {
            let [a, b, c, d] = [(); 4].map(|()| f64::from(random.unit()));
            let mean = far * a * reach;
            match which {
                0 => DVec4::new(a, b, c, d),
                1 => DVec4::new(mean, mean * mean + 0.3 * far * b * b, 0.0, 0.0),
                _ => DVec4::new(a - 0.5, b - 0.5, c - 0.5, 0.0),
            }
            .map(rounded)
        };
        let mut map = |which: usize, far: f64| {
            let edge = edges[which];
            let texels = (0..edge * edge).map(|_| texel(which, far)).collect();
            Map { edge, texels }
        };
        // Spread over probes as a low-discrepancy sequence is.
        let far = |probe: u32| {
            let sees = (f64::from(probe) * 0.618_034).fract() < sight;
            if sees { 1.0 } else { 0.02 }
        };
        let probes: Vec<[Map; 3]> = (0..count)
            .map(|probe| [0, 1, 2].map(|which| map(which, far(probe))))
            .collect();
        let maps = volume.lit(1);
        let images = [&maps.irradiance, &volume.moments, &maps.gradients];
        for (which, image) in images.into_iter().enumerate() {
            let (wide, parts) = (edges[which] + 2, [4, 2, 4][which]);
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
        let scaled = |(probe, [light, moments, gradients]): (usize, [Map; 3])| {
            let scale = f64::from(scales[probe]);
            let [light, gradients] = [light, gradients].map(|map| {
                let texels = map.texels.iter();
                let texels = texels.map(|t| (t.truncate() * scale).extend(t.w)).collect();
                Map { texels, ..map }
            });
            [light, moments, gradients]
        };
        RandomMaps {
            probes: probes.into_iter().enumerate().map(scaled).collect(),
            places,
        }
    }

    fn probe(&self, index: u32) -> Probe {
        let [irradiance, moments, gradients] = self.probes[index as usize].clone();
        Probe {
            place: self.places[index as usize].as_dvec3(),
            irradiance: Irradiance::Map(irradiance),
            gradients: Some(gradients),
            moments,
        }
    }
}

/// How surfaces look up in the tests.
fn lookups() -> [Lookup; 6] {
    let with = |visibility| Lookup {
        visibility,
        ..LOOKUP
    };
    [
        LOOKUP,
        with(Visibility::None),
        with(Visibility::Facing),
        with(Visibility::Rays),
        Lookup {
            normal_bias: 0.0,
            weight_floor: 0.0,
            crush: 0.5,
            ..LOOKUP
        },
        Lookup { rings: 1, ..LOOKUP },
    ]
}

#[test]
fn lookups_are_the_oracles() {
    let gpu = gpu();
    let (mut random, mut all_orphans) = (Random::new(41), 0);
    for scene in scenes() {
        let traced = traced(&gpu, &scene, [5, 32], [6, 8]);
        let (lattice, rays) = (&traced.volume.lattice, RayOracle::new(&scene));
        let view = View::new(&gpu, &traced.on_gpu, &scene.camera, [40, 30], &METRES);
        // Probes that see far, and such that are hidden from nearly everywhere.
        for sight in [1.0, 0.1] {
            let maps = RandomMaps::new(&gpu, &traced.volume, sight, &mut random);
            let probe = |probe| maps.probe(probe);
            let sees = |from: DVec3, to: DVec3| {
                let way = to - from;
                seen(&rays, from.as_vec3(), way.normalize()) >= way.length()
            };
            let probes = Probes {
                lattice,
                probe: &probe,
                is_there: &|_| true,
                sees: &sees,
            };
            let mut most_orphans = 0;
            for lookup in lookups() {
                let mut frame = Frame::new();
                frame.set_scene(&traced.on_gpu.set, &traced.on_gpu.materials);
                let volume = (&traced.volume, traced.volume.lit(1));
                let receivers = view.all(&traced.on_gpu);
                frame.fill("probes.clear", &traced.volume.orphans, 0);
                gather(&mut frame, &receivers, &traced.paths.rays, volume, &lookup);
                gpu.submit(frame).unwrap();
                let expected = view.receivers.iter().map(|(_, receiver)| {
                    let place = Place {
                        position: receiver.position,
                        geometric_normal: receiver.geometric_normal,
                        shading_normal: receiver.shading_normal,
                    };
                    oracle::light_of_probes(&probes, &place, &lookup)
                });
                let is_orphan = |(_, receiver): &&([u32; 2], Receiver)| {
                    let place = Place {
                        position: receiver.position,
                        geometric_normal: receiver.geometric_normal,
                        shading_normal: receiver.shading_normal,
                    };
                    oracle::is_orphan(&probes, &place, &lookup)
                };
                let orphans = view.receivers.iter().filter(is_orphan).count() as u32;
                let counted = read_words(&gpu, &traced.volume.orphans)[0];
                assert!(
                    counted.abs_diff(orphans) <= 3,
                    "{lookup:?}: {counted} orphans, not {orphans}"
                );
                most_orphans = most_orphans.max(orphans);
                let found = view.results(&gpu);
                let off = found.iter().zip(expected);
                let off = off.map(|(found, expected)| (*found - expected).abs().largest());
                let off: Vec<f64> = off.collect();
                // Where a ray passes an edge, or a shell is just seen, rounding decides.
                let near = off.iter().filter(|off| **off < 1e-2).count();
                let (name, far) = (&scene.name, off.len() - near);
                assert!(
                    far * 100 <= off.len(),
                    "{name}, {lookup:?}, sight {sight}: {far} of {} off",
                    off.len()
                );
            }
            println!("{}, sight {sight}: {most_orphans} orphans", scene.name);
            assert!(sight < 1.0 || most_orphans == 0, "{most_orphans}");
            all_orphans += most_orphans;
        }
    }
    assert!(all_orphans > 100, "{all_orphans}");
}

/// Levels around an eye in the scene, with a share of their probes, each of random light.
#[test]
fn lookups_of_levels_are_the_oracles() {
    let gpu = gpu();
    let mut random = Random::new(43);
    for scene in scenes() {
        let on_gpu = GpuScene::new(&gpu, &scene).unwrap();
        let view = View::new(&gpu, &on_gpu, &scene.camera, [40, 30], &METRES);
        let (low, high) = on_gpu.bounds;
        let windows = Layout::new((low, high), 5, 3, 0.0).windows(low.lerp(high, 0.6));
        let count = windows.len() as u32;
        let all = (0..).zip(&windows).flat_map(|(level, window)| {
            let probes = 0..window.lattice.probe_count();
            probes.map(move |probe| Key::new(level, count, window.at(probe)))
        });
        let all: Vec<Key> = all.collect();
        for (sight, kept) in [(1.0, 1.0), (1.0, 0.7), (0.1, 0.9)] {
            let needed: BTreeSet<Key> = all
                .iter()
                .filter(|_| f64::from(random.unit()) < kept)
                .copied()
                .collect();
            let kept = Kept {
                irradiance: volume::Irradiance::Octahedral(6),
                moment_texels: Some(8),
                has_gradients: true,
                bounces: 1,
            };
            let most = needed.len() as u32;
            let mut store = Store::new(&gpu, (&kept, 32), &windows, most).unwrap();
            store.pool.hold(&needed);
            store.pool.advance(0);
            store.look_up_by(&gpu, &LOOKUP, &windows).unwrap();
            store.publish(&gpu, &windows).unwrap();
            // Maps of all slots, in cells of a level; then places of those that are held.
            let mut slots = store.levels[0].clone();
            slots.lattice.counts = UVec3::new(store.pool.room(), 1, 1);
            let mut maps = RandomMaps::new(&gpu, &slots, sight, &mut random);
            let held: BTreeMap<Key, u32> = store.pool.lit().collect();
            for (key, slot) in &held {
                let home = windows[key.level(count) as usize].home(key.at());
                let by = Vec3::from([(); 3].map(|()| random.unit() - 0.5));
                maps.places[*slot as usize] = home.truncate() + 0.8 * home.w * by;
            }
            let rows = maps.places.iter().map(|place| place.extend(0.0).to_array());
            let rows: Vec<[f32; 4]> = rows.collect();
            gpu.upload_buffer(&slots.places, bytemuck::cast_slice(&rows))
                .unwrap();
            let mut frame = Frame::new();
            frame.set_scene(&on_gpu.set, &on_gpu.materials);
            store.gather(&mut frame, &view.all(&on_gpu), &LOOKUP, slots.lit(1));
            gpu.submit(frame).unwrap();
            let find = |level: u32, probe: u32| {
                let at = windows[level as usize].at(probe);
                held.get(&Key::new(level, count, at)).copied()
            };
            let is_there: Vec<_> = (0..count)
                .map(|level| move |probe: u32| find(level, probe).is_some())
                .collect();
            let probe: Vec<_> = (0..count)
                .map(|level| {
                    let maps = &maps;
                    move |probe: u32| maps.probe(find(level, probe).unwrap())
                })
                .collect();
            let levels: Vec<(Probes<'_>, u32)> = (0..count as usize)
                .map(|level| {
                    let probes = Probes {
                        lattice: &windows[level].lattice,
                        probe: &probe[level],
                        is_there: &is_there[level],
                        sees: &|_, _| true,
                    };
                    (probes, windows[level].open)
                })
                .collect();
            let (found, mut far) = (view.results(&gpu), 0);
            for (found, (_, receiver)) in found.iter().zip(&view.receivers) {
                let place = Place {
                    position: receiver.position,
                    geometric_normal: receiver.geometric_normal,
                    shading_normal: receiver.shading_normal,
                };
                let expected = oracle::light_of_levels(&levels, &place, &LOOKUP);
                far += usize::from((*found - expected).abs().largest() > 2e-2);
            }
            println!("{}, {sight}, {}: {far} off", scene.name, held.len());
            assert!(far * 100 <= found.len(), "{far} of {} off", found.len());
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
        let mut traced = traced(&gpu, &scene, [4, count], [6, 8]);
        let maps = RandomMaps::new(&gpu, &traced.volume, 1.0, &mut random);
        // From where that has moved them.
        traced.trace(&gpu);
        let Traced {
            on_gpu,
            paths,
            volume,
            rays,
            hits,
        } = &traced;
        let probe = |probe| maps.probe(probe);
        let probes = Probes {
            lattice: &volume.lattice,
            probe: &probe,
            is_there: &|_| true,
            sees: &|_, _| true,
        };
        let view = View::new(&gpu, on_gpu, &scene.camera, [8, 8], &METRES);
        let light_maps = LightMaps::new(&gpu, on_gpu, 64, false).unwrap();
        let given = Inputs {
            scene: on_gpu,
            maps: &light_maps,
            rsm: &light_maps,
            gbuffer: &view.gbuffer,
            direct: &view.result,
            is_still: false,
        };
        let mut frame = Frame::new();
        frame.set_scene(&on_gpu.set, &on_gpu.materials);
        let half = volume.lattice.probe_count() / 2;
        let all = volume.all.part(half, half);
        rays.bounce(
            &mut frame,
            &given,
            paths,
            (volume, volume.lit(1)),
            &LOOKUP,
            all,
        );
        gpu.submit(frame).unwrap();
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
                let light = oracle::light_of_probes(&probes, &place, &LOOKUP);
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
