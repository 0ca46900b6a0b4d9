//! Tests of the program as its users run it: commands and windows.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "../support/mod.rs"]
mod support;

mod bench;
mod chart;
mod cli;
mod cli_outputs;
mod docs;
mod faults;
mod fit;
mod golden_window;
mod lpv;
mod scene_errors;
mod sequences;
mod view;
mod voxelize;
