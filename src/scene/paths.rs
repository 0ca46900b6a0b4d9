//! Finding files that scene files name.

use std::borrow::Cow;
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

/// What is at a path in place of a file, as "a folder": `None` where there is a file, or nothing.
/// Asking does not open it: a pipe would wait for its writer, and a device may have no end.
pub(super) fn not_a_file(path: &Path) -> Option<&'static str> {
    let kind = std::fs::metadata(path).ok()?.file_type();
    match kind {
        _ if kind.is_file() => None,
        _ if kind.is_dir() => Some("a folder"),
        _ => Some("a device, pipe or socket"),
    }
}

/// The file as text, without a byte order mark; bytes that are not UTF-8 (comments and names of
/// old exporters) become replacement characters.
pub(super) fn read_text(path: &Path) -> Result<String, SceneError> {
    let bytes = std::fs::read(path).map_err(|error| SceneError::read(path, error))?;
    let text = String::from_utf8(bytes)
        .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned());
    Ok(match text.strip_prefix('\u{feff}') {
        Some(rest) => rest.to_owned(),
        None => text,
    })
}

/// The lines of an OBJ or MTL file, each with the number of the first line that it stands on: a
/// `\` at the end of a line joins the next one to it, but not at the end of a comment.
pub(super) fn joined_lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = (1..).zip(text.lines());
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut line = Cow::Borrowed(first);
        while let Some(start) = continued(&line) {
            let (start, next) = (start.to_owned(), lines.next());
            line = Cow::Owned(match next {
                Some((_, next)) => start + " " + next,
                None => start,
            });
        }
        Some((number, line))
    })
}

/// A line without its last `\`; `None` where it has none, or is a comment.
fn continued(line: &str) -> Option<&str> {
    let is_comment = line.trim_start().starts_with('#');
    line.trim_end().strip_suffix('\\').filter(|_| !is_comment)
}
