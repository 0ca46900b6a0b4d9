//! Interleaved sampling (Keller & Heidrich 2001; Hong 2015, section 3): each pixel of a tile has
//! directions of its own, then what they bring is averaged over the neighbours on one surface.
//! `oracle` is the CPU twin.

pub mod oracle;

use std::sync::Arc;

use super::surfaces::Limits;
use crate::gi::Settings;
use crate::gi::settings::{Domain, Group, Rule, Setting};
use crate::gpu_struct;
use crate::graph::{Access, Binding, Frame, Image, Pass, Sets, Shaders};
use crate::render::Receivers;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `gi.deinterleave`.
    pub struct DeinterleaveParams {
        /// The window's width and height (px).
        pub window: [u32; 2],
        /// Off a pixel's plane (footprints).
        pub plane_tolerance: f32,
        /// Least cosine of two normals.
        pub normal_cosine: f32,
    }
}

/// Settings of patterns.
pub static SETTINGS: &[Setting] = &[
    Setting {
        name: "interleave",
        help: "n: each pixel of an n×n tile gathers in its own directions, then neighbours on one \
               surface are averaged; 1: off",
        unit: "px",
        domain: Domain::Count { min: 1, max: 8 },
        default: "4",
    },
    Setting {
        name: "interleave_rows",
        help: "m of an n×m tile; 0: as many as columns",
        unit: "px",
        domain: Domain::Count { min: 0, max: 8 },
        default: "0",
    },
    Setting {
        name: "interleave_window",
        help: "mean of the diffuse light over a window as large as a tile; off: history and blur \
               bring the other pixels' directions, and without them each pixel has its own alone",
        unit: "",
        domain: Domain::Choice(&["on", "off"]),
        default: "on",
    },
    Setting {
        name: "interleave_order",
        help: "pixels gather where they are, or split: those with the same place in their tiles \
               beside each other",
        unit: "",
        domain: Domain::Choice(&["picture", "split"]),
        default: "picture",
    },
    Setting {
        name: "interleave_turn",
        help: "whether the directions of each tile are turned by an angle of its own",
        unit: "",
        domain: Domain::Choice(&["on", "off"]),
        default: "on",
    },
];

/// In which group they are, and when they have an effect.
pub const RULES: &[Rule] = &[
    Rule::always(Group::Screen, &["interleave", "interleave_rows"]),
    Rule {
        group: Group::Screen,
        settings: &["interleave_window", "interleave_order", "interleave_turn"],
        applies: |settings| Pattern::new(settings).count() > 1,
    },
];

/// The same of patterns of glossy reflections.
pub const SPECULAR_RULES: &[Rule] = &[Rule {
    group: Group::Screen,
    settings: &["specular_interleave"],
    applies: |settings| !settings.is("specular", "off"),
}];

/// The setting of patterns of glossy reflections.
pub static SPECULAR_SETTINGS: &[Setting] = &[Setting {
    name: "specular_interleave",
    help: "n: each pixel of an n×n tile mirrors about its own half vector of the glossy lobe, then \
           neighbours on one surface are averaged; 1: all by one cone as wide as the lobe, or with \
           paths each pixel by its own half vectors",
    unit: "px",
    domain: Domain::Count { min: 1, max: 8 },
    default: "1",
}];

/// Tiles of pixels that gather in different directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pattern {
    /// Width and height of a tile (px).
    pub size: [u32; 2],
    /// Whether each tile's directions are turned by an angle of its own.
    pub is_turned: bool,
}

impl Pattern {
    /// From a technique's settings; one pixel where it has no patterns.
    pub fn new(settings: &Settings) -> Self {
        let width = settings.find_count("interleave").unwrap_or(1);
        let height = match settings.find_count("interleave_rows") {
            None | Some(0) => width,
            Some(rows) => rows,
        };
        Pattern {
            size: [width, height],
            is_turned: settings.find_choice("interleave_turn") != Some("off"),
        }
    }

    /// Of glossy reflections, from a technique's settings; one pixel where it has no such patterns.
    pub fn specular(settings: &Settings) -> Self {
        Pattern::of([settings.find_count("specular_interleave").unwrap_or(1); 2])
    }

    /// Tiles of this size (px), each turned by an angle of its own.
    pub const fn of(size: [u32; 2]) -> Self {
        Pattern {
            size,
            is_turned: true,
        }
    }

    /// Pixels of a tile.
    pub fn count(self) -> u32 {
        self.size[0] * self.size[1]
    }

    /// Numbers of neighbouring pixels differ by this: the smallest number from .382 of all pixels
    /// on (a golden section) that has no factor in common with them. So a tile has each once.
    pub fn stride(self) -> u32 {
        let count = self.count();
        let first = (0.382 * f64::from(count)).ceil() as u32;
        let is_coprime = |stride: &u32| {
            let (mut a, mut b) = (*stride, count);
            while b > 0 {
                (a, b) = (b, a % b);
            }
            a == 1
        };
        (first..).find(is_coprime).unwrap_or(1)
    }

    /// As shaders read it: width, height and stride, 8 bits each, and whether tiles are turned.
    pub(in crate::gi) fn bits(self) -> u32 {
        let [width, height] = self.size;
        width | height << 8 | self.stride() << 16 | u32::from(self.is_turned) << 24
    }
}

/// Mean over a window around the pixel, on its own surface. Reads the G-buffer and an
/// RGBA32F image, writes an RGBA32F image; a thread a pixel.
pub static DEINTERLEAVE: Pass = Pass {
    name: "gi.deinterleave",
    shaders: Shaders::Compute("gi/shared/interleave/deinterleave.comp"),
    bindings: &[
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::sampled("interleaved", Access::ComputeSampled),
        Binding::image("indirect_diffuse", Access::ComputeWrite),
    ],
    constants: &[],
    params: Some(DeinterleaveParams::LAYOUT),
    sets: Sets::Scene,
};

/// Adds [`DEINTERLEAVE`] to the frame: from what was gathered to `result`, both as large.
pub fn deinterleave(
    frame: &mut Frame,
    gathered: &Receivers<'_>,
    result: &Arc<Image>,
    (pattern, limits): (Pattern, Limits),
) {
    frame
        .pass(&DEINTERLEAVE)
        .bind("view_depth", gathered.view_depth)
        .bind("normals", gathered.normals)
        .bind("interleaved", gathered.light)
        .bind("indirect_diffuse", result)
        .push(&DeinterleaveParams {
            window: pattern.size,
            plane_tolerance: limits.plane_tolerance,
            normal_cosine: limits.normal_cosine,
        })
        .dispatch(gathered.groups());
}
