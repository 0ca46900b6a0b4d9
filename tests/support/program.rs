//! Runs of the program itself.

use std::ffi::OsString;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Nothing here takes a tenth of it.
const TIMEOUT: Duration = Duration::from_secs(120);

/// What a run of the program gave.
pub struct Ran {
    /// The exit code.
    pub code: Option<i32>,
    /// All that it said.
    pub stderr: String,
}

/// The path of the program.
pub const PROGRAM: &str = env!("CARGO_BIN_EXE_lumivox");

/// Another program in its place, for a test that is one itself.
pub static OWN_PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// The variable that tells [`OWN_PROGRAM`] that it is not to test but to be the program.
pub const AS_PROGRAM: &str = "LUMIVOX_AS_PROGRAM";

/// The variable under which every command of the program validates: any message of the layer fails
/// it.
pub const VALIDATE: (&str, &str) = ("LUMIVOX_VALIDATE", "1");

/// The program, with validation.
pub fn command() -> Command {
    let mut command = match OWN_PROGRAM.get() {
        Some(own) => Command::new(own),
        None => Command::new(PROGRAM),
    };
    command.env(VALIDATE.0, VALIDATE.1).env(AS_PROGRAM, "1");
    command
}

/// Runs the program in a folder; it neither hangs nor panics.
pub fn lumivox(folder: &Path, arguments: &[OsString], environment: &[(&str, &str)]) -> Ran {
    lumivox_within(TIMEOUT, folder, arguments, environment)
}

/// As [`lumivox`], with another time after which it hangs.
pub fn lumivox_within(
    timeout: Duration,
    folder: &Path,
    arguments: &[OsString],
    environment: &[(&str, &str)],
) -> Ran {
    let mut command = command();
    command
        .args(arguments)
        .current_dir(folder)
        .envs(environment.iter().copied())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut pipe = child.stderr.take().unwrap();
    let reader = std::thread::spawn(move || {
        let mut bytes = Vec::new();
        pipe.read_to_end(&mut bytes)
            .map(|_| String::from_utf8_lossy(&bytes).into_owned())
    });
    let start = Instant::now();
    let code = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status.code();
        }
        if start.elapsed() > timeout {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("{arguments:?} hangs");
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let stderr = reader.join().unwrap().unwrap();
    assert!(
        !stderr.contains("panicked"),
        "{arguments:?} panics: {stderr}"
    );
    Ran { code, stderr }
}

/// Arguments, separated by spaces.
pub fn words(line: &str) -> Vec<OsString> {
    line.split_whitespace().map(OsString::from).collect()
}

/// One line (and its causes) that begins with `error:` and says all of `says`.
pub fn check_error(name: &str, ran: &Ran, code: i32, says: &[&str]) {
    let Ran {
        code: found,
        stderr,
    } = ran;
    assert_eq!(*found, Some(code), "{name}: {stderr}");
    let errors: Vec<&str> = stderr
        .lines()
        .filter(|line| line.starts_with("error: "))
        .collect();
    assert_eq!(errors.len(), 1, "{name}: not one line: {stderr}");
    let usage = |line: &str| {
        line.is_empty()
            || line.starts_with("Usage:")
            || line.starts_with("For more information")
            || line.starts_with("  ")
    };
    let rest: Vec<&str> = stderr
        .lines()
        .filter(|line| !line.starts_with("error: ") && !usage(line))
        .collect();
    assert!(
        (rest.iter())
            .all(|line| line.starts_with('[') || line.starts_with("chosen for this scene")),
        "{name}: more than an error, causes, warnings and what was chosen: {stderr}"
    );
    says.iter().for_each(|part| {
        assert!(
            errors[0].contains(part),
            "{name}: `{part}` is not in: {}",
            errors[0]
        )
    });
}
