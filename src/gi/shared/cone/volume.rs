//! What cones march through: the volume of a store, as data, and the passes through it.

use crate::gi::shared::voxel::{Directionality, NormalLobe, VoxelGrid};
use crate::graph::{Binding, Bound, Frame, Pass, PassBuilder, Sets, Shaders};
use crate::shader::StructLayout;

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
    /// E ·= the least V of a light. Reads the G-buffer, reads and writes R32F and RGBA32F; a thread
    /// a pixel.
    pub obscure: Pass,
    /// E += Σ L A cos θ cos θ' V / (d² + r²) over patches of surface that emit. Reads the G-buffer,
    /// reads and writes RGBA32F; a thread a pixel.
    pub patches: Pass,
    /// E/π = Σ w L over a set of cones from each voxel. Reads voxels, writes half floats; a thread
    /// a side of a voxel.
    pub bounce: Pass,
    /// What is seen along lines of sight. Reads and writes a row a line; a thread a line.
    pub see: Pass,
    /// Texels of a level, front to back along each pixel's ray. Writes RGBA32F, premultiplied by
    /// opacity; a thread a pixel.
    pub view: Pass,
    /// One cone. Writes RGBA32F rows: two of the cone, then two of each sample.
    pub trace: Pass,
}

impl VolumePasses {
    /// All of them.
    pub const fn all(&'static self) -> [&'static Pass; 10] {
        [
            &self.gather,
            &self.occlusion,
            &self.specular,
            &self.shadow,
            &self.obscure,
            &self.patches,
            &self.bounce,
            &self.see,
            &self.view,
            &self.trace,
        ]
    }
}

/// [`VolumePasses`] whose entry shaders are in a folder, from the constants 0 and 2 of the volume
/// (empty where it has none) and its bindings, which come behind the pass's own.
macro_rules! volume_passes {
    ($folder:literal, $constants:expr, $volume:expr) => {
        $crate::gi::shared::cone::volume::volume_passes!($folder, $constants, $volume =>
            gather: "cone.gather", "gather", tracer::ConeParams, "COUNT_SAMPLES", tracer::GATHER;
            occlusion: "cone.occlusion", "gather", tracer::ConeParams, "COUNT_SAMPLES",
                tracer::GATHER;
            specular: "cone.specular", "specular", tracer::SpecularParams, "COUNT_SAMPLES",
                tracer::SPECULAR;
            shadow: "cone.shadow", "shadow", shadow::ShadowConeParams, "", shadow::BINDINGS;
            obscure: "cone.obscure", "obscure", shadow::ObscureParams, "", shadow::OBSCURE;
            patches: "cone.patches", "patches", patches::PatchParams, "", patches::BINDINGS;
            bounce: "voxel.bounce", "bounce", tracer::BounceConeParams, "", tracer::BOUNCE;
            see: "cone.see", "see", see::SeeParams, "", see::BINDINGS;
            view: "cone.view", "view", view::ViewVoxelsParams, "SHOWN", view::BINDINGS;
            trace: "cone.trace", "trace", trace::TraceParams, "", trace::BINDINGS;
        )
    };
    ($folder:literal, $constants:expr, $volume:expr => $($field:ident:
        $name:literal, $file:literal, $params:ty, $constant:literal, $own:expr;)*) => {{
        use $crate::gi::shared::cone::volume::{VolumePasses, constants, pass};
        use $crate::gi::shared::cone::{patches, see, shadow, trace, tracer, view};
        use $crate::shader::GpuStruct;
        VolumePasses {
            $($field: {
                const OWN: usize = $own.len();
                const VOLUME: usize = $volume.len();
                pass(
                    $name,
                    concat!($folder, "/", $file, ".comp"),
                    <$params>::LAYOUT,
                    const {
                        use $crate::graph::pass::join;
                        &join::<_, OWN, VOLUME, { OWN + VOLUME }>($own, $volume)
                    },
                    const { &constants($constants, $constant) },
                )
            }),*
        }
    }};
}
pub(in crate::gi) use volume_passes;

/// The constants of a pass through a volume: the volume's own, the pass's own, and those of faces
/// and normals.
pub(in crate::gi) const fn constants(
    [first, third]: [&'static str; 2],
    own: &'static str,
) -> [&'static str; 7] {
    [
        first,
        own,
        third,
        "FACES",
        "FINEST_FACES",
        "EXTINCTION",
        "NORMALS",
    ]
}

pub(in crate::gi) const fn pass(
    name: &'static str,
    shader: &'static str,
    params: StructLayout,
    bindings: &'static [Binding],
    constants: &'static [&'static str],
) -> Pass {
    Pass {
        name,
        shaders: Shaders::Compute(shader),
        bindings,
        constants,
        params: Some(params),
        sets: Sets::Scene,
    }
}

/// What a pass of cones writes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum ConeOutput {
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

/// The volume of a store, for one frame.
#[derive(Clone, Copy)]
pub struct Volume<'v> {
    /// The store's passes.
    pub passes: &'static VolumePasses,
    /// Where it is, in its finest voxels.
    pub grid: VoxelGrid,
    /// Its bindings, by name.
    pub bound: [Option<(&'static str, Bound<'v>)>; 6],
    /// Its constants, by name, but for that of whether samples without matter are skipped.
    pub constants: [Option<(&'static str, u32)>; 2],
    /// Which levels have six faces.
    pub directionality: Directionality,
    /// Whether texels shine by their mean normals, and how; then none has faces.
    pub lobe: Option<NormalLobe>,
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
    pub(super) output: ConeOutput,
    pub(super) weights: FaceWeights,
}

impl March {
    pub(super) const fn new(skips_empty: bool, output: ConeOutput, weights: FaceWeights) -> Self {
        March {
            skips_empty,
            output,
            weights,
        }
    }
}

impl Volume<'_> {
    /// Adds one of its passes, with its own bindings and all constants; those bindings that are the
    /// pass's own are still to be bound.
    pub(super) fn pass<'f>(
        &self,
        frame: &'f mut Frame,
        pass: &'static Pass,
        march: March,
    ) -> PassBuilder<'f> {
        let values = pass
            .constants
            .iter()
            .filter_map(|name| Some((*name, self.constant(name, march)?)));
        let pass = values.fold(frame.pass(pass), |pass, (name, value)| {
            pass.constant(name, value)
        });
        self.bound
            .iter()
            .flatten()
            .fold(pass, |pass, &(name, bound)| pass.bind(name, bound))
    }

    /// The value of a constant of its passes; `None` of one that none of them has.
    fn constant(&self, name: &str, march: March) -> Option<u32> {
        Some(match name {
            "SKIP_EMPTY" => u32::from(march.skips_empty),
            "COUNT_SAMPLES" | "SHOWN" => march.output as u32,
            "FACES" => u32::from(self.directionality != Directionality::Isotropic),
            "FINEST_FACES" => u32::from(self.directionality.faces().is_some()),
            "EXTINCTION" => u32::from(march.weights == FaceWeights::Extinction),
            "NORMALS" => self.lobe.map_or(0, |lobe| lobe as u32),
            _ => {
                let mut own = self.constants.iter().flatten();
                own.find(|(known, _)| *known == name)?.1
            }
        })
    }
}
