//! The `lumivox` program.

fn main() -> std::process::ExitCode {
    lumivox::cli::run()
}
