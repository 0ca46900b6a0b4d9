//! What the lights see: [`views`] says how they look into the scene, [`maps`] draws it.

pub(super) mod maps;
pub(super) mod views;
