//! What a physical device is and can do, and why it may be refused.

use std::ffi::CStr;

use ash::vk;

use super::driver::Loops;
use super::fault::Faults;
use super::limits::{Limits, NEEDED};
use super::structure::RAY_QUERY;

/// The extensions of ray queries.
pub(super) const RAY_QUERY_EXTENSIONS: [&CStr; 3] = [
    vk::KHR_ACCELERATION_STRUCTURE_NAME,
    vk::KHR_RAY_QUERY_NAME,
    vk::KHR_DEFERRED_HOST_OPERATIONS_NAME,
];

/// The kind of a device; earlier is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A graphics card.
    Discrete,
    /// A GPU in the processor.
    Integrated,
    /// A GPU seen through a virtual machine.
    Virtual,
    /// A renderer that runs on the CPU.
    Cpu,
    /// Anything else that Vulkan reports.
    Other,
}

impl std::fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            DeviceKind::Discrete => "graphics card",
            DeviceKind::Integrated => "GPU in the processor",
            DeviceKind::Virtual => "GPU of a virtual machine",
            DeviceKind::Cpu => "renders on the CPU",
            DeviceKind::Other => "kind unknown",
        })
    }
}

/// What a device calls itself.
#[derive(Clone, Debug)]
pub struct DeviceInfo {
    /// Name of the device.
    pub name: String,
    /// Kind of the device.
    pub kind: DeviceKind,
    /// Driver and its version.
    pub driver: String,
    /// Vulkan version.
    pub api_version: String,
}

/// Atomics in 3D images of 32-bit integers, by the name in `lumivox devices`.
pub const IMAGE_ATOMICS: &str = "r32ui 3D storage images with atomics";

/// One feature, and what it costs not to have it.
#[derive(Clone, Debug)]
pub struct Check {
    /// Name of the feature, as in the Vulkan specification.
    pub name: &'static str,
    /// Whether the device has it.
    pub present: bool,
    /// What its absence costs.
    pub cost: String,
}

/// Optional features, enabled where present.
#[derive(Clone, Debug, Default)]
pub struct Features {
    /// Geometry shaders, and `gl_PrimitiveID` in fragment shaders.
    pub geometry_shader: bool,
    /// Indices of draws beyond 2²⁴ − 1.
    pub full_indices: bool,
    /// Anisotropic filtering.
    pub sampler_anisotropy: bool,
    /// 64-bit integers in shaders.
    pub shader_int64: bool,
    /// `VK_EXT_conservative_rasterization`.
    pub conservative_rasterization: bool,
    /// That it rasterizes triangles whose area is 0 once they are rounded.
    pub degenerate_triangles: bool,
    /// Atomics in 3D images of 32-bit integers.
    pub image_atomics: bool,
    /// `VK_EXT_conditional_rendering`.
    pub conditional_rendering: bool,
    /// `VK_KHR_ray_query`, with acceleration structures.
    pub ray_query: bool,
    /// Arithmetic and ballot subgroup operations in compute shaders.
    pub subgroup_arithmetic: bool,
    /// Invocations in a subgroup.
    pub subgroup_size: u32,
}

/// One physical device.
#[derive(Clone, Debug)]
pub struct Adapter {
    /// Position in the driver's list.
    pub index: usize,
    /// What the device calls itself.
    pub info: DeviceInfo,
    /// What Lumivox cannot do without.
    pub required: Vec<Check>,
    /// What Lumivox uses where it is there.
    pub optional: Vec<Check>,
    /// The optional features, for programs.
    pub features: Features,
    /// The sizes and counts that it allows at most.
    pub limits: Limits,
    /// How loops of shaders run on it.
    pub loops: Loops,
    pub(super) raw: vk::PhysicalDevice,
    pub(super) queue_family: Option<u32>,
    /// Whether its driver is one over another interface, which leaves out a part of Vulkan that
    /// Lumivox does not use.
    pub(super) is_layered: bool,
    pub(super) memory: vk::PhysicalDeviceMemoryProperties,
}

