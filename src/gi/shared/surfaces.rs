//! Which pixels show one surface.

use crate::gi::Settings;

/// How near two pixels' surfaces have to be to be one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Off a pixel's plane (footprints of a pixel).
    pub plane_tolerance: f32,
    /// Least cosine of two shading normals.
    pub normal_cosine: f32,
}

impl Limits {
    /// As a technique's settings say.
    pub fn new(settings: &Settings) -> Self {
        Limits {
            plane_tolerance: settings.find_number("plane_tolerance").unwrap_or(0.5),
            normal_cosine: settings.find_number("normal_cosine").unwrap_or(0.9),
        }
    }
}
