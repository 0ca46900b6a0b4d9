//! `lumivox scene`.

use super::CliError;

/// To be written.
#[derive(clap::Args)]
pub(crate) struct Args {}

/// To be written.
pub(crate) fn run(_args: &Args) -> Result<(), CliError> {
    Ok(())
}
