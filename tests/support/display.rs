//! A display without a screen (Xvfb), and the program's window on it.

use std::ffi::OsString;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use lumivox::view::parse_script;

use super::program::{Ran, lumivox_within};
use super::{Missing, skipped};

/// Scripts give up by themselves where something does not come.
const TIMEOUT: Duration = Duration::from_secs(600);

/// A display of its own, with a window manager where one is installed; ended on drop.
pub struct Display {
    name: String,
    server: Child,
    /// The window manager.
    pub manager: Option<Child>,
}

impl Display {
    /// `None`, and a word about it, where there is no Xvfb.
    pub fn start() -> Option<Display> {
        let mut command = Command::new("Xvfb");
        command
            .args([
                "-displayfd",
                "1",
                "-screen",
                "0",
                "1280x800x24",
                "-nolisten",
                "tcp",
            ])
            .stdout(Stdio::piped())
            .stderr(Stdio::null());
        let Ok(mut server) = command.spawn() else {
            skipped(&Missing::Package("Xvfb"));
            return None;
        };
        let mut line = String::new();
        BufReader::new(server.stdout.take().unwrap())
            .read_line(&mut line)
            .unwrap();
        let name = format!(":{}", line.trim());
        let mut manager = Command::new("openbox");
        manager
            .args(["--sm-disable"])
            .env("DISPLAY", &name)
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        let manager = manager
            .spawn()
            .inspect_err(|_| {
                skipped(&Missing::Package(
                    "openbox, without which windows are not minimised,",
                ))
            })
            .ok();
        // It takes over windows that are there already; only minimising needs it to be.
        std::thread::sleep(Duration::from_millis(300));
        Some(Display {
            name,
            server,
            manager,
        })
    }

    /// Runs a script in a window.
    pub fn view(&self, folder: &Path, arguments: &[&str], script: &str) -> Ran {
        self.view_in(folder, arguments, script, &[])
    }

    /// The same, with environment variables.
    pub fn view_in(
        &self,
        folder: &Path,
        arguments: &[&str],
        script: &str,
        variables: &[(&str, &str)],
    ) -> Ran {
        parse_script(script).unwrap();
        std::fs::write(folder.join("script.txt"), script).unwrap();
        let mut all: Vec<OsString> = ["--quiet", "view", "--script", "script.txt"]
            .map(OsString::from)
            .to_vec();
        all.extend(arguments.iter().map(OsString::from));
        // A minute where nothing else runs.
        let variables = [
            &[("DISPLAY", self.name.as_str()), ("WAYLAND_DISPLAY", "")],
            variables,
        ]
        .concat();
        lumivox_within(TIMEOUT, folder, &all, &variables)
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        for child in [self.manager.as_mut(), Some(&mut self.server)]
            .into_iter()
            .flatten()
        {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// Fails the test where the program failed.
pub fn check_done(ran: &Ran) {
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
}
