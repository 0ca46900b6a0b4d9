//! Samplers, descriptor set layouts, pools and writes.

use std::sync::Arc;

use ash::vk;

use super::{Context, Device, Error};

/// A sampler to make.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SamplerDesc {
    pub(crate) name: &'static str,
    pub(crate) linear: bool,
    pub(crate) repeat: bool,
}

/// A Vulkan sampler that destroys itself.
pub(crate) struct Sampler {
    raw: vk::Sampler,
    device: Arc<Device>,
}

impl Sampler {
    pub(crate) fn new(device: &Arc<Device>, desc: SamplerDesc) -> Result<Self, Error> {
        let (filter, mip_mode) = if desc.linear {
            (vk::Filter::LINEAR, vk::SamplerMipmapMode::LINEAR)
        } else {
            (vk::Filter::NEAREST, vk::SamplerMipmapMode::NEAREST)
        };
        let address = if desc.repeat {
            vk::SamplerAddressMode::REPEAT
        } else {
            vk::SamplerAddressMode::CLAMP_TO_EDGE
        };
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(filter)
            .min_filter(filter)
            .mipmap_mode(mip_mode)
            .address_mode_u(address)
            .address_mode_v(address)
            .address_mode_w(address)
            .max_lod(vk::LOD_CLAMP_NONE);
        // SAFETY: the device is alive.
        let raw =
            unsafe { device.raw().create_sampler(&info, None) }.during("creating a sampler")?;
        device.set_name(raw, desc.name);
        Ok(Sampler {
            raw,
            device: Arc::clone(device),
        })
    }

    pub(crate) fn raw(&self) -> vk::Sampler {
        self.raw
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        // SAFETY: every submission that used it was waited for.
        unsafe { self.device.raw().destroy_sampler(self.raw, None) };
    }
}

/// The layout of one descriptor set: bindings 0, 1, 2, … with one descriptor each, visible to all
/// stages.
pub(crate) struct SetLayout {
    raw: vk::DescriptorSetLayout,
    kinds: Vec<vk::DescriptorType>,
    device: Arc<Device>,
}

impl SetLayout {
    pub(crate) fn new(
        device: &Arc<Device>,
        name: &str,
        kinds: &[vk::DescriptorType],
    ) -> Result<Arc<Self>, Error> {
        let bindings: Vec<_> = (0u32..)
            .zip(kinds)
            .map(|(binding, &kind)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(kind)
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::ALL)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the device is alive.
        let raw = unsafe { device.raw().create_descriptor_set_layout(&info, None) }
            .during(&format!("creating the set layout {name}"))?;
        device.set_name(raw, name);
        Ok(Arc::new(SetLayout {
            raw,
            kinds: kinds.to_vec(),
            device: Arc::clone(device),
        }))
    }

    pub(crate) fn raw(&self) -> vk::DescriptorSetLayout {
        self.raw
    }
}

impl Drop for SetLayout {
    fn drop(&mut self) {
        // SAFETY: layouts may go before the sets and pipelines made from them.
        unsafe {
            self.device
                .raw()
                .destroy_descriptor_set_layout(self.raw, None)
        };
    }
}

/// What one binding of a set is to show.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Descriptor {
    /// The whole of a buffer.
    Buffer(vk::Buffer),
    /// A view of an image, in the layout that it will have.
    Image(vk::ImageView, vk::ImageLayout),
    /// A sampler without an image.
    Sampler(vk::Sampler),
    /// An acceleration structure.
    Structure(vk::AccelerationStructureKHR),
}

/// A pool of exactly the sets asked for.
pub(crate) struct DescriptorPool {
    raw: vk::DescriptorPool,
    device: Arc<Device>,
}

impl DescriptorPool {
    /// A pool with room for one set of each layout.
    pub(crate) fn new<'l>(
        device: &Arc<Device>,
        layouts: impl IntoIterator<Item = &'l SetLayout>,
    ) -> Result<Self, Error> {
        let mut sizes: Vec<vk::DescriptorPoolSize> = Vec::new();
        let mut sets = 0;
        for layout in layouts {
            sets += 1;
            for &kind in &layout.kinds {
                match sizes.iter_mut().find(|size| size.ty == kind) {
                    Some(size) => size.descriptor_count += 1,
                    None => sizes.push(vk::DescriptorPoolSize {
                        ty: kind,
                        descriptor_count: 1,
                    }),
                }
            }
        }
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(sets.max(1))
            .pool_sizes(&sizes);
        // SAFETY: the device is alive.
        let raw = unsafe { device.raw().create_descriptor_pool(&info, None) }
            .during("creating a descriptor pool")?;
        Ok(DescriptorPool {
            raw,
            device: Arc::clone(device),
        })
    }

    /// Makes and fills one set; it lives as long as the pool.
    pub(crate) fn set(
        &self,
        name: &str,
        layout: &SetLayout,
        descriptors: &[Descriptor],
    ) -> Result<vk::DescriptorSet, Error> {
        assert_eq!(
            layout.kinds.len(),
            descriptors.len(),
            "{name}: one descriptor for each binding"
        );
        let layouts = [layout.raw];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.raw)
            .set_layouts(&layouts);
        // SAFETY: pool and layout are alive.
        let sets = unsafe { self.device.raw().allocate_descriptor_sets(&info) }
            .during(&format!("allocating the descriptor set {name}"))?;
        let set = sets.first().copied().unwrap_or_default();
        // Sets are made anew with every frame, and Mesa (22.3) never frees the names of those that
        // end with their pool.
        if self.device.instance().is_validated() {
            self.device.set_name(set, name);
        }
        for ((binding, &kind), &descriptor) in (0u32..).zip(&layout.kinds).zip(descriptors) {
            self.write(set, binding, kind, descriptor);
        }
        Ok(set)
    }

    fn write(
        &self,
        set: vk::DescriptorSet,
        binding: u32,
        kind: vk::DescriptorType,
        descriptor: Descriptor,
    ) {
        let (mut buffers, mut images, mut structures) = (Vec::new(), Vec::new(), Vec::new());
        match descriptor {
            Descriptor::Structure(structure) => structures.push(structure),
            Descriptor::Buffer(buffer) => buffers.push(vk::DescriptorBufferInfo {
                buffer,
                offset: 0,
                range: vk::WHOLE_SIZE,
            }),
            Descriptor::Image(image_view, image_layout) => images.push(vk::DescriptorImageInfo {
                image_view,
                image_layout,
                ..Default::default()
            }),
            Descriptor::Sampler(sampler) => images.push(vk::DescriptorImageInfo {
                sampler,
                ..Default::default()
            }),
        }
        let mut write_structures = vk::WriteDescriptorSetAccelerationStructureKHR::default()
            .acceleration_structures(&structures);
        let write = vk::WriteDescriptorSet::default()
            .dst_set(set)
            .dst_binding(binding)
            .descriptor_type(kind);
        let write = if !structures.is_empty() {
            write.descriptor_count(1).push_next(&mut write_structures)
        } else if buffers.is_empty() {
            write.image_info(&images)
        } else {
            write.buffer_info(&buffers)
        };
        // SAFETY: the set is fresh, and what it shows is alive; the owner of the set keeps it so.
        unsafe { self.device.raw().update_descriptor_sets(&[write], &[]) };
    }
}

impl Drop for DescriptorPool {
    fn drop(&mut self) {
        // SAFETY: every submission that used its sets was waited for.
        unsafe { self.device.raw().destroy_descriptor_pool(self.raw, None) };
    }
}
