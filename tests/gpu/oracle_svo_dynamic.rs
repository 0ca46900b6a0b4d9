//! Dynamic tiles behind the static ones: what the entry leads to is the tree over all voxels, and
//! what is static stays as it is, bit by bit.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::support::octree::{lattice, matter, packed_radiance, plant};
use crate::support::{Random, gpu, read_words, words};
use glam::{DVec4, UVec3};
use lumivox::gi::shared::voxel::dynamic_passes::{TouchedBlock, TouchedCounters};
use lumivox::gi::shared::voxel::oracle::{VoxelIndex, block_bases, compact_order, occupancy_words};
use lumivox::gi::shared::voxel::{Directionality, Sides};
use lumivox::gi::voxel_cones::svo::oracle::octree;
use lumivox::gi::voxel_cones::svo::{
    BrickPool, BrickSettings, NodePool, Occupancy, OccupiedCube, TouchedVoxels,
};
use lumivox::graph::{Buffer, Frame, Gpu};

/// A tile that a root leads to, by level (0 the finest) and place: its index, the compact indices
/// of a leaf's voxels, and the bits of its brick.
#[derive(Clone, Debug, PartialEq)]
struct Seen {
    index: u32,
    voxels: Vec<(u32, u32)>,
    brick: Vec<[u16; 4]>,
}

type Tree = BTreeMap<(usize, [u32; 3]), Seen>;

/// Words, neighbours and brick of every tile of a pool.
struct Pools {
    nodes: Vec<u32>,
    neighbours: Vec<u32>,
    bricks: Vec<Vec<[u16; 4]>>,
    level_count: usize,
}

impl Pools {
    fn read(gpu: &Gpu, nodes: &NodePool, bricks: &BrickPool) -> Self {
        let count = nodes.tile_count() as usize;
        let halves: Vec<[u16; 4]> =
            bytemuck::pod_collect_to_vec(&gpu.read_image(&bricks.image, 0, 0).unwrap());
        let [width, height, _] = bricks.image.extent(0);
        let (row, column) = (width / 3, height / 3);
        let brick = |index: u32| {
            let corner =
                [index % row, index / row % column, index / (row * column)].map(|at| 3 * at);
            let texel = |texel: u32| {
                let at = [
                    corner[0] + texel % 3,
                    corner[1] + texel / 3 % 3,
                    corner[2] + texel / 9,
                ];
                halves[(at[0] + width * (at[1] + height * at[2])) as usize]
            };
            (0..27).map(texel).collect()
        };
        Pools {
            nodes: read_words(gpu, &nodes.nodes)[..count].to_vec(),
            neighbours: read_words(gpu, &nodes.neighbours)[..3 * count].to_vec(),
            bricks: (0..count as u32).map(brick).collect(),
            level_count: nodes.levels.len(),
        }
    }

    /// All tiles that tile `root` leads to.
    fn tree(&self, root: u32) -> Tree {
        let mut tree = Tree::new();
        let mut left = vec![(self.level_count - 1, [0; 3], root)];
        while let Some((level, place, index)) = left.pop() {
            let word = self.nodes[index as usize];
            let children = (0..8).filter(|node| word >> node & 1 == 1).zip(word >> 8..);
            let mut seen = Seen {
                index,
                voxels: Vec::new(),
                brick: self.bricks[index as usize].clone(),
            };
            if level == 0 {
                seen.voxels = children.collect();
            } else {
                left.extend(children.map(|(node, child)| {
                    (
                        level - 1,
                        [0, 1, 2].map(|axis| 2 * place[axis] + (node >> axis & 1)),
                        child,
                    )
                }));
            }
            assert!(tree.insert((level, place), seen).is_none());
        }
        tree
    }
}

/// What is wrong, in a line: the same tiles with the same voxels and texels.
fn compare(found: &Tree, expected: &Tree) -> Result<(), String> {
    if let Some(place) = found.keys().find(|place| !expected.contains_key(*place)) {
        return Err(format!("{place:?} is too many"));
    }
    for (place, expected) in expected {
        let found = found
            .get(place)
            .ok_or_else(|| format!("{place:?} is missing"))?;
        if found.voxels != expected.voxels {
            return Err(format!(
                "{place:?} has the voxels {:?}, not {:?}",
                found.voxels, expected.voxels
            ));
        }
        if let Some(texel) = (0..27).find(|texel| found.brick[*texel] != expected.brick[*texel]) {
            return Err(format!(
                "{place:?} (tile {}): texel {texel} is {:x?}, not {:x?}",
                found.index, found.brick[texel], expected.brick[texel]
            ));
        }
    }
    Ok(())
}

type Values = BTreeMap<VoxelIndex, DVec4>;

