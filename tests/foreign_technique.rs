//! A technique that the library does not know, added from outside, goes through every tool: the
//! renderer, every command, the page, the window and every case of the stress test. It has no
//! cells and no resolution, all bounces, a picture that settles over frames, and one view of its
//! own.
//!
//! The test is a program itself: it adds the technique and then is either the test or Lumivox.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used, clippy::expect_used)]

mod support {
    pub mod display;
    pub mod program;
    pub mod skip;

    pub use skip::{Missing, skipped};
}

use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use libtest_mimic::{Arguments, Trial};
use lumivox::gi::entry::{Entry, Stage};
use lumivox::gi::inspect::{Channels, Inspect, Scale, ViewRow};
use lumivox::gi::registry;
use lumivox::gi::settings::{Domain, Preset, Setting, Settings};
use lumivox::gi::{Change, Context, Inputs, MapNeeds, Needs, Technique};
use lumivox::graph::{Error, Frame, FrameStats, Gpu, Image};
use lumivox::image::{Aov, read_exr};
use lumivox::render::{GBuffer, Receivers};
use support::display::{Display, check_done};
use support::program::{AS_PROGRAM, OWN_PROGRAM, check_error, lumivox, words};

/// Half of what is missing comes with each frame: after these all but a thousandth is there.
const FRAMES_TO_REST: u32 = 10;

static PRESETS: &[Preset] = &[
    Preset {
        name: "dim",
        help: "little light everywhere",
        values: &[],
    },
    Preset {
        name: "bright",
        help: "more",
        values: &[&[("irradiance", "2")]],
    },
];

/// The same irradiance everywhere.
static TOY: Entry = Entry {
    bounces: |_| None,
    frames_to_rest: |_| FRAMES_TO_REST,
    settings: &[&[Setting {
        name: "irradiance",
        help: "of every pixel, in the end",
        unit: "W/m²",
        domain: Domain::Number { min: 0.0, max: 1e3 },
        default: "0.5",
    }]],
    presets: PRESETS,
    stages: &[&Stage::picture("filling", &["toy.fill"])],
    views: &[&[ViewRow {
        name: "toy-field",
        aliases: &["field"],
        help: "the irradiance, in space",
        unit: "W/m²",
        scale: Scale::Light,
        channels: Channels::Rgb,
    }]],
    ..Entry::new("toy", "the same irradiance everywhere", make)
};

fn make(_context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(Toy {
        irradiance: settings.number("irradiance"),
        frames: 0,
    }))
}

struct Toy {
    irradiance: f32,
    /// Since it was built, or a light or model moved.
    frames: u32,
}

impl Toy {
    fn texel(&self) -> [f32; 4] {
        let now = self.irradiance * (1.0 - 0.5f32.powi(self.frames as i32));
        [now, now, now, 1.0]
    }
}

impl Technique for Toy {
    fn needs(&self) -> Needs {
        Needs::maps(MapNeeds::Shadows)
    }

    fn build(&mut self, _context: &Context<'_>) -> Result<FrameStats, Error> {
        self.frames = 0;
        Ok(FrameStats::default())
    }

    fn follow(&mut self, _context: &Context<'_>, change: Change) -> Result<FrameStats, Error> {
        if change != Change::Camera {
            self.frames = 0;
        }
        Ok(FrameStats::default())
    }

    fn update(&mut self, _frame: &mut Frame, _given: &Inputs<'_>) {
        self.frames += 1;
    }

    fn gather(&mut self, frame: &mut Frame, _given: &Inputs<'_>, receivers: &Receivers<'_>) {
        frame.clear_image("toy.fill", receivers.light, self.texel());
    }
}

impl Inspect for Toy {
    fn counts(&self, _gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        Ok(vec![("frames", u64::from(self.frames))])
    }

    fn levels(&self, _view: &ViewRow) -> u32 {
        1
    }

