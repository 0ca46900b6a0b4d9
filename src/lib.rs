//! Lumivox.
pub mod frame;
pub mod gi;
pub mod graph;
pub mod image;
pub mod measure;
pub mod metrics;
pub mod reference;
pub mod render;
pub mod scene;
pub mod shader;
pub mod vulkan;