/// Where dynamic voxels are, as the voxelizer leaves it: touched blocks have their records behind
/// the static ones.
struct Posed {
    occupancy: Occupancy,
    blocks: Arc<Buffer>,
    block_room: u32,
    counts: Arc<Buffer>,
    radiance: Arc<Buffer>,
    all: BTreeSet<VoxelIndex>,
}

fn pose(gpu: &Gpu, still: &Values, moving: &Values, resolution: u32) -> Posed {
    let blocks = resolution / 4;
    let block_of = |voxel: &VoxelIndex| {
        let [x, y, z] = voxel.map(|at| at / 4);
        x + blocks * (y + blocks * z)
    };
    let touched: BTreeSet<u32> = moving.keys().map(block_of).collect();
    let all: BTreeSet<VoxelIndex> = still.keys().chain(moving.keys()).copied().collect();
    let still_words = occupancy_words(still.keys().copied(), resolution);
    let all_words = occupancy_words(all.iter().copied(), resolution);
    let mut bases = block_bases(&still_words);
    let mut list = Vec::new();
    let mut next = still.len() as u32;
    for block in &touched {
        let at = *block as usize;
        let [static_low, static_high] = [still_words[2 * at], still_words[2 * at + 1]];
        list.push(TouchedBlock {
            block: *block,
            static_base: bases[at],
            static_low,
            static_high,
        });
        bases[at] = next;
        next += all_words[2 * at].count_ones() + all_words[2 * at + 1].count_ones();
    }
    let dark = |value: DVec4| DVec4::new(0.0, 0.0, 0.0, value.w);
    let of_static = compact_order(still.keys().copied())
        .into_iter()
        .map(|voxel| {
            if touched.contains(&block_of(&voxel)) {
                dark(still[&voxel])
            } else {
                still[&voxel]
            }
        });
    let in_touched = compact_order(
        all.iter()
            .copied()
            .filter(|voxel| touched.contains(&block_of(voxel))),
    );
    let of_touched = in_touched.into_iter().map(|voxel| {
        moving
            .get(&voxel)
            .or_else(|| still.get(&voxel))
            .copied()
            .unwrap()
    });
    let radiance = packed_radiance(of_static.chain(of_touched));
    let (occupancy, block_bases) = (
        words(gpu, "occupancy", &all_words),
        words(gpu, "block_bases", &bases),
    );
    let cube = OccupiedCube {
        first: UVec3::ZERO,
        resolution,
        occupancy,
        block_bases,
        first_voxel: 0,
        filled: None,
    };
    let block_words: Vec<u32> = bytemuck::cast_slice(&list).to_vec();
    Posed {
        occupancy: Occupancy {
            resolution,
            cubes: vec![cube],
        },
        blocks: words(
            gpu,
            "touched",
            if block_words.is_empty() {
                &[0; 4]
            } else {
                &block_words
            },
        ),
        block_room: list.len() as u32,
        counts: words(
            gpu,
            "counts",
            bytemuck::cast_slice(&[TouchedCounters {
                fragment_count: 0,
                indexed: 1,
                unfinished_count: 0,
                touched_count: list.len() as u32,
                slot_count: 0,
                added_voxels: 0,
                dynamic_voxels: 0,
            }]),
        ),
        radiance: words(gpu, "radiance", &radiance),
        all,
    }
}

/// An octree that follows dynamic voxels.
struct Follower<'g> {
    gpu: &'g Gpu,
    resolution: u32,
    settings: BrickSettings,
    still: Values,
    nodes: NodePool,
    bricks: BrickPool,
    /// Never visited.
    first: (Vec<u32>, Vec<u32>),
}

impl<'g> Follower<'g> {
    fn new(gpu: &'g Gpu, still: Values, resolution: u32, settings: BrickSettings) -> Self {
        let occupied: BTreeSet<VoxelIndex> = still.keys().copied().collect();
        let (mut nodes, _) =
            NodePool::build_static(gpu, &plant(gpu, &occupied, resolution), settings.corners)
                .unwrap();
        nodes
            .follow(
                gpu,
                &pose(gpu, &still, &Values::new(), resolution).touched(),
                None,
            )
            .unwrap();
        let (bricks, _) = BrickPool::new(gpu, &nodes, settings, Sides::One, None).unwrap();
        let first = (
            read_words(gpu, &nodes.nodes),
            read_words(gpu, &nodes.neighbours),
        );
        Follower {
            gpu,
            resolution,
            settings,
            still,
            nodes,
            bricks,
            first,
        }
    }

    /// Dynamic voxels are here now, and all are lit.
    fn go_to(&mut self, moving: &Values) -> (Posed, Pools) {
        let posed = pose(self.gpu, &self.still, moving, self.resolution);
        self.nodes.follow(self.gpu, &posed.touched(), None).unwrap();
        self.bricks
            .follow(self.gpu, &self.nodes, Vec::new())
            .unwrap();
        update(self.gpu, &self.nodes, &mut self.bricks, &posed);
        let pools = Pools::read(self.gpu, &self.nodes, &self.bricks);
        (posed, pools)
    }

