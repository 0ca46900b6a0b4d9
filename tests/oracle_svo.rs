//! The sparse voxel octree on the device against the CPU oracle: every node, every pointer, every texel.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod support;

use std::collections::BTreeSet;

use glam::DVec4;
use lumivox::gi::registry::find;
use lumivox::gi::svo::bricks::pool_extent;
use lumivox::gi::svo::oracle::{Filter, Lattice, Octree, Texels, coarser, leaves, octree};
use lumivox::gi::svo::{BrickSettings, NodePool, Occupancy, PieceVoxelizer};
use lumivox::gi::voxel::oracle::VoxelIndex;
use lumivox::gi::voxel::{Injection, LightSettings, Method, Sides};
use lumivox::graph::{Frame, Gpu};
use lumivox::metrics::{Channel, compare as compare_images};
use lumivox::render::{GpuScene, LightMaps};
use lumivox::scene::Scene;
use support::octree::{grow, lattice, matter, plant, read_bricks, read_nodes};
use support::scenes::{bundled, in_unit_grid, scene_of, soup};
use support::technique::{Case, frame, shared_scene, shoot};
use support::voxels::{half, voxel_settings, voxelize};
use support::{Random, gpu, read_words};

/// What is wrong with an octree, if anything: every node and pointer is the oracle's, and the leaf nodes are the occupied voxels.
fn compare(tree: &Octree, voxels: &BTreeSet<VoxelIndex>, resolution: u32, lattice: Lattice) -> Result<(), String> {
    let expected = octree(voxels, resolution, lattice);
    if tree.counts != expected.counts {
        return Err(format!("{:?} tiles, {:?} expected", tree.counts, expected.counts));
    }
    if let Some(index) = (0..expected.tiles.len()).find(|index| tree.tiles[*index] != expected.tiles[*index]) {
        return Err(format!("tile {index} is {:?}, {:?} expected", tree.tiles[index], expected.tiles[index]));
    }
    let is_reached = reached_tiles(tree) == tree.tiles.len();
    let leaves = &tree.tiles[tree.tiles.len() - tree.counts[0] as usize..];
    let place = |tile: &[u32; 3], node: usize| [2 * tile[0] + (node as u32 & 1), 2 * tile[1] + (node as u32 >> 1 & 1), 2 * tile[2] + (node as u32 >> 2)];
    let found: BTreeSet<VoxelIndex> =
        leaves.iter().flat_map(|tile| (0..8).filter(|node| tile.nodes[*node].is_some()).map(|node| place(&tile.position, node))).collect();
    if found != *voxels {
        return Err("the leaf nodes are not the occupied voxels".to_owned());
    }
    is_reached.then_some(()).ok_or_else(|| "a tile has no parent, or two".to_owned())
}

/// Tiles that the root leads to, counted once for each way.
fn reached_tiles(tree: &Octree) -> usize {
    let inner = tree.tiles.len() - tree.counts[0] as usize;
    1 + tree.tiles[..inner].iter().flat_map(|tile| tile.nodes).flatten().count()
}

fn check_scene(gpu: &Gpu, scene: &GpuScene, resolution: u32, what: &str) {
    let read = voxelize(gpu, scene, voxel_settings(resolution, Method::Compute));
    let occupied = read.occupied();
    for (corners, lattice) in [(false, Lattice::Centres), (true, Lattice::Corners)] {
        let (pool, _) = NodePool::build(gpu, &Occupancy::from(&read.voxels), corners).unwrap();
        let tree = read_nodes(gpu, &pool).unwrap();
        compare(&tree, &occupied, resolution, lattice).unwrap_or_else(|error| panic!("{what} at {resolution}, {lattice:?}: {error}"));
        println!("{what} at {resolution}, {lattice:?}: {} voxels, {} tiles", occupied.len(), tree.tiles.len());
    }
}

#[test]
fn cornell_is_the_oracles_at_all_levels() {
    let gpu = gpu();
    let scene = GpuScene::new(&gpu, &bundled("cornell")).unwrap();
    [8, 16, 32, 64, 128].into_iter().for_each(|resolution| check_scene(&gpu, &scene, resolution, "cornell"));
}

#[test]
fn sponza_is_the_oracles() {
    let Some(scene) = shared_scene("sponza_dabrovic.toml") else { return };
    let gpu = gpu();
    check_scene(&gpu, &GpuScene::new(&gpu, &scene).unwrap(), 128, "sponza");
}

/// The same by triangles: fragments, voxels, octree.
#[test]
fn soups_are_the_oracles() {
    let gpu = gpu();
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let triangles = soup(&mut random, 32);
        let mut scene = GpuScene::new(&gpu, &scene_of(&triangles, 0.0, &mut random)).unwrap();
        in_unit_grid(&mut scene, 32);
        check_scene(&gpu, &scene, 32, &format!("soup {seed}"));
    }
    check_scene(&gpu, &GpuScene::new(&gpu, &Scene::default()).unwrap(), 32, "nothing");
}

