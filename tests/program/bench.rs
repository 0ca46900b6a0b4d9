//! `lumivox bench`: what it writes, what a refused case becomes, and what it says to wrong
//! arguments.

use std::path::Path;
use std::process::Output;

use crate::support::program::command;
use lumivox::gi::registry::TECHNIQUES;
use lumivox::measure::stages::UNSTAGED;

fn bench(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = command();
    command
        .arg("bench")
        .args(arguments)
        .arg("-o")
        .arg(folder.join("out"))
        .env("LUMIVOX_CACHE", folder.join("cache"));
    command.output().unwrap()
}

const TINY: [&str; 9] = [
    "bundled:cornell",
    "--size",
    "32x32",
    "--frames",
    "2",
    "--shadow-resolution",
    "64",
    "--max-error",
    "0.2",
];

fn records(path: &Path) -> Vec<serde_json::Value> {
    std::fs::read_to_string(path)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

#[test]
fn writes_records_tables_and_charts() {
    let folder = tempfile::tempdir().unwrap();
    let output = bench(
        folder.path(),
        &[
            &TINY[..],
            &["--preset", "accurate,cones", "--resolution", "8,16"],
        ]
        .concat(),
    );
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let out = folder.path().join("out");
    let records = records(&out.join("cornell-bench.jsonl"));
    assert_eq!(records.len(), 4);
    for record in &records {
        assert!(record["failure"].is_null());
        assert!(["host", "timestamps"].contains(&record["timing"].as_str().unwrap()));
        assert!(record["error"]["pixel"]["rel_rmse"].as_f64().unwrap() > 0.0);
        assert!(!record["error"]["materials"].as_array().unwrap().is_empty());
        assert!(
            record["directions"][0]["us_per_direction"]
                .as_f64()
                .unwrap()
                > 0.0
        );
        // Rays take no samples; a cone takes one at least.
        let cost = &record["directions"][0];
        let is_cones = record["preset"] == "cones";
        assert_eq!(cost["samples"].is_null(), !is_cones, "{cost}");
        if is_cones {
            let samples = cost["samples"].as_f64().unwrap();
            assert!(
                samples >= cost["pixels"].as_f64().unwrap() * cost["directions"].as_f64().unwrap(),
                "{cost}"
            );
            let ms = record["passes"]
                .as_array()
                .unwrap()
                .iter()
                .find(|pass| pass["name"] == "cone.gather")
                .unwrap()["gpu_ms"]["median"]
                .as_f64()
                .unwrap();
            assert!(
                (cost["us_per_sample"].as_f64().unwrap() * samples / (1e3 * ms) - 1.0).abs() < 1e-9,
                "{cost}"
            );
        }
        assert_eq!(record["passes"][0]["gpu_ms"]["n"], 2);
        assert!(
            record["build"]
                .as_array()
                .unwrap()
                .iter()
                .all(|pass| pass["gpu_ms"]["n"] == 5)
        );
        assert!(!record["first_build"].as_array().unwrap().is_empty());
        // Worked out on the host once, and not again in any build.
        let counted = record["counting"]
            .as_array()
            .unwrap()
            .iter()
            .find(|pass| pass["name"] == "voxel.expect_fragments")
            .unwrap();
        assert!(
            counted["gpu_ms"]["n"] == 1 && counted["gpu_ms"]["median"].as_f64().unwrap() > 0.0,
            "{counted}"
        );
        assert_eq!(record["counting"].as_array().unwrap().len(), 1);
        let bytes: u64 = record["memory"]
            .as_array()
            .unwrap()
            .iter()
            .map(|row| row["bytes"].as_u64().unwrap())
            .sum();
        assert_eq!(record["memory_bytes"], bytes);
        let world = record["bytes_per_occupied_voxel"].as_f64().unwrap()
            * record["counts"]["voxels"].as_f64().unwrap();
        let of_voxels = |row: &&serde_json::Value| {
            ["voxel.", "voxel_mips."]
                .iter()
                .any(|owner| row["name"].as_str().unwrap().starts_with(owner))
        };
        let screen = |row: &&serde_json::Value| {
            ["diffuse", "interleaved"]
                .iter()
                .any(|what| row["name"].as_str().unwrap().ends_with(what))
        };
        let rows = record["memory"].as_array().unwrap();
        let expected: u64 = rows
            .iter()
            .filter(of_voxels)
            .filter(|row| !screen(row))
            .map(|row| row["bytes"].as_u64().unwrap())
            .sum();
        assert!(
            (world - expected as f64).abs() < 1.0,
            "{world}, not {expected}"
        );
    }
    let csv = std::fs::read_to_string(out.join("cornell-bench.csv")).unwrap();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 5);
    assert!(
        lines[0].contains("stage build voxelization min ms")
            && lines[0].contains("total update ms")
            && lines[0].contains("counting voxel.expect_fragments ms")
            && lines[0].contains("block rel_rmse"),
        "{}",
        lines[0]
    );
    for name in [
        "error",
        "passes",
        "memory",
        "stages",
        "structures",
        "directions",
    ] {
        let svg = std::fs::read_to_string(out.join(format!("cornell-bench-{name}.svg"))).unwrap();
        assert!(
            svg.starts_with("<svg")
                && svg.trim_end().ends_with("</svg>")
                && svg.contains("voxel-mips cones")
        );
        assert!(
            svg.contains("shadow_resolution=64")
                && svg.contains("cone_set=")
                && svg.contains(records[0]["device"].as_str().unwrap())
        );
        let png = image::open(out.join(format!("cornell-bench-{name}.png"))).unwrap();
        assert_eq!(png.width(), 1000);
    }
}