    /// The same, and checks everything after it.
    fn check(&mut self, moving: &Values, what: &str) -> usize {
        let (posed, pools) = self.go_to(moving);
        let found = pools.tree(0);
        let settings = BrickSettings {
            touched: false,
            ..self.settings
        };
        let (nodes, mut bricks) = grow(self.gpu, &posed.occupancy, settings);
        update(self.gpu, &nodes, &mut bricks, &posed);
        compare(&found, &Pools::read(self.gpu, &nodes, &bricks).tree(0))
            .unwrap_or_else(|error| panic!("{what}: {error}"));
        let oracle = octree(&posed.all, self.resolution, lattice(self.settings));
        let counts: Vec<u32> = (0..pools.level_count)
            .map(|level| found.keys().filter(|(at, _)| *at == level).count() as u32)
            .collect();
        assert_eq!(counts, oracle.counts, "{what}: tiles by level");

        // The static part: words and neighbours are as built. The tree holds the static voxels
        // alone, and the ones in touched blocks are dark.
        let end = self.nodes.static_end() as usize;
        assert!(
            pools.nodes[1..end] == self.first.0[1..end]
                && pools.neighbours[..3 * end] == self.first.1[..3 * end],
            "{what}: a static tile was written"
        );
        let occupied: BTreeSet<VoxelIndex> = self.still.keys().copied().collect();
        let (nodes, mut bricks) = grow(
            self.gpu,
            &plant(self.gpu, &occupied, self.resolution),
            settings,
        );
        update(self.gpu, &nodes, &mut bricks, &posed);
        compare(
            &pools.tree(1),
            &Pools::read(self.gpu, &nodes, &bricks).tree(0),
        )
        .unwrap_or_else(|error| panic!("{what}, static: {error}"));
        // Dynamic tiles have dynamic neighbours.
        assert!(
            pools.neighbours[3 * end..]
                .iter()
                .all(|neighbour| *neighbour == 0 || *neighbour as usize > end),
            "{what}: a static neighbour"
        );
        found
            .values()
            .filter(|seen| seen.index as usize >= end)
            .count()
    }
}

fn grow(gpu: &Gpu, occupancy: &Occupancy, settings: BrickSettings) -> (NodePool, BrickPool) {
    let (nodes, _) = NodePool::build(gpu, occupancy, settings.corners).unwrap();
    let (bricks, _) = BrickPool::new(gpu, &nodes, settings, Sides::One, None).unwrap();
    (nodes, bricks)
}

fn update(gpu: &Gpu, nodes: &NodePool, bricks: &mut BrickPool, posed: &Posed) {
    let mut frame = Frame::new();
    bricks.update(&mut frame, nodes, &posed.radiance);
    gpu.submit(frame).unwrap();
}

impl Posed {
    fn touched(&self) -> TouchedVoxels<'_> {
        let OccupiedCube {
            occupancy,
            block_bases,
            ..
        } = &self.occupancy.cubes[0];
        TouchedVoxels {
            blocks: &self.blocks,
            block_room: self.block_room,
            counts: &self.counts,
            occupancy,
            block_bases,
        }
    }
}

/// A lump of dynamic voxels somewhere, at the border of the grid too.
fn lump(random: &mut Random, resolution: u32) -> Values {
    let corner = [0; 3].map(|_: u32| random.below(resolution));
    let size = [0; 3].map(|_: u32| 1 + random.below((resolution / 3).min(16)));
    let value = |random: &mut Random| {
        let opacity = f64::from(1 + random.below(16)) / 16.0;
        (DVec4::new(1.0, 0.5, 0.25, 1.0) * f64::from(random.below(3)) * opacity)
            .truncate()
            .extend(opacity)
    };
    let inside = |at: u32, axis: usize| corner[axis] + at;
    let all = (0..size[0] * size[1] * size[2]).map(|index| {
        [
            inside(index % size[0], 0),
            inside(index / size[0] % size[1], 1),
            inside(index / (size[0] * size[1]), 2),
        ]
    });
    let voxels: Vec<VoxelIndex> = all
        .filter(|at| at.iter().all(|at| *at < resolution))
        .collect();
    voxels
        .into_iter()
        .filter(|_| random.below(3) > 0)
        .collect::<Vec<_>>()
        .into_iter()
        .map(|voxel| (voxel, value(random)))
        .collect()
}

