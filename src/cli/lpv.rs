//! `lumivox lpv`: light goes from cell to cell, step by step.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::gi::lpv::oracle::simulator::{
    Action, CSV_HEADER, Injector, Occluder, Propagator, Recorder, Run, Setup, Shown, Slice, Spread,
    Structure, Transport, Which, direction, draw_slice, inject_file, scene_setup,
};
use crate::gi::simulator::LitScene;
use crate::measure::draw::Chart;
use crate::measure::lpv::{error_chart, flux_chart, reference_chart, write_drawing};
use crate::reference::light_surfaces;
use crate::scene::Scene;
use crate::text::{counted, quoted};

use super::CliError;
use super::common::{LoadArgs, each_once, progress_bar, say};
use super::files::{Files, check_results_folder};
use super::write::{check_output_folder, make_folder, write_text};

/// Powers of ten of `--log`.
const DECADES: f64 = 4.0;

/// Hand light from cell to cell on the CPU, step by step, by several propagators side by side;
/// draw slices of the grid as polar lobes, and plot flux and errors.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n\
\x20 lumivox lpv --injector wall --propagator lobes30 --propagator octree-lobes30 -o wall\n\
\x20 lumivox lpv --injector cell:4,16,16 --occluder x:12 --actions inject,step,step --show target \
 --each -o cell\n\
\x20 lumivox lpv bundled:cornell --propagator ordinates --iterations 64 -o cornell")]
pub(crate) struct Args {
    /// `bundled:NAME`, or the path of a .toml, .obj, .gltf or .glb file: what its lights make of
    /// its surfaces is injected, and its surfaces are opaque faces.
    #[arg(required_unless_present = "injector", conflicts_with = "injector")]
    scene: Option<OsString>,
    /// Light in an empty cube of cells of 1 m, where there is no scene: wall, cell, or the path of
    /// a .toml file; may be repeated. wall[:LAYER[:DIRECTION]] is all cells of a layer across the
    /// direction, cell[:X,Y,Z[:DIRECTION]] is one.
    #[arg(long, value_name = "KIND|FILE")]
    injector: Vec<OsString>,
    /// Flux of each cell of wall and cell (W); a factor of the light of files and scenes.
    #[arg(long, value_name = "X", default_value_t = 1.0)]
    multiplier: f64,
    /// Direction of injectors that name none.
    #[arg(long, value_name = "X,Y,Z", default_value = "1,0,0", value_parser = direction,
        allow_hyphen_values = true)]
    direction: DVec3,
    /// Opaque faces before cell PLANE of an axis: AXIS:PLANE, or AXIS:PLANE:LOW..END:LOW..END for
    /// a part along the two next axes (of y: z, then x); may be repeated.
    #[arg(long, value_name = "PLACE", value_parser = Occluder::parse)]
    occluder: Vec<Occluder>,
    /// Cells along each axis, or along the longest side of the scene.
    #[arg(long, value_name = "N", default_value_t = 32,
        value_parser = clap::value_parser!(u32).range(4..=128))]
    cells: u32,
    /// lobes30, axis6, stream or ordinates on one grid; octree-lobes30 (or -axis6, -stream) on the
    /// published levels; residual-lobes30 (or …) on levels that take over what the finer one has
    /// left. May be repeated.
    #[arg(long, value_name = "NAME", default_value = "lobes30")]
    propagator: Vec<String>,
    /// Directions of ordinates.
    #[arg(long, value_name = "K", default_value_t = 96,
        value_parser = clap::value_parser!(u32).range(8..=1024))]
    directions: u32,
    /// Fraction of the flux that goes on at each step.
    #[arg(long, value_name = "G", default_value_t = 1.0)]
    gain: f64,
    /// Negative flux is none; of lobes30 and axis6.
    #[arg(long)]
    clamp_negative: bool,
    /// Steps of every level, with all other actions in their order.
    #[arg(long, value_name = "K", default_value_t = 8, conflicts_with = "actions",
        value_parser = clap::value_parser!(u32).range(0..=1024))]
    iterations: u32,
    /// Single actions instead: inject, downsample, step (all levels), step:LEVEL, merge.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = action)]
    actions: Vec<Action>,
    /// The slice: an axis, and a cell along it [default: z, the middle].
    #[arg(long, value_name = "AXIS:INDEX")]
    slice: Option<String>,
    /// A level, the finest being 0, or merged.
    #[arg(long, value_name = "L|merged", default_value = "merged")]
    level: String,
    /// Of a level: what the last step has read, what it has left, or all steps.
    #[arg(long, value_name = "source|target|sum", default_value = "sum", value_parser = which)]
    show: Which,
    /// Lengths by their logarithm, over four powers of ten.
    #[arg(long)]
    log: bool,
    /// Draw the slice after each action, not only after the last.
    #[arg(long)]
    each: bool,
    /// Compare merged grids with a uniform one after so many steps.
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..=4096))]
    reference_iterations: Option<u32>,
    /// Folder of the pictures, the plots and `steps.csv`; made where it does not exist.
    #[arg(short, long, alias = "out", value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    load: LoadArgs,
}

