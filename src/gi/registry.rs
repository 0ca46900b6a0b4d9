//! The list of techniques. Everything that enumerates techniques runs over it.

use super::entry::Entry;
use super::none;
use super::voxel_cones::{clipmap, mips, svo};

/// All techniques.
pub static TECHNIQUES: &[&Entry] = &[&none::ENTRY, &mips::ENTRY, &svo::ENTRY, &clipmap::ENTRY];

/// There is no technique of this name.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no technique {name}; there are: {known}")]
pub struct UnknownTechnique {
    name: String,
    known: String,
}

/// The technique of a name.
pub fn find(name: &str) -> Result<&'static Entry, UnknownTechnique> {
    let known = || {
        TECHNIQUES
            .iter()
            .map(|entry| entry.name)
            .collect::<Vec<_>>()
            .join(", ")
    };
    TECHNIQUES
        .iter()
        .copied()
        .find(|entry| entry.name == name)
        .ok_or_else(|| UnknownTechnique {
            name: name.to_owned(),
            known: known(),
        })
}
