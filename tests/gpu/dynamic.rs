//! Dynamic geometry: static voxels with moving models among them against a voxelization of
//! everything at once, and against the CPU oracle.

use crate::support::compare::Largest;
use std::collections::BTreeMap;

use crate::support::scenes::{
    Corners, add_model, in_unit_grid, lump, random_pose, scene_of, soup, still,
};
use crate::support::technique::{
    Case, Surfaces, cases, frame, moving_room, small_lights, small_room,
};
use crate::support::voxels::{
    Read, area, compare_sets, coordinates, mean_normal, oracle_grid, raster_methods, read, unorm10,
    voxel_settings, voxelize,
};
use crate::support::{Random, gpu, read_words};
use glam::{DVec3, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::shared::voxel::build::passes::Voxel;
use lumivox::gi::shared::voxel::oracle::{self, VoxelIndex};
use lumivox::gi::shared::voxel::{
    DynamicVoxels, Injection, LightBounces, LightSettings, Method, Sides, VoxelLight, Voxelizer,
    Voxels,
};
use lumivox::graph::{FrameStats, Gpu};
use lumivox::render::GpuScene;
use lumivox::scene::{Pose, Scene};

/// The voxels that a scene has by compact index: whose places in memory differ, but not what they
/// hold.
#[derive(Debug, PartialEq)]
struct ByVoxel {
    occupancy: Vec<u32>,
    records: BTreeMap<VoxelIndex, (Voxel, Option<[u32; 4]>)>,
}

fn by_voxel(read: &Read) -> ByVoxel {
    let resolution = read.voxels.grid.resolution;
    let blocks = resolution / 4;
    let of = |voxel: VoxelIndex| {
        let [x, y, z] = voxel.map(|at| at / 4);
        let block = (x + blocks * (y + blocks * z)) as usize;
        let bit = oracle::block_bit(voxel);
        let words =
            u64::from(read.occupancy[2 * block]) | u64::from(read.occupancy[2 * block + 1]) << 32;
        let index = (read.bases[block] + (words & ((1u64 << bit) - 1)).count_ones()) as usize;
        (
            voxel,
            (
                read.records[index],
                read.emission
                    .get(index)
                    .map(|emission| emission.map(f32::to_bits)),
            ),
        )
    };
    ByVoxel {
        occupancy: read.occupancy.clone(),
        records: read.occupied().into_iter().map(of).collect(),
    }
}

/// What is wrong, in a line.
fn compare(found: &Read, expected: &Read) -> Result<(), String> {
    let (found, expected) = (by_voxel(found), by_voxel(expected));
    if let Some(word) = (0..expected.occupancy.len())
        .find(|word| found.occupancy[*word] != expected.occupancy[*word])
    {
        return Err(format!(
            "occupancy of block {}: {:x}, not {:x}",
            word / 2,
            found.occupancy[word],
            expected.occupancy[word]
        ));
    }
    for (voxel, record) in &expected.records {
        let other = &found.records[voxel];
        if coordinates(&other.0) != *voxel {
            return Err(format!(
                "the index of {voxel:?} leads to {:?}",
                coordinates(&other.0)
            ));
        }
        if other != record {
            return Err(format!("{voxel:?}: {other:?}, not {record:?}"));
        }
    }
    Ok(())
}

/// Static voxels with dynamic ones among them, followed through time.
struct Follower<'g> {
    gpu: &'g Gpu,
    scene: Scene,
    gpu_scene: GpuScene,
    voxelizer: Voxelizer,
    voxels: Voxels,
    dynamic: DynamicVoxels,
    resolution: u32,
}

impl<'g> Follower<'g> {
    fn new(gpu: &'g Gpu, scene: &Scene, resolution: u32) -> Self {
        let mut gpu_scene = GpuScene::new(gpu, scene).unwrap();
        in_unit_grid(&mut gpu_scene, resolution);
        let mut voxelizer =
            Voxelizer::new(gpu, &gpu_scene, voxel_settings(resolution, Method::Compute)).unwrap();
        let (voxels, dynamic, _) = voxelizer.run_dynamic(gpu, &gpu_scene).unwrap();
        Follower {
            gpu,
            scene: scene.clone(),
            gpu_scene,
            voxelizer,
            voxels,
            dynamic,
            resolution,
        }
    }

