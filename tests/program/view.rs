//! The real window, driven by scripts on a display without a screen (Xvfb): no validation message,
//! no leak, and the pictures of `lumivox render`.

use crate::support::{Missing, skipped};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use crate::support::display::{Display, check_done};
use crate::support::program::{check_error, lumivox};
use lumivox::gi::registry::TECHNIQUES;
use lumivox::gi::settings::Domain;
use lumivox::view::{SECTIONS, view_names};

/// What is timed runs without validation, which takes longer than all the rest.
const TIMED: [(&str, &str); 1] = [("LUMIVOX_VALIDATE", "0")];

/// The technique's smallest resolution, where it has one.
fn smallest(entry: &lumivox::gi::entry::Entry) -> Option<u32> {
    let setting = entry
        .settings
        .iter()
        .copied()
        .flatten()
        .find(|setting| setting.name == "resolution")?;
    match setting.domain {
        Domain::OneOf(values) => values.iter().copied().min(),
        Domain::Count { min, .. } => Some(min),
        _ => None,
    }
}

#[test]
fn the_window_goes_through_everything_without_a_validation_message_or_a_leak() {
    let Some(display) = Display::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let mut script = String::from("frames 120\n");
    for size in [
        "640 360", "1 1", "64 64", "3 200", "500 3", "801 601", "200 100", "320 240",
    ] {
        writeln!(script, "resize {size}\nframes 2").unwrap();
    }
    if display.manager.is_some() {
        script += "minimise\nrestore\nframes 2\nfullscreen on\nfullscreen off\nframes 2\n";
    }
    script += "vsync off\nframes 3\nvsync on\nscale 2\nframes 3\nscale 1\n";
    for entry in TECHNIQUES {
        writeln!(script, "technique left {}", entry.name).unwrap();
        if let Some(resolution) = smallest(entry) {
            writeln!(script, "set left resolution {resolution}").unwrap();
        }
        script += "still\n";
    }
    script += "technique left voxel-mips\nset left resolution 16\nset left injection rsm\nresize \
               200 150\npanels off\n";
    for view in view_names() {
        writeln!(script, "view {view}\nstill").unwrap();
    }
    script += "view full\ncomponent direct off\nstill\ncomponent visibility on\nstill\ncomponent \
               direct on\ncomponent visibility off\n";
    script += "compare split\ntechnique right none\nstill\ndivider 0.2\ndivider 0.8\ncompare \
               difference\nreference 3\ncompare single\n";
    script += "resize 480 360\npanels on\n";
    for section in SECTIONS {
        writeln!(script, "section {section}\nframes 2").unwrap();
    }
    script += "key F1\nframes 2\nkey Escape\nkey V\nkey C\nkey O\nkey F\nkey Home\nkey W\nlight \
               add\nlight move 0 0.1 0.1 0.1\nstill\n";
    script += "load bundled:two-rooms\nstill\ndrop scene/cornell.toml\nstill\nclose\n";
    // A scene of files, to be dropped on the window.
    let written = lumivox(
        folder.path(),
        &crate::support::program::words("scene cornell -o scene"),
        &[],
    );
    check_done(&written);
    check_done(&display.view(
        folder.path(),
        &[
            "--validate",
            "--size",
            "320x240",
            "--technique",
            "none",
            "--shadow-resolution",
            "256",
        ],
        &script,
    ));
}