fn all_settings() -> Vec<BrickSettings> {
    let centres = BrickSettings {
        corners: false,
        filter: 1,
        is_split: false,
        touched: true,
        directionality: Directionality::Isotropic,
        lobe: None,
    };
    let corners = BrickSettings {
        corners: true,
        filter: 0,
        is_split: true,
        touched: true,
        directionality: Directionality::Isotropic,
        lobe: None,
    };
    vec![
        centres,
        BrickSettings {
            touched: false,
            filter: 2,
            ..centres
        },
        corners,
        BrickSettings {
            is_split: false,
            filter: 1,
            ..corners
        },
    ]
}

/// Random static voxels and dynamic lumps that come, go and come back: the tree is that of all
/// voxels, and the static part as if never visited.
#[test]
fn random_voxels_are_as_if_built_at_once() {
    let gpu = gpu();
    let mut dynamic_tiles = 0;
    for seed in 0..16u64 {
        let mut random = Random::new(300 + seed);
        let resolution = [8, 16, 32, 64][seed as usize % 4];
        let settings = all_settings()[seed as usize / 4];
        let mut follower =
            Follower::new(&gpu, matter(&mut random, resolution), resolution, settings);
        let visits: Vec<Values> = (0..4).map(|_| lump(&mut random, resolution)).collect();
        for (step, visit) in [0, 1, 4, 2, 3, 0, 4].into_iter().enumerate() {
            let nobody = Values::new();
            let moving = visits.get(visit).unwrap_or(&nobody);
            let count = follower.check(
                moving,
                &format!("seed {seed} at {resolution}, {settings:?}, step {step}"),
            );
            assert_eq!(count == 0, moving.is_empty(), "seed {seed}, step {step}");
            dynamic_tiles += count;
        }
    }
    println!("{dynamic_tiles} dynamic tiles");
    assert!(dynamic_tiles > 5000);
}

/// Nothing static, all of the grid dynamic, dynamic voxels exactly where static ones are, a single
/// voxel at each corner of the grid.
#[test]
fn degenerate_voxels_are_as_if_built_at_once() {
    let gpu = gpu();
    let glow = DVec4::new(1.0, 2.0, 0.5, 1.0);
    let full = |resolution: u32| -> Values {
        (0..resolution.pow(3))
            .map(|index| {
                (
                    [
                        index % resolution,
                        index / resolution % resolution,
                        index / (resolution * resolution),
                    ],
                    glow,
                )
            })
            .collect()
    };
    let wall = |resolution: u32| -> Values {
        full(resolution)
            .into_iter()
            .filter(|(at, _)| at[1] == resolution / 2)
            .map(|(at, _)| (at, 0.5 * glow))
            .collect()
    };
    for settings in all_settings() {
        for resolution in [8, 16] {
            let corners: Vec<Values> = (0..8u32)
                .map(|index| {
                    [(
                        [0, 1, 2].map(|axis| (index >> axis & 1) * (resolution - 1)),
                        glow,
                    )]
                    .into()
                })
                .collect();
            for still in [Values::new(), wall(resolution), full(resolution)] {
                let mut follower = Follower::new(&gpu, still.clone(), resolution, settings);
                let poses = corners.iter().cloned().chain([
                    full(resolution),
                    still.clone(),
                    Values::new(),
                    wall(resolution),
                    full(resolution),
                    Values::new(),
                ]);
                for (step, moving) in poses.enumerate() {
                    follower.check(
                        &moving,
                        &format!(
                            "{} static voxels at {resolution}, {settings:?}, step {step}",
                            still.len()
                        ),
                    );
                }
            }
        }
    }
}

#[test]
fn comparator_notices_planted_errors() {
    let gpu = gpu();
    let mut random = Random::new(5);
    let still = matter(&mut random, 32);
    let moving = lump(&mut random, 32);
    let mut follower = Follower::new(&gpu, still, 32, all_settings()[0]);
    let (_, pools) = follower.go_to(&moving);
    let tree = pools.tree(0);
    assert_eq!(compare(&tree, &tree), Ok(()));
    assert!(compare(&tree, &pools.tree(1)).is_err(), "the static tree");
    let leaf = *tree
        .iter()
        .find(|(place, seen)| place.0 == 0 && !seen.voxels.is_empty())
        .unwrap()
        .0;
    let mut wrong = tree.clone();
    wrong.get_mut(&leaf).unwrap().voxels[0].1 ^= 1;
    assert!(compare(&wrong, &tree).is_err(), "a voxel");
    let mut wrong = tree.clone();
    wrong.get_mut(&leaf).unwrap().brick[26][3] ^= 1;
    assert!(compare(&wrong, &tree).is_err(), "a texel");
    let mut wrong = tree.clone();
    wrong.remove(&leaf);
    assert!(
        compare(&wrong, &tree).is_err() && compare(&tree, &wrong).is_err(),
        "a tile"
    );
}
