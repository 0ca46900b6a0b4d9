//! The bench for light propagation ([`crate::gi::lpv::oracle::simulator`]): what it starts from,
//! what it writes down after each action, and its pictures.

mod plots;
mod record;
mod scene;
mod slice;

pub use plots::{error_chart, flux_chart, reference_chart};
pub use record::{CSV_HEADER, Record, Recorder};
pub use scene::{SceneSetupError, scene_setup};
pub use slice::{Shown, Slice, SlicePicture, Spread, Which};
