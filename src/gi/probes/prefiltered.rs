//! Reflections by probes: light that is averaged over lobes beforehand, and looked up from where
//! each probe shows what a surface mirrors (Lagarde & Zanuttini 2012; Karis 2013; Luo 2022, section
//! 4.1).

use std::sync::Arc;

use super::field::{Field, LOOKUP};
use super::passes::LookupRow;
use super::volume::{Volume, store_image};
use crate::gi::settings::{Domain, Group, Rule, Setting, Settings};
use crate::gi::shared::split_sum;
use crate::gpu_struct;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Error, Frame, Gpu, Image, Pass, Sets, Shaders, vk};
use crate::render::bvh::{self, SceneRays};
use crate::render::{GBuffer, GpuScene, screen_groups};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `light_field.prefilter`.
    pub struct PrefilterParams {
        /// Edge of a map of radiance (texels).
        pub edge: u32,
        /// Maps beside each other in the images.
        pub columns: u32,
        /// And below each other.
        pub rows: u32,
        /// Number of probes.
        pub probe_count: u32,
        /// Which level, from 1 on (`gi/probes/prefiltered.glsl`).
        pub level: u32,
        /// Directions that a texel is averaged over.
        pub sample_count: u32,
        /// Of the lobe.
        pub roughness: f32,
    }
}

gpu_struct! {
    /// Parameters of `light_field.reflect`.
    pub struct ReflectParams {
        /// How places look probes up.
        pub lookup: LookupRow,
        /// xyz: smallest corner of the box that reflections are shifted in (m).
        pub low: [f32; 4],
        /// xyz: largest.
        pub high: [f32; 4],
        /// Maps below each other.
        pub rows: u32,
        /// [`Parallax`].
        pub parallax: u32,
    }
}

/// From where probes show what is mirrored.
pub(super) const PARALLAX: Setting = Setting {
    name: "parallax",
    help: "where a probe's light is looked up: distance, where a ray meets what is mirrored, box, \
           where one leaves the scene's bounds, or none, straight along the ray",
    unit: "",
    domain: Domain::Choice(&["distance", "box", "none"]),
    default: "distance",
};

/// When it has an effect.
pub(super) const PARALLAX_RULE: Rule = Rule {
    group: Group::Gather,
    settings: &[PARALLAX.name],
    applies: |settings| settings.is("specular", "prefiltered"),
};

/// Light of one level, averaged. Reads and writes R32UI; a thread a texel.
pub static PREFILTER: Pass = Pass {
    name: "light_field.prefilter",
    shaders: Shaders::Compute("gi/probes/prefilter.comp"),
    bindings: &[
        Binding::sampled("field_radiance", Access::ComputeSampled),
        Binding::image("field_prefiltered", Access::ComputeWrite),
    ],
    constants: &[],
    params: Some(PrefilterParams::LAYOUT),
    sets: Sets::Scene,
};

/// Light that glossy surfaces mirror, by the split sum. Reads the G-buffer and maps, writes
/// RGBA32F; a thread a pixel.
pub static REFLECT: Pass = Pass {
    name: "light_field.reflect",
    shaders: Shaders::Compute("gi/probes/reflect.comp"),
    bindings: &join::<_, 5, 9, 14>(
        bvh::BINDINGS,
        [
            Binding::sampled("view_depth", Access::ComputeSampled),
            Binding::sampled("normals", Access::ComputeSampled),
            Binding::sampled("specular", Access::ComputeSampled),
            Binding::image("indirect_specular", Access::ComputeWrite),
            Binding::buffer("probe_places", Access::ComputeRead),
            Binding::sampled("field_surfaces", Access::ComputeSampled),
            Binding::sampled("field_radiance", Access::ComputeSampled),
            Binding::sampled("field_prefiltered", Access::ComputeSampled),
            Binding::sampled("split_sum", Access::ComputeSampled),
        ],
    ),
    constants: &join::<_, 3, 1, 4>(bvh::CONSTANTS, ["FIELD_TEXELS"]),
    params: Some(ReflectParams::LAYOUT),
    sets: Sets::Scene,
};

/// What light is averaged over, from the first level below the radiance on
/// (`gi/probes/prefiltered.glsl`).
const LEVELS: [Level; 3] = [
    Level {
        roughness: 0.175,
        sample_count: 32,
    },
    Level {
        roughness: 0.35,
        sample_count: 64,
    },
    Level {
        roughness: 1.0,
        sample_count: 256,
    },
];