fn action(text: &str) -> Result<Action, String> {
    let of_level = text.strip_prefix("step:").map(str::parse);
    match (text, of_level) {
        ("inject", _) => Ok(Action::Inject),
        ("downsample", _) => Ok(Action::Downsample),
        ("step", _) => Ok(Action::Step(None)),
        ("merge", _) => Ok(Action::Merge),
        (_, Some(Ok(level))) => Ok(Action::Step(Some(level))),
        _ => Err(format!(
            "there is no action {}; there are inject, downsample, step, step:LEVEL and merge",
            quoted(text)
        )),
    }
}

fn which(text: &str) -> Result<Which, String> {
    match text {
        "source" => Ok(Which::Source),
        "target" => Ok(Which::Target),
        "sum" => Ok(Which::Sum),
        _ => Err(String::from("write source, target or sum")),
    }
}

/// Runs, draws, writes.
pub(crate) fn run(args: &Args, quiet: bool) -> Result<(), CliError> {
    check_output_folder(&args.output)?;
    check_number("--multiplier", args.multiplier, f64::MAX)?;
    check_number("--gain", args.gain, 1.0)?;
    let setup = setup(args)?;
    let slice = slice(args, &setup)?;
    let propagators: Vec<Propagator> = each_once(&args.propagator)
        .iter()
        .map(|name| Propagator::new(name, args.directions).map_err(CliError::input))
        .collect::<Result<_, _>>()?;
    check_memory(&setup, &propagators)?;
    let plans: Vec<Plan<'_>> = propagators
        .iter()
        .map(|propagator| Plan::new(args, &setup, propagator))
        .collect::<Result<_, _>>()?;
    make_folder(&args.output)?;
    let mut recorders = Vec::new();
    let bar = progress_bar(quiet, 0);
    for Plan {
        propagator,
        actions,
        shown,
    } in plans
    {
        bar.set_message(propagator.name.clone());
        let mut recorder = Recorder::new(&setup, propagator, args.reference_iterations);
        bar.inc_length(actions.len() as u64);
        for (number, action) in (1..).zip(&actions) {
            recorder.act(*action);
            bar.inc(1);
            let is_last = number == actions.len();
            if args.each || is_last {
                let name = if args.each {
                    format!("{}-{number:02}", propagator.name)
                } else {
                    propagator.name.clone()
                };
                let spread = if args.log {
                    Spread::Log(DECADES)
                } else {
                    Spread::Linear
                };
                let drawing = draw_slice(&recorder.run, slice, shown, spread);
                write_drawing(&drawing, &args.output.join(name)).map_err(CliError::failed)?;
            }
        }
        say(&summary(&recorder));
        recorders.push(recorder);
    }
    bar.finish_and_clear();
    write_numbers(args, &recorders)?;
    let notes = [notes(args, &setup)];
    let charts = [
        ("errors", error_chart(&recorders, &notes)),
        ("flux", flux_chart(&recorders, &notes)),
        ("reference", reference_chart(&recorders, &notes)),
    ];
    for (name, chart) in &charts {
        write_chart(chart.as_ref(), &args.output.join(name))?;
    }
    say(&format!("written to {}", args.output.display()));
    Ok(())
}

