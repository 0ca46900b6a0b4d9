//! The list of techniques. Everything that enumerates techniques runs over [`all`].

use std::sync::{PoisonError, RwLock};

use super::entry::{Entry, Stage};
use super::gtao;
use super::lpv;
use super::none;
use super::probes;
use super::prt;
use super::ray_traced;
use super::settings::listed;
use super::voxel_cones::{clipmap, mips, svo};
use super::{Context, Technique, Wanted};
use crate::graph::Error;

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
    &prt::ENTRY,
    &gtao::ENTRY,
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

/// Makes the first technique that lends such a store, for another one that wants it.
pub fn lend(context: &Context<'_>, wanted: &Wanted) -> Result<Box<dyn Technique>, Error> {
    let refused = |lender: &str, problem: String| Error::NotLent {
        lender: lender.to_owned(),
        problem,
    };
    let all = all().into_iter();
    let mut lenders = all.filter_map(|entry| Some((entry, entry.lends?)));
    let (entry, lends) = lenders
        .find(|(_, lends)| lends.kind == wanted.kind)
        .ok_or_else(|| refused(wanted.kind.name(), "no technique lends one".into()))?;
    let settings = (entry.settings(None, &(lends.pairs)(wanted)))
        .map_err(|error| refused(entry.name, error.to_string()))?;
    (entry.make)(context, &settings)
}

/// What the passes of a technique do, those of stores that it may use last; each stage once.
pub fn stages(entry: &Entry) -> Vec<&'static Stage> {
    let mut stages = entry.stages.to_vec();
    if entry.borrows {
        let lenders = all().into_iter().filter(|entry| entry.lends.is_some());
        for stage in lenders.flat_map(|entry| entry.stages) {
            if !stages.contains(stage) {
                stages.push(stage);
            }
        }
    }
    stages
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gi::StoreKind;

    #[test]
    fn every_kind_of_store_is_lent_by_one_technique() {
        for kind in StoreKind::ALL {
            let lends = |entry: &&&Entry| entry.lends.is_some_and(|lends| lends.kind == kind);
            assert_eq!(
                TECHNIQUES.iter().filter(lends).count(),
                1,
                "{}",
                kind.name()
            );
        }
    }
}
