//! Octrees on the device from voxels that a test chooses, read back as the oracle has them.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::{DVec3, DVec4, UVec3};
use lumivox::gi::shared::voxel::oracle::{VoxelIndex, block_bases, compact_order, occupancy_words};
use lumivox::gi::shared::voxel::{Injection, LightSettings, Method, Sides};
use lumivox::gi::voxel_cones::svo::oracle::{Lattice, LitVoxel, Octree, Texels, Tile};
use lumivox::gi::voxel_cones::svo::{
    BrickPool, BrickSettings, NodePool, Occupancy, OccupiedCube, PieceVoxelizer, RecordRange,
};
use lumivox::graph::{Frame, Gpu, Image};
use lumivox::render::{GpuScene, LightMaps};

use super::scenes::bundled;
use super::voxels::{half, to_half, voxel_settings};
use super::{Random, words};

/// Occupancy as the voxelizer would leave it.
pub fn plant(gpu: &Gpu, voxels: &BTreeSet<VoxelIndex>, resolution: u32) -> Occupancy {
    let occupancy = occupancy_words(voxels.iter().copied(), resolution);
    let (block_bases, occupancy) = (
        words(gpu, "block_bases", &block_bases(&occupancy)),
        words(gpu, "occupancy", &occupancy),
    );
    Occupancy {
        resolution,
        cubes: vec![OccupiedCube {
            first: UVec3::ZERO,
            resolution,
            occupancy,
            block_bases,
            first_voxel: 0,
            filled: None,
        }],
    }
}

/// Radiances of all faces of the Cornell box's voxels, lit in pieces as rays read them: from one
/// buffer where bricks read it too, and otherwise from texels.
pub fn light_in_pieces(gpu: &Gpu, has_bricks: bool) -> Vec<u8> {
    let scene = bundled("cornell");
    let gpu_scene = GpuScene::new(gpu, &scene).unwrap();
    gpu_scene
        .set_frame(gpu, &gpu_scene.frame_constants(&scene.camera, [8, 8]))
        .unwrap();
    let maps = LightMaps::new(gpu, &gpu_scene, 256, true).unwrap();
    let settings = voxel_settings(64, Method::Compute);
    let mut voxelizer = PieceVoxelizer::new(gpu, &gpu_scene, settings).unwrap();
    voxelizer.has_bricks = has_bricks;
    voxelizer.cut(2);
    let direct = LightSettings::direct(Injection::Rsm, Sides::Six);
    let (mut pieces, occupancy, _) = voxelizer.run(gpu, &gpu_scene, direct).unwrap();
    let (nodes, _) = NodePool::build(gpu, &occupancy, false).unwrap();
    pieces.pack(gpu).unwrap();
    let mut frame = Frame::new();
    frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
    maps.draw(&mut frame, &gpu_scene);
    pieces.update(&mut frame, &maps, &nodes.nodes);
    gpu.submit(frame).unwrap();
    assert_eq!(pieces.radiance_texels.is_some(), !has_bricks);
    let bytes = match &pieces.radiance_texels {
        Some(texels) => gpu.read_image(texels, 0, 0).unwrap(),
        None => gpu.read_buffer(&pieces.radiance).unwrap(),
    };
    bytes[..48 * pieces.voxel_count as usize].to_vec()
}

/// The node pool as the oracle has it; an error names a tile that cannot be read so.
pub fn read_nodes(gpu: &Gpu, pool: &NodePool) -> Result<Octree, String> {
    let count = pool.tile_count() as usize;
    let read = |buffer, each: usize| super::read_words(gpu, buffer)[..each * count].to_vec();
    let (nodes, neighbours) = (read(&pool.nodes, 1), read(&pool.neighbours, 3));
    let inner = count - pool.levels[0].count as usize;
    let mut positions: Vec<Option<[u32; 3]>> = vec![None; count];
    positions[0] = Some([0; 3]);
    let mut tiles = Vec::new();
    for index in 0..count {
        let position =
            positions[index].ok_or_else(|| format!("tile {index} has no parent before it"))?;
        let mut own = [None; 8];
        let flagged = own
            .iter_mut()
            .enumerate()
            .filter(|(node, _)| nodes[index] >> node & 1 == 1);
        for ((node, own), child) in flagged.zip(nodes[index] >> 8..) {
            *own = Some(child);
            if index < inner {
                let place = positions
                    .get_mut(child as usize)
                    .ok_or_else(|| format!("tile {index} has child {child} of {count}"))?;
                *place = Some([0, 1, 2].map(|axis| 2 * position[axis] + (node as u32 >> axis & 1)));
            }
        }
        let neighbours = [0, 1, 2].map(|axis| neighbours[3 * index + axis].checked_sub(1));
        tiles.push(Tile {
            position,
            nodes: own,
            neighbours,
        });
    }
    Ok(Octree {
        tiles,
        counts: pool.levels.iter().map(|level| level.count).collect(),
    })
}

