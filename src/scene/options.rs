//! How files become a scene.

/// How to load a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Render missing textures and materials mid-grey, with a warning; otherwise they are errors.
    pub allow_missing_textures: bool,
    /// The axis that points up in an `.obj` alone.
    pub up: Up,
}

/// An axis of a model's file that points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Up {
    /// +y, as everywhere in this crate.
    #[default]
    Y,
    /// +z: the model is turned, so that its z becomes y and its y becomes −z.
    Z,
}
