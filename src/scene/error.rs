//! Why a scene could not be loaded, made or written.

use crate::text::counted;
use std::path::{Path, PathBuf};

/// What is wrong with a scene, where, and what to do about it; always one line of text.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A file cannot be read at all.
    #[error("{}", one_line(format_args!("{}: cannot be read ({source}); {hint}", path.display())))]
    Read {
        /// The file that was read.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
        /// What to do about it.
        hint: &'static str,
    },
    /// One line of a text file is wrong.
    #[error("{}", one_line(format_args!("{}:{line}: {problem}; {hint}", path.display())))]
    Line {
        /// The text file that was read.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong, with the field's or key's name.
        problem: String,
        /// What to do about it.
        hint: String,
    },
    /// A file as a whole is wrong.
    #[error("{}", one_line(format_args!("{}: {problem}; {hint}", path.display())))]
    File {
        /// The file that was read.
        path: PathBuf,
        /// What is wrong with the file.
        problem: String,
        /// What to do about it.
        hint: String,
    },
    /// Textures that materials refer to do not exist; all of them.
    #[error(
        "{}: {}; add the files, or pass --allow-missing-textures to render them \
            mid-grey",
        counted(missing.len(), "missing texture"), one_line(missing.join(", "))
    )]
    MissingTextures {
        /// One entry a texture: its path, and the material, file and line that want it.
        missing: Vec<String>,
    },
    /// No bundled scene has this name.
    #[error("no bundled scene is called `{}`; there are {}", one_line(name), known.join(", "))]
    UnknownBundled {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: Vec<&'static str>,
    },
    /// A parameter of a bundled scene is unknown, malformed or out of range.
    #[error(
        "{}",
        one_line(format_args!("bundled scene `{scene}`: parameter `{parameter}` {problem}; {hint}"))
    )]
    Parameter {
        /// Name of the bundled scene.
        scene: String,
        /// Name of the parameter.
        parameter: String,
        /// What is wrong with the parameter.
        problem: String,
        /// What to do about it.
        hint: String,
    },
    /// A file cannot be written.
    #[error(
        "{}: cannot be written ({problem}); check that the folder exists, is writable and has \
         space",
        one_line(path.display())
    )]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system or the encoder said.
        problem: String,
    },
}

/// A text on one line: names of files and values of fields may hold line breaks, and characters
/// that a terminal obeys.
fn one_line(text: impl std::fmt::Display) -> String {
    let mut line = String::new();
    for c in text.to_string().chars() {
        if c.is_control() {
            line.extend(c.escape_default());
        } else {
            line.push(c);
        }
    }
    line
}

impl SceneError {
    /// An error on one line of a text file.
    pub(super) fn line(
        path: &Path,
        line: usize,
        problem: impl Into<String>,
        hint: impl Into<String>,
    ) -> Self {
        SceneError::Line {
            path: path.to_owned(),
            line,
            problem: problem.into(),
            hint: hint.into(),
        }
    }

    /// An error in a file as a whole.
    pub(crate) fn file(path: &Path, problem: impl Into<String>, hint: impl Into<String>) -> Self {
        SceneError::File {
            path: path.to_owned(),
            problem: problem.into(),
            hint: hint.into(),
        }
    }

    /// A file that cannot be read, with the hint that suits the reason.
    pub(super) fn read(path: &Path, source: std::io::Error) -> Self {
        let hint = match source.kind() {
            _ if path.is_dir() => {
                "this is a folder: give the .toml, .obj, .gltf or .glb file in it"
            }
            std::io::ErrorKind::NotFound => "check the path",
            std::io::ErrorKind::PermissionDenied => "check the file's permissions",
            _ => "check that the file is intact",
        };
        SceneError::Read {
            path: path.to_owned(),
            source,
            hint,
        }
    }

    /// A file that cannot be written.
    pub(super) fn write(path: &Path, problem: impl std::fmt::Display) -> Self {
        SceneError::Write {
            path: path.to_owned(),
            problem: problem.to_string(),
        }
    }
}
