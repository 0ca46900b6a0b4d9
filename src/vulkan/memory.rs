//! Device memory: sub-allocated, every allocation named, and counted by name.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;
use gpu_allocator::vulkan::{
    Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc,
};
use gpu_allocator::{AllocationError, AllocationSizes, MemoryLocation};

use super::fault::Planted;
use super::{Adapter, Error, Instance};

const MIB: u64 = 1 << 20;

/// As a float −4.3·10⁸, as a half −23, as a count more than there is of anything.
const POISON: u8 = 0xCD;

/// What a resource is counted for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// What every technique has: the scene, light maps, the G-buffer, the pictures.
    Shared,
    /// What a technique keeps in the world.
    Store,
    /// What else a technique has, such as images of the size of the screen.
    Screen,
}

/// One living allocation.
struct Entry {
    name: String,
    owner: Owner,
    /// Index of the heap.
    heap: usize,
    bytes: u64,
}

/// The allocator and its ledger.
pub(super) struct Memory {
    allocator: Mutex<Option<Allocator>>,
    ledger: Mutex<BTreeMap<u64, Entry>>,
    properties: vk::PhysicalDeviceMemoryProperties,
    /// Bytes that a heap is taken to have at most.
    heap_bytes: u64,
    allocation_bytes: u64,
    poisons: bool,
    planted: Arc<Planted>,
}

impl Memory {
    pub(super) fn new(
        instance: &Instance,
        device: &ash::Device,
        adapter: &Adapter,
        planted: &Arc<Planted>,
    ) -> Result<Self, Error> {
        let description = AllocatorCreateDesc {
            instance: instance.raw().clone(),
            device: device.clone(),
            physical_device: adapter.raw,
            debug_settings: Default::default(),
            buffer_device_address: adapter.features.ray_query,
            allocation_sizes: AllocationSizes::new(32 * MIB, 8 * MIB),
        };
        let allocator = Allocator::new(&description).map_err(|error| Error::Vulkan {
            what: format!("opening the memory allocator: {error}"),
            result: vk::Result::ERROR_INITIALIZATION_FAILED,
        })?;
        let (allocator, allocation_bytes) =
            (Mutex::new(Some(allocator)), adapter.limits.allocation_bytes);
        let (poisons, planted) = (instance.poisons(), Arc::clone(planted));
        Ok(Memory {
            allocator,
            ledger: Mutex::default(),
            properties: adapter.memory,
            heap_bytes: adapter.limits.heap_bytes,
            allocation_bytes,
            poisons,
            planted,
        })
    }

