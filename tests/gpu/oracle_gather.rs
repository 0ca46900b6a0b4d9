//! `voxel_mips.filter` and `cone.gather` on the device against the CPU oracles.

use crate::support::compare::{Largest, Worst, larger};
use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::sync::Arc;

use crate::support::gather::{
    View, by_oracle_with, cones_by_oracle, errors, filter, groups_of, matter, occupied,
    random_volume, read_chain, samples_by_oracle, verdict, volume,
};
use crate::support::octree::{grow_lit, lit_matter, read_nodes, read_texels};
use crate::support::scenes::bundled;
use crate::support::{Random, gpu};
use glam::{DVec3, DVec4, Vec3};
use lumivox::gi::Settings;
use lumivox::gi::registry::find;
use lumivox::gi::shared::cone::oracle::{Levels, Volume};
use lumivox::gi::shared::cone::{ConeTracer, cone_set, diffuse_set};
use lumivox::gi::shared::voxel::oracle::{VoxelIndex, hemisphere_direction};
use lumivox::gi::shared::voxel::{Directionality, NormalLobe, Prefilter, VoxelGrid};
use lumivox::gi::voxel_cones::mips;
use lumivox::gi::voxel_cones::mips::filter_mips;
use lumivox::gi::voxel_cones::mips::oracle::{Filter, coarser, sees_matter};
use lumivox::gi::voxel_cones::svo::BrickSettings;
use lumivox::gi::voxel_cones::svo::oracle::Texels;
use lumivox::graph::{Frame, Gpu, Image};
use lumivox::render::GpuScene;
use lumivox::scene::Scene;

const SIZE: [u32; 2] = [32, 24];

/// Largest difference of a level from the oracle's filter of the level above it, in steps of half
/// floats (2⁻¹¹ of the value, at least 2⁻¹⁴).
fn filter_error(chain: &[Volume], by: Filter) -> f64 {
    let error = |levels: &[Volume]| {
        let expected = coarser(&levels[0], by);
        let steps = |(seen, expected): (&DVec4, &DVec4)| {
            ((*seen - *expected).abs() / (expected.abs() * 2f64.powi(-11) + 2f64.powi(-25)))
                .largest()
        };
        levels[1]
            .texels
            .iter()
            .zip(&expected.texels)
            .map(steps)
            .worst()
    };
    chain.windows(2).map(error).worst()
}

#[test]
fn mips_are_the_oracles() {
    let gpu = gpu();
    for (resolution, filled) in [(8, 1.0), (32, 0.1), (64, 0.3), (64, 0.0005)] {
        let finest = random_volume(resolution, filled, &mut Random::new(u64::from(resolution)));
        let chains = [0, 1].map(|constant| {
            let image = volume(&gpu, &finest);
            let mut frame = Frame::new();
            filter(&gpu, &mut frame, &image, constant);
            gpu.submit(frame).unwrap();
            read_chain(&gpu, &image)
        });
        // Where there is no matter nothing is made.
        let (image, matter) = (
            volume(&gpu, &finest),
            matter(&gpu, &occupied(&finest), resolution),
        );
        let mut frame = Frame::new();
        frame.clear_mips("test.clear", &image, 1..image.mips(), [0.0; 4]);
        let groups = groups_of(&gpu, &matter, 1);
        filter_mips(&mut frame, &image, None, Prefilter::Directional, &groups);
        gpu.submit(frame).unwrap();
        let sparse = read_chain(&gpu, &image);
        let is_same = |(a, b): (&Volume, &Volume)| a.texels == b.texels;
        assert!(
            sparse.iter().zip(&chains[1]).all(is_same),
            "{resolution}³: a group is missing"
        );
        let image = volume(&gpu, &finest);
        let mut frame = Frame::new();
        frame.blit_mips("blit", &image);
        gpu.submit(frame).unwrap();
        let blit = read_chain(&gpu, &image);
        let errors = [
            filter_error(&chains[0], Filter::Box),
            filter_error(&chains[1], Filter::Directional),
            filter_error(&blit, Filter::Box),
        ];
        println!(
            "mips of {resolution}³: half-float steps off the oracle: box {:.2}, directional \
             {:.2}, blit {:.2}",
            errors[0], errors[1], errors[2]
        );
        // One step is what rounding to nearest gives, two what truncation gives.
        assert!(errors.iter().all(|error| *error <= 2.1), "{errors:?}");
        let apart = |(a, b): (&DVec4, &DVec4)| (*a - *b).abs().largest() / (a.largest() + 1e-3);
        let apart = chains[0]
            .iter()
            .zip(&blit)
            .flat_map(|(a, b)| a.texels.iter().zip(&b.texels).map(apart))
            .worst();
        println!("    compute and blit differ by {apart:.1e} of the value");
        assert!(apart <= 4e-3, "compute and blit differ by {apart}");
    }
}

