//! Presets that techniques of the family share.

use crate::gi::settings::{Preset, PresetValues};
use crate::gi::shared::cone;
use crate::gi::shared::screen;
use crate::gi::shared::voxel;

/// Many cones, so narrow that they read the finest levels.
pub(super) const NARROWEST: Preset = Preset {
    name: "accurate",
    help: "as cones, but 32 of them and so narrow that they read the finest levels",
    values: &[cone::NARROWEST],
};

/// One cone a pixel, and what pixels share.
pub(super) const FAST: Preset = Preset {
    name: "fast",
    help: "as cones, but one a pixel, with the light of earlier frames and of neighbours",
    values: &[
        &[("cones", "1"), ("interleave_window", "off")],
        screen::settings::FAST,
    ],
};

/// The settings' defaults.
pub(super) const CONES: Preset = Preset {
    name: "cones",
    help: "the cones that converge best for their time: narrow, interleaved, kept off the \
           receiver's plane, through levels that stay opaque",
    values: &[],
};

/// Coarser levels of six faces.
pub(super) const ANISOTROPIC: Preset = Preset {
    name: "anisotropic",
    help: "as cones, through coarser levels that look different along each axis from either side",
    values: &[voxel::ANISOTROPIC],
};

/// All levels of six faces.
pub(super) const DIRECTIONAL: Preset = Preset {
    name: "directional",
    help: "as cones, through voxels with six faces on all levels; either side of a face blocks",
    values: &[voxel::DIRECTIONAL],
};

/// A preset `textbook`: the technique as it was published.
pub(super) const fn textbook(help: &'static str, values: &'static [PresetValues]) -> Preset {
    Preset {
        name: "textbook",
        help,
        values,
    }
}

/// As published, where levels are made by a box filter.
pub(super) const TEXTBOOK: Preset = textbook(
    "as in the papers: box-filtered levels, six cones of 60°",
    &[&[("mip_filter", "box")], cone::TEXTBOOK],
);
