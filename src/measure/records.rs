//! Records on disk, a line of JSON each. A record is written as soon as it is measured, so that a
//! run that was stopped goes on where it was.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufRead as _, BufReader, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::image::ImageError;

/// Records that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file or folder cannot be used.
    #[error(
        "cannot {what} {}: {source}; check that it exists, is readable and writable, and has space",
        path.display()
    )]
    File {
        /// What was being done.
        what: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Another process has it open.
    #[error(
        "another lumivox writes {}; let it end, or name another folder with -o",
        path.display()
    )]
    InUse {
        /// The file of records that is in use.
        path: PathBuf,
    },
    /// A line is no record.
    #[error(
        "{}:{line}: this is no record of {command}: {problem}; remove the line, or name another \
         folder with -o",
        path.display()
    )]
    Line {
        /// The file of records.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// Whose record it ought to be.
        command: &'static str,
        /// What the parser found.
        problem: String,
    },
    /// A picture cannot be written.
    #[error(transparent)]
    Picture(#[from] ImageError),
}

/// What is written as a line each.
pub trait Versioned: Clone + Serialize + DeserializeOwned {
    /// The command that writes it.
    const COMMAND: &'static str;
    /// Version of its format.
    const VERSION: u32;
    /// The version that it was written with.
    fn version(&self) -> u32;
}

/// What is kept, and not measured again.
pub trait Keyed: Versioned {
    /// A hash of all that its figures depend on.
    fn key(&self) -> &str;

    /// Which of several measurements of one key it is; 0 where there is one alone.
    fn round(&self) -> u32 {
        0
    }

    /// Whether it is the same measurement as another.
    fn is_same(&self, other: &Self) -> bool {
        (self.key(), self.round()) == (other.key(), other.round())
    }
}

/// An open file of records, which no other process can open meanwhile.
#[derive(Debug)]
pub struct Records<R> {
    path: PathBuf,
    file: File,
    points: Vec<R>,
}

impl<R: Versioned> Records<R> {
    /// Opens or makes a file. A last line that was not written to its end is cut off, with a
    /// warning.
    pub fn open(path: &Path) -> Result<Self, RecordError> {
        let failed = |what| {
            move |source| RecordError::File {
                what,
                path: path.to_owned(),
                source,
            }
        };
        let mut file = OpenOptions::new()
            .read(true)
            .append(true)
            .create(true)
            .open(path)
            .map_err(failed("open"))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(RecordError::InUse {
                    path: path.to_owned(),
                });
            }
            // Some network file systems have no locks; records are whole lines even so.
            Err(TryLockError::Error(problem)) => log::warn!(
                "{} cannot be locked ({problem}); let no other lumivox write it",
                path.display()
            ),
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed("read"))?;
        let (points, whole) = parse(path, &bytes)?;
        if whole < bytes.len() {
            log::warn!(
                "{}: the last record was cut off and is measured again",
                path.display()
            );
            file.set_len(whole as u64)
                .and_then(|()| file.seek(SeekFrom::End(0)))
                .map_err(failed("write"))?;
        }
        Ok(Records {
            path: path.to_owned(),
            file,
            points,
        })
    }

    /// Appends a record that is not there yet.
    pub fn add(&mut self, point: &R) -> Result<(), RecordError> {
        let failed = |source| RecordError::File {
            what: "write",
            path: self.path.clone(),
            source,
        };
        let line = line_of(point).map_err(|error| failed(error.into()))?;
        self.file.write_all(line.as_bytes()).map_err(failed)?;
        self.points.push(point.clone());
        Ok(())
    }
}

impl<R: Keyed> Records<R> {
    /// The newest record of a key.
    pub fn find(&self, key: &str) -> Option<&R> {
        self.points.iter().rfind(|point| point.key() == key)
    }

    /// The records of a key, the newest of each round.
    pub fn rounds<'r>(&'r self, key: &str) -> Vec<&'r R> {
        let of_key: Vec<&R> = self
            .points
            .iter()
            .filter(|point| point.key() == key)
            .collect();
        let replaced = |index: usize| {
            let later = &of_key[index + 1..];
            later.iter().any(|point| point.is_same(of_key[index]))
        };
        (0..of_key.len())
            .filter(|index| !replaced(*index))
            .map(|index| of_key[index])
            .collect()
    }
}

