//! What cones march through: the volume of any of the voxel structures, and what a pass through it
//! binds.

use std::sync::Arc;

use crate::gi::shared::voxel::{Directionality, VoxelGrid};
use crate::graph::{Access, Binding, Buffer, Image, Pass, PassBuilder, Sets, Shaders};

/// Bindings of a volume, the last of a pass.
pub(super) const DENSE: [Binding; 3] = [
    Binding::sampled("voxels", Access::ComputeSampled),
    Binding::sampled("matter", Access::ComputeSampled),
    Binding::sampled("faces", Access::ComputeSampled),
];
pub(super) const SPARSE: [Binding; 3] = [
    Binding::buffer("nodes", Access::ComputeRead),
    Binding::sampled("bricks", Access::ComputeSampled),
    Binding::sampled("normals_of_bricks", Access::ComputeSampled),
];
pub(super) const CLIPMAP: [Binding; 3] = [
    Binding::buffer("levels", Access::ComputeRead),
    Binding::sampled("clipmap", Access::ComputeSampled),
    Binding::sampled("top", Access::ComputeSampled),
];

/// A pass through each kind of volume: the same but for where it looks texels up.
pub struct VolumePass {
    /// Through a 3D texture with all mips.
    pub dense: Pass,
    /// Through the node pool and the brick pool of a sparse voxel octree.
    pub sparse: Pass,
    /// Through the levels of a clipmap.
    pub clipmap: Pass,
}

/// A [`VolumePass`] from its name, the stem of its shaders, its parameters, and its bindings, after
/// which come those of the volume.
macro_rules! volume_pass {
    ($name:literal, $stem:literal, $params:ty, $bindings:expr) => {{
        use $crate::gi::shared::cone::volume::{CLIPMAP, DENSE, SPARSE, VolumePass, join, pass};
        const PUSH_BYTES: u32 = size_of::<$params>() as u32;
        const COUNT: usize = $bindings.len() + 3;
        VolumePass {
            dense: pass(
                $name,
                concat!($stem, ".comp"),
                PUSH_BYTES,
                const { &join::<_, COUNT>($bindings, DENSE) },
            ),
            sparse: pass(
                $name,
                concat!($stem, "_svo.comp"),
                PUSH_BYTES,
                const { &join::<_, COUNT>($bindings, SPARSE) },
            ),
            clipmap: pass(
                $name,
                concat!($stem, "_clipmap.comp"),
                PUSH_BYTES,
                const { &join::<_, COUNT>($bindings, CLIPMAP) },
            ),
        }
    }};
}
pub(super) use volume_pass;

pub(super) const fn pass(
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

/// `own`, then `volume`'s.
pub(super) const fn join<const OWN: usize, const COUNT: usize>(
    own: [Binding; OWN],
    volume: [Binding; 3],
) -> [Binding; COUNT] {
    let mut joined = [volume[0]; COUNT];
    let mut i = 0;
    while i < COUNT {
        joined[i] = if i < OWN { own[i] } else { volume[i - OWN] };
        i += 1;
    }
    joined
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
    pub(super) fn sides(&self) -> u32 {
        1 + u32::from(
            matches!(
                self,
                Volume::Sparse {
                    normals: Some(_),
                    ..
                }
            ) || self.directionality().faces().is_some(),
        )
    }

    /// Binds it as the last bindings of a pass, with the constants of the pass.
    pub(super) fn bind<'f>(
        &self,
        pass: PassBuilder<'f>,
        skips_empty: bool,
        output: Output,
        weights: FaceWeights,
    ) -> PassBuilder<'f> {
        let directionality = self.directionality();
        let [has_faces, has_finest] = [
            directionality != Directionality::Isotropic,
            directionality.faces().is_some(),
        ];
        let (pass, first, third) = match *self {
            Volume::Dense {
                radiance,
                matter,
                faces,
            } => {
                let faces = faces.map_or(radiance, |(faces, _)| faces);
                (
                    pass.bind(radiance).bind(matter).bind(faces),
                    u32::from(skips_empty),
                    0,
                )
            }
            Volume::Sparse {
                nodes,
                bricks,
                normals,
                corners,
                ..
            } => (
                pass.bind(nodes)
                    .bind(bricks)
                    .bind(normals.unwrap_or(bricks)),
                u32::from(corners),
                u32::from(normals.is_some()),
            ),
            Volume::Clipmap {
                levels,
                clipmap,
                top,
                shape: [n, count],
                ..
            } => (pass.bind(levels).bind(clipmap).bind(top), n, count),
        };
        let faces = [has_faces, has_finest, weights == FaceWeights::Extinction].map(u32::from);
        pass.constants(&[first, output as u32, third, faces[0], faces[1], faces[2]])
    }

    /// That of `pass` which is through this.
    pub(super) fn choose(&self, pass: &'static VolumePass) -> &'static Pass {
        match self {
            Volume::Dense { .. } => &pass.dense,
            Volume::Sparse { .. } => &pass.sparse,
            Volume::Clipmap { .. } => &pass.clipmap,
        }
    }

    /// Voxels that a cone crosses at most along an axis: in a clipmap they are larger in each level
    /// further out.
    pub(super) fn voxels_across(&self, grid: &VoxelGrid) -> u32 {
        match *self {
            Volume::Clipmap {
                shape: [n, levels], ..
            } => n * levels,
            Volume::Dense { .. } | Volume::Sparse { .. } => grid.resolution,
        }
    }

    pub(super) fn directionality(&self) -> Directionality {
        match *self {
            Volume::Dense { faces, .. } => faces
                .map_or(Directionality::Isotropic, |(_, directionality)| {
                    directionality
                }),
            Volume::Sparse { directionality, .. } | Volume::Clipmap { directionality, .. } => {
                directionality
            }
        }
    }

    /// Bricks from a face of a tile to the next, where there are bricks and faces.
    pub(super) fn face_stride(&self) -> u32 {
        if let Volume::Sparse { face_stride, .. } = *self {
            face_stride
        } else {
            0
        }
    }
}
