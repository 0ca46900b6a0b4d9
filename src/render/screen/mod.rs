//! What the camera sees: the surfaces ([`gbuffer`]), how they move ([`motion`]), and the picture
//! that the light makes of them ([`output`]).

pub(super) mod gbuffer;
pub(super) mod motion;
pub(super) mod output;
