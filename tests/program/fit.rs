//! `lumivox fit`: what it answers, how it ends, and that its records are those of `lumivox chart`.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Output;

use crate::support::program::{check_error, command, lumivox, words};
use lumivox::measure::chart::Point;
use lumivox::measure::records::read_records;

const GRID: &str = "[[sweep]]\ntechnique = [\"voxel-mips\", \"svo\"]\npreset = [\"cones\", \
                    \"textbook\"]\nset = { resolution = [8, 16] }\n";

const SMALL: &str = "bundled:cornell --grid grid.toml --size 32x32 --frames 2 --rebuilds 2 \
                     --shadow-resolution 64";

/// A folder with a small grid.
fn place() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("grid.toml"), GRID).unwrap();
    folder
}

fn run(folder: &Path, line: &str) -> Output {
    let mut command = command();
    command
        .current_dir(folder)
        .env("LUMIVOX_CACHE", folder.join("cache"));
    command.args(words(line)).output().unwrap()
}

fn succeeded(output: &Output) -> String {
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// An answer within the bound, with a command that renders it; again, with the records, and then a
/// chart of the same grid: neither measures anything twice.
#[test]
fn an_answer_is_measured_once_and_shared_with_the_chart() {
    let place = place();
    let folder = place.path();
    let fit = format!("fit {SMALL} --noise 0.2 --max-error 0.9 -o out --report fit.json");
    let said = succeeded(&run(folder, &fit));
    assert!(said.contains("an error of at most 90%"), "{said}");
    let report = std::fs::read_to_string(folder.join("fit.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let best = &report["best"];
    let error = best["error"].as_f64().unwrap();
    assert!(error > 0.0 && error <= 0.9, "{report}");
    assert_eq!(report["grid_points"], 8);
    let render = said.lines().last().unwrap();
    assert_eq!(best["command"], render);
    succeeded(&run(folder, render.strip_prefix("lumivox ").unwrap()));
    assert!(folder.join("picture.png").is_file());

    let records = folder.join("out/cornell.jsonl");
    let before = read_records::<Point>(&records).unwrap();
    let again = succeeded(&run(folder, &fit));
    assert!(again.contains("an error of at most 90%"), "{again}");
    // Times differ, so what looks promising does; what is known is not measured again.
    let measured = read_records::<Point>(&records).unwrap();
    assert_eq!(measured[..before.len()], before);
    succeeded(&run(
        folder,
        &format!("chart {SMALL} --max-error 0.2 -o out"),
    ));
    let all = read_records::<Point>(&records).unwrap();
    assert_eq!(all[..measured.len()], measured);
    let keys: BTreeSet<_> = all.iter().map(|point| (&point.key, point.round)).collect();
    assert_eq!(keys.len(), all.len(), "a round was measured twice");
    assert!(folder.join("out/chart.html").is_file());
}

/// A path of two views and a third view: the answer meets the bound in each, and what a view has
/// ruled out is not measured in the others.
#[test]
fn bounds_hold_in_all_views() {
    let place = place();
    let folder = place.path();
    let third = "camera = { eye = [0.0, 1.0, 0.9], target = [0.0, 0.0, -0.5], vfov_deg = 60 }";
    let line = format!(
        "fit {SMALL} --noise 0.1 --max-error 0.33 --views 2 --pan 40 -o out --report fit.json"
    );
    let run = |line: &str| {
        let mut command = command();
        command
            .current_dir(folder)
            .env("LUMIVOX_CACHE", folder.join("cache"));
        let words = words(line);
        command.args(words).args(["--at", third]).output().unwrap()
    };
    let said = succeeded(&run(&line));
    assert!(said.contains("cornell, 1 bounce, 3 views: "), "{said}");
    let report = std::fs::read_to_string(folder.join("fit.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let sources: Vec<&str> = report["views"]
        .as_array()
        .unwrap()
        .iter()
        .map(|source| source.as_str().unwrap())
        .collect();
    assert_eq!(sources[0], "bundled:cornell");
    assert!(sources[1].contains("--with 'camera = ") && sources[2].contains(third));
    let best = &report["best"];
    let views: Vec<Point> = serde_json::from_value(best["views"].clone()).unwrap();
    let errors: Vec<f64> = views
        .iter()
        .map(|view| view.error.unwrap().rel_rmse)
        .collect();
    let worst = best["error"].as_f64().unwrap();
    assert!(
        worst <= 0.33 && errors.contains(&worst) && errors.iter().all(|error| *error <= worst),
        "{errors:?}"
    );
    let hashes: BTreeSet<&str> = views
        .iter()
        .map(|view| view.setup.scene_hash.as_str())
        .collect();
    assert_eq!((views.len(), hashes.len()), (3, 3));
    let at = errors.iter().position(|error| *error == worst).unwrap();
    let render = said.lines().last().unwrap();
    assert!(
        render.starts_with(&format!("lumivox render {} --technique", sources[at])),
        "the view of the largest error: {render}"
    );
    let all = read_records::<Point>(&folder.join("out/cornell.jsonl")).unwrap();
    let mut counts: Vec<usize> = hashes
        .iter()
        .map(|hash| {
            let is_first =
                |point: &&Point| point.setup.scene_hash == *hash && point.round == Some(1);
            all.iter().filter(is_first).count()
        })
        .collect();
    counts.sort_unstable();
    assert!(
        counts[0] + 1 < counts[2],
        "{counts:?} were measured in the views"
    );

    // Where nothing meets the bounds, all views of the nearest are measured all the same.
    let output = run(&line.replace("--max-error", "--max-ms 0.001 --max-error"));
    assert_eq!(output.status.code(), Some(1));
    let report = std::fs::read_to_string(folder.join("fit.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["nearest"]["views"].as_array().map(Vec::len), Some(3));
}

/// Nothing takes so little time: exit code 1, and what comes nearest.
#[test]
fn a_bound_out_of_reach_names_the_nearest() {
    let place = place();
    let line = format!("fit {SMALL} --noise 0.2 --max-ms 0.000001 --moving --bounces 2");
    let output = run(place.path(), &line);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stdout);
    for part in [
        "2 bounces: nothing has a time of at most",
        "nearest: ",
        "lumivox render bundled:cornell",
    ] {
        assert!(said.contains(part), "{part:?} is not in {said}");
    }
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(error.contains("loosen a bound"), "{error}");
}

/// A view without light is told before anything is measured.
#[test]
fn views_that_cannot_be_judged_are_told() {
    let place = place();
    let mut command = command();
    command
        .current_dir(place.path())
        .env("LUMIVOX_CACHE", place.path().join("cache"));
    let words = words(&format!("fit {SMALL} --noise 0.2 --max-ms 9 -o out"));
    let output = command
        .args(words)
        .args(["--at", "light = []"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    let error = String::from_utf8_lossy(&output.stderr);
    for part in ["view 2", "light = []", "no indirect light"] {
        assert!(error.contains(part), "{part:?} is not in {error}");
    }
    let records = place.path().join("out/cornell.jsonl");
    assert_eq!(std::fs::metadata(records).unwrap().len(), 0);
}

/// Arguments after `fit`, and what the error must say; all are bad input.
const BAD_ARGUMENTS: &[(&str, &[&str])] = &[
    (
        "bundled:cornell",
        &["--max-error E", "--max-ms T", "--max-mib M"],
    ),
    (
        "bundled:cornell --max-error 0",
        &["--max-error is 0", "above 0"],
    ),
    ("bundled:cornell --max-ms -3", &["-3"]),
    (
        "bundled:cornell --max-mib nan",
        &["--max-mib is NaN", "above 0"],
    ),
    (
        "bundled:cornell --max-error 0.001",
        &["0.001", "0.01", "--noise"],
    ),
    (
        "bundled:cornell --max-ms 9 --noise 0",
        &["--noise is 0", "above 0"],
    ),
    (
        "bundled:cornell --max-ms 9 --bounces 99",
        &["99 bounces", "--bounces", "--grid"],
    ),
    (
        "bundled:cornell --max-ms 9 --bounces some",
        &["a number of bounces, or full"],
    ),
    (
        "bundled:cornell --max-ms 9 --grid no.toml",
        &["cannot read the grid", "no.toml"],
    ),
    ("bundled:nowhere --max-ms 9", &["nowhere"]),
    (
        "bundled:cornell --max-ms 9 --views 3",
        &["--views is 3", "--pan", "--at"],
    ),
    (
        "bundled:cornell --max-ms 9 --views 3 --pan 400",
        &["--pan is 400", "-360 to 360"],
    ),
    (
        "bundled:cornell --max-ms 9 --dolly 0.5",
        &["--dolly", "--views"],
    ),
    (
        "bundled:cornell --max-ms 9 --views 2 --fps 24",
        &["views 1 and 2", "the same"],
    ),
    ("bundled:cornell --max-ms 9 --views 0", &["--views"]),
    ("bundled:cornell --max-ms 9 --at camera=3", &["--at", "1"]),
    (
        "bundled:cornell --max-ms 9 --report fit.txt",
        &["fit.txt", "json"],
    ),
];

#[test]
fn bad_arguments_say_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, parts) in BAD_ARGUMENTS {
        let result = lumivox(folder.path(), &words(&format!("fit {arguments}")), &[]);
        check_error(arguments, &result, 2, parts);
    }
}
