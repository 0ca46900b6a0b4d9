//! `lumivox lpv`: files that it writes, and what it says of input that it cannot use.

use std::path::Path;

use crate::support::program::{check_error, lumivox, words};

/// A report has the account of the picture's light, where the technique keeps one.
#[test]
fn reports_have_the_account_of_light() {
    let folder = tempfile::tempdir().unwrap();
    let rows = |technique: &str| {
        let line = format!(
            "render bundled:cornell --technique {technique} --set resolution=16 --size 16x12 \
             --shadow-resolution 64 -o a.exr --report a.json"
        );
        let ran = lumivox(folder.path(), &words(&line), &[]);
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let text = std::fs::read_to_string(folder.path().join("a.json")).unwrap();
        let report: serde_json::Value = serde_json::from_str(&text).unwrap();
        report["energy"].as_array().cloned()
    };
    let energy = rows("lpv").unwrap();
    let watts = |name: &str| {
        let row = energy.iter().find(|row| row["name"] == name).unwrap();
        row["watts"][0].as_f64().unwrap()
    };
    assert!(watts("injected") > 1.0 && watts("on_its_way") == 0.0);
    assert!(watts("absorbed") > watts("left"));
    assert!(watts("lost").abs() < 1e-4 * watts("injected"), "{energy:?}");
    assert!(rows("svo").is_none());
}

/// Arguments, and what the error must say.
const BAD: &[(&str, &[&str])] = &[
    ("-o a", &["required"]),
    (
        "bundled:cornell --injector wall -o a",
        &["cannot be used with"],
    ),
    (
        "--injector gone.toml -o a",
        &["gone.toml", "wall, cell or a .toml file"],
    ),
    ("--injector bad.toml -o a", &["bad.toml:3", "fluxx"]),
    (
        "--injector cell:40,0,0 -o a",
        &["--injector", "[40, 0, 0]", "outside"],
    ),
    ("--injector cell:1,2 -o a", &["three numbers"]),
    ("--injector wall --direction 0,0,0 -o a", &["no direction"]),
    ("--injector wall --occluder w:3 -o a", &["x, y or z"]),
    (
        "--injector wall --occluder x:40 -o a",
        &["--occluder", "outside"],
    ),
    ("--injector wall --cells 3 -o a", &["--cells", "4..=128"]),
    (
        "--injector wall --gain 1.5 -o a",
        &["--gain", "1.5", "at most 1"],
    ),
    (
        "--injector wall --multiplier 0 -o a",
        &["--multiplier", "above 0"],
    ),
    (
        "--injector wall --propagator octree-ordinates -o a",
        &["octree-ordinates", "lobes30"],
    ),
    (
        "--injector wall --cells 8 --actions inject,jump -o a",
        &["\"jump\"", "downsample"],
    ),
    (
        "--injector wall --cells 8 --actions inject,step:1 -o a",
        &["step:1", "1 level"],
    ),
    (
        "--injector wall --cells 8 --slice z:8 -o a",
        &["--slice", "8 cells"],
    ),
    (
        "--injector wall --cells 8 --slice 4 -o a",
        &["--slice", "z:16"],
    ),
    (
        "--injector wall --cells 8 --level 1 -o a",
        &["--level 1", "1 level"],
    ),
    (
        "--injector wall --cells 8 --level top -o a",
        &["--level", "merged"],
    ),
    (
        "--injector wall --cells 128 --propagator ordinates --directions 1024 -o a",
        &["GiB"],
    ),
    ("dark.toml -o a", &["no light", "dark"]),
];

fn places() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("bad.toml", "[[cell]]\nat = [1, 2, 3]\nfluxx = 1.0\n");
    write(
        "good.toml",
        "[[cell]]\nat = [1, 2, 3]\nflux = 1.0\nnormal = [1.0, 0.0, 0.0]\n",
    );
    write("floor.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 3 2\n");
    write(
        "dark.toml",
        "[[model]]\npath = \"floor.obj\"\n\n[camera]\neye = [0.5, 1.0, 2.0]\n\
         target = [0.5, 0.0, 0.5]\nvfov_deg = 45.0\n",
    );
    folder
}

#[test]
fn bad_arguments_of_the_bench_are_told() {
    let folder = places();
    for (line, says) in BAD {
        let line = format!("lpv {line}");
        check_error(&line, &lumivox(folder.path(), &words(&line), &[]), 2, says);
        let left = folder.path().join("a");
        let is_empty = !left.exists() || left.read_dir().unwrap().next().is_none();
        assert!(is_empty, "{line}: something was written");
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = folder.read_dir().unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().to_str().unwrap().to_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn pictures_plots_and_numbers_are_written() {
    let folder = places();
    let run = |line: &str| {
        let ran = lumivox(folder.path(), &words(line), &[]);
        assert_eq!(ran.code, Some(0), "{line}: {}", ran.stderr);
    };
    run(
        "lpv --injector good.toml --injector wall:6:-1,0,0 --cells 8 --iterations 2 \
         --propagator octree-axis6 --propagator ordinates --directions 8 \
         --reference-iterations 4 --log -o one",
    );
    let one = folder.path().join("one");
    let stems = ["errors", "flux", "octree-axis6", "ordinates", "reference"];
    let mut expected: Vec<String> = stems
        .iter()
        .flat_map(|stem| [format!("{stem}.png"), format!("{stem}.svg")])
        .chain(["steps.csv".to_owned()])
        .collect();
    expected.sort();
    assert_eq!(names(&one), expected);
    for name in expected.iter().filter(|name| name.ends_with(".png")) {
        assert!(
            image::open(one.join(name)).unwrap().width() >= 500,
            "{name}"
        );
    }
    let picture = std::fs::read_to_string(one.join("ordinates.svg")).unwrap();
    assert!(picture.contains("ordinates: merged, z = 4, after 2 steps"));
    assert!(picture.matches("<polygon").count() > 8 && picture.ends_with("</svg>\n"));
    let numbers = std::fs::read_to_string(one.join("steps.csv")).unwrap();
    let lines: Vec<Vec<&str>> = numbers
        .lines()
        .map(|line| line.split(',').collect())
        .collect();
    // Inject, downsample, two steps, merge; without levels one less.
    assert_eq!(lines.len(), 1 + 5 + 4);
    assert!(lines.iter().all(|line| line.len() == lines[0].len()));
    assert_eq!(
        lines[0][..4],
        ["propagator", "action", "steps", "injected_w"]
    );
    // 1 W of the file and 64 of the wall.
    let injected: f64 = lines[1][3].parse().unwrap();
    assert!((injected - 65.0).abs() < 1e-9, "{injected}");
    // One action after the other, a picture of each.
    run(
        "lpv --injector cell --occluder x:3 --cells 8 --actions inject,step:0,merge --level 0 \
         --show target --each -o two",
    );
    let pictures = names(&folder.path().join("two"));
    let pictures: Vec<&str> = pictures
        .iter()
        .filter_map(|name| name.strip_suffix(".png"))
        .collect();
    assert_eq!(pictures, ["flux", "lobes30-01", "lobes30-02", "lobes30-03"]);
}