impl Adapter {
    /// Names of the required features that are missing; empty for a usable device.
    pub fn missing(&self) -> Vec<&'static str> {
        self.required
            .iter()
            .filter(|check| !check.present)
            .map(|check| check.name)
            .collect()
    }

    pub(super) fn new(
        instance: &ash::Instance,
        raw: vk::PhysicalDevice,
        index: usize,
        faults: &Faults,
    ) -> Self {
        // SAFETY: the device belongs to this living instance.
        let (base, memory) = unsafe {
            (
                instance.get_physical_device_properties(raw),
                instance.get_physical_device_memory_properties(raw),
            )
        };
        let (queue_family, timestamp_bits) = queue_family(instance, raw).unzip();
        let mut adapter = Adapter {
            index,
            info: DeviceInfo {
                name: base
                    .device_name_as_c_str()
                    .map(|name| name.to_string_lossy().into_owned())
                    .unwrap_or_default(),
                kind: kind(base.device_type),
                driver: version_text(base.driver_version),
                api_version: version_text(base.api_version),
            },
            required: vec![Check {
                name: "Vulkan 1.3",
                present: base.api_version >= vk::API_VERSION_1_3,
                cost: "no device without it".to_owned(),
            }],
            optional: Vec::new(),
            features: Features::default(),
            limits: Limits {
                timestamp_bits: timestamp_bits.unwrap_or(0),
                ..Limits::new(&base.limits, &memory)
            },
            loops: Loops::WATCHED,
            raw,
            queue_family,
            is_layered: has_extension(instance, raw, vk::KHR_PORTABILITY_SUBSET_NAME),
            memory,
        };
        if base.api_version >= vk::API_VERSION_1_3 {
            adapter.read_properties(instance);
            adapter.read_features(instance);
            adapter.read_formats(instance);
        }
        let needed = NEEDED.iter().map(|needed| Check {
            name: needed.name,
            present: (needed.of)(&base.limits) >= needed.least,
            cost: format!("no device without {}: some pass has as many", needed.least),
        });
        adapter.required.extend(needed);
        adapter.lose(&faults.absent);
        if faults.least_limits {
            adapter.limits.clamp();
        }
        adapter
    }

    /// Uses this family of queues, and of the optional features these alone.
    pub(super) fn work_with(&mut self, queue_family: u32, enabled: &Features) {
        self.queue_family = Some(queue_family);
        let mut enabled = enabled.clone();
        let both = self.features.optional().into_iter().zip(enabled.optional());
        for ((_, present, _), (_, enabled, _)) in both {
            *present &= *enabled;
        }
        self.optional = self.features.checks();
    }

    /// Leaves out what a test wants not to be there.
    fn lose(&mut self, absent: &[String]) {
        let is_absent = |name: &str| absent.iter().any(|absent| absent == name);
        self.required
            .iter_mut()
            .filter(|check| is_absent(check.name))
            .for_each(|check| check.present = false);
        for (name, present, _) in self.features.optional() {
            *present &= !is_absent(name);
        }
        self.optional = self.features.checks();
    }

    fn read_properties(&mut self, instance: &ash::Instance) {
        let mut v11 = vk::PhysicalDeviceVulkan11Properties::default();
        let mut v12 = vk::PhysicalDeviceVulkan12Properties::default();
        let mut v13 = vk::PhysicalDeviceVulkan13Properties::default();
        let mut maintenance3 = vk::PhysicalDeviceMaintenance3Properties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default()
            .push_next(&mut v11)
            .push_next(&mut v12)
            .push_next(&mut v13)
            .push_next(&mut maintenance3);
        // SAFETY: a Vulkan 1.3 device fills all of these.
        unsafe { instance.get_physical_device_properties2(self.raw, &mut properties) };
        let text = |name: Result<&std::ffi::CStr, _>| {
            name.map(|name| name.to_string_lossy().into_owned())
                .unwrap_or_default()
        };
        self.info.driver = format!(
            "{} {}",
            text(v12.driver_name_as_c_str()),
            text(v12.driver_info_as_c_str())
        )
        .trim()
        .to_owned();
        self.loops = Loops::of(v12.driver_id);
        self.limits.allocation_bytes = maintenance3.max_memory_allocation_size;
        let operations = vk::SubgroupFeatureFlags::ARITHMETIC | vk::SubgroupFeatureFlags::BALLOT;
        self.features.subgroup_size = v11.subgroup_size;
        self.features.subgroup_arithmetic = v11.subgroup_supported_operations.contains(operations)
            && v11
                .subgroup_supported_stages
                .contains(vk::ShaderStageFlags::COMPUTE);
    }

    fn read_features(&mut self, instance: &ash::Instance) {
        let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut features = vk::PhysicalDeviceFeatures2::default()
            .push_next(&mut v12)
            .push_next(&mut v13);
        // SAFETY: a Vulkan 1.3 device fills all of these.
        unsafe { instance.get_physical_device_features2(self.raw, &mut features) };
        let base = features.features;
        let cost = "no device without it";
        for (name, present) in [
            ("dynamicRendering", v13.dynamic_rendering == vk::TRUE),
            ("synchronization2", v13.synchronization2 == vk::TRUE),
            ("maintenance4", v13.maintenance4 == vk::TRUE),
            ("hostQueryReset", v12.host_query_reset == vk::TRUE),
            (
                "fragmentStoresAndAtomics",
                base.fragment_stores_and_atomics == vk::TRUE,
            ),
            (
                "shaderStorageImageExtendedFormats",
                base.shader_storage_image_extended_formats == vk::TRUE,
            ),
            (
                "a queue with graphics, compute and timestamps",
                self.queue_family.is_some(),
            ),
        ] {
            self.required.push(Check {
                name,
                present,
                cost: cost.to_owned(),
            });
        }
        let found = &mut self.features;
        found.geometry_shader = base.geometry_shader == vk::TRUE;
        found.full_indices = base.full_draw_index_uint32 == vk::TRUE;
        found.sampler_anisotropy = base.sampler_anisotropy == vk::TRUE;
        found.shader_int64 = base.shader_int64 == vk::TRUE;
        found.conservative_rasterization =
            has_extension(instance, self.raw, vk::EXT_CONSERVATIVE_RASTERIZATION_NAME);
        if found.conservative_rasterization {
            self.read_rasterization(instance);
        }
        let found = &mut self.features;
        found.conditional_rendering =
            has_extension(instance, self.raw, vk::EXT_CONDITIONAL_RENDERING_NAME);
        if v12.buffer_device_address == vk::TRUE {
            self.read_ray_query(instance);
        }
        self.optional = self.features.checks();
    }

    /// As [`Adapter::read_ray_query`], of conservative rasterization.
    fn read_rasterization(&mut self, instance: &ash::Instance) {
        let mut limits = vk::PhysicalDeviceConservativeRasterizationPropertiesEXT::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut limits);
        // SAFETY: the device has the extension.
        unsafe { instance.get_physical_device_properties2(self.raw, &mut properties) };
        self.features.degenerate_triangles = limits.degenerate_triangles_rasterized == vk::TRUE;
    }

    /// Features and properties of extensions may be asked for only where these are.
    fn read_ray_query(&mut self, instance: &ash::Instance) {
        let has = |name: &&CStr| has_extension(instance, self.raw, name);
        if !RAY_QUERY_EXTENSIONS.iter().all(has) {
            return;
        }
        let mut structures = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default();
        let mut queries = vk::PhysicalDeviceRayQueryFeaturesKHR::default();
        let mut features = vk::PhysicalDeviceFeatures2::default()
            .push_next(&mut structures)
            .push_next(&mut queries);
        let mut limits = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut limits);
        // SAFETY: the device has the extensions of these.
        unsafe {
            instance.get_physical_device_features2(self.raw, &mut features);
            instance.get_physical_device_properties2(self.raw, &mut properties);
        }
        self.features.ray_query =
            structures.acceleration_structure == vk::TRUE && queries.ray_query == vk::TRUE;
        self.limits.scratch_alignment = limits
            .min_acceleration_structure_scratch_offset_alignment
            .into();
    }

    fn read_formats(&mut self, instance: &ash::Instance) {
        let storage = vk::FormatFeatureFlags::STORAGE_IMAGE;
        let holds = |format: vk::Format, wanted: vk::FormatFeatureFlags| {
            let usage = vk::ImageUsageFlags::STORAGE | vk::ImageUsageFlags::SAMPLED;
            // SAFETY: plain queries of a living device.
            unsafe {
                let features = instance
                    .get_physical_device_format_properties(self.raw, format)
                    .optimal_tiling_features;
                let (kind, tiling, flags) = (
                    vk::ImageType::TYPE_3D,
                    vk::ImageTiling::OPTIMAL,
                    vk::ImageCreateFlags::empty(),
                );
                features.contains(wanted)
                    && instance
                        .get_physical_device_image_format_properties(
                            self.raw, format, kind, tiling, usage, flags,
                        )
                        .is_ok()
            }
        };
        let filtered = storage | vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR;
        self.required.push(Check {
            name: "rgba16f 3D storage images",
            present: holds(vk::Format::R16G16B16A16_SFLOAT, filtered),
            cost: "no device without it".to_owned(),
        });
        let atomic = storage | vk::FormatFeatureFlags::STORAGE_IMAGE_ATOMIC;
        self.features.image_atomics = holds(vk::Format::R32_UINT, atomic);
        self.optional = self.features.checks();
    }
}

