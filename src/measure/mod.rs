//! Measuring: reports of runs.

pub mod report;
