//! Measuring: cases, runs, reports and their charts.

pub mod bench;
mod build;
pub mod chart;
pub mod clocks;
pub mod draw;
pub mod explain;
mod figures;
pub mod fit;
pub mod lpv;
pub mod over_time;
mod profile;
pub mod records;
pub mod report;
pub mod stages;
pub mod stress;
pub mod table;
pub mod throughput;
pub mod walk;

pub use figures::{error_chart, memory_chart, motion_chart, passes_chart};
pub use profile::{directions_chart, stages_chart, structures_chart};
pub use walk::walk_chart;
