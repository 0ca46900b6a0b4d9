//! A propagator at work, action by action.

use glam::DVec3;

use super::account::{Account, flux_and_moment};
use super::light::{Light, Shape};
use super::{Propagator, Setup, Structure};
use crate::gi::lpv::CellGrid;
use crate::gi::lpv::oracle::lobes::Lobe;
use crate::gi::lpv::oracle::octree::{index_volume, merge_finest, merge_sum};

/// What can be done to a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Puts the light of all injectors into the finest level.
    Inject,
    /// Fills the coarser levels with means; of [`Structure::Residual`], hands what is on its way in
    /// the last level that has any to the next one.
    Downsample,
    /// One step: of all levels, or of one. Of [`Structure::Residual`], of the level that light is
    /// on its way in.
    Step(Option<usize>),
    /// Brings all levels onto the finest grid.
    Merge,
}

/// One grid of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Where its cells are.
    pub grid: CellGrid,
    /// Opaque faces of its cells, six bits each.
    pub faces: Vec<u32>,
    /// What the last step has read.
    pub source: Light,
    /// What it has left, which the next one reads.
    pub target: Light,
    /// All that was injected and that steps have left.
    pub sum: Light,
    /// Steps so far.
    pub steps: u32,
    /// Where its flux is.
    pub account: Account,
    /// Σ of flux (W) times place (finest cells), of what is on its way.
    moment: DVec3,
}

/// A propagator at work.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// How light is handed on.
    pub propagator: Propagator,
    /// The finest first.
    pub levels: Vec<Level>,
    /// All levels on the finest grid, since the last merge.
    pub merged: Option<Light>,
    /// Of each of the finest cells, the finest level that has light there, since the last merge.
    pub index: Vec<u32>,
    /// The level that light is on its way in; of [`Structure::Residual`].
    active: usize,
    start: DVec3,
    setup: Setup,
}

impl Run {
    /// Before any action.
    pub fn new(setup: &Setup, propagator: &Propagator) -> Self {
        let level = |(grid, faces)| {
            let dark = Light::dark(&grid, &propagator.transport);
            Level {
                grid,
                faces,
                source: dark.clone(),
                target: dark.clone(),
                sum: dark,
                steps: 0,
                account: Account::default(),
                moment: DVec3::ZERO,
            }
        };
        let levels = setup.levels(propagator.structure);
        Run {
            propagator: propagator.clone(),
            levels: levels.into_iter().map(level).collect(),
            merged: None,
            index: vec![0; setup.grid.count() as usize],
            active: 0,
            start: DVec3::ZERO,
            setup: setup.clone(),
        }
    }

    /// Does one thing.
    pub fn act(&mut self, action: Action) {
        match action {
            Action::Inject => self.inject(),
            Action::Downsample => match self.propagator.structure {
                Structure::Uniform => {}
                Structure::Octree => self.average(),
                Structure::Residual => self.hand_over(),
            },
            Action::Step(Some(level)) => self.step(level),
            Action::Step(None) if self.propagator.structure == Structure::Residual => {
                self.step(self.active);
            }
            Action::Step(None) => (0..self.levels.len()).for_each(|level| self.step(level)),
            Action::Merge => self.merge(),
        }
    }

    /// Everything in its order, with so many steps a level.
    pub fn automatic(structure: Structure, level_count: usize, steps: u32) -> Vec<Action> {
        let step = vec![Action::Step(None); steps as usize];
        let mut actions = vec![Action::Inject];
        match structure {
            Structure::Uniform => actions.extend(step),
            Structure::Octree => {
                actions.push(Action::Downsample);
                actions.extend(step);
            }
            Structure::Residual => {
                for level in 0..level_count {
                    if level > 0 {
                        actions.push(Action::Downsample);
                    }
                    actions.extend(&step);
                }
            }
        }
        actions.push(Action::Merge);
        actions
    }

    fn inject(&mut self) {
        let light = Light::injected(&self.setup, &self.propagator.transport);
        self.levels[0].take(0, light, true);
        let level = &self.levels[0];
        if level.account.on_its_way > 0.0 {
            self.start = level.moment / level.account.on_its_way;
        }
    }

    fn average(&mut self) {
        for level in 1..self.levels.len() {
            let (finer, own) = (&self.levels[level - 1], &self.levels[level]);
            let light = finer.target.coarser(&finer.grid, &own.grid, true);
            self.levels[level].replace(level, light);
        }
    }

