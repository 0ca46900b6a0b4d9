//! Plain twins of the passes, in double precision.

mod faces;
mod light;
pub mod lobes;
pub mod octree;
pub mod simulator;
mod sweep;

pub use faces::{Crossings, crossings};
pub use light::{Texel, inject, irradiance};
pub(crate) use sweep::neighbour;
pub use sweep::{Boundary, Ledger, Swept, field, jacobi, sweep};
