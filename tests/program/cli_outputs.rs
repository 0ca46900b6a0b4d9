//! Outputs that cannot be written are told before the work, and leave nothing behind.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::support::program::{check_error, lumivox, words};

/// Commands whose work takes hours, where nobody stops it, and what the output is called in each.
const WORK: &[(&str, &str)] = &[
    (
        "render bundled:cornell --size 2048x2048 --frames 100000 -o OUT",
        ".exr",
    ),
    (
        "render bundled:cornell --size 2048x2048 --frames 100000 -o OUT",
        ".png",
    ),
    (
        "render bundled:cornell --size 2048x2048 --frames 100000 -o fine.exr --report OUT",
        ".json",
    ),
    (
        "reference bundled:cornell --size 4096x4096 --spp 1000000 --no-cache -o OUT",
        ".exr",
    ),
    (
        "reference bundled:cornell --size 4096x4096 --spp 1000000 --no-cache --layers -o OUT",
        ".exr",
    ),
    (
        "reference bundled:cornell --size 4096x4096 --spp 1000000 --no-cache -o fine.exr --report \
         OUT",
        ".json",
    ),
    ("voxelize gone.obj --resolution 1024 -o OUT", ".json"),
    ("compare gone.exr gone.exr --heatmap OUT", ".png"),
    ("compare gone.exr gone.exr --bins OUT", ".png"),
    ("compare gone.exr gone.exr --report OUT", ".json"),
    ("compare gone_#.exr gone_#.exr --chart OUT", ".svg"),
];

/// Commands that write into a folder.
const FOLDER_WORK: &[&str] = &[
    "bench bundled:cornell --size 2048x2048 --frames 100000 -o OUT",
    "scene bundled:cornell -o OUT",
    "lpv --injector wall --cells 128 --iterations 1000 -o OUT",
];

/// A folder with a file, a file that is not to be written, a folder where a file would go, and a
/// folder that is not to be written into.
fn places() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("file"), "kept").unwrap();
    std::fs::create_dir(at("locked")).unwrap();
    for extension in ["exr", "png", "json", "svg"] {
        std::fs::create_dir(at(&format!("folder.{extension}"))).unwrap();
        std::fs::write(at(&format!("kept.{extension}")), "kept").unwrap();
        lock(&at(&format!("kept.{extension}")));
    }
    lock(&at("locked"));
    folder
}

fn lock(path: &Path) {
    let mut permissions = std::fs::metadata(path).unwrap().permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(path, permissions).unwrap();
}

/// Root can write anywhere.
fn is_root(folder: &Path) -> bool {
    let probe = folder.join("locked/probe");
    std::fs::write(&probe, "").is_ok() && std::fs::remove_file(&probe).is_ok()
}

/// All that is in a folder, with contents.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Option<Vec<u8>>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(contents(&path));
        }
        found.insert(path.clone(), std::fs::read(&path).ok());
    }
    found
}

#[test]
fn unwritable_outputs_are_told_before_the_work() {
    let folder = places();
    let is_root = is_root(folder.path());
    let before = contents(folder.path());
    let check = |line: &str, out: &str, says: &str| {
        let line = line.replace("OUT", out);
        check_error(
            &line,
            &lumivox(folder.path(), &words(&line), &[]),
            1,
            &[out, says],
        );
        assert_eq!(
            contents(folder.path()),
            before,
            "{line}: something was left or changed"
        );
    };
    for (line, extension) in WORK {
        check(line, &format!("gone/a{extension}"), "folder exists");
        check(line, &format!("file/a{extension}"), "folder exists");
        check(line, &format!("folder{extension}"), "it is a folder");
        if !is_root {
            check(line, &format!("locked/a{extension}"), "is writable");
            check(line, &format!("kept{extension}"), "is writable");
        }
    }
    for line in FOLDER_WORK {
        check(line, "file", "-o");
        check(line, "file/deep/deeper", "-o");
        if !is_root {
            check(line, "locked", "-o");
            check(line, "locked/deep", "-o");
        }
    }
}

#[test]
fn a_folder_in_the_place_of_a_benchmark_file_is_told_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["cornell-bench.csv", "cornell-bench-passes.svg"] {
        let taken = folder.path().join("out").join(name);
        std::fs::create_dir_all(&taken).unwrap();
        let ran = lumivox(
            folder.path(),
            &words("bench bundled:cornell --size 2048x2048 --frames 100000 -o out"),
            &[],
        );
        check_error(name, &ran, 1, &[name, "it is a folder"]);
        std::fs::remove_dir(&taken).unwrap();
        assert!(
            contents(folder.path()).values().all(Option::is_none),
            "{name}: something was left"
        );
    }
}

