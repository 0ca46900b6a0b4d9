//! How eight texels of premultiplied radiance become one, in dense mips and in bricks
//! (`gi/shared/voxel/prefilter.glsl`), and which of them depend on the direction.

use crate::gi::Settings;
use crate::gi::settings::{Domain, PresetValues, Setting};

/// The setting that chooses a [`Prefilter`].
pub const MIP_FILTER: Setting = Setting {
    name: "mip_filter",
    help: "2³ texels to one of the next level: box (their mean), directional (composited along \
           six directions, then averaged: thin walls stay opaque) or directional-max (the same, \
           then made as opaque as along its most opaque axis)",
    unit: "",
    domain: Domain::Choice(&["directional", "directional-max", "box"]),
    default: "directional",
};

/// A filter; its number is the `mode` of `filter_eight` in the shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prefilter {
    /// The mean of the eight texels.
    Box = 0,
    /// Composited along six directions, then averaged.
    Directional = 1,
    /// As `Directional`, then brought to the opacity of the most opaque axis.
    DirectionalMax = 2,
}

/// The settings that choose [`Directionality`], and how three faces make one texel.
pub static FACE_SETTINGS: &[Setting] = &[
    Setting {
        name: "anisotropic",
        help: "from level 1 on, a texel for each of six directions, composited front to back \
               along its axis; mip_filter is not used then",
        unit: "",
        domain: Domain::Choice(&["off", "on"]),
        default: "off",
    },
    Setting {
        name: "faces",
        help: "directional voxels, on all levels: one radiance and opacity for all directions \
               (one), or six faces; a face shows the surface that looks its way (front: from \
               behind it is transparent) or all surface across its axis (both: either side blocks)",
        unit: "",
        domain: Domain::Choice(&["one", "front", "both"]),
        default: "one",
    },
    Setting {
        name: "face_weights",
        help: "how the three faces that a cone meets make one opacity: extinction (their optical \
               depths along the direction) or squared (squares of its components as weights)",
        unit: "",
        domain: Domain::Choice(&["extinction", "squared"]),
        default: "extinction",
    },
    Setting {
        name: "normals",
        help: "where the light of a texel without faces goes: off (all ways alike) or by the mean \
               normal of what shines, which a second texel holds: toksvig (normals spread around \
               it by Toksvig's variance, and a cone sees the share that faces it), convolved (the \
               same, with the published lobe of the cone) or harmonics (two bands)",
        unit: "",
        domain: Domain::Choice(&["off", "toksvig", "harmonics", "convolved"]),
        default: "off",
    },
];

/// Six directions from level 1 on, with the opacity exponent that holds on curved walls too.
pub const ANISOTROPIC: PresetValues = &[
    ("anisotropic", "on"),
    ("face_weights", "squared"),
    ("opacity_exponent", "1.5"),
];

/// Six faces on all levels, likewise.
pub const DIRECTIONAL: PresetValues = &[("faces", "both"), ("opacity_exponent", "1.5")];

/// Whose surface a face of a directional voxel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Faces {
    /// The surface that looks the face's way: from behind, the face is transparent.
    Front = 1,
    /// All surface across the face's axis: either side blocks.
    Both = 2,
}

/// On which levels a texel has six faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Directionality {
    /// On none: a texel has one value for all directions.
    Isotropic,
    /// On all but the finest: anisotropic voxels (Crassin et al. 2011; Villegas & Ramírez).
    Anisotropic,
    /// On all: directional voxels.
    Directional(Faces),
}

impl Directionality {
    /// From a technique's settings; faces on all levels include those of the coarser ones.
    /// Isotropic where the technique does not have the settings. Rays see the sides of the finest
    /// voxels, so these have no faces then.
    pub fn new(settings: &Settings) -> Self {
        let has_cones = settings
            .find_choice("gather")
            .is_none_or(|by| by == "cones");
        match (
            settings.find_choice("faces").filter(|_| has_cones),
            settings.find_choice("anisotropic"),
        ) {
            (Some("front"), _) => Directionality::Directional(Faces::Front),
            (Some("both"), _) => Directionality::Directional(Faces::Both),
            (_, Some("on")) => Directionality::Anisotropic,
            _ => Directionality::Isotropic,
        }
    }

    /// The faces of the finest level.
    pub fn faces(self) -> Option<Faces> {
        if let Directionality::Directional(faces) = self {
            Some(faces)
        } else {
            None
        }
    }
}

/// How the light of a texel goes where its mean normal says: the share of it that a cone sees
/// (`gi/shared/cone/normals.glsl`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NormalLobe {
    /// Normals are spread around their mean with Toksvig's variance (Toksvig 2005).
    #[default]
    Toksvig = 1,
    /// The first two bands of what a one-sided surface sends.
    Harmonics = 2,
    /// As `Toksvig`, convolved with a lobe of the cone that looks: σ_v = cos φ with φ its aperture
    /// (Hong 2015, section 2.5.3.3.5).
    Convolved = 3,
}

impl NormalLobe {
    /// From a technique's settings; `None` where texels shine alike to all sides.
    pub fn new(settings: &Settings) -> Option<Self> {
        match settings.find_choice("normals") {
            Some("toksvig") => Some(NormalLobe::Toksvig),
            Some("harmonics") => Some(NormalLobe::Harmonics),
            Some("convolved") => Some(NormalLobe::Convolved),
            _ => None,
        }
    }
}

impl Prefilter {
    /// From a technique's settings.
    pub fn new(settings: &Settings) -> Self {
        match settings.choice(MIP_FILTER.name) {
            "box" => Prefilter::Box,
            "directional" => Prefilter::Directional,
            _ => Prefilter::DirectionalMax,
        }
    }
}
