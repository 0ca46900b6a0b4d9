//! Blocks as rays read them, against what the occupancy says.

use crate::support::scenes::{scene_of, soup};
use crate::support::technique::{Surfaces, small_lights, small_room};
use crate::support::voxels::{Read, voxel_settings, voxelize};
use crate::support::walker::Walker;
use crate::support::{Random, gpu};
use glam::{IVec3, Vec3};
use lumivox::gi::shared::voxel::trace::blocks::RayBlocks;
use lumivox::gi::shared::voxel::{Method, VoxelBox};
use lumivox::gi::voxel_cones::clipmap;
use lumivox::graph::{Bound, Frame};
use lumivox::render::GpuScene;

/// A block's place in the grid, and its words of occupancy; None outside.
fn occupancy(read: &Read, along: i32, block: IVec3) -> Option<[u32; 2]> {
    let is_inside = block.cmpge(IVec3::ZERO).all() && block.cmplt(IVec3::splat(along)).all();
    let index = block.x + along * (block.y + along * block.z);
    is_inside.then(|| [0, 1].map(|word| read.occupancy[2 * index as usize + word]))
}

/// Whether the cube of this edge (blocks) around a block is empty space of the grid that rays see
/// in no other one. Cubes begin where `corner` is the corner of the grid.
fn is_empty(read: &Read, along: i32, block: IVec3, edge: i32, place: (IVec3, VoxelBox)) -> bool {
    let (corner, hidden) = place;
    let low = (block + corner / 4).div_euclid(IVec3::splat(edge)) * edge - corner / 4;
    (0..edge.pow(3)).all(|index| {
        let at = low + IVec3::new(index % edge, index / edge % edge, index / (edge * edge));
        let is_hidden = !VoxelBox::cube(4 * at, 4).cut(hidden).is_empty();
        occupancy(read, along, at) == Some([0, 0]) && !is_hidden
    })
}

/// Occupancy and first voxel of each block that has voxels, and of the others the largest empty
/// cube.
#[test]
fn blocks_tell_how_large_empty_space_is() {
    let gpu = gpu();
    for (seed, (resolution, triangles)) in [(8, 3), (16, 1), (32, 2), (64, 4), (64, 1)]
        .into_iter()
        .enumerate()
    {
        let mut random = Random::new(40 + seed as u64);
        let corners: Vec<_> = soup(&mut random, resolution / 2)
            .into_iter()
            .take(triangles)
            .collect();
        let scene = GpuScene::new(&gpu, &scene_of(&corners, 1.0, &mut random)).unwrap();
        let read = voxelize(&gpu, &scene, voxel_settings(resolution, Method::Compute));
        let along = (resolution / 4) as i32;
        let middle = VoxelBox::cube(IVec3::splat(2 * along - 2), resolution / 4);
        for (first, place) in [
            (0, (IVec3::ZERO, VoxelBox::NONE)),
            (7, (IVec3::new(4, -8, 12), VoxelBox::NONE)),
            (1000, (IVec3::new(-36, 20, 0), middle)),
        ] {
            let blocks = RayBlocks::new(&gpu, resolution, 2).unwrap();
            let mut frame = Frame::new();
            blocks.pack(&mut frame, 0, (&read.voxels, 0), (IVec3::ZERO, middle));
            blocks.pack(&mut frame, 1, (&read.voxels, first), place);
            gpu.submit(frame).unwrap();
            let words: Vec<[u32; 4]> =
                bytemuck::pod_collect_to_vec(&gpu.read_image(blocks.image(), 0, 0).unwrap());
            let mut found = [0; 4];
            for index in 0..along.pow(3) {
                let block = IVec3::new(
                    index % along,
                    index / along % along,
                    index / (along * along),
                );
                let own = occupancy(&read, along, block).unwrap();
                let third = if own == [0, 0] {
                    let mut edges = [4, 2, 1].into_iter();
                    let is_largest =
                        |edge: &i32| *edge == 1 || is_empty(&read, along, block, *edge, place);
                    4 * edges.find(is_largest).unwrap() as u32
                } else {
                    first + read.bases[index as usize]
                };
                assert_eq!(
                    words[(along.pow(3) + index) as usize],
                    [own[0], own[1], third, 0],
                    "seed {seed}, block {block} of {resolution}³ at {place:?}"
                );
                let kind = [4, 8, 16].iter().position(|edge| *edge == third);
                found[if own == [0, 0] { kind.unwrap() } else { 3 }] += 1;
            }
            println!("{resolution}³, {place:?}: {found:?} empty by edge, and filled");
        }
    }
}

