//! All textures of a scene as one image, which a shader reads at any material's.

use std::sync::Arc;

use super::super::gpu_scene::{GpuScene, storage};
use crate::graph::{
    Buffer, Error, Gpu, Image, ImageDesc, ImageKind, ImageUsage, MATERIAL_TEXTURES, Owner, vk,
};

/// Width and largest height of a layer (texels).
const LAYER: usize = 4096;

/// Where the textures of a material are.
pub(super) struct SceneTextures {
    /// [`MATERIAL_TEXTURES`] of each material: first texel; width and height, 16 bits each.
    pub(super) rows: Arc<Buffer>,
    /// RGBA8 texels one behind the other, as whole numbers: rows of [`LAYER`].
    pub(super) texels: Arc<Image>,
}

impl SceneTextures {
    /// The finest level of all textures.
    pub(super) fn new(gpu: &Gpu, scene: &GpuScene) -> Result<Self, Error> {
        let mut texels: Vec<u8> = Vec::new();
        let mut places = Vec::with_capacity(scene.textures.len());
        for texture in &scene.textures {
            let [width, height, _] = texture.extent(0);
            if width.max(height) > 0xffff {
                return Err(Error::ImageTooLarge {
                    resource: texture.name().to_owned(),
                    wanted: format!("{width}×{height} texels"),
                    available: "65535 texels in a texture that rays see".to_owned(),
                });
            }
            let first = u32::try_from(texels.len() / 4).map_err(|_| Error::ImageTooLarge {
                resource: texture.name().to_owned(),
                wanted: format!("{} texels before it", texels.len() / 4),
                available: format!("{} texels of all textures that rays see", u32::MAX),
            })?;
            places.push([first, width | height << 16]);
            texels.extend(gpu.read_texture(texture)?);
        }
        let row = |index: &Option<u32>| index.map_or([0; 2], |index| places[index as usize]);
        let rows: Vec<[[u32; 2]; MATERIAL_TEXTURES]> = scene
            .material_textures
            .iter()
            .map(|textures| textures.each_ref().map(row))
            .collect();
        Ok(SceneTextures {
            rows: storage(
                gpu,
                ("bvh.texture_rows", Owner::Store),
                bytemuck::cast_slice(&rows),
            )?,
            texels: packed(gpu, texels)?,
        })
    }
}

fn packed(gpu: &Gpu, mut texels: Vec<u8>) -> Result<Arc<Image>, Error> {
    let height = (texels.len() / 4).div_ceil(LAYER).clamp(1, LAYER);
    let width = if texels.is_empty() { 1 } else { LAYER };
    let layer_bytes = 4 * width * height;
    let layers = texels.len().div_ceil(layer_bytes).max(1);
    texels.resize(layers * layer_bytes, 0);
    let image = gpu.create_image(&ImageDesc {
        name: "bvh.texels".into(),
        extent: [width as u32, height as u32, 1],
        kind: ImageKind::D2Array,
        format: vk::Format::R32_UINT,
        mips: 1,
        layers: layers as u32,
        usage: ImageUsage::SAMPLED,
        owner: Owner::Store,
    })?;
    for (layer, bytes) in texels.chunks_exact(layer_bytes).enumerate() {
        gpu.upload_image(&image, 0, layer as u32, bytes)?;
    }
    Ok(image)
}
