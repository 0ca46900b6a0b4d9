//! Commands of README and docs work as they stand there, and the manual page of scenes has every
//! key of the parser.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::support::program::lumivox;
use lumivox::scene::{LoadOptions, Scene};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// README and all pages.
fn pages() -> Vec<PathBuf> {
    let mut pages = vec![root().join("README.md")];
    let mut folders = vec![root().join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                pages.push(path);
            }
        }
    }
    pages.sort();
    pages
}

/// The commands in a page's blocks of `sh`, without comments.
fn commands(page: &str) -> Vec<String> {
    let mut is_shell = false;
    let mut found = Vec::new();
    for line in page.lines() {
        if let Some(language) = line.trim_start().strip_prefix("```") {
            is_shell = language == "sh";
        } else if is_shell && line.starts_with("lumivox ") {
            let command = line.split(" #").next().unwrap_or(line);
            found.push(command.trim().to_owned());
        }
    }
    found
}

/// Parts of commands that are not run, and why.
const NOT_RUN: &[(&str, &str)] = &[
    ("$LUMIVOX_SCENES", "the scene is not in the project"),
    ("lumivox view", "it opens a window"),
    ("--merge", "it gathers what other lines measure"),
    ("my-scene/scene.toml", "the page's block is that scene"),
    ("thing.obj", "it is the reader's own model"),
    ("thing.glb", "it is the reader's own model"),
];

/// Replaces the value of an option, or adds the option.
fn set(words: &mut Vec<String>, option: &str, value: &str) {
    match words.iter().position(|word| word == option) {
        Some(at) => words[at + 1] = value.to_owned(),
        None => words.extend([option.to_owned(), value.to_owned()]),
    }
}

/// Leaves an option and its value out.
fn unset(words: &mut Vec<String>, option: &str) {
    if let Some(at) = words.iter().position(|word| word == option) {
        words.drain(at..at + 2);
    }
}

/// The same command on a small picture; of a command that measures for long, its list.
fn small(command: &str) -> Vec<String> {
    let mut words: Vec<String> = split(command).into_iter().skip(1).collect();
    if words
        .iter()
        .any(|word| word == "--help" || word == "--list")
    {
        return words;
    }
    for word in &mut words {
        if word.starts_with("resolution=") {
            *word = "resolution=16".to_owned();
        }
        if word.starts_with("length_m=") {
            *word = "length_m=60".to_owned();
        }
    }
    if words.iter().any(|word| word == "--resolution") {
        set(&mut words, "--resolution", "16");
    }
    match words[0].clone().as_str() {
        "chart" | "stress" => {
            ["-o", "--shard", "--stress"]
                .iter()
                .for_each(|option| unset(&mut words, option));
            words.push("--list".to_owned());
        }
        "bench" => {
            set(&mut words, "--size", "16x12");
            set(&mut words, "--frames", "1");
            set(&mut words, "--rebuilds", "1");
            set(&mut words, "--shadow-resolution", "64");
            unset(&mut words, "--max-error");
            if words.iter().any(|word| word == "--walk") {
                set(&mut words, "--walk", "1");
            }
            if !words.iter().any(|word| word == "--no-reference") {
                words.push("--no-reference".to_owned());
            }
        }
        "render" => {
            set(&mut words, "--size", "16x12");
            set(&mut words, "--shadow-resolution", "64");
            if words.iter().any(|word| word == "--frames") {
                set(&mut words, "--frames", "1");
            }
        }
        "reference" => {
            set(&mut words, "--size", "16x12");
            unset(&mut words, "--max-error");
            set(&mut words, "--spp", "4");
        }
        "lpv" => {
            for option in ["--iterations", "--reference-iterations"] {
                if words.iter().any(|word| word == option) {
                    set(&mut words, option, "2");
                }
            }
        }
        "fit" => {
            set(&mut words, "--size", "16x12");
            set(&mut words, "--frames", "1");
            set(&mut words, "--rebuilds", "1");
            set(&mut words, "--shadow-resolution", "64");
            set(&mut words, "--noise", "0.5");
            set(&mut words, "--grid", TINY_GRID[0]);
            // What it answers is another matter; small pictures are far off.
            for option in ["--max-error", "--max-ms", "--max-mib"] {
                if words.iter().any(|word| word == option) {
                    set(&mut words, option, "1000000");
                }
            }
        }
        "explain" => {
            set(&mut words, "--size", "16x12");
            set(&mut words, "--shadow-resolution", "64");
            set(&mut words, "--max-error", "0.5");
        }
        _ => {}
    }
    words
}

