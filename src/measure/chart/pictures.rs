//! Pictures of points on disk.

use std::fs::File;
use std::path::{Path, PathBuf};

use super::bounces::LeftOut;
use super::point::SweepSetup;
use crate::image::{Image, write_heatmap, write_png};
use crate::measure::records::RecordError;
use crate::output::{write_file, write_text};
use crate::reference::Bounces;

/// The folder of pictures beside the records: `KEY.png`, what a point looks like, and
/// `KEY-error.png`, where it is wrong. `KEY-left-out.json` of a reference says what light it lacks.
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

    /// What the reference at this number of bounces leaves out, if it was measured.
    pub fn left_out(&self, setup: &SweepSetup, bounces: Bounces) -> Option<LeftOut> {
        let text = std::fs::read_to_string(self.left_out_file(&setup.reference_key(bounces)));
        serde_json::from_str(&text.ok()?).ok()
    }

    /// Writes what a reference leaves out.
    pub fn write_left_out(
        &self,
        setup: &SweepSetup,
        left_out: &LeftOut,
    ) -> Result<(), RecordError> {
        self.make()?;
        let path = self.left_out_file(&setup.reference_key(left_out.bounces));
        let text = serde_json::json!(left_out).to_string() + "\n";
        write_text(&path, &text).map_err(|source| RecordError::File {
            what: "write",
            path,
            source,
        })
    }

    fn left_out_file(&self, key: &str) -> PathBuf {
        self.0.join(format!("{key}-left-out.json"))
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
            (other.left_out_file(key), self.left_out_file(key)),
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
