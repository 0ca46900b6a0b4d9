//! What cones march through: the volume of a store, as data, and the passes through it.

use std::sync::Arc;

use crate::gi::shared::voxel::{Directionality, VoxelGrid};
use crate::graph::{Binding, Buffer, Frame, Image, Pass, PassBuilder, Resource, Sets, Shaders};

/// The passes through a store's volume. Each store has entry shaders of its own that include a pass
/// of `gi/shared/cone` and the store's volume.
pub struct VolumePasses {
    /// E = π Σ w L over a set of cones. Reads the G-buffer, writes RGBA32F (irradiance, ambient
    /// visibility); a thread a pixel.
    pub gather: Pass,
    /// Ambient visibility by a set of its own, in place of that of `gather`; what that gathered
    /// stays.
    pub occlusion: Pass,
    /// L_s by one cone along the mirror direction. Reads as `gather` and the specular lobe, writes
    /// RGBA32F.
    pub specular: Pass,
    /// L = Σ (ρ/π + f_s) E (n·ω) V over the lights. Reads the G-buffer, writes RGBA32F as
    /// `render.direct` does; a thread a pixel.
    pub shadow: Pass,
    /// E += Σ L A cos θ cos θ' V / (d² + r²) over patches of surface that emit. Reads the G-buffer,
    /// reads and writes RGBA32F; a thread a pixel.
    pub patches: Pass,
    /// E/π = Σ w L over a set of cones from each voxel. Reads voxels, writes half floats; a thread
    /// a side of a voxel.
    pub bounce: Pass,
    /// Texels of a level, front to back along each pixel's ray. Writes RGBA32F, premultiplied by
    /// opacity; a thread a pixel.
    pub view: Pass,
    /// One cone. Writes RGBA32F rows: two of the cone, then two of each sample.
    pub trace: Pass,
}

impl VolumePasses {
    /// All of them.
    pub const fn all(&'static self) -> [&'static Pass; 8] {
        [
            &self.gather,
            &self.occlusion,
            &self.specular,
            &self.shadow,
            &self.patches,
            &self.bounce,
            &self.view,
            &self.trace,
        ]
    }
}

/// [`VolumePasses`] whose entry shaders are in a folder, from the three bindings of the volume.
macro_rules! volume_passes {
    ($folder:literal, $volume:expr) => {{
        use $crate::gi::shared::cone::volume::{VolumePasses, pass};
        use $crate::gi::shared::cone::{patches, shadow, trace, tracer, view};
        macro_rules! of {
            ($name:literal, $file:literal, $params:ty, $own:expr) => {{
                const COUNT: usize = 3 + $own.len();
                pass(
                    $name,
                    concat!($folder, "/", $file, ".comp"),
                    size_of::<$params>() as u32,
                    const { &$crate::graph::pass::join::<3, _, COUNT>($volume, $own) },
                )
            }};
        }
        VolumePasses {
            gather: of!("cone.gather", "gather", tracer::ConeParams, tracer::GATHER),
            occlusion: of!(
                "cone.occlusion",
                "gather",
                tracer::ConeParams,
                tracer::GATHER
            ),
            specular: of!(
                "cone.specular",
                "specular",
                tracer::SpecularParams,
                tracer::SPECULAR
            ),
            shadow: of!(
                "cone.shadow",
                "shadow",
                shadow::ShadowConeParams,
                shadow::BINDINGS
            ),
            patches: of!(
                "cone.patches",
                "patches",
                patches::PatchParams,
                patches::BINDINGS
            ),
            bounce: of!(
                "voxel.bounce",
                "bounce",
                tracer::BounceConeParams,
                tracer::BOUNCE
            ),
            view: of!("cone.view", "view", view::ViewVoxelsParams, view::BINDINGS),
            trace: of!("cone.trace", "trace", trace::TraceParams, trace::BINDINGS),
        }
    }};
}
pub(in crate::gi) use volume_passes;

pub(in crate::gi) const fn pass(
    name: &'static str,
    shader: &'static str,
    push_bytes: u32,
    bindings: &'static [Binding],
) -> Pass {
    Pass {
        name,
        shaders: Shaders::Compute(shader),
        bindings,
        push_bytes,
        sets: Sets::Scene,
    }
}

/// What a pass of cones writes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Output {
    /// What the cones see.
    Light,
    /// In x, how many samples they take.
    Samples,
    /// Of `cone.view`: how the volume divides space.
    Structure,
}

/// How the three faces that a cone meets make one opacity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaceWeights {
    /// By their optical depths along the direction.
    Extinction,
    /// With the squares of the direction's components as weights.
    Squared,
}

/// A buffer or an image of a volume.
#[derive(Clone, Copy)]
pub enum Bound<'v> {
    /// A storage buffer.
    Buffer(&'v Arc<Buffer>),
    /// A sampled image, all mips.
    Image(&'v Arc<Image>),
}

/// A specialization constant of a volume.
#[derive(Clone, Copy)]
pub enum Constant {
    /// A value.
    Is(u32),
    /// 1 where a pass skips samples that see no matter.
    SkipsEmpty,
}

/// The volume of a store, for one frame.
#[derive(Clone, Copy)]
pub struct Volume<'v> {
    /// The store's passes.
    pub passes: &'static VolumePasses,
    /// Where it is, in its finest voxels.
    pub grid: VoxelGrid,
    /// Bindings 0 to 2.
    pub bound: [Bound<'v>; 3],
    /// Constants 0 and 2.
    pub constants: [Constant; 2],
    /// Which levels have six faces.
    pub directionality: Directionality,
    /// Radiances of a voxel.
    pub sides: u32,
    /// Voxels that a cone crosses at most along an axis.
    pub voxels_across: u32,
    /// From a face of what it stores to the next; 0 where the store needs none.
    pub face_stride: u32,
}

/// How a pass marches.
#[derive(Clone, Copy)]
pub(super) struct March {
    pub(super) skips_empty: bool,
    pub(super) output: Output,
    pub(super) weights: FaceWeights,
}

impl Volume<'_> {
    /// Adds one of its passes, with its own bindings and the constants; those of the pass follow.
    pub(super) fn pass<'f>(
        &self,
        frame: &'f mut Frame,
        pass: &'static Pass,
        march: March,
    ) -> PassBuilder<'f> {
        let own = self.constants.map(|constant| match constant {
            Constant::Is(value) => value,
            Constant::SkipsEmpty => u32::from(march.skips_empty),
        });
        let faces = [
            self.directionality != Directionality::Isotropic,
            self.directionality.faces().is_some(),
            march.weights == FaceWeights::Extinction,
        ]
        .map(u32::from);
        let constants = [
            own[0],
            march.output as u32,
            own[1],
            faces[0],
            faces[1],
            faces[2],
        ];
        let bound = self.bound.iter();
        bound.fold(frame.pass(pass).constants(&constants), |pass, bound| {
            pass.bind(match *bound {
                Bound::Buffer(buffer) => Resource::from(buffer),
                Bound::Image(image) => Resource::from(image),
            })
        })
    }
}