/// 100 random sets of voxels, up to the very border of the grid, 20 at each of the levels 5 to 9.
#[test]
fn random_voxels_are_the_oracles() {
    let gpu = gpu();
    for seed in 0..100u64 {
        let resolution = 32 << (seed % 5);
        let mut random = Random::new(900 + seed);
        let voxels: BTreeSet<VoxelIndex> = matter(&mut random, resolution).into_keys().collect();
        let planted = plant(&gpu, &voxels, resolution);
        for (corners, lattice) in [(false, Lattice::Centres), (true, Lattice::Corners)] {
            let (pool, _) = NodePool::build(&gpu, &planted, corners).unwrap();
            let tree = read_nodes(&gpu, &pool).unwrap();
            compare(&tree, &voxels, resolution, lattice).unwrap_or_else(|error| panic!("set {seed} at {resolution}, {lattice:?}: {error}"));
        }
    }
}

const FILTERS: [Filter; 3] = [Filter::Box, Filter::Directional, Filter::DirectionalMax];

/// Largest difference of a level from what the oracle makes of the level below, in steps of half floats (2⁻¹⁰ of the value, at least 2⁻¹³).
fn level_error(level: &Texels, expected: &Texels) -> f64 {
    let missing = expected.iter().filter(|(at, value)| value.w > 0.0 && !level.contains_key(*at)).count();
    assert_eq!(missing, 0, "texels without a brick");
    let error = |(at, value): (&VoxelIndex, &DVec4)| {
        let expected = expected.get(at).copied().unwrap_or_default();
        let step = expected.abs().max(DVec4::splat(0.125)) / 1024.0;
        ((*value - expected).abs() / step).max_element()
    };
    level.iter().map(error).fold(0.0, f64::max)
}

/// Rounding to half floats, which a driver may do towards zero: once when a texel is stored, and once for each of the three axes along which shares are added.
fn allowed(lattice: Lattice) -> f64 {
    if lattice == Lattice::Centres { 1.0 } else { 4.0 }
}

#[test]
fn bricks_are_the_oracles() {
    let gpu = gpu();
    for seed in 0..24u64 {
        let resolution = [8, 16, 32, 64][seed as usize % 4];
        let settings = BrickSettings { corners: seed % 2 == 1, filter: seed as u32 / 2 % 3, is_split: seed / 3 % 2 == 1 };
        let (lattice, filter) = (lattice(settings), FILTERS[settings.filter as usize]);
        let voxels = matter(&mut Random::new(40 + seed), resolution);
        let (nodes, pool) = grow(&gpu, &voxels, resolution, settings);
        let tree = read_nodes(&gpu, &nodes).unwrap();
        let levels = read_bricks(&gpu, &tree, &pool).unwrap_or_else(|error| panic!("matter {seed}, {settings:?}: {error}"));
        let errors: Vec<f64> = (0..levels.len())
            .map(|index| {
                level_error(
                    &levels[index],
                    &if index == 0 { leaves(&voxels, lattice) } else { coarser(&levels[index - 1], resolution >> (index - 1), lattice, filter) },
                )
            })
            .collect();
        println!("matter {seed} at {resolution}, {lattice:?}, {filter:?}: largest error by level {errors:.2?} half-float steps");
        assert!(errors.iter().all(|error| *error <= allowed(lattice)), "matter {seed}, {settings:?}: {errors:?}");
    }
}

/// One pass and three give the same bits; so do two runs.
#[test]
fn split_filter_and_repeats_give_the_same_bits() {
    let gpu = gpu();
    let voxels = matter(&mut Random::new(5), 32);
    for corners in [false, true] {
        let bits = |is_split| {
            let (_, pool) = grow(&gpu, &voxels, 32, BrickSettings { corners, filter: 1, is_split });
            let (nodes, _) = grow(&gpu, &voxels, 32, BrickSettings { corners, filter: 1, is_split });
            read_bricks(&gpu, &read_nodes(&gpu, &nodes).unwrap(), &pool).unwrap()
        };
        let first = bits(false);
        assert_eq!(first, bits(true));
        assert_eq!(first, bits(false));
    }
}

#[test]
fn pools_are_hardly_larger_than_what_they_hold() {
    for count in (1..200).chain((200..3_000_000).step_by(7919)) {
        let extent = pool_extent(count);
        let total: u32 = extent.iter().product();
        assert!(total >= count, "{count}: {extent:?}");
        assert!(f64::from(total) <= 1.1 * f64::from(count) + 4.0, "{count}: {extent:?}");
    }
}

/// At equal settings the picture is that of voxel-mips: by 0.0004 on Cornell and 0.0006 on the atrium.
#[test]
fn picture_is_that_of_voxel_mips() {
    let gpu = gpu();
    for name in ["cornell", "atrium"] {
        let scene = bundled(name);
        let indirect = |technique: &str| {
            let case = Case { entry: find(technique).unwrap(), preset: Some("cones") };
            shoot(&gpu, &scene, &case, &[("resolution", "64")], frame(96, 64, 512)).unwrap().indirect
        };
        let errors = compare_images(&indirect("svo"), &indirect("voxel-mips"), None, Channel::Rgb).unwrap().pixel;
        println!("{name}: rel_rmse {:.5}, bias {:+.5}", errors.rel_rmse, errors.bias);
        assert!(errors.rel_rmse <= 0.01, "{name}: {errors:?}");
    }
}

