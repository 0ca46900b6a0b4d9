//! The settings that suit the scene, where the user asks for them.

use super::pane::Pane;
use crate::gi::entry::{Entry, Suited};

/// A choice that is asked for.
pub(super) struct SuitJob {
    /// 0 left, 1 right.
    pub(super) side: usize,
    /// The technique that chooses.
    pub(super) entry: &'static Entry,
}

/// What came back.
pub(super) struct SuitAnswer {
    pub(super) of: SuitJob,
    /// `None` where nothing depends on the scene.
    pub(super) found: Result<Option<Suited>, String>,
}

/// How far the choice of a side is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) enum Suit {
    /// It was not asked for.
    #[default]
    Unasked,
    /// It is wanted.
    Wanted,
    /// The render thread looks at the scene.
    Asked,
    /// What it was chosen by, what it would need to be right, or why there is none.
    Said(String),
}

impl SuitJob {
    /// Looks at the scene of a side that shows it.
    pub(super) fn answer(self, pane: Option<&Pane<'_>>) -> SuitAnswer {
        let found = match pane {
            Some(pane) => pane.suit(self.entry).map_err(|error| error.to_string()),
            None => Err("there is no picture of the scene yet".to_owned()),
        };
        SuitAnswer { of: self, found }
    }
}
