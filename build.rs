//! Tells the program which path tracer it has, and what works transfer out: what is kept on disk is
//! of one build of them.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash as _, Hasher as _};
use std::path::{Path, PathBuf};

/// All that a transfer depends on, besides the scene.
const TRANSFER: [&str; 5] = [
    "src/gi/prt",
    "src/gi/shared/sh",
    "src/scene",
    "src/image",
    "Cargo.lock",
];

/// All that a reference depends on, besides the scene: the tracer, the scenes and textures that it
/// reads, and the crates below them.
const SOURCES: [&str; 4] = ["src/reference", "src/scene", "src/image", "Cargo.lock"];

fn main() -> std::io::Result<()> {
    tell_hash("LUMIVOX_TRACER", &SOURCES)?;
    tell_hash("LUMIVOX_TRANSFER", &TRANSFER)
}

/// Sets a variable to the hash of all files of these sources.
fn tell_hash(variable: &str, sources: &[&str]) -> std::io::Result<()> {
    let mut files = Vec::new();
    for source in sources {
        println!("cargo::rerun-if-changed={source}");
        list(Path::new(source), &mut files)?;
    }
    files.sort();
    let mut hasher = DefaultHasher::new();
    for file in files {
        (file.to_string_lossy(), std::fs::read(&file)?).hash(&mut hasher);
    }
    println!("cargo::rustc-env={variable}={:016x}", hasher.finish());
    Ok(())
}

/// All files in a folder and its folders; a file that is not there is none: a packaged crate may
/// lack its lock file.
fn list(path: &Path, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    if path.is_file() {
        files.push(path.to_owned());
    } else if path.is_dir() {
        for entry in std::fs::read_dir(path)? {
            list(&entry?.path(), files)?;
        }
    }
    Ok(())
}
