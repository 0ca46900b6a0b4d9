//! Every pass there is: the library's, as each module lists them, and the tests' own.

use lumivox::gi::probes::passes::LookupRow;
use lumivox::gi::registry::TECHNIQUES;
use lumivox::gi::shared::screen;
use lumivox::gpu_struct;
use lumivox::graph::pass::{Binding, Pass, RasterState, Sets, Shaders, join};
use lumivox::graph::{Access, vk};
use lumivox::render::{self, bvh};
use lumivox::shader::{Field, GpuStruct, StructLayout};

/// All passes. A module that declares passes adds its list here.
pub fn all_passes() -> Vec<&'static Pass> {
    let techniques = TECHNIQUES
        .iter()
        .flat_map(|entry| entry.passes.iter().copied().flatten().copied());
    let mut all: Vec<&'static Pass> = Vec::new();
    for pass in TEST_PASSES
        .iter()
        .copied()
        .chain(render::PASSES.iter().copied())
        .chain(screen::PASSES.iter().copied())
        .chain(techniques)
    {
        if !all.iter().any(|known| std::ptr::eq(*known, pass)) {
            all.push(pass);
        }
    }
    all
}

/// Every struct that Rust and GLSL share, by name, but for the parameters of passes.
pub fn all_structs() -> Vec<StructLayout> {
    let techniques = TECHNIQUES
        .iter()
        .flat_map(|entry| entry.structs.iter().copied().flatten().copied());
    let mut all: Vec<StructLayout> = Vec::new();
    for (name, fields) in render::STRUCTS.iter().copied().chain(techniques) {
        if !all.iter().any(|(known, _)| *known == name) {
            all.push((name, fields));
        }
    }
    all
}

gpu_struct! {
    /// Parameters of `test.color`.
    pub struct ColorParams {
        /// Colour to draw.
        pub color: [f32; 4],
    }
}

gpu_struct! {
    /// Parameters of `test.field_rays`.
    pub struct FieldRayParams {
        /// Of the probes; what of it counts is the columns and the smallest spacing.
        pub lookup: LookupRow,
        /// The greatest thickness of surfaces (m).
        pub thickness_m: f32,
        /// Number of rays.
        pub count: u32,
    }
}

/// A word, the parameters of passes of the tests.
const fn word(name: &'static str) -> Field {
    Field {
        name,
        offset: 0,
        size: 4,
    }
}

/// The same at an offset (bytes).
const fn word_at(name: &'static str, offset: usize) -> Field {
    Field {
        offset,
        ..word(name)
    }
}

/// The passes of the tests.
pub const TEST_PASSES: &[&Pass] = &[
    &DOUBLE,
    &COPY,
    &STORE,
    &SAMPLE,
    &COUNT,
    &COLOR,
    &MATERIAL,
    &HARMONICS,
    &ANSWER,
    &RAYS,
    &FIELD_RAYS,
];

/// values[i] = 2 values[i] + 1.
pub static DOUBLE: Pass = Pass {
    name: "test.double",
    shaders: Shaders::Compute("test/double.comp"),
    bindings: &[Binding::buffer("values", Access::ComputeReadWrite)],
    constants: &["WORKGROUP"],
    params: Some(("Params", &[word("count")])),
    sets: Sets::None,
};

/// target[i] = source[i].
pub static COPY: Pass = Pass {
    name: "test.copy",
    shaders: Shaders::Compute("test/copy.comp"),
    bindings: &[
        Binding::buffer("source", Access::ComputeRead),
        Binding::buffer("target", Access::ComputeWrite),
    ],
    constants: &[],
    params: Some(("Params", &[word("count")])),
    sets: Sets::None,
};

/// A ramp along x.
pub static STORE: Pass = Pass {
    name: "test.store3d",
    shaders: Shaders::Compute("test/store3d.comp"),
    bindings: &[Binding::image("volume", Access::ComputeWrite)],
    constants: &[],
    params: None,
    sets: Sets::None,
};