impl Features {
    /// Name of each, whether it is there, and what its absence costs.
    fn optional(&mut self) -> [(&'static str, &mut bool, &'static str); 10] {
        [
            (
                "geometryShader",
                &mut self.geometry_shader,
                "no raster voxelization; the compute voxelization is used",
            ),
            (
                "VK_EXT_conservative_rasterization",
                &mut self.conservative_rasterization,
                "no raster-hw voxelization; triangles are enlarged in a geometry shader",
            ),
            (
                "degenerateTrianglesRasterized",
                &mut self.degenerate_triangles,
                "raster-hw leaves out triangles that have no area once they are rounded",
            ),
            (
                IMAGE_ATOMICS,
                &mut self.image_atomics,
                "no accumulation=running-average",
            ),
            (
                "VK_EXT_conditional_rendering",
                &mut self.conditional_rendering,
                "no pass is left out on the device's own word; bounces go on to the last",
            ),
            (
                RAY_QUERY,
                &mut self.ray_query,
                "rays go through hierarchies in compute shaders",
            ),
            (
                "fullDrawIndexUint32",
                &mut self.full_indices,
                "no scenes of more than some 16 million triangles",
            ),
            (
                "samplerAnisotropy",
                &mut self.sampler_anisotropy,
                "material textures are filtered trilinearly only",
            ),
            (
                "shaderInt64",
                &mut self.shader_int64,
                "no 64-bit integers in shaders; 32-bit pairs are used",
            ),
            (
                "subgroup arithmetic in compute shaders",
                &mut self.subgroup_arithmetic,
                "reductions go through shared memory",
            ),
        ]
    }

