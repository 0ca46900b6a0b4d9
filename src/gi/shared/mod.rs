//! Parts that several families use. They name no technique.

pub mod bounces;
pub mod cone;
pub mod interleave;
pub mod paths;
pub mod screen;
pub mod sh;
pub mod split_sum;
pub mod surfaces;
pub mod voxel;