/// The records without those that a later one of the same key and round replaces.
pub fn newest<R: Keyed>(records: Vec<R>) -> Vec<R> {
    let mut kept: Vec<R> = Vec::new();
    for record in records {
        match kept.iter_mut().find(|known| known.is_same(&record)) {
            Some(known) => *known = record,
            None => kept.push(record),
        }
    }
    kept
}

/// A record as the line of a file: its command, then its fields.
pub fn line_of<R: Versioned>(record: &R) -> serde_json::Result<String> {
    #[derive(Serialize)]
    struct Line<'r, R> {
        command: &'static str,
        #[serde(flatten)]
        record: &'r R,
    }
    let command = R::COMMAND;
    Ok(serde_json::to_string(&Line { command, record })? + "\n")
}

/// The command that wrote a line; the first versions did not say.
fn command_of(line: &[u8]) -> Option<String> {
    #[derive(Deserialize)]
    struct Written {
        command: Option<String>,
    }
    serde_json::from_slice::<Written>(line).ok()?.command
}

/// Whether the first record of a file says that another command wrote it.
fn is_of_another<R: Versioned>(path: &Path) -> bool {
    let mut line = Vec::new();
    let read = File::open(path).and_then(|file| BufReader::new(file).read_until(b'\n', &mut line));
    read.is_ok() && command_of(&line).is_some_and(|command| command != R::COMMAND)
}

/// The files of a command's records (`*.jsonl`) in a folder, by name; those of other commands may
/// lie beside them.
pub fn record_files<R: Versioned>(folder: &Path) -> Result<Vec<PathBuf>, RecordError> {
    let failed = |source| RecordError::File {
        what: "read the folder",
        path: folder.to_owned(),
        source,
    };
    let entries = std::fs::read_dir(folder).map_err(failed)?;
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<_, _>>()
        .map_err(failed)?;
    files.retain(|path| {
        path.is_file()
            && path
                .extension()
                .is_some_and(|extension| extension == "jsonl")
            && !is_of_another::<R>(path)
    });
    files.sort();
    Ok(files)
}

/// All records of a file that is not to be changed; a last line that was not written to its end is
/// left out, with a warning.
pub fn read_records<R: Versioned>(path: &Path) -> Result<Vec<R>, RecordError> {
    let bytes = std::fs::read(path).map_err(|source| RecordError::File {
        what: "read",
        path: path.to_owned(),
        source,
    })?;
    let (points, whole) = parse(path, &bytes)?;
    if whole < bytes.len() {
        log::warn!(
            "{}: the last record was cut off and is left out",
            path.display()
        );
    }
    Ok(points)
}

/// The records, and the number of bytes that they take; what is beyond is a line without an end.
fn parse<R: Versioned>(path: &Path, bytes: &[u8]) -> Result<(Vec<R>, usize), RecordError> {
    let whole = bytes
        .iter()
        .rposition(|byte| *byte == b'\n')
        .map_or(0, |end| end + 1);
    let wrong = |index: usize, problem: String| RecordError::Line {
        path: path.to_owned(),
        line: index + 1,
        command: R::COMMAND,
        problem,
    };
    let point = |(index, line): (usize, &[u8])| {
        if let Some(command) = command_of(line).filter(|command| command != R::COMMAND) {
            return Err(wrong(index, format!("it is a record of {command}")));
        }
        let point: R =
            serde_json::from_slice(line).map_err(|error| wrong(index, error.to_string()))?;
        let (version, wanted) = (point.version(), R::VERSION);
        if version == wanted {
            Ok(point)
        } else {
            Err(wrong(
                index,
                format!("it is of version {version}, not {wanted}"),
            ))
        }
    };
    let lines = bytes[..whole]
        .split(|byte| *byte == b'\n')
        .enumerate()
        .filter(|(_, line)| !line.is_empty());
    Ok((lines.map(point).collect::<Result<_, _>>()?, whole))
}