#[test]
fn shaders_are_reloaded_and_broken_ones_leave_the_picture_as_it_was() {
    let Some(display) = Display::start() else {
        return;
    };
    if Command::new("glslangValidator")
        .arg("--version")
        .output()
        .is_err()
    {
        skipped(&Missing::Package("glslangValidator"));
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("glsl");
    copy_folder(&source, &path("glsl"));
    let composite = std::fs::read_to_string(source.join("render/screen/composite.comp")).unwrap();
    let changed = |name: &str, from: &str, to: &str| {
        assert!(composite.contains(from), "the shader has no {from}");
        std::fs::write(path(name), composite.replace(from, to)).unwrap();
    };
    changed("broken.comp", "imageStore(radiance", "imageStoer(radiance");
    changed(
        "rebound.comp",
        "layout(set = 1, binding = 0)",
        "layout(set = 1, binding = 9)",
    );
    changed(
        "mended.comp",
        "vec4(emitted + seen.rgb + reflected, seen.a)",
        "vec4(2.0 * (emitted + seen.rgb + reflected), seen.a)",
    );
    let to = "glsl/render/screen/composite.comp";
    let mut script = String::from("panels off\nstill\nsave before.exr\n");
    for refused in ["broken", "rebound"] {
        writeln!(
            script,
            "copy {refused}.comp {to}\nshader error\nframes 2\nstill\nsave {refused}.exr"
        )
        .unwrap();
    }
    writeln!(
        script,
        "copy mended.comp {to}\nshader ok\nframes 2\nstill\nsave mended.exr"
    )
    .unwrap();
    let arguments = [
        "--validate",
        "--size",
        "64x48",
        "--technique",
        "none",
        "--shadow-resolution",
        "256",
        "--glsl",
        "glsl",
    ];
    check_done(&display.view(folder.path(), &arguments, &script));
    let read = |name: &str| lumivox::image::read_exr(&path(name)).unwrap();
    let before = read("before.exr");
    assert_eq!(
        (&read("broken.exr"), &read("rebound.exr")),
        (&before, &before)
    );
    let twice = lumivox::image::Image::from_fn(before.width, before.height, |index| {
        2.0 * before.pixels[index]
    });
    assert_eq!(read("mended.exr"), twice);
}

fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let (source, target) = {
            let entry = entry.unwrap();
            (entry.path(), to.join(entry.file_name()))
        };
        if source.is_dir() {
            copy_folder(&source, &target)
        } else {
            assert!(std::fs::copy(&source, &target).is_ok())
        }
    }
}

