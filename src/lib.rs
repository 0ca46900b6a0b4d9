//! Lumivox.
pub mod image;
pub mod reference;
pub mod scene;