/// An existing file stays unchanged until the work is done. If the work fails, the check of the
/// output leaves no file behind.
#[test]
fn a_failure_leaves_what_was_there() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("old.exr"), "kept").unwrap();
    let before = contents(folder.path());
    for line in [
        "render gone.obj -o old.exr --report new.json",
        "render gone.obj -o new.exr --report new.json",
        "reference gone.obj -o new.exr",
        "compare gone.exr gone.exr --heatmap new.png --report new.json",
        "bench gone.obj -o new",
        "scene gone.obj -o new",
    ] {
        assert_eq!(
            lumivox(folder.path(), &words(line), &[]).code,
            Some(2),
            "{line}"
        );
        assert_eq!(
            contents(folder.path()),
            before,
            "{line}: something was left or changed"
        );
    }
}

/// Runs a command that has to work.
fn do_it(folder: &Path, arguments: &str) {
    let ran = lumivox(folder, &words(arguments), &[]);
    assert_eq!(ran.code, Some(0), "{arguments}: {}", ran.stderr);
}

/// A scene of its own files, an image and a reference.
fn inputs() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    do_it(folder.path(), "scene bundled:glossy -o .");
    for name in ["a.exr", "b.exr"] {
        let arguments =
            format!("reference bundled:cornell --size 8x8 --spp 1 --no-cache -o {name}");
        do_it(folder.path(), &arguments);
    }
    std::fs::copy(
        folder.path().join("glossy.toml"),
        folder.path().join("scene.json"),
    )
    .unwrap();
    folder
}

/// No command replaces what it reads, nor one of its outputs by another: not under another name,
/// not through a link.
#[test]
fn nothing_that_is_read_is_replaced() {
    let folder = inputs();
    let at = |name: &str| folder.path().join(name);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("b.exr", at("link.png")).unwrap();
        std::os::unix::fs::symlink("glossy.toml", at("link.json")).unwrap();
        std::os::unix::fs::symlink("fresh.png", at("one.png")).unwrap();
        std::os::unix::fs::symlink("./fresh.png", at("one.json")).unwrap();
    }
    std::fs::hard_link(at("a.exr"), at("hard.png")).unwrap();
    let small = "--size 8x8 --set resolution=16";
    let cases = [
        (
            "compare a.exr b.exr --heatmap b.exr".into(),
            "the name must end in .png",
        ),
        (
            "compare a.exr b.exr --heatmap link.png".into(),
            "link.png is read by this command",
        ),
        (
            "compare a.exr b.exr --heatmap hard.png".into(),
            "hard.png is read by this command",
        ),
        (
            "compare a.exr b.exr --report ./x.txt".into(),
            "the name must end in .json",
        ),
        (
            "compare a.exr b.exr --heatmap one.png --report one.json".into(),
            "is written twice",
        ),
        (
            format!("render glossy.toml {small} -o s.png --report s.png"),
            "must end in .json",
        ),
        (
            format!("render glossy.toml {small} -o s.png --report glossy.toml"),
            "end in .json",
        ),
        (
            format!("render glossy.toml {small} -o s.png --report link.json"),
            "is read by this",
        ),
        (
            format!("render glossy.toml {small} --reference a.exr -o a.exr"),
            "a.exr is read by",
        ),
        (
            "explain glossy.toml --size 8x8 --report link.json".into(),
            "is read by this command",
        ),
        (
            "voxelize glossy.toml -o link.json".into(),
            "is read by this command",
        ),
        ("scene glossy.toml -o .".into(), "which would be replaced"),
        (
            "scene ./glossy.toml -o ../".to_owned()
                + folder.path().file_name().unwrap().to_str().unwrap(),
            "which would be replaced",
        ),
    ];
    let before = contents(folder.path());
    for (arguments, message) in &cases {
        let output = lumivox(folder.path(), &words(arguments), &[]);
        assert_eq!(
            output.code,
            Some(if message == &"which would be replaced" {
                1
            } else {
                2
            })
        );
        assert!(
            output.stderr.contains(message),
            "{arguments}: {}",
            output.stderr
        );
        assert_eq!(contents(folder.path()), before, "{arguments}");
    }
}

