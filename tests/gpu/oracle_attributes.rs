//! `voxel.resolve` on the device against the CPU oracle: what each voxel's record holds.

use crate::support::compare::{Largest, Worst, larger};
use std::collections::BTreeMap;

use crate::support::scenes::{bundled, in_unit_grid, lump, scene_of, soup};
use crate::support::voxels::{
    Read, area, coordinates, is_concave, is_opposed, mean_normal, oracle_grid, raster_methods,
    seen, unorm10, voxel_settings, voxelize,
};
use crate::support::{Random, gpu};
use glam::{DVec2, DVec3, Vec3};
use lumivox::gi::shared::voxel::build::passes::Voxel;
use lumivox::gi::shared::voxel::oracle::{self, OPPOSED, PARALLEL, VoxelIndex, VoxelSum};
use lumivox::gi::shared::voxel::{Accumulation, Method, VoxelSettings, Voxelizer};
use lumivox::graph::Gpu;
use lumivox::render::GpuScene;
use lumivox::scene::{Material, Scene, Specular, Texture, TextureKind};

/// One attribute: the largest difference, and the largest as a share of what is allowed.
#[derive(Clone, Copy, Default)]
struct Off {
    difference: f64,
    share: f64,
    voxel: VoxelIndex,
}

#[derive(Default)]
struct Comparison {
    worst: BTreeMap<&'static str, Off>,
    voxels: usize,
    only_one: usize,
    /// The voxel that is being compared.
    at: VoxelIndex,
}

impl Comparison {
    fn see(&mut self, name: &'static str, difference: f64, allowed: f64) {
        let worst = self.worst.entry(name).or_default();
        worst.difference = larger(worst.difference, difference);
        if difference / allowed > worst.share || (difference / allowed).is_nan() {
            worst.share = difference / allowed;
            worst.voxel = self.at;
        }
    }

    fn print(&self, what: &str) {
        println!(
            "{what}: {} voxels, {} in one only",
            self.voxels, self.only_one
        );
        self.worst.iter().for_each(|(name, worst)| {
            println!(
                "    {name:14} worst {:.2e}, {:.2} of the tolerance",
                worst.difference, worst.share
            )
        });
    }

    fn verdict(&self) -> Result<(), String> {
        let bad = self
            .worst
            .iter()
            .find(|(_, worst)| worst.share.is_nan() || worst.share > 1.0);
        bad.map_or(Ok(()), |(name, worst)| {
            Err(format!(
                "{name} is off by {}, {} times the tolerance, in {:?}",
                worst.difference, worst.share, worst.voxel
            ))
        })
    }
}

/// A fragment's area is rounded to 1/16384 face, and computed in f32 from coordinates relative to
/// the triangle: so much per fragment (faces).
const AREA_ERROR: f64 = 1.5 / 16384.0;
/// Half a step of 10 bits, twice: in the fragment and in the voxel.
const TEN_BITS: f64 = 1.05 / 1023.0;

