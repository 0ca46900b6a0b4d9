//! Voxels as files that other programs read.
//!
//! | extension | holds |
//! | --- | --- |
//! | `.vox` | MagicaVoxel models of up to 256³ voxels, side by side; 255 colours; z up |
//! | `.ply` | a point at each voxel's centre (m): mean normal, sRGB colour, opacity; binary |
//! | `.json` | the grid (m), and each voxel's coordinates, linear albedo, mean normal and opacity |

mod json;
mod ply;
mod vox;

use std::path::{Path, PathBuf};

use super::VoxelList;
use crate::output::write_file;

/// A file format that voxels can be written in; the file's extension chooses it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportFormat {
    /// MagicaVoxel, `.vox`: 8-bit colours from a palette of 255.
    Vox,
    /// Stanford polygon file, `.ply`: a point a voxel.
    Ply,
    /// JSON, `.json`: the grid and the attributes of each voxel.
    Json,
}

/// Why voxels cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// No format has this extension.
    #[error("{}: the name must end in .vox, .ply or .json", path.display())]
    Extension {
        /// The file as the user named it.
        path: PathBuf,
    },
    /// There is nothing to write.
    #[error(
        "{}: no voxel is occupied; check that the scene's masks leave something",
        path.display()
    )]
    Empty {
        /// The file that was to be written.
        path: PathBuf,
    },
    /// The format has no room for them.
    #[error(
        "{}: {count} voxels are more than the {limit} that fit into a .vox file; lower \
         --resolution, or write .ply",
        path.display()
    )]
    TooMany {
        /// The file that was to be written.
        path: PathBuf,
        /// Occupied voxels.
        count: usize,
        /// Voxels that fit into the file.
        limit: usize,
    },
    /// The file cannot be written.
    #[error(
        "cannot write the voxels to {}: {source}; check that the folder exists, is writable and \
         has space",
        path.display()
    )]
    Write {
        /// The file that was to be written.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

impl ExportFormat {
    /// The format of a file, by its extension.
    pub fn of(path: &Path) -> Result<Self, ExportError> {
        match path
            .extension()
            .and_then(|extension| extension.to_str())
            .map(str::to_ascii_lowercase)
            .as_deref()
        {
            Some("vox") => Ok(ExportFormat::Vox),
            Some("ply") => Ok(ExportFormat::Ply),
            Some("json") => Ok(ExportFormat::Json),
            _ => Err(ExportError::Extension {
                path: path.to_owned(),
            }),
        }
    }
}

impl VoxelList {
    /// Writes the voxels in the format of the file's extension; `scene` and `technique` say where
    /// they are from, in formats that have room for it.
    pub fn write(&self, path: &Path, scene: &str, technique: &str) -> Result<(), ExportError> {
        let format = ExportFormat::of(path)?;
        if self.voxels.is_empty() {
            return Err(ExportError::Empty {
                path: path.to_owned(),
            });
        }
        if format == ExportFormat::Vox && self.voxels.len() > vox::COUNT_MAX {
            return Err(ExportError::TooMany {
                path: path.to_owned(),
                count: self.voxels.len(),
                limit: vox::COUNT_MAX,
            });
        }
        write_file(path, |mut file| match format {
            ExportFormat::Vox => vox::write(self, &mut file),
            ExportFormat::Ply => ply::write(self, scene, technique, &mut file),
            ExportFormat::Json => json::write(self, scene, technique, &mut file),
        })
        .map_err(|source| ExportError::Write {
            path: path.to_owned(),
            source,
        })
    }
}
