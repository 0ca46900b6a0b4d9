//! Acceleration structures, through which the device traces rays itself.

use std::sync::Arc;

use ash::vk;

use super::{Buffer, BufferDesc, BufferUsage, Context, Device, Error, Owner};

/// The name of the feature in `lumivox devices`.
pub(crate) const RAY_QUERY: &str = "VK_KHR_ray_query";

/// 32-bit words of an instance.
pub(crate) const INSTANCE_WORDS: usize = 16;

/// What an acceleration structure is made of.
pub enum StructureKind {
    /// Triangles of nine coordinates each (m).
    Triangles {
        /// How many there are.
        count: u32,
        /// Whether they may move later.
        moves: bool,
    },
    /// Others, each where it is.
    Parts(Vec<Arc<AccelerationStructure>>),
}

/// An acceleration structure to make.
pub struct StructureDesc {
    /// Name for reports, errors and debuggers.
    pub name: String,
    /// What it is made of.
    pub kind: StructureKind,
    /// What it is counted for.
    pub owner: Owner,
}

/// An acceleration structure and its memory; freed when the last owner drops it. It can be traced
/// once it was built.
pub struct AccelerationStructure {
    raw: vk::AccelerationStructureKHR,
    buffer: Arc<Buffer>,
    kind: StructureKind,
    /// Of a build, and of one that only follows triangles that have moved (bytes).
    scratch_bytes: [u64; 2],
    device: Arc<Device>,
}

impl AccelerationStructure {
    /// Makes one that is not built yet.
    pub fn new(device: &Arc<Device>, desc: StructureDesc) -> Result<Arc<Self>, Error> {
        let Some(functions) = device.structures() else {
            return Err(Error::FeatureMissing {
                what: desc.name,
                feature: RAY_QUERY,
            });
        };
        let geometries = [desc.kind.geometry(0)];
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        // SAFETY: the device is alive and has the feature.
        unsafe {
            functions.get_acceleration_structure_build_sizes(
                vk::AccelerationStructureBuildTypeKHR::DEVICE,
                &desc.kind.build(&geometries),
                &[desc.kind.count()],
                &mut sizes,
            );
        }
        let buffer = Buffer::new(
            device,
            &BufferDesc {
                name: desc.name.clone(),
                size_bytes: sizes.acceleration_structure_size,
                usage: BufferUsage::Structure,
                owner: desc.owner,
            },
        )?;
        let info = vk::AccelerationStructureCreateInfoKHR::default()
            .buffer(buffer.raw())
            .size(sizes.acceleration_structure_size)
            .ty(desc.kind.level());
        // SAFETY: the buffer is alive, made for this and large enough.
        let raw = unsafe { functions.create_acceleration_structure(&info, None) }.during(
            &format!("creating the acceleration structure {}", desc.name),
        )?;
        device.set_name(raw, &desc.name);
        Ok(Arc::new(AccelerationStructure {
            raw,
            buffer,
            kind: desc.kind,
            scratch_bytes: [sizes.build_scratch_size, sizes.update_scratch_size],
            device: Arc::clone(device),
        }))
    }

    /// Name for reports, errors and debuggers.
    pub fn name(&self) -> &str {
        self.buffer.name()
    }

    /// Those that it is made of.
    pub(crate) fn parts(&self) -> &[Arc<AccelerationStructure>] {
        match &self.kind {
            StructureKind::Parts(parts) => parts,
            StructureKind::Triangles { .. } => &[],
        }
    }

    pub(crate) fn raw(&self) -> vk::AccelerationStructureKHR {
        self.raw
    }

    /// The memory that it lies in, by which it is known to the barriers.
    pub(crate) fn buffer(&self) -> &Arc<Buffer> {
        &self.buffer
    }

    /// Memory that its build needs besides (bytes); `follows`: one that only follows triangles.
    pub(crate) fn scratch_bytes(&self, follows: bool) -> u64 {
        let alignment = self.device.adapter().limits.scratch_alignment;
        self.scratch_bytes[usize::from(follows)] + alignment
    }

    /// The rows from which a structure of these parts is built: each at its place, seen by all
    /// rays.
    pub(crate) fn instances(&self) -> Vec<[u32; INSTANCE_WORDS]> {
        let row = |part: &Arc<AccelerationStructure>| {
            let one = 1f32.to_bits();
            let address = part.address();
            let mut row = [0; INSTANCE_WORDS];
            (row[0], row[5], row[10]) = (one, one, one);
            row[12] = 0xff << 24;
            (row[14], row[15]) = (address as u32, (address >> 32) as u32);
            row
        };
        self.parts().iter().map(row).collect()
    }

