//! Pictures of points on disk.

use std::fs::File;
use std::path::{Path, PathBuf};

use crate::image::{Image, write_heatmap, write_png};
use crate::measure::records::RecordError;
use crate::output::write_file;

/// The folder of pictures beside the records: `KEY.png`, what a point looks like, and
/// `KEY-error.png`, where it is wrong.
#[derive(Clone, Debug)]
pub struct PictureFolder(PathBuf);

impl PictureFolder {
    /// The folder `pictures` of a folder of records; it is made with the first picture.
    pub fn of(records: &Path) -> Self {
        PictureFolder(records.join("pictures"))
    }

    /// The picture of a key.
    pub fn picture(&self, key: &str) -> PathBuf {
        self.0.join(format!("{key}.png"))
    }

    /// The heat map of a key.
    pub fn error(&self, key: &str) -> PathBuf {
        self.0.join(format!("{key}-error.png"))
    }

    /// Writes the radiance of a key at an exposure.
    pub fn write_picture(
        &self,
        key: &str,
        radiance: &Image,
        exposure: f32,
    ) -> Result<(), RecordError> {
        self.make()?;
        Ok(write_png(&self.picture(key), radiance, exposure)?)
    }

    /// Writes the absolute error of a key; `scale` is shown brightest.
    pub fn write_error(&self, key: &str, error: &Image, scale: f32) -> Result<(), RecordError> {
        self.make()?;
        Ok(write_heatmap(&self.error(key), error, scale)?)
    }

    /// Copies from another folder what it has of a key and this one lacks.
    pub fn copy(&self, other: &PictureFolder, key: &str) -> Result<(), RecordError> {
        for (from, to) in [
            (other.picture(key), self.picture(key)),
            (other.error(key), self.error(key)),
        ] {
            if from.is_file() && !to.exists() {
                self.make()?;
                let copied = File::open(&from).and_then(|mut from| {
                    write_file(&to, |file| std::io::copy(&mut from, file).map(drop))
                });
                copied.map_err(|source| RecordError::File {
                    what: "write",
                    path: to,
                    source,
                })?;
            }
        }
        Ok(())
    }

    fn make(&self) -> Result<(), RecordError> {
        std::fs::create_dir_all(&self.0).map_err(|source| RecordError::File {
            what: "make the folder",
            path: self.0.clone(),
            source,
        })
    }
}
