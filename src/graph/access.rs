//! How a pass uses a resource: the one place that spells pipeline stages, access masks and image
//! layouts.

use ash::vk;

/// How one pass uses one resource. "Compute" words are for compute shaders, "Raster" words for
/// vertex, geometry and fragment shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Access {
    /// Storage buffer or storage image, only read.
    ComputeRead,
    /// Storage buffer or storage image, only written; earlier contents of untouched texels are
    /// kept.
    ComputeWrite,
    /// Storage buffer or storage image, read and written, atomics included.
    ComputeReadWrite,
    /// Sampled image, read by a compute shader.
    ComputeSampled,
    /// Uniform buffer, read by a compute shader.
    ComputeUniform,
    /// Acceleration structure, traced by a compute shader.
    ComputeTraced,
    /// Storage buffer or storage image, only read.
    RasterRead,
    /// Storage buffer or storage image, read and written, atomics included.
    RasterReadWrite,
    /// Sampled image, read by a vertex, geometry or fragment shader.
    RasterSampled,
    /// Uniform buffer, read by a vertex, geometry or fragment shader.
    RasterUniform,
    /// Colour attachment.
    ColorTarget,
    /// Depth attachment, tested and written.
    DepthTarget,
    /// Arguments of an indirect dispatch or draw.
    IndirectRead,
    /// Indices of a draw.
    IndexRead,
    /// The word that says whether passes run.
    ConditionRead,
    /// Source of a copy or blit.
    TransferRead,
    /// Destination of a copy, blit, fill, clear or of constants.
    TransferWrite,
    /// What an acceleration structure is built from.
    BuildInput,
    /// Acceleration structure, part of one that is built.
    BuildPart,
    /// Acceleration structure that is built, and what its build needs besides.
    BuildTarget,
    /// Read by the host after the frame has finished.
    HostRead,
    /// Handed to the swapchain.
    Present,
}

/// What an [`Access`] means to Vulkan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sync {
    /// Stages at which it happens.
    pub stage: vk::PipelineStageFlags2,
    /// Kinds of memory access.
    pub access: vk::AccessFlags2,
    /// Layout that an image has to be in; buffers have none.
    pub layout: vk::ImageLayout,
    /// Whether it reads.
    pub reads: bool,
    /// Whether it writes.
    pub writes: bool,
}

/// Vertex and geometry shaders, whether or not the device has the latter, and fragment shaders.
const RASTER: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::from_raw(
    vk::PipelineStageFlags2::PRE_RASTERIZATION_SHADERS.as_raw()
        | vk::PipelineStageFlags2::FRAGMENT_SHADER.as_raw(),
);

impl Access {
    /// All words, for tests.
    pub const ALL: [Access; 22] = [
        Access::ComputeRead,
        Access::ComputeWrite,
        Access::ComputeReadWrite,
        Access::ComputeSampled,
        Access::ComputeUniform,
        Access::ComputeTraced,
        Access::RasterRead,
        Access::RasterReadWrite,
        Access::RasterSampled,
        Access::RasterUniform,
        Access::ColorTarget,
        Access::DepthTarget,
        Access::IndirectRead,
        Access::IndexRead,
        Access::ConditionRead,
        Access::TransferRead,
        Access::TransferWrite,
        Access::BuildInput,
        Access::BuildPart,
        Access::BuildTarget,
        Access::HostRead,
        Access::Present,
    ];