/// The centre of a volume at every mip.
pub static SAMPLE: Pass = Pass {
    name: "test.sample3d",
    shaders: Shaders::Compute("test/sample3d.comp"),
    bindings: &[
        Binding::sampled("volume", Access::ComputeSampled),
        Binding::buffer("target", Access::ComputeWrite),
    ],
    constants: &[],
    params: None,
    sets: Sets::Scene,
};

/// Counts fragments through a geometry shader, without attachments.
pub static COUNT: Pass = Pass {
    name: "test.count",
    shaders: Shaders::Raster {
        vertex: "test/quad.vert",
        geometry: Some("test/through.geom"),
        fragment: Some("test/count.frag"),
        state: RasterState::NO_TARGETS,
    },
    bindings: &[Binding::image("counts", Access::RasterReadWrite)],
    constants: &[],
    params: None,
    sets: Sets::None,
};

/// One colour.
pub static COLOR: Pass = Pass {
    name: "test.color",
    shaders: Shaders::Raster {
        vertex: "test/quad.vert",
        geometry: None,
        fragment: Some("test/color.frag"),
        state: RasterState {
            color: &[vk::Format::R32G32B32A32_SFLOAT],
            depth: Some(vk::Format::D32_SFLOAT),
            ..RasterState::NO_TARGETS
        },
    },
    bindings: &[],
    constants: &[],
    params: Some(ColorParams::LAYOUT),
    sets: Sets::None,
};

/// The albedo of one material.
pub static MATERIAL: Pass = Pass {
    name: "test.material",
    shaders: Shaders::Compute("test/material.comp"),
    bindings: &[Binding::buffer("target", Access::ComputeWrite)],
    constants: &[],
    params: Some(("Params", &[word("index")])),
    sets: Sets::SceneAndMaterials,
};

/// Every function of `gi/shared/sh.glsl`; a thread a case.
pub static HARMONICS: Pass = Pass {
    name: "test.sh",
    shaders: Shaders::Compute("test/sh.comp"),
    bindings: &[
        Binding::buffer("cases", Access::ComputeRead),
        Binding::buffer("results", Access::ComputeWrite),
    ],
    constants: &[],
    params: Some(("Params", &[word("count")])),
    sets: Sets::None,
};

/// The answer of each surface's pixel.
pub static ANSWER: Pass = Pass {
    name: "given.answer",
    shaders: Shaders::Compute("test/given.comp"),
    bindings: &[
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("given", Access::ComputeSampled),
        Binding::image("indirect_diffuse", Access::ComputeWrite),
    ],
    constants: &[],
    params: None,
    sets: Sets::Scene,
};

/// What rays meet; a thread a ray.
pub static RAYS: Pass = Pass {
    name: "test.rays",
    shaders: Shaders::Compute("test/rays.comp"),
    bindings: &join::<_, 5, 2, 7>(
        bvh::BINDINGS,
        [
            Binding::buffer("rays", Access::ComputeRead),
            Binding::buffer("hits", Access::ComputeWrite),
        ],
    ),
    constants: &bvh::CONSTANTS,
    params: Some(("Params", &[word("count"), word_at("any", 4)])),
    sets: Sets::Scene,
};

/// How rays end in the maps of a light field; a thread a ray.
pub static FIELD_RAYS: Pass = Pass {
    name: "test.field_rays",
    shaders: Shaders::Compute("test/field_rays.comp"),
    bindings: &[
        Binding::buffer("field_rays", Access::ComputeRead),
        Binding::buffer("ends", Access::ComputeWrite),
        Binding::sampled("field_surfaces", Access::ComputeSampled),
        Binding::sampled("field_radiance", Access::ComputeSampled),
    ],
    constants: &["FIELD_TEXELS", "THICKNESS_TRACE"],
    params: Some(FieldRayParams::LAYOUT),
    sets: Sets::Scene,
};