/// The texels of each level, finest first; an error names one whose copies in several bricks are
/// not equal, bit for bit.
pub fn read_bricks(gpu: &Gpu, tree: &Octree, pool: &BrickPool) -> Result<Vec<Texels>, String> {
    read_texels(gpu, tree, &pool.image)
}

/// The same for any image with a brick for each tile.
pub fn read_texels(gpu: &Gpu, tree: &Octree, image: &Arc<Image>) -> Result<Vec<Texels>, String> {
    let halves: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_image(image, 0, 0).unwrap());
    let [width, height, _] = image.extent(0);
    let (row, column) = (width / 3, height / 3);
    let mut levels = Vec::new();
    let mut end = tree.tiles.len() as u32;
    for count in &tree.counts {
        let mut texels: BTreeMap<VoxelIndex, [u16; 4]> = BTreeMap::new();
        for brick in end - count..end {
            let corner =
                [brick % row, brick / row % column, brick / (row * column)].map(|at| 3 * at);
            for texel in 0..27 {
                let offset = [texel % 3, texel / 3 % 3, texel / 9];
                let at: [u32; 3] = std::array::from_fn(|axis| corner[axis] + offset[axis]);
                let value = halves[(at[0] + width * (at[1] + height * at[2])) as usize];
                let place = std::array::from_fn(|axis| {
                    2 * tree.tiles[brick as usize].position[axis] + offset[axis]
                });
                let known = *texels.entry(place).or_insert(value);
                if known != value {
                    return Err(format!(
                        "level {}: texel {place:?} is {known:?} in one brick, {value:?} in another",
                        levels.len()
                    ));
                }
            }
        }
        levels.push(
            texels
                .into_iter()
                .map(|(at, value)| (at, DVec4::from(value.map(half))))
                .collect(),
        );
        end -= count;
    }
    Ok(levels)
}

/// Builds and fills an octree over voxels of these values.
pub fn grow(
    gpu: &Gpu,
    voxels: &Texels,
    resolution: u32,
    settings: BrickSettings,
) -> (NodePool, BrickPool) {
    let occupied: BTreeSet<VoxelIndex> = voxels.keys().copied().collect();
    let (nodes, _) =
        NodePool::build(gpu, &plant(gpu, &occupied, resolution), settings.corners).unwrap();
    let (mut bricks, _) = BrickPool::new(gpu, &nodes, settings, Sides::One, None).unwrap();
    shine(gpu, &nodes, &mut bricks, voxels);
    (nodes, bricks)
}

/// Radiance and opacity of voxels of these values, as half floats; two words each, at least four.
pub fn packed_radiance(values: impl Iterator<Item = DVec4>) -> Vec<u32> {
    let packed = |value: DVec4| {
        let [r, g, b, a] = (value.truncate() / value.w)
            .extend(value.w)
            .to_array()
            .map(|value| u32::from(to_half(value)));
        [r | g << 16, b | a << 16]
    };
    let mut radiance: Vec<u32> = values.flat_map(packed).collect();
    radiance.resize(radiance.len().max(4), 0);
    radiance
}

/// Fills the bricks of an octree over voxels of these values.
pub fn shine(gpu: &Gpu, nodes: &NodePool, bricks: &mut BrickPool, voxels: &Texels) {
    let radiance = packed_radiance(
        compact_order(voxels.keys().copied())
            .into_iter()
            .map(|voxel| voxels[&voxel]),
    );
    let mut frame = Frame::new();
    bricks.update(&mut frame, nodes, &words(gpu, "radiance", &radiance));
    gpu.submit(frame).unwrap();
}

/// Builds and fills an octree with normal bricks, over voxels of these sides.
pub fn grow_lit(
    gpu: &Gpu,
    voxels: &BTreeMap<VoxelIndex, LitVoxel>,
    resolution: u32,
    settings: BrickSettings,
) -> (NodePool, BrickPool) {
    let (nodes, _) = NodePool::build(
        gpu,
        &plant(gpu, &voxels.keys().copied().collect(), resolution),
        settings.corners,
    )
    .unwrap();
    let ordered = compact_order(voxels.keys().copied());
    // Two pieces, of whole blocks.
    let block = |index: usize| ordered[index].map(|at| at / 4);
    let middle = (ordered.len() / 2..ordered.len())
        .find(|index| *index > 0 && block(*index) != block(index - 1))
        .unwrap_or(ordered.len());
    let (first, second) = ordered.split_at(middle);
    let range = |first_voxel: usize, part: &[VoxelIndex]| {
        let mut records: Vec<u32> = part.iter().flat_map(|at| record(&voxels[at])).collect();
        records.resize(records.len().max(6), 0);
        RecordRange {
            first_voxel: first_voxel as u32,
            voxel_count: part.len() as u32,
            records: words(gpu, "records", &records),
            emission: None,
        }
    };
    let records = vec![range(0, first), range(first.len(), second)];
    let (mut bricks, _) = BrickPool::new(gpu, &nodes, settings, Sides::Two, Some(records)).unwrap();
    shine_lit(gpu, &nodes, &mut bricks, voxels);
    (nodes, bricks)
}

