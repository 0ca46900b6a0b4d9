//! Light propagation volumes (Kaplanyan & Dachsbacher 2010): light goes from cell to cell of a
//! grid, and surfaces look it up.
//!
//! - [`faces`]: which neighbours cannot see each other, and what they see instead.
//! - [`inject`]: what surfaces reflect, into cells, and [`inflow`], what comes from outside.
//! - [`sweep`]: from cells to all others, along discrete directions.
//! - [`jacobi`]: the same in steps of all cells at once.
//! - [`slices`]: the same in slices, with smoother steps.
//! - [`leaf_sweep`]: the same by [`leaves`] of an octree, in the order of a [`schedule`].
//! - [`lobes`]: the same by the published method, and [`blockers`], its fuzzy occlusion, of what
//!   lights see and the camera, in layers that [`peel`] finds.
//! - [`bands`]: streams of the published method in more bands.
//! - [`levels`]: the published method in all levels of an octree.
//! - [`light`]: what the light of cells is kept in.
//! - [`gather`]: from cells to pixels, and [`by_direction`], the same without harmonics.
//! - [`view`]: cells to look at, and [`structure`], by their level.
//! - [`ledger`]: where the light has gone, in watts.
//! - [`place`]: what the cell at a pixel has, in words.
//! - [`simulator`]: the published method on the CPU, to be watched.
//!
//! [`Cells`] is all from surfaces to cells, for one grid. Techniques:
//!
//! - [`uniform`]: one grid around the scene.
//! - [`cascaded`]: nested grids around the camera.
//! - [`octree`]: one grid, with larger cells far from surfaces, or levels of them.

pub mod bands;
pub mod blockers;
pub mod by_direction;
pub mod cascaded;
mod cell_settings;
mod cells;
mod directions;
pub mod faces;
pub mod gather;
mod grid;
pub mod inflow;
pub mod inject;
pub mod jacobi;
pub mod leaf_sweep;
pub mod leaves;
pub mod ledger;
pub mod levels;
pub mod light;
pub mod lobes;
pub mod octree;
mod one_grid;
pub mod oracle;
pub mod peel;
pub mod place;
pub mod schedule;
pub mod scroll;
mod settings;
pub mod simulator;
pub mod slices;
pub mod structure;
pub mod sweep;
pub mod uniform;
pub mod view;

pub use cell_settings::{CellSettings, Octree, Ordinates, Source};
pub use cells::{Cells, Propagation};
pub use directions::Directions;
pub use grid::{CellGrid, GridRow};
