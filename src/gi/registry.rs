//! The list of techniques. Everything that enumerates techniques runs over [`all`].

use std::sync::{PoisonError, RwLock};

use super::entry::Entry;
use super::lpv;
use super::none;
use super::probes;
use super::ray_traced;
use super::settings::listed;
use super::voxel_cones::{clipmap, mips, svo};

/// Lumivox's own techniques.
pub static TECHNIQUES: &[&Entry] = &[
    &none::ENTRY,
    &mips::ENTRY,
    &svo::ENTRY,
    &clipmap::ENTRY,
    &lpv::uniform::ENTRY,
    &lpv::cascaded::ENTRY,
    &lpv::octree::ENTRY,
    &ray_traced::ENTRY,
    &probes::irradiance::ENTRY,
    &probes::light_field::ENTRY,
    &probes::cascades::ENTRY,
];

/// The technique that commands take where none is named.
pub const DEFAULT: &str = mips::ENTRY.name;

/// What programs that use the library have added.
static ADDED: RwLock<Vec<&'static Entry>> = RwLock::new(Vec::new());

/// A technique of this name is there already.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is a technique {0} already; give yours another name")]
pub struct NameTaken(&'static str);

/// There is no technique of this name.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no technique {name}; there are: {known}")]
pub struct UnknownTechnique {
    name: String,
    known: String,
}

/// Adds a technique from outside of the library, for as long as the program runs.
pub fn add(entry: &'static Entry) -> Result<(), NameTaken> {
    let mut added = ADDED.write().unwrap_or_else(PoisonError::into_inner);
    let mut known = TECHNIQUES.iter().chain(added.iter());
    if known.any(|known| known.name == entry.name) {
        return Err(NameTaken(entry.name));
    }
    added.push(entry);
    Ok(())
}

/// All techniques: Lumivox's own, then those that were added.
pub fn all() -> Vec<&'static Entry> {
    let added = ADDED.read().unwrap_or_else(PoisonError::into_inner);
    TECHNIQUES.iter().chain(added.iter()).copied().collect()
}

/// Names of the techniques that have a setting of this name.
pub fn owners(setting: &str) -> Vec<&'static str> {
    let has = |entry: &&Entry| entry.all_settings().any(|known| known.name == setting);
    all()
        .into_iter()
        .filter(has)
        .map(|entry| entry.name)
        .collect()
}

/// The technique of a name.
pub fn find(name: &str) -> Result<&'static Entry, UnknownTechnique> {
    let all = all();
    let found = all.iter().find(|entry| entry.name == name);
    found.copied().ok_or_else(|| UnknownTechnique {
        name: name.to_owned(),
        known: listed(all.iter().map(|entry| entry.name)),
    })
}
