//! Which files a command reads and writes: none is written twice, and none that is read.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use crate::output::is_same_file;
use crate::scene::Scene;

use super::CliError;
use super::sequence::Numbered;
use super::write::check_output;

/// What the results of measurements are, by extension.
const RESULTS: &[&str] = &["csv", "html", "jsonl", "md", "png", "svg"];

/// The files of one command.
#[derive(Default)]
pub(super) struct Files {
    read: Vec<PathBuf>,
    written: Vec<PathBuf>,
}

impl Files {
    /// A file that the command reads; an error if it writes it too.
    pub(super) fn read(&mut self, path: &Path) -> Result<(), CliError> {
        if let Some(output) = self.written.iter().find(|known| is_same_file(known, path)) {
            return Err(clash(output, "is read by this command"));
        }
        self.read.push(path.to_owned());
        Ok(())
    }

    /// A scene as it stands on the command line.
    pub(super) fn read_source(&mut self, source: &OsStr) -> Result<(), CliError> {
        match source.to_str() {
            Some(bundled) if bundled.starts_with("bundled:") => Ok(()),
            _ => self.read(Path::new(source)),
        }
    }

    /// All files of a scene that was loaded.
    pub(super) fn read_scene(&mut self, scene: &Scene) -> Result<(), CliError> {
        scene.files.iter().try_for_each(|file| self.read(file))
    }

    /// A file that the command writes, with one of these extensions. It can be written, and is
    /// neither read nor written otherwise.
    pub(super) fn write(&mut self, path: &Path, extensions: &[&str]) -> Result<(), CliError> {
        let is_special = std::fs::metadata(path).is_ok_and(|found| !found.is_file());
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        if !is_special && !extensions.contains(&extension.to_lowercase().as_str()) {
            return Err(CliError::input(format!(
                "{}: the name must end in .{}",
                path.display(),
                extensions.join(" or .")
            )));
        }
        if self.read.iter().any(|known| is_same_file(known, path)) {
            return Err(clash(path, "is read by this command"));
        }
        if self.written.iter().any(|known| is_same_file(known, path)) {
            return Err(clash(path, "is written twice"));
        }
        check_output(path)?;
        self.written.push(path.to_owned());
        Ok(())
    }

    /// The files of a sequence's frames. The first stands for those that are not there yet.
    pub(super) fn write_frames(
        &mut self,
        name: &Numbered,
        frames: u32,
        extensions: &[&str],
    ) -> Result<(), CliError> {
        self.write(&name.path(0), extensions)?;
        let others = (1..frames).map(|frame| name.path(frame));
        for path in others.filter(|path| std::fs::symlink_metadata(path).is_ok()) {
            if self.read.iter().any(|known| is_same_file(known, &path)) {
                return Err(clash(&path, "is read by this command"));
            }
            check_output(&path)?;
            self.written.push(path);
        }
        Ok(())
    }
}

fn clash(path: &Path, why: &str) -> CliError {
    CliError::input(format!("{} {why}; name another file", path.display()))
}

/// An error if results in a folder could replace files of the scenes that are measured.
pub(super) fn check_results_folder(folder: &Path, scenes: &[Scene]) -> Result<(), CliError> {
    let is_result = |file: &&PathBuf| {
        let extension = file.extension().unwrap_or_default().to_string_lossy();
        RESULTS.contains(&extension.to_lowercase().as_str())
            && [folder, &folder.join("pictures")]
                .into_iter()
                .any(|folder| {
                    file.file_name()
                        .is_some_and(|name| is_same_file(&folder.join(name), file))
                })
    };
    match scenes.iter().flat_map(|scene| &scene.files).find(is_result) {
        Some(file) => Err(CliError::input(format!(
            "results in {} could replace {}, a file of the scene; name another folder with -o",
            folder.display(),
            file.display()
        ))),
        None => Ok(()),
    }
}
