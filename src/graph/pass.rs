//! What a pass is, declared as data beside the technique that it belongs to.

use ash::vk;

use super::Access;
use crate::shader::StructLayout;

/// Numbers and names of the specialization constants that passes have besides those which they
/// declare. They say what the frame's scene has: an environment by direction (`shared/sky.glsl`),
/// cascades of a light (`shared/light_view.glsl`), textures of any kind, textures of a specular
/// lobe (`render/bvh/textures.glsl`), and shadows of what is clear (`shared/clear_shadow.glsl`).
pub const SCENE_CONSTANTS: [(u32, &str); 5] = [
    (64, "SKY"),
    (65, "CASCADES"),
    (66, "TEXTURED_SCENE"),
    (67, "LOBE_TEXTURES"),
    (68, "CLEAR_SHADOWS"),
];

/// One pass: its name, shaders, bindings (set 1) and parameters. The same name is its label, timer
/// and column in reports.
#[derive(Debug)]
pub struct Pass {
    /// Name, for example `voxel.fragments`.
    pub name: &'static str,
    /// Shaders by stem.
    pub shaders: Shaders,
    /// Bindings of set 1: binding 0, 1, 2, …
    pub bindings: &'static [Binding],
    /// Names of the specialization constants 0, 1, 2, …, the same as in the shaders; empty where
    /// they have none.
    pub constants: &'static [&'static str],
    /// Its parameters, the push constants; at most 128 bytes.
    pub params: Option<StructLayout>,
    /// Which of the shared sets it uses.
    pub sets: Sets,
}

/// The shared descriptor sets that a pass uses besides its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sets {
    /// No shared set, only the pass's own.
    None,
    /// Set 0: frame constants, samplers, scene buffers.
    Scene,
    /// Set 0, and set 2: the textures of one material, changed between the draws or dispatches of
    /// the pass.
    SceneAndMaterials,
}

/// The shaders of a pass, by stem.
#[derive(Debug)]
pub enum Shaders {
    /// A compute shader.
    Compute(&'static str),
    /// Vertex, optional geometry, optional fragment shader.
    Raster {
        /// Stem of the vertex shader.
        vertex: &'static str,
        /// Stem of the geometry shader; needs the optional feature.
        geometry: Option<&'static str>,
        /// Stem of the fragment shader.
        fragment: Option<&'static str>,
        /// Fixed-function state.
        state: RasterState,
    },
}

/// Fixed-function state of a raster pass. Front faces are counter-clockwise; viewport and scissor
/// cover the targets.
#[derive(Debug)]
pub struct RasterState {
    /// Formats of the colour attachments.
    pub color: &'static [vk::Format],
    /// Format of the depth attachment, which is then tested and written.
    pub depth: Option<vk::Format>,
    /// Depth comparison.
    pub depth_compare: vk::CompareOp,
    /// Depth bias, for shadow maps.
    pub depth_bias: Option<DepthBias>,
    /// Faces that are not drawn: none, front, back.
    pub cull: vk::CullModeFlags,
    /// Overestimating conservative rasterization; needs the optional feature.
    pub conservative: bool,
}

impl RasterState {
    /// No attachments, no culling: a pass that only writes storage.
    pub const NO_TARGETS: Self = RasterState {
        color: &[],
        depth: None,
        depth_compare: vk::CompareOp::LESS,
        depth_bias: None,
        cull: vk::CullModeFlags::NONE,
        conservative: false,
    };
}

/// Depth bias of a raster pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthBias {
    /// Constant part (smallest depth steps).
    pub constant: f32,
    /// Part that grows with the slope.
    pub slope: f32,
}

/// What a binding shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingKind {
    /// A storage buffer.
    Buffer,
    /// A storage image, one mip.
    Image,
    /// A sampled image (`texture2D`, `texture3D`, …, with a sampler of set 0).
    Sampled,
    /// What rays go through: a sampled image of nodes or an acceleration structure. The pass runs
    /// a variant of its shader with the latter ([`query_stem`]).
    Rays,
}

/// One binding of set 1.
#[derive(Clone, Copy, Debug)]
pub struct Binding {
    /// Name, the same as in the shader.
    pub name: &'static str,
    /// Whether it is a buffer, a storage image or a sampled image.
    pub kind: BindingKind,
    /// How the pass uses it.
    pub access: Access,
}

