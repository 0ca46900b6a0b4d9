//! A display without a screen (Xvfb), and the program's window on it.

use std::ffi::OsString;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use lumivox::view::parse_script;
use x11rb::connection::Connection as _;
use x11rb::protocol::xproto::{ConnectionExt as _, KEY_PRESS_EVENT, KEY_RELEASE_EVENT};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

use super::program::{Ran, lumivox_within};
use super::{Missing, skipped};

/// Scripts give up by themselves where something does not come.
const TIMEOUT: Duration = Duration::from_secs(600);

/// Names of keys as X has them, for those that tests press (X11/keysymdef.h).
const KEYSYMS: [(&str, u32); 4] = [
    ("Escape", 0xff1b),
    ("F1", 0xffbe),
    ("F2", 0xffbf),
    ("F11", 0xffc8),
];

/// Keys that are held while another is pressed.
const MODIFIERS: [(&str, u32); 2] = [("Ctrl", 0xffe3), ("Shift", 0xffe1)];

/// A hand at the keyboard of a display.
pub struct Hand {
    connection: RustConnection,
    /// By number of the key, from the first on: what it means, with Shift next.
    symbols: Vec<Vec<u32>>,
    first: u8,
}

impl Hand {
    /// Presses a key and lets it go, as `F1`, `c` or `Ctrl+O`.
    pub fn press(&self, keys: &str) {
        let codes: Vec<u8> = keys.split('+').map(|name| self.code(name)).collect();
        let fake = |kind: u8, code: &u8| {
            let sent = self
                .connection
                .xtest_fake_input(kind, *code, 0, x11rb::NONE, 0, 0, 0);
            sent.unwrap().check().unwrap();
        };
        codes.iter().for_each(|code| fake(KEY_PRESS_EVENT, code));
        codes
            .iter()
            .rev()
            .for_each(|code| fake(KEY_RELEASE_EVENT, code));
    }

    fn code(&self, name: &str) -> u8 {
        let mut named = KEYSYMS.iter().chain(&MODIFIERS);
        // What is no name is a character, whose symbol is its code in Latin-1.
        let symbol = named.find(|(known, _)| *known == name).map_or_else(
            || u32::from(name.to_lowercase().chars().next().unwrap()),
            |(_, symbol)| *symbol,
        );
        let place = self.symbols.iter().position(|all| all[0] == symbol);
        self.first + u8::try_from(place.unwrap_or_else(|| panic!("no key {name}"))).unwrap()
    }
}

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

    /// A hand at its keyboard.
    pub fn hand(&self) -> Hand {
        let (connection, _) = RustConnection::connect(Some(&self.name)).unwrap();
        let setup = connection.setup();
        let (first, last) = (setup.min_keycode, setup.max_keycode);
        let mapped = connection
            .get_keyboard_mapping(first, last - first + 1)
            .unwrap();
        let mapped = mapped.reply().unwrap();
        let each = usize::from(mapped.keysyms_per_keycode);
        let symbols = mapped.keysyms.chunks(each).map(<[u32]>::to_vec).collect();
        Hand {
            connection,
            symbols,
            first,
        }
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
