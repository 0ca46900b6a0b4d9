//! The sizes and counts that a device allows at most, and those that passes need.

use ash::vk;

/// Limits that decide what can be built.
#[derive(Clone, Debug, Default)]
pub struct Limits {
    /// Largest part of a storage buffer that a shader can see (bytes).
    pub storage_buffer_bytes: u64,
    /// Largest uniform buffer (bytes).
    pub uniform_buffer_bytes: u64,
    /// Largest single allocation (bytes).
    pub allocation_bytes: u64,
    /// Size of the largest device-local memory heap (bytes).
    pub heap_bytes: u64,
    /// Largest extent of a 3D image (texels).
    pub extent_3d: u32,
    /// Largest extent of a 2D image (texels).
    pub extent_2d: u32,
    /// Duration of one timestamp tick (ns).
    pub timestamp_period_ns: f32,
    /// Bits of a timestamp that count; the others are to be left out.
    pub timestamp_bits: u32,
    /// Alignment of what the device needs while it builds an acceleration structure (bytes); 0
    /// where it has none.
    pub scratch_alignment: u64,
}

impl Limits {
    /// As the device tells them.
    pub(super) fn new(
        limits: &vk::PhysicalDeviceLimits,
        memory: &vk::PhysicalDeviceMemoryProperties,
    ) -> Self {
        let local = |heap: &&vk::MemoryHeap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL);
        let heaps = memory.memory_heaps_as_slice().iter();
        Limits {
            storage_buffer_bytes: limits.max_storage_buffer_range.into(),
            uniform_buffer_bytes: limits.max_uniform_buffer_range.into(),
            // Of Vulkan 1.1, and read where the device has that.
            allocation_bytes: u64::MAX,
            heap_bytes: heaps.filter(local).map(|heap| heap.size).max().unwrap_or(0),
            extent_3d: limits.max_image_dimension3_d,
            extent_2d: limits.max_image_dimension2_d,
            timestamp_period_ns: limits.timestamp_period,
            timestamp_bits: 0,
            scratch_alignment: 0,
        }
    }

    /// No more than every device of Vulkan 1.3 allows.
    pub(super) fn clamp(&mut self) {
        let least = [
            (&mut self.storage_buffer_bytes, 1 << 27),
            (&mut self.uniform_buffer_bytes, 1 << 14),
            (&mut self.allocation_bytes, 1 << 30),
        ];
        for (limit, least) in least {
            *limit = least.min(*limit);
        }
        for (limit, least) in [(&mut self.extent_3d, 256), (&mut self.extent_2d, 4096)] {
            *limit = least.min(*limit);
        }
    }
}

/// A limit that passes need more of than every device of Vulkan 1.3 has to allow.
#[derive(Clone, Copy)]
pub struct Needed {
    /// Name of the limit, as in the Vulkan specification.
    pub name: &'static str,
    /// As much as some pass has.
    pub least: u32,
    /// What a device allows.
    pub(super) of: fn(&vk::PhysicalDeviceLimits) -> u32,
}

/// All of them.
pub const NEEDED: [Needed; 5] = [
    Needed {
        name: "maxPerStageDescriptorStorageBuffers",
        least: 19,
        of: |limits| limits.max_per_stage_descriptor_storage_buffers,
    },
    Needed {
        name: "maxPerStageDescriptorStorageImages",
        least: 9,
        of: |limits| limits.max_per_stage_descriptor_storage_images,
    },
    Needed {
        name: "maxPerStageDescriptorSampledImages",
        least: 18,
        of: |limits| limits.max_per_stage_descriptor_sampled_images,
    },
    Needed {
        name: "maxColorAttachments",
        least: 7,
        of: |limits| limits.max_color_attachments,
    },
    Needed {
        name: "maxComputeWorkGroupInvocations",
        least: 256,
        of: |limits| limits.max_compute_work_group_invocations,
    },
];
