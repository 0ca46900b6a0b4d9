//! Lumivox.
pub mod image;
pub mod metrics;
pub mod reference;
pub mod scene;