/// Records against the oracle's sums. What a fragment's area is wrong by, its attributes weigh
/// wrong by.
fn compare(read: &Read, sums: &BTreeMap<VoxelIndex, VoxelSum>, coverage: bool) -> Comparison {
    let mut comparison = Comparison::default();
    for (index, record) in read.records.iter().enumerate() {
        let Some(sum) = sums.get(&coordinates(record)) else {
            comparison.only_one += 1;
            continue;
        };
        comparison.voxels += 1;
        comparison.at = coordinates(record);
        let area_error = AREA_ERROR * f64::from(sum.fragment_count + 2);
        let weight = (area_error / sum.area).min(1.0);
        comparison.see(
            "area",
            (area(record) - sum.area).abs(),
            area_error + sum.area / 2048.0,
        );
        let is_near_opposed = (sum.opposed - OPPOSED).abs() <= 1e-3 + 2.0 * weight;
        let is_near_parallel = (sum.parallel - PARALLEL).abs() <= 1e-3 + 4.0 * weight;
        let is_opposed_here = sum.opposed_axis.is_some();
        if !(is_near_opposed || is_opposed_here && is_near_parallel) {
            let off = |normal: DVec3| (mean_normal(record) - normal).abs().largest();
            // Of opposed planes either normal is theirs where two axes part them equally well.
            let off = if is_opposed_here {
                off(sum.normal).min(off(-sum.normal))
            } else {
                off(sum.normal)
            };
            comparison.see("normal", off, 1.05 / 1023.0 + 4.0 * weight);
        }
        comparison.see(
            "area across",
            (unorm10(record.across) - sum.across()).abs().largest(),
            TEN_BITS + area_error,
        );
        if !(is_near_opposed || is_opposed_here || is_opposed(record))
            && sum.height.abs() > 2e-3 + 4.0 * weight
        {
            comparison.see(
                "concave",
                f64::from(u8::from(is_concave(record) != sum.is_concave())),
                0.5,
            );
        }
        let root = (unorm10(record.albedo) - sum.albedo.map(f64::sqrt))
            .abs()
            .largest();
        // Error of the mean albedo, seen through its root.
        comparison.see(
            "albedo root",
            root,
            TEN_BITS + (weight / sum.albedo.min_element().sqrt().max(1e-3)).min(weight.sqrt()),
        );
        comparison.see(
            "mean position",
            (unorm10(record.mean_position) - sum.mean_position)
                .abs()
                .largest(),
            TEN_BITS + weight,
        );
        let opacity = if coverage { sum.coverage } else { 1.0 };
        comparison.see(
            "coverage",
            (f64::from(record.coverage & 0xfff) / 4095.0 - opacity).abs(),
            area_error + 2e-4,
        );
        let seen = (seen(record) - DVec2::new(sum.seen_from_one, sum.seen_from_both))
            .abs()
            .largest();
        comparison.see("seen share", seen, 0.5 / 255.0 + 2.0 * weight);
        if !is_near_opposed {
            comparison.see(
                "opposed",
                f64::from(u8::from(is_opposed(record) != sum.opposed_axis.is_some())),
                0.5,
            );
        }
        if let Some(emission) = read.emission.get(index) {
            let emitted = DVec3::new(
                f64::from(emission[0]),
                f64::from(emission[1]),
                f64::from(emission[2]),
            );
            if sum.opposed > OPPOSED + 0.1 || sum.opposed < 0.01 {
                let error =
                    (f64::from(emission[3]) - sum.emission_ahead).abs() * sum.emission.largest();
                comparison.see(
                    "emission ahead",
                    error,
                    1e-5 + 2.0 * weight * largest_emission(sums),
                );
            }
            comparison.see(
                "emission",
                (emitted - sum.emission).abs().largest(),
                1e-5 + weight * largest_emission(sums),
            );
        }
    }
    comparison.only_one += sums.len() - comparison.voxels;
    comparison
}

fn largest_emission(sums: &BTreeMap<VoxelIndex, VoxelSum>) -> f64 {
    sums.values()
        .map(|sum| sum.emission.largest())
        .worst()
        .max(1e-3)
}

fn check(
    gpu: &Gpu,
    scene: &Scene,
    resolution: u32,
    unit_grid: bool,
    coverage: bool,
    what: &str,
) -> Comparison {
    let mut gpu_scene = GpuScene::new(gpu, scene).unwrap();
    if unit_grid {
        in_unit_grid(&mut gpu_scene, resolution);
    }
    let read = voxelize(
        gpu,
        &gpu_scene,
        VoxelSettings {
            coverage,
            ..voxel_settings(resolution, Method::Compute)
        },
    );
    assert_eq!(read.emission.is_empty(), !scene.is_emissive());
    let comparison = compare(
        &read,
        &oracle::voxelize(scene, &oracle_grid(&read.voxels.grid)),
        coverage,
    );
    comparison
        .verdict()
        .unwrap_or_else(|error| panic!("{what}: {error}"));
    comparison
}

