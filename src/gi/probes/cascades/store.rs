//! The probes that are kept, and where levels find them.

use std::sync::Arc;

use super::layout::Window;
use super::passes::{GATHER, LevelParams};
use super::pool::Pool;
use crate::gi::probes::list::{Listed, ProbeList};
use crate::gi::probes::lookup::Lookup;
use crate::gi::probes::passes::LookupRow;
use crate::gi::probes::rays::ProbeRays;
use crate::gi::probes::volume::{Kept, Maps, Volume, buffer};
use crate::graph::{Buffer, Error, Frame, Gpu, PassBuilder};
use crate::render::Receivers;

/// The probes, with room for so many.
pub struct Store {
    /// Which they are.
    pub pool: Pool,
    /// The maps, as each level looks them up.
    pub levels: Vec<Volume>,
    pub(super) rays: ProbeRays,
    /// The probes of a frame's work, one after the other.
    pub(super) list: ProbeList,
    /// Of the first of those: xyz: where they stand on the lattice (m); w: spacing there (m).
    pub(super) homes: Arc<Buffer>,
    /// Of each level and place: the probe there.
    table: Arc<Buffer>,
    /// Of each level: how places look it up.
    rows: Arc<Buffer>,
    /// Whether no probe has light yet.
    pub(super) is_dark: bool,
}

/// Room for a few more than are needed: cameras move on, and growing takes a moment.
fn room_for(needed: u32) -> u32 {
    (needed + needed / 64).next_multiple_of(64).max(64)
}

impl Store {
    /// With room for as many as are needed.
    pub fn new(
        gpu: &Gpu,
        (kept, rays): (&Kept, u32),
        windows: &[Window],
        needed: u32,
    ) -> Result<Self, Error> {
        let capacity = room_for(needed);
        let volume = Volume::with_room(gpu, windows[0].lattice, capacity, kept)?;
        let rays = ProbeRays::new(gpu, capacity, rays)?;
        Store::of(gpu, (volume, rays), windows, Pool::new(capacity))
    }

    /// The same with room for as many as are needed; those that it holds keep what they have.
    pub fn grown(
        self,
        gpu: &Gpu,
        kept: &Kept,
        windows: &[Window],
        needed: u32,
    ) -> Result<Self, Error> {
        let capacity = room_for(needed);
        let volume = self.volume().grown(gpu, capacity, kept)?;
        let rays = self.rays.grown(gpu, capacity)?;
        let mut pool = self.pool;
        pool.grow(capacity);
        Ok(Store {
            is_dark: self.is_dark,
            ..Store::of(gpu, (volume, rays), windows, pool)?
        })
    }

    fn of(
        gpu: &Gpu,
        (volume, rays): (Volume, ProbeRays),
        windows: &[Window],
        pool: Pool,
    ) -> Result<Self, Error> {
        let capacity = pool.room();
        let places: u32 = (windows.iter())
            .map(|window| window.lattice.probe_count())
            .sum();
        let room = |name, size: usize| buffer(gpu, name, size as u64);
        Ok(Store {
            pool,
            levels: vec![volume],
            rays,
            list: ProbeList::new(gpu, 2 * capacity)?,
            homes: room("cascades.homes", 16 * capacity as usize)?,
            table: room("cascades.table", 4 * places as usize)?,
            rows: room("cascades.rows", size_of::<LookupRow>() * windows.len())?,
            is_dark: true,
        })
    }

    /// Of the finest level, or of any: all have the same maps.
    pub fn volume(&self) -> &Volume {
        &self.levels[0]
    }

    /// Looks probes up by levels that are where these are.
    pub fn look_up_by(
        &mut self,
        gpu: &Gpu,
        lookup: &Lookup,
        windows: &[Window],
    ) -> Result<(), Error> {
        let volume = self.volume().clone();
        let levels = windows.iter();
        self.levels = levels
            .map(|window| volume.looked_up_by(window.lattice))
            .collect();
        let rows: Vec<LookupRow> = (self.levels.iter().zip(windows))
            .map(|(volume, window)| {
                let mut row = lookup.row(volume);
                row.counts[3] = window.open;
                row
            })
            .collect();
        gpu.upload_buffer(&self.rows, bytemuck::cast_slice(&rows))
    }

    /// Says where the probes are that have their light.
    pub fn publish(&self, gpu: &Gpu, windows: &[Window]) -> Result<(), Error> {
        let counts = windows.iter().map(|window| window.lattice.probe_count());
        let mut table = vec![u32::MAX; counts.clone().sum::<u32>() as usize];
        let firsts: Vec<u32> = counts
            .scan(0, |next, count| {
                let first = *next;
                *next += count;
                Some(first)
            })
            .collect();
        for (key, slot) in self.pool.lit() {
            let level = key.level(windows.len() as u32) as usize;
            if let Some(probe) = windows[level].find(key.at()) {
                table[(firsts[level] + probe) as usize] = slot;
            }
        }
        gpu.upload_buffer(&self.table, bytemuck::cast_slice(&table))
    }

    /// Binds the maps of so many bounces, and how all levels look them up.
    pub(super) fn bind<'f>(
        &self,
        pass: PassBuilder<'f>,
        lookup: &Lookup,
        maps: &Maps,
    ) -> PassBuilder<'f> {
        lookup
            .bind(pass, self.volume(), maps)
            .bind("probe_table", &self.table)
            .bind("lookup_rows", &self.rows)
    }

    /// Adds [`GATHER`]: the light of surfaces, by the maps of so many bounces.
    pub fn gather(
        &self,
        frame: &mut Frame,
        receivers: &Receivers<'_>,
        lookup: &Lookup,
        maps: &Maps,
    ) {
        let pass = frame
            .pass(&GATHER)
            .bind("view_depth", receivers.view_depth)
            .bind("normals", receivers.normals)
            .bind("indirect_diffuse", receivers.light)
            .bind("probe_orphans", &self.volume().orphans);
        self.bind(pass, lookup, maps)
            .push(&LevelParams {
                level_count: self.levels.len() as u32,
            })
            .dispatch(receivers.groups());
    }

    /// The parts of the list that each level has, coarsest first, from `first` on.
    pub(super) fn of_levels<'s>(
        &'s self,
        first: u32,
        counts: &'s [u32],
    ) -> impl Iterator<Item = (&'s Volume, Listed<'s>)> {
        let parts = counts.iter().scan(first, |next, count| {
            let part = self.list.part(*next, *count);
            *next += count;
            Some(part)
        });
        let levels = self.levels.iter().rev().zip(parts);
        levels.filter(|(_, part)| part.count > 0)
    }
}