/// A texture is one of the scene's files, and results beside the scene could replace it.
#[test]
fn a_scenes_textures_are_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    image::RgbImage::new(2, 2).save(at("tile.png")).unwrap();
    std::fs::write(at("m.mtl"), "newmtl m\nmap_Kd tile.png\n").unwrap();
    std::fs::write(
        at("m.obj"),
        "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n",
    )
    .unwrap();
    let before = contents(folder.path());
    for (arguments, message) in [
        (
            "render m.obj --size 8x8 -o tile.png",
            "tile.png is read by this command",
        ),
        ("bench m.obj --size 8x8 -o .", "could replace"),
        ("chart m.obj --size 8x8 -o .", "could replace"),
        ("stress m.obj -o .", "could replace"),
    ] {
        let output = lumivox(folder.path(), &words(arguments), &[]);
        check_error(arguments, &output, 2, &[message]);
        assert_eq!(contents(folder.path()), before, "{arguments}");
    }
}

/// Benchmarks of one scene are kept beside each other and beside the records of `chart`.
#[test]
fn records_are_added_to() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join("out").join(name);
    let lines = |name: &str| std::fs::read_to_string(at(name)).unwrap().lines().count();
    std::fs::write(
        folder.path().join("grid.toml"),
        "[[sweep]]\ntechnique = [\"voxel-mips\"]\npreset = [\"cones\"]\n\
         set = { resolution = [16] }\n",
    )
    .unwrap();
    let size = "--size 16x16 --shadow-resolution 64 --max-error 0.3 --frames 1 -o out --quiet";
    let chart = format!("chart bundled:cornell --grid grid.toml {size}");
    let bench = format!("bench bundled:cornell --technique none {size}");
    for arguments in [
        &chart,
        &bench,
        &bench,
        &chart,
        &"chart --merge out -o out".to_owned(),
    ] {
        do_it(folder.path(), arguments);
    }
    assert_eq!(
        (lines("cornell.jsonl"), lines("cornell-bench.jsonl")),
        (2, 2)
    );
    // Both were of one case: the later one counts.
    do_it(folder.path(), "bench --merge out -o merged");
    let merged = std::fs::read_to_string(folder.path().join("merged/cornell-bench.jsonl"));
    assert_eq!(merged.unwrap().lines().count(), 1);
    let records = at("cornell-bench.jsonl");
    std::fs::copy(at("cornell.jsonl"), &records).unwrap();
    let output = lumivox(folder.path(), &words(&bench), &[]);
    check_error(&bench, &output, 1, &["it is a record of lumivox chart"]);

    let file = std::fs::File::open(&records).unwrap();
    file.lock().unwrap();
    let output = lumivox(folder.path(), &words(&bench), &[]);
    check_error(&bench, &output, 1, &["another lumivox writes"]);
}

/// A place without space is a failure, on disk and on the terminal.
#[cfg(target_os = "linux")]
#[test]
fn a_full_place_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let small = "--size 8x8 --set resolution=16";
    for arguments in [
        format!("render bundled:cornell {small} -o /dev/full"),
        format!("render bundled:cornell {small} -o a.png --report /dev/full"),
    ] {
        let output = lumivox(folder.path(), &words(&arguments), &[]);
        assert_eq!(output.code, Some(1), "{arguments}: {}", output.stderr);
        assert!(output.stderr.contains("No space left"), "{}", output.stderr);
    }
    for arguments in [
        "--help",
        "render --help",
        "techniques",
        "devices",
        "scene --list",
    ] {
        let output = crate::support::program::command()
            .args(words(arguments))
            .stdout(std::fs::File::create("/dev/full").unwrap())
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments}: {stderr}");
        assert!(
            stderr.contains("standard output: No space left"),
            "{arguments}: {stderr}"
        );
    }
}

/// A program that is stopped says what is kept, and ends by the signal.
#[cfg(unix)]
#[test]
fn a_stopped_program_says_what_is_kept() {
    use std::os::unix::process::ExitStatusExt;
    use std::time::{Duration, Instant};
    let folder = tempfile::tempdir().unwrap();
    let mut child = crate::support::program::command()
        .args(words(
            "chart bundled:cornell --size 16x16 --shadow-resolution 64 --max-error 0.3 -o out",
        ))
        .current_dir(folder.path())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let records = folder.path().join("out/cornell.jsonl");
    let start = Instant::now();
    while std::fs::read_to_string(&records)
        .unwrap_or_default()
        .is_empty()
    {
        assert!(
            start.elapsed() < Duration::from_secs(60),
            "nothing is measured"
        );
        std::thread::sleep(Duration::from_millis(20));
    }
    let killed = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
    let status = child.wait().unwrap();
    let mut stderr = String::new();
    std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut stderr).unwrap();
    assert_eq!(status.signal(), Some(2), "{stderr}");
    assert!(
        stderr.contains("stopped: the points that were measured are kept"),
        "{stderr}"
    );
    let whole = std::fs::read_to_string(&records).unwrap();
    assert!(whole.ends_with('\n'));
}