#[test]
fn the_picture_at_rest_is_that_of_the_copied_command_line() {
    let Some(display) = Display::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let steps = [
        "still",
        "drag 0.5 0.5 0.7 0.4",
        "light move 0 0.1 -0.2 0.1\nlight add",
        "technique left svo cones\nset left resolution 32",
        "technique left clipmap\nset left resolution 16\nset left levels 2",
        "view diffuse",
        "technique left svo cones\nset left resolution 16\nset left attributes on\nview \
         voxel-albedo 1",
        "view voxels 2",
        "view structure 1",
        "view full\ncomponent direct off\ncomponent emission off",
        "suit left",
        "technique left voxel-mips\nsuit left",
        "load bundled:emissive-gallery\ntechnique left voxel-mips\nset left resolution 32\nset \
         left bounces feedback",
        "resize 90 70\nexposure 1.5\ncomponent direct on\ncomponent emission on",
    ];
    let mut script = String::from("panels off\n");
    for (index, step) in steps.iter().enumerate() {
        writeln!(
            script,
            "{step}\nstill\nsave {index}.exr\ncommand {index}.txt\nscreenshot {index}.png"
        )
        .unwrap();
    }
    let arguments = [
        "--validate",
        "--size",
        "120x80",
        "--set",
        "resolution=32",
        "--shadow-resolution",
        "256",
    ];
    check_done(&display.view(folder.path(), &arguments, &script));
    for (index, step) in steps.iter().enumerate() {
        let path = |extension: &str| folder.path().join(format!("{index}.{extension}"));
        let mut words: Vec<OsString> = std::fs::read_to_string(path("txt"))
            .unwrap()
            .lines()
            .map(OsString::from)
            .collect();
        let after = |option: &str| {
            words
                .iter()
                .position(|word| word == option)
                .map(|at| at + 1)
        };
        let (output, exposure) = (
            after("-o").unwrap(),
            after("--exposure").map_or(1.0, |at| words[at].to_str().unwrap().parse().unwrap()),
        );
        words[output] = "again.exr".into();
        check_done(&lumivox(folder.path(), &words, &[]));
        let again = folder.path().join("again.exr");
        assert!(
            std::fs::read(path("exr")).unwrap() == std::fs::read(&again).unwrap(),
            "step {index}, {step}: the picture differs from that of {words:?}"
        );
        // What the window chose for the scene is what `render` chooses, which nobody named.
        if step.ends_with("suit left") && step.contains("voxel-mips") {
            let is_named = |word: &OsString| word == "gather=triangles" || word == "resolution=128";
            assert_eq!(
                words.iter().filter(|word| is_named(word)).count(),
                2,
                "{words:?}"
            );
            words.retain(|word| word != "--preset" && word != "accurate");
            let mut at = 0;
            while at < words.len() {
                match words[at] == "--set" || words[at] == "--shadow-resolution" {
                    true => drop(words.drain(at..at + 2)),
                    false => at += 1,
                }
            }
            let output = words.iter().position(|word| word == "-o").unwrap() + 1;
            words[output] = "chosen.exr".into();
            check_done(&lumivox(folder.path(), &words, &[]));
            let chosen = folder.path().join("chosen.exr");
            assert!(
                std::fs::read(&again).unwrap() == std::fs::read(chosen).unwrap(),
                "the window chose otherwise than render: {words:?}"
            );
        }
        // And the window shows it, pixel by pixel, as the program would write it: shown for the
        // last step, which has an exposure.
        let png = folder.path().join("again.png");
        lumivox::image::write_png(&png, &lumivox::image::read_exr(&again).unwrap(), exposure)
            .unwrap();
        let open = |path: &Path| image::open(path).unwrap().to_rgb8();
        let expected = open(&png);
        assert!(
            open(&path("png")) == expected,
            "step {index}, {step}: the window shows another picture"
        );
        if index + 1 == steps.len() {
            words[output] = "again.png".into();
            check_done(&lumivox(folder.path(), &words, &[]));
            assert!(
                exposure != 1.0 && open(&png) == expected,
                "the program writes another picture"
            );
        }
    }
}

/// Columns of a beam's list.
fn columns(path: &Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines()
        .skip(1)
        .map(|line| {
            line.split(',')
                .map(|number| number.parse().unwrap())
                .collect()
        })
        .collect()
}

/// Techniques of cells have no beam, and list the cell at the pixel.
#[test]
fn the_cell_at_a_pixel_is_listed() {
    let Some(display) = Display::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let mut script = String::from("still\nsection beam\n");
    let techniques = ["lpv", "lpv-octree", "lpv-cascaded"];
    for technique in techniques {
        writeln!(
            script,
            "technique left {technique}\nset left resolution 16\nstill\nbeam 0.5 0.02 normal\n\
             beam list {technique}.csv\nscreenshot {technique}.png\nbeam off"
        )
        .unwrap();
    }
    let arguments = [
        "--validate",
        "--size",
        "560x600",
        "--shadow-resolution",
        "64",
    ];
    check_done(&display.view(folder.path(), &arguments, &script));
    for technique in techniques {
        let path = folder.path().join(format!("{technique}.csv"));
        let text = std::fs::read_to_string(path).unwrap();
        let names: Vec<&str> = text
            .lines()
            .filter_map(|line| line.split(',').next())
            .collect();
        assert_eq!(names[..2], ["name", "surface"], "{technique}");
        for name in [
            "cell",
            "opaque faces",
            "flux injected",
            "E facing +y",
            "E facing as the surface",
        ] {
            assert!(names.contains(&name), "{technique}: {text}");
        }
        assert_eq!(
            names.contains(&"grid"),
            technique == "lpv-cascaded",
            "{technique}"
        );
        assert_eq!(
            names.contains(&"leaf"),
            technique == "lpv-octree",
            "{technique}"
        );
        // The ceiling faces −y, and light comes to it from there.
        let value = |name: &str| {
            let line = text.lines().find(|line| line.starts_with(name)).unwrap();
            line.split_once(',')
                .map(|(_, value)| value.to_owned())
                .unwrap()
        };
        assert_eq!(
            value("E facing as the surface"),
            value("E facing −y"),
            "{technique}"
        );
        assert!(value("E facing −y") != value("E facing +y"), "{technique}");
    }
}