    /// Records a build from what is in `input`. With `follows`, of triangles that were built
    /// before and have moved.
    pub(super) fn record_build(
        &self,
        commands: vk::CommandBuffer,
        (input, scratch): (&Buffer, &Buffer),
        follows: bool,
    ) {
        let Some(functions) = self.device.structures() else {
            return;
        };
        let alignment = self.device.adapter().limits.scratch_alignment.max(1);
        let scratch_address = scratch.address().next_multiple_of(alignment);
        let geometries = [self.kind.geometry(input.address())];
        let mut info = self
            .kind
            .build(&geometries)
            .dst_acceleration_structure(self.raw)
            .scratch_data(vk::DeviceOrHostAddressKHR {
                device_address: scratch_address,
            });
        if follows {
            info = info
                .mode(vk::BuildAccelerationStructureModeKHR::UPDATE)
                .src_acceleration_structure(self.raw);
        }
        let range = [vk::AccelerationStructureBuildRangeInfoKHR::default()
            .primitive_count(self.kind.count())];
        // SAFETY: the command buffer is begun; input and scratch are as large as asked for, and the
        // graph keeps them alive until the build is done.
        unsafe { functions.cmd_build_acceleration_structures(commands, &[info], &[&range]) };
    }

    fn address(&self) -> u64 {
        let info = vk::AccelerationStructureDeviceAddressInfoKHR::default()
            .acceleration_structure(self.raw);
        // SAFETY: the structure is alive.
        self.device.structures().map_or(0, |functions| unsafe {
            functions.get_acceleration_structure_device_address(&info)
        })
    }
}

impl StructureKind {
    fn count(&self) -> u32 {
        match self {
            StructureKind::Triangles { count, .. } => *count,
            StructureKind::Parts(parts) => parts.len() as u32,
        }
    }

    fn level(&self) -> vk::AccelerationStructureTypeKHR {
        match self {
            StructureKind::Triangles { .. } => vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL,
            StructureKind::Parts(_) => vk::AccelerationStructureTypeKHR::TOP_LEVEL,
        }
    }

    /// What is at an address.
    fn geometry(&self, address: u64) -> vk::AccelerationStructureGeometryKHR<'static> {
        let data = vk::DeviceOrHostAddressConstKHR {
            device_address: address,
        };
        match self {
            StructureKind::Triangles { count, .. } => {
                let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
                    .vertex_format(vk::Format::R32G32B32_SFLOAT)
                    .vertex_data(data)
                    .vertex_stride(12)
                    .max_vertex((3 * count).saturating_sub(1))
                    .index_type(vk::IndexType::NONE_KHR);
                vk::AccelerationStructureGeometryKHR::default()
                    .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
                    .geometry(vk::AccelerationStructureGeometryDataKHR { triangles })
            }
            StructureKind::Parts(_) => {
                let instances =
                    vk::AccelerationStructureGeometryInstancesDataKHR::default().data(data);
                vk::AccelerationStructureGeometryKHR::default()
                    .geometry_type(vk::GeometryTypeKHR::INSTANCES)
                    .geometry(vk::AccelerationStructureGeometryDataKHR { instances })
            }
        }
    }

    /// How it is built: for fast rays, since many are traced.
    fn build<'g>(
        &self,
        geometries: &'g [vk::AccelerationStructureGeometryKHR<'g>],
    ) -> vk::AccelerationStructureBuildGeometryInfoKHR<'g> {
        use vk::BuildAccelerationStructureFlagsKHR as Flags;
        let flags = match self {
            StructureKind::Triangles { moves: true, .. } => {
                Flags::PREFER_FAST_TRACE | Flags::ALLOW_UPDATE
            }
            _ => Flags::PREFER_FAST_TRACE,
        };
        vk::AccelerationStructureBuildGeometryInfoKHR::default()
            .ty(self.level())
            .flags(flags)
            .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
            .geometries(geometries)
    }
}

impl Drop for AccelerationStructure {
    fn drop(&mut self) {
        if let Some(functions) = self.device.structures() {
            // SAFETY: frames own what they use and are waited for, so the device no longer uses
            // the structure.
            unsafe { functions.destroy_acceleration_structure(self.raw, None) };
        }
    }
}
