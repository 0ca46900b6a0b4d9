//! Which texels of a clipmap may be other than zero, so that cones need not sample where none is
//! (`gi/voxel_cones/clipmap/filled.glsl`).

use std::sync::Arc;

use glam::IVec3;

use super::layout::Layout;
use crate::gpu_struct;
use crate::graph::{
    Access, Binding, Buffer, Error, Frame, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Owner,
    Pass, vk,
};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `clipmap.mark_filled`.
    pub(super) struct FilledParams {
        /// xyz: first texel of the level, from that of the next finer one (its texels); w: n.
        pub from_finer: [i32; 4],
        /// The level that is made; mips above the outermost level have the numbers behind it.
        pub filled_level: i32,
        /// Number of levels without those mips.
        pub levels: i32,
    }
}

gpu_struct! {
    /// Parameters of `clipmap.spread_filled`.
    pub(super) struct SpreadParams {
        /// The level that is made; mips above the outermost level have the numbers behind it.
        pub spread_level: i32,
        /// Voxels along an edge of a level.
        pub n: i32,
        /// Number of levels without those mips.
        pub levels: i32,
    }
}

/// The texels of a level that may be other than zero. A thread a block of 4³ texels.
pub(super) static MARK_FILLED: Pass = Pass {
    constants: &["HAS_VOXELS", "KEPT"],
    ..Pass::compute(
        "clipmap.mark_filled",
        "gi/voxel_cones/clipmap/mark_filled.comp",
        &[
            Binding::buffer("occupancy", Access::ComputeRead),
            Binding::image("filled", Access::ComputeReadWrite),
        ],
        FilledParams::LAYOUT,
    )
};

/// The stencils of a level that hold such texels. A thread a block of 4³ stencils.
pub(super) static SPREAD_FILLED: Pass = Pass::compute(
    "clipmap.spread_filled",
    "gi/voxel_cones/clipmap/spread_filled.comp",
    &[
        Binding::image("filled", Access::ComputeRead),
        Binding::image("matter", Access::ComputeWrite),
    ],
    SpreadParams::LAYOUT,
);

/// A bit for each texel of all levels and of the mips above, and for each stencil.
pub(super) struct Filled {
    layout: Layout,
    filled: Arc<Image>,
    /// What samples look up.
    pub(super) matter: Arc<Image>,
}

/// A level whose texels are marked: where it begins, the occupancy of its voxels, and whether
/// texels may be left that its voxels and the next finer level do not make.
pub(super) struct Marked<'m> {
    pub(super) first: IVec3,
    pub(super) occupancy: &'m Arc<Buffer>,
    pub(super) is_kept: bool,
}

impl Filled {
    /// Without contents: all of it is marked in the first frame.
    pub(super) fn new(gpu: &Gpu, layout: Layout) -> Result<Self, Error> {
        let n = layout.resolution;
        let image = |name: &str| {
            gpu.create_image(&ImageDesc {
                name: name.into(),
                extent: [n / 4, n / 4, (layout.levels + 1) * (n / 2)],
                kind: ImageKind::D3,
                format: vk::Format::R32_UINT,
                mips: 1,
                layers: 1,
                usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
                owner: Owner::Store,
            })
        };
        Ok(Filled {
            layout,
            filled: image("clipmap.filled")?,
            matter: image("clipmap.matter")?,
        })
    }

    /// Adds the passes that mark the texels of the levels, and of the mips above them.
    pub(super) fn mark(&self, frame: &mut Frame, levels: &[Marked<'_>]) {
        let Layout {
            resolution,
            levels: count,
            ..
        } = self.layout;
        let (n, levels_with_mips) = (resolution as i32, count + self.layout.top_mips());
        for level in 0..levels_with_mips {
            let stored = level.min(count - 1) as usize;
            let marked = &levels[stored];
            let has_voxels = level < count;
            // The mips above begin where the outermost level does.
            let from_finer = if level > 0 && has_voxels {
                2 * marked.first - levels[stored - 1].first
            } else {
                IVec3::ZERO
            };
            let blocks = (resolution >> (level + 1).saturating_sub(count)) / 4;
            let groups = [blocks.div_ceil(4); 3];
            frame
                .pass(&MARK_FILLED)
                .bind("occupancy", marked.occupancy)
                .bind("filled", &self.filled)
                .constant("HAS_VOXELS", has_voxels)
                .constant("KEPT", marked.is_kept)
                .push(&FilledParams {
                    from_finer: from_finer.extend(n).to_array(),
                    filled_level: level as i32,
                    levels: count as i32,
                })
                .dispatch(groups);
            frame
                .pass(&SPREAD_FILLED)
                .bind("filled", &self.filled)
                .bind("matter", &self.matter)
                .push(&SpreadParams {
                    spread_level: level as i32,
                    n,
                    levels: count as i32,
                })
                .dispatch(groups);
        }
    }
}