#[test]
fn a_beam_lists_what_it_sees() {
    let Some(display) = Display::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let mut script = String::from("still\nsection beam\n");
    for (technique, resolution) in [("voxel-mips", 32), ("svo", 32), ("clipmap", 16)] {
        writeln!(
            script,
            "technique left {technique} cones\nset left resolution {resolution}\nset left \
             interleave 1\nview diffuse\nstill\nsave {technique}.exr"
        )
        .unwrap();
        for cone in 0..16 {
            writeln!(
                script,
                "beam 0.5 0.8 diffuse {cone}\nbeam list {technique}-{cone}.csv"
            )
            .unwrap();
        }
        writeln!(
            script,
            "view structure\nstill\nbeam 0.5 0.8 mirror\nscreenshot {technique}.png\nbeam off"
        )
        .unwrap();
    }
    // Rays, no cones; then by hand, in split view too.
    script += "technique left voxel-mips accurate\nview full\nstill\nbeam 0.5 0.8 \
               normal\ntechnique left svo cones\nset left resolution 16\nkey P\nkey P\nstill\n";
    script += "compare split\ntechnique right clipmap cones\nset right resolution \
               16\nstill\nbeam 0.8 0.8 diffuse 3\nbeam list right.csv\nkey Escape\nframes 2\n";
    check_done(&display.view(
        folder.path(),
        &[
            "--validate",
            "--size",
            "500x300",
            "--technique",
            "none",
            "--shadow-resolution",
            "256",
        ],
        &script,
    ));
    for technique in ["voxel-mips", "svo", "clipmap"] {
        let image =
            lumivox::image::read_exr(&folder.path().join(format!("{technique}.exr"))).unwrap();
        let at = [image.width as f32 * 0.5, image.height as f32 * 0.8].map(|at| at as u32);
        let expected = f64::from(image.pixels[(at[0] + image.width * at[1]) as usize].y);
        let (mut irradiance, mut samples) = (0.0, 0);
        for cone in 0..16 {
            let rows = columns(&folder.path().join(format!("{technique}-{cone}.csv")));
            let (mut through, mut gathered) = (1.0, 0.0);
            for row in &rows {
                let [.., green, _, opacity, covered, _, sum, _] = row[..] else {
                    panic!("{row:?}")
                };
                gathered += through * opacity * green;
                through *= 1.0 - opacity;
                assert!(
                    (covered - 1.0 + through).abs() < 1e-5
                        && (sum - gathered).abs() < 1e-4 * gathered.max(1.0),
                    "{row:?}"
                );
            }
            // The samples have equal weights, as on a disc.
            irradiance += std::f64::consts::PI / 16.0 * gathered;
            samples += rows.len();
        }
        println!("{technique}: {samples} samples of 16 cones, {irradiance} of {expected} W/m²");
        assert!(
            samples >= 48 && expected > 0.0 && (irradiance - expected).abs() < 5e-3 * expected,
            "{technique}: {irradiance}, not {expected}"
        );
    }
    assert!(!columns(&folder.path().join("right.csv")).is_empty());
}

/// Figures of a simulator's list: names, and their numbers without units.
fn figures(path: &Path) -> BTreeMap<String, f64> {
    let text = std::fs::read_to_string(path).unwrap();
    let figure = |line: &str| {
        let (name, value) = line.split_once(',')?;
        let number = value.split([' ', ',']).next()?.parse().ok()?;
        Some((name.to_owned(), number))
    };
    text.lines().skip(1).filter_map(figure).collect()
}

