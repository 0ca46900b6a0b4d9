//! When each leaf is computed, and where its radiance is kept until all that need it have it.

use super::grid::CellGrid;
use super::leaves::{Beyond, Leaf, Leaves};

/// The slot that is always black: what comes from an opaque face.
pub(super) const BLACK: u16 = 0;
/// The slot that always has an environment of radiance 1: what comes through the border.
pub(super) const ENVIRONMENT: u16 = 1;
/// The first that leaves have.
pub(super) const FIRST_FREE: u32 = 2;

/// The slots that a leaf reads, of its upwind neighbours along x, y and z, and its own.
pub type Row = [u16; 4];

/// Leaves whose upwind neighbours are all done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Step {
    /// Where they begin in the list of leaves.
    pub first_leaf: u32,
    /// Where they begin in the list of rows.
    pub first_row: u32,
    /// How many have one upwind neighbour along each axis, and one row.
    pub ones: u32,
    /// How many have four smaller ones along some axis, and four rows; they come last.
    pub fours: u32,
}

/// All leaves, for the directions of one octant.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    /// One after the other.
    pub steps: Vec<Step>,
    /// Leaves, step by step.
    pub leaves: Vec<u32>,
    /// What they read and write.
    pub rows: Vec<Row>,
    /// Slots that they need.
    pub slot_count: u32,
}

/// More radiance is on its way at once than slots have numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooManyOnTheirWay(pub u32);

const NONE: u32 = u32::MAX;

/// When leaves are computed.
struct Times {
    /// Step of each.
    step: Vec<u32>,
    /// The last step that reads it, or its own.
    last_read: Vec<u32>,
    /// Whether it has four smaller neighbours upwind.
    has_four: Vec<bool>,
}

impl Times {
    /// Each as early as its neighbours allow.
    fn new(grid: &CellGrid, leaves: &Leaves, words: &[u32], octant: u32, order: &[u32]) -> Self {
        let mut times = Times {
            step: vec![0; order.len()],
            last_read: vec![0; order.len()],
            has_four: vec![false; order.len()],
        };
        for &at in order {
            let own = leaves.all[at as usize];
            let mut step = 0;
            let mut needed = [NONE; 12];
            for (axis, needed) in needed.chunks_exact_mut(4).enumerate() {
                match upwind(grid, leaves, words, own, (octant, axis)) {
                    Upwind::Opaque => {}
                    Upwind::Leaves(Beyond::One(one)) => needed[0] = one.unwrap_or(NONE),
                    Upwind::Leaves(Beyond::Four(four)) => {
                        times.has_four[at as usize] = true;
                        needed.copy_from_slice(&four.map(|one| one.unwrap_or(NONE)));
                    }
                }
                for &one in needed.iter().filter(|one| **one != NONE) {
                    step = step.max(times.step[one as usize] + 1);
                }
            }
            times.step[at as usize] = step;
            times.last_read[at as usize] = step;
            for one in needed.into_iter().filter(|one| *one != NONE) {
                let last = &mut times.last_read[one as usize];
                *last = step.max(*last);
            }
        }
        times
    }
}

enum Upwind {
    Opaque,
    Leaves(Beyond),
}

fn upwind(
    grid: &CellGrid,
    leaves: &Leaves,
    words: &[u32],
    leaf: Leaf,
    (octant, axis): (u32, usize),
) -> Upwind {
    let face = 2 * axis as u32 + (octant >> axis & 1);
    if leaf.level == 0 && words[grid.index(leaf.corner)] >> face & 1 == 1 {
        return Upwind::Opaque;
    }
    Upwind::Leaves(leaves.beyond(grid, leaf, face))
}