/// What is done with a propagator.
struct Plan<'p> {
    propagator: &'p Propagator,
    actions: Vec<Action>,
    shown: Shown,
}

impl<'p> Plan<'p> {
    fn new(args: &Args, setup: &Setup, propagator: &'p Propagator) -> Result<Self, CliError> {
        let levels = setup.level_count(propagator.structure);
        let actions = if args.actions.is_empty() {
            Run::automatic(propagator.structure, levels, args.iterations)
        } else {
            args.actions.clone()
        };
        check_actions(&actions, levels, &propagator.name)?;
        Ok(Plan {
            propagator,
            actions,
            shown: shown(args, levels, &propagator.name)?,
        })
    }
}

fn check_number(option: &str, value: f64, most: f64) -> Result<(), CliError> {
    if value > 0.0 && value <= most {
        return Ok(());
    }
    let most = if most < 2.0 {
        format!(" and at most {most}")
    } else {
        String::new()
    };
    Err(CliError::input(format!(
        "{option} is {value}; it must be above 0{most}"
    )))
}

/// Bytes of a propagator's cells, at most.
const MEMORY_MAX: usize = 8 << 30;

/// An error if the grids would not fit into a common memory.
fn check_memory(setup: &Setup, propagators: &[Propagator]) -> Result<(), CliError> {
    let bytes = |propagator: &Propagator| {
        let of_cell = match &propagator.transport {
            Transport::Lobes(_) => 4 * 4 * 8,
            Transport::Ordinates(directions) => 8 * directions.all.len(),
        };
        // Source, target, sum, and one that is being made.
        4 * of_cell * setup.grid.count() as usize
    };
    match propagators
        .iter()
        .find(|propagator| bytes(propagator) > MEMORY_MAX)
    {
        Some(large) => Err(CliError::input(format!(
            "{} would need {} GiB; take fewer --cells or --directions",
            large.name,
            bytes(large) >> 30
        ))),
        None => Ok(()),
    }
}

fn check_actions(actions: &[Action], levels: usize, name: &str) -> Result<(), CliError> {
    let is_beyond = |action: &&Action| matches!(action, Action::Step(Some(l)) if *l >= levels);
    match actions.iter().find(is_beyond) {
        Some(Action::Step(Some(level))) => Err(CliError::input(format!(
            "step:{level}: {name} has {}, from 0",
            counted(levels, "level")
        ))),
        _ => Ok(()),
    }
}

/// The scene's, or the empty cube with all injectors; with the occluders of the command.
fn setup(args: &Args) -> Result<Setup, CliError> {
    let mut setup = match &args.scene {
        Some(source) => {
            let scene = Scene::open(source, &args.load.options()).map_err(CliError::input)?;
            check_results_folder(&args.output, std::slice::from_ref(&scene))?;
            let lit = LitScene {
                scene: &scene,
                light: |scene, spacing_m| {
                    light_surfaces(scene, spacing_m).map_err(|error| error.to_string())
                },
            };
            scene_setup(&lit, args.cells, args.multiplier).map_err(CliError::input)?
        }
        None => {
            let mut setup = Setup::empty(args.cells);
            for injector in &args.injector {
                inject(args, injector, &mut setup)?;
            }
            setup
        }
    };
    for occluder in &args.occluder {
        occluder
            .close(&mut setup)
            .map_err(|error| CliError::input(format!("--occluder: {error}")))?;
    }
    (setup.gain, setup.clamp_negative) = (args.gain, args.clamp_negative);
    Ok(setup)
}

