//! Lumivox.
pub mod image;
pub mod scene;