/// The words of a command; single quotes keep a word together.
fn split(command: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (index, part) in command.split('\'').enumerate() {
        if index % 2 == 1 {
            words.push(part.to_owned());
        } else {
            words.extend(part.split_whitespace().map(str::to_owned));
        }
    }
    words
}

/// Files of the project that commands read.
const GRIDS: &[&str] = &[
    "docs/results/bundled/grid.toml",
    "docs/results/lpv-versus-cones/grid.toml",
    "docs/results/structures/grid.toml",
];

/// A grid of one point, to which the local search adds: its name and what it says.
const TINY_GRID: [&str; 2] = [
    "tiny.toml",
    "[[sweep]]\ntechnique = [\"voxel-mips\"]\npreset = [\"cones\"]\nset = { resolution = [8] }\n",
];

#[test]
fn commands_of_the_pages_work() {
    let cache = tempfile::tempdir().unwrap();
    let mut wrong = Vec::new();
    let (mut ran, mut known) = (0, BTreeSet::new());
    for page in pages() {
        let folder = tempfile::tempdir().unwrap();
        for grid in GRIDS {
            let copy = folder.path().join(grid);
            std::fs::create_dir_all(copy.parent().unwrap()).unwrap();
            std::fs::copy(root().join(grid), copy).unwrap();
        }
        std::fs::write(folder.path().join(TINY_GRID[0]), TINY_GRID[1]).unwrap();
        for command in commands(&std::fs::read_to_string(&page).unwrap()) {
            if NOT_RUN.iter().any(|(part, _)| command.contains(part)) {
                continue;
            }
            let words = small(&command);
            // What many pages have is run once, unless later lines need what it writes.
            let is_again = !known.insert(words.clone());
            if is_again && ["chart", "stress", "bench", "explain"].contains(&words[0].as_str()) {
                continue;
            }
            let arguments: Vec<std::ffi::OsString> = words.iter().map(Into::into).collect();
            let environment = [("LUMIVOX_CACHE", cache.path().to_str().unwrap())];
            let result = lumivox(folder.path(), &arguments, &environment);
            ran += 1;
            if result.code != Some(0) {
                let page = page.strip_prefix(root()).unwrap().display();
                wrong.push(format!(
                    "{page}: {command}\n  as {words:?}: {}",
                    result.stderr
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(ran > 20, "{ran} commands");
}

/// What the parser knows, by its answer to a key that nobody has.
fn keys_of_the_parser() -> BTreeSet<String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let mut keys = BTreeSet::new();
    for table in [
        "",
        "[[model]]\n",
        "[[model]]\n[[model.keyframe]]\n",
        "[camera]\n",
        "[[light]]\n",
        "[environment]\n",
        "[environment.clear_sky]\n",
    ] {
        std::fs::write(&path, format!("{table}zz = 1\n")).unwrap();
        let error = Scene::load(&path, &LoadOptions::default())
            .unwrap_err()
            .to_string();
        let (_, expected) = error.split_once("expected ").expect("an unknown field");
        let prefix: String = table
            .lines()
            .last()
            .map(|line| format!("{}.", line.trim_matches(['[', ']'])))
            .unwrap_or_default();
        let names = expected.split('`').skip(1).step_by(2);
        keys.extend(names.map(|name| format!("{prefix}{name}")));
    }
    keys
}

#[test]
fn the_manual_page_has_every_key() {
    let page = std::fs::read_to_string(root().join("docs/scene-toml.md")).unwrap();
    let told: BTreeSet<String> = page
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once("` |"))
        .map(|(key, _)| key.to_owned())
        .collect();
    let known = keys_of_the_parser();
    assert_eq!(told, known);
    assert!(known.len() > 15, "{known:?}");
}
