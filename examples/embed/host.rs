//! The other program: an instance, a device and a queue, an image and a command buffer, made with
//! `ash` and without Lumivox.

use std::ffi::{CStr, c_void};
use std::sync::Mutex;

use ash::vk;

/// What went wrong, in words.
pub type Failure = Box<dyn std::error::Error>;

/// What the validation layer says, where it is asked for.
static MESSAGES: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// A program with a device of its own.
pub struct Host {
    pub entry: ash::Entry,
    pub instance: ash::Instance,
    pub physical_device: vk::PhysicalDevice,
    pub device: ash::Device,
    pub queue_family: u32,
    pub queue: vk::Queue,
    memory: vk::PhysicalDeviceMemoryProperties,
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    messenger: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
}

/// An image that the host reads.
pub struct Target {
    pub image: vk::Image,
    memory: vk::DeviceMemory,
    buffer: vk::Buffer,
    buffer_memory: vk::DeviceMemory,
    bytes: u64,
    size: [u32; 2],
}

impl Host {
    /// Opens the first device that there is. `validates`: with the validation layer, which has to
    /// be installed then.
    pub fn new(validates: bool) -> Result<Self, Failure> {
        // SAFETY: each handle is made from the one before it, with structs that live until then;
        // the features and the queue are those that Lumivox needs of every device.
        unsafe {
            let entry = ash::Entry::load()?;
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let layers = [c"VK_LAYER_KHRONOS_validation".as_ptr()];
            let extensions = [
                vk::EXT_DEBUG_UTILS_NAME.as_ptr(),
                vk::EXT_VALIDATION_FEATURES_NAME.as_ptr(),
            ];
            let count = if validates { 2 } else { 0 };
            let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
            let mut checks =
                vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
            let mut info = vk::InstanceCreateInfo::default()
                .application_info(&application)
                .enabled_layer_names(&layers[..count / 2])
                .enabled_extension_names(&extensions[..count]);
            if validates {
                info = info.push_next(&mut checks);
            }
            let instance = entry.create_instance(&info, None)?;
            let messenger = if validates {
                let loader = ash::ext::debug_utils::Instance::new(&entry, &instance);
                let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
                    .message_severity(
                        vk::DebugUtilsMessageSeverityFlagsEXT::WARNING
                            | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
                    )
                    .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
                    .pfn_user_callback(Some(collect));
                let raw = loader.create_debug_utils_messenger(&info, None)?;
                Some((loader, raw))
            } else {
                None
            };
            let devices = instance.enumerate_physical_devices()?;
            let physical_device = *devices.first().ok_or("there is no Vulkan device")?;
            let families = instance.get_physical_device_queue_family_properties(physical_device);
            let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
            let family = families
                .iter()
                .position(|family| family.queue_flags.contains(wanted))
                .ok_or("no queue draws and computes")?;
            let queue_family = u32::try_from(family)?;
            let base = vk::PhysicalDeviceFeatures::default()
                .fragment_stores_and_atomics(true)
                .shader_storage_image_extended_formats(true);
            let mut v12 = vk::PhysicalDeviceVulkan12Features::default().host_query_reset(true);
            let mut v13 = vk::PhysicalDeviceVulkan13Features::default()
                .dynamic_rendering(true)
                .synchronization2(true)
                .maintenance4(true);
            let mut features = vk::PhysicalDeviceFeatures2::default()
                .features(base)
                .push_next(&mut v12)
                .push_next(&mut v13);
            let queues = [vk::DeviceQueueCreateInfo::default()
                .queue_family_index(queue_family)
                .queue_priorities(&[1.0])];
            let info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .push_next(&mut features);
            let device = instance.create_device(physical_device, &info, None)?;
            let info = vk::CommandPoolCreateInfo::default()
                .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER)
                .queue_family_index(queue_family);
            let pool = device.create_command_pool(&info, None)?;
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(pool)
                .command_buffer_count(1);
            let commands = device.allocate_command_buffers(&info)?;
            Ok(Host {
                memory: instance.get_physical_device_memory_properties(physical_device),
                queue: device.get_device_queue(queue_family, 0),
                commands: *commands.first().ok_or("no command buffer")?,
                entry,
                instance,
                physical_device,
                device,
                queue_family,
                pool,
                messenger,
            })
        }
    }

    /// An image of this size (px) of RGBA floats of 32 bits.
    pub fn target(&self, size: [u32; 2]) -> Result<Target, Failure> {
        let [width, height] = size;
        let bytes = 16 * u64::from(width) * u64::from(height);
        // SAFETY: image and buffer are bound to memory of their own that fits them.
        unsafe {
            let info = vk::ImageCreateInfo::default()
                .image_type(vk::ImageType::TYPE_2D)
                .format(vk::Format::R32G32B32A32_SFLOAT)
                .extent(vk::Extent3D {
                    width,
                    height,
                    depth: 1,
                })
                .mip_levels(1)
                .array_layers(1)
                .samples(vk::SampleCountFlags::TYPE_1)
                .usage(vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC);
            let image = self.device.create_image(&info, None)?;
            let needs = self.device.get_image_memory_requirements(image);
            let memory = self.allocate(needs, vk::MemoryPropertyFlags::DEVICE_LOCAL)?;
            self.device.bind_image_memory(image, memory, 0)?;
            let info = vk::BufferCreateInfo::default()
                .size(bytes)
                .usage(vk::BufferUsageFlags::TRANSFER_DST);
            let buffer = self.device.create_buffer(&info, None)?;
            let needs = self.device.get_buffer_memory_requirements(buffer);
            let visible =
                vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            let buffer_memory = self.allocate(needs, visible)?;
            self.device.bind_buffer_memory(buffer, buffer_memory, 0)?;
            Ok(Target {
                image,
                memory,
                buffer,
                buffer_memory,
                bytes,
                size,
            })
        }
    }

    unsafe fn allocate(
        &self,
        needs: vk::MemoryRequirements,
        wanted: vk::MemoryPropertyFlags,
    ) -> Result<vk::DeviceMemory, Failure> {
        let types = self.memory.memory_types_as_slice().iter().enumerate();
        let fits = |(index, kind): &(usize, &vk::MemoryType)| {
            needs.memory_type_bits >> index & 1 != 0 && kind.property_flags.contains(wanted)
        };
        let (index, _) = types.into_iter().find(fits).ok_or("no such memory")?;
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(needs.size)
            .memory_type_index(u32::try_from(index)?);
        // SAFETY: the type is one of the device's.
        Ok(unsafe { self.device.allocate_memory(&info, None) }?)
    }

    /// The program's frame: what `draw` records writes the target, which is in the layout for
    /// copies from it then; the program reads it. Returns the texels. What `draw` has returned
    /// lives until the frame is done.
    pub fn frame<T>(
        &self,
        target: &Target,
        draw: impl FnOnce(vk::CommandBuffer) -> Result<T, Failure>,
    ) -> Result<Vec<[f32; 4]>, Failure> {
        let device = &self.device;
        // SAFETY: the last frame was waited for; what the commands use lives until they are done.
        unsafe {
            let info = vk::CommandBufferBeginInfo::default()
                .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            device.begin_command_buffer(self.commands, &info)?;
            let drawn = draw(self.commands)?;
            let [width, height] = target.size;
            let region = vk::BufferImageCopy::default()
                .image_subresource(
                    vk::ImageSubresourceLayers::default()
                        .aspect_mask(vk::ImageAspectFlags::COLOR)
                        .layer_count(1),
                )
                .image_extent(vk::Extent3D {
                    width,
                    height,
                    depth: 1,
                });
            device.cmd_copy_image_to_buffer(
                self.commands,
                target.image,
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                target.buffer,
                &[region],
            );
            let barrier = [vk::MemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::COPY)
                .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
                .dst_stage_mask(vk::PipelineStageFlags2::HOST)
                .dst_access_mask(vk::AccessFlags2::HOST_READ)];
            let info = vk::DependencyInfo::default().memory_barriers(&barrier);
            device.cmd_pipeline_barrier2(self.commands, &info);
            device.end_command_buffer(self.commands)?;
            let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
            let submit = vk::SubmitInfo2::default().command_buffer_infos(&buffers);
            device.queue_submit2(self.queue, &[submit], vk::Fence::null())?;
            device.queue_wait_idle(self.queue)?;
            drop(drawn);
            let flags = vk::MemoryMapFlags::empty();
            let mapped = device.map_memory(target.buffer_memory, 0, target.bytes, flags)?;
            let texels =
                std::slice::from_raw_parts(mapped.cast::<[f32; 4]>(), (width * height) as usize);
            let texels = texels.to_vec();
            device.unmap_memory(target.buffer_memory);
            Ok(texels)
        }
    }

    /// Destroys a target.
    pub fn destroy(&self, target: &Target) {
        // SAFETY: all frames were waited for.
        unsafe {
            self.device.destroy_image(target.image, None);
            self.device.free_memory(target.memory, None);
            self.device.destroy_buffer(target.buffer, None);
            self.device.free_memory(target.buffer_memory, None);
        }
    }

    /// Destroys everything, and gives what the validation layer has said.
    pub fn end(self) -> Vec<String> {
        // SAFETY: all frames were waited for, and nothing that was made of these is left.
        unsafe {
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
            if let Some((loader, messenger)) = &self.messenger {
                loader.destroy_debug_utils_messenger(*messenger, None);
            }
            self.instance.destroy_instance(None);
        }
        MESSAGES
            .lock()
            .map_or_else(|_| Vec::new(), |messages| messages.clone())
    }
}

unsafe extern "system" fn collect(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    _user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid data with a message.
    let message = unsafe { CStr::from_ptr((*data).p_message) };
    if let Ok(mut messages) = MESSAGES.lock() {
        messages.push(message.to_string_lossy().into_owned());
    }
    vk::FALSE
}