/// Fills the bricks, with normals, of an octree over voxels of these sides.
pub fn shine_lit(
    gpu: &Gpu,
    nodes: &NodePool,
    bricks: &mut BrickPool,
    voxels: &BTreeMap<VoxelIndex, LitVoxel>,
) {
    let packed = |voxel: VoxelIndex| {
        let LitVoxel {
            front,
            back,
            opacity,
            ..
        } = voxels[&voxel];
        [front, back].into_iter().flat_map(move |side| {
            let [r, g, b, a] = side
                .extend(opacity)
                .to_array()
                .map(|value| u32::from(to_half(value)));
            [r | g << 16, b | a << 16]
        })
    };
    let mut radiance: Vec<u32> = compact_order(voxels.keys().copied())
        .into_iter()
        .flat_map(packed)
        .collect();
    radiance.resize(radiance.len().max(4), 0);
    let mut frame = Frame::new();
    bricks.update(&mut frame, nodes, &words(gpu, "radiance", &radiance));
    gpu.submit(frame).unwrap();
}

/// The record of a voxel, with nothing but its normal; an axis stands for opposed surfaces.
fn record(voxel: &LitVoxel) -> [u32; 7] {
    let axis = voxel
        .normal
        .to_array()
        .iter()
        .position(|component| *component == 1.0);
    // Opposed surfaces that are not parallel have a short mean normal.
    let mean = axis.map_or(voxel.normal, |_| DVec3::ZERO);
    let bits = ((mean + 1.0) / 2.0 * 1023.0).round().as_uvec3();
    let coverage = axis.map_or(0, |axis| 1 << 29 | (axis as u32) << 30);
    [
        0,
        0,
        bits.x | bits.y << 10 | bits.z << 20,
        0,
        0,
        coverage,
        0,
    ]
}

/// Random matter with two sides, one or both of which may be dark: normals of any length that
/// records can hold, and opposed surfaces.
pub fn lit_matter(random: &mut Random, resolution: u32) -> BTreeMap<VoxelIndex, LitVoxel> {
    let side = |random: &mut Random| {
        if random.below(3) == 0 {
            DVec3::ZERO
        } else {
            DVec3::from([0; 3].map(|_: u32| f64::from(random.below(65)) / 16.0))
        }
    };
    let normal = |random: &mut Random| {
        if random.below(4) == 0 {
            return DVec3::AXES[random.below(3) as usize];
        }
        let bits =
            || DVec3::from([0; 3].map(|_: u32| f64::from(random.below(1024)))) / 1023.0 * 2.0 - 1.0;
        std::iter::repeat_with(bits)
            .find(|normal| normal.length() <= 1.0)
            .unwrap()
    };
    let of = |(at, value): (VoxelIndex, DVec4), random: &mut Random| {
        (
            at,
            LitVoxel {
                front: side(random),
                back: side(random),
                normal: normal(random),
                opacity: value.w,
            },
        )
    };
    matter(random, resolution)
        .into_iter()
        .map(|voxel| of(voxel, random))
        .collect()
}

/// Random matter: single voxels, walls and a lump; half of it opaque, radiance up to 4 in steps
/// that half floats hold.
pub fn matter(random: &mut Random, resolution: u32) -> Texels {
    let mut voxels = BTreeSet::new();
    for _ in 0..random.below(60) {
        voxels.insert([0; 3].map(|_: u32| random.below(resolution)));
    }
    let span = |random: &mut Random| 1 + random.below((resolution / 4).min(24));
    for _ in 0..random.below(5) {
        let corner = [0; 3].map(|_: u32| random.below(resolution));
        let mut size = [0; 3].map(|_: u32| span(random));
        size[random.below(3) as usize] = 1 + random.below(2);
        let inside = |at: u32, axis: usize| (corner[axis] + at).min(resolution - 1);
        for index in 0..size[0] * size[1] * size[2] {
            let at = [
                index % size[0],
                index / size[0] % size[1],
                index / (size[0] * size[1]),
            ];
            voxels.insert([inside(at[0], 0), inside(at[1], 1), inside(at[2], 2)]);
        }
    }
    let value = |random: &mut Random| {
        let opacity = if random.below(2) == 0 {
            1.0
        } else {
            f64::from(1 + random.below(16)) / 16.0
        };
        let color = [0; 3].map(|_: u32| f64::from(random.below(65)) / 16.0);
        DVec4::new(
            color[0] * opacity,
            color[1] * opacity,
            color[2] * opacity,
            opacity,
        )
    };
    voxels
        .into_iter()
        .map(|voxel| (voxel, value(random)))
        .collect()
}

/// The lattice of some settings.
pub fn lattice(settings: BrickSettings) -> Lattice {
    if settings.corners {
        Lattice::Corners
    } else {
        Lattice::Centres
    }
}
