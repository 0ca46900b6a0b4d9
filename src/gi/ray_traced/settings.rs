//! Settings, presets and rules.

use crate::gi::settings::{Domain, Group, Preset, Rule, Setting, Settings};
use crate::gi::shared::interleave::Pattern;
use crate::gi::shared::paths::{HIT_LIGHT, MIRROR_RAYS, RAYS, SPECULAR};
use crate::gi::shared::screen;

/// The technique's own settings; patterns have theirs.
pub(super) const SETTINGS: &[Setting] = &[
    RAYS,
    SPECULAR,
    MIRROR_RAYS,
    Setting {
        name: "bounces",
        help: "indirect bounces",
        unit: "",
        domain: Domain::Count { min: 1, max: 8 },
        default: "1",
    },
    HIT_LIGHT,
    Setting {
        name: "hit_roughness",
        help: "surfaces that the rays of a diffuse one hit are at least as rough: less noise of \
               what mirrors a lamp, and wider spots of its light",
        unit: "",
        domain: Domain::Number { min: 0.0, max: 1.0 },
        default: "0",
    },
    Setting {
        name: "cache",
        help: "what the last place of a path reflects of the lights: none (they are asked, as \
               hit_light says) or voxels (what the voxel there has of them, diffusely)",
        unit: "",
        domain: Domain::Choice(&["none", "voxels"]),
        default: "none",
    },
    Setting {
        name: "cache_resolution",
        help: "voxels of the cache along the largest extent of the scene",
        unit: "voxels",
        domain: Domain::OneOf(&[8, 16, 32, 64, 128, 256, 512]),
        default: "256",
    },
];

/// The presets.
pub(super) const PRESETS: &[Preset] = &[
    Preset {
        name: "default",
        help: "16 rays a pixel, and means over tiles of pixels; shadow rays at what they hit",
        values: &[],
    },
    Preset {
        name: "fast",
        help: "one ray a pixel and shadow maps, with the light of earlier frames and of \
               neighbours",
        values: &[
            &[
                ("rays", "1"),
                ("mirror_rays", "1"),
                ("hit_light", "maps"),
                ("interleave_window", "off"),
            ],
            screen::settings::FAST,
        ],
    },
    Preset {
        name: "cached",
        help: "as default, but the last place of a path has the light of the voxel there",
        values: &[&[("cache", "voxels")]],
    },
    Preset {
        name: "accurate",
        help: "64 rays a pixel",
        values: &[&[("rays", "64"), ("mirror_rays", "64")]],
    },
];

/// In which group settings are, and when they have an effect.
pub(super) const RULES: &[Rule] = &[
    Rule::always(Group::Light, &["hit_light", "hit_roughness", "cache"]),
    Rule {
        group: Group::Light,
        settings: &["cache_resolution"],
        applies: |settings| settings.is("cache", "voxels"),
    },
    Rule::always(Group::Gather, &["rays", "specular"]),
    Rule {
        group: Group::Gather,
        settings: &["mirror_rays"],
        applies: |settings| settings.is("specular", "on"),
    },
    Rule::always(Group::Bounces, &["bounces"]),
];

/// Which of the settings passes are run with.
#[derive(Clone, Copy)]
pub(super) struct RaySettings {
    pub(super) rays: u32,
    pub(super) bounces: u32,
    pub(super) hit_roughness: f32,
    pub(super) uses_maps: bool,
    /// Voxels of the cache along the largest extent of the scene; none: there is no cache.
    pub(super) cache_resolution: Option<u32>,
    pub(super) pattern: Pattern,
}

impl RaySettings {
    pub(super) fn new(settings: &Settings) -> Self {
        RaySettings {
            rays: settings.count("rays"),
            bounces: settings.count("bounces"),
            hit_roughness: settings.number("hit_roughness"),
            uses_maps: settings.is("hit_light", "maps"),
            cache_resolution: settings
                .is("cache", "voxels")
                .then(|| settings.count("cache_resolution")),
            pattern: Pattern::new(settings),
        }
    }
}
