//! What the lights see: [`settings`] how finely, [`views`] how they look into the scene,
//! [`cascades`] where directional lights do; [`maps`] draws it, [`sampling`] says where that is too
//! coarse.

pub(super) mod cascades;
pub(super) mod maps;
pub(super) mod sampling;
pub(super) mod settings;
pub(super) mod views;
