//! Which probes there is room for, and which of them a frame traces and lights.

use std::collections::{BTreeMap, BTreeSet};

use glam::IVec3;

/// A probe, wherever the camera is: its level, finest 0, and its place in the level's lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Key {
    /// The coarsest comes first: what all else falls back to.
    from_coarsest: u32,
    at: [i32; 3],
}

impl Key {
    /// Of a place in the lattice of level `level` of `levels`.
    pub fn new(level: u32, levels: u32, at: IVec3) -> Self {
        Key {
            from_coarsest: levels - 1 - level,
            at: at.to_array(),
        }
    }

    /// Its level of so many.
    pub fn level(&self, levels: u32) -> u32 {
        levels - 1 - self.from_coarsest
    }

    /// Its place in the lattice.
    pub fn at(&self) -> IVec3 {
        self.at.into()
    }

    /// The seed of the turn of its rays: that of its place, whenever it was come to.
    pub fn seed(&self) -> u32 {
        let [x, y, z] = self.at.map(i32::cast_unsigned);
        x.wrapping_mul(0x9e37_79b1)
            ^ y.wrapping_mul(0x85eb_ca77)
            ^ z.wrapping_mul(0xc2b2_ae3d)
            ^ self.from_coarsest.wrapping_mul(0x27d4_eb2f)
    }
}

/// Where a probe is in the store, and whether it has its light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Held {
    slot: u32,
    is_lit: bool,
}

/// The probes of a store with room for so many.
#[derive(Debug)]
pub struct Pool {
    held: BTreeMap<Key, Held>,
    /// Slots that nobody has, the next one last.
    free: Vec<u32>,
    /// The last that was lit in turn.
    last: Option<Key>,
}

/// What a frame does.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Turn {
    /// Probes and their slots that are traced and lit for the first time, coarsest first.
    pub new: Vec<(Key, u32)>,
    /// Those that are lit again.
    pub again: Vec<(Key, u32)>,
}

impl Pool {
    /// With nothing in it.
    pub fn new(capacity: u32) -> Self {
        Pool {
            held: BTreeMap::new(),
            free: (0..capacity).rev().collect(),
            last: None,
        }
    }

    /// Makes room for so many, if that is more.
    pub fn grow(&mut self, capacity: u32) {
        let more = (self.room()..capacity).rev();
        self.free.splice(0..0, more);
    }

    /// How many it holds.
    pub fn held(&self) -> u32 {
        self.held.len() as u32
    }

    /// For how many there is room.
    pub fn room(&self) -> u32 {
        (self.held.len() + self.free.len()) as u32
    }

    /// Holds these, no more than there is room for, and no others; those that it had before stay
    /// where they are.
    pub fn hold(&mut self, needed: &BTreeSet<Key>) {
        let free = &mut self.free;
        self.held.retain(|key, held| {
            let stays = needed.contains(key);
            if !stays {
                free.push(held.slot);
            }
            stays
        });
        for key in needed {
            if !self.held.contains_key(key)
                && let Some(slot) = self.free.pop()
            {
                let is_lit = false;
                self.held.insert(*key, Held { slot, is_lit });
            }
        }
    }

    /// The probes that the next frame traces or lights, `most` of them (0: all), which are lit from
    /// then on. New ones come first; those of the coarsest level all come at once.
    pub fn advance(&mut self, most: u32) -> Turn {
        let most = if most == 0 { usize::MAX } else { most as usize };
        let mut turn = Turn::default();
        let is_coarsest = |key: &Key| key.from_coarsest == 0;
        for (key, held) in self.held.iter_mut().filter(|(_, held)| !held.is_lit) {
            if turn.new.len() >= most && !is_coarsest(key) {
                break;
            }
            held.is_lit = true;
            turn.new.push((*key, held.slot));
        }
        let left = most.saturating_sub(turn.new.len());
        let new: BTreeSet<Key> = turn.new.iter().map(|(key, _)| *key).collect();
        let old = |(key, held): &(&Key, &Held)| held.is_lit && !new.contains(key);
        let after = self
            .last
            .map_or(std::ops::Bound::Unbounded, std::ops::Bound::Excluded);
        let later = self.held.range((after, std::ops::Bound::Unbounded));
        let earlier = self
            .last
            .into_iter()
            .flat_map(|last| self.held.range(..=last));
        let in_turn = later.chain(earlier).filter(old).take(left);
        turn.again = in_turn.map(|(key, held)| (*key, held.slot)).collect();
        self.last = turn.again.last().map(|(key, _)| *key).or(self.last);
        turn
    }

    /// The probes that have their light, and their slots.
    pub fn lit(&self) -> impl Iterator<Item = (Key, u32)> {
        let lit = self.held.iter().filter(|(_, held)| held.is_lit);
        lit.map(|(key, held)| (*key, held.slot))
    }
}
