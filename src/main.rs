//! The `lumivox` program. All that it can do is in the library; `cli/` has one file per subcommand,
//! for arguments and printing only.
//!
//! Exit codes: 0 done, 1 the work failed, 2 bad arguments or input.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