    fn go_to(&mut self, time_s: f32) -> FrameStats {
        self.scene.set_time(time_s);
        self.gpu_scene.set_pose(self.gpu, &self.scene).unwrap();
        let (scene, voxelizer) = (&self.gpu_scene, &mut self.voxelizer);
        let (mut stats, _) = (self.dynamic)
            .update(self.gpu, scene, voxelizer, &mut self.voxels, None)
            .unwrap();
        stats.append(self.gpu.submit_waiting().unwrap());
        stats
    }

    /// Everything on the device now.
    fn read(&self) -> Read {
        read(self.gpu, self.voxels.clone())
    }

    /// The scene as it is now, voxelized at once.
    fn voxelized_at_once(&self) -> Read {
        let mut gpu_scene = GpuScene::new(self.gpu, &self.scene).unwrap();
        in_unit_grid(&mut gpu_scene, self.resolution);
        voxelize(
            self.gpu,
            &gpu_scene,
            voxel_settings(self.resolution, Method::Compute),
        )
    }

    fn check(&self, what: &str) -> Read {
        let (found, expected) = (self.read(), self.voxelized_at_once());
        compare(&found, &expected).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!(
            found.voxels.fragment_count, expected.voxels.fragment_count,
            "{what}"
        );
        assert_eq!(
            found.voxels.voxel_count - found.voxels.hidden_count,
            expected.voxels.voxel_count,
            "{what}"
        );
        found
    }
}

/// Random triangles around the origin.
fn centred_soup(random: &mut Random, resolution: u32, count: usize) -> Vec<Corners> {
    let mut triangles = soup(random, resolution);
    triangles.truncate(count);
    triangles
        .iter_mut()
        .flatten()
        .for_each(|corner| *corner -= 0.5 * resolution as f32);
    triangles
}

/// Static soups, up to two dynamic ones at random poses in, half out of and outside of the grid: as
/// voxelized at once, bit by bit, and as the oracle has it.
#[test]
fn random_models_at_random_poses_are_as_if_voxelized_at_once() {
    let gpu = gpu();
    let (mut shared, mut moved, mut outside) = (0, 0, 0);
    for seed in 0..24u64 {
        let mut random = Random::new(7000 + seed);
        let resolution = if seed % 3 == 0 { 64 } else { 32 };
        let emission = if seed % 2 == 0 { 5.0 } else { 0.0 };
        let static_count = [0, 1, 60][seed as usize % 3];
        let static_triangles: Vec<Corners> = soup(&mut random, resolution)
            .into_iter()
            .take(static_count)
            .collect();
        let mut scene = scene_of(&static_triangles, emission, &mut random);
        let middle = 0.5 * resolution as f32;
        for _ in 0..=seed % 2 {
            let triangles = centred_soup(&mut random, resolution, 40);
            let model = scene_of(&triangles, emission, &mut random);
            let poses: Vec<Pose> = (0..4)
                .map(|second| {
                    let mut pose = random_pose(
                        &mut random,
                        if second == 2 {
                            40.0 * middle
                        } else {
                            1.2 * middle
                        },
                    );
                    pose.translate += middle;
                    pose
                })
                .collect();
            add_model(&mut scene, model, &poses);
        }
        let mut follower = Follower::new(&gpu, &scene, resolution);
        follower.check(&format!("seed {seed}, first"));
        for time_s in [0.5, 1.0, 2.0, 2.3, 3.0, 0.0] {
            follower.go_to(time_s);
            let what = format!("seed {seed}, {time_s} s");
            let found = follower.check(&what);
            let difference = compare_sets(
                &found.occupied(),
                &follower.scene,
                &oracle_grid(&found.voxels.grid),
            )
            .unwrap_or_else(|error| panic!("{what}: {error}"));
            assert!(
                difference.rounding <= 2 + difference.oracle / 1000,
                "{what}: {difference:?}"
            );
            shared += u64::from(found.voxels.hidden_count);
            moved += u64::from(follower.dynamic.voxel_count);
            outside += u32::from(follower.dynamic.voxel_count == 0);
        }
    }
    println!(
        "{moved} voxels of dynamic geometry, {shared} static ones in the blocks that it touched; \
         {outside} times it was outside of the grid"
    );
    assert!(
        shared > 1000 && moved > 10_000,
        "the scenes have to overlap"
    );
}

