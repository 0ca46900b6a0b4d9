//! Tests that cannot run here say so in one place: `tools/test` prints the table at the end.

use std::io::Write as _;

/// What a test lacks.
pub enum Missing<'m> {
    /// A program or package that `tools/setup` installs; on the machine of CI this fails the test.
    Package(&'m str),
    /// Real scenes, references, or a feature of the device: nothing that setup could bring.
    Other(&'m str),
}

/// Says that the test is skipped and why: on stderr, and in the file that `LUMIVOX_SKIPPED` names.
pub fn skipped(missing: &Missing<'_>) {
    let why = match missing {
        Missing::Package(what) => {
            assert!(
                std::env::var_os("CI").is_none_or(|ci| ci != "true"),
                "{what} is not installed; tools/setup does it"
            );
            format!("{what} is not installed; run tools/setup")
        }
        Missing::Other(what) => (*what).to_owned(),
    };
    let thread = std::thread::current();
    let line = format!("{}: {why}\n", thread.name().unwrap_or("a test"));
    eprint!("SKIPPED: {line}");
    if let Some(path) = std::env::var_os("LUMIVOX_SKIPPED") {
        let mut file = std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(path)
            .unwrap();
        file.write_all(line.as_bytes()).unwrap();
    }
}
