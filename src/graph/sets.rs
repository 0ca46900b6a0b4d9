//! The descriptor sets that all passes share: set 0, frame and scene; set 2, one material.

use std::sync::Arc;

use ash::vk;

use crate::vulkan::{
    Buffer, Descriptor, DescriptorPool, Device, Error, Image, Sampler, SamplerDesc, SetLayout,
};

/// The buffers of set 0.
#[derive(Clone, Copy)]
pub struct SceneBindings<'b> {
    /// Binding 0: frame constants, a uniform buffer.
    pub frame_uniform: &'b Arc<Buffer>,
    /// Binding 4: the vertices of all triangles.
    pub vertices: &'b Arc<Buffer>,
    /// Binding 5: the triangles.
    pub triangles: &'b Arc<Buffer>,
    /// Binding 6: the materials.
    pub materials: &'b Arc<Buffer>,
    /// Binding 7: the lights.
    pub lights: &'b Arc<Buffer>,
}

/// Set 0: frame constants (0), samplers (1 linear clamp, 2 nearest clamp, 3 linear repeat),
/// vertices (4), triangles (5), materials (6), lights (7).
pub struct SceneSet {
    pub(super) raw: vk::DescriptorSet,
    /// The storage buffers; every pass that uses the set reads them.
    pub(super) storage: [Arc<Buffer>; 4],
    _frame_uniform: Arc<Buffer>,
    _shared: Arc<SharedSets>,
    _pool: DescriptorPool,
}

/// Set 2: the textures of one material: albedo (0), emission (1), normal (2), mask (3).
pub struct MaterialSet {
    pub(super) raw: vk::DescriptorSet,
    pub(super) images: [Arc<Image>; 4],
    _pool: DescriptorPool,
}

/// The material sets of a scene, in its order.
pub type MaterialSets = Arc<[Arc<MaterialSet>]>;

/// Layouts of the shared sets, and the samplers of set 0.
pub(super) struct SharedSets {
    pub(super) scene: Arc<SetLayout>,
    pub(super) material: Arc<SetLayout>,
    samplers: [Sampler; 3],
}

impl SharedSets {
    pub(super) fn new(device: &Arc<Device>) -> Result<Arc<Self>, Error> {
        use vk::DescriptorType as T;
        let storage = T::STORAGE_BUFFER;
        let scene = SetLayout::new(
            device,
            "scene",
            &[
                T::UNIFORM_BUFFER,
                T::SAMPLER,
                T::SAMPLER,
                T::SAMPLER,
                storage,
                storage,
                storage,
                storage,
            ],
        )?;
        let material = SetLayout::new(device, "material", &[T::SAMPLED_IMAGE; 4])?;
        let samplers = [
            Sampler::new(
                device,
                SamplerDesc {
                    name: "linear_clamp",
                    linear: true,
                    repeat: false,
                },
            )?,
            Sampler::new(
                device,
                SamplerDesc {
                    name: "nearest_clamp",
                    linear: false,
                    repeat: false,
                },
            )?,
            Sampler::new(
                device,
                SamplerDesc {
                    name: "linear_repeat",
                    linear: true,
                    repeat: true,
                },
            )?,
        ];
        Ok(Arc::new(SharedSets {
            scene,
            material,
            samplers,
        }))
    }
}

impl SceneSet {
    pub(super) fn new(
        device: &Arc<Device>,
        shared: &Arc<SharedSets>,
        bindings: &SceneBindings<'_>,
    ) -> Result<Arc<Self>, Error> {
        let storage = [
            bindings.vertices,
            bindings.triangles,
            bindings.materials,
            bindings.lights,
        ]
        .map(Arc::clone);
        let mut descriptors = vec![Descriptor::Buffer(bindings.frame_uniform.raw())];
        descriptors.extend(
            shared
                .samplers
                .iter()
                .map(|sampler| Descriptor::Sampler(sampler.raw())),
        );
        descriptors.extend(
            storage
                .iter()
                .map(|buffer| Descriptor::Buffer(buffer.raw())),
        );
        let pool = DescriptorPool::new(device, [&*shared.scene])?;
        let raw = pool.set("scene", &shared.scene, &descriptors)?;
        Ok(Arc::new(SceneSet {
            raw,
            storage,
            _frame_uniform: Arc::clone(bindings.frame_uniform),
            _shared: Arc::clone(shared),
            _pool: pool,
        }))
    }
}

impl MaterialSet {
    pub(super) fn new(
        device: &Arc<Device>,
        shared: &SharedSets,
        images: [&Arc<Image>; 4],
    ) -> Result<Arc<Self>, Error> {
        let pool = DescriptorPool::new(device, [&*shared.material])?;
        let mut descriptors = Vec::with_capacity(images.len());
        for image in images {
            descriptors.push(Descriptor::Image(
                image.view(0..image.mips())?,
                vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
            ));
            image.freeze();
        }
        let raw = pool.set("material", &shared.material, &descriptors)?;
        Ok(Arc::new(MaterialSet {
            raw,
            images: images.map(Arc::clone),
            _pool: pool,
        }))
    }
}