    fn draw_view(
        &self,
        frame: &mut Frame,
        _view: (&ViewRow, u32),
        _gbuffer: &GBuffer,
        seen: &Arc<Image>,
    ) {
        frame.clear_image("toy.view", seen, self.texel());
    }
}

/// Runs a command that succeeds.
fn run(folder: &Path, line: &str) {
    check_done(&lumivox(folder, &words(line), &[]));
}

fn text(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn green(path: &Path) -> Vec<f32> {
    let image = read_exr(path).unwrap();
    image.pixels.iter().map(|pixel| pixel.y).collect()
}

/// A picture holds the irradiance, after the frames that it takes; the view shows it too; what is
/// not there is refused.
fn is_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let render = "render bundled:cornell --technique toy --size 16x12 --shadow-resolution 64";
    run(at, &format!("{render} --aov diffuse --frames 2 -o two.exr"));
    run(
        at,
        &format!("{render} --preset bright --aov diffuse --frames 10 --report r.json -o rest.exr"),
    );
    run(
        at,
        &format!("{render} --view field --frames 10 -o field.exr"),
    );
    let close = |values: &[f32], to: f32| values.iter().all(|value| (value - to).abs() < 2e-3);
    assert!(close(&green(&at.join("field.exr")), 0.5));
    let surfaces = |name: &str| {
        let all = green(&at.join(name));
        all.into_iter()
            .filter(|value| *value > 0.0)
            .collect::<Vec<_>>()
    };
    assert!(close(&surfaces("two.exr"), 0.375) && close(&surfaces("rest.exr"), 2.0));
    let report = text(&at.join("r.json"));
    assert!(report.contains("\"technique\": \"toy\"") && report.contains("\"frames\": 10"));
    for (words_, says) in [
        ("--view nothing", ["nothing", "toy-field"]),
        ("--view field --level 1", ["--level 1", "0 to 0"]),
        ("--set resolution=8", ["resolution", "irradiance"]),
    ] {
        let ran = lumivox(at, &words(&format!("{render} {words_} -o a.exr")), &[]);
        check_error(words_, &ran, 2, &says);
    }
}

/// Its times, memory and error stand beside another technique's, in tables and charts.
fn is_measured() {
    let folder = tempfile::tempdir().unwrap();
    run(
        folder.path(),
        "bench bundled:cornell --technique toy,none --preset dim,bright --resolution 16,32 --size \
         32x24 --shadow-resolution 64 --frames 2 --rebuilds 1 --max-error 0.2 --walk 4 -o bench",
    );
    let mut reports: Vec<String> = Vec::new();
    for file in std::fs::read_dir(folder.path().join("bench")).unwrap() {
        let path = file.unwrap().path();
        if path.extension().is_some_and(|kind| kind == "jsonl") {
            reports.extend(text(&path).lines().map(str::to_owned));
        }
    }
    let of_toy = |report: &&String| report.contains("\"technique\":\"toy\"");
    assert_eq!(reports.iter().filter(of_toy).count(), 2, "a preset each");
    let is_whole = |report: &String| report.contains("toy.fill") && report.contains("rel_rmse");
    assert!(reports.iter().filter(of_toy).all(is_whole));
}

/// A grid, its front, and the page, with what it says of presets and the command to see a picture.
fn is_charted() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(
        at.join("grid.toml"),
        "[[sweep]]\ntechnique = [\"toy\"]\npreset = [\"dim\", \"bright\"]\n[[sweep]]\ntechnique = \
         [\"toy\"]\nset = { irradiance = [0.1, 1.0] }\n",
    )
    .unwrap();
    run(
        at,
        "chart bundled:cornell --grid grid.toml --size 32x24 --shadow-resolution 64 --frames 1 \
         --rebuilds 1 --max-error 0.2 -o chart",
    );
    let page = text(&at.join("chart/chart.html"));
    for said in [
        "toy",
        "the same irradiance everywhere",
        "irradiance=2",
        "--technique toy",
        "--frames 10 -o picture.png",
    ] {
        assert!(page.contains(said), "the page does not say {said}");
    }
}

