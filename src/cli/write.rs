//! Files that commands write: whether they can be, before the work that fills them; their names.

use std::fs::OpenOptions;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::CliError;
use crate::output;

/// Checks that a file can be written before the work that fills it: opens it, changes nothing in
/// it, and removes it if it was not there before.
pub(super) fn check_output(path: &Path) -> Result<(), CliError> {
    let probe = match std::fs::metadata(path) {
        Ok(found) if found.is_dir() => {
            return Err(CliError::failed(format!(
                "cannot write {}: it is a folder; name a file in it",
                path.display()
            )));
        }
        // A pipe would wait for its reader here.
        Ok(found) if !found.is_file() => return Ok(()),
        Ok(_) => OpenOptions::new().write(true).open(path).map(drop),
        // A link to a file that is still to be made.
        Err(_) if path.is_symlink() => return Ok(()),
        Err(_) => make_and_remove(path),
    };
    probe.map_err(|error| {
        CliError::failed(format!(
            "cannot write {}: {error}; check that the folder exists, is writable and has space",
            path.display()
        ))
    })
}

/// Checks that files can be written into a folder. If it does not exist, it is made later.
pub(super) fn check_output_folder(path: &Path) -> Result<(), CliError> {
    let above = path.ancestors().map(|folder| {
        if folder.as_os_str().is_empty() {
            Path::new(".")
        } else {
            folder
        }
    });
    let existing = above
        .into_iter()
        .find(|folder| folder.exists())
        .unwrap_or(path);
    let probe = match existing.is_dir() {
        true => make_and_remove(&existing.join(format!(".lumivox-{}", std::process::id()))),
        false => Err(ErrorKind::NotADirectory.into()),
    };
    probe.map_err(|error| {
        let (path, existing) = (path.display(), existing.display());
        CliError::failed(format!(
            "cannot write into the folder {path}: {existing}: {error}; make it a writable folder, \
             or name another with -o"
        ))
    })
}

fn make_and_remove(path: &Path) -> std::io::Result<()> {
    OpenOptions::new().write(true).create_new(true).open(path)?;
    std::fs::remove_file(path)
}

/// Writes a report as one JSON object.
pub(super) fn write_report(path: &Path, report: &serde_json::Value) -> Result<(), CliError> {
    output::write_text(path, &format!("{report:#}\n")).map_err(|error| {
        CliError::failed(format!(
            "cannot write the report {}: {error}; check that the folder exists, is writable and \
             has space",
            path.display()
        ))
    })
}

/// Makes the folder of an output.
pub(super) fn make_folder(folder: &Path) -> Result<(), CliError> {
    std::fs::create_dir_all(folder).map_err(|error| {
        CliError::failed(format!(
            "cannot make the folder {}: {error}; name another with -o",
            folder.display()
        ))
    })
}

/// Writes a whole file of text.
pub(super) fn write_text(path: &Path, text: &str) -> Result<(), CliError> {
    output::write_text(path, text).map_err(|error| {
        CliError::failed(format!(
            "cannot write {}: {error}; check that it is writable and has space",
            path.display()
        ))
    })
}

/// Where the files of each scene go, without what follows the scene's name.
pub(super) fn stems<'n>(scenes: impl Iterator<Item = &'n str>, folder: &Path) -> Vec<PathBuf> {
    let mut names: Vec<String> = Vec::new();
    scenes.for_each(|scene| names.push(unused_stem(scene, &names)));
    names.iter().map(|name| folder.join(name)).collect()
}

/// A file name for a scene that no scene before it has.
fn unused_stem(name: &str, used: &[String]) -> String {
    let safe: String = name
        .chars()
        .map(|c| {
            if c.is_alphanumeric() || "-_".contains(c) {
                c
            } else {
                '_'
            }
        })
        .collect();
    let numbered = (2..).map(|number| format!("{safe}_{number}"));
    std::iter::once(safe.clone())
        .chain(numbered)
        .find(|stem| !used.contains(stem))
        .unwrap_or(safe)
}

/// `NAME-WHAT` beside `NAME`.
pub(super) fn chart_stem(stem: &Path, what: &str) -> PathBuf {
    let mut name = stem.file_name().unwrap_or_default().to_owned();
    name.push(format!("-{what}"));
    stem.with_file_name(name)
}
