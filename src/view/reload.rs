//! Shaders that are compiled again when their files change, while the window is open.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

/// The compiler; what is checked in was made by it.
const COMPILER: &str = "glslangValidator";

/// How often the files are looked at.
const PERIOD: Duration = Duration::from_millis(300);

/// A module that was compiled, or the compiler's words.
pub(super) enum Compiled {
    /// Stem and SPIR-V.
    Module(String, Vec<u32>),
    /// What is wrong, and where.
    Failed(String),
}

/// The thread that watches a folder of GLSL.
pub(super) struct Watcher {
    found: Receiver<Compiled>,
    quit: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Watcher {
    /// Watches `folder`, which is laid out as `glsl/`; `notify` is called after each module, on the
    /// thread.
    pub(super) fn start(folder: PathBuf, notify: Box<dyn Fn() + Send>) -> std::io::Result<Self> {
        let (send, found) = channel();
        let (quit, quits) = channel();
        // Taken here, so that a change right after the start is not missed.
        let mut known = times(&folder);
        let work = move || {
            while quits.recv_timeout(PERIOD) == Err(RecvTimeoutError::Timeout) {
                let now = times(&folder);
                let changed: BTreeSet<PathBuf> = now
                    .iter()
                    .filter(|(path, time)| known.get(*path) != Some(time))
                    .map(|(path, _)| path.clone())
                    .collect();
                known = now;
                for compiled in compile_changed(&folder, &changed) {
                    if send.send(compiled).is_err() {
                        return;
                    }
                    notify();
                }
            }
        };
        let thread = std::thread::Builder::new()
            .name("shaders".to_owned())
            .spawn(work)?;
        Ok(Watcher {
            found,
            quit: Some(quit),
            thread: Some(thread),
        })
    }

    /// What was compiled since the last call.
    pub(super) fn take(&self) -> Vec<Compiled> {
        self.found.try_iter().collect()
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        drop(self.quit.take());
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            log::error!("the shader thread panicked");
        }
    }
}

/// All files below a folder, and when they were last written.
fn times(folder: &Path) -> BTreeMap<PathBuf, SystemTime> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        match entry.metadata() {
            Ok(data) if data.is_dir() => found.extend(times(&entry.path())),
            Ok(data) => drop(data.modified().map(|time| found.insert(entry.path(), time))),
            Err(_) => {}
        }
    }
    found
}

fn compile_changed(folder: &Path, changed: &BTreeSet<PathBuf>) -> Vec<Compiled> {
    if changed.is_empty() {
        return Vec::new();
    }
    let is_touched = |source: &Path| {
        let mut files = BTreeSet::from([source.to_owned()]);
        collect_includes(folder, source, &mut files);
        !files.is_disjoint(changed)
    };
    let touched = modules(folder)
        .into_iter()
        .filter(|(_, (source, _))| is_touched(source));
    touched
        .map(|(stem, (source, defines))| compile(folder, stem, &source, &defines))
        .collect()
}

/// Source and defines of every module, by stem: the entry points, and the variants of
/// `variants.txt`.
fn modules(folder: &Path) -> BTreeMap<String, (PathBuf, Vec<String>)> {
    let mut modules = BTreeMap::new();
    for stem in crate::shader::stems() {
        let source = folder.join(stem);
        if source.is_file() {
            modules.insert(stem.to_owned(), (source, Vec::new()));
        }
    }
    let variants = std::fs::read_to_string(folder.join("variants.txt")).unwrap_or_default();
    for line in variants.lines() {
        let words: Vec<&str> = line
            .split('#')
            .next()
            .unwrap_or("")
            .split_whitespace()
            .collect();
        if let [source, defines, stem] = words[..] {
            modules.insert(
                stem.to_owned(),
                (
                    folder.join(source),
                    defines
                        .split(',')
                        .map(|define| format!("-D{define}"))
                        .collect(),
                ),
            );
        }
    }
    modules
}

/// Everything that a file includes, transitively: relative to the file first, then to the folder.
fn collect_includes(folder: &Path, file: &Path, found: &mut BTreeSet<PathBuf>) {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    for line in text.lines() {
        let Some(rest) = line
            .trim_start()
            .strip_prefix('#')
            .and_then(|rest| rest.trim_start().strip_prefix("include"))
        else {
            continue;
        };
        let Some(name) = rest.split('"').nth(1) else {
            continue;
        };
        let candidates = [
            file.parent().unwrap_or(folder).join(name),
            folder.join(name),
        ];
        let Some(path) = candidates.into_iter().find(|candidate| candidate.is_file()) else {
            continue;
        };
        if found.insert(path.clone()) {
            collect_includes(folder, &path, found);
        }
    }
}

fn compile(folder: &Path, stem: String, source: &Path, defines: &[String]) -> Compiled {
    let output = std::env::temp_dir().join(format!(
        "lumivox-{}-{}.spv",
        std::process::id(),
        stem.replace('/', "-")
    ));
    let stage = stem.rsplit('.').next().unwrap_or("comp");
    let mut command = Command::new(COMPILER);
    command
        .args(["-V", "--target-env", "vulkan1.2", "-S", stage])
        .arg(format!("-I{}", folder.display()))
        .args(defines)
        .arg("-o")
        .arg(&output)
        .arg(source);
    let done = match command.output() {
        Ok(done) => done,
        Err(error) => {
            return Compiled::Failed(format!(
                "{stem}: {COMPILER} cannot be run ({error}); install glslang to reload shaders"
            ));
        }
    };
    let bytes = std::fs::read(&output).unwrap_or_default();
    let _ = std::fs::remove_file(&output);
    if !done.status.success() {
        let text = String::from_utf8_lossy(&done.stdout);
        let error = text
            .lines()
            .find(|line| line.starts_with("ERROR"))
            .unwrap_or("the compiler failed without a word");
        return Compiled::Failed(format!("{stem}: {error}"));
    }
    Compiled::Module(
        stem,
        bytes
            .as_chunks()
            .0
            .iter()
            .map(|word| u32::from_le_bytes(*word))
            .collect(),
    )
}
