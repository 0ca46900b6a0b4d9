//! Light probes: places that know the irradiance of every direction, and what they see from there.
//! Surfaces look the eight around them up. Maths: `docs/gi/probes.md`.

pub mod borrowed;
pub mod cascades;
pub mod explore;
pub mod field;
pub mod figures;
pub mod irradiance;
pub mod lattice;
pub mod light_field;
pub mod list;
pub mod lookup;
pub mod mirror;
pub mod oracle;
pub mod passes;
pub mod placement;
pub mod prefiltered;
pub mod raster;
pub mod rays;
pub mod reflection;
pub mod relocate;
pub mod schedule;
mod settings;
pub mod snap;
pub mod source;
pub mod view;
pub mod volume;
pub mod voxels;

pub use lattice::Lattice;
pub use passes::{
    BLEND, BLEND_SH, BOUNCE, EXPLORE, GATHER, GATHER_BY_RAYS, LIGHT, MOMENTS, MOMENTS_POWER, TRACE,
};
pub use view::VIEW;
