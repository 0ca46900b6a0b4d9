//! Buffers.

use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use super::{Context, Device, Error, Owner};

/// What a buffer is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BufferUsage {
    /// Storage in device memory; also source and destination of copies, arguments of indirect
    /// work, and indices of draws.
    Storage,
    /// Small constants in device memory, which come with the commands of a frame.
    Uniform,
    /// Constants that the host writes once, before anything reads them.
    Table,
    /// Written by copies, read by the host.
    Readback,
    /// Written by the host, source of copies.
    Staging,
    /// An acceleration structure, or what the device needs besides while it builds one.
    Structure,
    /// Written by the host; what an acceleration structure is built from.
    StructureInput,
}

/// A buffer to make.
#[derive(Clone, Debug)]
pub struct BufferDesc {
    /// Name for reports, errors and debuggers.
    pub name: String,
    /// Size (bytes); may be 0.
    pub size_bytes: u64,
    /// What it is for.
    pub usage: BufferUsage,
    /// What it is counted for.
    pub owner: Owner,
}

/// A buffer and its memory; freed when the last owner drops it.
pub struct Buffer {
    raw: vk::Buffer,
    allocation: Mutex<Option<Allocation>>,
    id: u64,
    name: String,
    size_bytes: u64,
    usage: BufferUsage,
    owner: Owner,
    device: Arc<Device>,
}

impl Buffer {
    /// Makes a buffer; a size beyond what the device can hold or bind is an error with the numbers.
    pub fn new(device: &Arc<Device>, desc: &BufferDesc) -> Result<Arc<Self>, Error> {
        let limits = &device.adapter().limits;
        let (limit, available) = match desc.usage {
            BufferUsage::Storage => ("maxStorageBufferRange", limits.storage_buffer_bytes),
            BufferUsage::Uniform | BufferUsage::Table => {
                ("maxUniformBufferRange", limits.uniform_buffer_bytes)
            }
            BufferUsage::Readback
            | BufferUsage::Staging
            | BufferUsage::Structure
            | BufferUsage::StructureInput => ("maxMemoryAllocationSize", limits.allocation_bytes),
        };
        if desc.size_bytes > available {
            return Err(Error::TooLarge {
                resource: desc.name.clone(),
                wanted: desc.size_bytes,
                available,
                limit,
            });
        }
        device
            .memory()
            .check(&desc.name, desc.size_bytes, location(desc.usage))?;
        let info = vk::BufferCreateInfo::default()
            .size(padded(desc.size_bytes))
            .usage(usage_flags(device, desc.usage));
        // SAFETY: the device is alive and the size is neither zero nor beyond its limits.
        let raw = unsafe { device.raw().create_buffer(&info, None) }
            .during(&format!("creating the buffer {}", desc.name))?;
        let mut buffer = Buffer {
            raw,
            allocation: Mutex::new(None),
            id: device.new_id(),
            name: desc.name.clone(),
            size_bytes: desc.size_bytes,
            usage: desc.usage,
            owner: desc.owner,
            device: Arc::clone(device),
        };
        buffer.bind_memory()?;
        device.set_name(raw, &desc.name);
        Ok(Arc::new(buffer))
    }

    /// Name for reports, errors and debuggers.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Size as asked for (bytes).
    pub fn size_bytes(&self) -> u64 {
        self.size_bytes
    }

    /// What it is for.
    pub fn usage(&self) -> BufferUsage {
        self.usage
    }

    pub(crate) fn id(&self) -> u64 {
        self.id
    }

    pub(crate) fn raw(&self) -> vk::Buffer {
        self.raw
    }

    /// Where the device has it; of buffers of acceleration structures alone.
    pub(super) fn address(&self) -> u64 {
        let info = vk::BufferDeviceAddressInfo::default().buffer(self.raw);
        // SAFETY: the buffer is alive and was made with an address.
        unsafe { self.device.raw().get_buffer_device_address(&info) }
    }