/// Its error budget. Without slots, maps and a resolution there are only two rows: the technique
/// unchanged, and finer shadow maps.
fn is_explained() {
    let folder = tempfile::tempdir().unwrap();
    run(
        folder.path(),
        "explain bundled:cornell --technique toy --size 32x24 --shadow-resolution 64 --max-error \
         0.2 --report budget.json",
    );
    let budget = text(&folder.path().join("budget.json"));
    assert!(budget.contains("as it is") && budget.contains("shadow maps"));
    assert!(!budget.contains("direct light"));
}

/// Every failure mode has a record; none is a failure of the program.
fn is_stressed() {
    let folder = tempfile::tempdir().unwrap();
    run(
        folder.path(),
        "stress --quick --technique toy --size 16x12 --shadow-resolution 32 -o stress",
    );
    let page = text(&folder.path().join("stress/stress.md"));
    for case in lumivox::measure::stress::CASES {
        assert!(page.contains(case.name), "{} is not there", case.name);
        let records = text(&folder.path().join(format!("stress/{}.jsonl", case.name)));
        assert!(
            records
                .lines()
                .all(|record| record.contains("\"technique\":\"toy\""))
        );
        assert!(!records.is_empty(), "{} has no record", case.name);
    }
}

/// The window shows the technique beside another one: its preset and setting, every section, its
/// view, and that it has no beam. The picture at rest is the command's picture.
fn is_seen() {
    let Some(display) = Display::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let mut script = String::from("technique left toy bright\nset left irradiance 3\nstill\n");
    for section in lumivox::view::SECTIONS {
        script += &format!("section {}\nframes 2\n", section.to_lowercase());
    }
    script += "view diffuse\nstill\nsave diffuse.exr\nview toy-field\nstill\nsave field.exr\n";
    script += "view full\nstill\nbeam 0.5 0.8 normal\nframes 2\nbeam off\n";
    script += "compare split\ntechnique right none\nstill\nscreenshot window.png\n";
    check_done(&display.view(
        folder.path(),
        &[
            "--size",
            "320x240",
            "--technique",
            "none",
            "--shadow-resolution",
            "64",
        ],
        &script,
    ));
    for name in ["diffuse.exr", "field.exr"] {
        let all = green(&folder.path().join(name));
        assert!(
            all.iter().all(|value| (0.0..3.005).contains(value)),
            "{name}"
        );
        assert!(all.iter().any(|value| *value > 2.995), "{name}");
    }
}

/// The list of techniques, and the name that is taken.
fn is_listed() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), "techniques toy");
    assert!(registry::find("toy").is_ok_and(|entry| std::ptr::eq(entry, &TOY)));
    assert!(registry::add(&TOY).is_err(), "twice");
    assert_eq!(TOY.view("toy-field"), TOY.view("field"));
    assert!(Aov::ALL.iter().all(|aov| aov.name() != "toy-field"));
}

fn main() -> ExitCode {
    registry::add(&TOY).unwrap();
    if std::env::var_os(AS_PROGRAM).is_some() {
        return lumivox::cli::run();
    }
    OWN_PROGRAM.set(std::env::current_exe().unwrap()).unwrap();
    let trials: [(&str, fn()); 7] = [
        ("is_listed", is_listed),
        ("is_rendered", is_rendered),
        ("is_measured", is_measured),
        ("is_charted", is_charted),
        ("is_explained", is_explained),
        ("is_stressed", is_stressed),
        ("is_seen", is_seen),
    ];
    let trials = trials.map(|(name, test)| {
        Trial::test(format!("foreign_technique::{name}"), move || {
            let start = std::time::Instant::now();
            test();
            eprintln!("{name}: {:.1} s", start.elapsed().as_secs_f64());
            Ok(())
        })
    });
    // Only libtest itself knows how to report times.
    let is_known = |argument: &OsString| argument != "--report-time";
    let arguments = Arguments::from_iter(std::env::args_os().filter(is_known));
    libtest_mimic::run(&arguments, trials.into()).exit_code()
}