/// Every pass that any technique runs is in a stage, and stages add up to their passes.
#[test]
fn stages_have_every_timed_pass_of_every_technique() {
    let folder = tempfile::tempdir().unwrap();
    let techniques = TECHNIQUES
        .iter()
        .map(|entry| entry.name)
        .collect::<Vec<_>>()
        .join(",");
    let mut runs = vec![vec!["--technique", techniques.as_str(), "--no-reference"]];
    let presets = |entry: &&&lumivox::gi::entry::Entry| {
        entry
            .presets
            .iter()
            .map(|preset| preset.name)
            .collect::<Vec<_>>()
            .join(",")
    };
    let with_presets: Vec<(&str, String)> = TECHNIQUES
        .iter()
        .filter(|entry| !entry.presets.is_empty())
        .map(|entry| (entry.name, presets(&entry)))
        .collect();
    runs.extend(with_presets.iter().map(|(technique, presets)| {
        vec![
            "--technique",
            *technique,
            "--preset",
            presets,
            "--no-reference",
        ]
    }));
    runs.push(vec![
        "--technique",
        "voxel-mips",
        "--preset",
        "textbook",
        "--set",
        "mip_method=blit",
        "--no-reference",
    ]);
    runs.push(vec![
        "--technique",
        "svo",
        "--preset",
        "cones",
        "--set",
        "normals=toksvig",
        "--no-reference",
    ]);
    for (index, run) in runs.iter().enumerate() {
        let folder = folder.path().join(index.to_string());
        let common = [
            "bundled:glossy",
            "--size",
            "16x16",
            "--frames",
            "1",
            "--rebuilds",
            "1",
            "--shadow-resolution",
            "16",
        ];
        let few: &[&str] = match run[1] {
            "none" => &[],
            "prt" => &["--set", "transfer_rays=64"],
            _ => &["--resolution", "16"],
        };
        let output = bench(&folder, &[&common[..], run, few].concat());
        assert!(
            output.status.success(),
            "{run:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        for record in records(&folder.join("out/glossy-bench.jsonl")) {
            assert!(
                record["failure"].is_null(),
                "{run:?}: {}",
                record["failure"]
            );
            let median = |rows: &str, keep: &dyn Fn(&serde_json::Value) -> bool| -> f64 {
                record[rows]
                    .as_array()
                    .unwrap()
                    .iter()
                    .filter(|row| keep(row))
                    .map(|row| row["gpu_ms"]["median"].as_f64().unwrap())
                    .sum()
            };
            assert!(
                record["stages"]
                    .as_array()
                    .unwrap()
                    .iter()
                    .all(|stage| stage["name"] != UNSTAGED),
                "{run:?}: {}",
                record["stages"]
            );
            for (rows, when) in [("build", "build"), ("passes", "frame")] {
                let (stages, passes) = (
                    median("stages", &|row| row["when"] == when),
                    median(rows, &|_| true),
                );
                assert!(
                    (stages - passes).abs() <= 1e-9 * passes,
                    "{run:?} {when}: {stages} ms in stages, {passes} ms in passes"
                );
            }
        }
    }
}

