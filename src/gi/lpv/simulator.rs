//! The simulator as the window has it: settings, actions, figures, drawing.

use glam::DVec3;

use super::oracle::simulator::{
    Action, Injector, Occluder, PROPAGATORS, Propagator, Recorder, Run, Setup, Shown, Slice,
    Spread, Structure, Which, draw_slice, scene_setup,
};
use crate::gi::Settings;
use crate::gi::settings::{Domain, Group, Rule, Setting};
use crate::gi::simulator::{ActionRow, Drawing, LitScene, Simulator, SimulatorRow};
use crate::text::short;

/// Powers of ten of logarithmic lengths.
const DECADES: f64 = 4.0;

static SETTINGS: &[Setting] = &[
    Setting {
        name: "injector",
        help: "where light starts in an empty cube: a wall, all cells of a layer across the \
               direction; or the middle cell; or what the lights of the window's scene make of \
               its surfaces, which are opaque faces then",
        unit: "",
        domain: Domain::Choice(&["wall", "cell", "scene"]),
        default: "wall",
    },
    Setting {
        name: "direction",
        help: "main direction of the light",
        unit: "",
        domain: Domain::Choice(&["+x", "-x", "+y", "-y", "+z", "-z", "diagonal"]),
        default: "+x",
    },
    Setting {
        name: "multiplier",
        help: "flux of each cell; of a scene, a factor",
        unit: "W",
        domain: Domain::Number {
            min: 0.001,
            max: 1000.0,
        },
        default: "1",
    },
    Setting {
        name: "occluder",
        help: "opaque faces in the middle: across the half of the grid with the low cells",
        unit: "",
        domain: Domain::Choice(&["none", "x", "y", "z"]),
        default: "none",
    },
    Setting {
        name: "propagator",
        help: "lobes or discrete directions on one grid; octree: on the published levels; \
               residual: on levels that take over what the finer one has left",
        unit: "",
        domain: Domain::Choice(&PROPAGATORS),
        default: "lobes30",
    },
    Setting {
        name: "cells",
        help: "along each axis, or along the longest side of the scene",
        unit: "",
        domain: Domain::OneOf(&[8, 12, 16, 24, 32, 48]),
        default: "16",
    },
    Setting {
        name: "directions",
        help: "along which ordinates sends light",
        unit: "",
        domain: Domain::Count { min: 8, max: 256 },
        default: "96",
    },
    Setting {
        name: "gain",
        help: "fraction of the flux that goes on at each step",
        unit: "",
        domain: Domain::Number { min: 0.1, max: 1.0 },
        default: "1",
    },
    Setting {
        name: "clamp_negative",
        help: "negative flux is none",
        unit: "",
        domain: Domain::Choice(&["off", "on"]),
        default: "off",
    },
];

static SHOWN: &[Setting] = &[
    Setting {
        name: "axis",
        help: "the slice is across it",
        unit: "",
        domain: Domain::Choice(&["x", "y", "z"]),
        default: "z",
    },
    Setting {
        name: "index",
        help: "which of the finest cells along it",
        unit: "",
        domain: Domain::Count { min: 0, max: 47 },
        default: "8",
    },
    Setting {
        name: "show",
        help: "all levels, as merged last; or of one level what the last step has read, what it \
               has left, or the sum of all steps",
        unit: "",
        domain: Domain::Choice(&["merged", "source", "target", "sum"]),
        default: "target",
    },
    Setting {
        name: "level",
        help: "0 the finest: the one that step-level steps, and that is shown but for merged",
        unit: "",
        domain: Domain::Count { min: 0, max: 6 },
        default: "0",
    },
    Setting {
        name: "lengths",
        help: "of lobes: by intensity, or by its logarithm over four powers of ten",
        unit: "",
        domain: Domain::Choice(&["linear", "log"]),
        default: "linear",
    },
];

static RULES: &[Rule] = &[
    Rule {
        group: Group::Other,
        settings: &["direction"],
        applies: |settings| !settings.is("injector", "scene"),
    },
    Rule {
        group: Group::Other,
        settings: &["directions"],
        applies: |settings| settings.is("propagator", "ordinates"),
    },
    Rule {
        group: Group::Other,
        settings: &["clamp_negative"],
        applies: |settings| {
            let name = settings.choice("propagator");
            name.ends_with("lobes30") || name.ends_with("axis6")
        },
    },
];

/// In the order of [`SIMULATOR`]'s actions; the last is of the level that is shown.
const ACTIONS: [Action; 5] = [
    Action::Inject,
    Action::Downsample,
    Action::Step(None),
    Action::Merge,
    Action::Step(Some(0)),
];

/// The row of the techniques that have it.
pub static SIMULATOR: SimulatorRow = SimulatorRow {
    summary: "light goes from cell to cell on the CPU, one action after the other",
    settings: SETTINGS,
    shown: SHOWN,
    rules: RULES,
    actions: &[
        ActionRow {
            name: "inject",
            help: "puts the light of the injector into the finest level",
        },
        ActionRow {
            name: "downsample",
            help: "fills coarser levels with means; of a residual propagator, hands what is on \
                   its way to the next level",
        },
        ActionRow {
            name: "step",
            help: "each cell hands its light to its neighbours once, in all levels; of a residual \
                   propagator, in the level that light is on its way in",
        },
        ActionRow {
            name: "merge",
            help: "brings all levels onto the finest grid",
        },
        ActionRow {
            name: "step-level",
            help: "one step of the level that is chosen below alone",
        },
    ],
    make,
};

