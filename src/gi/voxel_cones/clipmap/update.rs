//! How levels follow the camera: where they go, and which voxels, light and texels are made anew.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;

use super::filled::Marked;
use super::{Clipmap, Inner, Place};
use crate::gi::Context;
use crate::gi::shared::cone::Volume;
use crate::gi::shared::voxel::{
    self, EmissionSeenBy, LightBounces, LightInputs, VoxelBox, VoxelLight, VoxelLookup,
    VoxelRecords, VoxelWindow, WindowMove, move_windows,
};
use crate::graph::{Error, Frame, FrameStats, Gpu};
use crate::render::LightMaps;

/// One level: its voxels and their light. Boxes are in voxels of its unbounded grid.
pub(super) struct Level {
    pub(super) window: VoxelWindow,
    pub(super) light: VoxelLight,
    pub(super) place: Place,
    /// Where the next finer level was shown when this one's texels were made last.
    pub(super) inner: Inner,
    /// The voxels that have the light of this frame.
    pub(super) lit: VoxelBox,
    /// Where texels of the next finer level have changed since this one's were made.
    pub(super) stale: VoxelBox,
    /// Where voxels have.
    pub(super) new: Vec<VoxelBox>,
}

impl Level {
    pub(super) fn extent(&self) -> VoxelBox {
        VoxelBox::cube(self.place.first, self.window.voxels.grid.resolution)
    }

    pub(super) fn is_lit(&self) -> bool {
        self.lit == self.extent()
    }
}

impl Clipmap {
    /// Whether a level follows the camera and the lights in this frame.
    pub(super) fn is_due(&self, level: usize) -> bool {
        !self.is_staggered || self.frame.is_multiple_of(1 << level)
    }

    /// Where the levels go in this frame: those that are due to their places, and those whose finer
    /// level would leave them.
    pub(super) fn places(&self, eye: Vec3) -> Vec<Place> {
        let mut places = self.layout.places(eye);
        for (index, level) in self.levels.iter().enumerate() {
            let current = VoxelBox::cube(level.place.first, self.layout.resolution);
            let holds_finer = index.checked_sub(1).is_none_or(|finer| {
                let extent = self.layout.extent(places[finer].first);
                extent.cut(current) == extent
            });
            if !self.is_due(index) && holds_finer {
                places[index] = level.place;
            }
        }
        places
    }

    /// Moves levels to these places, and makes what lies within `stale` (m) anew.
    pub(super) fn follow(
        &mut self,
        context: &Context<'_>,
        places: &[Place],
        stale: &[(Vec3, Vec3)],
    ) -> Result<FrameStats, Error> {
        let stats = self.move_levels(context, 0..places.len(), places, stale)?;
        self.tell_places(context.gpu, places)?;
        Ok(stats)
    }

    /// Moves some levels, all at once.
    pub(super) fn move_levels(
        &mut self,
        context: &Context<'_>,
        range: Range<usize>,
        places: &[Place],
        stale: &[(Vec3, Vec3)],
    ) -> Result<FrameStats, Error> {
        let [carries_gathered, lights_slabs] = [
            self.light_settings.bounces == LightBounces::Feedback,
            self.lights_slabs(),
        ];
        let touched: Vec<Vec<VoxelBox>> = (self.levels[range.clone()].iter())
            .map(|level| {
                stale
                    .iter()
                    .map(|bounds| level.window.touched(*bounds))
                    .collect()
            })
            .collect();
        let levels = self.levels[range.clone()].iter_mut();
        let moves = levels.zip(&places[range.clone()]).zip(&touched);
        let moves = moves.map(|((level, place), stale)| {
            let light = &mut level.light;
            let carried = match &mut light.irradiance {
                Some(irradiance) if carries_gathered => {
                    Some((irradiance, light.settings.sides as u32))
                }
                _ if lights_slabs => Some((&mut light.radiance, light.settings.radiances())),
                _ => None,
            };
            WindowMove {
                window: &mut level.window,
                first: place.first,
                stale,
                carried,
            }
        });
        let scratch = &mut self.scratch;
        let (new, stats) = move_windows(context.gpu, context.scene, scratch, moves.collect())?;
        for (index, boxes) in range.zip(new) {
            let level = &mut self.levels[index];
            let place = places[index];
            if level.window.voxels.capacity() > level.light.capacity {
                (level.light).reserve(context.gpu, &level.window.voxels)?;
            }
            if !boxes.is_empty() {
                let stays = self.layout.stays_lit(level.place.first, place.first);
                level.lit = if lights_slabs {
                    level.lit.cut(stays)
                } else {
                    VoxelBox::NONE
                };
            }
            self.is_placed &= level.place == place && boxes.is_empty();
            level.place = place;
            level.new.extend(boxes);
        }
        Ok(stats)
    }

