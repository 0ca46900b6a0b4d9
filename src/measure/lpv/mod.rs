//! Files of the simulator of light propagation ([`crate::gi::lpv::oracle::simulator`]): drawings,
//! and plots of what it writes down after each action.

mod drawing;
mod plots;

pub use drawing::write_drawing;
pub use plots::{error_chart, flux_chart, reference_chart};
