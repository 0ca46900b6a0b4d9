//! Sequences: written frame by frame, and compared over time.

use std::path::Path;

use crate::support::program::{Ran, check_error, command, lumivox, words};
use serde_json::Value;

const SMALL: &str = "--size 32x24";

fn run(folder: &Path, line: &str) -> Ran {
    let cache = folder.join("cache");
    let environment = [("LUMIVOX_CACHE", cache.to_str().unwrap())];
    lumivox(folder, &words(line), &environment)
}

fn done(folder: &Path, line: &str) {
    let ran = run(folder, line);
    assert_eq!(ran.code, Some(0), "{line}: {}", ran.stderr);
}

fn json(folder: &Path, name: &str) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join(name)).unwrap()).unwrap()
}

/// The errors of a comparison's frames, over pixels.
fn errors(report: &Value) -> Vec<f64> {
    let frames = report["frames"].as_array().unwrap();
    let error = |frame: &Value| frame["pixel"]["rel_rmse"].as_f64().unwrap();
    frames.iter().map(error).collect()
}

/// A room with a board that crosses it within a second.
fn write_moving_scene(folder: &Path) {
    let text = "v -3 -2 -4\nv 3 -2 -4\nv 3 2 -4\nv -3 2 -4\nf 1 2 3 4\n";
    std::fs::write(folder.join("wall.obj"), text).unwrap();
    let text = "v -1 -1 -2\nv 0 -1 -2\nv 0 1 -2\nv -1 1 -2\nf 1 2 3 4\n";
    std::fs::write(folder.join("board.obj"), text).unwrap();
    let toml = "[[model]]\npath = \"wall.obj\"\n[[model]]\npath = \"board.obj\"\ndynamic = true\n\
                [[model.keyframe]]\ntime_s = 0.0\n\
                [[model.keyframe]]\ntime_s = 1.0\ntranslate = [1.5, 0.0, 0.0]\n\
                [camera]\neye = [0.0, 0.0, 1.0]\ntarget = [0.0, 0.0, -1.0]\n\
                [[light]]\nkind = \"point\"\nposition = [0.0, 1.0, 1.0]\n\
                intensity = [9.0, 9.0, 9.0]\n";
    std::fs::write(folder.join("moving.toml"), toml).unwrap();
}

/// Technique and reference see the same thing in each frame, as the camera turns, moves and time
/// goes on; frames of another path differ.
#[test]
fn frames_show_what_the_path_says() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    write_moving_scene(folder);
    for (scene, path, other) in [
        ("bundled:cornell", "--pan -2.5 --dolly 0.1", "--pan -2.5"),
        ("moving.toml", "--fps 4 --time 0.25", "--fps 8 --time 0.25"),
    ] {
        let of = format!("{scene} {SMALL} --frames 3 --aov depth");
        done(
            folder,
            &format!("render {of} {path} --technique none --shadow-resolution 64 -o t_##.exr"),
        );
        for (path, name) in [(path, "r"), (other, "o")] {
            done(
                folder,
                &format!("reference {of} {path} --spp 1 -o {name}_##.exr"),
            );
        }
        let compared = |name: &str, path: &str| {
            let line = format!("compare t_##.exr {name}_##.exr {path} --report c.json");
            done(folder, &line);
            json(folder, "c.json")
        };
        let same = errors(&compared("r", &format!("--scene {scene} {path}")));
        assert!(
            same.len() == 3 && same.iter().all(|error| *error < 1e-3),
            "{same:?}"
        );
        let apart = errors(&compared("o", ""));
        assert!(apart[0] < 1e-3 && apart[2] > 0.01, "{scene}: {apart:?}");
        // Frame 0 is the scene as it is, and no frame is as the one before.
        assert!(!folder.join("t_03.exr").exists());
        let frame = |number: u32| std::fs::read(folder.join(format!("t_{number:02}.exr"))).unwrap();
        assert!(frame(0) != frame(1) && frame(1) != frame(2), "{scene}");
    }
    // Without a number, the last frame alone.
    let line =
        format!("render bundled:cornell {SMALL} --technique none --frames 3 --pan 2 -o l.exr");
    done(folder, &line);
    done(folder, &line.replace("l.exr", "n_#.exr"));
    let bytes = |name: &str| std::fs::read(folder.join(name)).unwrap();
    assert_eq!(bytes("l.exr"), bytes("n_2.exr"));
}

/// A report says how the scene goes on, the same of all three commands. Files behind the last frame
/// are told, and what is compared.
#[test]
fn reports_say_what_was_shown() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    write_moving_scene(folder);
    let path = "--fps 4 --time 0.25 --pan -2";
    let of = format!("moving.toml {SMALL} {path} --report r.json");
    let sequence = |name: &str| json(folder, name)["sequence"].clone();
    let expected = |frames: u32, last_time_s: f64| {
        let (fps, pan_deg, dolly_m) = (4.0, -2.0, 0.0);
        serde_json::json!({ "frames": frames, "fps": fps, "last_time_s": last_time_s,
            "pan_deg": pan_deg, "dolly_m": dolly_m })
    };
    let render = format!("render {of} --technique none --shadow-resolution 64 --frames");
    done(folder, &format!("{render} 3 -o t_#.exr"));
    assert_eq!(sequence("r.json"), expected(3, 0.75));
    done(
        folder,
        &format!("reference {of} --spp 1 --frames 3 -o r_#.exr"),
    );
    assert_eq!(sequence("r.json"), expected(3, 0.75));
    let shorter = run(folder, &format!("{render} 2 -o t_#.exr"));
    assert!(shorter.stderr.contains("t_2.exr"), "{}", shorter.stderr);
    let compare = format!("compare t_#.exr r_#.exr --scene moving.toml {path} --report r.json");
    let mut command = command();
    command.args(words(&compare)).current_dir(folder);
    let said = command.output().unwrap().stdout;
    assert!(said.starts_with(b"3 frames, t_0.exr to t_2.exr\n"));
    assert_eq!(sequence("r.json"), expected(3, 0.75));
    std::fs::remove_file(folder.join("t_2.exr")).unwrap();
    let ran = run(folder, &format!("{render} 2 -o t_#.exr"));
    assert!(!ran.stderr.contains("t_2.exr"), "{}", ran.stderr);
    done(folder, &compare);
    assert_eq!(sequence("r.json"), expected(2, 0.5));
    done(folder, &format!("{render} 1 -o t.exr"));
    assert_eq!(sequence("r.json"), Value::Null);
}

