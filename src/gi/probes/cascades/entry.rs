//! The row of the registry.

use super::make;
use super::passes::{BOUNCE, GATHER, LIGHT_FIELD, MIRROR, NEED, PLACE, VIEW};
use super::settings::{PRESETS, RULES, SETTINGS};
use crate::gi::CAST;
use crate::gi::entry::{Directions, Entry, Stage};
use crate::gi::probes::borrowed::{AIM, MOMENTS_CAST, TAKE};
use crate::gi::probes::field;
use crate::gi::probes::mirror::SPECULAR_RULES;
use crate::gi::probes::passes::{
    BLEND, BLEND_SH, LIGHT, MOMENTS, MOMENTS_POWER, STRUCTS, SURFACES, TRACE,
};
use crate::gi::probes::prefiltered::{PREFILTER, REFLECT};
use crate::gi::probes::reflection::{REFLECTION_RULES, REFLECTION_SETTINGS};
use crate::gi::probes::settings::{KEPT_SETTINGS, LOOKUP_SETTINGS};
use crate::gi::probes::view::LEVEL_VIEWS;
use crate::gi::shared::bounces::LightBounces;
use crate::gi::shared::interleave;
use crate::gi::shared::paths;

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    bounces: |settings| LightBounces::new(settings).count(),
    settings: &[
        SETTINGS,
        KEPT_SETTINGS,
        LOOKUP_SETTINGS,
        REFLECTION_SETTINGS,
        interleave::SPECULAR_SETTINGS,
    ],
    rules: &[
        RULES,
        SPECULAR_RULES,
        REFLECTION_RULES,
        interleave::SPECULAR_RULES,
    ],
    presets: PRESETS,
    borrows: true,
    passes: &[&[
        &NEED,
        &PLACE,
        &TRACE,
        &SURFACES,
        &MOMENTS,
        &MOMENTS_POWER,
        &LIGHT,
        &BOUNCE,
        &BLEND,
        &BLEND_SH,
        &AIM,
        &TAKE,
        &MOMENTS_CAST,
        &GATHER,
        &field::TRACE,
        &LIGHT_FIELD,
        &PREFILTER,
        &REFLECT,
        &MIRROR,
        &VIEW,
    ]],
    views: &[&LEVEL_VIEWS],
    structs: &[paths::STRUCTS, STRUCTS],
    stages: &[
        &Stage::store("hierarchy", paths::HOST_PASSES),
        &Stage::store("casting", &["probes.aim", CAST, "probes.take"]),
        &Stage::store("placement", &["cascades.need", "cascades.place"]),
        &Stage::store(
            "tracing",
            &[
                "probes.trace",
                "probes.surfaces",
                "probes.moments",
                "probes.moments_power",
                "probes.moments_cast",
                "light_field.trace",
            ],
        ),
        &Stage::store(
            "lighting",
            &[
                "probes.light",
                "probes.blend",
                "probes.blend_sh",
                "cascades.light_field",
                "light_field.prefilter",
            ],
        ),
        &Stage::store("bounces", &["cascades.bounce"]),
        &Stage::picture("gather", &["probes.clear", "cascades.gather"]),
        &Stage::picture("specular", &["light_field.reflect", "cascades.mirror"]),
    ],
    directions: &[Directions {
        pass: &MIRROR,
        count: None,
    }],
    ..Entry::new(
        "probe-cascades",
        "nested lattices of probes around the camera, as many as surfaces need",
        make,
    )
};
