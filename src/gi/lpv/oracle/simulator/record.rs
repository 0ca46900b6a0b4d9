//! Numbers of each action.

use super::{
    Account, Action, Errors, Propagator, Run, Setup, Structure, difference, errors_to,
    errors_within,
};
use crate::gi::lpv::oracle::lobes::Lobe;

/// What is known after an action.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Its name.
    pub action: &'static str,
    /// Steps so far.
    pub steps: u32,
    /// Where the flux is (W).
    pub account: Account,
    /// How far the centre of what is on its way has moved (finest cells).
    pub moved_cells: f64,
    /// Of levels against the mean of the finer one.
    pub within: Option<Errors>,
    /// Of levels against the mean of a uniform grid after as many steps.
    pub to_uniform: Option<Errors>,
    /// Of the merged grid against a uniform one after the steps of the reference: root of the mean
    /// square over that of the latter.
    pub to_reference: Option<f64>,
}

/// The columns of [`Record::csv`].
pub const CSV_HEADER: &str = "propagator,action,steps,injected_w,on_its_way_w,left_w,absorbed_w,\
    lost_w,moved_cells,e_abs,e_rel,e_worst,uniform_e_abs,uniform_e_rel,uniform_e_worst,\
    to_reference";

/// A run, and what is compared with it.
pub struct Recorder {
    /// At work.
    pub run: Run,
    /// One record an action.
    pub records: Vec<Record>,
    uniform: Option<Run>,
    reference: Option<Vec<Lobe>>,
}

/// A uniform grid of the same steps.
fn uniform(propagator: &Propagator) -> Propagator {
    Propagator {
        structure: Structure::Uniform,
        ..propagator.clone()
    }
}

impl Recorder {
    /// Before any action. With `reference_steps`, merged grids are compared with a uniform one
    /// after so many.
    pub fn new(setup: &Setup, propagator: &Propagator, reference_steps: Option<u32>) -> Self {
        let run = Run::new(setup, propagator);
        let reference = reference_steps.and_then(|steps| {
            let mut reference = Run::new(setup, &uniform(propagator));
            for action in Run::automatic(Structure::Uniform, 1, steps) {
                reference.act(action);
            }
            reference.levels[0].sum.lobes().map(<[Lobe]>::to_vec)
        });
        let is_compared = propagator.structure == Structure::Octree;
        Recorder {
            uniform: is_compared.then(|| Run::new(setup, &uniform(propagator))),
            run,
            records: Vec::new(),
            reference,
        }
    }

    /// Does one thing, and writes down what is known after it.
    pub fn act(&mut self, action: Action) {
        self.run.act(action);
        let name = match action {
            Action::Inject => "inject",
            Action::Downsample => "downsample",
            Action::Step(_) => "step",
            Action::Merge => "merge",
        };
        // The uniform grid has one level, of which all levels' step is one.
        if let Some(uniform) = &mut self.uniform
            && matches!(action, Action::Inject | Action::Step(None | Some(0)))
        {
            uniform.act(action);
        }
        let grids: Vec<_> = self.run.levels.iter().map(|level| level.grid).collect();
        let fields = self.run.fields().filter(|_| self.uniform.is_some());
        let uniform = self.uniform.as_ref();
        let uniform = uniform.and_then(|uniform| uniform.levels[0].sum.lobes());
        self.records.push(Record {
            action: name,
            steps: self.run.steps(),
            account: self.run.account(),
            moved_cells: self.run.moved().length(),
            within: fields.as_ref().map(|fields| errors_within(&grids, fields)),
            to_uniform: fields
                .as_ref()
                .zip(uniform)
                .map(|(fields, uniform)| errors_to(&grids, fields, uniform)),
            to_reference: self.difference_to_reference(),
        });
    }

    /// Of the grid as it would be merged now.
    fn difference_to_reference(&self) -> Option<f64> {
        let reference = self.reference.as_ref()?;
        let mut run = self.run.clone();
        run.act(Action::Merge);
        let merged = run.merged?;
        Some(difference(merged.lobes()?, reference))
    }
}

impl Record {
    /// A line of the columns of [`CSV_HEADER`].
    pub fn csv(&self, propagator: &str) -> String {
        let Account {
            injected,
            on_its_way,
            left,
            absorbed,
            ..
        } = self.account;
        let errors = |errors: Option<Errors>| {
            errors.map_or_else(
                || ",,".to_owned(),
                |errors| format!("{},{},{}", errors.absolute, errors.relative, errors.worst),
            )
        };
        format!(
            "{propagator},{},{},{injected},{on_its_way},{left},{absorbed},{},{},{},{},{}",
            self.action,
            self.steps,
            self.account.lost(),
            self.moved_cells,
            errors(self.within),
            errors(self.to_uniform),
            self.to_reference
                .map_or_else(String::new, |value| value.to_string()),
        )
    }
}
