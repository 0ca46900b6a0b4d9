//! Which texels of a clipmap may be other than zero, so that cones need not sample where none is
//! (`gi/voxel_cones/clipmap/filled.glsl`).

use std::sync::Arc;

use glam::IVec3;

use super::layout::Layout;
use crate::gi::shared::voxel::VoxelBox;
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
        /// xyz: first block of 4³ texels that is made.
        pub first_block: [i32; 4],
        /// xyz: end of those that are made.
        pub end_block: [i32; 4],
        /// The level that is made; mips above the outermost level have the numbers behind it.
        pub filled_level: i32,
        /// Number of levels without those mips.
        pub levels: i32,
    }
}

gpu_struct! {
    /// Parameters of `clipmap.spread_filled`.
    pub(super) struct SpreadParams {
        /// xyz: first block of 4³ stencils that is made.
        pub first_block: [i32; 4],
        /// xyz: end of those that are made.
        pub end_block: [i32; 4],
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

/// A bit for each texel of all levels and of the mips above, and for each stencil: a texel of the
/// images has those of 4×4×4 texels, and of 4×4×2 stencils.
pub(super) struct Filled {
    layout: Layout,
    filled: Arc<Image>,
    /// What samples look up.
    pub(super) matter: Arc<Image>,
    /// What is marked of each level.
    marked: Vec<Marks>,
}

/// What is marked of a level.
#[derive(Clone, Copy)]
struct Marks {
    /// Its first voxel.
    first: IVec3,
    /// Where texels may be marked that are zero now, in voxels of its unbounded grid.
    kept: VoxelBox,
}

/// A level whose texels are marked: where it begins, its voxels, where they have changed, and
/// whether texels may be left that its voxels and the next finer level do not make.
pub(super) struct Marked<'m> {
    pub(super) first: IVec3,
    pub(super) occupancy: &'m Arc<Buffer>,
    pub(super) new: &'m [VoxelBox],
    pub(super) is_kept: bool,
}

impl Filled {
    /// Without contents: all of it is marked in the first frame.
    pub(super) fn new(gpu: &Gpu, layout: Layout) -> Result<Self, Error> {
        let n = layout.resolution;
        let image = |name: &str, layers_of_block, format| {
            gpu.create_image(&ImageDesc {
                name: name.into(),
                extent: [
                    n / 4,
                    n / 4,
                    (layout.levels + 1) * (n / 4) * layers_of_block,
                ],
                kind: ImageKind::D3,
                format,
                mips: 1,
                layers: 1,
                usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
                owner: Owner::Store,
            })
        };
        Ok(Filled {
            layout,
            filled: image("clipmap.filled", 1, vk::Format::R16G16B16A16_UINT)?,
            matter: image("clipmap.matter", 2, vk::Format::R32_UINT)?,
            marked: Vec::new(),
        })
    }

    /// Where the texels of a level are marked anew, in voxels of its unbounded grid; `finer`: the
    /// same of the next finer level.
    fn remarked(&self, levels: &[Marked<'_>], level: usize, finer: Option<VoxelBox>) -> VoxelBox {
        let own = &levels[level];
        let extent = VoxelBox::cube(own.first, self.layout.resolution);
        let Some(before) = self
            .marked
            .get(level)
            .filter(|marks| marks.first == own.first)
        else {
            return extent;
        };
        let changed = own
            .new
            .iter()
            .fold(before.kept, |all, new| all.around(*new));
        let Some((index, finer)) = level.checked_sub(1).zip(finer) else {
            return changed.cut(extent);
        };
        // What the next finer level has left is no longer marked for it.
        let [stood, stands] =
            [self.marked[index].first, levels[index].first].map(|first| self.layout.extent(first));
        let left = if stood == stands {
            VoxelBox::NONE
        } else {
            stood
        };
        changed.around(finer.coarser()).around(left).cut(extent)
    }

    /// Adds the passes that mark the texels of the levels, and of the mips above them, where they
    /// may have changed since it was called last.
    pub(super) fn mark(&mut self, frame: &mut Frame, levels: &[Marked<'_>]) {
        let mut remarked: Option<VoxelBox> = None;
        let mut marks = Vec::new();
        for (index, level) in levels.iter().enumerate() {
            let made = self.remarked(levels, index, remarked);
            // The next finer level is marked already.
            let from_finer = index
                .checked_sub(1)
                .map_or(IVec3::ZERO, |finer| 2 * level.first - levels[finer].first);
            self.mark_level(frame, index as u32, level, from_finer, made);
            marks.push(Marks {
                first: level.first,
                kept: if level.is_kept { made } else { VoxelBox::NONE },
            });
            remarked = Some(made);
        }
        let Some((outermost, mut made)) = levels.last().zip(remarked) else {
            return;
        };
        for mip in 0..self.layout.top_mips() {
            made = made.coarser();
            let level = self.layout.levels + mip;
            self.mark_level(frame, level, outermost, IVec3::ZERO, made);
        }
        self.marked = marks;
    }

    /// Adds the passes that mark the texels of a level in `made`, from its own voxels and from what
    /// is marked of the next finer level. The mips above the outermost level have its place.
    fn mark_level(
        &self,
        frame: &mut Frame,
        level: u32,
        own: &Marked<'_>,
        from_finer: IVec3,
        made: VoxelBox,
    ) {
        let Layout {
            resolution: n,
            levels,
            ..
        } = self.layout;
        if made.is_empty() {
            return;
        }
        let mip = (level + 1).saturating_sub(levels);
        let first = own.first >> mip as i32;
        let blocks = IVec3::splat((n >> mip) as i32 / 4);
        let low: IVec3 = (made.low - first) >> 2;
        let end: IVec3 = (made.end - first + 3) >> 2;
        let end = end.min(blocks);
        let groups = |low: IVec3| ((end - low).as_uvec3() + 3) / 4;
        frame
            .pass(&MARK_FILLED)
            .bind("occupancy", own.occupancy)
            .bind("filled", &self.filled)
            .constant("HAS_VOXELS", mip == 0)
            .constant("KEPT", own.is_kept)
            .push(&FilledParams {
                from_finer: from_finer.extend(n as i32).to_array(),
                first_block: low.extend(0).to_array(),
                end_block: end.extend(0).to_array(),
                filled_level: level as i32,
                levels: levels as i32,
            })
            .dispatch(groups(low).to_array());
        // The stencils of a block reach into the next.
        let low = (low - 1).max(IVec3::ZERO);
        frame
            .pass(&SPREAD_FILLED)
            .bind("filled", &self.filled)
            .bind("matter", &self.matter)
            .push(&SpreadParams {
                first_block: low.extend(0).to_array(),
                end_block: end.extend(0).to_array(),
                spread_level: level as i32,
                n: n as i32,
                levels: levels as i32,
            })
            .dispatch(groups(low).to_array());
    }
}
