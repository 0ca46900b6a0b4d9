//! Plain twins of the passes, in double precision.

mod faces;
mod light;
pub mod lobes;
mod sweep;

pub use faces::{Crossings, crossings};
pub use light::{Texel, inject, irradiance};
pub use sweep::{Boundary, Ledger, Swept, field, jacobi, sweep};
