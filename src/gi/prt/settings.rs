//! Settings, presets and rules.

use super::compress::CompressSettings;
use super::lattice::{LatticeSettings, Refine};
use super::lobes::{LobeSettings, Projection};
use super::transfer::{Sampling, TransferSettings};
use crate::gi::settings::{Domain, Group, Preset, Rule, Setting, Settings};
use crate::render::GpuScene;

/// The technique's settings.
pub(super) const SETTINGS: &[Setting] = &[
    Setting {
        name: "order",
        help: "bands of spherical harmonics that the environment is kept in: 4 hold a sky, 8 a \
               light that is 30° wide",
        unit: "",
        domain: Domain::Count { min: 2, max: 10 },
        default: "6",
    },
    Setting {
        name: "cells",
        help: "cells of the lattice of points along the largest extent of the scene",
        unit: "",
        domain: Domain::Count { min: 1, max: 1024 },
        default: "16",
    },
    Setting {
        name: "inset",
        help: "how far points move from the border of a surface towards the middle of their cells; \
               at 0, as published, corners of a room see outside",
        unit: "",
        domain: Domain::Number { min: 0.0, max: 0.9 },
        default: "0.1",
    },
    Setting {
        name: "refine",
        help: "times that a triangle's cells are halved where the light of the sky differs in them",
        unit: "",
        domain: Domain::Count { min: 0, max: 3 },
        default: "0",
    },
    Setting {
        name: "refine_difference",
        help: "the largest difference in a triangle's cells (root mean square), as part of what a \
               surface in the open gets",
        unit: "",
        domain: Domain::Number {
            min: 0.01,
            max: 1.0,
        },
        default: "0.1",
    },
    Setting {
        name: "invalid_share",
        help: "a point of whose rays a larger share ends on back faces, and that sees neither sky \
               nor open places, takes what its neighbours have; 1 keeps all",
        unit: "",
        domain: Domain::Number {
            min: 0.05,
            max: 1.0,
        },
        default: "0.25",
    },
    Setting {
        name: "transfer_rays",
        help: "rays of a point, in each round of the build",
        unit: "",
        domain: Domain::Count { min: 64, max: 8192 },
        default: "512",
    },
    Setting {
        name: "sampling",
        help: "where they go: cosine (a spiral that each point turns) or sphere (in strata, the \
               same for all points, as published)",
        unit: "",
        domain: Domain::Choice(&["cosine", "sphere"]),
        default: "cosine",
    },
    Setting {
        name: "sides",
        help: "auto (backs of triangles have points where something is seen from there) or front",
        unit: "",
        domain: Domain::Choice(&["auto", "front"]),
        default: "auto",
    },
    Setting {
        name: "points_max",
        help: "more points are an error",
        unit: "",
        domain: Domain::Count {
            min: 1_000,
            max: 100_000_000,
        },
        default: "2000000",
    },
    Setting {
        name: "dynamic",
        help: "models that may move: error, or freeze (where they stand at first)",
        unit: "",
        domain: Domain::Choice(&["error", "freeze"]),
        default: "error",
    },
    Setting {
        name: "lights",
        help: "emission and analytic lights: bake (a column each) or ignore (as published)",
        unit: "",
        domain: Domain::Choice(&["bake", "ignore"]),
        default: "bake",
    },
    Setting {
        name: "fit",
        help: "what is kept of a sky: seen (its first bands, and what those above bring surfaces \
               where they look) or sphere (its first bands alone, as published)",
        unit: "",
        domain: Domain::Choice(&["seen", "sphere"]),
        default: "seen",
    },
    Setting {
        name: "window",
        help: "what damps high bands: none, hann or lanczos; every window makes errors larger or \
               no smaller",
        unit: "",
        domain: Domain::Choice(&["none", "hann", "lanczos"]),
        default: "none",
    },
    Setting {
        name: "window_width",
        help: "bands until the window is closed",
        unit: "",
        domain: Domain::Number {
            min: 2.0,
            max: 64.0,
        },
        default: "12",
    },
    Setting {
        name: "negative",
        help: "irradiance below 0, where bands ring: clamp or keep",
        unit: "",
        domain: Domain::Choice(&["clamp", "keep"]),
        default: "clamp",
    },
    Setting {
        name: "transfer",
        help: "vector (irradiance alone) or matrix (also which light comes from where, for glossy \
               surfaces of roughness 0.5 and more, and for normal maps)",
        unit: "",
        domain: Domain::Choice(&["vector", "matrix"]),
        default: "vector",
    },
    Setting {
        name: "out_order",
        help: "bands of spherical harmonics of where light comes from, with transfer=matrix",
        unit: "",
        domain: Domain::Count { min: 3, max: 6 },
        default: "5",
    },
    Setting {
        name: "projection",
        help: "with transfer=matrix: hemisphere (least squares above the surface, by the cosine) \
               or plain (as if below it all were dark)",
        unit: "",
        domain: Domain::Choice(&["hemisphere", "plain"]),
        default: "hemisphere",
    },
    Setting {
        name: "compress",
        help: "how harmonics are kept: none (all of each point), vq (the mean of a cluster of \
               points), pca (a few vectors of all points) or cpca (a few vectors of each cluster)",
        unit: "",
        domain: Domain::Choice(&["none", "vq", "pca", "cpca"]),
        default: "none",
    },
    Setting {
        name: "clusters",
        help: "clusters of points, with vq and cpca",
        unit: "",
        domain: Domain::Count { min: 1, max: 256 },
        default: "64",
    },
    Setting {
        name: "basis",
        help: "vectors of a cluster beside its mean, with pca and cpca: 2 bytes a point each",
        unit: "",
        domain: Domain::Count { min: 1, max: 32 },
        default: "8",
    },
    Setting {
        name: "bounces",
        help: "times that light is reflected, the last time towards the camera",
        unit: "",
        domain: Domain::Count { min: 1, max: 8 },
        default: "3",
    },
];