    /// Allocates for the resource `id`; refuses, before asking the driver, what cannot fit.
    pub(super) fn allocate(
        &self,
        id: u64,
        (name, owner): (&str, Owner),
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation, Error> {
        let heap = heap_of(&self.properties, requirements.memory_type_bits, location);
        self.check_in(heap, name, requirements.size)?;
        let description = AllocationCreateDesc {
            name,
            requirements,
            location,
            linear,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let result = match self.allocator().as_mut() {
            Some(allocator) if !self.planted.fails_allocation() => allocator.allocate(&description),
            _ => Err(AllocationError::OutOfMemory),
        };
        match result {
            Ok(mut allocation) => {
                if self.poisons {
                    allocation
                        .mapped_slice_mut()
                        .unwrap_or_default()
                        .fill(POISON);
                }
                self.ledger().insert(
                    id,
                    Entry {
                        name: name.to_owned(),
                        owner,
                        heap,
                        bytes: allocation.size(),
                    },
                );
                Ok(allocation)
            }
            Err(AllocationError::OutOfMemory) => {
                Err(self.out_of_memory(heap, name, requirements.size))
            }
            Err(error) => Err(Error::Vulkan {
                what: format!("{name}: allocating {} bytes: {error}", requirements.size),
                result: vk::Result::ERROR_UNKNOWN,
            }),
        }
    }

    /// Whether `bytes` of a kind of memory can be had at all.
    pub(super) fn check(
        &self,
        name: &str,
        bytes: u64,
        location: MemoryLocation,
    ) -> Result<(), Error> {
        let heap = heap_of(&self.properties, u32::MAX, location);
        self.check_in(heap, name, bytes)
    }

    fn check_in(&self, heap: usize, name: &str, bytes: u64) -> Result<(), Error> {
        if bytes > self.allocation_bytes {
            return Err(Error::TooLarge {
                resource: name.to_owned(),
                wanted: bytes,
                available: self.allocation_bytes,
                limit: "maxMemoryAllocationSize",
            });
        }
        if bytes > self.available(heap) {
            Err(self.out_of_memory(heap, name, bytes))
        } else {
            Ok(())
        }
    }

    pub(super) fn free(&self, id: u64, allocation: Allocation) {
        self.ledger().remove(&id);
        if let Some(allocator) = self.allocator().as_mut()
            && let Err(error) = allocator.free(allocation)
        {
            log::error!("freeing memory: {error}");
        }
    }

    /// Name and bytes of everything alive, in order of creation.
    pub(super) fn list(&self) -> Vec<(String, u64)> {
        self.ledger()
            .values()
            .map(|entry| (entry.name.clone(), entry.bytes))
            .collect()
    }

    /// Bytes of everything alive that is counted for an owner.
    pub(super) fn bytes_of(&self, owner: Owner) -> u64 {
        let ledger = self.ledger();
        let owned = ledger.values().filter(|entry| entry.owner == owner);
        owned.map(|entry| entry.bytes).sum()
    }

    /// Bytes in use as the allocator counts them, which is not how [`Memory::list`] does.
    pub(super) fn allocated_bytes(&self) -> u64 {
        self.allocator().as_ref().map_or(0, |allocator| {
            allocator.generate_report().total_allocated_bytes
        })
    }

    /// Gives all memory back; right before the device is destroyed.
    pub(super) fn close(&self) {
        drop(self.allocator().take());
    }

    /// Bytes left in the heap that buffers and images of the device itself come from.
    pub(super) fn left_bytes(&self) -> u64 {
        self.available(heap_of(&self.properties, u32::MAX, MemoryLocation::GpuOnly))
    }

    /// Bytes left in a heap.
    fn available(&self, heap: usize) -> u64 {
        let heaps = self.properties.memory_heaps_as_slice();
        let bytes = heaps.get(heap).map_or(0, |heap| heap.size);
        let ledger = self.ledger();
        let used = ledger.values().filter(|entry| entry.heap == heap);
        bytes
            .min(self.heap_bytes)
            .saturating_sub(used.map(|entry| entry.bytes).sum())
    }

    fn out_of_memory(&self, heap: usize, name: &str, wanted: u64) -> Error {
        Error::OutOfMemory {
            resource: name.to_owned(),
            wanted,
            available: self.available(heap),
        }
    }

    fn allocator(&self) -> MutexGuard<'_, Option<Allocator>> {
        self.allocator
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    fn ledger(&self) -> MutexGuard<'_, BTreeMap<u64, Entry>> {
        self.ledger.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The heap that the allocator takes memory of a kind from: that of the first type with all
/// properties that it prefers, else of the first that it can do with.
fn heap_of(
    properties: &vk::PhysicalDeviceMemoryProperties,
    type_bits: u32,
    location: MemoryLocation,
) -> usize {
    use vk::MemoryPropertyFlags as Flags;
    let host = Flags::HOST_VISIBLE | Flags::HOST_COHERENT;
    let (preferred, needed) = match location {
        MemoryLocation::CpuToGpu => (host | Flags::DEVICE_LOCAL, host),
        MemoryLocation::GpuToCpu => (host | Flags::HOST_CACHED, host),
        MemoryLocation::GpuOnly | MemoryLocation::Unknown => (Flags::DEVICE_LOCAL, Flags::empty()),
    };
    let types = properties.memory_types_as_slice();
    let find = |wanted: Flags| {
        (0u32..)
            .zip(types)
            .find(|(index, kind)| {
                type_bits & (1 << index) != 0 && kind.property_flags.contains(wanted)
            })
            .map(|(_, kind)| kind.heap_index as usize)
    };
    find(preferred).or_else(|| find(needed)).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As of a discrete GPU: memory of its own, the host's, and a small window on its own.
    #[test]
    fn each_kind_of_memory_has_its_heap() {
        use vk::MemoryPropertyFlags as Flags;
        let host = Flags::HOST_VISIBLE | Flags::HOST_COHERENT;
        let mut properties = vk::PhysicalDeviceMemoryProperties::default();
        let types = [
            (Flags::DEVICE_LOCAL, 0),
            (host, 1),
            (host | Flags::HOST_CACHED, 1),
            (host | Flags::DEVICE_LOCAL, 2),
        ];
        properties.memory_type_count = types.len() as u32;
        for (slot, (property_flags, heap_index)) in properties.memory_types.iter_mut().zip(types) {
            (slot.property_flags, slot.heap_index) = (property_flags, heap_index);
        }
        let heap = |bits, location| heap_of(&properties, bits, location);
        assert_eq!(heap(u32::MAX, MemoryLocation::GpuOnly), 0);
        assert_eq!(heap(u32::MAX, MemoryLocation::GpuToCpu), 1);
        assert_eq!(heap(u32::MAX, MemoryLocation::CpuToGpu), 2);
        assert_eq!(heap(0b0111, MemoryLocation::CpuToGpu), 1);
    }
}