fn inject(args: &Args, injector: &OsString, setup: &mut Setup) -> Result<(), CliError> {
    let wrong = |error: String| CliError::input(format!("--injector: {error}"));
    if let Some(found) = injector.to_str().and_then(Injector::parse) {
        let found = found.map_err(wrong)?;
        return found
            .inject(setup, args.multiplier, args.direction)
            .map_err(wrong);
    }
    let path = Path::new(injector);
    Files::default().read(path)?;
    let text = std::fs::read_to_string(path).map_err(|error| {
        wrong(format!(
            "{}: {error}; name wall, cell or a .toml file",
            path.display()
        ))
    })?;
    let origin = path.display().to_string();
    inject_file(setup, (&origin, &text), args.multiplier).map_err(CliError::input)
}

fn slice(args: &Args, setup: &Setup) -> Result<Slice, CliError> {
    let size = setup.grid.size;
    let Some(text) = &args.slice else {
        return Ok(Slice {
            axis: 2,
            index: size.z / 2,
        });
    };
    let parts = text.split_once(':').and_then(|(axis, index)| {
        let axis = ["x", "y", "z"].iter().position(|name| *name == axis)?;
        Some((axis, index.parse().ok()?))
    });
    match parts {
        Some((axis, index)) if index < size[axis] => Ok(Slice { axis, index }),
        Some((axis, index)) => Err(CliError::input(format!(
            "--slice: {index} is outside of {} cells, which are counted from 0",
            size[axis]
        ))),
        None => Err(CliError::input(format!(
            "--slice is {text}; write an axis and a cell, as in z:16"
        ))),
    }
}

fn shown(args: &Args, levels: usize, name: &str) -> Result<Shown, CliError> {
    match (args.level.as_str(), args.level.parse::<usize>()) {
        ("merged", _) => Ok(Shown::Merged),
        (_, Ok(level)) if level < levels => Ok(Shown::Level(level, args.show)),
        (_, Ok(level)) => Err(CliError::input(format!(
            "--level {level}: {name} has {}, from 0",
            counted(levels, "level")
        ))),
        _ => Err(CliError::input(format!(
            "--level is {}; write a level or merged",
            quoted(&args.level)
        ))),
    }
}

fn write_numbers(args: &Args, recorders: &[Recorder]) -> Result<(), CliError> {
    let mut text = format!("{CSV_HEADER}\n");
    for recorder in recorders {
        for record in &recorder.records {
            text.push_str(&record.csv(&recorder.run.propagator.name));
            text.push('\n');
        }
    }
    write_text(&args.output.join("steps.csv"), &text)
}

fn write_chart(chart: Option<&Chart>, stem: &Path) -> Result<(), CliError> {
    chart.map_or(Ok(()), |chart| {
        chart.write(stem).map(drop).map_err(CliError::failed)
    })
}

fn notes(args: &Args, setup: &Setup) -> String {
    let [x, y, z] = setup.grid.size.to_array();
    let source = match &args.scene {
        Some(scene) => scene.to_string_lossy().into_owned(),
        None => {
            let names = args.injector.iter().map(|name| name.to_string_lossy());
            names.collect::<Vec<_>>().join(" ")
        }
    };
    format!("{source}, {x}×{y}×{z} cells, gain {}", args.gain)
}

fn summary(recorder: &Recorder) -> String {
    let account = recorder.run.account();
    let share = |flux: f64| {
        if account.injected == 0.0 {
            "0".to_owned()
        } else {
            format!("{:.4}", flux / account.injected)
        }
    };
    let mut text = format!(
        "{}: injected {:.4} W; of it on its way {}, left {}, absorbed {}, lost {}",
        recorder.run.propagator.name,
        account.injected,
        share(account.on_its_way),
        share(account.left),
        share(account.absorbed),
        share(account.lost())
    );
    if let Some(last) = recorder.records.last() {
        if let Some(errors) = last.within {
            text += &format!(
                "; e_abs {:.4}, e_rel {:.4}",
                errors.absolute, errors.relative
            );
        }
        if let Some(errors) = last.to_uniform {
            text += &format!(
                "; to uniform {:.4}, {:.4}",
                errors.absolute, errors.relative
            );
        }
        if let Some(difference) = last.to_reference {
            text += &format!("; to the reference {difference:.4}");
        }
    }
    if recorder.run.propagator.structure == Structure::Octree {
        text += " (each level has its own light)";
    }
    text
}