#[test]
fn attributes_of_matt_scenes_are_the_oracles() {
    let gpu = gpu();
    for resolution in [8, 64] {
        check(
            &gpu,
            &bundled("cornell"),
            resolution,
            false,
            true,
            "cornell",
        )
        .print(&format!("cornell {resolution}"));
    }
    check(
        &gpu,
        &scene_of(&lump(48, 64), 0.0, &mut Random::new(3)),
        64,
        true,
        true,
        "lump",
    )
    .print("lump 64");
    check(
        &gpu,
        &scene_of(&lump(48, 64), 40.0, &mut Random::new(3)),
        16,
        false,
        false,
        "lump",
    )
    .print("glowing lump 16, binary");
    check(
        &gpu,
        &bundled("cornell-lamp"),
        32,
        false,
        true,
        "cornell-lamp",
    )
    .print("cornell-lamp 32");
}

#[test]
fn attributes_of_soups_are_the_oracles() {
    let gpu = gpu();
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let scene = scene_of(
            &soup(&mut random, 32),
            if seed % 2 == 0 { 7.0 } else { 0.0 },
            &mut random,
        );
        let comparison = check(
            &gpu,
            &scene,
            32,
            true,
            seed % 3 != 0,
            &format!("soup {seed}"),
        );
        if seed == 0 {
            comparison.print("soup 0");
        }
    }
}

/// Textures and masks: the device takes one trilinear sample where the oracle averages a voxel's
/// square, so the means agree and single voxels roughly.
#[test]
fn textured_and_masked_attributes_are_near_the_oracles() {
    let (gpu, scene) = (gpu(), bundled("atrium"));
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let read = voxelize(&gpu, &gpu_scene, voxel_settings(32, Method::Compute));
    let sums = oracle::voxelize(&scene, &oracle_grid(&read.voxels.grid));
    let (mut only_gpu, mut errors, mut means, mut total_area) =
        (0usize, Vec::new(), [DVec3::ZERO; 2], [0.0; 2]);
    for record in &read.records {
        let Some(sum) = sums.get(&coordinates(record)) else {
            only_gpu += 1;
            continue;
        };
        let albedo = unorm10(record.albedo).powf(2.0);
        errors.push((albedo - sum.albedo).abs().largest());
        total_area = [total_area[0] + area(record), total_area[1] + sum.area];
        means = [
            means[0] + area(record) * albedo,
            means[1] + sum.area * sum.albedo,
        ];
    }
    errors.sort_by(f64::total_cmp);
    let only_oracle = sums.len() - errors.len();
    let at = |share: f64| errors[((errors.len() - 1) as f64 * share) as usize];
    let bias = (means[0] / means[1] - 1.0).abs().largest();
    println!(
        "atrium 32: {} voxels, {only_gpu} only here, {only_oracle} only in the oracle",
        read.records.len()
    );
    println!(
        "    albedo: median error {:.4}, 95% below {:.4}, largest {:.3}; area-weighted bias \
         {bias:.4}",
        at(0.5),
        at(0.95),
        at(1.0)
    );
    println!(
        "    area: {:.1} here, {:.1} in the oracle",
        total_area[0], total_area[1]
    );
    assert!(
        only_gpu + only_oracle <= read.records.len() / 50,
        "masks differ in {} voxels",
        only_gpu + only_oracle
    );
    assert!(at(0.5) <= 0.01 && at(0.95) <= 0.05 && bias <= 0.015);
    assert!((total_area[0] / total_area[1] - 1.0).abs() <= 0.01);
}

/// Texels along an edge of a voxel in [`tiled_sheet`], and of a square of one colour in it.
const TEXELS: u32 = 64;
const SQUARE: u32 = 16;

