//! What the camera sees: the surfaces ([`gbuffer`]), how they move ([`motion`]), those that
//! light is gathered for ([`receivers`]), and the picture that the light makes of them
//! ([`output`]).

pub(super) mod gbuffer;
pub(super) mod motion;
pub(super) mod output;
pub(super) mod receivers;
pub(super) mod terms_view;