/// The presets.
pub(super) const PRESETS: &[Preset] = &[
    Preset {
        name: "balanced",
        help: "order 6, 16 cells, three bounces",
        values: &[],
    },
    Preset {
        name: "fast",
        help: "order 4, 8 cells, half of the rays: built in a moment",
        values: &[&[
            ("order", "4"),
            ("cells", "8"),
            ("transfer_rays", "256"),
            ("bounces", "2"),
        ]],
    },
    Preset {
        name: "accurate",
        help: "order 8, 32 cells, halved where light differs",
        values: &[&[("order", "8"), ("cells", "32"), ("refine", "1")]],
    },
    Preset {
        name: "textbook",
        help: "as published: points at corners, one set of rays over the sphere, the environment \
               alone",
        values: &[&[
            ("order", "5"),
            ("cells", "8"),
            ("inset", "0"),
            ("invalid_share", "1"),
            ("transfer_rays", "1024"),
            ("sampling", "sphere"),
            ("bounces", "2"),
            ("lights", "ignore"),
            ("fit", "sphere"),
            ("negative", "keep"),
            ("sides", "front"),
        ]],
    },
    Preset {
        name: "compressed",
        help: "as accurate, in a tenth of the memory",
        values: &[&[
            ("order", "8"),
            ("cells", "32"),
            ("refine", "1"),
            ("compress", "cpca"),
        ]],
    },
    Preset {
        name: "glossy",
        help: "as balanced, with rough mirrors and normal maps",
        values: &[&[("transfer", "matrix"), ("compress", "cpca")]],
    },
];

/// In which group settings are, and when they have an effect.
pub(super) const RULES: &[Rule] = &[
    Rule::always(
        Group::Structure,
        &[
            "cells",
            "inset",
            "refine",
            "invalid_share",
            "sides",
            "points_max",
            "dynamic",
            "compress",
        ],
    ),
    Rule {
        group: Group::Structure,
        settings: &["refine_difference"],
        applies: |settings| settings.count("refine") > 0,
    },
    Rule {
        group: Group::Structure,
        settings: &["clusters"],
        applies: |settings| settings.is("compress", "vq") || settings.is("compress", "cpca"),
    },
    Rule {
        group: Group::Structure,
        settings: &["basis"],
        applies: |settings| settings.is("compress", "pca") || settings.is("compress", "cpca"),
    },
    Rule::always(
        Group::Light,
        &[
            "order",
            "transfer_rays",
            "sampling",
            "lights",
            "fit",
            "window",
            "transfer",
        ],
    ),
    Rule {
        group: Group::Light,
        settings: &["out_order", "projection"],
        applies: |settings| settings.is("transfer", "matrix"),
    },
    Rule {
        group: Group::Light,
        settings: &["window_width"],
        applies: |settings| !settings.is("window", "none"),
    },
    Rule::always(Group::Gather, &["negative"]),
    Rule::always(Group::Bounces, &["bounces"]),
];

/// How transfer is worked out, in a scene.
pub fn transfer_settings(settings: &Settings, scene: &GpuScene) -> TransferSettings {
    let (low, high) = scene.bounds;
    let extent_m = (high - low).max_element().max(1e-6);
    TransferSettings {
        lattice: LatticeSettings {
            cell_m: extent_m / settings.count("cells") as f32,
            inset: settings.number("inset"),
            refine: Refine {
                levels: settings.count("refine"),
                difference: settings.number("refine_difference"),
                most_nodes: settings.count("points_max").into(),
            },
        },
        order: settings.count("order"),
        rays: settings.count("transfer_rays"),
        sampling: match settings.choice("sampling") {
            "sphere" => Sampling::Sphere,
            _ => Sampling::Cosine,
        },
        bounces: settings.count("bounces"),
        has_backs: settings.is("sides", "auto"),
        invalid_share: settings.number("invalid_share"),
        has_lights: settings.is("lights", "bake"),
        compress: match settings.choice("compress") {
            "vq" => Some((settings.count("clusters"), 0)),
            "pca" => Some((1, settings.count("basis"))),
            "cpca" => Some((settings.count("clusters"), settings.count("basis"))),
            _ => None,
        }
        .map(|(clusters, vectors)| CompressSettings { clusters, vectors }),
        // Radiance is kept for those alone that look at it.
        lobes: (settings.is("transfer", "matrix") && (scene.is_glossy || scene.has_bumps())).then(
            || LobeSettings {
                order: settings.count("out_order"),
                projection: match settings.choice("projection") {
                    "plain" => Projection::Plain,
                    _ => Projection::Hemisphere,
                },
            },
        ),
    }
}