/// A sheet across one axis whose texture, mask and emission are aligned with the voxels: each voxel
/// is 4×4 squares of random colours, so one mip's texel is the mean of a voxel, the next finer ones
/// have other values at its centre, and the next coarser one mixes it with its neighbours. Its
/// material is half metal.
fn tiled_sheet(axis: usize, resolution: u32, random: &mut Random) -> Scene {
    let n = resolution as f32;
    let turned = |a: f32, b: f32| {
        let mut point = Vec3::splat(0.5 * n + 0.5);
        (point[(axis + 1) % 3], point[(axis + 2) % 3]) = (a, b);
        point
    };
    let mut scene = scene_of(
        &[[turned(-n, -n), turned(4.0 * n, -n), turned(-n, 4.0 * n)]],
        0.0,
        random,
    );
    for vertex in &mut scene.vertices {
        (vertex.u, vertex.v) = (
            vertex.position[(axis + 1) % 3] / n,
            vertex.position[(axis + 2) % 3] / n,
        );
    }
    let squares = resolution * TEXELS / SQUARE;
    let mut tiled = |name: &str,
                     kind: TextureKind,
                     square: &mut dyn FnMut(&mut Random, u32, u32) -> [u8; 4]| {
        let colours: Vec<[u8; 4]> = (0..squares * squares)
            .map(|i| square(random, i % squares, i / squares))
            .collect();
        let edge = resolution * TEXELS;
        let texels = (0..edge * edge)
            .map(|i| colours[(i / edge / SQUARE * squares + i % edge / SQUARE) as usize])
            .collect();
        scene.textures.push(
            Texture {
                name: name.into(),
                kind,
                width: edge,
                height: edge,
                texels,
            }
            .into(),
        );
        Some(scene.textures.len() as u32 - 1)
    };
    let any = &mut |random: &mut Random, _, _| [0; 4].map(|_: u8| random.below(256) as u8);
    let albedo_texture = tiled("albedo", TextureKind::Color, any);
    let emission_texture = tiled("emission", TextureKind::Color, any);
    // What is kept of a voxel is 30%, which is no surface, 60%, 80% or all.
    let kept = |x: u32, y: u32| [77, 153, 204, 255][((x / 4 + 3 * (y / 4)) % 4) as usize];
    let mask_texture = tiled("mask", TextureKind::Mask, &mut |_, x, y| [kept(x, y); 4]);
    let specular = Some(Specular {
        f0: Vec3::splat(0.5),
        roughness: 0.5,
        metalness: 0.5,
        texture: None,
    });
    let emission = Vec3::new(1.0, 3.0, 2.0);
    scene.materials[0] = Material {
        albedo: Vec3::splat(0.9),
        emission,
        albedo_texture,
        emission_texture,
        mask_texture,
        specular,
        ..Material::default()
    };
    scene
}

/// One trilinear sample at the right mip is the mean of a voxel's square, where texels and voxels
/// are aligned; 8-bit mips leave 0.6%. What is half covered weighs half, what is less is no
/// surface, and nothing of a metal is diffuse.
#[test]
fn aligned_textures_and_masks_are_the_oracles() {
    let (gpu, resolution) = (gpu(), 8);
    for axis in 0..3 {
        let scene = tiled_sheet(axis, resolution, &mut Random::new(60 + axis as u64));
        let mut gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
        in_unit_grid(&mut gpu_scene, resolution);
        let read = voxelize(
            &gpu,
            &gpu_scene,
            voxel_settings(resolution, Method::Compute),
        );
        let sums = oracle::voxelize(&scene, &oracle_grid(&read.voxels.grid));
        assert_eq!(
            read.occupied(),
            sums.keys().copied().collect(),
            "axis {axis}"
        );
        let [mut areas, mut albedos, mut emissions] = [0.0f64; 3];
        for (record, emission) in read.records.iter().zip(&read.emission) {
            let sum = &sums[&coordinates(record)];
            let emission = DVec3::new(
                f64::from(emission[0]),
                f64::from(emission[1]),
                f64::from(emission[2]),
            );
            areas = larger(areas, (area(record) - sum.area).abs());
            albedos = larger(
                albedos,
                (unorm10(record.albedo) - sum.albedo.map(f64::sqrt))
                    .abs()
                    .largest(),
            );
            emissions = larger(emissions, (emission - sum.emission).abs().largest());
        }
        println!(
            "axis {axis}: {} voxels, worst area {areas:.4}, albedo root {albedos:.4}, emission \
             {emissions:.4}",
            read.records.len()
        );
        assert!(
            read.records.len() == 48 && areas <= 2e-3 && albedos <= 6e-3 && emissions <= 0.018,
            "axis {axis}"
        );
    }
}

