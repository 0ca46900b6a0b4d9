//! Vulkan by hand: instance, device, memory, resources, pipelines, commands, windows. The only
//! unsafe code of the crate.
//!
//! Nothing here knows what a pass, a scene or a voxel is; [`crate::graph`] is the layer that users
//! program against.
#![allow(unsafe_code)]

mod adapter;
mod buffer;
mod command;
mod debug;
mod descriptor;
mod device;
mod driver;
mod error;
mod fault;
mod host;
mod image;
mod instance;
mod limits;
mod memory;
#[cfg(feature = "view")]
mod painter;
#[cfg(feature = "view")]
mod picture;
mod pipeline;
mod pipeline_cache;
mod query;
mod structure;
#[cfg(feature = "view")]
mod surface;
#[cfg(feature = "view")]
mod swapchain;

pub use adapter::{Adapter, Check, DeviceInfo, DeviceKind, Features, IMAGE_ATOMICS};
pub use ash::vk;
pub use buffer::{Buffer, BufferDesc, BufferUsage};
pub use debug::Messages;
pub use device::{Device, DeviceChoice};
pub use driver::Loops;
pub use error::Error;
#[doc(hidden)]
pub use fault::Faults;
pub use host::{Handover, HostCommands, HostDevice};
pub use image::{Image, ImageDesc, ImageKind, ImageUsage};
pub use instance::{Instance, InstanceOptions};
pub use limits::{Limits, NEEDED, Needed};
pub use memory::Owner;
#[cfg(feature = "view")]
#[doc(hidden)]
pub use painter::{ACQUIRED_BEFORE, capture_barrier, window_barriers};
pub use structure::{AccelerationStructure, StructureDesc, StructureKind};
#[cfg(feature = "view")]
pub use {
    painter::{Capture, Paint, Painter, Shown},
    picture::{PictureShaders, PlacedPicture},
    surface::Surface,
};

pub(crate) use command::{Attachment, Commands, ImageRegion, Rendering};
pub(crate) use descriptor::{Descriptor, DescriptorPool, Sampler, SamplerDesc, SetLayout};
pub(crate) use error::Context;
pub(crate) use pipeline::{GraphicsDesc, Pipeline, PipelineLayout};
pub(crate) use query::Timestamps;
pub(crate) use structure::RAY_QUERY;