#[test]
fn the_simulator_does_what_its_buttons_say() {
    let Some(display) = Display::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let script = "still\nsection simulator\nsimulator set cells 8\nsimulator list new.csv\n\
                  screenshot new.png\nsimulator act inject\nsimulator list injected.csv\n\
                  screenshot injected.png\nsimulator act step\nsimulator list stepped.csv\n\
                  screenshot stepped.png\nsimulator set axis x\nscreenshot across.png\n\
                  simulator over\nsimulator list over.csv\n\
                  simulator set propagator octree-axis6\nsimulator set occluder y\n\
                  simulator run 3\nsimulator set level 1\nsimulator act step-level\n\
                  simulator list level.csv\nsimulator set show merged\nsimulator list octree.csv\n\
                  screenshot octree.png\nsimulator set injector scene\nsimulator run 2\n\
                  simulator list scene.csv\nclose\n";
    let arguments = [
        "--validate",
        "--size",
        "760x620",
        "--technique",
        "lpv",
        "--set",
        "resolution=8",
        "--shadow-resolution",
        "64",
    ];
    check_done(&display.view(folder.path(), &arguments, script));
    let path = |name: &str| folder.path().join(name);
    let [new, injected, stepped, over, octree, scene] =
        ["new", "injected", "stepped", "over", "octree", "scene"]
            .map(|name| figures(&path(&format!("{name}.csv"))));
    assert_eq!((new["injected"], over["injected"]), (0.0, 0.0));
    assert_eq!((injected["on its way"], injected["steps"]), (64.0, 0.0));
    let accounted = stepped["on its way"] + stepped["left"] + stepped["lost"];
    assert!(
        stepped["steps"] == 1.0 && stepped["centre moved"] > 0.1 && (accounted - 64.0).abs() < 0.1,
        "{stepped:?}"
    );
    let level = figures(&path("level.csv"));
    assert!(
        level["steps"] == 4.0 && level["injected"] > 0.0,
        "{level:?}"
    );
    assert!(octree["steps"] == 4.0 && octree["levels"] == 3.0 && octree["absorbed"] > 0.0);
    assert!(octree["e_abs"] > 0.0 && octree["e_rel to one grid"] > 0.0);
    assert!(scene["injected"] > 0.0 && scene["injected"] != octree["injected"]);
    // Each of them is another picture.
    let seen = ["new", "injected", "stepped", "across", "octree"]
        .map(|name| std::fs::read(path(&format!("{name}.png"))).unwrap());
    for (index, picture) in seen.iter().enumerate() {
        assert!(!seen[..index].contains(picture), "picture {index}");
    }
    for (technique, script, says) in [
        (
            "lpv",
            "section simulator\nframes 2\nsimulator act jump\n",
            "no action jump",
        ),
        ("lpv", "simulator act step\n", "not open"),
        (
            "none",
            "section simulator\nsimulator act step\n",
            "no simulator",
        ),
    ] {
        let arguments = ["--technique", technique, "--shadow-resolution", "16"];
        let ran = display.view(folder.path(), &arguments, script);
        assert!(
            ran.code == Some(1) && ran.stderr.contains(says),
            "{script}: {}",
            ran.stderr
        );
    }
}

/// Memory of the process over 10,000 frames: 15 s; without validation, whose layers keep books of
/// their own.
#[test]
fn ten_thousand_frames_need_no_more_memory() {
    let Some(display) = Display::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    // The first frames compile pipelines. Without this variable glibc changes while the program
    // runs what it gives back to the system and what it keeps: up to 2.6% more after some
    // thousand frames, and no more from there on, 30,000 frames on too.
    let fixed = [
        ("MALLOC_MMAP_THRESHOLD_", "65536"),
        ("LUMIVOX_VALIDATE", "0"),
    ];
    let script = "frames 1000\nmemory mark\nframes 10000\nmemory check 1\n";
    let arguments = [
        "--size",
        "64x64",
        "--technique",
        "none",
        "--shadow-resolution",
        "16",
        "--no-vsync",
    ];
    let ran = display.view_in(folder.path(), &arguments, script, &fixed);
    check_done(&ran);
    println!(
        "{}",
        ran.stderr
            .lines()
            .find(|line| line.starts_with("memory:"))
            .unwrap_or_default()
    );
}