/// The bindings, or the constants, of a pass in two parts.
pub const fn join<T: Copy, const A: usize, const B: usize, const ALL: usize>(
    first: [T; A],
    second: [T; B],
) -> [T; ALL] {
    assert!(A + B == ALL && A > 0);
    let mut joined = [first[0]; ALL];
    let mut i = 1;
    while i < ALL {
        joined[i] = if i < A { first[i] } else { second[i - A] };
        i += 1;
    }
    joined
}

impl Binding {
    /// A storage buffer.
    pub const fn buffer(name: &'static str, access: Access) -> Self {
        Binding {
            name,
            kind: BindingKind::Buffer,
            access,
        }
    }

    /// A storage image.
    pub const fn image(name: &'static str, access: Access) -> Self {
        Binding {
            name,
            kind: BindingKind::Image,
            access,
        }
    }

    /// A sampled image.
    pub const fn sampled(name: &'static str, access: Access) -> Self {
        Binding {
            name,
            kind: BindingKind::Sampled,
            access,
        }
    }

    /// What rays of a compute shader go through.
    pub const fn rays(name: &'static str) -> Self {
        Binding {
            name,
            kind: BindingKind::Rays,
            access: Access::ComputeSampled,
        }
    }

    /// With `queries`, in the variant of the shader that lets the device trace.
    pub(crate) fn descriptor_type(&self, queries: bool) -> vk::DescriptorType {
        match self.kind {
            BindingKind::Buffer => vk::DescriptorType::STORAGE_BUFFER,
            BindingKind::Image => vk::DescriptorType::STORAGE_IMAGE,
            BindingKind::Rays if queries => vk::DescriptorType::ACCELERATION_STRUCTURE_KHR,
            BindingKind::Sampled | BindingKind::Rays => vk::DescriptorType::SAMPLED_IMAGE,
        }
    }
}

/// Stem of the variant of a compute shader that lets the device trace its rays (`RAY_QUERY` in
/// `glsl/variants.txt`).
pub fn query_stem(stem: &str) -> String {
    format!("{}_query.comp", stem.trim_end_matches(".comp"))
}

impl Pass {
    /// A compute pass without constants and without shared sets.
    pub const fn compute(
        name: &'static str,
        shader: &'static str,
        bindings: &'static [Binding],
        params: StructLayout,
    ) -> Self {
        Pass {
            name,
            shaders: Shaders::Compute(shader),
            bindings,
            constants: &[],
            params: Some(params),
            sets: Sets::None,
        }
    }

    /// Stems of all shaders of the pass, each with its stage.
    pub fn stages(&self) -> Vec<(vk::ShaderStageFlags, &'static str)> {
        match &self.shaders {
            Shaders::Compute(stem) => vec![(vk::ShaderStageFlags::COMPUTE, *stem)],
            Shaders::Raster {
                vertex,
                geometry,
                fragment,
                ..
            } => [
                (vk::ShaderStageFlags::VERTEX, Some(*vertex)),
                (vk::ShaderStageFlags::GEOMETRY, *geometry),
                (vk::ShaderStageFlags::FRAGMENT, *fragment),
            ]
            .into_iter()
            .filter_map(|(stage, stem)| Some((stage, stem?)))
            .collect(),
        }
    }

    /// Whether its rays go through what is bound: then its shader has a variant ([`query_stem`]).
    pub fn traces(&self) -> bool {
        let mut kinds = self.bindings.iter().map(|binding| binding.kind);
        kinds.any(|kind| kind == BindingKind::Rays)
    }

    /// As [`Pass::stages`], with `queries` of the variant that lets the device trace.
    pub fn modules(&self, queries: bool) -> Vec<(vk::ShaderStageFlags, String)> {
        let module = |stem: &str| {
            if queries {
                query_stem(stem)
            } else {
                stem.into()
            }
        };
        let stages = self.stages().into_iter();
        stages.map(|(stage, stem)| (stage, module(stem))).collect()
    }

    /// Size of the parameters (bytes).
    pub fn push_bytes(&self) -> usize {
        let last = self.params.and_then(|(_, fields)| fields.last());
        last.map_or(0, |field| field.offset + field.size)
    }

    /// Whether the pass runs compute shaders.
    pub fn is_compute(&self) -> bool {
        matches!(self.shaders, Shaders::Compute(_))
    }
}