    /// Stages, access masks and layout of this use.
    pub fn sync(self) -> Sync {
        use vk::{AccessFlags2 as A, ImageLayout as L, PipelineStageFlags2 as S};
        let (read, write) = (A::SHADER_STORAGE_READ, A::SHADER_STORAGE_WRITE);
        let (stage, reads, writes, layout) = match self {
            Access::ComputeRead => (S::COMPUTE_SHADER, read, A::NONE, L::GENERAL),
            Access::ComputeWrite => (S::COMPUTE_SHADER, A::NONE, write, L::GENERAL),
            Access::ComputeReadWrite => (S::COMPUTE_SHADER, read, write, L::GENERAL),
            Access::ComputeSampled => (
                S::COMPUTE_SHADER,
                A::SHADER_SAMPLED_READ,
                A::NONE,
                L::SHADER_READ_ONLY_OPTIMAL,
            ),
            Access::ComputeUniform => (S::COMPUTE_SHADER, A::UNIFORM_READ, A::NONE, L::UNDEFINED),
            Access::ComputeTraced => (
                S::COMPUTE_SHADER,
                A::ACCELERATION_STRUCTURE_READ_KHR,
                A::NONE,
                L::UNDEFINED,
            ),
            Access::RasterRead => (RASTER, read, A::NONE, L::GENERAL),
            Access::RasterReadWrite => (RASTER, read, write, L::GENERAL),
            Access::RasterSampled => (
                RASTER,
                A::SHADER_SAMPLED_READ,
                A::NONE,
                L::SHADER_READ_ONLY_OPTIMAL,
            ),
            Access::RasterUniform => (RASTER, A::UNIFORM_READ, A::NONE, L::UNDEFINED),
            Access::ColorTarget => (
                S::COLOR_ATTACHMENT_OUTPUT,
                A::COLOR_ATTACHMENT_READ,
                A::COLOR_ATTACHMENT_WRITE,
                L::COLOR_ATTACHMENT_OPTIMAL,
            ),
            Access::DepthTarget => (
                S::EARLY_FRAGMENT_TESTS | S::LATE_FRAGMENT_TESTS,
                A::DEPTH_STENCIL_ATTACHMENT_READ,
                A::DEPTH_STENCIL_ATTACHMENT_WRITE,
                L::DEPTH_ATTACHMENT_OPTIMAL,
            ),
            Access::IndirectRead => (
                S::DRAW_INDIRECT,
                A::INDIRECT_COMMAND_READ,
                A::NONE,
                L::UNDEFINED,
            ),
            Access::IndexRead => (S::INDEX_INPUT, A::INDEX_READ, A::NONE, L::UNDEFINED),
            Access::ConditionRead => (
                S::CONDITIONAL_RENDERING_EXT,
                A::CONDITIONAL_RENDERING_READ_EXT,
                A::NONE,
                L::UNDEFINED,
            ),
            Access::TransferRead => (
                S::ALL_TRANSFER,
                A::TRANSFER_READ,
                A::NONE,
                L::TRANSFER_SRC_OPTIMAL,
            ),
            Access::TransferWrite => (
                S::ALL_TRANSFER,
                A::NONE,
                A::TRANSFER_WRITE,
                L::TRANSFER_DST_OPTIMAL,
            ),
            Access::BuildInput => (
                S::ACCELERATION_STRUCTURE_BUILD_KHR,
                A::SHADER_READ,
                A::NONE,
                L::UNDEFINED,
            ),
            Access::BuildPart => (
                S::ACCELERATION_STRUCTURE_BUILD_KHR,
                A::ACCELERATION_STRUCTURE_READ_KHR,
                A::NONE,
                L::UNDEFINED,
            ),
            Access::BuildTarget => (
                S::ACCELERATION_STRUCTURE_BUILD_KHR,
                A::ACCELERATION_STRUCTURE_READ_KHR,
                A::ACCELERATION_STRUCTURE_WRITE_KHR,
                L::UNDEFINED,
            ),
            Access::HostRead => (S::HOST, A::HOST_READ, A::NONE, L::UNDEFINED),
            Access::Present => (S::BOTTOM_OF_PIPE, A::NONE, A::NONE, L::PRESENT_SRC_KHR),
        };
        Sync {
            stage,
            access: reads | writes,
            layout,
            reads: !reads.is_empty(),
            writes: !writes.is_empty(),
        }
    }
}

/// The write bits of an access mask.
pub(crate) fn written(access: vk::AccessFlags2) -> vk::AccessFlags2 {
    use vk::AccessFlags2 as A;
    access
        & (A::SHADER_STORAGE_WRITE
            | A::COLOR_ATTACHMENT_WRITE
            | A::DEPTH_STENCIL_ATTACHMENT_WRITE
            | A::TRANSFER_WRITE
            | A::ACCELERATION_STRUCTURE_WRITE_KHR)
}
