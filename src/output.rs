//! Files that the program writes: each is there whole, or as it was before.

use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Cursor, Error, ErrorKind, Seek, Write};
use std::path::{Path, PathBuf};

/// What a file's contents are written to.
pub trait Sink: Write + Seek {}

impl<T: Write + Seek> Sink for T {}

/// Links that lead to a file, at most.
const LINKS_MAX: usize = 40;

/// Writes a file: `fill` fills a new file in the same folder, which then takes the name. If
/// anything fails, what was there stays. A link is followed, and a pipe or device is written to.
pub fn write_file<E: From<Error>>(
    path: &Path,
    fill: impl FnOnce(&mut dyn Sink) -> Result<(), E>,
) -> Result<(), E> {
    let target = resolve(path);
    if target.is_symlink() {
        return Err(Error::other("its links lead to no file").into());
    }
    let found = std::fs::metadata(&target).ok();
    if found.as_ref().is_some_and(|found| !found.is_file()) {
        let mut bytes = Cursor::new(Vec::new());
        fill(&mut bytes)?;
        return Ok(OpenOptions::new()
            .write(true)
            .open(&target)?
            .write_all(bytes.get_ref())?);
    }
    let mut unfinished = tempfile::Builder::new();
    unfinished.prefix(".").suffix(".part");
    #[cfg(unix)]
    unfinished.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let unfinished = match unfinished.tempfile_in(folder_of(&target)) {
        Ok(unfinished) => unfinished,
        // A file that may be written, in a folder that may not.
        Err(error) if error.kind() == ErrorKind::PermissionDenied && found.is_some() => {
            return fill_whole(
                OpenOptions::new()
                    .write(true)
                    .truncate(true)
                    .open(&target)?,
                fill,
            );
        }
        Err(error) => return Err(error.into()),
    };
    fill_whole(unfinished.as_file().try_clone()?, fill)?;
    if let Some(found) = found {
        unfinished.as_file().set_permissions(found.permissions())?;
    }
    unfinished
        .persist(&target)
        .map(drop)
        .map_err(|error| error.error.into())
}

fn fill_whole<E: From<Error>>(
    file: File,
    fill: impl FnOnce(&mut dyn Sink) -> Result<(), E>,
) -> Result<(), E> {
    let mut sink = BufWriter::new(file);
    fill(&mut sink)?;
    let file = sink.into_inner().map_err(|error| error.into_error())?;
    Ok(file.sync_all()?)
}

/// Writes a file of text.
pub fn write_text(path: &Path, text: &str) -> Result<(), Error> {
    write_file(path, |file| file.write_all(text.as_bytes()))
}

/// Where a path leads, links followed, whether or not there is a file.
pub fn resolve(path: &Path) -> PathBuf {
    let mut target = path.to_owned();
    for _ in 0..LINKS_MAX {
        match std::fs::read_link(&target) {
            Ok(next) => target = folder_of(&target).join(next),
            Err(_) => break,
        }
    }
    target
}

/// Whether two paths lead to one file, there or still to be made.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    let place = |path: &Path| {
        let target = resolve(path);
        let folder = std::fs::canonicalize(folder_of(&target)).ok()?;
        Some(folder.join(target.file_name()?))
    };
    same_file::is_same_file(a, b)
        .unwrap_or_else(|_| place(a).is_some_and(|place_a| place(b) == Some(place_a)))
}

fn folder_of(path: &Path) -> &Path {
    path.parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fails_leaves_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        write_text(&path, "old").unwrap();
        let failed = write_file(&path, |file| {
            file.write_all(b"new")?;
            Err(Error::other("no"))
        });
        assert_eq!(failed.unwrap_err().to_string(), "no");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_known() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        symlink("file", at("link")).unwrap();
        symlink("link", at("link of a link")).unwrap();
        symlink("circle", at("circle")).unwrap();
        assert!(is_same_file(&at("link of a link"), &at("file")));
        assert!(!is_same_file(&at("link of a link"), &at("other")));
        assert!(!is_same_file(&at("none/file"), &at("none/other")));
        write_text(&at("link of a link"), "text").unwrap();
        assert!(at("link of a link").is_symlink() && !at("file").is_symlink());
        std::fs::hard_link(at("file"), at("hard")).unwrap();
        assert!(is_same_file(&at("hard"), &at("link")));
        std::fs::set_permissions(at("file"), PermissionsExt::from_mode(0o600)).unwrap();
        write_text(&at("link"), "more").unwrap();
        let mode = std::fs::metadata(at("file")).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        assert!(write_text(&at("circle"), "text").is_err());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_an_error() {
        let full = write_text(Path::new("/dev/full"), "text");
        assert_eq!(full.unwrap_err().kind(), ErrorKind::StorageFull);
    }
}
