//! The logical device: one queue, its memory, and names for debuggers.

use std::ffi::CStr;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;

use super::adapter::RAY_QUERY_EXTENSIONS;
use super::fault::Planted;
use super::memory::Memory;
use super::pipeline_cache::PipelineCache;
use super::{Adapter, Context, Error, Faults, Instance, Owner, debug};

/// Which device to use.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The best usable one: discrete, then integrated, then virtual, then CPU.
    #[default]
    Best,
    /// By position in the list of `lumivox devices`.
    Index(usize),
    /// By a part of its name, in any case.
    Name(String),
}

impl From<&str> for DeviceChoice {
    /// A number is an index, anything else a name.
    fn from(text: &str) -> Self {
        text.parse()
            .map_or_else(|_| DeviceChoice::Name(text.to_owned()), DeviceChoice::Index)
    }
}

/// A logical device with one queue for everything.
pub struct Device {
    raw: ash::Device,
    /// Whoever submits or presents holds it: one at a time may.
    queue: Mutex<vk::Queue>,
    memory: Memory,
    names: Option<ash::ext::debug_utils::Device>,
    conditions: Option<ash::ext::conditional_rendering::Device>,
    structures: Option<ash::khr::acceleration_structure::Device>,
    adapter: Adapter,
    next_id: AtomicU64,
    retired: Mutex<Vec<u64>>,
    planted: Arc<Planted>,
    pipelines: PipelineCache,
    /// Whether it goes with this object.
    is_own: bool,
    instance: Arc<Instance>,
}

impl Device {
    /// Chooses and opens a device. Compiled pipelines are kept in `cache_dir`.
    pub fn new(
        instance: &Arc<Instance>,
        choice: &DeviceChoice,
        cache_dir: Option<&Path>,
    ) -> Result<Arc<Self>, Error> {
        let adapter = choose(instance.adapters()?, choice)?;
        Self::of(instance, adapter, (false, cache_dir))
    }

    pub(super) fn of(
        instance: &Arc<Instance>,
        adapter: Adapter,
        (presents, cache_dir): (bool, Option<&Path>),
    ) -> Result<Arc<Self>, Error> {
        let family = adapter.queue_family.unwrap_or(0);
        let raw = open(instance, &adapter, family, presents)?;
        // SAFETY: the device was made with one queue of this family.
        let queue = unsafe { raw.get_device_queue(family, 0) };
        Self::assemble(instance, adapter, (raw, queue, true), cache_dir)
    }

    /// Of a device, with its queue; `is_own`: it goes with this object.
    pub(super) fn assemble(
        instance: &Arc<Instance>,
        adapter: Adapter,
        (raw, queue, is_own): (ash::Device, vk::Queue, bool),
        cache_dir: Option<&Path>,
    ) -> Result<Arc<Self>, Error> {
        let planted = Arc::new(Planted::new(instance.faults().clone()));
        let memory = match Memory::new(instance, &raw, &adapter, &planted) {
            Ok(memory) => memory,
            Err(error) => {
                if is_own {
                    // SAFETY: nothing was made from the device yet.
                    unsafe { raw.destroy_device(None) };
                }
                return Err(error);
            }
        };
        let names = instance
            .has_debug_utils()
            .then(|| ash::ext::debug_utils::Device::new(instance.raw(), &raw));
        let conditions = adapter
            .features
            .conditional_rendering
            .then(|| ash::ext::conditional_rendering::Device::new(instance.raw(), &raw));
        let structures = adapter
            .features
            .ray_query
            .then(|| ash::khr::acceleration_structure::Device::new(instance.raw(), &raw));
        let (next_id, retired) = (AtomicU64::new(1), Mutex::new(Vec::new()));
        // SAFETY: the physical device is the instance's.
        let properties = unsafe { instance.raw().get_physical_device_properties(adapter.raw) };
        let pipelines = PipelineCache::new(&raw, &properties, cache_dir);
        Ok(Arc::new(Device {
            raw,
            queue: Mutex::new(queue),
            memory,
            names,
            conditions,
            structures,
            adapter,
            next_id,
            retired,
            planted,
            pipelines,
            is_own,
            instance: Arc::clone(instance),
        }))
    }