    fn hand_over(&mut self) {
        let next = self.active + 1;
        if next == self.levels.len() {
            return;
        }
        let (finer, own) = (&self.levels[self.active], &self.levels[next]);
        let light = finer.target.coarser(&finer.grid, &own.grid, false);
        // The finer level has counted this light where it is.
        self.levels[next].take(next, light, false);
        let finer = &mut self.levels[self.active];
        finer.account.handed_on += finer.account.on_its_way;
        finer.account.on_its_way = 0.0;
        finer.moment = DVec3::ZERO;
        self.active = next;
    }

    fn step(&mut self, at: usize) {
        let level = &mut self.levels[at];
        let place = (&level.grid, level.faces.as_slice());
        let how = (self.setup.gain, self.setup.clamp_negative);
        let (after, taken) = level.target.step(place, &self.propagator.transport, how);
        level.account.left += taken.left;
        level.account.absorbed += taken.absorbed;
        level.source = std::mem::replace(&mut level.target, after);
        level.sum.add(&level.target);
        level.steps += 1;
        level.weigh(at);
    }

    fn merge(&mut self) {
        let grids: Vec<CellGrid> = self.levels.iter().map(|level| level.grid).collect();
        let fields: Option<Vec<Vec<Lobe>>> = self
            .levels
            .iter()
            .map(|level| level.sum.lobes().map(<[Lobe]>::to_vec))
            .collect();
        self.merged = Some(match (self.propagator.structure, fields) {
            (Structure::Octree, Some(fields)) => {
                self.index = index_volume(&grids, &fields);
                Light::Lobes(merge_finest(&grids, &fields))
            }
            (Structure::Residual, Some(fields)) => Light::Lobes(merge_sum(&grids, &fields)),
            _ => self.levels[0].sum.clone(),
        });
    }

    /// Steps so far: of the level that has most, or of all levels that light has gone through one
    /// after the other.
    pub fn steps(&self) -> u32 {
        let steps = self.levels.iter().map(|level| level.steps);
        match self.propagator.structure {
            Structure::Residual => steps.sum(),
            _ => steps.max().unwrap_or(0),
        }
    }

    /// Flux of all levels; what one has handed to the next is counted once.
    pub fn account(&self) -> Account {
        let mut all = Account::default();
        for (at, level) in self.levels.iter().enumerate() {
            if at == 0 || self.propagator.structure == Structure::Octree {
                all.injected += level.account.injected;
            }
            all.left += level.account.left;
            all.absorbed += level.account.absorbed;
            all.on_its_way += level.account.on_its_way;
        }
        all
    }

    /// How far the centre of what is on its way is from where it was injected (finest cells).
    pub fn moved(&self) -> DVec3 {
        let flux: f64 = self
            .levels
            .iter()
            .map(|level| level.account.on_its_way)
            .sum();
        let moment: DVec3 = self.levels.iter().map(|level| level.moment).sum();
        if flux == 0.0 {
            DVec3::ZERO
        } else {
            moment / flux - self.start
        }
    }

    /// The sums of all levels; `None` where light is along directions.
    pub fn fields(&self) -> Option<Vec<&[Lobe]>> {
        self.levels.iter().map(|level| level.sum.lobes()).collect()
    }

    /// Intensity of a cell of the merged grid.
    pub fn merged_shape(&self, cell: usize) -> Shape {
        let merged = self.merged.as_ref().unwrap_or(&self.levels[0].sum);
        merged.shape(&self.levels[0].grid, cell)
    }
}

impl Level {
    /// More light to hand on. What is not counted yet adds to the sum.
    fn take(&mut self, at: usize, light: Light, is_new: bool) {
        let before = self.account.on_its_way;
        if is_new {
            self.sum.add(&light);
        }
        self.target.add(&light);
        self.source = self.target.clone();
        self.weigh(at);
        self.account.injected += self.account.on_its_way - before;
    }

    /// Other light to hand on.
    fn replace(&mut self, at: usize, light: Light) {
        (self.source, self.target, self.sum) = (light.clone(), light.clone(), light);
        self.steps = 0;
        self.account = Account::default();
        self.weigh(at);
        self.account.injected = self.account.on_its_way;
    }

    fn weigh(&mut self, at: usize) {
        (self.account.on_its_way, self.moment) = flux_and_moment(&self.target, &self.grid, at);
    }
}