/// Textured emission: one trilinear sample a fragment for a voxel's mean.
#[test]
fn textured_emission_is_near_the_oracles() {
    let (gpu, scene) = (gpu(), bundled("emissive-gallery"));
    let read = voxelize(
        &gpu,
        &GpuScene::new(&gpu, &scene).unwrap(),
        voxel_settings(32, Method::Compute),
    );
    let sums = oracle::voxelize(&scene, &oracle_grid(&read.voxels.grid));
    let (mut emitted, mut expected, mut difference) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for (record, emission) in read.records.iter().zip(&read.emission) {
        let sum = &sums[&coordinates(record)];
        let own = DVec3::new(
            f64::from(emission[0]),
            f64::from(emission[1]),
            f64::from(emission[2]),
        );
        emitted += area(record) * own;
        expected += sum.area * sum.emission;
        difference += sum.area * (own - sum.emission).abs().element_sum();
    }
    let (bias, mean_error) = (
        (emitted.element_sum() / expected.element_sum() - 1.0).abs(),
        difference / expected.element_sum(),
    );
    println!(
        "emissive-gallery 32: emitted flux off by {bias:.4}, mean error of a voxel \
         {mean_error:.4} of the mean"
    );
    assert!(bias <= 0.02 && mean_error <= 0.1);
}

#[test]
fn two_runs_are_the_same_bits() {
    let gpu = gpu();
    let mut random = Random::new(21);
    for (name, scene) in [
        ("atrium", bundled("atrium")),
        ("soup", scene_of(&soup(&mut random, 64), 3.0, &mut random)),
    ] {
        let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
        let first = voxelize(&gpu, &gpu_scene, voxel_settings(64, Method::Compute));
        for method in [
            vec![Method::Compute],
            raster_methods(&gpu),
            vec![Method::Compute],
        ]
        .concat()
        {
            let second = voxelize(&gpu, &gpu_scene, voxel_settings(64, method));
            assert!(
                first.records == second.records
                    && first.occupancy == second.occupancy
                    && first.emission == second.emission,
                "{name}, {method:?}"
            );
        }
    }
}

