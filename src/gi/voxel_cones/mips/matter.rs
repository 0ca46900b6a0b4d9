//! The matter pyramid: where samples of the dense radiance cannot be other than zero, so that cones
//! need not take them (`gi/voxel_cones/matter.glsl`).

use std::sync::Arc;

use crate::gpu_struct;
use crate::graph::{
    Access, Binding, Buffer, Error, Frame, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Owner,
    Pass, Sets, Shaders, vk,
};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `voxel_mips.reduce_matter`.
    pub struct MatterParams {
        /// The mip that is made.
        pub mip: i32,
    }
}

/// Mip 0 of the pyramid, from the occupancy. A thread a block of 4³ voxels.
pub static MARK_MATTER: Pass = Pass {
    name: "voxel_mips.mark_matter",
    shaders: Shaders::Compute("gi/voxel_cones/mips/mark_matter.comp"),
    bindings: &[
        Binding::buffer("occupancy", Access::ComputeRead),
        Binding::image("matter", Access::ComputeWrite),
    ],
    constants: &[],
    params: None,
    sets: Sets::None,
};

/// A mip of the pyramid from the next finer one. A thread a word.
pub static REDUCE_MATTER: Pass = Pass::compute(
    "voxel_mips.reduce_matter",
    "gi/voxel_cones/mips/reduce_matter.comp",
    &[Binding::image("matter", Access::ComputeReadWrite)],
    MatterParams::LAYOUT,
);

/// The image of a pyramid over a grid of n³ voxels, still without contents: R32, n/4 × n/4 × n
/// words.
pub fn matter_image(gpu: &Gpu, resolution: u32) -> Result<Arc<Image>, Error> {
    gpu.create_image(&ImageDesc {
        name: "voxel_mips.matter".into(),
        extent: [resolution / 4, resolution / 4, resolution],
        kind: ImageKind::D3,
        format: vk::Format::R32_UINT,
        mips: 1,
        layers: 1,
        usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
        owner: Owner::Store,
    })
}

/// Adds the passes that make the pyramid of voxels with this occupancy.
pub fn mark_matter(frame: &mut Frame, occupancy: &Arc<Buffer>, matter: &Arc<Image>) {
    let [blocks, _, resolution] = matter.extent(0);
    frame
        .pass(&MARK_MATTER)
        .bind("occupancy", occupancy)
        .bind("matter", matter)
        .dispatch([blocks.pow(3).div_ceil(64), 1, 1]);
    for mip in 1..=resolution.ilog2() {
        let size = resolution >> mip;
        let groups = [size.div_ceil(16), size.div_ceil(16), size.div_ceil(8)];
        frame
            .pass(&REDUCE_MATTER)
            .bind("matter", matter)
            .push(&MatterParams { mip: mip as i32 })
            .dispatch(groups);
    }
}
