//! Devices, images and command buffers that another program has made, and keeps.

use std::path::Path;
use std::sync::Arc;

use ash::vk;

use super::{Adapter, Commands, Device, Error, Features, Image, ImageDesc, Instance};

/// A device of another program.
pub struct HostDevice {
    /// The loader that the instance came from.
    pub entry: ash::Entry,
    /// The instance, of Vulkan 1.3.
    pub instance: ash::Instance,
    /// The physical device.
    pub physical_device: vk::PhysicalDevice,
    /// The device, with all of [`HostDevice::REQUIRED`].
    pub device: ash::Device,
    /// A family of queues with graphics, compute and timestamps.
    pub queue_family: u32,
    /// A queue of it.
    pub queue: vk::Queue,
    /// The optional features that the device was made with, extensions included; those that are set
    /// here and that the physical device lacks count as missing.
    pub enabled: Features,
}

impl HostDevice {
    /// The features that a device is made with, by their names in the Vulkan specification.
    pub const REQUIRED: [&str; 6] = [
        "dynamicRendering",
        "synchronization2",
        "maintenance4",
        "hostQueryReset",
        "fragmentStoresAndAtomics",
        "shaderStorageImageExtendedFormats",
    ];
}

impl Device {
    /// Works on a device of another program. Compiled pipelines are kept in `cache_dir`.
    ///
    /// # Safety
    /// All handles are alive, belong together and outlive this object and all that is made from it;
    /// the device has the features that [`HostDevice`] says. Nobody else uses the queue while a
    /// method of [`crate::graph::Gpu`] runs that submits.
    pub unsafe fn from_ash(host: HostDevice, cache_dir: Option<&Path>) -> Result<Arc<Self>, Error> {
        let instance = Instance::of_host(host.entry, host.instance);
        let mut adapter = Adapter::new(instance.raw(), host.physical_device, 0, instance.faults());
        adapter.work_with(host.queue_family, &host.enabled);
        let missing = adapter.missing();
        if !missing.is_empty() {
            return Err(Error::DeviceRefused {
                missing: missing.join(", "),
                name: adapter.info.name,
            });
        }
        let made = (host.device, host.queue, false);
        Device::assemble(&instance, adapter, made, cache_dir)
    }
}

impl Image {
    /// An image of another program, to be handed over with [`Handover`]; `desc` says how it was
    /// made.
    ///
    /// # Safety
    /// The image is as `desc` says, is of this device, and outlives what is recorded with it.
    pub unsafe fn from_ash(device: &Arc<Device>, raw: vk::Image, desc: &ImageDesc) -> Arc<Self> {
        Image::of_host(device, raw, desc)
    }
}

/// A command buffer of another program, to record into.
pub struct HostCommands(pub(crate) Commands);

impl HostCommands {
    /// Of a command buffer that is being recorded, outside of a rendering scope.
    ///
    /// # Safety
    /// It stays in that state for as long as this object is used, nobody else records into it
    /// meanwhile, and it is of the device's family of queues.
    pub unsafe fn from_ash(device: &Arc<Device>, raw: vk::CommandBuffer) -> Self {
        HostCommands(Commands::of_host(device, raw))
    }
}

/// An image of another program that commands are to write.
///
/// What was done with it before is waited for by a barrier after all commands and all their
/// accesses. A barrier behind makes what was written visible to all commands that follow.
#[derive(Clone)]
pub struct Handover {
    /// The image, of one mip and layer, made to be the destination of copies.
    pub image: Arc<Image>,
    /// The layout that it is in when the commands begin; `UNDEFINED` where its contents may go.
    pub before: vk::ImageLayout,
    /// The layout that it is left in.
    pub after: vk::ImageLayout,
}