fn settings(pairs: &[String]) -> Settings {
    find("voxel-mips")
        .unwrap()
        .settings(Some("textbook"), pairs)
        .unwrap()
}

/// The scene seen from its camera, with a grid around it.
fn cornell(gpu: &Gpu, environment: Vec3, resolution: u32) -> (Scene, GpuScene, VoxelGrid, View) {
    let mut scene = bundled("cornell");
    scene.environment = environment.into();
    let gpu_scene = GpuScene::new(gpu, &scene).unwrap();
    let grid = VoxelGrid::around(gpu_scene.bounds, resolution);
    let view = View::new(gpu, &gpu_scene, &scene.camera, SIZE, &grid);
    assert!(
        view.receivers.len() as u32 == SIZE[0] * SIZE[1],
        "the box is closed"
    );
    (scene, gpu_scene, grid, view)
}

/// The device's answer at each receiver, with empty space skipped or not.
fn gather_cones(
    gpu: &Gpu,
    scene: &GpuScene,
    grid: &VoxelGrid,
    view: &View,
    volume: [&Arc<Image>; 2],
    settings: &Settings,
    skips_empty: bool,
) -> Vec<DVec4> {
    let [radiance, matter] = volume;
    let mut tracer = ConeTracer::new(gpu, settings).unwrap();
    tracer.skips_empty = skips_empty;
    let mut frame = Frame::new();
    frame.set_scene(&scene.set, &scene.materials);
    let volume = mips::volume(*grid, radiance, matter, None);
    tracer.gather(&mut frame, &view.all(scene), volume);
    gpu.submit(frame).unwrap();
    view.results(gpu)
}

/// The same, bit for bit, whether empty space is skipped or not.
fn cones_on_gpu(
    gpu: &Gpu,
    scene: &GpuScene,
    grid: &VoxelGrid,
    view: &View,
    volume: [&Arc<Image>; 2],
    settings: &Settings,
) -> Vec<DVec4> {
    let all = gather_cones(gpu, scene, grid, view, volume, settings, false);
    assert!(
        gather_cones(gpu, scene, grid, view, volume, settings, true) == all,
        "skipping empty space changes the picture"
    );
    all
}

/// What is wrong with a matter pyramid, if anything: every bit of every mip is the oracle's.
fn compare_matter(
    words: &[u32],
    occupied: &BTreeSet<VoxelIndex>,
    resolution: u32,
) -> Result<(), String> {
    let row = (resolution / 4) as usize;
    for mip in 0..=resolution.ilog2() {
        let size = resolution >> mip;
        for index in 0..size.pow(3) {
            let stencil @ [x, y, z] = [index % size, index / size % size, index / (size * size)];
            let word = words[(x / 4) as usize
                + row * ((y / 4) as usize + row * (z / 2 + resolution - size) as usize)];
            let seen = word >> (x % 4 + 4 * (y % 4) + 16 * (z % 2)) & 1 == 1;
            let expected = sees_matter(occupied, resolution, stencil, mip);
            if seen != expected {
                return Err(format!("stencil {stencil:?} of mip {mip} is {seen}"));
            }
        }
    }
    Ok(())
}

#[test]
fn matter_pyramid_is_the_oracles() {
    let gpu = gpu();
    for seed in 0..12u64 {
        let resolution = [8, 16, 32, 64][seed as usize % 4];
        let mut random = Random::new(700 + seed);
        // None, one, a few anywhere up to the border of the grid.
        let count = [0, 1, 3, 40][seed as usize / 4 + (seed as usize & 1)];
        let occupied: BTreeSet<VoxelIndex> = (0..count)
            .map(|_| [0; 3].map(|_: u32| random.below(resolution)))
            .collect();
        let mut words: Vec<u32> = bytemuck::pod_collect_to_vec(
            &gpu.read_image(&matter(&gpu, &occupied, resolution), 0, 0)
                .unwrap(),
        );
        compare_matter(&words, &occupied, resolution)
            .unwrap_or_else(|error| panic!("seed {seed}, {occupied:?}: {error}"));
        words[random.below(resolution * resolution / 16 * resolution / 2) as usize] ^=
            1 << random.below(32);
        assert!(
            compare_matter(&words, &occupied, resolution).is_err(),
            "a flipped bit goes unnoticed"
        );
    }
}