/// The bench with what it has written down.
struct Bench(Recorder);

fn make(settings: &Settings, lit: &LitScene<'_>) -> Result<Box<dyn Simulator>, String> {
    let (cells, multiplier) = (
        settings.count("cells"),
        f64::from(settings.number("multiplier")),
    );
    let mut setup = if settings.is("injector", "scene") {
        scene_setup(lit, cells, multiplier).map_err(|error| error.to_string())?
    } else {
        let mut setup = Setup::empty(cells);
        let injector = match settings.choice("injector") {
            "cell" => Injector::Cell {
                cell: None,
                direction: None,
            },
            _ => Injector::Wall {
                layer: None,
                direction: None,
            },
        };
        injector.inject(&mut setup, multiplier, main_direction(settings))?;
        setup
    };
    if let Some(axis) = axis(settings.choice("occluder")) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let occluder = Occluder {
            axis,
            plane: setup.grid.size[axis] / 2,
            across: Some([[0, setup.grid.size[u] / 2], [0, setup.grid.size[v]]]),
        };
        occluder.close(&mut setup)?;
    }
    setup.gain = f64::from(settings.number("gain"));
    setup.clamp_negative = settings.is("clamp_negative", "on");
    let propagator = Propagator::new(settings.choice("propagator"), settings.count("directions"))?;
    Ok(Box::new(Bench(Recorder::new(&setup, &propagator, None))))
}

fn axis(name: &str) -> Option<usize> {
    ["x", "y", "z"].iter().position(|axis| *axis == name)
}

fn main_direction(settings: &Settings) -> DVec3 {
    match settings.choice("direction") {
        "+x" => DVec3::X,
        "-x" => DVec3::NEG_X,
        "+y" => DVec3::Y,
        "-y" => DVec3::NEG_Y,
        "+z" => DVec3::Z,
        "-z" => DVec3::NEG_Z,
        _ => DVec3::ONE.normalize(),
    }
}

impl Bench {
    /// The level that is chosen, or the coarsest where there are fewer.
    fn level(&self, shown: &Settings) -> usize {
        (shown.count("level") as usize).min(self.0.run.levels.len() - 1)
    }
}

impl Simulator for Bench {
    fn act(&mut self, action: usize, shown: &Settings) {
        self.0.act(match ACTIONS[action] {
            Action::Step(Some(_)) => Action::Step(Some(self.level(shown))),
            action => action,
        });
    }

    fn automatic(&self, steps: u32) -> Vec<usize> {
        let run = &self.0.run;
        let actions = Run::automatic(run.propagator.structure, run.levels.len(), steps);
        let at = |action: &Action| ACTIONS.iter().position(|known| known == action);
        actions.iter().filter_map(at).collect()
    }

    fn figures(&self) -> Vec<(&'static str, String)> {
        let run = &self.0.run;
        let account = run.account();
        let watts = |flux: f64| format!("{} W", short(flux));
        let levels = match run.propagator.structure {
            Structure::Octree => format!("{}, each with its own light", run.levels.len()),
            _ => run.levels.len().to_string(),
        };
        let mut figures = vec![
            ("steps", run.steps().to_string()),
            ("levels", levels),
            ("injected", watts(account.injected)),
            ("on its way", watts(account.on_its_way)),
            ("left", watts(account.left)),
            ("absorbed", watts(account.absorbed)),
            ("lost", watts(account.lost())),
            (
                "centre moved",
                format!("{} cells", short(run.moved().length())),
            ),
        ];
        if let Some(last) = self.0.records.last() {
            let radiance = |value: f64| format!("{} W/(m² sr)", short(value));
            let of = [
                (last.within, ["e_abs", "e_rel"]),
                (last.to_uniform, ["e_abs to one grid", "e_rel to one grid"]),
            ];
            for (errors, [absolute, relative]) in of {
                let Some(errors) = errors else { continue };
                figures.push((absolute, radiance(errors.absolute)));
                figures.push((relative, short(errors.relative)));
            }
        }
        figures
    }

    fn most(&self, setting: &str) -> Option<u32> {
        let run = &self.0.run;
        match setting {
            "index" => Some(run.levels[0].grid.size.max_element() - 1),
            "level" => Some(run.levels.len() as u32 - 1),
            _ => None,
        }
    }

    fn draw(&self, shown: &Settings) -> Drawing {
        let run = &self.0.run;
        let axis = axis(shown.choice("axis")).unwrap_or(2);
        let level = self.level(shown);
        let what = match shown.choice("show") {
            "source" => Shown::Level(level, Which::Source),
            "target" => Shown::Level(level, Which::Target),
            "sum" => Shown::Level(level, Which::Sum),
            _ => Shown::Merged,
        };
        let slice = Slice {
            axis,
            index: shown.count("index").min(run.levels[0].grid.size[axis] - 1),
        };
        let spread = if shown.is("lengths", "log") {
            Spread::Log(DECADES)
        } else {
            Spread::Linear
        };
        draw_slice(run, slice, what, spread)
    }
}
