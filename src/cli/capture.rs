//! Captures of frames, which RenderDoc opens.

use std::path::{Path, PathBuf};
use std::ptr::null;

use renderdoc::{DevicePointer, RenderDoc, V141};
use tempfile::TempDir;

use super::CliError;

/// RenderDoc, and the file that its next capture goes to.
pub(super) struct Capture {
    api: RenderDoc<V141>,
    /// Where it writes, under a name of its own.
    folder: TempDir,
    path: PathBuf,
}

impl Capture {
    /// Of a device whose instance has RenderDoc's layer, which has loaded its library.
    pub(super) fn new(path: &Path) -> Result<Self, CliError> {
        let mut api = RenderDoc::<V141>::new().map_err(CliError::failed)?;
        // Beside the file, so that it can take its name.
        let beside = path
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty());
        let folder = TempDir::new_in(beside.unwrap_or(Path::new("."))).map_err(CliError::failed)?;
        api.set_capture_file_path_template(folder.path().join("frame"));
        Ok(Capture {
            api,
            folder,
            path: path.to_owned(),
        })
    }

    /// What `draw` submits is in the capture.
    pub(super) fn take<T>(
        mut self,
        draw: impl FnOnce() -> Result<T, CliError>,
    ) -> Result<T, CliError> {
        let all = || DevicePointer::from(null());
        self.api.start_frame_capture(all(), null());
        let drawn = draw();
        self.api.end_frame_capture(all(), null());
        let drawn = drawn?;
        let written = std::fs::read_dir(self.folder.path()).map_err(CliError::failed)?;
        let captured = written.flatten().map(|file| file.path()).next();
        let captured =
            captured.ok_or_else(|| CliError::failed("RenderDoc has written no capture"))?;
        std::fs::rename(captured, &self.path).map_err(CliError::failed)?;
        Ok(drawn)
    }
}
