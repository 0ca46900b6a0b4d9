//! Lumivox.
pub mod graph;
pub mod image;
pub mod scene;
pub mod shader;
pub mod vulkan;
