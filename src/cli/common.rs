//! What several subcommands need.

use std::io::Write as _;
use std::path::Path;

use lumivox::reference::MAX_SIZE_PX;

use super::CliError;

/// Prints a line. That nobody reads it any more is no failure of the work.
pub(super) fn say(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// Whether a file is to be EXR rather than PNG, by its extension.
pub(super) fn is_exr(path: &Path) -> Result<bool, CliError> {
    match path.extension().and_then(|extension| extension.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("exr") => Ok(true),
        Some("png") => Ok(false),
        _ => Err(CliError::input(format!("{}: the name must end in .exr or .png", path.display()))),
    }
}

/// A size written as WIDTHxHEIGHT.
pub(super) fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parts = text.split_once('x').and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    let (width, height) = parts.ok_or_else(|| String::from("write WIDTHxHEIGHT, as in 1280x720"))?;
    let is_possible = |size: &u32| (1..=MAX_SIZE_PX).contains(size);
    if is_possible(&width) && is_possible(&height) { Ok((width, height)) } else { Err(format!("width and height must be 1 to {MAX_SIZE_PX} px")) }
}
