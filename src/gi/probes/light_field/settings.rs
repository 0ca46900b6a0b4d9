//! Settings, presets and rules.

use crate::gi::probes::borrowed::{SOURCE_RESOLUTION, STORE};
use crate::gi::probes::field::RADIANCE_TEXELS;
use crate::gi::probes::prefiltered::{PARALLAX, PARALLAX_RULE};
use crate::gi::probes::settings::BOUNCES;
use crate::gi::settings::{Domain, Group, Preset, Rule, Setting, Settings};
use crate::gi::shared::interleave::Pattern;
use crate::gi::shared::paths::{HIT_LIGHT, MIRROR_RAYS, RAYS};

/// Its own settings; where probes stand, and patterns, have theirs.
pub(super) const SETTINGS: &[Setting] = &[
    RADIANCE_TEXELS,
    Setting {
        name: "trace_mode",
        help: "what a ray meets in a texel: the plane of the surface there, or as published that \
               surface with a thickness",
        unit: "",
        domain: Domain::Choice(&["plane", "thickness"]),
        default: "plane",
    },
    Setting {
        name: "thickness",
        help: "the greatest thickness of surfaces",
        unit: "m",
        domain: Domain::Number {
            min: 0.03,
            max: 0.5,
        },
        default: "0.5",
    },
    Setting {
        name: "origin_bias",
        help: "how far off its surface a ray starts, in texels of the nearest probe",
        unit: "texels",
        domain: Domain::Number { min: 0.0, max: 8.0 },
        default: "1",
    },
    Setting {
        name: "unknown",
        help: "what answers a ray that leaves what its eight probes see: rays, through the \
               triangles, or irradiance, the mean of what comes to the surface",
        unit: "",
        domain: Domain::Choice(&["rays", "irradiance"]),
        default: "rays",
    },
    RAYS,
    Setting {
        name: "specular",
        help: "glossy reflections: rays, through the maps; prefiltered, light of the maps that is \
               averaged beforehand up to roughness 0.35, rays to 0.65, and beyond the mean of all \
               that probes see in front of a surface; cones, through the store of another \
               technique; or off",
        unit: "",
        domain: Domain::Choice(&["rays", "prefiltered", "cones", "off"]),
        default: "rays",
    },
    MIRROR_RAYS,
    PARALLAX,
    STORE,
    SOURCE_RESOLUTION,
    HIT_LIGHT,
    Setting {
        name: "probe_rays",
        help: "rays of a probe for its irradiance, where further bounces or unknown ask for it",
        unit: "rays",
        domain: Domain::Count { min: 32, max: 8192 },
        default: "256",
    },
    BOUNCES,
];

/// The presets.
pub(super) const PRESETS: &[Preset] = &[
    Preset {
        name: "default",
        help: "8 probes along the longest side, 64×64 texels each, 16 rays a pixel",
        values: &[DEFAULT],
    },
    Preset {
        name: "fast",
        help: "4 probes along the longest side, and shadow maps say which light reaches what they \
               see",
        values: &[DEFAULT, &[("probes", "4"), ("hit_light", "maps")]],
    },
    Preset {
        name: "textbook",
        help: "as in McGuire et al. 2017: 4 probes along the longest side, 128×128 texels each, \
               surfaces of a thickness",
        values: &[
            DEFAULT,
            &[
                ("probes", "4"),
                ("radiance_texels", "128"),
                ("trace_mode", "thickness"),
                ("origin_bias", "4"),
                ("unknown", "irradiance"),
            ],
        ],
    },
    Preset {
        name: "accurate",
        help: "128×128 texels, 64 rays a pixel",
        values: &[
            DEFAULT,
            &[
                ("radiance_texels", "128"),
                ("rays", "64"),
                ("mirror_rays", "64"),
            ],
        ],
    },
];

const DEFAULT: &[(&str, &str)] = &[
    ("probes", "8"),
    ("outer_layer", "0.5"),
    ("placement", "lattice"),
];

/// In which group settings are, and when they have an effect.
pub(super) const RULES: &[Rule] = &[
    Rule::always(Group::Structure, &["radiance_texels"]),
    Rule::always(Group::Light, &["hit_light"]),
    Rule {
        group: Group::Light,
        settings: &["probe_rays"],
        applies: |settings| !settings.is("bounces", "1") || settings.is("unknown", "irradiance"),
    },
    Rule::always(
        Group::Gather,
        &["rays", "specular", "trace_mode", "origin_bias", "unknown"],
    ),
    Rule {
        group: Group::Gather,
        settings: &["thickness"],
        applies: |settings| settings.is("trace_mode", "thickness"),
    },
    Rule {
        group: Group::Gather,
        settings: &["mirror_rays"],
        applies: |settings| !settings.is("specular", "off") && !settings.is("specular", "cones"),
    },
    Rule {
        group: Group::Light,
        settings: &[STORE.name, SOURCE_RESOLUTION.name],
        applies: |settings| settings.is("specular", "cones"),
    },
    PARALLAX_RULE,
    Rule::always(Group::Bounces, &["bounces"]),
];

/// Edge of a map of distances for that (texels).
pub(super) const MOMENT_TEXELS: u32 = 16;

/// Which of the settings rays through the field are run with.
#[derive(Clone, Copy)]
pub(super) struct FieldRaySettings {
    pub(super) rays: u32,
    pub(super) has_thickness: bool,
    pub(super) thickness_m: f32,
    pub(super) origin_bias: f32,
    pub(super) unknown_by_rays: bool,
    pub(super) pattern: Pattern,
}

impl FieldRaySettings {
    pub(super) fn new(settings: &Settings) -> Self {
        FieldRaySettings {
            rays: settings.count("rays"),
            has_thickness: settings.is("trace_mode", "thickness"),
            thickness_m: settings.number("thickness"),
            origin_bias: settings.number("origin_bias"),
            unknown_by_rays: settings.is("unknown", "rays"),
            pattern: Pattern::new(settings),
        }
    }
}