/// By keys alone: down the list into a folder and to a scene, or by its path. What cannot be read
/// is told.
#[test]
fn the_dialog_opens_a_scene_and_tells_what_it_cannot_open() {
    let Some(display) = Display::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    check_done(&lumivox(
        folder.path(),
        &crate::support::program::words("scene cornell -o scene"),
        &[],
    ));
    std::fs::write(folder.path().join("broken.toml"), "camera = 3\n").unwrap();
    let arguments = [
        "--validate",
        "--size",
        "640x400",
        "--technique",
        "none",
        "--shadow-resolution",
        "16",
    ];
    let by_list = "still\nbrowse\nframes 20\nkey ArrowDown\nkey Enter\nframes 20\nkey \
                   ArrowDown\nkey Enter\nopened cornell.obj\nstill\n";
    let by_path = "browse\nframes 20\nkey Slash\nframes 3\ntype /cornell.toml\nkey Enter\nopened \
                   cornell.toml\nstill\n";
    check_done(&display.view(folder.path(), &arguments, &format!("{by_list}{by_path}")));
    let broken = "browse\nframes 20\nkey Slash\nframes 3\ntype /broken.toml\nkey Enter\nopened \
                  broken.toml\n";
    let ran = display.view(folder.path(), &arguments, broken);
    assert!(
        ran.code == Some(1) && ran.stderr.contains("broken.toml:1"),
        "{}",
        ran.stderr
    );
}

#[test]
fn the_window_answers_while_a_frame_takes_long() {
    let Some(display) = Display::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let ran = display.view_in(
        folder.path(),
        &["--size", "480x360", "--set", "resolution=64"],
        "frames 5\nresponsive 4 10\n",
        &TIMED,
    );
    check_done(&ran);
    println!(
        "{}",
        ran.stderr
            .lines()
            .find(|line| line.starts_with("responsive:"))
            .unwrap_or_default()
    );
}

/// The window is left alone after each drag: nothing but itself brings the full picture. A machine
/// that is busy only makes the full picture late, which does not count.
#[test]
fn the_full_picture_follows_whatever_moved_and_the_status_says_what_is_shown() {
    let Some(display) = Display::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let mut script = String::from("still\n");
    let mut state = 7_u32;
    let mut random = |low: f32, high: f32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        low + (high - low) * (state >> 8) as f32 / (1 << 24) as f32
    };
    for _ in 0..12 {
        let [x, y, seconds] = [random(0.1, 0.9), random(0.2, 0.8), random(0.05, 0.6)];
        writeln!(script, "drag 0.5 0.5 {x:.2} {y:.2} {seconds:.2}\nsettled 1").unwrap();
    }
    script += "key W\nsettled 1\nresize 520 380\nsettled 1\nlight move 0 0.1 0 0\nsettled 1\n";
    script += "compare split\ntechnique right none\nsettled 1\ndrag 0.3 0.5 0.4 0.6 0.3\nsettled \
               1\ncompare single\n";
    // Frames that depend on each other: one of them is not the full picture, whatever its size.
    script += "resize 120 90\nset left bounces feedback\nstill\ndrag 0.5 0.5 0.7 0.6 0.3\nsettled \
               1\nsave shown.exr\ncommand shown.txt\n";
    let arguments = [
        "--size",
        "480x360",
        "--preset",
        "cones",
        "--set",
        "resolution=32",
        "--shadow-resolution",
        "256",
    ];
    check_done(&display.view_in(folder.path(), &arguments, &script, &TIMED));
    let mut words: Vec<OsString> = std::fs::read_to_string(folder.path().join("shown.txt"))
        .unwrap()
        .lines()
        .map(OsString::from)
        .collect();
    let output = words.iter().position(|word| word == "-o").unwrap() + 1;
    words[output] = "again.exr".into();
    check_done(&lumivox(folder.path(), &words, &[]));
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(
        read("shown.exr") == read("again.exr"),
        "the picture at rest differs from that of {words:?}"
    );
}

