//! How a pass uses a resource: the one place that spells pipeline stages, access masks and image layouts.

use ash::vk;

/// How one pass uses one resource. "Compute" words are for compute shaders, "Raster" words for vertex, geometry and fragment shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Access {
    /// Storage buffer or storage image, only read.
    ComputeRead,
    /// Storage buffer or storage image, only written; earlier contents of untouched texels are kept.
    ComputeWrite,
    /// Storage buffer or storage image, read and written, atomics included.
    ComputeReadWrite,
    /// Sampled image.
    ComputeSampled,
    /// Storage buffer or storage image, only read.
    RasterRead,
    /// Storage buffer or storage image, read and written, atomics included.
    RasterReadWrite,
    /// Sampled image.
    RasterSampled,
    /// Colour attachment.
    ColorTarget,
    /// Depth attachment, tested and written.
    DepthTarget,
    /// Arguments of an indirect dispatch or draw.
    IndirectRead,
    /// Source of a copy or blit.
    TransferRead,
    /// Destination of a copy, blit, fill or clear.
    TransferWrite,
    /// Read by the host after the frame has finished.
    HostRead,
    /// Handed to the swapchain.
    Present,
}
