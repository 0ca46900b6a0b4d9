//! `lumivox bench`: what it writes, what a refused case becomes, and what it says to wrong arguments.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::path::Path;
use std::process::{Command, Output};

fn bench(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lumivox"));
    command.arg("bench").args(arguments).arg("-o").arg(folder.join("out")).env("LUMIVOX_CACHE", folder.join("cache"));
    command.output().unwrap()
}

const TINY: [&str; 9] = ["bundled:cornell", "--size", "32x32", "--frames", "2", "--shadow-resolution", "64", "--max-error", "0.2"];

fn records(path: &Path) -> Vec<serde_json::Value> {
    std::fs::read_to_string(path).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn writes_records_tables_and_charts() {
    let folder = tempfile::tempdir().unwrap();
    let output = bench(folder.path(), &[&TINY[..], &["--preset", "accurate,cones", "--resolution", "8,16"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let out = folder.path().join("out");
    let records = records(&out.join("cornell.jsonl"));
    assert_eq!(records.len(), 4);
    for record in &records {
        assert!(record["failure"].is_null());
        assert!(["host", "timestamps"].contains(&record["timing"].as_str().unwrap()));
        assert!(record["error"]["pixel"]["rel_rmse"].as_f64().unwrap() > 0.0);
        assert!(!record["error"]["materials"].as_array().unwrap().is_empty());
        assert!(record["directions"][0]["us_per_direction"].as_f64().unwrap() > 0.0);
        assert_eq!(record["passes"][0]["gpu_ms"]["n"], 2);
        assert!(record["build"].as_array().unwrap().iter().all(|pass| pass["gpu_ms"]["n"] == 5));
        assert!(!record["first_build"].as_array().unwrap().is_empty());
        // Counted once, and not again in any build.
        let counted = record["counting"].as_array().unwrap().iter().find(|pass| pass["name"] == "voxel.fragments").unwrap();
        assert!(counted["gpu_ms"]["n"] == 1 && counted["gpu_ms"]["median"].as_f64().unwrap() > 0.0, "{counted}");
        assert!(record["counting"].as_array().unwrap().iter().all(|pass| pass["name"] != "voxel.resolve"));
        let bytes: u64 = record["memory"].as_array().unwrap().iter().map(|row| row["bytes"].as_u64().unwrap()).sum();
        assert_eq!(record["memory_bytes"], bytes);
    }
    let csv = std::fs::read_to_string(out.join("cornell.csv")).unwrap();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 5);
    assert!(
        lines[0].contains("total voxelization ms") && lines[0].contains("counting voxel.fragments ms") && lines[0].contains("block rel_rmse"),
        "{}",
        lines[0]
    );
    for name in ["error", "passes", "memory"] {
        let svg = std::fs::read_to_string(out.join(format!("cornell-{name}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && svg.contains("voxel-mips cones"));
        let png = image::open(out.join(format!("cornell-{name}.png"))).unwrap();
        assert_eq!(png.width(), 1000);
    }
}

/// 1,024³ half-float texels and their mips are 9.8 GB: more than lavapipe's heap.
#[test]
fn a_refused_case_is_a_row() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--device", "llvmpipe", "--preset", "cones", "--resolution", "1024,8", "--no-reference"];
    let output = bench(folder.path(), &[&TINY[..7], &arguments].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let records = records(&folder.path().join("out/cornell.jsonl"));
    assert!(records[0]["failure"].as_str().unwrap().contains("voxel_mips.radiance"), "{}", records[0]["failure"]);
    assert!(records[1]["failure"].is_null() && records[1]["error"].is_null());
    assert!(String::from_utf8_lossy(&output.stdout).contains("voxel-mips cones 1024"));
}

#[test]
fn wrong_arguments_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let cases: [(&[&str], &str); 9] = [
        (&["--technique", "nonsense"], "there is no technique nonsense"),
        (&["--preset", "nonsense"], "there is no preset nonsense"),
        (&["--resolution", "65"], "setting resolution: 65"),
        (&["--resolution", "many"], "many"),
        (&["--set", "nonsense=1"], "there is no setting nonsense"),
        (&["--set", "cones"], "KEY=VALUE"),
        (&["--frames", "0"], "frames"),
        (&["--max-error", "0"], "--max-error is 0"),
        (&["--timing", "sundial"], "host or timestamps"),
    ];
    for (arguments, message) in cases {
        let output = bench(folder.path(), &[&["bundled:cornell"], arguments].concat());
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(message), "{arguments:?}: {stderr}");
    }
    assert_eq!(bench(folder.path(), &["bundled:nonsense"]).status.code(), Some(2));
}