    /// Copies host bytes in; the buffer must be host visible, and not in use by the device.
    pub(crate) fn write_mapped(&self, offset: u64, bytes: &[u8]) {
        let mut allocation = self
            .allocation
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let mapped = allocation.as_mut().and_then(Allocation::mapped_slice_mut);
        let start = usize::try_from(offset).unwrap_or(usize::MAX);
        let target =
            mapped.and_then(|mapped| mapped.get_mut(start..start.checked_add(bytes.len())?));
        assert!(
            target.is_some(),
            "buffer {}: {} bytes at {offset} cannot be written by the host",
            self.name,
            bytes.len()
        );
        if let Some(target) = target {
            target.copy_from_slice(bytes);
        }
    }

    /// Copies the contents out; the buffer must be host visible, and not in use by the device.
    pub(crate) fn read_mapped(&self) -> Vec<u8> {
        let allocation = self
            .allocation
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let mapped = allocation.as_ref().and_then(Allocation::mapped_slice);
        let bytes = mapped.and_then(|mapped| mapped.get(..usize::try_from(self.size_bytes).ok()?));
        assert!(
            bytes.is_some(),
            "buffer {} cannot be read by the host",
            self.name
        );
        bytes.unwrap_or_default().to_vec()
    }

    fn bind_memory(&mut self) -> Result<(), Error> {
        // SAFETY: the buffer is alive.
        let requirements = unsafe { self.device.raw().get_buffer_memory_requirements(self.raw) };
        let allocation = self.device.memory().allocate(
            self.id,
            (&self.name, self.owner),
            requirements,
            location(self.usage),
            true,
        )?;
        // SAFETY: the memory fits the requirements, and is freed only after the buffer.
        let bound = unsafe {
            self.device
                .raw()
                .bind_buffer_memory(self.raw, allocation.memory(), allocation.offset())
        };
        *self
            .allocation
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner) = Some(allocation);
        bound.during(&format!("binding memory of the buffer {}", self.name))
    }
}

/// The kind of memory that a buffer lies in.
fn location(usage: BufferUsage) -> MemoryLocation {
    match usage {
        BufferUsage::Storage | BufferUsage::Uniform | BufferUsage::Structure => {
            MemoryLocation::GpuOnly
        }
        BufferUsage::Table | BufferUsage::Staging | BufferUsage::StructureInput => {
            MemoryLocation::CpuToGpu
        }
        BufferUsage::Readback => MemoryLocation::GpuToCpu,
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: frames own what they use and are waited for, so the device no longer uses the
        // buffer.
        unsafe { self.device.raw().destroy_buffer(self.raw, None) };
        if let Some(allocation) = self
            .allocation
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner)
            .take()
        {
            self.device.memory().free(self.id, allocation);
        }
        self.device.retire(self.id);
    }
}

/// Whole words, at least one: Vulkan has no empty buffers, and fills count in words.
fn padded(size_bytes: u64) -> u64 {
    size_bytes.max(4).next_multiple_of(4)
}

fn usage_flags(device: &Device, usage: BufferUsage) -> vk::BufferUsageFlags {
    let copies = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
    let conditions = if device.adapter().features.conditional_rendering {
        vk::BufferUsageFlags::CONDITIONAL_RENDERING_EXT
    } else {
        vk::BufferUsageFlags::empty()
    };
    match usage {
        BufferUsage::Storage => {
            copies
                | conditions
                | vk::BufferUsageFlags::STORAGE_BUFFER
                | vk::BufferUsageFlags::INDIRECT_BUFFER
                | vk::BufferUsageFlags::INDEX_BUFFER
        }
        BufferUsage::Uniform => {
            vk::BufferUsageFlags::TRANSFER_DST | vk::BufferUsageFlags::UNIFORM_BUFFER
        }
        BufferUsage::Table => vk::BufferUsageFlags::UNIFORM_BUFFER,
        BufferUsage::Readback => vk::BufferUsageFlags::TRANSFER_DST,
        BufferUsage::Staging => vk::BufferUsageFlags::TRANSFER_SRC,
        BufferUsage::Structure => {
            vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR
                | vk::BufferUsageFlags::STORAGE_BUFFER
                | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS
        }
        BufferUsage::StructureInput => {
            vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR
                | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS
        }
    }
}
