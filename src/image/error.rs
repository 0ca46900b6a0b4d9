//! What can go wrong with an image file.

use std::path::{Path, PathBuf};

/// An image file could not be read or written; the message names the file.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file could not be read as OpenEXR.
    #[error("cannot read the image {}; give an OpenEXR file", path.display())]
    Read {
        /// The file that was read.
        path: PathBuf,
        /// What the decoder or the system said.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The file could not be written.
    #[error(
        "cannot write the image {}; check that the folder exists, is writable and has space",
        path.display()
    )]
    Write {
        /// The file that was to be written.
        path: PathBuf,
        /// What the encoder or the system said.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The file holds an image, but not the channels asked for.
    #[error("{} has no channels R, G, B nor Y; it has {found}", path.display())]
    NoColor {
        /// The file that was read.
        path: PathBuf,
        /// The channels that it has.
        found: String,
    },
    /// The file has layers, but not the one asked for.
    #[error("{} has no layer {layer}; it has the channels {found}", path.display())]
    NoLayer {
        /// The file that was read.
        path: PathBuf,
        /// Name of the layer that was asked for.
        layer: &'static str,
        /// The channels that it has.
        found: String,
    },
}

impl ImageError {
    /// A failure to read `path`.
    pub(super) fn read(
        path: &Path,
        source: impl Into<Box<dyn std::error::Error + Send + Sync>>,
    ) -> Self {
        ImageError::Read {
            path: path.to_owned(),
            source: source.into(),
        }
    }

    /// A failure of the EXR decoder, without its wrapping of the system's own message.
    pub(super) fn read_exr(path: &Path, error: exr::error::Error) -> Self {
        match error {
            exr::error::Error::Io(source) => Self::read(path, source),
            other => Self::read(path, other),
        }
    }

    /// A failure of the EXR encoder, likewise.
    pub(super) fn write_exr(path: &Path, error: exr::error::Error) -> Self {
        match error {
            exr::error::Error::Io(source) => Self::write(path, source),
            other => Self::write(path, other),
        }
    }

    /// A failure to write `path`.
    pub(super) fn write(
        path: &Path,
        source: impl Into<Box<dyn std::error::Error + Send + Sync>>,
    ) -> Self {
        ImageError::Write {
            path: path.to_owned(),
            source: source.into(),
        }
    }
}