    /// Tells the shaders where the levels are, where they do not know.
    pub(super) fn tell_places(&mut self, gpu: &Gpu, places: &[Place]) -> Result<(), Error> {
        if std::mem::replace(&mut self.is_placed, true) {
            return Ok(());
        }
        if let Some(volume) = &self.volume {
            volume.set_places(gpu, places)?;
        }
        (self.space.as_mut()).map_or(Ok(()), |space| space.follow(gpu, &self.levels, places))
    }

    /// Where the texels of a level are made from the next finer level.
    pub(super) fn inner(&self, level: usize) -> Inner {
        level.checked_sub(1).map_or(Inner::NONE, |finer| {
            self.layout.inner(self.levels[finer].place)
        })
    }

    /// Whether voxels that stay in a level keep their light: it depends on nothing but their
    /// neighbours and the lights.
    pub(super) fn lights_slabs(&self) -> bool {
        let settings = &self.light_settings;
        !settings.bounces.any() && !settings.traces() && settings.emission == EmissionSeenBy::All
    }

    /// Whether a level has voxels without light, or texels that are not what they would be.
    pub(super) fn is_changed(&self, index: usize) -> bool {
        let level = &self.levels[index];
        !level.is_lit()
            || !level.new.is_empty()
            || !level.stale.is_empty()
            || level.inner != self.inner(index)
    }

    /// The levels whose texels are made anew in this frame.
    pub(super) fn due(&mut self) -> Vec<usize> {
        let count = self.levels.len();
        // A level that has moved shows nothing of what it held before.
        let follows = |technique: &Self, index: usize| {
            technique.is_due(index) || !technique.levels[index].new.is_empty()
        };
        let bounces = self.light_settings.bounces;
        if self.light_settings.emission != EmissionSeenBy::All {
            // Where the emission comes in another way, all levels show either what voxels see or
            // what the picture sees.
            self.levels
                .iter_mut()
                .for_each(|level| level.lit = VoxelBox::NONE);
            return (0..count).collect();
        }
        if bounces == LightBounces::Feedback
            || (bounces.any() && (0..count).any(|index| self.is_changed(index)))
        {
            // Each voxel gathers from all levels.
            self.levels
                .iter_mut()
                .for_each(|level| level.lit = VoxelBox::NONE);
        }
        let mut due: Vec<usize> = Vec::new();
        for index in 0..count {
            let finer_is_due = index
                .checked_sub(1)
                .is_some_and(|finer| due.last() == Some(&finer));
            if follows(self, index) && (finer_is_due || self.is_changed(index)) {
                due.push(index);
            }
        }
        due
    }

    /// Adds the passes that light the levels that are due, and make their texels.
    pub(super) fn light_due(&mut self, frame: &mut Frame, lights: LightInputs<'_>) {
        let due = self.due.clone();
        if due.iter().any(|index| !self.levels[*index].is_lit()) {
            self.bound_tiles(frame, lights.rsm);
        }
        if due.iter().any(|index| !self.levels[*index].new.is_empty()) {
            self.mark_filled(frame, &due);
        }
        let mut changed = VoxelBox::NONE;
        for index in due.iter().copied() {
            changed = self.update_level(frame, lights, index);
            if let Some(coarser) = self.levels.get_mut(index + 1) {
                coarser.stale = coarser.stale.around(changed.coarser());
            }
        }
        if let Some(space) = &mut self.space {
            space.light(frame, &self.levels);
        }
        self.frame += 1;
        if due
            .last()
            .is_some_and(|last| *last + 1 == self.levels.len())
        {
            self.filter_top(frame, changed);
        }
    }

