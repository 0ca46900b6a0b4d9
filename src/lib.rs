//! Lumivox.
pub mod graph;
pub mod image;
pub mod metrics;
pub mod reference;
pub mod scene;
pub mod shader;
pub mod vulkan;
