//! Leaves of an octree: blocks of cells far from surfaces, and single cells near them.

use glam::{IVec3, UVec3};

use super::grid::CellGrid;

/// A block of 2^`level` cells along each axis. It may stick out of the grid at its far ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// Its smallest cell.
    pub corner: UVec3,
    /// How often its edge is twice as long as a cell's.
    pub level: u32,
}

impl Leaf {
    /// Cells along its edge.
    pub fn size(&self) -> u32 {
        1 << self.level
    }

    /// As the shaders read it: 9 bits of each coordinate, then the level.
    pub(super) fn word(&self) -> u32 {
        self.corner.x | self.corner.y << 9 | self.corner.z << 18 | self.level << 27
    }
}

/// Where an octree is fine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LeafSettings {
    /// Blocks around a leaf that hold no opaque face either.
    pub guard: u32,
    /// Level of the largest leaves.
    pub max_level: u32,
}

/// All leaves of a grid.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Leaves {
    /// Block by block, the eight parts of a block one after the other (Morton order).
    pub all: Vec<Leaf>,
    /// The leaf that each cell is in.
    pub of_cell: Vec<u32>,
}

/// Which blocks of one level are to be divided.
struct Level {
    size: UVec3,
    is_divided: Vec<bool>,
}

impl Level {
    fn index(&self, block: UVec3) -> usize {
        (block.x + self.size.x * (block.y + self.size.y * block.z)) as usize
    }
}

/// For all blocks of a level, whether they hold an opaque face.
fn busy_blocks(below: &Level) -> Level {
    let size = (below.size + 1) / 2;
    let mut level = Level {
        size,
        is_divided: vec![false; size.element_product() as usize],
    };
    for (index, _) in below
        .is_divided
        .iter()
        .enumerate()
        .filter(|(_, busy)| **busy)
    {
        let block = block_of(below.size, index) / 2;
        let own = level.index(block);
        level.is_divided[own] = true;
    }
    level
}

fn block_of(size: UVec3, index: usize) -> UVec3 {
    let at = index as u32;
    UVec3::new(at % size.x, at / size.x % size.y, at / (size.x * size.y))
}

/// The same for blocks that have such a one among the `guard` next to them, axis by axis.
fn guarded(mut level: Level, guard: u32) -> Level {
    for axis in 0..3 {
        let mut wider = level.is_divided.clone();
        for (index, _) in level
            .is_divided
            .iter()
            .enumerate()
            .filter(|(_, busy)| **busy)
        {
            let block = block_of(level.size, index);
            let end = level.size[axis].min(block[axis] + guard + 1);
            for along in block[axis].saturating_sub(guard)..end {
                let mut near = block;
                near[axis] = along;
                wider[level.index(near)] = true;
            }
        }
        level.is_divided = wider;
    }
    level
}

impl Leaves {
    /// A block is a leaf if neither it nor its neighbours hold an opaque face (`words`, six bits a
    /// cell), and its parent is none. Leaves that share a face are then at most a level apart: the
    /// neighbours of what is next to a leaf are the leaf itself and its neighbours.
    pub fn new(grid: &CellGrid, words: &[u32], settings: LeafSettings) -> Self {
        let mut busy = Level {
            size: grid.size,
            is_divided: words.iter().map(|word| word & 63 != 0).collect(),
        };
        let mut levels = Vec::new();
        for _ in 0..settings.max_level {
            busy = busy_blocks(&busy);
            let copy = Level {
                size: busy.size,
                is_divided: busy.is_divided.clone(),
            };
            levels.push(guarded(copy, settings.guard));
        }
        let mut leaves = Leaves {
            all: Vec::new(),
            of_cell: vec![0; grid.count() as usize],
        };
        for_each_root(grid.size, settings.max_level, UVec3::ZERO, &mut |corner| {
            leaves.divide(grid, &levels, corner, settings.max_level);
        });
        leaves
    }

