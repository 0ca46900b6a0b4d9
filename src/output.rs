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

/// Writes a file of bytes.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    write_file(path, |file| file.write_all(bytes))
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
