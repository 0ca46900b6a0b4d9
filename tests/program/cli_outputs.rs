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
    ("compare gone.exr gone.exr --report OUT", ".json"),
];

/// Commands that write into a folder.
const FOLDER_WORK: &[&str] = &[
    "bench bundled:cornell --size 2048x2048 --frames 100000 -o OUT",
    "scene bundled:cornell -o OUT",
];

/// A folder with a file, a file that is not to be written, a folder where a file would go, and a
/// folder that is not to be written into.
fn places() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("file"), "kept").unwrap();
    std::fs::create_dir(at("locked")).unwrap();
    for extension in ["exr", "png", "json"] {
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
    for name in ["cornell.csv", "cornell-passes.svg"] {
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