impl Schedule {
    /// For directions of an octant, whose bits 0, 1 and 2 say that x, y and z fall.
    pub fn new(
        grid: &CellGrid,
        leaves: &Leaves,
        words: &[u32],
        (max_level, octant): (u32, u32),
    ) -> Result<Self, TooManyOnTheirWay> {
        let order = leaves.upwind_order(grid, max_level, octant);
        let times = Times::new(grid, leaves, words, octant, &order);
        let mut schedule = Schedule::of_times(&times, &order);
        let slots = schedule.assign_slots(&times);
        if schedule.slot_count > u32::from(u16::MAX) + 1 {
            return Err(TooManyOnTheirWay(schedule.slot_count));
        }
        schedule.write_rows(&times, |leaf, at| {
            let own = leaves.all[leaf as usize];
            let found =
                [0, 1, 2].map(
                    |axis| match upwind(grid, leaves, words, own, (octant, axis)) {
                        Upwind::Opaque => BLACK,
                        Upwind::Leaves(Beyond::One(one)) => slot_of(&slots, one),
                        Upwind::Leaves(Beyond::Four(four)) => slot_of(&slots, four[at]),
                    },
                );
            [found[0], found[1], found[2], slots[leaf as usize] as u16]
        });
        Ok(schedule)
    }

    /// Sorts the leaves by their step, and those with four neighbours last, else in `order`.
    fn of_times(times: &Times, order: &[u32]) -> Self {
        let count = times.step.iter().max().map_or(0, |last| last + 1);
        let mut steps = vec![Step::default(); count as usize];
        for &leaf in order {
            let step = &mut steps[times.step[leaf as usize] as usize];
            if times.has_four[leaf as usize] {
                step.fours += 1;
            } else {
                step.ones += 1;
            }
        }
        let (mut next_leaf, mut next_row) = (0, 0);
        let mut next = Vec::new();
        for step in &mut steps {
            (step.first_leaf, step.first_row) = (next_leaf, next_row);
            next.push([next_leaf, next_leaf + step.ones]);
            next_leaf += step.ones + step.fours;
            next_row += step.ones + 4 * step.fours;
        }
        let mut sorted = vec![0; order.len()];
        for &leaf in order {
            let kind = usize::from(times.has_four[leaf as usize]);
            let place = &mut next[times.step[leaf as usize] as usize][kind];
            sorted[*place as usize] = leaf;
            *place += 1;
        }
        Schedule {
            steps,
            leaves: sorted,
            rows: Vec::with_capacity(next_row as usize),
            slot_count: 0,
        }
    }

    /// A slot for each leaf, from its step to the last that reads it.
    fn assign_slots(&mut self, times: &Times) -> Vec<u32> {
        // Leaves that are read last in the same step, as a list: the next of each.
        let mut first_done = vec![NONE; self.steps.len()];
        let mut next_done = vec![NONE; self.leaves.len()];
        let (mut slots, mut free) = (vec![0; self.leaves.len()], Vec::new());
        self.slot_count = FIRST_FREE;
        for (at, step) in self.steps.iter().enumerate() {
            let mut done = match at.checked_sub(1) {
                Some(before) => first_done[before],
                None => NONE,
            };
            while done != NONE {
                free.push(slots[done as usize]);
                done = next_done[done as usize];
            }
            let own = &self.leaves[step.first_leaf as usize..];
            for &leaf in &own[..(step.ones + step.fours) as usize] {
                slots[leaf as usize] = free.pop().unwrap_or_else(|| {
                    self.slot_count += 1;
                    self.slot_count - 1
                });
                let last = times.last_read[leaf as usize] as usize;
                next_done[leaf as usize] = first_done[last];
                first_done[last] = leaf;
            }
        }
        slots
    }

    fn write_rows(&mut self, times: &Times, row: impl Fn(u32, usize) -> Row) {
        for &leaf in &self.leaves {
            let count = if times.has_four[leaf as usize] { 4 } else { 1 };
            self.rows.extend((0..count).map(|at| row(leaf, at)));
        }
    }
}

fn slot_of(slots: &[u32], leaf: Option<u32>) -> u16 {
    leaf.map_or(ENVIRONMENT, |leaf| slots[leaf as usize] as u16)
}