/// One command draws two structures side by side, with every stage of either.
#[test]
fn techniques_are_set_side_by_side() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        "--technique",
        "voxel-mips,svo",
        "--preset",
        "cones",
        "--resolution",
        "8,16",
        "--no-reference",
    ];
    let output = bench(folder.path(), &[&TINY[..7], &arguments].concat());
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let records = records(&folder.path().join("out/cornell-bench.jsonl"));
    assert_eq!(
        records
            .iter()
            .map(|row| row["technique"].as_str().unwrap())
            .collect::<Vec<_>>(),
        ["voxel-mips", "voxel-mips", "svo", "svo"]
    );
    let svg =
        std::fs::read_to_string(folder.path().join("out/cornell-bench-structures.svg")).unwrap();
    let stages = [
        "voxelization",
        "node flagging and allocation",
        "leaf writing",
        "border transfer",
        "light injection",
        "mip filtering",
    ];
    for name in ["voxel-mips cones", "svo cones", "16³ cells"]
        .iter()
        .chain(&stages)
    {
        assert!(svg.contains(name), "{name} is not in the chart");
    }
}

/// A camera that walks: what stands still costs nothing, light neither. A clipmap follows, and a
/// dense grid has nothing to follow with.
#[test]
fn a_walk_is_measured_by_speed() {
    let folder = tempfile::tempdir().unwrap();
    let walk = ["--walk", "4", "--speeds", "0,4"];
    let arguments = [
        "--technique",
        "none,voxel-mips,clipmap",
        "--no-reference",
        "--resolution",
        "16",
    ];
    let output = bench(folder.path(), &[&TINY[..7], &arguments, &walk].concat());
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let out = folder.path().join("out");
    let records = records(&out.join("cornell-bench.jsonl"));
    assert!(
        records[0]["walks"].as_array().unwrap().is_empty(),
        "there is nothing to walk among"
    );
    for (record, follows) in [(&records[1], false), (&records[2], true)] {
        let walks = record["walks"].as_array().unwrap();
        let speeds: Vec<f64> = walks
            .iter()
            .map(|walk| walk["voxels_per_frame"].as_f64().unwrap())
            .collect();
        assert_eq!(speeds, [0.0, 4.0]);
        for (walk, moves) in walks.iter().zip([false, follows]) {
            let ran = walk["passes"]
                .as_array()
                .unwrap()
                .iter()
                .find(|pass| pass["name"] == "voxel.fragments");
            assert_eq!(
                (ran.is_some(), walk["stages"].get("voxelization").is_some()),
                (moves, moves),
                "{walk}"
            );
            assert!(
                walk["frames"] == 4
                    && (walk["mean_update_ms"].as_f64().unwrap() > 0.0) == moves
                    && walk["update_ms"]["n"] == 4,
                "{walk}"
            );
        }
    }
    let csv = std::fs::read_to_string(out.join("cornell-bench.csv")).unwrap();
    assert!(
        csv.lines()
            .next()
            .unwrap()
            .contains("walk 4 voxels geometry mean ms"),
        "{csv}"
    );
    assert!(String::from_utf8_lossy(&output.stdout).contains("cells a frame"));
    assert!(
        std::fs::read_to_string(out.join("cornell-bench-walk.svg"))
            .unwrap()
            .contains("clipmap accurate 16, all anew")
    );
    let output = bench(
        folder.path(),
        &[&TINY[..7], &["--walk", "1", "--speeds", "-1"]].concat(),
    );
    assert_eq!(output.status.code(), Some(2));
}

