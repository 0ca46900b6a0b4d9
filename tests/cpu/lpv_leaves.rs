//! Leaves of the octree, and the order in which they are swept.

use std::collections::BTreeMap;

use glam::UVec3;
use lumivox::gi::lpv::CellGrid;
use lumivox::gi::lpv::leaves::{Beyond, LeafSettings, Leaves};
use lumivox::gi::lpv::oracle::leaf_of;
use lumivox::gi::lpv::schedule::{Schedule, Step};

use crate::lpv::{cell_of, cube};
use crate::support::Random;

/// Grids with some opaque faces, each seen by both of its cells.
fn cases() -> Vec<(CellGrid, Vec<u32>)> {
    let mut random = Random::new(20);
    let sizes = [
        [16, 16, 16],
        [32, 32, 32],
        [37, 9, 22],
        [3, 3, 40],
        [5, 33, 17],
    ];
    let mut all = Vec::new();
    for size in sizes {
        for count in [0, 1, 3, 40] {
            let grid = CellGrid {
                size: UVec3::from(size),
                ..cube(1)
            };
            let mut faces = vec![0; grid.count() as usize];
            for _ in 0..count {
                let axis = random.below(3) as usize;
                let mut cell = UVec3::from([0, 1, 2].map(|axis| random.below(size[axis])));
                cell[axis] = cell[axis].min(size[axis] - 2);
                faces[grid.index(cell)] |= 2 << (2 * axis);
                cell[axis] += 1;
                faces[grid.index(cell)] |= 1 << (2 * axis);
            }
            all.push((grid, faces));
        }
    }
    all
}

fn settings() -> impl Iterator<Item = LeafSettings> {
    [(1, 0), (1, 2), (1, 5), (1, 8), (2, 5), (4, 3)]
        .into_iter()
        .map(|(guard, max_level)| LeafSettings { guard, max_level })
}

#[test]
fn leaves_are_the_largest_blocks_far_from_faces() {
    let mut counts = BTreeMap::new();
    for (grid, faces) in cases() {
        for settings in settings() {
            let leaves = Leaves::new(&grid, &faces, settings);
            // The oracle looks at each cell of each block: every seventh cell will do.
            for (index, leaf) in leaves.of_cell.iter().enumerate().step_by(7) {
                let leaf = leaves.all[*leaf as usize];
                let expected = leaf_of(&grid, &faces, settings, cell_of(&grid, index));
                assert_eq!(leaf, expected, "{:?}, {settings:?}", grid.size);
                *counts.entry(leaf.level).or_insert(0) += 1;
            }
            let mut seen = vec![false; leaves.all.len()];
            leaves
                .of_cell
                .iter()
                .for_each(|leaf| seen[*leaf as usize] = true);
            assert!(seen.iter().all(|seen| *seen), "leaves without a cell");
        }
    }
    println!("cells by level: {counts:?}");
    assert!(counts.len() > 5);
}

/// With neighbours at most a level apart, four reads are all of a face.
#[test]
fn leaves_that_share_a_face_are_a_level_apart_at_most() {
    for (grid, faces) in cases() {
        for settings in settings() {
            let leaves = Leaves::new(&grid, &faces, settings);
            for index in 0..grid.count() as usize {
                let cell = cell_of(&grid, index);
                let level =
                    |cell: UVec3| leaves.all[leaves.of_cell[grid.index(cell)] as usize].level;
                for axis in 0..3 {
                    let mut next = cell;
                    next[axis] += 1;
                    if next[axis] < grid.size[axis] {
                        let apart = level(cell).abs_diff(level(next));
                        assert!(apart <= 1, "{:?}, {settings:?}, {cell}", grid.size);
                    }
                }
            }
        }
    }
}

/// What a leaf reads is there: in its slot is the neighbour that it wants, computed in a step
/// before, and nobody has taken the slot since.
#[test]
fn what_a_leaf_reads_is_in_its_slot() {
    let mut most = (0, 0);
    for (grid, faces) in cases() {
        for settings in settings() {
            let leaves = Leaves::new(&grid, &faces, settings);
            for octant in 0..8 {
                let max_level = settings.max_level;
                let schedule = Schedule::new(&grid, &leaves, &faces, (max_level, octant)).unwrap();
                check(&grid, &leaves, &faces, octant, &schedule);
                if schedule.steps.len() > most.0 {
                    most = (schedule.steps.len(), schedule.slot_count);
                }
            }
        }
    }
    println!("most steps: {}, with {} slots", most.0, most.1);
}

const BLACK: u16 = 0;
const ENVIRONMENT: u16 = 1;

fn check(grid: &CellGrid, leaves: &Leaves, faces: &[u32], octant: u32, schedule: &Schedule) {
    let mut held: Vec<Option<u32>> = vec![None; schedule.slot_count as usize];
    let (mut is_done, mut next) = (vec![false; leaves.all.len()], Step::default());
    for step in &schedule.steps {
        assert_eq!(step.first_leaf, next.first_leaf);
        assert_eq!(step.first_row, next.first_row);
        let count = step.ones + step.fours;
        next.first_leaf += count;
        next.first_row += step.ones + 4 * step.fours;
        let mut written = Vec::new();
        for at in 0..count {
            let leaf = schedule.leaves[(step.first_leaf + at) as usize];
            let (first, reads) = match at.checked_sub(step.ones) {
                None => (step.first_row + at, 1),
                Some(four) => (step.first_row + step.ones + 4 * four, 4),
            };
            let rows = &schedule.rows[first as usize..][..reads];
            for axis in 0..3 {
                let wanted = wanted(grid, leaves, faces, leaf, (octant, axis));
                for (read, row) in rows.iter().enumerate() {
                    let wanted = wanted[if wanted.len() == 4 { read } else { 0 }];
                    let found = match row[axis] {
                        BLACK => Found::Opaque,
                        ENVIRONMENT => Found::Border,
                        slot => Found::Leaf(held[usize::from(slot)].unwrap()),
                    };
                    assert_eq!(found, wanted, "leaf {leaf} of octant {octant}, axis {axis}");
                }
                assert!(wanted.len() == 1 || reads == 4);
            }
            assert!(rows.iter().all(|row| row[3] == rows[0][3]));
            assert!(
                !std::mem::replace(&mut is_done[leaf as usize], true),
                "twice"
            );
            written.push((rows[0][3], leaf));
        }
        // All of a step at once: nothing that it reads may be overwritten.
        let reads = &schedule.rows[step.first_row as usize..next.first_row as usize];
        for (slot, leaf) in written {
            assert!(slot > ENVIRONMENT);
            assert!(
                !reads.iter().any(|row| row[..3].contains(&slot)),
                "slot {slot}"
            );
            held[usize::from(slot)] = Some(leaf);
        }
    }
    assert!(is_done.iter().all(|done| *done), "leaves are left out");
}

#[derive(Debug, PartialEq, Clone, Copy)]
enum Found {
    Opaque,
    Border,
    Leaf(u32),
}

fn wanted(
    grid: &CellGrid,
    leaves: &Leaves,
    faces: &[u32],
    leaf: u32,
    (octant, axis): (u32, usize),
) -> Vec<Found> {
    let own = leaves.all[leaf as usize];
    let face = 2 * axis as u32 + (octant >> axis & 1);
    if faces[grid.index(own.corner)] >> face & 1 == 1 {
        return vec![Found::Opaque];
    }
    let found = |leaf: Option<u32>| leaf.map_or(Found::Border, Found::Leaf);
    match leaves.beyond(grid, own, face) {
        Beyond::One(one) => vec![found(one)],
        Beyond::Four(four) => four.map(found).to_vec(),
    }
}