/// Real keys, which the window manager passes on to the window that has the focus: Ctrl and Shift
/// with them, and those that other programs take for themselves.
#[test]
fn the_keys_of_a_keyboard_do_what_the_overview_says() {
    let Some(display) = Display::start() else {
        return;
    };
    if display.manager.is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let keys = [
        ("F1", "help on"),
        ("Escape", "help off"),
        ("F2", "panels off"),
        ("F2", "panels on"),
        ("c", "compare split"),
        ("c", "compare difference"),
        ("c", "compare single"),
        ("v", "view direct"),
        ("Shift+v", "view full"),
        ("o", "camera orbit"),
        ("o", "camera fly"),
        ("]", "exposure 0.25"),
        ("[", "exposure 0"),
        ("Ctrl+3", "bookmark 3"),
        ("Ctrl+o", "dialog on"),
        ("Escape", "dialog off"),
        ("F11", "fullscreen on"),
        ("F11", "fullscreen off"),
    ];
    let mut script = String::from("still\n");
    for (index, (_, becomes)) in keys.iter().enumerate() {
        writeln!(script, "command {index}.txt\nuntil {becomes}").unwrap();
    }
    script += "command last.txt\nframes 100000\n";
    let arguments = ["--size", "640x400", "--technique", "none"];
    let wait_for = |name: &str, ran: &dyn Fn() -> bool| {
        while !folder.path().join(name).exists() && !ran() {
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
    };
    let ran = std::thread::scope(|scope| {
        let window = scope.spawn(|| display.view_in(folder.path(), &arguments, &script, &TIMED));
        let hand = display.hand();
        for (index, (key, _)) in keys.iter().enumerate() {
            wait_for(&format!("{index}.txt"), &|| window.is_finished());
            // The window may be slower to get the focus, or the dialog to open, than a hand is.
            std::thread::sleep(std::time::Duration::from_millis(100));
            hand.press(key);
        }
        wait_for("last.txt", &|| window.is_finished());
        std::thread::sleep(std::time::Duration::from_millis(100));
        hand.press("Ctrl+q");
        window.join().unwrap()
    });
    check_done(&ran);
}

#[test]
fn a_quick_picture_is_shown_in_the_next_frame() {
    let Some(display) = Display::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    // The pointer is moved, so that all from the event to the picture is in it.
    let ran = display.view_in(
        folder.path(),
        &[
            "--size",
            "64x64",
            "--technique",
            "none",
            "--shadow-resolution",
            "16",
        ],
        "still\nlatency 1\n",
        &TIMED,
    );
    check_done(&ran);
    println!(
        "{}",
        ran.stderr
            .lines()
            .find(|line| line.starts_with("latency:"))
            .unwrap_or_default()
    );
}

#[test]
fn without_a_display_the_error_names_render() {
    let folder = tempfile::tempdir().unwrap();
    for display in ["", ":987"] {
        let ran = lumivox(
            folder.path(),
            &crate::support::program::words("view"),
            &[("DISPLAY", display), ("WAYLAND_DISPLAY", "")],
        );
        check_error(
            &format!("display {display:?}"),
            &ran,
            1,
            &["no window can be opened", "lumivox render"],
        );
    }
}

#[test]
fn bad_arguments_are_named() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bad.txt"), "still\nfly 3\n").unwrap();
    for (line, says) in [
        ("view --script bad.txt", ["bad.txt", "line 2"]),
        ("view --script none.txt", ["none.txt", "No such file"]),
        ("view --set resolution=7", ["resolution", "7"]),
        ("view --glsl nowhere", ["--glsl nowhere", "no such folder"]),
        ("view missing.toml", ["missing.toml", ""]),
    ] {
        check_error(
            line,
            &lumivox(folder.path(), &crate::support::program::words(line), &[]),
            2,
            &says,
        );
    }
}