/// Eight pieces are the whole: the same tree, but for the compact order of the voxels, and the same light.
#[test]
fn pieces_are_the_whole() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let settings = voxel_settings(64, Method::Compute);
    let mut voxelizer = PieceVoxelizer::new(&gpu, &gpu_scene, settings).unwrap();
    let (whole, occupancy, _) = voxelizer.run(&gpu, &gpu_scene, LightSettings::direct(Injection::Voxel, Sides::One)).unwrap();
    let bits = read_words(&gpu, &occupancy.occupancy);
    voxelizer.cut(&gpu, 2).unwrap();
    let (pieces, occupancy, _) = voxelizer.run(&gpu, &gpu_scene, LightSettings::direct(Injection::Voxel, Sides::One)).unwrap();
    let differing: u32 = bits.iter().zip(read_words(&gpu, &occupancy.occupancy)).map(|(a, b)| (a ^ b).count_ones()).sum();
    println!("{} and {} voxels, {differing} within rounding", whole.voxel_count, pieces.voxel_count);
    assert!(f64::from(differing) <= 1e-4 * f64::from(whole.voxel_count), "{differing} voxels differ");
    let bases = read_words(&gpu, &occupancy.block_bases);
    let (pool, _) = NodePool::build(&gpu, &occupancy, false).unwrap();
    let mut voxels: Vec<u32> = Vec::new();
    let tree = read_nodes(&gpu, &pool).unwrap();
    tree.tiles[tree.tiles.len() - tree.counts[0] as usize..].iter().for_each(|tile| voxels.extend(tile.nodes.iter().flatten()));
    voxels.sort_unstable();
    assert!(voxels.into_iter().eq(0..pieces.voxel_count), "a compact index is missing or there twice");
    assert_eq!(bases[0], 0);
}

/// The picture of a grid in pieces is that of the whole.
#[test]
fn light_of_pieces_is_that_of_the_whole() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let light = |along: u32| {
        let mut voxelizer = PieceVoxelizer::new(&gpu, &gpu_scene, voxel_settings(32, Method::Compute)).unwrap();
        voxelizer.cut(&gpu, along).unwrap();
        let (pieces, _, _) = voxelizer.run(&gpu, &gpu_scene, LightSettings::direct(Injection::Rsm, Sides::One)).unwrap();
        let maps = LightMaps::new(&gpu, &gpu_scene, 512, true).unwrap();
        gpu_scene.set_frame(&gpu, &gpu_scene.frame_constants(&scene.camera, [8, 8])).unwrap();
        let mut frame = Frame::new();
        frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
        maps.draw(&mut frame, &gpu_scene);
        pieces.update(&mut frame, &maps);
        gpu.submit(frame).unwrap();
        let halves: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&pieces.radiance).unwrap());
        halves.iter().take(pieces.voxel_count as usize).map(|voxel| f64::from(half(voxel[0]) as f32)).sum::<f64>()
    };
    let (whole, pieces) = (light(1), light(4));
    println!("sum of red radiance: {whole:.3} of the whole, {pieces:.3} of 64 pieces");
    assert!((pieces / whole - 1.0).abs() < 0.01, "{pieces} and {whole}");
}

#[test]
fn comparators_notice_planted_errors() {
    let gpu = gpu();
    let voxels = matter(&mut Random::new(11), 32);
    let occupied: BTreeSet<VoxelIndex> = voxels.keys().copied().collect();
    let settings = BrickSettings { corners: false, filter: 1, is_split: false };
    let (nodes, pool) = grow(&gpu, &voxels, 32, settings);
    let tree = read_nodes(&gpu, &nodes).unwrap();
    assert!(compare(&tree, &occupied, 32, Lattice::Centres).is_ok());
    assert!(compare(&tree, &occupied, 32, Lattice::Corners).is_err());
    let mut wrong = tree.clone();
    let last = wrong.tiles.len() - 1;
    wrong.tiles[last].neighbours[0] = Some(0);
    assert!(compare(&wrong, &occupied, 32, Lattice::Centres).is_err());
    let mut fewer = occupied.clone();
    fewer.pop_first();
    assert!(compare(&tree, &fewer, 32, Lattice::Centres).is_err());
    let levels = read_bricks(&gpu, &tree, &pool).unwrap();
    let mut brighter = levels[1].clone();
    brighter.values_mut().for_each(|value| *value *= 1.01);
    let expected = coarser(&levels[0], 32, Lattice::Centres, Filter::Directional);
    assert!(level_error(&levels[1], &expected) <= 1.0 && level_error(&brighter, &expected) > 4.0);
    assert!(level_error(&levels[1], &coarser(&levels[0], 32, Lattice::Centres, Filter::Box)) > 4.0);
}