/// Means over both kinds of fragments against the oracle's, in f64.
#[test]
fn shared_voxels_hold_the_oracles_means() {
    let gpu = gpu();
    let mut random = Random::new(3);
    let mut scene = scene_of(&lump(24, 32), 3.0, &mut random);
    let mut triangles = lump(20, 32);
    triangles
        .iter_mut()
        .flatten()
        .for_each(|corner| *corner = 0.9 * (*corner - 16.0));
    add_model(
        &mut scene,
        scene_of(&triangles, 3.0, &mut random),
        &[
            still(Vec3::splat(60.0)),
            Pose {
                rotate_deg: Vec3::new(20.0, 30.0, 0.0),
                translate: Vec3::splat(16.3),
            },
        ],
    );
    let mut follower = Follower::new(&gpu, &scene, 32);
    follower.go_to(1.0);
    let found = follower.check("lumps");
    let sums = oracle::voxelize(&follower.scene, &oracle_grid(&found.voxels.grid));
    let static_sums = oracle::voxelize(
        &Scene {
            triangles: follower.scene.triangles[..follower.scene.models[0].first_triangle as usize]
                .to_vec(),
            ..follower.scene.clone()
        },
        &oracle_grid(&found.voxels.grid),
    );
    let (mut compared, mut worst) = (0, [0.0f64; 3]);
    for (voxel, (record, _)) in by_voxel(&found).records {
        let (Some(sum), Some(before)) = (sums.get(&voxel), static_sums.get(&voxel)) else {
            continue;
        };
        if sum.fragment_count == before.fragment_count || sum.area < 0.05 {
            continue;
        }
        compared += 1;
        let off = [
            (area(&record) - sum.area).abs() / sum.area,
            (unorm10(record.albedo).powf(2.0) - sum.albedo)
                .abs()
                .largest(),
            (mean_normal(&record) - sum.normal).length(),
        ];
        worst = [0, 1, 2].map(|i| worst[i].max(off[i]));
        assert!((mean_normal(&record) - DVec3::ZERO).is_finite());
    }
    println!(
        "{compared} shared voxels: area {:.4} (relative), albedo {:.4}, normal {:.4} off at most",
        worst[0], worst[1], worst[2]
    );
    assert!(
        compared > 300 && worst[0] < 0.02 && worst[1] < 0.01 && worst[2] < 0.02,
        "{compared} voxels, {worst:?}"
    );
}

/// After a visit, and after having left, everything static is what it was: every bit of occupancy,
/// bases and records.
#[test]
fn what_was_visited_is_as_if_never_visited() {
    let gpu = gpu();
    let mut random = Random::new(11);
    let mut scene = scene_of(&lump(40, 64), 3.0, &mut random);
    let triangles = lump(30, 64)
        .into_iter()
        .map(|corners| corners.map(|corner| 0.4 * (corner - 32.0)))
        .collect::<Vec<_>>();
    let away = still(Vec3::new(500.0, 0.0, 0.0));
    let visits: Vec<Pose> = (0..6)
        .map(|_| random_pose(&mut random, 20.0))
        .map(|pose| Pose {
            translate: pose.translate + 32.0,
            ..pose
        })
        .collect();
    let model = scene_of(&triangles, 3.0, &mut random);
    let poses: Vec<Pose> = std::iter::once(away).chain(visits).chain([away]).collect();
    add_model(&mut scene, model, &poses);
    let mut follower = Follower::new(&gpu, &scene, 64);
    let before = follower.read();
    let still_only = |read: &Read| {
        (
            read.occupancy.clone(),
            read.bases.clone(),
            read.records.clone(),
            read.emission.clone(),
            read.voxels.hidden_count,
        )
    };
    let mut static_scene = scene.clone();
    static_scene
        .triangles
        .truncate(scene.models[0].first_triangle as usize);
    static_scene.models.clear();
    let mut static_gpu = GpuScene::new(&gpu, &static_scene).unwrap();
    in_unit_grid(&mut static_gpu, 64);
    static_gpu.largest_emission = follower.gpu_scene.largest_emission;
    let without = voxelize(&gpu, &static_gpu, voxel_settings(64, Method::Compute));
    assert!(
        still_only(&before) == still_only(&without),
        "a scene without the model"
    );
    for second in 1..=6u16 {
        follower.go_to(f32::from(second));
        let visited = follower.read();
        assert!(
            follower.dynamic.voxel_count > 100 && visited.voxels.hidden_count > 0,
            "{second} s: {} voxels",
            follower.dynamic.voxel_count
        );
        assert!(
            visited.records[..before.records.len()] == before.records[..],
            "{second} s: a static record has changed"
        );
        assert!(visited.occupancy != before.occupancy);
    }
    follower.go_to(7.0);
    let after = follower.read();
    assert!(still_only(&after) == still_only(&before));
    assert_eq!(
        (after.voxels.voxel_count, after.voxels.fragment_count),
        (before.voxels.voxel_count, before.voxels.fragment_count)
    );
}