    /// The physical device behind this one.
    pub fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    /// The instance behind this device.
    pub fn instance(&self) -> &Arc<Instance> {
        &self.instance
    }

    /// Bytes in use as the allocator counts them.
    pub fn memory_allocated_bytes(&self) -> u64 {
        self.memory.allocated_bytes()
    }

    /// Bytes that buffers and images of the device itself may still take.
    pub fn memory_left_bytes(&self) -> u64 {
        self.memory.left_bytes()
    }

    /// Memory in use: name and bytes of every living resource.
    pub fn memory_in_use(&self) -> Vec<(String, u64)> {
        self.memory.list()
    }

    /// Bytes of every living resource that is counted for an owner.
    pub fn bytes_of(&self, owner: Owner) -> u64 {
        self.memory.bytes_of(owner)
    }

    /// Takes other faults; answers how many allocations were tried since the last time.
    pub(crate) fn plant(&self, faults: Faults) -> u64 {
        self.planted.plant(faults)
    }

    /// How many steps of the submission that is about to be recorded finish before the device is
    /// lost, where a test wants that.
    pub(crate) fn planted_loss(&self) -> Option<usize> {
        self.planted.loss()
    }

    /// What a test wants the driver to say to the next picture.
    #[cfg_attr(
        not(feature = "view"),
        allow(dead_code, reason = "only windows present")
    )]
    pub(super) fn planted_present(&self) -> Option<vk::Result> {
        self.planted.present()
    }

    /// Ids of resources that were dropped since the last call.
    pub(crate) fn take_retired(&self) -> Vec<u64> {
        std::mem::take(&mut *self.retired.lock().unwrap_or_else(PoisonError::into_inner))
    }

    pub(super) fn retire(&self, id: u64) {
        self.retired
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(id);
    }

    pub(super) fn new_id(&self) -> u64 {
        self.next_id.fetch_add(1, Ordering::Relaxed)
    }

    pub(super) fn raw(&self) -> &ash::Device {
        &self.raw
    }

    /// What pipelines are made with.
    pub(super) fn pipeline_cache(&self) -> vk::PipelineCache {
        self.pipelines.raw()
    }

    /// The queue, for as long as the guard lives.
    pub(super) fn queue(&self) -> MutexGuard<'_, vk::Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn queue_family(&self) -> u32 {
        self.adapter.queue_family.unwrap_or(0)
    }

    pub(super) fn memory(&self) -> &Memory {
        &self.memory
    }

    pub(super) fn debug_utils(&self) -> Option<&ash::ext::debug_utils::Device> {
        self.names.as_ref()
    }

    pub(super) fn conditions(&self) -> Option<&ash::ext::conditional_rendering::Device> {
        self.conditions.as_ref()
    }

    /// Functions of acceleration structures, where the device has ray queries.
    pub(super) fn structures(&self) -> Option<&ash::khr::acceleration_structure::Device> {
        self.structures.as_ref()
    }

    /// Names an object for validation messages and debuggers.
    pub(super) fn set_name(&self, handle: impl vk::Handle, name: &str) {
        if let Some(names) = &self.names {
            let name = debug::c_name(name);
            let info = vk::DebugUtilsObjectNameInfoEXT::default()
                .object_handle(handle)
                .object_name(&name);
            // SAFETY: the handle was made by this device. A failure only loses a name.
            let _ = unsafe { names.set_debug_utils_object_name(&info) };
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        for (name, bytes) in self.memory.list() {
            debug::report(
                self.instance.messages(),
                format!("leaked at exit: {name}, {bytes} bytes"),
            );
        }
        self.memory.close();
        self.pipelines.close(&self.raw);
        if self.is_own {
            // SAFETY: every object keeps its device alive, so none is left, and every submission
            // is waited for before what it uses goes.
            unsafe { self.raw.destroy_device(None) };
        }
    }
}

