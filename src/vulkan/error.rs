//! What can go wrong between us and the driver, in one line each.

use ash::vk;

/// An error that the user, the machine or the driver can cause.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// libvulkan is not there.
    #[error("no Vulkan loader found; install a Vulkan driver and its loader (libvulkan): {0}")]
    NoLoader(String),
    /// The loader is older than Vulkan 1.3.
    #[error("the Vulkan loader offers version {0}, but 1.3 is needed; update the loader")]
    LoaderTooOld(String),
    /// The loader found no driver.
    #[error("no Vulkan device found; install a driver (Mesa's lavapipe works without a GPU)")]
    NoDevice,
    /// Validation was asked for, and its layer is not installed.
    #[error(
        "the layer VK_LAYER_KHRONOS_validation is not installed; install the Vulkan validation \
         layers or run without validation"
    )]
    LayerMissing,
    /// Captures were asked for, but RenderDoc's layer is not installed.
    #[error(
        "captures need RenderDoc, whose layer VK_LAYER_RENDERDOC_Capture is not installed; install \
         it from your system's packages or from https://renderdoc.org"
    )]
    CaptureLayerMissing,
    /// No device can show pictures on the window's surface.
    #[error(
        "no Vulkan device can show pictures in a window of this display; render to a file \
         instead: lumivox render"
    )]
    NoPresent,
    /// The device choice names nothing.
    #[error("no Vulkan device matches {wanted}; there are: {have}")]
    DeviceNotFound {
        /// What was asked for.
        wanted: String,
        /// Names of the devices that there are.
        have: String,
    },
    /// The device lacks something that is required.
    #[error("the device {name} cannot be used, it lacks: {missing}")]
    DeviceRefused {
        /// Name of the device.
        name: String,
        /// Everything that is missing.
        missing: String,
    },
    /// A resource is larger than a limit of the device.
    #[error(
        "{resource}: {wanted} bytes wanted, but {limit} of this device is {available} bytes; \
         lower the resolution, the probes or the size"
    )]
    TooLarge {
        /// Name of the resource.
        resource: String,
        /// Bytes asked for.
        wanted: u64,
        /// The value of that limit (bytes).
        available: u64,
        /// Name of the limit.
        limit: &'static str,
    },
    /// An image has too many texels along an axis, too many mips or too many layers.
    #[error(
        "{resource}: {wanted} wanted, but this device allows {available}; lower the resolution, \
         the probes or the size"
    )]
    ImageTooLarge {
        /// Name of the resource.
        resource: String,
        /// Extent, mips and layers asked for.
        wanted: String,
        /// Extent, mips and layers possible.
        available: String,
    },
    /// Indices of draws are too small for a scene.
    #[error(
        "the scene has {wanted} corners of triangles, but a draw of this device can name \
         {available} (fullDrawIndexUint32); leave out parts of the scene"
    )]
    TooManyCorners {
        /// Corners of the scene.
        wanted: usize,
        /// Corners that indices can name.
        available: usize,
    },
    /// The memory heap is full.
    #[error(
        "{resource}: out of memory: {wanted} bytes wanted, {available} bytes available; lower the \
         resolution, the probes or the size"
    )]
    OutOfMemory {
        /// Name of the resource.
        resource: String,
        /// Bytes asked for.
        wanted: u64,
        /// Bytes left in the heap.
        available: u64,
    },
    /// The device cannot make an image of this format for this use.
    #[error("{resource}: this device has no images of format {format:?} for {usage:?}")]
    FormatUnsupported {
        /// Name of the resource.
        resource: String,
        /// The image format that was asked for.
        format: vk::Format,
        /// What the image was to be used for.
        usage: vk::ImageUsageFlags,
    },
    /// A pass needs an optional feature that this device lacks.
    #[error("{what} needs {feature}, which this device lacks")]
    FeatureMissing {
        /// What needs it: a pass or an option, in words.
        what: String,
        /// Name of the missing feature.
        feature: &'static str,
    },
    /// The driver ended threads of a pass before their work was done, however little each had.
    #[error(
        "{pass}: the driver ended {thread_count} threads before they were done; use a lower \
         resolution, or report the driver"
    )]
    Unfinished {
        /// Name of the pass.
        pass: &'static str,
        /// Threads that were not done.
        thread_count: u32,
    },
    /// A scene is not one that a technique can light.
    #[error("{technique}: {problem}; {hint}")]
    Unsuited {
        /// Name of the technique.
        technique: &'static str,
        /// Why.
        problem: String,
        /// What to do.
        hint: String,
    },
    /// A technique does not lend its store as another wants it.
    #[error("the store of {lender}: {problem}")]
    NotLent {
        /// Name of the technique.
        lender: String,
        /// Why.
        problem: String,
    },
    /// A shader module is not among those embedded.
    #[error("no shader module {0}; run tools/shaders and build again")]
    ModuleMissing(String),
    /// A module that was compiled while the program runs does not fit in place of the embedded one.
    #[error("{stem}: {problem}; the old shader stays")]
    ModuleRefused {
        /// Stem of the shader, its path without the ending.
        stem: String,
        /// What does not fit.
        problem: String,
    },
    /// The device stopped answering.
    #[error("the device was lost; the last pass that finished is {last_pass}")]
    DeviceLost {
        /// Name of the last pass whose end was recorded, or a phrase when there is none.
        last_pass: String,
    },
    /// What the window is shown on has gone.
    #[error("{what}: the window's surface is lost; open the window again: lumivox view")]
    SurfaceLost {
        /// What was being done.
        what: String,
    },
    /// Any other failure of a Vulkan call.
    #[error("{what}: {result}")]
    Vulkan {
        /// What was being done.
        what: String,
        /// What the driver answered.
        result: vk::Result,
    },
}

/// Adds what was being done to a bare Vulkan result.
pub(crate) trait Context<T> {
    /// Names the work that failed.
    fn during(self, what: &str) -> Result<T, Error>;
}

impl<T> Context<T> for Result<T, vk::Result> {
    fn during(self, what: &str) -> Result<T, Error> {
        self.map_err(|result| match result {
            vk::Result::ERROR_SURFACE_LOST_KHR => Error::SurfaceLost {
                what: what.to_owned(),
            },
            result => Error::Vulkan {
                what: what.to_owned(),
                result,
            },
        })
    }
}
