//! Where mips may be other than zero: only there they are made
//! (`gi/voxel_cones/mips/list_groups.comp`).

use std::sync::Arc;

use crate::gi::shared::voxel::build::buffer;
use crate::gpu_struct;
use crate::graph::compute::{linear_groups, read_write};
use crate::graph::{Access, Binding, Buffer, Error, Frame, Gpu, Image, Pass};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `voxel_mips.list_groups`.
    pub struct ListGroupsParams {
        /// The mip whose groups are listed.
        pub listed_mip: i32,
        /// Texels along an edge of mip 0.
        pub resolution: i32,
        /// First word of the mip's list.
        pub first_word: u32,
        /// Cubes side by side: 1, or 6 faces.
        pub cubes: u32,
    }
}

/// The groups of a mip that hold a texel that may be other than zero. Reads the matter pyramid; a
/// thread a group.
pub static LIST_GROUPS: Pass = Pass::compute(
    "voxel_mips.list_groups",
    "gi/voxel_cones/mips/list_groups.comp",
    &[
        Binding::image("matter", Access::ComputeRead),
        read_write("groups"),
    ],
    ListGroupsParams::LAYOUT,
);

/// Words of a list before its groups.
const HEAD: u32 = 4;

/// Groups of 4³ texels of all mips but the finest: a list each, with the workgroups of an indirect
/// dispatch over it.
pub struct FilterGroups {
    lists: Arc<Buffer>,
    resolution: u32,
    cubes: u32,
}

impl FilterGroups {
    /// For mips of n³ texels, one cube or six; without groups.
    pub fn new(gpu: &Gpu, resolution: u32, cubes: u32) -> Result<Self, Error> {
        let mut groups = FilterGroups {
            lists: buffer(gpu, "voxel_mips.groups", 0)?,
            resolution,
            cubes,
        };
        let words = groups.first_word(resolution.ilog2() + 1);
        groups.lists = buffer(gpu, "voxel_mips.groups", 4 * u64::from(words))?;
        Ok(groups)
    }

    /// Groups of a mip, listed or not.
    fn count(&self, mip: u32) -> u32 {
        (self.resolution >> mip).div_ceil(4).pow(3)
    }

    fn first_word(&self, mip: u32) -> u32 {
        (1..mip).map(|finer| HEAD + self.count(finer)).sum()
    }

    /// Adds the passes that list the groups that hold matter.
    pub fn list(&self, frame: &mut Frame, matter: &Arc<Image>) {
        frame.fill("voxel_mips.clear", &self.lists, 0);
        for mip in 1..=self.resolution.ilog2() {
            frame
                .pass(&LIST_GROUPS)
                .bind("matter", matter)
                .bind("groups", &self.lists)
                .push(&ListGroupsParams {
                    listed_mip: mip as i32,
                    resolution: self.resolution as i32,
                    first_word: self.first_word(mip),
                    cubes: self.cubes,
                })
                .dispatch(linear_groups(self.count(mip)));
        }
    }

    /// The list of a mip: the buffer and its first word.
    pub(super) fn of_mip(&self, mip: u32) -> (&Arc<Buffer>, u32) {
        (&self.lists, self.first_word(mip))
    }
}
