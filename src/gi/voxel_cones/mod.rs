//! The family of techniques that keep light in voxels and gather it by cones.

pub mod clipmap;
pub mod mips;
pub mod svo;