    fn checks(&mut self) -> Vec<Check> {
        self.optional()
            .map(|(name, present, cost)| Check {
                name,
                present: *present,
                cost: cost.to_owned(),
            })
            .to_vec()
    }
}

fn kind(kind: vk::PhysicalDeviceType) -> DeviceKind {
    match kind {
        vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
        vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
        vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
        vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
        _ => DeviceKind::Other,
    }
}

/// The family of queues that do all work, and how many bits of its timestamps count.
fn queue_family(instance: &ash::Instance, raw: vk::PhysicalDevice) -> Option<(u32, u32)> {
    // SAFETY: the device belongs to this living instance.
    let families = unsafe { instance.get_physical_device_queue_family_properties(raw) };
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    let index = families.iter().position(|family| {
        family.queue_flags.contains(wanted) && family.timestamp_valid_bits > 0
    })?;
    let bits = families[index].timestamp_valid_bits;
    Some((u32::try_from(index).ok()?, bits))
}

fn has_extension(instance: &ash::Instance, raw: vk::PhysicalDevice, name: &std::ffi::CStr) -> bool {
    // SAFETY: the device belongs to this living instance.
    let extensions =
        unsafe { instance.enumerate_device_extension_properties(raw) }.unwrap_or_default();
    extensions
        .iter()
        .any(|extension| extension.extension_name_as_c_str() == Ok(name))
}

/// `major.minor.patch`.
pub(super) fn version_text(version: u32) -> String {
    format!(
        "{}.{}.{}",
        vk::api_version_major(version),
        vk::api_version_minor(version),
        vk::api_version_patch(version)
    )
}