/// The running average rounds to 8 bits after each of n fragments, each rounding weighing k/n: at
/// most (n + 1) / 4 steps of 1/255 from the plain mean.
#[test]
fn running_average_stays_within_its_bits() {
    let gpu = gpu();
    // Off the lattice: a triangle that only touches a voxel would count as much as one that fills
    // it.
    let mut triangles = lump(40, 32);
    triangles
        .iter_mut()
        .flatten()
        .for_each(|corner| *corner += Vec3::new(0.137, 0.291, 0.413));
    let scene = scene_of(&triangles, 0.0, &mut Random::new(8));
    let mut gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    in_unit_grid(&mut gpu_scene, 32);
    let settings = VoxelSettings {
        accumulation: Accumulation::RunningAverage,
        ..voxel_settings(32, Method::Compute)
    };
    let exact = voxelize(&gpu, &gpu_scene, voxel_settings(32, Method::Compute));
    let mut voxelizer = Voxelizer::new(&gpu, &gpu_scene, settings).unwrap();
    let runs: Vec<Read> = (0..4)
        .map(|_| crate::support::voxels::read(&gpu, voxelizer.run(&gpu, &gpu_scene).unwrap().0))
        .collect();
    let mut plain: BTreeMap<VoxelIndex, (DVec3, f64)> = BTreeMap::new();
    for fragment in oracle::fragments(&scene, &oracle_grid(&exact.voxels.grid)) {
        let (sum, count) = plain.entry(fragment.voxel).or_default();
        *sum += fragment.albedo;
        *count += 1.0;
    }
    let albedo = |read: &Read, index: usize| unorm10(read.records[index].albedo).powf(2.0);
    let (mut spread, mut from_exact, mut from_plain, mut share) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
    for index in 0..exact.records.len() {
        let (sum, count) = plain[&coordinates(&exact.records[index])];
        if count > 255.0 {
            // Above that the average forgets.
            continue;
        }
        // Each run's average may be so far from the plain mean; reading it back costs 10 bits of
        // the root, twice.
        let bound = (count + 1.0) / 4.0 / 255.0 + 2.0 * TEN_BITS;
        for run in &runs {
            from_exact = larger(
                from_exact,
                (albedo(run, index) - albedo(&exact, index)).abs().largest(),
            );
            spread = larger(
                spread,
                (albedo(run, index) - albedo(&runs[0], index))
                    .abs()
                    .largest(),
            );
            let off = (albedo(run, index) - sum / count).abs().largest();
            from_plain = larger(from_plain, off);
            share = larger(share, off / bound);
        }
    }
    println!(
        "running average, albedo: between runs {spread:.4}, from the plain mean {from_plain:.4} \
         ({share:.2} of the bound), from exact {from_exact:.3}"
    );
    assert!(share <= 1.0, "{share} of the 8-bit bound");
    assert!(runs.iter().all(|run| run.occupancy == exact.occupancy));
}

#[test]
fn comparators_notice_planted_errors() {
    let gpu = gpu();
    let scene = scene_of(&lump(12, 16), 5.0, &mut Random::new(2));
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let mut read = voxelize(&gpu, &gpu_scene, voxel_settings(16, Method::Compute));
    let sums = oracle::voxelize(&scene, &oracle_grid(&read.voxels.grid));
    assert_eq!(compare(&read, &sums, true).verdict(), Ok(()));
    let good = read.records.clone();
    let index = good.iter().position(|record| area(record) > 0.5).unwrap();
    type Plant = fn(&mut Voxel);
    let plants: [(&str, Plant); 8] = [
        ("area", |record| record.z_area += 4 << 16),
        ("normal", |record| {
            record.normal = record.normal & !1023 | (record.normal + 4) & 1023
        }),
        ("albedo root", |record| {
            record.albedo = record.albedo & !1023 | (record.albedo ^ 4) & 1023
        }),
        ("mean position", |record| record.mean_position ^= 4 << 20),
        ("coverage", |record| {
            record.coverage = record.coverage & !0xfff | record.coverage.wrapping_sub(20) & 0xfff
        }),
        ("seen share", |record| record.coverage ^= 16 << 12),
        ("area across", |record| record.across ^= 16),
        ("opposed", |record| record.coverage ^= 1 << 29),
    ];
    for (name, plant) in plants {
        read.records.clone_from(&good);
        plant(&mut read.records[index]);
        let error = compare(&read, &sums, true).verdict().expect_err(name);
        assert!(error.starts_with(name), "{name}: {error}");
    }
    read.records = good;
    let unplanted = read.emission.clone();
    read.emission[index][2] += 0.01;
    assert!(
        compare(&read, &sums, true)
            .verdict()
            .expect_err("emission")
            .starts_with("emission is")
    );
    read.emission = unplanted;
    // Only bright voxels count whose sides can be told apart for certain.
    let is_certain = |sum: &VoxelSum| {
        sum.area > 0.5
            && sum.opposed < 0.01
            && sum.emission.largest() > 0.5 * largest_emission(&sums)
    };
    let index = read
        .records
        .iter()
        .position(|record| is_certain(&sums[&coordinates(record)]))
        .unwrap();
    read.emission[index][3] = 1.0 - read.emission[index][3].round();
    assert!(
        compare(&read, &sums, true)
            .verdict()
            .expect_err("emission ahead")
            .starts_with("emission ahead")
    );
}