/// Wherever the levels of a clipmap are: the cube that a ray crosses in one step, which begins at a
/// multiple of its edge from where all places are counted from, holds no voxel of the level and
/// nothing of the next finer one.
#[test]
fn cubes_of_levels_are_empty_wherever_those_are() {
    let gpu = gpu();
    let scene = small_room(Surfaces::Diffuse, vec![small_lights()[0].1]);
    for pairs in [
        &["resolution=64", "levels=3"][..],
        &["resolution=32", "levels=4", "level_updates=staggered"],
    ] {
        let settings = clipmap::ENTRY.settings(Some("accurate"), pairs).unwrap();
        let (mut random, mut large) = (Random::new(31), 0);
        let mut eye = Vec3::new(0.0, 1.0, 0.0);
        let mut walker = Walker::new(&gpu, &scene, &clipmap::ENTRY, &settings, eye);
        for step in 0..8 {
            walker.texels(eye);
            let space = walker.technique.space().unwrap();
            let [(_, Bound::Buffer(rows)), (_, Bound::Image(blocks)), ..] = space.bound[..] else {
                panic!("a clipmap's space begins otherwise")
            };
            let rows: Vec<[f32; 8]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(rows).unwrap());
            let words: Vec<[u32; 4]> =
                bytemuck::pod_collect_to_vec(&gpu.read_image(blocks, 0, 0).unwrap());
            let along = blocks.extent(0)[0] as i32;
            // In blocks of the level.
            let corner = |level: usize| {
                IVec3::from([0, 1, 2].map(|axis| rows[level][axis] as i32)) >> (level as i32 + 2)
            };
            for level in 0..(blocks.extent(0)[2] as i32 / along) as usize {
                let first = corner(level);
                for index in 0..along.pow(3) {
                    let block = IVec3::new(
                        index % along,
                        index / along % along,
                        index / (along * along),
                    );
                    let word = |at: IVec3| {
                        let layer = level as i32 * along + at.z;
                        words[(at.x + along * (at.y + along * layer)) as usize]
                    };
                    let [a, b, edge, _] = word(block);
                    if (a, b) != (0, 0) || edge == 4 {
                        continue;
                    }
                    large += 1;
                    let edge = edge as i32 / 4;
                    let low = (first + block).div_euclid(IVec3::splat(edge)) * edge - first;
                    for index in 0..edge.pow(3) {
                        let at = low
                            + IVec3::new(index % edge, index / edge % edge, index / (edge * edge));
                        let is_inside =
                            at.cmpge(IVec3::ZERO).all() && at.cmplt(IVec3::splat(along)).all();
                        assert!(
                            is_inside && word(at)[..2] == [0, 0],
                            "{pairs:?}, step {step}: block {block} of level {level}"
                        );
                        // The next finer level begins at half a block.
                        let finer = level
                            .checked_sub(1)
                            .map(|finer| VoxelBox::cube(corner(finer), along as u32));
                        assert!(
                            finer.is_none_or(|finer| finer
                                .cut(VoxelBox::cube(2 * (first + at), 2))
                                .is_empty()),
                            "{pairs:?}, step {step}: block {block} of level {level}"
                        );
                    }
                }
            }
            let reach = if step % 3 == 2 { 3.0 } else { 0.8 };
            eye = (eye + reach * (Vec3::new(random.unit(), random.unit(), random.unit()) - 0.5))
                .clamp(Vec3::new(-1.5, -0.5, -1.5), Vec3::new(1.5, 2.5, 1.5));
        }
        println!("{pairs:?}: {large} blocks in larger cubes");
        assert!(large > 1000, "{pairs:?}: {large}");
    }
}