/// Samples that the device counts are those that the oracle takes, but for cones that end within
/// rounding of another sample.
#[test]
fn counted_samples_are_the_oracles() {
    let gpu = gpu();
    let (scene, gpu_scene, grid, view) = cornell(&gpu, Vec3::ZERO, 32);
    for (seed, pairs) in [
        ["cones=6", "aperture_scale=1"],
        ["cones=16", "aperture_scale=0.1"],
    ]
    .into_iter()
    .enumerate()
    {
        let finest = random_volume(32, 0.05, &mut Random::new(60 + seed as u64));
        let image = volume(&gpu, &finest);
        let mut frame = Frame::new();
        filter(&gpu, &mut frame, &image, 1);
        gpu.submit(frame).unwrap();
        let matter = matter(&gpu, &occupied(&finest), 32);
        let settings = settings(&pairs.map(str::to_owned));
        let cones = mips::volume(grid, &image, &matter, None);
        let counted = ConeTracer::new(&gpu, &settings)
            .unwrap()
            .count_samples(&gpu, &gpu_scene, &view.gbuffer, cones, [true, false])
            .unwrap();
        let chain = read_chain(&gpu, &image);
        let expected: u64 = samples_by_oracle(&chain, &scene, &grid, &view, &settings);
        println!("{pairs:?}: {counted:?} samples, {expected} by the oracle");
        let [("cone.gather", samples)] = counted[..] else {
            panic!("{counted:?}")
        };
        assert!(
            (samples as f64 / expected as f64 - 1.0).abs() < 0.002,
            "{samples} samples, {expected} by the oracle"
        );
        // Where the pyramid has nothing, cones see nothing: it is this pyramid that they skip by.
        let nothing = crate::support::gather::matter(&gpu, &BTreeSet::new(), 32);
        let seen = gather_cones(
            &gpu,
            &gpu_scene,
            &grid,
            &view,
            [&image, &nothing],
            &settings,
            true,
        );
        assert!(
            seen != gather_cones(
                &gpu,
                &gpu_scene,
                &grid,
                &view,
                [&image, &matter],
                &settings,
                true
            )
        );
    }
}

#[test]
fn cones_are_the_oracles() {
    let gpu = gpu();
    let (scene, gpu_scene, grid, view) = cornell(&gpu, Vec3::new(0.7, 0.5, 0.3), 32);
    for seed in 0..12 {
        let mut random = Random::new(300 + seed);
        let finest = random_volume(32, [0.02, 0.1, 0.4][seed as usize % 3], &mut random);
        let (image, matter) = (volume(&gpu, &finest), matter(&gpu, &occupied(&finest), 32));
        let mut frame = Frame::new();
        filter(&gpu, &mut frame, &image, random.below(2));
        gpu.submit(frame).unwrap();
        let mut pairs: Vec<String> = Vec::new();
        let mut set = |name: &str, value: String| pairs.push(format!("{name}={value}"));
        set(
            "cones",
            [1, 5, 6, 9, 16, 25, 32][seed as usize % 7].to_string(),
        );
        set(
            "cone_set",
            ["papers", "disc", "kahl"][random.below(3) as usize].to_owned(),
        );
        set(
            "kahl_side",
            ["on", "off"][random.below(2) as usize].to_owned(),
        );
        set("aperture_scale", (0.1 + random.unit()).to_string());
        set("step_factor", (0.25 + 1.25 * random.unit()).to_string());
        set("opacity_exponent", (0.5 + 3.0 * random.unit()).to_string());
        set(
            "height_clamp",
            if random.below(2) == 0 {
                "0".to_owned()
            } else {
                (1.0 + 6.0 * random.unit()).to_string()
            },
        );
        set("start_offset", (0.5 + 2.0 * random.unit()).to_string());
        set(
            "max_distance",
            if random.below(2) == 0 {
                "0".to_owned()
            } else {
                (0.3 + random.unit()).to_string()
            },
        );
        set(
            "interleave",
            [1, 2, 4, 8][random.below(4) as usize].to_string(),
        );
        set("ao_falloff", (4.0 * random.unit()).to_string());
        let settings = settings(&pairs);
        let seen = cones_on_gpu(&gpu, &gpu_scene, &grid, &view, [&image, &matter], &settings);
        let expected = cones_by_oracle(&read_chain(&gpu, &image), &scene, &grid, &view, &settings);
        let result = errors(&seen, &expected);
        let (relative, visibility) = &result;
        let at = |share: f64| relative[((relative.len() - 1) as f64 * share) as usize];
        println!(
            "cones {seed}: relative error median {:.1e}, 99% {:.1e}, worst {:.1e}; visibility \
             {visibility:.1e}",
            at(0.5),
            at(0.99),
            at(1.0)
        );
        verdict(&result).unwrap_or_else(|error| panic!("cones {seed}, {pairs:?}: {error}"));
    }
}

