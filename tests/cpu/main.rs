//! Tests that need no device: the planner, metrics, the reference, scenes, and the repository
//! itself.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "../support/mod.rs"]
mod support;

mod comparators;
#[cfg(feature = "measure")]
mod fit;
#[cfg(feature = "flip")]
mod flip;
mod glass;
mod gltf;
mod graph;
mod layers;
mod limits;
mod lpv;
mod lpv_leaves;
mod lpv_lobes;
mod lpv_octree;
mod lpv_octree_claims;
mod lpv_simulator;
mod metrics;
mod output;
mod placement;
mod properties;
mod prt;
mod radiosity;
mod reference;
mod repository;
mod scene;
mod sky;
mod sources;
mod spherical_harmonics;
mod sun;
#[cfg(feature = "view")]
mod window;