pub(super) fn choose(adapters: Vec<Adapter>, choice: &DeviceChoice) -> Result<Adapter, Error> {
    if adapters.is_empty() {
        return Err(Error::NoDevice);
    }
    let have = adapters
        .iter()
        .map(|adapter| format!("[{}] {}", adapter.index, adapter.info.name))
        .collect::<Vec<_>>()
        .join(", ");
    let (wanted, mut fitting): (String, Vec<Adapter>) = match choice {
        DeviceChoice::Best => ("a usable one".to_owned(), adapters),
        DeviceChoice::Index(index) => (
            format!("index {index}"),
            adapters
                .into_iter()
                .filter(|adapter| adapter.index == *index)
                .collect(),
        ),
        DeviceChoice::Name(name) => {
            let wanted = name.to_lowercase();
            (
                format!("\"{name}\""),
                adapters
                    .into_iter()
                    .filter(|adapter| adapter.info.name.to_lowercase().contains(&wanted))
                    .collect(),
            )
        }
    };
    fitting.sort_by_key(|adapter| {
        (
            !adapter.missing().is_empty(),
            adapter.info.kind,
            adapter.index,
        )
    });
    let Some(best) = fitting.into_iter().next() else {
        return Err(Error::DeviceNotFound { wanted, have });
    };
    let missing = best.missing();
    if missing.is_empty() {
        Ok(best)
    } else {
        Err(Error::DeviceRefused {
            name: best.info.name,
            missing: missing.join(", "),
        })
    }
}

fn open(
    instance: &Instance,
    adapter: &Adapter,
    family: u32,
    presents: bool,
) -> Result<ash::Device, Error> {
    let found = &adapter.features;
    // With robust access, nothing outside of a buffer or image is read or written. The check of
    // every access has to see such accesses happen, so it goes without.
    let is_robust = instance.is_validated() && !instance.checks_accesses();
    let base = vk::PhysicalDeviceFeatures::default()
        .fragment_stores_and_atomics(true)
        .shader_storage_image_extended_formats(true)
        .robust_buffer_access(is_robust)
        .full_draw_index_uint32(found.full_indices)
        .geometry_shader(found.geometry_shader)
        .sampler_anisotropy(found.sampler_anisotropy)
        .shader_int64(found.shader_int64);
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default()
        .host_query_reset(true)
        .buffer_device_address(found.ray_query);
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default()
        .dynamic_rendering(true)
        .synchronization2(true)
        .maintenance4(true)
        .robust_image_access(is_robust);
    let mut condition =
        vk::PhysicalDeviceConditionalRenderingFeaturesEXT::default().conditional_rendering(true);
    let mut structures =
        vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default().acceleration_structure(true);
    let mut queries = vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(true);
    let mut features = vk::PhysicalDeviceFeatures2::default()
        .features(base)
        .push_next(&mut v12)
        .push_next(&mut v13);
    let mut extensions = Vec::new();
    if found.conditional_rendering {
        features = features.push_next(&mut condition);
        extensions.push(vk::EXT_CONDITIONAL_RENDERING_NAME.as_ptr());
    }
    if found.conservative_rasterization {
        extensions.push(vk::EXT_CONSERVATIVE_RASTERIZATION_NAME.as_ptr());
    }
    if found.ray_query {
        features = features.push_next(&mut structures).push_next(&mut queries);
        extensions.extend(RAY_QUERY_EXTENSIONS.map(CStr::as_ptr));
    }
    if adapter.is_layered {
        extensions.push(vk::KHR_PORTABILITY_SUBSET_NAME.as_ptr());
    }
    if presents {
        extensions.push(vk::KHR_SWAPCHAIN_NAME.as_ptr());
    }
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(family)
        .queue_priorities(&[1.0])];
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .push_next(&mut features);
    // SAFETY: everything that is enabled was found present, and all pointers live until the end of
    // this function.
    unsafe { instance.raw().create_device(adapter.raw, &info, None) }.during("opening the device")
}
