//! Presets that techniques of the family share.

use crate::gi::settings::{Preset, PresetValues};
use crate::gi::shared::cone;
use crate::gi::shared::screen;
use crate::gi::shared::voxel;

/// Exact rays.
pub(super) const ACCURATE: Preset = Preset {
    name: "accurate",
    help: "exact rays, interleaved over 4×4 pixels: the least error for its time where walls are \
           flat",
    values: &[&[("gather", "rays")]],
};

/// One ray a pixel, and what pixels share.
pub(super) const FAST: Preset = Preset {
    name: "fast",
    help: "as accurate, but one ray a pixel, with the light of earlier frames and of neighbours",
    values: &[
        &[
            ("gather", "rays"),
            ("rays", "1"),
            ("interleave_window", "off"),
        ],
        screen::settings::FAST,
    ],
};

/// Exact visibility.
pub(super) const TRIANGLES: Preset = Preset {
    name: "triangles",
    help: "as accurate, but rays meet the scene's own triangles: voxels only keep the light of \
           each of their faces, so walls and bars thinner than a voxel hide what they should",
    values: &[&[("gather", "triangles"), ("radiance", "six-sided")]],
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