    /// Adds the passes that mark which texels may be other than zero. A level that is not due still
    /// has the texels that the next finer one made of it before.
    fn mark_filled(&mut self, frame: &mut Frame, due: &[usize]) {
        let Some(volume) = &mut self.volume else {
            return;
        };
        let levels = self.levels.iter().enumerate();
        let marked: Vec<Marked<'_>> = levels
            .map(|(index, level)| Marked {
                first: level.place.first,
                occupancy: &level.window.voxels.occupancy,
                new: &level.new,
                is_kept: !due.contains(&index),
            })
            .collect();
        volume.filled.mark(frame, &marked);
    }

    /// Adds the pass that injection into levels needs, unless its result is kept and nothing has
    /// moved since.
    pub(super) fn bound_tiles(&mut self, frame: &mut Frame, maps: &LightMaps) {
        let is_bound = self.bound.as_ref().is_some_and(|(bound, moves)| {
            Arc::ptr_eq(bound, &maps.tiles[0]) && *moves == maps.moves
        });
        if !is_bound {
            voxel::bound_tiles(frame, maps);
            self.bound = Some((Arc::clone(&maps.tiles[0]), maps.moves));
        }
    }

    /// Adds the passes that light the voxels of a level that are not lit, and make its texels where
    /// they are not what they would be; returns where.
    pub(super) fn update_level(
        &mut self,
        frame: &mut Frame,
        lights: LightInputs<'_>,
        index: usize,
    ) -> VoxelBox {
        let inner = self.inner(index);
        let level = &mut self.levels[index];
        let (extent, left) = (level.extent(), level.inner.region());
        let changed = if !level.is_lit() {
            let records = VoxelRecords {
                kept: level.lit,
                ..VoxelRecords::from(&level.window.voxels)
            };
            let voxels = &level.window.voxels;
            let bound = [
                ("occupancy", &voxels.occupancy),
                ("block_bases", &voxels.block_bases),
            ];
            let lookup = VoxelLookup::by_occupancy(&records, &bound);
            level
                .light
                .update_records(frame, &records, lookup, lights, None);
            if let Some(space) = &mut self.space {
                space.forget_light(index);
            }
            extent
        } else if level.inner != inner {
            left.around(inner.region())
        } else {
            level.stale.cut(inner.region())
        };
        let new = std::mem::take(&mut level.new);
        (level.inner, level.stale) = (inner, VoxelBox::NONE);
        level.lit = extent;
        // A voxel that has gone leaves its texel behind, and so does a finer level that has moved
        // away.
        if let Some(volume) = &self.volume {
            for cleared in new
                .into_iter()
                .chain(left.cut(extent).without(inner.region()))
            {
                volume.clear_box(frame, index as u32, cleared);
            }
        }
        self.write_level(frame, index, changed);
        changed
    }

    /// Adds the passes that make the texels of a level in `region` from its voxels and the next
    /// finer level. Where neither has any, they have to be empty before.
    pub(super) fn write_level(&self, frame: &mut Frame, index: usize, region: VoxelBox) {
        let Some(volume) = &self.volume else { return };
        let (level, number, inner) = (&self.levels[index], index as u32, self.inner(index));
        let voxels = &level.window.voxels;
        volume.write_voxels(frame, number, region, &inner, voxels, &level.light);
        volume.filter_inner(frame, number, region, &inner, voxels);
    }

    /// Adds the passes that make the mips above the outermost level, where its texels in `region`
    /// are seen.
    pub(super) fn filter_top(&self, frame: &mut Frame, region: VoxelBox) {
        if let Some(volume) = &self.volume {
            volume.filter_top(frame, self.outermost().place.first, region);
        }
    }

    pub(super) fn outermost(&self) -> &Level {
        &self.levels[self.levels.len() - 1]
    }

    /// What the cones of voxels march through.
    pub(super) fn seen_by_voxels(&self) -> Option<Volume<'_>> {
        let outermost = self.levels.last()?;
        Some(self.volume.as_ref()?.as_seen_by_voxels(outermost.place))
    }
}