struct Level {
    /// Of the lobe; the last has all directions in front of a surface.
    roughness: f32,
    /// Directions that a texel is averaged over, so many that none of the radiance's falls between
    /// them.
    sample_count: u32,
}

/// Edge of the last level's maps (texels).
const ALL_SIDES_TEXELS: u32 = 8;

fn edge_of_level(level: u32, edge: u32) -> u32 {
    if level as usize == LEVELS.len() {
        ALL_SIDES_TEXELS
    } else {
        edge >> level
    }
}

/// From where probes show what is mirrored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parallax {
    /// Straight along the ray, as if that were far off.
    None = 0,
    /// Where a ray leaves the bounds of the scene.
    Box = 1,
    /// Where a ray meets a surface.
    Distance = 2,
}

/// What reflections of probes are looked up in.
pub struct Prefiltered {
    /// R32UI: all levels, with an exponent that the channels share.
    pub levels: Arc<Image>,
    split_sum: Arc<Image>,
    parallax: Parallax,
}

impl Parallax {
    /// As the settings say; none where nothing is averaged beforehand.
    pub(super) fn new(settings: &Settings) -> Option<Self> {
        if !settings.is("specular", "prefiltered") {
            None
        } else if settings.is(PARALLAX.name, "box") {
            Some(Parallax::Box)
        } else if settings.is(PARALLAX.name, "none") {
            Some(Parallax::None)
        } else {
            Some(Parallax::Distance)
        }
    }
}

impl Prefiltered {
    /// Makes room for these light fields.
    pub fn new(gpu: &Gpu, field: &Field, parallax: Parallax) -> Result<Self, Error> {
        let [columns, rows] = field.layout();
        let [half_rough, rough, all_sides] =
            [1, 2, 3].map(|level| edge_of_level(level, field.edge));
        // The first level, and below it the others beside each other.
        let size = [
            columns * half_rough.max(rough + all_sides),
            rows * (half_rough + rough.max(all_sides)),
        ];
        Ok(Prefiltered {
            levels: store_image(gpu, "light_field.prefiltered", size, vk::Format::R32_UINT)?,
            split_sum: split_sum::table(gpu)?,
            parallax,
        })
    }

    /// Adds [`PREFILTER`] for each level, of fields whose light is there.
    pub fn filter(&self, frame: &mut Frame, field: &Field) {
        let [columns, rows] = field.layout();
        for (
            level,
            Level {
                roughness,
                sample_count,
            },
        ) in (1..).zip(&LEVELS)
        {
            let edge = edge_of_level(level, field.edge);
            frame
                .pass(&PREFILTER)
                .bind("field_radiance", &field.radiance)
                .bind("field_prefiltered", &self.levels)
                .push(&PrefilterParams {
                    edge: field.edge,
                    columns,
                    rows,
                    probe_count: field.probe_count,
                    level,
                    sample_count: *sample_count,
                    roughness: *roughness,
                })
                .dispatch([(columns * edge).div_ceil(8), (rows * edge).div_ceil(8), 1]);
        }
    }

    /// Adds [`REFLECT`]: writes all of `light`, with 1 in alpha where rays are to mirror.
    pub fn reflect(
        &self,
        frame: &mut Frame,
        (scene, triangles): (&GpuScene, &SceneRays),
        (volume, field): (&Volume, &Field),
        (gbuffer, specular, light): (&GBuffer, &Arc<Image>, &Arc<Image>),
    ) {
        let (low, high) = scene.lit_bounds();
        triangles
            .bind(frame.pass(&REFLECT))
            .bind("view_depth", &gbuffer.view_depth)
            .bind("normals", &gbuffer.normals)
            .bind("specular", specular)
            .bind("indirect_specular", light)
            .bind("probe_places", &volume.places)
            .bind("field_surfaces", &field.surfaces)
            .bind("field_radiance", &field.radiance)
            .bind("field_prefiltered", &self.levels)
            .bind("split_sum", &self.split_sum)
            .constant("FIELD_TEXELS", field.edge)
            .push(&ReflectParams {
                lookup: LOOKUP.row(volume),
                low: low.extend(0.0).to_array(),
                high: high.extend(0.0).to_array(),
                rows: field.layout()[1],
                parallax: self.parallax as u32,
            })
            .dispatch(screen_groups(gbuffer.size));
    }
}