/// Through an octree, with and without normals. Its descent is exact, so that it samples what a
/// dense volume of the same texels would.
#[test]
fn cones_through_bricks_are_the_oracles() {
    let gpu = gpu();
    let (scene, gpu_scene, grid, view) = cornell(&gpu, Vec3::new(0.7, 0.5, 0.3), 32);
    let bricks = BrickSettings {
        corners: false,
        filter: 1,
        is_split: false,
        touched: false,
        directionality: Directionality::Isotropic,
        lobe: Some(NormalLobe::Toksvig),
    };
    for seed in 0..4 {
        let pairs = [
            ["cones=6", "aperture_scale=1"],
            ["cones=16", "aperture_scale=0.15"],
        ][seed as usize % 2]
            .map(str::to_owned);
        let settings = settings(&pairs);
        let (nodes, pool) = grow_lit(
            &gpu,
            &lit_matter(&mut Random::new(500 + seed), 32),
            32,
            bricks,
        );
        let tree = read_nodes(&gpu, &nodes).unwrap();
        let volumes = |image: &Arc<Image>| -> Vec<Volume> {
            let level = |(level, texels): (u32, Texels)| {
                Volume::new(32 >> level, |at| {
                    texels.get(&at).copied().unwrap_or_default()
                })
            };
            (0..)
                .zip(read_texels(&gpu, &tree, image).unwrap())
                .map(level)
                .collect()
        };
        let (light, normals) = (volumes(&pool.image), volumes(pool.normals().unwrap()));
        let seen = |has_normals: bool| {
            let mut frame = Frame::new();
            frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
            let volume = if has_normals {
                pool.volume(grid, &nodes)
            } else {
                pool.volume_of(grid, &nodes, &pool.image)
            };
            let tracer = ConeTracer::new(&gpu, &settings).unwrap();
            tracer.gather(&mut frame, &view.all(&gpu_scene), volume);
            gpu.submit(frame).unwrap();
            view.results(&gpu)
        };
        let expected = |normals| {
            cones_by_oracle(
                Levels {
                    light: &light,
                    normals,
                    ..Levels::default()
                },
                &scene,
                &grid,
                &view,
                &settings,
            )
        };
        let (with, without) = (
            errors(&seen(true), &expected(&normals)),
            errors(&seen(false), &expected(&[])),
        );
        let planted = errors(&seen(true), &expected(&[]));
        println!(
            "bricks {seed}: worst error {:.1e} with normals, {:.1e} without",
            with.0.last().unwrap(),
            without.0.last().unwrap()
        );
        verdict(&without).unwrap_or_else(|error| panic!("bricks {seed}: {error}"));
        verdict(&with).unwrap_or_else(|error| panic!("bricks {seed}, normals: {error}"));
        assert!(
            verdict(&planted).is_err(),
            "bricks {seed}: normals change nothing"
        );
    }
}

