//! Plain twins of the passes, in double precision.

pub mod bands;
mod faces;
mod leaves;
mod light;
pub mod lobes;
mod lookup;
pub mod octree;
pub mod simulator;
mod slices;
mod surfels;
mod sweep;

pub use faces::{Crossings, crossings};
pub use leaves::{leaf_of, sweep_leaves};
pub use light::{Texel, inject};
pub use lookup::{Place, by_direction, irradiance, specular};
pub use slices::slices;
pub use surfels::{merge, surfels};
pub(crate) use sweep::neighbour;
pub use sweep::{Boundary, Ledger, Swept, field, jacobi, sweep};