    fn divide(&mut self, grid: &CellGrid, levels: &[Level], corner: UVec3, level: u32) {
        if corner.cmpge(grid.size).any() {
            return;
        }
        let blocks = level.checked_sub(1).and_then(|at| levels.get(at as usize));
        if blocks.is_some_and(|blocks| blocks.is_divided[blocks.index(corner >> level)]) {
            for part in parts(corner, level, UVec3::ZERO) {
                self.divide(grid, levels, part, level - 1);
            }
            return;
        }
        let end = (corner + (1 << level)).min(grid.size);
        for z in corner.z..end.z {
            for y in corner.y..end.y {
                let first = grid.index(UVec3::new(corner.x, y, z));
                let row = &mut self.of_cell[first..][..(end.x - corner.x) as usize];
                row.fill(self.all.len() as u32);
            }
        }
        self.all.push(Leaf { corner, level });
    }

    /// All leaves in an order in which each comes after those that are upwind of it. Bits 0, 1 and
    /// 2 of `octant` say that x, y and z fall.
    pub fn upwind_order(&self, grid: &CellGrid, max_level: u32, octant: u32) -> Vec<u32> {
        let flip = UVec3::new(octant & 1, octant >> 1 & 1, octant >> 2);
        let mut order = Vec::with_capacity(self.all.len());
        for_each_root(grid.size, max_level, flip, &mut |corner| {
            self.visit(grid, corner, (max_level, flip), &mut order);
        });
        order
    }

    fn visit(
        &self,
        grid: &CellGrid,
        corner: UVec3,
        (level, flip): (u32, UVec3),
        order: &mut Vec<u32>,
    ) {
        if corner.cmpge(grid.size).any() {
            return;
        }
        let leaf = self.of_cell[grid.index(corner)];
        if self.all[leaf as usize].level >= level {
            order.push(leaf);
            return;
        }
        for part in parts(corner, level, flip) {
            self.visit(grid, part, (level - 1, flip), order);
        }
    }

    /// What is on the other side of a face of a leaf: one leaf, or four smaller ones. Faces are in
    /// the order −x, +x, −y, +y, −z, +z.
    pub fn beyond(&self, grid: &CellGrid, leaf: Leaf, face: u32) -> Beyond {
        let axis = (face / 2) as usize;
        let step = if face.is_multiple_of(2) {
            -1
        } else {
            leaf.size() as i32
        };
        let mut next = leaf.corner.as_ivec3();
        next[axis] += step;
        let at = |cell: IVec3| {
            let is_there = cell.cmpge(IVec3::ZERO).all() && cell.cmplt(grid.size.as_ivec3()).all();
            is_there.then(|| self.of_cell[grid.index(cell.as_uvec3())])
        };
        let first = at(next);
        let level = first.map(|first| self.all[first as usize].level);
        if level.is_none_or(|level| level >= leaf.level) {
            return Beyond::One(first);
        }
        let half = leaf.size() as i32 / 2;
        Beyond::Four([0, 1, 2, 3].map(|quarter| {
            let mut cell = next;
            cell[(axis + 1) % 3] += half * (quarter & 1);
            cell[(axis + 2) % 3] += half * (quarter >> 1);
            at(cell)
        }))
    }
}

/// What is beyond a face: leaves, `None` outside of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beyond {
    /// One, as large or larger.
    One(Option<u32>),
    /// Four, half as large.
    Four([Option<u32>; 4]),
}

/// The corners of the largest blocks, along falling axes from the far end.
fn for_each_root(size: UVec3, level: u32, flip: UVec3, visit: &mut dyn FnMut(UVec3)) {
    let count = (size + ((1 << level) - 1)) >> level;
    let along = |axis: usize, at: u32| match flip[axis] {
        0 => at,
        _ => count[axis] - 1 - at,
    };
    for z in 0..count.z {
        for y in 0..count.y {
            for x in 0..count.x {
                visit(UVec3::new(along(0, x), along(1, y), along(2, z)) << level);
            }
        }
    }
}

/// The corners of the eight parts of a block, along falling axes from the far end.
fn parts(corner: UVec3, level: u32, flip: UVec3) -> [UVec3; 8] {
    [0, 1, 2, 3, 4, 5, 6, 7].map(|part: u32| {
        let far = UVec3::new(part & 1, part >> 1 & 1, part >> 2) ^ flip;
        corner + (far << (level - 1))
    })
}
