//! Measuring: cases, runs, reports and their charts.

pub mod bench;
pub mod chart;
mod figures;
pub mod report;
pub mod table;

pub use figures::{error_chart, memory_chart, passes_chart};