/// By rasterization too.
#[test]
fn methods_agree_on_dynamic_geometry() {
    let gpu = gpu();
    if raster_methods(&gpu).is_empty() {
        return;
    }
    let mut random = Random::new(21);
    let mut scene = scene_of(&soup(&mut random, 32), 2.0, &mut random);
    let model = scene_of(&centred_soup(&mut random, 32, 50), 2.0, &mut random);
    add_model(
        &mut scene,
        model,
        &[
            still(Vec3::splat(16.0)),
            Pose {
                rotate_deg: Vec3::splat(40.0),
                translate: Vec3::splat(14.0),
            },
        ],
    );
    let mut follower = Follower::new(&gpu, &scene, 32);
    follower.voxelizer = Voxelizer::new(
        &gpu,
        &follower.gpu_scene,
        voxel_settings(32, Method::Raster),
    )
    .unwrap();
    for time_s in [0.3, 1.0] {
        follower.go_to(time_s);
        follower.check(&format!("raster, {time_s} s"));
    }
}

#[test]
fn comparator_notices_planted_errors() {
    let gpu = gpu();
    let mut random = Random::new(5);
    let mut scene = scene_of(&soup(&mut random, 32), 2.0, &mut random);
    let model = scene_of(&centred_soup(&mut random, 32, 30), 2.0, &mut random);
    add_model(&mut scene, model, &[still(Vec3::splat(16.0))]);
    let mut follower = Follower::new(&gpu, &scene, 32);
    let expected = follower.voxelized_at_once();
    let mut planted = follower.read();
    assert_eq!(compare(&planted, &expected), Ok(()));
    let last = planted.records.len() - 1;
    planted.records[last].albedo ^= 1;
    assert!(compare(&planted, &expected).is_err(), "a record");
    let mut planted = follower.read();
    planted.emission[last][0] += 1.0;
    assert!(compare(&planted, &expected).is_err(), "emission");
    let mut planted = follower.read();
    let block = (0..planted.bases.len())
        .find(|block| planted.occupancy[2 * block] != 0)
        .unwrap();
    planted.bases[block] += 1;
    assert!(compare(&planted, &expected).is_err(), "a base");
    let mut planted = follower.read();
    planted.occupancy[9] ^= 1;
    assert!(compare(&planted, &expected).is_err(), "occupancy");
    follower.go_to(0.0);
    assert_eq!(compare(&follower.read(), &expected), Ok(()));
}

/// With feedback, static voxels keep what they have gathered when models move, bit by bit, and the
/// others start from nothing; whether or not buffers grow.
#[test]
fn static_voxels_keep_what_they_gathered() {
    let gpu = gpu();
    for (sides, seed) in [(Sides::One, 31), (Sides::Two, 32)] {
        let mut random = Random::new(seed);
        let mut scene = scene_of(&lump(20, 32), 0.0, &mut random);
        let model = scene_of(&centred_soup(&mut random, 32, 40), 0.0, &mut random);
        let poses = [
            still(Vec3::splat(900.0)),
            still(Vec3::splat(16.0)),
            still(Vec3::splat(17.0)),
            still(Vec3::splat(900.0)),
        ];
        add_model(&mut scene, model, &poses);
        let mut follower = Follower::new(&gpu, &scene, 32);
        let settings = LightSettings {
            bounces: LightBounces::Feedback,
            ..LightSettings::direct(Injection::Voxel, sides)
        };
        let mut light =
            VoxelLight::new(&gpu, &follower.gpu_scene, &follower.voxels, settings).unwrap();
        let static_words =
            2 * sides as usize * follower.dynamic.slots(&follower.voxels).start as usize;
        let mut grown = 0;
        for time_s in [1.0, 2.0, 3.0, 1.0] {
            let irradiance = light.irradiance.as_ref().unwrap();
            let gathered: Vec<u32> = (0..irradiance.size_bytes() / 4)
                .map(|_| 1 + random.below(u32::MAX - 1))
                .collect();
            gpu.upload_buffer(irradiance, bytemuck::cast_slice(&gathered))
                .unwrap();
            follower.go_to(time_s);
            let capacity = light.capacity;
            light
                .follow(
                    &gpu,
                    &follower.gpu_scene,
                    &follower.voxels,
                    follower.dynamic.slots(&follower.voxels).start,
                )
                .unwrap();
            grown += u32::from(light.capacity > capacity);
            let kept = read_words(&gpu, light.irradiance.as_ref().unwrap());
            assert!(
                kept[..static_words] == gathered[..static_words],
                "{sides:?}, {time_s} s: static voxels have changed"
            );
            assert!(
                kept[static_words..].iter().all(|word| *word == 0),
                "{sides:?}, {time_s} s: another voxel's light"
            );
            assert!(kept.len() >= 2 * sides as usize * follower.voxels.voxel_count as usize);
        }
        assert!(
            static_words > 1000 && (1..4).contains(&grown),
            "{static_words} words, the buffer grew {grown} times"
        );
    }
}

