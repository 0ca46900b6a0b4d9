//! What is remembered from one window to the next: its size, recent scenes.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::output::write_text;

/// How many scenes are remembered.
const RECENT: usize = 10;

/// The remembered state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Remembered {
    /// Width and height of the window (points).
    pub(super) size: [f64; 2],
    /// Whether the window fills the screen.
    pub(super) fullscreen: bool,
    /// Whether pictures wait for the display.
    pub(super) vsync: bool,
    /// Whether the panels are shown.
    pub(super) panels: bool,
    /// Scenes as they were named, the last one first.
    pub(super) recent: Vec<String>,
}

impl Default for Remembered {
    fn default() -> Self {
        Remembered {
            size: [1280.0, 720.0],
            fullscreen: false,
            vsync: true,
            panels: true,
            recent: Vec::new(),
        }
    }
}

impl Remembered {
    /// Where it is kept: `view.toml` in the folder for settings that the system names; `None` where
    /// it names none.
    pub(super) fn path() -> Option<PathBuf> {
        let named = |name: &str| {
            std::env::var_os(name)
                .filter(|value| !value.is_empty())
                .map(PathBuf::from)
        };
        let folder = named("XDG_CONFIG_HOME")
            .or_else(|| named("APPDATA"))
            .or_else(|| Some(named("HOME")?.join(".config")))?;
        Some(folder.join("lumivox").join("view.toml"))
    }

    /// Reads it; what cannot be read is as if there were nothing, with a warning.
    pub(super) fn read(path: &Path) -> Self {
        let Ok(text) = std::fs::read_to_string(path) else {
            return Self::default();
        };
        let mut found: Self = toml::from_str(&text).unwrap_or_else(|error| {
            log::warn!(
                "{}: {}; the window opens as for the first time",
                path.display(),
                error.message()
            );
            Self::default()
        });
        let is_possible = |size: &f64| (1.0..=16384.0).contains(size);
        if !found.size.iter().all(is_possible) {
            found.size = Self::default().size;
        }
        found.recent.truncate(RECENT);
        found
    }

    /// Writes it; a failure is only a warning.
    pub(super) fn write(&self, path: &Path) {
        let folder = path.parent().unwrap_or(Path::new("."));
        let text = toml::to_string(self).unwrap_or_default();
        if let Err(error) = std::fs::create_dir_all(folder).and_then(|()| write_text(path, &text)) {
            log::warn!("{}: {error}; the window is not remembered", path.display());
        }
    }

    /// Puts a scene first.
    pub(super) fn add_recent(&mut self, source: &str) {
        self.recent.retain(|known| known != source);
        self.recent.insert(0, source.to_owned());
        self.recent.truncate(RECENT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_nonsense_is_not() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("below").join("view.toml");
        let mut state = Remembered {
            size: [640.0, 400.0],
            vsync: false,
            ..Remembered::default()
        };
        for index in 0..12 {
            state.add_recent(&format!("scene {index}"));
        }
        state.add_recent("scene 5");
        assert_eq!(
            (
                state.recent.len(),
                state.recent[0].as_str(),
                state.recent[1].as_str()
            ),
            (10, "scene 5", "scene 11")
        );
        state.write(&path);
        assert_eq!(Remembered::read(&path), state);
        std::fs::write(&path, "size = [0.0, nan]")?;
        assert_eq!(Remembered::read(&path), Remembered::default());
        std::fs::write(&path, "size = 3")?;
        assert_eq!(Remembered::read(&path), Remembered::default());
        Ok(())
    }
}
