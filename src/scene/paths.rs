//! Finding files that scene files name.

use std::path::{Path, PathBuf};

use super::SceneError;

/// The file that `name`, written in a file in `folder`, means: as written, else with backslashes as
/// separators, else with upper and lower case taken as the same. `None` where there is none, or no
/// file but a folder, or a device or pipe, which may have no end.
pub(super) fn resolve(folder: &Path, name: &str) -> Option<PathBuf> {
    let direct = folder.join(name);
    if direct.is_file() {
        return Some(direct);
    }
    let portable = name.replace('\\', "/");
    let mut found = if portable.starts_with('/') {
        PathBuf::from("/")
    } else {
        folder.to_owned()
    };
    for component in portable
        .split('/')
        .filter(|component| !component.is_empty())
    {
        let exact = found.join(component);
        found = if exact.exists() {
            exact
        } else {
            entry_ignoring_case(&found, component)?
        };
    }
    found.is_file().then_some(found)
}

fn entry_ignoring_case(folder: &Path, name: &str) -> Option<PathBuf> {
    let folder = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let wanted = name.to_lowercase();
    let mut entries: Vec<_> = std::fs::read_dir(folder)
        .ok()?
        .flatten()
        .map(|entry| entry.path())
        .collect();
    entries.sort();
    entries.into_iter().find(|path| {
        path.file_name()
            .is_some_and(|found| found.to_string_lossy().to_lowercase() == wanted)
    })
}

/// The folder that a file's references start from.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

/// A file's name without folder and extension, for reports.
pub(super) fn stem_of(path: &Path) -> String {
    path.file_stem()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

/// The file as text; bytes that are not UTF-8 (comments and names of old exporters) become
/// replacement characters.
pub(super) fn read_text(path: &Path) -> Result<String, SceneError> {
    let bytes = std::fs::read(path).map_err(|error| SceneError::read(path, error))?;
    Ok(String::from_utf8(bytes)
        .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned()))
}
