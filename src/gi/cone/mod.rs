//! Cone sets and cone marching, shared by the voxel techniques.

pub mod oracle;
mod patches;
mod sets;
mod shadow;
mod view;

use std::sync::Arc;

pub use patches::{EmissivePatches, GpuPatch, PATCHES, PATCHES_CLIPMAP, PATCHES_SPARSE, Patch, PatchParams, patches};
pub use sets::{Cone, ConeSet, KahlRings, check, cone_set, diffuse_set, kahl_set};
pub use shadow::{SHADOW, SHADOW_CLIPMAP, SHADOW_SPARSE, SOFT_SHADOWS, ShadowConeParams};
pub use view::{VIEW, VIEW_CLIPMAP, VIEW_SPARSE, ViewVoxelsParams, VoxelVolume};

use crate::gi::Settings;
use crate::gi::registry::Substitution;
use crate::gi::settings::{Domain, PresetValues, Setting};
use crate::gi::voxel::rays::LOOP_BUDGET;
use crate::gi::voxel::voxelize::linear_groups;
use crate::gi::voxel::{Bounces, Directionality, VoxelGrid, VoxelRecords};
use crate::gpu_struct;
use crate::graph::{Access, Binding, Buffer, Error, Frame, Gpu, Image, Pass, PassBuilder, Sets, Shaders};
use crate::render::{GBuffer, GpuScene, screen_groups, screen_image, storage};
use crate::shader::{Field, GpuStruct};

gpu_struct! {
    /// Parameters of `cone.gather`.
    pub struct ConeParams {
        /// xyz: smallest corner of the grid (m); w: voxel size (m).
        pub grid: [f32; 4],
        /// Voxels along an edge of the grid.
        pub resolution: f32,
        /// β.
        pub step_factor: f32,
        /// g.
        pub opacity_exponent: f32,
        /// k; 0: off.
        pub height_clamp: f32,
        /// Longest distance (voxels).
        pub max_distance: f32,
        /// λ (1/m).
        pub ao_falloff: f32,
        /// Start along the geometric normal (voxels).
        pub start_offset: f32,
        /// First cone of this dispatch.
        pub first_cone: u32,
        /// One beyond its last cone.
        pub end_cone: u32,
        /// n of the n×n interleaving tile.
        pub interleave: u32,
        /// Width of a stratum of sin²θ; 0 where elevations are fixed.
        pub jitter: f32,
        /// 1 for visibility alone.
        pub is_occlusion: u32,
        /// Bricks of a sparse volume from a face of a tile to the next.
        pub face_stride: u32,
    }
}

