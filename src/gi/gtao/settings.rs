//! Settings, presets and rules.

use crate::gi::settings::{Domain, Group, Preset, Rule, Setting};
use crate::gi::shared::screen;

/// The technique's own settings; patterns have theirs.
pub(super) const SETTINGS: &[Setting] = &[
    Setting {
        name: "slices",
        help: "planes through the eye and the surface, each of which has two horizons",
        unit: "",
        domain: Domain::Count { min: 1, max: 64 },
        default: "4",
    },
    Setting {
        name: "slice_steps",
        help: "samples of the picture's depths along each half of a slice",
        unit: "",
        domain: Domain::Count { min: 1, max: 64 },
        default: "16",
    },
    Setting {
        name: "light",
        help: "none (the technique is for --aov visibility), or sky: that of the environment, \
               times the visibility; surfaces never send any",
        unit: "",
        domain: Domain::Choice(&["none", "sky"]),
        default: "none",
    },
    Setting {
        name: "occlusion_distance",
        help: "occluders farther away do not count; 0: all that the picture shows",
        unit: "m",
        domain: Domain::Number { min: 0.0, max: 1e6 },
        default: "0",
    },
    Setting {
        name: "occlusion_falloff",
        help: "λ in the weight 1 / (1 + λ r) of an occluder at a distance r",
        unit: "1/m",
        domain: Domain::Number { min: 0.0, max: 1e4 },
        default: "0",
    },
    Setting {
        name: "thin_occluders",
        help: "a sample behind the horizon takes back this share of the way down to it, so that a \
               thin occluder hides less than one without a back; 0: none has a back",
        unit: "",
        domain: Domain::Number { min: 0.0, max: 1.0 },
        default: "0",
    },
];

/// The presets.
pub(super) const PRESETS: &[Preset] = &[
    Preset {
        name: "default",
        help: "4 slices a pixel, and means over tiles of pixels",
        values: &[],
    },
    Preset {
        name: "fast",
        help: "one slice a pixel, with the light of earlier frames and of neighbours",
        values: &[
            &[
                ("slices", "1"),
                ("slice_steps", "8"),
                ("interleave_window", "off"),
            ],
            screen::settings::FAST,
        ],
    },
    Preset {
        name: "accurate",
        help: "16 slices a pixel, and every other pixel nearby",
        values: &[&[("slices", "16"), ("slice_steps", "48")]],
    },
];

/// In which group settings are, and when they have an effect.
pub(super) const RULES: &[Rule] = &[Rule::always(
    Group::Gather,
    &[
        "slices",
        "slice_steps",
        "light",
        "occlusion_distance",
        "occlusion_falloff",
        "thin_occluders",
    ],
)];
