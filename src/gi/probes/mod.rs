//! Light probes: places that know the irradiance of every direction, and what they see from there.
//! Surfaces look the eight around them up. Maths: `docs/gi/probes.md`.

pub mod explore;
pub mod irradiance;
pub mod lattice;
pub mod lookup;
pub mod oracle;
pub mod passes;
pub mod rays;
mod settings;
pub mod snap;
pub mod volume;

pub use lattice::Lattice;
pub use passes::{BLEND, BOUNCE, EXPLORE, GATHER, LIGHT, MOMENTS, TRACE};