gpu_struct! {
    /// Parameters of `cone.specular`.
    pub struct SpecularParams {
        /// xyz: smallest corner of the grid (m); w: voxel size (m).
        pub grid: [f32; 4],
        /// Voxels along an edge of the grid.
        pub resolution: f32,
        /// β.
        pub step_factor: f32,
        /// g.
        pub opacity_exponent: f32,
        /// k; 0: off.
        pub height_clamp: f32,
        /// Longest distance (voxels).
        pub max_distance: f32,
        /// Start along the geometric normal (voxels).
        pub start_offset: f32,
        /// As in [`ConeParams`].
        pub face_stride: u32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.bounce` by cones.
    pub struct BounceConeParams {
        /// xyz: first voxel of the piece of the grid that the voxels are of; w: voxels along an edge of the grid.
        pub first_voxel: [f32; 4],
        /// Number of occupied voxels.
        pub voxel_count: u32,
        /// β.
        pub step_factor: f32,
        /// g.
        pub opacity_exponent: f32,
        /// k; 0: off.
        pub height_clamp: f32,
        /// Longest distance (voxels).
        pub max_distance: f32,
        /// Start along the normal (voxels).
        pub start_offset: f32,
        /// First cone of this dispatch.
        pub first_cone: u32,
        /// One beyond its last cone.
        pub end_cone: u32,
        /// Width of a stratum of sin²θ.
        pub jitter: f32,
        /// Edge of the voxels that gather (voxels that are gathered from).
        pub voxel_scale: f32,
        /// As in [`ConeParams`].
        pub face_stride: u32,
    }
}

const GATHER_BINDINGS: [Binding; 4] = [
    Binding::sampled("view_depth", Access::ComputeSampled),
    Binding::sampled("normals", Access::ComputeSampled),
    Binding::buffer("cones", Access::ComputeRead),
    Binding::image("indirect_diffuse", Access::ComputeReadWrite),
];

const SPECULAR_BINDINGS: [Binding; 5] = [
    Binding::sampled("view_depth", Access::ComputeSampled),
    Binding::sampled("normals", Access::ComputeSampled),
    Binding::sampled("albedo", Access::ComputeSampled),
    Binding::sampled("specular", Access::ComputeSampled),
    Binding::image("indirect_specular", Access::ComputeWrite),
];

const BOUNCE_BINDINGS: [Binding; 3] = [
    Binding::buffer("voxel_records", Access::ComputeRead),
    Binding::buffer("cones", Access::ComputeRead),
    Binding::buffer("voxel_irradiance", Access::ComputeReadWrite),
];

const DENSE: [Binding; 3] =
    [Binding::sampled("voxels", Access::ComputeSampled), Binding::sampled("matter", Access::ComputeSampled), Binding::sampled("faces", Access::ComputeSampled)];
const SPARSE: [Binding; 3] = [
    Binding::buffer("nodes", Access::ComputeRead),
    Binding::sampled("bricks", Access::ComputeSampled),
    Binding::sampled("normals_of_bricks", Access::ComputeSampled),
];
const CLIPMAP: [Binding; 3] =
    [Binding::buffer("levels", Access::ComputeRead), Binding::sampled("clipmap", Access::ComputeSampled), Binding::sampled("top", Access::ComputeSampled)];

static GATHER_DENSE_BINDINGS: [Binding; 7] = {
    let ([a, b, c, d], [voxels, matter, faces]) = (GATHER_BINDINGS, DENSE);
    [a, b, c, d, voxels, matter, faces]
};

static GATHER_SPARSE_BINDINGS: [Binding; 7] = {
    let ([a, b, c, d], [nodes, bricks, normals]) = (GATHER_BINDINGS, SPARSE);
    [a, b, c, d, nodes, bricks, normals]
};

static GATHER_CLIPMAP_BINDINGS: [Binding; 7] = {
    let ([a, b, c, d], [levels, clipmap, top]) = (GATHER_BINDINGS, CLIPMAP);
    [a, b, c, d, levels, clipmap, top]
};

static SPECULAR_DENSE_BINDINGS: [Binding; 8] = {
    let ([a, b, c, d, e], [voxels, matter, faces]) = (SPECULAR_BINDINGS, DENSE);
    [a, b, c, d, e, voxels, matter, faces]
};

static SPECULAR_SPARSE_BINDINGS: [Binding; 8] = {
    let ([a, b, c, d, e], [nodes, bricks, normals]) = (SPECULAR_BINDINGS, SPARSE);
    [a, b, c, d, e, nodes, bricks, normals]
};

static SPECULAR_CLIPMAP_BINDINGS: [Binding; 8] = {
    let ([a, b, c, d, e], [levels, clipmap, top]) = (SPECULAR_BINDINGS, CLIPMAP);
    [a, b, c, d, e, levels, clipmap, top]
};

static BOUNCE_DENSE_BINDINGS: [Binding; 6] = {
    let ([a, b, c], [voxels, matter, faces]) = (BOUNCE_BINDINGS, DENSE);
    [a, b, c, voxels, matter, faces]
};

static BOUNCE_SPARSE_BINDINGS: [Binding; 6] = {
    let ([a, b, c], [nodes, bricks, normals]) = (BOUNCE_BINDINGS, SPARSE);
    [a, b, c, nodes, bricks, normals]
};

static BOUNCE_CLIPMAP_BINDINGS: [Binding; 6] = {
    let ([a, b, c], [levels, clipmap, top]) = (BOUNCE_BINDINGS, CLIPMAP);
    [a, b, c, levels, clipmap, top]
};

const fn gather_pass(name: &'static str, shader: &'static str, bindings: &'static [Binding]) -> Pass {
    Pass { name, shaders: Shaders::Compute(shader), bindings, push_bytes: size_of::<ConeParams>() as u32, sets: Sets::Scene }
}

const fn specular_pass(shader: &'static str, bindings: &'static [Binding]) -> Pass {
    Pass { name: "cone.specular", shaders: Shaders::Compute(shader), bindings, push_bytes: size_of::<SpecularParams>() as u32, sets: Sets::Scene }
}

const fn bounce_pass(shader: &'static str, bindings: &'static [Binding]) -> Pass {
    Pass { name: "voxel.bounce", shaders: Shaders::Compute(shader), bindings, push_bytes: size_of::<BounceConeParams>() as u32, sets: Sets::Scene }
}

/// E = π Σ w L over a set of cones. Reads the G-buffer and a dense radiance volume with mips, writes RGBA32F (irradiance, ambient visibility).
pub static GATHER: Pass = gather_pass("cone.gather", "gi/cone/gather.comp", &GATHER_DENSE_BINDINGS);

/// As [`GATHER`], through the node pool and the brick pool of a sparse voxel octree.
pub static GATHER_SPARSE: Pass = gather_pass("cone.gather", "gi/cone/gather_svo.comp", &GATHER_SPARSE_BINDINGS);

/// Ambient visibility by a set of its own, in place of that of [`GATHER`]; what that gathered stays.
pub static OCCLUSION: Pass = gather_pass("cone.occlusion", "gi/cone/gather.comp", &GATHER_DENSE_BINDINGS);

/// As [`OCCLUSION`], through a sparse voxel octree.
pub static OCCLUSION_SPARSE: Pass = gather_pass("cone.occlusion", "gi/cone/gather_svo.comp", &GATHER_SPARSE_BINDINGS);

/// L_s by one cone along the mirror direction. Reads as [`GATHER`] and the specular lobe, writes RGBA32F.
pub static SPECULAR: Pass = specular_pass("gi/cone/specular.comp", &SPECULAR_DENSE_BINDINGS);

/// As [`SPECULAR`], through a sparse voxel octree.
pub static SPECULAR_SPARSE: Pass = specular_pass("gi/cone/specular_svo.comp", &SPECULAR_SPARSE_BINDINGS);

/// E/π = Σ w L over a set of cones from each voxel. Reads voxels and a dense radiance volume with mips, writes half floats; a thread a voxel.
pub static BOUNCE: Pass = bounce_pass("gi/cone/bounce.comp", &BOUNCE_DENSE_BINDINGS);

/// As [`BOUNCE`], through a sparse voxel octree.
pub static BOUNCE_SPARSE: Pass = bounce_pass("gi/cone/bounce_svo.comp", &BOUNCE_SPARSE_BINDINGS);

/// As [`OCCLUSION`], through the levels of a clipmap.
pub static OCCLUSION_CLIPMAP: Pass = gather_pass("cone.occlusion", "gi/cone/gather_clipmap.comp", &GATHER_CLIPMAP_BINDINGS);

/// As [`GATHER`], through the levels of a clipmap.
pub static GATHER_CLIPMAP: Pass = gather_pass("cone.gather", "gi/cone/gather_clipmap.comp", &GATHER_CLIPMAP_BINDINGS);

/// As [`SPECULAR`], through the levels of a clipmap.
pub static SPECULAR_CLIPMAP: Pass = specular_pass("gi/cone/specular_clipmap.comp", &SPECULAR_CLIPMAP_BINDINGS);

/// As [`BOUNCE`], through the levels of a clipmap.
pub static BOUNCE_CLIPMAP: Pass = bounce_pass("gi/cone/bounce_clipmap.comp", &BOUNCE_CLIPMAP_BINDINGS);

/// The passes through a dense volume.
pub static PASSES: &[&Pass] = &[&GATHER, &OCCLUSION, &SPECULAR, &SHADOW, &PATCHES, &BOUNCE, &VIEW];

/// The passes through a sparse volume.
pub static SPARSE_PASSES: &[&Pass] = &[&GATHER_SPARSE, &OCCLUSION_SPARSE, &SPECULAR_SPARSE, &SHADOW_SPARSE, &PATCHES_SPARSE, &BOUNCE_SPARSE, &VIEW_SPARSE];

/// The passes through a clipmap.
pub static CLIPMAP_PASSES: &[&Pass] =
    &[&GATHER_CLIPMAP, &OCCLUSION_CLIPMAP, &SPECULAR_CLIPMAP, &SHADOW_CLIPMAP, &PATCHES_CLIPMAP, &BOUNCE_CLIPMAP, &VIEW_CLIPMAP];

/// What a pass of cones writes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Output {
    /// What the cones see.
    Light,
    /// In x, how many samples they take.
    Samples,
}

/// How the three faces that a cone meets make one opacity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaceWeights {
    /// By their optical depths along the direction.
    Extinction,
    /// With the squares of the direction's components as weights.
    Squared,
}

/// What cones march through.
#[derive(Clone, Copy)]
pub enum Volume<'v> {
    /// A 3D texture with all mips.
    Dense {
        /// Radiance premultiplied by opacity; of anisotropic voxels the finest level alone.
        radiance: &'v Arc<Image>,
        /// Where samples of it may be other than zero: the matter pyramid.
        matter: &'v Arc<Image>,
        /// The levels with six faces, side by side along x, and which these are.
        faces: Option<(&'v Arc<Image>, Directionality)>,
    },
    /// A sparse voxel octree.
    Sparse {
        /// Node pool.
        nodes: &'v Arc<Buffer>,
        /// Brick pool.
        bricks: &'v Arc<Image>,
        /// Normal bricks, where texels shine by their normals.
        normals: Option<&'v Arc<Image>>,
        /// Whether its texels are at corners of voxels, not where those of dense mips are.
        corners: bool,
        /// The levels with six faces; without normal bricks.
        directionality: Directionality,
        /// Bricks from a face of a tile to the next.
        face_stride: u32,
    },
    /// A clipmap.
    Clipmap {
        /// Where its levels are.
        levels: &'v Arc<Buffer>,
        /// Radiance premultiplied by opacity, all levels.
        clipmap: &'v Arc<Image>,
        /// Mips of the outermost level.
        top: &'v Arc<Image>,
        /// Voxels along an edge of a level, and the number of levels.
        shape: [u32; 2],
        /// The levels with six faces.
        directionality: Directionality,
    },
}

impl Volume<'_> {
    /// Radiances of a voxel.
    fn sides(&self) -> u32 {
        1 + u32::from(matches!(self, Volume::Sparse { normals: Some(_), .. }) || self.directionality().faces().is_some())
    }

    /// Binds it as the last bindings of a pass, with the constants of the pass.
    fn bind<'f>(&self, pass: PassBuilder<'f>, skips_empty: bool, output: Output, weights: FaceWeights) -> PassBuilder<'f> {
        let directionality = self.directionality();
        let [has_faces, has_finest] = [directionality != Directionality::Isotropic, directionality.faces().is_some()];
        let (pass, first, third) = match *self {
            Volume::Dense { radiance, matter, faces } => {
                let faces = faces.map_or(radiance, |(faces, _)| faces);
                (pass.bind(radiance).bind(matter).bind(faces), u32::from(skips_empty), 0)
            }
            Volume::Sparse { nodes, bricks, normals, corners, .. } => {
                (pass.bind(nodes).bind(bricks).bind(normals.unwrap_or(bricks)), u32::from(corners), u32::from(normals.is_some()))
            }
            Volume::Clipmap { levels, clipmap, top, shape: [n, count], .. } => (pass.bind(levels).bind(clipmap).bind(top), n, count),
        };
        let faces = [has_faces, has_finest, weights == FaceWeights::Extinction].map(u32::from);
        pass.constants(&[first, output as u32, third, faces[0], faces[1], faces[2]])
    }

    /// That one of the same pass through a dense volume, a sparse one and a clipmap which is through this.
    fn choose(&self, [dense, sparse, clipmap]: [&'static Pass; 3]) -> &'static Pass {
        match self {
            Volume::Dense { .. } => dense,
            Volume::Sparse { .. } => sparse,
            Volume::Clipmap { .. } => clipmap,
        }
    }

    /// Voxels that a cone crosses at most along an axis: in a clipmap they are larger in each level further out.
    fn voxels_across(&self, grid: &VoxelGrid) -> u32 {
        match *self {
            Volume::Clipmap { shape: [n, levels], .. } => n * levels,
            Volume::Dense { .. } | Volume::Sparse { .. } => grid.resolution,
        }
    }

    fn directionality(&self) -> Directionality {
        match *self {
            Volume::Dense { faces, .. } => faces.map_or(Directionality::Isotropic, |(_, directionality)| directionality),
            Volume::Sparse { directionality, .. } | Volume::Clipmap { directionality, .. } => directionality,
        }
    }

    /// Bricks from a face of a tile to the next, where there are bricks and faces.
    fn face_stride(&self) -> u32 {
        if let Volume::Sparse { face_stride, .. } = *self { face_stride } else { 0 }
    }
}

/// All structs that this module shares with shaders.
pub static STRUCTS: &[(&str, &[Field])] = &[
    (ConeParams::NAME, ConeParams::FIELDS),
    (SpecularParams::NAME, SpecularParams::FIELDS),
    (ShadowConeParams::NAME, ShadowConeParams::FIELDS),
    (GpuPatch::NAME, GpuPatch::FIELDS),
    (PatchParams::NAME, PatchParams::FIELDS),
    (BounceConeParams::NAME, BounceConeParams::FIELDS),
    (ViewVoxelsParams::NAME, ViewVoxelsParams::FIELDS),
];

/// Cones as the papers have them: six of 60°, unclamped, the same in every pixel.
pub const TEXTBOOK: PresetValues = &[
    ("cone_set", "papers"),
    ("cones", "6"),
    ("aperture_scale", "1"),
    ("step_factor", "0.5"),
    ("opacity_exponent", "1"),
    ("height_clamp", "0"),
    ("start_offset", "1.5"),
    ("interleave", "1"),
];

/// As many cones as there are, so narrow that they read the finest levels.
pub const NARROWEST: PresetValues = &[("cones", "32"), ("aperture_scale", "0.05")];

/// Settings of cones.
pub static SETTINGS: &[Setting] = &[
    Setting { name: "cones", help: "diffuse cones a pixel", unit: "", domain: Domain::OneOf(&[1, 5, 6, 9, 16, 25, 32]), default: "16" },
    Setting {
        name: "cone_set",
        help: "directions: papers (1, 5, 6 and 9 as published; 16 and more on a disc), disc (equal shares of the cosine-weighted disc) or kahl (the rings of \
               kahl_*, whatever cones says)",
        unit: "",
        domain: Domain::Choice(&["papers", "disc", "kahl"]),
        default: "disc",
    },
    Setting { name: "kahl_front", help: "the cone along the normal of cone_set = kahl", unit: "", domain: Domain::Choice(&["on", "off"]), default: "on" },
    Setting { name: "kahl_intermediate", help: "its four cones at 45°", unit: "", domain: Domain::Choice(&["on", "off"]), default: "on" },
    Setting { name: "kahl_side", help: "its four cones along the surface", unit: "", domain: Domain::Choice(&["on", "off"]), default: "off" },
    Setting {
        name: "aperture_scale",
        help: "factor on tan(γ/2) of every diffuse cone; 1: the set covers the hemisphere once",
        unit: "",
        domain: Domain::Number { min: 0.05, max: 2.0 },
        default: "0.15",
    },
    Setting { name: "step_factor", help: "β: step in sample diameters", unit: "diameters", domain: Domain::Number { min: 0.1, max: 2.0 }, default: "1" },
    Setting {
        name: "opacity_exponent",
        help: "g in α' = 1 − (1 − α)^(g β); above 1 it makes up for what trilinear sampling lets through",
        unit: "",
        domain: Domain::Number { min: 0.1, max: 8.0 },
        default: "2.5",
    },
    Setting {
        name: "height_clamp",
        help: "k: a sample is no wider than its height over the receiver's tangent plane / k; 0: off",
        unit: "",
        domain: Domain::Number { min: 0.0, max: 16.0 },
        default: "5",
    },
    Setting {
        name: "start_offset",
        help: "start of a cone over the surface, along its normal",
        unit: "voxels",
        domain: Domain::Number { min: 0.0, max: 16.0 },
        default: "1.5",
    },
    Setting {
        name: "max_distance",
        help: "longest reach of a cone; 0: to the end of the grid",
        unit: "m",
        domain: Domain::Number { min: 0.0, max: 1e6 },
        default: "0",
    },
    Setting {
        name: "interleave",
        help: "n: each pixel of an n×n tile gathers in its own directions, then neighbours on one surface are averaged; 1: off",
        unit: "px",
        domain: Domain::OneOf(&[1, 2, 4, 8]),
        default: "4",
    },
    Setting {
        name: "ao_falloff",
        help: "λ in the ambient visibility's weight 1 / (1 + λ r)",
        unit: "1/m",
        domain: Domain::Number { min: 0.0, max: 1e4 },
        default: "0",
    },
    Setting {
        name: "occlusion_cones",
        help: "cones of the ambient visibility alone, on a disc; 0: those of the gather give it, with ao_falloff and max_distance",
        unit: "",
        domain: Domain::Count { min: 0, max: 64 },
        default: "0",
    },
    Setting {
        name: "occlusion_distance",
        help: "longest reach of occlusion_cones; 0: to the end of the grid",
        unit: "m",
        domain: Domain::Number { min: 0.0, max: 1e6 },
        default: "0",
    },
    Setting {
        name: "occlusion_falloff",
        help: "λ of occlusion_cones in the weight 1 / (1 + λ r)",
        unit: "1/m",
        domain: Domain::Number { min: 0.0, max: 1e4 },
        default: "0",
    },
    Setting {
        name: "shadows",
        help: "of the lights on what is seen: maps, or cones from the surface to each light through the voxels (soft; without maps where nothing else reads them)",
        unit: "",
        domain: Domain::Choice(&["maps", "cones"]),
        default: "maps",
    },
    Setting {
        name: "shadow_aperture",
        help: "full angle of shadows = cones: a light is as soft as a sphere that is seen so large",
        unit: "degrees",
        domain: Domain::Number { min: 1.0, max: 25.0 },
        default: "5",
    },
    Setting {
        name: "emissive_patches",
        help: "with shadows = cones: at most so many patches of surface that emits, each seen by a cone; the diffuse gather then sees no emission; 0: it does",
        unit: "",
        domain: Domain::Count { min: 0, max: 1024 },
        default: "32",
    },
    Setting {
        name: "specular",
        help: "glossy reflections by one cone, in a scene with glossy surfaces",
        unit: "",
        domain: Domain::Choice(&["on", "off"]),
        default: "on",
    },
];

/// Substitutions of a technique that gathers by cones alone.
pub static SUBSTITUTIONS: &[Substitution] = &[
    Substitution { name: "directions", help: "as many cones as the settings allow, so that no light falls between them", pairs: more_cones },
    Substitution {
        name: "filtering",
        help: "cones so narrow that they read the finest voxels alone",
        pairs: |settings| if settings.number("aperture_scale") > 0.05 { vec!["aperture_scale=0.05".into()] } else { Vec::new() },
    },
];

/// 32 cones of equal shares, turned from pixel to pixel: 2,048 directions in each interleaving window.
pub fn more_cones(_: &Settings) -> Vec<String> {
    ["cones=32", "cone_set=disc", "interleave=8"].map(String::from).to_vec()
}

/// How cones are traced.
#[derive(Clone, Copy, Debug)]
pub struct ConeSettings {
    /// n of the interleaving tile.
    pub interleave: u32,
    step_factor: f32,
    opacity_exponent: f32,
    height_clamp: f32,
    start_offset: f32,
    max_distance_m: f32,
    ao_falloff: f32,
    face_weights: FaceWeights,
}

/// Number of a pixel's diffuse cones.
pub fn diffuse_count(settings: &Settings) -> u32 {
    diffuse_set(settings).cones.len() as u32
}

/// A cone set on the device.
struct DeviceSet {
    cones: Arc<Buffer>,
    count: u32,
    jitter: f32,
    is_narrow: bool,
}

impl DeviceSet {
    fn new(gpu: &Gpu, name: &str, set: &ConeSet) -> Result<Self, Error> {
        let is_narrow = set.cones.iter().all(|cone| cone.tan_half_aperture <= NARROW);
        let rows: Vec<[f32; 4]> = set.cones.iter().map(|cone| [cone.sin2_theta, cone.phi_rad, cone.tan_half_aperture, cone.weight]).collect();
        Ok(DeviceSet { cones: storage(gpu, name, bytemuck::cast_slice(&rows))?, count: rows.len() as u32, jitter: set.stratum, is_narrow })
    }
}

/// Cone sets on the device, and how they are traced.
pub struct ConeTracer {
    settings: ConeSettings,
    /// Of a pixel.
    set: DeviceSet,
    /// Of a voxel, where voxels gather.
    bounce_set: Option<DeviceSet>,
    /// Of a pixel's ambient visibility, where it has cones of its own; their longest reach (m), 0 for the end of the grid, and λ (1/m).
    occlusion: Option<(DeviceSet, f32, f32)>,
    /// tan(γ/2) of the cone to a light; absent where shadow maps say what hides it.
    shadow_tan_half: Option<f32>,
    /// Whether diffuse cones skip samples of a dense volume's empty space. The picture is the same, bit by bit.
    pub skips_empty: bool,
}

/// Cones of at most this tan(γ/2) skip empty space: wider ones leave it within a few samples, of which most see matter.
const NARROW: f32 = 0.3;

/// Lanes of the widest vector in which a software device runs invocations; a loop turns for all of them until the last has ended.
const VECTOR_LANES: u32 = 8;

/// Turns of a sample's loops where lanes differ in whether a level has faces.
const FACE_TURNS: u32 = 5;

/// Samples of the longest cone: across the cube's diagonal, √3 n voxels, in steps of no less than β voxels.
fn longest_march(resolution: u32, step_factor: f32) -> u32 {
    (1.8 * resolution as f32 / step_factor).ceil() as u32 + 1
}

fn face_turns(directionality: Directionality) -> u32 {
    if directionality == Directionality::Isotropic { 0 } else { FACE_TURNS }
}

impl ConeTracer {
    /// From a technique's settings.
    pub fn new(gpu: &Gpu, settings: &Settings) -> Result<Self, Error> {
        let (resolution, step_factor) = (settings.count("resolution"), settings.number("step_factor"));
        // A sample that is taken costs a turn of two loops.
        let turns = 2 + face_turns(Directionality::new(settings));
        if turns * longest_march(resolution, step_factor) > LOOP_BUDGET {
            let what = format!("step_factor {step_factor} at resolution {resolution} (take larger steps or fewer voxels)");
            return Err(Error::FeatureMissing { what, feature: "more than 65,535 turns of a shader's loops" });
        }
        let aperture_scale = settings.number("aperture_scale");
        let set = DeviceSet::new(gpu, "cone.set", &diffuse_set(settings))?;
        let occlusion = match settings.count("occlusion_cones") {
            0 => None,
            count => Some(DeviceSet::new(gpu, "cone.occlusion_set", &cone_set(count, true, aperture_scale))?),
        };
        let bounce_set = cone_set(settings.count("bounce_directions"), true, aperture_scale);
        Ok(ConeTracer {
            settings: ConeSettings {
                interleave: settings.count("interleave"),
                step_factor: settings.number("step_factor"),
                opacity_exponent: settings.number("opacity_exponent"),
                height_clamp: settings.number("height_clamp"),
                start_offset: settings.number("start_offset"),
                max_distance_m: settings.number("max_distance"),
                ao_falloff: settings.number("ao_falloff"),
                face_weights: if settings.find_choice("face_weights") == Some("squared") { FaceWeights::Squared } else { FaceWeights::Extinction },
            },
            bounce_set: Bounces::new(settings).any().then(|| DeviceSet::new(gpu, "cone.bounce_set", &bounce_set)).transpose()?,
            occlusion: occlusion.map(|set| (set, settings.number("occlusion_distance"), settings.number("occlusion_falloff"))),
            shadow_tan_half: settings.is("shadows", "cones").then(|| (0.5 * settings.number("shadow_aperture").to_radians()).tan()),
            skips_empty: set.is_narrow,
            set,
        })
    }

    /// Whether lights have shadows by cones.
    pub fn has_shadows(&self) -> bool {
        self.shadow_tan_half.is_some()
    }

    /// Whether there are cones even where something else gathers the diffuse light.
    pub fn is_beside_gather(&self) -> bool {
        self.has_shadows() || self.occlusion.is_some()
    }

    /// Whether some cones, the specular one aside, skip empty space, and so need the matter pyramid of a dense volume.
    pub fn needs_matter(&self) -> bool {
        self.skips_empty || self.has_shadows() || self.occlusion.as_ref().is_some_and(|(set, ..)| set.is_narrow)
    }

    /// Adds the diffuse gather.
    pub fn gather(&self, frame: &mut Frame, gbuffer: &GBuffer, grid: &VoxelGrid, volume: Volume<'_>, result: &Arc<Image>) {
        self.add_gather(frame, gbuffer, grid, volume, result, Output::Light);
    }

    /// Adds the ambient visibility by cones of its own to what was gathered; nothing where the settings have none.
    pub fn occlusion(&self, frame: &mut Frame, gbuffer: &GBuffer, grid: &VoxelGrid, volume: Volume<'_>, result: &Arc<Image>) {
        let Some((set, reach_m, falloff)) = &self.occlusion else { return };
        let settings = ConeSettings { max_distance_m: *reach_m, ao_falloff: *falloff, ..self.settings };
        let pass = volume.choose([&OCCLUSION, &OCCLUSION_SPARSE, &OCCLUSION_CLIPMAP]);
        for (params, groups) in gather_params(&settings, set, grid, volume, gbuffer) {
            let params = ConeParams { is_occlusion: 1, ..params };
            let builder = frame.pass(pass).bind(&gbuffer.view_depth).bind(&gbuffer.normals).bind(&set.cones).bind(result);
            volume.bind(builder, set.is_narrow, Output::Light, settings.face_weights).push(&params).dispatch(groups);
        }
    }

    fn add_gather(&self, frame: &mut Frame, gbuffer: &GBuffer, grid: &VoxelGrid, volume: Volume<'_>, result: &Arc<Image>, output: Output) {
        let pass = volume.choose([&GATHER, &GATHER_SPARSE, &GATHER_CLIPMAP]);
        for (params, groups) in gather_params(&self.settings, &self.set, grid, volume, gbuffer) {
            let builder = frame.pass(pass).bind(&gbuffer.view_depth).bind(&gbuffer.normals).bind(&self.set.cones).bind(result);
            volume.bind(builder, self.skips_empty, output, self.settings.face_weights).push(&params).dispatch(groups);
        }
    }

    /// Adds `voxel.bounce` for the voxels of a grid, or of a piece of it: what reaches each, E/π, into `irradiance`. Nothing where the settings have one
    /// bounce.
    pub fn bounce(&self, frame: &mut Frame, grid: &VoxelGrid, voxels: &VoxelRecords, volume: Volume<'_>, irradiance: &Arc<Buffer>) {
        let Some(set) = &self.bounce_set else { return };
        let pass = volume.choose([&BOUNCE, &BOUNCE_SPARSE, &BOUNCE_CLIPMAP]);
        let s = &self.settings;
        let first_voxel = ((voxels.grid.origin - grid.origin) / voxels.grid.voxel_size).round();
        for [first_cone, end_cone] in s.dispatches(grid, volume, set.count) {
            let params = BounceConeParams {
                first_voxel: first_voxel.extend(grid.resolution as f32).to_array(),
                voxel_count: voxels.voxel_count,
                step_factor: s.step_factor,
                opacity_exponent: s.opacity_exponent,
                height_clamp: s.height_clamp,
                max_distance: s.max_distance(grid),
                start_offset: s.start_offset,
                first_cone,
                end_cone,
                jitter: set.jitter,
                voxel_scale: voxels.grid.voxel_size / grid.voxel_size,
                face_stride: volume.face_stride(),
            };
            let builder = frame.pass(pass).bind(&voxels.records).bind(&set.cones).bind(irradiance);
            let threads = volume.sides() * voxels.voxel_count;
            volume.bind(builder, self.skips_empty, Output::Light, s.face_weights).push(&params).dispatch(linear_groups(threads));
        }
    }

    /// Adds the specular cone; nothing in a scene without glossy surfaces.
    pub fn specular(&self, frame: &mut Frame, gbuffer: &GBuffer, grid: &VoxelGrid, volume: Volume<'_>, result: &Arc<Image>) {
        self.add_specular(frame, gbuffer, grid, volume, result, Output::Light);
    }

    fn add_specular(&self, frame: &mut Frame, gbuffer: &GBuffer, grid: &VoxelGrid, volume: Volume<'_>, result: &Arc<Image>, output: Output) {
        let Some(specular) = &gbuffer.specular else { return };
        let s = &self.settings;
        let params = SpecularParams {
            grid: grid.row(),
            resolution: grid.resolution as f32,
            step_factor: s.step_factor,
            opacity_exponent: s.opacity_exponent,
            height_clamp: s.height_clamp,
            max_distance: s.max_distance(grid),
            start_offset: s.start_offset,
            face_stride: volume.face_stride(),
        };
        let pass = volume.choose([&SPECULAR, &SPECULAR_SPARSE, &SPECULAR_CLIPMAP]);
        let builder = frame.pass(pass).bind(&gbuffer.view_depth).bind(&gbuffer.normals).bind(&gbuffer.albedo).bind(specular).bind(result);
        volume.bind(builder, true, output, s.face_weights).push(&params).dispatch(screen_groups(gbuffer.size));
    }

    /// Samples that all cones of a picture take, skipped ones too, by pass: counted by the passes themselves, in a run without light. `counted`: whether to
    /// count the diffuse gather, and the specular cone. The scene's frame constants are those of the picture.
    pub fn count_samples(
        &self,
        gpu: &Gpu,
        scene: &GpuScene,
        gbuffer: &GBuffer,
        grid: &VoxelGrid,
        volume: Volume<'_>,
        counted: [bool; 2],
    ) -> Result<Vec<(&'static str, u64)>, Error> {
        let result = screen_image(gpu, "cone.samples", gbuffer.size)?;
        let mut counts = Vec::new();
        for (pass, is_counted) in [&GATHER, &SPECULAR].into_iter().zip(counted) {
            if !is_counted {
                continue;
            }
            let mut frame = Frame::new();
            frame.set_scene(&scene.set, &scene.materials);
            if std::ptr::eq(pass, &GATHER) {
                self.add_gather(&mut frame, gbuffer, grid, volume, &result, Output::Samples);
            } else {
                self.add_specular(&mut frame, gbuffer, grid, volume, &result, Output::Samples);
            }
            gpu.submit(frame)?;
            let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_image(&result, 0, 0)?);
            counts.push((pass.name, texels.iter().map(|texel| texel[0] as u64).sum()));
        }
        Ok(counts)
    }
}

impl ConeSettings {
    /// First cone, and one beyond the last, of as many dispatches as keep the loops of one thread's cones within `LOOP_BUDGET`.
    fn dispatches(&self, grid: &VoxelGrid, volume: Volume<'_>, count: u32) -> Vec<[u32; 2]> {
        // A sample that is taken costs a turn of both loops; one that is skipped costs a turn of the inner one, which at worst no two lanes of a vector take
        // together.
        let turns = 2 + VECTOR_LANES + face_turns(volume.directionality());
        let cones_a_dispatch = (LOOP_BUDGET / (turns * longest_march(volume.voxels_across(grid), self.step_factor))).max(1);
        (0..count).step_by(cones_a_dispatch as usize).map(|first| [first, (first + cones_a_dispatch).min(count)]).collect()
    }

    /// Longest distance (voxels).
    fn max_distance(&self, grid: &VoxelGrid) -> f32 {
        if self.max_distance_m > 0.0 { self.max_distance_m / grid.voxel_size } else { 4.0 * grid.resolution as f32 }
    }
}

/// What `cone.gather` and `cone.occlusion` are told, and their workgroups, dispatch by dispatch.
fn gather_params(s: &ConeSettings, set: &DeviceSet, grid: &VoxelGrid, volume: Volume<'_>, gbuffer: &GBuffer) -> impl Iterator<Item = (ConeParams, [u32; 3])> {
    let face_stride = volume.face_stride();
    let params = move |[first_cone, end_cone]: [u32; 2]| ConeParams {
        grid: grid.row(),
        resolution: grid.resolution as f32,
        step_factor: s.step_factor,
        opacity_exponent: s.opacity_exponent,
        height_clamp: s.height_clamp,
        max_distance: s.max_distance(grid),
        ao_falloff: s.ao_falloff,
        start_offset: s.start_offset,
        first_cone,
        end_cone,
        interleave: s.interleave,
        jitter: set.jitter,
        is_occlusion: 0,
        face_stride,
    };
    let groups = screen_groups(gbuffer.size);
    s.dispatches(grid, volume, set.count).into_iter().map(move |cones| (params(cones), groups))
}