/// Visibility by separate cones replaces the gather's visibility, and leaves the irradiance as it
/// is, bit by bit.
#[test]
fn occlusion_cones_are_the_oracles() {
    let gpu = gpu();
    let (scene, gpu_scene, grid, view) = cornell(&gpu, Vec3::new(0.7, 0.5, 0.3), 32);
    for (seed, pairs) in [
        [
            "occlusion_cones=3",
            "occlusion_distance=0.4",
            "occlusion_falloff=2",
            "aperture_scale=1",
        ],
        [
            "occlusion_cones=24",
            "occlusion_distance=0",
            "occlusion_falloff=0",
            "aperture_scale=0.2",
        ],
    ]
    .into_iter()
    .enumerate()
    {
        let finest = random_volume(32, 0.05, &mut Random::new(80 + seed as u64));
        let (image, matter) = (volume(&gpu, &finest), matter(&gpu, &occupied(&finest), 32));
        let pairs: Vec<String> = pairs
            .iter()
            .copied()
            .chain(["interleave=4"])
            .map(str::to_owned)
            .collect();
        let settings = settings(&pairs);
        let tracer = ConeTracer::new(&gpu, &settings).unwrap();
        let cones = mips::volume(grid, &image, &matter, None);
        let mut frame = Frame::new();
        frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
        filter(&gpu, &mut frame, &image, 1);
        tracer.gather(&mut frame, &view.all(&gpu_scene), cones);
        gpu.submit(frame).unwrap();
        let gathered = view.results(&gpu);
        let mut frame = Frame::new();
        frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
        tracer.occlusion(&mut frame, &view.all(&gpu_scene), cones);
        gpu.submit(frame).unwrap();
        let seen = view.results(&gpu);
        assert!(
            seen.iter()
                .zip(&gathered)
                .all(|(seen, gathered)| seen.truncate() == gathered.truncate()),
            "{pairs:?}: the irradiance has changed"
        );
        let set = cone_set(
            settings.count("occlusion_cones"),
            true,
            settings.number("aperture_scale"),
        );
        let expected = by_oracle_with(
            read_chain(&gpu, &image).as_slice().into(),
            &scene,
            &grid,
            &view,
            &settings,
            &set,
            ["occlusion_distance", "occlusion_falloff"],
        );
        let expected: Vec<DVec4> = gathered
            .iter()
            .zip(expected)
            .map(|(gathered, (own, _))| gathered.truncate().extend(own.visibility))
            .collect();
        let result = errors(&seen, &expected);
        println!(
            "occlusion {pairs:?}: visibility off by at most {:.1e}",
            result.1
        );
        verdict(&result).unwrap_or_else(|error| panic!("{pairs:?}: {error}"));
        assert!(
            verdict(&errors(&gathered, &expected)).is_err(),
            "{pairs:?}: the gather's own visibility goes unnoticed"
        );
    }
}

#[test]
fn every_cone_set_sees_a_uniform_environment() {
    let gpu = gpu();
    let environment = Vec3::new(1.0, 2.0, 3.0);
    let (_, gpu_scene, grid, view) = cornell(&gpu, environment, 32);
    let (image, matter) = (
        volume(&gpu, &Volume::new(32, |_| DVec4::ZERO)),
        matter(&gpu, &BTreeSet::new(), 32),
    );
    let mut frame = Frame::new();
    filter(&gpu, &mut frame, &image, 0);
    gpu.submit(frame).unwrap();
    let counted = [1, 4, 5, 6, 9, 16, 25, 32]
        .into_iter()
        .flat_map(|count| ["papers", "disc"].map(|set| format!("cone_set={set} cones={count}")));
    let word = |rings: u32, ring: u32| if rings >> ring & 1 == 1 { "on" } else { "off" };
    let rings = |rings| {
        format!(
            "cone_set=kahl kahl_front={} kahl_intermediate={} kahl_side={}",
            word(rings, 0),
            word(rings, 1),
            word(rings, 2)
        )
    };
    let mut worst = 0.0f64;
    for set in counted.chain((1..8).map(rings)) {
        let pairs: Vec<String> = set
            .split(' ')
            .chain(["interleave=4", "aperture_scale=1"])
            .map(str::to_owned)
            .collect();
        let settings = settings(&pairs);
        let weights: f64 = diffuse_set(&settings)
            .cones
            .iter()
            .map(|cone| f64::from(cone.weight))
            .sum();
        assert!(
            (weights - 1.0).abs() < 1e-6,
            "{set}: weights sum to {weights}"
        );
        for result in cones_on_gpu(&gpu, &gpu_scene, &grid, &view, [&image, &matter], &settings) {
            let error = (result.truncate() / (PI * environment.as_dvec3()) - 1.0)
                .abs()
                .largest();
            worst = larger(worst, error);
            assert!(
                error <= 0.005 && (result.w - 1.0).abs() < 1e-5,
                "{set}: {result}"
            );
        }
    }
    println!("uniform environment: E = π L to {worst:.1e} with every set");
}