/// 1,024³ half-float texels and their mips are 9.8 GB: more than lavapipe's heap.
#[test]
fn a_refused_case_is_a_row() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        "--device",
        "llvmpipe",
        "--technique",
        "voxel-mips,none",
        "--preset",
        "cones",
        "--resolution",
        "1024,8",
        "--no-reference",
    ];
    let output = bench(folder.path(), &[&TINY[..7], &arguments].concat());
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let records = records(&folder.path().join("out/cornell-bench.jsonl"));
    assert!(
        records[0]["failure"]
            .as_str()
            .unwrap()
            .contains("voxel_mips.radiance"),
        "{}",
        records[0]["failure"]
    );
    assert_eq!(records[0]["refused"]["name"], "voxel_mips.radiance");
    assert!(records[0]["refused"]["bytes"].as_u64().unwrap() >= 8 * 1024u64.pow(3) * 8 / 7);
    assert!(records[0]["stages"].as_array().unwrap().is_empty());
    let csv = std::fs::read_to_string(folder.path().join("out/cornell-bench.csv")).unwrap();
    assert!(
        csv.lines()
            .next()
            .unwrap()
            .contains("failure,refused_bytes")
            && csv.contains(&records[0]["refused"]["bytes"].to_string()),
        "{csv}"
    );
    assert!(records[1]["failure"].is_null() && records[1]["error"].is_null());
    assert!(String::from_utf8_lossy(&output.stdout).contains("voxel-mips cones 1024"));
    assert!(records[2]["technique"] == "none" && records[2]["failure"].is_null());
    assert!(
        std::fs::read_to_string(folder.path().join("out/cornell-bench-memory.svg"))
            .unwrap()
            .contains("voxel-mips cones, refused")
    );
}

/// Records that are gathered give the files that were written while they were measured.
#[test]
fn records_give_their_tables_and_charts_again() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        &TINY[..],
        &["--technique", "voxel-mips,none", "--walk", "2"],
        &["--speeds", "1", "--times", "0"],
    ];
    let measured = bench(folder.path(), &arguments.concat());
    assert!(measured.status.success(), "{measured:?}");
    let (out, again) = (folder.path().join("out"), folder.path().join("again"));
    let merge = |from: &Path| {
        command()
            .args(["bench", "--merge"])
            .arg(from)
            .arg("-o")
            .arg(&again)
            .output()
            .unwrap()
    };
    let merged = merge(&out);
    assert!(merged.status.success(), "{merged:?}");
    let mut files = 0;
    for file in std::fs::read_dir(&out).unwrap() {
        let file = file.unwrap().path();
        let drawn = again.join(file.file_name().unwrap());
        let same = std::fs::read(&file).unwrap() == std::fs::read(&drawn).unwrap();
        assert!(same, "{}", drawn.display());
        files += 1;
    }
    assert_eq!(std::fs::read_dir(&again).unwrap().count(), files);
    assert!(files > 6, "{files} files");

    let empty = folder.path().join("empty");
    std::fs::create_dir(&empty).unwrap();
    std::fs::write(folder.path().join("cache/bad.jsonl"), "{}\n").unwrap();
    for (from, message) in [
        (empty.as_path(), "there are no records"),
        (&folder.path().join("none"), "cannot read the folder"),
        (
            &folder.path().join("cache"),
            "bad.jsonl:1: this is no record of lumivox bench",
        ),
    ] {
        let refused = merge(from);
        let stderr = String::from_utf8_lossy(&refused.stderr);
        assert!(
            refused.status.code() == Some(2) && stderr.contains(message),
            "{stderr}"
        );
    }
}

/// Every table and chart in docs/results is what its records say.
#[test]
fn results_are_those_of_their_records() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let output = std::process::Command::new(root.join("tools/results"))
        .args(["--check", "--lumivox"])
        .arg(env!("CARGO_BIN_EXE_lumivox"))
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn wrong_arguments_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let cases: [(&[&str], &str); 11] = [
        (
            &["--technique", "nonsense"],
            "there is no technique nonsense",
        ),
        (&["--preset", "nonsense"], "there is no preset nonsense"),
        (&["--resolution", "65"], "setting resolution: 65"),
        (&["--resolution", "many"], "many"),
        (&["--set", "nonsense=1"], "there is no setting nonsense"),
        (&["--set", "cones"], "KEY=VALUE"),
        (&["--frames", "0"], "frames"),
        (&["--max-error", "0"], "--max-error is 0"),
        (&["--timing", "sundial"], "host or device"),
        (&["--seconds", "0"], "more than 0"),
        (&["--throughput", "soon"], "more than 0"),
    ];
    for (arguments, message) in cases {
        let output = bench(folder.path(), &[&["bundled:cornell"], arguments].concat());
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(message), "{arguments:?}: {stderr}");
    }
    assert_eq!(
        bench(folder.path(), &["bundled:nonsense"]).status.code(),
        Some(2)
    );
}
