//! Shader modules, compiled by `tools/shaders` and embedded, and the structs that Rust and GLSL
//! share.

mod interface;
mod layout;
mod modules;

pub use interface::Interface;
pub use layout::{Field, GpuStruct, StructLayout};

use crate::vulkan::Error;

/// The SPIR-V words of a module by its stem, for example `gi/shared/voxel/fragments.comp`. In debug
/// builds, a module in the folder that `LUMIVOX_SPIRV` names stands in for the embedded one:
/// `tools/mutants` changes shaders without a build.
pub fn words(stem: &str) -> Result<Vec<u32>, Error> {
    if cfg!(debug_assertions)
        && let Some(folder) = std::env::var_os("LUMIVOX_SPIRV")
        && let Ok(bytes) = std::fs::read(std::path::Path::new(&folder).join(format!("{stem}.spv")))
    {
        return Ok(words_of(&bytes));
    }
    let index = modules::MODULES
        .binary_search_by(|(name, _)| (*name).cmp(stem))
        .map_err(|_| Error::ModuleMissing(stem.to_owned()))?;
    let (_, bytes) = modules::MODULES[index];
    Ok(words_of(bytes))
}

/// The files are little-endian.
fn words_of(bytes: &[u8]) -> Vec<u32> {
    bytes
        .as_chunks()
        .0
        .iter()
        .map(|word| u32::from_le_bytes(*word))
        .collect()
}

/// A module whose two-dimensional RGBA32F storage images are RGBA16F: what shaders read and write
/// stays the same.
pub fn with_half_images(mut words: Vec<u32>) -> Vec<u32> {
    let mut at = 5;
    while let Some(&first) = words.get(at) {
        let length = ((first >> 16) as usize).max(1);
        if first & 0xffff == interface::TYPE_IMAGE
            && let Some([_, _, kind @ ..]) = words.get_mut(at..at + length)
            && interface::is_full_image(kind)
            && let Some(format) = kind.last_mut()
        {
            *format = interface::RGBA16F;
        }
        at += length;
    }
    words
}

/// The stems of all embedded modules, sorted.
pub fn stems() -> impl Iterator<Item = &'static str> {
    modules::MODULES.iter().map(|(name, _)| *name)
}