/// Each of Kahl's cones counts as much as it covers of the cosine-weighted hemisphere, which
/// 400,000 directions tell.
#[test]
fn weights_of_kahls_cones_are_what_they_cover() {
    let settings = settings(&[
        "cone_set=kahl".to_owned(),
        "kahl_side=on".to_owned(),
        "aperture_scale=1".to_owned(),
    ]);
    let set = diffuse_set(&settings).cones;
    assert_eq!(set.len(), 9);
    let cos_half = (0.5f64 * 0.55).cos();
    let axis = |cone: &lumivox::gi::shared::cone::Cone| {
        hemisphere_direction(
            DVec3::Z,
            f64::from(cone.sin2_theta),
            f64::from(cone.phi_rad),
        )
    };
    let axes: Vec<DVec3> = set.iter().map(axis).collect();
    for (i, j, expected) in [
        (0, 1, 45.0),
        (1, 2, 60.0),
        (1, 5, 45.0),
        (0, 5, 90.0),
        (5, 6, 90.0),
    ] {
        assert!(
            (axes[i].dot(axes[j]).clamp(-1.0, 1.0).acos().to_degrees() - expected).abs() < 0.05,
            "{i} and {j} are not {expected}° apart"
        );
    }
    let n = 400_000;
    let mut covered = [0.0f64; 9];
    for i in 0..n {
        let direction = hemisphere_direction(
            DVec3::Z,
            (f64::from(i) + 0.5) / f64::from(n),
            f64::from(i) * PI * (3.0 - 5f64.sqrt()),
        );
        axes.iter()
            .zip(&mut covered)
            .filter(|(axis, _)| axis.dot(direction) >= cos_half)
            .for_each(|(_, covered)| *covered += 1.0);
    }
    let total: f64 = covered.iter().sum();
    println!(
        "Kahl's nine cones cover {:.4} of the cosine-weighted hemisphere",
        total / f64::from(n)
    );
    for (cone, covered) in set.iter().zip(covered) {
        assert!(
            (f64::from(cone.weight) - covered / total).abs() < 3e-4,
            "{cone:?} covers {}",
            covered / total
        );
    }
}

#[test]
fn a_set_without_cones_is_refused() {
    for technique in ["voxel-mips", "svo"] {
        let rings = ["cone_set=kahl", "kahl_front=off", "kahl_intermediate=off"];
        let error = find(technique)
            .unwrap()
            .settings(Some("textbook"), &rings)
            .unwrap_err();
        assert!(error.to_string().contains("kahl_front"), "{error}");
    }
}

#[test]
fn comparators_notice_planted_errors() {
    let gpu = gpu();
    let finest = random_volume(16, 0.3, &mut Random::new(1));
    let image = volume(&gpu, &finest);
    let mut frame = Frame::new();
    filter(&gpu, &mut frame, &image, 1);
    gpu.submit(frame).unwrap();
    let mut chain = read_chain(&gpu, &image);
    assert!(
        filter_error(&chain, Filter::Directional) < 2.1 && filter_error(&chain, Filter::Box) > 10.0
    );
    for channel in 0..4 {
        let mut wrong = read_chain(&gpu, &image);
        wrong[1].texels[7][channel] = f64::NAN;
        assert!(filter_error(&wrong, Filter::Directional).is_nan());
    }
    chain[2].texels[5] *= 1.01;
    assert!(filter_error(&chain, Filter::Directional) > 4.0);
    // One pixel of many, by 2%; visibility alone.
    let expected = vec![DVec4::ONE; 100];
    let mut seen = expected.clone();
    assert_eq!(verdict(&errors(&seen, &expected)), Ok(()));
    seen[17].y = 1.02;
    assert!(verdict(&errors(&seen, &expected)).is_err());
    seen[17] = DVec4::new(1.0, 1.0, 1.0, 0.98);
    assert!(verdict(&errors(&seen, &expected)).is_err());
    seen[17].x = f64::NAN;
    assert!(verdict(&errors(&seen, &expected)).is_err());
}
