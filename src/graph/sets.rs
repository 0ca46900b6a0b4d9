//! The descriptor sets that all passes share: set 0, frame and scene; set 2, one material.

use std::sync::Arc;

use ash::vk;

use super::Access;
use super::pass::{Pass, SCENE_CONSTANTS};
use crate::vulkan::{
    Buffer, Descriptor, DescriptorPool, Device, Error, Image, Loops, Sampler, SamplerDesc,
    SetLayout,
};

/// The buffers of set 0.
#[derive(Clone)]
pub struct SceneBindings {
    /// Binding 0: frame constants, a uniform buffer.
    pub frame_uniform: Arc<Buffer>,
    /// Binding 4: the positions of vertices (m), three numbers each.
    pub positions: Arc<Buffer>,
    /// Binding 5: their unit shading normals, three numbers each.
    pub normals: Arc<Buffer>,
    /// Binding 6: their texture coordinates, two numbers each.
    pub uvs: Arc<Buffer>,
    /// Binding 7: the vertices of triangles, three each.
    pub triangle_vertices: Arc<Buffer>,
    /// Binding 8: the materials of triangles, one each.
    pub triangle_materials: Arc<Buffer>,
    /// Binding 9: the materials.
    pub materials: Arc<Buffer>,
    /// Binding 10: the lights.
    pub lights: Arc<Buffer>,
    /// Binding 11: the environment by direction, an image that is only read from now on; one texel
    /// where it is the same from everywhere, and then `SKY` of [`super::SCENE_CONSTANTS`] is false.
    pub sky: Arc<Image>,
    /// Binding 12: shadows of what is clear, a row a texel; any buffer where no light has them.
    pub clear_shadows: Arc<Buffer>,
    /// Whether lights have shadows of what is clear.
    pub has_clear_shadows: bool,
    /// Whether a light has cascades.
    pub has_cascades: bool,
    /// Whether a material has a texture.
    pub has_textures: bool,
    /// Whether a material has a texture of its specular lobe.
    pub has_lobe_textures: bool,
}

/// Set 0: frame constants (0), samplers (1 linear clamp, 2 nearest clamp, 3 linear repeat),
/// positions (4), normals (5) and texture coordinates (6) of vertices, vertices (7) and materials
/// (8) of triangles, materials (9), lights (10), the environment by direction (11), shadows of what
/// is clear (12).
pub struct SceneSet {
    pub(super) raw: vk::DescriptorSet,
    /// The storage buffers.
    storage: [Arc<Buffer>; 8],
    /// Values of [`super::SCENE_CONSTANTS`].
    pub(super) has: [bool; SCENE_CONSTANTS.len()],
    /// The frame constants.
    frame_uniform: Arc<Buffer>,
    loops: Loops,
    _sky: Arc<Image>,
    _shared: Arc<SharedSets>,
    _pool: DescriptorPool,
}

/// How many textures a material has.
pub const MATERIAL_TEXTURES: usize = 5;

/// Set 2: the textures of one material: albedo (0), emission (1), normal (2), mask (3), lobe (4).
pub struct MaterialSet {
    pub(super) raw: vk::DescriptorSet,
    pub(super) images: [Arc<Image>; MATERIAL_TEXTURES],
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
        let scene = SetLayout::new(
            device,
            "scene",
            &[
                &[T::UNIFORM_BUFFER][..],
                &[T::SAMPLER; 3],
                &[T::STORAGE_BUFFER; 7],
                &[T::SAMPLED_IMAGE],
                &[T::STORAGE_BUFFER],
            ]
            .concat(),
        )?;
        let material = SetLayout::new(device, "material", &[T::SAMPLED_IMAGE; MATERIAL_TEXTURES])?;
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
        bindings: &SceneBindings,
    ) -> Result<Arc<Self>, Error> {
        let storage = [
            &bindings.positions,
            &bindings.normals,
            &bindings.uvs,
            &bindings.triangle_vertices,
            &bindings.triangle_materials,
            &bindings.materials,
            &bindings.lights,
            &bindings.clear_shadows,
        ]
        .map(Arc::clone);
        let mut descriptors = vec![Descriptor::Buffer(bindings.frame_uniform.raw())];
        descriptors.extend(
            shared
                .samplers
                .iter()
                .map(|sampler| Descriptor::Sampler(sampler.raw())),
        );
        let [buffers @ .., clear_shadows] = &storage;
        descriptors.extend(
            buffers
                .iter()
                .map(|buffer| Descriptor::Buffer(buffer.raw())),
        );
        let sky = &bindings.sky;
        descriptors.push(Descriptor::Image(
            sky.view(0..sky.mips())?,
            vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
        ));
        descriptors.push(Descriptor::Buffer(clear_shadows.raw()));
        sky.freeze();
        let pool = DescriptorPool::new(device, [&*shared.scene])?;
        let raw = pool.set("scene", &shared.scene, &descriptors)?;
        Ok(Arc::new(SceneSet {
            raw,
            storage,
            has: [
                sky.extent(0) != [1; 3],
                bindings.has_cascades,
                bindings.has_textures,
                bindings.has_lobe_textures,
                bindings.has_clear_shadows,
            ],
            frame_uniform: Arc::clone(&bindings.frame_uniform),
            loops: device.adapter().loops,
            _sky: Arc::clone(sky),
            _shared: Arc::clone(shared),
            _pool: pool,
        }))
    }

    /// How loops run on its device.
    pub fn loops(&self) -> Loops {
        self.loops
    }

    /// The buffers that a pass reads which uses the set, and how.
    pub(super) fn read_by(&self, pass: &Pass) -> impl Iterator<Item = (&Arc<Buffer>, Access)> {
        let [storage, uniform] = if pass.is_compute() {
            [Access::ComputeRead, Access::ComputeUniform]
        } else {
            [Access::RasterRead, Access::RasterUniform]
        };
        let stored = self.storage.iter().map(move |buffer| (buffer, storage));
        stored.chain([(&self.frame_uniform, uniform)])
    }
}

impl MaterialSet {
    pub(super) fn new(
        device: &Arc<Device>,
        shared: &SharedSets,
        images: [&Arc<Image>; MATERIAL_TEXTURES],
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
