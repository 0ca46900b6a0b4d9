//! Search: the cheapest technique and settings that meet bounds on one scene, by measuring as few
//! points as possible.
//!
//! A [`Search`] knows nothing of techniques. It has [`Candidate`]s, and a [`Trial`] that measures
//! them. [`SceneTrial`] is the one that measures points of [sweeps](super::chart::Sweep), one for
//! each [`View`] of a scene, and keeps their records. A [`Fit`] is what was found, in words.

mod answer;
mod bound;
mod candidate;
mod cases;
mod estimate;
mod gain;
mod search;
mod trial;
mod view;

pub use answer::{Choice, Fit};
pub use bound::{Aim, Bounds, Figures};
pub use candidate::Candidate;
pub use cases::{candidate_of, cases_at, neighbours};
pub use search::{Found, Search, Trial};
pub use trial::{SceneTrial, TrialProgress, TrialSettings};
pub use view::View;