/// A scene without dynamic models has no pass and no byte for them.
#[test]
fn static_scenes_pay_nothing() {
    let gpu = gpu();
    let names = [
        "voxel.dynamic_occupancy",
        "voxel.touched",
        "voxel.fragments",
        "voxel.fragment_emission",
        "voxel.heads",
    ];
    let passes = [
        "voxel.restore_blocks",
        "voxel.count_touched",
        "voxel.scan_touched",
        "voxel.index_touched",
        "voxel.continue_lists",
        "voxel_mips.clear_dynamic",
        "svo.copy_occupancy",
        "svo.mark_affected",
        "svo.flag_dynamic",
        "svo.allocate_dynamic",
        "svo.flag_texels",
        "svo.keep_static",
        "scene.set_pose",
    ];
    let svo_names = [
        "svo.dynamic_levels",
        "svo.dynamic_places",
        "svo.originals",
        "svo.remade_texels",
        "svo.affected_tiles",
    ];
    let (_, light) = small_lights()[0];
    for (scene, pays) in [
        (small_room(Surfaces::Emissive, vec![light]), false),
        (moving_room(Surfaces::Emissive, light), true),
    ] {
        // Paths and probes have no voxels.
        // A clipmap voxelizes whatever comes into its windows, static or not, and keeps what it
        // needs for that; an octree with faces is made anew.
        let follows = |case: &&Case| {
            let others = [
                "none",
                "gtao",
                "ray-traced",
                "irradiance-probes",
                "light-field-probes",
                "probe-cascades",
                "prt",
                "clipmap",
                "lpv",
                "lpv-cascaded",
                "lpv-octree",
            ];
            !(others.contains(&case.entry.name) || case.entry.name == "svo" && case.has_faces())
        };
        for case in cases().iter().filter(follows) {
            gpu.take_journal();
            let (mut renderer, _) = Renderer::new(
                &gpu,
                &scene,
                case.entry,
                &case.settings(&[("resolution", "16")]),
                frame(16, 8, 32),
            )
            .unwrap();
            let mut moved = scene.clone();
            moved.set_time(0.4);
            renderer.set_pose(&moved).unwrap();
            renderer.render(&scene.camera).unwrap();
            let ran: Vec<String> = gpu
                .take_journal()
                .into_iter()
                .flat_map(|frame| frame.names)
                .collect();
            let memory: Vec<String> = gpu.memory().into_iter().map(|row| row.0).collect();
            for name in names {
                assert_eq!(
                    memory.iter().any(|row| row.starts_with(name)),
                    pays,
                    "{}: {name}",
                    case.name()
                );
            }
            let (has_volume, has_octree) = (
                case.entry.name == "voxel-mips" && case.settings(&[]).is("gather", "cones"),
                case.entry.name == "svo",
            );
            let has_bricks = case.settings(&[]).is("gather", "cones");
            for name in svo_names {
                assert_eq!(
                    memory.iter().any(|row| row.starts_with(name)),
                    pays && has_octree,
                    "{}: {name}",
                    case.name()
                );
            }
            for pass in passes {
                let pays = pays
                    && (has_volume || pass != "voxel_mips.clear_dynamic")
                    && (has_octree || !pass.starts_with("svo."))
                    && (has_bricks || pass != "svo.keep_static");
                assert_eq!(
                    ran.iter().any(|name| name == pass),
                    pays,
                    "{}: {pass}",
                    case.name()
                );
            }
        }
    }
}