/// Pixels that share nothing of their different directions are told.
#[test]
fn patterns_that_stay_are_told() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let line = format!(
        "render bundled:cornell {SMALL} --technique voxel-mips --set resolution=16 --set \
         interleave_window=off -o p.exr"
    );
    for (more, is_told) in [
        ("", true),
        (" --set blur=even", false),
        (" --set interleave=1", false),
    ] {
        let ran = run(folder, &format!("{line}{more}"));
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        assert_eq!(ran.stderr.contains("which is noise"), is_told, "{more}");
    }
}

/// A change that is shown by halves, planted: error, lag and the share that is shown fall and rise
/// with it, and the chart and the report are written.
#[test]
fn error_over_time_is_that_of_each_frame() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let light = |watts: f32| {
        let light =
            format!("kind=\"point\",position=[0,1.5,0],intensity=[{watts},{watts},{watts}]");
        format!("light=[{{{light}}}]")
    };
    for (name, watts) in [
        ("a.exr", 8.0),
        ("s_0.exr", 8.0),
        ("s_1.exr", 12.0),
        ("b.exr", 16.0),
    ] {
        let line = format!(
            "render bundled:cornell {SMALL} --technique none --aov direct --with {} -o {name}",
            light(watts)
        );
        done(folder, &line);
    }
    done(
        folder,
        "compare s_#.exr b.exr --before a.exr --after b.exr --converged b.exr --scene \
         bundled:cornell --chart c.svg --report c.json",
    );
    let report = json(folder, "c.json");
    let of = |key: &str| {
        let frames = report["frames"].as_array().unwrap();
        frames
            .iter()
            .map(|frame| frame[key].as_f64().unwrap())
            .collect::<Vec<_>>()
    };
    let near = |found: &[f64], expected: &[f64]| {
        let pairs = found.iter().zip(expected);
        assert!(
            found.len() == expected.len() && pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-4),
            "{found:?}, {expected:?}"
        );
    };
    near(&of("shown"), &[0.0, 0.5]);
    near(&of("lag"), &[0.5, 0.25]);
    near(
        &[report["mean"]["pixel"]["bias"].as_f64().unwrap()],
        &[-0.375],
    );
    near(&[report["flicker"].as_f64().unwrap()], &[0.25]);
    assert_eq!(report["shown"][0]["from_frame"], Value::Null);
    assert!(report["frames"][0]["block"]["rel_rmse"].as_f64().unwrap() > 0.4);
    let chart = std::fs::read_to_string(folder.join("c.svg")).unwrap();
    assert!(chart.contains("rel_rmse") && chart.contains("share of the change"));
}

#[test]
fn wrong_sequences_are_told() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let render = format!("render bundled:cornell {SMALL} --technique none");
    done(folder, &format!("{render} --frames 2 -o t_#.exr"));
    let cases: &[(&str, &[&str])] = &[
        ("compare t_#.exr gone_#.exr", &["gone_0.exr", "2 frames"]),
        ("compare gone_#.exr t_#.exr", &["gone_0.exr", "from 0 on"]),
        ("compare t_0.exr t_#.exr", &["t_#.exr is a sequence"]),
        (
            "compare t_#.exr t_#.exr --heatmap h.png",
            &["--heatmap", "two pictures"],
        ),
        ("compare t_#.exr t_#.exr --pan 1", &["--pan", "--scene"]),
        (
            "compare t_0.exr t_1.exr --chart c.svg",
            &["--chart", "sequences"],
        ),
        (
            "compare t_#.exr t_#.exr --report t_1.exr",
            &["t_1.exr", ".json"],
        ),
        ("compare t_#.exr t_#.exr --before t_0.exr", &["required"]),
        ("RENDER --pan NaN -o a.exr", &["--pan is NaN"]),
        ("RENDER --fps 0 -o a.exr", &["--fps is 0", "0.001 to"]),
        ("RENDER --fps 1e-39 -o a.exr", &["--fps is", "0.001 to"]),
        ("RENDER --dolly 1e38 -o a.exr", &["--dolly is", "to 10000"]),
        ("RENDER -o a_#_#.exr", &["a_#_#.exr", "one run of #"]),
        (
            "RENDER --frames 2 --reference t_1.exr -o t_#.exr",
            &["t_1.exr", "is read by this command"],
        ),
        (
            "reference bundled:cornell --frames 2 -o a.exr",
            &["--frames is 2", "write #"],
        ),
        (
            "reference bundled:cornell --aov discontinuity -o a.exr",
            &["discontinuity", "render"],
        ),
    ];
    for (line, says) in cases {
        let ran = run(folder, &line.replace("RENDER", &render));
        check_error(line, &ran, 2, says);
        assert!(!folder.join("a.exr").exists(), "{line}: something was left");
    }
}
